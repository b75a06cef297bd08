"""Where few ASVs serve the AUVs of a scenario: hand-worked places, brute force, and rings."""

import math
from typing import Any

import numpy as np
import pytest
from plans_for_tests import inputs_of
from worlds import scenario

from bindusbl_des import Scenario, Setup, formation
from bindusbl_des.apps.planning.placement import best_ring, free_places, objective_of, reach_of


def holding(*places: tuple[float, float], **changes: Any) -> Scenario:
    """AUVs that hold at places (m), for a minute, in a survey of 200 m; HF 40 m, MF far."""
    auvs = {"count": len(places), "route": {"kind": "hold", "positions_m": [*map(list, places)]}}
    return scenario(
        duration_s=60.0,
        survey={"side_m": 200.0},
        auvs=auvs,
        acoustics={"hf": {"range_m": 40.0}, "mf": {"range_m": 400.0}},
        **changes,
    )


def test_two_asvs_serve_two_pairs_of_auvs() -> None:
    """Each lies within reach of both AUVs of its pair."""
    world = holding((-80.0, 60.0), (-60.0, 60.0), (70.0, -80.0), (70.0, -50.0))
    inputs = inputs_of(Setup(world))
    value = objective_of("coverage", inputs)
    found = free_places(Setup(world), 2, inputs=inputs)
    away = np.hypot(*(inputs.ways.places_m[:, 0, None] - found).transpose(2, 0, 1)).min(axis=1)
    assert away.max() <= reach_of(inputs) == 40.0
    radius, angle = best_ring(Setup(world), 2, inputs=inputs)
    assert value(found) <= value(formation(2, radius, math.radians(angle)))
    assert free_places(Setup(world), 2).tolist() == found.tolist()


def test_what_cannot_all_be_heard_is_heard_mostly() -> None:
    """One ASV for three AUVs side by side and one far away: the three are served."""
    world = holding((0.0, 0.0), (20.0, 0.0), (10.0, 15.0), (95.0, 95.0))
    found = free_places(Setup(world), 1)
    away = np.hypot(*(np.array([(0, 0), (20, 0), (10, 15)]) - found).T)
    assert away.max() <= 40.0


def test_free_places_for_information_beat_all_of_a_grid() -> None:
    """Two ASVs about one AUV, on a grid of 15 m: none of its pairs leaves less unknown."""
    world = holding((5.0, -3.0))
    inputs = inputs_of(Setup(world))
    value = objective_of("information", inputs)
    axis = np.arange(-30.0, 31.0, 15.0)
    grid = np.stack(np.meshgrid(axis + 5, axis - 3), axis=-1).reshape(-1, 2)
    best = min(value(grid[[i, j]]) for i in range(len(grid)) for j in range(i))
    assert value(free_places(Setup(world), 2, "information", inputs)) <= 1.02 * best


@pytest.mark.parametrize("objective", ["coverage", "information", "error"])
def test_free_places_are_no_worse_than_the_best_ring_nor_that_than_any_other(
    objective: Any,
) -> None:
    world = scenario(duration_s=100.0, survey={"side_m": 120.0}, auvs={"count": 3})
    inputs = inputs_of(Setup(world))
    value = objective_of(objective, inputs)
    radius, angle = best_ring(Setup(world), 2, objective, inputs)
    ring = value(formation(2, radius, math.radians(angle)))
    others = [
        value(formation(2, float(r), math.radians(a)))
        for r in range(0, 80, 20)
        for a in (0, 60, 120)
    ]
    assert ring <= 1.01 * min(others)
    assert value(free_places(Setup(world), 2, objective, inputs)) <= 1.005 * ring


def test_any_function_of_places_may_be_the_objective() -> None:
    world = holding((0.0, 0.0))
    found = free_places(
        Setup(world), 1, lambda places: float(np.hypot(*(places[0] - (12.0, 34.0))))
    )
    assert found[0] == pytest.approx([12.0, 34.0], abs=0.2)


def test_what_cannot_be_placed_is_told() -> None:
    world = holding((0.0, 0.0))
    with pytest.raises(ValueError, match="there is no objective 'luck'; use one of coverage"):
        free_places(Setup(world), 1, "luck")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="at least one"):
        free_places(Setup(world), 0)
    with pytest.raises(ValueError, match="at least one"):
        best_ring(Setup(world), 0)


def test_how_far_asvs_hear() -> None:
    """A horizontal range as it is; of a slant one what is left at the depth of 10 m."""
    assert reach_of(inputs_of(Setup(holding((0.0, 0.0))))) == 40.0
    slant = scenario(acoustics={"hf": {"range_m": 50.0, "range_metric": "slant"}})
    assert reach_of(inputs_of(Setup(slant))) == pytest.approx(math.sqrt(50.0**2 - 10.0**2))


def test_a_prediction_says_that_it_leaves_failures_out() -> None:
    failing = scenario(asvs={"failures": [{"asv": 1, "at_s": 20.0}]})
    assert (
        "ASVs that fail are taken to serve all the time."
        in inputs_of(Setup(failing)).approximations
    )
    assert not inputs_of(Setup(scenario())).approximations
