"""A fix that an AUV makes of itself: a mirror image, with the AUV's own errors and the ASV's."""

import math
from typing import Any

import numpy as np
import pytest
from worlds import QUIET_USBL, merged, still

from bindusbl_des import Result, simulate

PASSIVE = {"protocol": {"ranging": "passive"}}
LASTING: dict[str, dict[str, Any]] = {
    "misalignment": {"usbl": {"misalignment_sd_deg": 3.0}},
    "heading": {"navigation": {"heading_sd_deg": 2.0}},
    "gnss": {"usbl": {"gnss_correlated_sd_m": 0.8}},
    "sound_speed": {"environment": {"assumed_sound_speed_m_per_s": 1530.0}},
    "clock": {"navigation": {"clock_offset_sd_s": 5e-4, "clock_drift_sd": 1e-5}},
}
LASTING_TURNS = LASTING["misalignment"], LASTING["heading"]


def held(**changes: Any) -> tuple[Result, dict[str, Any]]:
    """Return a mission of AUVs that hold 20 m from the ASV in their midst, without other noise; and
    of each its fixes, with what was wrong as it heard each ping.
    """
    base = {"usbl": QUIET_USBL, "duration_s": 30.0, **PASSIVE}
    result = simulate(still(2, **merged(base, changes)), 4)
    both = result.tables["fixes"].merge(result.tables["receptions"], on=["ping", "auv"])
    each = {auv: both[both.auv == auv] for auv in ("AUV0", "AUV1")}
    assert min(map(len, each.values())) > 10
    return result, each


@pytest.mark.parametrize(
    "changes", [LASTING["misalignment"], LASTING["heading"], merged(*LASTING_TURNS)]
)
def test_misalignments_and_compasses_are_the_auvs(changes: dict[str, Any]) -> None:
    """Each AUV takes the ASV for turned by its own errors, and itself for turned about the ASV."""
    turns = []
    for own in held(**changes)[1].values():
        turns.append(math.radians(own.misalignment_deg.iloc[0]))
        assert np.arctan2(own.y_m, own.x_m).to_numpy() == pytest.approx(
            np.full(len(own), turns[-1]), abs=1e-3
        )
    assert abs(turns[0]) > 1e-3 < abs(turns[1] - turns[0])


def test_a_late_clock_takes_ways_for_shorter() -> None:
    """The AUV hears a ping when its clock still says earlier: by c (offset + drift t)."""
    for own in held(**LASTING["clock"])[1].values():
        found = np.sqrt(own.x_m**2 + own.y_m**2 + own.z_m**2) - math.hypot(20.0, 10.0)
        late = own.clock_late_s.to_numpy()
        assert found.to_numpy() == pytest.approx(-1500.0 * late, abs=1e-3)
        assert np.diff(late) / np.diff(own.valid_at_s) == pytest.approx(
            np.full(len(own) - 1, (late[-1] - late[0]) / np.ptp(own.valid_at_s)), rel=1e-3
        )


def test_where_the_asv_takes_itself_for_is_of_the_instant_at_which_it_pings() -> None:
    """Which is one for all that hear it."""
    slow = {"gnss_correlated_sd_m": 0.8, "gnss_time_constant_s": 20.0}
    one, other = held(usbl=slow)[1].values()
    for own in (one, other):
        off = own[["gnss_error_x_m", "gnss_error_y_m"]].to_numpy()
        assert own[["x_m", "y_m"]].to_numpy() - (20.0, 0.0) == pytest.approx(off, abs=0.02)
        assert np.abs(off).max() > 0.1
    both = one.merge(other, on="ping")
    assert (both.gnss_error_x_m_x == both.gnss_error_x_m_y).all()


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
