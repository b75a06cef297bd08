"""Witnesses are run before they are believed: what is told of one is what happened in it."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ...acoustics.propagation import TOUCH
from ...mission.simulation import simulate
from ...preflight.round_lengths import rounds_of
from ...results.result import Result
from ...scenario.planned import asv_stations
from ...scenario.scenario import Scenario
from ...scenario.water import sound_speed_of
from ..pair import Pair, Plan

Row = dict[str, Any]

# A round that begins so much later (s) than its frame has slipped.
SLIPPED_S = 1e-6


@dataclass(frozen=True)
class Signal:
    """A signal of a witness: what it is, who sent it, when and where (m), and from when to when it
    is at the receiver (s).
    """

    what: str
    sender: str
    sent_at_s: float
    place_m: tuple[float, float, float]
    begins_at_s: float
    ends_at_s: float


@dataclass(frozen=True)
class Witness:
    """What goes wrong in a scenario: two signals that overlap at a receiver, or (with neither) what
    is `told` of its rounds; `plan` is that scenario, to be run with a `seed`.
    """

    kind: str
    plan: Plan
    seed: int
    told: str
    receiver: str | None = None
    signals: tuple[Signal, ...] = ()

    @property
    def overlap_s(self) -> float | None:
        """How long both signals last at the receiver together (s)."""
        if not self.signals:
            return None
        begins = max(signal.begins_at_s for signal in self.signals)
        return min(signal.ends_at_s for signal in self.signals) - begins


def witness_of(pairs: Iterable[Pair]) -> Witness | None:
    """Return the first witness of pairs that are refused in which that happens when it is run."""
    for pair in pairs:
        for plan in pair.witnesses() if pair.witnesses else ():
            found = played(pair.kind, plan)
            if found is not None:
                return found
    return None


def played(kind: str, plan: Plan, seed: int = 0) -> Witness | None:
    """Run a scenario (plain data); return what of a kind went wrong in it first, None if nothing
    did.
    """
    result = simulate(Scenario.model_validate(plan), seed)
    if kind == "round and its frame":
        return _slipped(kind, plan, seed, result)
    for receiver, one, other in _overlaps(result):
        signals = tuple(sorted((one, other), key=lambda it: it.begins_at_s))
        told = f"{signals[0].sender} and {signals[1].sender} at {receiver}"
        return Witness(kind, plan, seed, told, receiver, signals)
    return None


def _slipped(kind: str, plan: Plan, seed: int, result: Result) -> Witness | None:
    frame = rounds_of(result.scenario).frame
    for row in result.arrow["rounds"].to_pylist():
        late = row["started_at_s"] - row["round"] * frame
        if late > SLIPPED_S:
            told = f"round {row['round']} begins {late:.4g} s after its frame"
            return Witness(kind, plan, seed, told)
    return None


def _overlaps(result: Result) -> Iterator[tuple[str, Signal, Signal]]:
    """Yield receivers and two signals that overlapped there."""
    protocol = result.scenario.protocol
    pings = {row["ping"]: row for row in result.arrow["pings"].to_pylist()}
    there: dict[str, list[Signal]] = {}
    lasts = result.scenario.acoustics.hf.ping_s
    for row in result.arrow["receptions"].to_pylist():
        if row["outcome"] == "collided" and row["arrived_at_s"] is not None:
            signal = _ping(row, pings[row["ping"]], protocol.pinging, lasts)
            there.setdefault(row[protocol.listening], []).append(signal)
    for receiver, signals in there.items():
        yield from _neighbours(receiver, signals)
    if protocol.ranging == "twtt":
        yield from _calls(result, list(pings.values()), there)
    if "frame_receptions" in result.arrow:
        yield from _frames(result)


def _neighbours(receiver: str, signals: list[Signal]) -> Iterator[tuple[str, Signal, Signal]]:
    for one, other in pairwise(sorted(signals, key=lambda it: it.begins_at_s)):
        if other.begins_at_s < one.ends_at_s - TOUCH:
            yield receiver, one, other


def _ping(row: Row, ping: Row, pinging: str, lasts: float) -> Signal:
    arrived = row["arrived_at_s"]
    what = f"ping {row['ping']} (round {ping['round']}, slot {ping['slot']})"
    place = (ping["x_m"], ping["y_m"], ping["z_m"])
    return Signal(what, ping[pinging], ping["sent_at_s"], place, arrived, arrived + lasts)


def _calls(
    result: Result, pings: list[Row], there: dict[str, list[Signal]]
) -> Iterator[tuple[str, Signal, Signal]]:
    """Yield calls that met another at an AUV, and answers that a call met at an ASV."""
    places = _stations(result)
    called = [ping for ping in pings if ping["called_by"] is not None]
    for ping in called:
        at = (ping["x_m"], ping["y_m"], ping["z_m"])
        for other in called:
            same = math.isclose(other["called_at_s"], ping["called_at_s"])
            if ping["call"] == "collided" and same and other["called_by"] != ping["called_by"]:
                both = (_call(it, at, places, result.scenario) for it in (ping, other))
                yield (ping["auv"], *both)
    for asv, signals in there.items():
        for signal in signals:
            for ping in called:
                call = _call(ping, places[asv], places, result.scenario)
                if (
                    call.begins_at_s < signal.ends_at_s - TOUCH
                    and signal.begins_at_s < call.ends_at_s - TOUCH
                ):
                    yield asv, signal, call


def _call(
    ping: Row,
    at: tuple[float, float, float],
    places: dict[str, tuple[float, float, float]],
    scenario: Scenario,
) -> Signal:
    """Return the call for a ping's AUV as it is heard at a place (m)."""
    caller, sent = ping["called_by"], ping["called_at_s"]
    begins = sent + math.dist(places[caller], at) / sound_speed_of(scenario)
    what = f"call (round {ping['round']}, slot {ping['slot']})"
    lasts = scenario.acoustics.hf.ping_s
    return Signal(what, caller, sent, places[caller], begins, begins + lasts)


def _frames(result: Result) -> Iterator[tuple[str, Signal, Signal]]:
    """Yield AUVs at which two frames of fixes met."""
    frames, places = result.arrow["broadcasts"].to_pylist(), _stations(result)
    there: dict[str, list[Signal]] = {}
    for row in result.arrow["frame_receptions"].to_pylist():
        if row["outcome"] == "collided":
            number, arrived = row["broadcast"], row["arrived_at_s"]
            frame = frames[number]
            signal = Signal(
                f"broadcast {number} (round {frame['round']})", frame["asv"],
                frame["sent_at_s"], places[frame["asv"]], arrived, arrived + frame["airtime_s"],
            )  # fmt: skip
            there.setdefault(row["auv"], []).append(signal)
    for auv, signals in there.items():
        yield from _neighbours(auv, signals)


def _stations(result: Result) -> dict[str, tuple[float, float, float]]:
    """Return where the ASVs of a witness lie (m): they do not move."""
    stations = asv_stations(result.scenario)
    return {f"ASV{number}": (x, y, 0.0) for number, (x, y) in enumerate(stations)}
