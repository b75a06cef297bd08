"""What instruments say is what the tables say, within the last digit of each format."""

import json
import math
from typing import Any

import numpy as np
import pynmea2
import pytest
from live_for_tests import (
    EstimateReading,
    FixReading,
    Gnss,
    Truth,
    UsblReading,
    at_sea,
    heard,
    ned_at_depth,
)

from bindusbl_des import simulate
from bindusbl_des.apps.live.nmea import _over_ground, sentences
from bindusbl_des.apps.live.outputs import line
from bindusbl_des.apps.live.readings import Compass

MISSIONS: dict[str, dict[str, Any]] = {
    "paper": {},
    "errors": {
        "usbl": {
            "misalignment_sd_deg": 1.0, "gnss_correlated_sd_m": 2.0, "gnss_sd_m": 0.5,
            "outlier_share": 0.1,
        }
    },
    "twtt": {"protocol": {"ranging": "twtt"}},
    "direct_reply": {"protocol": {"downlink": "direct_reply", "ranging": "twtt"}},
    "aloha": {"protocol": {"schedule": "aloha"}},
    "sheet": {"usbl": {"model": {"model": "datasheet", "accuracy_percent": 1.0}}},
    "passive": {"protocol": {"ranging": "passive"}},
    "lossy": {"acoustics": {"mf": {"range_m": 30.0}}},
}  # fmt: skip


@pytest.mark.parametrize("name", MISSIONS)
def test_who_listens_changes_nothing_and_hears_what_the_tables_have(name: str) -> None:
    """Each decoded ping is measured at once, as its fix will be; fixes come as they are delivered,
    and what was lost never.
    """
    scenario = at_sea(**MISSIONS[name])
    readings, mission, _ = heard(scenario)
    result = mission.result()
    plain = simulate(scenario, 3)
    assert all(result.arrow[it].equals(plain.arrow[it]) for it in plain.arrow)
    assert [it.at_s for it in readings] == sorted(it.at_s for it in readings)

    receptions, fixes = result.tables["receptions"], result.tables["fixes"]
    decoded = receptions[receptions.outcome == "heard"]
    sights = {(it.ping, it.vehicle): it for it in readings if isinstance(it, UsblReading)}
    if scenario.protocol.asvs_ping:
        assert not sights
    else:
        assert set(sights) == set(zip(decoded.ping, decoded.asv, strict=True))
        ends = decoded.arrived_at_s + scenario.acoustics.hf.ping_s
        for ping, asv, end in zip(decoded.ping, decoded.asv, ends, strict=True):
            assert sights[ping, asv].at_s == pytest.approx(end, abs=1e-9)
        if name in ("paper", "twtt", "aloha", "lossy"):  # neither outliers nor spread of a sheet
            for row in decoded[decoded.azimuth_deg.notna()].itertuples():
                sight = sights[row.ping, row.asv].sight
                x, y, z = (float(sight.place[axis]) - sight.own[axis] for axis in range(3))
                azimuth, elevation = math.atan2(y, x), math.atan2(z, math.hypot(x, y))
                turned = math.remainder(math.degrees(azimuth) - row.azimuth_deg, 360.0)
                assert turned == pytest.approx(0.0, abs=1e-9)
                assert math.degrees(elevation) == pytest.approx(row.elevation_deg, abs=1e-9)
        alone = fixes[~fixes.asvs.str.contains(" ")]
        assert len(alone) > 5
        for row in alone.itertuples():
            place = sights[row.ping, row.asvs].sight.place
            assert place.tolist() == [row.x_m, row.y_m, row.z_m]

    given = {it.fix.fix: it for it in readings if isinstance(it, FixReading)}
    delivered = fixes[fixes.outcome == "delivered"]
    assert set(given) == set(delivered.fix)
    assert name != "lossy" or len(delivered) < 0.8 * len(fixes)
    for row in delivered.itertuples():
        it = given[row.fix]
        assert (it.at_s, it.vehicle, it.fix.x_m) == (row.delivered_at_s, row.auv, row.x_m)

    tracks = result.tables["tracks"].set_index(["vehicle", "time_s"])
    for it in readings:
        if isinstance(it, EstimateReading):
            row = tracks.loc[it.vehicle, it.at_s]
            wanted = row[["estimate_x_m", "estimate_y_m", "estimate_z_m"]].tolist()
            assert it.place == pytest.approx(wanted, abs=1e-9)


def test_gnss_and_compass_err_as_the_scenario_says() -> None:
    """White noise of GNSS and compass over 600 telegrams; sd within 4 sd of its own estimate."""
    changes = {"duration_s": 300.0, "usbl": {"gnss_sd_m": 0.5, "heading_sd_deg": 2.0}}
    readings, _, _ = heard(at_sea(**changes), truth=True)
    true = {(it.vehicle, it.at_s): it for it in readings if isinstance(it, Truth)}
    off = [
        np.subtract(it.place, true[it.vehicle, it.at_s].place[:2])
        for it in readings
        if isinstance(it, Gnss)
    ]
    turned = [
        math.remainder(it.yaw - true[it.vehicle, it.at_s].yaw, math.tau)
        for it in readings
        if isinstance(it, Compass)
    ]
    count = len(turned)
    assert np.std(off) == pytest.approx(0.5, rel=4 / math.sqrt(4 * count))
    assert np.degrees(np.std(turned)) == pytest.approx(2.0, rel=4 / math.sqrt(2 * count))


