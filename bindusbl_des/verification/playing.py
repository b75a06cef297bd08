"""Witnesses are run before they are believed: what is told of one is what happened in it.  Its
scenario is the one that is verified, but for where its vehicles are.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from ..acoustics.propagation import TOUCH
from ..core.arrays import Floats
from ..mission.simulation import simulate
from ..results.result import Result
from ..scenario.scenario import Scenario
from ..setup import Setup
from .case import REFUSED, UNDECIDED, Case, Plan, SignalPair

# What lies at a range is put so much nearer, or farther: roundings of its place are smaller.
SLIVER = 1e-9

# Who moves by no metre a minute counts as still: a route needs a speed.
STILL_M_PER_S = 0.001

# The other AUVs are so many reaches away from all ASVs.
OUT_OF_THE_WAY = 20.0

LATEST_S = 10.0

# Of a witness that lasts longer (s), so many instants are sampled: what matters is when it sounds.
LONG_S, SAMPLES = 5000.0, 10_000


@dataclass(frozen=True)
class Actor:
    """An AUV of a witness: where it begins (m), how deep (m), where it heads for, how late (s).

    It heads for a place (m) at the largest relative speed, or lies still.
    """

    x: float
    y: float
    depth: float
    towards: tuple[float, float] | None = None
    late_s: float = 0.0


def stations_of(case: Case) -> Floats:
    """Return where the ASVs of a witness lie (m), (m, 2): those that move on a ring."""
    found = case.stations
    return np.array(case.setup.nominal_stations_m) if found is None else found


def staged(
    case: Case,
    actors: Mapping[int, Actor],
    duration_s: float,
    sound_speed: float,
    **changes: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the plain data of a witness: some AUVs act, all others are out of the way.

    `changes` are laid over the sections of the scenario.
    """
    scenario = case.scenario
    setup = case.setup
    data = scenario.model_dump(mode="json", exclude_unset=True)
    data = {name: data[name] for name in ("acoustics", "protocol", "usbl") if name in data}
    auvs = [actors.get(n) or _aside(case, n) for n in range(scenario.auvs.count)]
    stations = stations_of(case)
    data |= {
        "name": f"{scenario.name}: witness",
        "duration_s": duration_s,
        "survey": {**_survey(case), "depths_m": [auv.depth for auv in auvs]},
        "auvs": {"count": len(auvs), **_routes(case, auvs, duration_s)},
        "asvs": {"count": len(stations), "formation": {"positions_m": stations.tolist()}},
        "navigation": {"filter": "dead_reckoning"},  # which changes nothing that is sent
        "environment": {
            "sound_speed_m_per_s": sound_speed,
            "assumed_sound_speed_m_per_s": setup.assumed_sound_speed_m_per_s,
        },
    }
    if duration_s > LONG_S:
        rate = SAMPLES / duration_s
        data["record"] = {"metrics_hz": rate, "tracks_hz": rate}
        data["navigation"]["imu_rate_hz"] = max(rate, 0.001)
    if any(auv.late_s for auv in auvs):
        data["auvs"]["ping_late_s"] = [auv.late_s for auv in auvs]
    data["acoustics"] = lossless(data)
    for section, change in changes.items():
        data[section] = {**data.get(section, {}), **change}
    return data


def lossless(plan: Plan) -> dict[str, Any]:
    """Return the section `acoustics` of a scenario in which no sound is lost."""
    acoustics = {**plan.get("acoustics", {}), "loss": {"law": "none"}}
    mf = acoustics.get("mf", {})
    if "modem" in mf:
        mf.pop("airtimes", None)  # which the modem brings
    return acoustics


def _survey(case: Case) -> dict[str, Any]:
    survey = case.scenario.survey.model_dump(mode="json", exclude_unset=True)
    if "area" in survey:
        return {"polygon_m": [list(corner) for corner in case.setup.area.outline]}
    kept = ("side_m", "size_m", "polygon_m", "rotation_deg")
    return {name: survey[name] for name in kept if name in survey}


def _aside(case: Case, number: int) -> Actor:
    """Return an AUV that no ASV hears, apart from all others."""
    stations, protocol = stations_of(case), case.scenario.protocol
    reach = case.scenario.acoustics.hf.range_m + protocol.conflict_margin_m
    x, y = stations.max(axis=0) + OUT_OF_THE_WAY * reach
    return Actor(float(x) + number, float(y), case.depths[number][1])


