"""The network of a mission: both bands, and the surface fleet that schedules and broadcasts."""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field

import numpy as np
import simpy
from numpy.random import Generator as RandomStream

from ..records.events import Round
from ..records.recorder import Recorder
from ..vehicles.fleet import Fleet
from ..vehicles.motion import places
from .broadcasters import Broadcaster, BroadcastView
from .chart import Chart
from .conflicts import Array, Hearing, hearing, survey
from .fix_queue import FixBatch, FixQueue, ReplyQueue
from .happenings import Happenings, Watched
from .hf.uplink import Uplink
from .mf.downlink import MfDownlink
from .order.known import Known
from .order.polling import Answers
from .order.view import Groups, TimedGroups, View
from .own.ranging import OwnRanging
from .ranging import OneWay, TwoWay
from .schedules import Schedule
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


# What an ASV sends of a broadcast: its number, and the fixes, rows of the record
Carried = tuple[int, Sequence[int]]

Downlink = Callable[["Network", Turn, float], Steps]


@dataclass
class Network(Watched):
    """What the protocol runs on: slots and bands, who decides what, and what the fleet knows.

    `policy` is the downlink; rounds start every `frame` (s), or as soon as they can if it is 0;
    all later by what they have `paused` (s), while no ASV worked.
    A `chart` tells where the fleet believes the AUVs to be; without one it knows.  What it
    expects of their `estimates` schedules may ask; slots that end with `answers` wait for these.
    Who is within HF range and a `conflict_margin` (m) of an ASV counts as heard by it.
    """

    env: simpy.Environment
    slots: Slots
    auv_fleet: Fleet
    asv_fleet: Fleet
    record: Recorder
    queue: FixQueue | ReplyQueue
    uplink: Uplink
    downlink: MfDownlink
    ranging: OneWay | TwoWay | OwnRanging
    policy: Downlink
    frame: float
    schedule: Schedule
    schedule_draw: RandomStream
    broadcaster: Broadcaster
    broadcaster_draw: RandomStream
    mf_range: float
    chart: Chart | None
    estimates: Known
    answers: Answers | None = None
    conflict_margin: float = 0.0
    downlink_free_at: float = 0.0
    paused: float = 0.0
    _fixes_plotted: int = field(default=0, init=False)
    _broadcasts: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self.watching = Happenings(self.env, self.record, self.uplink, self.downlink)

    def view(self, round_number: int, time: float) -> View:
        """Return what the fleet knows when it schedules a round."""
        asvs, slant = self.asv_fleet.motion, self.uplink.band.slant
        hf_range = self.uplink.band.reach
        reach = hf_range + self.conflict_margin
        self.asv_fleet.reach(time)
        if self.chart is None:
            self.auv_fleet.reach(time)
            seen = survey(self.auv_fleet.motion, asvs, time, reach, slant)
        else:
            plot, own = self._plotted(self.chart, time), places(asvs, time)[:, :3]
            seen = plot, own, hearing(plot, own, reach, slant)
        metric, failed = "slant" if slant else "horizontal", self.asv_fleet.failed(time)
        if failed:
            seen[2][:, failed] = False
        return View(
            *(round_number, time, *seen, hf_range, metric, self.schedule_draw, failed),
            slots=self.slots,
            known=self.estimates,
        )

    def _plotted(self, chart: Chart, time: float) -> Array:
        """Return where the fleet believes the AUVs to be, by all fixes made so far."""
        chart.note(self.record.fixes.rows[self._fixes_plotted :])
        self._fixes_plotted = self.record.fixes.count
        return chart.at(time)

    def _reached(self, time: float) -> Hearing:
        """Return which AUVs the fleet believes within MF range of each ASV, shape (n, m)."""
        asvs = places(self.asv_fleet.motion, time)[:, :3]
        if self.chart is not None:
            auvs = self._plotted(self.chart, time)
        else:
            self.auv_fleet.reach(time)
            auvs = places(self.auv_fleet.motion, time)[:, :3]
        return hearing(np.ascontiguousarray(auvs), np.ascontiguousarray(asvs), self.mf_range, False)

    def shared(self, batch: FixBatch, time: float) -> list[list[Carried]]:
        """Return which ASVs send what of the next broadcast: those of a list at once, one list
        after the other.
        """
        number = self._broadcasts
        self._broadcasts += 1
        draw, fleet = self.broadcaster_draw, self.asv_fleet
        chosen = self.broadcaster(BroadcastView(number, time, batch, fleet, draw, self._reached))
        if isinstance(chosen, int):
            return [[(chosen, batch.rows)]]
        first = batch.rows.start
        return [[(asv, (first + own).tolist()) for asv, own in shares] for shares in chosen]

    def close(self, time: float) -> None:
        """Settle what is under way as the mission ends at an instant (s)."""
        before_the_end = math.nextafter(time, 0.0)
        self.queue.take(before_the_end)  # pings that were heard but not broadcast any more
        self.uplink.close(time)
        self.ranging.close()
        self.downlink.close(before_the_end)
