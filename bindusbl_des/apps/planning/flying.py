"""The missions of a plan: a campaign that grows on demand, its goals' values, and the budget."""

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from itertools import chain, takewhile
from pathlib import Path
from time import monotonic
from types import MappingProxyType
from typing import Any

import numpy as np

from ...support.arrays import Floats
from ...support.files import sync
from ...support.process import ProgressLine, answered, duration, end_now
from ...support.wording import counted
from ..campaigns.campaign import Campaign, unfinished_campaign
from ..campaigns.experiments.experiment import Experiment, ExperimentPlan
from ..campaigns.failures import check_files
from ..campaigns.running import at_run, laid_out, mended, restore_record
from ..campaigns.statistics.outcomes import failed_because
from ..campaigns.storage.folder import AS_ASKED, LIMIT, RECORD, CampaignError, clean, locked
from ..campaigns.storage.part_rows import read_part
from ..campaigns.storage.parts import MISSIONS, OK, committed
from ..campaigns.workers.batches import Row, compile_kernels
from ..campaigns.workers.pools import WorkerPool, at_work, pool_for
from ..campaigns.workers.supervisor import Supervisor, interruptible
from .goals import Goal
from .question import Question

AUVS = "auvs"


def wanted(goals: Sequence[Goal]) -> dict[str, list[str]]:
    """Return the columns that the goals need from the tables of AUVs and of missions.

    >>> wanted([Goal("position_error_m", below=1.0), Goal("area_covered_share", above=0.9)])
    {'auvs': ['position_error_m'], 'missions': ['area_covered_share']}
    """
    columns = {table: [goal.metric for goal in goals if goal.is_of_auvs == (table == AUVS)]
               for table in (AUVS, MISSIONS)}  # fmt: skip
    return {table: list(dict.fromkeys(names)) for table, names in columns.items()}


def values(goals: Sequence[Goal], rows: Sequence[Mapping[str, Any]]) -> Floats:
    """Return the goals' values (k, g) of k missions; nan where a mission failed or has none."""
    found = [[_value(goal, row) for goal in goals] for row in rows]
    return np.array(found, float).reshape(len(rows), len(goals))


def _value(goal: Goal, row: Mapping[str, Any]) -> float:
    if not row:
        return np.nan
    if goal.lost and LOST in row:
        each = np.array([_value(replace(goal, lost=0), lost) for lost in row[LOST]])
        return float(each.max() if goal.is_below else each.min())  # nan if any is
    if goal.is_of_auvs:
        return float(goal.of_fleets(np.array([row[f"{AUVS}.{goal.metric}"]], float))[0])
    value = row[goal.metric]
    return np.nan if value is None else float(value)


# Under this key a mission's row holds the rows of the same mission with each loss of vessels.
LOST = "lost"

Pair = tuple[int, int]  # the number of a point, and that of a seed in its list

# A batch is written when its share is done, or after this time (s), since it costs some files.
BATCH_S = 2.0

# The wanted columns of each table.
Wanted = Mapping[str, Sequence[str]]

# From the number of a point to the points with each loss of its vessels
Losses = Mapping[int, Sequence[int]]


class Stopped(KeyboardInterrupt):
    """Ctrl-C; finished missions are kept."""


