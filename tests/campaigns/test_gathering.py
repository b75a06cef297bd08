"""Rows of missions gathered into the tables of a part."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bindusbl_des import Scenario, simulate
from bindusbl_des.campaigns.experiments.experiment import PlannedMission, PlannedPoint
from bindusbl_des.campaigns.storage import joining
from bindusbl_des.campaigns.storage.joining import compact
from bindusbl_des.campaigns.storage.part_rows import read_table
from bindusbl_des.campaigns.storage.parts import commit, part_path
from bindusbl_des.campaigns.workers import batches as gathering
from bindusbl_des.campaigns.workers.batches import Gathered, Ran
from bindusbl_des.results import result_folder
from bindusbl_des.results.result_folder import read_parquet

POINTS = {n: PlannedPoint("{}", {"a": float(n), "b": [n, None]}, {}) for n in range(3)}


@pytest.fixture(scope="module")
def ran() -> list[Ran]:
    """Five missions, of which the first and the fourth failed."""
    scenario = Scenario(name="short", duration_s=6.0)
    return [
        Ran(PlannedMission(n, n // 2, n), 0.5, error="ValueError: no")
        if n % 3 == 0
        else Ran(PlannedMission(n, n // 2, n), 0.5, simulate(scenario, n).arrow)
        for n in range(5)
    ]


def gathered(ran: list[Ran]) -> dict[str, pa.Table]:
    found = Gathered({"a": "float", "b": "json"}, POINTS, "model")
    for it in ran:
        found.add(it)
    return found.tables()


@pytest.mark.parametrize("most_apart", [1, 2, 4])
def test_tables_do_not_depend_on_when_rows_are_joined(
    ran: list[Ran], most_apart: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joined as they come or all at the end, rows and their order are the same."""
    whole = gathered(ran)
    assert whole["missions"]["mission"].to_pylist() == [0, 1, 2, 3, 4]
    assert whole["missions"]["status"].to_pylist() == ["failed", "ok", "ok", "failed", "ok"]
    assert whole["missions"]["b"].to_pylist() == [
        "[0, null]",
        "[0, null]",
        *2 * ["[1, null]"],
        "[2, null]",
    ]
    assert whole["auvs"]["mission"].to_pylist() == [1, 1, 1, 2, 2, 2, 4, 4, 4]
    assert whole["pings"]["seed"].unique().to_pylist() == [1, 2, 4]
    monkeypatch.setattr(gathering, "MOST_APART", most_apart)
    again = gathered(ran)
    assert again.keys() == whole.keys()
    for name, table in whole.items():
        assert again[name].equals(table), name


def test_what_rows_take_is_known(ran: list[Ran]) -> None:
    """The memory that rows are said to take is about what Arrow says that they take."""
    found = Gathered({"a": "float", "b": "json"}, POINTS, "model")
    assert found.nbytes == 0
    for it in ran:
        found.add(it)
    assert found.nbytes == pytest.approx(
        sum(table.nbytes for it in ran for table in it.tables.values()), rel=0.5
    )


def test_a_mission_in_two_parts_is_read_once(ran: list[Ran], tmp_path: Path) -> None:
    """As one has it whose worker was thought dead: its rows are those of the first part."""
    commit(tmp_path, "00000001-00000000", gathered(ran[:3]), "a plan")
    commit(tmp_path, "00000002-00000000", gathered(ran[1:]), "a plan")
    whole = gathered(ran)
    for name in ("missions", "auvs"):
        found = read_table(tmp_path, name)
        assert found is not None
        assert found["mission"].to_pylist() == whole[name]["mission"].to_pylist()


def test_parts_are_joined_forward_in_groups_of_one_length(
    ran: list[Ran], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever parts missions lie in, and however few rows are read at a time, the joined tables
    are those of one part; a group of rows does not depend on the parts either.
    """
    monkeypatch.setattr(joining, "ROWS_IN_GROUP", 7)
    monkeypatch.setattr(result_folder, "PIECE", 3)
    for name, numbers in {"00000001-00000000": [3, 0, 2], "00000002-00000000": [1, 4]}.items():
        commit(tmp_path, name, gathered([ran[n] for n in numbers]), "plan")
    compact(tmp_path, leave_out=[2])
    for name, table in gathered([it for it in ran if it.mission.number != 2]).items():
        joined = part_path(tmp_path, name, "all-0001")
        assert read_parquet(joined).equals(table), name
        groups = pq.ParquetFile(joined).metadata
        lengths = [groups.row_group(n).num_rows for n in range(groups.num_row_groups)]
        assert all(length == 7 for length in lengths[:-1]), name
        assert lengths, "pyarrow 18 cannot read a file without a group"
