"""Errors that outlast a ping: what they make of fixes, and that fusing does not average them away.

Worked examples of common errors: physics of the MVLUE with a stacked covariance.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import blank, scenario

from bindusbl_des import Setup
from bindusbl_des.core.records.events import HEARD
from bindusbl_des.core.records.rows import PING, RECEPTION
from bindusbl_des.core.usbl.fixes import HeardBeacon, located_with_errors, measured_with_errors
from bindusbl_des.core.usbl.fusion import fuse_shared
from bindusbl_des.core.usbl.instrument import packed
from bindusbl_des.core.usbl.measuring import Instrument, PackedInstrument
from bindusbl_des.core.usbl.sights import Heard
from bindusbl_des.core.usbl.systematic_effects import SLOW, SYSTEMATIC, Systematic
from bindusbl_des.core.vehicles.motion import together
from bindusbl_des.core.vehicles.vehicle import moored

Array = np.ndarray
NONE, NOISE_WIDTH = -1, 12
SOUND = 1500.0
STATIONS = np.array([[40.0, 5.0, 0.0], [-25.0, 30.0, 0.0], [-10.0, -35.0, 0.0]])
FLEET = together([moored((*place, 0.7 * k)).legs for k, place in enumerate(STATIONS)])
SOURCE = np.array([3.0, -6.0, 12.0])
PINGED, TURNAROUND = 200.0, 0.5  # s
# columns of J: three misalignments, three GNSS errors along x and y, sound speed, clock and drift
COLUMNS = 12
SDS = np.array([*[0.03] * 3, *[0.8] * 6, 0.007, 5e-4, 2e-6])
INSTRUMENT = Setup(scenario()).usbl


@cache
def array_of(name: str) -> Array:
    return Setup(scenario(usbl={"array": name})).usbl.array


def instrument_of(array: str, sds: Any, wrong: float, **more: Any) -> PackedInstrument:
    """Return an instrument by the noise of TDOAs, travel time, steps, attitude and GNSS, and by how
    much it takes sound for too fast.
    """
    named = ("tdoa_sd", "travel_time_sd", "quantum", "attitude_sd", "gnss_sd")
    usbl = replace(
        INSTRUMENT,
        array=array_of(array),
        **dict(zip(named, sds, strict=True)),
        sound_speed=SOUND / (1.0 - wrong),
        true_sound_speed=SOUND,
        **more,
    )
    return packed([usbl] * 3)


@dataclass(frozen=True)
class Sea:
    """One ping at three ASVs, and all that is wrong: c in the order of J."""

    wrong: Array = field(default_factory=lambda: np.zeros(COLUMNS))
    noise: Array = field(default_factory=lambda: np.zeros((3, NOISE_WIDTH + 4)))
    sds: Array = field(default_factory=lambda: SDS)
    quiet: bool = False
    called_by: int = NONE
    heard: tuple[int, ...] = (0, 1, 2)
    array: str = "oem5"
    outliers: tuple[float, float] = (-math.inf, 0.0)
    source: Array = field(default_factory=lambda: SOURCE)
    called_from: Array = field(default_factory=lambda: np.zeros(3))  # on the way since the call
    strayed: float = 0.0
    sheet: Any = None
    slow_share: float | None = None  # of errors of which J is then

    def measured(self) -> tuple[Array, Array, Array, Array]:
        """Return fix (3,), covariance (3, 3), J with its derivatives, and by the way since the
        call, (3, 50), and what is left of the covariance (3,).
        """
        travel = np.linalg.norm(self.source - STATIONS, axis=1) / SOUND
        ping, receptions = blank(PING, 1), blank(RECEPTION, 3)
        ping["auv"], ping["sent_at_s"] = 0, PINGED
        ping["x_m"], ping["y_m"], ping["z_m"] = self.source
        if self.called_by != NONE:
            ping["called_by"] = self.called_by
            way = self.source + self.called_from - STATIONS[self.called_by]
            ping["call_time_s"] = np.linalg.norm(way) / SOUND
            ping["called_at_s"] = PINGED - TURNAROUND - ping["call_time_s"]
        receptions["asv"], receptions["travel_time_s"] = np.arange(3), travel
        receptions["arrived_at_s"] = PINGED + travel
        receptions["outcome"] = NONE
        receptions["outcome"][list(self.heard)] = HEARD
        heard = Heard(ping[0], receptions, self.noise)
        noise = (2.6e-7, 6.7e-6, 0.0, (0.003, 0.003, 0.015), 0.02)
        quiet = (0.0, 0.0, 0.0, (0.0, 0.0, 0.0), 0.0)
        instrument = instrument_of(
            self.array, quiet if self.quiet else noise, self.wrong[9], sheet=self.sheet,
            slow_share=self.slow_share or 0.0,
        )  # fmt: skip
        levels = np.zeros(1, dtype=SYSTEMATIC)
        for kind in ("misalignment", "gnss", "sound_speed", "clock", "slow"):
            levels[f"{kind}_at"] = NONE
        if self.slow_share is None:
            tell(levels, self.sds, misalignment=0, gnss=3, sound_speed=9, clock=10)
            variances = self.sds**2
        else:
            levels["slow_at"], variances = 0, np.ones(3 * SLOW)
        levels["outliers_below"], levels["outlier_sd_m"] = self.outliers
        systematic = Systematic(
            levels[0], variances, self.wrong[:3],
            self.wrong[3:9].reshape(3, 1, 2), self.wrong[None, 10:],
        )  # fmt: skip
        return measured_with_errors(heard, FLEET, instrument, np.array([self.strayed]), systematic)


def tell(levels: Array, sds: Array, **begin: int) -> None:
    """Have all that lasts be told, each kind at a column of J."""
    levels["sd"] = [*sds[[0, 3, 4, 3, 4]], sds[9]]
    levels["clock_offset_sd_s"], levels["clock_drift_sd"] = sds[10:]
    for kind, at in begin.items():
        levels[f"{kind}_at"] = at


WAYS = [
    {}, {"heard": (1,)}, {"called_by": 0}, {"called_by": 2, "heard": (1,)},
    {"called_by": 2, "heard": (0, 1)}, {"array": "cross5", "heard": (2, 0)},
]  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("column", range(COLUMNS))
def test_a_fix_moves_with_what_is_wrong_as_it_says(way: dict[str, Any], column: int) -> None:
    """J equals differences: each heading, GNSS, sound speed and clock, one way and two ways."""
    sea = Sea(**way)  # without noise: where fixes differ, weights that change matter as well
    step = 1e-3 * SDS[column] * np.eye(COLUMNS)[column]
    jacobian = sea.measured()[2][:, column]
    moved = replace(sea, wrong=step).measured()[0] - replace(sea, wrong=-step).measured()[0]
    assert moved / (2 * step[column]) == pytest.approx(
        jacobian, rel=2e-3, abs=2e-3 * abs(jacobian).max()
    )
    called = "called_by" in way
    alone = set(way.get("heard", (0, 1, 2))) | ({way["called_by"]} if called else set())
    depends = {**{k: k in way.get("heard", (0, 1, 2)) for k in range(3)}, 9: True}
    depends |= {3 + 2 * k + axis: k in alone for k in range(3) for axis in range(2)}
    assert (np.abs(jacobian).max() > 0.0) == depends.get(column, not called)


@pytest.mark.parametrize("heard", [(0,), (1,), (0, 1), (0, 1, 2)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_fix_moves_with_the_way_since_a_call_as_it_says(
    heard: tuple[int, ...], axis: int
) -> None:
    """J equals differences, and what that way may be is no part of what is left."""
    sea, step = Sea(called_by=0, heard=heard), 1e-3 * np.eye(3)[axis]
    jacobian = sea.measured()[2][:, 4 * COLUMNS + axis]
    ahead, behind = (replace(sea, called_from=s * step).measured()[0] for s in (1.0, -1.0))
    found = (ahead - behind) / 2e-3
    assert found == pytest.approx(jacobian, rel=2e-3, abs=2e-3 * abs(jacobian).max())
    assert abs(jacobian).max() > 0.01
    strays = replace(sea, strayed=1e-8)  # so little that no weights change
    assert strays.measured()[3] == pytest.approx(sea.measured()[3], rel=1e-5)


def test_who_was_not_called_has_no_way_since() -> None:
    """The columns of the way are 0."""
    assert not Sea().measured()[2][:, 4 * COLUMNS :].any()


@pytest.mark.parametrize("way", [{"heard": (1,)}, {"array": "cross5", "heard": (2,)}])
@pytest.mark.parametrize("axis", [0, 1])
def test_what_is_wrong_turns_with_the_direction(way: dict[str, Any], axis: int) -> None:
    """J changes from place to place as it says, but for what elevation makes of a late clock: how
    fast it turns is the less certain the more of the range that clock may be.
    """
    sea, step = Sea(**way), 0.01 * np.eye(3)[axis]
    count = COLUMNS * (1 + axis)
    told = sea.measured()[2][:2, count : count + COLUMNS]
    ahead, behind = (
        replace(sea, source=SOURCE + side * step).measured()[2][:2, :COLUMNS] for side in (1, -1)
    )
    found, (x, y) = (ahead - behind) / 0.02, (SOURCE - STATIONS[way["heard"][0]])[:2]
    along = np.array([x, y]) / np.hypot(x, y)
    found[:, 10:] -= np.outer(along, along @ found[:, 10:])
    found[:, 9] -= along * (along @ (found[:, 9] - told[:, 9]))  # nor of the array's elevation
    late_m = 1500.0 * math.hypot(SDS[10], SDS[11] * PINGED)
    found[:, 10:] /= 1.0 + (3.0 * late_m) ** 2 / (x * x + y * y + SOURCE[2] ** 2)
    scale = np.abs(told).max(axis=0)
    assert (np.abs(found - told) <= 2e-3 * scale + 1e-9).all()


def fused(
    fixes: list[Array], covariances: list[Array], jacobians: list[Array]
) -> tuple[Array, Array]:
    """Fuse fixes (3,) that share unknowns of unit variance; return place and covariance."""
    beside = jacobians[0].shape[1]
    state, spread = np.zeros(3 + beside), np.eye(3 + beside)
    state[:3] = fixes[0]
    spread[:3, :3] = covariances[0] + jacobians[0] @ jacobians[0].T
    spread[:3, 3:], spread[3:, :3] = -jacobians[0], -jacobians[0].T
    for fix, covariance, jacobian in zip(fixes[1:], covariances[1:], jacobians[1:], strict=True):
        state, spread, _, _ = fuse_shared(state, spread, fix, covariance, jacobian)
    return state[:3], spread[:3, :3]


@given(st.integers(0, 10_000), st.integers(1, 4))
def test_shared_errors_are_fused_as_by_all_at_once(seed: int, others: int) -> None:
    """Fix by fix or all in one weighted least squares: the same estimate and covariance."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((4, 4))
    prior, first = root @ root.T + 0.1 * np.eye(4), rng.standard_normal(4)
    information, vector = np.linalg.inv(prior), np.linalg.inv(prior) @ first
    state, spread = first, prior
    for _ in range(others):
        unit, root = rng.standard_normal(3), rng.standard_normal((3, 3))
        unit /= np.linalg.norm(unit)
        noise, fix = root @ root.T + 0.1 * np.eye(3), rng.standard_normal(3)
        design = np.column_stack((np.eye(3), -unit))
        information = information + design.T @ np.linalg.inv(noise) @ design
        vector = vector + design.T @ np.linalg.inv(noise) @ fix
        state, spread, _, _ = fuse_shared(state, spread, fix, noise, -unit.reshape(3, 1))
    assert spread == pytest.approx(np.linalg.inv(information), abs=1e-7)
    assert state == pytest.approx(np.linalg.solve(information, vector), abs=1e-6)


