"""Result folders: complete or absent, self-describing, readable again."""

import ast
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from commands_for_tests import call
from results_for_tests import TABLES
from worlds import scenario, still

from bindusbl_des import Result, load_result, simulate

# Without a receiver of GNSS there is no table of its fixes.
WRITTEN = [table for table in TABLES if table != "gnss_fixes"]


@pytest.fixture(scope="module")
def result() -> Result:
    """A short mission with every table."""
    return simulate(scenario(duration_s=40.0), 7)


def test_a_result_folder_reads_back(result: Result, tmp_path: Path) -> None:
    """What is written is what was simulated."""
    folder = result.write(tmp_path / "out")
    back = load_result(folder)
    assert back.scenario == result.scenario
    assert back.seed == 7
    assert set(back.arrow) == set(WRITTEN)
    for name in WRITTEN:
        pd.testing.assert_frame_equal(back.tables[name], result.tables[name])
    files = {path.name for path in folder.iterdir()}
    assert {"run.json", "scenario.yaml", "data_dictionary.json", "report.html"} <= files
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_only_tables_that_are_asked_for_become_frames(result: Result) -> None:
    """All of them are there by name; one is made once, and stays."""
    never: Any = None  # becomes none
    one = Result(result.scenario, 7, {**result.arrow, "pings": never}, 1.0)
    assert one.tables["auvs"] is one.auvs
    assert len(one.auvs) == 3
    with pytest.raises(AttributeError):
        one.tables["pings"]
    assert one.tables.get("assignment") is None
    rows = {name: len(it) for name, it in result.tables.items()}
    assert rows == {name: it.num_rows for name, it in result.arrow.items()}


def test_every_column_says_what_it_is(result: Result, tmp_path: Path) -> None:
    """Unit and meaning of each column, and what made the file, are in the Parquet metadata."""
    folder = result.write(tmp_path / "out")
    for name in WRITTEN:
        file = pq.read_schema(folder / f"{name}.parquet")
        assert file.metadata[b"bindusbl.schema"].decode() == f"{name}/1"
        assert file.metadata[b"bindusbl.seed"] == b"7"
        assert len(file.metadata[b"bindusbl.scenario_sha256"]) == 64
        for field in file:
            assert field.metadata[b"meaning"]
            suffix_units = {"_m": b"m", "_s": b"s", "_hz": b"Hz", "_rad": b"rad", "_m2": b"m2"}
            for suffix, unit in suffix_units.items():
                if field.name.endswith(suffix) and not field.name.endswith("_per_s"):
                    assert field.metadata[b"unit"] == unit, field.name
    dictionary = json.loads((folder / "data_dictionary.json").read_text())
    others = {"signals", "signal_receptions", "auv_frames", "auv_frame_receptions", "packets"}
    others |= {"peer_ranges", "modem_lines"}
    assert set(dictionary) == {*TABLES, *others}
    for name in WRITTEN:
        names = pq.read_schema(folder / f"{name}.parquet").names
        assert list(dictionary[name])[: len(names)] == names
        assert len(names) == len(dictionary[name]) or name == "fixes"  # of relays, repetition
    assert dictionary["pings"]["x_m"]["frame"].startswith("survey")


def test_agreed_columns_are_there(result: Result) -> None:
    """Scripts rely on these names."""
    agreed = {
        "rounds": "round started_at_s colours conflicts uplink_s downlink_s fixes",
        "pings": "ping round slot auv sent_at_s x_m y_m z_m in_range_of heard_by",
        "receptions": "ping auv asv arrived_at_s slant_range_m travel_time_s outcome",
        "broadcasts": "round asv sent_at_s airtime_s payload_bytes fixes",
        "fixes": "fix ping round auv asvs pinged_at_s broadcast_at_s broadcast_by delivered_at_s "
        "latency_s x_m y_m z_m sd_x_m sd_y_m error_m innovation_m correction_m outcome",
        "tracks": "time_s vehicle x_m y_m z_m yaw_rad estimate_x_m estimate_y_m estimate_z_m "
        "imu_x_m imu_y_m position_error_m cross_track_error_m path_error_m",
        "auvs": "auv pings pings_in_range pings_heard hf_coverage fixes fixes_delivered "
        "fix_rate_hz interval_mean_s latency_mean_s latency_p95_s position_error_m "
        "position_error_rms_m cross_track_error_m imu_error_m distance_m collisions",
        "mission": "rounds collisions hf_utilisation mf_utilisation fixes_delivered",
    }
    for table, names in agreed.items():
        assert set(names.split()) <= set(result.arrow[table].column_names)


