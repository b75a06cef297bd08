"""The command `export`: a mission for viewers, tables for spreadsheets."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import RunFailed, refuse, talk

if TYPE_CHECKING:
    from ..result import Result

REMEDY = (
    "MCAP files are written by the package foxglove-sdk, which is not installed here; install it "
    "with: python -m pip install 'bindusbl-des[mcap]'"
)


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--to", "kind", type=click.Choice(["mcap", "csv"]), required=True, help="Format.")
@click.option("--out", metavar="PATH", help="File or folder (default DIR/NAME.mcap, DIR/csv).")
@click.option("--force", is_flag=True, help="Replace an earlier export.")
def export(folder: str, kind: str, out: str | None, force: bool) -> None:
    """Export a run, or as CSV also a campaign.

    mcap is one file for Foxglove, Lichtblick and PlotJuggler; csv is a folder with a file for each
    table, for spreadsheets.
    """
    source = Path(folder)
    path = _to_mcap(source, out, force) if kind == "mcap" else _to_csv(source, out, force)
    click.echo(path)


def _to_mcap(source: Path, out: str | None, force: bool) -> Path:
    if _is_campaign(source):
        refuse(f"{source} is a campaign; MCAP shows one mission: give the folder of a run")
    result = _result(source)
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", result.scenario.name)
    path = Path(out) if out else source / f"{name}.mcap"
    _check(path, force, path.is_file())
    if "tracks" not in result.arrow:
        refuse(
            f"{source} holds metrics only, nothing that a viewer could show; run the scenario "
            "with --set record.detail=full"
        )
    try:
        from ..export.mcap_file import write_mcap
    except ModuleNotFoundError as error:
        if error.name != "foxglove":
            raise
        refuse(REMEDY)
    try:
        counts = write_mcap(result, path)
    except OSError as error:
        raise RunFailed(f"{path}: cannot be written ({error.strerror or error})") from error
    talk(f"{sum(counts.values())} messages on {len(counts)} topics, {_size(path)}")
    if result.scenario.environment.origin.coordinates is None:
        talk("No positions on Earth: the scenario has no environment.origin.")
    return path


def _to_csv(source: Path, out: str | None, force: bool) -> Path:
    from ..export.csv_folder import replaceable, write_csv

    tables = _campaign_tables(source) if _is_campaign(source) else _result(source).arrow
    path = Path(out) if out else source / "csv"
    _check(path, force, replaceable(path))
    try:
        counts = write_csv(tables, path)
    except OSError as error:
        raise RunFailed(f"{path}: cannot be written ({error.strerror or error})") from error
    talk(", ".join(f"{name}: {rows} rows" for name, rows in counts.items()))
    return path


def _check(path: Path, force: bool, replaceable: bool) -> None:
    """Refuse a place that cannot take an export; by force an earlier export gives way."""
    if path.exists():
        if not force:
            refuse(f"{path}: exists; use --force to replace it, or name another --out")
        if not replaceable:
            refuse(f"{path}: is no earlier export, so --force will not replace it")
    if not path.absolute().parent.is_dir():
        refuse(f"{path}: the folder {path.parent} does not exist")


def _is_campaign(source: Path) -> bool:
    return (source / "campaign.json").is_file()


def _result(source: Path) -> "Result":
    from ..result import load_result

    try:
        return load_result(source)
    except (OSError, ValueError) as error:
        refuse(str(error))


def _campaign_tables(source: Path) -> Mapping[str, Any]:
    """Return the tables of a campaign, finished or not, in the order of its plan."""
    from ..campaigns.storage.folder import read_record
    from ..campaigns.storage.parts import MISSIONS, TABLES, read_table

    try:
        read_record(source)
        found = {name: read_table(source, name) for name in (MISSIONS, *TABLES)}
    except (OSError, ValueError) as error:
        refuse(str(error))
    tables = {name: table for name, table in found.items() if table is not None}
    if not tables:
        refuse(f"{source}: no mission of this campaign has finished yet; run it, then export it")
    return tables


def _size(path: Path) -> str:
    return f"{path.stat().st_size / 1e6:.1f} MB"
