"""Recorded tracks in CSV, GPX and MCAP files, and what is refused with a remedy."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import scenario

from bindusbl_des import Setup
from bindusbl_des.models.charts.recordings import read_recording

GPX = """<?xml version="1.0"?>
<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1">
<trk><name>AUV0</name><trkseg>
<trkpt lat="54.33" lon="10.18"><ele>-10</ele><time>2026-11-22T14:00:00Z</time></trkpt>
<trkpt lat="54.331" lon="10.18"><ele>-12.5</ele><time>2026-11-22T14:01:00.500Z</time></trkpt>
</trkseg><trkseg>
<trkpt lat="54.332" lon="10.18"><ele>-12.5</ele><time>2026-11-22T15:02:00+01:00</time></trkpt>
</trkseg></trk></gpx>
"""
# 2026-11-22 14:00 UTC: 20,779 days after 1970-01-01, and 14 h
UNIX = 20_779 * 86_400 + 14 * 3600.0


def written(folder: Path, text: str, name: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_gpx_track_is_read_in_unix_time(tmp_path: Path) -> None:
    """Segments follow one another, zones are heeded, elevations are negative below the sea."""
    found = read_recording(written(tmp_path, GPX, "a.gpx"))
    assert found.in_degrees
    assert found.times.tolist() == [UNIX, UNIX + 60.5, UNIX + 120.0]
    assert found.places.tolist() == [[54.33, 10.18], [54.331, 10.18], [54.332, 10.18]]
    assert found.depths.tolist() == [10.0, 12.5, 12.5]
    assert found.where[2] == f"{tmp_path}/a.gpx:7"


def test_what_a_gpx_does_not_say_of_depth_is_unknown(tmp_path: Path) -> None:
    text = GPX.replace("<ele>-10</ele>", "")
    depths = read_recording(written(tmp_path, text, "a.gpx")).depths
    assert np.isnan(depths).tolist() == [True, False, False]


def test_a_csv_has_metres_or_degrees(tmp_path: Path) -> None:
    text = "lon_deg,time_s,lat_deg,depth_m,note\n10.18,0,54.33,5,a\n10.19,2,54.33,6,b\n"
    found = read_recording(written(tmp_path, text, "degrees.csv"))
    assert found.in_degrees
    assert found.places.tolist() == [[54.33, 10.18], [54.33, 10.19]]
    assert found.depths.tolist() == [5.0, 6.0]
    both = "time_s,x_m,y_m,z_m,lat_deg,lon_deg\n0,1,2,3,54,10\n1,2,2,3,54,10\n"
    found = read_recording(written(tmp_path, both, "both.csv"))
    assert not found.in_degrees
    assert found.places.tolist() == [[1.0, 2.0], [2.0, 2.0]]


def test_several_tracks_in_a_file_are_told_apart(tmp_path: Path) -> None:
    text = "vehicle,time_s,x_m,y_m,z_m\n" + "".join(
        f"AUV{auv},{time},{auv},{time},7\n" for time in range(3) for auv in range(2)
    )
    path = written(tmp_path, text, "tracks.csv")
    assert read_recording(path, "AUV1").places[:, 0].tolist() == [1.0, 1.0, 1.0]
    with pytest.raises(
        ValueError, match=r"holds 'AUV0', 'AUV1'; name one for each AUV in auvs.rou"
    ):
        read_recording(path)
    with pytest.raises(ValueError, match=r"no track 'AUV7'; holds 'AUV0'"):
        read_recording(path, "AUV7")


def mcap(path: Path, messages: list[tuple[str, str, Any]]) -> Path:
    """Write JSON messages, each with topic and name of its schema, one a second."""
    from mcap.writer import Writer

    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        channels: dict[str, int] = {}
        for second, (topic, schema, content) in enumerate(messages):
            if topic not in channels:
                number = writer.register_schema(schema, "jsonschema", b"{}")
                channels[topic] = writer.register_channel(topic, "json", number)
            data = content if isinstance(content, bytes) else json.dumps(content).encode()
            writer.add_message(channels[topic], second * 10**9, data, second * 10**9)
        writer.finish()
    return path


def fix(lat: Any, lon: Any, height: Any = -10.0, **more: Any) -> dict[str, Any]:
    return {"latitude": lat, "longitude": lon, "altitude": height, **more}


LOCATION = "foxglove.LocationFix"


def test_locations_in_an_mcap_file_are_a_track(tmp_path: Path) -> None:
    """At their own time or that of the log; what is not a position is passed over."""
    stamp = {"timestamp": {"sec": 100, "nsec": 500_000_000}}
    messages = [
        ("/boat/location", LOCATION, fix(54.33, 10.18)),
        ("/diagnostics", "text", ["not a row"]),
        ("/boat/location", LOCATION, fix(54.34, 10.18, **stamp)),
    ]
    found = read_recording(mcap(tmp_path / "a.mcap", messages))
    assert found.times.tolist() == [0.0, 100.5]
    assert found.places.tolist() == [[54.33, 10.18], [54.34, 10.18]]
    assert found.depths.tolist() == [10.0, 10.0]


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (
            "",
            "a.csv",
            r"a.csv:1: column time_s, x_m, y_m, depth_m missing; the header needs time_s",
        ),
        ("time_s,lat_deg,depth_m\n", "a.csv", r"a.csv:1: column lon_deg missing"),
        (
            "time_s,lat_deg,lon_deg,depth_m\n0,110.18,54.33,1\n1,2,3,4\n",
            "a.csv",
            r"a.csv:2: latitude 110.18 is beyond 90 deg: latitude and longitude are swapped",
        ),
        (
            "time_s,lat_deg,lon_deg,depth_m\n0,6021000,570000,1\n1,2,3,4\n",
            "a.csv",
            r"a.csv:2: latitude 6021000, longitude 570000 are no degrees .* UTM",
        ),
        ("time_s,x_m,y_m,depth_m\n0,0,0\n", "a.csv", r"a.csv:2: needs a number in each of time_s"),
        (
            "time_s,x_m,y_m,z_m\n0,0,0,-0.5\n1,0,0,-40\n",
            "a.csv",
            r"a.csv:3: a depth of -40 m is above the sea; depths must be positive below it",
        ),
        ("time_s,x_m,y_m,depth_m\n0,0,0,inf\n", "a.csv", r"a.csv:2: holds a value that is not f"),
        (
            "time_s,x_m,y_m,depth_m\n5,0,0,1\n5,1,0,1\n",
            "a.csv",
            r"a.csv: all its samples are of one instant; a track needs two",
        ),
        (
            "time_s,x_m,y_m,depth_m\n5,0,0,1\n4,1,0,1\n",
            "a.csv",
            r"a.csv:3: time_s must increase, but 4 s follows 5 s",
        ),
        (
            "time_s,x_m,y_m,depth_m\n1780300800000,0,0,1\n1780300840000,1,0,1\n",
            "a.csv",
            r"a.csv:2: time_s is 1780300800000, .*; times look like milliseconds: divide .* 1,000",
        ),
        ("\xff\0", "a.csv", r"a.csv:1: column time_s"),
        ("<gpx/>", "a.gpx", r"a.gpx: has 0 samples; a track needs at least two"),
        (GPX.replace('lat="54.33', 'lat="10,18'), "a.gpx", r"a.gpx:4: a trkpt needs numbers"),
        (GPX.replace("<ele>-1", "<ele>deep"), "a.gpx", r"a.gpx:4: 'deep0' is no elevation"),
        (
            GPX.replace("<ele>-1", "<ele>4"),
            "a.gpx",
            r"a.gpx:4: is 40 m above the sea; heights must be negative below it. Remove them",
        ),
        (
            GPX.replace("time>", "stamp>"),
            "a.gpx",
            r"a.gpx:4: has no <time>; a track needs one at each point, a route has none",
        ),
        (GPX.replace("2026-11-22T", "noon"), "a.gpx", r"a.gpx:4: 'noon14:00:00Z' is no time"),
        ("MCAP", "a.mcap", r"a.mcap: cannot be read as an MCAP file"),
    ],
)
def test_what_is_no_track_is_told_with_its_line_and_a_remedy(
    tmp_path: Path, text: str, name: str, said: str
) -> None:
    path = written(tmp_path, text, name)
    with pytest.raises(ValueError, match=said) as told:
        read_recording(path)
    assert str(told.value).startswith(str(path))


@pytest.mark.parametrize(
    ("content", "schema", "said"),
    [
        (fix("54", 10), LOCATION, r"message 1 on /a: needs numbers as latitude and longitude"),
        (fix(100.0, 54.0), LOCATION, r"message 1 on /a: latitude 100 is beyond 90 deg"),
        (fix(54.0, 10.0, 1e400), LOCATION, r"message 1 on /a: its height is inf; leave it out"),
        ([1], LOCATION, r"message 1 on /a: needs numbers as latitude"),
        (
            {"time_s": 0, "x_m": None, "y_m": 0, "z_m": 0},
            "row",
            r"message 1 on /a: needs a finite number in each of time_s, x_m, y_m, z_m",
        ),
        (
            {"time_s": 0, "x_m": 0, "y_m": 0, "z_m": -9},
            "row",
            r"message 1 on /a: a depth of -9 m is above the sea; depths must be positive below it",
        ),
        (
            {"time_s": 10**400, "x_m": 0, "y_m": 0, "z_m": 1},
            "row",
            r"message 1 on /a: needs a finite number in each of time_s, x_m, y_m, z_m",
        ),
        (
            b'{"latitude": 1.0, "longitude": 2.0, "timestamp": {"sec": NaN, "nsec": 0}}',
            LOCATION,
            r"message 1 on /a: its timestamp is nan s; leave it out",
        ),
        (b"{", LOCATION, r"a.mcap: message 1 on /a: is no JSON: Expecting property name"),
    ],
)
def test_messages_that_are_no_positions_are_told(
    tmp_path: Path, content: Any, schema: str, said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        read_recording(mcap(tmp_path / "a.mcap", [("/a", schema, content)]))


def flown(path: Path, track: str, depth_m: float = 10.0) -> Any:
    """Return the places of an AUV that is to go along a track of a file."""
    route = {"kind": "track", "files": [str(path)], "tracks": [track]}
    asked = scenario(
        auvs={"count": 1, "route": route}, survey={"depth_m": depth_m},
        environment={"origin": {"lat_deg": 54.33, "lon_deg": 10.18}},
    )  # fmt: skip
    tracks = Setup(asked).auv_tracks
    assert tracks is not None
    return tracks[0][1]


def test_heights_above_the_ellipsoid_are_depths_below_the_plane_of_the_survey(
    tmp_path: Path,
) -> None:
    """10 km from its centre that plane is 7.84 m above the ellipsoid (pymap3d 3.2.0)."""
    there = (54.4198375206246, 10.18, 7.839823805987634)
    messages = [("/a", LOCATION, fix(*there)), ("/a", LOCATION, fix(there[0], 10.18, None))]
    places = flown(mcap(tmp_path / "a.mcap", messages), "/a", 12.0)
    assert places[0] == pytest.approx([10_000.0, 0.0, 0.0], abs=1e-6)
    assert places[1, 2] == 12.0


def test_a_height_far_above_the_sea_is_refused_of_the_track_that_is_asked_for(
    tmp_path: Path,
) -> None:
    """Receivers tell heights above the ellipsoid, which may lie far below the sea."""
    row = {"time_s": 0, "x_m": 0, "y_m": 0, "z_m": 3}
    messages = [
        ("/ship/location", LOCATION, fix(54.33, 10.18, 40.0)),
        ("/ship/location", LOCATION, fix(54.33, 10.18, 41.0)),
        ("/auv/tracks", "row", row),
        ("/auv/tracks", "row", {**row, "time_s": 1}),
    ]
    path = mcap(tmp_path / "a.mcap", messages)
    with pytest.raises(
        ValueError, match=r"message 2 on /ship/location: is 41 m above the sea; .*R"
    ):
        flown(path, "/ship/location")
    assert flown(path, "/auv/tracks")[:, 2].tolist() == [3.0, 3.0]


def test_a_file_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"gone.csv: cannot be read as a CSV file: No such file"):
        read_recording(tmp_path / "gone.csv")


WORDS = ["time_s", "x_m", "y_m", "lat_deg", "lon_deg", "depth_m", "0", "91", "nan", "1e400", '"']


@given(
    st.lists(st.sampled_from([*WORDS, ",", "\n", "\0", "vehicle"])), st.sampled_from(["csv", "gpx"])
)
def test_whatever_stands_in_a_track_file_nothing_but_a_bad_chart_is_raised(
    tmp_path_factory: pytest.TempPathFactory, words: list[str], ending: str
) -> None:
    path = tmp_path_factory.getbasetemp() / f"any.{ending}"
    path.write_text("time_s,x_m,y_m,depth_m\n0,0,0,0\n" + "".join(words))
    try:
        found = read_recording(path)
    except ValueError as error:
        said = str(error)
    else:
        said = str(path)
        assert not any(map(math.isnan, found.times))
    assert said.startswith(str(path))
