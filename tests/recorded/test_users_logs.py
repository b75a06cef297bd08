"""Logs as users have them (`reference/cases`): polled, in degrees, with rows that cannot be."""

import csv
import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call

from bindusbl_des import fit, read_log

CASES = Path(__file__).parents[1] / "reference" / "cases"


def with_rows(tmp_path: Path, case: str, **tables: str) -> str:
    """Return a copy of a log, some of its tables others."""
    folder = tmp_path / case
    shutil.copytree(CASES / case, folder, dirs_exist_ok=True)
    for name, text in tables.items():
        (folder / f"{name}.csv").write_text(text)
    return str(folder)


def once(text: str) -> str:
    """Return a table of fixes in which none that equals the last one is listed."""
    head, *rows = text.splitlines()
    kept = [
        row
        for before, row in zip(["", *rows], rows, strict=False)
        if before.partition(",")[2] != row.partition(",")[2]
    ]
    return "\n".join([head, *kept]) + "\n"


def test_a_log_that_was_polled_has_each_fix_once(tmp_path: Path) -> None:
    """Of 1,184 rows of 148 fixes the noise is that of the fixes: a walk of 0.040, not 0.587."""
    with pytest.warns(UserWarning, match="1036 of 1184 fixes repeat one before to the last digit"):
        log = read_log(str(CASES / "stale_polled"))
    text = once((CASES / "stale_polled" / "fixes.csv").read_text())
    plain = read_log(with_rows(tmp_path, "stale_polled", fixes=text))
    assert not plain.left_out
    assert log.fixes.times.tolist() == plain.fixes.times.tolist()
    assert np.array_equal(log.fixes.places, plain.fixes.places)
    assert fit(log).noise == fit(plain).noise
    assert fit(log).noise.random_walk < 0.05


@pytest.mark.parametrize("unit", ["metres", "degrees"])
def test_polled_fixes_of_two_vessels_are_told_apart(unit: str, tmp_path: Path) -> None:
    """They take turns in the log, in metres or degrees; one that truly lies still is no repetition,
    and digits so coarse that equal ones come by chance tell of none.
    """
    rng, rows, odometry = np.random.default_rng(3), [], []
    for second in range(200):
        odometry.append((second, 54.0 + second * 1e-5, 10.0, 0.0))
    for second in range(5, 195, 5):
        for vessel in range(2):
            lat = 54.0 + second * 1e-5 + rng.normal() * 5e-6
            lon = 10.0 + rng.normal() * 1e-5
            rows += [(second + late, lat, lon, 0.5, 0.5, vessel) for late in range(5)]
    rows.sort(key=lambda row: row[0])
    names = ("lat_deg", "lon_deg")
    if unit == "metres":
        names = ("x_m", "y_m")
        rows = [(t, 111e3 * (a - 54.0), 65e3 * (b - 10.0), *rest) for t, a, b, *rest in rows]
        odometry = [(t, 111e3 * (a - 54.0), 65e3 * (b - 10.0), yaw) for t, a, b, yaw in odometry]

    def written(kept: list[tuple[float, ...]], digits: int) -> str:
        lines = [
            f"{t},{a:.{digits}f},{b:.{digits}f},{','.join(map(str, rest))}"
            for t, a, b, *rest in kept
        ]
        return "\n".join([f"time_s,{names[0]},{names[1]},sd_x_m,sd_y_m,asv", *lines]) + "\n"

    def log_of(fixes: str, folder: str) -> str:
        (tmp_path / folder).mkdir()
        lines = "".join(",".join(map(repr, row)) + "\n" for row in odometry)
        (tmp_path / folder / "odometry.csv").write_text(
            f"time_s,{names[0]},{names[1]},yaw_rad\n{lines}"
        )
        (tmp_path / folder / "fixes.csv").write_text(fixes)
        return str(tmp_path / folder)

    with pytest.warns(UserWarning, match="304 of 380 fixes repeat one before to the last digit"):
        found = read_log(log_of(written(rows, 9), "polled"))
    assert len(found.fixes.times) == 76
    first = [row for row in rows if row[0] % 5 == 0]
    assert not read_log(log_of(written(first, 9), "once")).left_out
    coarse = 5 if unit == "degrees" else 0
    assert not read_log(log_of(written(first, coarse), "coarse")).left_out


