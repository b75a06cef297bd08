"""Measured advice as HTML: what would help, what would not, and what was not tried."""

from collections.abc import Iterator, Sequence
from html import escape

from ..core.wording import counted
from ..results.effects import HARMS, HELPS, NEGLIGIBLE, NO_EFFECT, Advice, Effect, interval

HOW = (
    "Changes were chosen in missions with some seeds and measured in missions with others, paired "
    "with missions of the plan as it is; the intervals (Student's t) hold together with 95 %."
)
NOTHING_TRIED = (
    "No change was tried. <code>bindusbl-des report DIR --advice-missions 100</code> simulates "
    "changes and says what was measured."
)


def advised(advice: Advice | None) -> tuple[str, ...]:
    """Return paragraphs of HTML on what would help the worst AUV of a mission."""
    if advice is None:
        return (NOTHING_TRIED,)
    return (*_measured(advice), *_others(advice))


def _measured(advice: Advice) -> Iterator[str]:
    if advice.shortage:
        yield f"Not known: {escape(advice.shortage)}."
        return
    helps = advice.of(HELPS)
    if helps:
        items = "".join(_item(it) for it in helps)
        yield (
            f"<b>Measured:</b> the worst AUV's mean error, {advice.error_m:.2f} m over "
            f"{max(it.seeds for it in helps)} other seeds, would change by <ul>{items}</ul> "
            "Options to be added to <code>run</code>."
        )
    else:
        yield (
            f"Nothing that was tried ({_tried(advice)}) measurably lowers the worst AUV's mean "
            "error."
        )
    for words, verdict in (
        ("No measurable effect", NO_EFFECT),
        ("Too little to matter, below 1 %", NEGLIGIBLE),
        ("Worse", HARMS),
    ):
        found = advice.of(verdict)
        if found:
            named = "; ".join(f"{escape(it.words)} ({_interval(it)})" for it in found)
            yield f"<b>{words}:</b> {named}."
    if advice.effects:
        yield f'<span class="note">{HOW}</span>'


def _tried(advice: Advice) -> str:
    count = len(advice.effects) + len(advice.dropped) + len(advice.inert)
    return f"{counted(count, 'change')}, {advice.missions} missions"


def _interval(effect: Effect) -> str:
    return interval(effect).replace("-", "&minus;")


def _item(effect: Effect) -> str:
    options = escape(" ".join(effect.options))
    return f"<li><b>{_interval(effect)}</b> {escape(effect.words)}<br><code>{options}</code></li>"


def _others(advice: Advice) -> Iterator[str]:
    """Yield what was left out, and why, folded up."""
    groups = (
        ("left the worst AUV's error as it was", advice.inert),
        ("promised less in the first trials, and were not measured", advice.dropped),
        ("no need to try", advice.needless),
        ("no mission was left to try (--advice-missions)", advice.untried),
    )
    lists = "".join(f"<dt>{words}</dt><dd>{_listed(it)}</dd>" for words, it in groups if it)
    if lists:
        yield f"<details><summary>What else was considered</summary><dl>{lists}</dl></details>"


def _listed(words: Sequence[str]) -> str:
    return escape("; ".join(words)) + "."
