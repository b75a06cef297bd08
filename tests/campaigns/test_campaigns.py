"""Campaigns: every mission once, whatever is killed, and the same tables for any worker count."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest
from campaigns_for_tests import (
    OneThread,
    cut_short,
    fly_with,
    parts,
    read_record,
    same,
    write_record,
)
from commands_for_tests import call

from bindusbl_des import Campaign, load_campaign, load_scenario, resume, simulate, sweep
from bindusbl_des.apps.campaigns.workers import batches, pools, supervisor
from bindusbl_des.apps.campaigns.workers.pools import Progress

BASE = "name: tiny\nduration_s: 5\n"
EXPERIMENT = "scenario: base.yaml\nvary: {asvs.count: [2, 3]}\nseeds: 8\n"

# Schedules of one's own that do to their process what accidents do to it.
ACCIDENTS = """
import os, signal, time

def _seed(view):
    return view.random.bit_generator.seed_seq.entropy

def slow(view):
    if view.round == 0:
        time.sleep(0.05)
    while _seed(view) == 29 and os.path.exists(os.path.join(os.path.dirname(__file__), "hold")):
        time.sleep(0.02)
    return [[auv] for auv in range(len(view.auvs))]

def poison(view):
    if _seed(view) == 3:
        os.kill(os.getpid(), 9)
    if _seed(view) == 5:
        os._exit(0)
    if _seed(view) == 7:
        os.kill(os.getpid(), 40)
    return [[auv] for auv in range(len(view.auvs))]

def endless(view):
    while _seed(view) == 3:
        time.sleep(0.1)
    return [[auv] for auv in range(len(view.auvs))]

def raising(view):
    if _seed(view) == 3:
        raise RuntimeError("seed 3 does not work")
    return [[auv] for auv in range(len(view.auvs))]

def loud(view):
    try:
        raise RuntimeError("no depth" * 2_500_000)
    except RuntimeError as error:
        raise ValueError(f"no mission: {error}") from error

def stopped(view):
    if _seed(view) == 3:
        os.kill(os.getpid(), signal.SIGSTOP)
    return [[auv] for auv in range(len(view.auvs))]
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the files of the experiments, in which modules are found."""
    folder = tmp_path_factory.mktemp("campaigns")
    (folder / "accidents.py").write_text(ACCIDENTS)
    (folder / "base.yaml").write_text(BASE)
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    for name in ("slow", "poison", "raising", "loud", "endless", "stopped"):
        text = f"{BASE}protocol: {{schedule: 'accidents:{name}'}}\n"
        (folder / f"{name}_base.yaml").write_text(text)
        text = EXPERIMENT.replace("base", f"{name}_base")
        (folder / f"{name}.yaml").write_text(text)
    for name in ("poison", "endless", "stopped"):
        text = (folder / f"{name}.yaml").read_text().replace("[2, 3]", "[2]")
        (folder / f"{name}.yaml").write_text(text)
    (folder / "slow.yaml").write_text(
        "scenario: slow_base.yaml\nvary: {asvs.count: [2, 3]}\nseeds: 30\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
        patch.syspath_prepend(str(folder))
        yield folder


@pytest.fixture
def at_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """Missions are run in this process."""
    fly_with(monkeypatch)


@pytest.fixture(scope="module")
def undisturbed(home: Path) -> Campaign:
    """The campaign of the slow missions that nothing happened to."""
    with pytest.MonkeyPatch.context() as patch:
        fly_with(patch)
        return sweep(home / "slow.yaml", home / "undisturbed")


@pytest.fixture
def experiment(home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The small experiment; the test runs in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return home / "experiment.yaml"


@pytest.fixture
def hold(home: Path, undisturbed: Campaign) -> Iterator[Path]:
    """A file: while it exists no campaign of slow missions ends, however long a test may take."""
    file = home / "hold"
    file.touch()
    yield file
    file.unlink(missing_ok=True)


def start(home: Path, *words: object, **options: object) -> "subprocess.Popen[str]":
    """Start the command line as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "bindusbl_des.cli", *map(str, words)],
        env={**os.environ, "PYTHONPATH": f"{home}:{Path(__file__).parents[2]}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,  # type: ignore[call-overload]
    )


def wait_for_part(folder: Path, seconds: float = 120.0) -> None:
    """Wait until a campaign has written something."""
    until = time.monotonic() + seconds
    while not list(folder.glob("missions/part-*.parquet")):
        assert time.monotonic() < until, "nothing was written"
        time.sleep(0.02)


def wait_for_mission(folder: Path, number: int, seconds: float = 120.0) -> None:
    """Wait until a worker is at a mission."""
    until = time.monotonic() + seconds
    while str(number) not in [it.read_text().strip() for it in folder.glob("missions/.at-*.tmp")]:
        assert time.monotonic() < until, f"mission {number} was never begun"
        time.sleep(0.02)


def wait_for_stop(parent: "subprocess.Popen[str]", folder: Path, seconds: float = 120.0) -> None:
    """Wait until a campaign has asked its workers to stop, or has ended because they did."""
    until = time.monotonic() + seconds
    while not (folder / "stop").exists() and parent.poll() is None:
        assert time.monotonic() < until, "nobody was asked to stop"
        time.sleep(0.02)


