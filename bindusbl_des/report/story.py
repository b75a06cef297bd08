"""What happened in a mission, in sentences whose every number is taken from its tables."""

from dataclasses import dataclass
from html import escape
from math import ceil, isnan

import numpy as np

from .recording import COLLIDED, DELIVERED, LOST, OUT_OF_MF, Recording
from .remedies import broadcast_distances, loss_by_listeners, remedies
from .service import Service, patience, service

# A reader takes in a few paragraphs; the rest is in the table and the plots.
MOST_AUVS, MOST_GAPS, MOST_OTHERS = 3, 4, 12

REASONS = {
    "out_of_hf": "were out of HF range of every ASV",
    "lost": "were in range but lost to the channel",
    "collided": "collided with another ping at the ASVs in range",
    "out_of_mf": "were heard, but the fix was broadcast beyond MF range of the AUV",
    "in_flight": "were still under way when the mission ended",
}


@dataclass(frozen=True)
class Story:
    """The verdict in a sentence, paragraphs of HTML under headings, and each AUV's service."""

    verdict: str
    sections: tuple[tuple[str, tuple[str, ...]], ...]
    services: tuple[Service, ...]


def story(mission: Recording) -> Story:
    """Return what happened in a mission: who starved, when, why, and what would have helped."""
    wait = patience(mission)
    services = tuple(service(mission, auv, wait) for auv in range(mission.auvs))
    starving = sorted((it for it in services if it.gaps), key=lambda it: -it.starved)
    sections = [(f"AUV{it.auv}", _starvation(mission, it)) for it in starving[:MOST_AUVS]]
    if len(starving) > MOST_AUVS:
        sections.append(("Others", (_others(starving[MOST_AUVS:]),)))
    sections.append(("What would help", _help(mission, bool(starving))))
    return Story(_verdict(mission, starving, wait), tuple(sections), services)


def _others(starving: list[Service]) -> str:
    named = ", ".join(f"AUV{it.auv} ({it.starved:.0f} s)" for it in starving[:MOST_OTHERS])
    more = len(starving) - MOST_OTHERS
    return f"Also without fixes for a while: {named}" + (f" and {more} more." if more > 0 else ".")


def _verdict(mission: Recording, starving: list[Service], wait: float) -> str:
    duration = mission.scenario.duration_s
    rule = (
        f"An AUV counts as starved after {wait:.1f} s without a fix: "
        "the time in which dead reckoning drifts by 1 m, or three rounds if they take longer."
    )
    if not starving:
        gaps = [_longest_wait(mission, auv) for auv in range(mission.auvs)]
        auv = int(np.argmax(gaps))
        return (
            f"No AUV starved; the longest wait for a fix was {gaps[auv]:.1f} s, of AUV{auv}. {rule}"
        )
    worst = starving[0]
    longest = max(worst.gaps, key=lambda gap: gap.length)
    share = 100 * worst.starved / duration
    verb = "starved" if len(starving) == 1 else "starved most"
    return (
        f"AUV{worst.auv} {verb}: {worst.starved:.0f} of {duration:g} s ({share:.0f} %) passed in "
        f"gaps without fixes, the longest {longest.length:.0f} s, from {longest.start:.0f} to "
        f"{longest.end:.0f} s. {rule}"
    )


def _longest_wait(mission: Recording, auv: int) -> float:
    arrivals = mission.fixes["delivered_at_s"][mission.delivered_to(auv)]
    instants = np.concatenate(([0.0], arrivals, [mission.scenario.duration_s]))
    return float(np.diff(instants).max())


def _starvation(mission: Recording, auv: Service) -> tuple[str, ...]:
    longest = sorted(auv.gaps, key=lambda gap: -gap.length)[:MOST_GAPS]
    listed = ", ".join(
        f'<a href="#playback" data-seek="{gap.start:.2f}" data-auv="{auv.auv}">'
        f"{gap.start:.0f}&ndash;{gap.end:.0f} s</a>"
        for gap in sorted(longest, key=lambda gap: gap.start)
    )
    more = f" and {len(auv.gaps) - len(longest)} shorter" if len(auv.gaps) > len(longest) else ""
    when = (
        f"<b>When:</b> no fix for {auv.starved:.0f} s in {_counted(len(auv.gaps), 'gap')}: "
        f"{listed}{more}."
    )
    effect = f"Its error was {auv.error_in_gaps:.2f} m then"
    if not isnan(auv.error_otherwise):
        effect += f", {auv.error_otherwise:.2f} m the rest of the time"
    return f"{when} {effect} (time means).", _why(mission, auv)