def test_missing_values_are_null() -> None:
    """AUVs without fixes have no latency, rather than a zero or a NaN."""
    result = simulate(still(2, at=60.0))
    assert result.arrow["auvs"]["latency_mean_s"].null_count == 2
    assert result.arrow["mission"]["latency_mean_s"].null_count == 1
    tracks = result.arrow["tracks"].to_pandas()
    assert tracks[tracks.vehicle == "ASV0"].estimate_x_m.isna().all()


def test_tracks_agree_with_metrics() -> None:
    """The time means are those of the tracks, sampled alike."""
    rates = {"tracks_hz": 30.0, "metrics_hz": 30.0}
    result = simulate(scenario(duration_s=60.0, record=rates), 1)
    tracks = result.tables["tracks"]
    auvs = tracks[tracks.vehicle.str.startswith("AUV")].groupby("vehicle")
    means = auvs.position_error_m.mean().to_numpy()
    assert means == pytest.approx(result.auvs.position_error_m.to_numpy())
    across = auvs.cross_track_error_m.apply(lambda e: e.abs().mean()).to_numpy()
    assert across == pytest.approx(result.auvs.cross_track_error_m.to_numpy())
    assert len(tracks[tracks.vehicle == "AUV0"]) == 1800
    assert tracks.time_s.max() < 60.0
    error = np.hypot(tracks.estimate_x_m - tracks.x_m, tracks.estimate_y_m - tracks.y_m)
    assert np.nanmax(np.abs(error - tracks.position_error_m)) < 1e-12


def test_depth_is_measured_not_integrated() -> None:
    """The depth estimate scatters around the true depth by the sensor's noise."""
    tracks = simulate(scenario(duration_s=200.0, record={"tracks_hz": 10.0})).tables["tracks"]
    error = (tracks.estimate_z_m - tracks.z_m).dropna()
    assert error.std() == pytest.approx(0.05, rel=4 / np.sqrt(2 * len(error)))
    assert abs(error.mean()) < 4 * 0.05 / np.sqrt(len(error))


def test_a_depth_is_what_it_is_however_often_one_looks() -> None:
    """The sensor errs at each sample of its own, whenever and by whom it is read."""
    often, seldom = [
        simulate(scenario(duration_s=60.0, record={"tracks_hz": rate})).tables["tracks"]
        for rate in (15.0, 1.0)
    ]
    merged = seldom.merge(often, on=["vehicle", "time_s"], suffixes=("", "_often"))
    merged = merged[merged.vehicle == "AUV0"]
    assert len(merged) == 60
    assert (merged.estimate_z_m == merged.estimate_z_m_often).all()
    assert merged.estimate_z_m.nunique() == 60


def test_an_existing_folder_is_kept(result: Result, tmp_path: Path) -> None:
    """A folder is never overwritten without force, and never one of other things."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("precious")
    for force in (False, True):
        with pytest.raises(FileExistsError):
            result.write(tmp_path / "mine", force=force)
    assert (tmp_path / "mine" / "thesis.tex").read_text() == "precious"
    result.write(tmp_path / "out")
    with pytest.raises(FileExistsError):
        result.write(tmp_path / "out")
    result.write(tmp_path / "out", force=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "out"]


def test_force_replaces_results_and_what_was_made_of_them(result: Result, tmp_path: Path) -> None:
    """Figures and exports go with the results; any other file keeps the whole folder."""
    folder = result.write(tmp_path / "out")
    for name in ("figures/error.svg", "csv/columns.csv", "csv/fixes.csv", "test.mcap",
                 ".report.html-abc.draft"):  # fmt: skip
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("made of the results")
    assert result.scenario.name == "test"
    result.write(folder, force=True)
    assert not {"figures", "csv", "test.mcap"} & set(os.listdir(folder))
    for name in ("thesis.tex", "figures/mine.svg", "csv/mine.csv", "other.mcap", "notes/a"):
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("precious")
        said = name if name.startswith("figures") else name.partition("/")[0]
        with pytest.raises(FileExistsError, match=f"out: holds {said}, which no run wrote"):
            result.write(folder, force=True)
        assert path.read_text() == "precious"
        path.unlink()
        if path.parent != folder:
            path.parent.rmdir()
    assert set(load_result(folder).arrow) == set(WRITTEN)


def test_force_replaces_all_figures_that_are_drawn(result: Result, tmp_path: Path) -> None:
    folder = result.write(tmp_path / "out")
    assert call("plot", folder).exit_code == 0
    result.write(folder, force=True)
    assert not (folder / "figures").exists()


def test_a_failed_write_leaves_nothing(result: Result, tmp_path: Path) -> None:
    """A disk that fills up half way leaves neither folder nor draft."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (9000, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            result.write(tmp_path / "out")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []


