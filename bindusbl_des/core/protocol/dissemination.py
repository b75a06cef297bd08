"""Schedule dissemination: frames announce slots; which AUVs know theirs by when, and which ping
without.

The fleet assigns the slots of a round as the frame begins that announces them, and knows of its
AUVs only what fixes say.  An AUV knows the slots of frames that it has decoded, and nothing else.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import simpy
from numpy.typing import NDArray

from ...support.arrays import Flags
from ...support.streams import Purpose, Streams
from ..records.events import Assignment, Round
from ..records.rows import EventBuffer, Recorder
from .frames import MfDownlink
from .ranging import BySteps, OneWay, TwoWay
from .slots import Slots
from .steps import SAME, moment
from .view import Schedule, TimedGroups, View

# Function of a broadcast's number and an instant (s): which AUVs (n,) have decoded it by then
Decoded = Callable[[int, float], Flags]


@dataclass
class AnnouncedRound:
    """The plan of a round that begins at `starts_s` (s): its ping groups, its announcements.

    `frames` are numbers of broadcasts, each with the AUVs that it names, and `awaited` is how many
    ASVs have yet to begin theirs; `informed` (n,) tells which AUVs know the plan so far, all of
    them if it was agreed before the launch.
    """

    number: int
    view: View
    groups: TimedGroups
    starts_s: float
    informed: Flags
    frames: list[tuple[int, Sequence[int]]] = field(default_factory=list)
    awaited: int = 0

    @property
    def named(self) -> list[int]:
        """The AUVs that have a slot, in the order of slots."""
        return [auv for group in self.groups for auv in group]

    def slot_of(self, auv: int) -> int | None:
        """Return the slot of an AUV, or None if it has none."""
        return next((slot for slot, group in enumerate(self.groups) if auv in group), None)

    def frame_of(self, auv: int) -> int | None:
        """Return the number of the broadcast that names an AUV, or None."""
        return next((number for number, named in self.frames if auv in named), None)

    def forget(self, starts_s: float) -> None:
        """Start the round later than it was announced; no AUV knows when."""
        self.starts_s = starts_s
        self.informed[:] = False
        self.frames.clear()

    def learn(self, decoded: Decoded, time: float) -> list[int]:
        """Note which AUVs know the plan by `time` (s); return those for which that is new.

        An AUV learns its slot from the frame that names it, and that it has none from all frames
        together.
        """
        if not self.frames or self.informed.all():
            return []
        heard = [decoded(number, time) for number, _ in self.frames]
        knows = np.logical_and.reduce(heard)
        if self.awaited or sum(len(named) for _, named in self.frames) < len(self.named):
            knows[:] = False  # there are frames to come
        for mine, (_, named) in zip(heard, self.frames, strict=True):
            knows[list(named)] = mine[list(named)]
        new: list[int] = np.flatnonzero(knows & ~self.informed).tolist()
        self.informed |= knows
        return new


@dataclass(slots=True)
class Knowledge:
    """What one AUV knows: the number and start (s) of the last round that was announced to it, and
    how long rounds last (s).

    Its next turn is in `slot`, `turn_s` (s) after the start of a round; None: it has none.
    """

    round: int = -1
    starts_s: float = 0.0
    period_s: float = 0.0
    turn_s: float | None = None
    slot: int = 0
    pinged_at_s: float = -np.inf

    def learn(self, plan: AnnouncedRound, turn_s: float | None, slot: int) -> None:
        """Take in the plan of a later round; rounds last as long as on average since the last."""
        if self.round >= 0:
            self.period_s = (plan.starts_s - self.starts_s) / (plan.number - self.round)
        self.round, self.starts_s = plan.number, plan.starts_s
        self.turn_s, self.slot = turn_s, slot


class LastHeard:
    """When the fleet last heard each AUV, by the fixes that it has made.

    An AUV that has not been heard for `forget_after` (s), counted from its launch at first, is
    lost.  Lost AUVs get recall slots in turn.
    """

    def __init__(self, auvs: int, fixes: EventBuffer, forget_after: float | None) -> None:
        self._heard_at, self._fixes, self._noted = np.zeros(auvs), fixes, 0
        self._forget_after = math.inf if forget_after is None else forget_after
        self._recalled_in = np.full(auvs, -1)

    def lost(self, time: float) -> NDArray[np.bool_]:
        """Return which AUVs are lost at an instant (s), (n,)."""
        new = self._fixes.rows[self._noted :]
        np.maximum.at(self._heard_at, new["auv"], new["pinged_at_s"])
        self._noted = self._fixes.count
        return np.asarray(time - self._heard_at > self._forget_after)

    def recall(self, lost: NDArray[np.bool_], number: int) -> int:
        """Return the least recently recalled of the `lost` AUVs (n,), for round `number`."""
        auv = int(np.argmin(np.where(lost, self._recalled_in, number)))
        self._recalled_in[auv] = number
        return auv


class Announcing(NamedTuple):
    """How slots are announced: frames of a round announce the round `ahead` rounds later.

    `missed` is what AUVs do that received no slot (:class:`.announcing.BroadcastSettings`),
    `chance` how likely each pings in a contention slot.  Every `recall_rounds` rounds one lost AUV
    gets a slot.
    """

    ahead: int
    missed: str
    chance: float
    recall_rounds: int


@dataclass
class Dissemination:
    """Announces slots, and knows which AUVs know theirs.

    `view` returns what the fleet knows as it schedules a round, by its number and an instant (s);
    `opens` the earliest start (s) of a round, by its number; `works_from` the first instant (s),
    from a given one on, at which an ASV works.
    """

    env: simpy.Environment
    slots: Slots
    record: Recorder
    downlink: MfDownlink
    ranging: OneWay | TwoWay | BySteps
    schedule: Schedule
    view: Callable[[int, float], View]
    opens: Callable[[int], float]
    works_from: Callable[[float], float]
    last_heard: LastHeard
    announcing: Announcing
    auvs: list[Knowledge]
    streams: Streams
    _plans: dict[int, AnnouncedRound] = field(default_factory=dict, init=False)
    _under_way: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._luck = cache(partial(self.streams.of, Purpose.CONTENTION))

    def planned(self, number: int, time: float) -> AnnouncedRound:
        """Return the plan of a round that begins at an instant (s).

        If it was not announced, or begins later than announced because no ASV worked, no AUV knows
        it.
        """
        if not self._plans:
            self._agree()
        plan = self._plans.get(number)
        if plan is None:
            plan = self._plans[number] = self._plan(number, time, time)
        elif plan.starts_s != time:
            plan.forget(time)
        self._under_way = number
        self._plans.pop(number - 1, None)  # no AUV can use the plan of a round that is over
        return plan

    def _agree(self) -> None:
        """Agree before the launch on the rounds that no frame can announce."""
        starts = 0.0
        for number in range(self.announcing.ahead):
            starts = max(starts, self.opens(number))
            plan = self._plans[number] = self._plan(number, 0.0, starts, starts)
            plan.informed[:] = True
            starts = self._slot_starts(plan.groups, plan.starts_s)[-1]
            for auv in range(len(self.auvs)):
                self._learn(auv, plan)
        count = len(plan.named)
        lasts = starts - plan.starts_s, self.slots.downlink_slot(count, count)
        # a broadcast is expected to carry a fix of each AUV
        for auv, knowledge in enumerate(self.auvs):
            knowledge.period_s = sum(lasts) if self.announcing.ahead == 1 else max(lasts)
            self._reckon(auv, 1)

    def assign(self, number: int, time: float, senders: Sequence[int]) -> dict[int, list[int]]:
        """Plan the round that a broadcast of round `number`, which begins at `time` (s), announces.

        Return for each ASV of `senders` the AUVs that its frames name: those to which it is the
        nearest.
        """
        ahead, count = number + self.announcing.ahead, len(self.auvs)
        lasts = len(senders) * self.slots.downlink_slot(count, count)  # at most, one by one
        if self.announcing.ahead > 1:  # the round before it begins with the broadcast
            if ahead - 1 not in self._plans:
                self._plans[ahead - 1] = self._plan(ahead - 1, time, time)
            before = self._plans[ahead - 1]
            lasts = max(lasts, self._slot_starts(before.groups, before.starts_s)[-1] - time)
        lasts = max(lasts, self.opens(ahead) - time)
        plan = self._plans[ahead] = self._plan(ahead, time, time, lasts)
        plan.awaited = len(senders)
        named: dict[int, list[int]] = {asv: [] for asv in senders}
        away = np.linalg.norm(plan.view.auvs[:, None, :2] - plan.view.asvs[senders, :2], axis=2)
        for auv in plan.named:
            named[senders[int(away[auv].argmin())]].append(auv)
        return named

    def foretell(self, number: int, ends: float) -> None:
        """Set the start of the round that round `number` has announced: the end (s) of its downlink
        slot, or later, if the round before it or its time frame asks for that.
        """
        ahead = number + self.announcing.ahead
        plan, starts = self._plans[ahead], [ends, self.opens(ahead)]
        if self.announcing.ahead > 1:
            starts.append(self._slot_starts(self._plans[ahead - 1].groups, plan.starts_s)[-1])
        plan.starts_s = max(starts)

    def send(self, number: int, broadcast: int, part: int, named: Sequence[int]) -> None:
        """Note that an ASV sends a frame of round `number`, a row of broadcasts, that names AUVs;
        `part` counts the ASV's frames of that broadcast from 0.
        """
        plan = self._plans[number + self.announcing.ahead]
        plan.frames.append((broadcast, named))
        plan.awaited -= part == 0

    def _plan(
        self, number: int, time: float, starts: float, ahead_s: float = 0.0
    ) -> AnnouncedRound:
        """Return the plan of a round that begins at `starts` (s), by what the fleet knows at `time`
        (s); it expects the start `ahead_s` (s) after that at the latest.
        """
        view, lost = self.view(number, time), self.last_heard.lost(time)
        view.heard[lost] = False
        view.lost, view.ahead_s = tuple(np.flatnonzero(lost).tolist()), ahead_s
        asked = self.schedule(view)
        assert view.known is not None
        view.known.give_turns(asked, view.heard, number)
        groups = [[auv for auv in group if not lost[auv]] for group in asked]
        lengths = list(asked.lengths_s) if isinstance(asked, TimedGroups) else []
        if not lengths:  # empty slots of T_UL can be left out
            groups = [group for group in groups if group] or [[]]
        if self.announcing.missed == "contention":
            groups.append([])
        elif lost.any() and number % self.announcing.recall_rounds == 0:
            groups.append([self.last_heard.recall(lost, number)])
        lengths += [self.slots.uplink_slot] * (len(groups) - len(lengths))
        uninformed = np.zeros(len(lost), dtype=np.bool_)
        return AnnouncedRound(number, view, TimedGroups(groups, lengths), starts, uninformed)

    def _slot_starts(self, groups: TimedGroups, starts: float) -> list[float]:
        """Return when (s) the slots of a round begin, and when the last of them ends."""
        return list(accumulate(groups.lengths_s, self.slots.clock.after, initial=starts))

    def known(self, row: Round, slot: int, time: float) -> list[int]:
        """Return the AUVs that ping in a slot of a round, from an instant (s) on.

        They are the AUVs of its group that know the slot; in a contention slot the AUVs that know
        when it begins, have not had a turn, and dare to ping by chance.
        """
        self._hear(time)
        plan = self._plans[row.round]
        row.assigned, row.informed = len(plan.named), row.informed or 0
        if self.announcing.missed == "contention" and slot == len(plan.groups) - 1:
            heard = np.flatnonzero(plan.informed).tolist()
            late = [auv for auv in heard if self.auvs[auv].pinged_at_s < plan.starts_s]
            group = [auv for auv in late if self._dares(auv)]
        else:
            for auv in plan.groups[slot]:
                self._note(plan, slot, auv, time)
            group = [auv for auv in plan.groups[slot] if plan.informed[auv]]
            row.informed += len(group)
        able = [auv for auv in group if self._is_quiet(auv, time)]
        for auv in able:
            self.auvs[auv].pinged_at_s = time
        return able

    def _note(self, plan: AnnouncedRound, slot: int, auv: int, time: float) -> None:
        """Record whether an AUV knows its slot."""
        number = plan.frame_of(auv)
        frame = None if number is None else self.record.broadcasts[number]
        self.record.assignments.append(
            Assignment(
                plan.number,
                slot,
                auv,
                time,
                told_at_s=None if frame is None else frame.sent_at_s,
                told_by=None if frame is None else frame.asv,
                outcome="known" if plan.informed[auv] else "missed",
            )
        )

    def _dares(self, auv: int) -> bool:
        return bool(self._luck(auv).random() < self.announcing.chance)

    def _is_quiet(self, auv: int, time: float) -> bool:
        """Return whether the last ping of an AUV is over."""
        return time - self.auvs[auv].pinged_at_s >= self.slots.ping_duration

    def _hear(self, time: float) -> None:
        """Let AUVs learn the plans of frames that they have decoded by an instant (s)."""
        for plan in self._plans.values():
            for auv in plan.learn(self.downlink.decoded, time):
                if plan.number > self.auvs[auv].round:
                    self._learn(auv, plan)
                    self._reckon(auv, 1)

    def _learn(self, auv: int, plan: AnnouncedRound) -> None:
        """Let an AUV know a plan: its slot, and when its turn begins."""
        slot = plan.slot_of(auv)
        if self.announcing.missed == "contention":
            slot = len(plan.groups) - 1
        turn = None
        if slot is not None and self.announcing.missed != "silent":
            turn = self._slot_starts(plan.groups, plan.starts_s)[slot] - plan.starts_s
        self.auvs[auv].learn(plan, turn, slot or 0)

    def _reckon(self, auv: int, rounds: int) -> None:
        """Schedule an AUV's turn by its own reckoning, `rounds` rounds after the last that was
        announced to it, or in the first later one whose turn is not past.
        """
        knowledge = self.auvs[auv]
        if knowledge.turn_s is None:
            return
        instant = self._reckoned(knowledge, rounds)
        while instant < self.env.now:
            rounds += 1
            instant = self._reckoned(knowledge, rounds)
        event = moment(self.env, instant)
        event.callbacks.append(partial(self._turn, auv, knowledge.round, rounds, instant))

    def _reckoned(self, knowledge: Knowledge, rounds: int) -> float:
        assert knowledge.turn_s is not None
        return self.slots.clock.after(
            knowledge.starts_s, rounds * knowledge.period_s + knowledge.turn_s
        )

    def _turn(
        self, auv: int, informed: int, rounds: int, instant: float, _: simpy.Event | None = None
    ) -> None:
        """Let an AUV ping at `instant` (s), in the turn that it has reckoned from round `informed`,
        unless a later round has been announced to it.
        """
        self._hear(instant)
        knowledge = self.auvs[auv]
        if knowledge.round != informed:
            return
        luck = self.announcing.missed == "last_slot" or self._dares(auv)
        if luck and self._is_quiet(auv, instant):
            knowledge.pinged_at_s = instant
            plan = self._plan_at(instant)
            self.ranging.ping(plan.number, knowledge.slot, [auv], instant, plan.view)
        self._reckon(auv, rounds + 1)

    def _plan_at(self, instant: float) -> AnnouncedRound:
        """Return the plan of the round under way; if the next begins just now, of that."""
        following = self._plans.get(self._under_way + 1)
        if following is None or following.starts_s > instant + SAME:
            return self._plans[self._under_way]
        begins = self.works_from(following.starts_s) == following.starts_s
        return following if begins else self._plans[self._under_way]
