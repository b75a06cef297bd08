"""The exponential of four numbers at once, to the bits of the mathematical library.

e^x = 2^(k / 128) e^r with k the whole number nearest to 128 x / ln 2: a table has the powers of two
between 1 and 2, further ones are added to the exponent, and a short polynomial does for r, at most
ln 2 / 256.  Source: glibc 2.28 and later, sysdeps/ieee754/dbl-64/e_exp.c, as it runs on processors
that multiply and add in one operation; errors are below 0.511 of the last place.
"""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call, untyped-decorator"

import math
from collections.abc import Callable
from decimal import Decimal, localcontext
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from ..compiling.compiler import TARGET
from .numbers import LANES, VECTOR, all_at_least, fma, lanes
from .places import PLACES, row_at

Floats = NDArray[np.float64]

LARGEST = 500.0  # beyond, results may be infinite or less than normal numbers: they are looked at

# Places in a number; and one of them, in two parts, the first of which is short.
PER_PLACE = float.fromhex("0x1.71547652b82fep0") * PLACES
LONG, REST = float.fromhex("0x1.62e42fefap-8"), float.fromhex("0x1.cf79abc9e3b3ap-47")
PLACED = 1.5 * 2.0**52  # added and taken off again, this rounds to whole numbers

C2, C3, C4, C5 = map(
    float.fromhex,
    ("0x1.ffffffffffdbdp-2", "0x1.555555555543cp-3", "0x1.55555cf172b91p-5",
     "0x1.1111167a4d017p-7"),
)  # fmt: skip

EXPONENT = 52 - 7  # bits before the exponent of two, less those of a place


def _table() -> Floats:
    """Return what rounding took off the power of each place, as a share of it, and that power, less
    what the number of the place adds when it is shifted into the exponent; (PLACES, 4).
    """
    rows = np.zeros((PLACES, 4))
    with localcontext(prec=60):
        for place, row in enumerate(rows):
            power = Decimal(2) ** (Decimal(place) / PLACES)
            row[1] = power
            row[0] = power / Decimal(row[1]) - 1
    rows.view(np.int64)[:, 1] -= np.arange(PLACES) << EXPONENT
    return rows


TABLE = _table()


def _raise(_: Any, number: Any, placed: Any) -> Any:
    """Add a whole number of places, the last bits of `placed`, to a number's exponent of two."""

    def build(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        whole = ir.VectorType(ir.IntType(64), LANES)
        bits, places = (builder.bitcast(it, whole) for it in args)
        added = builder.shl(places, ir.Constant(whole, [EXPONENT] * LANES))
        return builder.bitcast(builder.add(bits, added), VECTOR)

    return lanes(number, placed), build


_raised = cast(Callable[[float, float], float], intrinsic(_raise))


def _of_lanes(power: float) -> float:
    if not all_at_least(LARGEST - abs(power), 0.0):
        return math.exp(power)
    placed = fma(power, PER_PLACE, PLACED)
    places = placed - PLACED
    left = fma(-places, REST, fma(-places, LONG, power))
    off, begun, _, _ = row_at(TABLE, placed)
    square = left * left
    more = fma(square, fma(left, C3, C2), off + left)
    more = fma(square * square, fma(left, C5, C4), more)
    scale = _raised(begun, placed)
    return fma(scale, more, scale)


def exp(power: float) -> float:
    """Return e to some power."""
    return math.exp(power)


@overload(exp, target=TARGET, strict=False, jit_options={"forceinline": True})
def _exp(power: Any) -> Callable[[float], float]:
    return _of_lanes if power is lanes else lambda power: math.exp(power)
