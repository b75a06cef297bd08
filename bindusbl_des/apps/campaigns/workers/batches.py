"""Batches of missions, as workers run them.

A worker loads compiled code first, and writes on the disk which mission it runs (its heartbeat), so
that the supervisor knows the mission at which a worker died.
"""

import errno
import faulthandler
import json
import os
import shlex
import signal
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa

from ....core.mission.simulation import simulate
from ....core.results.columns import arrow
from ....core.results.schemas import schema
from ....core.scenario.scenario import Scenario
from ....core.scenario.sections.survey import SURVEY
from ....support.compiled import is_uncompiled, kept_in, warm_marker
from ....support.kept_files import check_kept, named_files, placed
from ....support.plugins import allow, source_sha256
from ....support.wording import LONGEST_ERROR, LONGEST_TRACE, shortened
from ..experiments.experiment import (
    ExperimentPlan,
    PlannedMission,
    PlannedPoint,
    as_written,
    mission_id,
    model_version,
)
from ..experiments.point_checks import without_plugins
from ..storage.folder import STOP, write_json
from ..storage.part_rows import labelled, read_part, varied_columns
from ..storage.parts import FAILED, MISSIONS, OK, commit, part_path

# The duration (s) of a warming mission: enough to receive a ping and compute its fix.
WARMING_S = 3.0

# The kinds of missions for which this process has its compiled code.
_ready: set[str] = set()


def compile_kernels(plan: ExperimentPlan, folder: Path) -> None:
    """Compile the code for all missions of a plan on the disk, unless it is there."""
    folder_of_code = None if is_uncompiled() else kept_in()
    if folder_of_code is not None and warm_marker(folder_of_code).exists():
        return
    for point in plan.points:
        warm(point.scenario, folder)


@lru_cache(maxsize=16)  # the seeds of a point follow one another
def warm(scenario: str, folder: Path) -> None:
    """Run the beginning of a mission, unless this process ran one of its kind.

    Its files lie in a folder.
    """
    data = placed(json.loads(scenario), folder)
    kind = json.dumps(_kind({**data, "name": "", "asvs": {**data["asvs"], "formation": None}}))
    if kind in _ready:
        return
    _ready.add(kind)
    data = without_plugins(data)  # which might do anything
    length = data["duration_s"]
    data["duration_s"] = WARMING_S if length == SURVEY else min(length, WARMING_S)
    data["protocol"]["schedule"] = "one_per_slot"
    with suppress(Exception):  # the mission itself reports what is wrong
        simulate(Scenario.model_validate(data), 0)


def _kind(data: Any) -> Any:
    """Return the features of a mission that decide which code it needs: all but sizes of numbers.

    >>> _kind({"gain": 0.9, "sd": 0, "failures": [], "models": ["otter", 2.0]})
    {'gain': True, 'sd': False, 'failures': [], 'models': ['otter', True]}
    """
    if isinstance(data, dict):
        return {key: _kind(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_kind(value) for value in data]
    return data if data is None or isinstance(data, str) else bool(data)


# Each mission's number overwrites the last one, so all have this width; aligned left while the
# worker loads code, and right while the mission's time runs.
WIDTH, LOADING, AT_MISSION = 20, "<", ">"


class Heartbeat:
    """The heartbeat file of one batch; it is removed when the batch has ended in order."""

    def __init__(self, folder: Path, part: str) -> None:
        """Begin a heartbeat.

        Raises:
            OSError: when it cannot be written.
        """
        self._path = _path(folder, part)
        self._path.parent.mkdir(exist_ok=True)
        self._path.unlink(missing_ok=True)  # of a worker that died; and no link is followed
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)

    def close(self) -> None:
        """Remove the heartbeat."""
        os.close(self._file)
        self._path.unlink(missing_ok=True)

    @contextmanager
    def at(self, mission: int, seconds: float | None) -> Iterator[None]:
        """Record that the worker runs a mission; end the process after `seconds`.

        A thread outside Python then writes the stack after the number.  A process has one such
        limit, so missions must not run in several threads.
        """
        side = LOADING if seconds is None else AT_MISSION
        os.lseek(self._file, 0, os.SEEK_SET)
        os.write(self._file, f"{mission:{side}{WIDTH - 1}}\n".encode())
        if seconds is None:
            yield
            return
        faulthandler.dump_traceback_later(seconds, exit=True, file=self._file)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def heartbeat_of(folder: Path, part: str) -> tuple[str, bool]:
    """Return a worker's last heartbeat (or ""), and whether a mission's time runs."""
    try:
        text = _path(folder, part).read_text(encoding="utf-8", errors="replace")[:WIDTH]
    except OSError:  # not yet, or no longer
        return "", False
    return text, text.startswith(" ")


