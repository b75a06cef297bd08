"""AUVs that another program moves over UDP: NMEA, MAVLink, JSON, and whatever else comes."""

import json
import math
import os
import select
import selectors
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_for_tests import FORMATS, START, Output, Session, at_sea, earth_of, written
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bindusbl_des import Instruments, Mission, Setup, load_result
from bindusbl_des.apps.live.nmea import sentence
from bindusbl_des.apps.live.poses import Received
from bindusbl_des.core.geometry.geodesy import geodetic_from_ned

ORIGIN = (54.33, 10.18)


@pytest.fixture
def ear() -> Any:
    found = Received("127.0.0.1", 0, 2, ORIGIN)
    yield found
    found.close()


def test_each_way_of_saying_a_pose_is_the_same_pose(ear: Received) -> None:
    """Within the last digit of each: 1e-7 degrees (12 mm), 1e-6 minutes (2 mm), a double."""
    place, heading = [40.0, -30.0, 12.5], 1.25
    lat, lon, _ = geodetic_from_ned(place, *ORIGIN)
    degrees = {"lat_deg": lat, "lon_deg": lon, "depth_m": 12.5, "heading_deg": 71.61972439135292}
    writer = mavlink.MAVLink(None, srcSystem=1)
    here = writer.global_position_int_encode(
        1, round(lat * 1e7), round(lon * 1e7), -12_500, -12_500, 0, 0, 0, 65535
    )
    turned = writer.attitude_encode(1, 0.0, 0.0, heading, 0.0, 0.0, 0.0)
    minutes = f"{54}{(lat - 54) * 60:09.6f},N,010{(lon - 10) * 60:09.6f},E"
    ways = {
        "json": json.dumps({"vehicle": "AUV0", **degrees}).encode(),
        "metres": b'{"vehicle": "AUV0", "x_m": 40, "y_m": -30, "z_m": 12.5, "heading_deg": %.12f}'
        % math.degrees(heading),
        "mavlink": here.pack(writer) + turned.pack(writer),
        "nmea": (
            sentence("GPHDT", f"{math.degrees(heading):.6f}", "T")
            + sentence("GPGGA", "080000.00", minutes, "1,12,0.9,-12.5,M,0.0,M,,")
        ).encode(),
    }
    for name, text in ways.items():
        fresh = Received("127.0.0.1", 0, 1, ORIGIN)
        fresh.take(text)
        assert not fresh.missing, name
        (pose,) = fresh.advance_to(0.0)["auvs"]
        assert pose[:3].tolist() == pytest.approx(place, abs=0.012), name
        assert pose[3] == pytest.approx(heading, abs=1e-6), name
        fresh.close()


NONSENSE = [
    (b"hello", "not understood"),
    (b"\xff\xfe", "not understood"),
    (b"{}", "not understood"),
    (b"[" * 4000, "not understood"),
    (b'{"vehicle": "AUV0", "x_m": 0, "y_m": 0, "z_m": 0}\n' * 100, "longer than 4096 bytes"),
    (b'{"vehicle": 7}', "not understood"),
    (b'{"vehicle": "AUV9", "x_m": 0, "y_m": 0, "z_m": 0}', "of no AUV that there is"),
    (b'{"vehicle": "ASV0", "x_m": 0, "y_m": 0, "z_m": 0}', "of no AUV that there is"),
    (b'{"vehicle": "AUV0", "x_m": NaN, "y_m": 0, "z_m": 0}', "not finite"),
    (b'{"vehicle": "AUV0", "x_m": 1e400, "y_m": 0, "z_m": 0}', "not finite"),
    (b'{"vehicle": "AUV0", "x_m": 1e9, "y_m": 0, "z_m": 0}', "far from the survey"),
    (
        b'{"vehicle": "AUV0", "x_m": 0, "y_m": 0, "z_m": -90}',
        "out of the water: depths are",
    ),
    (b'{"vehicle": "AUV0", "x_m": 9999, "y_m": 0, "z_m": 5}', "farther than anybody goes"),
    (b'{"vehicle": "AUV0", "lat_deg": 91, "lon_deg": 0, "depth_m": 5}', "nowhere on Earth"),
    (b"$GPHDT,12.0,T*00", "damaged"),
    (b"$GPGGA,080000.00,5419.8,N,01010.8,E,0,0,,,M,,M,,", "of a receiver without a fix"),
    (b"\xfd" + bytes(6) + b"\x21" + bytes(20), "damaged"),
    (b"$GPGGA,,,,,1", "not understood"),
    (b"$GPGGA,080000.00,5475.8,N,01010.8,E,1,9,1,-3,M,,M,,", "of no latitude and longitude"),
    (b"$GPGGA,080000.00,5419.8,n,01010.8,E,1,9,1,-3,M,,M,,", "of no latitude and longitude"),
    (b"$GPGGA,080000.00,5419.8,N,01010.8,,1,9,1,-3,M,,M,,", "of no latitude and longitude"),
    (b"$GPGGA,080000.00,5419.8,N,-1010.8,E,1,9,1,-3,M,,M,,", "of no latitude and longitude"),
    (b"$GPGGA,080000.00,9119.8,N,01010.8,E,1,9,1,-3,M,,M,,", "nowhere on Earth"),
    (b"$GPGGA,080000.00,5419.8,N,01010.8,E,1,9,1,-10,F,,M,,", "of a height that is not in met"),
    (b"$GPGGA,080000.00,5419.8,N,01010.8,E,,9,1,-3,M,,M,,", "of a receiver without a fix"),
    (b"$gpgga,080000.00,5419.8,N,01010.8,E,1,9,1,-3,M,,M,,", "not understood"),
    (b"$GPTHS,12.0,V", "of a compass without a heading"),
    (b'{"vehicle": "AUV0", "lat_deg": 54, "lon_deg": 370, "depth_m": 5}', "nowhere on Earth"),
]


