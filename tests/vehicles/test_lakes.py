"""Lakes and rivers: positions in and out where the water is not at the height of the sea."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from worlds import scenario

from bindusbl_des import Setup, load_scenario, simulate

LAKE = 372.0  # Lake of Zurich and others lie about so high (m)
ORIGIN = {"lat_deg": 47.25, "lon_deg": 8.6}
GPX = """<gpx xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
<trkpt lat="47.25" lon="8.6"><ele>{0}</ele><time>1970-01-01T00:00:00Z</time></trkpt>
<trkpt lat="47.2505" lon="8.6"><ele>{1}</ele><time>1970-01-01T00:01:00Z</time></trkpt>
</trkseg></trk></gpx>
"""
TRACK = "name: lake\nduration_s: 20\nauvs: {{count: 1, route: {{kind: track, files: [{}]}}}}\n"
AT = f"environment: {{surface_m: {LAKE}, origin: {{lat_deg: 47.25, lon_deg: 8.6}}}}\n"


def test_heights_of_a_track_are_depths_below_the_lake(tmp_path: Path) -> None:
    """Those of a GPX count from the sea; without the lake's height the file is refused with it."""
    (tmp_path / "auv.gpx").write_text(GPX.format(LAKE - 8.0, LAKE - 9.0))
    (tmp_path / "lake.yaml").write_text(TRACK.format("auv.gpx") + AT)
    [(_, places)] = Setup(load_scenario(tmp_path / "lake.yaml")).auv_tracks or ()
    np.testing.assert_allclose(places[:, 2], [8.0, 9.0], atol=1e-9)
    assert call("validate", tmp_path / "lake.yaml").exit_code == 0
    at_sea = call("validate", tmp_path / "lake.yaml", "--set", "environment.surface_m=0")
    assert at_sea.exit_code == 2
    assert "is 364 m above the sea" in at_sea.output
    assert "give the height of a lake or river (environment.surface_m)" in at_sea.output


def test_what_an_export_says_of_a_lake_is_read_back(tmp_path: Path) -> None:
    """Heights above the ellipsoid in MCAP, and back to the same places within a millimetre."""
    reader = pytest.importorskip("mcap.reader")
    decoder = pytest.importorskip("mcap_protobuf.decoder").DecoderFactory()
    water = {"surface_m": LAKE, "origin": ORIGIN}
    result = simulate(scenario(duration_s=10.0, environment=water, survey={"depth_m": 8.0}), 0)
    folder = result.write(tmp_path / "run")
    out = tmp_path / "run.mcap"
    assert call("export", folder, "--to", "mcap", "--out", out).exit_code == 0
    with open(out, "rb") as file:
        heights = [
            decoder.decoder_for("protobuf", schema)(message.data).altitude
            for schema, _, message in reader.make_reader(file).iter_messages("/AUV0/location")
        ]
    assert len(heights) > 9
    assert heights == pytest.approx([LAKE - 8.0] * len(heights), abs=0.01)
    track = "{kind: track, files: [run.mcap], tracks: [/AUV0/location]}"
    text = f"name: lake\nduration_s: 9\nauvs: {{count: 1, route: {track}}}\n{AT}"
    (tmp_path / "lake.yaml").write_text(text)
    [(_, places)] = Setup(load_scenario(tmp_path / "lake.yaml")).auv_tracks or ()
    tracks = result.tables["tracks"]
    gone = tracks.loc[tracks.vehicle == "AUV0", ["x_m", "y_m", "z_m"]].to_numpy()
    np.testing.assert_allclose(places, gone[: len(places)], atol=1e-3)


def test_places_keep_their_distance_on_a_lake() -> None:
    """Degrees at the height of the water: those of the sea would be 6 cm off in each kilometre."""

    def station(**water: Any) -> tuple[float, float]:
        placed = {"count": 1, "formation": {"positions_deg": [[47.259, 8.6]]}}
        [found] = Setup(scenario(environment={"origin": ORIGIN, **water}, asvs=placed)).stations_m
        return found

    sea, lake = station()[0], station(surface_m=LAKE)[0]
    assert lake / sea - 1.0 == pytest.approx(LAKE / 6.37e6, rel=0.01)
    water = {"origin": ORIGIN, "surface_m": LAKE}
    [(lat, lon, height)] = Setup(scenario(environment=water)).on_earth([(lake, 0.0)])
    assert (lat, lon) == pytest.approx((47.259, 8.6), abs=1e-9)
    assert height == pytest.approx(LAKE, abs=0.1)  # and the curvature over 1 km