def take_heartbeat(folder: Path, part: str) -> tuple[int | None, str]:
    """Return the mission at which a worker died, and its stack if it took too long.

    None if the worker had not begun, or if its machine lost the heartbeat.
    """
    path = _path(folder, part)
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return None, ""
    path.unlink(missing_ok=True)
    number = text[:WIDTH].strip()
    return (int(number), text[WIDTH:]) if number.isdigit() else (None, "")


def _path(folder: Path, part: str) -> Path:
    return folder / "missions" / f".at-{part}.tmp"  # a leftover is cleared away


@dataclass(frozen=True)
class Batch:
    """Missions for one worker, with all that it needs to run them and to write their rows.

    `plugins` are the plug-ins that the user allows.
    """

    folder: str
    part: str
    plan_sha256: str
    model_version: str
    columns: Mapping[str, str]
    points: Mapping[int, PlannedPoint]
    missions: tuple[PlannedMission, ...]
    budget_s: float
    mission_timeout_s: float | None = None
    plugins: tuple[str, ...] = ()
    own_parts: Mapping[str, str] = field(default_factory=dict)

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of its missions in the plan."""
        return tuple(mission.number for mission in self.missions)


@dataclass(frozen=True)
class Row:
    """The report on a mission: its number, whether it failed, and its wall time."""

    number: int
    status: str
    wall_time_s: float


# The most missions with separate tables: one of a single row takes a kilobyte for each column.
MOST_APART = 32
CELL_BYTES = 8


@dataclass
class Ran:
    """A finished mission: its tables, or the reason why there are none."""

    mission: PlannedMission
    wall_time_s: float
    tables: Mapping[str, pa.Table] = field(default_factory=dict)
    error: str | None = None


class Gathered:
    """The rows of a batch's missions, gathered into the tables of a part."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._apart: list[Ran] = []
        self._joined: dict[str, list[pa.Table]] = {}
        #: The approximate size (bytes) of the rows, since Arrow's own count is slow.
        self.nbytes = 0

    def add(self, ran: Ran) -> None:
        """Add the rows of one mission."""
        self._apart.append(ran)
        self.nbytes += sum(
            CELL_BYTES * table.num_rows * table.num_columns for table in ran.tables.values()
        )
        if len(self._apart) == MOST_APART:
            self._join()

    def tables(self) -> dict[str, pa.Table]:
        """Return the tables of all missions, each row with its mission."""
        self._join()
        return {name: pa.concat_tables(tables) for name, tables in self._joined.items()}

    def _join(self) -> None:
        ran, self._apart = self._apart, []
        if not ran:
            return
        names = dict.fromkeys(name for run in ran for name in run.tables if name != "mission")
        found = {name: self._table(name, ran) for name in names}
        for name, table in {**found, MISSIONS: self._missions(ran)}.items():
            self._joined.setdefault(name, []).append(table.combine_chunks())

    def _table(self, name: str, ran: Sequence[Ran]) -> pa.Table:
        lengths = [len(run.tables[name]) if name in run.tables else 0 for run in ran]
        owner = arrow([n for n, length in enumerate(lengths) for _ in range(length)], pa.int64())
        labels = self._labels(ran, with_point=name == "auvs")
        return labelled(
            pa.concat_tables([run.tables[name] for run in ran if name in run.tables]),
            {key: array.take(owner) for key, array in labels.items()},
        )

    def _missions(self, ran: Sequence[Ran]) -> pa.Table:
        described = schema("mission")
        nothing = pa.table([pa.nulls(1, field.type) for field in described], schema=described)
        labels = self._labels(ran, with_point=True)
        labels["status"] = arrow([FAILED if run.error else OK for run in ran], pa.string())
        labels["error"] = arrow([run.error for run in ran], pa.string())
        labels["wall_time_s"] = arrow([run.wall_time_s for run in ran], pa.float64())
        return labelled(
            pa.concat_tables([run.tables["mission"] if run.tables else nothing for run in ran]),
            labels,
        )

    def _labels(self, ran: Sequence[Ran], *, with_point: bool) -> dict[str, pa.Array]:
        """Return the columns that identify missions, with a value for each mission."""
        batch = self._batch
        points = [batch.points[run.mission.point] for run in ran]
        ids = [
            mission_id(point.scenario, run.mission.seed, batch.model_version)
            for run, point in zip(ran, points, strict=True)
        ]
        labels = {
            "mission": arrow([run.mission.number for run in ran], pa.int64()),
            "mission_id": arrow(ids, pa.string()),
            "seed": arrow([run.mission.seed for run in ran], pa.int64()),
        }
        if with_point:
            labels["point"] = arrow([run.mission.point for run in ran], pa.int64())
            labels |= varied_columns(batch.columns, [point.varied for point in points])
        return labels


# With `detail: full`, a part is written before its tables exceed this size (bytes).
LARGEST_PART_BYTES = 64_000_000


