"""Areas, tracks, casts, curves and airtimes as programs of users save them (`reference/cases`)."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commands_for_tests import call

from bindusbl_des import Setup, load_scenario, simulate
from bindusbl_des.core.scenario.measured import read_curve
from bindusbl_des.core.sea.water_column import read_cast
from bindusbl_des.models.charts.areas import read_area
from bindusbl_des.models.charts.recordings import read_recording
from bindusbl_des.models.presets.modems import airtime_table

CASES = Path(__file__).parents[1] / "reference" / "cases"
SAME = ["xsi_unbound.kml", "gxprefix.kml", "closed_path.kml", "closed_line.geojson"]
SAME += ["linear_ring.kml", "bom.geojson", "utf16.geojson", "emptypoly.geojson"]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str, str], str]:
    """Return how to write a scenario that names a file in the place of a word."""
    shutil.copytree(CASES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)

    def written(shell: str, word: str, name: str) -> str:
        Path("m.yaml").write_text(Path(shell).read_text().replace(word, name))
        return "m.yaml"

    return written


@pytest.mark.parametrize("name", SAME)
def test_an_area_is_read_as_programs_save_it(
    name: str, files: Callable[[str, str, str], str]
) -> None:
    assert read_area(name) == read_area("poly.geojson")
    done = call("validate", files("base.yaml", "AREA", name))
    assert (done.exit_code, done.output) == (0, "m.yaml: ok\n")


KML = """<?xml version="1.0" encoding="{}"?><kml xmlns="http://www.opengis.net/kml/2.2">
<Document><Placemark><name>F\xf6rde</name><gx:balloonVisibility>1</gx:balloonVisibility>
<MultiGeometry><Point><coordinates>10.1,54.3</coordinates></Point><Polygon><outerBoundaryIs>
<LinearRing><coordinates>10.16,54.33 10.163,54.33 10.163,54.3318 10.16,54.3318 10.16,54.33
</coordinates></LinearRing></outerBoundaryIs></Polygon></MultiGeometry></Placemark></Document></kml>
"""


@pytest.mark.parametrize(
    ("said", "saved"),
    [("UTF-8", "utf-8"), ("UTF-8", "utf-8-sig"), ("UTF-8", "cp1252"), ("UTF-16", "utf-16"),
     ("ISO-8859-1", "latin-1"), ("windows-1252", "cp1252")],
)  # fmt: skip
def test_a_kml_with_names_in_any_encoding(said: str, saved: str, tmp_path: Path) -> None:
    (tmp_path / "a.kml").write_bytes(KML.format(said).encode(saved))
    assert read_area(tmp_path / "a.kml") == read_area(CASES / "poly.geojson")


def test_parts_without_coordinates_and_lines_beside_a_polygon_do_not_count(tmp_path: Path) -> None:
    """Also a line that goes around: a polygon is what is meant, where there is one; of two lines
    that go around nobody knows which.
    """
    ring = json.loads((CASES / "poly.geojson").read_text())["features"][0]["geometry"][
        "coordinates"
    ]
    line = {"type": "LineString", "coordinates": ring[0]}
    polygon = {"type": "MultiPolygon", "coordinates": [[], ring]}
    empty = [{"type": kind, "coordinates": []} for kind in ("Point", "LineString", "MultiPoint")]
    for parts in ([polygon, line, *empty], [line, *empty]):
        data = {"type": "GeometryCollection", "geometries": parts}
        (tmp_path / "a.geojson").write_text(json.dumps(data))
        assert read_area(tmp_path / "a.geojson") == read_area(CASES / "poly.geojson")
    data = {"type": "GeometryCollection", "geometries": [line, line]}
    (tmp_path / "a.geojson").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=r"holds 2 polygons .*; name the one to be surveyed"):
        read_area(tmp_path / "a.geojson")


@pytest.mark.parametrize(
    ("name", "west", "wide"), [("lon360.geojson", 237.96, 0.003), ("lonbeyond.kml", 179.999, 0.004)]
)
def test_longitudes_count_to_360(
    name: str, west: float, wide: float, files: Callable[[str, str, str], str]
) -> None:
    """The area is as large as one of as many degrees at 10 deg east."""
    corners = read_area(name)
    assert all(-180.0 <= lon <= 180.0 for _, lon in corners)
    assert [(lon - west) % 360.0 for _, lon in corners] == pytest.approx(
        [0.0, wide, wide, 0.0], abs=1e-9
    )
    here = Setup(load_scenario(files("base.yaml", "AREA", "poly.geojson"))).area.shape.area
    found = Setup(load_scenario(files("base.yaml", "AREA", name))).area.shape.area
    assert found == pytest.approx(here * wide / 0.003, rel=1e-5)


def test_a_ring_that_is_not_closed_is_told_as_ever() -> None:
    with pytest.raises(ValueError, match=r"unclosed.kml:1: Polygon \('bay'\): its ring is not cl"):
        read_area(CASES / "unclosed.kml")


def test_metres_are_still_told_from_degrees(tmp_path: Path) -> None:
    """A strip of 300 m x 8 m, which degrees up to 360 and 90 could be."""
    ring = [[0, 0], [300, 0], [300, 8], [0, 8], [0, 0]]
    (tmp_path / "a.geojson").write_text(f'{{"type": "Polygon", "coordinates": [{ring}]}}')
    with pytest.raises(ValueError, match=r"reaches over 60 deg of longitude.* are these metres"):
        read_area(tmp_path / "a.geojson")


SUMMER = [[0.5, 19.0, 33.0], [6.0, 18.5, 33.1], [12.0, 11.0, 34.2]]


@pytest.mark.parametrize(
    ("name", "samples", "told"),
    [
        ("ctd_semicolon.csv", SUMMER, ""),
        ("ctd_tab.csv", SUMMER, ""),
        ("ctd_comment.csv", SUMMER, ""),
        ("ctd_castaway.csv", [[0.15, *SUMMER[0][1:]], *SUMMER[1:]], ""),
        ("cast.cnv", [[1.0, 18.9, 33.01], [2.0, 18.8, 33.02], [12.0, 11.8, 34.02]], ""),
        (
            "ctd_negfirst.csv",
            [*SUMMER, [30.0, 8.5, 34.8]],
            "environment.ctd: 1 of 5 rows is left out: ",
        ),
    ],
)
def test_a_cast_is_read_as_instruments_save_it(
    name: str, samples: list[list[float]], told: str, files: Callable[[str, str, str], str]
) -> None:
    found = read_cast(name)
    assert found.temperatures_c is not None
    assert found.salinities_psu is not None
    read = np.column_stack((found.depths_m, found.temperatures_c, found.salinities_psu))
    assert read.tolist() == samples
    done = call("validate", files("base_ctd.yaml", "CTD", name))
    assert done.exit_code == 0
    assert told in done.output
    assert done.output.strip().endswith("1 warning" if told else "ok")


def test_what_a_sea_bird_did_not_measure_is_no_sample(tmp_path: Path) -> None:
    """Its flag would pass for 0 degrees; of pressures it is told what makes depths of them."""
    text = (CASES / "cast.cnv").read_text()
    flagged = text.replace("*END*", "# bad_flag = -9.990e-29\n*END*").replace(
        "18.8000", "-9.990e-29"
    )
    (tmp_path / "a.cnv").write_text(flagged)
    found = read_cast(tmp_path / "a.cnv")
    assert found.depths_m.tolist() == [1.0, 12.0]
    assert "a.cnv:8: temperature_c must be a number" in found.left_out[0]
    (tmp_path / "b.cnv").write_text(text.replace("depSM: Depth [salt water, m]", "prDM: Pressure"))
    with pytest.raises(
        ValueError, match=r"has the columns prDM, tv290C, sal00; .* depths from pres"
    ):
        read_cast(tmp_path / "b.cnv")


def test_samples_on_deck_may_be_the_most(tmp_path: Path) -> None:
    """The instrument was logging before it went in; a column of heights is refused."""
    head = "depth_m,sound_speed_m_per_s\n"
    deck = "".join(f"-0.{n},1500\n" for n in range(1, 8))
    (tmp_path / "c.csv").write_text(f"{head}{deck}0.5,1500\n3,1490\n")
    found = read_cast(tmp_path / "c.csv")
    assert found.depths_m.tolist() == [0.5, 3.0]
    assert found.left_out[0].startswith("7 of 9 rows are left out: ")
    (tmp_path / "c.csv").write_text(f"{head}-0.5,1500\n-3,1490\n-9,1480\n")
    with pytest.raises(ValueError, match=r"c.csv:3: depth_m must be a number from 0 to"):
        read_cast(tmp_path / "c.csv")


def test_a_cast_that_heaves_keeps_what_goes_deeper(tmp_path: Path) -> None:
    """One that is as long on its way up is refused with the remedy."""
    head = "depth_m,sound_speed_m_per_s\n"
    down = [1, 2, 3, 2.6, 3.5, 5, 5, 8]
    (tmp_path / "c.csv").write_text(head + "".join(f"{it},1500\n" for it in down))
    found = read_cast(tmp_path / "c.csv")
    assert found.depths_m.tolist() == [1.0, 2.0, 3.0, 3.5, 5.0, 8.0]
    assert "1 of 8 rows have the depth_m of the row before" in found.left_out[0]
    assert "depth_m must increase, but 2.6 m follows 3 m; keep the way down" in found.left_out[1]
    (tmp_path / "c.csv").write_text(head + "".join(f"{it},1500\n" for it in [1, 5, 9, 6, 2, 0]))
    with pytest.raises(
        ValueError, match=r"c.csv:5: depth_m must increase, but 6 m follows 9 m; ke"
    ):
        read_cast(tmp_path / "c.csv")


def test_curves_and_airtimes_have_semicolons_and_rows_that_cannot_be(tmp_path: Path) -> None:
    assert read_curve(CASES / "curve_semi.csv")[:2] == ((10.0, 100.0), (0.9, 0.5))
    assert airtime_table(CASES / "air_semi.csv").airtimes_s == (0.17, 0.18)
    (tmp_path / "c.csv").write_text("range_m,delivery_ratio\nm,1\n10,0.9\n100,0.5\n")
    (tmp_path / "a.csv").write_text("payload_bytes;airtime_s\n8;0,5\n16;soon\n24;0,9\n")
    lines = "mf: {channel: {model: curve, file: c.csv}, airtimes: a.csv}"
    (tmp_path / "m.yaml").write_text(f"name: m\nacoustics:\n  {lines}\n")
    done = call("validate", tmp_path / "m.yaml")
    assert "acoustics.mf.channel.file: 1 of 3 rows is left out: " in done.output
    assert "c.csv:2: range_m is 'm'; give a number" in done.output
    assert "acoustics.mf.airtimes: 1 of 3 rows is left out: " in done.output
    assert "a.csv:3: a line of a table of airtimes that has the airtime_s 'soon'" in done.output
    assert airtime_table(tmp_path / "a.csv").airtime(16) == pytest.approx(0.7)


def test_a_track_with_semicolons_is_that_with_commas(tmp_path: Path) -> None:
    found = read_recording(CASES / "tsemi.csv")
    assert found.times.tolist() == [0.0, 40.0, 70.0]
    assert found.places.tolist() == [[54.33, 10.16], [54.33036, 10.16], [54.3306, 10.16]]


@pytest.mark.parametrize(
    ("change", "left"),
    [
        (lambda text: text.replace("\n", "\ns,deg,deg,m\n", 1), 1),
        (lambda text: text + text.splitlines()[0] + "\n", 0),
        (lambda text: text + "0,54.33,10.16,8\n", 1),
        (lambda text: text.replace("\n40", "\n1e9,54.33,10.16,8\n40"), 1),
        (lambda text: text.replace("\n40", "\n1,,,\n2,,,\n3,nan,nan,8\n4,,,8\n40"), 4),
        (lambda text: text.replace(",8\n", ",8,\n"), 0),
        (lambda text: "# " + text.replace(",", " "), 0),
    ],
)
def test_a_track_with_rows_that_tell_nothing_is_the_track(
    change: Callable[[str], str], left: int, tmp_path: Path
) -> None:
    """Units, a header again, the begin of another track, a leap of the clock, no fix."""
    text = (
        "time_s,lat_deg,lon_deg,depth_m\n0,54.33,10.16,8\n40,54.33036,10.16,8\n70,54.3306,10.16,8\n"
    )
    (tmp_path / "t.csv").write_text(change(text))
    found = read_recording(tmp_path / "t.csv")
    assert found.times.tolist() == [0.0, 40.0, 70.0]
    assert found.places[:, 0].tolist() == [54.33, 54.33036, 54.3306]
    assert [told.partition(" ")[0] for told in found.left_out] == [str(left)] * (left > 0)


def test_times_of_a_csv_may_have_zones(tmp_path: Path) -> None:
    rows = "2026-06-01T10:00:00+02:00,1,2,8\n2026-06-01 08:00:40.5,2,2,8\n2026-06-01T08:01Z,3,2,8\n"
    (tmp_path / "t.csv").write_text(f"time_s,x_m,y_m,depth_m\n{rows}")
    found = read_recording(tmp_path / "t.csv")
    assert found.times.tolist() == [1780300800.0, 1780300840.5, 1780300860.0]


def test_times_in_milliseconds_are_told(files: Callable[[str, str, str], str]) -> None:
    done = call("validate", files("t_base.yaml", "FILE", "tms.csv"))
    assert done.exit_code == 2
    assert (
        "tms.csv:2: time_s is 1780300800000, later than any mission; times look like" in done.output
    )
    assert "milliseconds: divide them by 1,000" in done.output


def test_of_samples_of_one_second_the_first_counts(files: Callable[[str, str, str], str]) -> None:
    found = read_recording("duptime.gpx")
    assert found.places[:, 0].tolist() == [54.33, 54.33036]
    start = "duptime.gpx], time_offset_s: 1780300800"
    done = call("validate", files("t_base.yaml", "FILE]", start))
    assert done.exit_code == 0
    assert (
        "auvs.route.files.0: 1 of 3 rows have the time_s of the row before, first " in done.output
    )


def test_a_receiver_without_a_fix_was_not_in_the_gulf_of_guinea(tmp_path: Path) -> None:
    """What it says then, 0 and 0, is left out; a track that is there is not."""
    rows = "0,0,0,5\n1,0,0,5\n2,54.33,10.16,5\n3,54.33001,10.16,5\n4,54.33002,10.16,5\n"
    (tmp_path / "t.csv").write_text(f"time_s,lat_deg,lon_deg,depth_m\n{rows}")
    found = read_recording(tmp_path / "t.csv")
    assert found.times.tolist() == [2.0, 3.0, 4.0]
    assert found.left_out[0].startswith("2 of 5 rows are left out: ")
    (tmp_path / "t.csv").write_text(
        f"time_s,lat_deg,lon_deg,depth_m\n{rows.replace('54.33', '0.0').replace('10.16', '0')}"
    )
    assert len(read_recording(tmp_path / "t.csv").times) == 5


def in_csv(text: str) -> str:
    """Return the samples of a GPX as CSV."""
    found = re.findall(r'lat="([\d.]+)" lon="([\d.]+)"><time>\S+T(\d\d):(\d\d):(\d\d)Z', text)
    rows = [
        f"{1780300800 + 3600 * (int(h) - 8) + 60 * int(m) + int(s)},{lat},{lon},8"
        for lat, lon, h, m, s in found
    ]
    return "\n".join(["time_s,lat_deg,lon_deg,depth_m", *rows]) + "\n"


def in_mcap(text: str, path: Path) -> None:
    """Write samples in CSV as positions in an MCAP file."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
        channel = writer.register_channel("/auv", "json", schema)
        for row in text.splitlines()[1:]:
            time, lat, lon, _ = map(float, row.split(","))
            said = {"latitude": lat, "longitude": lon, "altitude": -8.0}
            at = round(time * 1e9)
            writer.add_message(channel, at, json.dumps(said).encode(), at)
        writer.finish()


