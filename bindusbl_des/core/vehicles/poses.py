"""The poses of vehicles that an outside program moves, and the motion between and beyond them.

The program is asked at equal steps.  Each answer is checked and becomes a line of the vehicles'
logs (:mod:`.motion`), which compiled equations read like any other motion.  Beyond the last answer
every vehicle keeps its last velocity.
"""

from collections.abc import Callable, Mapping
from math import ceil, isfinite
from numbers import Real
from pathlib import Path
from traceback import walk_tb
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...models.charts.shapes import HIGHEST
from ...support.arrays import Floats, real_numbers
from ...support.compiled import compiled
from ...support.wording import plain, shortened
from . import motion
from .motion import COS, DISTANCE, PLACE, RATES, SIN, YAW, Motion, X, Y
from .tracks import FARTHEST, FASTEST
from .vehicle import Vehicle

# The numbers of a pose, in words and by axis, and the names of vehicles in messages.
POSE, AXES = "x, y, z (m, z down), yaw (rad)", ("x", "y", "z", "yaw")
NAMES = {"auvs": "AUV", "asvs": "ASV"}

# The clock of a source may differ by so much (s): rounding in a sum of steps.
SAME_S = 1e-6


def _line(error: Exception) -> str:
    """Return the file and line that raised an error, as `` at source.py:12``."""
    *_, (frame, line) = walk_tb(error.__traceback__)
    return f" at {Path(frame.f_code.co_filename).name}:{line}"


class PoseSource(Protocol):
    """An outside program that moves vehicles of a mission."""

    def advance_to(self, time: float) -> Mapping[str, ArrayLike]:
        """Advance to an instant (s) of the mission; return the poses of the vehicles then.

        The mapping holds the poses of all AUVs under "auvs", of all ASVs under "asvs", or both: a
        row for each vehicle with x, y, z (m, survey frame, z down) and yaw (rad, from +x towards
        +y; not wrapped or wrapped).  It is called for 0 s first, then for each following step once,
        in order.  A fleet that is missing in the first answer moves as the scenario says.

        A source with an attribute `time` (s) must have reached that instant.
        """


