"""How long slots and rounds last: the command `timing`; what frames hold, what it costs to tell
slots, and the load that AUVs with random access offer.
"""

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from ...support.plugins import is_plugin, loaded
from ...support.wording import counted
from .console import answer, reading_from
from .coverage import limits_data, limits_lines, planned_limits
from .options import json_option, plugins_option, scenario_argument, set_option

if TYPE_CHECKING:
    from ...core.protocol.slots import Slots
    from ...core.scenario.scenario import Scenario
    from ...core.setup import Setup
    from ..preflight.round_lengths import OfferedLoad, Rounds


def assignments(scenario: "Scenario", rounds: "Rounds") -> Iterator[str]:
    """Yield what schedule dissemination takes, where frames carry slots."""
    if not rounds.named:
        return
    slots, protocol, auvs = rounds.slots, scenario.protocol, rounds.auvs
    size = slots.payload_bytes(auvs, rounds.named) - slots.payload_bytes(auvs)
    longer = slots.airtime(auvs, rounds.named) - slots.airtime(auvs)
    yield (
        "Frames name the slots of AUVs (knowledge: broadcast): "
        f"{counted(rounds.named, 'record')} of {protocol.dissemination.assignment_bytes} B "
        "in each broadcast."
    )
    yield f"Beside the records of all fixes they take {size} B and {1e3 * longer:.1f} ms."
    if rounds.contention:
        yield f"A contention slot makes each round {1e3 * slots.uplink_slot:.1f} ms longer."


def behind(slots: "Slots", auvs: int) -> Iterator[str]:
    """Yield what AUVs send behind a broadcast of a fix for each of so many AUVs."""
    if (after := slots.behind) is None:
        return
    longest = max(message.airtime_s for message in slots.messages.packed(auvs))
    busy = slots.held_s(auvs) - slots.airtime(auvs)
    yield f"Behind a broadcast of {auvs} fixes AUVs send for {1e3 * busy:.1f} ms of T_DL:"
    if after.hops:
        who, turn = len(after.relays), 1e3 * after.relay_turn_s(longest)
        yield (
            f"  {counted(who, 'AUV')} forward each frame over {counted(after.hops, 'hop')}, in "
            f"turns of {turn:.1f} ms;"
        )
    if after.acknowledgement is not None:
        size, airtime, _ = after.acknowledging(1)
        turn = 1e3 * after.acknowledgement_turn_s()
        yield (
            f"  each AUV acknowledges its fix by {size} B, {1e3 * airtime:.1f} ms, in turns of "
            f"{turn:.1f} ms."
        )


def messages(slots: "Slots") -> Iterator[str]:
    """Yield what a modem does with messages, where it does more than to send them at its rate."""
    messages = slots.messages
    if messages.most is not None:
        rest = "further ones follow in others" if messages.splits else "further ones wait"
        yield f"A message holds {messages.most} {'fix' if messages.most == 1 else 'fixes'}; {rest}."
    delays = messages.delay(0), messages.delay(messages.most or 0)
    if any(delays):
        delays_ms = span([1e3 * delay for delay in sorted({*delays})])
        yield f"A modem hands a message over {delays_ms} ms after its end."


def span(values: list[float]) -> str:
    """Return values from the first to the last, those that look the same once."""
    return " .. ".join(dict.fromkeys(f"{value:.3f}" for value in values))


def answered(slots: "Slots") -> str:
    """Tell how each ping is answered."""
    if not slots.answer:
        return "each ping is answered as it is heard, without airtime"
    size, airtime = slots.payload_bytes(1), 1e3 * slots.airtime(1)
    return f"each ping is answered as it is heard, in a frame of {size} B, {airtime:.1f} ms"


