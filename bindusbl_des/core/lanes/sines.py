"""Sine and cosine of four angles at once, to the bits of the mathematical library.

A call of that library works on one number; arithmetic works on four.  What glibc does is known:
the nearest quarter turns are taken off an angle, then the nearest place of a table, and short
polynomials do for the rest.  Source: glibc 2.28 and later, sysdeps/ieee754/dbl-64/s_sin.c (IBM's
Accurate Mathematical Library), as it runs on processors that multiply and add in one operation;
errors are below 0.55 of the last place.
"""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call, untyped-decorator"

from collections.abc import Callable
from decimal import Decimal, localcontext
from math import copysign, cos, pi, sin
from typing import Any, cast

import numpy as np
from llvmlite import binding, ir
from numba.core import cgutils, types
from numba.core.typing.templates import signature
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from ..compiled import inlined
from ..compiling.compiler import TARGET
from .numbers import DOUBLE, all_at_least, fma, if_positive, lanes
from .places import PLACES, row_at

Floats = NDArray[np.float64]

# The first LLVM that knows of sine and cosine of one angle: one call of the mathematical library,
# where that has one, in place of two.
FIRST_WITH_SINCOS = 20

# Angles (rad) below which no quarter turn is taken off, and at most one; and those that are so
# small that the sine needs no table.
NONE_OFF, ONE_OFF, SMALL = 0.85546875, float.fromhex("0x1.368fdp+1"), 0.126

# Added and taken off again, these round to whole numbers, and to places of the table.
WHOLE, PLACED = 1.5 * 2.0**52, 1.5 * 2.0**45

# A quarter turn (rad): in two parts, and, for any number of them, in four short ones.
QUARTER, QUARTER_REST, PER_QUARTER = pi / 2.0, float.fromhex("0x1.1a62633145c07p-54"), 2.0 / pi
Q1, Q2, Q3, Q4 = map(
    float.fromhex,
    ("0x1.921fb58p0", "-0x1.dde973cp-27", "-0x1.cb3b398p-55", "-0x1.d747f23e32ed7p-83"),
)

# Polynomials beside a place, of sine and cosine, and of a small sine.
S3, S5 = -1.66666666666664880952546298448555e-01, 8.33333214285722277379541354343671e-03
C2, C4, C6 = 0.5, -4.16666666666664434524222570944589e-02, 1.38888874007937613028114285595617e-03
T3, T5, T7, T9, T11 = map(
    float.fromhex,
    ("-0x1.5555555555555p-3", "0x1.1111111110ecep-7", "-0x1.a01a019db08b8p-13",
     "0x1.71de27b9a7ed9p-19", "-0x1.addffc2fcdf59p-26"),
)  # fmt: skip


def _table() -> Floats:
    """Return sine and cosine of each place, and what rounding took off them, (PLACES, 4)."""
    rows = np.zeros((PLACES, 4))
    with localcontext(prec=60):
        terms = [Decimal(1)]
        for k in range(1, 32):
            terms.append(terms[-1] / PLACES / k)
        ahead = sum(terms[0::4]) - sum(terms[2::4])
        aside = sum(terms[1::4]) - sum(terms[3::4])
        sine, cosine = Decimal(0), Decimal(1)
        for row in rows:
            row[0], row[2] = sine, cosine
            row[1], row[3] = sine - Decimal(row[0]), cosine - Decimal(row[2])
            sine, cosine = sine * ahead + cosine * aside, cosine * ahead - sine * aside
    return rows


TABLE = _table()