class Flights:
    """The finished missions of an experiment, and the workers who simulate more.

    `asked` are the wanted columns by table.  `note` receives the rows of missions as they end.
    `losses` maps a point to the points with each loss of its vessels.
    """

    def __init__(
        self,
        campaign: Campaign,
        pool: WorkerPool,
        asked: Wanted,
        note: Callable[[Sequence[Row]], None],
        losses: Losses,
    ) -> None:
        self._losses = losses
        self.campaign, self._pool, self._asked, self._note = campaign, pool, asked, note
        self._rows: dict[int, dict[str, Any]] = {}
        self._read: set[str] = set()
        self._take_in()

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def failed(self) -> str:
        """How many missions failed, and why; "" without failures."""
        failed = counted(sum(not row for row in self._rows.values()), "mission")
        why = failed_because(self.campaign.folder)
        return f"{failed} failed{why}" if why else ""

    def lacking(self, pairs: Sequence[Pair], lost: bool = False) -> int:
        """Return how many of these missions are missing, with those of `lost` vessels if asked."""
        return len({n for pair in pairs for n in self._numbers(pair, lost)} - self._rows.keys())

    def rows(
        self,
        pairs: Sequence[Pair],
        until: float = math.inf,
        most: int | None = None,
        lost: bool = False,
    ) -> list[dict[str, Any]]:
        """Return the columns of missions, after simulating the missing ones.

        With `lost` each row also holds the missions with losses.  A failed mission is an empty row;
        columns of AUVs are lists.  No mission begins after `until` (s, by `time.monotonic`), and at
        most `most` are simulated; the rows then end before the first missing mission.

        Raises:
            Stopped: when the user interrupted them.
            NotWritten: when the folder cannot be written.
        """
        numbers = [self._numbers(pair, lost) for pair in pairs]
        each = dict.fromkeys(chain.from_iterable(numbers))
        missing = [number for number in each if number not in self._rows][:most]
        if missing:
            self._fly(missing, until)
        flown = takewhile(lambda own: all(number in self._rows for number in own), numbers)
        return [self._row(own) for own in flown]

    def _row(self, numbers: Sequence[int]) -> dict[str, Any]:
        """Return the row of a mission, with those of its losses under LOST."""
        whole, *lost = (self._rows[number] for number in numbers)
        return {**whole, LOST: lost} if whole and lost else whole

    def _numbers(self, pair: Pair, lost: bool) -> list[int]:
        """Return the number of a mission, and those of its losses."""
        point, seed = pair
        seeds = len(self.campaign.plan.experiment.seeds)
        points = (point, *(self._losses.get(point, ()) if lost else ()))
        return [point * seeds + seed for point in points]

    def _fly(self, missing: Sequence[int], until: float) -> None:
        plan, folder = self.campaign.plan, self.campaign.folder
        supervisor = Supervisor(plan, folder, self._pool, self._note, shortest_batch_s=BATCH_S)
        with interruptible(supervisor.stop) as interrupts:
            supervisor.run(np.array(missing, np.int64), until)
        clean(folder)  # remove the request to stop
        self._take_in()
        if interrupts:
            raise Stopped

    def _take_in(self) -> None:
        """Read the rows of new parts."""
        folder = self.campaign.folder
        for part in set(committed(folder)) - self._read:
            self._read.add(part)
            rows = read_part(
                folder, MISSIONS, part, ("mission", "status", *self._asked.get(MISSIONS, ()))
            )
            for row in rows.to_pylist() if rows is not None else ():
                number, well = row.pop("mission"), row.pop("status") == OK
                self._rows.setdefault(number, row if well else {})
            self._take_in_auvs(part)

    def _take_in_auvs(self, part: str) -> None:
        columns = self._asked.get("auvs", ())
        table = read_part(self.campaign.folder, "auvs", part, ("mission", *columns))
        if not columns or table is None:
            return
        for row in table.to_pylist():
            own = self._rows[row["mission"]]
            for name in columns:
                own.setdefault(f"auvs.{name}", []).append(row[name])


@contextmanager
def flights(
    experiment: Experiment,
    folder: Path,
    asked: Wanted,
    pool: WorkerPool,
    note: Callable[[Sequence[Row]], None] = lambda _: None,
    limit_m: float | None = None,
    losses: Losses = MappingProxyType({}),
) -> Iterator[Flights]:
    """Yield the missions of an experiment in a folder, which may hold some of them already.

    `limit_m` is the mean error (m) that every AUV should keep, for the folder's record.  `losses`
    maps a point to the points with each loss of its vessels.

    Raises:
        CampaignError: when the folder holds other missions, or another process works in it.
        NotWritten: when the folder cannot be written.
    """
    plan = ExperimentPlan(experiment)
    folder.mkdir(exist_ok=True)
    sync(folder.parent)
    restore_record(folder, plan, None)
    with locked(folder), at_run(_campaign(plan, folder), **{LIMIT: limit_m}) as campaign:
        with answered(end_now):
            compile_kernels(plan, folder)
        yield Flights(campaign, pool, asked, note, losses)
        campaign.record["status"] = AS_ASKED


