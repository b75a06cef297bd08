"""What autopilots and topside software read: MAVLink, MAVProxy's JSON and the UGPS API."""

import json
import math
import socket
from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from commands_for_tests import call
from live_for_tests import (
    FixReading,
    Gnss,
    Topside,
    UsblReading,
    asked,
    at_sea,
    heard,
    ned_at_depth,
    written,
)
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bindusbl_des.apps.live.mavlink import (
    ATTITUDE,
    GLOBAL_POSITION_INT,
    GpsInputs,
    Mavlink,
    _gps_time,
    mavproxy,
    messages,
)
from bindusbl_des.apps.live.outputs import encoder

# By so many seconds TAI is ahead of UTC from some instant on (NTP seconds): leap-seconds.list of
# IERS, which expires on 2026-06-28.  GPS time is 19 s behind TAI.
TAI_UTC = {
    2524521600: 19, 2571782400: 20, 2603318400: 21, 2634854400: 22, 2698012800: 23, 2776982400: 24,
    2840140800: 25, 2871676800: 26, 2918937600: 27, 2950473600: 28, 2982009600: 29, 3029443200: 30,
    3076704000: 31, 3124137600: 32, 3345062400: 33, 3439756800: 34, 3550089600: 35, 3644697600: 36,
    3692217600: 37,
}  # fmt: skip

API = json.loads((Path(__file__).parents[1] / "reference" / "ugps_api.json").read_text())


def test_autopilots_are_given_the_fixes_that_were_delivered() -> None:
    """pymavlink reads each: position to 1e-7 degrees (1 cm), accuracy of the covariance, and the
    instant of the ping to a millisecond; and none while the last fix is stale.
    """
    scenario = at_sea(acoustics={"mf": {"range_m": 45.0}}, duration_s=120.0)
    readings, mission, earth = heard(scenario)
    encode, lines = Mavlink(), mavproxy()
    reader = mavlink.MAVLink(None)
    reader.robust_parsing = False
    fixes, seen = mission.result().tables["fixes"].set_index("fix"), set()
    kinds, numbers = {0: 0, 3: 0}, Counter[int]()
    for it in readings:
        sent, said = encode(it, earth), lines(it, earth)
        assert len(sent) == len(said)
        for telegram, text in zip(sent, said, strict=True):
            (message,) = reader.parse_buffer(telegram)
            assert message.get_type() == "GPS_INPUT"
            assert message.get_srcSystem() == int(it.vehicle[3:]) + 1
            numbers[message.get_srcSystem()] += 1
            assert message.get_seq() == numbers[message.get_srcSystem()] % 256
            kinds[message.fix_type] += 1
            alike = json.loads(text)
            assert alike["lat"] == message.lat
            assert alike["time_usec"] == message.time_usec
            if message.fix_type == 0:
                continue
            assert isinstance(it, FixReading)
            seen.add(it.fix.fix)
            row = fixes.loc[it.fix.fix]
            assert row.outcome == "delivered"
            ((x, y, _),) = ned_at_depth(
                [message.lat / 1e7], [message.lon / 1e7], [row.z_m], earth.origin
            )
            assert [x, y] == pytest.approx([row.x_m, row.y_m], abs=0.012)
            assert message.alt == pytest.approx(-row.z_m, rel=1e-6)
            accuracy = math.hypot(row.sd_x_m, row.sd_y_m)
            assert message.horiz_accuracy == pytest.approx(accuracy, rel=1e-6)
            begins = 86_400_000 + 8 * 3_600_000 + 18_000  # Monday, 8 h, leap seconds
            assert message.time_week_ms - begins == pytest.approx(1e3 * row.pinged_at_s, abs=0.51)
            assert message.time_usec / 1e6 - earth.start.timestamp() == pytest.approx(
                row.delivered_at_s, abs=2e-6
            )
    assert seen == set(fixes.index[fixes.outcome == "delivered"])
    assert min(kinds.values()) > 5


