"""How pings come about: on the AUV's own clock, or in answer to a call."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import inf, nan
from typing import Any

import numpy as np
import simpy

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled
from ...support.plugins import OwnPart
from ...support.streams import Purpose, Streams
from ..records.events import HEARD, IN_FLIGHT
from ..records.rows import CALLED, Rows
from ..scenario.families import RANGING
from ..scenario.part_choice import own_part, shipped_part
from ..scenario.sections.protocol import Protocol
from ..scenario.site import Site
from ..vehicles.fleet import VehicleFleet
from .answers import Answers
from .pings import NO_CALL, HfBand, members
from .predicted_positions import planned_speeds
from .steps import SAME, check_now, checked_steps, event_of, moment
from .view import View


class OneWay:
    """Synchronised clocks (owtt_sync): AUVs ping on time, and the travel time gives the range.

    `late` (n): each AUV pings so much later (s) than the start of its slot; None: on time.
    """

    def __init__(
        self,
        env: simpy.Environment,
        uplink: HfBand,
        late: Sequence[float] | None = None,
    ) -> None:
        self._env, self._uplink, self._late = env, uplink, late

    def ping(
        self, round_number: int, slot: int, group: Sequence[int], time: float, view: View
    ) -> None:
        """Let a group of AUVs ping at the start of its slot."""
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
        """End the mission; nothing waits."""


class TwoWay:
    """At the start of its slot each AUV is called by an ASV, and answers that call: no clocks.

    The ASV that the fleet believes nearest calls, whether the AUV is within its range or not; an
    ASV that calls several AUVs names them in one call.  The AUV answers one turnaround after it has
    heard the call.  All ASVs that hear the answer measure it.  An AUV that hears no call does not
    ping: its turn is recorded with the outcome of the call.
    """

    def __init__(
        self,
        env: simpy.Environment,
        uplink: HfBand,
        *,
        turnaround: float,
        one_way: bool = False,
        answers: Answers | None = None,
    ) -> None:
        """With `one_way` the answer alone is timed, by synchronised clocks.

        `answers` follow calls and pings, where a slot ends with its answers.
        """
        self._one_way, self._answers = one_way, answers
        self._env, self._uplink = env, uplink
        self._answer_delay = uplink.band.duration + turnaround
        self._waiting: dict[tuple[int, int, int], Rows] = {}  # calls not yet answered

    def ping(
        self, round_number: int, slot: int, group: Sequence[int], time: float, view: View
    ) -> None:
        """Call the AUVs of a group at the start of its slot; each answers the call it hears."""
        if self._answers is not None:
            self._answers.begin((round_number, slot), len(group))
        failed = self._uplink.failed(time)
        if len(failed) == len(view.asvs):
            return  # no ASV is left to call
        callers = nearest(view, group, failed)
        calls = self._uplink.call(group, callers, time)
        outcomes, ways_s = calls["call"].tolist(), calls["call_time_s"].tolist()
        for number, (auv, outcome, way_s) in enumerate(zip(group, outcomes, ways_s, strict=True)):
            call = calls[number : number + 1]
            if outcome != HEARD:
                self._uplink.send(round_number, slot, [auv], time, call)
                continue
            turn = round_number, slot, auv
            self._waiting[turn] = call
            if self._uplink.foresees_calls:
                self._answer_at(time + way_s + self._answer_delay, turn)
            else:
                moment(self._env, time + way_s).callbacks.append(partial(self._hear, turn))

    def _hear(self, turn: tuple[int, int, int], _: simpy.Event) -> None:
        """Correct the predicted instant at which an AUV hears its call."""
        call = self._waiting[turn][0]
        called_at = float(call["called_at_s"])
        call["call_time_s"] = self._uplink.call_time(call["called_by"], turn[2], called_at)
        self._answer_at(called_at + float(call["call_time_s"]) + self._answer_delay, turn)

    def _answer_at(self, time: float, turn: tuple[int, int, int]) -> None:
        moment(self._env, time).callbacks.append(partial(self._answer, turn, time))

    def _answer(self, turn: tuple[int, int, int], time: float, _: simpy.Event) -> None:
        call = self._waiting.pop(turn)
        if self._one_way:
            call["call_time_s"] = nan
        pings = self._uplink.send(turn[0], turn[1], [turn[2]], time, call)
        if self._answers is not None:
            self._answers.expect(turn[:2], pings, int(call["called_by"][0]))

    def close(self) -> None:
        """End the mission; record the calls that AUVs have not answered by now."""
        for (round_number, slot, auv), call in self._waiting.items():
            call["call"] = IN_FLIGHT
            self._uplink.send(round_number, slot, [auv], float(call["called_at_s"][0]), call)


class Slot:
    """The slot of a ping group, for a ranging by steps: what the fleet knows, and verbs.

    `round` and `number` count rounds, and slots in a round; `group` are the AUVs; `view` is what
    the schedule knew; `random` is the ranging's own random stream.
    """

    def __init__(
        self,
        ranging: "BySteps",
        round_number: int,
        number: int,
        group: Sequence[int],
        view: View,
    ) -> None:
        self.round, self.number, self.group, self.view = round_number, number, list(group), view
        self.random = ranging.random
        self._ranging, self._members = ranging, frozenset(group)
        self._calls: set[tuple[int, bytes]] = set()  # AUVs that were called, and their calls' rows

    def ping(self, auvs: Sequence[int], time: float, called: Rows = NO_CALL) -> None:
        """Let AUVs ping now, at an instant (s): by their clocks, or one AUV by its call (1,)."""
        self._check(auvs, time)
        if called is not NO_CALL:
            self._check_call(auvs, called)
        if called is NO_CALL or called[0]["call"] == HEARD:  # an AUV that hears no call is silent
            self._check_silence(auvs, time)
        self._ranging.uplink.send(self.round, self.number, list(auvs), time, called)

    def call(self, auvs: Sequence[int], asvs: Sequence[int], time: float) -> Any:
        """Let ASVs call AUVs now, at an instant (s), one for each.

        Return the calls with their outcomes, records of :data:`CALLED` (n,); an AUV with `.call ==
        HEARD` hears its call `.call_time_s` (s) later.
        """
        self._check(auvs, time)
        vessels = range(len(self.view.asvs))
        if len(asvs) != len(auvs) or any(asv not in vessels for asv in asvs):
            raise ValueError(f"one ASV of 0..{vessels[-1]} calls each AUV; got {list(asvs)}")
        failed = sorted(set(asvs) & set(self._ranging.uplink.failed(time)))
        if failed:
            raise ValueError(f"ASV{failed[0]} has failed by {time:g} s; let another one call")
        callers = np.array(asvs, dtype=np.int64)
        answers = self._ranging.uplink.call(list(auvs), callers, time)
        self._calls |= {(auv, answer.tobytes()) for auv, answer in zip(auvs, answers, strict=True)}
        return answers.view(np.recarray)

    def _check(self, auvs: Sequence[int], time: float) -> None:
        """Refuse AUVs that are not in the slot, and instants that are not now."""
        if len(set(auvs)) != len(auvs) or not self._members.issuperset(auvs):
            members = sorted(self._members)
            raise ValueError(f"the AUVs of the slot are {members}, each once; got {list(auvs)}")
        check_now(self._ranging.env, time, "wait with `yield slot.until(time)`")

    def _check_silence(self, auvs: Sequence[int], time: float) -> None:
        """Refuse AUVs that are still pinging at `time` (s); note when the pings that begin now will
        end.
        """
        busy = self._ranging.pinging_until
        for auv in auvs:
            if time < busy.get(auv, 0.0) - SAME:
                raise ValueError(f"AUV{auv} is still pinging, until {busy[auv]:g} s")
            busy[auv] = time + self._ranging.uplink.band.duration

    def _check_call(self, auvs: Sequence[int], called: Rows) -> None:
        """Refuse a `called` that is not the record, unchanged, that :meth:`call` returned for the
        one AUV.
        """
        is_record = getattr(called, "dtype", None) == CALLED and called.shape == (1,)
        if not is_record or len(auvs) != 1 or (auvs[0], called.tobytes()) not in self._calls:
            raise ValueError(
                "called is one record of those that call() returns, as it is, and of the one AUV "
                "that pings: calls[k : k + 1] for auvs[k]"
            )

    def until(self, time: float) -> simpy.Event:
        """Return the event of an instant (s) that is not past."""
        return event_of(self._ranging.env, time)


@dataclass(frozen=True)
class BySteps:
    """A ranging that is a function of a slot, user-defined or shipped, whose steps are checked.

    `pinging_until` is when (s) the last ping of each AUV ends.
    """

    part: OwnPart
    env: simpy.Environment
    uplink: HfBand
    random: np.random.Generator
    pinging_until: dict[int, float] = field(default_factory=dict)

    def ping(
        self, round_number: int, slot: int, group: Sequence[int], time: float, view: View
    ) -> None:
        """Run the steps of a group's slot, from an instant (s) on."""
        here = Slot(self, round_number, slot, group, view)
        self.env.process(self._steps(here, time))

    def _steps(self, slot: Slot, time: float) -> Generator[simpy.Event, Any, None]:
        when = f" in slot {slot.number} of round {slot.round}"
        yield from checked_steps(self.part, self.part(slot, time, when=when), self.env, when)

    def close(self) -> None:
        """End the mission; steps that are still to come are dropped."""


