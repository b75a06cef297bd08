"""Rows of missions gathered into the tables of a part."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest
from campaigns_for_tests import Singly, cut_short, fly_with, parts, same

from bindusbl_des import Campaign, load_campaign, resume, sweep
from bindusbl_des.apps.campaigns.storage import part_rows
from bindusbl_des.apps.campaigns.workers import batches
from bindusbl_des.core.results import result_folder

FAILING = """
def schedule(view):
    if view.random.bit_generator.seed_seq.entropy in (0, 3):
        raise ValueError("no")
    return [[auv] for auv in range(len(view.auvs))]
"""


@pytest.fixture
def flown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_this_process: None
) -> Callable[[str], Campaign]:
    """Return what flies ten missions into a folder, of which four fail, and keeps all tables."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
    monkeypatch.syspath_prepend(str(tmp_path))
    Path("failing_for_a_test.py").write_text(FAILING)
    schedule = "protocol: {schedule: 'failing_for_a_test:schedule'}\n"
    Path("base.yaml").write_text(f"name: short\nduration_s: 4\n{schedule}")
    return lambda folder: sweep("base.yaml", folder, **ASKED)


ASKED = {"vary": {"asvs.count": [2, 3]}, "seeds": 5, "detail": "full"}
TABLES = ("pings", "fixes", "tracks", "frame_receptions")


def equal(one: Campaign, other: Campaign) -> None:
    same(one, other)
    for name in TABLES:
        pd.testing.assert_frame_equal(one.table(name), other.table(name))


@pytest.mark.parametrize("most_apart", [1, 2, 4])
def test_tables_do_not_depend_on_when_rows_are_joined(
    flown: Callable[[str], Campaign], most_apart: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joined as they come or all at the end, rows and their order are the same."""
    whole = flown("whole")
    assert whole.missions["mission"].tolist() == list(range(10))
    assert whole.missions["status"].tolist() == ["failed", "ok", "ok", "failed", "ok"] * 2
    assert whole.missions["asvs.count"].tolist() == [2] * 5 + [3] * 5
    assert whole.auvs["mission"].tolist() == [n for n in (1, 2, 4, 6, 7, 9) for _ in range(3)]
    assert whole.table("pings")["seed"].unique().tolist() == [1, 2, 4]
    monkeypatch.setattr(batches, "MOST_APART", most_apart)
    equal(flown("again"), whole)


def test_a_mission_in_two_parts_is_read_once(flown: Callable[[str], Campaign]) -> None:
    """As one has it whose worker was thought dead: its rows are those of the first part."""
    whole = flown("whole")
    for folder in ("one", "two"):  # one part of all missions, and one of some of them
        cut_short("base.yaml", folder, **ASKED)
    for path in Path("one").glob(f"*/part-{parts('one')[0]}.*"):
        twin = Path("two", path.parent.name, path.name)
        twin.write_bytes(path.read_bytes())
    assert len(parts("two")) == 2
    found = load_campaign("two")
    numbers = found.missions["mission"].tolist()
    assert numbers == sorted({*numbers})
    for table in (found.missions, found.auvs):
        assert not table.drop(columns="wall_time_s", errors="ignore").duplicated().any()
    equal(resume("two"), whole)


def test_parts_are_joined_forward_in_groups_of_one_length(
    flown: Callable[[str], Campaign], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever parts missions lie in, and however few rows are read at a time, the joined tables
    are those of one part; a group of rows does not depend on the parts either.
    """
    whole = flown("whole")
    monkeypatch.setattr(part_rows, "ROWS_IN_GROUP", 7)
    monkeypatch.setattr(result_folder, "PIECE", 3)
    fly_with(monkeypatch, Singly)
    folder = cut_short("base.yaml", "apart", after=10, **ASKED)
    assert len(parts(folder)) == 10
    equal(resume(folder), whole)
    for joined in folder.glob("*/part-all-0001.parquet"):
        groups = pq.ParquetFile(joined).metadata
        lengths = [groups.row_group(n).num_rows for n in range(groups.num_row_groups)]
        assert all(length == 7 for length in lengths[:-1]), joined
        assert lengths, "pyarrow 18 cannot read a file without a group"