@pytest.mark.parametrize(("text", "why"), NONSENSE)
def test_nonsense_is_counted_and_the_last_good_pose_holds(
    ear: Received, text: bytes, why: str
) -> None:
    for auv in (0, 1):
        good = {"vehicle": f"AUV{auv}", "x_m": 1.0, "y_m": 2.0, "z_m": 3.0, "heading_deg": 0.0}
        ear.take(json.dumps(good).encode())
    before = ear.advance_to(0.0)["auvs"]
    ear.take(text)
    assert np.array_equal(ear.advance_to(0.1)["auvs"], before)
    assert sum(ear.counts.values()) == 3
    assert any(it.startswith(why) for it in ear.counts)
    assert why in ear.words()


HERE = "5419.8,N,01010.8,E"


@pytest.mark.parametrize(
    ("text", "depth"),
    [
        (sentence("GPGGA", "080000.00", HERE, "1,9,0.9,-7.5,M,,M,,").encode(), 7.5),
        (sentence("GNGGA", "080000.00", HERE, "4,9,0.9,-7.5,M,40.0,M,,").encode(), 7.5),
        (sentence("IIGGA", "", HERE, "6,,,-7.5,M,,,,").encode(), 7.5),
        (sentence("GPGGA", "080000.00", HERE, "1,9,0.9,,M,,M,,").encode(), 20.0),
        (sentence("GPGGA", "080000.00", HERE, "1").encode(), 20.0),
        (
            b"\\s:AUV,c:1717228800*5A\\"
            + sentence("GPGGA", "080000.00", HERE, "1,9,0.9,-7.5,M,,M,,").encode(),
            7.5,
        ),
        (b"\x00\xff" + sentence("GPGGA", "", HERE, "1,9,0.9,-7.5,M,,M,,").encode(), 7.5),
        (b"\xef\xbb\xbf" + sentence("GPGGA", "", HERE, "1,9,0.9,-7.5,M,,M,,").encode(), 7.5),
        (b'{"vehicle": "AUV0", "lat_deg": 54.33, "lon_deg": -349.82, "heading_deg": null}', 20.0),
    ],
)
def test_places_are_understood_as_programs_send_them(text: bytes, depth: float) -> None:
    """Any talker, behind a TAG block or bytes of something else; who says no depth is as deep as
    the survey, or as before.
    """
    ear = Received("127.0.0.1", 0, 1, ORIGIN, [20.0])
    try:
        for heading in (b"$GPHDT,90.0,T\r\n", b"$GPTHS,180.0,A\r\n"):
            ear.take(text.strip() + b"\r\n" + heading)
        pose = ear.advance_to(0.0)["auvs"][0]
        assert pose.tolist() == pytest.approx([0.0, 0.0, depth, math.pi], abs=0.02)
        ear.take(b'{"vehicle": "AUV0", "lat_deg": 54.33, "lon_deg": 10.18, "depth_m": 9}')
        ear.take(b"$GPGGA,080000.00,5419.8,N,01010.8,E,1,9,0.9,,M,,M,,")
        assert ear.advance_to(60.0)["auvs"][0, 2] == pytest.approx(9.0, abs=1e-6)
    finally:
        ear.close()


