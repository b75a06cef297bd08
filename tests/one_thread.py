"""Campaigns run in the process of the test, without workers."""

from concurrent.futures import Future, ThreadPoolExecutor

from bindusbl_des.campaigns.workers.batches import Batch, Row, run_batch


class OneThread:
    """A crew of one thread of this process: no accident can happen to it, and it starts at once."""

    size = 1

    def __init__(self, *_: object) -> None:
        self._executor = ThreadPoolExecutor(1)
        self._running = 0

    def has_room(self) -> bool:
        return self._running == 0

    def submit(self, batch: Batch) -> "Future[list[Row]]":
        self._running += 1
        return self._executor.submit(run_batch, batch)

    def release(self, future: "Future[list[Row]]") -> int | None:
        self._running -= 1
        return None

    def close(self, *, now: bool) -> None:
        self._executor.shutdown()