def test_tables_do_not_depend_on_the_number_of_workers(
    undisturbed: Campaign, home: Path, tmp_path: Path
) -> None:
    """One worker and two find the same, row for row."""
    two = sweep(home / "slow.yaml", tmp_path / "two", workers=2)
    same(undisturbed, two)
    assert list(two.missions["mission"]) == list(range(60))
    assert two.missions["mission_id"].is_unique
    assert list(two.missions["asvs.count"].unique()) == [2, 3]
    assert len(list((two.folder / "missions").iterdir())) == 1


def test_a_killed_worker_costs_nothing(
    undisturbed: Campaign, home: Path, hold: Path, tmp_path: Path
) -> None:
    """Its missions are run again, once."""

    def kill() -> None:
        wait_for_part(tmp_path / "killed")
        active_children()[0].kill()
        hold.unlink()

    killer = threading.Thread(target=kill)
    killer.start()
    same(undisturbed, sweep(home / "slow.yaml", tmp_path / "killed", workers=2))
    killer.join()


def test_a_killed_campaign_is_resumed(
    undisturbed: Campaign, home: Path, hold: Path, tmp_path: Path
) -> None:
    """Kill -9 of the parent loses no row and leaves no worker; a second process waits its turn."""
    folder = tmp_path / "killed"
    parent = start(home, "sweep", home / "slow.yaml", "--out", folder, "--workers", 1)
    wait_for_part(folder)
    second = call("resume", folder)
    assert (second.exit_code, second.stderr.count("is running this campaign")) == (2, 1)
    assert call("sweep", home / "slow.yaml", "--out", folder).exit_code == 2
    assert "running" in call("status", folder).stdout
    parent.kill()
    hold.unlink()
    parent.communicate()
    assert 0 < len(load_campaign(folder).missions) < 60
    (folder / "auvs" / ".part-x.parquet.tmp").write_text("half")
    assert "killed" in call("status", folder).stdout
    again = call("resume", folder, "--workers", 1, "--json")
    assert again.exit_code == 0, again.stderr
    assert json.loads(again.stdout)["done"] == 60
    same(undisturbed, load_campaign(folder))
    assert not list(folder.glob("**/*.tmp"))
    assert not (folder / "campaign.lock").exists()


@pytest.mark.slow
def test_a_campaign_that_was_stopped_for_a_while_goes_on(
    undisturbed: Campaign, home: Path, hold: Path, tmp_path: Path
) -> None:
    """Ctrl-Z, then `fg`: no mission is lost, though its limit ran out while it was stopped."""
    folder = tmp_path / "stopped"
    words = ("--out", folder, "--workers", 1, "--mission-timeout", 3)
    parent = start(home, "sweep", home / "slow.yaml", *words, start_new_session=True)
    wait_for_mission(folder, 29)
    os.killpg(parent.pid, signal.SIGSTOP)
    hold.unlink()
    time.sleep(3.1)
    assert "running" in call("status", folder).stdout
    parent.send_signal(signal.SIGCONT)  # first alone, with its worker still stopped
    time.sleep(0.3)
    parent.send_signal(signal.SIGSTOP)
    os.killpg(parent.pid, signal.SIGCONT)
    _, stderr = parent.communicate(timeout=120)
    assert parent.returncode == 0, stderr
    same(undisturbed, load_campaign(folder))


def test_ctrl_c_flushes_what_was_run(home: Path, hold: Path, tmp_path: Path) -> None:
    """The first Ctrl-C ends the campaign in order, with exit code 130."""
    folder = tmp_path / "interrupted"
    parent = start(home, "sweep", home / "slow.yaml", "--out", folder, "--workers", 1)
    wait_for_part(folder)
    parent.send_signal(signal.SIGINT)
    wait_for_stop(parent, folder)
    hold.unlink()
    _, stderr = parent.communicate(timeout=120)
    assert parent.returncode == 130, stderr
    assert "resume" in stderr
    assert read_record(folder)["status"] == "interrupted"
    assert 0 < len(load_campaign(folder).missions) < 60


def test_a_second_ctrl_c_ends_at_once(home: Path, tmp_path: Path) -> None:
    """A mission that never ends keeps nobody waiting; what was written counts, no worker stays."""
    folder = tmp_path / "twice"
    parent = start(home, "sweep", home / "endless.yaml", "--out", folder, "--workers", 1)
    wait_for_mission(folder, 3)
    parent.send_signal(signal.SIGINT)
    wait_for_stop(parent, folder)
    parent.send_signal(signal.SIGINT)
    _, stderr = parent.communicate(timeout=120)  # its pipes close when its workers have ended
    assert (parent.returncode, "Traceback" in stderr) == (130, False), stderr
    assert read_record(folder)["status"] == "interrupted"
    assert not list(folder.glob("**/*.tmp"))
    assert not (folder / "stop").exists()