def _load(setup: "Setup", load: "OfferedLoad") -> Iterator[str]:
    """Yield how often AUVs ping, and how many of these pings meet no other."""
    protocol = setup.scenario.protocol
    yield (
        f"{protocol.program.words}: each AUV has something to send every {protocol.frame_s:g} s "
        "on average, at Poisson instants."
    )
    slotted = setup.schedule.access == "slotted" and setup.scenario.traffic is None
    unit = "slots" if slotted else "pings"
    yield f"{'offered load G':<22}{load.load:>10.3f} {unit} of {1e3 * load.lasts_s:.3f} ms"
    yield f"{'pings of all AUVs':<22}{load.pings_per_s:>10.3f} per s, about"
    if load.success is not None:
        alone = "alone in their slot" if unit == "slots" else "meet no other"
        yield f"{alone:<22}{100 * load.success:>10.1f} % at an ASV that hears all AUVs"
        clear = load.pings_per_s * load.lasts_s * load.success
        yield f"{'throughput S':<22}{clear:>10.3f} {unit} clear, per {unit[:-1]}'s length"
    elif load.window is None or load.slot_s is None:
        of = "the program" if setup.scenario.traffic is None else "data behind pings"
        yield f"{'meet no other':<22}{'-':>10}   not bounded: no closed form tells of {of}"
    else:
        most = load.window - 1
        yield (
            f"{'held back':<22}{f'0 to {most}':>10} slots of {1e3 * load.slot_s:.3f} ms, at most "
            f"{most * load.slot_s:.3f} s in quiet, by who hears another AUV"
        )


def _cycles(rounds: "Rounds", fixes: list[int]) -> Iterator[str]:
    """Yield how long MF is taken by a broadcast of each number of fixes."""
    if not rounds.broadcasts:
        yield f"{rounds.downlink}: {answered(rounds.slots)}; there are no rounds."
        return
    yield from behind(rounds.slots, 1)
    yield "A fix is broadcast as soon as MF is free, with all that wait; a round of K fixes takes"
    yield f"{'K':>6}{'bytes':>8}{'T_tx ms':>10}{'T_DL ms':>10}{'fixes/s':>10}"
    for count in fixes:
        length = rounds.length(0, count)
        yield (
            f"{count:>6}{rounds.slots.payload_bytes(count):>8}"
            f"{1e3 * rounds.slots.airtime(count):>10.1f}{1e3 * length:>10.1f}"
            f"{count / length:>10.3f}"
        )


# Rows of the timing table; a fleet of more AUVs is shown by its ends.
MOST_ROWS = 12


@click.command(short_help="Print slots, rounds and fix rates of a scenario's protocol.")
@scenario_argument
@set_option
@json_option("slots and rounds (s), limits")
@plugins_option
def timing(scenario: str, overrides: tuple[str, ...], allow_plugins: bool) -> None:
    """Print slots, rounds and fix rates of a scenario's protocol, and their limits."""
    reading = reading_from(scenario, overrides, allow_plugins)
    mission, setup = reading.scenario, reading.setup
    from ..preflight.round_lengths import rounds_of

    rounds, limits = rounds_of(setup), planned_limits(mission)
    parts = map("\n".join, (
        _durations(setup, rounds.slots),
        _downlink(setup, rounds),
        limits_lines(setup, limits),
    ))  # fmt: skip
    text = "\n\n".join(filter(None, parts))
    answer({**_timing(setup, rounds), "limits": limits_data(limits)}, text)


def _durations(setup: "Setup", slots: "Slots") -> Iterator[str]:
    protocol = setup.scenario.protocol
    rate, ranging, two_way = protocol.tick_rate_hz, protocol.ranging, protocol.calls
    yield f"{'survey across L':<22}{setup.area.across:>10.2f} m"
    for name, value in (
        ("crossing time t_C", slots.crossing_time),
        ("ping T_P", slots.ping_duration),
        ("longest travel time", slots.longest_travel_time),
        *((("AUV turnaround", protocol.turnaround_s),) if two_way else ()),
        *((("answer and its guard", slots.answer),) if slots.answer else ()),
        *((("data behind a ping", slots.data),) if slots.data else ()),
        ("two-way slot T_UL" if two_way else "uplink slot T_UL", slots.uplink_slot),
    ):
        yield f"{name:<22}{1e3 * value:>10.3f} ms"
    if is_plugin(ranging) and loaded(ranging):
        yield f"Slots last as {ranging} says."
    elif is_plugin(ranging):
        yield f"Slots of one-way ranging; those of {ranging} may differ: --allow-plugins asks it."
    on_clock = slots.clock.after(0.0, slots.uplink_slot)
    if rate is None:
        yield f"{'clock':<22}{'exact':>10}"
        return
    yield f"{'  on the clock':<22}{1e3 * on_clock:>10.3f} ms = {round(on_clock * rate)} ticks"
    yield f"{'tick':<22}{1e3 / rate:>10.3f} ms = 1/{rate:g} s"