@inlined
def _taken_off(angle: float) -> tuple[float, float, float]:
    """Return how many quarter turns are nearest to angles (rad), and what is left, in two parts."""
    is_one, is_near = abs(angle) - NONE_OFF, ONE_OFF - abs(angle)
    one = if_positive(is_one, copysign(1.0, angle), 0.0)
    past = fma(-one, QUARTER, angle)
    left = fma(-one, QUARTER_REST, past)
    rest = fma(-one, QUARTER_REST, past - left)
    many = fma(angle, PER_QUARTER, WHOLE) - WHOLE
    far = fma(-many, Q2, fma(-many, Q1, angle))
    farther = fma(-many, Q3, far)
    farthest = fma(-many, Q4, farther)
    far_rest = fma(-many, Q4, farther - farthest) + fma(-many, Q3, far - farther)
    return (
        if_positive(is_near, one, many),
        if_positive(is_near, left, farthest),
        if_positive(is_near, rest, far_rest),
    )


@inlined
def _of_acute(angle: float, rest: float) -> tuple[float, float]:
    """Return sine and cosine of angles (rad) from 0 to NONE_OFF, given in two parts.

    At x past a place p: sin(p + x) = sin p + (cos p s - sin p c), cos(p + x) = cos p - (sin p s +
    cos p c), with s = sin x and c = 1 - cos x.
    """
    placed = angle + PLACED
    sine, sine_rest, cosine, cosine_rest = row_at(TABLE, placed)
    x = angle - (placed - PLACED)
    square = x * x
    s = x + fma(x * square, fma(S5, square, S3), rest)
    c = fma(x, rest, square * fma(fma(C6, square, C4), square, C2))
    found = sine + fma(s, cosine, fma(-sine, c, fma(s, cosine_rest, sine_rest)))
    square = angle * angle
    small = fma(fma(fma(fma(T11, square, T9), square, T7), square, T5), square, T3)
    small = angle + fma(fma(small, angle, -0.5 * rest), square, rest)
    x += rest
    square = x * x
    s = fma(x * square, fma(S5, square, S3), x)
    c = square * fma(fma(C6, square, C4), square, C2)
    return (
        if_positive(SMALL - angle, small, found),
        cosine + fma(-s, sine, fma(-cosine, c, fma(-s, sine_rest, cosine_rest))),
    )


def _of_lanes(angle: float) -> tuple[float, float]:
    if all_at_least(NONE_OFF - abs(angle), 0.0):  # roll and pitch
        sine, cosine = _of_acute(abs(angle), 0.0)
        return copysign(sine, angle), cosine
    quarters, left, rest = _taken_off(angle)
    sine, cosine = _of_acute(abs(left), copysign(1.0, left) * rest)
    sine = copysign(sine, left)
    turn = quarters - 4.0 * (fma(quarters, 0.25, WHOLE) - WHOLE)  # less whole turns: -2 to 2
    is_odd = 0.5 - abs(abs(turn) - 1.0)
    sine, cosine = if_positive(is_odd, cosine, sine), if_positive(is_odd, sine, cosine)
    return (
        if_positive((turn + 0.5) * (1.5 - turn), sine, -sine),
        if_positive((turn + 1.5) * (0.5 - turn), cosine, -cosine),
    )


def _library(_: Any, angle: Any) -> Any:
    """Take sine and cosine of one angle."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if binding.llvm_version_info[0] < FIRST_WITH_SINCOS:
            kind = signature(types.float64, types.float64)
            both = [context.get_function(it, kind)(builder, args) for it in (sin, cos)]
        else:
            pair = ir.FunctionType(ir.LiteralStructType([DOUBLE, DOUBLE]), [DOUBLE])
            function = cgutils.get_or_insert_function(builder.module, pair, "llvm.sincos.f64")
            found = builder.call(function, args)
            both = [builder.extract_value(found, number) for number in range(2)]
        return context.make_tuple(builder, sig.return_type, both)

    return types.UniTuple(types.float64, 2)(types.float64), build


_by_library = cast(Callable[[float], tuple[float, float]], intrinsic(_library))


def sincos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle (rad); of lanes, angles are below 1e8."""
    return sin(angle), cos(angle)


@overload(sincos, target=TARGET, strict=False, jit_options={"forceinline": True})
def _sincos(angle: Any) -> Callable[[float], tuple[float, float]]:
    return _of_lanes if angle is lanes else lambda angle: _by_library(angle)
