"""The missions of a plan: a campaign whose missions are flown when somebody wants to know them."""

import errno
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..campaigns.campaign import Campaign, unfinished_campaign
from ..campaigns.experiments.experiment import Experiment
from ..campaigns.experiments.plan import Plan
from ..campaigns.refusals import check_files
from ..campaigns.running import first_record
from ..campaigns.storage.folder import (
    RECORD,
    CampaignError,
    clean,
    locked,
    write_json,
    write_scenario,
)
from ..campaigns.storage.joining import compact
from ..campaigns.storage.parts import MISSIONS, OK, clean_parts, committed, read_part, set_aside
from ..campaigns.workers.batches import NotWritten, Row
from ..campaigns.workers.interruption import interruptible
from ..campaigns.workers.pools import WorkerPool, at_work, pool_for
from ..campaigns.workers.supervisor import Supervisor
from ..campaigns.workers.warming import compile_kernels
from ..core.ctrl_c import answered, end_now
from ..core.durable import sync
from ..core.kept_files import keep, portable

Floats = NDArray[np.float64]
Pair = tuple[int, int]  # the number of a point, and that of a seed in its list

# Batches are written when their share is flown, or after so long (s): each costs some files.
BATCH_S = 2.0

# Of one table of a part, the columns that are wanted of each mission.
Wanted = Mapping[str, Sequence[str]]


class Stopped(KeyboardInterrupt):
    """Ctrl-C: what was flown is kept."""


class Flights:
    """The missions of an experiment that are flown so far, and the workers who fly more.

    `asked` are the columns that are read: of missions by their names, and of AUVs.  `note` hears of
    missions as they end.
    """

    def __init__(
        self,
        campaign: Campaign,
        pool: WorkerPool,
        asked: Wanted,
        note: Callable[[Sequence[Row]], None],
    ) -> None:
        self.campaign, self._pool, self._asked, self._note = campaign, pool, asked, note
        self._rows: dict[int, dict[str, Any]] = {}
        self._read: set[str] = set()
        self._take_in()

    def __len__(self) -> int:
        return len(self._rows)

    def lacking(self, pairs: Sequence[Pair]) -> int:
        """Return how many missions have not been flown."""
        return len({self._number(pair) for pair in pairs} - self._rows.keys())

    def rows(
        self, pairs: Sequence[Pair], until: float = math.inf, most: int | None = None
    ) -> list[dict[str, Any]]:
        """Return the columns of missions, which are flown where that has not been done.

        A failed mission is an empty row; columns of AUVs are lists.  `until` is the instant (by
        `time.monotonic`) at which no further mission is begun, `most` how many are flown; if either
        is not enough, the rows are those of the first missions alone, up to one that was not flown.

        Raises:
            Stopped: when the user interrupted them.
            NotWritten: when the folder cannot be written.
        """
        numbers = [self._number(pair) for pair in pairs]
        missing = [it for it in dict.fromkeys(numbers) if it not in self._rows][:most]
        if missing:
            self._fly(np.array(missing, np.int64), until)
        flown = takewhile(self._rows.__contains__, numbers)
        return [self._rows[it] for it in flown]

    def _number(self, pair: Pair) -> int:
        point, seed = pair
        return point * len(self.campaign.plan.experiment.seeds) + seed

    def _fly(self, missing: NDArray[np.int64], until: float) -> None:
        supervisor = Supervisor(
            self.campaign.plan,
            self.campaign.folder,
            self._pool,
            self._note,
            shortest_batch_s=BATCH_S,
        )
        interrupted = False

        def stop() -> None:
            nonlocal interrupted
            interrupted = True
            supervisor.stop()

        with interruptible(stop):
            supervisor.run(missing, until)
        if supervisor.trouble:
            raise supervisor.trouble
        clean(self.campaign.folder)  # a stop is no longer asked for
        self._take_in()
        if interrupted:
            raise Stopped

    def _take_in(self) -> None:
        """Read the rows of parts that were not there before."""
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
) -> Iterator[Flights]:
    """Yield the missions of an experiment in a folder, which may hold some of them already.

    Raises:
        CampaignError: when the folder holds other missions, or another process flies them.
        NotWritten: when the folder cannot be written.
    """
    plan = Plan(experiment)
    folder.mkdir(exist_ok=True)
    sync(folder.parent)
    with locked(folder):
        campaign = _campaign(plan, folder)
        status = "interrupted"
        try:
            with answered(end_now):
                compile_kernels(plan, folder)
            yield Flights(campaign, pool, asked, note)
            status = "flown as far as a plan asked"
        finally:
            _settle(campaign, status)


def local_workers(count: int | None) -> AbstractContextManager[WorkerPool]:
    """Return workers of this machine while they are needed, one for each CPU unless told."""
    return at_work(pool_for("local", count or os.cpu_count() or 1))


def _campaign(plan: Plan, folder: Path) -> Campaign:
    """Return the campaign of a plan in a folder that holds it, or nothing yet."""
    if (folder / RECORD).exists():
        before = unfinished_campaign(folder)
        if before.record["plan_sha256"] != plan.fingerprint():
            raise CampaignError(
                f"{folder}: holds missions of another plan, model or part; name another folder"
            )
        check_files(before)
        clean(folder)
        set_aside(folder, plan.fingerprint())
        clean_parts(folder)
        rows = len(before.done())
    else:
        keep(plan.files, folder)
        write_scenario(folder, portable(plan.experiment.given))
        rows = 0
    session = {"began_at": time.time(), "rows_before": rows}
    record = {**first_record(plan, None), "status": "running", "session": session}
    try:
        write_json(folder / RECORD, record)
    except OSError as error:
        raise NotWritten(error.errno or errno.EIO, error.strerror or str(error)) from None
    return Campaign(folder, plan, record)


def _settle(campaign: Campaign, status: str) -> None:
    with suppress(OSError):  # on a full disk the rows still say what is done
        clean(campaign.folder)
        compact(campaign.folder)
        write_json(campaign.folder / RECORD, {**campaign.record, "status": status})