def test_nothing_but_truth_is_the_truth() -> None:
    """Without it no telegram of any format has the errors of fixes, or true positions."""
    readings, _, earth = heard(at_sea())
    said = "".join(line(it, earth) for it in readings)
    assert '"truth"' not in said
    assert "error_m" not in said


def angle(text: str, side: str) -> float:
    whole, minutes = divmod(float(text), 100.0)
    return (whole + minutes / 60.0) * (-1 if side in "SW" else 1)


def test_nmea_is_read_back_as_it_was_measured() -> None:
    """Positions within the last digit (2 mm), what a USBL has measured within 1 mm, headings within
    0.01 degrees, instants within 0.01 s; at most 82 characters.
    """
    scenario = at_sea(usbl={"gnss_sd_m": 0.5})
    readings, _, earth = heard(scenario)
    assert earth.origin is not None
    kinds = set()
    for it in readings:
        for text in sentences(it, earth):
            assert len(text) <= 82
            assert text.endswith("\r\n")
            kind = text[1:].partition(",")[0]
            kinds.add(kind)
            if kind == "PSIMSSB":
                assert isinstance(it, UsblReading)
                data = pynmea2.NMEASentence.parse(text, check=True).data
                time, beacon, *system, x, y, depth = data[1:11] if data[0] == "SSB" else data[:10]
                assert system == ["A", "", "C", "H", "M"]
                assert beacon == f"B{int(it.auv[3:]) + 1:02d}"
                cosine, sine = math.cos(it.sight.yaw), math.sin(it.sight.yaw)
                north = cosine * float(y) - sine * float(x) + it.sight.own[0]
                east = sine * float(y) + cosine * float(x) + it.sight.own[1]
                down = float(depth) + it.sight.own[2]
                assert [north, east, down] == pytest.approx(it.sight.place.tolist(), abs=1e-3)
                when = 3600 * int(time[:2]) + 60 * int(time[2:4]) + float(time[4:])
                assert when - 8 * 3600 == pytest.approx(it.at_s, abs=0.0051)
                continue
            said = pynmea2.parse(text, check=True)
            if kind in ("GPGGA", "GPRMC"):
                assert isinstance(it, (Gnss, EstimateReading))
                depth = it.place[2] if isinstance(it, EstimateReading) else 0.0
                ((x, y, _),) = ned_at_depth(
                    [angle(said.lat, said.lat_dir)], [angle(said.lon, said.lon_dir)],
                    [depth], earth.origin,
                )  # fmt: skip
                assert [x, y] == pytest.approx(it.place[:2], abs=2e-3)
            if kind == "GPGGA":
                assert said.gps_qual == (1 if isinstance(it, Gnss) else 6)
            if kind == "GPHDT":
                assert isinstance(it, Compass)
                off = math.remainder(float(said.heading) - math.degrees(it.yaw), 360.0)
                assert abs(off) <= 0.0051
    assert kinds == {"GPGGA", "GPRMC", "GPZDA", "GPHDT", "PSIMSSB"}


def test_a_line_of_json_has_what_the_table_has() -> None:
    """To the last bit: numbers are written so that they read back."""
    readings, mission, earth = heard(at_sea())
    fixes = mission.result().tables["fixes"].set_index("fix")
    said = [json.loads(line(it, earth)) for it in readings]
    kinds = {it["kind"] for it in said}
    assert kinds == {"gnss", "compass", "usbl", "fix", "estimate", "ping", "broadcast"}
    for it in said:
        if it["kind"] == "fix":
            row = fixes.loc[it["fix"]]
            for column in ("x_m", "y_m", "z_m", "sd_x_m", "pinged_at_s", "latency_s"):
                assert it[column] == row[column]
            assert it["broadcast_by"] == row["broadcast_by"]
            assert it["utc"].startswith("2026-06-01T08:0")


def test_a_fix_that_nobody_broadcast_says_so() -> None:
    readings, _, earth = heard(at_sea(protocol={"ranging": "passive"}))
    fixes = [json.loads(line(it, earth)) for it in readings if isinstance(it, FixReading)]
    assert fixes
    assert {fix["broadcast_by"] for fix in fixes} == {None}


def test_a_course_just_west_of_north_is_north() -> None:
    """0.03 deg, of sentences that have a tenth: 360.0 is none."""
    assert _over_ground((1.0, -math.radians(0.03))) == ("1.94", "0.0")
    assert _over_ground((1.0, -math.radians(0.07))) == ("1.94", "359.9")


def test_vehicles_are_chosen() -> None:
    readings, _, _ = heard(at_sea(), only=("ASV0", "AUV1"))
    assert {it.vehicle for it in readings} == {"ASV0", "AUV1"}


def test_a_vessel_that_has_failed_says_nothing() -> None:
    failing = {"failures": [{"asv": 0, "at_s": 10.0, "until_s": 30.0}]}
    readings, _, _ = heard(at_sea(asvs=failing))
    own = [it.at_s for it in readings if it.vehicle == "ASV0" and isinstance(it, Gnss)]
    assert own == [*range(10), *range(30, 60)]
