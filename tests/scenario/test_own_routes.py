"""Placements and routes of one's own: asked for by whoever wants to know, and checked."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from commands_for_tests import call
from families_for_tests import allow, forbid, home_of
from pydantic import ValidationError

from bindusbl_des import PlanView, Scenario, load_scenario, simulate

OWN = """
import numpy as np
from bindusbl_des import PlanView

def corners(plan: PlanView, *, inset_m: float = 0.0):
    half = plan.side / 2 - inset_m
    return half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])[: plan.asvs]

def ladder(plan: PlanView, *, rungs: int = 3):
    ways = []
    for auv in range(plan.auvs):
        ys = np.linspace(0.0, 30.0, rungs)
        ways.append([(20.0 * (-1) ** k + auv, y) for k, y in enumerate(ys)])
    return ways

def circles(plan: PlanView):
    times = np.arange(0.0, plan.duration + 5.0)
    angle = times * 0.05
    return [
        np.column_stack([times, r * np.cos(angle), r * np.sin(angle), 0 * times + plan.depth])
        for r in 10.0 + np.arange(plan.auvs)
    ]

def still(way):
    (x, y, _), = way.planned([0.0])
    return [(0, x, y, way.depth), (way.duration, x, y, way.depth)]
def exact(way):
    times = np.arange(0.0, way.duration + 3.0, 0.05)
    places = way.planned(way.speed * times)[:, :2]
    return np.column_stack([times, places, 0 * times + way.depth])
def sunk(way): return [(0, 0, 0, 3), (9, 0, 0, 3)]
def narrow(way): return [(0, 0, 0), (9, 0, 0)]
def halts(way): return [(0, 0, 0, 0), (0, 0, 0, 0)]

def short(plan): return [(0, 0)]
def none(plan): pass
def deep(plan): return [(0, 0, 3)] * plan.asvs
def level(plan): return [(0, 0, 0)] * plan.asvs
def far(plan): return [(1e9, 0)] * plan.asvs
def nan(plan): return [(float("nan"), 0)] * plan.asvs
def words(plan): return "here"
def raises(plan): raise KeyError("no")
def one(plan): return [[(0, 0)]] * plan.auvs
def mixed(plan): return [[(0, 0), (5, 5)], [(0, 0, 0, 5), (9, 9, 9, 9)]]
def same(plan): return [[(0, 0), (0, 0)]] * plan.auvs
def back(plan): return [[(1, 0, 0, 5), (0, 1, 1, 5)]] * plan.auvs
def fast(plan): return [[(0, 0, 0, 5), (1, 9999, 1, 5)]] * plan.auvs
def flies(plan): return [[(0, 0, 0, -20), (9, 1, 1, -20)]] * plan.auvs
def hovers(plan): return [[(0, 0, 0, 0), (9, 1, 1, -3)]] * plan.auvs
def away(plan): return [[(900, 0, 0, 5), (901, 1, 1, 5)]] * plan.auvs
"""

MISSION: dict[str, Any] = {
    "name": "m",
    "duration_s": 20.0,
    "auvs": {"count": 2},
    "asvs": {"count": 4},
    "survey": {"side_m": 60.0},
}


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(MISSION))
    yield from home_of(tmp_path, monkeypatch, own_plans=OWN)


def mission(**changes: Any) -> Scenario:
    """Return the mission with other keys of AUVs and ASVs; all parts of one's own are allowed."""
    names = [line.split()[1].split("(")[0] for line in OWN.splitlines() if line.startswith("def ")]
    allow(f"own_plans:{name}" for name in names)
    data = json.loads(json.dumps(MISSION))
    for key, value in changes.items():
        data[key] |= value
    return Scenario.model_validate(data)


def test_asvs_lie_where_the_placement_says() -> None:
    """As with the same positions in the file, to the last bit."""
    own = mission(asvs={"formation": {"model": "own_plans:corners", "inset_m": 5.0}})
    places = [[-25.0, -25.0], [25.0, -25.0], [25.0, 25.0], [-25.0, 25.0]]
    given = mission(asvs={"formation": {"positions_m": places}})
    for name, table in simulate(own, 3).tables.items():
        assert table.equals(simulate(given, 3).tables[name]), name