def local_workers(count: int | None) -> AbstractContextManager[WorkerPool]:
    """Return a context with worker processes on this machine, by default one for each CPU."""
    return at_work(pool_for("local", count or os.cpu_count() or 1))


def limit_of(goals: Sequence[Goal]) -> float | None:
    """Return the goals' limit of the worst AUV's mean error (m), or None."""
    return next((goal.below for goal in goals if goal.metric == "position_error_m"
                 and goal.of == "worst"), None)  # fmt: skip


def _campaign(plan: ExperimentPlan, folder: Path) -> Campaign:
    """Return the campaign of a plan in its folder, which may be new."""
    if not (folder / RECORD).exists():
        return laid_out(plan, folder)
    before = unfinished_campaign(folder)
    if before.record["plan_sha256"] != plan.fingerprint():
        raise CampaignError(
            f"{folder}: holds missions of another plan, model or part; name another folder"
        )
    check_files(before)
    mended(before)
    return Campaign(folder, plan, before.record)


class Budget:
    """How many missions a plan may still simulate, and for how long (s); None means no limit.

    Time counts only while missions run, not while the plan compiles or predicts.  `cut_by` is the
    option that stopped the plan, or ""; `best` is text for the progress line.
    """

    def __init__(self, question: Question, *, quiet: bool) -> None:
        self.question = question
        self.flown = 0
        self.best = self.cut_by = ""
        self._most = question.budget_missions
        self._seconds = question.budget_s
        self._took = 0.0
        self._began = self._asked = math.nan
        self._doing = "proposing teams"
        self._line = ProgressLine(quiet=quiet)

    def sample(self, missions: Flights, goals: Sequence[Goal], pairs: Sequence[Pair]) -> Floats:
        """Return the goals' values (k, g) of missions after simulating the missing ones.

        If the budget does not suffice, only the first missions are returned.
        """
        self._began, before = monotonic(), self._took
        until = math.inf if self._seconds is None else self._began + self._seconds - before
        most = None if self._most is None else self._most - self.flown
        lost = any(goal.lost for goal in goals)
        self._asked = self.flown + missions.lacking(pairs, lost)
        try:
            rows = missions.rows(pairs, until, most, lost)
        finally:
            self._took = before + monotonic() - self._began
            self._began = math.nan
        if len(rows) < len(pairs):
            used_up = self._most is not None and self.flown >= self._most
            by_missions = f"--budget-missions {self._most}"
            self.cut_by = by_missions if used_up else f"--budget-s {self._seconds:g}"
        return values(goals, rows)

    def begin(self, what: str) -> None:
        """Show on the progress line what the plan does from now on."""
        self._doing = what
        self._line.tell(self._text)

    def note(self, rows: Sequence[Row]) -> None:
        """Count missions that have ended."""
        self.flown += len(rows)
        self._line.tell(self._text)

    def end(self) -> None:
        """End the progress line."""
        self._line.end(self._text)

    def _text(self) -> str:
        took = self._took + (0.0 if math.isnan(self._began) else monotonic() - self._began)
        left = [f"{self._doing}: {self.flown} missions flown"]
        if self.flown and self._asked > self.flown:
            seconds = took / self.flown * (self._asked - self.flown)
            left.append(f"at least {duration(seconds)} left")
        if self._seconds is not None:
            left.append(f"cut off in {duration(max(self._seconds - took, 0.0))}")
        return ", ".join(left) + (f"; best so far {self.best}" if self.best else "")
