"""On a machine that has compiled nothing a second process compiles what a mission needs late."""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest
from worlds import scenario

from bindusbl_des import load_scenario
from bindusbl_des.campaigns.workers import helping
from bindusbl_des.campaigns.workers.helping import Helper
from bindusbl_des.commands.console import compiling_told
from bindusbl_des.core import compiled, plugins
from bindusbl_des.mission import mission
from bindusbl_des.preflight import machine

PACKAGE = Path(__file__).parents[2]

HULL = {"vehicle": "bluerov2", "speed_m_per_s": 0.6}
SCENARIOS = sorted(Path(__file__, "../../../scenarios").resolve().glob("*.yaml"))


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_shipped_missions_can_be_rehearsed(path: Path) -> None:
    helping.rehearse(load_scenario(path))


@pytest.mark.parametrize(
    "changes",
    [
        {"auvs": {**HULL, "feedback": "estimate"}, "asvs": {"vehicle": "otter"}},
        {"navigation": {"filter": "smoother"}, "usbl": {"misalignment_sd_deg": 1.0}},
        {"protocol": {"ranging": "passive"}},
        {"protocol": {"ranging": "twtt", "schedule": "polling"}},
        {"record": {"detail": "summary"}},
    ],
)
def test_missions_of_all_kinds_can_be_rehearsed(changes: dict[str, Any]) -> None:
    helping.rehearse(scenario(**changes))


def test_a_rehearsal_has_neither_hulls_nor_code_of_strangers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "strangers.py").write_text("def order(view): return [[0], [1], [2]]\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(plugins, "_admitted", set())
    file = tmp_path / "mission.yaml"
    file.write_text(
        "name: mine\nauvs: {vehicle: bluerov2, speed_m_per_s: 0.6}\nasvs: {vehicle: otter}\n"
        "protocol: {schedule: 'strangers:order'}\n"
    )
    rehearsed = []
    flown = mission.Mission
    monkeypatch.setattr(mission, "Mission", lambda it: rehearsed.append(it) or flown(it))
    helping.rehearse(load_scenario(file, allow_plugins=True))
    (it,) = rehearsed
    assert it.duration_s == helping.SHORT_S
    assert (str(it.auvs.vehicle), str(it.asvs.vehicle)) == ("kinematic", "moored")
    assert not plugins.is_plugin(str(it.protocol.schedule))


@pytest.fixture
def idle_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(helping, "idle_cores", lambda: 1.0)


class Counted(Helper):
    """A helper that begins no process, and has made so many functions."""

    began = ended = 0

    @property
    def made(self) -> int:
        return 30

    def begin(self) -> None:
        self.began += 1

    def end(self) -> None:
        self.ended += 1


def test_the_first_function_calls_the_helper_once() -> None:
    helper = Counted(scenario())
    with compiling_told(None, helper):
        assert helper.began == 0
        tell = compiled._WATCH.tell
        assert tell is not None
        for made in range(3):
            tell(compiled._WATCH.functions + made, compiled.compiling_s())
        assert (helper.began, helper.ended) == (1, 0)
    assert (helper.began, helper.ended) == (1, 1)


@pytest.mark.usefixtures("idle_core")
def test_a_helper_is_gone_after_the_mission() -> None:
    helper = Helper(scenario())
    helper.begin()
    process = helper._process
    assert process.is_alive()
    helper.end()
    assert not process.is_alive()


@pytest.mark.slow
def test_a_helper_goes_with_its_parent(tmp_path: Path) -> None:
    """A parent that is killed leaves nobody behind."""
    program = f"""
        import os, signal, sys
        sys.path[:0] = [{str(PACKAGE)!r}]
        from bindusbl_des import Scenario
        from bindusbl_des.campaigns.workers import helping
        from bindusbl_des.vehicles import motion  # whose code is kept somewhere
        helping.idle_cores = lambda: 1.0
        helper = helping.Helper(Scenario(name="left"))
        helper.begin()
        print(helper._process.pid, flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    parent = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        capture_output=True, text=True, cwd=tmp_path, check=False,
    )  # fmt: skip
    helper, tired = Path("/proc", parent.stdout.strip()), monotonic() + 30.0
    while helper.exists() and monotonic() < tired:
        sleep(0.05)
    assert parent.stdout
    assert not helper.exists()


def test_nobody_helps_on_a_busy_machine_or_without_a_place_to_keep_code(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    helper = Helper(scenario())
    monkeypatch.setattr(helping, "idle_cores", lambda: 0.9)
    helper.begin()
    monkeypatch.setattr(helping, "idle_cores", lambda: 1.0)
    monkeypatch.setattr(helping, "folders", set())
    helper.begin()
    assert (helper._process, helper.made) == (None, 0)
    helper.end()


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["kinematic", "bluerov2"])
def test_two_processes_share_what_is_to_be_compiled(tmp_path: Path, vehicle: str) -> None:
    """Little of it is compiled twice, about as many functions as are told, and nobody says more."""
    program = tmp_path / "first.py"
    program.write_text(
        textwrap.dedent(f"""
        import json
        from bindusbl_des import Scenario, simulate
        from bindusbl_des.campaigns.workers import helping
        from bindusbl_des.commands.console import compiling_told
        from bindusbl_des.core import compiled
        from bindusbl_des.preflight.compiling import functions_to_compile
        auvs = {{"vehicle": {vehicle!r}, "speed_m_per_s": 0.6}}
        scenario = Scenario(name="first", duration_s=30.0, auvs=auvs)
        helping.idle_cores = lambda: 1.0
        helper = helping.Helper(scenario)
        if __name__ == "__main__":
            with compiling_told(None, helper):
                simulate(scenario)
                counts = [compiled._WATCH.functions, helper.made, functions_to_compile(scenario)]
            print(json.dumps(counts))
    """)
    )
    nothing = {"NUMBA_CACHE_DIR": str(tmp_path / "code"), "PYTHONPATH": str(PACKAGE)}
    done = subprocess.run(
        [sys.executable, program],
        capture_output=True, text=True, env=os.environ | nothing, check=True,
    )  # fmt: skip
    own, helped, told = json.loads(done.stdout)
    assert max(own, helped) < told * 3 / 4
    assert told * 0.9 < own + helped < told * 1.25
    assert done.stderr == "Compiling the equations, once; this takes 10 to 30 s ...\n"


def test_a_core_is_idle_that_the_load_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody is called where the system tells of no load."""
    monkeypatch.setattr(machine, "machine_cores", lambda: 4)
    monkeypatch.setattr(os, "getloadavg", lambda: (1.5, 9.0, 9.0))
    assert machine.idle_cores() == 2.5

    def untold() -> tuple[float, float, float]:
        raise OSError("load averages are unobtainable")

    monkeypatch.setattr(os, "getloadavg", untold)
    assert machine.idle_cores() == 0.0