def ranging_of(
    protocol: Protocol,
    late: Sequence[float] | None,
    env: simpy.Environment,
    uplink: HfBand,
    streams: Streams,
    answers: Answers | None = None,
) -> OneWay | TwoWay | BySteps:
    """Return the ranging of a protocol; AUVs ping so much `late` (s), None: on time; `answers`
    follow the calls of polling.

    Raises:
        PluginError: when a user-defined one is not allowed, or cannot be loaded or called.
    """
    name = protocol.ranging
    if protocol.pings_by_steps:
        shipped = None if name.is_own else shipped_part(RANGING, name)
        part = own_part(RANGING, name) if shipped is None else OwnPart(RANGING.key, name, shipped)
        return BySteps(part, env, uplink, streams.of(Purpose.RANGING))
    if protocol.calls:
        delay, one_way = protocol.turnaround_s, RANGING.declared(name).own_clocks
        return TwoWay(env, uplink, turnaround=delay, one_way=one_way, answers=answers)
    return OneWay(env, uplink, late)


def nearest(view: View, group: Sequence[int], failed: Sequence[int] = ()) -> Ints:
    """Return for each AUV of a group the number of the ASV nearest to where the fleet believes the
    AUV, (n,); ASVs that have `failed` are left out.
    """
    callers = np.empty(len(group), dtype=np.int64)
    auvs, asvs = np.ascontiguousarray(view.auvs), np.ascontiguousarray(view.asvs)
    choose_callers(auvs, asvs, members(tuple(group)), members(tuple(failed)), callers)
    return callers


