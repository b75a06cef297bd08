"""Batches of missions, run by a worker, which writes their rows itself.

The rows of a batch's missions, gathered into the tables of a part as the missions end.
"""

import json
import shlex
import signal
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path

import pyarrow as pa

from ...core.kept_files import check_kept, named_files, placed
from ...core.plugin_sources import source_sha256
from ...core.plugins import allow
from ...mission.simulation import simulate
from ...results.schemas import arrow
from ...scenario.families import leave_of
from ...scenario.scenario import Scenario
from ..experiments.experiment import as_written
from ..experiments.plan import Mission, PlannedPoint, mission_id
from ..storage.folder import STOP, write_json
from ..storage.parts import (
    ARROW_TYPES,
    FAILED,
    MISSIONS,
    OK,
    commit,
    labelled,
    metric_schema,
    part_path,
    read_part,
)
from .heartbeats import Heartbeat
from .warming import warm

# So many missions have tables of their own: one of a single row takes a kilobyte for each column.
MOST_APART = 32
CELL_BYTES = 8


@dataclass
class Ran:
    """One mission as it was run: its tables, or why there are none."""

    mission: Mission
    wall_time_s: float
    tables: Mapping[str, pa.Table] = field(default_factory=dict)
    error: str | None = None


class Gathered:
    """Missions that were run, and their rows.

    `columns` has the type of each varied key, `points` what is planned at each point.
    """

    def __init__(
        self, columns: Mapping[str, str], points: Mapping[int, PlannedPoint], model_version: str
    ) -> None:
        self._columns, self._points, self._model_version = columns, points, model_version
        self._apart: list[Ran] = []
        self._joined: dict[str, list[pa.Table]] = {}
        #: About how much memory (bytes) the rows take: to ask Arrow takes longer than to run some.
        self.nbytes = 0

    def add(self, ran: Ran) -> None:
        """Take the rows of one more mission."""
        self._apart.append(ran)
        self.nbytes += sum(CELL_BYTES * it.num_rows * it.num_columns for it in ran.tables.values())
        if len(self._apart) == MOST_APART:
            self._join()

    def tables(self) -> dict[str, pa.Table]:
        """Return the tables of all missions so far, each row with what says which one it is of."""
        self._join()
        return {name: pa.concat_tables(tables) for name, tables in self._joined.items()}

    def _join(self) -> None:
        ran, self._apart = self._apart, []
        if not ran:
            return
        names = dict.fromkeys(name for it in ran for name in it.tables if name != "mission")
        found = {name: self._table(name, ran) for name in names}
        for name, table in {**found, MISSIONS: self._missions(ran)}.items():
            self._joined.setdefault(name, []).append(table.combine_chunks())

    def _table(self, name: str, ran: Sequence[Ran]) -> pa.Table:
        lengths = [len(it.tables[name]) if name in it.tables else 0 for it in ran]
        owner = arrow([n for n, length in enumerate(lengths) for _ in range(length)], pa.int64())
        labels = self._labels(ran, with_point=name == "auvs")
        return labelled(
            pa.concat_tables([it.tables[name] for it in ran if name in it.tables]),
            {key: array.take(owner) for key, array in labels.items()},
        )

    def _missions(self, ran: Sequence[Ran]) -> pa.Table:
        described = metric_schema(MISSIONS)
        nothing = pa.table([pa.nulls(1, field.type) for field in described], schema=described)
        labels = self._labels(ran, with_point=True)
        labels["status"] = arrow([FAILED if it.error else OK for it in ran], pa.string())
        labels["error"] = arrow([it.error for it in ran], pa.string())
        labels["wall_time_s"] = arrow([it.wall_time_s for it in ran], pa.float64())
        return labelled(
            pa.concat_tables([it.tables["mission"] if it.tables else nothing for it in ran]), labels
        )

    def _labels(self, ran: Sequence[Ran], *, with_point: bool) -> dict[str, pa.Array]:
        """Return the columns that say which mission it was, a value for each mission."""
        points = [self._points[it.mission.point] for it in ran]
        ids = [
            mission_id(point.scenario, it.mission.seed, self._model_version)
            for it, point in zip(ran, points, strict=True)
        ]
        labels = {
            "mission": arrow([it.mission.number for it in ran], pa.int64()),
            "mission_id": arrow(ids, pa.string()),
            "seed": arrow([it.mission.seed for it in ran], pa.int64()),
        }
        if with_point:
            labels["point"] = arrow([it.mission.point for it in ran], pa.int64())
            for key, kind in self._columns.items():
                values = [point.varied[key] for point in points]
                if kind == "json":
                    values = [None if value is None else json.dumps(value) for value in values]
                labels[key] = arrow(values, ARROW_TYPES[kind])
        return labels


# With `detail: full`, a part is written before its tables need more memory than this.
LARGEST_PART_BYTES = 64_000_000


class NotWritten(OSError):
    """The rows of a batch could not be written; the campaign stops and can be resumed."""


@dataclass(frozen=True)
class Batch:
    """Missions for one worker, and all it must know to run them and write their rows.

    `plugins` are the names that the worker may load, by leave of whoever gave the command.
    """

    folder: str
    part: str
    plan_sha256: str
    model_version: str
    columns: Mapping[str, str]
    points: Mapping[int, PlannedPoint]
    missions: tuple[Mission, ...]
    budget_s: float
    mission_timeout_s: float | None = None
    plugins: tuple[str, ...] = ()
    own_parts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """What comes back of one mission: its number, whether it failed, its wall time."""

    number: int
    status: str
    wall_time_s: float


