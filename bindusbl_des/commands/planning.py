"""Commands for planners, who run no mission: timing and coverage."""

from typing import TYPE_CHECKING

import click

from .console import scenario_from, set_option

if TYPE_CHECKING:
    from ..scenario import Scenario
    from ..slots import Slots

# Rows of the timing table; a fleet of more AUVs is shown by its ends.
MOST_ROWS = 12


@click.command()
@click.argument("scenario", metavar="SCENARIO.yaml")
@set_option
def timing(scenario: str, overrides: tuple[str, ...]) -> None:
    """Print the slots of a scenario's protocol, its rounds and how often an AUV can be fixed."""
    mission = scenario_from(scenario, overrides)
    from ..world import slots_of

    slots = slots_of(mission)
    click.echo("\n".join([*_durations(mission, slots), "", *_rounds(mission, slots)]))


def _durations(scenario: "Scenario", slots: "Slots") -> list[str]:
    rows = (
        ("crossing time t_C", slots.crossing_time),
        ("ping T_P", slots.ping_duration),
        ("longest travel time", slots.longest_travel_time),
        ("uplink slot T_UL", slots.uplink_slot),
    )
    rate = scenario.protocol.tick_rate_hz
    return [
        f"{name:<22}{1e3 * value:>10.2f} ms{_ticks(slots, value) if 'slot' in name else ''}"
        for name, value in rows
    ] + [f"{'clock':<22}{'exact' if rate is None else f'ticks of 1/{rate:g} s':>10}"]


def _ticks(slots: "Slots", duration: float) -> str:
    """Return a duration as the clock of the protocol has it."""
    return f"  ({1e3 * slots.clock.after(0.0, duration):.2f} ms on the clock)"


def _rounds(scenario: "Scenario", slots: "Slots") -> list[str]:
    """Return a row for each number of fixes a round may bring, for one group and for one AUV each.

    With a group for all AUVs a round is shortest; with a slot for each it is longest.
    """
    count = scenario.auvs.count
    shown = [k for k in range(count + 1) if k < MOST_ROWS or k == count]
    lines = [
        "A sequential round of K fixes: shortest (all AUVs ping at once), longest (one by one)",
        f"{'K':>6} {'bytes':>7} {'T_tx ms':>9} {'T_DL ms':>9} {'round s':>17} {'fixes/s per AUV':>17}",
    ]
    for fixes in shown:
        first, last = slots.round_length(1, fixes), slots.round_length(count, fixes)
        lines.append(
            f"{fixes:>6} {slots.payload_bytes(fixes):>7} {1e3 * slots.airtime(fixes):>9.1f} "
            f"{1e3 * slots.downlink_slot(fixes):>9.1f} {f'{first:.3f} .. {last:.3f}':>17} "
            f"{f'{1 / last:.3f} .. {1 / first:.3f}' if fixes == count else '':>17}"
        )
    return lines


@click.command()
@click.argument("scenario", metavar="SCENARIO.yaml")
@set_option
@click.option("--figure", metavar="FILE", help="Also draw the map to a PNG, SVG or PDF file.")
def coverage(scenario: str, overrides: tuple[str, ...], figure: str | None) -> None:
    """Print where the ASVs keep station and how much of the survey they hear."""
    scenario_from(scenario, overrides)
    raise NotImplementedError