@pytest.mark.parametrize("surface_m", [0.0, 6.0, 372.0, -430.0])
def test_an_autopilot_on_a_lake_is_as_deep_as_below_its_surface(surface_m: float) -> None:
    """The height of the lake above the sea is in `alt`, not in `relative_alt`."""
    ear = Received("127.0.0.1", 0, 1, ORIGIN)
    writer = mavlink.MAVLink(None, srcSystem=1)
    above = round(1e3 * (surface_m - 10.0))
    said = writer.global_position_int_encode(0, 543300000, 101800000, above, -10_000, 0, 0, 0, 0)
    ear.take(said.pack(writer))
    assert ear.advance_to(0.0)["auvs"][0, 2] == pytest.approx(10.0, abs=1e-6)
    ear.close()


def test_what_cannot_be_leaves_the_rest_of_its_datagram(ear: Received) -> None:
    """A foreign system, and a place that is none, before two AUVs in one datagram of MAVLink."""
    parts = []
    for system, lat in ((9, 543300000), (1, 1_000_000_000), (1, 543300000), (2, 543300000)):
        writer = mavlink.MAVLink(None, srcSystem=system)
        said = writer.global_position_int_encode(0, lat, 101800000, 0, 0, 0, 0, 0, 9000)
        parts.append(said.pack(writer))
    ear.take(b"".join(parts))
    assert ear.counts == {"taken": 2, "of no AUV that there is": 1, "nowhere on Earth": 1}


def test_a_message_is_found_behind_other_bytes(ear: Received) -> None:
    """The end of another message is before some, a mark of the byte order before JSON."""
    writer = mavlink.MAVLink(None, srcSystem=1)
    said = writer.global_position_int_encode(0, 543300000, 101800000, 0, 0, 0, 0, 0, 9000)
    message = said.pack(writer)
    ear.take(b"\x00" + message)
    ear.take(message[-9:] + message + message)
    ear.take(b'\xef\xbb\xbf{"vehicle": "AUV1", "x_m": 0, "y_m": 0, "z_m": 5}')
    assert ear.counts == {"taken": 4}


def test_no_byte_of_a_binary_telegram_is_taken_for_a_space(ear: Received) -> None:
    """Checksums end in any byte: all of 2,000 places are taken."""
    writer = mavlink.MAVLink(None, srcSystem=1)
    for n in range(2000):
        said = writer.global_position_int_encode(n, 543300000, 101800000, -n, -n, 0, 0, 0, 9000)
        ear.take(said.pack(writer))
    assert ear.counts == {"taken": 2000}


