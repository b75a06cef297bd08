"""The network of a mission: both bands, what decides outcomes on them, and what the fleet knows."""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from math import nextafter
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy
from numpy.random import Generator as RandomStream

from ...support.arrays import Flags, Floats, Ints
from ...support.facts import cached_property
from ..acoustics.messages import Message
from ..records.events import HEARD, Round
from ..records.rows import Recorder, Rows
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places
from .acknowledged import Acknowledged, Repeating, known_by
from .answers import Answers
from .data import Data
from .deliveries import Deliveries, OwnFixes
from .dissemination import Dissemination
from .exchange import Exchange
from .frames import MfDownlink, Replies
from .happenings import Happenings, Watch
from .outcomes import Outcomes
from .pings import HfBand
from .predicted_positions import PredictedPositions
from .ranging import BySteps, OneWay, TwoWay
from .slots import Slots
from .view import Groups, KnownFixes, Schedule, View

if TYPE_CHECKING:
    from .access.air import SharedAir
    from .access.hosted import Modem

Steps = Generator[simpy.Event, None, float]

# An ASV's share of a broadcast: its number, and the indices of its fixes among the k
Share = tuple[int, Ints]

# Fixes by their rows in the record; fixes that wait are a range.
Fixes = range | Ints


class BroadcastView:
    """What the surface fleet knows when it broadcasts k fixes; k may be 0.

    `number` counts the broadcasts of the mission, this one begins at `time` (s), there are `count`
    ASVs, and `random` is the broadcaster's own random stream.  `reached` tells which AUVs the fleet
    believes within MF range of which ASVs.
    """

    def __init__(
        self,
        number: int,
        time: float,
        record: Recorder,
        rows: Fixes,
        fleet: VehicleFleet,
        random: np.random.Generator,
        reached: Callable[[float], Flags],
        acknowledged: Acknowledged | None = None,
    ) -> None:
        """`rows` are fixes of the record; `acknowledged` None: AUVs acknowledge none."""
        self._acknowledged = acknowledged
        self.number, self.time, self.count, self.random = number, time, len(fleet.vehicles), random
        self._record, self._rows, self._fleet, self._reached = record, rows, fleet, reached

    @cached_property
    def fixes(self) -> Floats:
        """Positions of the AUVs by the fixes (m), shape (k, 3)."""
        fixes = rows_of(self._record, self._rows)
        return np.column_stack((fixes["x_m"], fixes["y_m"], fixes["z_m"]))

    @cached_property
    def asvs(self) -> Floats:
        """Positions of the m ASVs (m), shape (m, 3)."""
        return places(self._fleet.motion, self.time)[:, :3]

    @property
    def failed(self) -> tuple[int, ...]:
        """The ASVs that have failed and cannot broadcast."""
        return self._fleet.failed(self.time)

    @cached_property
    def heard(self) -> Flags:
        """Which ASVs' measurements were fused for each fix, shape (k, m)."""
        return hearers(self._record, self._rows, self.count)

    @cached_property
    def listeners(self) -> Flags:
        """Which AUVs the fleet believes within MF range of each ASV, shape (n, m)."""
        return self._reached(self.time)

    @property
    def acknowledged_at_s(self) -> Floats:
        """Since when (s) the fleet has known that each AUV has its newest acknowledged fix, (n,);
        NaN before the first.

        Raises:
            LookupError: where AUVs do not acknowledge (`protocol.acknowledge`).
        """
        return known_by(self._acknowledged).at_s


def rows_of(record: Recorder, rows: Fixes) -> Rows:
    """Return fixes of a record by their rows."""
    if isinstance(rows, range):
        return record.fixes.array[rows.start : rows.stop]
    chosen: Rows = record.fixes.array[rows]
    return chosen


def hearers(record: Recorder, rows: Fixes, asvs: int) -> Flags:
    """Return for each fix of `rows` which ASVs' measurements were fused, (k, `asvs`)."""
    fused = np.zeros((len(rows), asvs), dtype=np.bool_)
    if len(rows):
        fixes = rows_of(record, rows)
        begin = int(fixes["first"].min())
        receptions = record.receptions.array[begin : int(fixes["end"].max())]
        heard = np.flatnonzero(receptions["outcome"] == HEARD)
        first = np.searchsorted(heard, fixes["first"] - begin)
        end = np.searchsorted(heard, fixes["end"] - begin)
        before = np.repeat(np.cumsum(end - first) - end, end - first)
        hearing = heard[np.arange(len(before)) - before]
        fix = np.repeat(np.arange(len(fixes)), end - first)
        fused[fix, receptions["asv"][hearing]] = True
    return fused


#: Returns the ASV that sends all fixes, or slot after slot the shares of several ASVs.
Broadcaster = Callable[[BroadcastView], int | list[list[Share]]]


@dataclass(slots=True)
class Turn:
    """A round under way: its row in the record; its ping groups, one for each slot, and the lengths
    of the slots (s), T_UL unless the schedule says otherwise; and what the fleet knew when it
    began.
    """

    row: Round
    groups: Groups
    lengths_s: Sequence[float]
    view: View


Downlink = Callable[["Network", Turn, float], Steps]


