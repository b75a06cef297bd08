"""What happened in a mission, in sentences whose every number is taken from its tables.

A mission is judged by its worst AUV, and by the age of its last fix from beginning to end.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import isnan

from ...core.results.effects import harm_text
from ...core.scenario.scenario import Scenario
from ...support.wording import counted, instant, number, timed
from .gaps import Gap, Patience, Service, patience, service
from .losses import MOST_OTHERS, lost
from .recording import Metrics, Recording
from .remedies import advised, remedies

# A reader takes in a few paragraphs; the rest is in the table and the plots.
MOST_AUVS, MOST_GAPS = 3, 4

REASONS = {
    "lost": "were in range but lost to the channel",
    "collided": "collided with another ping at the ASVs in range",
    "out_of_mf": "were heard, but the fix was broadcast beyond MF range of the AUV",
    "in_flight": "were still under way when the mission ended",
    "refused": "were located, but refused by its filter as it was told (navigation.nis_gate)",
}
UNDECODED = "were heard, but the AUV did not decode the frame with its fix"
HEARD_BY_ITSELF = {"collided": "were overlapped by another ping at the AUV"}


@dataclass(frozen=True)
class Story:
    """The verdict in a sentence and its reason, paragraphs of HTML under headings, each AUV's
    service.

    `warning` says first what is wrong with the fixes; it is empty where nothing is.
    """

    warning: str
    verdict: str
    reason: str
    sections: tuple[tuple[str, tuple[str, ...]], ...]
    services: tuple[Service, ...]


def story(mission: Recording) -> Story:
    """Return what happened in a mission: who starved, when, why, and what would help."""
    wait = patience(mission)
    services = tuple(service(mission, auv, wait) for auv in range(mission.auvs))
    errors = [row["position_error_m"] or 0.0 for row in mission.metrics.auvs]
    starving = sorted((auv for auv in services if auv.gaps), key=lambda auv: -errors[auv.auv])
    sections = [(f"AUV{auv.auv}", _starvation(mission, auv)) for auv in starving[:MOST_AUVS]]
    if len(starving) > MOST_AUVS:
        sections.append(("Others", (_others(starving[MOST_AUVS:]),)))
    if sentence := lost(mission):
        sections.append(("Pings and fixes that were lost", sentence))
    sections.append(("What would help", (*remedies(mission), *advised(mission.metrics.advice))))
    warning = " ".join(harm_text(mission.metrics.auvs, mission.metrics.advice))
    reason = _reason(mission, starving, wait, harmless=not warning)
    return Story(warning, _worst(mission.metrics), reason, tuple(sections), services)


def short_story(metrics: Metrics) -> Story:
    """Return what can be said of a mission of which only metrics were recorded."""
    warning = " ".join(harm_text(metrics.auvs, metrics.advice))
    sections = [("What would help", advised(metrics.advice))]
    if metrics.broken:
        sections.insert(0, ("Its schedule", (escape(metrics.broken),)))
    return Story(warning, _worst(metrics), "", tuple(sections), ())


def _others(starving: list[Service]) -> str:
    named = ", ".join(f"AUV{auv.auv} ({timed(auv.starved)})" for auv in starving[:MOST_OTHERS])
    more = len(starving) - MOST_OTHERS
    return f"Also without fixes for a while: {named}" + (f" and {more} more." if more > 0 else ".")


def _worst(metrics: Metrics) -> str:
    """Return who navigated worst, on average and for 95 % of the time."""
    mission, names = metrics.mission, ("position_error_m", "position_error_p95_m")
    worst = [(mission.get(f"worst_{name}"), mission.get(f"worst_{name}_auv")) for name in names]
    (error, auv), (largest, other) = worst
    if error is None or largest is None:  # a mission of an older version
        return ""
    whose = "it" if auv == other else f"{other}'s, the largest there,"
    fleet = f" (mean of the fleet {number(mission['position_error_m'])} m)" * (
        len(metrics.auvs) > 1
    )
    return (
        f"{auv} navigated worst: its error was {number(error)} m on average{fleet}; for 95 % of "
        f"the time {whose} stayed below {number(largest)} m."
    )


def _reason(mission: Recording, starving: list[Service], wait: Patience, *, harmless: bool) -> str:
    """Return who had no fixes for how long, and which ASVs failed."""
    text = _failed(mission)
    if starving:
        return f"{text} {_starved(mission, starving)} {wait.rule}".lstrip()
    if not harmless:  # however often they come, fixes that do harm are no service
        return text
    oldest, auv = (
        mission.metrics.mission[f"worst_fix_age_max_s{ending}"] for ending in ("", "_auv")
    )
    text += f" No AUV starved; the last fix was never older than {timed(oldest, 1)} ({auv})."
    return f"{text} {wait.rule}".lstrip()


def _failed(mission: Recording) -> str:
    """Return which ASVs failed when."""
    end = mission.scenario.duration_s
    text = [
        f"ASV{failure.asv} failed at {instant(failure.at_s, end)}"
        + (
            f" and worked again from {instant(failure.until_s, end)}"
            if failure.until_s is not None and failure.until_s < end
            else ""
        )
        for failure in sorted(mission.scenario.asvs.failures, key=lambda failure: failure.at_s)
        if failure.at_s < end
    ]
    return f"{'; '.join(text)}." if text else ""


def _starved(mission: Recording, starving: list[Service]) -> str:
    worst = max(starving, key=lambda auv: auv.starved)
    duration = mission.scenario.duration_s
    longest = max(worst.gaps, key=lambda gap: gap.length)
    share = 100 * worst.starved / duration
    verb = "starved" if len(starving) == 1 else "starved most"
    return (
        f"AUV{worst.auv} {verb}: {_both(timed(worst.starved), ' of ', timed(duration))} "
        f"({share:.0f} %) passed in gaps without fixes, the longest {timed(longest.length)}, from "
        f"{_span(longest, ' to ', duration)}."
    )


def _starvation(mission: Recording, auv: Service) -> tuple[str, ...]:
    longest = sorted(auv.gaps, key=lambda gap: -gap.length)[:MOST_GAPS]
    listed = ", ".join(
        f'<a href="#playback" data-seek="{gap.start:.2f}" data-auv="{auv.auv}">'
        f"{_span(gap, '&ndash;', mission.scenario.duration_s)}</a>"
        for gap in sorted(longest, key=lambda gap: gap.start)
    )
    more = f" and {len(auv.gaps) - len(longest)} shorter" if len(auv.gaps) > len(longest) else ""
    when = (
        f"<b>When:</b> no fix for {timed(auv.starved)} in {counted(len(auv.gaps), 'gap')}: "
        f"{listed}{more}."
    )
    effect = f"Its error was {number(auv.error_in_gaps)} m then"
    if not isnan(auv.error_otherwise):
        effect += f", {number(auv.error_otherwise)} m the rest of the time"
    return f"{when} {effect} (time means).", _why(mission, auv)


def _span(gap: Gap, between: str, duration_s: float) -> str:
    return _both(instant(gap.start, duration_s), between, instant(gap.end, duration_s))


def _both(first: str, between: str, second: str) -> str:
    """Return two times, their unit once if it is that of both."""
    unit = second[second.find(" ") :] if " " in second else ""
    return f"{first.removesuffix(unit)}{between}{second}"


def _why(mission: Recording, auv: Service) -> str:
    fates = {name: n for name, n in auv.fates.items() if n}
    passive = mission.scenario.protocol.asvs_ping
    sent, late = sum(fates.values()), fates.pop("delivered", 0)
    if not sent:
        why = "no ASV pinged" if passive else "it sent no ping"
        also = "" if passive else ": no ASV called it, or none was due"
        if _is_abandoned(mission.scenario, auv.gaps):
            also = ": no ASV worked"
        elif mission.setup.tells_slots:
            also = ": it had no slot, or did not know it"
        return f"<b>Why:</b> {why} in those gaps{also}."
    pings = f"{counted(sent, 'ping')} {'of the ASVs' if passive else 'it sent'} in those gaps"
    calls = mission.scenario.protocol.calls
    if calls:  # whose turns without an answer have no ping
        pings = f"{counted(sent, 'turn')} in which an ASV called it in those gaps"
    if not fates:
        return f"<b>Why:</b> {pings}, and all led to fixes: there were too few."
    ordered = sorted(fates.items(), key=lambda item: -item[1])
    were = "were" if calls else "were sent"
    reasons = {"out_of_hf": f"{were} {escape(mission.scenario.acoustics.hf.beyond)}"}
    reasons |= REASONS | (HEARD_BY_ITSELF if passive else {})
    if not mission.scenario.acoustics.mf.traits.ends_at_range:
        reasons["out_of_mf"] = UNDECODED
    elif mission.scenario.asvs.failures:
        reasons["out_of_mf"] += ", or as its ASV failed"
    if "collided" in mission.fixes["outcome"]:
        reasons["out_of_mf"] += ", or met another frame"
    if mission.setup.land is not None:
        reasons["out_of_hf"] += ", or behind land"
        reasons["out_of_mf"] += ", or behind land"
    why = ", ".join(
        f"{n} ({100 * n / sent:.0f} %) {reasons[name].replace('were', 'was', n == 1)}"
        for name, n in ordered
    )
    text = f"<b>Why:</b> of {pings}, {why}"
    if late:
        text += f"; {late} led to the fixes that ended them"
    if fates.get("out_of_hf") and isnan(auv.median):
        text += ". No ASV worked then"
    elif fates.get("out_of_hf"):
        nearest = "nearest ASV" + " that worked" * bool(mission.scenario.asvs.failures)
        text += (
            f". The {'one that pinged' if passive else nearest} was {auv.median:.0f} m away "
            f"then (median, at most {auv.furthest:.0f} m)"
        )
    return text + "."


def _is_abandoned(scenario: Scenario, gaps: Sequence[Gap]) -> bool:
    """Tell whether the last ASV failed in one of some gaps."""
    return any(
        gap.start <= failure.at_s < gap.end and not any(scenario.asvs.alive(failure.at_s))
        for failure in scenario.asvs.failures
        for gap in gaps
    )