def _why(mission: Recording, auv: Service) -> str:
    fates = {name: n for name, n in auv.fates.items() if n}
    sent, late = sum(fates.values()), fates.pop("delivered", 0)
    if not sent:
        return "<b>Why:</b> it sent no ping in those gaps: no ASV called it, or none was due."
    ordered = sorted(fates.items(), key=lambda it: -it[1])
    reasons = ", ".join(f"{n} ({100 * n / sent:.0f} %) {REASONS[name]}" for name, n in ordered)
    text = f"<b>Why:</b> of {_counted(sent, 'ping')} it sent in those gaps, {reasons}"
    if late:
        text += f"; {late} led to the fixes that ended them"
    if fates.get("out_of_hf"):
        hf = mission.scenario.acoustics.hf
        text += (
            f". Out of range, the nearest ASV was {auv.median:.0f} m away (median, at most "
            f"{auv.furthest:.0f} m); the HF range is {hf.range_m:g} m ({hf.range_metric})"
        )
    return text + "."


def _help(mission: Recording, starving: bool) -> tuple[str, ...]:
    lines = [*_coverage_help(mission), *_loss_help(mission), *_collision_help(mission)]
    lines += _downlink_help(mission)
    if lines:
        return tuple(lines)
    if starving:
        return ("No single cause that other stations, ranges or schedules would remove.",)
    return ("Nothing: pings were in range, decoded, and their fixes delivered.",)


def _coverage_help(mission: Recording) -> list[str]:
    in_range = mission.pings["in_range_of"] > 0
    if not len(in_range) or in_range.mean() > 0.995:
        return []
    worst = min(
        float(in_range[mission.pings["auv"] == auv].mean())
        for auv in np.unique(mission.pings["auv"])
    )
    tried = "".join(
        f"<li>{escape(it.words)}: the worst AUV in range for {100 * it.worst:.0f} % of the time, "
        f"all for {100 * it.all:.0f} %<br><code>{escape(_options(it.settings))}</code></li>"
        for it in remedies(mission)
    )
    now = (
        f"<b>Range:</b> {100 * in_range.mean():.0f} % of all pings were within HF range of an ASV, "
        f"{100 * worst:.0f} % of the worst AUV's."
    )
    if not tried:
        return [f"{now} No regular formation with up to one more ASV would do better."]
    note = (
        "Counted on the paths of this run, not simulated; to try one, add its options to "
        "<code>run</code>."
    )
    return [f"{now} What would have reached more: <ul>{tried}</ul> {note}"]


def _options(settings: tuple[str, ...]) -> str:
    return " ".join(f"--set {it}" for it in settings)


def _loss_help(mission: Recording) -> list[str]:
    lost = int(np.sum(mission.fate == LOST))
    heard_of = int(np.sum(mission.pings["in_range_of"] > 0))
    if not heard_of or lost < 0.02 * heard_of:
        return []
    shares = ", ".join(
        f"{100 * missed / sent:.0f} % with {_counted(listeners, 'ASV')} in range"
        for listeners, (missed, sent) in loss_by_listeners(mission).items()
    )
    loss = mission.scenario.acoustics.loss
    contention = ""
    if loss.combine != "off" and mission.auvs > 1:
        share = min(loss.contention_per_auv * (mission.auvs - 1), loss.cap)
        contention = (
            f" The scenario's contention term alone (acoustics.loss.contention_per_auv, "
            f"{mission.auvs} AUVs) is a loss of {100 * share:.3g} %."
        )
    return [
        f"<b>Losses:</b> {lost} of {heard_of} pings in range were decoded by no ASV: {shares}."
        f"{contention}"
    ]


def _collision_help(mission: Recording) -> list[str]:
    collided = int(np.sum(mission.fate == COLLIDED))
    if not collided:
        return []
    schedule = mission.scenario.protocol.schedule
    return [
        f"<b>Collisions:</b> {_counted(collided, 'ping')} overlapped another at an ASV and were "
        f"decoded by none, under the schedule {escape(schedule)}. "
        "<code>--set protocol.schedule=one_per_slot</code> never lets two AUVs ping together."
    ]


def _downlink_help(mission: Recording) -> list[str]:
    missed = int(np.sum(mission.fate == OUT_OF_MF))
    made = missed + int(np.sum(mission.fate == DELIVERED))
    if not missed:
        return []
    away, nearest = broadcast_distances(mission)
    reach = mission.scenario.acoustics.mf.range_m
    needed, near = ceil(float(away.max())), int(np.sum(nearest <= reach))
    text = (
        f"<b>Downlink:</b> {missed} of {made} fixes ({100 * missed / made:.0f} %) were broadcast "
        f"beyond MF range ({reach:g} m) of their AUV; "
        f"<code>--set acoustics.mf.range_m={needed}</code> would have reached all"
    )
    if near and mission.scenario.protocol.broadcaster != "nearest":
        text += (
            f", and {near} of them were within range of another ASV: "
            "<code>--set protocol.broadcaster=nearest</code>"
        )
    return [text + "."]


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
