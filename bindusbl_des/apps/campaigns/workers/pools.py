"""Pools that run batches: processes of this machine, or a Dask cluster; and the progress line."""

import logging
import math
import os
import signal
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import parent_process, resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Lock
from time import monotonic
from typing import Any, TextIO

from ....support.process import ProgressLine, collect_seldom, duration
from ..storage.parts import FAILED
from .batches import Batch, Row, run_batch

# Libraries whose threads would slow the workers, which share the machine.
LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA")
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in LIBRARIES}

# Python's resource tracker need not warn when it cleans up after a killed parent.
QUIETLY = {"PYTHONWARNINGS": "ignore:resource_tracker:UserWarning"}


@contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for processes that begin in the block."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _ctrl_c_held_back() -> Iterator[None]:
    """Block Ctrl-C while a process starts, which would die of it before it ignores it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _script_hidden() -> Iterator[None]:
    """Hide the main script, so that one without `if __name__ == "__main__"` may start a sweep."""
    main = sys.modules["__main__"]
    hidden = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
    if "__file__" in hidden:
        del main.__file__
    main.__spec__ = None
    try:
        yield
    finally:
        for name, value in hidden.items():
            setattr(main, name, value)


class _Process(SpawnProcess):
    """A spawned process that does not run the user's script again."""

    @staticmethod
    def _Popen(process_obj: BaseProcess) -> Any:
        with environment(ONE_THREAD), _script_hidden(), _ctrl_c_held_back():
            return SpawnProcess._Popen(process_obj)


class Spawn(SpawnContext):
    """The way workers are started."""

    Process = _Process

    def Lock(self) -> Lock:
        """Return a lock between processes.

        Raises:
            OSError: naming the folder of semaphores, where that cannot be written.
        """
        try:
            return super().Lock()
        except OSError as error:
            why = f"{error.strerror}; workers have their semaphores there: make it writable"
            raise OSError(error.errno, why, "/dev/shm") from error


def begin_work() -> None:
    """Tie a worker to its parent, and import what missions need before the first batch."""
    go_with_parent()
    import_module("bindusbl_des.core.mission.mission")


def go_with_parent() -> None:
    """Ignore Ctrl-C in this process, and end it when its parent ends."""
    collect_seldom()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class Progress:
    """Counts missions, and shows the progress.

    The rate counts from the begin of the first mission, without the start of workers.
    """

    def __init__(self, total: int = 0, *, quiet: bool = True, stream: TextIO | None = None) -> None:
        self.total, self.ran, self.failed = total, 0, 0
        self._line = ProgressLine(quiet=quiet, stream=stream)
        self._began = math.inf

    def note(self, rows: Sequence[Row]) -> None:
        """Count the missions of a batch that has just ended."""
        self.ran += len(rows)
        self.failed += sum(row.status == FAILED for row in rows)
        self._began = min(self._began, monotonic() - sum(row.wall_time_s for row in rows))
        self._line.tell(self.line)

    def end(self) -> None:
        """End the progress line."""
        self._line.end(self.line)

    @property
    def rate(self) -> float:
        """Missions per second so far."""
        spent = monotonic() - self._began
        return self.ran / spent if spent > 0 else 0.0

    def line(self) -> str:
        """Return the text of the progress."""
        rate = self.rate
        left = f", {duration((self.total - self.ran) / rate)} left" if rate else ""
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.ran}/{self.total} missions{failed}, {rate:.1f}/s{left}"


REMEDY = 'Dask is not installed; install it with: python -m pip install "bindusbl-des[cluster]"'


# The longest time for a cluster's answer.
PATIENCE = "10s"


class BackendMissing(RuntimeError):
    """The backend asked for is not installed or cannot be reached."""


def _stand_by() -> None:
    """Do nothing, in a process that has imported what missions need."""


