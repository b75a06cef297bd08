"""What a shell hands over: streams that are closed, pipes, variables that were never set."""

import json
import os
import subprocess
import sys
from pathlib import Path

import click
import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import COMMANDS, call

from bindusbl_des import load_result

TINY = "name: tiny\nduration_s: 5\nrecord: {detail: summary}\n"

pytestmark = pytest.mark.usefixtures("in_empty_folder")


def pipe(text: str) -> str:
    """Return the name of a pipe that holds a text, to be read once."""
    reader, writer = os.pipe()
    os.write(writer, text.encode())
    os.close(writer)
    return f"/dev/fd/{reader}"


def test_a_mission_needs_no_streams() -> None:
    """Started by a service that closes them, `run` leaves its results all the same."""
    Path("f.yaml").write_text(TINY)
    words = f"'{sys.executable}' -m bindusbl_des.cli run f.yaml --out o --no-advice"
    assert subprocess.run(f"{words} <&- >&- 2>&-", shell=True).returncode == 0
    assert load_result("o").seed == 0


def test_a_pipe_is_read_once() -> None:
    """Whoever reads a scenario from a pipe takes all of its text the first time."""
    assert call("validate", pipe(TINY)).exit_code == 0
    assert call("validate", pipe("scenario: quickstart\nseeds: 2\n")).exit_code == 0
    wrong = call("validate", pipe(f"{TINY}speed: 1\n"))
    assert (wrong.exit_code, "4:1: speed: unknown key" in wrong.stdout) == (2, True)
    told = call("sweep", pipe(TINY), "--set", "auvs.count=2", "--seeds", "3", "--dry-run")
    assert told.stdout.startswith("missions  3 (")


def test_a_plan_does_not_name_the_pipe_that_it_was_read_from(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is not there to be read again; the plan's folder has a copy of the scenario."""
    hand_made(monkeypatch, lambda asked, seed: [auv(0.5 + 0.01 * seed)] * asked.auvs.count)
    Path("f.yaml").write_text(TINY)
    words = ("--below", "position_error_m=1", "--vary", "asvs.count=1")
    sources = []
    for given, out in ((pipe(TINY), "a"), ("f.yaml", "b")):
        assert call("plan", given, *words, "--out", out).exit_code == 0
        sources.append(json.loads(Path(out, "plan.json").read_text())["scenario"])
    assert sources == ["a/missions/scenario.yaml", "f.yaml"]


@pytest.mark.parametrize(
    "words",
    [
        ("sweep", "quickstart"),
        ("plan", "quickstart", "--below", "position_error_m=1"),
        ("reproduce",),
    ],
)
@pytest.mark.parametrize("place", ["link", "link/below"])
def test_a_link_that_leads_nowhere_is_named(words: tuple[str, ...], place: str) -> None:
    """No folder can be made there; nothing is begun."""
    Path("link").symlink_to("nowhere")
    told = call(*words, "--out", place)
    assert told.exit_code == 2
    assert "link is a link that leads nowhere; name another" in told.stderr
    assert os.listdir() == ["link"]


OUT = sorted(name for name, it in COMMANDS.items() if any(p.name == "out" for p in it.params))


@pytest.mark.parametrize("name", OUT)
def test_an_empty_name_is_not_taken_for_none(name: str) -> None:
    """`--out "$WHERE"`, where WHERE was never set, must not write into a place by default."""
    taken = [it for it in COMMANDS[name].params if isinstance(it, click.Argument)]
    done = call(name, *("quickstart" for it in taken if it.required), "--out", "")
    assert done.exit_code == 2
    assert "'--out': is empty" in done.stderr
    assert not os.listdir()


def test_an_empty_name_of_a_file_is_shown() -> None:
    assert call("run", "").stderr.startswith("'': no such file")
