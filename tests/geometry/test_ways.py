"""Ways round land: on the water, the shortest, and lanes that end before land, in drawn bays."""

import itertools
import json
import math
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import shapely
from bays_for_tests import Bay, drawn_bay

from bindusbl_des import Scenario, Setup

MANY = pytest.param(range(8, 1000), marks=pytest.mark.slow)
FAR = {"count": 1, "formation": {"positions_m": [[400.0, 0.0]]}}


def planned(bay: Bay, **route: object) -> Setup:
    lanes = {"lane_spacing_m": 15.0, "division": "equal_length"}
    auvs = {"count": 2, "route": {**lanes, **route}}
    return Setup(Scenario(name="bay", survey=bay.survey, auvs=auvs, asvs=FAR))


def line(path: object, count: int = 3000) -> shapely.LineString:
    along = np.linspace(0.0, path.length, count)  # type: ignore[attr-defined]
    return shapely.LineString(path.sample(along)[:, :2])  # type: ignore[attr-defined]


@pytest.mark.parametrize("seeds", [range(8), MANY])
def test_lanes_end_before_land_and_go_round(seeds: range) -> None:
    """Each lane is in the water; AUVs go from one to the next, and back again, without a metre on
    land or where nobody goes; what is left out of the area lies near its edges.
    """
    told = 0
    for seed in seeds:
        bay = drawn_bay(seed)
        try:
            setup = planned(bay)
        except ValueError as error:  # a strip of hardly any water, or no room to turn
            if not ("leaves AUV" in str(error) or "leads over land" in str(error)):
                raise
            told += 1
            continue
        swept, ashore = [], bay.closed.buffer(-1e-3)  # along a shore rounding decides
        # only where they are to stay inside do lanes end before a slanting edge
        room = shapely.box(*[-1e4] * 2, *[1e4] * 2) if setup.area.is_convex else bay.water
        for plan in setup.plans:
            assert line(plan.tour).intersection(ashore).length < 0.1, seed
            for first, last in plan.lanes:
                ends = plan.path.sample(np.array([first, last]))[:, :2]
                lane = shapely.LineString(ends)
                assert lane.difference((room - ashore).buffer(1e-6)).length < 1e-6, seed
                swept.append(lane.buffer(7.6, cap_style="flat"))
        inner = bay.water.buffer(-16.0)
        left = inner.difference(shapely.union_all(swept)).area
        assert left < 0.12 * inner.area + 120.0, seed
    assert told < 0.1 * len(seeds) + 1


