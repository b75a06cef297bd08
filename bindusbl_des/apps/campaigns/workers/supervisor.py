"""The supervisor distributes batches, survives dying workers, and isolates missions that kill them;
an estimate of a campaign's cost from sampled missions.

Batches grow with the campaign, so that its folder holds few files and a crash loses at most half a
minute of one worker.  Missions of a point stay together.  The first Ctrl-C finishes missions under
way, the second stops at once.
"""

import json
import math
import os
import signal
import tempfile
import threading
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from types import FrameType

import numpy as np

from ....support.arrays import Ints
from ....support.kept_files import keep
from ....support.plugins import is_allowed
from ..experiments.experiment import ExperimentPlan
from ..experiments.point_checks import without_plugins
from ..storage.folder import ask_to_stop
from ..storage.part_rows import compact
from ..storage.parts import FAILED, MISSIONS, part_path
from .batches import (
    Batch,
    Gathered,
    NotWritten,
    Ran,
    Row,
    as_not_written,
    heartbeat_of,
    rows_of,
    run_batch,
    signal_name,
    take_heartbeat,
    write,
    write_failure,
)
from .pools import WorkerPool


class WaitingMissions:
    """Waiting missions by number, in order; those put back come first."""

    def __init__(self, seeds: int) -> None:
        self._seeds, self._numbers = seeds, np.zeros(0, np.int64)

    def __len__(self) -> int:
        return len(self._numbers)

    def extend(self, numbers: Ints) -> None:
        """Add missions behind all others."""
        self._numbers = np.concatenate([self._numbers, numbers])

    def put_back(self, numbers: Sequence[int]) -> None:
        """Add missions before all others."""
        if numbers:
            self._numbers = np.concatenate([numbers, self._numbers])

    def take(self, most: int) -> tuple[int, ...]:
        """Return the next missions, at least one; keep the seeds of a point together if possible.

        A worker computes a point's scenario and paths once for consecutive seeds.

        >>> waiting = WaitingMissions(seeds=4)
        >>> waiting.extend(np.arange(12))
        >>> waiting.take(6), waiting.take(3), waiting.take(6)
        ((0, 1, 2, 3), (4, 5, 6), (7, 8, 9, 10, 11))
        """
        point = self._numbers[: most + 1] // self._seeds
        if len(point) > most and point[-1] == point[-2]:
            most = int(np.argmax(point == point[-1])) or most
        batch, self._numbers = np.split(self._numbers, [most])
        return tuple(batch.tolist())


# Missions of the first batches, and the most in a batch, whose rows stay in memory.
FIRST_IN_BATCH, MOST_IN_BATCH = 50, 5000
SHORTEST_BATCH_S = 0.5
LONGEST_BATCH_S = 30.0

# A mission is given up after so many deaths of its worker, the last with it alone; deaths before it
# began count less.
MOST_KILLS, MOST_DEATHS_BEFORE = 3, 8
# A mission is given up after so many timeouts; one may come from a stopped campaign (Ctrl-Z).
MOST_TIMEOUTS = 2

# A stopped worker cannot end itself: its parent ends it so long (s) after the limit.  LOADING_S is
# the time (s) to start and load code, outside a mission's own time.
GRACE_S, LOADING_S = 2.0, 600.0
# The longest step (s) of the parent's clock between looks, so that a stopped campaign counts none.
LOOK_S = 1.0
STOPPED = "The worker was stopped, or did not answer; its parent ended it.\n"

# The length of batches as a share of the campaign's time so far.
BATCH_SHARE = 0.1

# After so many deaths in a row without a finished mission, the cause is no mission.
MOST_DEATHS_IN_A_ROW = 8


class WorkersDie(RuntimeError):
    """Workers die one after another, whichever missions they run."""