@compiled
def choose_callers(auvs: Floats, asvs: Floats, group: Ints, failed: Ints, callers: Ints) -> None:
    """Write to `callers` (n,) for each AUV of a group (n,) the nearest ASV that has not `failed`.

    `auvs` (k, 3) and `asvs` (m, 3) are believed positions (m); the distance is horizontal.
    """
    works = np.ones(len(asvs), dtype=np.bool_)
    for asv in failed:
        works[asv] = False
    for k in range(len(group)):
        callers[k], least = 0, inf
        for asv in range(len(asvs)):
            ahead = auvs[group[k], 0] - asvs[asv, 0]
            aside = auvs[group[k], 1] - asvs[asv, 1]
            square = ahead * ahead + aside * aside
            if works[asv] and square < least:
                callers[k], least = asv, square


def strayed(site: Site, auvs: VehicleFleet) -> Floats:
    """Return the variance (m2), along any level axis, of how far each AUV goes between a call and
    its answer, (n,).

    It goes for a ping and a turnaround at its planned speed on an unknown course: 0 for AUVs that
    hold, the fastest leg of a track.  A current adds to it for vehicles that drift with it.
    """
    scenario = site.scenario
    protocol, water = scenario.protocol, scenario.environment
    drift = np.array([auv.group.vehicle.has_dynamics for auv in site.auvs]) * (
        water.current_m_per_s**2 + 2 * water.current_variation_m_per_s**2 + site.flow.rms_m_per_s**2
    )
    lasts = scenario.acoustics.hf.ping_s + protocol.turnaround_s
    return np.asarray((planned_speeds(site, auvs) ** 2 + drift) * lasts**2 / 2)