def test_auvs_go_where_the_route_says() -> None:
    """Way points as those in the file, tracks as places at instants."""
    own = mission(auvs={"route": {"kind": "own_plans:ladder", "rungs": 4}})
    points = [[[20.0 * (-1) ** k + auv, 10.0 * k] for k in range(4)] for auv in range(2)]
    given = mission(auvs={"route": {"kind": "waypoints", "points_m": points}})
    for name, table in simulate(own, 3).tables.items():
        assert table.equals(simulate(given, 3).tables[name]), name
    circling = simulate(mission(auvs={"route": {"kind": "own_plans:circles"}}), 3)
    tracks = circling.tables["tracks"]
    first = tracks[tracks.vehicle == "AUV1"]
    assert np.allclose(np.hypot(first.x_m, first.y_m), 11.0, atol=0.01)


def test_vehicles_with_dynamics_fly_way_points_of_ones_own() -> None:
    own = mission(auvs={"vehicle": "bluerov2", "route": {"kind": "own_plans:ladder"}})
    assert simulate(own, 1).auvs.distance_m.min() > 5.0
    with pytest.raises(ValueError, match="bluerov2 flies way points; with tracks use kinematic"):
        simulate(mission(auvs={"vehicle": "bluerov2", "route": {"kind": "own_plans:circles"}}), 1)


def test_whoever_reads_a_result_asks_nobody(home: Path) -> None:
    """Figures, report, explain and exports of a mission whose plug-ins are gone."""
    own = mission(
        auvs={"route": {"kind": "own_plans:circles"}},
        asvs={"formation": {"model": "own_plans:corners"}},
    )
    simulate(own, 1).write(home / "r")
    (home / "own_plans.py").unlink()
    sys.modules.pop("own_plans")
    forbid()
    for words in (
        ("plot", "r", "coverage", "--out", "c.png"),
        ("plot", "r", "trajectory", "--out", "t.png"),
        ("report", "r", "--out", "r.html", "--no-advice"),
        ("explain", "r", "--ping", 1),
        ("timing", "r/scenario.yaml"),
        ("validate", "r/scenario.yaml"),
        ("sweep", "r/scenario.yaml", "--seeds", 2, "--dry-run"),
    ):
        outcome = call(*words)
        assert outcome.exit_code == 0, (words, outcome.output)
    refused = call("coverage", "r/scenario.yaml")
    assert (refused.exit_code, len(refused.stderr.splitlines())) == (2, 1)
    assert "asvs.formation: 'own_plans:corners' is a plug-in: " in refused.stderr


def test_coverage_asks_the_placement(home: Path) -> None:
    setting = ("--set", "asvs.formation={model: 'own_plans:corners', inset_m: 10}")
    told = call("coverage", "m.yaml", *setting, "--allow-plugins", "--figure", "c.png")
    assert told.exit_code == 0, told.output
    assert "ASV2" in told.stdout
    assert "20.00 m north, 20.00 m east" in " ".join(told.stdout.split())


def test_vehicles_of_ones_own_move_as_they_say() -> None:
    """What goes along its plan exactly is as good as kinematic; what lies still, as moored."""
    own, shipped = simulate(mission(auvs={"vehicle": "own_plans:exact"}), 1), simulate(mission(), 1)
    columns = ["x_m", "y_m"]
    tracks = [it.tables["tracks"].loc[:, columns].to_numpy(float) for it in (own, shipped)]
    assert np.allclose(*tracks, atol=0.02)
    assert own.auvs.distance_m.to_numpy() == pytest.approx(shipped.auvs.distance_m, rel=0.01)
    still = simulate(mission(asvs={"vehicle": "own_plans:still"}), 1)
    assert still.auvs.equals(shipped.auvs)


def test_a_vehicle_of_ones_own_needs_a_way() -> None:
    with pytest.raises(ValidationError, match=r"own_plans:exact flies paths; with a hold route"):
        mission(
            auvs={
                "vehicle": "own_plans:exact",
                "route": {"kind": "hold", "positions_m": [[0, 0], [1, 1]]},
            }
        )
    with pytest.raises(ValidationError, match=r"a own_plans:exact vehicle does not steer"):
        mission(auvs={"vehicle": "own_plans:exact", "feedback": "estimate"})


ROUTE, PLACEMENT = "auvs.route.kind", "asvs.formation.model"
AUV, ASV = "auvs.vehicle", "asvs.vehicle"
PLACES = "it must be places of shape (4, 2), x and y in m, one for each ASV"
WAYS = "it must be a list of 2 arrays, one for each AUV: way points (n, 2)"