class Supervisor:
    """Distributes a plan's missions to the workers of a pool, who write the rows; counts them."""

    def __init__(
        self,
        plan: ExperimentPlan,
        folder: Path,
        pool: WorkerPool,
        note: Callable[[Sequence[Row]], None] = lambda _: None,
        mission_timeout_s: float | None = None,
        shortest_batch_s: float = SHORTEST_BATCH_S,
    ) -> None:
        self.plan, self.folder, self.pool, self.note = plan, folder, pool, note
        self.mission_timeout_s = mission_timeout_s
        self._shortest_batch_s = shortest_batch_s
        self.stopping = False
        self.trouble: NotWritten | None = None
        self._fresh = WaitingMissions(len(plan.experiment.seeds))
        self._suspects: deque[tuple[int, ...]] = deque()
        self._kills: Counter[tuple[int, bool]] = Counter()  # by number, and whether it had begun
        self._deaths = self._finished = 0
        self._worked_s = 0.0
        self._running: dict[Future[list[Row]], Batch] = {}
        self._heard: dict[str, tuple[str, float]] = {}  # of each part, and for how long (s)
        self._ended = set[str]()
        self._began = self._looked = monotonic()
        self._plan_sha256 = plan.fingerprint()

    def stop(self) -> None:
        """Ask workers to finish their present missions, write the rows, and end."""
        self.stopping = True
        with suppress(OSError):  # on a full disk they stop when their time is spent
            ask_to_stop(self.folder)

    def run(self, missions: Ints, until: float = math.inf) -> None:
        """Distribute missions (by number) until each has a row or the supervisor stops.

        It also stops at `until` (s, by `time.monotonic`); missions that have begun still end.

        Raises:
            NotWritten: when rows cannot be written.
        """
        self._fresh.extend(missions)
        while self._running or (self._is_waiting and not self.stopping):
            if monotonic() > until and not self.stopping:
                self.stop()
            while self._is_waiting and not self.stopping and self.pool.has_room():
                batch = self._next()
                self._running[self.pool.submit(batch)] = batch
            finished, _ = wait(self._running, timeout=0.2, return_when=FIRST_COMPLETED)
            if self.mission_timeout_s is not None:
                self._end_silent(self.mission_timeout_s)
            for future in finished:
                self._take(self._running.pop(future), future)
        if self.trouble:
            raise self.trouble

    def _end_silent(self, limit: float) -> None:
        """End workers that run one mission longer than `limit` (s)."""
        now = monotonic()
        passed, self._looked = min(now - self._looked, LOOK_S), now
        heard, self._heard = self._heard, {}
        for future, batch in self._running.items():
            text, runs = heartbeat_of(self.folder, batch.part)
            before, silent_s = heard.get(batch.part, ("", 0.0))
            silent_s = silent_s + passed if text == before else 0.0
            self._heard[batch.part] = text, silent_s
            if (
                silent_s > (limit if runs else max(limit, LOADING_S)) + GRACE_S
                and not future.done()
            ):
                self._ended |= {batch.part} if runs else set()
                self.pool.end(future)

    @property
    def _is_waiting(self) -> bool:
        return bool(self._suspects or self._fresh)

    def _next(self) -> Batch:
        """Return the next batch: a suspect, or a fair share of waiting missions within its time."""
        spent, most = monotonic() - self._began, FIRST_IN_BATCH
        budget_s = min(max(BATCH_SHARE * spent, self._shortest_batch_s), LONGEST_BATCH_S)
        if self._suspects:
            numbers = self._suspects.popleft()
        else:
            if self._worked_s:
                most = min(math.ceil(budget_s * self._finished / self._worked_s), MOST_IN_BATCH)
            numbers = self._fresh.take(min(math.ceil(len(self._fresh) / 2 / self.pool.size), most))
        limit = self.mission_timeout_s
        return batch_of(self.plan, self.folder, numbers, budget_s, limit, self._plan_sha256)

    def _take(self, batch: Batch, future: "Future[list[Row]]") -> None:
        """Count the missions of a batch that has ended; its unfinished ones wait again."""
        exit_code = self.pool.release(future)
        error = future.exception()
        if isinstance(error, NotWritten):
            self._break_off(error)
        elif error is None:
            self._count(batch, future.result())
        elif part_path(self.folder, MISSIONS, batch.part).is_file():  # died when all was written
            self._count(batch, rows_of(self.folder, batch.part))
        else:
            self._suspect(batch, exit_code, error)

    def _count(self, batch: Batch, rows: list[Row]) -> None:
        self._finished, self._deaths = self._finished + len(rows), 0
        self._worked_s += sum(row.wall_time_s for row in rows)
        self.note(rows)
        ran = {row.number for row in rows}
        self._fresh.put_back([number for number in batch.numbers if number not in ran])

    def _suspect(self, batch: Batch, exit_code: int | None, error: BaseException) -> None:
        """Retry the mission at which a worker died alone; others of its batch may go on.

        Without a heartbeat, halves of the batch are tried until the mission is alone.
        """
        numbers = batch.numbers
        culprit, trace = take_heartbeat(self.folder, batch.part)
        trace = trace or STOPPED * (batch.part in self._ended)
        end = signal_name(exit_code) if exit_code is not None else type(error).__name__
        # Once any mission was finished, a begun mission itself is the cause
        if not trace and (culprit is None or not self._finished):
            self._count_death(end)
        if culprit is None and len(numbers) > 1:
            middle = len(numbers) // 2
            self._suspects.extend((numbers[:middle], numbers[middle:]))
            return
        number, had_begun = (numbers[0], False) if culprit is None else (culprit, True)
        self._fresh.put_back([other for other in numbers if other != number])
        self._kills[number, had_begun] += 1
        most = MOST_TIMEOUTS if trace else MOST_KILLS if had_begun else MOST_DEATHS_BEFORE
        if self._kills[number, had_begun] < most:
            self._suspects.append((number,))
        elif trace:
            text = f"took longer than {self.mission_timeout_s:g} s; ended"
            self._quarantine(batch, number, text, trace)
        else:
            text = f"killed its worker {most} times{'' if had_begun else ' before it began'}: {end}"
            self._quarantine(batch, number, text, str(error))

    def _count_death(self, end: str) -> None:
        self._deaths += 1
        if self._deaths >= MOST_DEATHS_IN_A_ROW:
            raise WorkersDie(f"{self._deaths} workers died in a row: {end}")

    def _quarantine(self, batch: Batch, number: int, text: str, trace: str) -> None:
        """Write a failed row for a mission that kills its worker or never ends."""
        mission = next(mission for mission in batch.missions if mission.number == number)
        found = Gathered(batch)
        found.add(Ran(mission, 0.0, error=text))
        try:
            with as_not_written():
                write_failure(batch, mission, text, trace)
            write(batch, found)
        except NotWritten as error:
            self._break_off(error)
            return
        self.note([Row(mission.number, FAILED, 0.0)])

    def _break_off(self, error: NotWritten) -> None:
        self.trouble = error
        self.stop()