@pytest.mark.parametrize(
    ("count", "sd"), [(1, 0.583095), (2, 0.463681), (3, 0.416333), (4, 0.390512), (10, 0.339116)]
)
def test_a_common_error_is_a_floor(count: int, sd: float) -> None:
    """Fixes of variance 0.25 with one error of variance 0.09 in common: never below 0.3 m."""
    rng = np.random.default_rng(count)
    fixes = list(rng.standard_normal((count, 3)))
    place, spread = fused(fixes, [0.25 * np.eye(3)] * count, [0.3 * np.eye(3)] * count)
    assert np.sqrt(np.diag(spread)) == pytest.approx([sd] * 3, abs=5e-7)
    assert place == pytest.approx(np.mean(fixes, axis=0))  # their weights are what they were


def test_a_clock_cancels_where_geometry_says_so() -> None:
    """A clock of 1 ms: nothing of it is left between two ASVs, and much of it beside two."""
    east, north = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    along, across = np.diag([0.01, 0.25, 1.0]), np.diag([0.25, 0.01, 1.0])
    nowhere = [np.zeros(3)] * 2
    opposite = fused(nowhere, [along] * 2, [1.5 * east[:, None], -1.5 * east[:, None]])[1]
    assert opposite[:2, :2] == pytest.approx(np.diag([0.005, 0.125]), abs=1e-9)
    aside = fused(nowhere, [along, across], [1.5 * east[:, None], 1.5 * north[:, None]])[1]
    assert aside[:2, :2] == pytest.approx(
        np.array([[0.123243, 0.113627], [0.113627, 0.123243]]), abs=5e-7
    )


