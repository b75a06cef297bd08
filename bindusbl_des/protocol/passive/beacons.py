"""The HF band with passive ranging: pings of ASVs, and where and when they arrive at AUVs."""

from collections.abc import Callable
from functools import cache, partial
from heapq import heappop, heappush

import numpy as np

from ...acoustics.channel import AskedChannel, Prospects, between, deciding
from ...acoustics.loss import LossTerms
from ...acoustics.propagation import TOUCH, Band
from ...acoustics.travel_time import travel_time
from ...core.streams import Purpose, Streams
from ...records.events import IN_FLIGHT, LOST
from ...records.recorder import EventBuffer, Recorder
from ...vehicles.fleet import Fleet
from ...vehicles.motion import places
from ..hf.handed import spread_in
from .radiation import arrive, radiate

# How far off an ASV believes to be as it pings, in standard deviations: x, y, z
GNSS_NOISE = np.dtype(("f8", (3,)))


class Beacons:
    """ASVs ping: sound spreads at a finite speed; where it arrives is on record as it is sent.

    What becomes of it there is decided later (:class:`.outcomes.PassiveOutcomes`).
    """

    def __init__(
        self,
        auvs: Fleet,
        asvs: Fleet,
        band: Band,
        channel: LossTerms | AskedChannel,
        streams: Streams,
        record: Recorder,
    ) -> None:
        """Put a band together; the channel as of :class:`..hf.uplink.Uplink`."""
        self.band = band
        self._auvs, self._asvs, self._record = auvs, asvs, record
        self._channel, self.receiver, self._way = deciding(channel, band)
        self._gnss = cache(partial(streams.of, Purpose.BEACON))
        #: :data:`GNSS_NOISE`, ping by ping.
        self.gnss_noise = EventBuffer(GNSS_NOISE)
        self._spread_in = spread_in(record, self._way, auvs, asvs)
        self._prospects: dict[int, Prospects] = {}  # of pings, where the channel was asked
        self._nearly_there: list[tuple[float, int]] = []  # instants (s) and receptions, a heap
        #: Whom to tell of pings that have just been sent; nobody unless somebody waits for them.
        self.on_sent: Callable[[range], None] | None = None

    def send(self, round_number: int, slot: int, asv: int, time: float) -> range:
        """Let an ASV ping now, at `time` (s); return its receptions."""
        pings, receptions, noise = self._record.pings, self._record.receptions, self.gnss_noise
        ping, first = pings.count, receptions.count
        self._auvs.advance(time)
        self._asvs.advance(time)
        self._ask(ping, time)
        noise.room_for(1)[ping] = self._gnss(asv).standard_normal(3)
        pings.room_for(1)
        receptions.room_for(len(self._auvs))
        receptions.count = radiate(
            self._spread_in.address, asv, round_number, slot, time, self._auvs.foreseen, ping,
            first,
        )  # fmt: skip
        pings.count = noise.count = ping + 1
        if self._asvs.works_for(asv, time, self.band.duration) < self.band.duration:  # it is cut
            cut = receptions.array[first : receptions.count]
            cut["outcome"][cut["outcome"] == IN_FLIGHT] = LOST
        rows = range(first, receptions.count)
        if not self._auvs.foreseen:
            for row in rows:
                instant = float(receptions.array[row]["arrived_at_s"])
                heappush(self._nearly_there, (instant, row))
        if self.on_sent is not None:
            self.on_sent(range(ping, ping + 1))
        return rows

    def _ask(self, ping: int, time: float) -> None:
        """Ask what becomes of the signals of a ping, but for the disc, which is compiled."""
        if self._channel is None:
            return
        auvs, asvs = (places(it.motion, time)[:, :3] for it in (self._auvs, self._asvs))
        reach = self.band.reach
        prospects = self._channel.prospects(between(time, auvs, asvs, reach, calling=True))
        self._foretell(prospects)
        if not self._auvs.foreseen:
            self._prospects[ping] = prospects

    def _foretell(self, prospects: Prospects) -> None:
        """Have compiled code know what becomes of signals."""
        self._spread_in.renew("way", self._way._replace(prospects=prospects))

    def amend(self, time: float) -> None:
        """Work out the arrivals that are nearly there by an instant (s), at AUVs that have no sure
        future: they steer by their fixes, or an outside program moves them.
        """
        pings, receptions = self._record.pings, self._record.receptions
        while self._nearly_there and self._nearly_there[0][0] <= time + TOUCH:
            row = heappop(self._nearly_there)[1]
            it = receptions.array[row]
            ping = pings.array[it["ping"]]
            place = ping["x_m"], ping["y_m"], ping["z_m"]
            auv, sent_at = self._auvs.vehicles[it["auv"]], float(ping["sent_at_s"])
            travel = travel_time(place, auv.at, sent_at, self.band.sound_speed)
            if self._channel is not None:
                self._foretell(self._prospects[int(it["ping"])])
            arrive(self._spread_in.address, row, travel)
