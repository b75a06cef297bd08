"""What measurements say at the place where an AUV believes to be, against exact posteriors."""

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from missions_against import drawn_protocol, uncompiled
from worlds import QUIET_NAVIGATION, QUIET_USBL, blank, merged, still

from bindusbl_des import Scenario, simulate
from bindusbl_des.core.navigation.fix_update import Said
from bindusbl_des.core.navigation.turning import PingBelief, turned
from bindusbl_des.core.records.events import HEARD
from bindusbl_des.core.records.rows import RECEPTION

DEPTH = 10.0

DRAWN, MORE_DRAWN = range(2788, 2800), range(2700, 2788)
NO_FIX = Said(math.nan, math.nan, (math.nan, math.nan, math.nan))


def sights(origins: np.ndarray, polar: np.ndarray, sds: tuple[float, float, float]) -> np.ndarray:
    """Return receptions of ranges (m), azimuths and elevations (rad), (n, 3), with such noise."""
    rows = blank(RECEPTION, len(origins))
    reach, azimuth, elevation = polar.T
    level = np.cos(elevation)
    ahead = reach * np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    for axis, along, origin in zip("xyz", ahead, origins.T, strict=True):
        rows[f"ahead_{axis}_m"], rows[f"from_{axis}_m"] = along, origin
    rows["range_m2"], rows["turn_rad2"], rows["steep_rad2"] = np.square(sds)
    rows["level_rad2"] = rows["both_rad2"] = rows["from_m2"] = 0.0
    rows["outcome"] = HEARD
    return rows


def standing(place: tuple[float, float, float], spread: np.ndarray) -> PingBelief:
    """Return the belief of an AUV that nobody called."""
    return PingBelief(place, spread, place, 0.0)


