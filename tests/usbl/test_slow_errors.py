"""Acoustic errors that change slowly: what is drawn, and what fixes say of them."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_systematic import FLEET, PINGED, SOUND, STATIONS

from bindusbl_des.core.streams import Streams
from bindusbl_des.records.events import HEARD, LOST
from bindusbl_des.records.rows import NONE, PING, RECEPTION
from bindusbl_des.usbl.array import ARRAYS
from bindusbl_des.usbl.instrument import Sheet, Usbl
from bindusbl_des.usbl.measuring import NOISE_WIDTH, Instrument
from bindusbl_des.usbl.slow_errors import FIRST, advance, blend, slow_numbers
from bindusbl_des.usbl.systematic_effects import SLOW
from bindusbl_des.usbl.systematic_fixes import SYSTEMATIC, Systematic, measured_astray
from bindusbl_des.usbl.two_way import Heard

Array = NDArray[np.float64]

SOURCE = np.array([25.0, 18.0, 12.0])
SHARE = 0.6
SHEETS = {
    "array": None,
    "angles": Sheet(bearing_sd=0.01, elevation_sd=0.008, path_sd=0.1, path_share=0.002),
    "place": Sheet(spread_sd=0.5, spread_share=0.01),
}
WAYS: dict[str, dict[str, Any]] = {
    "one": {"heard": (1,)}, "three": {}, "call": {"called_by": 0},
    "call of another": {"called_by": 2, "heard": (0, 1)},
}  # fmt: skip


def measured(
    noise: Array, sheet: Sheet | None, heard: tuple[int, ...] = (0, 1, 2), called_by: int = NONE,
    share: float = SHARE, source: Array = SOURCE,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Return fix, covariance, J and what is left, where ASVs tell slow errors from others."""
    ping, receptions = np.zeros(1, dtype=PING), np.zeros(3, dtype=RECEPTION)
    travel = np.linalg.norm(source - STATIONS, axis=1) / SOUND
    ping["auv"], ping["sent_at_s"], ping["called_by"] = 0, PINGED, called_by
    ping["x_m"], ping["y_m"], ping["z_m"] = source
    ping["called_at_s"] = ping["call_time_s"] = np.nan
    if called_by != NONE:
        ping["call_time_s"] = travel[called_by]
        ping["called_at_s"] = PINGED - travel[called_by]
    receptions["asv"], receptions["travel_time_s"] = np.arange(3), travel
    receptions["arrived_at_s"], receptions["outcome"] = PINGED + travel, LOST
    receptions["outcome"][list(heard)] = HEARD
    receptions["lowered"] = receptions["snr_db"] = np.nan
    usbl = Usbl(
        ARRAYS["oem5"], 2.6e-7, 6.7e-6, 0.0, (0.003, 0.003, 0.015), 0.02, SOUND, sheet=sheet,
        slow_share=share,
    )  # fmt: skip
    levels = np.zeros(1, dtype=SYSTEMATIC)
    for kind in ("misalignment", "gnss", "sound_speed", "clock"):
        levels[f"{kind}_at"] = NONE
    known = np.ones(3 * SLOW)
    systematic = Systematic(levels[0], known, np.zeros(3), np.zeros((3, 1, 2)), np.zeros((1, 2)))
    instrument = Instrument(usbl.array, usbl.metric, usbl.levels[0])
    strayed = np.zeros(1)
    return measured_astray(
        Heard(ping[0], receptions, noise), FLEET, instrument, strayed, systematic
    )


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", SHEETS)
def test_j_holds_what_slow_numbers_move(kind: str, way: str) -> None:
    """J J^T of each ASV is that of the fix's differences by the numbers that are slow."""
    sheet, quiet, step = SHEETS[kind], np.zeros((3, NOISE_WIDTH + 4)), 1e-3
    jacobian = measured(quiet, sheet, **WAYS[way])[2]
    for asv in range(3):
        found = np.zeros((2, 2))
        for number in range(FIRST):
            moved = quiet.copy()
            moved[asv, number] = np.sqrt(SHARE) * step
            up = measured(moved, sheet, **WAYS[way])[0]
            by = (up - measured(-moved, sheet, **WAYS[way])[0])[:2] / (2 * step)
            found += np.outer(by, by)
        own = jacobian[:2, SLOW * asv : SLOW * (asv + 1)]
        assert own @ own.T == pytest.approx(found, rel=0.02, abs=0.02 * np.abs(found).max())
        assert (np.abs(own).max() > 0.0) == (asv in WAYS[way].get("heard", (0, 1, 2)))