def test_a_killed_export_is_in_nobodys_way(result: Result, tmp_path: Path) -> None:
    """What it left within a run's folder goes when the run is written anew."""
    folder = result.write(tmp_path / "out")
    draft = folder / ".csv-abcd_123.draft"
    draft.mkdir()
    with pytest.raises(FileExistsError, match=r"holds \.csv-abcd_123.draft, which no run wrote"):
        result.write(folder, force=True)
    (draft / "host").write_text(socket.gethostname())
    result.write(folder, force=True)
    assert not draft.exists()


def test_a_killed_run_leaves_no_result(tmp_path: Path) -> None:
    """A run killed at any moment leaves no folder that looks complete."""
    path = Path(__file__).parents[2] / "scenarios" / "recovery_140m.yaml"
    command = [sys.executable, "-m", "bindusbl_des.cli", "run", str(path), "--no-advice", "--out"]
    for delay in (0.8, 1.1, 1.4):  # about when it writes, as machines go
        folder = tmp_path / f"out{delay}"
        process = subprocess.Popen(
            [*command, str(folder)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
        if folder.exists():
            assert set(load_result(folder).arrow) == set(WRITTEN)


@pytest.mark.parametrize("damage", ["missing", "run.json", "fixes.parquet"])
def test_a_damaged_folder_is_refused(result: Result, tmp_path: Path, damage: str) -> None:
    """A folder that is no result, or a damaged one, is refused in plain words."""
    folder = tmp_path / "out"
    if damage != "missing":
        result.write(folder)
        os.truncate(folder / damage, 20)
    with pytest.raises((FileNotFoundError, ValueError), match=r"no result folder|damaged"):
        load_result(folder)


def test_a_summary_keeps_metrics_only(tmp_path: Path) -> None:
    """With detail: summary no event tables are kept, in memory or on disk."""
    short = scenario(duration_s=20.0, record={"detail": "summary"})
    folder = simulate(short).write(tmp_path / "out")
    assert {it.stem for it in folder.glob("*.parquet")} == {"auvs", "mission"}
    assert set(load_result(folder).arrow) == {"auvs", "mission"}


def test_a_run_needs_no_pandas() -> None:
    """From scenario to report and summary nothing loads pandas, which takes a third of a second."""
    code = (
        "import sys; from bindusbl_des import Scenario, simulate\n"
        "result = simulate(Scenario(name='x', duration_s=20.0), 1)\n"
        "result.report(), result.summary()\n"
        "print('pandas' in sys.modules, 'matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"], done.stderr


HEAVY = (
    *("numba", "pyarrow", "pandas", "shapely", "networkx", "matplotlib", "scipy", "gsw"),
    *("simpy", "numpy", "concurrent.futures.process"),
)


@pytest.mark.parametrize(
    ("what", "loads"),
    [
        ("import bindusbl_des", ()),
        ("from bindusbl_des import Scenario, simulate; Scenario(name='x')", ()),
        ("from bindusbl_des import Mission", ("simpy", "numpy")),
        ("main(['validate', 'quickstart', 'recovery_140m'])", ()),
        ("main(['validate', 'table_1'])", ("numpy", "pyarrow")),  # whose metrics are columns
        ("main(['validate', 'remus_1km'])", ("numba", "scipy", "numpy")),  # whose hull is asked
        ("main(['--help'])", ()),
    ],
)
def test_who_does_not_fly_does_not_wait_for_a_simulator(what: str, loads: Sequence[str]) -> None:
    """What a mission needs is loaded by the first one: numba and Arrow take a second."""
    code = (
        "import sys\nfrom bindusbl_des.cli import main\n"
        f"try:\n    {what}\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found = ast.literal_eval(done.stdout.splitlines()[-1])
    assert set(found) <= set(loads), done.stderr


def test_a_folder_that_lacks_a_table_is_damaged(result: Result, tmp_path: Path) -> None:
    """Whoever reads it is told which, instead of going on without."""
    folder = result.write(tmp_path / "run")
    for name in ("auvs", "fixes"):
        (folder / f"{name}.parquet").unlink()
    with pytest.raises(
        ValueError, match=r"auvs\.parquet is missing; .*fixes\.parquet is missing; run"
    ):
        load_result(folder)


def test_whole_numbers_may_be_missing_where_the_table_says_so(result: Result) -> None:
    """Where nobody is told of slots there is no count of who was; what did not collide overlaps
    nothing.
    """
    for table, column in (("rounds", "assigned"), ("receptions", "overlapped_by")):
        values = result.arrow[table][column]
        assert values.type == pa.int64()
        assert values.null_count == len(values)
    for table in result.arrow.values():
        table.validate(full=True)


def test_tables_keep_their_rows_as_other_missions_are_flown() -> None:
    """Buffers go from mission to mission."""
    first = simulate(scenario(duration_s=20.0), 1)
    kept = {name: table.to_pylist() for name, table in first.arrow.items()}
    simulate(scenario(duration_s=20.0), 2)
    assert {name: table.to_pylist() for name, table in first.arrow.items()} == kept