def test_a_heading_does_not_hide_that_a_place_is_missing(
    ear: Received, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An AUV of which only headings are heard is silent; what then is heard of far away is believed
    as soon as somebody could have gone there, headings in between or not.
    """
    now = 100.0
    monkeypatch.setattr("bindusbl_des.apps.live.poses.monotonic", lambda: now)

    def place(auv: int, x: float) -> bytes:
        return b'{"vehicle": "AUV%d", "x_m": %f, "y_m": 0, "z_m": 5}' % (auv, x)

    for auv in (0, 1):
        ear.take(place(auv, 0.0))
    for _ in range(40):
        now += 0.1
        ear.take(b"$GPHDT,12.0,T")
        ear.take(b"$GPRMC,080000.00,V,,,,,,,010626,,,N")
        ear.take(place(1, 0.0))
        ear.advance_to(now)
    assert ear.counts == {"taken": 82}
    assert "an AUV was silent for 4.0 s" in ear.words()
    ear.take(place(0, 240.0))
    assert ear.advance_to(now + 60.0)["auvs"][0, 0] == 240.0


def test_a_flood_of_datagrams_waits_for_further_looks() -> None:
    """However much has come, a look reads some lines: of small datagrams, and of full ones."""
    ear = Received("127.0.0.1", 0, 10, ORIGIN)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sea:
        for text, parts in ((b"garbage", 1), (b"1\n" * 2048, 2048), (b"\n" * 4096, 4096)):
            for _ in range(150):
                sea.sendto(text, ("127.0.0.1", ear.port))
            before = sum(ear.counts.values())
            ear.listen()
            assert 0 <= sum(ear.counts.values()) - before <= 384 + parts
            for _ in range(150):  # nothing is left of it
                ear.listen()
        good = b'{"vehicle": "AUV%d", "x_m": 0, "y_m": 0, "z_m": 5}'
        sea.sendto(b"\n".join(good % auv for auv in range(10)), ("127.0.0.1", ear.port))
        ear.listen()
    assert not ear.missing
    ear.close()


def test_a_mission_flies_where_it_is_told() -> None:
    """AUVs circle by datagrams; the mission has them there, and is given fixes of there.

    Meanwhile it waits: it looks around some times in each of its 60 steps.
    """
    looks: list[Session] = []
    scenario = at_sea(duration_s=6.0, auvs={"count": 2})
    ear, over = Received("127.0.0.1", 0, 2, ORIGIN), threading.Event()

    def pose(auv: int, angle: float) -> bytes:
        x, y = 20.0 * math.cos(angle), 20.0 * math.sin(angle) + 5.0 * auv
        said = {"x_m": x, "y_m": y, "z_m": 10.0, "heading_deg": math.degrees(angle) + 90.0}
        return json.dumps({"vehicle": f"AUV{auv}", **said}).encode()

    def swim() -> None:
        began = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sea:
            while not over.wait(0.02):
                for auv in (0, 1):
                    angle = 0.05 * (time.monotonic() - began)
                    sea.sendto(pose(auv, angle), ("127.0.0.1", ear.port))
                sea.sendto(b"garbage", ("127.0.0.1", ear.port))

    swimmer = threading.Thread(target=swim)
    swimmer.start()
    try:
        while ear.missing:
            ear.listen()
        mission = Mission(scenario, 3, poses=ear)
        with selectors.DefaultSelector() as selector:
            told: list[bytes] = []
            sink: Any = type(
                "Sink", (), {"name": "", "clients": 0, "send": lambda _, it: told.append(it)}
            )()
            output = Output(FORMATS["json"].make(), sink)
            session = Session(
                Instruments(mission), earth_of(Setup(scenario), START), [output], selector, print,
                follows=True,
            )  # fmt: skip
            session.fly(looks.append)
    finally:
        over.set()
        swimmer.join()
    result = mission.result()
    ear.close()
    tracks = result.tables["tracks"]
    of_it = tracks[tracks.vehicle == "AUV0"]
    assert np.hypot(of_it.x_m, of_it.y_m).tolist() == pytest.approx([20.0] * len(of_it), abs=0.1)
    assert len(result.tables["fixes"]) > 5
    assert b"fix" in b"".join(told)
    assert ear.counts["taken"] > 100
    assert ear.counts["not understood"] > 10
    assert len(looks) < 600
    assert session.lateness.quantile(0.5) < 0.15  # what happens in a step is sent at its end


def test_the_command_waits_for_poses_and_tells_of_them(tmp_path: Path) -> None:
    written(tmp_path, "name: posed\nduration_s: 3\nauvs: {count: 1}\n")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sea:
        sea.bind(("127.0.0.1", 0))
        port = sea.getsockname()[1]
    command = [
        sys.executable, "-m", "bindusbl_des.cli", "live", "sea.yaml", "--to", "json:file:j.txt",
        "--poses", f"udp:{port}", "--out", "flown",
    ]  # fmt: skip
    with (
        subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sea,
    ):
        began, said = time.monotonic(), b""
        assert process.stderr is not None
        while b"poses are refused" not in said and time.monotonic() - began < 120.0:
            sea.sendto(b'{"vehicle": "AUV0", "x_m": 3, "y_m": 4, "z_m": -60}', ("127.0.0.1", port))
            if select.select([process.stderr], [], [], 0.05)[0]:
                said += os.read(process.stderr.fileno(), 1 << 16)
        began = time.monotonic()
        while process.poll() is None and time.monotonic() - began < 120.0:
            sea.sendto(b'{"vehicle": "AUV0", "x_m": 3, "y_m": 4, "z_m": 5}', ("127.0.0.1", port))
            time.sleep(0.05)
        process.kill()  # if it still waits
        err = said.decode() + process.stderr.read()
    assert process.returncode == 0, err
    assert "poses are refused: out of the water" in err.partition("telegrams sent")[0]
    assert f"waiting for poses of AUV0 on UDP port {port}" in err
    assert "taken; refused: " in err
    tracks = load_result(tmp_path / "flown").tables["tracks"]
    of_it = tracks[tracks.vehicle == "AUV0"]
    assert of_it[["x_m", "y_m", "z_m"]].to_numpy() == pytest.approx(
        np.array([[3, 4, 5]] * len(of_it))
    )


def test_poses_by_gga_are_depths_below_the_lake() -> None:
    ear = Received("127.0.0.1", 0, 1, (47.25, 8.6, 372.0))
    try:
        ear.take(b"$GPGGA,120000,4715.000,N,00836.000,E,1,08,1.0,366.5,M,0.0,M,,")
        ear.take(b"$GPHDT,90.0,T")
        [pose] = ear.advance_to(0.0)["auvs"]
    finally:
        ear.close()
    assert pose[:3] == pytest.approx([0.0, 0.0, 5.5], abs=1e-6)
