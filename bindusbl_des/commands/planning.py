"""Commands for planners, who run no mission: timing and coverage."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .console import check_figure, scenario_from, set_option, talk

if TYPE_CHECKING:
    from ..scenario import Scenario
    from ..slots import Slots

Stations = list[tuple[float, float]]

# Rows of the timing table; a fleet of more AUVs is shown by its ends.
MOST_ROWS = 12

# The covering radius takes the fourth power of the number of ASVs: 50 take a moment.
MOST_ASVS = 50


@click.command()
@click.argument("scenario", metavar="SCENARIO.yaml")
@set_option
def timing(scenario: str, overrides: tuple[str, ...]) -> None:
    """Print slots, rounds and fix rates of a scenario's protocol."""
    mission = scenario_from(scenario, overrides)
    from ..world import slots_of

    slots = slots_of(mission)
    click.echo("\n".join([*_durations(mission, slots), "", *_rounds(mission, slots)]))


def _durations(scenario: "Scenario", slots: "Slots") -> Iterator[str]:
    rate = scenario.protocol.tick_rate_hz
    for name, value in (
        ("crossing time t_C", slots.crossing_time),
        ("ping T_P", slots.ping_duration),
        ("longest travel time", slots.longest_travel_time),
        ("uplink slot T_UL", slots.uplink_slot),
    ):
        yield f"{name:<22}{1e3 * value:>10.3f} ms"
    on_clock = slots.clock.after(0.0, slots.uplink_slot)
    if rate is None:
        yield f"{'clock':<22}{'exact':>10}"
        return
    yield f"{'  on the clock':<22}{1e3 * on_clock:>10.3f} ms = {round(on_clock * rate)} ticks"
    yield f"{'tick':<22}{1e3 / rate:>10.3f} ms = 1/{rate:g} s"


def _rounds(scenario: "Scenario", slots: "Slots") -> Iterator[str]:
    """Yield a row for each number of fixes that a round may bring.

    A round is shortest where all AUVs ping at once, longest where each has a slot of its own; if
    all are fixed in each round, that is how often an AUV gets a fix.
    """
    count = scenario.auvs.count
    yield "A sequential round of K fixes, with one ping group .. a group for each AUV:"
    yield f"{'K':>6}{'bytes':>8}{'T_tx ms':>10}{'T_DL ms':>10}{'round s':>18}{'rounds/s':>18}"
    for fixes in (k for k in range(count + 1) if k < MOST_ROWS or k == count):
        first, last = slots.round_length(1, fixes), slots.round_length(count, fixes)
        yield (
            f"{fixes:>6}{slots.payload_bytes(fixes):>8}{1e3 * slots.airtime(fixes):>10.1f}"
            f"{1e3 * slots.downlink_slot(fixes):>10.1f}{f'{first:.3f} .. {last:.3f}':>18}"
            f"{f'{1 / last:.3f} .. {1 / first:.3f}':>18}"
        )


@click.command()
@click.argument("scenario", metavar="SCENARIO.yaml")
@set_option
@click.option("--figure", metavar="FILE", help="Also draw the map to a PNG, SVG or PDF file.")
@click.option("--force", is_flag=True, help="Replace the figure if it exists.")
def coverage(scenario: str, overrides: tuple[str, ...], figure: str | None, force: bool) -> None:
    """Print where the ASVs are and how much of the survey they hear."""
    mission = scenario_from(scenario, overrides)
    if figure:
        check_figure(Path(figure), force)
    from ..coverage import coverage_map
    from ..launch import asv_stations, horizontal_reach

    stations, reach = asv_stations(mission), horizontal_reach(mission)
    click.echo("\n".join(_coverage(mission, stations, reach)))
    click.echo("\nHeard by none (.), one (o), several ASVs (#); x to the right, y upwards:")
    click.echo("\n".join(coverage_map(mission.survey.side_m, stations, reach)))
    if figure:
        from ..figures.coverage import coverage_figure
        from ..figures.style import TWO_COLUMNS, save, styled

        with styled():
            save(coverage_figure(mission, TWO_COLUMNS), Path(figure))
        talk(f"Figure: {figure}")


def _coverage(scenario: "Scenario", stations: Stations, reach: float) -> Iterator[str]:
    from ..coverage import covered_area, covering_radius
    from ..formations import corner_distance, formation_radius_bound

    side, hf_range = scenario.survey.side_m, scenario.acoustics.hf.range_m
    for number, (x, y) in enumerate(stations[:MOST_ROWS]):
        yield f"{f'ASV{number}':<26}{x:>9.2f}, {y:.2f} m"
    if len(stations) > MOST_ROWS:
        yield f"... {len(stations) - MOST_ROWS} more ASVs"
    metric = scenario.acoustics.hf.range_metric
    yield f"{'HF range':<26}{hf_range:>9.2f} m {metric}, {reach:.2f} m seen from above"
    yield f"{'worst corner':<26}{corner_distance(side, stations):>9.2f} m to its nearest ASV"
    try:
        bound = f"{formation_radius_bound(side, hf_range):>9.2f} m (not sufficient by itself)"
    except ValueError:
        bound = f"{'none':>9} (the HF range is below half the side)"
    yield f"{'smallest radius (paper)':<26}{bound}"
    if len(stations) <= MOST_ASVS:
        radius = covering_radius(side, stations)
        verdict = "within" if radius <= reach else "beyond"
        yield f"{'covering radius':<26}{radius:>9.2f} m, {verdict} the HF range"
    else:
        yield f"{'covering radius':<26}{'-':>9} (not computed for more than {MOST_ASVS} ASVs)"
    yield f"{'covered area':<26}{100 * covered_area(side, stations, reach):>9.2f} %"
