"""The receptions of a ping: which vehicle decodes it, which does not, and by which rule."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .chain import (
    Step,
    apart,
    behind,
    compared,
    failed_at,
    known,
    lines,
    lost_in_a_row,
    position_at,
    rows_where,
    too_fast,
)

if TYPE_CHECKING:
    from ...core.results.result import Result

LEVELS = ("snr_db", "level_db", "margin_db")

# A vessel slower than this (m/s) rests; with a smaller change of heading (rad) it goes straight.
RESTS, STRAIGHT = 1e-3, 1e-3


def is_sent(ping: Any) -> bool:
    """Tell whether an AUV sent this ping: not if the call for it failed (two-way ranging)."""
    return ping.get("call") in (None, "heard")


def receptions(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield one step for each reception of a ping; none for a ping that was not sent.

    ASVs receive pings; with passive ranging AUVs receive those of ASVs.
    """
    if not is_sent(ping):
        return
    hf, protocol = result.scenario.acoustics.hf, result.scenario.protocol
    met = rows_where(result.tables["receptions"], ping=ping.ping).sort_values("arrived_at_s")
    for reception in met.itertuples():
        depth = ping.z_m
        if protocol.asvs_ping:
            depth = position_at(result, str(reception.auv), float(reception.arrived_at_s))[2]
        slant = away = float(reception.slant_range_m)
        if hf.range_metric != "slant":  # ASVs float at the surface
            away = math.sqrt(max(slant**2 - depth**2, 0.0))
        what, why = _decided(result, reception, away)
        path = f"{reception.slant_range_m:.1f} m, {1e3 * reception.travel_time_s:.1f} ms"
        facts = {
            "outcome": reception.outcome,
            "why": known(reception.why),
            "slant_range_m": reception.slant_range_m,
            "travel_time_s": reception.travel_time_s,
            "range_m": away,
            "limit_m": hf.range_m if hf.traits.ends_at_range else None,
            "loss_probability": known(reception.loss_probability),
            **_levels(reception),
        }
        who = getattr(reception, protocol.listening)
        yield Step(reception.arrived_at_s, who, f"{what} ({path})", why, facts)


def _decided(result: "Result", reception: Any, away: float) -> tuple[str, str]:
    """Return the outcome of one reception and the reason, from its column `why`.

    `away` is the distance (m) in the metric of the band.
    """
    why, outcome, hf = known(reception.why), reception.outcome, result.scenario.acoustics.hf
    begin, asv = float(reception.arrived_at_s), str(reception.asv)
    sent = begin - float(reception.travel_time_s)
    near, chance = _near(result, reception, away), _chance(result, reception)
    if why == "failed":
        return "hears nothing", f"{asv} had {failed_at(result, asv, begin)}"
    if why == "failed_meanwhile":
        passive = result.scenario.protocol.asvs_ping
        when = failed_at(result, asv, (sent if passive else begin) + hf.ping_s)
        return "loses it", f"{asv} {when}, while it {'pinged' if passive else 'was hearing it'}"
    if outcome == "blocked":
        return "hears nothing", behind(result, str(reception.auv), asv, sent)
    if outcome == "out_of_range":
        what = "is too far away" if hf.traits.ends_at_range else "hears nothing"
        return what, (near or f"it is {hf.beyond}") + on_its_way(result, asv, begin)
    if outcome == "in_flight":
        ends = f"the ping ends at {begin + hf.ping_s:.4f} s"
        ends += f", the mission at {result.scenario.duration_s:g} s"
        return "would hear it, but the mission ends", lines(near, ends)
    if why == "own_frame":
        return "hears nothing", _own_frame(result, reception)
    if why == "own_signal":
        return "hears nothing", f"it sends {_signal(result, reception)}"
    if outcome == "collided":
        return "hears pings mixed", lines(near, _overlapping(result, reception))
    if why == "doppler":
        pair = str(reception.auv), asv
        return "loses it", lines(near, too_fast(result, "hf", pair, sent))
    alone = "nothing drowns it" if _levels(reception) else "no other ping overlaps"
    if outcome == "heard":
        return "decodes it", lines(near, alone, chance)
    if chance and not _levels(reception):
        chance += ", and the draw (not recorded) was below"
    lasts = ""
    if why == "burst":
        both = {"auv": reception.auv, "asv": reception.asv}
        lasts = lost_in_a_row(hf, rows_where(result.tables["receptions"], **both), begin)
    return "loses it", lines(near, alone, chance, lasts)