class NotWritten(OSError):
    """The rows of a batch could not be written; the campaign stops and can be resumed."""


@contextmanager
def as_not_written() -> Iterator[None]:
    """Raise NotWritten for any error of writing in the block."""
    try:
        yield
    except OSError as error:
        raise NotWritten(error.errno or errno.EIO, error.strerror or str(error)) from None


def run_batch(batch: Batch) -> list[Row]:
    """Run at least one mission, until the time budget ends or the campaign stops; write the rows.

    Raises:
        NotWritten: when the rows cannot be written, as on a full disk.
    """
    folder = Path(batch.folder)
    if part_path(folder, MISSIONS, batch.part).is_file():  # sent again by a cluster
        return rows_of(folder, batch.part)
    allow(batch.plugins)
    rows, found = [], Gathered(batch)
    with as_not_written():
        beating = Heartbeat(folder, batch.part)
    with closing(beating) as heartbeat:
        began = time.monotonic()
        for mission in batch.missions:
            with heartbeat.at(mission.number, None):  # loading is no mission's time
                warm(batch.points[mission.point].scenario, folder)
            with heartbeat.at(mission.number, batch.mission_timeout_s):
                ran = _run(batch, mission)
            found.add(ran)
            rows.append(Row(mission.number, FAILED if ran.error else OK, ran.wall_time_s))
            is_long = time.monotonic() - began > batch.budget_s
            if is_long or found.nbytes > LARGEST_PART_BYTES or (folder / STOP).exists():
                break
    write(batch, found)
    return rows


def rows_of(folder: Path, part: str) -> list[Row]:
    """Return the reports on a part's missions from the disk."""
    rows = read_part(folder, MISSIONS, part, ("mission", "status", "wall_time_s"))
    assert rows is not None
    return [Row(*row.values()) for row in rows.to_pylist()]


@lru_cache(maxsize=16)
def _scenario(text: str, folder: Path) -> tuple[Scenario, list[str]]:
    """Return a scenario with its files in a folder, and the names of these files."""
    data = json.loads(text)
    return Scenario.model_validate(placed(data, folder)), named_files(data)


def _run(batch: Batch, mission: PlannedMission) -> Ran:
    began = time.perf_counter()
    try:
        folder = Path(batch.folder)
        scenario, files = _scenario(batch.points[mission.point].scenario, folder)
        check_kept(files, folder)
        _check_code(batch)
        result = simulate(scenario, mission.seed)
    except Exception as error:  # report one mission's error; the others go on
        spent = time.perf_counter() - began
        text = shortened(f"{type(error).__name__}: {error}".rstrip(": "), LONGEST_ERROR)
        with as_not_written():
            write_failure(batch, mission, text, traceback.format_exc())
        return Ran(mission, spent, error=text)
    return Ran(mission, time.perf_counter() - began, result.arrow)


def _check_code(batch: Batch) -> None:
    """Refuse to run other code than the campaign began with."""
    if batch.model_version != model_version():
        raise ValueError(
            f"this worker has model {model_version()}; the campaign began with "
            f"{batch.model_version}"
        )
    for name, recorded in batch.own_parts.items():
        if _source(name) != recorded:
            raise ValueError(f"{name}: its source has changed since the campaign began")


@cache
def _source(name: str) -> str:
    """Return the fingerprint of a part's file as this process loaded it."""
    return source_sha256(name)


def write_failure(batch: Batch, mission: PlannedMission, error: str, trace: str) -> None:
    """Write `failures/<mission_id>.json`: the error, and the command that repeats it."""
    folder, point = Path(batch.folder), batch.points[mission.point]
    name = mission_id(point.scenario, mission.seed, batch.model_version)
    (folder / "failures").mkdir(exist_ok=True)
    values = [f"--set {shlex.quote(f'{k}={as_written(v)}')}" for k, v in point.sets.items()]
    scenario = shlex.quote(str(folder / "scenario.yaml"))
    leave = _scenario(point.scenario, folder)[0].leave
    write_json(
        folder / "failures" / f"{name}.json",
        {
            "mission_id": name,
            "mission": mission.number,
            "point": mission.point,
            "varied": point.varied,
            "seed": mission.seed,
            "error": error,
            "traceback": shortened(trace, LONGEST_TRACE),
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
    with as_not_written():
        commit(Path(batch.folder), batch.part, found.tables(), batch.plan_sha256)


def signal_name(exit_code: int | None) -> str:
    """Return what ended a process: the name or number of a signal, or an exit code."""
    if exit_code is None:
        return "an unknown cause"
    if exit_code >= 0:
        return f"exit code {exit_code}"
    with suppress(ValueError):  # signals of real time have none
        return f"signal {-exit_code} ({signal.Signals(-exit_code).name})"
    return f"signal {-exit_code}"