def test_weights_may_be_negative() -> None:
    """Of two that err together the worse one tells what the better one errs by (sd 1, 2; 0.9)."""
    jacobians = [np.array([[0.95], [0], [0]]), np.array([[1.8 / 0.95], [0], [0]])]
    own = [np.diag([1 - 0.95**2, 1, 1]), np.diag([4 - (1.8 / 0.95) ** 2, 1, 1])]
    place, spread = fused([np.array([1.0, 0, 0]), np.zeros(3)], own, jacobians)
    assert place[0] == pytest.approx(1.5714286, abs=1e-7)
    assert spread[0, 0] == pytest.approx(0.542857143, abs=1e-9)


def anywhere(rng: np.random.Generator, way: dict[str, Any]) -> Array:
    """Return a place of an AUV among the ASVs; if the caller is deaf, not in line with it."""
    if way.get("called_by") in way.get("heard", (0, 1, 2)) or not way:
        return np.array([*rng.uniform(-40.0, 40.0, 2), 12.0])
    return np.array([rng.uniform(10.0, 50.0), rng.uniform(20.0, 60.0), 12.0])


# What is wrong: one kind alone, or all at once; (nothing else is told, either)
ALONE = {
    "nothing": (), "misalignment": (0, 1, 2), "gnss": tuple(range(3, 9)), "sound_speed": (9,),
    "clock": (10, 11), "everything": tuple(range(COLUMNS)),
}  # fmt: skip


