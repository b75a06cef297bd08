"""Who runs the batches: processes of this machine, each supervised by itself, or a Dask cluster."""

import logging
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any, Protocol

from .batches import Batch, Row, run_batch
from .processes import QUIETLY, Spawn, begin_work, environment

REMEDY = 'Dask is not installed; install it with: python -m pip install "bindusbl-des[cluster]"'


# How long a cluster may take to answer.
PATIENCE = "10s"


class BackendMissing(RuntimeError):
    """The backend asked for is not installed or cannot be reached."""


class WorkerPool(Protocol):
    """Workers to whom batches are given."""

    @property
    def size(self) -> int:
        """How many batches run at once."""

    def begin(self) -> None:
        """Start the workers: until batches are given they import what these need."""

    def has_room(self) -> bool:
        """Tell whether a worker waits for a batch."""

    def submit(self, batch: Batch) -> "Future[list[Row]]":
        """Give a batch to a worker."""

    def release(self, future: "Future[list[Row]]") -> int | None:
        """Take note that a batch has ended; return the exit code of a worker that died of it."""

    def close(self, *, now: bool) -> None:
        """Let the workers go; `now` ends them in the midst of their work."""


@contextmanager
def at_work(pool: WorkerPool) -> Iterator[WorkerPool]:
    """Have workers begin, and let them go; whoever leaves in haste ends them in their work."""
    try:
        pool.begin()
        yield pool
    except BaseException:
        pool.close(now=True)
        raise
    pool.close(now=False)


def _stand_by() -> None:
    """Do nothing: to come here the process has imported this module, and all that missions need."""


class LocalPool:
    """Processes of this machine, each in a pool of its own: if one dies, it dies alone."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._idle: list[ProcessPoolExecutor] = []
        self._busy: dict[Future[list[Row]], ProcessPoolExecutor] = {}
        self._processes: dict[ProcessPoolExecutor, list[BaseProcess]] = {}
        with environment(QUIETLY):
            resource_tracker.ensure_running()

    def begin(self) -> None:
        """Start the workers: until batches are given they import what these need."""
        for _ in range(self.size - len(self._processes)):
            pool = self._new()
            pool.submit(_stand_by)
            self._processes[pool] = _processes_of(pool)
            self._idle.append(pool)

    def has_room(self) -> bool:
        """Tell whether a worker waits for a batch."""
        return len(self._busy) < self.size

    def submit(self, batch: Batch) -> "Future[list[Row]]":
        """Give a batch to a waiting worker, or to a new one."""
        pool = self._idle.pop() if self._idle else self._new()
        try:
            future = pool.submit(run_batch, batch)
        except RuntimeError:  # it died while it waited
            self._dismiss(pool)
            pool = self._new()
            future = pool.submit(run_batch, batch)
        self._processes[pool] = _processes_of(pool)
        self._busy[future] = pool
        return future

    def _new(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, mp_context=Spawn(), initializer=begin_work)

    def _dismiss(self, pool: ProcessPoolExecutor) -> None:
        pool.shutdown(wait=True, cancel_futures=True)
        self._processes.pop(pool, None)

    def release(self, future: "Future[list[Row]]") -> int | None:
        """Take a worker back; one that died is let go, and its exit code returned."""
        pool = self._busy.pop(future)
        if not isinstance(future.exception(), RuntimeError):
            self._idle.append(pool)
            return None
        processes = self._processes.get(pool, [])
        self._dismiss(pool)
        return processes[0].exitcode if processes else None

    def pids(self) -> list[int]:
        """Return the process numbers of the workers."""
        return [p.pid for ps in self._processes.values() for p in ps if p.pid is not None]

    def close(self, *, now: bool) -> None:
        """Let the workers go."""
        pools = [*self._idle, *self._busy.values()]
        for pool in pools:
            for process in self._processes.get(pool, []) if now else []:
                process.kill()
        for pool in pools:
            pool.shutdown(wait=True, cancel_futures=True)


def _processes_of(pool: ProcessPoolExecutor) -> list[BaseProcess]:
    return list((getattr(pool, "_processes", None) or {}).values())


class ClusterPool:
    """The workers of a Dask cluster."""

    def __init__(self, address: str) -> None:
        try:
            distributed: Any = import_module("distributed")
        except ImportError:
            raise BackendMissing(REMEDY) from None
        # A scheduler that is lost is told in one line, below, and not by Dask with a traceback.
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
        """Leave the workers as they are: they have begun."""

    @property
    def size(self) -> int:
        """The number of threads in the cluster, which may grow."""
        return max(1, sum(map(int, self._client.nthreads().values())))

    def has_room(self) -> bool:
        """Tell whether a worker waits for a batch; one more each waits with it."""
        return self._running < 2 * self.size

    def submit(self, batch: Batch) -> "Future[list[Row]]":
        """Give a batch to the scheduler."""
        self._running += 1
        return self._executor.submit(run_batch, batch)

    def release(self, future: "Future[list[Row]]") -> int | None:
        """Take note that a batch has ended; Dask replaces its workers itself.

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

    def close(self, *, now: bool) -> None:
        """Leave the cluster, which goes on."""
        self._executor.shutdown(wait=not now)
        self._client.close()


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
