"""Teams without a vessel against the least squares of all that they measured, by GTSAM."""

from itertools import starmap
from math import atan2, hypot
from typing import Any

import numpy as np
import pytest
from test_team import covariances, held, places, ranges

from bindusbl_des import Result, simulate

gtsam = pytest.importorskip("gtsam", reason="the optimum is GTSAM's, the extra `replay`")

FIVE = [[0.0, 0.0], [150.0, 20.0], [-30.0, 180.0], [120.0, 150.0], [-110.0, -40.0]]
DEPTHS = [5.0, 40.0, 80.0, 20.0, 60.0]
FINE = {
    "tdoa_sd_s": 1e-9, "travel_time_sd_s": 1e-6, "quantum_s": 0.0, "roll_sd_deg": 0.002,
    "pitch_sd_deg": 0.002, "heading_sd_deg": 0.002,
}  # fmt: skip
KINDS = {
    "ranges": {"kind": "owtt"},
    "ranges and bearings": {"kind": "owtt", "bearing": "array"},
    "bearings, elevations, depth differences": {"kind": "angles", "bearing": "array"},
}


def team(kind: str, sd_m: float, seed: int, **changes: Any) -> Result:
    """Five AUVs that lie still beyond all vessels, and take themselves for elsewhere by so much."""
    navigation = {"initial_position_sd_m": sd_m, "depth_sd_m": 0.0, "nis_gate": None}
    peers = {**KINDS[kind], "every_s": 4.0, "fusion": "centralised"}
    return simulate(
        held(FIVE, peers, survey={"depths_m": DEPTHS}, navigation=navigation, **changes), seed
    )


def optimum(result: Result, sd_m: float) -> tuple[Any, Any]:
    """Return the places (n, 2), m, that first places and all measurements say together by the last
    instant of the tracks, and the covariances (n, 2, 2), m2, of these.
    """
    tracks = result.tables["tracks"]
    first = tracks[(tracks.time_s == 0.0) & tracks.vehicle.str.startswith("AUV")]
    began = first[["estimate_x_m", "estimate_y_m"]].to_numpy()
    graph, guess = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for auv, place in enumerate(began):
        graph.add(gtsam.PriorFactorPoint2(auv, place, gtsam.noiseModel.Isotropic.Sigma(2, sd_m)))
        guess.insert(auv, place)
    told = ranges(result)
    for row in told[told.heard_at_s <= tracks.time_s.max()].itertuples():
        for factor in starmap(seen_by(row), measured(row)):
            graph.add(factor)
    exact = gtsam.GaussNewtonParams()
    exact.setRelativeErrorTol(1e-15)
    exact.setAbsoluteErrorTol(1e-15)
    best = gtsam.GaussNewtonOptimizer(graph, guess, exact).optimize()
    marginals = gtsam.Marginals(graph, best)
    every = range(len(began))
    return np.array([best.atPoint2(auv) for auv in every]), np.array(
        [marginals.marginalCovariance(auv) for auv in every]
    )


def measured(row: Any) -> list[tuple[Any, float, float]]:
    """Return what a row says, of what there is: how it follows from the way to the sender and how
    much deeper that is, the measurement, and its standard deviation.
    """
    found = [
        (lambda x, y, z: hypot(x, y, z), row.range_m, row.range_sd_m),
        (lambda x, y, z: atan2(y, x), np.radians(row.azimuth_deg), np.radians(row.azimuth_sd_deg)),
        (
            lambda x, y, z: atan2(z, hypot(x, y)),
            np.radians(row.elevation_deg),
            np.radians(row.elevation_sd_deg),
        ),
    ]
    return [(says, value, sd) for says, value, sd in found if value is not None and value == value]


def seen_by(row: Any) -> Any:
    """Return what makes a factor of a measurement between two places."""
    whose = [int(row.auv[3:]), int(row.sender[3:])]

    def factor(says: Any, value: float, sd: float) -> Any:
        def error(_: Any, values: Any, slopes: Any) -> Any:
            x, y = values.atPoint2(whose[1]) - values.atPoint2(whose[0])
            z = row.depth_difference_m
            if slopes is not None:
                step = 1e-4
                one, other = (
                    (says(x + dx, y + dy, z) - says(x - dx, y - dy, z)) / (2.0 * step)
                    for dx, dy in ((step, 0.0), (0.0, step))
                )
                slopes[0], slopes[1] = np.array([[-one, -other]]), np.array([[one, other]])
            off = says(x, y, z) - value
            if says(x, y, z) != hypot(x, y, z):
                off = (off + np.pi) % (2.0 * np.pi) - np.pi
            return np.array([off])

        return gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, sd), whose, error)

    return factor


@pytest.mark.parametrize("kind", KINDS)
def test_where_it_is_linear_a_team_is_where_least_squares_say(kind: str) -> None:
    """To 1e-6 m: AUVs that know their places to a centimetre, and measure each other as well."""
    sd = 0.01
    result = team(kind, sd, 2, usbl=FINE)
    assert len(ranges(result)) > 150
    best, spreads = optimum(result, sd)
    moved = places(result) - np.array(FIVE)
    assert np.abs(moved).max() > 3e-3
    assert np.abs(places(result) - best).max() < 1e-6
    assert np.abs(covariances(result) - spreads).max() < 1e-3 * sd**2


@pytest.mark.parametrize("kind", KINDS)
def test_where_it_is_not_a_team_is_within_the_spread_of_that(kind: str) -> None:
    """Unsure by 3 m at first, by the errors of a usual array: within 0.7 sd of what it states."""
    result = team(kind, 3.0, 1)
    best, _ = optimum(result, 3.0)
    off = places(result) - best
    spread = covariances(result)
    squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread), off)
    assert squares.max() < 0.5
    assert np.trace(spread, axis1=1, axis2=2).max() < 2.0 * 3.0**2