@pytest.mark.parametrize("name", ["twoseg_gap.gpx", "gap.csv", "gap.mcap"])
def test_a_gap_of_a_track_is_no_way(name: str, files: Callable[[str, str, str], str]) -> None:
    """Between its dives nobody knows where the AUV was: refused with the instants and the remedies,
    each of which can be typed.
    """
    Path("gap.csv").write_text(in_csv(Path("twoseg_gap.gpx").read_text()))
    assert Path("gap.csv").read_text().count("\n") == 5
    in_mcap(Path("gap.csv").read_text(), Path("gap.mcap"))
    path = files("t_twoseg.yaml", "twoseg_gap.gpx", name)
    done = call("validate", path)
    assert done.exit_code == 2
    assert (
        "it has a gap from 40 to 3600 s of the mission, in which nobody knows its way (130 m); "
        in (done.output)
    )
    assert "(duration_s: 40), begin it after it (auvs.route.time_offset_s: 1780304400), or add" in (
        done.output
    )
    assert call("validate", path, "--set", "duration_s=40").exit_code == 0
    after = ("--set", "auvs.route.time_offset_s=1780304400", "--set", "duration_s=30")
    assert call("validate", path, *after).exit_code == 0
    late = call("validate", path, "--set", "auvs.route.time_offset_s=1780300900")
    assert "from -60 to 3500 s of the mission" in late.output
    assert "begin it after it (auvs.route.time_offset_s: 1780304400)" in late.output
    assert "duration_s: -" not in late.output


