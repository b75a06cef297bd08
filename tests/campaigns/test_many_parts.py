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
from campaigns_for_tests import OneThread, auv, hand_made, same
from hypothesis import given
from hypothesis import strategies as st
from test_campaign_folders import flipped

from bindusbl_des.campaigns import campaign as campaign_module
from bindusbl_des.campaigns import page, running
from bindusbl_des.campaigns.campaign import Campaign, load_campaign
from bindusbl_des.campaigns.experiments.experiment import ExperimentPlan
from bindusbl_des.campaigns.experiments.experiment_file import load_experiment
from bindusbl_des.campaigns.experiments.options import PythonArguments
from bindusbl_des.campaigns.running import first_record, resume
from bindusbl_des.campaigns.statistics import outcomes
from bindusbl_des.campaigns.statistics.outcomes import MissionOutcomes
from bindusbl_des.campaigns.storage import done as runs
from bindusbl_des.campaigns.storage import part_rows
from bindusbl_des.campaigns.storage.folder import (
    CampaignError,
    read_record,
    write_record,
    write_scenario,
)
from bindusbl_des.campaigns.storage.part_rows import done
from bindusbl_des.campaigns.storage.parts import committed, record_path
from bindusbl_des.campaigns.workers.batches import run_batch
from bindusbl_des.campaigns.workers.supervisor import batch_of
from bindusbl_des.core.files import sealed
from bindusbl_des.results.schemas import mission_numbers

IN_PART = 4
FAILS = 6  # the seed whose mission fails

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
    """Return what writes a campaign of so many parts, interrupted before they are joined."""

    def fleet(_: object, seed: int) -> list[dict[str, float | None]]:
        if seed == FAILS:
            raise ValueError("no")
        return [auv(1.0 + seed)]

    def write(parts: int) -> Path:
        folder = tmp_path / f"c{parts}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        given = load_experiment("base.yaml", PythonArguments(None, None, parts * IN_PART, None))
        plan = ExperimentPlan(given)
        session = {"began_at": 0.0, "rows_before": 0}
        record = {**first_record(plan, None), "status": "interrupted", "session": session}
        write_record(folder, record)
        write_scenario(folder, plan.experiment.given)
        for first in range(0, len(plan), IN_PART):
            run_batch(batch_of(plan, folder, tuple(range(first, first + IN_PART)), 100.0))
        assert len(committed(folder)) == parts
        return folder

    monkeypatch.chdir(tmp_path)
    hand_made(monkeypatch, fleet)
    monkeypatch.setattr(running, "pool_for", OneThread)
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
        assert (state.done, state.failed, state.missing) == (count * IN_PART - 1, 1, 0)
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
        assert committed(folder) == ["all-0001"]
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
    whole = page.sweep_page(campaign)

    def read_some(folder: Path, metrics: Sequence[str]) -> MissionOutcomes:
        read.append(metrics)
        return plain(folder, metrics)

    plain = outcomes.outcomes
    monkeypatch.setattr(outcomes, "outcomes", read_some)
    monkeypatch.setattr(outcomes, "MOST_VALUES", 40 * 5 * IN_PART)
    monkeypatch.setattr(part_rows, "MOST_APART", 2)
    assert page.sweep_page(campaign) == whole
    assert len(read) == 3
    assert {name for names in read for name in names} == set(mission_numbers())
    rows = part_rows.read_table(campaign.folder, "missions")
    assert rows is not None
    assert (len(rows), rows["mission"].num_chunks) == (5 * IN_PART, 3)


def test_no_flipped_bit_of_a_record_changes_what_is_counted(
    in_parts: Callable[[int], Path],
) -> None:
    """It is told with its file, or the right missions are counted all the same."""
    folder = in_parts(3)
    sound, told = done(folder), []
    path, dice = record_path(folder, committed(folder)[1]), random.Random(4)
    whole = path.read_bytes()
    for _ in range(300):
        flipped(path, dice)
        try:
            found = done(folder)
        except CampaignError as error:
            told.append(str(error))
        else:
            assert (found.numbers == sound.numbers).all()
            assert (found.failed == sound.failed).all()
        path.write_bytes(whole)
    assert 200 < len(told) < 300
    assert all(committed(folder)[1] in it and f"resume {folder}" in it for it in told)
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
        assert record["missions"]["runs"][0][1] == IN_PART
        path.write_text(json.dumps({key: record[key] for key in record if key in _FORMER}))
    assert done(folder).numbers.tolist() == list(range(12))
    assert done(folder).numbers[done(folder).failed].tolist() == [FAILS]
    monkeypatch.setattr(runs, "MOST_RUNS", 0)
    again = load_campaign(in_parts(3))
    assert "missions" not in json.loads(next(again.folder.glob("checksums/*")).read_text())
    _equal(again, load_campaign(folder))


_FORMER = ("part", "plan_sha256", "replaces", "files")


def _equal(one: Campaign, other: Campaign) -> None:
    assert one.done().numbers.tolist() == other.done().numbers.tolist()
    assert one.done().failed.tolist() == other.done().failed.tolist()
    same(one, other)


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
    path = record_path(folder, committed(folder)[0])
    record = json.loads(path.read_text())
    record["missions"]["runs"] = runs
    path.write_text(json.dumps(sealed(record)))
    with pytest.raises(CampaignError, match="is damaged"):
        done(folder)


def test_a_plan_is_made_only_where_it_is_needed_or_was_edited(
    in_parts: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counting missions works out no scenario of a point, however many points there are."""
    folder = in_parts(1)
    monkeypatch.setattr(campaign_module, "ExperimentPlan", None)
    campaign = load_campaign(folder)
    assert (campaign.state().done, campaign.state().failed) == (IN_PART, 0)
    with pytest.raises(CampaignError, match=r"campaign\.json is damaged or was edited"):
        _ = campaign.plan  # since `None` makes none
    path = folder / "campaign.json"
    path.write_text(path.read_text().replace('"points": [', '"points": [{"auvs.count": 0}, '))
    with pytest.raises(CampaignError, match=r"campaign\.json is damaged or was edited"):
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
    assert "done      7" in told.stdout


def test_what_is_read_of_a_part_leaves_memory_with_it(in_parts: Callable[[int], Path]) -> None:
    """Commands seldom look for garbage: what only that frees would be gigabytes of many parts."""
    campaign = load_campaign(in_parts(5))
    gc.collect()
    gc.disable()
    try:
        assert len(campaign.missions) == 5 * IN_PART
        running.compact(campaign.folder)
        campaign.report()
        left = [it for it in gc.get_objects() if type(it) in (pq.FileMetaData, pq.ParquetFile)]
    finally:
        gc.enable()
    assert not left
