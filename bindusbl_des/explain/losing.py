"""Why signals are lost, in words: what a channel other than the disc makes of them, losses that
last (`burst_s`), who else is on the air with random access, and what was wrong all the time when a
fix was made, as nobody on board knew.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..acoustics.bursts import PAIR, lost_since
from ..acoustics.channel import AskedChannel, between
from ..core.plugins import is_plugin
from ..core.streams import Purpose, Streams, pair_keys
from ..core.wording import counted, plain, plus_minus
from ..mission.build import slow_errors
from ..mission.closed_loop import slow_gnss
from ..mission.sensor_errors import clocks, misalignments
from ..preflight.fix_chance import below
from ..scenario.channel_settings import burst_s
from ..scenario.declared import channel_named
from ..scenario.part_choice import PartChoice
from ..setup import Setup
from ..usbl.measuring import slow_path_sd
from ..usbl.slow_errors import RANGE, advance
from ..vehicles.currents import CONTROL_S
from .chain import Step, place, row_of, rows_where

if TYPE_CHECKING:
    from ..results.result import Result


def located(fix: Any) -> str:
    """Return in words where a fix is, and how surely."""
    x, y = plus_minus(fix.x_m, fix.sd_x_m), plus_minus(fix.y_m, fix.sd_y_m)
    return f"x {x}, y {y} m"


def wrong(result: "Result", fix: Any) -> tuple[list[str], dict[str, float]]:
    """Return in words, and as numbers, the systematic errors that a fix contains.

    They are drawn anew, as the mission of this seed drew them.
    """
    if is_plugin(result.scenario.usbl.model):
        return [], {}
    has = {kind.name for kind in result.setup.lasting_errors}
    found = [*_of_vessels(result, fix, has), *_shared(result, fix, has)]
    return [text for text, _ in found], {
        name: value for _, facts in found for name, value in facts.items()
    }


def _of_vessels(
    result: "Result", fix: Any, has: set[str]
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield what is wrong with the ASVs that have measured a fix, or the AUV that has itself."""
    world, streams = result.scenario, Streams(result.seed)
    passive, names = world.protocol.asvs_ping, fix.asvs.split()
    asvs = [int(name.removeprefix("ASV")) for name in names]
    if "misalignment" in has:
        carriers = [fix.auv] if passive else names
        turns = np.degrees(misalignments(result.setup, streams))[
            [int(carrier[3:]) for carrier in carriers]
        ]
        text = ", ".join(
            f"{carrier} {turn:+.2f}" for carrier, turn in zip(carriers, turns, strict=True)
        )
        facts = {
            f"{carrier}_misalignment_deg": float(turn)
            for carrier, turn in zip(carriers, turns, strict=True)
        }
        yield f"headings misaligned (deg): {text}", facts
    if "gnss" in has:
        met = rows_where(result.tables["receptions"], ping=fix.ping)
        arrived = [
            fix.pinged_at_s if passive else float(rows_where(met, asv=name).arrived_at_s.iloc[0])
            for name in names
        ]
        slow = slow_gnss(result.setup, streams)
        off = [slow[asv, int(time / CONTROL_S)] for asv, time in zip(asvs, arrived, strict=True)]
        text = ", ".join(f"{n} {x:+.2f} {y:+.2f}" for n, (x, y) in zip(names, off, strict=True))
        facts = {
            f"{name}_gnss_{axis}_m": float(error)
            for name, place in zip(names, off, strict=True)
            for axis, error in zip("xy", place, strict=True)
        }
        yield f"GNSS slowly astray (x y, m): {text}", facts
    if "slow" in has and not result.setup.ranging.calls:  # of a call and its answer: in a path
        errors = {name: _slow_error(result, fix, name) for name in names}
        text = ", ".join(f"{name} {error:+.3f}" for name, error in errors.items())
        facts = {f"{name}_slow_range_m": error for name, error in errors.items()}
        yield f"ranges slowly astray (m): {text}", facts