@pytest.mark.parametrize("kind", ALONE)
@pytest.mark.parametrize(
    "way",
    [
        {},
        pytest.param({"called_by": 0}, marks=pytest.mark.slow),
        {"called_by": 2, "heard": (0, 1)},
    ],
)
def test_fixes_are_as_good_as_they_say(kind: str, way: dict[str, Any]) -> None:
    """Whatever lasts: the errors of fixes agree with their covariance, and what J leaves of them.

    The first tells of all errors; the second of what is left where everything that lasts is known.
    """
    rng, count, told = np.random.default_rng(5), 1500, np.zeros(COLUMNS)
    told[list(ALONE[kind])] = SDS[list(ALONE[kind])]
    squares = np.zeros(2)
    for _ in range(count):
        wrong, noise = (
            told * rng.standard_normal(COLUMNS),
            rng.standard_normal((3, NOISE_WIDTH + 4)),
        )
        sea = Sea(wrong, noise, told, source=anywhere(rng, way), **way)
        fix, covariance, jacobian, (xx, yy, xy) = sea.measured()
        off = fix - sea.source
        left = np.array([[xx, xy], [xy, yy]])
        squares[0] += off[:2] @ np.linalg.solve(covariance[:2, :2], off[:2])
        there, along_x, along_y, bend = np.split(jacobian[:, : 4 * COLUMNS], 4, axis=1)
        there = there - off[0] * along_x - off[1] * along_y  # J of the place, not of the fix
        off = off - there @ wrong - bend @ wrong**2 / 2
        squares[1] += off[:2] @ np.linalg.solve(left, off[:2])
    # chi-squared of 2 degrees of freedom at 3.3 sd, 3 % for terms of third order; turned offsets
    # all lie beyond their tangents, which covariances take for chance, as the bend of an ellipse
    chance = 3.3 * math.sqrt(4 / count) + 0.06
    by_ellipse = 0.15 if way.get("heard") else 0.0
    assert squares[1] / count == pytest.approx(2.0, abs=chance + by_ellipse)
    assert squares[0] / count == pytest.approx(2.0, abs=chance + 0.15)