@pytest.mark.parametrize(
    ("key", "name", "said"),
    [
        (PLACEMENT, "short", f"returned [(0, 0)]; {PLACES}"),
        (PLACEMENT, "none", f"returned None; {PLACES}"),
        (PLACEMENT, "deep", PLACES),
        (PLACEMENT, "far", PLACES),
        (PLACEMENT, "nan", PLACES),
        (PLACEMENT, "words", PLACES),
        (PLACEMENT, "raises", "raised KeyError: 'no'"),
        (ROUTE, "none", f"returned None; {WAYS}"),
        (ROUTE, "words", WAYS),
        (ROUTE, "one", WAYS),
        (ROUTE, "mixed", WAYS),
        (ROUTE, "short", WAYS),
        (ROUTE, "nan", WAYS),
        (ROUTE, "same", "way points in a row must be 0.001 m apart or more (AUV0)"),
        (ROUTE, "back", "the times of a track must increase (AUV0)"),
        (ROUTE, "fast", "a track must be slower than 1000 m/s; are its columns time, x, y, depth?"),
        (ROUTE, "flies", "a track must be in the sea; depths are positive below its surface"),
        (ROUTE, "hovers", "a track must be in the sea; depths are positive below its surface"),
        (ROUTE, "away", "a track must be in the mission, which lasts from 0 to 20 s (AUV0)"),
        (ROUTE, "raises", "raised KeyError: 'no'"),
        (AUV, "narrow", "it must be an array (n, 4), time in s, x, y and depth in m; n >= 2"),
        (AUV, "halts", "the times of a track must increase (AUV0)"),
        (AUV, "none", "returned None; it must be an array (n, 4)"),
        (AUV, "raises", "raised KeyError for AUV0: 'no', at own_plans.py:"),
        (ASV, "sunk", "ASVs are at the surface, at a depth of 0 (ASV0)"),
        (ASV, "words", "returned 'here'; it must be an array (n, 4)"),
    ],
)
def test_what_is_no_plan_fails_the_run(home: Path, key: str, name: str, said: str) -> None:
    """Exit code 1 and one line: the key, the part, what it returned, and what is needed."""
    setting = ("--set", f"{key}=own_plans:{name}")
    outcome = call("-q", "run", "m.yaml", "--allow-plugins", "--no-advice", *setting)
    assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (1, 1), outcome.output
    assert f": 'own_plans:{name}' r" in outcome.stderr
    assert key.removesuffix(".kind").removesuffix(".model") in outcome.stderr
    assert said in outcome.stderr


@pytest.mark.parametrize(
    ("formation", "said"),
    [
        ("{model: positions}", "model: positions needs positions_m; add it, or use ring"),
        ("{model: ring, positions_m: [[0, 0]]}", "model: ring excludes positions_m; remove it"),
        (
            "{model: rng}",
            "model: must be one of ring, positions, follow, assign, zigzag, visit, information, "
            "track, module:object; got the text",
        ),
        ("{kind: 'a:b'}", "kind: unknown key; asvs.formation is chosen by its `model`"),
        ("{model: ring, angel_deg: 3}", "angel_deg: unknown key; did you mean 'angle_deg'?"),
        (
            "{model: 'a:b', x: .nan}",
            "takes settings of numbers, texts, lists and mappings; x is",
        ),
    ],
)
def test_a_formation_says_which_it_is(home: Path, formation: str, said: str) -> None:
    outcome = call("run", "m.yaml", "--set", "asvs.count=1", "--set", f"asvs.formation={formation}")
    assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (2, 1), outcome.output
    assert said in outcome.stderr


def test_todays_keys_stay_what_they_are(home: Path) -> None:
    for setting in ("asvs.formation.angle_deg=30", "asvs.formation={model: ring, angle_deg: 30}"):
        formation = load_scenario("m.yaml", overrides=[setting]).asvs.formation
        assert str(formation.choice) == "ring"
        assert formation.angle_deg == 30  # type: ignore[union-attr]


def test_a_level_answer_may_say_so() -> None:
    """Depths of 0 are those of vessels."""
    level = mission(asvs={"formation": {"model": "own_plans:level"}})
    flat = mission(asvs={"formation": {"positions_m": [[0.0, 0.0]] * 4}})
    assert simulate(level, 1).auvs.equals(simulate(flat, 1).auvs)


def test_a_plan_may_know_the_survey() -> None:
    """`PlanView` is what the README of extending says it is."""
    assert list(PlanView.__annotations__) == [
        "auvs", "asvs", "side", "depth", "hf_range", "mf_range", "speed", "turning_radius",
        "duration", "corners",
    ]  # fmt: skip
