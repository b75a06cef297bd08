"""AUVs that range each other: which AUV sends when, which answer, and what they measure.

Every `every_s` each AUV has a turn, one after the other, on the HF band beside all pings, with what
that costs there (:mod:`.access.air`): airtime, collisions, deafness, energy.

owtt    the message has the instant of sending and the sender's estimate; an AUV that decodes it
        gets a range by both clocks, with their errors
twtt    the AUV asks, and all that decode this answer in their turns, with their estimates; half
        the round trip is the range, which needs no clock
angles  the message has the sender's depth; an AUV that decodes it measures its direction by an
        array, which needs no clock; elevation angle and both depths give the distance

With an array each AUV also measures the direction of other messages, by the array, attitude and
errors of `usbl`.  The navigators of all AUVs use these measurements (:mod:`..navigation.team`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from math import atan2, cos, hypot, nan, sin, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.streams import Purpose, Streams
from ..navigation.team import PeerSight, SentBelief, Team
from ..records.events import PeerRange
from ..records.rows import Recorder
from ..scenario.families import PeerTraits
from ..usbl.instrument import Usbl
from ..usbl.measuring import NOISE_WIDTH
from ..vehicles.fleet import VehicleFleet
from .access.air import SharedAir
from .access.node import HeardSignal, Node, Steps
from .deliveries import Deliveries

# Kinds of signals: an AUV's message to all others, its question to them, an answer to one of them.
TELLS, ASKS, ANSWERS = "peer", "peer_query", "peer_answer"

# Bytes of a question, and the time (s) between its end and the first answer.
QUESTION_BYTES, TURNAROUND_S = 4, 0.02


class PeerSensors(NamedTuple):
    """What AUVs measure each other with: a USBL without GNSS, with an array or none; how late (s)
    each clock is at first and per second, (n, 2); the misalignment of each array (n,), rad; and a
    function that returns an AUV's measured depth (m) at an instant (s), with its standard
    deviation.
    """

    usbl: Usbl
    has_array: bool
    clocks: Floats
    turned: Floats
    depth: Callable[[int, float], float]
    depth_sd_m: float


class Direction(NamedTuple):
    """A measured bearing, from x towards y, and angle downwards, with standard deviations (rad)."""

    bearing: float
    bearing_sd: float
    steep: float
    steep_sd: float


@dataclass(frozen=True)
class PeerMessage:
    """The content of a message to other AUVs: the sender's estimate (`told`) and measured depth
    (m).  An answer also has when its question was sent and arrived (s), and how far (m) the sender
    has gone by its own dead reckoning since, (2,).
    """

    told: SentBelief
    depth_m: float
    asked_at_s: float = nan
    heard_at_s: float = nan
    gone: Floats | None = None


@dataclass
class Peers:
    """The AUVs of a fleet as they range each other: each has a turn every `every_s` (s), and its
    messages have `message_bytes`.
    """

    air: SharedAir
    fleet: VehicleFleet
    team: Team
    deliveries: Deliveries
    record: Recorder
    streams: Streams
    sensors: PeerSensors
    kind: PeerTraits
    every_s: float
    message_bytes: int
    longest_s: float  # longest travel time (s) of a signal that can be decoded

    def __post_init__(self) -> None:
        self._chance = {
            (auv, sender): self.streams.of(Purpose.PEER, auv, sender)
            for auv in range(self.air.auvs)
            for sender in range(self.air.auvs)
            if auv != sender
        }

    def begin(self, nodes: list[Node]) -> None:
        """Start the processes by which AUVs send and listen."""
        for node in nodes:
            self.air.env.process(self._speak(node))
            self.air.env.process(self._listen(node))

    def _speak(self, node: Node) -> Steps:
        for turn in count():
            yield node.until((turn + (node.number + 1) / self.air.auvs) * self.every_s)
            yield from self._when_free(node)
            if not self.kind.asks:
                yield node.send(TELLS, bytes=self.message_bytes, data=self._message(node))
            else:
                yield node.send(ASKS, bytes=QUESTION_BYTES, data=node.clock)

    def _when_free(self, node: Node) -> Steps:
        """Wait until an AUV sends nothing."""
        while (until := self.air.sends_until(node.number)) > node.clock:
            yield node.until(until)

    def _message(self, node: Node) -> PeerMessage:
        time = node.clock
        self.fleet.advance(time)
        self.deliveries.settle(time)
        return PeerMessage(
            self.team.belief_to_send(node.number, time), self.sensors.depth(node.number, time)
        )

    def _listen(self, node: Node) -> Steps:
        while True:
            heard = yield node.hears()
            if heard.kind == TELLS:
                self._measure(node, heard, heard.data, heard.began_at_s - heard.data.told.sent_at_s)
            elif heard.kind == ASKS:
                self.air.env.process(self._answer(node, heard))
            elif heard.kind == ANSWERS and heard.to == node.name:
                said = heard.data
                there = said.heard_at_s - said.asked_at_s
                back = heard.began_at_s - said.told.sent_at_s
                self._measure(node, heard, said, 0.5 * (there + back))

    def _answer(self, node: Node, heard: HeardSignal) -> Steps:
        """Answer a question, after the answers of AUVs with lower numbers."""
        asker = self.air.names.index(heard.sender)
        others = node.number - (node.number > asker)
        slot = node.lasts_s(self.message_bytes) + self.longest_s
        yield node.wait(TURNAROUND_S + others * slot)
        yield from self._when_free(node)
        came, before = heard.began_at_s, self._reckoned(node.number, heard.began_at_s)
        message = self._message(node)
        gone = self._reckoned(node.number, message.told.sent_at_s) - before
        message = PeerMessage(message.told, message.depth_m, heard.data, came, gone)
        yield node.send(ANSWERS, to=heard.sender, bytes=self.message_bytes, data=message)

    def _reckoned(self, auv: int, time: float) -> Floats:
        dr = self.team.dr(auv, time)
        return np.array((dr.x, dr.y))

    def _measure(self, node: Node, heard: HeardSignal, said: PeerMessage, took: float) -> None:
        """Measure a message that an AUV has decoded and that `took` (s) by both clocks; let its
        navigator use the measurement, and record it.
        """
        auv, sender, now = node.number, self.air.names.index(heard.sender), node.clock
        self.fleet.advance(now)
        self.deliveries.settle(now)
        came, chance = heard.began_at_s, self._chance[auv, sender]
        range_m, range_sd = self._range(auv, sender, said, came, took, chance)
        depth = self.sensors.depth(auv, came)
        seen = Direction(nan, nan, nan, nan)
        if self.sensors.has_array:
            seen = self._direction(auv, sender, said.told.sent_at_s, came, chance)
        if self.kind.ranges:  # a range and depths say as much
            seen = seen._replace(steep=nan, steep_sd=nan)
        legs = np.zeros((1, 2))
        if said.gone is not None:
            mine = self._reckoned(auv, came) - self._reckoned(auv, said.asked_at_s)
            legs = np.array(((0.0, 0.0), said.gone - mine))
        sight = PeerSight(
            auv, sender, came, now, said.told, range_m, range_sd**2, seen.bearing,
            seen.bearing_sd**2, seen.steep, seen.steep_sd**2, said.depth_m - depth,
            2.0 * self.sensors.depth_sd_m**2, legs,
        )  # fmt: skip
        moved, outcome = self.team.apply_peer(sight)
        here, there = self._true(auv, came), self._true(sender, said.told.sent_at_s)
        away = float(np.linalg.norm(here[:3] - there[:3]))
        off = seen.bearing - atan2(there[1] - here[1], there[0] - here[0])
        self.record.peer_ranges.append(
            PeerRange(
                len(self.record.peer_ranges), auv, heard.sender, said.told.sent_at_s, came, now,
                range_m, range_m - away, range_sd, _degrees(seen.bearing, 0.0),
                _degrees(off, -180.0), float(np.degrees(seen.bearing_sd)),
                float(np.degrees(seen.steep)), float(np.degrees(seen.steep_sd)),
                said.depth_m - depth,
                outcome.off, moved if outcome.is_taken else nan, outcome.nis, outcome.share,
            )
        )  # fmt: skip

    def _range(
        self, auv: int, sender: int, said: PeerMessage, came: float, took: float,
        chance: np.random.Generator,
    ) -> tuple[float, float]:  # fmt: skip
        """Return the range (m) that an AUV measures by a signal that `took` (s), and its standard
        deviation; NaN where no ranges are measured.  `came` (s) is when the signal began at the
        AUV.
        """
        if not self.kind.ranges:
            return nan, nan
        usbl, one_way = self.sensors.usbl, said.gone is None
        sd = usbl.range_sd(1 if one_way else 2)
        if one_way:
            for whose, sign, time in ((auv, -1.0, came), (sender, 1.0, said.told.sent_at_s)):
                late, later = self.sensors.clocks[whose]
                took += sign * (late + later * time)
        return usbl.sound_speed * took + sd * chance.standard_normal(), sd

    def _direction(
        self, auv: int, sender: int, sent_at: float, came: float, chance: np.random.Generator
    ) -> "Direction":
        """Return the direction that an AUV measures of a signal's sender, sent at `sent_at` and
        heard from `came` on (s), with errors drawn from `chance`.
        """
        here, there = self._true(auv, came), self._true(sender, sent_at)
        usbl = self.sensors.usbl
        took = float(np.linalg.norm(here[:3] - there[:3])) / usbl.sound_speed
        fix, spread = usbl.locate(
            there[:3], here[:3], float(here[3]), took, chance.standard_normal(NOISE_WIDTH)
        )
        x, y, z = (fix - here[:3]).tolist()
        away, bearing = max(hypot(x, y), 1e-3), atan2(y, x)
        steep, reach = atan2(z, away), hypot(away, z)
        east = np.array((-sin(bearing), cos(bearing), 0.0))
        down = np.array((-z / reach * x / away, -z / reach * y / away, away / reach))
        return Direction(
            bearing + float(self.sensors.turned[auv]),
            sqrt(float(east @ spread @ east)) / away,
            steep,
            sqrt(float(down @ spread @ down)) / reach,
        )

    def _true(self, auv: int, time: float) -> Floats:
        return np.array(self.fleet.vehicles[auv].at(time))


def _degrees(angle: float, lowest: float) -> float:
    """Return an angle (rad) in degrees, in [lowest, lowest + 360)."""
    return (float(np.degrees(angle)) - lowest) % 360.0 + lowest