def test_a_mission_that_never_ends_is_ended(home: Path, tmp_path: Path) -> None:
    """It is quarantined at its limit with the place where it hung; all others are done."""
    folder = tmp_path / "endless"
    words = ("--out", folder, "--workers", 2, "--mission-timeout", 3)
    result = call("sweep", home / "endless.yaml", *words)
    assert result.exit_code == 3, result.stderr
    missions = load_campaign(folder).missions
    failed = missions[missions["status"] == "failed"]
    assert list(failed["seed"]) == [3]
    assert list(failed["error"]) == ["took longer than 3 s; ended"]
    assert len(missions) == 8
    trace = json.loads(next((folder / "failures").iterdir()).read_text())["traceback"]
    assert trace.startswith("Timeout")
    assert "accidents.py" in trace
    assert not list(folder.glob("**/*.tmp"))


def test_a_worker_that_is_stopped_is_ended_by_its_parent(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SIGSTOP stops its own clock, too: its mission is quarantined, all others are done."""
    monkeypatch.setattr(supervisor, "GRACE_S", 0.5)
    folder = tmp_path / "stopped"
    words = ("--out", folder, "--workers", 2, "--mission-timeout", 1.5)
    result = call("sweep", home / "stopped.yaml", *words)
    assert result.exit_code == 3, result.stderr
    missions = load_campaign(folder).missions
    failed = missions[missions["status"] == "failed"]
    assert failed[["seed", "error"]].values.tolist() == [[3, "took longer than 1.5 s; ended"]]
    assert len(missions) == 8
    failure = json.loads(next((folder / "failures").iterdir()).read_text())
    assert failure["traceback"] == supervisor.STOPPED
    assert not list(folder.glob("**/*.tmp"))


def say_at(batch: Any, mission: int) -> None:
    """Leave what a worker leaves that died as it loaded what a mission needs."""
    path = Path(batch.folder) / "missions" / f".at-{batch.part}.tmp"
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"{mission:<19}\n")


@pytest.mark.parametrize("silent", ["before it begins", "as it loads"])
def test_a_worker_that_never_begins_a_mission_is_ended(
    silent: str, home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Time to start and to load is none of a mission's, but it is not endless: others take over."""
    ended: list[Future[Any]] = []

    class Deaf(OneThread):
        def submit(self, batch: Any) -> "Future[Any]":
            if ended:
                return super().submit(batch)
            monkeypatch.setattr(supervisor, "LOADING_S", 0.0)
            if silent == "as it loads":
                say_at(batch, batch.missions[0].number)
            self._running += 1
            return Future()

        def end(self, future: "Future[Any]") -> None:
            ended.append(future)
            monkeypatch.setattr(supervisor, "LOADING_S", 600.0)
            future.set_exception(BrokenProcessPool("ended"))

    fly_with(monkeypatch, Deaf)
    campaign = sweep(home / "experiment.yaml", tmp_path / "deaf", mission_timeout_s=2.0)
    assert len(ended) == 1
    assert len(campaign.missions) == 16
    assert set(campaign.missions["status"]) == {"ok"}


@pytest.mark.parametrize("seeds", [4, pytest.param(8, marks=pytest.mark.slow)])
def test_missions_that_kill_their_workers_are_quarantined(
    home: Path, tmp_path: Path, seeds: int
) -> None:
    """All others are done; a file each says how to see it again; the exit code is 3."""
    folder, workers = tmp_path / "poison", seeds // 4
    words = ("--seeds", seeds, "--workers", workers)
    result = call("sweep", home / "poison.yaml", "--out", folder, *words)
    assert result.exit_code == 3, result.stderr
    causes = {3: "signal 9 (SIGKILL)", 5: "exit code 0", 7: "signal 40"}
    killed = [seed for seed in causes if seed < seeds]
    missions = load_campaign(folder).missions
    assert missions.loc[missions["status"] != "ok", "seed"].tolist() == killed
    paths = (folder / "failures").iterdir()
    failures = {it["seed"]: it for it in (json.loads(path.read_text()) for path in paths)}
    assert {seed: failures[seed]["error"] for seed in sorted(failures)} == {
        seed: f"killed its worker 3 times: {causes[seed]}" for seed in killed
    }
    assert failures[3]["reproduce"] == (
        f"bindusbl-des run {folder}/scenario.yaml --set asvs.count=2 --seed 3 --allow-plugins"
    )


def frail(dies: Callable[[Any], bool]) -> type[OneThread]:
    """Return a pool whose workers die of some batches."""

    class Frail(OneThread):
        def submit(self, batch: Any) -> "Future[Any]":
            if not dies(batch):
                return super().submit(batch)
            self._running += 1
            dead: Future[Any] = Future()
            dead.set_exception(BrokenProcessPool())
            return dead

    return Frail


@pytest.mark.usefixtures("at_home")
def test_a_worker_that_dies_before_a_mission_begins_is_not_its_fault(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lone mission that five workers are given, which die as they start, is flown by the next."""
    deaths = iter(range(5))
    fly_with(monkeypatch, frail(lambda _: next(deaths, None) is not None))
    folder = tmp_path / "frail"
    assert call("sweep", home / "base.yaml", "--seeds", 1, "--out", folder).exit_code == 0
    assert load_campaign(folder).missions["status"].tolist() == ["ok"]


@pytest.mark.usefixtures("at_home")
def test_workers_that_die_in_a_row_end_a_campaign(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As they start, in its midst: no mission has failed of it, and all others can be resumed."""
    batches = iter(range(99))
    fly_with(monkeypatch, frail(lambda _: next(batches) > 0))
    folder = tmp_path / "frail"
    stopped = call("sweep", home / "base.yaml", "--seeds", 8, "--out", folder)
    assert (stopped.exit_code, "8 workers died in a row: " in stopped.stderr) == (1, True)
    assert load_campaign(folder).missions["status"].tolist() == ["ok"] * 4


@pytest.mark.usefixtures("at_home")
def test_workers_that_die_now_and_then_end_no_campaign(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two of three do, before their missions begin: more than eight, but never in a row."""
    batches = iter(range(99))
    fly_with(monkeypatch, frail(lambda _: next(batches) % 3 < 2))
    folder = tmp_path / "frail"
    assert call("sweep", home / "base.yaml", "--seeds", 24, "--out", folder).exit_code == 0
    assert next(batches) > 14
    assert set(load_campaign(folder).missions["status"]) == {"ok"}


@pytest.mark.usefixtures("at_home")
def test_missions_side_by_side_that_kill_their_workers_end_no_campaign(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three of them are nine workers in a row."""

    def kills(batch: Any) -> bool:
        numbers = [it.number for it in batch.missions if it.number in (4, 5, 6)]
        if numbers:
            say_at(batch, numbers[0])
        return bool(numbers)

    fly_with(monkeypatch, frail(kills))
    folder = tmp_path / "frail"
    assert call("sweep", home / "base.yaml", "--seeds", 8, "--out", folder).exit_code == 3
    failed = load_campaign(folder).missions.query("status == 'failed'")["seed"]
    assert failed.tolist() == [4, 5, 6]


@pytest.mark.usefixtures("at_home")
def test_a_mission_that_raises_is_a_failed_row(home: Path, tmp_path: Path) -> None:
    """Nothing is tried again until it is asked for."""
    folder = tmp_path / "raising"
    assert call("sweep", home / "raising.yaml", "--out", folder).exit_code == 3
    missions = load_campaign(folder).missions
    failed = missions[missions["status"] == "failed"]
    told = "'accidents:raising' raised RuntimeError in round 0: seed 3 does not work"
    line = ", at accidents.py:30"
    assert list(failed["error"]) == [f"PluginError: protocol.schedule: {told}{line}"] * 2
    assert failed["position_error_m"].isna().all()
    assert len(load_campaign(folder).auvs) == 14 * 3
    trace = json.loads(next((folder / "failures").iterdir()).read_text())["traceback"]
    assert "accidents.py" in trace
    assert call("resume", folder).exit_code == 3
    assert call("resume", folder, "--retry-failed", "--json").exit_code == 3
    assert len(load_campaign(folder).missions) == 16


@pytest.mark.usefixtures("at_home")
def test_what_an_error_says_is_kept_as_far_as_a_campaign_can_carry_it(
    experiment: Path, home: Path
) -> None:
    """An error of 20 MB, raised as another was handled, leaves a campaign that can be read."""
    assert call("sweep", home / "loud.yaml", "--seeds", 1, "--out", "broken").exit_code == 3
    told = load_campaign("broken").missions["error"]
    assert told.str.contains("ValueError in round 0: no mission: no depthno").all()
    assert told.str.len().max() <= 2000
    assert sum(path.stat().st_size for path in Path("broken").rglob("*")) < 1e6
    failure = json.loads(next(Path("broken/failures").iterdir()).read_text())
    assert failure["traceback"].startswith("Traceback")
    assert call("status", "broken").exit_code == 0


@pytest.mark.usefixtures("at_home")
def test_missions_of_other_code_are_not_mixed_in(
    experiment: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not by who goes on with a campaign, nor by a worker of another installation."""
    sweep(experiment, "edited", workers=1)
    record = read_record("edited")
    now = record["model_version"]
    write_record("edited", {**record, "model_version": f"{now[:-12]}{'0' * 12}"})
    refused = call("resume", "edited")
    assert refused.exit_code == 2
    assert refused.stderr.startswith(f"edited: began with model {now[:-12]}{'0' * 12}, this is ")
    assert refused.stderr.endswith("into another folder, or put its code back as it was\n")
    monkeypatch.setattr(batches, "model_version", lambda: "0.2.0/4+abc")
    mixed = sweep(experiment, "mixed", workers=1)
    told = f"ValueError: this worker has model 0.2.0/4+abc; the campaign began with {now}"
    assert set(mixed.missions["error"]) == {told}


@pytest.mark.usefixtures("at_home")
def test_shards_and_their_merger_equal_the_whole(experiment: Path, tmp_path: Path) -> None:
    """Two shards joined are the campaign; one alone is part of it; another's is refused."""
    whole = sweep(experiment, tmp_path / "whole", workers=1)
    for shard in ("1/2", "2/2"):
        assert call("sweep", experiment, "--shard", shard, "--out", f"s{shard[0]}").exit_code == 0
    assert call("merge", "s1", "s2", "--out", "joined").exit_code == 0
    same(whole, load_campaign("joined"))
    half = call("merge", "s1", "--out", "half")
    assert (half.exit_code, "8 missions are in none of them" in half.stderr) == (0, True)
    assert call("sweep", experiment, "--seeds", 1, "--out", "s3").exit_code == 0
    refused = call("merge", "s1", "s3", "--out", "other")
    assert refused.exit_code == 2
    assert refused.stderr == "s3 is not of the same campaign as s1: missions is 2, not 16\n"
    assert not Path("other").exists()


@pytest.mark.usefixtures("at_home")
def test_resume_refuses_another_model(experiment: Path) -> None:
    """Missions of two models are not mixed; the message shows both."""
    sweep(experiment, "old", workers=1)
    record = read_record("old")
    write_record("old", {**record, "model_version": "0.0.1/0"})
    refused = call("resume", "old")
    assert refused.exit_code == 2
    assert refused.stderr.startswith("old: began with model 0.0.1/0, this is model ")
    record["experiment"]["scenario_as_given"]["duration_s"] = 6
    write_record("old", record)
    assert "was edited" in call("resume", "old").stderr


@pytest.mark.usefixtures("at_home")
def test_a_campaign_keeps_the_defaults_that_it_ran_with(home: Path, tmp_path: Path) -> None:
    """Points of a campaign from before another default are told as they were flown."""
    path = home / "filters.yaml"
    path.write_text(
        "scenario: base.yaml\npoints: [{asvs.count: 2}, {navigation.filter: dead_reckoning}]\n"
    )
    now = sweep(path, tmp_path / "then", workers=1)
    record = read_record(now.folder)
    record["scenario"]["navigation"]["filter"] = "fixed_gain"
    write_record(now.folder, record)
    old = load_campaign(now.folder)
    filters = [[it.varied["navigation.filter"] for it in c.plan.points] for c in (now, old)]
    assert filters == [["kalman", "dead_reckoning"], ["fixed_gain", "dead_reckoning"]]
    assert old.plan.experiment.given == {
        **now.plan.experiment.given, "navigation": {"filter": "fixed_gain"}
    }  # fmt: skip


@pytest.mark.usefixtures("at_home")
def test_full_detail_keeps_the_events(home: Path, tmp_path: Path) -> None:
    """Event tables say of which mission each row is; a mission equals the same one run alone."""
    path = home / "full.yaml"
    path.write_text(EXPERIMENT.replace("seeds: 8", "seeds: [5]\ndetail: full"))
    campaign = sweep(path, tmp_path / "full", workers=1)
    pings = pd.read_parquet(campaign.folder / "pings")
    assert sorted(pings["mission"].unique()) == [0, 1]
    alone = simulate(load_scenario(home / "base.yaml", overrides=["asvs.count=2"]), seed=5)
    assert len(alone.tables["pings"]) == (pings["mission"] == 0).sum()
    assert alone.mission["position_error_m"][0] == campaign.missions["position_error_m"][0]


def test_a_dry_run_writes_nothing(experiment: Path, tmp_path: Path) -> None:
    """It tells missions, time and disk."""
    told = call("sweep", experiment, "--dry-run")
    assert told.exit_code == 0
    assert told.stdout.splitlines()[0] == "missions  16 (2 points x 8 seeds)"
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("at_home")
def test_an_estimate_is_of_short_points_and_long_ones(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Disk is told within a factor of 2, whatever the version of pyarrow; a mission takes as long
    here as it lasts.
    """

    def timed(batch: Any) -> list[Any]:
        (point,) = batch.points.values()
        length = float(json.loads(point.scenario)["duration_s"])
        return [replace(row, wall_time_s=length) for row in run_batch(batch)]

    run_batch = supervisor.run_batch
    monkeypatch.setattr(supervisor, "run_batch", timed)
    vary, folder = {"duration_s": [5, 200]}, tmp_path / "flown"
    flown = sweep(home / "base.yaml", folder, vary=vary, seeds=2, detail="full", workers=1)
    cost = supervisor.estimated(flown.plan, 4, 1)
    assert cost.seconds == supervisor.START_S + 2 * 205
    taken = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    assert taken / 2 < cost.bytes < 2 * taken


@pytest.mark.usefixtures("at_home")
def test_a_full_disk_stops_the_campaign(experiment: Path) -> None:
    """The message says what to do, nothing half written stays, and `resume` finishes."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (12_000, limits[1]))  # campaign.json fits, no table
    try:
        stopped = call("sweep", experiment, "--out", "full")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert stopped.exit_code == 1
    assert stopped.stderr.startswith("stopped, because results cannot be written: File too large")
    assert not list(Path("full").glob("**/*.tmp"))
    assert read_record("full")["status"].startswith("stopped")
    assert call("resume", "full").exit_code == 0
    assert len(load_campaign("full").missions) == 16


@pytest.mark.usefixtures("at_home")
def test_a_folder_that_got_no_record_is_empty_again(experiment: Path) -> None:
    """A disk that is full before anything counts leaves a folder that can be swept into."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_000, limits[1]))  # campaign.json does not fit
    try:
        stopped = call("sweep", experiment, "--out", "full")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert stopped.exit_code == 1
    assert (
        stopped.stderr == "full: File too large; nothing was kept: free some space, run it again\n"
    )
    assert {path.name for path in Path("full").iterdir()} <= {"campaign.lock"}
    assert call("sweep", experiment, "--out", "full").exit_code == 0


@pytest.mark.usefixtures("at_home")
def test_parts_are_counted_once(experiment: Path) -> None:
    """What a killed process left beside the rows that count changes nothing."""
    folder = cut_short(experiment, "c", after=12)
    first, *others = parts(folder)
    assert others
    orphan = folder / "auvs" / "part-00000009-0123abcd.parquet"
    orphan.write_bytes((folder / "auvs" / f"part-{first}.parquet").read_bytes())
    kept = (folder / "missions" / f"part-{first}.parquet").read_bytes()
    whole = resume(folder)
    assert (orphan.exists(), parts(folder)) == (False, ["all-0001"])
    (folder / "missions" / f"part-{first}.parquet").write_bytes(kept)  # killed before it was gone
    same(whole, load_campaign(folder))
    assert len(whole.missions) == 16


@pytest.mark.usefixtures("at_home")
def test_the_lock_of_another_machine_is_believed(experiment: Path) -> None:
    """Whether its process is still there cannot be seen; the message says what to delete."""
    sweep(experiment, "c", seeds=1)
    Path("c/campaign.lock").write_text(json.dumps({"pid": 1, "host": "elsewhere"}))
    told = call("resume", "c")
    assert told.exit_code == 2
    assert re.search("process 1 on elsewhere.*delete c/campaign.lock", told.stderr)


def test_progress_leaves_out_how_workers_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten seconds until workers run do not slow down the missions that are left."""

    def row(status: str, wall_time_s: float) -> Any:
        return SimpleNamespace(status=status, wall_time_s=wall_time_s)

    now = 100.0
    monkeypatch.setattr(pools, "monotonic", lambda: now)
    progress = Progress(202)
    assert progress.line() == "0/202 missions, 0.0/s"
    now += 10.0  # workers are started and load compiled code
    now += 0.5
    progress.note([row("ok", 0.25), row("failed", 0.25)])
    assert progress.line() == "2/202 missions, 1 failed, 4.0/s, 50 s left"
    now += 0.1  # another worker began a little earlier
    progress.note([row("ok", 0.7)])
    assert progress.line() == "3/202 missions, 1 failed, 4.3/s, 46 s left"


@pytest.mark.usefixtures("at_home")
def test_status_leaves_out_how_workers_start(experiment: Path) -> None:
    """The rate of a campaign that runs counts from its first mission of this session."""
    folder = cut_short(experiment, "rate", after=9)
    files = sorted(folder.glob("missions/part-*"), key=lambda it: it.stat().st_mtime)[:2]
    rows = [pq.read_table(file)["wall_time_s"].to_pylist() for file in files]
    assert len(files) == len(parts(folder)) == 2
    for file, at in zip(files, (1020.0 + sum(rows[0]), 1030.0), strict=True):
        os.utime(file, (at, at))

    def rate(status: str, began_at: float, rows_before: int) -> float | None:
        session = {"began_at": began_at, "rows_before": rows_before}
        write_record(folder, {**read_record(folder), "status": status, "session": session})
        return load_campaign(folder).state().missions_per_s

    ran = [len(it) for it in rows]
    assert rate("running", 1000.0, 0) == pytest.approx(sum(ran) / 10.0, rel=1e-5)
    own = ran[1] / min(sum(rows[1]), 5.0)  # the first part is of an earlier session
    assert rate("running", 1025.0, ran[0]) == pytest.approx(own, rel=1e-5)
    assert rate("interrupted", 1025.0, ran[0]) is None


@pytest.mark.usefixtures("at_home")
def test_sampled_points_fill_their_ranges(home: Path) -> None:
    """Whole numbers stay whole, and the same seed gives the same points."""
    pytest.importorskip("scipy")
    path = home / "sampled.yaml"
    path.write_text(
        "scenario: base.yaml\nsample: {method: sobol, points: 16, ranges: "
        "{asvs.count: [1, 4], asvs.formation.angle_deg: [0, 120]}}\n"
    )
    points, again = (sweep(path).experiment.points for _ in range(2))
    assert points == again
    assert [sorted(p["asvs.count"] for p in points).count(n) for n in (1, 2, 3, 4)] == [4] * 4
    assert all(0 <= p["asvs.formation.angle_deg"] <= 120 for p in points)


def test_a_missing_cluster_package_is_named(
    experiment: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The message has the line to install it, and nothing is left."""
    monkeypatch.setattr(pools, "PATIENCE", "1s")
    told = call("sweep", experiment, "--backend", "dask:tcp://127.0.0.1:1")
    assert told.exit_code == 1
    assert not Path("results").exists()
    assert call("sweep", experiment, "--backend", "slurm").exit_code == 2


HEAD = "scenario: base.yaml\n"

# What follows the file's name in each message.
WRONG = {
    "empty": ("", ["1:1: the file is empty; an experiment needs at least `scenario: FILE.yaml`"]),
    "list": ("- 1\n", ["1:1: must hold keys such as `scenario: FILE.yaml`; it holds a list"]),
    "no scenario": (
        "seeds: 3\n",
        ["1:1: scenario: missing; add it, such as `scenario: my_mission.yaml`"],
    ),
    "no such scenario": (
        "scenario: bse.yaml\n",
        ["1:11: scenario: no such file: bse.yaml; scenarios are sought beside the experiment file"],
    ),
    "scenario is a number": ("scenario: 5\n", ["1:11: scenario: needs the name of a file; got 5"]),
    "misspelt key": (HEAD + "seed: 3\n", ["2:1: seed: unknown key; did you mean 'seeds'?"]),
    "key of a scenario": (
        HEAD + "asvs: {count: 3}\n",
        ["2:1: asvs: unknown key; a scenario's keys go under vary, as in `vary: {asvs: [...]}`"],
    ),
    "two ways": (
        HEAD + "vary: {asvs.count: [2]}\npoints: [{asvs.count: 2}]\n",
        ["3:1: points: cannot be combined with vary; keep one of them"],
    ),
    "vary is a list": (
        HEAD + "vary: [2]\n",
        ["2:7: vary: needs dotted keys with lists of values; got a list"],
    ),
    "value for list": (
        HEAD + "vary: {asvs.count: 2}\n",
        ["2:20: vary.asvs.count: needs a list of values or a range, such as [1, 2] or 2:5; got 2"],
    ),
    "empty values": (
        HEAD + "vary: {asvs.count: []}\n",
        ["2:20: vary.asvs.count: is an empty list; give at least one value"],
    ),
    "unknown varied keys, wrong values and more at once": (
        HEAD + "seeds: 0\nvary:\n  asvs.cuont: [2, 3]\n  acoustics.hf.range_m: [50, -1, x]\n  "
        "protocol.schedule: [dsatur, 'no where:x']\ndetail: ful\n",
        [
            "2:8: seeds: must be >= 1 and <= 5000000, the number of seeds; got 0",
            "4:3: asvs.cuont: unknown key; did you mean 'count'?",
            "5:30: acoustics.hf.range_m: must be >= 0.1 and <= 100000 m; got -1",
            "5:34: acoustics.hf.range_m: needs a number (>= 0.1 and <= 100000 m); got the text 'x'",
            "6:31: protocol.schedule: 'no where:x' is no schedule (one of spatial_reuse, dsatur, "
            "one_per_slot, round_robin, random, worst_first, polling, super_tdma, aloha, "
            "slotted_aloha, csma, or your own as module:object)",
            "7:9: detail: must be one of summary, full; got the text 'ful'; did you mean 'full'?",
        ],
    ),
    "contradiction": (
        HEAD + "vary:\n  auvs.count: [1, 2]\n  auvs.route.kind: [hold]\n  "
        "auvs.route.positions_m: [[[0, 0], [9, 9]]]\n",
        [
            "5:28: auvs.route.positions_m: needs one [x, y] per AUV: 1 expected, 2 given "
            '(with auvs.count=1, auvs.route.kind="hold", auvs.route.positions_m=[[0, 0], [9, '
            "9]])"
        ],
    ),
    "no seeds": (
        HEAD + "seeds: []\n",
        ["2:8: seeds: is an empty list; give a number of seeds or name some"],
    ),
    "seeds": (
        HEAD + "seeds: [1, 1, -2, x]\n",
        [
            "2:12: seeds.1: seed 1 is given twice; keep one",
            "2:15: seeds.2: a seed is a whole number >= 0; got -2",
            "2:19: seeds.3: a seed is a whole number >= 0; got the text 'x'",
        ],
    ),
    "seed text": (
        HEAD + "seeds: many\n",
        ["2:8: seeds: needs a whole number or a list of seeds; got the text 'many'"],
    ),
    "detail of the record": (
        HEAD + "vary: {record.detail: [full]}\n",
        ["2:24: record.detail: belongs to the experiment: write `detail: full` at the top level"],
    ),
    "points": (
        HEAD + "points: [3]\n",
        ["2:10: points.0: a point needs {dotted.key: value, ...}; got 3"],
    ),
    "no points": (
        HEAD + "points: []\n",
        ["2:9: points: needs a list of points, {key: value, ...} each; got an empty list"],
    ),
    "same points": (
        HEAD + "points: [{asvs.count: 2}, {asvs.count: 2}]\n",
        ["2:40: asvs.count: point 1 is the same scenario as point 0; keep one"],
    ),
    "too many": (
        HEAD + "seeds: 5000000\nvary: {asvs.count: [2, 3]}\n",
        ["2:8: seeds: makes 10,000,000 missions; at most 5,000,000 can run"],
    ),
    "sample": (
        HEAD + "sample: {method: hls, points: 0, seed: x, range: {}}\n",
        [
            "2:9: sample: needs ranges: {dotted.key: [low, high], ...}; got nothing",
            "2:18: sample.method: must be one of lhs, sobol; got the text 'hls'; did you "
            "mean 'lhs'?",
            "2:31: sample.points: needs a whole number (>= 1 and <= 1000000); got 0",
            "2:40: sample.seed: needs a whole number >= 0; got the text 'x'",
            "2:43: sample.range: unknown key; did you mean 'ranges'?",
        ],
    ),
    "sobol": (
        HEAD + "sample: {method: sobol, points: 100, ranges: {auvs.speed_m_per_s: [2, 1]}}\n",
        [
            "2:33: sample.points: Sobol' points come in powers of two; write 64 or 128, not 100",
            "2:67: sample.ranges.auvs.speed_m_per_s: needs [low, high] with low < high; got [2, 1]",
        ],
    ),
    "sampled out of range": (
        HEAD + "sample: {points: 2, ranges: {asvs.cuont: [1, 3]}}\n",
        ["2:30: asvs.cuont: unknown key; did you mean 'count'?"],
    ),
    "space": (
        HEAD + "vary: {asvs.count: [2], ' survey.side_m': [100, 140]}\n",
        ["2:25:  survey.side_m: has a space before or behind it: write 'survey.side_m'"],
    ),
    "alias": (
        HEAD + "vary: {asvs.count: &a [2]}\n",
        ["2:20: vary.asvs.count: anchor &a is not allowed; remove it"],
    ),
    "twice": (
        HEAD + "seeds: 3\nseeds: 4\n",
        ["3:1: seeds: given twice, first in line 2; keep one"],
    ),
    "name": (
        HEAD + "name: ''\n",
        ["2:7: name: needs a text of 1 to 100 characters; got the text ''"],
    ),
    "keys of a section": (
        HEAD + "vary: {asvs.count.x: [2]}\n",
        ["2:23: asvs.count: needs a whole number (>= 0 and <= 10000); got keys and values"],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_experiments_get_their_messages(name: str, experiment: Path, tmp_path: Path) -> None:
    """Every mistake is told with its place, exit code 2, and nothing is left."""
    text, messages = WRONG[name]
    Path("base.yaml").write_text(BASE)
    Path("wrong.yaml").write_text(text)
    told = call("sweep", "wrong.yaml")
    assert told.stderr.splitlines() == [f"wrong.yaml:{message}" for message in messages]
    assert told.exit_code == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["base.yaml", "wrong.yaml"]


def test_validate_knows_experiments(experiment: Path) -> None:
    """`validate` tells them from scenarios by their key `scenario`; `schema` describes both."""
    assert call("validate", experiment).stdout == f"{experiment}: ok\n"
    Path("base.yaml").write_text(BASE)
    Path("wrong.yaml").write_text(HEAD + "seed: 3\n")
    told = call("validate", "wrong.yaml")
    assert told.stdout == "wrong.yaml:2:1: seed: unknown key; did you mean 'seeds'?\n"
    keys = json.loads(call("schema", "experiment").stdout)["properties"]
    assert {"scenario", "vary", "points", "sample", "seeds", "detail", "until_ci"} <= {*keys}


def test_workers_do_without_pandas(home: Path, tmp_path: Path) -> None:
    """Missions are flown and their rows written by a process that never loads pandas."""
    (home / "loaded.py").write_text(
        "import sys\n"
        "def slots(view):\n"
        "    if 'pandas' in sys.modules:\n"
        "        raise RuntimeError('pandas was loaded')\n"
        "    return [[auv] for auv in range(len(view.auvs))]\n"
    )
    (home / "loaded.yaml").write_text(f"{BASE}protocol: {{schedule: 'loaded:slots'}}\n")
    words = ("--seeds", 2, "--workers", 1, "--out", tmp_path / "c")
    ran = start(home, "sweep", home / "loaded.yaml", *words, "--allow-plugins")
    _, stderr = ran.communicate(timeout=120)
    assert ran.returncode == 0, stderr
    assert load_campaign(tmp_path / "c").missions["status"].tolist() == ["ok"] * 2


@pytest.mark.usefixtures("at_home")
@pytest.mark.parametrize("words", [("status",), ("report",), ("resume",), ("compare",)])
def test_a_folder_that_may_not_be_read_is_not_taken_for_an_empty_one(
    experiment: Path, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is named, not rows that are lost; nothing is run again (root may read all)."""
    assert call("sweep", experiment, "--out", "c").exit_code == 0
    listed = Path.iterdir

    def iterdir(path: Path) -> object:
        if path.name == "missions":
            raise PermissionError(13, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(Path, "iterdir", iterdir)
    found = call(*words, "c")
    assert found.exit_code == 2
    assert found.stderr.startswith("c/missions cannot be read (Permission denied); ask its owner")
