"""The command `export`: a mission for viewers, tables for spreadsheets."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import answer, check_file, refuse, refusing, result_in, talk, writing
from .options import folder_argument, force_option, json_option, out_option

if TYPE_CHECKING:
    from ...core.results.result import Result

REMEDY = (
    "MCAP files are written by the package foxglove-sdk, which is not installed here; install it "
    "with: python -m pip install 'bindusbl-des[mcap]'"
)


# Formats of plans alone
OF_PLANS = ("gpx", "qgc", "pdf")


@click.command()
@folder_argument
@click.option(
    "--to",
    "kind",
    type=click.Choice(["mcap", "ros2bag", "csv", "geojson", "kml", "kmz", "gpx", "qgc", "pdf"]),
    required=True,
    help="Format.",
)
@out_option("PATH", "File or folder (default DIR/NAME.mcap and so on, DIR/csv, DIR/qgc).")
@force_option("Replace an earlier export.")
@json_option("name and contents")
def export(folder: str, kind: str, out: str | None, force: bool) -> None:
    """Export a run, as CSV also a campaign, as a chart also a plan.

    mcap is one file for Foxglove, Lichtblick and PlotJuggler; ros2bag one for ROS 2 (fixes as they
    were delivered, estimates, the truth on /truth); csv is a folder with a file for each
    table, for spreadsheets; geojson, kml and kmz are charts of the survey, the ASVs and the ways of
    the AUVs, for maps, of a scenario that has a place on Earth. Of a plan's folder geojson, kml,
    kmz and gpx are the team that is its answer: vessels, HF and MF ranges, and the lanes of the
    AUVs; qgc is a folder with a plan of each vehicle for QGroundControl, pdf a sheet for the
    skipper.
    """
    source = Path(folder)
    from ..planning.folder import is_plan_folder

    if is_plan_folder(source):
        path, counts = _plan_to_chart(source, kind, out, force)
    elif kind in OF_PLANS:
        refuse(f"{source} is no plan; {kind} is for the vessels and lanes of one (--to kml)")
    elif kind == "csv":
        path, counts = _to_csv(source, out, force)
    else:
        path, counts = _to_file(source, kind, out, force)
    answer({"export": str(path), "to": kind, "counts": dict(counts)}, str(path))


def _plan_to_chart(
    source: Path, kind: str, out: str | None, force: bool
) -> tuple[Path, Mapping[str, int]]:
    """Write the team of a plan as a chart; return its name and how much of everything is in it."""
    from ...core.setup import Setup
    from ..export.chart_files import WRITERS, write_plan
    from ..export.vehicle_plans import write_vehicle_plans
    from ..planning.aboard import plain_words, write_sheet
    from ..planning.folder import PlanError, drawn_team

    kinds = tuple(dict.fromkeys((*WRITERS, *OF_PLANS)))
    if kind not in kinds:
        refuse(
            f"{source} is a plan, of many missions; export its team to {', '.join(kinds)}, a run "
            f"of it (`bindusbl-des run {source / 'best.yaml'}`), or the campaign "
            f"{source / 'missions'} to csv"
        )
    with refusing(PlanError, OSError, ValueError):
        team = drawn_team(source)
    path = Path(out) if out else source / (kind if kind == "qgc" else f"plan.{kind}")
    if kind != "qgc":
        check_file(path, force)
    setup = Setup.of(team.scenario)
    with _chart(path, "plan anew"):
        if kind == "qgc":
            counts: Mapping[str, int] = write_vehicle_plans(setup, path, force=force)
            talk(f"{team.whose}: {', '.join(f'{name}.plan' for name in counts)}")
            return path, counts
        if kind == "pdf":
            counts = write_sheet(team, path, replace=force)
        else:
            told = plain_words(team)
            counts = write_plan(setup, path, kind, about=told, ways=team.ways, replace=force)
    talk(f"{team.whose}: {_shapes(counts)}, {_size(path)}")
    return path, counts


@contextmanager
def _chart(path: Path, then: str) -> Iterator[None]:
    """Refuse to write a chart of what has no place on Earth, or where it cannot be written."""
    try:
        with writing(path):
            yield
    except ValueError as error:
        refuse(f"{path}: {error}; set environment.origin.lat_deg and lon_deg, and {then}")


def _shapes(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {shape}" for shape, count in counts.items())


def _to_file(
    source: Path, kind: str, out: str | None, force: bool
) -> tuple[Path, Mapping[str, int]]:
    """Write one file of a mission; return its name and how much of everything is in it."""
    if _is_campaign(source):
        refuse(f"{source} is a campaign; {kind} shows one mission: give the folder of a run")
    from ...support.wording import file_name

    result = result_in(source)
    ending = "ros2.mcap" if kind == "ros2bag" else kind
    path = Path(out) if out else source / f"{file_name(result.scenario.name)}.{ending}"
    check_file(path, force)
    if "tracks" not in result.arrow:
        refuse(
            f"{source} holds metrics only, nothing that a viewer could show; run the scenario "
            "with --set record.detail=full"
        )
    write = {"mcap": _write_mcap, "ros2bag": _write_mcap}.get(kind, _write_chart)
    return path, write(result, path, kind, force)


def _write_chart(result: "Result", path: Path, kind: str, force: bool) -> Mapping[str, int]:
    from ..export.chart_files import write_chart

    with _chart(path, "run it again"):
        counts = write_chart(result, path, kind, replace=force)
    talk(f"{_shapes(counts)}, {_size(path)}")
    return counts


def _write_mcap(result: "Result", path: Path, kind: str, force: bool) -> Mapping[str, int]:
    try:
        if kind == "mcap":
            from ..export.mcap_file import write_mcap as write
        else:
            from ..live.ros2 import write_bag as write
    except ModuleNotFoundError as error:
        if error.name != "foxglove":
            raise
        refuse(REMEDY)
    with writing(path):
        counts = write(result, path, replace=force)
    talk(f"{sum(counts.values())} messages on {len(counts)} topics, {_size(path)}")
    if result.setup.origin_deg is None:
        talk("No positions on Earth: the scenario has no environment.origin.")
    return counts


def _to_csv(source: Path, out: str | None, force: bool) -> tuple[Path, Mapping[str, int]]:
    """Write a folder of CSV files; return its name and the rows of each."""
    from ...core.results.result_folder import write_csv

    tables = _campaign_tables(source) if _is_campaign(source) else result_in(source).arrow
    path = Path(out) if out else source / "csv"
    if not path.absolute().parent.is_dir():
        refuse(f"{path}: the folder {path.parent} does not exist")
    with writing(path):
        counts = write_csv(tables, path, force=force)
    talk(", ".join(f"{name}: {rows} rows" for name, rows in counts.items()))
    return path, counts


def _is_campaign(source: Path) -> bool:
    return (source / "campaign.json").is_file()


def _campaign_tables(source: Path) -> Mapping[str, Any]:
    """Return the tables of a campaign, finished or not, and its points, in the plan's order."""
    from ..campaigns.campaign import unfinished_campaign
    from ..campaigns.statistics.points_table import points_rows
    from ..campaigns.storage.part_rows import read_table
    from ..campaigns.storage.parts import MISSIONS, TABLES

    with refusing(OSError, ValueError):
        campaign = unfinished_campaign(source)
        read = {name: read_table(source, name) for name in (MISSIONS, *TABLES)}
        if read[MISSIONS] is not None:
            read["points"] = points_rows(source, campaign.plan)
    tables = {name: table for name, table in read.items() if table is not None}
    if not tables:
        refuse(f"{source}: no mission of this campaign has finished yet; run it, then export it")
    return tables


def _size(path: Path) -> str:
    return f"{path.stat().st_size / 1e6:.1f} MB"
