"""Surveys whose area a chart says: the mission of the same polygon in metres, kept with results."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bindusbl_des import (
    Scenario,
    ScenarioError,
    Setup,
    load_campaign,
    load_result,
    load_scenario,
    simulate,
    sweep,
)
from bindusbl_des.apps.campaigns.experiments.experiment_file import load_experiment
from bindusbl_des.core.geometry.geodesy import geodetic_from_ned

pytestmark = pytest.mark.usefixtures("in_this_process")

ORIGIN = (54.33, 10.18)
# Two sides of 60 and 40 m, and a corner cut off: its centroid is not the origin.
CORNERS = [[-30.0, -20.0], [30.0, -20.0], [30.0, 10.0], [20.0, 20.0], [-30.0, 20.0]]

YAML = """name: fjord
duration_s: 20
survey: {area: fjord.geojson}
auvs: {count: 1, speed_m_per_s: 1.5}
asvs: {count: 1}
"""
WITH_ORIGIN = YAML + "environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}\n"


def geojson(corners: list[list[float]], origin: tuple[float, float] = ORIGIN) -> str:
    """Return a polygon about an origin, its corners in metres, as GeoJSON."""
    ring = [geodetic_from_ned([*it, 0.0], *origin)[1::-1] for it in [*corners, corners[0]]]
    return json.dumps({"type": "Polygon", "coordinates": [ring]})


def put(folder: Path, text: str = WITH_ORIGIN, name: str = "fjord.geojson") -> Path:
    (folder / name).write_text(geojson(CORNERS))
    (folder / "fjord.yaml").write_text(text)
    return folder / "fjord.yaml"


def test_the_area_lies_about_the_origin_that_is_given(tmp_path: Path) -> None:
    """To a micrometre, by which the file's degrees are rounded."""
    scenario = load_scenario(put(tmp_path))
    assert scenario.survey.shapes == ("area",)
    np.testing.assert_allclose(Setup(scenario).area.outline, CORNERS, atol=1e-6)
    assert Setup(scenario).origin_deg == ORIGIN


def test_without_an_origin_the_area_lies_about_its_centroid(tmp_path: Path) -> None:
    """60 m by 40 m less a triangle of 50 m2 at (80/3, 50/3) m: 2350 m2 about (-0.567, -0.355) m."""
    scenario = load_scenario(put(tmp_path, YAML))
    area = Setup(scenario).area
    middle = np.array([-50 * 80 / 3, -50 * 50 / 3]) / 2350
    np.testing.assert_allclose(area.outline, CORNERS - middle, atol=1e-5)
    np.testing.assert_allclose(area.centroid, [0.0, 0.0], atol=1e-6)
    assert Setup(scenario).origin_deg == pytest.approx(
        geodetic_from_ned([*middle, 0.0], *ORIGIN)[:2]
    )


KML = """<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><Polygon><outerBoundaryIs>
<LinearRing><coordinates>{}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>
"""


def test_the_mission_is_that_of_the_polygon_in_metres(tmp_path: Path) -> None:
    """Whether the file is GeoJSON or KML."""
    metres = {"name": "m", "duration_s": 20.0, "survey": {"polygon_m": CORNERS}}
    metres |= {"auvs": {"count": 1, "speed_m_per_s": 1.5}, "asvs": {"count": 1}}
    columns = ["x_m", "y_m", "z_m", "yaw_rad"]
    asked = simulate(Scenario.model_validate(metres), 2).tables["tracks"][columns]
    ring = json.loads(geojson(CORNERS))["coordinates"][0]
    (tmp_path / "fjord.kml").write_text(KML.format(" ".join(f"{x!r},{y!r}" for x, y in ring)))
    scenario = load_scenario(put(tmp_path))
    for area in ("fjord.geojson", "fjord.kml"):
        scenario = load_scenario(tmp_path / "fjord.yaml", overrides=[f"survey.area={area}"])
        found = simulate(scenario, 2).tables["tracks"][columns]
        np.testing.assert_allclose(found, asked, atol=1e-6)


