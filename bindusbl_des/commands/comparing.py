"""The command `compare`: are two campaigns, or two points of one, different, and how surely?"""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .console import check_file, mistakes_told, print_json, refuse, say, talk, writing
from .options import json_option, out_option

if TYPE_CHECKING:
    from ..campaigns.compare import Comparison

TABLES = (".csv", ".parquet")


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True)
@click.option("--by", metavar="KEY", help="Compare the points of one campaign along this key.")
@click.option("--baseline", metavar="VALUE", help="Compare with this value of KEY, not the first.")
@click.option("--metric", "metrics", multiple=True, help="Metric to compare; repeatable.")
@click.option(
    "--mean", "by_mean", is_flag=True, help="Judge by the fleet's means, not each worst AUV."
)
@out_option("FILE", "Also write all rows to a .csv or .parquet file.")
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
@json_option("all rows")
def compare(
    folders: tuple[str, ...],
    by: str | None,
    baseline: str | None,
    metrics: tuple[str, ...],
    by_mean: bool,
    out: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Compare campaigns with the first, or points of one campaign.

    Missions with equal seeds are paired, so that the noise they share cancels; each is judged by
    its worst AUV.
    """
    if by_mean and metrics:
        refuse("--metric says what to compare; leave out --mean")
    if out:
        check_file(Path(out), force, TABLES, "table")
    with mistakes_told():
        from ..campaigns.compare import compared
        from ..campaigns.statistics.comparison_table import comparison_table, filled
        from ..campaigns.statistics.outcomes import JUDGED, MEANS

        judged = metrics or (MEANS if by_mean else JUDGED)
        found = compared(folders, by=by, metrics=judged, baseline=baseline)
        if out:
            _write_table(found, Path(out), force)
    if as_json:
        print_json({"labels": found.labels, "differences": found.records(), "notes": found.notes})
    else:
        labels = [f"{label}: {told}" for label, told in found.labels.items()]
        labels[0] += " (baseline)"
        say("\n".join([*map(filled, labels), ""]))
        say("\n".join([comparison_table(found.differences), *map(filled, found.notes)]))
    if out:
        talk(f"Table: {out}")


def _write_table(found: "Comparison", path: Path, force: bool) -> None:
    """Write all rows, so that there is a whole table or none."""
    from ..core.files import draft_of

    frame = found.frame()
    with writing(path), draft_of(path, replace=force) as draft, open(draft, "wb") as file:
        if path.suffix.lower() == ".csv":
            frame.to_csv(file, index=False)
        else:
            frame.to_parquet(file, index=False)