@pytest.mark.parametrize("kind", SHEETS)
def test_j_has_no_edge_straight_below(kind: str) -> None:
    """Straight below an ASV, where every way is level, J turns no more than elsewhere: what its
    derivatives say of a place a metre on, on whichever side, is J there.
    """
    quiet, below = np.zeros((3, NOISE_WIDTH + 4)), STATIONS[1] + np.array([0.3, -0.2, 30.0])
    count, whole = 3 * SLOW, measured(quiet, SHEETS[kind], heard=(1,), source=below)[2]
    for step in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)):
        there = measured(quiet, SHEETS[kind], heard=(1,), source=below + np.array(step))[2]
        along = step[0] * whole[:2, count : 2 * count] + step[1] * whole[:2, 2 * count : 3 * count]
        size = np.abs(there[:2, :count]).max()
        assert whole[:2, :count] + along == pytest.approx(there[:2, :count], abs=0.05 * size)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", SHEETS)
def test_the_covariance_of_a_fix_is_what_it_was(kind: str, way: str) -> None:
    """A single fix errs as it does without slow errors; J and what is left add up to that."""
    sheet, quiet = SHEETS[kind], np.zeros((3, NOISE_WIDTH + 4))
    _, covariance, jacobian, left = measured(quiet, sheet, **WAYS[way])
    plain = measured(quiet, sheet, **WAYS[way], share=0.0)[1]
    assert covariance == pytest.approx(plain, rel=0.02, abs=0.02 * np.abs(plain).max())
    own = jacobian[:2, : 3 * SLOW]
    rest = np.array([[left[0], left[2]], [left[2], left[1]]])
    assert own @ own.T + rest == pytest.approx(covariance[:2, :2], rel=0.02, abs=1e-3)


@pytest.mark.parametrize("elements", [5, 8])
def test_slow_numbers_last_as_long_as_they_say(elements: int) -> None:
    """Of each number: variance 1, a share of it with the correlation exp(-T / tau), at any pace."""
    tau, share, pace = 4.0, 0.7, (0.5, 1.5)
    numbers = slow_numbers(share, tau, elements, Streams(3), 1, 2)
    assert numbers is not None
    rng, rows, time = np.random.default_rng(1), [], 0.0
    for k in range(40_000):
        row = rng.standard_normal(NOISE_WIDTH + 4 + elements - 5)
        advance(numbers[0, 1], time)
        blend(row, numbers[0, 1])
        rows.append(row)
        time += pace[k % 2]
    found, count = np.array(rows), FIRST + elements - 5
    slow = [*range(FIRST), *range(found.shape[1] - elements + 5, found.shape[1])]
    assert len(slow) == count
    assert found.var(axis=0) == pytest.approx(np.ones(found.shape[1]), abs=0.06)
    for after, passed in ((2, 2.0), (8, 8.0)):
        beside = (found[after:] * found[:-after]).mean(axis=0)
        expected = np.zeros(found.shape[1])
        expected[slow] = share * np.exp(-passed / tau)
        assert beside == pytest.approx(expected, abs=0.05)
    both = found[:, slow].T @ found[:, slow] / len(found)
    assert both == pytest.approx(np.eye(count), abs=0.07)  # independent of each other


def test_none_are_drawn_without_a_share() -> None:
    assert slow_numbers(0.0, 60.0, 5, Streams(0), 2, 2) is None
    some = slow_numbers(0.5, 60.0, 5, Streams(0), 2, 2)
    more = slow_numbers(0.5, 60.0, 5, Streams(0), 2, 3)
    assert some is not None
    assert more is not None
    assert np.array_equal(some["key"], more["key"][:, :2])  # a further ASV leaves them as they are
    assert len(np.unique(more["key"][:, :, 0])) == 6