def test_ranges_and_receptions_that_repeat_count_once(tmp_path: Path) -> None:
    """Per beacon and vessel; while the vehicle lies still an equal range is another one."""
    odometry = "time_s,x_m,y_m,yaw_rad\n" + "".join(
        f"{t},{min(t, 50) * 0.8:.3f},0,0\n" for t in range(101)
    )
    ranges, receptions = ["time_s,beacon,range_m"], ["time_s,asv,valid,range_m"]
    rng = np.random.default_rng(1)
    for begin in range(0, 100, 10):
        for beacon, x in (("a", 0.0), ("b", 90.0)):
            metres = abs(x - min(begin, 50) * 0.8) + abs(rng.normal()) if begin < 60 else 40.0
            for late in range(0, 10, 2):
                ranges.append(f"{begin + late},{beacon},{metres:.6f}")
                receptions.append(f"{begin + late},{beacon},{int(begin != 30)},{metres:.6f}")
    path = tmp_path / "log"
    path.mkdir()
    (path / "beacons.csv").write_text("beacon,x_m,y_m\na,0,0\nb,90,0\n")
    (path / "odometry.csv").write_text(odometry)
    (path / "ranges.csv").write_text("\n".join(ranges) + "\n")
    (path / "receptions.csv").write_text("\n".join(receptions) + "\n")
    with pytest.warns(UserWarning, match="repeat one before") as told:
        log = read_log(str(path))
    texts = [str(it.message) for it in told]
    assert [text.partition(" of ")[2].split()[1] for text in texts] == ["ranges", "receptions"]
    moving = log.ranges.times < 50.0
    assert moving.sum() == 10
    assert (~moving).sum() > 30  # at rest
    assert log.receptions is not None
    assert len(log.receptions.times) == len(log.ranges.times)


def test_what_moves_by_less_than_a_digit_repeats_nothing(tmp_path: Path) -> None:
    """Ranges in whole metres at 1 Hz of a vehicle at 0.2 m/s: five in a row are alike."""
    odometry = "".join(f"{t},{0.2 * t:.1f},0,0\n" for t in range(100))
    (tmp_path / "odometry.csv").write_text(f"time_s,x_m,y_m,yaw_rad\n{odometry}")
    (tmp_path / "beacons.csv").write_text("beacon,x_m,y_m\na,-9,0\n")
    ranges = "".join(f"{t},a,{9 + 0.2 * t:.0f}\n" for t in range(100))
    (tmp_path / "ranges.csv").write_text(f"time_s,beacon,range_m\n{ranges}")
    assert len(read_log(str(tmp_path)).ranges.times) == 100


def test_a_fix_that_is_listed_twice_counts_once(tmp_path: Path) -> None:
    """Under one instant it is the same, whatever the vehicle did."""
    (tmp_path / "odometry.csv").write_text("time_s,x_m,y_m,yaw_rad\n0,0,0,0\n9,0,0,0\n")
    (tmp_path / "fixes.csv").write_text("time_s,x_m,y_m,sd_x_m,sd_y_m\n" + 2 * "3,0,0,1,1\n")
    with pytest.warns(UserWarning, match=r"1 of 2 fixes repeat .* first .*fixes.csv:3"):
        assert len(read_log(str(tmp_path)).fixes.times) == 1


def in_radians(factor: float, begin: float = 0.0) -> str:
    """Return the odometry of the log in degrees, its headings times a factor, from some on."""
    with (CASES / "yaw_degrees" / "odometry.csv").open() as file:
        head, *rows = list(csv.reader(file))
    lines = [[*row[:3], repr(begin + factor * float(row[3])), *row[4:]] for row in rows]
    return "\n".join(",".join(row) for row in [head, *lines]) + "\n"


def test_headings_in_degrees_are_refused(tmp_path: Path) -> None:
    """As radians the log tells of the bias put in, 0.05 m/s ahead and -0.03 aside; also where they
    went around twice before.
    """
    with pytest.raises(
        ValueError, match=r"odometry.csv:2: yaw_rad is 17.1887, beyond 2 pi; are these d"
    ):
        read_log(str(CASES / "yaw_degrees"))
    for begin in (0.0, 4.0 * math.pi):
        text = in_radians(math.pi / 180.0, begin)
        found = fit(read_log(with_rows(tmp_path, "yaw_degrees", odometry=text)))
        assert found.noise.bias == pytest.approx((0.05, -0.03), abs=0.005)
    constant = "time_s,x_m,y_m,yaw_rad\n" + "".join(f"{t},0,{t},90\n" for t in range(9))
    fixes = "time_s,x_m,y_m,sd_x_m,sd_y_m\n5,0,5,1,1\n"
    with pytest.raises(ValueError, match=r"yaw_rad is 90, beyond 2 pi"):
        read_log(with_rows(tmp_path, "yaw_degrees", odometry=constant, fixes=fixes))


