"""Modems on a wire: hosts over ports and terminals, what sounds for them, and the same offline.

The codec of this file is its own: codes, fields and units as the SeaTrac Developer Guide has them,
by which public drivers read a beacon's lines.
"""

import json
import os
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import atan2, degrees, dist, hypot
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from commands_for_tests import call

from bindusbl_des import Mission, Scenario, load_result, simulate

pytestmark = pytest.mark.usefixtures("in_empty_folder")

# Three AUVs that hold their places around a vessel, and what hosts say is all that sounds.
QUIET: dict[str, Any] = {
    "name": "wire",
    "duration_s": 30.0,
    "auvs": {
        "count": 3,
        "route": {"kind": "hold", "positions_m": [[60, 80], [-90, 0], [200, 150]]},
    },
    "asvs": {"count": 1, "formation": {"positions_m": [[0, 0]]}},
    "protocol": {"schedule": "aloha", "frame_s": 1e6},
    "acoustics": {"hf": {"range_m": 600, "bit_rate_bps": 1000}, "loss": {"law": "none"}},
    "usbl": {"heading_sd_deg": 0, "pitch_sd_deg": 0, "roll_sd_deg": 0},
}
ASV0, SPEED = 4, 1500.0


def crc(data: bytes) -> int:
    """Return the guide's CRC-16, bit by bit."""
    value = 0
    for byte in data:
        for bit in range(8):
            is_odd = (byte >> bit ^ value) & 1
            value = value >> 1 ^ (0xA001 if is_odd else 0)
    return value


def asks(*data: int, more: bytes = b"") -> bytes:
    content = bytes(data) + more
    return b"#" + (content + struct.pack("<H", crc(content))).hex().upper().encode()


class Told(NamedTuple):
    """A line of a beacon: its code, its content, and when it was said."""

    code: int
    content: bytes
    at_s: float


def read(text: bytes, at_s: float = 0.0) -> Told:
    assert re.fullmatch(rb"\$([0-9A-F]{2}){3,}", text), text
    data = bytes.fromhex(text[1:].decode())
    assert struct.unpack("<H", data[-2:])[0] == crc(data[:-2])
    return Told(data[0], data[1:-2], at_s)


def fix_of(content: bytes) -> tuple[dict[str, float], bytes]:
    """Return the fields of an ACOFIX, and what is behind it."""
    named = dict(
        zip(
            ("to", "sender", "flags", "type", "yaw", "pitch", "roll", "depth", "speed", "rssi"),
            struct.unpack("<4B3hHHh", content[:16]),
            strict=True,
        )
    )
    rest = content[16:]
    if named["flags"] & 1:
        named |= zip(("count", "time", "range"), struct.unpack("<IiH", rest[:10]), strict=True)
        rest = rest[10:]
    if named["flags"] & 2:
        rest = rest[1 + 2 * rest[0] :]
        named |= zip(("azimuth", "elevation", "fit"), struct.unpack("<3h", rest[:6]), strict=True)
        rest = rest[6:]
    if named["flags"] & 4:
        named |= zip(("east", "north", "down"), struct.unpack("<3h", rest[:6]), strict=True)
        rest = rest[6:]
    return named, rest


def lines_of(mission: Mission, vehicle: str, *codes: int) -> list[Told]:
    """Return what a vehicle's beacon has said, of some codes."""
    table = mission.result().tables["modem_lines"]
    said = table[(table["vehicle"] == vehicle) & (table["said_by"] == "modem")]
    told = [read(it.line.encode(), it.time_s) for it in said.itertuples()]
    return [it for it in told if it.code in codes]


def spoken(*said: tuple[float, str, bytes], **changes: Any) -> Mission:
    """Fly a mission in which hosts say something."""
    mission = Mission(Scenario(**QUIET | {"modems": {"make": "seatrac"}} | changes), 1)
    for at_s, vehicle, text in said:
        mission.advance(at_s)
        mission.modems[vehicle].hear(text)
    return mission


