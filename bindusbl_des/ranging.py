"""How a ping comes about: on the AUV's own clock, or in answer to an interrogation."""

from collections.abc import Sequence

import simpy

from .acoustics import travel_time
from .boards import Board, ReplyBoard
from .fleet import Fleet
from .uplink import Uplink


class OneWay:
    """Synchronised clocks: AUVs ping on time, the one-way travel time is the range (owtt_sync)."""

    def __init__(self, uplink: Uplink, board: Board | ReplyBoard) -> None:
        self._uplink, self._board = uplink, board

    def ping(self, round_number: int, slot: int, group: Sequence[int], time: float) -> None:
        """Let a group of AUVs ping at the start of its slot."""
        self._board.expect(self._uplink.send(round_number, slot, group, time))


class TwoWay:
    """No clocks: the ASVs call at the start of the slot, the AUV answers the call it hears first.

    The calling ASV ranges by the round trip; the others hear the answer as well and, sharing its
    GNSS time, range by it with the same noise.  An AUV out of everybody's range hears no call: its
    turn is recorded as a ping that nobody can hear.
    """

    def __init__(
        self,
        env: simpy.Environment,
        uplink: Uplink,
        board: Board | ReplyBoard,
        auvs: Fleet,
        asvs: Fleet,
        *,
        turnaround: float,
        sound_speed: float,
    ) -> None:
        self._env, self._uplink, self._board = env, uplink, board
        self._auvs, self._asvs = auvs, asvs
        self._reply_delay = uplink.ping_duration + turnaround
        self._sound_speed = sound_speed

    def ping(self, round_number: int, slot: int, group: Sequence[int], time: float) -> None:
        """Call the AUVs of a group at the start of its slot; each pings when it hears the call."""
        for auv in group:
            self._call(round_number, slot, auv, time)

    def _call(self, round_number: int, slot: int, auv: int, time: float) -> None:
        vehicle = self._auvs.vehicles[auv]
        place = vehicle.at(time)
        calls = [
            (travel_time(vessel, vehicle.at, time, self._sound_speed), asv)
            for asv, vessel in enumerate(vessel.at(time) for vessel in self._asvs.vehicles)
            if self._uplink.in_range(place, vessel)
        ]
        if not calls:
            self._board.expect(self._uplink.send(round_number, slot, [auv], time))
            return
        travel, caller = min(calls)
        replies_at = time + travel + self._reply_delay
        event = self._env.timeout(max(replies_at - self._env.now, 0.0))
        event.callbacks.append(
            lambda _: self._board.expect(
                self._uplink.send(round_number, slot, [auv], replies_at, caller, travel)
            )
        )
