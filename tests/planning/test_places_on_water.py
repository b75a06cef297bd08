"""Where plans put vessels, and where vessels and AUVs go, in drawn bays: never ashore (shapely)."""

from typing import Any

import numpy as np
import pytest
import shapely
from bays_for_tests import Bay, drawn_bay
from plans_for_tests import team_in

from bindusbl_des import Scenario, simulate
from bindusbl_des.apps.planning import teams

LANES = {"route": {"lane_spacing_m": 30.0}}


def mission(bay: Bay, **keys: Any) -> Scenario:
    hf = {"hf": {"range_m": 60.0}}
    given = {"duration_s": 100.0, "survey": bay.survey, "auvs": {"count": 2, **LANES}, **keys}
    return Scenario(name="bay", acoustics=hf, **given)


def ashore(bay: Bay, places: Any) -> int:
    """Return how many places (n, 2), m, lie more than a millimetre within land or keep-outs."""
    return int(shapely.contains_xy(shapely.buffer(bay.closed, -1e-3), places).sum())


@pytest.mark.parametrize("seeds", [[4], pytest.param(range(5, 60), marks=pytest.mark.slow)])
def test_all_that_a_plan_tries_lies_on_the_water(seeds: Any) -> None:
    """Rings, free places and single vessels: every station of every team, near land as well."""
    placed, near = 0, 0
    for seed in seeds:
        bay = drawn_bay(seed)
        question = team_in(mission(bay, asvs={"count": 2}, auvs={"count": 1, **LANES})).question
        tried = [team.stations for team in teams.proposed(question, lambda _: None)]
        places = np.concatenate([stations for stations in tried if len(stations)])
        assert not ashore(bay, places), seed
        placed += len(places)
        if not bay.closed.is_empty:
            away = shapely.distance(bay.closed, shapely.points(places))
            near += int((away < 20.0).sum())
    assert placed > 20 * len(seeds)
    assert near > 2 * len(seeds)


@pytest.mark.parametrize("model", ["follow", "assign", "zigzag", "visit", "information"])
@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(6, 200), marks=pytest.mark.slow)])
def test_whatever_moves_keeps_to_the_water(model: str, seeds: range) -> None:
    """Vessels of each placement that moves, and AUVs on their lanes, at every instant on record."""
    gone = 0.0
    for seed in seeds:
        bay = drawn_bay(seed)
        formation = {"model": model, "speed_m_per_s": 2.0}
        moving = mission(bay, asvs={"count": 2, "formation": formation})
        tracks = simulate(moving, seed).tables["tracks"]
        assert not ashore(bay, tracks[["x_m", "y_m"]].to_numpy()), seed
        own = tracks[tracks.vehicle == "ASV0"]
        gone += float(np.hypot(np.diff(own.x_m), np.diff(own.y_m)).sum())
    assert gone > 20.0 * len(seeds)