class ReceivedPoses:
    """The poses that a source has answered so far."""

    def __init__(self, source: PoseSource, counts: Mapping[str, int]) -> None:
        """Take a source, and the numbers of "auvs" and "asvs".

        Raises:
            ValueError: when `source` is no source of poses.
        """
        if not callable(getattr(source, "advance_to", None)):
            raise ValueError(
                f"{shortened(repr(source))} moves no vehicles: it has no method advance_to(time)"
            )
        if isinstance(source, type):
            raise ValueError(
                f"{shortened(repr(source))} is a class; poses come from an object of it: "
                f"poses={source.__name__}(...)"
            )
        self._source, self._counts = source, dict(counts)
        self._is_asked = False
        self._last: dict[str, Floats] = {}
        self._last_at = 0.0

    def at(self, time: float) -> dict[str, Floats]:
        """Return the poses (n, 4) at the next instant (s), for each fleet that the source moves.

        Raises:
            ValueError: when the answer cannot be used.
            RuntimeError: when the source is being asked already.
        """
        answer = self._asked(time)
        poses = {kind: self._poses(kind, answer[kind], time) for kind in answer}
        for kind, were in self._last.items():
            _refuse_leap(kind, poses[kind] - were, time, time - self._last_at)
        self._last, self._last_at = poses, time
        return poses

    def _asked(self, time: float) -> Mapping[str, ArrayLike]:
        if self._is_asked:
            raise RuntimeError(
                "a pose source must not advance or look at the mission while it is asked for poses"
            )
        self._is_asked = True
        try:
            answer: Any = self._source.advance_to(time)
        except Exception as error:
            error.add_note(
                f"The pose source raised this{_line(error)}, asked for {_plain(time)} s."
            )
            raise
        finally:
            self._is_asked = False
        self._check_clock(time)
        if not isinstance(answer, Mapping) or not answer or set(answer) - set(self._counts):
            named = sorted(map(str, answer)) if isinstance(answer, Mapping) else type(answer)
            raise ValueError(
                f"{_at(time)} must be a dict with the poses of 'auvs', of 'asvs' or of both, "
                f"each with rows of {POSE}; got {shortened(str(named))}"
            )
        if self._last and set(answer) != set(self._last):
            raise ValueError(
                f"{_at(time)} has poses of {', '.join(sorted(answer))}; at 0 s it had those of "
                f"{', '.join(sorted(self._last))}, and must go on with them"
            )
        return answer

    def _check_clock(self, time: float) -> None:
        stands_at = getattr(self._source, "time", None)
        if isinstance(stands_at, (int, float)) and not abs(stands_at - time) <= SAME_S:
            raise ValueError(
                f"the pose source was asked for {_plain(time)} s, and its own `time` is "
                f"{_plain(float(stands_at))} s; it must stop there, and goes through one mission: "
                "begin a new one for each, and choose pose_step_s as a multiple of its own step"
            )

    def _poses(self, kind: str, answer: ArrayLike, time: float) -> Floats:
        """Return the poses of a fleet, (n, 4), if they can be used."""
        count, name = self._counts[kind], NAMES[kind]
        poses = real_numbers(answer)
        if poses is None or poses.shape != (count, 4):
            is_array = poses is not None and poses.size
            got = f"shape {np.shape(answer)}" if is_array else shortened(repr(answer))
            raise ValueError(
                f"{_at(time)} must have one row of {POSE} for each of the {count} {name}s: "
                f"{kind} of shape ({count}, 4), got {got}"
            )
        if not np.isfinite(poses).all():
            which, axis = np.argwhere(~np.isfinite(poses))[0]
            raise ValueError(
                f"{_at(time)} has {name}{which} at {AXES[axis]} = {float(poses[which, axis])}; "
                "poses must be finite numbers"
            )
        if (np.abs(poses) > FARTHEST).any():
            which, axis = np.argwhere(np.abs(poses) > FARTHEST)[0]
            raise ValueError(
                f"{_at(time)} has {name}{which} at {AXES[axis]} = {float(poses[which, axis]):g}; "
                f"places must be within {FARTHEST:g} m of the survey, yaw within {FARTHEST:g} rad"
            )
        if kind == "auvs" and (poses[:, 2] < -HIGHEST).any():
            which = int(np.argmin(poses[:, 2]))
            raise ValueError(
                f"{_at(time)} has {name}{which} at z = {float(poses[which, 2]):g}; AUVs must be in "
                "the sea, and z is down: positive below its surface"
            )
        return poses


def _refuse_leap(kind: str, moved: Floats, time: float, within_s: float) -> None:
    """Refuse displacements (n, 4) that no vehicle makes within `within_s` (s)."""
    ways = np.linalg.norm(moved[:, :3], axis=1)
    which = int(np.argmax(ways))
    if ways[which] > FASTEST * within_s:
        raise ValueError(
            f"{_at(time)} has {NAMES[kind]}{which} {ways[which]:.3g} m from where it was "
            f"{_plain(within_s)} s before; are poses in metres, and its steps in order?"
        )


def _plain(time: float) -> str:
    """Return an instant (s) as text, without the rounding of a product of steps."""
    return plain(round(time, 9))


def _at(time: float) -> str:
    return f"the pose source's answer at {_plain(time)} s"


# A shorter step (s) is refused: sound travels a metre and a half in it.
SHORTEST_STEP_S = 1e-3