@pytest.mark.parametrize(
    ("case", "told", "sights"),
    [
        (
            "late_first_fix",
            r"1 of 20 rows is left out: .*fixes.csv:2: valid_at_s is -3, outside",
            19,
        ),
        ("negative_range", r"1 of 120 rows is left out: .*ranges.csv:63: range_m is -0.07", 119),
        ("dup_odometry_time", r"1 of 101 rows have the time_s of the row before, first .*:53: ", 2),
    ],
)
def test_one_row_does_not_cost_a_log(case: str, told: str, sights: int) -> None:
    with pytest.warns(UserWarning, match=told):
        log = read_log(str(CASES / case))
    assert len(log.fixes.times) + len(log.ranges.times) == sights
    done = call("fit", CASES / case)
    assert done.exit_code == 0
    assert log.left_out[0] in done.stderr
    assert "random_walk_m_per_sqrt_s" in done.stdout


def test_semicolons_and_decimal_commas_are_read() -> None:
    """It is the log of late_first_fix without the late one."""
    found = read_log(str(CASES / "semicolon_log"))
    with pytest.warns(UserWarning, match="outside the time"):
        other = read_log(str(CASES / "late_first_fix"))
    assert np.array_equal(found.times, other.times)
    assert np.array_equal(found.places, other.places)
    assert len(found.fixes.times) == len(other.fixes.times)


def test_rows_of_all_tables_are_left_out_and_counted(tmp_path: Path) -> None:
    """Of the same log with a row of nothing in each table the same is read."""
    (tmp_path / "plain").mkdir()
    tables = {
        "odometry": ["time_s,x_m,y_m,yaw_rad", *(f"{t},{t},0,0" for t in range(9))],
        "beacons": ["beacon,x_m,y_m", "a,0,9", "b,9,9"],
        "ranges": ["time_s,beacon,range_m", *(f"{t},{'ab'[t % 2]},{9 + t}" for t in range(8))],
        "receptions": ["time_s,asv,valid,range_m", *(f"{t},0,1,{9 + t}" for t in range(8))],
        "fixes": ["time_s,x_m,y_m,sd_x_m,sd_y_m", *(f"{t},{t}.5,0,1,1" for t in range(1, 8))],
    }
    for name, lines in tables.items():
        (tmp_path / "plain" / f"{name}.csv").write_text("\n".join(lines) + "\n")
    plain = read_log(str(tmp_path / "plain"))
    wrong = {
        "odometry": ["5.5,nan,0,0", "2,4,0,0", "s,m,m,rad"],
        "beacons": [",1,1"],
        "ranges": ["3,c,9", "3,a,", "99,a,9"],
        "receptions": ["3,0,maybe,4", "3,0,1,far"],
        "fixes": ["3,,,1,1", "3,1,1,0,1", "-5,1,1,1,1"],
    }
    for name, lines in tables.items():
        text = "\n".join([lines[0], *lines[1:6], *wrong[name], *lines[6:]])
        (tmp_path / "plain" / f"{name}.csv").write_text(text + "\n")
    with pytest.warns(UserWarning, match="left out") as told:
        found = read_log(str(tmp_path / "plain"))
    assert np.array_equal(found.places, plain.places)
    assert found.beacons.names == plain.beacons.names
    assert np.array_equal(found.ranges.metres, plain.ranges.metres)
    assert np.array_equal(found.fixes.places, plain.fixes.places)
    assert found.receptions is not None
    assert plain.receptions is not None
    assert np.array_equal(found.receptions.times, plain.receptions.times)
    texts = "\n".join(str(it.message) for it in told)
    for name in tables:
        assert f"{name}.csv" in texts
    assert "3 of 11 rows are left out: " in texts  # of ranges


def test_messages_of_a_log_that_are_none_do_not_cost_it(tmp_path: Path) -> None:
    """What is no JSON, and what is no row, on a topic of its own or among rows."""
    pytest.importorskip("mcap")
    from mcap.writer import Writer

    path = tmp_path / "log.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(name="row", encoding="jsonschema", data=b"{}")
        topics = {
            name: writer.register_channel(topic=name, message_encoding="json", schema_id=schema)
            for name in ("/odometry", "/fixes", "/diagnostics")
        }
        for n in range(9):
            pose = {"time_s": n, "x_m": 2.0 * n, "y_m": 0.0, "yaw_rad": 0.0}
            writer.add_message(topics["/odometry"], n, json.dumps(pose).encode(), n)
            fix = {"time_s": n, "x_m": 2.1 * n, "y_m": 0.0, "sd_x_m": 0.5, "sd_y_m": 0.5}
            content = b"{" if n == 3 else b"[1]" if n == 5 else json.dumps(fix).encode()
            writer.add_message(topics["/fixes"], n, content, n)
            writer.add_message(topics["/diagnostics"], n, b"[true]", n)
        writer.finish()
    with pytest.warns(UserWarning, match=r"2 of 9 rows are left out: .*message 4 on /fixes: needs"):
        assert len(read_log(str(path)).fixes.times) == 7


