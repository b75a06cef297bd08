"""The command `bench`: how fast missions and commands are on this machine."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import click

from .console import answer, refuse, refusing, talk
from .options import json_option


@click.command()
@click.option("--quick", is_flag=True, help="Fleets of up to ten AUVs, few repeats.")
@click.option("--only", metavar="NAME", help="Missions whose name contains this: '(3,3)'.")
@click.option("--commands", "with_commands", is_flag=True, help="Also time whole commands.")
@click.option(
    "--against",
    metavar="FILE",
    help="Compare with what --json printed before (default: the record in the project's sources).",
)
@json_option("all numbers")
def bench(quick: bool, only: str | None, with_commands: bool, against: str | None) -> None:
    """Measure the speed of standard missions on this machine.

    Missions are warm: code is compiled and the first run discarded.  A mission named (N,M) has N
    AUVs and M ASVs and lasts 300 s.  Those of ten thousand AUVs take minutes: they are measured
    where --only names their fleet, '(10000,200)'.

    Each is compared with the last record from the same kind of machine: processor, cores, system.
    """
    from ...benchmarks.bench import bench as measure
    from ...benchmarks.missions import USUAL, standard_missions

    missions = standard_missions()
    most, asked = 10 if quick and not only else USUAL, only or ""
    names = [
        name
        for name, mission in missions.items()
        if asked in name and (mission.auvs.count <= most or name.split()[0] in asked)
    ]
    if not names:
        refuse(f"--only {only}: no such mission; there are {', '.join(missions)}")
    records = _records(against)
    measured = measure(names, quick=quick, with_commands=with_commands, told=talk)
    answer(measured, chain(_lines(measured), [""], _compared(measured, records)))


def _records(against: str | None) -> dict[str, Any]:
    """Return the records to compare with, none where the project's are not there."""
    from ...benchmarks.bench import HISTORY, recorded

    if against is None and not HISTORY.is_file():
        return {}
    file = Path(against) if against is not None else HISTORY
    try:
        with refusing(ValueError):
            return dict(recorded(file))
    except OSError as error:
        refuse(f"{file}: cannot be read ({error.strerror})")


def _compared(measured: dict[str, Any], records: dict[str, Any]) -> Iterator[str]:
    """Yield how each mission compares with the last record from such a machine."""
    from ...benchmarks.bench import last_alike, ratios

    last = last_alike(measured, records)
    if last is None:
        why = "of such a machine" if records else "here"
        yield (
            f"no earlier record {why}; keep one with `bindusbl-des bench --json > before.json` and "
            "compare with it by --against before.json"
        )
        return
    name, before = last
    yield f"processor time over that of {name!r}, measured on the same kind of machine"
    for ratio in ratios(measured, before):
        note = "  SLOWER" if ratio.is_slower else ""
        yield (
            f"{ratio.mission:<24}{ratio.what:<20}{ratio.value:>6.2f}  ({ratio.now_ms:.1f} ms, was "
            f"{ratio.before_ms:.1f}){note}"
        )


def _lines(measured: dict[str, Any]) -> Iterator[str]:
    from ...benchmarks.missions import DURATION_S

    machine = measured["machine"]
    yield (
        f"{machine['processor']}, {machine['cores']} cores, Python {machine['python']}; "
        f"{DURATION_S:g} s each"
    )
    if machine["load"] > 1:
        yield f"other work has {machine['load']:g} processes at once: look at processor times"
    yield "ms of processor time; by the clock, where other work counts too; rates per processor s"
    yield ""
    yield f"{'mission':<20}{'ms':>9}{'by the clock':>28}{'new':>10}{'tables':>8}{'events':>9}" + (
        f"{'times':>8}{'memory':>8}"
    )
    yield f"{'':<20}{'':>9}{'median (min .. max)':>28}{'config.':>10}{'written':>8}{'per s':>9}" + (
        f"{'real':>8}{'MB':>8}"
    )
    yield "-" * 100
    for name, row in measured["missions"].items():
        yield f"{name:<20}{_row(row)}"
    yield ""
    yield from _share_lines(measured["missions"])
    if "commands" in measured:
        yield ""
        yield from _command_lines(measured["commands"])


def _row(row: dict[str, Any]) -> str:
    took = row["mission_ms"]
    clock = f"{took['median']:.1f} ({took['min']:.1f} .. {took['max']:.1f})"
    return (
        f"{took['processor']:>9.1f}{clock:>28}{row['new_configuration_ms']['processor']:>10.1f}"
        f"{row['writing_ms']['processor']:>8.1f}{_rate(row['events_per_s']):>9}"
        f"{row['sim_seconds_per_s']:>8,.0f}{row['peak_memory_mb']:>8.0f}"
    )


def _rate(per_s: float | None) -> str:
    return "-" if per_s is None else f"{per_s:,.0f}"


def _share_lines(missions: dict[str, Any]) -> Iterator[str]:
    """Yield the share of time of each part, as profiled in a run of its own."""
    parts = list(next(iter(missions.values()))["shares"])
    yield f"{'share of time, %':<20}" + "".join(f"{part:>11}" for part in parts)
    for name, row in missions.items():
        yield f"{name:<20}" + "".join(f"{100 * row['shares'][part]:>11.0f}" for part in parts)


def _command_lines(times: dict[str, Any]) -> Iterator[str]:
    sweep = times["sweep"]
    named = (("import", "import_ms"), ("--help", "help_ms"), ("run, baseline", "run_ms"))
    for name, key in named:
        took = times[key]
        processor = f"{took['processor']:.0f} ms of processor time"
        yield f"{name:<20}{took['median']:>9.0f} ms by the clock, {processor}"
    yield (
        f"{'sweep':<20}{sweep['missions_per_s']:>9.1f} missions/s with {sweep['workers']} workers: "
        f"{sweep['missions']} missions in {sweep['wall_s']:.1f} s"
    )
    yield (
        f"{'':<20}{sweep['planned_s']:>9.0f} s for {sweep['planned_missions']:,} missions, "
        "extrapolated in proportion"
    )