def test_a_ping_with_usbl_by_hand() -> None:
    """Asked at 2 s for AUV0 at (60, 80, 10): 8 bytes at 1,000 bit/s, there, 10 ms, and back."""
    mission = spoken((2.0, "ASV0", asks(0x40, 1, 4)))
    (taken,) = lines_of(mission, "ASV0", 0x40)
    assert taken.content == bytes((0, 1))
    assert taken.at_s == 2.0
    away = dist((60, 80, 10), (0, 0, 0))
    (heard,) = lines_of(mission, "AUV0", 0x41)
    assert heard.at_s == pytest.approx(2.0 + 0.064 + away / SPEED, abs=1e-9)
    (answer,) = lines_of(mission, "ASV0", 0x42)
    assert answer.at_s == pytest.approx(2.0 + 2 * (0.064 + away / SPEED) + 0.010, abs=1e-9)
    fix, rest = fix_of(answer.content)
    assert rest == b""
    assert (fix["to"], fix["sender"], fix["type"], fix["flags"]) == (ASV0, 1, 5, 7)
    assert fix["time"] / 1e7 == pytest.approx(away / SPEED, abs=5e-5)
    assert fix["range"] / 10 == pytest.approx(away, abs=0.1)
    assert (fix["north"] / 10, fix["east"] / 10) == pytest.approx((60, 80), abs=3.0)
    turned = fix["yaw"] / 10 + fix["azimuth"] / 10  # from north
    assert (turned - degrees(atan2(80, 60)) + 180) % 360 - 180 == pytest.approx(0, abs=2.0)
    assert fix["elevation"] / 10 == pytest.approx(-degrees(atan2(10, hypot(60, 80))), abs=2.0)


def test_what_a_request_lets_a_beacon_measure() -> None:
    """Without U no direction; with X the depth that the other tells; an AUV's beacon has none."""
    mission = spoken(
        (1.0, "ASV0", asks(0x40, 1, 2)), (3.0, "ASV0", asks(0x40, 1, 6)),
        (5.0, "AUV1", asks(0x40, 1, 4)),
    )  # fmt: skip
    plain, enhanced = (fix_of(it.content)[0] for it in lines_of(mission, "ASV0", 0x42))
    (of_auv,) = (fix_of(it.content)[0] for it in lines_of(mission, "AUV1", 0x42))
    assert (plain["flags"], enhanced["flags"], of_auv["flags"]) == (1, 15, 1)
    assert enhanced["down"] == 100
    assert of_auv["range"] / 10 == pytest.approx(dist((60, 80), (-90, 0)), abs=0.1)


def test_data_are_acknowledged_with_what_was_queued() -> None:
    mission = spoken(
        (1.0, "AUV0", asks(0x64, ASV0, 3, more=b"abc")),
        (2.0, "ASV0", asks(0x60, 1, 2, 5, more=b"hello")),
        (4.0, "ASV0", asks(0x60, 0, 0, 2, more=b"hi")),
        (6.0, "ASV0", asks(0x48, 2, 2, 4, more=b"echo")),
        (8.0, "ASV0", asks(0x50, 3, 0x89, 0)),
        (10.0, "ASV0", asks(0x5B, 2, 4, more=b"TEST")),  # of beacon 2, to all
    )
    at_auv, broadcast = lines_of(mission, "AUV0", 0x61)
    assert fix_of(at_auv.content)[1] == b"\x00\x05hello\xff"
    assert fix_of(broadcast.content)[1] == b"\x00\x02hi\xff"
    (back,) = lines_of(mission, "ASV0", 0x61)
    assert fix_of(back.content)[1] == b"\xff\x03abc\xff"
    assert len(lines_of(mission, "AUV2", 0x61)) == 1
    (echo,) = lines_of(mission, "ASV0", 0x4A)
    assert fix_of(echo.content)[1] == b"\x04echo"
    (known,) = lines_of(mission, "ASV0", 0x52)
    (status,), (at_auv,) = lines_of(mission, "ASV0", 0x5B), lines_of(mission, "AUV2", 0x5C)
    assert status.content == b"\x00\x02"
    assert fix_of(at_auv.content)[1] == b"\x02\x04TEST\xff"
    flags, depth, yaw, pitch, roll, size, local = struct.unpack("<Bi3hBB", fix_of(known.content)[1])
    assert (flags, size, local, depth) == (0x89, 0, 255, 100)
    assert (pitch, roll) == (0, 0)
    assert 0 <= yaw < 3600


