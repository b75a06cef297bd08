"""Who has the HF and the MF band when, and what became of every ping."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

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

Boxes = list[tuple[float, float, float]]  # start (s), end (s), row

# Rounds shown unless others are asked for
ROUNDS = 5

# Space (in) for a row, and at most for all
ROW, TALLEST = 0.24, 7.5

# Type (pt) of what stands in slots and frames
OWNER_SIZE = 5.5

# outcome: marker, colour of the mark (None: the sender's), meaning
MARKS: tuple[tuple[str, str, str | None, str], ...] = (
    ("heard", "|", None, "ping sent, or heard"),
    ("lost", "o", "#777777", "ping lost"),
    ("collided", "X", ALARM, "collided"),
)


def timeline(
    result: "Result", width: float, first: int | None = None, last: int | None = None
) -> Figure:
    """Draw some rounds, `first` to `last`: a row for each band, each AUV and each ASV."""
    scenario = result.scenario
    first = 0 if first is None else first
    last = min(first + ROUNDS, len(result.tables["rounds"])) - 1 if last is None else last
    rows = ["HF", "MF", *names("AUV", scenario.auvs.count), *names("ASV", scenario.asvs.count)]
    figure = new_figure(width, 1.2 + min(ROW * len(rows), TALLEST))
    axes = figure.add_subplot()
    place = {name: row for row, name in enumerate(rows)}
    window = _draw_bands(axes, result, range(first, last + 1))
    _draw_pings(axes, result, (first, last), place)
    _draw_fixes(axes, result, window, place)
    axes.set(xlim=window, ylim=(len(rows) - 0.4, -0.6), xlabel="time (s)", ylabel="band, vehicle")
    step = -(-len(rows) // 40)
    axes.set_yticks(range(0, len(rows), step), rows[::step])
    axes.grid(visible=False, axis="y")
    axes.set_title(f"{scenario.name}, seed {result.seed}: rounds {first} to {last}")
    legend_below(figure, _handles())
    return figure


def _draw_bands(axes: Axes, result: "Result", numbers: range) -> tuple[float, float]:
    """Draw slots and frames of some rounds; return when they begin and end (s)."""
    starts, ends = [], []
    uplinks: Boxes = []
    frames: Boxes = []
    guards: Boxes = []
    for number in numbers:
        slots, sent = uplink_slots(result, number), broadcasts_of(result, number)
        own = downlink_slots(result, number)
        uplinks += [(slot.start, slot.end, 0.0) for slot in slots]
        guards += [(slot.start, slot.end, 1.0) for slot in own]
        frames += [(f.sent_at_s, f.sent_at_s + f.airtime_s, 1.0) for f in sent.itertuples()]
        starts.append(slots[0].start)
        ends += [span.end for span in (*slots, *own)]
        axes.axvline(slots[0].start, color=INK, lw=0.6)
    _boxes(axes, uplinks, fc="#dfe5ea", ec=HF)
    _boxes(axes, guards, fc="#fbefd0", ec="none")
    _boxes(axes, frames, fc=MF, ec="none")
    axes.set_xlim(min(starts), max(ends))
    for number in numbers:
        _name_owners(axes, result, number)
    return min(starts), max(ends)


def _name_owners(axes: Axes, result: "Result", number: int) -> None:
    """Write the numbers of who pings into their slots, and of the ASV into its frame."""
    pings = result.tables["pings"]
    own, who = pings[pings["round"] == number], result.scenario.protocol.pinging
    for slot, span in enumerate(uplink_slots(result, number)):
        group = [str(name)[3:] for name in own[who][own.slot == slot]]
        many = "pings" if result.scenario.protocol.random_access else "AUVs"
        text = " ".join(group) if len(group) <= 4 else f"{len(group)} {many}"
        _name_owner(axes, span, 0, text)
    for frame in broadcasts_of(result, number).itertuples():
        if frame.airtime_s > 0:
            on_air = Span(frame.sent_at_s, frame.sent_at_s + frame.airtime_s)
            _name_owner(axes, on_air, 1, f"{frame.asv}: {frame.fixes}")


def _name_owner(axes: Axes, span: Span, row: int, text: str) -> None:
    if fits(text, axes, span.length, OWNER_SIZE):
        middle = (span.start + span.end) / 2
        axes.text(middle, row, text, ha="center", va="center", fontsize=OWNER_SIZE, clip_on=True)


def _draw_pings(
    axes: Axes, result: "Result", numbers: tuple[int, int], place: dict[str, int]
) -> None:
    pings, receptions = pings_sent(result), result.tables["receptions"]
    up, down = result.scenario.protocol.pinging, result.scenario.protocol.listening
    pings = pings[pings["round"].between(*numbers)]
    axes.scatter(
        pings.sent_at_s, pings[up].map(place), c=pings[up].map(colour_of), marker="|", s=50,
        lw=1.4, label="sent",
    )  # fmt: skip
    receptions = receptions[receptions.ping.isin(pings.ping)]
    for outcome, marker, colour, _ in MARKS:
        met = receptions[receptions.outcome == outcome]
        colours = met[up].map(colour_of) if colour is None else [colour] * len(met)
        looks: dict[str, Any] = {"s": 50 if marker == "|" else 26, "lw": 1.2, "label": outcome}
        if marker == "o":
            looks |= {"facecolors": "none", "edgecolors": colours}
        else:
            looks |= {"c": colours}
        axes.scatter(met.arrived_at_s, met[down].map(place), marker=marker, zorder=3, **looks)


def _draw_fixes(
    axes: Axes, result: "Result", window: tuple[float, float], place: dict[str, int]
) -> None:
    fixes = result.tables["fixes"]
    got = fixes[fixes.delivered_at_s.between(*window)]
    axes.scatter(
        got.delivered_at_s, got.auv.map(place), c=got.auv.map(colour_of), marker="v", s=22,
        lw=0, zorder=3, label="delivered",
    )  # fmt: skip
    missed = fixes[
        fixes.outcome.isin(["out_of_range", "blocked"]) & fixes.broadcast_at_s.between(*window)
    ]
    axes.scatter(
        missed.broadcast_at_s, missed.auv.map(place), c=MF, marker="x", s=22, lw=1.0,
        zorder=3, label="beyond MF range",
    )  # fmt: skip


def _boxes(axes: Axes, boxes: Boxes, **looks: Any) -> None:
    corners = [
        np.array([(start, y - 0.36), (end, y - 0.36), (end, y + 0.36), (start, y + 0.36)])
        for start, end, y in boxes
    ]
    axes.add_collection(PolyCollection(corners, lw=0.5, **looks), autolim=False)


def _handles() -> list[Artist]:
    handles: list[Artist] = [
        Patch(fc="#dfe5ea", ec=HF, lw=0.5, label="HF slot (who pings)"),
        Patch(fc=MF, label="MF frame (ASV: fixes)"),
        Patch(fc="#fbefd0", label="rest of MF slot"),
    ]
    handles += [
        Line2D([], [], ls="", marker=marker, color=colour or INK, ms=4 if marker == "o" else 6,
               mfc="none" if marker == "o" else None, label=meaning)
        for _, marker, colour, meaning in MARKS
    ]  # fmt: skip
    return [
        *handles,
        Line2D([], [], ls="", marker="v", color=INK, ms=4, label="fix delivered"),
        Line2D([], [], ls="", marker="x", color=MF, ms=4, label="fix for AUV beyond MF range"),
    ]
