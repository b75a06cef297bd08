"""What is exported can be read again: charts as areas, tables and messages as tracks."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from worlds import scenario

from bindusbl_des import load_result, load_scenario, simulate
from bindusbl_des.charts.geojson import read_geojson
from bindusbl_des.charts.kml import read_kml
from bindusbl_des.cli import main
from bindusbl_des.geometry.geodesy import ned_at_depth
from bindusbl_des.scenario.on_earth import origin_of
from bindusbl_des.scenario.planned import tracks_of
from bindusbl_des.scenario.survey_area import area_of

ORIGIN = (54.33, 10.18)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a short mission in Kiel fjord, with its exports."""
    folder = tmp_path_factory.mktemp("charts") / "run"
    place = {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]}
    asked = scenario(name="Kiel <Fjord>", duration_s=20.0, environment={"origin": place})
    simulate(asked, seed=3).write(folder)
    for kind in ("geojson", "kml", "csv", "mcap"):
        outcome = CliRunner().invoke(main, ["export", str(folder), "--to", kind])
        assert outcome.exit_code == 0, outcome.output
    return folder


@pytest.mark.parametrize("ending", ["geojson", "kml"])
def test_a_chart_shows_area_vessels_and_ways(run: Path, ending: str) -> None:
    """To the micrometre where they were."""
    result = load_result(run)
    read = read_geojson if ending == "geojson" else read_kml
    shapes = {
        it.told.rpartition("('")[2].rstrip("')"): it for it in read(run / f"Kiel_Fjord_.{ending}")
    }
    auvs, asvs = result.scenario.auvs.count, result.scenario.asvs.count
    assert len(shapes) == 1 + asvs + 2 * auvs
    tracks = result.tables["tracks"].groupby("vehicle")
    for name, columns in (("AUV1", ["x_m", "y_m"]), ("ASV0", ["x_m", "y_m"])):
        lat, lon = np.array(shapes[name].corners).T
        expected = tracks.get_group(name)[columns].to_numpy()[: len(lat)]
        found = ned_at_depth(lat, lon, np.zeros(len(lat)), ORIGIN)[:, :2]
        np.testing.assert_allclose(found, expected, atol=1e-6)
    assert shapes["ASV0"].kind == "point"
    assert shapes["AUV1 (estimate"].kind == "line"


@pytest.mark.parametrize("ending", ["geojson", "kml"])
def test_a_chart_is_the_area_of_another_survey(run: Path, ending: str, tmp_path: Path) -> None:
    (tmp_path / "again.yaml").write_text(
        f"name: again\nsurvey: {{area: {run}/Kiel_Fjord_.{ending}}}\n"
        "environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}\n"
    )
    asked, again = load_result(run).scenario, load_scenario(tmp_path / "again.yaml")
    np.testing.assert_allclose(area_of(again).outline, area_of(asked).outline, atol=1e-6)
    # Without the origin it is the centre of the square again.
    alone = load_scenario(tmp_path / "again.yaml", overrides=["environment.origin=null"])
    assert origin_of(alone) == pytest.approx(ORIGIN, abs=1e-11)


@pytest.mark.parametrize(
    ("file", "track", "vertical"),
    [
        ("csv/tracks.csv", "AUV0", 1e-9),
        ("Kiel_Fjord_.mcap", "/AUV0/tracks", 1e-9),
        # Heights are above the ellipsoid, which at 100 m falls 0.8 mm below the survey's plane.
        ("Kiel_Fjord_.mcap", "/AUV0/location", 1e-3),
    ],
)
def test_what_was_flown_can_be_flown_again(
    run: Path, tmp_path: Path, file: str, track: str, vertical: float
) -> None:
    (tmp_path / "again.yaml").write_text(
        "name: again\nduration_s: 20\n"
        f"auvs: {{count: 1, route: {{kind: track, files: [{run / file}], tracks: [{track}]}}}}\n"
        "environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}\n"
    )
    tracks = tracks_of(load_scenario(tmp_path / "again.yaml"))
    flown = load_result(run).tables["tracks"].query("vehicle == 'AUV0'")
    assert tracks is not None
    times, places = tracks[0]
    np.testing.assert_allclose(times, flown.time_s, atol=1e-6)
    np.testing.assert_allclose(places[:, :2], flown[["x_m", "y_m"]], atol=1e-6)
    np.testing.assert_allclose(places[:, 2], flown.z_m, atol=vertical)


def test_exports_are_no_strangers_in_a_folder(run: Path) -> None:
    """A run may be written over them; a mission that is nowhere has no chart."""
    load_result(run).write(run, force=True)
    assert not (run / "Kiel_Fjord_.kml").exists()
    nowhere = simulate(scenario(name="nowhere", duration_s=2.0), 0).write(run.parent / "nowhere")
    outcome = CliRunner().invoke(main, ["export", str(nowhere), "--to", "kml"])
    assert outcome.exit_code == 2
    assert "has no environment.origin, so it is nowhere on Earth; set" in outcome.output
    assert json.loads((nowhere / "run.json").read_text())["status"] == "complete"