def _near(result: "Result", reception: Any, away: float) -> str:
    """Compare the distance (m) with the band's range, or tell the level if there is no range."""
    hf = result.scenario.acoustics.hf
    if not hf.traits.ends_at_range:
        return _level(reception)
    # A vessel that moves may cross the limit while the ping is under way.
    as_decided = (away > hf.range_m) == (reception.outcome == "out_of_range")
    words = compared(away, hf.range_m) if as_decided else "at the edge of the"
    return f"{hf.range_metric} range {words} HF range"


def _levels(reception: Any) -> dict[str, float]:
    """Return the levels (dB) of a reception; {} if the channel computes none."""
    found = {name: getattr(reception, name) for name in LEVELS}
    return {} if any(known(value) is None for value in found.values()) else found


def _level(reception: Any) -> str:
    """Tell at which SNR a ping arrived; "" if the channel computes no levels."""
    found = _levels(reception)
    if not found:
        return ""
    margin = found["margin_db"]
    side = "above" if margin >= 0.0 else "below"
    return (
        f"heard at {found['snr_db']:.1f} dB over the noise, {abs(margin):.1f} dB {side} the "
        f"{found['snr_db'] - margin:.1f} dB at which half of all pings are decoded"
    )


def _chance(result: "Result", reception: Any) -> str:
    """Tell the probability that a ping was lost, and its cause; "" if not recorded."""
    probability = known(reception.loss_probability)
    if probability is None:
        return ""
    words = f"loss probability {probability:.3f}"
    channel, loss = result.scenario.acoustics.hf.channel, result.scenario.acoustics.loss
    if _levels(reception):
        return f"{words} before the shadowing of this ping"
    if not result.scenario.acoustics.hf.traits.ends_at_range:
        file = None if channel.is_own else channel.settings.get("file")
        by = f"the curve {Path(file).name}" if file else f"the channel {channel.words}"
        return f"{words} by {by} at {reception.slant_range_m:.1f} m"
    words += f" by range law '{loss.law}'"
    if loss.combine == "off":
        return words
    return f"{words} and contention, {loss.contention_per_auv:g} a further AUV ({loss.combine})"


def _overlapping(result: "Result", reception: Any) -> str:
    """Tell which signal overlapped a ping at its listener, and for how long."""
    by, why = known(reception.overlapped_by), known(reception.why)
    if by is None:
        return "another sound overlaps it (which one, this folder does not say)"
    capture = result.scenario.acoustics.hf.channel.settings.get("capture_db")
    needs = "" if capture is None else f"; it had to be {capture:g} dB above noise and others"
    if why == "call":
        return f"overlaps the call of ASV{by:.0f}{needs}"
    if why == "packet":
        sent = rows_where(result.tables["packets"], packet=int(by)).iloc[0]
        return (
            f"overlaps data of {sent.auv} (packet {by:.0f}, from {sent.sent_at_s:.4f} s on){needs}"
        )
    if why == "signal":
        return f"overlaps {_signal(result, reception)}{needs}"
    protocol, lasts = result.scenario.protocol, result.scenario.acoustics.hf.ping_s
    here = {protocol.listening: getattr(reception, protocol.listening)}
    other = rows_where(result.tables["receptions"], ping=by, **here).iloc[0]
    ping = f"ping {other.ping} of {other[protocol.pinging]}"
    if why == "echo":
        return f"overlaps the echo of {ping}{needs}"
    beside = lasts - abs(other.arrived_at_s - reception.arrived_at_s)
    return (
        f"overlaps {ping} at {other.arrived_at_s:.4f} s (overlap {1e3 * beside:.1f} of "
        f"{1e3 * lasts:.1f} ms){needs}"
    )