@dataclass
class HfNetwork:
    """What pings of AUVs or ASVs run on: slots, HF band (`uplink`), and `deliveries` of fixes."""

    env: simpy.Environment
    slots: Slots
    auv_fleet: VehicleFleet
    asv_fleet: VehicleFleet
    record: Recorder
    uplink: HfBand
    outcomes: Outcomes
    deliveries: Deliveries

    def __post_init__(self) -> None:
        self.watching = Happenings(
            self.env, self.record, self.uplink, self.outcomes, self.deliveries
        )
        #: Modems that outside hosts control, by the names of their vehicles.
        self.modems: Mapping[str, Modem] = {}

    def happening(self, kind: str, **which: Any) -> simpy.Event:
        """Return the event of the next happening of a kind, at its exact instant.

        Its value is a :class:`.happenings.Happening`, which lists the kinds.  `which` are values
        that columns of its row must have: ``happening("delivery", auv=1)``.

        Raises:
            ValueError: for an unknown kind or column, or a value that the column never has.
        """
        return self.watching.next(kind, which, self.env.now)

    def happenings(self, *kinds: str, **which: Any) -> Watch:
        """Return all happenings of some kinds from now on, one after the other by its `next()`.

        Of two at one instant :meth:`happening` returns the first alone.
        """
        return self.watching.watch(kinds, which, self.env.now)


@dataclass
class Network(HfNetwork):
    """What the protocol runs on: slots and bands, the parts that decide, and what the fleet knows.

    `uplink` is the HF band and `deliveries` the MF band; `downlink` decides when which fixes travel
    on MF.  Rounds start every `frame_s` (s), or as soon as they can if it is 0, and later by
    `paused` (s), the time in which no ASV worked.  The fleet schedules by the predicted `positions`
    of AUVs, and schedules may ask what it expects of their `estimates`.  Slots of polling end with
    the `answers`. `dissemination` announces slots to AUVs; without it all know them at once.  Fixes
    wait for a broadcast, unless `replies` answer each ping by itself.  Where AUVs acknowledge or
    relay frames, or fixes are repeated, `deliveries` are the `exchange`, and the fleet knows which
    fixes were `acknowledged`.  AUVs may have `data` to send after their pings.
    """

    deliveries: MfDownlink
    ranging: OneWay | TwoWay | BySteps
    downlink: Downlink
    frame_s: float
    schedule: Schedule
    schedule_draw: RandomStream
    broadcaster: Broadcaster
    broadcaster_draw: RandomStream
    mf_range: float
    mf_slant: bool
    positions: PredictedPositions
    estimates: KnownFixes
    answers: Answers | None = None
    dissemination: Dissemination | None = None
    replies: Replies | None = None
    downlink_free_at: float = 0.0
    paused: float = 0.0
    air: "SharedAir | None" = None  # where vehicles run access programs
    exchange: Exchange | None = None
    acknowledged: Acknowledged | None = None
    repeating: Repeating | None = None
    data: Data | None = None
    broadcasts: int = field(default=0, init=False)  # number so far
    fixes_taken: int = field(default=0, init=False)  # fixes before this one do not wait any more

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.replies is not None:
            self.uplink.answered_by = self.replies.expect

    def opens(self, round_number: int) -> float:
        """Return the earliest start (s) of a round, at which its time frame begins."""
        return self.slots.clock.after(0.0, round_number * self.frame_s + self.paused)

    def view(self, round_number: int, time: float) -> View:
        """Return the fleet's knowledge as it schedules a round."""
        if self.positions.follow_fixes or self.exchange is not None:
            self.outcomes.resolve_passed(time)  # pings may acknowledge fixes, too
        auvs, asvs, heard = self.positions.seen(time)
        band = self.uplink.band
        return View(
            round_number, time, auvs, asvs, heard, band.reach,
            "slant" if band.slant else "horizontal", self.schedule_draw,
            self.asv_fleet.failed(time), self.slots, self.estimates,
            acknowledged=self.acknowledged,
        )  # fmt: skip

    def listeners(self, time: float) -> Flags:
        """Return which AUVs the fleet believes within MF range of each ASV at an instant (s)."""
        return self.positions.within(self.mf_range, self.mf_slant, time)

    def has_fix(self, time: float) -> bool:
        """Return whether a fix waits, of pings decided by an instant (s)."""
        return self.outcomes.resolve_passed(time).stop > self.fixes_taken

    def behind_s(self, asv: int, time: float, messages: Sequence[Message], fixes: Ints) -> float:
        """Return how long (s) AUVs send after a broadcast of some messages, which carry `fixes`,
        rows of the record, and begin at an instant (s).
        """
        assert self.exchange is not None
        return self.exchange.follow(asv, time, messages, fixes)

    def take_fixes(self, time: float) -> Fixes:
        """Return the fixes that wait, the oldest first, as many as one broadcast carries; then
        fixes to be repeated, as far as they fit.

        Pings that have passed all ASVs by an instant (s) are decided and measured here.
        """
        first, end = self.fixes_taken, self.outcomes.resolve_passed(time).stop
        messages = self.slots.messages
        if messages.most is not None and not messages.splits:
            end = min(end, first + messages.most)
        self.fixes_taken = end
        if self.repeating is None:
            return range(first, end)
        room = None if messages.most is None or messages.splits else messages.most - (end - first)
        return self.repeating.with_due(range(first, end), room)

    def close(self, time: float) -> None:
        """Decide what is in flight as the mission ends at an instant (s)."""
        before_the_end = nextafter(time, 0.0)
        self.uplink.answered_by = self.dissemination = None  # no ping is answered any more
        self.outcomes.resolve_passed(before_the_end)  # heard, but not broadcast any more
        self.outcomes.close(time)
        if self.air is not None:
            self.air.close(time)
        if self.data is not None:
            self.data.close(time)
        self.ranging.close()
        self.deliveries.close(before_the_end)


@dataclass
class PassiveNetwork(HfNetwork):
    """What passive ranging runs on: ASVs ping in turn, and AUVs fix themselves."""

    deliveries: OwnFixes

    def close(self, time: float) -> None:
        """Decide what is in flight as the mission ends at an instant (s)."""
        self.deliveries.settle(nextafter(time, 0.0))