def test_a_clock_off_by_the_range_itself_leaves_no_sure_direction() -> None:
    """An AUV 13 m from its ASV with clocks off by 6 m: the fix lies as far off across as its
    direction errs at the true range, not at the one measured, which may be next to nothing.
    """
    rng, count, told = np.random.default_rng(7), 3000, np.zeros(COLUMNS)
    told[10] = 0.004
    source, squares = STATIONS[1] + np.array([4.0, -4.0, 12.0]), np.zeros(2)
    for _ in range(count):
        wrong = told * rng.standard_normal(COLUMNS)
        noise = rng.standard_normal((3, NOISE_WIDTH + 4))
        fix, covariance, _, _ = Sea(wrong, noise, told, source=source, heard=(1,)).measured()
        off = (fix - source)[:2]
        squares[0] += off @ np.linalg.solve(covariance[:2, :2], off)
        across = np.array([1.0, 1.0]) / math.sqrt(2.0)
        squares[1] += (off @ across) ** 2 / (across @ covariance[:2, :2] @ across)
    assert squares[0] / count == pytest.approx(2.0, rel=0.1)
    assert 0.4 < squares[1] / count < 1.1  # of clocks that make ranges longer it is more


@pytest.mark.parametrize(("count", "factor"), [(2, 0.75), (3, 2 / 3)])
def test_fixes_that_are_alike_are_worth_less(count: int, factor: float) -> None:
    """Errors of K fixes correlated by a half leave (1 + (K - 1) / 2) / K of a variance."""
    half = math.sqrt(0.5) * np.eye(3)
    spread = fused([np.zeros(3)] * count, [half @ half] * count, [half] * count)[1]
    assert np.diag(spread) == pytest.approx([factor] * 3)


def test_measurements_that_contradict_each_other_make_no_sure_fix() -> None:
    """An outlier among three: nobody knows which, but the fix does not pass for a good one."""
    noise = np.random.default_rng(1).standard_normal((3, NOISE_WIDTH + 4))
    noise[:, NOISE_WIDTH + 1] = (0.0, -9.0, 0.0)  # the second is one
    noise[1, NOISE_WIDTH + 2 :] = (0.6, -0.8)
    nobody = Sea(noise=noise).measured()
    possible = Sea(noise=noise, outliers=(-math.inf, 25.0)).measured()
    for one, other in zip(nobody, possible, strict=True):
        assert np.array_equal(one, other)  # as long as they agree
    for heard in ((0, 1), (0, 1, 2)):
        fix, covariance, _, _ = Sea(noise=noise, outliers=(-3.0, 25.0), heard=heard).measured()
        without = Sea(noise=noise, heard=heard).measured()[1]
        off = (fix - SOURCE)[:2]
        assert off @ np.linalg.solve(without[:2, :2], off) > 50.0
        assert (np.diag(covariance) > 20.0 * np.diag(without)).all()
        assert off @ np.linalg.solve(covariance[:2, :2], off) < 20.0


