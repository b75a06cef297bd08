"""The poses of vehicles that an outside program moves, and what lies between and beyond them.

It is asked at equal steps, and each answer is a line of the vehicles' logs (:mod:`.logs`); so
compiled equations read them as they read any other motion.  What has not been asked for yet is
predicted: every vehicle keeps its last velocity.
"""

from collections.abc import Callable, Mapping
from math import ceil, isfinite
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled
from ..core.wording import plain
from . import logs
from .logs import COS, DISTANCE, RATES, SIN, YAW, X, Y
from .motion import HEADINGS, PLACE, Floats, Motion, distance_at, lines, place_at
from .pose_source import Answers, PoseSource
from .vehicle import Place

Array = NDArray[np.float64]

# A shorter step (s) is refused: sound travels a metre and a half in it.
SHORTEST_STEP_S = 1e-3


class Poses:
    """The poses of a mission's vehicles that an outside program moves, as far as it was asked.

    Between two samples positions and yaw are cubics with the slopes that the last three samples
    before each end give: where a vehicle is depends on samples up to the next one only.  They are
    within 0.04 j step^3 of a motion with the jerk j (m/s3), within 0.07 a step^2 where its
    acceleration jumps by a (m/s2), within 0.2 v step where its velocity does by v (m/s).
    """

    def __init__(
        self,
        source: PoseSource,
        step_s: float,
        counts: Mapping[str, int],
        lasts_s: float,
        ahead_s: float,
    ) -> None:
        """Ask for the poses at 0 s, each `step_s` (s) from then on as the mission needs them.

        `counts` tells how many "auvs" and "asvs" there are; until `lasts_s` (s) poses may be asked
        for, and `ahead_s` (s) ahead they are predicted.

        Raises:
            ValueError: for a step that is none, and whenever an answer cannot be used.
        """
        if not _is_step(step_s):
            raise ValueError(
                f"pose_step_s must be a number of seconds, at least {plain(SHORTEST_STEP_S)}; got "
                f"{step_s!r}"
            )
        self.step_s, self._answers = float(step_s), Answers(source, counts)
        kind = type(source)
        #: Who moves vehicles, for whoever reads the results.
        self.described = (
            f"an outside program, {kind.__module__}:{kind.__qualname__}, gave the poses each "
            f"{plain(self.step_s)} s, in the place of vehicle, route and formation; scenario and "
            "seed alone do not give this mission again"
        )
        self._lines, self._ahead = ceil(lasts_s / step_s) + 2, ceil(ahead_s / step_s) + 1
        self._logs: dict[str, Floats] = {}
        for fleet, poses in self._answers.at(0.0).items():
            self._logs[fleet] = np.zeros((len(poses), self._lines, logs.COLUMNS))
            self._logs[fleet][:, 0, PLACE] = poses
        self._known = 0
        #: Whom to tell up to which instant (s) poses are known, whenever further ones are.
        self.on_known: Callable[[float], None] | None = None
        self._predict()

    @property
    def kinds(self) -> tuple[str, ...]:
        """Which fleets the outside program moves: "auvs", "asvs" or both."""
        return tuple(self._logs)

    def motion(self, kind: str) -> Motion:
        """Return the motion of a fleet; beyond the last instant asked for it is predicted."""
        log = self._logs[kind]
        ends = np.arange(len(log) + 1, dtype=np.int64) * self._lines
        return Motion(log.reshape(-1, logs.COLUMNS), ends, self.step_s)

    def advance(self, time: float) -> None:
        """Ask for all poses up to an instant (s): up to the first sample not before it.

        Raises:
            ValueError: when an answer cannot be used, or the time is beyond all that is asked for.
        """
        wanted = ceil(time / self.step_s)
        while wanted > 0 and (wanted - 1) * self.step_s >= time:  # a quotient is rounded
            wanted -= 1
        while wanted * self.step_s < time:
            wanted += 1
        if wanted <= self._known:
            return
        if wanted >= self._lines:
            raise ValueError(f"nobody knows where vehicles are at {plain(time)} s, after the end")
        while self._known < wanted:
            line = self._known + 1
            for kind, poses in self._answers.at(line * self.step_s).items():
                _note(self._logs[kind], line, self.step_s, poses)
            self._known = line
        self._predict()
        if self.on_known is not None:
            self.on_known(self._known * self.step_s)

    def _predict(self) -> None:
        """Let all vehicles keep their velocity after the last pose known."""
        end = min(self._known + 1 + self._ahead, self._lines)
        for log in self._logs.values():
            _carry_on(log, self._known, end, self.step_s)


def _is_step(step: Any) -> bool:
    return isinstance(step, Real) and isfinite(step) and float(step) >= SHORTEST_STEP_S


@compiled
def _note(log: Floats, line: int, step: float, poses: Floats) -> None:
    """Write the line (1 or later) of a sample to the logs of a fleet (n, lines, logs.COLUMNS)."""
    for vehicle in range(len(log)):
        own, turn = log[vehicle], 2.0 * np.pi
        for axis in range(4):
            now, was = poses[vehicle, axis], own[line - 1, axis]
            if axis == YAW:  # the nearest of all headings that are the same
                now += turn * np.round((was - now) / turn)
            own[line, axis] = now
            if line == 1:
                own[0, RATES + axis] = own[1, RATES + axis] = (now - was) / step
            else:
                slope = 3.0 * now - 4.0 * was + own[line - 2, axis]
                own[line, RATES + axis] = slope / (2.0 * step)
        own[line, COS], own[line, SIN] = logs.headings(
            own, line - 1, step, own[line, YAW], own[line, RATES + YAW]
        )
        own[line, DISTANCE] = logs.distance(
            own, line - 1, step, own[line, X], own[line, Y], own[line, RATES + X],
            own[line, RATES + Y],
        )  # fmt: skip


@compiled
def _carry_on(log: Floats, last: int, end: int, step: float) -> None:
    """Write places and rates after the `last` line and before the `end`, at its velocity."""
    for vehicle in range(len(log)):
        own = log[vehicle]
        for line in range(last + 1, end):
            for axis in range(4):
                rate = own[last, RATES + axis]
                own[line, axis] = own[last, axis] + (line - last) * step * rate
                own[line, RATES + axis] = rate


class PosedVehicle:
    """A vehicle that an outside program moves; asked for later than that is, this moves on."""

    def __init__(self, poses: Poses, kind: str, number: int) -> None:
        self._poses, self._motion, self._number = poses, poses.motion(kind), number

    def at(self, time: float) -> Place:
        self._poses.advance(time)
        return Place(*place_at(*self._motion, self._number, time))

    def sample(self, times: Array) -> Array:
        return self._lines(times)[:, PLACE]

    def heading_integral(self, times: Array) -> Array:
        return self._lines(times)[:, HEADINGS]

    def _lines(self, times: Array) -> Array:
        instants = np.array(times, dtype=np.float64)
        if len(instants):
            self._poses.advance(float(instants.max()))
        found: Array = lines(*self._motion, self._number, instants)
        return found

    def distance(self, time: float) -> float:
        self._poses.advance(time)
        return distance_at(*self._motion, self._number, time)

    def path_error(self, times: Array) -> Array:
        return np.zeros(0)  # the mission knows of no plan that it follows

    def along(self, time: float) -> None:
        return None

    def saturated(self, time: float) -> None:
        return None
