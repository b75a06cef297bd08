"""What `timing` tells of a scenario's limits: what no protocol could do better."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...preflight.limits.groups import Groups
    from ...preflight.limits.limits import Limits
    from ...scenario.scenario import Scenario

# What stands before the rates of rounds that are not a downlink's of that name.
RATES = {
    "planned": "these rounds",
    "back_to_back": "frame behind frame",
}
WIDTH = 28


def planned_limits(scenario: "Scenario") -> "Limits | None":
    """Return the limits of a scenario by its plans; None where only a plug-in knows these."""
    from ...core.plugins import PluginError
    from ...preflight.limits.limits import limits

    try:
        return limits(scenario)
    except (PluginError, ValueError):
        return None


def limits_told(scenario: "Scenario", limits: "Limits | None") -> Iterator[str]:
    """Yield the lines about limits: of slots, pings, records, latency, and fix rates."""
    if limits is None:
        yield "Limits follow from where the AUVs go, which only the plug-in knows."
        return
    yield "Limits, for the vehicles where they are planned to be:"
    worst = int(limits.in_range.argmin())
    least, mean = 100 * limits.in_range[worst], 100 * limits.in_range.mean()
    yield _line("in HF range", f"{mean:.1f} % of the time, AUV{worst} {least:.1f} %")
    chances = 100 * limits.fix_chance
    worst = int(chances.argmin())
    told = f"{chances.mean():.1f} % of pings, AUV{worst} {chances[worst]:.1f} %"
    yield _line("chance of a fix", told)
    if limits.groups is not None:
        yield from _groups(limits.groups)
    who = "an AUV" if scenario.protocol.is_passive else "an ASV"
    yield _line(
        f"pings decoded by {who}",
        f"{limits.decodes_hz:.1f} /s; {limits.cleared_hz:.1f} /s if each has 20 ms to die away",
    )
    if limits.capacity_hz is not None:
        slotted = scenario.protocol.schedule == "slotted_aloha"
        least = ", if no two of a slot are heard" * slotted
        yield _line("  of ALOHA, at its best", f"{limits.capacity_hz:.2f} /s on average{least}")
    if limits.records_hz is not None:
        by = f", {limits.senders} ASVs at once" if limits.senders > 1 else ""
        a_frame = f"{scenario.auvs.count} a frame" if limits.groups is not None else "long frames"
        yield _line("records on the downlink", f"{limits.records_hz:.3f} /s, {a_frame}{by}")
    if limits.latency_s is not None:
        yield _line("latency", f"{limits.latency_s:.3f} s at least, by the nearest ASV")
    yield "Fixes per AUV and second, if nothing is lost but by range:"
    best = max((rates.mean for rates in limits.rates.values()), default=0.0)
    yield f"{'':<{WIDTH}}{'mean':>8}{'worst AUV':>16}{'of the best':>13}"
    for name, rates in limits.rates.items():
        lowest = f"{rates.lowest:.3f} (AUV{rates.worst})"
        share = f"{100 * rates.mean / best:.0f} %" if best else "-"
        yield f"  {RATES.get(name, name):<{WIDTH - 2}}{rates.mean:>8.3f}{lowest:>16}{share:>13}"


def _groups(groups: "Groups") -> Iterator[str]:
    low, high = groups.fewest
    fewest = f"{low:.2f}: chromatic number"
    if not groups.is_exact:
        fewest = f"{low:.2f}; DSATUR needs {high:.2f}, between them lies the chromatic number"
    clique = "" if groups.clique is None else f"clique {groups.clique:.2f}, "
    yield _line(
        "slots for all, at least", f"{fewest} ({clique}one ASV hears {groups.most_heard:.2f})"
    )
    if groups.made is not None:
        yield _line("slots of these rounds", f"{groups.made:.2f}")
    yield _line("AUVs in a slot, at most", f"{groups.reuse:.2f}, of those in range")


def _line(name: str, told: str) -> str:
    return f"  {name:<{WIDTH - 2}}{told}"


def limits_data(limits: "Limits | None") -> dict[str, Any] | None:
    """Return limits as data: rates in 1/s, times in s, AUVs by number; None where not known."""
    if limits is None:
        return None
    groups = limits.groups
    return {
        "in_range": limits.in_range.tolist(),
        "fix_chance": limits.fix_chance.tolist(),
        "groups": None if groups is None else {**asdict(groups), "is_exact": groups.is_exact},
        "decodes_hz": limits.decodes_hz,
        "cleared_hz": limits.cleared_hz,
        "capacity_hz": limits.capacity_hz,
        "records_hz": limits.records_hz,
        "senders": limits.senders,
        "latency_s": limits.latency_s,
        "fix_rates_hz": {name: rates.each.tolist() for name, rates in limits.rates.items()},
    }