def _signal(result: "Result", reception: Any) -> str:
    """Tell which signal of a program overlapped a ping at its listener."""
    signal = result.tables["signals"].iloc[int(reception.overlapped_by)]
    over = signal.sent_at_s + signal.lasts_s
    return (
        f"signal {signal.signal}, {signal.kind!r} of {signal.sender}, sent from "
        f"{signal.sent_at_s:.4f} to {over:.4f} s"
    )


def _own_frame(result: "Result", reception: Any) -> str:
    """Tell which frame an ASV was sending while a ping arrived."""
    frame = result.tables["broadcasts"].iloc[int(reception.overlapped_by)]
    over = frame.sent_at_s + frame.airtime_s
    rule = "direct_reply" if result.scenario.protocol.replies else "duplex per_node"
    return f"it sends a frame from {frame.sent_at_s:.4f} to {over:.4f} s ({rule})"


def on_its_way(result: "Result", vessel: str, time: float) -> str:
    """Return where a vessel was heading at time (s), and how fast; "" if it did not move.

    The target is the row of its track at which it next changes its heading or rests.
    """
    if result.scenario.asvs.formation.moored is not None:
        return ""
    track = rows_where(result.tables["tracks"], vehicle=vessel)
    times, x, y = (track[name].to_numpy(float) for name in ("time_s", "x_m", "y_m"))
    steps, lasts = np.diff(x) + 1j * np.diff(y), np.diff(times)
    now = max(int(np.searchsorted(times, time, side="right")) - 1, 0)
    if now >= len(lasts) or abs(steps[now]) < RESTS * lasts[now]:
        return ""
    same = np.abs(np.angle(steps[now:] / steps[now])) < STRAIGHT
    same &= np.abs(steps[now:]) >= RESTS * lasts[now:]
    end = now + (int(same.argmin()) if not same.all() else len(same))
    speed = (np.abs(steps[now:end]) / lasts[now:end]).max()
    return f"; {vessel} was on its way to x {x[end]:.0f}, y {y[end]:.0f} m at {speed:.2g} m/s"


def why_unanswered(result: "Result", ping: Any) -> str:
    """Tell why an AUV did not answer a call."""
    hf, auv, asv = result.scenario.acoustics.hf, ping.auv, ping.called_by
    away = apart(hf, position_at(result, asv, ping.called_at_s), (ping.x_m, ping.y_m, ping.z_m))
    if ping.call == "in_flight":
        return f"the mission ends before {auv} answers"
    if ping.call_why == "failed_meanwhile":
        return f"{asv} {failed_at(result, asv, ping.called_at_s + hf.ping_s)}, while it called"
    if ping.call == "blocked":
        return behind(result, auv, asv, ping.called_at_s)
    if ping.call == "out_of_range":
        return f"{auv} is {away:.1f} m away, {hf.beyond}"
    if ping.call == "collided":
        by = known(ping.call_why) or "call"
        if by.startswith("own_"):
            return f"{auv} sends a {by[4:]} itself meanwhile"
        return f"another {'ASV' if by == 'call' else 'vehicle'}'s {by} overlaps it at {auv}"
    if ping.call_why == "doppler":
        return f"{auv} loses the call: {too_fast(result, 'hf', (auv, asv), ping.called_at_s)}"
    words = f"{auv}, {away:.1f} m away, loses the call by chance"
    if ping.call_why != "burst":
        return words
    return f"{words}; losses last {hf.burst_s:g} s on average (burst_s)"
