"""Witnesses are simulated before the verifier reports them: a report tells what happened."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from ...core.acoustics.propagation import TOUCH
from ...core.mission.simulation import simulate
from ...core.results.result import Result
from ...core.scenario.scenario import Scenario
from ...support.arrays import Floats
from .case import REFUSED, UNDECIDED, Plan, SignalPair

Row = dict[str, Any]
Place = tuple[float, float, float]

# The most scenarios to simulate for one pair of signals, and their longest duration (s) times pairs
# of an AUV and an ASV.
MOST_PLAYED, LONGEST_PLAYED_S = 50, 5e6


@dataclass(frozen=True)
class WitnessSignal:
    """A signal in a simulated witness: what it is, who sends it when (s) and where (m), and from
    when to when (s) it is at the receiver.
    """

    what: str
    sender: str
    sent_at_s: float
    place_m: Place
    begins_at_s: float
    ends_at_s: float


@dataclass(frozen=True)
class Witness:
    """Two signals that overlap at a receiver in the scenario of `plan` with a `seed`."""

    kind: str
    plan: Plan
    seed: int
    receiver: str
    signals: tuple[WitnessSignal, WitnessSignal]

    @property
    def words(self) -> str:
        """The senders and the receiver in words."""
        one, other = self.signals
        return f"{one.sender} and {other.sender} at {self.receiver}"

    @property
    def overlap_s(self) -> float:
        """The duration (s) of the overlap at the receiver."""
        begins = max(signal.begins_at_s for signal in self.signals)
        return min(signal.ends_at_s for signal in self.signals) - begins


def witnessed(pair: SignalPair) -> tuple[SignalPair, Witness | None]:
    """Return a pair with its verdict, and its first witness whose signals overlap in simulation.

    Without such a witness the verdict is undecided: the bound is exceeded, but no collision was
    seen.
    """
    if pair.witnesses is None:
        return pair, None
    found, _ = seen(pair, islice(pair.witnesses(), MOST_PLAYED))
    return replace(pair, verdict=UNDECIDED if found is None else REFUSED), found


def seen(pair: SignalPair, plans: Iterable[Plan]) -> tuple[Witness | None, str]:
    """Simulate scenarios until two signals of a pair overlap on its band; return that witness.

    Else return None, and a sentence on signals that something else destroyed, or "".
    """
    lost = ""
    for plan in plans:
        if (result := _run(plan)) is None:
            continue
        if (found := _first_overlap(pair.kind, plan, result, pair.band)) is not None:
            return found, ""
        lost = lost or ("" if result.violations is None else result.violations.text)
    return None, lost


def played(kind: str, plan: Plan, seed: int = 0, band: str | None = None) -> Witness | None:
    """Run a scenario (plain data); return the first two signals that overlapped in it, on a band or
    (None) on either; None if none did, or it is none: its vehicles would be too far out, or too
    late.
    """
    result = _run(plan, seed)
    return None if result is None else _first_overlap(kind, plan, result, band)


def _run(plan: Plan, seed: int = 0) -> Result | None:
    try:
        scenario = Scenario.model_validate(plan)
    except ValueError:
        return None
    longest_s = LONGEST_PLAYED_S / (scenario.auvs.count * scenario.asvs.count)
    if scenario.duration_s > longest_s:
        scenario = scenario.model_copy(update={"duration_s": longest_s})
    return simulate(scenario, seed)


def _first_overlap(kind: str, plan: Plan, result: Result, band: str | None) -> Witness | None:
    for receiver, *signals in _overlaps(result, band):
        first, second = sorted(signals, key=lambda signal: signal.begins_at_s)
        return Witness(kind, plan, result.seed, receiver, (first, second))
    return None


Overlap = tuple[str, WitnessSignal, WitnessSignal]


def _overlaps(result: Result, band: str | None) -> Iterator[Overlap]:
    """Yield receivers and two signals that overlapped there, on one band or (None) on either."""
    tracks = _tracks(result)
    if band != "mf":
        pings = _pings(result)
        yield from _neighbours(pings)
        yield from _calls(result, tracks, pings)
    if band != "hf" and "frame_receptions" in result.arrow:
        yield from _neighbours(_frames(result, tracks))


def _neighbours(there: dict[str, list[WitnessSignal]]) -> Iterator[Overlap]:
    """Yield signals that overlapped, by receivers at which they collided with anything."""
    for receiver, signals in there.items():
        for one, other in pairwise(sorted(signals, key=lambda signal: signal.begins_at_s)):
            if other.begins_at_s < one.ends_at_s - TOUCH:
                yield receiver, one, other


def _collided(result: Result, table: str) -> list[Row]:
    """Return the rows of signals that collided: as Python's a table takes ten times the memory."""
    rows = result.arrow[table]
    those = np.flatnonzero(np.array(rows["outcome"]) == "collided")
    return list(rows.take(those).to_pylist())


