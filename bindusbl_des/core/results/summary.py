"""The summary of a mission for a terminal: a table, and sentences beside it."""

from collections.abc import Callable, Iterator, Sequence
from textwrap import wrap
from typing import Any

from ...support.wording import Shown, aligned, counted, number, significant
from .effects import HELPS, NO_EFFECT, Advice, Effect, harm_text, interval

Row = dict[str, Any]

COLUMNS = (
    Shown("in range", "%", "hf_coverage", 0, 100),
    Shown("fixes", "", "fixes_delivered", 0),
    Shown("interval", "s", "interval_mean_s", 2),
    Shown("max age", "s", "fix_age_max_s", 1),
    Shown("latency", "s", "latency_mean_s", 3),
    Shown("error", "m", "position_error_m", 2),
    Shown("95 %", "m", "position_error_p95_m", 2),
    Shown("no fixes", "m", "imu_error_m", 2),
)

# A fleet with more AUVs shows the first ones, and the least and largest value of all.
MOST_ROWS, FIRST_ROWS = 20, 10
# A terminal shows the best of the advice, in lines of its width; the report has all.
MOST_ADVICE, WIDTH = 4, 80


def summary(
    auvs: Sequence[Row], mission: Row, advice: Advice | None = None, broken: str = ""
) -> str:
    """Return the summary of a mission: harm done by its fixes, the table of metrics, the advice.

    Take the metrics of each AUV and of the mission by their names; None is not known.  `broken`
    describes violations of its schedule, if any.
    """
    harm = [line for text in harm_text(auvs, advice) for line in wrap(text, WIDTH)]
    table = "\n".join([summary_table(auvs, mission), *wrap(broken, WIDTH)])
    parts = ["\n".join(harm), table, "\n".join(_advice(advice))]
    return "\n\n".join(part for part in parts if part)


def summary_table(auvs: Sequence[Row], mission: Row) -> str:
    """Return a table with a row per AUV, the fleet's mean and its worst AUV, units below headings.

    A large fleet has rows of its first AUVs, and the least, mean and largest values of all.
    """
    is_large = len(auvs) > MOST_ROWS
    shown = auvs[: FIRST_ROWS if is_large else MOST_ROWS]
    rows = [
        ("AUV", *(column.words for column in COLUMNS)),
        ("", *(column.unit for column in COLUMNS)),
    ]
    rows += [_row(str(auv["auv"]), auv) for auv in shown]
    if is_large:
        rows.append((f"+{len(auvs) - FIRST_ROWS}", *("..." for _ in COLUMNS)))
        rows.append(_row("min", _extremes(auvs, min)))
    rows.append(_row("mean", mission))
    if is_large:
        rows.append(_row("max", _extremes(auvs, max)))
    metrics = [column.metric for column in COLUMNS]
    rows.append(_row("worst", {name: mission.get(f"worst_{name}") for name in metrics}))
    names = (mission.get(f"worst_{name}_auv") for name in metrics)
    rows.append(("of AUV", *((name or "-").removeprefix("AUV") for name in names)))
    lines = aligned(rows)
    lines.insert(2, "-" * max(map(len, lines)))
    lines.append(
        f"{rounds_text(mission)}; channel use "
        f"HF {100 * mission['hf_utilisation']:.1f} %, MF {100 * mission['mf_utilisation']:.1f} %"
    )
    if (drawn := mission.get("energy_j")) is not None:
        each = mission.get("energy_per_fix_j")
        text = "" if each is None else f", {significant(each)} J for each fix delivered"
        lines.append(f"modems drew {significant(drawn)} J{text}")
    return "\n".join(lines)


def rounds_text(mission: Row) -> str:
    """Return how many rounds a mission had, and how many collisions.

    >>> rounds_text({"rounds": 1, "collisions": 2, "frame_collisions": 0})
    '1 round, 2 collisions'
    >>> rounds_text({"rounds": 2, "collisions": 1, "frame_collisions": 3})
    '2 rounds, 4 collisions (1 on HF, 3 on MF)'
    """
    hf, mf = int(mission["collisions"]), int(mission.get("frame_collisions") or 0)
    text = counted(hf + mf, "collision") + (f" ({hf} on HF, {mf} on MF)" if mf else "")
    return f"{counted(int(mission['rounds']), 'round')}, {text}"


def _extremes(auvs: Sequence[Row], pick: Callable[..., Any]) -> Row:
    return {
        metric: pick((auv[metric] for auv in auvs if auv[metric] is not None), default=None)
        for _, _, metric, *_ in COLUMNS
    }


def _row(name: str, metrics: Row) -> tuple[str, ...]:
    return (name, *(column.number_in(metrics) for column in COLUMNS))


def _advice(advice: Advice | None) -> Iterator[str]:
    """Yield lines on the changes that would help, none wider than a terminal."""
    if advice is None:
        return
    if advice.shortage:
        yield from wrap(f"What would help is not known: {advice.shortage}.", WIDTH)
        return
    helps = advice.of(HELPS)
    if helps:
        yield from wrap(
            f"What would help: the worst AUV's mean error, {number(advice.error_m)} m as it is, "
            "would change by",
            WIDTH,
        )
    for effect in helps[:MOST_ADVICE]:
        yield from _lines(effect)
    yield from wrap(_rest(advice, len(helps)), WIDTH)


def _lines(effect: Effect) -> Iterator[str]:
    yield from wrap(
        f"{interval(effect)}  {effect.words}", WIDTH, initial_indent="  ", subsequent_indent="    "
    )
    # Options that do not fit into one line are continued, so that all can be copied.
    line = "   "
    for option in effect.options:
        if len(line) + len(option) + 3 > WIDTH and line.strip():
            yield f"{line} \\"
            line = "   "
        line += f" {option}"
    yield line


def _rest(advice: Advice, helpful: int) -> str:
    tried = len(advice.effects) + len(advice.dropped) + len(advice.inert)
    parts = []
    if not helpful:
        parts.append(f"Of {tried} changes that were tried none measurably lowers the worst error.")
    elif helpful > MOST_ADVICE:
        parts.append(f"{helpful - MOST_ADVICE} more would help.")
    none = len(advice.of(NO_EFFECT))
    if none:
        parts.append(
            f"No measurable effect: {'; '.join(effect.words for effect in advice.of(NO_EFFECT))}."
        )
    if advice.untried:
        parts.append(f"{len(advice.untried)} changes were not tried (--advice-missions).")
    return " ".join([*parts, "The report tells all that was tried."])
