"""The command `coverage`: where the ASVs are and what they hear; and what `timing` tells of limits
that no protocol could better.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import click

from ...support.wording import WIDEST
from .console import (
    check_figure,
    print_json,
    reading_from,
    refuse,
    refuse_plugins,
    say,
    talk,
    wants_json,
    writing,
)
from .options import json_option, plugins_option, scenario_argument, set_option

if TYPE_CHECKING:
    from ...core.scenario.scenario import Scenario
    from ...core.setup import Setup
    from ..preflight.fix_chance import Rings
    from ..preflight.limits import Groups, Limits


# What stands before the rates of rounds that are not a downlink's of that name.
RATES = {
    "planned": "these rounds",
    "back_to_back": "frame behind frame",
}
WIDTH = 28


def planned_limits(scenario: "Scenario") -> "Limits | None":
    """Return the limits of a scenario by its plans; None where only a plug-in knows these, and
    without any ASV.
    """
    if not scenario.asvs.count:
        return None
    from ...support.plugins import PluginError
    from ..preflight.limits import limits

    try:
        return limits(scenario)
    except (PluginError, ValueError):
        return None


def limits_lines(setup: "Setup", limits: "Limits | None") -> Iterator[str]:
    """Yield the lines about limits: of slots, pings, records, latency, and fix rates."""
    from ..preflight.band_warnings import left_out

    scenario = setup.scenario
    if not scenario.asvs.count:
        yield "Without an ASV no round begins and no AUV pings: there are no fixes by sound."
        return
    if limits is None:
        yield "Limits follow from where the AUVs go, which only the plug-in knows."
        return
    if scenario.asvs.formation.moves:
        yield "These ASVs move. Limits of moored ones on a ring, which missions may exceed:"
    else:
        yield "Limits, for the vehicles where they are planned to be:"
    worst = int(limits.in_range.argmin())
    least, mean = 100 * limits.in_range[worst], 100 * limits.in_range.mean()
    yield _line("in HF range", f"{mean:.1f} % of the time, AUV{worst} {least:.1f} %")
    chances = 100 * limits.fix_chance
    worst = int(chances.argmin())
    words = f"{chances.mean():.1f} % of pings, AUV{worst} {chances[worst]:.1f} %"
    yield _line("chance of a fix", words)
    if limits.groups is not None:
        yield from _groups(limits.groups)
    who = "an AUV" if scenario.protocol.asvs_ping else "an ASV"
    yield _line(
        f"pings decoded by {who}",
        f"{limits.decodes_hz:.1f} /s; {limits.cleared_hz:.1f} /s if each has 20 ms to die away",
    )
    if limits.capacity_hz is not None:
        slotted = setup.schedule.access == "slotted"
        least = ", if no two of a slot are heard" * slotted
        yield _line("  of ALOHA, at its best", f"{limits.capacity_hz:.2f} /s on average{least}")
    if limits.records_hz is not None:
        yield _line("records on the downlink", f"{limits.records_hz:.3f} /s, {limits.frames}")
    if limits.latency_s is not None:
        yield _line("latency", f"{limits.latency_s:.3f} s at least, by the nearest ASV")
    yield "Fixes per AUV and second, if nothing is lost but by range:"
    for sentence in left_out(setup):
        yield fill(sentence, WIDEST, initial_indent="  ", subsequent_indent="  ")
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
        fewest = f"{low:.2f}; {high:.2f} are enough, between them lies the chromatic number"
    clique = "" if groups.clique is None else f"clique {groups.clique:.2f}, "
    yield _line(
        "slots for all, at least", f"{fewest} ({clique}one ASV hears {groups.most_heard:.2f})"
    )
    if groups.made is not None:
        yield _line("slots of these rounds", f"{groups.made:.2f}")
    yield _line("AUVs in a slot, at most", f"{groups.reuse:.2f}, of those in range")


def _line(name: str, words: str) -> str:
    return f"  {name:<{WIDTH - 2}}{words}"


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


Stations = tuple[tuple[float, float], ...]

# Rows of the stations; of more ASVs the others are counted.
MOST_ROWS = 12

# Corners are taken nearer by this share: who is heard but for rounding is heard.
ROUNDING = 1e-9

# The survey is asked for the chance of a fix in so many cells along each side.
CELLS = 48


@click.command()
@scenario_argument
@set_option
@click.option("--figure", metavar="FILE", help="Also draw the map to a PNG, SVG or PDF file.")
@click.option("--force", is_flag=True, help="Replace the figure if it exists.")
@json_option("stations and distances (m)")
@plugins_option
def coverage(
    scenario: str,
    overrides: tuple[str, ...],
    figure: str | None,
    force: bool,
    allow_plugins: bool,
) -> None:
    """Print where the ASVs are and how much of the survey they hear."""
    reading = reading_from(scenario, overrides, allow_plugins)
    refuse_plugins(mistake for mistake in reading.unloaded if mistake.key == "asvs.formation")
    if figure:
        check_figure(Path(figure), force)
    from ...core.geometry.coverage import coverage_map
    from ...core.scenario.site import NoStations
    from ...support.plugins import PluginError

    try:
        stations, reach = reading.setup.stations_m, reading.setup.horizontal_reach_m
    except (NoStations, PluginError) as error:
        refuse(f"{scenario}: {error}")
    if figure and not stations:
        refuse(f"{scenario}: asvs.count is 0: no coverage can be drawn; leave out --figure")
    from ..preflight.fix_chance import heard_rings

    setup = reading.setup
    heard = heard_rings(setup)
    found = _coverage(setup, stations, reach, heard)
    if wants_json():
        print_json(found)
    else:
        say("\n".join(_told(found)))
    if stations and not wants_json():
        signs = "none (.), one (o), several ASVs (#)"
        say(f"\nHalf the pings or more heard by {signs}; north is up, east to the right:")
        say("\n".join(coverage_map(setup.area, stations, heard, land=setup.land)))
    if figure:
        from ..figures.coverage import coverage_figure
        from ..figures.style import TWO_COLUMNS, save, styled

        with writing(Path(figure)), styled():
            save(coverage_figure(setup, TWO_COLUMNS), Path(figure), replace=force)
        talk(f"Figure: {figure}")


def _coverage(setup: "Setup", stations: Stations, reach: float, heard: "Rings") -> dict[str, Any]:
    """Return where the ASVs are and what they hear, distances in m; what has no value is None.

    `left_out` names the scenario's keys that change what is heard and are not counted here.
    """
    from ...core.geometry.coverage import covered_by_rings, covering_radius
    from ...core.geometry.formation import corner_distance, formation_radius_bound

    scenario, land = setup.scenario, setup.land
    area, hf_range = setup.area, scenario.acoustics.hf.range_m
    covered = partial(covered_by, setup, stations)
    try:
        bound = formation_radius_bound(area.side, hf_range) if area.side else None
    except ValueError:  # the HF range is below half the side
        bound = None
    return {
        "asvs": [{"asv": number, "x_m": x, "y_m": y} for number, (x, y) in enumerate(stations)],
        "survey": area.words,
        "origin_deg": setup.origin_deg,
        "side_m": area.side,
        "area_m2": area.square_m,
        "hf_range_m": hf_range,
        "range_metric": scenario.acoustics.hf.range_metric,
        "reach_m": reach,
        "heard_from_m": setup.deepest_m,
        "heard_m": heard[0][1] if heard and heard[0][0] == 0.0 else 0.0,
        "heard_between_m": [list(ring) for ring in heard],
        "worst_corner_m": corner_distance(area, stations) if stations else None,
        "formation_radius_bound_m": bound,
        "covering_radius_m": covering_radius(area, stations) if stations else None,
        "covered_area": covered(heard),
        "behind_land": (
            covered_by_rings(area, stations, heard) - covered(heard) if land and stations else None
        ),
        **_by_slant(setup, covered),
        **_chances(setup, stations),
        **_directions(setup),
        "left_out": ["asvs.failures"] if scenario.asvs.failures else [],
    }


def covered_by(setup: "Setup", stations: Stations, heard: "Rings") -> float:
    """Return the share of the survey that ASVs hear; without any it is none."""
    from ...core.geometry.coverage import covered_by_rings

    return covered_by_rings(setup.area, stations, heard, setup.land) if stations else 0.0


def _by_slant(setup: "Setup", covered: "Callable[[Rings], float]") -> dict[str, Any]:
    """Return how far (m), seen from above, the HF range would reach as a slant range, and which
    share of the area is `covered` then; None where it is one, or differs little.
    """
    from ...core.setup import Setup
    from ..preflight.band_warnings import steep
    from ..preflight.fix_chance import heard_rings

    if all(problem.key != "acoustics.hf.range_metric" for problem in steep(setup)):
        return {"slant_reach_m": None, "slant_covered_area": None}
    scenario, bands = setup.scenario, setup.scenario.acoustics
    hf = bands.hf.model_copy(update={"range_metric": "slant"})
    other = scenario.model_copy(update={"acoustics": bands.model_copy(update={"hf": hf})})
    by_slant = Setup.of(other)
    share = covered(heard_rings(by_slant))
    return {"slant_reach_m": by_slant.horizontal_reach_m, "slant_covered_area": share}


def _chances(setup: "Setup", stations: Stations) -> dict[str, Any]:
    """Return how likely pings from the survey make fixes that are delivered: everywhere, and where
    it is least likely; None where a user-defined channel decides it.
    """
    import numpy as np

    from ...core.geometry.coverage import loneliest_point
    from ..preflight.fix_chance import fix_chance, mean_chance

    if not stations:
        return {"fix_chance_mean": 0.0, "fix_chance_least": 0.0}
    area, everywhere = setup.area, mean_chance(setup, stations, CELLS)
    ends, asvs = np.array([*area.open_corners, loneliest_point(area, stations)]), np.array(stations)
    nearest = asvs[np.hypot(*(ends[:, None] - asvs).transpose(2, 0, 1)).argmin(axis=1)]
    ends += (nearest - ends) * ROUNDING
    farthest = np.column_stack((ends, np.full(len(ends), setup.deepest_m)))
    at_ends = fix_chance(setup, stations, farthest)
    if everywhere is None or at_ends is None:
        return {"fix_chance_mean": None, "fix_chance_least": None}
    mean, least = everywhere
    return {"fix_chance_mean": mean, "fix_chance_least": min(least, float(at_ends.min()))}


def _directions(setup: "Setup") -> dict[str, Any]:
    """Return the noise of a level target's bearing and elevation by the array or its sheet, without
    that of the AHRS; None where no angles are stated, or a user-defined instrument measures.
    """

    if setup.scenario.usbl.model.is_own:
        return {"bearing_sd_deg": None, "elevation_sd_deg": None}
    worst = zip(*(usbl.level_sds() for usbl in setup.usbls), strict=True)
    bearing, elevation = (math.degrees(max(sds)) or None for sds in worst)
    return {"bearing_sd_deg": bearing, "elevation_sd_deg": elevation}


def _told(found: dict[str, Any]) -> Iterator[str]:
    from ...core.geometry.geodesy import degrees_text, minutes_text

    stations, reach = found["asvs"], found["reach_m"]
    for row in stations[:MOST_ROWS]:
        yield f"ASV{row['asv']:<23}{row['x_m']:>z9.2f} m north, {row['y_m']:z.2f} m east"
    if len(stations) > MOST_ROWS:
        yield f"... {len(stations) - MOST_ROWS} more ASVs"
    if not stations:
        yield f"{'ASVs':<26}{'none':>9}"
    metric = found["range_metric"]
    if not found["side_m"]:
        yield f"{'survey':<{WIDTH}} {found['survey']}"
    if found["origin_deg"]:
        yield f"{'x = y = 0':<{WIDTH}} {degrees_text(*found['origin_deg'])}"
        yield f"{'':<{WIDTH}} {minutes_text(*found['origin_deg'])}"
    yield f"{'HF range':<26}{found['hf_range_m']:>9.2f} m {metric}, {reach:.2f} m seen from above"
    if (by_slant := found["slant_reach_m"]) is not None:
        area = 100 * found["slant_covered_area"]
        yield f"{'as a slant range':<26}{by_slant:>9.2f} m seen from above, {area:.2f} % covered"
    if abs((heard := found["heard_m"]) - reach) > 0.01 * reach:
        yield f"{'half the pings':<26}{heard:>9.2f} m seen from above, up to which they are decoded"
        yield f"{'':<26}{found['heard_from_m']:>9.2f} m deep, as the deepest AUV is"
    for begin, end in found["heard_between_m"]:
        if begin > 0.0:
            yield f"{'':<26}{begin:>9.2f} m to {end:.2f} m: half of them again"
    if stations:
        yield from _distances(found)
    yield f"{'covered area':<26}{100 * found['covered_area']:>9.2f} %"
    if (hidden := found["behind_land"]) is not None:
        yield f"{'behind land':<26}{100 * hidden:>9.2f} % within that, and not heard all the same"
    if (mean := found["fix_chance_mean"]) is not None:
        least = 100 * found["fix_chance_least"]
        yield f"{'chance of a fix':<26}{100 * mean:>9.2f} % of pings, {least:.1f} % at worst"
    if (bearing := found["bearing_sd_deg"]) is not None:
        elevation = found["elevation_sd_deg"]
        yield f"{'bearing, elevation':<26}{bearing:>9.2f} deg, {elevation:.2f} deg; AHRS beside"
    if found["left_out"]:
        yield f"{'asvs.failures':<26}left out: ASVs that fail are taken to hear all the time"


def _distances(found: dict[str, Any]) -> Iterator[str]:
    from ...core.geometry.coverage import is_within

    reach, heard = found["reach_m"], found["heard_m"]
    yield f"{'worst corner':<26}{found['worst_corner_m']:>9.2f} m to its nearest ASV"
    if (bound := found["formation_radius_bound_m"]) is None:
        why = "the HF range is below half the side" if found["side_m"] else "for squares only"
        words = f"{'none':>9} ({why})"
    else:
        words = f"{bound:>9.2f} m (not sufficient by itself)"
    yield f"{'smallest radius (paper)':<26}{words}"
    radius = found["covering_radius_m"]
    by_range, by_sound = is_within(radius, reach), is_within(radius, heard)
    verdict = "within" if by_range and by_sound else "beyond"
    what = "where half are decoded" if by_range and not by_sound else "the HF range"
    yield f"{'covering radius':<26}{radius:>9.2f} m, {verdict} {what}"