def _downlink(setup: "Setup", rounds: "Rounds") -> Iterator[str]:
    """Yield what a round is under the scenario's downlink and schedule, and a table of rounds."""
    scenario, protocol = setup.scenario, setup.scenario.protocol
    downlink, schedule = protocol.downlink, protocol.schedule
    if not scenario.asvs.count:
        return
    if protocol.asvs_ping:
        yield from _passive(rounds)
        return
    if protocol.random_access:
        from ..preflight.round_lengths import offered

        yield from _load(setup, offered(setup, rounds.slots))
        yield from _cycles(rounds, _shown(1, rounds.auvs))
        return
    if not rounds.are_known:
        own = "the plug-in decides when fixes are broadcast and rounds end."
        yield f"{schedule} / {downlink}: {own}"
        return
    yield f"{schedule} / {downlink}: {setup.downlink.in_words}"
    if (peers := scenario.navigation.peers) is not None:
        lasts = 8e3 * peers.message_bytes / scenario.acoustics.hf.bit_rate_bps
        yield (
            f"Beside the slots each AUV speaks to its peers every {peers.every_s:g} s, in messages "
            f"of {lasts:.4g} ms on HF: pings that one overlaps are lost, which nothing here counts."
        )
    if protocol.replies:
        yield f"There, {answered(rounds.slots)}."
    yield from rounds.pace_lines(setup.schedule)
    yield from assignments(scenario, rounds)
    yield from behind(rounds.slots, rounds.auvs)
    if rounds.frame:
        yield from _frames(setup, rounds)
    else:
        yield from _groups(rounds, setup.broadcaster.at_once)


def _passive(rounds: "Rounds") -> Iterator[str]:
    """Yield the round in which every ASV pings once."""
    length = rounds.length(rounds.most, 0)
    yield "passive: the ASVs ping in turn, a slot each; AUVs, however many, fix themselves."
    yield f"{'ASVs':>14}{'round s':>12}{'rounds/s':>12}{'fixes/s in range of all':>26}"
    yield f"{rounds.most:>14}{length:>12.3f}{1 / length:>12.3f}{rounds.most / length:>26.3f}"


def _frames(setup: "Setup", rounds: "Rounds") -> Iterator[str]:
    """Yield the rounds of a schedule that gives each frame to one AUV."""
    count, frame = setup.scenario.auvs.count, rounds.frame
    by_lot = setup.schedule.turn == "lot"
    turn, chosen = ("on average ", "drawn at random from") if by_lot else ("", "in turn of")
    yield f"One AUV pings in each frame of {frame:g} s, {chosen} {count}:"
    yield f"{'':<24}{'round s':>10}{'begins every s':>18}{'an AUV pings every s':>24}"
    answers = ("without a fix", "with a fix") if rounds.broadcasts else ("answered",)
    for fixes, name in enumerate(answers):
        every = rounds.period(1, fixes)
        yield (
            f"{name:<24}{rounds.length(1, fixes):>10.3f}{every:>18.3f}"
            f"{f'{turn}{count * every:.3f}':>24}"
        )
    longest = rounds.length(1, len(answers) - 1)
    if longest > frame:
        yield f"A round takes longer than the frame: frames of {longest:.4g} s would hold it."