def _pings(result: Result) -> dict[str, list[WitnessSignal]]:
    """Return the pings that collided, receiver by receiver."""
    protocol, lasts = result.scenario.protocol, result.scenario.acoustics.hf.ping_s
    pings = {row["ping"]: row for row in result.arrow["pings"].to_pylist()}
    there: dict[str, list[WitnessSignal]] = {}
    for row in _collided(result, "receptions"):
        ping, arrived = pings[row["ping"]], row["arrived_at_s"]
        if arrived is None:  # no call made it ping, and the outcome is that call's
            continue
        what = f"ping {row['ping']} (round {ping['round']}, slot {ping['slot']})"
        place = (ping["x_m"], ping["y_m"], ping["z_m"])
        signal = WitnessSignal(
            what, ping[protocol.pinging], ping["sent_at_s"], place, arrived, arrived + lasts
        )
        there.setdefault(row[protocol.listening], []).append(signal)
    return there


def _calls(
    result: Result, tracks: dict[str, Floats], there: dict[str, list[WitnessSignal]]
) -> Iterator[Overlap]:
    """Yield calls that met another at an AUV, and answers that a call met at an ASV."""
    lasts, sound_speed = result.scenario.acoustics.hf.ping_s, result.setup.sound_speed_m_per_s
    called = [ping for ping in result.arrow["pings"].to_pylist() if ping["called_by"] is not None]
    everywhere = np.concatenate(list(tracks.values()))[:, 1:]
    longest_s = float(np.linalg.norm(np.ptp(everywhere, axis=0))) / sound_speed + lasts

    def call(ping: Row, at: Place) -> WitnessSignal:
        """Return the call for a ping as it is heard at a place (m)."""
        place = _place(tracks[ping["called_by"]], ping["called_at_s"])
        begins = ping["called_at_s"] + math.dist(place, at) / sound_speed
        what = f"call (round {ping['round']}, slot {ping['slot']})"
        sent = ping["called_by"], ping["called_at_s"]
        return WitnessSignal(what, *sent, place, begins, begins + lasts)

    for ping in called:
        for other in called if ping["call"] == "collided" else ():
            same = math.isclose(other["called_at_s"], ping["called_at_s"])
            if same and other["called_by"] != ping["called_by"]:
                at = (ping["x_m"], ping["y_m"], ping["z_m"])
                yield ping["auv"], call(ping, at), call(other, at)
    for asv, signals in there.items():
        for signal in signals:
            at = _place(tracks[asv], signal.begins_at_s)
            for ping in called:
                if abs(ping["called_at_s"] - signal.begins_at_s) > longest_s:
                    continue  # it is not under way any more, or yet
                heard = call(ping, at)
                begins = max(heard.begins_at_s, signal.begins_at_s)
                if begins < min(heard.ends_at_s, signal.ends_at_s) - TOUCH:
                    yield asv, signal, heard


def _frames(result: Result, tracks: dict[str, Floats]) -> dict[str, list[WitnessSignal]]:
    """Return the frames of fixes that collided at AUVs, and those of AUVs wherever they did,
    receiver by receiver.
    """
    there: dict[str, list[WitnessSignal]] = {}
    for sent, heard, number, sender, receiver in (
        ("broadcasts", "frame_receptions", "broadcast", "asv", "auv"),
        ("auv_frames", "auv_frame_receptions", "auv_frame", "auv", "listener"),
    ):
        frames = result.arrow[sent].to_pylist() if sent in result.arrow else []
        for row in _collided(result, heard) if frames else ():
            frame, arrived = frames[row[number]], row["arrived_at_s"]
            what = f"broadcast {row[number]} (round {frame.get('round')})"
            if sent == "auv_frames":
                what = f"{frame['kind']} {row[number]} of broadcast {frame['broadcast']}"
            place = _place(tracks[frame[sender]], frame["sent_at_s"])
            signal = WitnessSignal(
                what,
                frame[sender],
                frame["sent_at_s"],
                place,
                arrived,
                arrived + frame["airtime_s"],
            )
            there.setdefault(row[receiver], []).append(signal)
    return there


def _tracks(result: Result) -> dict[str, Floats]:
    """Return when (s) and where (m) each vehicle was, rows of (time, x, y, z)."""
    table = result.arrow["tracks"]
    rows = np.column_stack([table[name] for name in ("time_s", "x_m", "y_m", "z_m")])
    vehicles, which = np.unique(np.array(table["vehicle"], dtype=str), return_inverse=True)
    ends = np.cumsum(np.bincount(which))[:-1]
    parts = np.split(rows[np.argsort(which, kind="stable")], ends)
    return dict(zip(vehicles.tolist(), parts, strict=True))


def _place(track: Floats, at_s: float) -> Place:
    """Return where a vehicle was at an instant (m), straight from one of its rows to the next."""
    x, y, z = (float(np.interp(at_s, track[:, 0], values)) for values in track.T[1:])
    return x, y, z
