"""What would help: remedies for what was diagnosed first, then whatever else was measured.

A remedy says what it is known to do: measured in other missions, predicted where none could be
flown, or neither, and then it says that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil

import numpy as np

from ...core.results.effects import (
    HARMS,
    HELPS,
    NEGLIGIBLE,
    NO_EFFECT,
    Advice,
    Effect,
    Foreseen,
    interval,
)
from ...support.wording import counted, number
from .losses import broadcast_distances
from .recording import COLLIDED, LOST, OUT_OF_HF, OUT_OF_MF, Recording

# Of pings, a share that is worth a remedy.
NOTEWORTHY = 0.02
# A remedy is for where most of the pings would have been in range; ranges in steps of these (m).
MOST_PINGS, STEP_M = 0.95, 5.0

HOW = (
    "Changes were chosen in missions with some seeds and measured in missions with others, paired "
    "with missions of the plan as it is; the intervals (Student's t) hold together with 95 %."
)
NOTHING_TRIED = (
    "No change was tried. <code>bindusbl-des report DIR --advice</code> simulates changes and says "
    "what was measured."
)


@dataclass(frozen=True)
class Cause:
    """Why so many `pings` made no fix, in words, and the settings that would mend it."""

    pings: int
    words: str
    settings: tuple[str, ...]


def causes(mission: Recording) -> list[Cause]:
    """Return why pings made no fixes that their AUVs have, what cost most of them first."""
    asked = max(len(mission.fate), 1)
    known = [cause for cause in _causes(mission) if cause.pings >= NOTEWORTHY * asked]
    return sorted(known, key=lambda cause: -cause.pings)


def _causes(mission: Recording) -> Iterator[Cause]:
    scenario, fate = mission.scenario, mission.fate
    setup = mission.setup
    hf, mf, asvs = scenario.acoustics.hf, scenario.acoustics.mf, scenario.asvs.count
    more = f"asvs.count={asvs + 1}"
    unheard = mission.nearest[fate == OUT_OF_HF]
    unheard = unheard[np.isfinite(unheard)]
    if len(unheard):
        is_disc = hf.traits.ends_at_range
        reach = STEP_M * ceil(float(np.quantile(unheard, MOST_PINGS)) / STEP_M)
        longer = is_disc and reach > hf.range_m
        settings = (f"acoustics.hf.range_m={reach:g}",) if longer else ()
        land = ", or behind land" * (setup.land is not None)
        words = f"{_pings(len(unheard))} sent {hf.beyond}{land}"
        yield Cause(len(unheard), words, (*settings, more))
    lost = int(np.sum(fate == LOST))
    if lost:
        yield Cause(lost, f"{_pings(lost)} lost to the channel everywhere", (more,))
    collided = int(np.sum(fate == COLLIDED))
    if collided:
        alone = ("protocol.schedule=one_per_slot",) if setup.schedule.is_proved else ()
        words = f"{counted(collided, 'ping')} collided with others"
        yield Cause(collided, words, alone or ("protocol.schedule=spatial_reuse",))
    if not np.any(fate == OUT_OF_MF) or not mf.traits.ends_at_range:
        return
    _, nearest = broadcast_distances(mission)
    near, far = int(np.sum(nearest <= mf.range_m)), nearest[nearest > mf.range_m]
    if near and not setup.broadcaster.serves_nearest:
        words = f"{_fixes(near)} broadcast from too far away, while another ASV was within MF range"
        yield Cause(near, words, ("protocol.broadcaster=nearest",))
    far = far[np.isfinite(far)]
    if len(far):
        reach = STEP_M * ceil(float(np.quantile(far, MOST_PINGS)) / STEP_M)
        words = f"{_fixes(len(far))} broadcast while no ASV was within MF range"
        yield Cause(len(far), words, (f"acoustics.mf.range_m={reach:g}",))


def _fixes(count: int) -> str:
    return "1 fix was" if count == 1 else f"{count} fixes were"


def _pings(count: int) -> str:
    return f"{counted(count, 'ping')} {'was' if count == 1 else 'were'}"


def remedies(mission: Recording) -> tuple[str, ...]:
    """Return the paragraph of HTML that names a remedy for each cause; none where none is known."""
    advice, known = mission.metrics.advice, causes(mission)
    items = "".join(
        f"<li>{escape(cause.words[0].upper() + cause.words[1:])}: "
        + "; or ".join(
            f"<code>--set {escape(setting)}</code> ({_known(setting, advice)})"
            for setting in cause.settings
        )
        + "</li>"
        for cause in known
        if cause.settings
    )
    return (f"<b>For what went wrong:</b><ul>{items}</ul>",) if items else ()


def _known(setting: str, advice: Advice | None) -> str:
    if advice is None:
        return "not tried"
    key = setting.partition("=")[0]

    def first(settings: Sequence[str]) -> str:
        """The setting of this key, empty where there is none; a name must be the same."""
        own = next((option for option in settings if option.partition("=")[0] == key), "")
        return own if own == setting or key.endswith(("_m", "count")) else ""

    for effect in advice.effects:
        if own := first(effect.settings):
            what = "" if own == setting else f" with {own.partition('=')[2]}"
            text = "" if effect.verdict in (HELPS, HARMS) else f", {effect.verdict}"
            return f"measured{what}: {_interval(effect)}{text}"
    for change in advice.foreseen:
        if own := first(change.settings):
            what = "" if own == setting else f" with {own.partition('=')[2]}"
            return (
                f"predicted{what}: {number(change.now_m)} to {number(change.then_m)} m, not flown"
            )
    name = setting.partition("=")[2]
    if any(name in words.split() for words in advice.dropped):
        return "tried, and promised less than what is below"
    if any(name in words.split() for words in advice.inert):
        return "tried, and left the worst AUV's error as it was"
    return "not tried"


def advised(advice: Advice | None) -> tuple[str, ...]:
    """Return paragraphs of HTML on what would help the worst AUV of a mission."""
    if advice is None:
        return (NOTHING_TRIED,)
    return (*_measured(advice), *_foreseen(advice.foreseen), *_others(advice))


def _foreseen(changes: Sequence[Foreseen]) -> Iterator[str]:
    """Yield what the planner predicts of changes of which none could be flown."""
    if not changes:
        return
    items = "".join(
        f"<li><b>{number(change.now_m)} to {number(change.then_m)} m</b> {escape(change.words)}<br>"
        f"<code>{escape(' '.join(change.options))}</code></li>"
        for change in changes
    )
    yield (
        "<b>Predicted, not flown:</b> by geometry, slots and drift the worst AUV's mean error "
        f"would change from what is predicted of the plan as it is <ul>{items}</ul>"
    )


def _measured(advice: Advice) -> Iterator[str]:
    if advice.shortage:
        yield f"Not known: {escape(advice.shortage)}."
        return
    helps = advice.of(HELPS)
    if helps:
        items = "".join(_item(effect) for effect in helps)
        yield (
            f"<b>Measured:</b> the worst AUV's mean error, {number(advice.error_m)} m over "
            f"{max(effect.seeds for effect in helps)} other seeds, would change by "
            f"<ul>{items}</ul> Options to be added to <code>run</code>."
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
        effects = advice.of(verdict)
        if effects:
            named = "; ".join(f"{escape(effect.words)} ({_interval(effect)})" for effect in effects)
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
    lists = "".join(
        f"<dt>{words}</dt><dd>{_listed(changes)}</dd>" for words, changes in groups if changes
    )
    if lists:
        yield f"<details><summary>What else was considered</summary><dl>{lists}</dl></details>"


def _listed(words: Sequence[str]) -> str:
    return escape("; ".join(words)) + "."
