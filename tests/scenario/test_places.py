"""Places in latitude and longitude: the same mission as in metres, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bindusbl_des import (
    Scenario,
    ScenarioError,
    Setup,
    load_result,
    load_scenario,
    simulate,
    warnings_of,
)
from bindusbl_des.core.geometry.geodesy import geodetic_from_ned

ORIGIN = (54.33, 10.18)
LAT_LON = {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]}
PLACES = [[10.0, 12.0], [0.0, 0.0], [12.0, -5.0]]
WAYS = [[[0.0, 0.0], [12.0, 10.0]], [[-12.0, -12.0], [10.0, -11.0]], [[5.0, -5.0], [-10.0, 12.0]]]


def degrees(place: list[float]) -> list[float]:
    return list(geodetic_from_ned([*place, 0.0], *ORIGIN)[:2])


def told(route: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    data: dict[str, Any] = {"name": "m", "duration_s": 10.0, "environment": {"origin": LAT_LON}}
    return {**data, **({"auvs": {"route": route}} if route else {}), **more}


HELD = {"kind": "hold", "positions_deg": [degrees(it) for it in PLACES]}
TOURED = {"kind": "waypoints", "points_deg": [[degrees(it) for it in way] for way in WAYS]}
PLACED = {"formation": {"positions_deg": [degrees(it) for it in PLACES]}}


def test_positions_in_degrees_are_where_they_are_in_metres() -> None:
    """To a micrometre, by which the degrees of the scenario are rounded."""
    held = Setup(Scenario.model_validate(told(HELD))).route
    toured = Setup(Scenario.model_validate(told(TOURED))).route
    assert held.kind == "hold"
    assert toured.kind == "waypoints"
    np.testing.assert_allclose(held.positions_m, PLACES, atol=1e-6)
    np.testing.assert_allclose(toured.points_m, WAYS, atol=1e-6)
    stations = Setup(Scenario.model_validate(told(asvs=PLACED))).stations_m
    np.testing.assert_allclose(stations, PLACES, atol=1e-6)


def test_missions_in_degrees_are_those_in_metres() -> None:
    """Every ping is sent from there, and heard there: to the micrometre of the degrees."""
    metres = simulate(
        Scenario.model_validate(
            told(
                {"kind": "hold", "positions_m": PLACES},
                asvs={"formation": {"positions_m": PLACES}},
            )
        ),
        1,
    )
    deg = simulate(Scenario.model_validate(told(HELD, asvs=PLACED)), 1)
    columns = ["x_m", "y_m", "z_m"]
    np.testing.assert_allclose(
        deg.tables["tracks"][columns], metres.tables["tracks"][columns], atol=1e-6
    )
    assert (deg.tables["receptions"].outcome == metres.tables["receptions"].outcome).all()


def test_a_scenario_in_degrees_is_kept_as_it_was_given(tmp_path: Path) -> None:
    result = simulate(Scenario.model_validate(told(HELD, asvs=PLACED)), 1)
    result.write(tmp_path / "run")
    back = load_result(tmp_path / "run").scenario
    assert back == result.scenario
    assert back.model_dump(mode="json")["auvs"]["route"]["positions_deg"] == HELD["positions_deg"]


SWAPPED = [degrees(it)[::-1] for it in PLACES]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (
            {**told(HELD), "environment": {}},
            "auvs.route.positions_deg: needs environment.origin.lat_deg and lon_deg, where "
            "x = y = 0; add them",
        ),
        (
            {**told(TOURED), "environment": {}},
            "auvs.route.points_deg: needs environment.origin.lat_deg and lon_deg, where "
            "x = y = 0; add them",
        ),
        (
            told({**HELD, "positions_m": PLACES}),
            "auvs.route.positions_deg: excludes positions_m; keep one of them",
        ),
        (
            told({**TOURED, "points_m": WAYS}),
            "auvs.route.points_deg: excludes points_m; keep one of them",
        ),
        (
            told(asvs={"formation": {**PLACED["formation"], "positions_m": PLACES}}),
            "asvs.formation.positions_deg: excludes positions_m; keep one of them",
        ),
        (
            told({**HELD, "positions_deg": SWAPPED}),
            "auvs.route.positions_deg.0: latitude 10.1801845, longitude 54.3300898 is 6,003 km "
            "from environment.origin, but near it with latitude and longitude swapped; swap them",
        ),
        (
            told({**HELD, "positions_deg": [[-54.33, 10.18], *HELD["positions_deg"][1:]]}),
            "auvs.route.positions_deg.0: latitude -54.33, longitude 10.18 is 10,316 km from "
            "environment.origin (54.33, 10.18); correct one of them",
        ),
        (
            told({**HELD, "positions_deg": HELD["positions_deg"][:2]}),
            "auvs.route.positions_deg: needs one [lat, lon] per AUV: 3 expected, 2 given",
        ),
        (
            told({**TOURED, "points_deg": [way[:1] for way in TOURED["points_deg"]]}),
            "auvs.route.points_deg.0: needs at least two points, those in a row 0.001 m apart",
        ),
        (
            told(asvs={"count": 2, **PLACED}),
            "asvs.formation.positions_deg: needs one [lat, lon] per ASV: 2 expected, 3 given; or "
            "have them placed by `asvs.formation: {model: ring}`",
        ),
        (
            told(asvs={"formation": {"model": "ring", **PLACED["formation"]}}),
            "asvs.formation.model: ring excludes positions_deg; remove it, or use positions",
        ),
        (
            told(asvs={"formation": {"radius_m": 5.0, **PLACED["formation"]}}),
            "asvs.formation.positions_deg: excludes radius_m, clearance_m and angle_deg",
        ),
        (
            told({**HELD, "positions_deg": [[100.0, 10.0]]}),
            "must be <= 90 deg; got 100",
        ),
        (
            told({**HELD, "positions_deg": [[54.0, 10.0, 3.0]]}),
            "needs two numbers [lat, lon]; got a list of 3",
        ),
        (told({**HELD, "positions_deg": [54.0]}), "needs [lat, lon]; got 54"),
    ],
)
def test_positions_that_cannot_be_meant_are_refused(data: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match="validation error") as error:
        Scenario.model_validate(data)
    assert said in str(error.value)


TIMES = np.arange(0.0, 12.0, 2.0)
# 2026-11-22 14:00 UTC
UNIX = 1_795_356_000.0


def csv_of(way: list[list[float]], begin: float) -> str:
    """Return a track in degrees along a way of two points (m), 5 m deep, from an instant (s) on."""
    lines = ["time_s,lat_deg,lon_deg,depth_m"]
    for time, share in zip(TIMES, np.linspace(0.0, 1.0, len(TIMES)), strict=True):
        place = [a + share * (b - a) for a, b in zip(*way, strict=True)]
        lat, lon, _ = geodetic_from_ned([*place, 5.0], *ORIGIN)
        lines.append(f"{begin + time:.3f},{lat!r},{lon!r},5")
    return "\n".join(lines) + "\n"


YAML = """name: m
duration_s: 10
auvs: {count: 1, route: {kind: track, files: [a.csv]}}
environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}
"""


def test_a_track_in_degrees_and_unix_time_is_flown(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(csv_of(WAYS[0], UNIX))
    (tmp_path / "m.yaml").write_text(YAML)
    with pytest.raises(ScenarioError, match=r"set auvs.route.time_offset_s: 1795356000 to begin"):
        load_scenario(tmp_path / "m.yaml")
    scenario = load_scenario(tmp_path / "m.yaml", overrides=[f"auvs.route.time_offset_s={UNIX}"])
    tracks = Setup(scenario).auv_tracks
    assert tracks is not None
    times, places = tracks[0]
    np.testing.assert_allclose(times, TIMES, atol=1e-6)
    np.testing.assert_allclose(places[[0, -1], :2], WAYS[0], atol=1e-6)
    assert (places[:, 2] == 5.0).all()


def test_a_track_in_degrees_needs_an_origin_near_it(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(csv_of(WAYS[0], 0.0))
    (tmp_path / "m.yaml").write_text(YAML.replace("environment", "#"))
    with pytest.raises(ScenarioError, match=r"a.csv: is in latitude and longitude; set environm"):
        load_scenario(tmp_path / "m.yaml")
    (tmp_path / "m.yaml").write_text(YAML.replace("54.33", "10.18", 1).replace("10.18}", "54.33}"))
    with pytest.raises(ScenarioError, match=r"a.csv:2: .* 6,003 km from environment.origin, but"):
        load_scenario(tmp_path / "m.yaml")


GPX_POINT = '<trkpt lat="{}" lon="{}"><time>2026-11-22T14:00:{:02d}Z</time></trkpt>'


def test_a_track_without_depths_is_at_that_of_the_survey(tmp_path: Path) -> None:
    """So the key has an effect, and is idle with tracks that say their depths."""
    points = [GPX_POINT.format(*degrees([2.0 * n, 0.0]), int(time)) for n, time in enumerate(TIMES)]
    (tmp_path / "a.gpx").write_text(f"<gpx><trk>{''.join(points)}</trk></gpx>")
    (tmp_path / "m.yaml").write_text(YAML.replace("a.csv]", f"a.gpx], time_offset_s: {UNIX}"))
    scenario = load_scenario(tmp_path / "m.yaml", overrides=["survey.depth_m=7"])
    tracks = Setup(scenario).auv_tracks
    assert tracks is not None
    assert (tracks[0][1][:, 2] == 7.0).all()
    assert not [it for it in warnings_of(scenario) if it.key == "survey.depth_m"]
    (tmp_path / "a.csv").write_text(csv_of(WAYS[0], 0.0))
    (tmp_path / "m.yaml").write_text(YAML)
    scenario = load_scenario(tmp_path / "m.yaml", overrides=["survey.depth_m=7"])
    assert [it for it in warnings_of(scenario) if it.key == "survey.depth_m"]


def test_one_file_may_hold_the_tracks_of_a_fleet(tmp_path: Path) -> None:
    """As the table `tracks` of an export does: what was flown is flown again."""
    from bindusbl_des.core.results.result_folder import write_csv

    first = simulate(Scenario.model_validate({"name": "m", "duration_s": 10.0}), 0)
    write_csv(first.arrow, tmp_path / "csv")
    route = {"kind": "track", "files": ["csv/tracks.csv"] * 3, "tracks": ["AUV0", "AUV1", "AUV2"]}
    text = f"name: again\nduration_s: 10\nauvs: {{route: {route}}}\n".replace("'", "")
    (tmp_path / "m.yaml").write_text(text)
    again = simulate(load_scenario(tmp_path / "m.yaml"), 0)
    columns = ["time_s", "x_m", "y_m", "z_m"]
    rows = [it.tables["tracks"].query("vehicle == 'AUV2'")[columns] for it in (first, again)]
    np.testing.assert_allclose(*rows, atol=1e-9)
    with pytest.raises(ScenarioError, match=r"auvs.route.tracks: needs one name per AUV: 3 exp"):
        load_scenario(tmp_path / "m.yaml", overrides=["auvs.route.tracks=[AUV0]"])
    with pytest.raises(ScenarioError, match=r"auvs.route.files.0: .*no track 'AUV9'; holds 'AUV0'"):
        load_scenario(tmp_path / "m.yaml", overrides=["auvs.route.tracks=[AUV9, AUV1, AUV2]"])
