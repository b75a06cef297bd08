"""Passive ranging (piUSBL): ASVs take turns to ping, and every AUV that hears one fixes itself.

Nobody schedules AUVs, and nobody answers them.
"""

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from itertools import count

import simpy

from ..navigation.navigators import Navigator
from ..records.events import Round
from ..records.rows import Recorder
from ..vehicles.fleet import VehicleFleet
from .happenings import Happenings, Watched
from .hf.band import HfBand
from .hf.outcomes import Outcomes
from .mf.downlink import Deliveries
from .slots import Slots
from .steps import moment, some_work


class OwnFixes(Deliveries):
    """The fixes that AUVs make themselves: each has its own as soon as it has decoded a ping."""

    def __init__(
        self,
        env: simpy.Environment,
        auvs: VehicleFleet,
        navigator: Navigator,
        record: Recorder,
        outcomes: Outcomes,
    ) -> None:
        super().__init__(env, auvs, navigator, record)
        self._record, self._outcomes = record, outcomes

    def expect(self, pings: range) -> None:
        """Let AUVs that steer by their fixes, or are moved meanwhile, have each at its instant.

        The others' are settled later, each with its own instant all the same.
        """
        if not self._auvs.foreseen:
            for ping in self._record.pings.array[pings.start : pings.stop]:
                for row in range(ping["first"], ping["end"]):
                    instant = float(self._record.receptions.array[row]["arrived_at_s"])
                    self._at(instant, partial(self._near, row))

    def _near(self, row: int) -> None:
        """Wait for the end of a ping that is nearly there."""
        self._outcomes.update_arrivals(self._env.now)
        reception, lasts = self._record.receptions.array[row], self._outcomes.band.duration
        ends = float(reception["arrived_at_s"]) + lasts
        self._at(ends, partial(self.settle, ends))

    def _at(self, instant: float, verb: Callable[[], None]) -> None:
        moment(self._env, instant).callbacks.append(lambda _: verb())

    def settle(self, time: float) -> None:
        """Let AUVs have all fixes that they have made by an instant (s)."""
        self._outcomes.resolve_passed(time)
        self.deliver(time)


@dataclass
class PassiveNetwork(Watched):
    """What passive ranging runs on: the slots and the band, and who waits for what happens."""

    env: simpy.Environment
    slots: Slots
    auv_fleet: VehicleFleet
    asv_fleet: VehicleFleet
    record: Recorder
    uplink: HfBand
    outcomes: Outcomes
    deliveries: OwnFixes

    def __post_init__(self) -> None:
        counts = {"auv": len(self.auv_fleet), "asv": len(self.asv_fleet)}
        self.watching = Happenings(
            self.env,
            self.record,
            self.uplink,
            self.outcomes,
            self.deliveries,
            counts,
            heard_is_had=True,
        )

    def close(self, time: float) -> None:
        """Settle what is under way as the mission ends at an instant (s)."""
        self.deliveries.settle(math.nextafter(time, 0.0))


def take_turns(network: PassiveNetwork) -> Generator[simpy.Event, None, None]:
    """Let the ASVs ping one after the other, a slot each, from the mission's start to its end.

    Nobody hears two of them in one slot, wherever the AUVs are: the ASVs need not know.  Those that
    have failed by the start of a round have no slot in it; who fails later leaves its own empty.
    """
    time, asvs = 0.0, network.asv_fleet
    for number in count():
        time = yield from some_work(network.env, asvs, network.slots.clock, time)
        failed = asvs.failed(time)
        turns = [asv for asv in range(len(asvs)) if asv not in failed]
        row = Round(number, time, colours=len(turns), conflicts=0, downlink_s=0.0)
        network.record.rounds.append(row)
        for slot, asv in enumerate(turns):
            if asv not in asvs.failed(time):
                network.deliveries.expect(network.uplink.send(number, slot, [asv], time))
            time = network.slots.clock.after(time, network.slots.uplink_slot)
            yield moment(network.env, time)
            row.uplink_s = time - row.started_at_s
            network.deliveries.settle(time)