def test_results_take_the_chart_along(tmp_path: Path) -> None:
    """And mean the same when the user's own has changed or gone."""
    scenario = load_scenario(put(tmp_path))
    result = simulate(scenario, 0)
    result.write(tmp_path / "run")
    copies = [it.name for it in (tmp_path / "run" / "charts").iterdir()]
    assert len(copies) == 1
    (tmp_path / "fjord.geojson").unlink()
    for back in (
        load_result(tmp_path / "run").scenario,
        load_scenario(tmp_path / "run" / "scenario.yaml"),
    ):
        assert back.survey.area == str(tmp_path / "run" / "charts" / copies[0])
        assert Setup(back).area == Setup(scenario).area
    assert Setup(scenario).area.words == "2,350 m2, a polygon of 5 corners"  # as it was read
    (tmp_path / "run" / "charts" / copies[0]).unlink()
    with pytest.raises(ValueError, match=r"run.json is damaged .*survey.area: .*cannot be read"):
        load_result(tmp_path / "run")


def test_areas_are_varied_as_other_keys_are(tmp_path: Path) -> None:
    put(tmp_path)
    (tmp_path / "half.geojson").write_text(geojson([[-30, -20], [30, -20], [30, 0], [-30, 0]]))
    (tmp_path / "areas.yaml").write_text(
        "scenario: fjord.yaml\nseeds: 1\nvary: {survey.area: [fjord.geojson, half.geojson]}\n"
    )
    sweep(load_experiment(tmp_path / "areas.yaml"), tmp_path / "out", workers=1)
    (tmp_path / "fjord.geojson").unlink()
    rows = load_campaign(tmp_path / "out").missions
    assert sorted(it.partition("-")[0] for it in rows["survey.area"]) == [
        "charts/fjord",
        "charts/half",
    ]
    assert len(set(rows["position_error_m"])) == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (WITH_ORIGIN.replace("fjord.geo", "lake.geo"), r"3:16: survey.area: no such file: .*lake"),
        (
            WITH_ORIGIN.replace("fjord.geojson", "fjord.shp"),
            r"survey.area: no such file: .*fjord.shp; files are sought beside the scenario file",
        ),
        (WITH_ORIGIN.replace("54.33", "10.18").replace("lon_deg: 10.18", "lon_deg: 54.33"), "swap"),
        (
            WITH_ORIGIN.replace("54.33", "-54.33"),
            r"survey.area: latitude 54.3297305, longitude 10.1796926 is 10,316 km from envir",
        ),
        (
            WITH_ORIGIN.replace("survey: {", "survey: {side_m: 50, "),
            r"survey.area: excludes side_m: either says what the survey is",
        ),
        (
            WITH_ORIGIN.replace("survey: {", "survey: {rotation_deg: 50, "),
            r"survey.rotation_deg: turns squares and rectangles; turn the corners of a polygon",
        ),
        (WITH_ORIGIN.replace("fjord.geojson", "7"), r"survey.area: needs a text; got 7"),
    ],
)
def test_areas_that_cannot_be_meant_are_refused(tmp_path: Path, text: str, said: str) -> None:
    path = put(tmp_path, text)
    with pytest.raises(ScenarioError, match=said) as told:
        load_scenario(path)
    assert len(told.value.mistakes) == 1


def test_what_is_wrong_within_a_chart_is_told_at_its_key(tmp_path: Path) -> None:
    path = put(tmp_path)
    crossed: Any = [CORNERS[0], CORNERS[2], CORNERS[1], CORNERS[4]]
    (tmp_path / "fjord.geojson").write_text(geojson(crossed))
    (tmp_path / "nowhere.yaml").write_text("name: m\n\nsurvey: {area: fjord.geojson}\n")
    for file in (path, tmp_path / "nowhere.yaml"):  # with an origin, and about its own centroid
        with pytest.raises(ScenarioError, match=r"yaml:3:16: survey.area: crosses or touches it"):
            load_scenario(file)
    (tmp_path / "fjord.geojson").write_text("{}")
    with pytest.raises(ScenarioError, match=r"yaml:3:16: survey.area: .*is no GeoJSON object"):
        load_scenario(path)