class LocalPool:
    """Processes of this machine, each in its own pool, so that a dying one affects no other."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._idle: list[ProcessPoolExecutor] = []
        self._busy: dict[Future[list[Row]], ProcessPoolExecutor] = {}
        self._processes: dict[ProcessPoolExecutor, BaseProcess] = {}
        with environment(QUIETLY):
            resource_tracker.ensure_running()

    def begin(self) -> None:
        """Start the workers, which import what missions need."""
        self._idle += [self._new() for _ in range(self.size)]

    def has_room(self) -> bool:
        """Tell whether a worker waits for a batch."""
        return len(self._busy) < self.size

    def submit(self, batch: Batch) -> "Future[list[Row]]":
        """Give a batch to a waiting worker, or to a new one."""
        pool = self._idle.pop() if self._idle else self._new()
        try:
            future = pool.submit(run_batch, batch)
        except BrokenProcessPool:  # it died while it waited
            self._dismiss(pool)
            pool = self._new()
            future = pool.submit(run_batch, batch)
        self._busy[future] = pool
        return future

    def _new(self) -> ProcessPoolExecutor:
        pool = ProcessPoolExecutor(1, mp_context=Spawn(), initializer=begin_work)
        pool.submit(_stand_by)  # which starts its process
        (self._processes[pool],) = pool._processes.values()
        return pool

    def _dismiss(self, pool: ProcessPoolExecutor) -> int | None:
        pool.shutdown(wait=True, cancel_futures=True)
        return self._processes.pop(pool).exitcode

    def end(self, future: "Future[list[Row]]") -> None:
        """End the worker of a batch, even one that is stopped."""
        self._processes[self._busy[future]].kill()

    def release(self, future: "Future[list[Row]]") -> int | None:
        """Take a worker back; if it died, drop it and return its exit code."""
        pool = self._busy.pop(future)
        if not isinstance(future.exception(), BrokenProcessPool):
            self._idle.append(pool)
            return None
        return self._dismiss(pool)

    def close(self) -> None:
        """End the workers at once: their rows are on the disk."""
        for process in self._processes.values():
            process.kill()
        for pool in list(self._processes):
            self._dismiss(pool)


class ClusterPool:
    """The workers of a Dask cluster."""

    def __init__(self, address: str) -> None:
        try:
            distributed: Any = import_module("distributed")
        except ImportError:
            raise BackendMissing(REMEDY) from None
        # A lost scheduler is reported below in one line, not by Dask with a traceback.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        try:
            self._client: Any = distributed.Client(address, timeout=PATIENCE)
            self._address = address
        except (OSError, ValueError) as error:
            raise BackendMissing(f"no Dask scheduler at {address}: {error}") from None
        # A batch that Dask sends again after a worker died is recognised by its part.
        self._executor: Executor = self._client.get_executor(pure=False, retries=0)
        self._running = 0

    def begin(self) -> None:
        """Do nothing, since the workers run already."""

    @property
    def size(self) -> int:
        """The number of threads in the cluster, which may grow."""
        return max(1, sum(map(int, self._client.nthreads().values())))

    def has_room(self) -> bool:
        """Tell whether a worker waits for a batch; one further batch may queue for each."""
        return self._running < 2 * self.size

    def submit(self, batch: Batch) -> "Future[list[Row]]":
        """Give a batch to the scheduler."""
        self._running += 1
        return self._executor.submit(run_batch, batch)

    def end(self, future: "Future[list[Row]]") -> None:
        """Do nothing: Dask gives batches of silent workers to others."""

    def release(self, future: "Future[list[Row]]") -> int | None:
        """Note that a batch has ended; Dask replaces its workers itself.

        Raises:
            BackendMissing: when the cluster has been lost.
        """
        self._running -= 1
        if future.cancelled():
            raise BackendMissing(
                f"the Dask scheduler at {self._address} is gone. What was written counts; start it "
                "again, then `bindusbl-des resume` the folder"
            )
        return None

    def close(self) -> None:
        """Disconnect from the cluster, which continues."""
        self._executor.shutdown(wait=False)
        self._client.close()


WorkerPool = LocalPool | ClusterPool


@contextmanager
def at_work(pool: WorkerPool) -> Iterator[WorkerPool]:
    """Start a pool for the block, and end it; at once if an error comes."""
    try:
        pool.begin()
        yield pool
    finally:
        pool.close()


def pool_for(backend: str, workers: int) -> WorkerPool:
    """Return the pool of a backend: `local` or ``dask:ADDRESS``.

    Raises:
        ValueError: when there is no such backend.
        BackendMissing: when it is not installed or cannot be reached.
    """
    kind, _, address = backend.partition(":")
    if backend == "local":
        return LocalPool(workers)
    if kind == "dask" and address:
        return ClusterPool(address)
    raise ValueError(
        f"no backend {backend!r}; write local, or dask:ADDRESS such as dask:tcp://10.0.0.1:8786"
    )
