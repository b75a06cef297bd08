"""A clock that is set while a campaign runs, back or by a day: it costs nothing but the rate."""

import fcntl
import os
import time
from pathlib import Path

import pytest
from campaigns_for_tests import (
    Killed,
    Singly,
    fly_with,
    parts,
    read_record,
    same,
    write_record,
)
from commands_for_tests import call

from bindusbl_des import CampaignState, load_campaign, resume, sweep

DAY_S = 86400.0
SEEDS = 6


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
    began, jumps = time.time, [0]
    monkeypatch.setattr(time, "time", lambda: began() + jumps[0] * jump_s)
    rates: list[float] = []
    dated: set[Path] = set()

    def jump(_: CampaignState) -> None:
        new = {*Path("c").glob("*/part-*")} - dated
        for path in new:
            os.utime(path, (time.time(), time.time()))
        dated.update(new)
        state = load_campaign("c").state()
        assert state.status == "running"
        rates.extend(it for it in (state.missions_per_s, state.seconds_left) if it is not None)
        jumps[0] += 1

    def killed(state: CampaignState) -> None:
        jump(state)
        if len(parts("c")) >= 3:
            raise Killed

    fly_with(monkeypatch, Singly)
    with pytest.raises(Killed):
        sweep("base.yaml", "c", seeds=SEEDS, progress=killed)
    assert 3 <= len(parts("c")) < SEEDS
    assert call("status", "c").exit_code == 0
    resume("c", progress=jump)
    same(sweep("base.yaml", "undisturbed", seeds=SEEDS), load_campaign("c"))
    assert all(it >= 0 for it in rates)
    assert len(rates) > 0 or jump_s < 0


@pytest.mark.usefixtures("in_this_process")
def test_rows_that_go_while_a_campaign_runs_make_no_rate_below_zero(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("base.yaml").write_text("name: tiny\nduration_s: 2\n")
    sweep("base.yaml", "c", seeds=SEEDS)
    session = {"began_at": 0.0, "rows_before": SEEDS + 5}
    write_record("c", {**read_record("c"), "status": "running", "session": session})
    with open("c/campaign.lock", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        campaign = load_campaign("c")
        assert campaign.state().seconds_left is None
        Path("c/missions/part-all-0001.parquet").unlink()
        assert campaign.state().seconds_left is None
