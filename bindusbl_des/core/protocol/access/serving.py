"""Random access: AUVs ping when their programs decide, ASVs broadcast the fixes.

Each vehicle runs its program (:mod:`.node`), beside the downlink.  A round is a cycle of the
downlink: from when MF is free, over the broadcast that begins as soon as a fix waits, to the end of
its slot.  HF does not wait for it.
"""

from collections.abc import Iterator
from heapq import heappop, heappush
from math import inf
from typing import Any

import numpy as np

from ....support.arrays import Floats
from ....support.plugins import OwnPart
from ....support.streams import Purpose, Streams
from ...records.events import Round
from ...scenario.families import ACCESS
from ...scenario.part_choice import checked_part
from ...scenario.sections.protocol import Protocol
from ..conflicts import conflict_count
from ..network import Network, Turn
from ..steps import checked_steps, moment
from ..tdma import broadcast
from .air import SharedAir
from .node import Node, Program, Steps

# Intervals that are drawn at once
DRAWN = 64


def _checked(part: OwnPart, node: Node) -> Steps:
    """Run the steps of a user-defined program.

    Raises:
        PluginError: when it raises anything, or yields what is no event of the mission.
    """

    def when() -> str:
        return f" for {node.name} at {node.air.env.now:g} s"

    yield from checked_steps(part, part(node, when=when()), node.air.env, when)


def poisson(draw: np.random.Generator, mean_s: float) -> Iterator[float]:
    """Yield the instants (s) of a Poisson process from 0 on, with a mean interval (s).

    >>> instants = poisson(np.random.default_rng(0), 2.0)
    >>> [round(next(instants), 2) for _ in range(3)]
    [1.36, 3.4, 3.44]
    """
    time = 0.0
    while True:
        for interval in draw.standard_exponential(DRAWN).tolist():
            time += mean_s * interval
            yield time


def run_programs(
    network: Network,
    protocol: Protocol,
    streams: Streams,
    bit_rate_bps: float,
    clocks: Floats,
) -> None:
    """Start the program of each AUV, and of each ASV if the program has a part for it; serve the
    downlink meanwhile.  `clocks` (n, 2) says how late (s) the clock of each AUV is at first, and
    how much later each second; ASVs have GNSS time.

    Each vehicle draws when it has something to send from a stream of its own, so that a further AUV
    changes nothing for the others.
    """
    cycles = Cycles(network)

    def ping(auvs: Any, time: float, waited: Floats | None, level_db: float | None) -> range:
        pings = network.uplink.send(cycles.number, 0, auvs, time, waited=waited, level_db=level_db)
        cycles.expect(pings)
        return pings

    traits = ACCESS.declared(protocol.program)
    program: Program = checked_part(ACCESS, protocol.program, _checked)
    air = SharedAir(
        network.env, network.uplink, network.record, streams, bit_rate_bps=bit_rate_bps,
        hearing=traits.hears or protocol.acknowledges_pings, ping=ping, data=network.data,
        watching=network.watching, outcomes=network.outcomes,
    )  # fmt: skip
    on_asvs = traits.on_asvs or protocol.acknowledges_pings
    for number, name in enumerate(air.names if on_asvs else air.names[: air.auvs]):
        whose = (number,) if number < air.auvs else (number - air.auvs, 0)
        node = Node(
            name,
            network.slots,
            streams.of(Purpose.BACKOFF, *whose),
            poisson(streams.of(Purpose.PACKET, *whose), protocol.frame_s),
            air,
            number,
            tuple((-clocks[number]).tolist()) if number < air.auvs else (0.0, 0.0),
        )
        network.env.process(program(node))
    if protocol.signals:
        network.air = air


class Cycles:
    """The downlink's cycles, a round each; with direct replies all pings are of one round."""

    def __init__(self, network: Network) -> None:
        """Begin the first cycle at 0 s."""
        self._network = network
        self._passing: list[tuple[float, int]] = []  # heap: when (s) pings will have passed
        self._is_sending, self._resumes_at = False, inf  # when (s) an ASV works again, if none does
        self._awaited = inf  # the instant (s) of the next wake-up
        self._turn = self._begun(0, 0.0)
        if network.replies is not None:
            self._turn.row.downlink_s = 0.0

    @property
    def number(self) -> int:
        """The number of the cycle under way."""
        return self._turn.row.round

    @property
    def next_at(self) -> float:
        """The next instant (s) at which a cycle ends, or a ping may have become a fix."""
        if self._is_sending:
            return self._network.downlink_free_at
        return min(self._resumes_at, self._passing[0][0] if self._passing else inf)

    def _begun(self, number: int, time: float) -> Turn:
        """Begin a cycle at `time` (s); return its round, which has no ping groups."""
        view = self._network.view(number, time)
        row = Round(number, time, colours=0, conflicts=conflict_count(view.heard))
        self._network.record.rounds.append(row)
        return Turn(row, (), (), view)

    def expect(self, pings: range) -> None:
        """Wait until pings have passed every ASV in range."""
        if self._network.replies is not None:
            return
        for ping in pings:
            passed = float(self._network.record.pings.array[ping]["passed_at_s"])
            if passed < inf:
                heappush(self._passing, (self._network.slots.clock.after(passed, 0.0), ping))
        self._await_next()

    def _await_next(self) -> None:
        """Schedule a wake-up at the next instant at which something is to be done."""
        time = self.next_at
        if time < self._awaited:
            self._awaited = time
            moment(self._network.env, time).callbacks.append(lambda _: self._wake(time))

    def _wake(self, time: float) -> None:
        if time == self._awaited:
            self._awaited = inf
            if self.next_at <= time:
                self._go_on(time)
            self._await_next()

    def _go_on(self, time: float) -> None:
        """Do what is due at an instant (s): end a cycle, broadcast the fixes that wait."""
        network = self._network
        if self._is_sending:
            self._is_sending = False
            self._turn = self._begun(self.number + 1, time)
        has_fix = network.has_fix(time)
        while self._passing and self._passing[0][0] <= time:
            ping = heappop(self._passing)[1]
            if network.record.pings.array[ping]["passed_at_s"] > time:  # ASVs were predicted nearer
                self.expect(range(ping, ping + 1))
        self._resumes_at = inf
        if has_fix:
            works = network.asv_fleet.works_from(time)
            if works > time:
                self._resumes_at = network.slots.clock.after(0.0, works) if works < inf else inf
            else:
                self._turn.row.uplink_s = time - self._turn.row.started_at_s
                broadcast(network, self._turn, time)
                self._is_sending = True
