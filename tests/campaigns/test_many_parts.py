"""What commands do for each part of a large campaign: files opened and looked at, never time."""

import gc
import json
import os
import random
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from campaigns_for_tests import (
    Singly,
    auv,
    cut_short,
    fly_with,
    hand_made,
    parts,
    read_record,
    same,
    sealed,
    write_record,
)
from hypothesis import given
from hypothesis import strategies as st
from test_campaign_folders import flipped

from bindusbl_des import load_campaign, resume
from bindusbl_des.apps.campaigns.statistics import outcomes
from bindusbl_des.apps.campaigns.storage import part_rows
from bindusbl_des.apps.campaigns.storage import parts as runs

FAILS = 2  # the seed whose mission fails

_opened: Counter[str] | None = None


def _note(event: str, given: tuple[Any, ...]) -> None:
    if _opened is not None and event == "open":
        _opened[Path(str(given[0])).suffix] += 1


sys.addaudithook(_note)  # which cannot be taken away


@contextmanager
def opened() -> Iterator[Counter[str]]:
    """Yield how many files are opened meanwhile, by their ending."""
    global _opened
    _opened = Counter()
    try:
        yield _opened
    finally:
        _opened = None


@pytest.fixture
def in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[int], Path]:
    """Return what writes a campaign of so many missions, each a part that is not joined yet."""

    def fleet(_: object, seed: int) -> list[dict[str, float | None]]:
        if seed == FAILS:
            raise ValueError("no")
        return [auv(1.0 + seed)]

    def write(count: int) -> Path:
        folder = tmp_path / f"c{count}"
        shutil.rmtree(folder, ignore_errors=True)
        cut_short("base.yaml", folder, after=count, seeds=count)
        assert len(parts(folder)) == count
        return folder

    monkeypatch.chdir(tmp_path)
    hand_made(monkeypatch, fleet)
    fly_with(monkeypatch, Singly)
    Path("base.yaml").write_text("name: tiny\nduration_s: 5\nauvs: {count: 1}\n")
    return write


def as_running(folder: Path) -> None:
    """Have a campaign as it is when its process was killed."""
    write_record(folder, {**read_record(folder), "status": "running"})