def test_what_cannot_be_is_told_by_its_code() -> None:
    """A busy beacon, no answer, wrong fields, too few of them, and what is no command."""
    mission = spoken(
        (1.0, "ASV0", asks(0x40, 9, 2)),  # nobody has this number
        (1.1, "ASV0", asks(0x40, 1, 2)),
        (9.0, "ASV0", asks(0x40, ASV0, 2)),
        (9.1, "ASV0", asks(0x40, 1)),
        (9.2, "ASV0", asks(0x60, 1, 2, 9, more=b"few")),
        (9.3, "ASV0", asks(0x40, 1, 2)[:-1] + b"0"),
        (9.4, "ASV0", b"\xff\x00garbage"),
        (9.5, "ASV0", b"#4001" + asks(0x40, 1, 2)),  # half a line before it
        (20.0, "ASV0", asks(0x99)),
    )
    taken = [(it.content[0], it.content[1:]) for it in lines_of(mission, "ASV0", 0x40)]
    assert taken == [(0, b"\x09"), (0x30, b"\x01"), (5, b"\x04"), (4, b"\x01"), (0, b"\x01")]
    (error,) = lines_of(mission, "ASV0", 0x43)
    assert error.content == bytes((0x34, 9))
    assert lines_of(mission, "ASV0", 0x60)[0].content[0] == 4
    assert lines_of(mission, "ASV0", 0x99)[0].content == b"\x01"
    assert len(lines_of(mission, "ASV0", 0x42)) == 1


def test_settings_are_kept_and_obeyed() -> None:
    """A beacon gets another number, and tells its status ten times a second."""
    mission = spoken((1.0, "AUV0", asks(0x15)))
    (settings,) = lines_of(mission, "AUV0", 0x15)
    changed = bytearray(settings.content)
    changed[0] = 4
    assert changed[-14] == 1
    changed[-14] = 12
    mission = spoken(
        (1.0, "AUV0", asks(0x16, more=bytes(changed))), (3.0, "ASV0", asks(0x40, 12, 2))
    )
    assert lines_of(mission, "AUV0", 0x16)[0].content == b"\x00"
    assert fix_of(lines_of(mission, "ASV0", 0x42)[0].content)[0]["sender"] == 12
    assert len(lines_of(mission, "AUV0", 0x10)) == pytest.approx(290, abs=3)


def test_two_messages_at_once_collide_at_a_beacon() -> None:
    """Signals of hosts are signals of the mission: overlaps destroy them, and it is on record."""
    mission = spoken((1.0, "AUV0", asks(0x60, 0, 0, 0)), (1.0, "AUV1", asks(0x60, 0, 0, 0)))
    assert lines_of(mission, "ASV0", 0x61) == []
    heard = mission.result().tables["signal_receptions"]
    assert set(heard[heard["listener"] == "ASV0"]["outcome"]) == {"collided"}


def test_an_evologics_modem_delivers_and_locates() -> None:
    mission = Mission(Scenario(**QUIET | {"modems": {"make": "evologics"}}), 1)
    said: list[bytes] = []
    heard: list[bytes] = []
    mission.modems["ASV0"].on_say, mission.modems["AUV0"].on_say = said.append, heard.append
    mission.advance(1.0)
    mission.modems["ASV0"].hear(b"AT*SENDIM,p0,5,1,ack,hello")
    mission.advance(5.0)
    for wrong in (
        b"AT*SENDIM,4,1,ack,hello", b"AT*SENDIM,x", b"AT*SENDIM,1,4,ack,a", b"ATxyz", b"hi",
        b"AT!AL999",
    ):  # fmt: skip
        mission.modems["ASV0"].hear(wrong)
    mission.modems["ASV0"].hear(b"+++AT*SENDIM,1,77,ack,a")
    mission.advance(20.0)
    text = [it.decode().rstrip() for it in said]
    assert text[:2] == ["OK", "SENDSTART,1,im,104000,0"]
    assert "DELIVEREDIM,1" in text
    (where,) = (it.split(",") for it in text if it.startswith("USBLLONG,"))
    east, north, up = (float(it) for it in where[7:10])
    assert (east, north, up) == pytest.approx((80, 60, -10), abs=3.0)
    assert float(where[13]) == pytest.approx(1e6 * dist((60, 80, 10), (0, 0, 0)) / SPEED, abs=50)
    assert [it for it in text if it.startswith("ERROR")] == [
        "ERROR WRONG LENGTH", "ERROR WRONG FORMAT", "ERROR WRONG DESTINATION ADDRESS",
        "ERROR WRONG COMMAND", "ERROR OUT OF RANGE",
    ]  # fmt: skip
    assert "+++AT*SENDIM:2:OK" in text
    assert "+++AT:11:FAILEDIM,77" in text
    (got,) = (it for it in heard if it.startswith(b"RECVIM,"))
    assert re.fullmatch(rb"RECVIM,5,4,1,ack,104000,-60,150,0.0,hello\r\n", got)


