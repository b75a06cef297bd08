"""A second process that compiles what the first mission on a machine needs late.

Whoever finds compiled code on the disk needs no helper, so what that is made of is loaded late.
"""

import os
from contextlib import suppress
from typing import Any

import numpy as np

from ...core.compiled import watch_compiling
from ...core.compiling.code_cache import TOLD, folders
from ...preflight.machine import idle_cores
from ...scenario.families import without_plugins
from ...scenario.scenario import Scenario

# Long enough for a ping to be heard and its fix to be computed.
SHORT_S = 3.0


class Helper:
    """A process that compiles what a mission needs late, while this one compiles what it needs now.

    Each finds on the disk what the other has compiled, and waits for what it compiles just then
    (:mod:`...core.compiling.turns`).
    """

    def __init__(self, scenario: Scenario) -> None:
        """Take the mission that is to be helped."""
        self._scenario = scenario
        self._process: Any = None
        self._made: Any = None

    @property
    def made(self) -> int:
        """How many functions it has begun to compile."""
        return self._made.value if self._made else 0

    def begin(self) -> None:
        """Begin, where there are a core to spare, a place for what is compiled, and turns.

        On a busy machine the mission would wait longer for its helper than without it.
        """
        if os.name != "posix" or not folders or idle_cores() < 1.0:
            return
        from .processes import Spawn

        spawn = Spawn()
        with suppress(OSError):  # the machine has no room for it
            self._made = spawn.RawValue("q")
            process = spawn.Process(target=_help, args=(self._scenario, self._made))
            process.start()
            self._process = process

    def end(self) -> None:
        """End, since the mission has all that it needs, or has failed."""
        if self._process:
            self._process.kill()
            self._process.join()


def _help(scenario: Scenario, made: Any) -> None:
    """Compile in a process of its own, silently; count the functions that are begun in `made`."""
    from .processes import go_with_parent

    def count(before: int, _: float) -> None:
        made.value = before + 1

    go_with_parent()
    os.environ[TOLD] = "1"
    watch_compiling(count)
    with suppress(Exception):  # what is wrong with a mission is told by the mission
        rehearse(scenario)


def rehearse(scenario: Scenario) -> None:
    """Correct what AUVs believe, write the tables and metrics, and only then fly a short mission.

    Vehicles move without equations of motion, which are what a mission begins with.  Plug-ins are
    left out, since they might do anything.

    Raises:
        ValidationError: when the scenario cannot do without these.
    """
    from ...mission.build import build_world
    from ...mission.event_tables import event_tables
    from ...mission.metrics import auv_metrics
    from ...mission.mission import Mission
    from ...protocol.own.steps import Environment

    short = _without_hulls(scenario)
    world = build_world(Environment(), short, 0)
    world.navigator.correct(world.record.fixes.rows, np.empty(0, dtype=np.int64))
    event_tables(world)
    auv_metrics(world)
    Mission(short).result()


def _without_hulls(scenario: Scenario) -> Scenario:
    """Return a short mission of the same kind, with neither hulls nor plug-ins."""
    data = without_plugins(scenario.model_dump(mode="json"))
    data["duration_s"] = min(SHORT_S, scenario.duration_s)
    if scenario.auvs.vehicle.has_dynamics:
        data["auvs"] |= {"vehicle": "kinematic", "feedback": "truth"}
    if scenario.asvs.vehicle.has_dynamics:
        data["asvs"]["vehicle"] = "moored"
    return Scenario.model_validate(data)