class Poses:
    """The poses of the vehicles that an outside program moves, up to the last answer.

    Between two samples, positions and yaw are cubics.  Their slope at each sample follows from the
    last three samples up to it, so a pose depends on samples up to the next one only.  The error is
    below 0.04 j step^3 for a motion with jerk j (m/s3), 0.07 a step^2 where the acceleration jumps
    by a (m/s2), and 0.2 v step where the velocity jumps by v (m/s).
    """

    def __init__(
        self,
        source: PoseSource,
        step_s: float,
        counts: Mapping[str, int],
        lasts_s: float,
        ahead_s: float,
    ) -> None:
        """Ask the source for the poses at 0 s; later ones follow as the mission needs them.

        They are `step_s` (s) apart; `counts` holds the numbers of "auvs" and "asvs"; the mission
        lasts `lasts_s` (s); poses are predicted `ahead_s` (s) ahead.

        Raises:
            ValueError: for an invalid step, or an answer that cannot be used.
        """
        if not _is_step(step_s):
            raise ValueError(
                f"pose_step_s must be a number of seconds, at least {plain(SHORTEST_STEP_S)}; got "
                f"{step_s!r}"
            )
        self.step_s, self._answers = float(step_s), ReceivedPoses(source, counts)
        kind = type(source)
        #: A sentence for the results: which program moves the vehicles.
        self.described = (
            f"an outside program, {kind.__module__}:{kind.__qualname__}, gave the poses each "
            f"{plain(self.step_s)} s, in the place of vehicle, route and formation; scenario and "
            "seed alone do not give this mission again"
        )
        self._lines, self._ahead = ceil(lasts_s / step_s) + 2, ceil(ahead_s / step_s) + 1
        self._logs: dict[str, Floats] = {}
        for fleet, poses in self._answers.at(0.0).items():
            self._logs[fleet] = np.zeros((len(poses), self._lines, motion.COLUMNS))
            self._logs[fleet][:, 0, PLACE] = poses
        self._known = 0
        #: Called with the instant (s) up to which poses are known, after each advance.
        self.on_known: Callable[[float], None] | None = None
        self._predict()

    @property
    def kinds(self) -> tuple[str, ...]:
        """The fleets that the outside program moves: "auvs", "asvs" or both."""
        return tuple(self._logs)

    def motion(self, kind: str) -> Motion:
        """Return the motion of a fleet; beyond the last answer it is predicted."""
        log = self._logs[kind]
        ends = np.arange(len(log) + 1, dtype=np.int64) * self._lines
        steps = np.full(len(log), self.step_s)
        return Motion(log.reshape(-1, motion.COLUMNS), ends, steps)

    def advance(self, time: float) -> None:
        """Ask for poses up to the first sample at or after an instant (s).

        Raises:
            ValueError: when an answer cannot be used, or the instant is after the mission's end.
        """
        wanted = ceil(time / self.step_s)
        while wanted > 0 and (wanted - 1) * self.step_s >= time:  # the quotient is rounded
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
        """Write poses beyond the last answer: every vehicle keeps its velocity."""
        end = min(self._known + 1 + self._ahead, self._lines)
        for log in self._logs.values():
            _carry_on(log, self._known, end, self.step_s)


def _is_step(step: Any) -> bool:
    return isinstance(step, Real) and isfinite(step) and float(step) >= SHORTEST_STEP_S


@compiled
def _note(log: Floats, line: int, step: float, poses: Floats) -> None:
    """Write a sample (n, 4) as line `line` >= 1 of a fleet's logs (n, lines, motion.COLUMNS)."""
    for vehicle in range(len(log)):
        own, turn = log[vehicle], 2.0 * np.pi
        for axis in range(4):
            now, was = poses[vehicle, axis], own[line - 1, axis]
            if axis == YAW:  # unwrapped: the equal heading that is nearest to the last
                now += turn * np.round((was - now) / turn)
            own[line, axis] = now
            if line == 1:
                own[0, RATES + axis] = own[1, RATES + axis] = (now - was) / step
            else:
                slope = 3.0 * now - 4.0 * was + own[line - 2, axis]
                own[line, RATES + axis] = slope / (2.0 * step)
        own[line, COS], own[line, SIN] = motion.headings(
            own, line - 1, step, own[line, YAW], own[line, RATES + YAW]
        )
        own[line, DISTANCE] = motion.distance(
            own, line - 1, step, own[line, X], own[line, Y], own[line, RATES + X],
            own[line, RATES + Y],
        )  # fmt: skip


@compiled
def _carry_on(log: Floats, last: int, end: int, step: float) -> None:
    """Write the lines of each log after `last` and before `end`, at the velocity of `last`."""
    for vehicle in range(len(log)):
        own = log[vehicle]
        for line in range(last + 1, end):
            for axis in range(4):
                rate = own[last, RATES + axis]
                own[line, axis] = own[last, axis] + (line - last) * step * rate
                own[line, RATES + axis] = rate


class PosedVehicle(Vehicle):
    """A vehicle that an outside program moves; asked about a later instant, it advances that."""

    def __init__(self, poses: Poses, kind: str, number: int) -> None:
        super().__init__(poses.motion(kind), number)
        self._poses = poses

    def _advance(self, time: float) -> None:
        self._poses.advance(time)
