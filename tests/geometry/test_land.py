"""Land: what crosses it and what lies on it, against shapely alone; and files and keys of it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely
from bays_for_tests import Bay, drawn_bay
from commands_for_tests import call

from bindusbl_des import Scenario, ScenarioError, Setup, load_scenario
from bindusbl_des.core.geometry.coverage import covered_by_rings

MANY = pytest.param(range(100, 1000), marks=pytest.mark.slow)


def setup_of(bay: Bay) -> Setup:
    return Setup(Scenario(name="bay", survey=bay.survey, auvs={"route": HELD}, asvs=FAR))


FAR = {"count": 1, "formation": {"positions_m": [[1e3, 30.0]]}}
HELD = {"kind": "hold", "positions_m": [[1e3, 0.0], [1e3, 10.0], [1e3, 20.0]]}


@pytest.mark.parametrize("seeds", [range(100), MANY])
def test_paths_and_places(seeds: range) -> None:
    met = 0
    for seed in seeds:
        bay, draw = drawn_bay(seed), np.random.default_rng(seed)
        setup, ashore, closed = setup_of(bay), bay.ashore, bay.closed
        here, there = draw.uniform(-200, 200, (2, 30, 2))
        lines = shapely.linestrings(np.stack(np.broadcast_arrays(here[:, None], there), axis=2))
        over = shapely.length(shapely.intersection(lines, ashore))
        cross, touched = over > 1e-5, (over > 0.0) & (over < 1e-3)  # which rounding decides
        if setup.land is None:
            assert not bay.land
        else:
            assert ((setup.land.crossed(here, there) == cross) | touched).all(), seed
            on = shapely.contains_xy(ashore, here)
            assert (setup.land.holds(here) == on).all()
            met += int(cross.sum())
        if setup.closed is not None:
            on = shapely.contains_xy(closed, here)
            assert (setup.closed.holds(here) == on).all()
        inside = shapely.intersects_xy(bay.water, here)
        assert (setup.area.contains(here) == inside).all()
        assert setup.area.square_m == pytest.approx(bay.water.area)
        beyond = [setup.area.beyond(x, y) for x, y in here[~inside]]
        assert beyond == pytest.approx(shapely.distance(bay.water, shapely.points(here[~inside])))
    assert met > 50 * len(seeds)


@pytest.mark.parametrize("seeds", [range(30), MANY])
def test_vessels_lie_and_stop_on_the_water(seeds: range) -> None:
    """A station is refused exactly where shapely has it on land or where nobody goes; whoever moves
    stops a metre before that, on a straight way over water, or gets there.
    """
    refused = stopped = 0
    for seed in seeds:
        bay, draw = drawn_bay(seed), np.random.default_rng(seed)
        if (closed := setup_of(bay).closed) is None:
            continue
        inner = shapely.buffer(bay.closed, -1e-6)
        for (x, y), (to_x, to_y) in draw.uniform(-120, 120, (12, 2, 2)).tolist():
            ashore = bool(bay.closed.contains(shapely.Point(x, y)))
            assert (closed.ashore(x, y) > 0.0) == ashore
            lie = {"count": 1, "formation": {"positions_m": [[x, y]]}}
            if ashore and not refused % 10:
                with pytest.raises(ValueError, match=r"positions_m.0: ASV0 at .* from open water"):
                    Scenario(name="bay", survey=bay.survey, auvs={"route": HELD}, asvs=lie)
            refused += ashore
            begin = closed.afloat((x, y))
            assert not inner.contains(shapely.Point(begin))
            end = closed.stopped(begin, (to_x, to_y))
            way = shapely.LineString([begin, (to_x, to_y)])
            assert way.distance(shapely.Point(end)) < 1e-6
            assert shapely.LineString([begin, end]).intersection(inner).length < 1e-5, seed
            if end != (to_x, to_y):
                stopped += 1
                before = shapely.Point(end).distance(way.intersection(bay.closed))
                assert before == pytest.approx(1.0, abs=1e-5) or end == pytest.approx(begin)
    assert refused > 0.4 * len(seeds)
    assert stopped > len(seeds)


SQUARE = [[10.0, -10.0], [30.0, -10.0], [30.0, 10.0], [10.0, 10.0]]


def test_shores_belong_to_the_water() -> None:
    """What touches land, or goes along a shore, does not cross it; what goes in does."""
    land = Setup(Scenario(name="square", survey={"land": [SQUARE]})).land
    assert land is not None
    along = land.crossed([(10.0, -50.0)], [(10.0, 50.0), (10.001, 50.0), (9.999, 50.0)])
    assert along.tolist() == [[False, True, False]]
    corner = land.crossed([(0.0, -20.0)], [(40.0, 20.0), (20.0, -20.0), (20.0, 0.0)])
    assert corner.tolist() == [[True, False, True]]  # by two corners; beside; by one, and stays
    assert land.crossed([(0.0, 0.0)], [(20.0, -20.0)]).tolist() == [[False]]  # touches a corner
    assert land.holds([(10.0, 0.0), (20.0, 0.0), (9.0, 0.0)]).tolist() == [False, True, False]
    assert land.ashore(14.0, 3.0) == pytest.approx(4.0)


def test_what_is_covered_is_what_is_seen() -> None:
    """What an ASV hears, as polygons, is what it hears point by point."""
    for seed in range(8):
        bay, draw = drawn_bay(seed), np.random.default_rng(seed)
        setup = setup_of(bay)
        asvs = draw.uniform(-120, 120, (3, 2))
        x0, y0, x1, y1 = bay.water.bounds
        points = draw.uniform((x0, y0), (x1, y1), (20_000, 2))
        points = points[shapely.contains_xy(bay.water, points)]
        lines = shapely.linestrings(np.stack(np.broadcast_arrays(points[:, None], asvs), axis=2))
        seen = shapely.length(shapely.intersection(lines, bay.ashore)) < 1e-5
        heard = (seen & (shapely.length(lines) < 90.0)).any(axis=1)
        covered = covered_by_rings(setup.area, asvs, [(0.0, 90.0)], setup.land)
        assert covered == pytest.approx(heard.mean(), abs=4 / len(points) ** 0.5)


def test_whoever_may_be_nearby_is_behind_it_still() -> None:
    """Behind what is left of land without its outer metres is behind land from wherever one is."""
    land = Setup(Scenario(name="square", survey={"land": [SQUARE]})).land
    assert land is not None
    draw = np.random.default_rng(0)
    here, there = draw.uniform(-40, 60, (2, 40, 2))
    sure = land.within(5.0).crossed(here, there)
    assert 0 < sure.sum() < land.crossed(here, there).sum()
    for _ in range(20):
        shift = draw.uniform(-5 / 2**0.5, 5 / 2**0.5, (2, 40, 2))
        assert land.crossed(here + shift[0], there + shift[1])[sure].all()


def test_the_worst_corner_is_one_of_the_open_water(tmp_path: Path) -> None:
    """Where a coast lies over a corner, that where it cuts the edge; an island has its own."""
    asvs, met = {"count": 2, "formation": {"positions_m": [[0.0, 5.0], [160.0, -160.0]]}}, 0
    for seed in range(8):
        bay = drawn_bay(seed)
        given = {"name": "bay", "survey": bay.survey, "auvs": {"route": HELD}, "asvs": asvs}
        (tmp_path / "bay.yaml").write_text(json.dumps(given))
        told = call("coverage", str(tmp_path / "bay.yaml"), "--json")
        if told.exit_code == 0:
            corners = shapely.get_coordinates(bay.water)
            away = np.hypot(*(corners[:, None] - asvs["formation"]["positions_m"]).T)
            assert json.loads(told.stdout)["worst_corner_m"] == pytest.approx(
                away.min(axis=0).max()
            )
            met += 1
    assert met > 3


ORIGIN = (54.33, 10.18)


def ring(*corners: tuple[float, float]) -> list[list[float]]:
    """Return a ring as GeoJSON has it, of corners x, y (m) about an origin."""
    east, north = np.array([*corners, corners[0]])[:, ::-1].T
    earth = pyproj.Proj(proj="aeqd", ellps="WGS84", lat_0=ORIGIN[0], lon_0=ORIGIN[1])
    return np.column_stack(earth(east, north, inverse=True)).tolist()  # type: ignore[no-any-return]


OUTER = (-50.0, -40.0), (50.0, -40.0), (50.0, 40.0), (-50.0, 40.0)
HOLE = (-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)
ISLES = ((20.0, 0.0), (30.0, 0.0), (30.0, 9.0)), ((-30.0, 20.0), (-20.0, 20.0), (-20.0, 60.0))


def chart(path: Path, *rings: list[list[list[float]]]) -> str:
    path.write_text(json.dumps({"type": "MultiPolygon", "coordinates": list(rings)}))
    return str(path)


def test_holes_and_charts_are_land(tmp_path: Path) -> None:
    """Of an area with a hole, and isles in a chart of their own, one of which a lake is in."""
    area = chart(tmp_path / "area.geojson", [ring(*OUTER), ring(*HOLE)])
    lake = (25.0, 2.0), (28.0, 2.0), (28.0, 5.0)
    land = chart(tmp_path / "isles.geojson", [ring(*ISLES[0]), ring(*lake)], [ring(*ISLES[1])])
    place = {"origin": {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]}}
    survey, there = {"area": area, "land": land}, {"positions_m": [[0.0, 30.0]]}
    asvs = {"count": 1, "formation": there}
    scenario = Scenario(name="isles", survey=survey, environment=place, asvs=asvs)
    setup, outer = Setup(scenario), shapely.Polygon(OUTER)
    ashore = [shapely.Polygon(ISLES[0], [lake]), shapely.Polygon(ISLES[1]), shapely.Polygon(HOLE)]
    assert setup.area.square_m == pytest.approx((outer - shapely.union_all(ashore)).area, rel=1e-6)
    assert setup.land is not None
    places = [(0.0, 0.0), (27.0, 3.0), (29.0, 1.0), (-22.0, 50.0), (9.0, 9.0)]
    assert setup.land.holds(places).tolist() == [True, False, True, True, False]
    again = Scenario.model_validate(scenario.model_dump())
    assert Setup(again).land == setup.land
    # cut up around lakes it covers the same, and hides the same: no sound passes where parts meet
    assert len(setup.land.undivided) > 3
    whole = Setup(Scenario(name="cut", survey={"land": setup.land.undivided}, asvs=asvs)).land
    assert whole is not None
    assert whole.shape.symmetric_difference(setup.land.shape).area < 1e-6
    here, there = np.random.default_rng(0).uniform(-40, 60, (2, 60, 2))
    assert (setup.land.crossed(here, there) == whole.crossed(here, there)).all()


@pytest.mark.parametrize(
    ("survey", "said"),
    [
        ({"land": [OUTER], "size_m": [80.0, 60.0]}, r"survey.land: land, and water where nobody"),
        ({"keep_out": [[*OUTER[:2], *OUTER[:1:-1]]]}, r"survey.keep_out.0: crosses or touches its"),
        ({"land": [OUTER[:2]]}, r"survey.land.0: needs at least three corners that differ; got 2"),
        ({"land": 7}, r"survey.land: needs a list of list of \[x, y\]; got 7"),
        ({"land": [[[1.0, 2.0, 3.0]]]}, r"survey.land.0.0: needs two numbers \[x, y\]; got a list"),
        ({"land": "isles.geojson"}, r"survey.land: no such file: .*isles.geojson"),
        ({"land": "held.geojson"}, r"survey.land: is a chart, and nothing says where on Earth"),
    ],
)
def test_land_that_is_none_is_told(tmp_path: Path, survey: dict[str, Any], said: str) -> None:
    chart(tmp_path / "held.geojson", [ring(*HOLE)])
    (tmp_path / "bad.yaml").write_text(json.dumps({"name": "bad", "survey": survey}))
    with pytest.raises(ScenarioError, match=rf"bad.yaml:1:\d+: {said}") as found:
        load_scenario(tmp_path / "bad.yaml")
    assert len(found.value.mistakes) == 1


def test_what_a_place_sees_is_what_no_land_crosses() -> None:
    """As a polygon and point by point; a place on land sees nothing."""
    for seed in range(30):
        bay, draw = drawn_bay(seed), np.random.default_rng(seed)
        if (land := setup_of(bay).land) is None:
            continue
        x, y = draw.uniform(-150, 150, 2).tolist()
        corners = land.seen((x, y), 120.0)
        if bay.ashore.contains(shapely.Point(x, y)):
            assert not len(corners)
            continue
        seen, points = shapely.Polygon(corners), np.add(draw.uniform(-130, 130, (300, 2)), (x, y))
        clear = shapely.distance(seen.boundary, shapely.points(points)) > 0.05
        lines = shapely.linestrings(np.stack(np.broadcast_arrays((x, y), points), axis=1))
        by_hand = (shapely.length(shapely.intersection(lines, bay.ashore)) < 1e-5) & (
            shapely.length(lines) < 120.0
        )
        inside = shapely.contains_xy(seen, points)
        assert (inside == by_hand)[clear].all(), seed
