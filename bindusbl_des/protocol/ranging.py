"""How a ping comes about: on the AUV's own clock, or in answer to an interrogation."""

from collections.abc import Sequence
from functools import partial
from math import nan

import numpy as np
import simpy

from ..core.streams import Purpose, Streams
from ..records.events import HEARD, IN_FLIGHT
from ..records.rows import Rows
from ..scenario.families import RANGING
from ..scenario.part_settings import own_part
from ..scenario.planned import route_of
from ..scenario.scenario import Scenario
from ..vehicles.fleet import Fleet
from ..vehicles.motion import SPEED, Floats, Ints
from .hf.calling import choose_callers
from .hf.handed import members
from .hf.uplink import Uplink
from .own.ranging import OwnRanging
from .own.steps import moment
from .schedules.polling import Answers
from .schedules.view import View


class OneWay:
    """Synchronised clocks: AUVs ping on time, the one-way travel time is the range (owtt_sync).

    Or each so much `late` (s), after the start of its slot.
    """

    def __init__(
        self,
        env: simpy.Environment,
        uplink: Uplink,
        late: Sequence[float] | None = None,
    ) -> None:
        self._env, self._uplink, self._late = env, uplink, late

    def ping(
        self, round_number: int, slot: int, group: Sequence[int], time: float, view: View
    ) -> None:
        """Let a group of AUVs ping at the start of its slot, wherever the fleet believes them."""
        if self._late is None:
            self._uplink.send(round_number, slot, group, time)
            return
        for auv in group:
            pings_at = time + self._late[auv]
            event = moment(self._env, pings_at)
            event.callbacks.append(partial(self._ping, (round_number, slot, auv), pings_at))

    def _ping(self, turn: tuple[int, int, int], time: float, _: simpy.Event) -> None:
        """Let one AUV ping in its turn (round, slot, AUV) at an instant (s)."""
        self._uplink.send(turn[0], turn[1], [turn[2]], time)

    def close(self) -> None:
        """End the mission; nobody waits for anything."""


class TwoWay:
    """At the start of its slot each AUV is called by an ASV, and answers what it hears: no clocks.

    The nearest ASV calls, as far as the fleet knows, be the AUV within its range or not; who calls
    several names them in one call.  The AUV answers as soon as it has heard the call and turned
    about.  All ASVs that hear the answer measure it.  An AUV that hears no call does not ping: its
    turn is recorded with what became of the call.
    """

    def __init__(
        self,
        env: simpy.Environment,
        uplink: Uplink,
        *,
        turnaround: float,
        one_way: bool = False,
        answers: Answers | None = None,
    ) -> None:
        """Put a way together: with `one_way` the answer alone is timed, by synchronised clocks.

        `answers` are told of calls and pings, where somebody waits for them.
        """
        self._one_way, self._answers = one_way, answers
        self._env, self._uplink = env, uplink
        self._answer_delay = uplink.band.duration + turnaround
        self._waiting: dict[tuple[int, int, int], Rows] = {}  # calls not yet answered

    def ping(
        self, round_number: int, slot: int, group: Sequence[int], time: float, view: View
    ) -> None:
        """Call the AUVs of a group at the start of its slot; each pings when it has heard that."""
        if self._answers is not None:
            self._answers.begin((round_number, slot), len(group))
        failed = self._uplink.failed(time)
        if len(failed) == len(view.asvs):
            return  # nobody calls
        callers = nearest(view, group, failed)
        calls = self._uplink.call(group, callers, time)
        outcomes, lasting = calls["call"].tolist(), calls["call_time_s"].tolist()
        for number, (auv, outcome, lasts) in enumerate(zip(group, outcomes, lasting, strict=True)):
            call = calls[number : number + 1]
            if outcome != HEARD:
                self._uplink.send(round_number, slot, [auv], time, call)
                continue
            turn = round_number, slot, auv
            self._waiting[turn] = call
            if self._uplink.foresees_calls:
                self._answer_at(time + lasts + self._answer_delay, turn)
            else:
                event = self._env.timeout(max(time + lasts - self._env.now, 0.0))
                event.callbacks.append(partial(self._hear, turn))

    def _hear(self, turn: tuple[int, int, int], _: simpy.Event) -> None:
        """Amend when an AUV hears its call, when it was predicted to hear it."""
        call = self._waiting[turn][0]
        called_at = float(call["called_at_s"])
        call["call_time_s"] = self._uplink.call_time(call["called_by"], turn[2], called_at)
        self._answer_at(called_at + float(call["call_time_s"]) + self._answer_delay, turn)

    def _answer_at(self, time: float, turn: tuple[int, int, int]) -> None:
        event = self._env.timeout(max(time - self._env.now, 0.0))
        event.callbacks.append(partial(self._answer, turn, time))

    def _answer(self, turn: tuple[int, int, int], time: float, _: simpy.Event) -> None:
        call = self._waiting.pop(turn)
        if self._one_way:
            call["call_time_s"] = nan
        pings = self._uplink.send(turn[0], turn[1], [turn[2]], time, call)
        if self._answers is not None:
            self._answers.expect(turn[:2], pings.start, int(call["called_by"][0]))

    def close(self) -> None:
        """End the mission; record the calls that AUVs have not answered by now."""
        for (round_number, slot, auv), call in self._waiting.items():
            call["call"] = IN_FLIGHT
            self._uplink.send(round_number, slot, [auv], float(call["called_at_s"][0]), call)


