"""Five hundred missions with every accident in one campaign: the tables are as without."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from campaigns_for_tests import read_record, same
from commands_for_tests import call

from bindusbl_des import load_campaign, sweep

# A schedule that never works for seed 450, and meets each other accident once where asked to.
ACCIDENTS = """
import os, subprocess, sys, time

def _first(name):
    if "ACCIDENTS" not in os.environ:
        return False
    try:
        os.close(os.open(os.path.join(os.environ["ACCIDENTS"], name), os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return False
    return True

def schedule(view):
    seed = view.random.bit_generator.seed_seq.entropy
    if seed == 450:
        os.kill(os.getpid(), 9)
    if seed == 100 and _first("worker"):
        os.kill(os.getpid(), 9)
    if seed == 200 and _first("second"):
        words = [sys.executable, "-m", "bindusbl_des.cli", "resume", os.environ["FOLDER"]]
        told = subprocess.run(words, capture_output=True, text=True)
        with open(os.path.join(os.environ["ACCIDENTS"], "second"), "w") as file:
            file.write(f"{told.returncode} {told.stderr}")
    if seed == 300 and _first("parent"):
        while not os.path.getsize(os.path.join(os.environ["ACCIDENTS"], "second")):
            time.sleep(0.1)  # another worker's `resume` has not been answered yet
        os.kill(os.getppid(), 9)
    return [[auv] for auv in range(len(view.auvs))]
"""


def command(home: Path, *words: object, largest_file: int | None = None) -> "tuple[int, str]":
    """Run a command as a process of its own, where it may be killed; return exit code and talk."""

    def limit() -> None:
        if largest_file is not None:
            hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, hard))

    ran = subprocess.run(
        [sys.executable, "-m", "bindusbl_des.cli", *map(str, words)],
        env={
            **os.environ,
            "PYTHONPATH": f"{home}:{Path(__file__).parents[2]}",
            "ACCIDENTS": str(home),
            "FOLDER": str(home / "disturbed"),
        },
        preexec_fn=limit,
        capture_output=True,
        text=True,
    )
    return ran.returncode, ran.stderr


@pytest.mark.slow
def test_every_accident_in_one_campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker, the parent and a mission killed, a second process, a full disk: all is found."""
    (tmp_path / "perils.py").write_text(ACCIDENTS)
    scenario, folder = tmp_path / "short.yaml", tmp_path / "disturbed"
    scenario.write_text("name: short\nduration_s: 3\nprotocol: {schedule: 'perils:schedule'}\n")
    monkeypatch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
    monkeypatch.syspath_prepend(str(tmp_path))
    undisturbed = sweep(scenario, tmp_path / "undisturbed", seeds=500, workers=2)

    words = ("sweep", scenario, "--seeds", 500, "--workers", 2, "--out", folder)
    assert command(tmp_path, *words)[0] == -9  # by the mission with seed 300
    assert (tmp_path / "worker").exists()
    code, _, message = (tmp_path / "second").read_text().partition(" ")
    assert (code, "is running this campaign" in message) == ("2", True)
    rows = len(load_campaign(folder).done())
    assert 100 < rows < 500
    for largest_file in (1_000, 12_000):  # no room for the record; for the record, but no table
        ended, talk = command(tmp_path, "resume", folder, largest_file=largest_file)
        assert (ended, "results cannot be written" in talk) == (1, True), talk
    assert rows <= len(load_campaign(folder).done()) < 500

    again = call("resume", folder, "--workers", 2, "--json")
    assert again.exit_code == 3, again.stderr
    told = json.loads(again.stdout)
    assert {**told, "folder": ""} == {
        "folder": "", "name": "short", "status": "complete",
        "missions": 500, "done": 499, "failed": 1, "missing": 0, "findings": told["findings"],
    }  # fmt: skip
    same(undisturbed, load_campaign(folder))
    assert list(undisturbed.missions.query("status == 'failed'")["seed"]) == [450]
    assert read_record(folder)["status"] == "complete"
    assert sorted(path.name for path in folder.iterdir()) == [
        "auvs", "campaign.json", "checksums", "failures", "missions", "report.html",
        "scenario.yaml",
    ]  # fmt: skip
    assert len(list((folder / "failures").iterdir())) == 1
