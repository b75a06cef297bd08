"""Energy of modems: how long each vehicle sends and receives on a band, and what that takes.

Every vehicle listens for the whole mission, and receives all signals within range: pings and calls
on HF, frames on MF.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints, by_number
from ..records.events import HEARD, OUT_OF_RANGE, AuvFrame, Broadcast
from ..records.rows import NONE, Recorder, Rows
from ..vehicles.fleet import VehicleFleet


class Powers(NamedTuple):
    """Electrical power (W) of a modem that sends, receives, or waits."""

    sending: float
    receiving: float
    waiting: float


class OnAir(NamedTuple):
    """How long (s) each of n vehicles sends and receives on a band, (n,) each."""

    sending: Floats
    receiving: Floats


class Hf(NamedTuple):
    """The HF band of a mission: how long (s) a signal lasts, how far (m) it is heard, in slant or
    horizontal range, the sound speed (m/s), and how long (s) the mission lasts.
    """

    signal: float
    reach: float
    by_slant: bool
    sound_speed: float
    mission: float


def energy(on_air: OnAir, powers: Powers, duration: float | Floats) -> Floats:
    """Return the energy (J), (n,), of each vehicle's modem over a duration (s), one for all or
    (n,).

    >>> energy(OnAir(np.array([1.0]), np.array([2.0])), Powers(10.0, 0.5, 0.1), 100.0)
    array([20.7])
    """
    waiting = np.maximum(duration - on_air.sending - on_air.receiving, 0.0)
    return (
        powers.sending * on_air.sending
        + powers.receiving * on_air.receiving
        + powers.waiting * waiting
    )


def on_hf(
    record: Recorder, pinging: str, fleets: Mapping[str, VehicleFleet], hf: Hf, packets: Rows
) -> dict[str, OnAir]:
    """Return how long the vehicles of each of the `fleets`, "auv" and "asv", send and receive
    pings, calls, and `packets`, rows of sounds; overlapping signals count once.

    Vehicles of the kind `pinging` ping.  Which vehicles of the other kind hear pings is on record;
    all else is heard within HF range.
    """
    pings, receptions = record.pings.rows, record.receptions.rows
    called = pings["call"] != NONE
    sent = pings[~called | (pings["call"] == HEARD)]
    begun = (receptions["outcome"] != OUT_OF_RANGE) & ~np.isnan(receptions["arrived_at_s"])
    met, calls = receptions[begun], np.unique(pings[called][["called_at_s", "called_by"]])
    callers = [
        fleets["asv"].ways.of(call["called_by"], np.array([call["called_at_s"]])).truth[0, :3]
        for call in calls
    ]
    by_call = SentSignals(calls["called_at_s"], calls["called_by"], np.reshape(callers, (-1, 3)))
    places = np.column_stack([sent[name] for name in ("x_m", "y_m", "z_m")])
    by_ping = SentSignals(sent["sent_at_s"], sent[pinging], places)
    found = {}
    for kind, fleet in fleets.items():
        found[kind] = OnAir(*np.zeros((2, len(fleet))))
        for number in range(len(fleet)):
            heard = [_heard(by_call, fleet, number, kind == "asv", hf)]
            if kind == pinging:
                heard.append(_heard(by_ping, fleet, number, True, hf))
                own = by_ping.at[by_ping.by == number]
            else:
                heard.append(met["arrived_at_s"][met[kind] == number])
                own = np.empty(0)
            if kind == "asv":
                own = np.append(own, by_call.at[by_call.by == number])
            times = (np.sort(own), np.sort(np.concatenate(heard)))
            if len(packets):
                vehicle = number if kind == "auv" else len(fleets["auv"]) + number
                here = packets[packets["listener"] == vehicle]
                is_own = here["sender"] == vehicle
                rows = here[is_own], here[~is_own & (here["arrived_at_s"] < hf.mission)]
                for total, begins, beside in zip(found[kind], times, rows, strict=True):
                    total[number] = _beside(begins, beside, hf)
                continue
            for total, begins in zip(found[kind], times, strict=True):
                total[number] = covered(begins, hf.signal, hf.mission)
    return found


def _beside(begins: Floats, packets: Rows, hf: Hf) -> float:
    """Return the time (s) covered by pings and calls from `begins` (n,), s, on and by `packets`."""
    every = np.concatenate((begins, packets["arrived_at_s"]))
    lasts, order = np.append(np.full(len(begins), hf.signal), packets["lasts_s"]), np.argsort(every)
    return together(every[order], lasts[order], hf.mission)


class SentSignals(NamedTuple):
    """Signals of one kind of vehicle: when (n,), s, by whom (n,), and from where (n, 3), m."""

    at: Floats
    by: Ints
    places: Floats


def _heard(signals: SentSignals, fleet: VehicleFleet, number: int, is_own: bool, hf: Hf) -> Floats:
    """Return when (s) signals in range begin at a vehicle; without its own, if they are of its
    fleet (`is_own`), and without any while it has failed.
    """
    away = signals.places - fleet.ways.of(number, np.array(signals.at)).truth[:, :3]
    slant = np.linalg.norm(away, axis=1)
    near = (slant if hf.by_slant else np.hypot(away[:, 0], away[:, 1])) <= hf.reach
    if is_own:
        near &= signals.by != number
    if fleet.failures is not None:
        near &= np.array([number not in fleet.failed(time) for time in signals.at], dtype=bool)
    return np.asarray((signals.at + slant / hf.sound_speed)[near])


def covered(starts: Floats, length: float, end: float) -> float:
    """Return the time (s) before `end` that intervals of one length cover, overlaps counted once.

    `starts` (n,) rise.

    >>> round(covered(np.array([0.0, 1.0, 1.0, 1.5, 9.5]), 1.0, 10.0), 9)
    3.0
    """
    gaps = np.minimum(np.diff(starts, append=end), length)
    return float(np.maximum(gaps, 0.0).sum())


def together(begins: Floats, lasts: Floats, end: float) -> float:
    """Return the time (s) before `end` covered by intervals (n,) whose `begins` (s) rise.

    >>> together(np.array([0.0, 1.0, 5.0]), np.array([2.0, 0.5, 3.0]), 6.0)
    3.0
    """
    ends = np.minimum(begins + lasts, end)
    until = np.maximum.accumulate(np.append(0.0, ends))[:-1]
    overlapping = np.maximum(ends - until, 0.0)
    added = np.where(begins >= until, np.minimum(lasts, end - begins), overlapping)
    return float(np.cumsum(np.append(0.0, added))[-1])


def on_sea(record: Recorder, sounds: Rows, auvs: int, asvs: int, end: float) -> dict[str, OnAir]:
    """Return how long AUVs and ASVs send and receive on HF with access programs, by all `sounds`
    and receptions of a mission that lasts until `end` (s).
    """
    met = record.receptions.rows
    met = met[(met["outcome"] != OUT_OF_RANGE) & ~np.isnan(met["arrived_at_s"])]
    found = OnAir(*np.zeros((2, auvs + asvs)))
    for vehicle, rows in enumerate(by_number(sounds["listener"], auvs + asvs)):
        here = sounds[rows]
        here = here[here["arrived_at_s"] < end]
        own = here["sender"] == vehicle
        pings = met[met["asv"] == vehicle - auvs]
        begins, ends = (
            np.concatenate((here[name][~own], pings[name]))
            for name in ("arrived_at_s", "ended_at_s")
        )
        sent, order = here[own], np.argsort(begins, kind="stable")
        found.sending[vehicle] = together(sent["sent_at_s"], sent["lasts_s"], end)
        found.receiving[vehicle] = together(begins[order], (ends - begins)[order], end)
    return {
        "auv": OnAir(*(each[:auvs] for each in found)),
        "asv": OnAir(*(each[auvs:] for each in found)),
    }


def on_mf(
    frames: Sequence[Broadcast | AuvFrame],
    places: tuple[Callable[[float], Floats], Callable[[float], Floats]],
    reach: float,
    duration: float,
    failed: Callable[[float], Sequence[int]] = lambda _: (),
    by_slant: bool = False,
) -> tuple[OnAir, OnAir]:
    """Return how long AUVs and ASVs send and receive frames, in the order in which they begin;
    overlapping frames count once.

    `places` are functions of an instant (s) that return the positions of AUVs (n, 3+) and ASVs (m,
    3+), m; frames reach `reach` (m), horizontally unless `by_slant`.  ASVs that have `failed` by an
    instant receive none.
    """
    axes = 3 if by_slant else 2
    found = [OnAir(*np.zeros((2, len(where(0.0))))) for where in places]
    over = [np.zeros(len(on_air.receiving)) for on_air in found]  # s up to which time is counted
    for frame in frames:
        begins, lasts = frame.sent_at_s, min(frame.airtime_s, duration - frame.sent_at_s)
        if lasts <= 0.0:
            continue
        of_asv = isinstance(frame, Broadcast)
        sender = frame.asv if isinstance(frame, Broadcast) else frame.auv
        here = places[of_asv](begins)[sender, :axes]
        found[of_asv].sending[sender] += lasts
        own = (sender,)
        deaf_auvs, deaf_asvs = ((), own) if of_asv else (own, ())
        for where, on_air, until, deaf in zip(
            places, found, over, (deaf_auvs, (*deaf_asvs, *failed(begins))), strict=True
        ):
            near = np.linalg.norm(where(begins)[:, :axes] - here, axis=1) <= reach
            near[list(deaf)] = False
            more = np.where(until <= begins, lasts, np.maximum(begins + lasts - until, 0.0))
            on_air.receiving[near] += more[near]
            until[near] = np.maximum(until[near], begins + lasts)
    return found[0], found[1]
