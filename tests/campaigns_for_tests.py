"""What tests of campaigns share: commands, campaigns without workers, tables that are equal."""

from concurrent.futures import Future, ThreadPoolExecutor

import pandas as pd
from click.testing import CliRunner, Result

from bindusbl_des.campaigns.campaign import Campaign
from bindusbl_des.campaigns.workers.batches import Batch, Row, run_batch
from bindusbl_des.cli import main


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


def call(*words: object) -> Result:
    """Run a command; an exception that is no exit is a failure of the test."""
    return CliRunner().invoke(main, [str(word) for word in words], catch_exceptions=False)


def same(one: Campaign, other: Campaign) -> None:
    """Check that two campaigns found the same, but for the time it took."""
    for name in ("missions", "auvs"):
        frames = [
            getattr(it, name).drop(columns="wall_time_s", errors="ignore") for it in (one, other)
        ]
        pd.testing.assert_frame_equal(*frames)