def test_messages_of_an_autopilot_are_read() -> None:
    """MAVLink 1 and 2, several in a datagram, garbage between; what is damaged is none."""
    for kind in ("mavlink1", "mavlink2"):
        writer = mavlink.MAVLink(None, srcSystem=7)
        here = writer.global_position_int_encode(
            5, 543300000, 101800000, -12_340, -12_340, 1, 2, 3, 9000
        )
        turned = writer.attitude_encode(5, 0.1, 0.2, 1.5, 0.0, 0.0, 0.0)
        others = writer.heartbeat_encode(12, 3, 0, 0, 0)
        first, second, third = (
            it.pack(writer, force_mavlink1=kind == "mavlink1") for it in (here, others, turned)
        )
        found = list(messages(b"\x00\xfd" + first + second + b"junk" + third))
        assert [it.number for it in found] == [GLOBAL_POSITION_INT, ATTITUDE]
        assert {it.system for it in found} == {7}
        assert found[0].fields[1:4] == (543300000, 101800000, -12_340)
        assert found[1].fields[3] == 1.5
        damaged = bytearray(first)
        damaged[12] ^= 1
        assert not any(messages(bytes(damaged)))
        for length in range(len(first)):
            assert not any(messages(first[:length]))
            found = [it for it in messages(first[:length] + second + third) if it]
            assert [it.number for it in found] == [ATTITUDE]
        for junk in (b"\xfe\x03", b"\xfd\xff", b"\xfe\x1c\x00\x00\x00\x21"):
            found = [it for it in messages(junk + first + third) if it]
            assert [it.number for it in found] == [GLOBAL_POSITION_INT, ATTITUDE]


def test_gps_time_has_the_leap_seconds_of_its_day() -> None:
    """A second before each of them, at it, and a day later."""
    began = datetime(1980, 1, 6, tzinfo=UTC)
    for seconds, ahead in TAI_UTC.items():
        leap = datetime(1900, 1, 1, tzinfo=UTC) + timedelta(seconds=seconds)
        for off, less in ((-1, 1), (0, 0), (86_400, 0)):
            when = leap + timedelta(seconds=off)
            if when < began:
                continue
            week, milliseconds = _gps_time(when)
            passed = (when - began).total_seconds() + ahead - less - 19
            assert week * 604_800 + milliseconds / 1e3 == passed, when


def check(value: Any, schema: dict[str, Any]) -> None:
    """Refuse a value that is not as the description has it."""
    types = {"number": (int, float), "integer": int, "string": str, "boolean": bool}
    if schema["type"] == "object":
        assert set(schema["required"]) <= set(value)
        for name in set(value) & set(schema["properties"]):
            check(value[name], schema["properties"][name])
    elif schema["type"] == "array":
        for it in value:
            check(it, schema["items"])
    else:
        assert isinstance(value, types[schema["type"]])
        assert isinstance(value, bool) == (schema["type"] == "boolean")
        assert schema.get("minimum", -math.inf) <= value if schema["type"] == "number" else True
        assert schema["type"] != "number" or value <= schema.get("maximum", math.inf)
        assert value in schema.get("enum", [value])


def test_every_answer_of_the_topside_is_as_its_api_says() -> None:
    """From nothing known, through each reading, to the last position: it is what was measured."""
    readings, _, earth = heard(at_sea(usbl={"gnss_sd_m": 0.5}, duration_s=20.0))
    last = [it for it in readings if isinstance(it, UsblReading)][-1]
    topside = Topside("ugps", "127.0.0.1", 0, last.vehicle, last.auv)
    base = f"http://127.0.0.1:{topside.port}"
    try:
        for number, it in enumerate(readings):
            assert topside(it, earth) == ()
            for path, schema in API["answers"].items():
                check(topside.answer(path), schema)
                if number % 100 == 0:
                    with urlopen(base + path, timeout=5.0) as answer:
                        assert json.load(answer) == topside.answer(path)
        assert topside.answer("/api/v1/position/acoustic/raw")["position_valid"]
        found = topside.answer("/api/v1/position/global")
        place = last.sight.place
        ((x, y, _),) = ned_at_depth([found["lat"]], [found["lon"]], [place[2]], earth.origin)
        assert [x, y] == pytest.approx(place[:2].tolist(), abs=1e-6)
        with pytest.raises(HTTPError, match="404"):
            urlopen(base + "/api/v2", timeout=5.0)
        with socket.create_connection(("127.0.0.1", topside.port)) as rude:
            rude.sendall(b"\x16\x03\x01\x02 garbage\r\n\r\n")
        with urlopen(base + "/api/", timeout=5.0) as answer:
            assert json.load(answer) == {"versions": ["v1"]}
    finally:
        topside.close()


