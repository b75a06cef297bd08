"""Environments of Gymnasium and PettingZoo over missions: where vessels go, and who pings next.

Those of Gymnasium are registered as this module is imported: ``gymnasium.make("Placement-v0")``, or
without an import of one's own ``gymnasium.make("bindusbl_des.gym:Placement-v0")``.  What is
observed is what the surface fleet knows; the reward is the truth: less the error (m) of the worst
AUV.  An episode is a mission, truncated at its `duration_s`, since nothing of it is terminal; its
seed is drawn from that of `reset`.
"""

from collections.abc import Mapping, Sequence
from math import hypot
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import simpy
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray

from .core.mission.mission import Mission
from .core.protocol.view import View
from .core.scenario.files.scenario_file import as_scenario
from .core.scenario.scenario import Scenario
from .core.setup import Setup
from .support.arrays import Floats

Observation = NDArray[np.float32]

# What observations are divided by, so that they are about 1: s, m and turns; and where they end.
TIME_S, ERROR_M, TURNS, MOST = 60.0, 10.0, 10.0, 10.0


def worst_error(mission: Mission) -> float:
    """Return how far (m) the AUV that is worst off is from where it believes to be."""
    states = mission.auvs()
    return max(hypot(*offset) for offset in (states.estimate - states.truth[:, :2]).tolist())


def _scenario(scenario: Scenario | str | Path) -> Scenario:
    found = as_scenario(scenario, allow_plugins=False)
    if found.protocol.asvs_ping:
        raise ValueError("protocol.ranging: with passive ranging vessels know of no fixes")
    if not found.asvs.count:
        raise ValueError("asvs.count: is 0, and actions are of vessels; give at least one")
    return found


def _observed(*parts: Any) -> Observation:
    """Return what is observed in one row, within bounds."""
    row = np.concatenate([np.ravel(part) for part in parts])
    return np.asarray(np.clip(row, -MOST, MOST), np.float32)


class GymVessels:
    """Vessels that go as they are told: a source of poses
    (:class:`.core.vehicles.poses.PoseSource`)."""

    def __init__(self, places: Floats, middle: Floats, farthest: float) -> None:
        """Let them lie at places (m, 2), m; they stay within a square of this half side (m) about a
        `middle` (2,), m.
        """
        self.places, self._bounds = places.copy(), (middle - farthest, middle + farthest)
        self.velocity, self._yaw = np.zeros_like(places), np.zeros(len(places))
        self._time = 0.0

    def advance_to(self, time: float) -> Mapping[str, Floats]:
        """Move on to an instant (s); return the poses (m, 4) of the ASVs."""
        self.places += self.velocity * (time - self._time)
        np.clip(self.places, *self._bounds, out=self.places)
        self._time = time
        going = np.hypot(*self.velocity.T) > 1e-6
        self._yaw[going] = np.arctan2(self.velocity[going, 1], self.velocity[going, 0])
        return {"asvs": np.column_stack([self.places, np.zeros(len(self.places)), self._yaw])}