def batch_of(
    plan: ExperimentPlan,
    folder: Path,
    numbers: tuple[int, ...],
    budget_s: float,
    mission_timeout_s: float | None = None,
    plan_sha256: str = "",
) -> Batch:
    """Return a batch of missions of a plan."""
    missions = tuple(plan.mission(number) for number in numbers)
    return Batch(
        folder=str(folder.absolute()),
        part=f"{numbers[0]:08d}-{uuid.uuid4().hex[:8]}",
        plan_sha256=plan_sha256 or plan.fingerprint(),
        model_version=plan.model_version,
        columns=plan.columns,
        points={mission.point: plan.points[mission.point] for mission in missions},
        missions=missions,
        budget_s=budget_s,
        mission_timeout_s=mission_timeout_s,
        plugins=tuple(name for name in plan.own_parts if is_allowed(name)),
        own_parts=plan.own_parts,
    )


@contextmanager
def interruptible(stop: Callable[[], None]) -> Iterator[list[int]]:
    """Call `stop` at the first interrupt or request to end; raise KeyboardInterrupt at the next.

    Yields the received signals.  Outside the main thread, which gets no signals, it does nothing.
    """
    asked: list[int] = []

    def receive(number: int, _: FrameType | None) -> None:
        asked.append(number)
        if len(asked) > 1:
            raise KeyboardInterrupt
        stop()

    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = {number: signal.signal(number, receive) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


# The time (s) and the most missions for sampling a point.
SAMPLE_S, MOST_SAMPLED = 0.5, 8

# The fixed time (s) of any campaign, and the size (bytes) of its page.
START_S, PAGE_BYTES = 3.0, 170_000


@dataclass(frozen=True)
class CampaignEstimate:
    """The missions of a campaign, and their expected time (s) and disk space (bytes)."""

    missions: int
    points: int
    seeds: int
    seconds: float
    bytes: int


def estimated(plan: ExperimentPlan, missions: int, workers: int | None) -> CampaignEstimate:
    """Estimate a campaign's cost from missions of its first and last point.

    They run in a temporary folder; shipped parts stand for plug-ins, which are not loaded.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        keep(plan.files, folder)
        _, alone = _sampled(plan, folder, 0, range(1))
        each = [_sampled(plan, folder, 0, range(1, 1 + MOST_SAMPLED))]
        if len(plan.points) > 1:
            seeds = range(1 + MOST_SAMPLED, 1 + 2 * MOST_SAMPLED)
            each.append(_sampled(plan, folder, len(plan.points) - 1, seeds))
    seconds, size = np.mean(each, axis=0).tolist()
    at_once = max(1, min(workers or os.cpu_count() or 1, missions))
    return CampaignEstimate(
        missions,
        len(plan.points),
        len(plan.experiment.seeds),
        START_S + seconds * missions / at_once,
        round(PAGE_BYTES + alone - each[0][1] + size * missions),
    )


def _sampled(
    plan: ExperimentPlan, folder: Path, point: int, seeds: Iterable[int]
) -> tuple[float, float]:
    """Run missions of a point with new seeds; return time (s) and disk space (bytes) of each."""
    batch = _plain(batch_of(plan, folder, (point * len(plan.experiment.seeds),), SAMPLE_S))
    (mission,) = batch.missions
    before = _size(folder)
    rows = run_batch(
        replace(batch, missions=tuple(replace(mission, number=seed, seed=seed) for seed in seeds))
    )
    compact(folder)
    spent = sum(row.wall_time_s for row in rows)
    return spent / len(rows), (_size(folder) - before) / len(rows)


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.glob("*/*.parquet"))


def _plain(batch: Batch) -> Batch:
    """Return a batch without plug-ins."""
    points = {
        number: replace(point, scenario=json.dumps(without_plugins(json.loads(point.scenario))))
        for number, point in batch.points.items()
    }
    return replace(batch, points=points, plugins=(), own_parts={})