def ranging_of(
    scenario: Scenario,
    env: simpy.Environment,
    uplink: Uplink,
    streams: Streams,
    answers: Answers | None = None,
) -> OneWay | TwoWay | OwnRanging:
    """Return how the pings of a scenario come about; `answers` wait for them where it polls.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
    """
    name = scenario.protocol.ranging
    if scenario.protocol.calls:
        delay, one_way = scenario.protocol.turnaround_s, name == "owtt_sync"
        return TwoWay(env, uplink, turnaround=delay, one_way=one_way, answers=answers)
    if name == "owtt_sync":
        return OneWay(env, uplink, scenario.auvs.ping_late_s)
    draw = streams.of(Purpose.RANGING)
    return OwnRanging(name, own_part(RANGING, name), env, uplink, draw)


def nearest(view: View, group: Sequence[int], failed: Sequence[int] = ()) -> Ints:
    """Return for each AUV of a group the ASV nearest to where the fleet believes it, shape (n,), of
    those that have not failed.
    """
    callers = np.empty(len(group), dtype=np.int64)
    auvs, asvs = np.ascontiguousarray(view.auvs), np.ascontiguousarray(view.asvs)
    choose_callers(auvs, asvs, members(tuple(group)), members(tuple(failed)), callers)
    return callers


def strayed(scenario: Scenario, auvs: Fleet) -> Floats:
    """Return how far AUVs go between a call and its answer, as far as the fleet knows, (n,), m2.

    That is the variance along any level direction of the way in a ping and a turnaround, at the
    planned speed on an unknown course: none for those that hold, the fastest leg of a track.  A
    current adds its own way to that of vehicles that drift with it.
    """
    protocol, water = scenario.protocol, scenario.environment
    drift = 0.0
    if scenario.auvs.vehicle.has_dynamics:
        drift = water.current_m_per_s**2 + 2 * water.current_variation_m_per_s**2
    lasts = scenario.acoustics.hf.ping_s + protocol.turnaround_s
    return np.asarray((planned_speeds(scenario, auvs) ** 2 + drift) * lasts**2 / 2)


def planned_speeds(scenario: Scenario, auvs: Fleet) -> Floats:
    """Return the planned speed of each AUV (m/s), (n,), of a track that of its fastest leg."""
    speed = np.array(scenario.auvs.speeds)
    if scenario.auvs.route.kind == "hold":
        speed[:] = 0.0
    elif route_of(scenario).kind == "track" and auvs.poses is None:
        table, first, _ = auvs.motion
        speed = np.maximum.reduceat(table[:, SPEED], first[:-1])
    return speed