def _routes(case: Case, auvs: list[Actor], duration_s: float) -> dict[str, Any]:
    """Return the routes of AUVs, with their speeds: way points if any of them moves."""
    if all(auv.towards is None for auv in auvs):
        return {"route": {"kind": "hold", "positions_m": [[auv.x, auv.y] for auv in auvs]}}
    speed = min(case.closing_m_per_s, 20.0)
    ways, speeds = [], []
    for auv in auvs:
        x, y = auv.towards or (auv.x + 1.0, auv.y)
        away = math.hypot(x - auv.x, y - auv.y)
        far = max(1.0, 2 * speed * duration_s) / away
        ways.append([[auv.x, auv.y], [auv.x + far * (x - auv.x), auv.y + far * (y - auv.y)]])
        speeds.append(max(speed, STILL_M_PER_S) if auv.towards else STILL_M_PER_S)
    return {"route": {"kind": "waypoints", "points_m": ways}, "speeds_m_per_s": speeds}


Row = dict[str, Any]
Place = tuple[float, float, float]

# So many scenarios are run to see two signals of a pair overlap, each so long (s), all pairs of an
# AUV and an ASV together.
MOST_PLAYED, LONGEST_PLAYED_S = 50, 5e6


@dataclass(frozen=True)
class Signal:
    """A signal of a witness: what it is, who sent it, when and where (m), and from when to when it
    is at the receiver (s).
    """

    what: str
    sender: str
    sent_at_s: float
    place_m: Place
    begins_at_s: float
    ends_at_s: float


@dataclass(frozen=True)
class Witness:
    """Two signals that overlap at a receiver in a scenario, `plan`, to be run with a `seed`."""

    kind: str
    plan: Plan
    seed: int
    receiver: str
    signals: tuple[Signal, Signal]

    @property
    def words(self) -> str:
        """Whose signals overlap where."""
        one, other = self.signals
        return f"{one.sender} and {other.sender} at {self.receiver}"

    @property
    def overlap_s(self) -> float:
        """How long both signals last at the receiver together (s)."""
        begins = max(signal.begins_at_s for signal in self.signals)
        return min(signal.ends_at_s for signal in self.signals) - begins


def witnessed(pair: SignalPair) -> tuple[SignalPair, Witness | None]:
    """Return a pair and the first of its witnesses in which two signals overlap when it is run.

    Without any it is not refused: its bound is exceeded, but nobody has seen it collide.
    """
    if pair.witnesses is None:
        return pair, None
    found, _ = seen(pair, islice(pair.witnesses(), MOST_PLAYED))
    return replace(pair, verdict=UNDECIDED if found is None else REFUSED), found


def seen(pair: SignalPair, plans: Iterable[Plan]) -> tuple[Witness | None, str]:
    """Run scenarios until two signals overlap in one on the band of a pair; return that.

    Without any, tell in a sentence which signals were destroyed by something else, if any were.
    """
    lost = ""
    for result, plan in ((_run(plan), plan) for plan in plans):
        if result is not None:
            found = _first_overlap(pair.kind, plan, result, pair.band)
            if found is not None:
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
    for receiver, one, other in _overlaps(result, band):
        first, second = sorted((one, other), key=lambda signal: signal.begins_at_s)
        return Witness(kind, plan, result.seed, receiver, (first, second))
    return None


def _overlaps(result: Result, band: str | None) -> Iterator[tuple[str, Signal, Signal]]:
    """Yield receivers and two signals that overlapped there, on one band or (None) on either."""
    if band != "mf":
        yield from _pings(result)
    if band != "hf" and "frame_receptions" in result.arrow:
        yield from _frames(result)


def _pings(result: Result) -> Iterator[tuple[str, Signal, Signal]]:
    """Yield ASVs at which two pings met, or a call."""
    protocol = result.scenario.protocol
    pings = {row["ping"]: row for row in result.arrow["pings"].to_pylist()}
    there: dict[str, list[Signal]] = {}
    lasts = result.scenario.acoustics.hf.ping_s
    for row in _collided(result, "receptions"):
        if row["arrived_at_s"] is not None:
            signal = _ping(row, pings[row["ping"]], protocol.pinging, lasts)
            there.setdefault(row[protocol.listening], []).append(signal)
    for receiver, signals in there.items():
        yield from _neighbours(receiver, signals)
    yield from _calls(result, list(pings.values()), there)


