"""The anatomy of one round: every ping's way up, the broadcast's way down, and the guards.

With passive ranging every ping's way down.
"""

from typing import TYPE_CHECKING, Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from ...core.results.round_timeline import (
    Span,
    broadcasts_of,
    downlink_slots,
    pings_sent,
    uplink_slots,
)
from ...support.palette import ALARM, HF, INK, MF
from .style import colour_of, fits, legend_below, names, new_figure

if TYPE_CHECKING:
    from ...core.results.result import Result

# Vehicles of each kind that have a row
MOST_ROWS = 12

ROW = 0.2  # inches

# How the way of a ping is drawn, by its outcome; None: in the colour of its AUV
WAYS: dict[str, tuple[str | None, str, float]] = {
    "out_of_range": ("#c8c8c8", ":", 0.6),
    "blocked": ("#c8c8c8", ":", 0.6),
    "in_flight": ("#777777", ":", 1.0),
    "lost": ("#777777", "--", 1.0),
    "collided": (ALARM, "-", 1.0),
    "heard": (None, "-", 1.0),
}


def anatomy(result: "Result", width: float, number: int | None = None) -> Figure:
    """Draw one round, by default that with most fixes, and its first uplink slot enlarged."""
    number = busiest(result) if number is None else number
    scenario = result.scenario
    rows = [
        *names("ASV", min(scenario.asvs.count, MOST_ROWS)),
        *names("AUV", min(scenario.auvs.count, MOST_ROWS)),
    ]
    height = 1.6 + 2 * (ROW * len(rows) + 0.7)
    figure = new_figure(width, height)
    whole, slot = figure.subplots(2, 1)
    place = {name: row for row, name in enumerate(rows)}
    for axes in (whole, slot):
        _draw_ways(axes, result, number, place)
        axes.set_yticks(range(len(rows)), rows)
        axes.grid(visible=False, axis="y")
        axes.set_ylabel("vehicle")
    _annotate_round(whole, result, number)
    _annotate_slot(slot, result, number)
    whole.set(xlabel="time (s)", ylim=(len(rows) - 0.5, -3.4))
    first = "first ping" if scenario.protocol.random_access else "first slot"
    slot.set(xlabel=f"time since the {first} began (ms)", ylim=(len(rows) - 0.5, -2.1))
    whole.set_title(f"{scenario.name}, seed {result.seed}: round {number}")
    legend_below(figure, _handles(scenario.protocol.calls))
    return figure


def busiest(result: "Result") -> int:
    """Return the first of the rounds that brought most fixes."""
    return int(result.tables["rounds"].fixes.to_numpy().argmax())


def _draw_ways(axes: Axes, result: "Result", number: int, place: dict[str, int]) -> None:
    """Draw pings and frames as bars as long as they last, and the ways between as slanted lines."""
    duration, protocol = result.scenario.acoustics.hf.ping_s, result.scenario.protocol
    up, down = protocol.pinging, protocol.listening
    pings: Any = pings_sent(result)
    receptions = result.tables["receptions"]
    pings = pings[(pings["round"] == number) & pings[up].isin(place)]
    sent = dict(zip(pings.ping, pings.sent_at_s, strict=True))
    for at, who in zip(pings.sent_at_s, pings[up], strict=True):
        _bar(axes, Span(at, at + duration), place[who], colour_of(who))
    arrivals = receptions[receptions.ping.isin(sent) & receptions[down].isin(place)]
    for outcome, (colour, style, thickness) in WAYS.items():
        met: Any = arrivals[arrivals.outcome == outcome]
        paths = [
            [(sent[m.ping], place[getattr(m, up)]), (m.arrived_at_s, place[getattr(m, down)])]
            for m in met.itertuples()
        ]
        colours = [colour or colour_of(who) for who in met[up]]
        axes.add_collection(
            LineCollection(paths, colors=colours, ls=style, lw=thickness, label=outcome)
        )
        for m in met.itertuples() if outcome in ("heard", "collided") else ():
            heard = Span(m.arrived_at_s, m.arrived_at_s + duration)
            _bar(axes, heard, place[getattr(m, down)], colour or colour_of(getattr(m, up)))
    if protocol.calls:
        _draw_calls(axes, result, number, place)
    _draw_frames(axes, result, number, place)


def _draw_calls(axes: Axes, result: "Result", number: int, place: dict[str, int]) -> None:
    """Draw each call as a bar at its ASV, and its way to the AUV that answers (twtt, polling)."""
    duration, protocol = result.scenario.acoustics.hf.ping_s, result.scenario.protocol
    turns: Any = result.tables["pings"]
    turns = turns[(turns["round"] == number) & turns.auv.isin(place) & turns.called_by.isin(place)]
    paths = []
    for turn in turns.itertuples():
        _bar(axes, Span(turn.called_at_s, turn.called_at_s + duration), place[turn.called_by], HF)
        if turn.call == "heard":
            arrives = turn.sent_at_s - protocol.turnaround_s - duration
            paths.append([(turn.called_at_s, place[turn.called_by]), (arrives, place[turn.auv])])
            _bar(axes, Span(arrives, arrives + duration), place[turn.auv], HF)
    axes.add_collection(LineCollection(paths, colors=HF, lw=1.0, label="call"))