def run_batch(batch: Batch) -> list[Row]:
    """Run missions until the budget is spent or the campaign stops, at least one; write them.

    Raises:
        NotWritten: when the rows cannot be written, as on a full disk.
    """
    folder = Path(batch.folder)
    if part_path(folder, MISSIONS, batch.part).is_file():  # sent again by a cluster
        return rows_of(folder, batch.part)
    allow(batch.plugins)
    rows, found = [], gathered(batch)
    with _beating(folder, batch.part) as heartbeat:
        began = time.monotonic()
        for mission in batch.missions:
            warm(batch.points[mission.point].scenario, folder)  # loading is no mission's time
            with heartbeat.at(mission.number, batch.mission_timeout_s):
                ran = _run(batch, mission)
            found.add(ran)
            rows.append(Row(mission.number, FAILED if ran.error else OK, ran.wall_time_s))
            is_long = time.monotonic() - began > batch.budget_s
            if is_long or found.nbytes > LARGEST_PART_BYTES or (folder / STOP).exists():
                break
    write(batch, found)
    return rows


def gathered(batch: Batch) -> Gathered:
    """Return what gathers the rows of a batch's missions."""
    return Gathered(batch.columns, batch.points, batch.model_version)


@contextmanager
def _beating(folder: Path, part: str) -> Iterator[Heartbeat]:
    try:
        heartbeat = Heartbeat(folder, part)
    except OSError as error:
        raise NotWritten(error.errno, error.strerror) from None
    try:
        yield heartbeat
    finally:
        heartbeat.close()


def rows_of(folder: Path, part: str) -> list[Row]:
    """Return what would have come back of a part that is on the disk."""
    rows = read_part(folder, MISSIONS, part, ("mission", "status", "wall_time_s"))
    assert rows is not None
    return [Row(*row.values()) for row in rows.to_pylist()]


@lru_cache(maxsize=16)
def _scenario(text: str, folder: Path) -> tuple[Scenario, list[str]]:
    """Return a scenario with its files in a folder, and their names there."""
    data = json.loads(text)
    return Scenario.model_validate(placed(data, folder)), named_files(data)


def _run(batch: Batch, mission: Mission) -> Ran:
    began = time.perf_counter()
    try:
        folder = Path(batch.folder)
        scenario, files = _scenario(batch.points[mission.point].scenario, folder)
        check_kept(files, folder)
        _check_parts(batch.own_parts)
        result = simulate(scenario, mission.seed)
    except Exception as error:  # what goes wrong in one mission is told, and the others go on
        spent = time.perf_counter() - began
        text = f"{type(error).__name__}: {error}".rstrip(": ")
        _note_failure(batch, mission, text, traceback.format_exc())
        return Ran(mission, spent, error=text)
    return Ran(mission, time.perf_counter() - began, result.arrow)


def _check_parts(own_parts: Mapping[str, str]) -> None:
    for name, told in own_parts.items():
        if _source(name) != told:
            raise ValueError(f"{name}: its source has changed since the campaign began")


@cache
def _source(name: str) -> str:
    """Return the fingerprint of a part's file as this process found it, and goes on using it."""
    return source_sha256(name)


def _note_failure(batch: Batch, mission: Mission, error: str, trace: str) -> None:
    try:
        write_failure(batch, mission, error, trace)
    except OSError as reason:
        raise NotWritten(reason.errno, reason.strerror) from None


def write_failure(batch: Batch, mission: Mission, error: str, trace: str) -> None:
    """Write `failures/<mission_id>.json`: what happened, and the command that does it again."""
    folder, point = Path(batch.folder), batch.points[mission.point]
    name = mission_id(point.scenario, mission.seed, batch.model_version)
    (folder / "failures").mkdir(exist_ok=True)
    values = [f"--set {shlex.quote(f'{k}={as_written(v)}')}" for k, v in point.sets.items()]
    scenario = shlex.quote(str(folder / "scenario.yaml"))
    leave = leave_of(_scenario(point.scenario, folder)[0])
    write_json(
        folder / "failures" / f"{name}.json",
        {
            "mission_id": name,
            "mission": mission.number,
            "point": mission.point,
            "varied": point.varied,
            "seed": mission.seed,
            "error": error,
            "traceback": trace,
            "reproduce": " ".join(
                ["bindusbl-des run", scenario, *values, f"--seed {mission.seed}{leave}"]
            ),
        },
    )


def write(batch: Batch, found: Gathered) -> None:
    """Write the rows of missions as one part.

    Raises:
        NotWritten: when it cannot be written.
    """
    try:
        commit(Path(batch.folder), batch.part, found.tables(), batch.plan_sha256)
    except OSError as error:
        raise NotWritten(error.errno, error.strerror or str(error)) from None


def signal_name(exit_code: int | None) -> str:
    """Return what ended a process: the name of a signal, or an exit code."""
    if exit_code is None:
        return "an unknown cause"
    if exit_code < 0:
        return f"signal {-exit_code} ({signal.Signals(-exit_code).name})"
    return f"exit code {exit_code}"