def _slow_error(result: "Result", fix: Any, asv: str) -> float:
    """Return by how much (m) the slow error of an ASV makes the range too long that it measured."""
    world, levels = result.scenario, replace(result.setup.usbl, slow_share=1.0).levels[0]
    numbers = slow_errors(result.setup, Streams(result.seed))
    if numbers is None:
        return 0.0
    pair = numbers[int(fix.auv.removeprefix("AUV")), int(asv.removeprefix("ASV"))]
    heard = rows_where(result.tables["receptions"], auv=fix.auv, asv=asv)
    decided = heard[heard.outcome.isin(["heard", "lost", "collided"])]
    met = rows_where(decided, ping=fix.ping).iloc[0]
    for time in decided[decided.arrived_at_s <= met.arrived_at_s].arrived_at_s:
        advance(pair, time)
    way = float(met.travel_time_s) * result.setup.assumed_sound_speed_m_per_s
    noise = math.sqrt(world.usbl.slow_share) * float(pair["value"][RANGE])
    return noise * float(slow_path_sd(way, levels))


def _shared(result: "Result", fix: Any, has: set[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield what is wrong for all ASVs at once."""
    world = result.scenario
    if "sound_speed" in has:
        share = result.setup.sound_speed_error
        way = "long" if share > 0 else "short"
        text = f"ranges {100 * abs(share):.2f} % too {way}: sound is assumed to travel at "
        text += f"{result.setup.assumed_sound_speed_m_per_s:g}, not at "
        text += f"{result.setup.sound_speed_m_per_s:g} m/s"
        yield text, {"sound_speed_error": share}
    ping = row_of(result, "pings", "ping", int(fix.ping))
    if "clock" in has and not isinstance(ping.get("call"), str):
        offset, drift = clocks(result.setup, Streams(result.seed))[int(fix.auv.removeprefix("AUV"))]
        passive = world.protocol.asvs_ping  # it says when it hears, not when it pings
        late = offset + drift * (fix.valid_at_s if passive else fix.pinged_at_s)
        longer = late * result.setup.assumed_sound_speed_m_per_s * (-1 if passive else 1)
        text = (
            f"the clock of {fix.auv} is {1e3 * late:+.3f} ms late: ranges {longer:+.2f} m too long"
        )
        yield text, {"clock_late_s": float(late)}


# Instants (s) that differ by less are one.
SAME = 1e-9


def sending_at_random(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the cycle of the downlink that a ping falls into, and the ping."""
    protocol = result.scenario.protocol
    row = row_of(result, "rounds", "round", ping["round"])
    yield Step(
        row.started_at_s,
        f"Round {ping['round']}",
        f"begins: {_why_round(protocol.replies)} ({protocol.schedule.words})",
        f"AUVs ping as they like; {counted(row.conflicts, 'pair')} of them could collide at an ASV",
        {"round": ping["round"], "conflicts": row.conflicts},
    )
    waited = ping.get("waited_s")
    yield Step(
        ping.sent_at_s,
        ping.auv,
        f"pings at x {ping.x_m:.1f}, y {ping.y_m:.1f}, depth {ping.z_m:.1f} m",
        f"{_why_now(result, ping)}; {_others_on_air(result, ping)}",
        {
            "x_m": ping.x_m, "y_m": ping.y_m, "z_m": ping.z_m,
            **({} if waited is None else {"held_back_s": waited}),
        },
    )  # fmt: skip


def _why_round(replies: bool) -> str:
    if replies:
        return "it lasts as long as the mission, since each ping is answered by itself"
    return "MF is free"


def why_broadcast(result: "Result", fix: Any, frame: Any, known_at_s: float) -> str:
    """Tell what a fix has waited for, which the fleet has known since an instant (s)."""
    downlink, slots = result.scenario.protocol.downlink, result.setup.slots
    waited, begun = fix.broadcast_at_s - known_at_s, frame.sent_at_s
    started = row_of(result, "rounds", "round", int(frame["round"])).started_at_s
    if begun <= slots.clock.after(known_at_s, 0.0) + SAME:
        return f"{downlink}: MF was free, so that it is broadcast at once"
    if frame.get("part"):
        return f"{downlink}: it is in message {frame.part + 1} of its broadcast"
    if started < known_at_s:
        return f"{downlink}: no ASV worked for {waited:.4f} s"
    return f"{downlink}: frames before it held the band until now, for {waited:.4f} s"


def _why_now(result: "Result", ping: Any) -> str:
    """Tell by which rule an AUV pings at this instant."""
    protocol = result.scenario.protocol
    access = result.setup.schedule.access
    if access == "poisson":
        return (
            f"{protocol.schedule}: an instant of its own Poisson process, on average every "
            f"{protocol.frame_s:g} s; it asks nobody"
        )
    if access == "slotted":
        slots = result.setup.slots
        length = slots.clock.after(0.0, slots.uplink_slot)
        return (
            f"{protocol.schedule}: slot {round(ping.sent_at_s / length)} of {length:.4f} s begins, "
            "and in the one before it has had something to send"
        )
    waited = float(ping.waited_s)
    if waited <= 0.0:
        return (
            f"{protocol.schedule}: it hears no other AUV, so that it pings as soon as it has "
            "something to send"
        )
    return (
        f"{protocol.schedule}: it has had something to send since {ping.sent_at_s - waited:.4f} s, "
        f"but heard a ping then, or sent one; it held back for {waited:.4f} s, until its backoff "
        "was counted down in quiet"
    )


def _others_on_air(result: "Result", ping: Any) -> str:
    """Tell which AUVs ping while this one does."""
    lasts, pings = result.scenario.acoustics.hf.ping_s, result.tables["pings"]
    beside = pings[(pings.sent_at_s - ping.sent_at_s).abs() < lasts]
    others = beside[beside.ping != ping.ping]
    if not len(others):
        return "nobody else pings meanwhile"
    text = [
        f"{row.auv} since {row.sent_at_s:.4f} s (ping {row.ping})" for row in others.itertuples()
    ]
    return f"others ping meanwhile: {', '.join(text)}"


def ping_burst_words(result: "Result", reception: Any, loss: float | None) -> str:
    """Tell since when pings of a pair were lost as one arrived that was, with its probability of
    that, None where nobody knows it; "" where each is lost by itself.
    """
    channel = result.scenario.acoustics.hf.channel
    time = float(reception.arrived_at_s)
    return _burst_step(result, channel, Purpose.BURST, (reception.auv, reception.asv), time, loss)


def frame_burst_words(result: "Result", fix: Any) -> str:
    """Tell since when frames of a pair were lost as one began that was, with a fix; "" where each
    is lost by itself.
    """
    channel, time = result.scenario.acoustics.mf.channel, float(fix.broadcast_at_s)
    if burst_s(channel) is None:
        return ""
    vehicles = fix.auv, fix.broadcast_by
    loss = None if is_plugin(channel) else _frame_loss(result, fix)
    return _burst_step(result, channel, Purpose.FRAME_BURST, vehicles, time, loss)


def _frame_loss(result: "Result", fix: Any) -> float:
    """Return how likely the frame of a fix was lost, from where both are in the tables."""
    channel_of, time = result.setup.frame_channel, float(fix.broadcast_at_s)
    assert channel_of is not None
    frames = rows_where(result.tables["broadcasts"], sent_at_s=time, asv=fix.broadcast_by)
    auv, asv = (place(result, name, time)[None, :3] for name in (fix.auv, fix.broadcast_by))
    signals = between(time, auv, asv, result.scenario.acoustics.mf.range_m, calling=True)
    frame: Any = frames.iloc[0]
    channel = channel_of(int(frame.payload_bytes), float(frame.airtime_s))
    return float(channel.prospects(signals)["loss"][0, 0])


def burst_words(channel: PartChoice) -> str:
    """Tell how long losses of a channel last; "" where each signal is lost by itself."""
    mean_s = burst_s(channel)
    return "" if mean_s is None else f"losses last {plain(mean_s)} s on average (burst_s)"


def _burst_step(
    result: "Result",
    channel: PartChoice,
    purpose: Purpose,
    vehicles: tuple[str, str],
    time: float,
    loss: float | None,
) -> str:
    mean_s, words = burst_s(channel), burst_words(channel)
    if mean_s is None:
        return ""
    auv, asv = (int(name[3:]) for name in vehicles)
    key = pair_keys(Streams(result.seed), purpose, auv, asv + 1)[asv]
    pair = np.array([(key, mean_s)], dtype=PAIR)[0]
    since = math.nan if loss is None else lost_since(pair, time, loss)
    if math.isnan(since):
        return words
    begun = "the start" if since == 0.0 else f"{since:.2f} s"
    return f"{words}, and this pair had lost its signals since {begun}"


LEVELS = ("snr_db", "level_db", "margin_db")


def levels(reception: Any) -> dict[str, float]:
    """Return the levels (dB) of a reception, nothing where the channel knows of none."""
    found = {name: getattr(reception, name) for name in LEVELS}
    return {} if any(value is None or math.isnan(value) for value in found.values()) else found


def audible(result: "Result", receptions: Any) -> NDArray[np.bool_]:
    """Tell which receptions are sounds that may drown others, decoded or not."""
    heard = (receptions.outcome != "out_of_range").to_numpy()
    channel = None
    if not is_plugin(result.scenario.acoustics.hf.channel):
        channel = result.setup.ping_channel
    if channel is None or channel.audible_m is None:
        return np.asarray(heard)
    return np.asarray(heard | (receptions.slant_range_m <= channel.audible_m).to_numpy())


def decided_by_channel(
    result: "Result", reception: Any, others: list[str], depth: float
) -> tuple[str, str]:
    """Return what becomes of a ping by a curve or by its SNR, and why; `others` overlap it, and its
    AUV is so deep (m).
    """
    scenario, outcome = result.scenario, reception.outcome
    setup = result.setup
    loss = loss_by_channel(setup, float(reception.slant_range_m), depth)
    level, chance = _level(reception), _chance(setup, reception, loss)
    overlap = f"overlaps {', '.join(others)}" if others else "no other ping overlaps"
    if outcome == "collided" and not others:
        overlap = "overlaps the echo of another ping"
    if outcome == "out_of_range":
        return "cannot decode it", level or chance
    if outcome == "in_flight":
        ends = reception.arrived_at_s + scenario.acoustics.hf.ping_s
        return "would hear it, but the mission ends", (
            f"the ping ends at {ends:.4f} s, the mission at {scenario.duration_s:g} s; {chance}"
        )
    if outcome == "collided":
        return "hears pings mixed", "; ".join(filter(None, [level, overlap, _capture(setup)]))
    survived = [overlap, _capture(setup)] if others else [overlap]
    if outcome == "lost":
        drawn = "" if level else ", and the draw (not recorded) was below"
        lasts = ping_burst_words(result, reception, loss)
        return "loses it", "; ".join(filter(None, [level, *survived, f"{chance}{drawn}", lasts]))
    return "decodes it", "; ".join(filter(None, [level, *survived, chance]))


def loss_by_channel(setup: Setup, slant_range_m: float, depth: float) -> float:
    """Return the probability that a ping is lost over a range (m) if nothing overlaps it, between
    the surface and so deep an AUV (m).
    """
    signal = between(
        0.0,
        *below(np.array([slant_range_m]), depth),
        setup.scenario.acoustics.hf.range_m,
        calling=False,
    )
    return float(_asked(setup).prospects(signal)["loss"][0, 0])


def _level(reception: Any) -> str:
    """Tell how loud a ping arrived, "" where the channel knows of no levels."""
    found = levels(reception)
    if not found:
        return ""
    margin = found["margin_db"]
    needed = found["snr_db"] - margin
    side = "above" if margin >= 0.0 else "below"
    return (
        f"heard at {found['snr_db']:.1f} dB over the noise, {abs(margin):.1f} dB {side} the "
        f"{needed:.1f} dB at which half of all pings are decoded"
    )


def _chance(setup: Setup, reception: Any, loss: float) -> str:
    """Tell how likely a ping was lost on its way."""
    channel, away = setup.scenario.acoustics.hf.channel, float(reception.slant_range_m)
    if not channel_named(channel).has_levels:
        file = channel.settings.get("file")
        by = f"the curve {Path(file).name}" if file else f"the channel {channel}"
        return f"loss probability {loss:.3f} by {by} at {away:.1f} m"
    spread = _asked(setup).receiver.shadowing_sd_db
    if setup.pings_echo:
        return f"{spread:g} dB of shadowing about the level that echoes leave"
    return f"loss probability {loss:.3f}, with {spread:g} dB of shadowing about the level expected"


def _capture(setup: Setup) -> str:
    capture = _asked(setup).receiver.capture
    if math.isinf(capture):
        return ""
    return f"what is {10 * math.log10(capture):g} dB above noise and others together survives"


def _asked(setup: Setup) -> AskedChannel:
    channel = setup.ping_channel
    assert channel is not None
    return channel
