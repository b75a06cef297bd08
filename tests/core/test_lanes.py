"""Four vehicles at once: each lane has the bits of a float, and what is no lanes is refused."""

import math
import platform
from math import hypot, sqrt

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from numba.core.errors import TypingError
from numpy.typing import NDArray

from bindusbl_des.core.compiled import entry, inlined
from bindusbl_des.core.lanes.arctangent import SLENDER, atan2
from bindusbl_des.core.lanes.blocks import block
from bindusbl_des.core.lanes.exponential import LARGEST, exp
from bindusbl_des.core.lanes.numbers import LANES, all_at_least, if_positive
from bindusbl_des.core.lanes.sines import sincos

Floats = NDArray[np.float64]

LIBRARY, VERSION = platform.libc_ver()
FUSED = get_host_cpu_features().get("fma", True)  # where it is no choice, it is there
as_the_library_rounds = pytest.mark.skipif(
    LIBRARY != "glibc" or [int(part) for part in VERSION.split(".")] < [2, 34] or not FUSED,
    reason="other libraries, and this one on other processors, round otherwise",
)


@inlined
def formula(x: float, y: float) -> float:
    """Return what every operation makes of two numbers."""
    sine, cosine = sincos(x)
    total = 0.0
    for k in range(1, 4):
        total += (k * 0.5 - y) * sine / (cosine - 7.0)
        total -= -x
        total *= 0.75
        total /= 3.0 + abs(y)
    total = total + exp(-y * y) + atan2(y, x) + hypot(x, y) - sqrt(abs(x))
    return total * if_positive(x, y, 2.0) + min(max(x, -0.5), 0.5)


@entry
def together(rows: Floats) -> None:
    """Write what the formula makes of rows 0 and 1 to row 2, all lanes at once."""
    four = block(rows, 0)
    four[2] = formula(four[0], four[1])
    four[3] = 1.5


@entry
def one_by_one(rows: Floats) -> None:
    """Do the same, lane by lane."""
    for lane in range(LANES):
        rows[2, lane] = formula(rows[0, lane], rows[1, lane])
        rows[3, lane] = 1.5


@entry
def turn(rows: Floats) -> None:
    """Write sines and cosines of row 0 to rows 1 and 2."""
    four = block(rows, 0)
    four[1], four[2] = sincos(four[0])


@entry
def grow_and_point(rows: Floats) -> None:
    """Write exponentials of row 0 and angles of rows 0 and 1 to rows 2 and 3."""
    four = block(rows, 0)
    four[2], four[3] = exp(four[0]), atan2(four[0], four[1])


@entry
def level(rows: Floats, first: int, bound: float) -> bool:
    """Return whether no lane of a row is below a bound."""
    return all_at_least(block(rows, first)[0], bound)


def test_lanes_have_the_bits_of_floats() -> None:
    """Of 1,000 blocks from 1e-6 to 1e6, of either sign, of zeros and of infinities."""
    random = np.random.default_rng(3)
    for _ in range(1000):
        rows = random.normal(size=(4, LANES)) * 10.0 ** random.uniform(-6, 6, (4, LANES))
        rows[:2, random.integers(LANES)] = random.choice([0.0, -0.0, np.inf, np.nan], 2)
        expected = rows.copy()
        together(rows)
        one_by_one(expected)
        assert np.array_equal(rows, expected, equal_nan=True)


@as_the_library_rounds
@pytest.mark.parametrize("within", [1e-300, 0.126, 0.13, 0.856, 0.86, 2.42, 2.43, 7.0, 1e3, 1e8])
def test_sines_have_the_bits_of_the_library(within: float) -> None:
    """Of angles on either side of where other formulas begin, and of zeros of either sign."""
    rows = np.zeros((3, LANES))
    for angles in np.random.default_rng(5).uniform(-1.0, 1.0, (5000, LANES)):
        rows[0] = within * np.copysign(np.abs(angles) ** 0.1, angles)
        rows[0, 0] = math.copysign(0.0 if angles[1] > 0.9 else rows[0, 0], angles[0])
        turn(rows)
        expected = [(math.sin(angle), math.cos(angle)) for angle in rows[0].tolist()]
        assert rows[1:].tobytes() == np.array(expected).T.tobytes()


@as_the_library_rounds
@pytest.mark.parametrize("within", [1e-250, 1e-20, 0.003, 1.0, 20.0, LARGEST, 700.0])
@pytest.mark.parametrize("slender", [0.0, 0.8 * SLENDER, SLENDER, 100.0 * SLENDER])
def test_exponentials_and_angles_have_the_bits_of_the_library(
    within: float, slender: float
) -> None:
    """Of numbers on either side of where other formulas begin, and of zeros of either sign."""
    random, rows = np.random.default_rng(7), np.zeros((4, LANES))
    for numbers in random.uniform(-1.0, 1.0, (500, LANES)):
        rows[0] = within * numbers
        rows[1] = slender * np.abs(rows[0]) * random.uniform(1.0, 2.0, LANES)
        rows[0, random.integers(LANES)] = random.choice([0.0, -0.0])
        rows[1, 0] *= random.choice([1.0, 0.0, -1.0, -0.0])
        grow_and_point(rows)
        pairs = rows[:2].T.tolist()
        assert rows[2].tolist() == [math.exp(power) for power, _ in pairs]
        expected = np.array([math.atan2(*pair) for pair in pairs])
        assert rows[3].tobytes() == expected.tobytes()


def test_angles_that_are_none_have_no_sine() -> None:
    """Nor do they lead beyond the table."""
    rows = np.array([[np.nan, np.inf, -np.inf, np.nan], [0.0] * LANES, [0.0] * LANES])
    turn(rows)
    assert np.isnan(rows[1:]).all()


def test_a_bound_holds_for_every_lane() -> None:
    """One lane below it, or that is no number, is seen wherever it is."""
    rows = np.arange(3.0 * LANES).reshape(3, LANES)
    assert level(rows, 1, LANES)
    for lane in range(LANES):
        for wrong in (LANES - 0.5, np.nan):
            spoilt = rows.copy()
            spoilt[1, lane] = wrong
            assert not level(spoilt, 1, float(LANES))
            assert level(spoilt, 2, float(LANES))


def test_only_rows_of_floats_are_lanes() -> None:
    """What is not laid out as lanes is refused when the code is compiled."""
    for rows in (np.zeros(8), np.zeros((2, LANES), dtype=int), np.zeros((2, 2 * LANES))[:, ::2]):
        with pytest.raises(TypingError):
            together(rows)
