"""Logs are read as they are meant, and what is wrong in them is told with its place."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from logs_for_tests import write_pyfg

from bindusbl_des import read_log

ODOMETRY = "time_s,x_m,y_m,yaw_rad\n10,0,0,0\n11,1,0,0\n13,3,0,0\n"
BEACONS = "beacon,x_m,y_m\nN,0,50\nE,50,0\n"
RANGES = "time_s,beacon,range_m\n12,N,50.1\n11,E,49\n"
DEGREES = "time_s,lat_deg,lon_deg,yaw_rad\n10,54.0,10.0,0\n11,54.0001,10.0,0\n"
CROSSED = "time_s,x_m,y_m,sd_x_m,sd_y_m,cov_xy_m2\n11,0,0,2,2.5,-6\n"


def folder_of(path: Path, **files: str) -> str:
    """Return a folder with CSV files."""
    for name, text in files.items():
        (path / f"{name}.csv").write_text(text)
    return str(path)


def test_steps_add_up_in_the_frame_of_the_last(tmp_path: Path) -> None:
    """Ahead 4 m, a quarter turn, 3 m: the odometry of a PyFG file."""
    log = read_log(str(write_pyfg(tmp_path / "run.pyfg")))
    assert log.places == pytest.approx(np.array([[0, 0], [2, 0], [4, 0], [4, 3]]))
    assert log.times.tolist() == [0.0, 1.0, 2.0, 4.0]
    assert not log.placed
    assert log.ranges.times.tolist() == [1.0, 2.0, 4.0]
    assert [log.beacons.names[k] for k in log.ranges.beacons] == ["L0", "L1", "L0"]
    assert log.stated is not None
    assert log.stated.range_m == pytest.approx(0.75)


def test_without_instants_the_way_stands_in(tmp_path: Path) -> None:
    """All stamps alike: an instant is the way gone at a nominal speed."""
    path = write_pyfg(tmp_path / "run.pyfg")
    words = [line.split() for line in path.read_text().splitlines()]
    rows = [[it[0], "0", *it[2:]] if it[0].startswith("EDGE") else it for it in words]
    path.write_text("\n".join(map(" ".join, rows)))
    log = read_log(str(path), speed=2.0)
    assert log.times == pytest.approx([0.0, 1.0, 2.0, 3.5])
    assert not log.has_clock


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (("A1 A2", "A2 A1"), ":5: the step from A2 to A1 does not go on"),
        (("A1 A2", "A0 A2"), ":5: the step from A0 to A2 does not go on"),
        ((" L0 4", " L7 4"), ":7: the beacon L7 has no VERTEX_XY"),
        ((".5625", ".5625 7"), ":7: EDGE_RANGE has 6 words, not 5"),
        (("0.5625", "inf"), ":7: EDGE_RANGE is inf"),
        (("0 40", "0 far"), ":2: needs a number in the column VERTEX_XY; met the text 'far'"),
        (("0.5625", "-0.5625"), ":7: needs a range from 0 m"),
        (("2 0 1.57", "2 0 90.57"), ":5: turns by 90.5.* rad, beyond 2 pi; are these degrees"),
        (("2 0 0 0.0004 0 0 0.0004", "2 0 0 0.0004 0 0 -0.0004"), ":4: needs variances of a step"),
        (("EDGE_SE2 4", "EDGE_SE2 1.5"), ":6: its instant 1.5 s is before"),
        (("VERTEX_XY L1 0 40", "VERTEX_XYZ L1 0 40 3"), ":2: VERTEX_XYZ is not known"),
        (("L1 0 40", "L1 0"), ":2: VERTEX_XY has 2 words, not 3"),
    ],
)
def test_mistakes_in_a_factor_graph_name_their_line(
    edit: tuple[str, str], told: str, tmp_path: Path
) -> None:
    """File, line and what is wrong there."""
    path = write_pyfg(tmp_path / "run.pyfg", edit)
    with pytest.raises(ValueError, match=f"{path}{told}"):
        read_log(str(path))


def test_a_factor_graph_is_of_one_vehicle(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is of one vehicle; leave out --vehicle"):
        read_log(str(write_pyfg(tmp_path / "run.pyfg")), "AUV1")


def test_a_folder_of_csv_is_a_log(tmp_path: Path) -> None:
    """Times begin at the first row of the odometry; sights are put in order."""
    log = read_log(folder_of(tmp_path, odometry=ODOMETRY, beacons=BEACONS, ranges=RANGES))
    assert log.times.tolist() == [0.0, 1.0, 3.0]
    assert log.ranges.times.tolist() == [1.0, 2.0]
    assert log.ranges.metres.tolist() == [49.0, 50.1]
    assert log.placed
    odometry = log.odometry(np.array([2.0]))
    assert odometry.position == pytest.approx(np.array([[2.0, 0.0]]))
    assert odometry.headings == pytest.approx(np.array([[2.0, 0.0]]))


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ({"odometry": ODOMETRY}, "neither ranges nor fixes"),
        ({"beacons": BEACONS}, "has no odometry"),
        (
            {"odometry": ODOMETRY.replace("\n11,1", "\n9,1").replace("\n13", "\n8")},
            "odometry.csv:3: time_s must increase, but 9 s follows 10 s",
        ),
        (
            {"odometry": ODOMETRY.replace(",0,0,0\n11,", ",0,x,0\n11,x")},
            "csv:2: needs a number in .* y_m",
        ),
        ({"odometry": ODOMETRY.replace("\n1", "\n17803008000")}, "times look like milliseconds"),
        (
            {"odometry": ODOMETRY.replace("yaw_rad", "yaw").replace("y_m", "north_m")},
            "csv:2: needs numbers in time_s, x_m, y_m, yaw_rad; it lacks y_m, yaw_rad and has "
            "time_s, x_m, north_m, yaw$",
        ),
        ({"beacons": "beacon,lat_deg,lon_deg\nN,54,10\n"}, "beacons.csv:2: is in lat_deg, lon_deg"),
        (
            {"odometry": DEGREES},
            "beacons.csv:2: is in metres, but the odometry is in lat_deg, lon_deg",
        ),
        (
            {"odometry": DEGREES.replace("54.0,", "154.0,"), "beacons": "beacon"},
            "odometry.csv:2: latitude 154 is beyond 90 deg: latitude and longitude are swapped",
        ),
        ({"ranges": RANGES.replace("E,", "W,")}, "ranges.csv:3: the beacon W is not in .*N, E"),
        ({"ranges": RANGES.replace("49", "-49")}, "ranges.csv:3: range_m is -49"),
        ({"ranges": RANGES.replace("49", "9" * 400)}, "ranges.csv:3: range_m is inf"),
        (
            {"odometry": ODOMETRY.replace("11,1", "11,1e308").replace("13,3", "13,1e308")},
            "odometry.csv:3: x_m is 1e.308; no log",
        ),
        (
            {"beacons": BEACONS + "N,0,51\n"},
            "beacons.csv:4: .* is listed twice",
        ),
        (
            {"ranges": RANGES.replace("12,", "99,")},
            "ranges.csv:2: time_s is 99, outside the time of the odometry, 10 to 13 s; are both by",
        ),
        ({"fixes": "time_s,x_m,y_m,sd_x_m,sd_y_m\n11,0,0,0,1\n"}, "fixes.csv:2: sd_x_m"),
        (
            {"fixes": "time_s,auv,x_m,y_m,sd_x_m,sd_y_m\n11,A,0,0,1,1\n11,B,0,0,2,1\n"},
            "fixes.csv: is of A, B; name one with --vehicle",
        ),
        ({"fixes": CROSSED}, "fixes.csv:2: cov_xy_m2 is -6, above sd_x_m times sd_y_m"),
    ],
)
def test_mistakes_in_csv_name_their_line(files: dict[str, str], told: str, tmp_path: Path) -> None:
    """File, line and column."""
    whole = {"odometry": ODOMETRY, "beacons": BEACONS, "ranges": RANGES}
    given = files if told.startswith(("neither", "has no")) else whole | files
    with pytest.raises(ValueError, match=told):
        read_log(folder_of(tmp_path, **given))


def test_a_log_in_degrees_is_in_metres_from_its_start(tmp_path: Path) -> None:
    """Lengths of a degree at 54 deg north on WGS-84: 111,305 m of latitude, 65,576 m of longitude
    (M = a (1 - e2) / w^3, N cos(lat) = a cos(lat) / w with w^2 = 1 - e2 sin^2(lat)).
    """
    a, e2, lat = 6378137.0, 6.69437999014e-3, np.radians(54.0)
    w = np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
    north, east = np.radians((a * (1.0 - e2) / w**3, a * np.cos(lat) / w))
    log = read_log(
        folder_of(
            tmp_path,
            odometry=DEGREES,
            beacons="beacon,lat_deg,lon_deg,z_m\nN,54.001,10.0,5\nE,54.0,10.001,5\n",
            ranges="time_s,beacon,range_m\n10.5,N,106\n",
            fixes="valid_at_s,lat_deg,lon_deg,sd_x_m,sd_y_m,outcome\n10.5,54.0001,10.0001,1,1,"
            "delivered\n10.6,,,,,lost\n",
        )
    )
    assert log.places == pytest.approx(np.array([[0.0, 0.0], [1e-4 * north, 0.0]]), abs=1e-4)
    placed = [[1e-3 * north, 0.0, 5.0], [0.0, 1e-3 * east, 5.0]]
    assert log.beacons.places == pytest.approx(np.array(placed), abs=2e-3)
    assert log.fixes.places == pytest.approx(1e-4 * np.array([[north, east]]), abs=1e-4)


def test_names_that_are_no_logs(tmp_path: Path) -> None:
    """What is not there, or of no kind that is known, is told so."""
    (tmp_path / "track.txt").write_text("0 0")
    other = str(tmp_path / "track.txt")
    for name, told in (("nowhere.pyfg", "no such log"), (other, "a log is a")):
        with pytest.raises(ValueError, match=told):
            read_log(name)


def test_vehicles_of_a_folder_are_told_apart(tmp_path: Path) -> None:
    """Of several vehicles one must be named; ASVs have no odometry to replay."""
    rows = "time_s,vehicle,imu_x_m,imu_y_m,yaw_rad\n"
    rows += "0,AUV0,0,0,0\n9,AUV0,9,0,0\n0,AUV1,5,5,0\n9,AUV1,9,5,0\n"
    fixes = "auv,valid_at_s,x_m,y_m,sd_x_m,sd_y_m,outcome\n"
    fixes += "AUV1,3,6,5,1,1,delivered\nAUV1,4,6,5,1,1,out_of_range\n"
    name = folder_of(tmp_path, tracks=rows, fixes=fixes)
    with pytest.raises(ValueError, match="holds AUV0, AUV1; name one with --vehicle"):
        read_log(name)
    log = read_log(name, "AUV1")
    assert log.places[0].tolist() == [5.0, 5.0]
    assert log.fixes.times.tolist() == [3.0]
    fixes = fixes.replace("auv,", "vehicle,") + "AUV0,5,6,5,1,1,delivered\n"
    fixes = fixes.replace("1,delivered", "1, Delivered")
    log = read_log(folder_of(tmp_path, tracks=rows, fixes=fixes), "AUV1")
    assert log.fixes.times.tolist() == [3.0]


def test_mcap_is_read_as_csv_is(tmp_path: Path) -> None:
    """Rows as JSON messages on topics give the log that the same rows give as CSV."""
    pytest.importorskip("mcap")
    from mcap.writer import Writer

    files = {"odometry": ODOMETRY, "beacons": BEACONS, "ranges": RANGES}
    (tmp_path / "csv").mkdir()
    asked = read_log(folder_of(tmp_path / "csv", **files))
    path = tmp_path / "log.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        for name, text in files.items():
            schema = writer.register_schema(name=name, encoding="jsonschema", data=b"{}")
            channel = writer.register_channel(
                topic=f"/AUV0/{name}", message_encoding="json", schema_id=schema
            )
            for number, row in enumerate(csv.DictReader(text.splitlines())):
                told = {key: _number(value) for key, value in row.items()}
                data = json.dumps(told).encode()
                writer.add_message(channel, log_time=number, data=data, publish_time=number)
        writer.finish()
    found = read_log(str(path))
    assert found.times.tolist() == asked.times.tolist()
    assert found.ranges.metres.tolist() == asked.ranges.metres.tolist()
    assert found.beacons.names == asked.beacons.names
    for size in (4, 100):
        (tmp_path / "broken.mcap").write_bytes(path.read_bytes()[:size])
        with pytest.raises(ValueError, match="cannot be read as an MCAP file"):
            read_log(str(tmp_path / "broken.mcap"))


def test_a_reception_without_a_plain_outcome_is_left_out(tmp_path: Path) -> None:
    """Whatever JSON may hold in its place."""
    pytest.importorskip("mcap")
    from mcap.writer import Writer

    path = tmp_path / "log.mcap"
    outcomes: list[Any] = ["heard", {"heard": 1}, ["lost"], "lost", None]
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(name="row", encoding="jsonschema", data=b"{}")
        odometry, receptions = (
            writer.register_channel(topic=it, message_encoding="json", schema_id=schema)
            for it in ("/odometry", "/receptions")
        )
        for n, outcome in enumerate(outcomes):
            pose = {"time_s": n, "x_m": 2.0 * n, "y_m": 0.0, "yaw_rad": 0.0}
            heard = {"time_s": 1.0 + n, "outcome": outcome}
            for channel, row in ((odometry, pose), (receptions, heard)):
                writer.add_message(channel, n, json.dumps(row).encode(), n)
        fixes = writer.register_channel(topic="/fixes", message_encoding="json", schema_id=schema)
        fix = {"time_s": 1, "x_m": 2.0, "y_m": 0.0, "sd_x_m": 0.5, "sd_y_m": 0.5}
        writer.add_message(fixes, 9, json.dumps(fix).encode(), 9)
        writer.finish()
    found = read_log(str(path)).receptions
    assert found is not None
    assert (found.times.tolist(), found.is_lost.tolist()) == ([1.0, 4.0], [False, True])


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