def test_to_count_missions_one_small_file_a_part_is_opened(
    in_parts: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The record of each part is read, once; no table is."""
    stats, plain = [0], os.stat

    def stat(*words: Any, **more: Any) -> os.stat_result:
        stats[0] += 1
        return plain(*words, **more)

    found = []
    for count in (5, 15):
        folder = in_parts(count)
        monkeypatch.setattr(os, "stat", stat)
        stats[0] = 0
        with opened() as files, monkeypatch.context() as patch:
            patch.setattr(pq, "ParquetFile", None)
            state = load_campaign(folder).state()
        monkeypatch.setattr(os, "stat", plain)
        assert (state.done, state.failed, state.missing) == (count - 1, 1, 0)
        found.append((files[".json"], files[".parquet"], stats[0]))
    more = np.diff(found, axis=0)[0] / 10
    assert more[:2].tolist() == [1, 0]
    assert 1 <= more[2] <= 8


def test_a_rate_reads_the_rows_of_one_part(in_parts: Callable[[int], Path]) -> None:
    """That which was written first tells when the first mission began."""
    folder = in_parts(9)
    as_running(folder)
    with opened() as files:
        assert load_campaign(folder).state().missions_per_s
    assert files[".parquet"] == 2  # its checksum is compared, then it is read


def test_the_report_of_a_complete_campaign_reads_one_part(in_parts: Callable[[int], Path]) -> None:
    """However many parts there were: each group of metrics is read of the one that is left."""
    found = []
    for count in (5, 15):
        folder = in_parts(count)
        resume(folder)
        assert parts(folder) == ["all-0001"]
        with opened() as files:
            campaign = resume(folder)
            campaign.report()
        found.append((files[".json"], files[".parquet"]))
    assert found[0] == found[1]
    assert found[0][1] <= 25


def test_a_report_reads_many_metrics_of_a_part_at_a_time(
    in_parts: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that its tables show it has; parts are put together meanwhile; the page is the same."""
    campaign, read = load_campaign(in_parts(5)), list[Sequence[str]]()
    whole = campaign.report()

    def read_some(folder: Path, metrics: Sequence[str], points: int) -> Any:
        read.append(metrics)
        return plain(folder, metrics, points)

    plain = outcomes.outcomes
    monkeypatch.setattr(outcomes, "outcomes", read_some)
    monkeypatch.setattr(outcomes, "MOST_VALUES", 40 * 5)
    monkeypatch.setattr(part_rows, "MOST_APART", 2)
    assert campaign.report() == whole
    assert len(read) == 3
    assert {name for names in read for name in names} == set(campaign.points.metric)
    assert campaign.missions["mission"].tolist() == list(range(5))


def test_no_flipped_bit_of_a_record_changes_what_is_counted(
    in_parts: Callable[[int], Path],
) -> None:
    """It is told with its file, or the right missions are counted all the same."""
    folder = in_parts(3)
    sound, told = load_campaign(folder).done(), []
    (_, path, _), dice = sorted(folder.glob("checksums/*")), random.Random(4)
    whole = path.read_bytes()
    for _ in range(300):
        flipped(path, dice)
        try:
            found = load_campaign(folder).done()
        except ValueError as error:
            told.append(str(error))
        else:
            assert (found.numbers == sound.numbers).all()
            assert (found.failed == sound.failed).all()
        path.write_bytes(whole)
    assert 200 < len(told) < 300
    assert all(path.stem in it and f"resume {folder}" in it for it in told)
    flipped(path, dice)
    shutil.copytree(folder, "damaged")
    path.write_bytes(whole)
    with pytest.warns(UserWarning, match="its missions are run again"):
        mended = resume("damaged")
    same(mended, resume(folder))


def test_a_record_without_missions_has_them_in_its_rows(
    in_parts: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those of earlier versions, and of parts whose missions are in too many pieces."""
    folder = in_parts(3)
    for path in folder.glob("checksums/*"):
        record = json.loads(path.read_text())
        assert record["missions"]["runs"][0][1] == 1
        path.write_text(json.dumps({key: record[key] for key in record if key in _FORMER}))
    found = load_campaign(folder).done()
    assert (found.numbers.tolist(), found.failed.tolist()) == ([0, 1, 2], [False, False, True])
    monkeypatch.setattr(runs, "MOST_RUNS", 0)
    again = load_campaign(in_parts(4))
    assert "missions" not in json.loads(next(again.folder.glob("checksums/*")).read_text())
    assert again.done().numbers.tolist() == list(range(4))
    assert again.done().failed.tolist() == [False, False, True, False]


_FORMER = ("part", "plan_sha256", "replaces", "files")


@given(st.sets(st.integers(0, 3000), max_size=60), st.integers(1, 1000))
def test_numbers_are_found_again_from_their_runs(numbers: set[int], step: int) -> None:
    """Whatever missions a part has; those of a share, every so many, are one run."""
    some = np.array(sorted(numbers), dtype=np.int64)
    assert runs._numbers(json.loads(json.dumps(runs._runs(some)))).tolist() == some.tolist()
    share = runs._runs(np.arange(7, 7 + 50 * step, step))
    assert share == {"step": step, "runs": [[7, 50]]}


@pytest.mark.parametrize(
    "runs",
    [[[0, 10**9]], [[-1, 2]], [[0, -2]], [[2**63, 1]], [[2**62, 4], [0, 2**62]], [[0]], "x", None],
)
def test_missions_that_cannot_be_are_refused(runs: Any, in_parts: Callable[[int], Path]) -> None:
    """A stranger's record with a sum that fits takes no memory and ends in no traceback."""
    folder = in_parts(1)
    (path,) = folder.glob("checksums/*")
    record = json.loads(path.read_text())
    record["missions"]["runs"] = runs
    path.write_text(sealed(record))
    with pytest.raises(ValueError, match="is damaged"):
        load_campaign(folder)


def test_a_plan_is_made_only_where_it_is_needed_or_was_edited(
    in_parts: Callable[[int], Path],
) -> None:
    """Counting missions works out no scenario of a point, however many points there are."""
    folder = in_parts(1)
    campaign = load_campaign(folder)
    assert (campaign.state().done, "plan" in vars(campaign)) == (1, False)
    record = read_record(folder)
    record["experiment"]["points"] = [{"auvs.count": 0}]
    write_record(folder, record)
    with pytest.raises(ValueError, match=r"campaign\.json is damaged or was edited"):
        load_campaign(folder)


def test_status_loads_no_machinery_of_missions(in_parts: Callable[[int], Path]) -> None:
    """Neither what compiles equations nor what draws, computes with or searches tables."""
    code = (
        "import sys\n"
        "from bindusbl_des.cli import main\n"
        f"try: main(['status', {str(in_parts(2))!r}])\n"
        "except SystemExit: pass\n"
        "heavy = {'numba', 'scipy', 'pandas', 'matplotlib', 'shapely', 'networkx', 'simpy'}\n"
        "print('loaded', *heavy.intersection(sys.modules))"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    told = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert told.stdout.splitlines()[-1] == "loaded", told.stderr
    assert "done      2" in told.stdout


def test_what_is_read_of_a_part_leaves_memory_with_it(in_parts: Callable[[int], Path]) -> None:
    """Commands seldom look for garbage: what only that frees would be gigabytes of many parts."""
    campaign = load_campaign(in_parts(5))
    gc.collect()
    gc.disable()
    try:
        assert len(campaign.missions) == 5
        resume(campaign.folder).report()
        left = [it for it in gc.get_objects() if type(it) in (pq.FileMetaData, pq.ParquetFile)]
    finally:
        gc.enable()
    assert not left
