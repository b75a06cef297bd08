"""What modems draw: how long each vehicle sends and receives on a band, and the energy of that.

Everybody listens for the whole mission.  A call counts at the ASV that sends it and at the AUVs
that answer it, a frame at its ASV and at the AUVs within range as it begins.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..records.events import HEARD, OUT_OF_RANGE, Broadcast
from ..records.recorder import Recorder
from ..records.rows import NONE
from ..vehicles.motion import Floats, Ints


class Powers(NamedTuple):
    """Electrical power (W) of a modem that sends, receives, or waits."""

    sending: float
    receiving: float
    waiting: float


class OnAir(NamedTuple):
    """How long (s) each of n vehicles sends and receives on a band, (n,) each."""

    sending: Floats
    receiving: Floats


class Times(NamedTuple):
    """How long (s) a signal of a band lasts, and the mission."""

    signal: float
    mission: float


def energy(on_air: OnAir, powers: Powers, duration: float | Floats) -> Floats:
    """Return what the modem of each vehicle draws (J), shape (n,), that works for a duration (s),
    one for all or (n,).

    >>> energy(OnAir(np.array([1.0]), np.array([2.0])), Powers(10.0, 0.5, 0.1), 100.0)
    array([20.7])
    """
    waiting = np.maximum(duration - on_air.sending - on_air.receiving, 0.0)
    return (
        powers.sending * on_air.sending
        + powers.receiving * on_air.receiving
        + powers.waiting * waiting
    )


def on_hf(record: Recorder, pinging: str, auvs: int, asvs: int, times: Times) -> dict[str, OnAir]:
    """Return how long the vehicles of each kind, "auv" and "asv", send and receive pings and calls.

    Those of the kind `pinging` ping, the others listen.
    """
    pings, receptions = record.pings.rows, record.receptions.rows
    called, answers = pings["call"] != NONE, pings["call"] == HEARD
    sent, answered = pings[~called | answers], pings[answers]
    begun = (receptions["outcome"] != OUT_OF_RANGE) & ~np.isnan(receptions["arrived_at_s"])
    met, calls = receptions[begun], np.unique(pings[called][["called_at_s", "called_by"]])
    found = {"auv": OnAir(*np.zeros((2, auvs))), "asv": OnAir(*np.zeros((2, asvs)))}
    listening = "asv" if pinging == "auv" else "auv"
    _add(found[pinging].sending, sent[pinging], sent["sent_at_s"], times)
    _add(found[listening].receiving, met[listening], met["arrived_at_s"], times)
    _add(found["asv"].sending, calls["called_by"], calls["called_at_s"], times)
    heard = answered["sent_at_s"] - times.signal  # at the latest: who answers has heard it out
    _add(found["auv"].receiving, answered["auv"], heard, times)
    return found


def _add(total: Floats, vehicles: Ints, begins: Floats, times: Times) -> None:
    """Add to what vehicles spend (s) the signals of a band that begin at instants (s)."""
    np.add.at(total, vehicles, np.clip(times.mission - begins, 0.0, times.signal))


def on_mf(
    broadcasts: Sequence[Broadcast],
    places: tuple[Callable[[float], Floats], Callable[[float], Floats]],
    reach: float,
    duration: float,
) -> tuple[OnAir, OnAir]:
    """Return how long AUVs and ASVs send and receive frames; two at once are received once.

    `places` tell where AUVs (n, 2+) and ASVs (m, 2+) are at an instant (s), m; frames reach
    `reach` (m), as seen from above.
    """
    auvs, asvs = (OnAir(*np.zeros((2, len(where(0.0))))) for where in places)
    over = np.zeros(len(auvs.receiving))  # what each AUV has received until then is counted
    for frame in broadcasts:
        begins, lasts = frame.sent_at_s, min(frame.airtime_s, duration - frame.sent_at_s)
        if lasts > 0.0:
            away = places[0](begins)[:, :2] - places[1](begins)[frame.asv, :2]
            asvs.sending[frame.asv] += lasts
            near = np.hypot(*away.T) <= reach
            more = np.where(over <= begins, lasts, np.maximum(begins + lasts - over, 0.0))
            auvs.receiving[near] += more[near]
            over[near] = np.maximum(over[near], begins + lasts)
    return auvs, asvs