def _groups(rounds: "Rounds", shares: bool) -> Iterator[str]:
    """Yield a row for each number of fixes that a round may bring.

    A round is shortest where all AUVs ping at once, longest where each has a slot of its own; if
    all are fixed in each round, that is how often an AUV gets a fix.  Where several ASVs have their
    `shares` of a broadcast, downlink slots are shorter than of one that sends all.
    """
    slots, ends = rounds.slots, sorted({rounds.fewest, rounds.most})
    yield from messages(slots) if rounds.broadcasts else ()
    if not rounds.broadcasts:
        yield f"{'ping groups':>14}{'round s':>18}{'rounds/s':>18}"
        for groups in _shown(rounds.fewest, rounds.most):
            lengths = [rounds.least(groups, 0), rounds.length(groups, 0)]
            yield f"{groups:>14}{span(lengths):>18}{_rates(lengths):>18}"
        return
    each = " .. ".join(
        "a ping group for each AUV" if groups == rounds.auvs
        else "one ping group" if groups == 1 else f"{groups} ping groups"
        for groups in ends
    )  # fmt: skip
    if shares:
        yield "parallel: ASVs broadcast at once, each to AUVs that hear no other; if one has all:"
    yield f"A round of K fixes, with {each}:"
    yield f"{'K':>6}{'bytes':>8}{'T_tx ms':>10}{'T_DL ms':>10}{'round s':>18}{'rounds/s':>18}"
    for fixes in _shown(0, rounds.auvs):
        lengths = [rounds.least(ends[0], fixes), rounds.length(ends[-1], fixes)]
        yield (
            f"{fixes:>6}{slots.payload_bytes(fixes, rounds.named):>8}"
            f"{1e3 * slots.airtime(fixes, rounds.named):>10.1f}"
            f"{1e3 * slots.downlink_slot(fixes, rounds.named):>10.1f}"
            f"{span(lengths):>18}{_rates(lengths):>18}"
        )


def _timing(setup: "Setup", rounds: "Rounds") -> dict[str, Any]:
    """Return slots and rounds as data: durations in s, rounds as in the table, a row for each."""
    from ..preflight.round_lengths import offered

    slots, protocol = rounds.slots, setup.scenario.protocol
    answered = not rounds.broadcasts
    most = 1 if rounds.frame else rounds.auvs
    rows = [
        {"groups": groups, "fixes": fixes, "round_s": rounds.length(groups, fixes),
         "period_s": rounds.period(groups, fixes)}
        for fixes in ([0] if answered else _shown(0, most))
        if fixes or rounds.most  # with random access nothing is broadcast in vain
        for groups in (
            _shown(rounds.fewest, rounds.most) if answered
            else sorted({rounds.fewest, rounds.most})
        )
    ]  # fmt: skip
    return {
        "schedule": None if protocol.asvs_ping else protocol.rule,
        "downlink": None if protocol.asvs_ping else protocol.downlink,
        "ranging": protocol.ranging,
        "tick_rate_hz": protocol.tick_rate_hz,
        "across_m": setup.area.across,
        "crossing_time_s": slots.crossing_time,
        "ping_s": slots.ping_duration,
        "longest_travel_time_s": slots.longest_travel_time,
        "uplink_slot_s": slots.uplink_slot,
        "data_s": slots.data,
        "shortest_uplink_slot_s": (rounds.pace or [slots])[0].uplink_slot,
        "uplink_guard_s": slots.uplink_guard,
        "downlink_guard_s": slots.downlink_guard,
        "shortest_downlink_slot_s": slots.shortest_downlink,
        "most_fixes": slots.messages.most,
        "processing_s": slots.messages.delay(slots.messages.most or 0),
        "behind_s": slots.held_s(most) - slots.airtime(most),
        "named": rounds.named,
        "assignment_bytes": rounds.named * protocol.dissemination.assignment_bytes,
        "frame_s": rounds.frame or None,
        "access": asdict(offered(setup, slots)) if protocol.random_access else None,
        "rounds": [] if not setup.scenario.asvs.count else rows if rounds.are_known else None,
    }


def _shown(first: int, last: int) -> list[int]:
    """Return the numbers to show: all of a few, of many the first and the last."""
    return [k for k in range(first, last + 1) if k - first < MOST_ROWS or k == last]


def _rates(lengths: list[float]) -> str:
    return span([1 / length for length in reversed(lengths)])
