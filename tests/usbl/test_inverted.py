"""A fix that an AUV makes of itself: a mirror image, with the AUV's own errors and the ASV's."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_usbl import instrument
from worlds import QUIET_USBL, merged, scenario, still

from bindusbl_des import Result, Scenario, Setup, simulate
from bindusbl_des.core.streams import Streams
from bindusbl_des.mission.closed_loop import slow_gnss
from bindusbl_des.mission.sensor_errors import clocks, misalignments, systematic_errors_of
from bindusbl_des.records.rows import PING, RECEPTION
from bindusbl_des.usbl.inverted import HeardBeacon, located_astray, located_itself
from bindusbl_des.usbl.measuring import Instrument
from bindusbl_des.vehicles.currents import CONTROL_S

PASSIVE = {"protocol": {"ranging": "passive"}}
LASTING: dict[str, dict[str, Any]] = {
    "misalignment": {"usbl": {"misalignment_sd_deg": 3.0}},
    "heading": {"navigation": {"heading_sd_deg": 2.0}},
    "gnss": {"usbl": {"gnss_correlated_sd_m": 0.8}},
    "sound_speed": {"environment": {"assumed_sound_speed_m_per_s": 1530.0}},
    "clock": {"navigation": {"clock_offset_sd_s": 5e-4, "clock_drift_sd": 1e-5}},
}
LASTING_TURNS = LASTING["misalignment"], LASTING["heading"]
COORDINATE = st.floats(-80.0, 80.0)


def heard(source: Any, place: Any, yaw: float, noise: Any, at: float = 7.0) -> HeardBeacon:
    """Return what an AUV hears of a ping at an instant (s), in water of 1500 m/s."""
    way = math.dist(source, place) / 1500.0
    ping, it = np.zeros(1, dtype=PING), np.zeros(1, dtype=RECEPTION)
    ping[0]["x_m"], ping[0]["y_m"], ping[0]["z_m"] = source
    ping[0]["sent_at_s"] = at - way
    it[0]["arrived_at_s"], it[0]["travel_time_s"] = at, way
    x, y, z = map(float, place)
    return HeardBeacon(ping[0], it[0], (x, y, z), yaw, np.array(noise))


@settings(max_examples=60, deadline=None)
@given(
    source=st.tuples(COORDINATE, COORDINATE), place=st.tuples(COORDINATE, COORDINATE),
    depth=st.floats(3.0, 60.0), yaw=st.floats(-3.0, 3.0), seed=st.integers(0, 99),
)  # fmt: skip
def test_a_fix_of_oneself_is_the_mirror_image_of_a_fix_of_the_source(
    source: Any, place: Any, depth: float, yaw: float, seed: int
) -> None:
    """Both are off by the same, in opposite directions, and as sure of it: the array is one."""
    usbl = instrument(gnss_sd=0.0)
    noise = np.random.default_rng(seed).standard_normal(12)
    above, below = np.array([*source, 0.0]), np.array([*place, depth])
    own = heard(above, below, yaw, noise)
    fix, covariance = located_itself(own, Instrument(usbl.array, usbl.metric, usbl.levels[0]))
    of_source, other = usbl.locate(above, below, yaw, own.reception["travel_time_s"], noise)
    assert fix - below == pytest.approx(-(of_source - above), abs=1e-9)
    assert covariance == pytest.approx(other, rel=1e-12)


@pytest.mark.parametrize("name", LASTING)
def test_effects_are_what_lasting_errors_make_of_a_fix(name: str) -> None:
    """J c is how a fix moves with c, by differences; and the covariance contains it."""
    world = scenario(**merged(LASTING[name], {**PASSIVE, "usbl": QUIET_USBL}))
    systematic = systematic_errors_of(Setup(world), Streams(3))
    assert systematic is not None
    c0 = 1500.0 if name != "sound_speed" else 1530.0
    usbl = instrument(
        tdoa_sd=0.0, travel_time_sd=0.0, quantum=0.0, attitude_sd=(0.0, 0.0, 0.0),
        sound_speed=c0, true_sound_speed=1500.0,
    )  # fmt: skip
    parts = Instrument(usbl.array, usbl.metric, usbl.levels[0])
    own = heard((30.0, -20.0, 0.0), (-4.0, 9.0, 15.0), 0.7, np.zeros(20))
    told = systematic._replace(levels=systematic.levels[0])
    fix, covariance, jacobians, left = located_astray(own, parts, told)
    error = np.array(fix) - own.place
    truth = {
        "misalignment": lambda: systematic.misalignments[:1],
        "heading": lambda: systematic.misalignments[:1],
        "gnss": lambda: systematic.gnss[0, int(own.ping["sent_at_s"] / CONTROL_S)],
        "sound_speed": lambda: np.array([1.0 - 1500.0 / 1530.0]),
        "clock": lambda: systematic.clocks[0],
    }[name]()
    count, step = len(systematic.variances), 1e-3
    moved = jacobians[:, count : 3 * count].reshape(3, 2, count)
    bend = jacobians[:, 3 * count : 4 * count]
    columns, jacobians = jacobians[:, : len(truth)], jacobians[:, :count]
    size = np.linalg.norm(error)
    assert size > 0.05
    # but for the second order of a turn by 8 deg, and a plane wave taken for a sphere
    assert columns @ truth == pytest.approx(error, abs=0.1 * size)
    spread = jacobians @ np.diag(systematic.variances) @ jacobians.T
    spread += bend @ np.diag(0.75 * systematic.variances**2) @ bend.T
    assert covariance == pytest.approx(spread, abs=1e-6 + 1e-3 * np.abs(spread).max())
    assert left == pytest.approx(np.zeros(3), abs=1e-6 + 1e-3 * np.abs(spread).max())
    for axis in range(2):
        aside = np.array((-4.0, 9.0, 15.0)) + step * np.eye(3)[axis]
        there = heard((30.0, -20.0, 0.0), aside, 0.7, np.zeros(20))
        other = located_astray(there, parts, told)[2]
        found = (other[:2, :count] - jacobians[:2]) / step
        largest = np.abs(moved[:2]).max()
        assert found == pytest.approx(moved[:2, axis], abs=0.2 * largest + 1e-6)


def held(seed: int, **changes: Any) -> tuple[Scenario, Result]:
    """Return a mission of AUVs that hold 20 m from the ASV in their midst, without other noise."""
    base = {"usbl": QUIET_USBL, "duration_s": 30.0, **PASSIVE}
    world = still(2, **merged(base, changes))
    return world, simulate(world, seed)


@pytest.mark.parametrize(
    "changes", [LASTING["misalignment"], LASTING["heading"], merged(*LASTING_TURNS)]
)
def test_misalignments_and_compasses_are_the_auvs(changes: dict[str, Any]) -> None:
    """Each AUV takes the ASV for turned by its own errors, and itself for turned about the ASV."""
    world, result = held(4, **changes)
    fixes = result.tables["fixes"]
    for auv, turn in enumerate(misalignments(Setup(world), Streams(4))):
        own = fixes[fixes.auv == f"AUV{auv}"]
        assert np.arctan2(own.y_m, own.x_m).to_numpy() == pytest.approx(
            np.full(len(own), turn), abs=1e-3
        )


def test_a_late_clock_takes_ways_for_shorter() -> None:
    """The AUV hears a ping when its clock still says earlier: by c (offset + drift t)."""
    world, result = held(4, **LASTING["clock"])
    fixes = result.tables["fixes"]
    for auv, (offset, drift) in enumerate(clocks(Setup(world), Streams(4))):
        own = fixes[fixes.auv == f"AUV{auv}"]
        found = np.sqrt(own.x_m**2 + own.y_m**2 + own.z_m**2) - math.hypot(20.0, 10.0)
        late = offset + drift * own.valid_at_s
        assert found.to_numpy() == pytest.approx(-1500.0 * late.to_numpy(), abs=1e-3)


def test_where_the_asv_takes_itself_for_is_of_the_instant_at_which_it_pings() -> None:
    world, result = held(4, usbl={"gnss_correlated_sd_m": 0.8, "gnss_time_constant_s": 20.0})
    [astray], fixes = slow_gnss(Setup(world), Streams(4)), result.tables["fixes"]
    off = astray[(fixes.pinged_at_s / CONTROL_S).astype(int)]
    assert fixes[["x_m", "y_m"]].to_numpy() - (20.0, 0.0) == pytest.approx(off, abs=0.02)


@pytest.mark.parametrize(
    "name", ["all", *(pytest.param(name, marks=pytest.mark.slow) for name in LASTING)]
)
def test_fixes_know_of_what_lasts(name: str) -> None:
    """Over many seeds, the errors of the last fix agree with its covariance (NEES 2)."""
    changes: dict[str, Any] = {}
    for key in LASTING if name == "all" else [name]:
        changes = merged(changes, LASTING[key])
    if name in ("sound_speed", "all"):  # is no random number: as large as it is said to be, or less
        changes["environment"] = {"assumed_sound_speed_m_per_s": 1500.5}
    world = still(4, **merged({"duration_s": 2.0, **PASSIVE}, changes))
    squares = []
    for seed in range(60):
        fixes = simulate(world, seed).tables["fixes"]
        for it in fixes.drop_duplicates("auv", keep="last").itertuples():
            error = np.array([it.x_m - 20.0, it.y_m])
            covariance = [[it.sd_x_m**2, it.cov_xy_m2], [it.cov_xy_m2, it.sd_y_m**2]]
            squares.append(error @ np.linalg.solve(covariance, error))
    # four AUVs of a mission share the ASV's GNSS: as many as 60 to 240 independent draws of 2
    assert np.mean(squares) == pytest.approx(2.0, abs=4 * math.sqrt(4 / 120))
