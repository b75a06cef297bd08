"""An outside program that moves vehicles, as a physics engine does: what it answers is checked."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..charts.samples import HIGHEST
from ..core.wording import plain, shortened
from .tracks import FARTHEST, FASTEST

Array = NDArray[np.float64]

# What is said of one vehicle's pose, and how vehicles of a fleet are called.
POSE, AXES = "x, y, z (m, z down), yaw (rad)", ("x", "y", "z", "yaw")
NAMES = {"auvs": "AUV", "asvs": "ASV"}

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


class Answers:
    """What a source of poses has answered so far."""

    def __init__(self, source: PoseSource, counts: Mapping[str, int]) -> None:
        """Take a source, and how many "auvs" and "asvs" there are.

        Raises:
            ValueError: when it is none.
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
        self._last: dict[str, Array] = {}
        self._last_at = 0.0

    def at(self, time: float) -> dict[str, Array]:
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

    def _poses(self, kind: str, answer: ArrayLike, time: float) -> Array:
        """Return the poses of a fleet, (n, 4), if they can be used."""
        count, name = self._counts[kind], NAMES[kind]
        try:
            told = np.asarray(answer)
            poses = np.array(told if told.dtype.kind in "fiu" else (), dtype=np.float64, order="C")
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


def _refuse_leap(kind: str, moved: Array, time: float, within_s: float) -> None:
    """Refuse ways (n, 4) that nobody goes in such a time (s)."""
    ways = np.linalg.norm(moved[:, :3], axis=1)
    which = int(np.argmax(ways))
    if ways[which] > FASTEST * within_s:
        raise ValueError(
            f"{_at(time)} has {NAMES[kind]}{which} {ways[which]:.3g} m from where it was "
            f"{_plain(within_s)} s before; are poses in metres, and its steps in order?"
        )


def _plain(time: float) -> str:
    """Return an instant (s), without what a product of steps has behind it."""
    return plain(round(time, 9))


def _at(time: float) -> str:
    return f"the pose source's answer at {_plain(time)} s"