@pytest.mark.parametrize("left_m", [0.0, 1e-16, 1e-4])
def test_a_fix_at_the_array_has_no_direction_to_turn(left_m: float) -> None:
    """A clock that is off may leave nothing of a range; rounding of the rest is not a direction."""
    early = np.zeros(COLUMNS)
    early[10] = left_m / SOUND - np.linalg.norm(SOURCE - STATIONS[1]) / SOUND
    for quiet in (True, False):
        found = Sea(early, heard=(1,), quiet=quiet).measured()
        assert all(np.isfinite(it).all() for it in found)
        assert np.abs(found[2][:, 1]).max() < 1e-3 + left_m  # by a turn


def beacon(wrong: Array, place: Array, **told: int) -> tuple[Array, Array, Array, Array]:
    """Return what an AUV makes of itself of a ping of the ASV at (30, -20, 0), all quiet but what
    is wrong: heading, GNSS along x and y, sound speed, clock and its drift.
    """
    source, at, yaw = np.array([30.0, -20.0, 0.0]), 7.0, 0.7
    way = np.linalg.norm(source - place) / SOUND
    ping, reception = blank(PING, 1), np.zeros(1, dtype=RECEPTION)
    ping["x_m"], ping["y_m"], ping["z_m"] = source
    ping["sent_at_s"] = at - way
    reception["arrived_at_s"], reception["travel_time_s"] = at, way
    own = HeardBeacon(ping[0], reception[0], tuple(place.tolist()), yaw, np.zeros(20))
    instrument = instrument_of("oem5", (0.0, 0.0, 0.0, (0.0, 0.0, 0.0), 0.0), wrong[3])
    one = Instrument(instrument.array[0], instrument.metric[0], instrument.levels[0])
    levels, sds = np.zeros(1, dtype=SYSTEMATIC), SDS[[0, *[1] * 2, *range(3, 12)]]
    for kind in ("misalignment", "gnss", "sound_speed", "clock", "slow"):
        levels[f"{kind}_at"] = NONE
    tell(levels, sds, misalignment=0, gnss=1, sound_speed=3, clock=4)
    systematic = Systematic(
        levels[0], SDS[[0, 3, 4, 9, 10, 11]] ** 2, wrong[:1], wrong[1:3].reshape(1, 1, 2),
        wrong[None, 4:],
    )  # fmt: skip
    return located_with_errors(own, one, systematic)


@pytest.mark.parametrize("column", range(6))
def test_a_fix_of_oneself_moves_with_what_is_wrong_as_it_says(column: int) -> None:
    """J equals differences, and how it changes from place to place."""
    place, count = np.array([-4.0, 9.0, 15.0]), 6
    sd = SDS[[0, 3, 4, 9, 10, 11]][column]
    step = 1e-3 * sd * np.eye(count)[column]
    jacobian = beacon(0.0 * step, place)[2]
    found = (beacon(step, place)[0] - beacon(-step, place)[0]) / (2.0 * step[column])
    own = jacobian[:, column]
    assert found == pytest.approx(own, rel=2e-3, abs=2e-3 * np.abs(own).max())
    assert np.abs(own).max() > 0.0
    for axis in range(2):
        aside = 1e-3 * np.eye(3)[axis]
        there = beacon(0.0 * step, place + aside)[2][:2, column]
        told = jacobian[:2, count * (1 + axis) + column]
        largest = np.abs(jacobian[:2, count : 3 * count].reshape(2, 2, count)[..., column]).max()
        assert (there - own[:2]) / 1e-3 == pytest.approx(told, abs=0.2 * largest + 1e-6)
