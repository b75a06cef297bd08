"""The command `reproduce`: the paper's experiments, figures and numbers, judged."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import print_json, talk
from .sweeps import SOME_FAILED, mistakes_told

if TYPE_CHECKING:
    from ..reproduction.reproduce import Reproduction

# A quick look and a full run plan different missions, so that neither can continue the other.
FOLDERS = {False: "results/reproduction", True: "results/reproduction-quick"}


@click.command()
@click.argument("what", metavar="[paper]", type=click.Choice(["paper"]), default="paper")
@click.option("--quick", is_flag=True, help="Few seeds and team sizes: a look in a minute or two.")
@click.option(
    "--out", metavar="DIR", help="Folder (default results/reproduction, -quick with --quick)."
)
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes at once (default: one per CPU)."
)
@click.option("--json", "as_json", is_flag=True, help="Print numbers and sentences as JSON.")
@click.pass_context
def reproduce(
    context: click.Context,
    what: str,
    quick: bool,
    out: str | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Run every experiment of the paper; put its numbers beside those measured.

    Each published number gets a verdict by rule: reproduced, differs or cannot be.  The folder
    holds the document with its figures, tables, and a campaign for each experiment.  A call that
    was cut short is continued by the next one.
    """
    quiet = bool((context.find_root().obj or {}).get("quiet"))
    with mistakes_told():
        from ..reproduction.reproduce import reproduce as reproduce_paper
        from ..reproduction.running import Interrupted, SomeFailed

        try:
            found = reproduce_paper(
                Path(out or FOLDERS[quick]), quick=quick, workers=workers, quiet=quiet, tell=talk
            )
        except Interrupted:
            raise KeyboardInterrupt from None
        except SomeFailed as error:
            talk(str(error))
            context.exit(SOME_FAILED)
    if as_json:
        print_json(_summary(found))
    else:
        from ..reproduction.tables import for_terminal

        click.echo(for_terminal(found.numbers, found.sentences()))
        click.echo(f"Results: {found.folder}")


def _summary(found: "Reproduction") -> dict[str, Any]:
    from ..reproduction.comparison import record
    from ..reproduction.tables import count

    return {
        "folder": str(found.folder),
        "missions": sum(len(run.plan) for run in found.runs.values()),
        "counts": count(found.numbers),
        "numbers": [record(it) for it in found.numbers],
        "sentences": [asdict(claim) for claim in found.sentences()],
    }