def _draw_frames(axes: Axes, result: "Result", number: int, place: dict[str, int]) -> None:
    fixes = result.tables["fixes"]
    for frame in broadcasts_of(result, number).itertuples():
        if frame.asv not in place:
            continue
        ends = frame.sent_at_s + frame.airtime_s
        _bar(axes, Span(frame.sent_at_s, ends), place[frame.asv], MF)
        carried = fixes[
            (fixes.broadcast_at_s == frame.sent_at_s)
            & (fixes.broadcast_by == frame.asv)
            & (fixes.outcome == "delivered")
            & fixes.auv.isin(place)
        ]
        paths = [
            [(ends, place[frame.asv]), (fix.delivered_at_s, place[fix.auv])]
            for fix in carried.itertuples()
        ]
        axes.add_collection(LineCollection(paths, colors=MF, lw=1.0, label="delivery"))
        axes.plot(carried.delivered_at_s, carried.auv.map(place), "v", color=MF, ms=4)


def _bar(axes: Axes, span: Span, row: int, colour: str) -> None:
    axes.broken_barh([(span.start, span.length)], (row - 0.22, 0.44), fc=colour, lw=0)


def _annotate_round(axes: Axes, result: "Result", number: int) -> None:
    """Mark the slots of the round and the parts of its frames."""
    guard_s = result.setup.slots.downlink_guard
    frames = broadcasts_of(result, number)
    ends = (frames.sent_at_s + frames.airtime_s).to_numpy()
    uplinks, downlinks = uplink_slots(result, number), downlink_slots(result, number)
    axes.set_xlim(uplinks[0].start, max(span.end for span in (*uplinks, *downlinks)))
    for index, span in enumerate(uplinks):
        axes.axvspan(span.start, span.end, color="#dfe5ea", alpha=0.5 if index % 2 else 1, lw=0,
                     zorder=0)  # fmt: skip
        if not result.scenario.protocol.random_access:
            _bracket(axes, span, -1.2, rf"$T_{{UL}}$ {1e3 * span.length:.0f} ms")
    for span in downlinks:
        axes.axvspan(span.start, span.end, color="#fbefd0", lw=0, zorder=0)
        if not result.scenario.protocol.replies:  # these lie in the uplink slots
            _bracket(axes, span, -1.2, rf"$T_{{DL}}$ {1e3 * span.length:.0f} ms")
        on_air = Span(span.start, ends[(ends > span.start) & (ends <= span.end)].max())
        guard = Span(on_air.end, on_air.end + guard_s)
        _bracket(axes, on_air, -2.3, rf"$T_{{tx}}$ {1e3 * on_air.length:.0f} ms")
        _bracket(axes, guard, -2.3, rf"$T_{{DL,G}}$ {1e3 * guard.length:.0f} ms")


def _annotate_slot(axes: Axes, result: "Result", number: int) -> None:
    """Mark ping, longest way and guard of the first slot; show it in ms since its beginning."""
    slots, first = result.setup.slots, _first_slot(result, number)
    there = (slots.ping_duration, "$T_P$"), (slots.longest_travel_time, r"$\tau_{OT,max}$")
    waits = result.scenario.protocol.turnaround_s
    parts = (
        *(
            [*there, *([(waits, "turnaround")] if waits else [])]
            if result.scenario.protocol.calls
            else []
        ),
        *there,
        *([] if result.scenario.protocol.random_access else [(slots.uplink_guard, "$T_G$")]),
    )
    until, shown_ms = first.start, 1.05e3 * sum(length for length, _ in parts)
    axes.set_xlim(until, until + shown_ms / 1e3)
    for length, symbol in parts:
        span = Span(until, until + length)
        _bracket(axes, span, -1.0, f"{symbol} {1e3 * length:.3g} ms")
        until = span.end
        axes.axvline(until, color=INK, lw=0.4, ls=":")
    ticks_ms = [
        value for value in MaxNLocator(7).tick_values(0.0, shown_ms) if 0.0 <= value <= shown_ms
    ]
    axes.set_xticks(
        [first.start + tick / 1e3 for tick in ticks_ms], [f"{tick:g}" for tick in ticks_ms]
    )


def _first_slot(result: "Result", number: int) -> Span:
    """Return the first slot of a round; with random access what follows its first ping."""
    cycle = uplink_slots(result, number)[0]
    pings = result.tables["pings"]
    sent = pings.sent_at_s[pings["round"] == number]
    if result.scenario.protocol.random_access and len(sent):
        return Span(float(sent.min()), cycle.end)
    return cycle


def _bracket(axes: Axes, span: Span, y: float, text: str) -> None:
    axes.annotate(
        "", (span.start, y), (span.end, y), annotation_clip=True,
        arrowprops={"arrowstyle": "<->", "lw": 0.6, "color": INK, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    shown = text if fits(text.replace("$", ""), axes, span.length, 5.5) else text.split()[0]
    middle = (span.start + span.end) / 2
    axes.text(middle, y - 0.15, shown, ha="center", va="bottom", fontsize=6.5)


def _handles(is_called: bool) -> list[Artist]:
    names_of = {
        "heard": "ping heard (its sender's colour)", "collided": "collided", "lost": "lost",
        "out_of_range": "beyond HF range",
    }  # fmt: skip
    calls = [Line2D([], [], color=HF, label="call of an ASV")] if is_called else []
    handles: list[Artist] = [
        Line2D([], [], color=WAYS[outcome][0] or INK, ls=WAYS[outcome][1], label=label)
        for outcome, label in names_of.items()
    ]
    return [
        *calls,
        *handles,
        Line2D([], [], color=MF, marker="v", ms=4, label="frame and delivery"),
    ]