class GpsInputOf(NamedTuple):
    """What an autopilot is sent: type of fix, dilution of precision, satellites."""

    fix_type: int
    hdop: float
    satellites: int

    @property
    def is_used(self) -> bool:
        """Whether ArduPilot's filter takes it by default: EK3_GPS_CHECK (HDOP, satellites)."""
        return self.fix_type >= 3 and self.hdop <= 2.5 and self.satellites >= 6


def forwarded(base: str, version: str) -> GpsInputOf:
    """Return what the maker's extension for BlueOS makes of a topside's answers, by its conditions
    (github.com/waterlinked/blueos-ugps-extension): 1.0.4 looks at the quality of the global
    position, 1.0.6 at its dilution and at the acoustic position, 1.0.7 at the configuration first.
    """

    def got(path: str) -> Any:
        with urlopen(base + path, timeout=5.0) as answer:
            return json.load(answer)

    place = got("/api/v1/position/global")
    assert {"lat", "lon", "orientation"} <= set(place)
    is_heard = got("/api/v1/position/acoustic/filtered")["position_valid"]
    satellites = max(place["numsats"], 0)
    if version == "1.0.4":
        unknown = 65535.0 if place["hdop"] == -1 else place["hdop"]
        return GpsInputOf(3 if place["fix_quality"] else 0, unknown, satellites)
    if version == "1.0.6":
        is_valid = place["hdop"] < 20 and is_heard
        return GpsInputOf(3 if is_valid else 0, place["hdop"], satellites)
    configured = got("/api/v1/config/generic")
    assert {"gps", "compass"} <= set(configured)  # or it waits for ever
    if configured["gps"] == "static" and "onboard" not in version:
        return GpsInputOf(3 if is_heard else 0, 1.0, max(satellites, 6))
    hdop = place["hdop"] if place["hdop"] > 0 else 65535.0
    return GpsInputOf(place["fix_quality"] if is_heard else 0, hdop, satellites)


def put(url: str, content: bytes) -> tuple[int, Any]:
    request = Request(url, data=content, method="PUT")
    try:
        with urlopen(request, timeout=5.0) as answer:
            return answer.status, json.load(answer)
    except HTTPError as error:
        return error.code, None


def test_the_maker_s_own_client_passes_fixes_on() -> None:
    """In each of its versions: a fix that ArduPilot uses, none once it is stale; what it tells is
    answered with 200, and the heading of the vehicle comes back.
    """
    readings, _, earth = heard(at_sea(duration_s=20.0))
    first = next(it for it in readings if isinstance(it, UsblReading))
    topside = Topside("ugps", "127.0.0.1", 0, first.vehicle, first.auv)
    base = f"http://127.0.0.1:{topside.port}"
    versions = ("1.0.4", "1.0.6", "1.0.7", "1.0.7, its GPS onboard")
    try:
        assert not any(forwarded(base, version).is_used for version in versions)
        for it in readings:
            if not isinstance(it, UsblReading) or it is first:
                topside(it, earth)
            if it is first:
                assert all(forwarded(base, version).is_used for version in versions)
                with urlopen(f"{base}/api/v1/config/generic", timeout=5.0) as answer:
                    configured = json.load(answer)
                master = topside.answer("/api/v1/position/master")
                assert [configured["static_lat"], configured["static_lon"]] == [
                    master["lat"],
                    master["lon"],
                ]
        assert not any(forwarded(base, version).is_used for version in versions)
        ok = (200, {"success": True})
        assert put(f"{base}/api/v1/external/depth", b'{"depth": 3.2, "temp": 10.0}') == ok
        assert put(f"{base}/api/v1/external/orientation", b'{"orientation": 271}') == ok
        assert topside.answer("/api/v1/position/global")["orientation"] == 271.0
        assert put(f"{base}/api/v1/external/orientation", b'{"orientation": -1}') == ok
        assert topside.answer("/api/v1/position/global")["orientation"] == -1.0
        for wrong in (b"{", b'{"orientation": "north"}', b'{"orientation": NaN}', b"[]"):
            assert put(f"{base}/api/v1/external/orientation", wrong)[0] == 400
        assert put(f"{base}/api/v1/position/global", b"{}")[0] == 404
        assert put(f"{base}/api/v1/external/depth", b" " * 100_000)[0] == 413
    finally:
        topside.close()


