"""The network of a mission: both bands, and the surface fleet that schedules and broadcasts."""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
import simpy
from numpy.random import Generator as RandomStream

from ..acoustics.modem import Message
from ..records.events import Round
from ..records.recorder import Recorder
from ..vehicles.fleet import Fleet
from ..vehicles.motion import Ints
from .broadcasters import Broadcaster, BroadcastView
from .fix_batch import FixBatch
from .happenings import Happenings, Watched
from .hf.outcomes import Outcomes
from .hf.uplink import Uplink
from .knowledge.telling import Telling
from .lookout import Lookout
from .mf.downlink import MfDownlink
from .own.ranging import OwnRanging
from .ranging import OneWay, TwoWay
from .replies import Replies
from .schedules.known import Known
from .schedules.named import Schedule
from .schedules.polling import Answers
from .schedules.view import Groups, TimedGroups, View
from .slots import Slots

Steps = Generator[simpy.Event, None, float]


@dataclass(slots=True)
class Turn:
    """A round under way: its row in the record, its ping groups, one for each slot, what the fleet
    knew when it began, and the uplink slot T_UL (s).
    """

    row: Round
    groups: Groups
    view: View
    uplink_slot: float

    def length(self, slot: int) -> float:
        """Return how long (s) a slot lasts: T_UL, unless the schedule has said how long."""
        groups = self.groups
        return groups.lengths_s[slot] if isinstance(groups, TimedGroups) else self.uplink_slot


class Carried(NamedTuple):
    """What an ASV sends of a broadcast: fixes, rows of the record, and to whom it tells a slot."""

    asv: int
    fixes: Ints
    named: Sequence[int] = ()

    def split(self, messages: Sequence[Message]) -> "list[Carried]":
        """Return what each of some messages holds of it."""
        if len(messages) == 1:
            return [self]
        parts, fixes, named = [], self.fixes, self.named
        for count, told, *_ in messages:
            parts.append(Carried(self.asv, fixes[:count], named[:told]))
            fixes, named = fixes[count:], named[told:]
        return parts


Downlink = Callable[["Network", Turn, float], Steps]


@dataclass
class Network(Watched):
    """What the protocol runs on: slots and bands, who decides what, and what the fleet knows.

    `policy` is the downlink; rounds start every `frame` (s), or as soon as they can if it is 0;
    all later by what they have `paused` (s), while no ASV worked.
    The `lookout` says where the fleet believes AUVs to be.  What it expects of their `estimates`
    schedules may ask; slots that end with `answers` wait for these.
    `telling` is who knows which slots; without it everybody knows all of them at once.
    Fixes wait for a broadcast, unless `replies` answer each ping by itself.
    """

    env: simpy.Environment
    slots: Slots
    auv_fleet: Fleet
    asv_fleet: Fleet
    record: Recorder
    uplink: Uplink
    outcomes: Outcomes
    downlink: MfDownlink
    ranging: OneWay | TwoWay | OwnRanging
    policy: Downlink
    frame: float
    schedule: Schedule
    schedule_draw: RandomStream
    broadcaster: Broadcaster
    broadcaster_draw: RandomStream
    mf_range: float
    lookout: Lookout
    estimates: Known
    answers: Answers | None = None
    telling: Telling | None = None
    replies: Replies | None = None
    downlink_free_at: float = 0.0
    paused: float = 0.0
    _broadcasts: int = field(default=0, init=False)
    _fixes_taken: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        counts = {"auv": len(self.auv_fleet), "asv": len(self.asv_fleet)}
        self.watching = Happenings(
            self.env, self.record, self.uplink, self.outcomes, self.downlink, counts
        )
        if self.replies is not None:
            self.uplink.answered_by = self.replies.expect
        self._reached = partial(self.lookout.within, self.mf_range)

    def planned(self, round_number: int, time: float) -> tuple[View, Groups]:
        """Return what the fleet knew when it scheduled a round that begins now, and its groups."""
        if self.telling is None:
            view = self.view(round_number, time)
            return view, self.schedule(view)
        plan = self.telling.planned(round_number, time)
        return plan.view, plan.groups

    def pinging(self, turn: Turn, slot: int, time: float) -> Sequence[int]:
        """Return those of a slot's ping group that know it as it begins, at an instant (s)."""
        if self.telling is None:
            return turn.groups[slot]
        return self.telling.known(turn.row, slot, time)

    def foretell(self, turn: Turn, ends: float) -> None:
        """Have the frames of a round say when another begins, the downlink slot being over then."""
        if self.telling is not None:
            self.telling.foretell(turn.row.round, ends)

    def tell(self, turn: Turn, named: Sequence[int]) -> None:
        """Note which AUVs the frame names that has just begun."""
        if self.telling is not None:
            self.telling.send(turn.row.round, len(self.record.broadcasts) - 1, named)

    def opens(self, round_number: int) -> float:
        """Return the earliest instant (s) at which a round may begin: that of its frame."""
        return self.slots.clock.after(0.0, round_number * self.frame + self.paused)

    def view(self, round_number: int, time: float) -> View:
        """Return what the fleet knows when it schedules a round."""
        seen, band = self.lookout.seen(time), self.uplink.band
        metric, failed = "slant" if band.slant else "horizontal", self.asv_fleet.failed(time)
        known = self.slots, self.estimates
        return View(
            round_number, time, *seen, band.reach, metric, self.schedule_draw, failed, *known
        )

    def has_fix(self, time: float) -> bool:
        """Tell whether a fix waits, of pings that have been heard by an instant (s)."""
        return self.outcomes.decide_passed(time).stop > self._fixes_taken

    def _taken(self, time: float) -> FixBatch:
        """Return the fixes that wait, the oldest first, as many as one broadcast carries."""
        first, end = self._fixes_taken, self.outcomes.decide_passed(time).stop
        messages = self.slots.messages
        if messages.most is not None and not messages.splits:
            end = min(end, first + messages.most)
        self._fixes_taken = end
        return FixBatch(self.record, range(first, end))

    def shared(self, turn: Turn, time: float) -> list[list[Carried]]:
        """Return which ASVs send what of the next broadcast, which begins at an instant (s): those
        of a list at once, one list after the other.
        """
        batch, number = self._taken(time), self._broadcasts
        self._broadcasts += 1
        draw, fleet = self.broadcaster_draw, self.asv_fleet
        rows = np.arange(batch.rows.start, batch.rows.stop)
        chosen = self.broadcaster(BroadcastView(number, time, batch, fleet, draw, self._reached))
        if isinstance(chosen, int):
            shares = [[Carried(chosen, rows)]]
        else:
            shares = [[Carried(asv, rows[own]) for asv, own in it] for it in chosen]
        if self.telling is None:
            return shares
        senders = [share.asv for slot in shares for share in slot]
        named = self.telling.assign(turn.row.round, time, senders)
        return [[share._replace(named=named[share.asv]) for share in slot] for slot in shares]

    def close(self, time: float) -> None:
        """Settle what is under way as the mission ends at an instant (s)."""
        before_the_end = math.nextafter(time, 0.0)
        self.uplink.answered_by = self.telling = None  # nobody is answered or told any more
        if self.replies is None:
            self.outcomes.decide_passed(before_the_end)  # heard, but not broadcast any more
        self.outcomes.close(time)
        self.ranging.close()
        self.downlink.close(before_the_end)