def test_a_host_is_heard_when_it_speaks_however_long_nothing_has_happened() -> None:
    mission = Mission(Scenario(**QUIET | {"modems": {"make": "evologics"}}), 1)
    mission.advance(20.3)
    mission.modems["ASV0"].hear(b"AT*SENDIM,5,1,noack,hello")
    mission.advance(25.0)
    (signal,) = mission.result().tables["signals"].sent_at_s
    assert signal == 20.3


def test_the_same_lines_offline_are_the_same_mission(tmp_path: Path) -> None:
    """Also those that were said as statuses were told, at whole seconds."""
    said = spoken(
        (2.0, "ASV0", asks(0x40, 1, 4)), (5.0, "ASV0", asks(0x10)),
        (7.123456789, "AUV1", asks(0x40, 1, 4)), (9.87654321, "ASV0", asks(0x40, 2, 4)),
    ).result()  # fmt: skip
    said.write(tmp_path / "said")
    keys = said.scenario.model_dump()
    keys["modems"]["lines"] = str(tmp_path / "said" / "modem_lines.parquet")
    again = simulate(Scenario.model_validate(keys), 1)
    for name in ("signals", "signal_receptions", "modem_lines"):
        assert again.arrow[name].equals(said.arrow[name]), name


@contextmanager
def live(*to: str, duration_s: float = 30.0) -> Iterator[tuple[list[str], "subprocess.Popen[str]"]]:
    """Have a live session at 20 times real time; yield where its modems are, and its process."""
    Path("wire.yaml").write_text(json.dumps(QUIET | {"duration_s": duration_s}))
    options = [part for it in to for part in ("--to", it)]
    command = [sys.executable, "-m", "bindusbl_des", "live", "wire.yaml", *options]
    command += ["--speed", "20", "--seed", "1", "--out", "flown"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as session:
        assert session.stdout is not None
        where = []
        for told in session.stdout:
            where += re.findall(r", \w+: (?:listens on [\d.]+:)?(\S+)$", told.strip())
            if len(where) == sum(1 + it.partition(":")[0].count(",") for it in to):
                break
        try:
            yield where, session
        finally:
            session.kill()


class Host:
    """A program that speaks with a beacon over a port or a terminal."""

    def __init__(self, where: str) -> None:
        if where.isdigit():
            self._port = socket.create_connection(("127.0.0.1", int(where)))
            self._file = self._port.fileno()
        else:
            self._file = os.open(where, os.O_RDWR | os.O_NOCTTY)
        os.set_blocking(self._file, False)
        self._rest = b""

    def close(self) -> None:
        if hasattr(self, "_port"):
            self._port.close()
        else:
            os.close(self._file)

    def say(self, data: bytes) -> None:
        os.write(self._file, data)

    def hear_until(self, ends: bytes) -> bytes:
        """Return all that a modem says up to what ends so."""
        while ends not in self._rest:
            assert select.select([self._file], [], [], 60.0)[0], self._rest
            self._rest += os.read(self._file, 4096)
        said, _, self._rest = self._rest.partition(ends)
        return said

    def hear(self, code: int, within_s: float = 60.0) -> Told:
        """Return the next line of a code."""
        until = time.monotonic() + within_s
        while time.monotonic() < until:
            if not select.select([self._file], [], [], 0.2)[0]:
                continue
            *lines, self._rest = (self._rest + os.read(self._file, 4096)).split(b"\r\n")
            for told in map(read, lines):
                if told.code == code:
                    return told
        raise AssertionError(f"nothing of {code:#x} within {within_s} s")


def test_a_host_over_a_port_and_one_over_a_terminal() -> None:
    """Pings, data, garbage and two hosts of one beacon; the folder says the same offline."""
    with live("seatrac/ASV0,AUV0:tcp:0", "seatrac/AUV1:pty", duration_s=400.0) as (where, session):
        vessel, auv, other = map(Host, where)
        second = Host(where[0])
        vessel.say(asks(0x02) + b"\r\n")
        assert vessel.hear(0x02).content[5:7] == struct.pack("<H", 795)
        second.say(b"\x00\xffgarbage\r\n#4001")  # and half a line, which is its own
        vessel.say(asks(0x40, 1, 6)[:5])
        vessel.say(asks(0x40, 1, 6)[5:] + b"\r\n")
        assert fix_of(auv.hear(0x41).content)[0]["sender"] == ASV0
        assert fix_of(vessel.hear(0x42).content)[0]["flags"] == 15
        assert fix_of(second.hear(0x42).content)[0]["flags"] == 15
        other.say(asks(0x60, ASV0, 2, 2, more=b"up") + b"\r\n")
        assert fix_of(vessel.hear(0x61).content)[1] == b"\x00\x02up\xff"
        assert fix_of(other.hear(0x61).content)[1] == b"\xff\x00\xff"
        for host in (vessel, second, auv, other):
            host.close()
        session.send_signal(signal.SIGINT)
        assert session.wait(timeout=120) == 0
    flown = load_result("flown")
    assert flown.scenario.modems is not None
    assert set(flown.tables["signals"]["kind"]) == {"seatrac"}
    keys = flown.scenario.model_dump()
    keys["modems"]["lines"] = "flown/modem_lines.parquet"
    again = simulate(Scenario.model_validate(keys), 1)
    for name in ("signals", "signal_receptions", "modem_lines"):
        assert again.arrow[name].equals(flown.arrow[name]), name


def test_hosts_of_s2c_modems_send_any_bytes_by_any_line_ends() -> None:
    """Line ends among the bytes of a message are content; half a line is its host's own."""
    to = ("evologics/ASV0,AUV0:tcp:0", "evologics/AUV1:pty")
    with live(*to, duration_s=400.0) as (where, session):
        vessel, auv, other = map(Host, where)
        second = Host(where[0])
        second.say(b"\x00\xffgarbage\nAT?A")
        vessel.say(b"+++AT*SENDIM,p0,5,1,ack,a\r")
        vessel.say(b"\n,b\r")
        told = vessel.hear_until(b"SENDSTART,1,im,104000,0\r\n")
        assert told == b"+++AT*SENDIM:2:OK\r\n+++AT:23:"
        assert auv.hear_until(b",ack,104000,-60,150,0.0,a\r\n,b\r\n").endswith(b"RECVIM,5,4,1")
        vessel.hear_until(b"USBLANGLES,")
        second.hear_until(b"USBLANGLES,")
        second.say(b"L\n")
        second.hear_until(b"\r\n4\r\n")
        other.say(b"AT?AL\rAT*SEND,2,4,hi\r\n")
        assert other.hear_until(b"ERROR WRONG COMMAND\r\n").endswith(b"2\r\n")
        for host in (vessel, second, auv, other):
            host.close()
        session.send_signal(signal.SIGINT)
        assert session.wait(timeout=120) == 0
    lines = load_result("flown").tables["modem_lines"]
    said = set(lines[lines["said_by"] == "host"]["line"])
    assert said == {
        r"\x00\xffgarbage", "AT?AL", r"+++AT*SENDIM,p0,5,1,ack,a\r\n,b", "AT*SEND,2,4,hi",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (("--to", "seatrac:pty", "--to", "evologics:pty"), "modems of one make"),
        (("--to", "seatrac:udp:127.0.0.1:1"), "seatrac does not go to udp"),
        (("--to", "seatrac/AUV7:pty"), "there is no AUV7"),
        (("--to", "seatrac:pty", "--speed", "max"), "give --speed 1"),
        (
            ("--to", "seatrac:pty", "--set", "auvs={count: 15}"),
            "modems.make: seatrac has addresses for 15 modems, and there are 16 vehicles",
        ),
        (("--to", "seatrac:pty", "--set", "protocol.ranging=passive"), "modems: need a vehicle"),
    ],
)
def test_what_cannot_be_on_a_wire_is_a_line(asked: tuple[str, ...], told: str) -> None:
    Path("wire.yaml").write_text(json.dumps(QUIET))
    done = call("live", "wire.yaml", *asked, "--out", "flown")
    assert done.exit_code == 2
    assert told in done.output
    assert not Path("flown").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("time_s,vehicle,line\n1.0,AUV9,#02\n", "row 1: AUV9 at 1.0 s"),
        ("time_s,vehicle\n1.0,AUV0\n", "row 1 needs time_s (s), vehicle and line"),
        ("time_s,vehicle,line\nsoon,AUV0,#02\n", "row 1 needs time_s (s), vehicle and line"),
        (None, "cannot be read"),
    ],
)
def test_a_wrong_record_of_hosts_is_a_line(text: str | None, told: str) -> None:
    if text is not None:
        Path("said.csv").write_text(text)
    with pytest.raises(ValueError, match=re.escape(told)):
        spoken(modems={"make": "seatrac", "lines": "said.csv"})