def test_a_range_of_a_factor_graph_that_cannot_be_is_left_out(tmp_path: Path) -> None:
    from logs_for_tests import write_pyfg

    path = write_pyfg(tmp_path / "run.pyfg", ("48 0.5", "-48 0.5"))
    path.write_text("# by hand\n" + path.read_text())
    with pytest.warns(
        UserWarning, match=r"1 of 3 rows is left out: .*pyfg:8: needs a range from 0"
    ):
        assert len(read_log(str(path)).ranges.times) == 2


TIMES = [(t, f"{t + 0.3 * (t % 3):.1f}", f"0.{t}") for t in range(1, 19, 2)]
PLAIN = {
    "odometry": "time_s,x_m,y_m,yaw_rad\n" + "".join(f"{t},{t},0,0\n" for t in range(20)),
    "fixes": "time_s,x_m,y_m,sd_x_m,sd_y_m\n" + "".join(f"{t},{x},{y},1,1\n" for t, x, y in TIMES),
}


def clocked(text: str, zone: str) -> str:
    """Return a table whose seconds are times of a day."""
    head, *rows = text.splitlines()
    lines = [
        f"2026-06-01T{zone[:2]}:00:{int(row.partition(',')[0]):02d}{zone[2:]},{row.partition(',')[2]}"
        for row in rows
    ]
    return "\n".join([head, *lines]) + "\n"


@pytest.mark.parametrize(
    "change",
    [
        lambda tables: {name: clocked(text, "08Z") for name, text in tables.items()},
        lambda tables: {
            "odometry": clocked(tables["odometry"], "08Z"),
            "fixes": clocked(tables["fixes"], "10+02:00"),
        },
        lambda tables: {name: text.replace(",", "\t") for name, text in tables.items()},
        lambda tables: {
            name: text.replace("\n", f"\n{text.splitlines()[0]}\n", 1)
            for name, text in tables.items()
        },
    ],
)
def test_the_same_log_however_it_is_written(change: Any, tmp_path: Path) -> None:
    """Times with zones, tabs, a header that is there twice."""
    for name, tables in (("plain", PLAIN), ("other", change(PLAIN))):
        (tmp_path / name).mkdir()
        for table, text in tables.items():
            (tmp_path / name / f"{table}.csv").write_text(text)
    plain, other = (read_log(str(tmp_path / name)) for name in ("plain", "other"))
    assert np.array_equal(plain.times, other.times)
    assert np.array_equal(plain.fixes.times, other.fixes.times)
    assert np.array_equal(plain.fixes.places, other.fixes.places)


def test_rows_without_a_measurement_may_be_the_most(tmp_path: Path) -> None:
    """A log at 4 Hz of fixes at 1 Hz: empty, or nan; a log without any fix is refused."""
    head, *rows = PLAIN["fixes"].splitlines()
    late = [
        row + "".join(f"\n{row.partition(',')[0]}.{n},,nan,," for n in (2, 4, 6)) for row in rows
    ]
    (tmp_path / "odometry.csv").write_text(PLAIN["odometry"])
    (tmp_path / "fixes.csv").write_text("\n".join([head, *late]) + "\n")
    with pytest.warns(
        UserWarning, match="27 of 36 rows are left out: .*fixes.csv:3: needs numbers"
    ):
        assert len(read_log(str(tmp_path)).fixes.times) == 9
    (tmp_path / "fixes.csv").write_text(f"{head}\n1,,,,\n2,,,,\n")
    with pytest.raises(
        ValueError, match=r"fixes.csv:2: needs numbers in .*; it lacks x_m, y_m, sd_x_m"
    ):
        read_log(str(tmp_path))


def test_odometry_begins_where_its_receiver_has_a_fix(tmp_path: Path) -> None:
    """Not at 0, 0; and goes on beyond 180 degrees east."""
    rows = "".join(f"{t},{54 + t * 1e-5:.6f},{179.9999 + t * 1e-5:.6f},0\n" for t in range(1, 20))
    (tmp_path / "odometry.csv").write_text(f"time_s,lat_deg,lon_deg,yaw_rad\n0,0,0,0\n{rows}")
    fixes = "".join(
        f"{t},{54 + t * 1e-5:.6f},{-180.0001 + t * 1e-5:.7f},1,1\n" for t in range(2, 19, 3)
    )
    (tmp_path / "fixes.csv").write_text(f"time_s,lat_deg,lon_deg,sd_x_m,sd_y_m\n{fixes}")
    with pytest.warns(UserWarning, match="1 of 20 rows is left out: .*odometry.csv:2: is at 0, 0"):
        log = read_log(str(tmp_path))
    assert log.places[0] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert log.fixes.places == pytest.approx(log.at(log.places, log.fixes.times), abs=0.02)
