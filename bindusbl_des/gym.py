"""Environments of Gymnasium and PettingZoo over missions: steer the vessels, or choose who pings.

The import of this module registers those of Gymnasium: ``gymnasium.make("Placement-v0")``, or
without an import ``gymnasium.make("bindusbl_des.gym:Placement-v0")``.  Observations hold what the
surface fleet knows; the reward is the truth: less the error (m) of the worst AUV.  An episode is a
mission, truncated at its `duration_s` and never terminated; `reset` draws its seed.
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

# Divisors of observations (s, m, turns), which make them about 1; and their largest value.
TIME_S, ERROR_M, TURNS, MOST = 60.0, 10.0, 10.0, 10.0


def worst_error(mission: Mission) -> float:
    """Return the largest distance (m) between an AUV and its estimate, of all AUVs."""
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
    """Return an observation as one row, clipped to its bounds."""
    row = np.concatenate([np.ravel(part) for part in parts])
    return np.asarray(np.clip(row, -MOST, MOST), np.float32)


class GymVessels:
    """Vessels with commanded velocities: a :class:`.core.vehicles.poses.PoseSource`."""

    def __init__(self, places: Floats, middle: Floats, farthest: float) -> None:
        """Begin at positions (m, 2; m); stay within `farthest` (m) of `middle` (2,; m) on each
        axis.
        """
        self.places, self._bounds = places.copy(), (middle - farthest, middle + farthest)
        self.velocity, self._yaw = np.zeros_like(places), np.zeros(len(places))
        self._time = 0.0

    def advance_to(self, time: float) -> Mapping[str, Floats]:
        """Move to time (s); return the poses (m, 4) of the ASVs."""
        self.places += self.velocity * (time - self._time)
        np.clip(self.places, *self._bounds, out=self.places)
        self._time = time
        going = np.hypot(*self.velocity.T) > 1e-6
        self._yaw[going] = np.arctan2(self.velocity[going, 1], self.velocity[going, 0])
        return {"asvs": np.column_stack([self.places, np.zeros(len(self.places)), self._yaw])}


class Placement(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Steer the vessels so that the worst AUV has the least error.

    An action (2 m,) is the velocity of each vessel, north and east, as a share of `speed_m_per_s`,
    for `step_s` (s).  The observation holds the vessels' positions; each AUV's newest fix,
    delivered or not, and the time since its ping (the whole mission without a fix); and the passed
    share of the mission.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self,
        scenario: Scenario | str | Path = "failure_140m",
        step_s: float = 10.0,
        speed_m_per_s: float = 1.5,
        render_mode: str | None = None,
    ) -> None:
        """Simulate missions of a scenario.

        Raises:
            ScenarioError: when the scenario file cannot be read or used.
            ValueError: with passive ranging, without a vessel, or for a step or speed not above 0.
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
        """Begin a mission; return the first observation and `{"seed": the mission's seed}`.

        Gymnasium's generator, which `seed` seeds, draws the mission's seed; `options` have no
        effect.
        """
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
        """Move the vessels for one step with the velocities of an action."""
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
    """Choose who pings next: an action is the AUV that has the next round alone.

    At the round's begin the observation holds for each AUV the time since the ping of its last fix,
    its expected error, its turns in vain, and the share of ASVs that may hear it; and the passed
    share of the mission.  A step is a round.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(
        self, scenario: Scenario | str | Path = "failure_140m", render_mode: str | None = None
    ) -> None:
        """Simulate missions of a scenario whose AUVs know all slots; its schedule is not used.

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
        """Begin a mission whose first round is AUV0's; return as :meth:`Placement.reset`."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**31))
        self._next, self._asked = 0, simpy.Event(simpy.Environment())
        self._seen = np.zeros(4 * self.scenario.auvs.count + 1, np.float32)
        self._mission = Mission(self.scenario, drawn, schedule=self._schedule)
        return self._seen.copy(), {"seed": drawn}

    def _schedule(self, view: View) -> Sequence[Sequence[int]]:
        """Return the chosen AUV as the only group; keep the observation of its round."""
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
        """Let the chosen AUV ping in the next round; simulate until the round after it begins."""
        self._next, self._asked = int(action), self._mission.env.event()
        self._mission.advance(self._asked)
        error = worst_error(self._mission)
        is_over = self._mission.time >= self.scenario.duration_s
        if is_over:  # no round begins any more
            self._seen[-1] = 1.0
        return self._seen.copy(), -error, False, is_over, {"worst_error_m": error}


class Vessels(pettingzoo.ParallelEnv):  # type: ignore[misc]  # it has no types
    """Each vessel steers itself: :class:`Placement` with one agent for each ASV, `ASV0` and so on.

    An action (2,) is the velocity of the agent's vessel.  Each agent observes what Placement does,
    its own position first.  All have the same reward.
    """

    metadata: dict[str, Any] = {"name": "vessels_v0", "render_modes": []}  # noqa: RUF012 - as above

    def __init__(
        self,
        scenario: Scenario | str | Path = "recovery_140m",
        step_s: float = 10.0,
        speed_m_per_s: float = 1.5,
        render_mode: str | None = None,
    ) -> None:
        """Simulate missions of a scenario; errors are those of :class:`Placement`."""
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
        """Return the bounds of an agent's observation."""
        assert isinstance(self._observes, Box)
        return self._observes

    def action_space(self, agent: str) -> Box:
        """Return the bounds of an agent's velocity, a share of the speed."""
        return self._acts

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin a mission; return all agents' observations and infos as :meth:`Placement.reset`."""
        seen, info = self._fleet.reset(seed=seed, options=options)
        self.agents = list(self.possible_agents)
        return self._of_each(seen), {agent: dict(info) for agent in self.agents}

    def step(
        self, actions: dict[str, NDArray[np.float32]]
    ) -> tuple[
        dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool],
        dict[str, dict[str, Any]],
    ]:  # fmt: skip
        """Move all vessels for one step."""
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
        """Return each agent's observation, with its own position first."""
        count = len(self.possible_agents)
        places, rest = seen[: 2 * count].reshape(count, 2), seen[2 * count :]
        return {
            agent: np.concatenate((np.roll(places, -number, axis=0).ravel(), rest))
            for number, agent in enumerate(self.possible_agents)
        }


for _name, _env in (("Placement-v0", Placement), ("Schedule-v0", Schedule)):
    gymnasium.register(_name, entry_point=f"bindusbl_des.gym:{_env.__name__}")
