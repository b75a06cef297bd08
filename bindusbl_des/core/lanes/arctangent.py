"""The angles of four slender triangles at once, to the bits of the mathematical library.

Of an angle below 1/16 rad it takes a polynomial of the quotient, to which it adds what the division
has rounded off.  Larger ones are looked up in a table: it is called for them, lane by lane.
Source: glibc 2.34 and later, sysdeps/ieee754/dbl-64/e_atan2.c (IBM's Accurate Mathematical
Library), as it runs on processors that multiply and add in one operation; errors are below 0.504 of
the last place.
"""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call, untyped-decorator"

import math
from collections.abc import Callable
from math import copysign
from typing import Any

from numba.extending import overload

from ..compiling.compiler import TARGET
from .numbers import all_at_least, fma, if_positive, lanes

SLENDER = 16.5  # times as long as wide, or more: below 1/16 rad however the quotient is rounded

C3, C5, C7, C9, C11, C13 = map(
    float.fromhex,
    ("-0x1.5555555555555p-2", "0x1.99999999997fdp-3", "-0x1.24924923f7603p-3",
     "0x1.c71c6e5129a3bp-4", "-0x1.7458022b13c25p-4", "0x1.375f08b31cbcep-4"),
)  # fmt: skip


def _of_lanes(aside: float, ahead: float) -> float:
    width = abs(aside)
    if not all_at_least(min(ahead - SLENDER * width, copysign(1.0, ahead)), 0.0):
        return math.atan2(aside, ahead)
    ratio = width / ahead
    whole = ahead * ratio
    rest = ((width - whole) - fma(ahead, ratio, -whole)) / ahead
    square = ratio * ratio
    series = fma(fma(fma(C13, square, C11), square, C9), square, C7)
    series = fma(fma(series, square, C5), square, C3)
    angle = ratio + fma(ratio * square, series, rest)
    return copysign(if_positive(width, angle, 0.0), aside)  # of a point at the origin, too


def atan2(aside: float, ahead: float) -> float:
    """Return the angle (rad) of a place so far ahead and aside; of lanes, 0 or from 1e-280 on."""
    return math.atan2(aside, ahead)


@overload(atan2, target=TARGET, strict=False, jit_options={"forceinline": True})
def _atan2(aside: Any, ahead: Any) -> Callable[[float, float], float]:
    return _of_lanes if lanes in (aside, ahead) else lambda aside, ahead: math.atan2(aside, ahead)
