"""What Kalman filter and smoother know, as all that was measured by then says: one Gaussian vector.

Errors of dead reckoning at any instants are jointly normal, by covariances that are written down
here; an estimate is their mean, conditioned on all fixes delivered by then.
"""

import math
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from worlds import QUIET_NAVIGATION, merged, scenario, still

from bindusbl_des import Odometry, Result, Sounding, simulate

Array = NDArray[np.float64]
START, WALK, DRAWN = 0.5, 0.03, 0.1  # m, m/sqrt(s), m/s


def measured(sounding: Sounding) -> tuple[Array, Array]:
    """Measure the place with errors of any shape."""
    fixes, spreads = [], []
    for _ in sounding.asvs:
        half = sounding.random.normal(0.0, 0.5, (3, 3))
        spreads.append(half @ half.T + 0.1 * np.eye(3))
        fixes.append(sounding.random.multivariate_normal(sounding.source, spreads[-1]))
    return np.array(fixes), np.array(spreads)


class Keeping:
    """A navigator of one's own that keeps what dead reckoning told."""

    last: ClassVar[Any]

    def __init__(self, reckoning: Any, auvs: int) -> None:
        Keeping.last = reckoning

    def correct(self, fixes: Any, due: Any) -> None:
        pass

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        return odometry.position

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        return np.zeros((len(odometry.times), 3))


def flown(name: Any, **changes: Any) -> Result:
    """Fly AUVs at the surface, which have fixes by GNSS before others that come late."""
    base: dict[str, Any] = {
        "duration_s": 40.01,
        "survey": {"side_m": 60.0, "depth_m": 0.3},
        "auvs": {"count": 2},
        "asvs": {"count": 2},
        "acoustics": {"mf": {"bit_rate_bps": 300.0}},
        "usbl": {"model": measured},
        "navigation": {
            "filter": name, "gnss_fix": {"every_s": 1.9, "sd_m": 1.5}, "nis_gate": None,
            "initial_position_sd_m": START, "random_walk_m_per_sqrt_s": WALK,
            "velocity_bias_m_per_s": [0.0, 0.0], "velocity_bias_sd_m_per_s": DRAWN,
        },
        "record": {"tracks_hz": 0.3},
    }  # fmt: skip
    return simulate(scenario(**merged(base, changes)), 3)


def integrals(first: Array, second: Array, lasts: float) -> Array:
    """Return the covariances of a Gauss-Markov process's integrals up to instants (s), per
    variance.
    """
    low, high = np.minimum.outer(first, second), np.maximum.outer(first, second)
    decay = np.exp(-low / lasts) + np.exp(-high / lasts) - np.exp(-(high - low) / lasts)
    return lasts**2 * (2.0 * low / lasts - 1.0 + decay)


def covariances(one: Odometry, other: Odometry, what: str) -> Array:
    """Return those of errors of dead reckoning (2 n, 2 m), m2, x and y of each instant in turn."""
    low = np.minimum.outer(one.times, other.times)
    high = np.maximum.outer(one.times, other.times)
    alike = START**2 + WALK**2 * low
    if what == "wandering":
        alike = alike + DRAWN**2 * integrals(one.times, other.times, 15.0)
    elif what != "body":
        alike = alike + DRAWN**2 * low * high
    if what == "current":
        alike = alike + CURRENT**2 * low * high
        alike = alike + 2 * CURRENT**2 / LASTS * (low**2 * high / 2 - low**3 / 6)
    found = np.kron(alike, np.eye(2))
    if what == "body":
        turns = [
            np.array([[[c, -s], [s, c]] for c, s in it.headings]).reshape(-1, 2)
            for it in (one, other)
        ]
        found += DRAWN**2 * turns[0] @ turns[1].T
    return found


CURRENT, LASTS = 0.05, 600.0  # m/s, s
KINDS: dict[str, dict[str, Any]] = {
    "body": {"navigation": {"bias_frame": "body"}},
    "world": {"navigation": {"bias_frame": "world"}},
    "wandering": {"navigation": {"bias_frame": "world", "velocity_bias_time_constant_s": 15.0}},
    "current": {
        "navigation": {"bias_frame": "world", "velocity": "through_water"},
        "environment": {
            "current_variation_m_per_s": CURRENT, "current_variation_time_s": LASTS,
        },
    },
}  # fmt: skip
FILTERS: dict[str, tuple[Any, float]] = {
    "kalman": ("kalman", 0.0),
    "at once": ({"model": "smoother", "lag_s": 0.0}, 0.0),
    "lag": ({"model": "smoother", "lag_s": 7.0}, 7.0),
    "smoother": ("smoother", math.inf),
}


def fixes_of(result: Result, auv: str) -> pd.DataFrame:
    """Return all fixes of an AUV, by whatever they were made."""
    own = result.tables["fixes"].query("auv == @auv and outcome == 'delivered'")
    gnss = result.tables["gnss_fixes"].query("auv == @auv")
    by_gnss = gnss.assign(
        valid_at_s=gnss.fixed_at_s, delivered_at_s=gnss.fixed_at_s, sd_x_m=gnss.sd_m,
        sd_y_m=gnss.sd_m, cov_xy_m2=0.0,
    )  # fmt: skip
    names = ["valid_at_s", "delivered_at_s", "x_m", "y_m", "sd_x_m", "sd_y_m", "cov_xy_m2"]
    return pd.concat([own[names], by_gnss[names]])


