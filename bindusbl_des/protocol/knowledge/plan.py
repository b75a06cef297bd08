"""The slots of one round as the fleet assigns them, and what one AUV knows of the rounds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..schedules.view import TimedGroups, View

Flags = NDArray[np.bool_]

# Whether each AUV has decoded a broadcast, by its number, by an instant (s), (n,)
Decoded = Callable[[int, float], Flags]


@dataclass
class Plan:
    """The ping groups of a round that begins at an instant, and the frames that tell of it.

    `frames` are numbers of broadcasts, each with the AUVs that it names; `told` (n,) who knows the
    plan so far, all of them where it was agreed before the launch.
    """

    number: int
    view: View
    groups: TimedGroups
    starts_s: float
    told: Flags
    frames: list[tuple[int, Sequence[int]]] = field(default_factory=list)

    @property
    def named(self) -> list[int]:
        """The AUVs that have a slot, in the order of the slots."""
        return [auv for group in self.groups for auv in group]

    def slot_of(self, auv: int) -> int | None:
        """Return the slot of an AUV; None if it has none."""
        return next((slot for slot, group in enumerate(self.groups) if auv in group), None)

    def frame_of(self, auv: int) -> int | None:
        """Return the number of the broadcast that names an AUV; None if none has."""
        return next((number for number, named in self.frames if auv in named), None)

    def forget(self, starts_s: float) -> None:
        """Have the round begin later than anybody was told; nobody knows when."""
        self.starts_s = starts_s
        self.told[:] = False
        self.frames.clear()

    def learn(self, decoded: Decoded, time: float) -> list[int]:
        """Note who knows the plan by an instant (s); return the AUVs for which that is new.

        An AUV knows its slot by the frame that names it, and that it has none by all of them.
        """
        if not self.frames or self.told.all():
            return []
        heard = [decoded(number, time) for number, _ in self.frames]
        knows = np.logical_and.reduce(heard)
        if sum(len(named) for _, named in self.frames) < len(self.named):
            knows[:] = False  # there are frames to come
        for mine, (_, named) in zip(heard, self.frames, strict=True):
            knows[list(named)] = mine[list(named)]
        new: list[int] = np.flatnonzero(knows & ~self.told).tolist()
        self.told |= knows
        return new


@dataclass(slots=True)
class Knowledge:
    """What one AUV knows: of which round it was told last, when that begins, how long rounds last.

    `turn_s` is when its next turn in a round would be, from the start of one (s), in which `slot`:
    None where it would have none.
    """

    round: int = -1
    starts_s: float = 0.0
    period_s: float = 0.0
    turn_s: float | None = None
    slot: int = 0
    pinged_at_s: float = -np.inf

    def learn(self, plan: Plan, turn_s: float | None, slot: int) -> None:
        """Take in the plan of a later round; rounds last as long as those since the last told."""
        if self.round >= 0:
            self.period_s = (plan.starts_s - self.starts_s) / (plan.number - self.round)
        self.round, self.starts_s = plan.number, plan.starts_s
        self.turn_s, self.slot = turn_s, slot