class Placement(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Move the vessels, so that the worst AUV knows best where it is.

    An action (2 m,) is the velocity of each vessel, north and east, as a share of `speed_m_per_s`,
    for `step_s` (s).  Observed are the vessels' places; of each AUV the newest fix that they have
    made of it, whether or not it has been delivered, and the time since its ping (the whole
    mission, if there is none); and how much of the mission has passed.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self,
        scenario: Scenario | str | Path = "failure_140m",
        step_s: float = 10.0,
        speed_m_per_s: float = 1.5,
        render_mode: str | None = None,
    ) -> None:
        """Fly missions of a scenario.

        Raises:
            ScenarioError: when the scenario file cannot be read or used.
            ValueError: with passive ranging, without a vessel, or for a step or speed that is none.
        """
        if not (step_s > 0.0 and speed_m_per_s > 0.0):
            raise ValueError(
                f"step_s and speed_m_per_s must be above 0; got {step_s!r}, {speed_m_per_s!r}"
            )
        self.scenario, self.render_mode = _scenario(scenario), render_mode
        self._step_s, self._speed = step_s, speed_m_per_s
        self._setup = Setup.of(self.scenario)
        area = self._setup.area
        self._middle, self._scale = np.array(area.centroid), area.across
        self._asvs, self._auvs = self.scenario.asvs.count, self.scenario.auvs.count
        size = 2 * self._asvs + 3 * self._auvs + 1
        self.action_space = Box(-1.0, 1.0, (2 * self._asvs,), np.float32)
        self.observation_space = Box(-MOST, MOST, (size,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a mission; its seed is drawn, and in the `info` that is returned."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**31))
        stations = np.array(self._setup.stations_m)
        self._vessels = GymVessels(stations, self._middle, 2.0 * self._scale)
        self._mission = Mission(self.scenario, drawn, poses=self._vessels, pose_step_s=0.5)
        self._step = 0
        return self._observe(), {"seed": drawn}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move the vessels for a step."""
        end, self._step = self.scenario.duration_s, self._step + 1
        shares = np.clip(np.asarray(action, np.float64).reshape(-1, 2), -1.0, 1.0)
        faster = np.maximum(np.hypot(*shares.T), 1.0)
        self._vessels.velocity = self._speed * shares / faster[:, None]
        self._mission.advance(min(self._step * self._step_s, end))
        error = worst_error(self._mission)
        is_over = self._mission.time >= end
        return self._observe(), -error, False, is_over, {"worst_error_m": error}

    def _observe(self) -> Observation:
        now, end = self._mission.time, self.scenario.duration_s
        fixes = self._mission.fleet_fixes()
        fixes = np.where(np.isnan(fixes), [*self._middle, 0.0], fixes)
        vessels, places = (
            (them - self._middle) / self._scale for them in (self._vessels.places, fixes[:, :2])
        )
        return _observed(vessels, places, (now - fixes[:, 2]) / TIME_S, now / end)


class Schedule(gymnasium.Env[Observation, np.int64]):
    """Choose who pings next: an action is the AUV that has the following round for itself.

    Observed as that round begins, of each AUV what a schedule is asked with: the time since the
    ping of its last fix, the error expected of it, its turns in vain, and how many ASVs it is
    believed to be heard by; and how much of the mission has passed.  A step is a round.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self, scenario: Scenario | str | Path = "failure_140m", render_mode: str | None = None
    ) -> None:
        """Fly missions of a scenario with slots that all AUVs know, whatever its schedule.

        Raises:
            ScenarioError: when the scenario file cannot be read or used.

        With passive ranging, random access or `knowledge: broadcast`, `reset` raises ValueError.
        """
        self.scenario, self.render_mode = _scenario(scenario), render_mode
        count = self.scenario.auvs.count
        self.action_space = Discrete(count)
        self.observation_space = Box(-MOST, MOST, (4 * count + 1,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a mission, in whose first round AUV0 pings; its seed is drawn, and in the `info`
        that is returned.
        """
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**31))
        self._next, self._asked = 0, simpy.Event(simpy.Environment())
        self._seen = np.zeros(4 * self.scenario.auvs.count + 1, np.float32)
        self._mission = Mission(self.scenario, drawn, schedule=self._schedule)
        return self._seen.copy(), {"seed": drawn}

    def _schedule(self, view: View) -> Sequence[Sequence[int]]:
        """Let the AUV ping that was chosen; note what is known as its round begins."""
        self._seen = _observed(
            view.since_s / TIME_S,
            view.expected_error_m / ERROR_M,
            view.turns_in_vain / TURNS,
            view.heard.mean(axis=1),
            view.time / self.scenario.duration_s,
        )
        if not self._asked.triggered:
            self._asked.succeed()
        return [[self._next]]

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Let an AUV ping in the round that follows, and go on until that begins."""
        self._next, self._asked = int(action), self._mission.env.event()
        self._mission.advance(self._asked)
        error = worst_error(self._mission)
        is_over = self._mission.time >= self.scenario.duration_s
        if is_over:  # no round begins any more
            self._seen[-1] = 1.0
        return self._seen.copy(), -error, False, is_over, {"worst_error_m": error}


class Vessels(pettingzoo.ParallelEnv):  # type: ignore[misc]  # it has no types
    """Each vessel decides where it goes: :class:`Placement` with an agent for each, `ASV0` and so
    on.

    An action (2,) is the velocity of an agent's own vessel.  Each observes what Placement does,
    its own place first of those of all vessels.  All have the same reward.
    """

    metadata: dict[str, Any] = {"name": "vessels_v0", "render_modes": []}  # noqa: RUF012 - as above

    def __init__(
        self,
        scenario: Scenario | str | Path = "recovery_140m",
        step_s: float = 10.0,
        speed_m_per_s: float = 1.5,
        render_mode: str | None = None,
    ) -> None:
        """Fly missions of a scenario; what it raises is as of :class:`Placement`."""
        self._fleet = Placement(scenario=scenario, step_s=step_s, speed_m_per_s=speed_m_per_s)
        self.render_mode = render_mode
        count = self._fleet.scenario.asvs.count
        self.possible_agents = [f"ASV{asv}" for asv in range(count)]
        self.agents = list(self.possible_agents)
        self._observes, self._acts = (
            self._fleet.observation_space,
            Box(-1.0, 1.0, (2,), np.float32),
        )

    def observation_space(self, agent: str) -> Box:
        """Return what an agent observes."""
        assert isinstance(self._observes, Box)
        return self._observes

    def action_space(self, agent: str) -> Box:
        """Return the velocities that an agent chooses from, as shares of the speed."""
        return self._acts

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin a mission; its seed is drawn, and in the infos that are returned."""
        seen, info = self._fleet.reset(seed=seed, options=options)
        self.agents = list(self.possible_agents)
        return self._of_each(seen), {agent: dict(info) for agent in self.agents}

    def step(
        self, actions: dict[str, NDArray[np.float32]]
    ) -> tuple[
        dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool],
        dict[str, dict[str, Any]],
    ]:  # fmt: skip
        """Move all vessels for a step."""
        moved = np.concatenate([actions[agent] for agent in self.possible_agents])
        seen, reward, is_terminal, is_over, info = self._fleet.step(moved)
        seens, agents = self._of_each(seen), self.agents
        if is_over:
            self.agents = []
        return (
            seens,
            dict.fromkeys(agents, reward),
            dict.fromkeys(agents, is_terminal),
            dict.fromkeys(agents, is_over),
            {agent: dict(info) for agent in agents},
        )

    def _of_each(self, seen: Observation) -> dict[str, Observation]:
        """Return what each agent observes, of what the fleet does: itself first."""
        count = len(self.possible_agents)
        places, rest = seen[: 2 * count].reshape(count, 2), seen[2 * count :]
        return {
            agent: np.concatenate((np.roll(places, -number, axis=0).ravel(), rest))
            for number, agent in enumerate(self.possible_agents)
        }


for _name, _env in (("Placement-v0", Placement), ("Schedule-v0", Schedule)):
    gymnasium.register(_name, entry_point=f"bindusbl_des.gym:{_env.__name__}")