def on_a_grid(bay: Bay, off: float, start: tuple[float, float], end: tuple[float, float]) -> float:
    """Return how long (m) the shortest way is on a grid whose steps lead in many directions."""
    step, reach = 3.0, 3
    moves = [
        (i, j)
        for i, j in itertools.product(range(-reach, reach + 1), repeat=2)
        if math.gcd(i, j) == 1
    ]
    x, y = np.arange(-150.0, 151.0, step), np.arange(-150.0, 151.0, step)
    open_sea = ~shapely.contains_xy(bay.closed.buffer(off), *np.meshgrid(x, y, indexing="ij"))
    graph: nx.Graph = nx.Graph()
    solid = bay.closed.buffer(off - 0.3)
    shapely.prepare(solid)
    for i, j in moves:
        a, b = slice(max(i, 0), len(x) + min(i, 0)), slice(max(j, 0), len(y) + min(j, 0))
        c, d = slice(max(-i, 0), len(x) + min(-i, 0)), slice(max(-j, 0), len(y) + min(-j, 0))
        both = np.argwhere(open_sea[a, b] & open_sea[c, d])
        first, second = both + np.array([a.start, b.start]), both + np.array([c.start, d.start])
        here = np.stack((x[first[:, 0]], y[first[:, 1]]), axis=1)
        there = np.stack((x[second[:, 0]], y[second[:, 1]]), axis=1)
        free = ~shapely.intersects(solid, shapely.linestrings(np.stack((here, there), axis=1)))
        long = step * math.hypot(i, j)
        graph.add_weighted_edges_from(
            (tuple(one), tuple(other), long)
            for one, other in zip(first[free].tolist(), second[free].tolist(), strict=True)
        )
    ends = [
        (int(np.abs(x - place[0]).argmin()), int(np.abs(y - place[1]).argmin()))
        for place in (start, end)
    ]
    return float(nx.dijkstra_path_length(graph, *ends))


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 60), marks=pytest.mark.slow)])
def test_ways_round_land_are_the_shortest(seeds: range) -> None:
    """To 1 %, against a fine grid at the same distance from land: from lanes that lie on one side
    of it to where AUVs are recovered on the other.
    """
    sought = 0
    for seed in seeds:
        bay, draw = drawn_bay(seed), np.random.default_rng(seed)
        away = bay.closed.buffer(8.0)
        places = [tuple(map(float, place)) for place in draw.integers(-70, 71, (200, 2)) // 3 * 3]
        free = [place for place in places if not away.contains(shapely.Point(place))]
        around = (
            (one, other)
            for one, other in itertools.combinations(free, 2)
            if math.dist(one, other) > 60.0
            and shapely.LineString([one, other]).intersection(away).length > 15.0
        )
        if (ends := next(around, None)) is None:
            continue  # of a bay with hardly any land
        (start, end), sought = ends, sought + 1
        x, y = start
        route = {"lane_spacing_m": 15.0, "inside": False}
        # a survey of one short lane, which is where the way begins
        survey = {
            "polygon_m": [[x - 2, y - 2], [x + 2, y - 2], [x + 2, y + 2], [x - 2, y + 2]],
            "land": bay.land, "keep_out": bay.keep_out,
        }  # fmt: skip
        auvs = {
            "count": 1, "vehicle": {"model": "kinematic", "turning_radius_m": 1.0},
            "route": {**route, "end_margin_m": 0.5}, "recovery_m": [list(end)],
        }  # fmt: skip
        setup = Setup(Scenario(name="way", survey=survey, auvs=auvs, asvs=FAR))
        plan = setup.plans[0]
        way = plan.path.length - plan.lanes[-1][1]
        assert line(plan.path, 9000).intersection(bay.closed).length < 1e-2
        best = on_a_grid(bay, 1.0, start, end)
        assert way < 1.01 * best + 2.0 * math.pi + 4.0, seed  # and a turn of the vehicle
        assert way > 0.97 * best - 6.0, seed
    assert sought > 0.8 * len(seeds)


def test_a_single_vessel_lies_on_the_water_nearest_to_the_middle() -> None:
    """Nobody asked for a place on the island: one that is asked for there is a mistake."""
    isle = [[-20.0, -10.0], [20.0, -10.0], [20.0, 12.0], [-20.0, 12.0]]

    def station(survey: dict[str, object]) -> tuple[float, float]:
        [place] = Setup(Scenario(name="isle", survey=survey, asvs={"count": 1})).stations_m
        return place

    assert station({"keep_out": [isle]}) == station({"land": [isle]})
    assert station({"land": [isle]}) == pytest.approx((0.0, -11.0))
    assert station({"land": [[[30.0, 30.0], [40.0, 30.0], [40.0, 40.0]]]}) == (0.0, 0.0)


def test_a_chart_of_all_has_the_area_as_well(tmp_path: Path) -> None:
    """Of land's chart the polygon that is surveyed is no land; one that is nothing else is."""
    rings = {"bay": (0.0, 0.01), "isle": (0.004, 0.005)}
    features = [
        {"type": "Feature", "properties": {"name": name}, "geometry": {"type": "Polygon",
         "coordinates": [[[a, a], [b, a], [b, b], [a, b], [a, a]]]}}
        for name, (a, b) in rings.items()
    ]  # fmt: skip
    for file, some in (("all.geojson", features), ("bay.geojson", features[:1])):
        (tmp_path / file).write_text(json.dumps({"type": "FeatureCollection", "features": some}))
    file = str(tmp_path / "all.geojson")
    survey = {"area": file, "area_name": "bay", "keep_out": file}
    setup = Setup(Scenario(name="bay", survey=survey, asvs={"count": 1}, auvs={"count": 1}))
    assert len(setup.scenario.survey.charted("keep_out")) == 1
    assert setup.area.square_m == pytest.approx(0.99 * 1113.0 * 1106.0, rel=2e-3)
    covered = str(tmp_path / "bay.geojson")
    with pytest.raises(ValueError, match=r"survey.land: .* cover all of it"):
        Scenario(name="bay", survey={"area": covered, "land": covered})


def test_places_where_nobody_lies_are_mistakes() -> None:
    isle = [[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]]

    def said(**keys: object) -> str:
        with pytest.raises(ValueError, match=r"survey|asvs|auvs") as found:
            Scenario.model_validate({"name": "isle", "asvs": FAR, **keys})
        return str(found.value)

    survey = {"land": [isle]}
    moored = {"count": 1, "formation": {"positions_m": [[7.0, 0.0]]}}
    text = said(survey=survey, asvs=moored)
    assert "asvs.formation.positions_m.0: ASV0 at (7, 0) m is on land, 3 m from open water" in text
    ring = {"count": 3, "formation": {"radius_m": 5.0}}
    assert "asvs.formation.radius_m: ASV0 at (5, 0) m is where nobody goes (keep_out), 5 m" in said(
        survey={"keep_out": [isle]}, asvs=ring
    )
    held = {"count": 1, "route": {"kind": "hold", "positions_m": [[0.0, 1.0]]}}
    assert "auvs.route.positions_m.0: AUV0 at (0, 1) m is on land, 9 m" in said(
        survey=survey, auvs=held
    )
    through = {"kind": "waypoints", "points_m": [[[-40.0, 0.0], [40.0, 0.0]]]}
    text = said(survey=survey, auvs={"count": 1, "route": through})
    assert "auvs.route.points_m.0: the way of AUV0 leads over land" in text
    assert "for 20 m, at first from (-9.999, 0) m on, 30 m after its start" in text
    launched = {"count": 1, "launch_m": [[9.0, 9.0]]}
    assert "auvs.launch_m: AUV0 at (9, 9) m is on land, 1 m" in said(survey=survey, auvs=launched)