def check(result: Result, reckoning: Any, kind: str, lag: float) -> None:
    """See that estimates are what all fixes say that were delivered up to the lag (s) later."""
    for number in range(2):
        fixes = fixes_of(result, f"AUV{number}")
        assert len(fixes) > 25
        assert not fixes.sort_values("delivered_at_s").valid_at_s.is_monotonic_increasing
        track = result.tables["tracks"].query(f"vehicle == 'AUV{number}'")
        for row in track.itertuples():
            known = fixes[fixes.delivered_at_s <= row.time_s + lag]
            told = reckoning.odometry(number, known.valid_at_s.to_numpy())
            now = reckoning.odometry(number, np.array([row.time_s]))
            off = told.position - known[["x_m", "y_m"]].to_numpy()
            noise = np.zeros((2 * len(known), 2 * len(known)))
            for n, it in enumerate(known.itertuples()):
                own = [[it.sd_x_m**2, it.cov_xy_m2], [it.cov_xy_m2, it.sd_y_m**2]]
                noise[2 * n : 2 * n + 2, 2 * n : 2 * n + 2] = own
            beside = covariances(now, told, kind)
            gain = np.linalg.solve(covariances(told, told, kind) + noise, beside.T).T
            place = now.position[0] - gain @ off.ravel()
            spread = covariances(now, now, kind) - gain @ beside.T
            assert [row.estimate_x_m, row.estimate_y_m] == pytest.approx(place, abs=1e-6)
            assert [row.estimate_sd_x_m**2, row.estimate_sd_y_m**2, row.estimate_cov_xy_m2] == (
                pytest.approx([spread[0, 0], spread[1, 1], spread[0, 1]], abs=1e-7)
            )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FILTERS)
def test_estimates_are_the_means_of_all_that_is_known(name: str, kind: str) -> None:
    """And as sure, whether fixes come in turn or not."""
    chosen, lag = FILTERS[name]
    flown(Keeping, **KINDS[kind])
    check(flown(chosen, **KINDS[kind]), Keeping.last, kind, lag)


def test_what_comes_too_late_for_its_place_is_left_out_till_afterwards() -> None:
    """A filter remembers its last 16 fixes: one that holds before them has no effect; a smoother
    weighs it all the same.
    """
    many = merged(
        KINDS["world"], {"navigation": {"gnss_fix": {"every_s": 0.05}}, "duration_s": 9.01}
    )

    flown(Keeping, **many)
    smoothed = flown("smoother", **many)
    check(smoothed, Keeping.last, "world", math.inf)
    fixes = flown("kalman", **many).tables["fixes"].query("outcome == 'delivered'")
    assert len(fixes) > 2
    assert fixes[["innovation_m", "nis", "correction_m"]].isna().all(axis=None)


def astray(sounding: Sounding) -> tuple[Array, Array]:
    """Take everybody for 30 m farther along x."""
    count = len(sounding.asvs)
    return sounding.source + np.tile((30.0, 0.0, 0.0), (count, 1)), np.tile(
        np.eye(3) / 4, (count, 1, 1)
    )


def noisy(sounding: Sounding) -> tuple[Array, Array]:
    """Measure as well as it says."""
    return sounding.source + sounding.random.normal(0.0, 0.5, (1, 3)), np.eye(3)[None] / 4


def gated(usbl: Any, **navigation: Any) -> Result:
    """Fly an AUV that keeps its place and knows it, as far as it knows."""
    told = {"model": "kalman", "random_walk_m_per_sqrt_s": 0.01, **navigation.pop("told")}
    return simulate(
        still(
            1, duration_s=70.0, usbl={"model": usbl},
            navigation={**QUIET_NAVIGATION, "filter": told, **navigation},
            record={"tracks_hz": 20.0}, protocol={"tick_rate_hz": None},
        ),
        1,
    )  # fmt: skip


def test_a_wild_fix_is_refused_and_a_lost_navigator_comes_back() -> None:
    """One outlier changes nothing; when everything looks like one, the belief gives way."""
    result = gated(astray, told={"initial_position_sd_m": 0.1}, nis_gate=9.21)
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    track = result.tables["tracks"].query("vehicle == 'AUV0'")
    assert fixes.correction_m.isna().tolist()[:6] == 5 * [True] + [False]
    assert fixes.correction_m.iloc[5] == pytest.approx(30.0, abs=0.2)
    assert (fixes.nis[:5] > 1000).all()
    assert fixes.nis.iloc[5] == pytest.approx(9.21, abs=0.1)
    before = track[track.time_s < fixes.delivered_at_s.iloc[5]]
    assert (before.estimate_x_m == 20.0).all()
    # so that the NIS of the sixth is 9.21: 30 m squared over that, less the fix's own variance
    unsure = before.time_s > fixes.delivered_at_s.iloc[4]
    assert (before[~unsure].estimate_sd_x_m < 0.3).all()
    assert before[unsure].estimate_sd_x_m.to_numpy() ** 2 == pytest.approx(
        900 / 9.21 - 0.25, abs=0.1
    )
    after = track[track.time_s > fixes.delivered_at_s.iloc[5]].iloc[0]
    assert after.estimate_x_m == pytest.approx(50.0, abs=0.2)


def test_a_gate_that_refuses_good_fixes_makes_nobody_unsure() -> None:
    """Of a gate below all that fixes err by, each sixth passes."""
    result = gated(noisy, told={"initial_position_sd_m": 0.5}, nis_gate=5e-324)
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    track = result.tables["tracks"].query("vehicle == 'AUV0'")
    assert np.flatnonzero(fixes.correction_m.notna()).tolist() == [*range(5, len(fixes), 6)]
    late = track[track.time_s > 1.0].estimate_sd_x_m
    assert 0.1 < late.min() <= late.max() < 1.5