def _collided(result: Result, table: str) -> list[Row]:
    """Return the rows of signals that collided: as Python's a table takes ten times the memory."""
    rows = result.arrow[table]
    those = np.flatnonzero(np.array(rows["outcome"]) == "collided")
    return list(rows.take(those).to_pylist())


def _neighbours(receiver: str, signals: list[Signal]) -> Iterator[tuple[str, Signal, Signal]]:
    for one, other in pairwise(sorted(signals, key=lambda signal: signal.begins_at_s)):
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
    tracks = _tracks(result)
    called = [ping for ping in pings if ping["called_by"] is not None]
    everywhere = np.concatenate(list(tracks.values()))[:, 1:]
    farthest_m = float(np.linalg.norm(np.ptp(everywhere, axis=0)))
    longest_s = farthest_m / result.setup.sound_speed_m_per_s + result.scenario.acoustics.hf.ping_s
    for ping in (ping for ping in called if ping["call"] == "collided"):
        at = (ping["x_m"], ping["y_m"], ping["z_m"])
        for other in called:
            same = math.isclose(other["called_at_s"], ping["called_at_s"])
            if same and other["called_by"] != ping["called_by"]:
                both = (_call(sent, at, tracks, result.setup) for sent in (ping, other))
                yield (ping["auv"], *both)
    for asv, signals in there.items():
        for signal in signals:
            at = _place(tracks[asv], signal.begins_at_s)
            for ping in called:
                if abs(ping["called_at_s"] - signal.begins_at_s) > longest_s:
                    continue  # it is not under way any more, or yet
                call = _call(ping, at, tracks, result.setup)
                if (
                    call.begins_at_s < signal.ends_at_s - TOUCH
                    and signal.begins_at_s < call.ends_at_s - TOUCH
                ):
                    yield asv, signal, call


def _call(
    ping: Row,
    at: Place,
    tracks: dict[str, Floats],
    setup: Setup,
) -> Signal:
    """Return the call for a ping's AUV as it is heard at a place (m)."""
    caller, sent = ping["called_by"], ping["called_at_s"]
    place = _place(tracks[caller], sent)
    begins = sent + math.dist(place, at) / setup.sound_speed_m_per_s
    what = f"call (round {ping['round']}, slot {ping['slot']})"
    lasts = setup.scenario.acoustics.hf.ping_s
    return Signal(what, caller, sent, place, begins, begins + lasts)


def _frames(result: Result) -> Iterator[tuple[str, Signal, Signal]]:
    """Yield AUVs at which two frames of fixes met, and vehicles at which those of AUVs did."""
    frames, tracks = result.arrow["broadcasts"].to_pylist(), _tracks(result)
    there: dict[str, list[Signal]] = {}
    for row in _collided(result, "frame_receptions"):
        number, arrived = row["broadcast"], row["arrived_at_s"]
        frame = frames[number]
        signal = Signal(
            f"broadcast {number} (round {frame['round']})", frame["asv"],
            frame["sent_at_s"], _place(tracks[frame["asv"]], frame["sent_at_s"]),
            arrived, arrived + frame["airtime_s"],
        )  # fmt: skip
        there.setdefault(row["auv"], []).append(signal)
    sent = result.arrow["auv_frames"].to_pylist() if "auv_frames" in result.arrow else []
    for row in _collided(result, "auv_frame_receptions") if sent else ():
        frame, arrived = sent[row["auv_frame"]], row["arrived_at_s"]
        signal = Signal(
            f"{frame['kind']} {frame['auv_frame']} of broadcast {frame['broadcast']}", frame["auv"],
            frame["sent_at_s"], _place(tracks[frame["auv"]], frame["sent_at_s"]),
            arrived, arrived + frame["airtime_s"],
        )  # fmt: skip
        there.setdefault(row["listener"], []).append(signal)
    for auv, signals in there.items():
        yield from _neighbours(auv, signals)


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
