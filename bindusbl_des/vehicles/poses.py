"""Vehicles that an outside program moves, as a physics engine does: it is asked for their poses.

It is asked at equal steps, and each answer is a line of the vehicles' logs (:mod:`.logs`); so
compiled equations read them as they read any other motion.  What has not been asked for yet is
predicted: every vehicle keeps its last velocity.
"""

from collections.abc import Mapping
from math import ceil, isfinite
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.compiled import compiled
from ..core.wording import plain, shortened
from . import logs
from .logs import COS, DISTANCE, RATES, SIN, YAW, X, Y
from .motion import HEADINGS, PLACE, Floats, Motion, distance_at, lines, place_at
from .tracks import FASTEST
from .vehicle import Place

Array = NDArray[np.float64]

# What is said of one vehicle's pose, and how vehicles of a fleet are called.
POSE, AXES = "x, y, z (m, z down), yaw (rad)", ("x", "y", "z", "yaw")
NAMES = {"auvs": "AUV", "asvs": "ASV"}

# A shorter step (s) is refused: sound travels a metre and a half in it.
SHORTEST_STEP_S = 1e-3

# By so much (s) the clock of a source may be off: the last digits of a sum of steps.
SAME_S = 1e-6


class PoseSource(Protocol):
    """An outside program that moves vehicles of a mission."""

    def advance_to(self, time: float) -> Mapping[str, ArrayLike]:
        """Move on to an instant (s) of the mission; return where vehicles are then.

        That are the poses of all AUVs under "auvs", of all ASVs under "asvs", or both: a row for
        each, with x, y, z (m, survey frame, z down) and yaw (rad, from +x towards +y, however often
        turned).  It is asked for 0 s first, then for each following step, in order and once; who is
        missing in the first answer moves as the scenario says.

        A source that has an attribute `time` (s) must then stand at that instant.
        """


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
        if not (isfinite(step_s) and step_s >= SHORTEST_STEP_S):
            raise ValueError(
                f"pose_step_s must be a number of seconds, at least {plain(SHORTEST_STEP_S)}; got "
                f"{step_s!r}"
            )
        if not callable(getattr(source, "advance_to", None)):
            raise ValueError(
                f"{shortened(repr(source))} moves no vehicles: it has no method advance_to(time)"
            )
        self.step_s, self._source, self._counts = float(step_s), source, dict(counts)
        self._lines = ceil(lasts_s / step_s) + 2
        self._predicted = ceil(ahead_s / step_s) + 1
        self._known, self._is_asking = -1, False
        self._logs: dict[str, Floats] = {}
        for kind, poses in self._asked(0.0).items():
            self._logs[kind] = np.zeros((self._counts[kind], self._lines, logs.COLUMNS))
            self._logs[kind][:, 0, PLACE] = self._checked(kind, poses, 0.0)
        self._known = 0
        self._predict()

    @property
    def kinds(self) -> tuple[str, ...]:
        """Which fleets the outside program moves: "auvs", "asvs" or both."""
        return tuple(self._logs)

    @property
    def described(self) -> str:
        """Say who moves vehicles, for whoever reads the results."""
        kind = type(self._source)
        return (
            f"an outside program, {kind.__module__}:{kind.__qualname__}, gave the poses each "
            f"{plain(self.step_s)} s, in the place of vehicle, route and formation; scenario and "
            "seed alone do not give this mission again"
        )

    def motion(self, kind: str) -> Motion:
        """Return the motion of a fleet; beyond the last instant asked for it is predicted."""
        count = self._counts[kind]
        ends = np.arange(count + 1, dtype=np.int64) * self._lines
        return Motion(self._logs[kind].reshape(-1, logs.COLUMNS), ends, self.step_s)

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
            instant = line * self.step_s
            for kind, answer in self._asked(instant).items():
                poses = self._checked(kind, answer, instant)
                _note(self._logs[kind], line, self.step_s, poses)
            self._known = line
        self._predict()

    def _predict(self) -> None:
        """Let all vehicles keep their velocity after the last pose known."""
        end = min(self._known + 1 + self._predicted, self._lines)
        for log in self._logs.values():
            _carry_on(log, self._known, end, self.step_s)

    def _asked(self, time: float) -> Mapping[str, ArrayLike]:
        """Return what the source answers about an instant (s), by fleet."""
        if self._is_asking:
            raise RuntimeError(
                "a pose source must not advance or look at the mission while it is asked for poses"
            )
        self._is_asking = True
        try:
            answer = self._source.advance_to(time)
        finally:
            self._is_asking = False
        self._check_clock(time)
        if not isinstance(answer, Mapping) or not answer or set(answer) - set(self._counts):
            named = sorted(map(str, answer)) if isinstance(answer, Mapping) else type(answer)
            raise ValueError(
                f"{_at(time)} must be a dict with the poses of 'auvs', of 'asvs' or of both, "
                f"each with rows of {POSE}; got {shortened(str(named))}"
            )
        if self._known >= 0 and set(answer) != set(self._logs):
            raise ValueError(
                f"{_at(time)} has poses of {', '.join(sorted(answer))}; at 0 s it had those of "
                f"{', '.join(sorted(self._logs))}, and must go on with them"
            )
        return answer

    def _check_clock(self, time: float) -> None:
        stands_at = getattr(self._source, "time", None)
        if isinstance(stands_at, (int, float)) and not abs(stands_at - time) <= SAME_S:
            raise ValueError(
                f"the pose source was asked for {plain(time)} s, and its own `time` is "
                f"{plain(float(stands_at))} s; it must stop there, and goes through one mission: "
                "begin a new one for each, and choose pose_step_s as a multiple of its own step"
            )

    def _checked(self, kind: str, answer: ArrayLike, time: float) -> Array:
        """Return the poses of a fleet, (n, 4), if they can be used."""
        count, name = self._counts[kind], NAMES[kind]
        try:
            poses = np.array(answer, dtype=np.float64, order="C")
        except (TypeError, ValueError):
            poses = np.empty(0)
        if poses.shape != (count, 4):
            got = f"shape {poses.shape}" if poses.size else shortened(repr(answer))
            raise ValueError(
                f"{_at(time)} must have one row of {POSE} for each of the {count} {name}s: "
                f"{kind} of shape ({count}, 4), got {got}"
            )
        if not np.isfinite(poses).all():
            which, axis = np.argwhere(~np.isfinite(poses))[0]
            value = float(poses[which, axis])
            raise ValueError(
                f"{_at(time)} has {name}{which} at {AXES[axis]} = {value}; poses "
                "must be finite numbers"
            )
        if self._known >= 0:
            moved = np.hypot(*(poses - self._logs[kind][:, self._known, PLACE])[:, :2].T)
            which = int(np.argmax(moved))
            if moved[which] > FASTEST * self.step_s:
                raise ValueError(
                    f"{_at(time)} has {name}{which} {moved[which]:.3g} m from where it was "
                    f"{plain(self.step_s)} s before; are poses in metres, and its steps in order?"
                )
        return poses


def _at(time: float) -> str:
    return f"the pose source's answer at {plain(time)} s"


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
        instants = np.ascontiguousarray(times, dtype=np.float64)
        if len(instants):
            self._poses.advance(float(instants.max()))
        found: Array = lines(*self._motion, self._number, instants)
        return found

    def distance(self, time: float) -> float:
        self._poses.advance(time)
        return distance_at(*self._motion, self._number, time)

    def path_error(self, times: Array) -> Array:
        return np.zeros(0)  # the mission knows of no plan that it follows

    def saturated(self, time: float) -> None:
        return None