def test_long_steps_that_a_vehicle_goes_or_rests_are_no_gaps(tmp_path: Path) -> None:
    """A leg at the usual speed with no sample on it, and an hour on one place."""
    head = "time_s,x_m,y_m,depth_m\n"
    turn = [(t, t, 0.0) for t in range(20)]
    leg = [(19 + 300 + t, 319 + t, 0.0) for t in range(20)]
    rest = [(t + 3600, x + 19, 0.0) for t, x, _ in leg]
    rows = "".join(f"{t},{x},{y},5\n" for t, x, y in (*turn, *leg, *rest))
    (tmp_path / "t.csv").write_text(head + rows)
    lines = "survey: {side_m: 900}\nauvs: {count: 1, route: {kind: track, files: [t.csv]}}\n"
    (tmp_path / "m.yaml").write_text(f"name: m\nduration_s: 3900\n{lines}")
    assert call("validate", tmp_path / "m.yaml").exit_code == 0


def test_vessels_have_no_gaps_either(tmp_path: Path) -> None:
    rows = [(0, 0), (10, 10), (20, 20), (1020, 70), (1030, 80)]
    text = "".join(f"{t},{x},0,0\n" for t, x in rows)
    (tmp_path / "v.csv").write_text(f"time_s,x_m,y_m,depth_m\n{text}")
    lines = "asvs: {count: 1, formation: {model: track, files: [v.csv]}}\n"
    (tmp_path / "m.yaml").write_text(f"name: m\nduration_s: 900\n{lines}")
    done = call("validate", tmp_path / "m.yaml")
    assert "asvs.formation.files.0: it has a gap from 20 to 1020 s" in done.output
    assert "asvs.formation.time_offset_s: 1020" in done.output


def test_a_mission_flies_in_the_water_of_a_cnv(files: Callable[[str, str, str], str]) -> None:
    result = simulate(load_scenario(files("base_ctd.yaml", "CTD", "cast.cnv")), seed=0)
    assert len(result.tables["pings"]) > 0
