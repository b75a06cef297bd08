"""The command `reproduce`: the paper's experiments, figures and numbers, judged."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import answer, is_quiet, mistakes_text, refuse, refusing, talk
from .options import json_option, out_option, workers_option
from .sweeps import SOME_FAILED

if TYPE_CHECKING:
    from ...experiments.reproduction.counting import Tally
    from ...experiments.reproduction.readings import Reading
    from ...experiments.reproduction.reproduce import Counted, Reproduction

FOLDER = "results/reproduction"

# With --json, this many of the best joint readings are told
SHOWN = 10


@click.command(short_help="Run the paper's experiments; put its numbers beside ours.")
@click.argument("what", metavar="[paper]", type=click.Choice(["paper"]), default="paper")
@click.option("--quick", is_flag=True, help="Few seeds and team sizes: a look in a minute or two.")
@click.option(
    "--reading",
    metavar="NAME",
    help="Only the paper's numbers, under one joint reading: default, likely, or choices joined "
    "by /, such as position/world/shift.",
)
@click.option(
    "--readings",
    is_flag=True,
    help="Only count how many of the paper's numbers each joint reading meets.",
)
@out_option(
    "DIR", "Folder (default results/reproduction; -NAME with --reading, -quick with --quick)."
)
@workers_option
@json_option("numbers and sentences")
@click.pass_context
def reproduce(
    context: click.Context,
    what: str,
    quick: bool,
    reading: str | None,
    readings: bool,
    out: str | None,
    workers: int | None,
) -> None:
    """Run every experiment of the paper; put its numbers beside those measured.

    Each published number gets a verdict by rule: reproduced, differs or cannot be.  The folder
    holds the document with its figures, tables, and a campaign for each experiment.  A call that
    was cut short is continued by the next one.

    A joint reading makes one choice of everything that the paper leaves open, for all its numbers.
    The whole reproduction counts what each of them meets; --quick leaves that out.
    """
    if reading is not None and readings:
        refuse("--reading runs one joint reading, --readings counts all; give one of them")
    with mistakes_text():
        from ...experiments.reproduction import reproduce as ways
        from ...experiments.reproduction.campaigns import SomeFailed

        one = _reading(reading) if reading is not None else None
        folder = Path(out or _folder(one, quick))
        how = ways.How(quick=quick, workers=workers, quiet=is_quiet(), tell=talk)
        try:
            if readings:
                _tell_count(ways.count_readings(folder, **how))
            elif one:
                _tell(ways.reproduce_reading(one, folder, **how), one)
            else:
                _tell(ways.reproduce(folder, **how), None)
        except SomeFailed as error:
            talk(str(error))
            context.exit(SOME_FAILED)


def _reading(name: str) -> "Reading":
    from ...experiments.reproduction.readings import UnknownReading, reading_named

    with refusing(UnknownReading, before="--reading: "):
        return reading_named(name)


def _folder(one: "Reading | None", quick: bool) -> str:
    """Return where results go unless the user says; other missions go to another folder."""
    name = "-" + one.name.replace("/", "-") if one else ""
    return f"{FOLDER}{name}{'-quick' if quick else ''}"


def _tell(done: "Reproduction", one: "Reading | None") -> None:
    from ...experiments.reproduction.document import for_terminal

    head = [f"Reading: {one.name}"] if one else []
    text = for_terminal(done.numbers, done.sentences())
    answer(_summary(done, one), [*head, text, f"Results: {done.folder}"])


def _summary(done: "Reproduction", one: "Reading | None") -> dict[str, Any]:
    from ...experiments.reproduction.document import count, record

    return {
        "folder": str(done.folder),
        **({"reading": one.name, "choices": asdict(one)} if one else {}),
        "missions": sum(len(run.plan) for run in done.runs.values()),
        "counts": count(done.numbers),
        "numbers": [record(number) for number in done.numbers],
        "sentences": [asdict(claim) for claim in done.sentences()],
    }


def _tell_count(counts: "Counted") -> None:
    from ...experiments.reproduction.readings_page import for_terminal

    answer(_count(counts), [for_terminal(counts.tally), f"Results: {counts.folder}"])


def _count(counts: "Counted") -> dict[str, Any]:
    counted: Tally = counts.tally
    return {
        "folder": str(counts.folder),
        "missions": sum(len(run.plan) for run in counts.runs.values()),
        "numbers": len(counted.rows),
        "readings": len(counted.readings),
        "best": [
            {
                "reading": counted.readings[place].name,
                "choices": asdict(counted.readings[place]),
                "met": int(counted.counts[place]),
                "foretold": int(counted.foretold[place]),
                "off_by": float(counted.deviations[place]),
            }
            for place in counted.ranks[:SHOWN]
        ],
        "switches": [asdict(switch) for switch in counted.switches()],
        "not_told_apart": len(counted.rivals()),
        "by_chance": asdict(counted.by_chance),
    }