def test_a_position_grows_stale() -> None:
    readings, _, earth = heard(at_sea(duration_s=20.0))
    first = next(it for it in readings if isinstance(it, UsblReading))
    topside = Topside("ugps", "127.0.0.1", 0, first.vehicle, first.auv)
    try:
        for it in readings:
            if not isinstance(it, UsblReading) or it is first:
                topside(it, earth)
            if it is first:
                assert topside.answer("/api/v1/position/acoustic/raw")["position_valid"]
        assert not topside.answer("/api/v1/position/acoustic/filtered")["position_valid"]
        assert topside.answer("/api/v1/position/global")["fix_quality"] == 0
        assert topside.answer("/api/v1/position/master")["fix_quality"] == 3
    finally:
        topside.close()


def test_the_command_offers_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = call(
        "live", written(tmp_path), "--to", "ugps/ASV1,AUV2:http:0", "--to", "mavlink:file:m.bin",
        "--to", "mavproxy/AUV0:file:m.json", "--speed", "max", "--out", "flown",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "ASV1 locates AUV2: http://127.0.0.1:" in done.output
    assert Path("m.bin").read_bytes().startswith(b"\xfd")
    assert all(json.loads(it)["gps_id"] == 0 for it in Path("m.json").read_text().splitlines())
    done = call("live", "sea.yaml", "--to", "ugps:udp:1:2", "--out", "flown2")
    assert "ugps does not go to udp; write ugps:http:PORT" in done.output
    done = call("live", "sea.yaml", "--to", "mavlink:pty", "--dry")
    assert done.output.strip().startswith("fd ")


def test_fixes_at_the_surface_are_sent_as_gnss_and_as_gps_input() -> None:
    surfaced = {"survey": {"depth_m": 0.3}, "navigation": {"gnss_fix": {"every_s": 5.0}}}
    readings, mission, earth = heard(at_sea(duration_s=21.0, **surfaced))
    own = [it for it in readings if isinstance(it, Gnss) and it.vehicle == "AUV1"]
    rows = mission.result().tables["gnss_fixes"].query("auv == 'AUV1'")
    assert [it.at_s for it in own] == rows.fixed_at_s.tolist() == [5.0, 10.0, 15.0, 20.0]
    assert [it.place for it in own] == list(zip(rows.x_m, rows.y_m, strict=True))
    given = GpsInputs().of(own[0], earth)
    assert given is not None
    assert given.fix_type == 3
    assert given.lat == round(earth.geodetic(own[0].place)[0] * 1e7)
    assert given.horiz_accuracy == pytest.approx(math.sqrt(2.0) * 2.0)
    assert given.ignore_flags & mavlink.GPS_INPUT_IGNORE_FLAG_VERTICAL_ACCURACY
    for name, is_in in (("nmea", False), ("nmea/AUV0", False), ("nmea/AUV1", True)):
        encode = encoder(asked(f"{name}:file:x", ["AUV0", "AUV1"]), ())
        assert bool(encode(own[0], earth)) == is_in
