"""A clock that is set while a campaign runs, back or by a day: it costs nothing but the rate."""

import os
import time
from pathlib import Path

import pytest
from campaigns_for_tests import OneThread, same
from commands_for_tests import call

from bindusbl_des import load_campaign, sweep
from bindusbl_des.campaigns import running
from bindusbl_des.campaigns.campaign import unfinished_campaign
from bindusbl_des.campaigns.storage.folder import locked
from bindusbl_des.campaigns.storage.parts import part_names, part_path
from bindusbl_des.campaigns.workers.batches import Batch, Row, run_batch

DAY_S = 86400.0
SEEDS = 12


class Killed(BaseException):
    """The parent is gone."""


@pytest.mark.parametrize(
    "jump_s",
    [
        *(-DAY_S, -1.0, 400 * DAY_S),
        *(pytest.param(it, marks=pytest.mark.slow) for it in (-10 * DAY_S, DAY_S)),
    ],
)
def test_a_clock_that_jumps_loses_nothing(
    jump_s: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Part after part is of another day; the parent is killed, and goes on; no rate is below zero.

    Files get the time that the clock has when they are written.
    """
    monkeypatch.chdir(tmp_path)
    Path("base.yaml").write_text("name: tiny\nduration_s: 2\n")
    began, jumps, left = time.time, [0], [3]
    monkeypatch.setattr(time, "time", lambda: began() + jumps[0] * jump_s)
    rates: list[float] = []

    def flown(batch: Batch) -> list[Row]:
        jumps[0] += 1
        rows = run_batch(batch)
        for path in Path("c").glob(f"*/part-{batch.part}.*"):
            os.utime(path, (time.time(), time.time()))
        state = unfinished_campaign("c").state()
        assert state.status == "running"
        rates.extend(it for it in (state.missions_per_s, state.seconds_left) if it is not None)
        return rows

    class Jumping(OneThread):
        def submit(self, batch: Batch):  # type: ignore[no-untyped-def]
            if not left[0]:
                raise Killed
            left[0] -= 1
            self._running += 1
            return self._executor.submit(flown, batch)

    monkeypatch.setattr(running, "pool_for", Jumping)
    with pytest.raises(Killed):
        sweep("base.yaml", "c", seeds=SEEDS)
    assert len(part_names(Path("c"))) == 3
    left[0] = 99
    assert call("status", "c").exit_code == 0
    resumed = call("resume", "c")
    assert resumed.exit_code == 0, resumed.stderr
    same(sweep("base.yaml", "undisturbed", seeds=SEEDS), load_campaign("c"))
    assert all(it >= 0 for it in rates)
    assert len(rates) > 0 or jump_s < 0


def test_rows_that_go_while_a_campaign_runs_make_no_rate_below_zero(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(running, "pool_for", OneThread)
    Path("base.yaml").write_text("name: tiny\nduration_s: 2\n")
    campaign = sweep("base.yaml", "c", seeds=SEEDS)
    session = {"began_at": 0.0, "rows_before": SEEDS + 5}
    campaign.record = {**campaign.record, "status": "running", "session": session}
    with locked(Path("c")):
        assert campaign.state().seconds_left is None
        part_path(Path("c"), "missions", "all-0001").unlink()
        assert campaign.state().seconds_left is None