def polar_of(places: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Return ranges, azimuths and elevations (n, 3) of places (n, 3) from an origin."""
    x, y, z = (places - origin).T
    return np.column_stack((np.sqrt(x * x + y * y + z * z), np.arctan2(y, x),
                            np.arctan2(z, np.hypot(x, y))))  # fmt: skip


def astray(said: Said, truth: np.ndarray) -> tuple[tuple[float, float], float]:
    """Return how far (m) a fix is off along x and y, and its normalised square."""
    (x, y), (xx, yy, xy) = (said.x - truth[0], said.y - truth[1]), said.noise
    return (x, y), (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)


def posterior(
    origins: np.ndarray, polar: np.ndarray, sds: tuple[float, float, float],
    place: np.ndarray, spread: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return mean (2,) and covariance (2, 2) of the place by weighing samples of the prior, with
    depths that nothing is known of.
    """
    rng, count = np.random.default_rng(1), 400_000
    level = rng.multivariate_normal(place, spread, count)
    deep = DEPTH + rng.uniform(-8.0, 8.0, count) * 500.0 * sds[2]
    places, weights = np.column_stack((level, deep)), np.zeros(count)
    for origin, measured in zip(origins, polar, strict=True):
        off = (polar_of(places, origin) - measured) / np.array(sds)
        weights -= 0.5 * (off**2).sum(axis=1)
    weights = np.exp(weights - weights.max())
    assert weights.sum() ** 2 / (weights**2).sum() > 2000.0  # so many independent samples
    mean = np.average(level, axis=0, weights=weights)
    return mean, np.cov(level.T, aweights=weights)


@pytest.mark.parametrize("bearing_deg", [1.0, 5.0])
@pytest.mark.parametrize("origins", [[[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0], [100.0, 700.0, 0.0]]])
def test_a_belief_and_a_sight_make_the_exact_posterior(
    origins: list[list[float]], bearing_deg: float
) -> None:
    """500 m away, the prior surer across than the array: mean and covariance within 5 % of it."""
    sds = 1.0, math.radians(bearing_deg), math.radians(0.5)
    place, spread = np.array([400.0, 300.0]), np.array([[4.0, 1.0], [1.0, 6.0]])
    truth, rng = np.array([[402.0, 298.0, DEPTH]]), np.random.default_rng(0)
    vessels = np.array(origins)
    polar = np.vstack([polar_of(truth, origin) for origin in vessels])
    polar += rng.normal(size=polar.shape) * np.array(sds)
    own = np.diag(np.ones(6))
    own[:2, :2] = spread
    said, _ = turned(sights(vessels, polar, sds), NO_FIX, standing((*place, DEPTH), own))
    xx, yy, xy = said.noise
    gain = spread @ np.linalg.inv(spread + np.array([[xx, xy], [xy, yy]]))
    mean = place + gain @ (np.array([said.x, said.y]) - place)
    exact, exact_spread = posterior(vessels, polar, sds, place, spread)
    sd = np.sqrt(np.diag(exact_spread))
    assert mean == pytest.approx(exact, abs=0.05 * sd.max())
    assert spread - gain @ spread == pytest.approx(exact_spread, abs=0.05 * sd.max() ** 2)


@pytest.mark.parametrize("sure", [0.1, 30.0, 70.0])
@pytest.mark.parametrize("bearing_deg", [1.0, 10.0])
def test_sights_have_no_bias_and_err_as_they_say(bearing_deg: float, sure: float) -> None:
    """Of 4000, with beliefs as unsure as `sure` (m): the mean within four standard errors, and the
    normalised squares, of which each has a variance of about 4 (10 for the wide bearing).
    """
    rng, count = np.random.default_rng(2), 4000
    sds = 0.1, math.radians(bearing_deg), math.radians(0.3)
    origin, truth = np.zeros((1, 3)), np.array([300.0, 400.0, DEPTH])
    own = np.diag([sure**2, sure**2, 1.0, 1.0, 1.0, 1.0])
    polar = polar_of(truth[None], origin[0]) + rng.normal(size=(count, 3)) * np.array(sds)
    beliefs = truth[:2] + rng.normal(size=(count, 2)) * sure
    off, squares = np.empty((count, 2)), np.empty(count)
    for k in range(count):
        believed = standing((*beliefs[k], DEPTH), own)
        said, _ = turned(sights(origin, polar[k : k + 1], sds), NO_FIX, believed)
        off[k], squares[k] = astray(said, truth)
    along = off @ truth[:2] / 500.0
    assert abs(along.mean()) < 4.0 * along.std() / math.sqrt(count)
    assert (np.abs(off.mean(axis=0)) < 4.0 * off.std(axis=0) / math.sqrt(count)).all()
    assert squares.mean() == pytest.approx(2.0, abs=4.0 * math.sqrt(10.0 / count))


def test_level_and_steep_errors_may_go_together() -> None:
    """As those of an array that leans: steeply below it the places that it tells lie on a line.
    No bias and normalised squares of 2, over 4000 with four standard errors.
    """
    rng, count = np.random.default_rng(4), 4000
    rad2 = math.radians(1.0) ** 2 * np.array([[1.0, 0.9], [0.9, 1.0]])
    truth, origin, own = np.array([60.0, 80.0, 100.0]), np.zeros((1, 3)), np.diag([100.0] * 6)
    (reach, azimuth, _), up = polar_of(truth[None], origin[0])[0], np.linalg.norm(truth[:2])
    level = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    steep = np.array([*(-truth[:2] * truth[2] / up), up]) / reach
    off, squares = np.empty((count, 2)), np.empty(count)
    for k in range(count):
        seen = truth / reach + rng.multivariate_normal((0.0, 0.0), rad2) @ (level, steep)
        seen *= (reach + 0.05 * rng.normal()) / np.linalg.norm(seen)
        rows = sights(origin, polar_of(seen[None], origin[0]), (0.05, 0.0, math.sqrt(rad2[1, 1])))
        rows["level_rad2"], rows["both_rad2"] = rad2[0]
        believed = standing((*(truth[:2] + rng.normal(size=2) * 10.0), truth[2]), own)
        said, _ = turned(rows, NO_FIX, believed)
        off[k], squares[k] = astray(said, truth)
    assert (np.abs(off.mean(axis=0)) < 4.0 * off.std(axis=0) / math.sqrt(count)).all()
    assert squares.mean() == pytest.approx(2.0, abs=4.0 * math.sqrt(4.0 / count))


@pytest.mark.parametrize("caller", [0, 1, 2])
def test_answers_are_ranged_by_the_way_that_the_auv_knows(caller: int) -> None:
    """Whole ways of call and answer, 0.6 m apart, to two vessels, called by either or by a third:
    no bias and normalised squares of 2, over 4000 with four standard errors.
    """
    rng, count = np.random.default_rng(3), 4000
    sds = 0.05, math.radians(1.0), math.radians(0.3)
    vessels = np.array([[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [90.0, -50.0, 0.0]])
    truth, gone = np.array([100.0, 60.0, DEPTH]), np.array([0.5, -0.3, 0.0])
    called, origin = truth - gone, vessels[caller]
    own, sure = np.eye(6), 1.0
    off, squares = np.empty((count, 2)), np.empty(count)
    for k in range(count):
        polar = np.vstack([polar_of(truth[None], it) for it in vessels[:2]])
        polar[:, 0] += np.linalg.norm(called - origin)
        polar += rng.normal(size=polar.shape) * np.array(sds)
        rows = sights(vessels[:2], polar, sds)
        rows["caller_x_m"], rows["caller_y_m"], rows["caller_z_m"] = origin
        rows["called_before_s"], rows["is_caller"] = 1.0, [caller == 0, caller == 1]
        moved = rng.normal(size=2) * sure
        place = (*(truth[:2] + moved), DEPTH)
        before = (*(called[:2] + moved), DEPTH)
        said, _ = turned(rows, NO_FIX, PingBelief(place, own, before, 0.0))
        off[k], squares[k] = astray(said, truth)
    assert (np.abs(off.mean(axis=0)) < 4.0 * off.std(axis=0) / math.sqrt(count)).all()
    assert squares.mean() == pytest.approx(2.0, abs=4.0 * math.sqrt(4.0 / count))


def test_what_is_not_known_apart_is_taken_as_the_fix_says() -> None:
    """One measurement of two that is not known leaves the fix as it is."""
    table = Said(1.0, 2.0, (3.0, 4.0, 0.5))
    vessels = np.zeros((2, 3))
    rows = sights(vessels, np.array([[50.0, 0.1, 0.2], [50.0, 0.1, 0.2]]), (0.1, 0.02, 0.02))
    rows["range_m2"][1] = math.nan
    believed = standing((48.0, 5.0, DEPTH), np.eye(6))
    assert turned(rows, table, believed)[0] == table
    assert turned(rows[:1], table, believed)[0] != table


@pytest.mark.parametrize("away", [0.0, 1e-9, 1e-4])
def test_at_an_array_a_fix_lies_in_no_direction(away: float) -> None:
    """Who believes to be there takes the fix for what its row says; nothing is divided by 0."""
    polar = polar_of(np.array([[6.0, 8.0, 0.0]]), np.zeros(3))
    rows = sights(np.zeros((1, 3)), polar, (0.1, 0.01, 0.01))
    table = Said(6.0, 8.0, (0.2, 0.3, 0.1))
    said, polar_too = turned(rows, table, standing((away, 0.0, 0.0), np.eye(6)))
    assert said == table
    assert not polar_too
    said, _ = turned(rows, table, standing((0.01, 0.0, 0.0), np.eye(6)))
    assert np.isfinite([*said[:2], *said.noise]).all()


def test_about_its_caller_a_call_comes_from_no_direction() -> None:
    """An AUV that may have been at its caller cannot tell how long the way of the call was."""
    polar = polar_of(np.array([[30.0, 40.0, DEPTH]]), np.zeros(3))
    rows = sights(np.zeros((1, 3)), polar, (0.1, 0.01, 0.01))
    rows["caller_x_m"], rows["caller_y_m"], rows["caller_z_m"] = 31.0, 40.0, DEPTH
    rows["is_caller"] = rows["called_before_s"] = 0.0
    table = Said(30.0, 40.0, (0.2, 0.3, 0.1))
    assert turned(rows, table, standing((30.0, 40.0, DEPTH), np.eye(6)))[0] == table


def test_what_is_known_of_a_place_lost_in_rounding_leaves_the_row() -> None:
    """A vessel a thousand kilometres away beside one at hand, ranges of both exact."""
    origins = np.array([[-1e6, 0.0, DEPTH], [-1e6, 1.0, DEPTH]])
    rows = sights(origins, polar_of(np.array([[0.0, 0.0, DEPTH]]), origins), (0.0, 0.5, 0.5))
    table = Said(0.0, 0.0, (2.0, 3.0, 0.0))
    assert turned(rows, table, standing((5.0, 5.0, DEPTH), np.eye(6)))[0] == table


def flown(navigator: str, drawn: Sequence[int], folder: Path) -> int:
    """Fly drawn missions; return of how many keys do not contradict each other."""
    flown = 0
    for seed in drawn:
        data = drawn_protocol(seed, folder)
        data["navigation"]["filter"], data["duration_s"] = navigator, 10.0
        try:
            scenario = Scenario.model_validate(data)
        except ValueError:  # keys that contradict each other
            continue
        simulate(scenario, seed)  # refuses to end with what is no number
        flown += 1
    return flown


def test_drawn_missions_end_with_numbers(tmp_path: Path) -> None:
    """Every key drawn, AUVs at the surface and at ASVs among them: none ends with a NaN."""
    assert 3 * uncompiled("navigation.test_turning", tmp_path) >= len(DRAWN)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("navigator", "drawn"), [("kalman", MORE_DRAWN), ("smoother", [*DRAWN, *MORE_DRAWN])]
)
def test_more_drawn_missions_end_with_numbers(
    navigator: str, drawn: Sequence[int], tmp_path: Path
) -> None:
    """The same, and of the smoother."""
    assert 3 * flown(navigator, drawn, tmp_path) >= len(drawn)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"usbl": {"array": "cross5", "misalignment_sd_deg": 1e-9}},
        {"protocol": {"ranging": {"model": "twtt", "turnaround_s": 0.0}}},
        {"protocol": {"ranging": "passive"}},
    ],
)
def test_a_filter_knows_that_waves_are_round(changes: dict[str, Any]) -> None:
    """Without noise: an array takes a wave for a plane one, which puts fixes 5 mm off (of
    `oem5` 5.49 mm by Newton on the sphere, exact arrivals); the filter is off by what a second
    step would mend, 1 / 1000 of that.
    """
    quiet = {"usbl": QUIET_USBL, "navigation": {**QUIET_NAVIGATION, "filter": "kalman"}}
    world = still(2, **merged({"duration_s": 6.0, **quiet}, changes))
    fixes = simulate(world, 0).tables["fixes"]
    assert fixes.error_m.to_numpy() == pytest.approx(np.full(len(fixes), 5.4e-3), abs=1e-4)
    assert fixes.innovation_m.max() < 1e-5


if __name__ == "__main__":
    print(json.dumps(flown("kalman", DRAWN, Path(sys.argv[1]))))
