"""The commands `replay` and `fit`: recorded missions through our navigators."""

import warnings
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import (
    answer,
    check_file,
    compiling_shown,
    reading_from,
    refuse,
    refusing,
    talk,
    warn,
    write_new,
    writing,
)
from .options import Range, force_option, json_option, out_option, plugins_option

if TYPE_CHECKING:
    from ...core.scenario.scenario import Scenario
    from ..recorded.log import Log
    from ..recorded.replaying import Replay

LOGS = (
    "LOG is a .pyfg file, an .mcap file, a folder of CSV files (odometry or tracks, ranges, "
    "beacons, fixes, receptions; docs/replay.md), or goats_15 or goats_16, which ship with the "
    "package gtsam."
)


def log_options(command: Any) -> Any:
    """Give a command the options that say how a log is read."""
    vehicle = click.option(
        "--vehicle", metavar="NAME", help="Whose log it is, where a file holds several."
    )
    speed = click.option(
        "--speed",
        metavar="M_PER_S",
        type=Range(min=0.001, max=20.0),
        default=1.0,
        help="Nominal speed by which the way stands in for instants that a log has not (1).",
    )
    return vehicle(speed(command))


@click.command(epilog=LOGS)
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@log_options
@click.option(
    "--noise",
    metavar="SCENARIO",
    help="Take the noise of a scenario file, such as `fit` writes; else it is fitted to each log.",
)
@plugins_option
@out_option("DIR", "Folder for tables (Parquet and CSV) and figures.")
@force_option("Replace the folder of an earlier replay.")
@json_option("the figures of each log")
def replay(
    logs: tuple[str, ...],
    vehicle: str | None,
    speed: float,
    noise: str | None,
    allow_plugins: bool,
    out: str | None,
    force: bool,
) -> None:
    """Replay recorded missions through our filter and smoother.

    Where odometry is in a frame of its own, its start is found from the ranges.  Where gtsam is
    installed and the log states its noise, distances from GTSAM's robust optimum are told.

    A navigator of your own that --noise names at navigation.filter takes the filter's place.
    """
    from ..recorded.outcome import tables
    from ..recorded.replay_text import summary

    stated = None if noise is None else reading_from(noise, allow_plugins=allow_plugins).scenario
    navigator = None if stated is None else _navigator_of(stated)
    read = [_read(name, vehicle, speed) for name in logs]
    if len({log.name for log in read}) < len(read):
        refuse("two logs have the same name; replay them one by one")
    replays = [_replayed(log, stated, navigator) for log in read]
    written = tables(replays)
    rows, beacons = written["logs"].to_pylist(), written["beacons"].to_pylist()
    if out is not None:
        _write(Path(out), replays, written, force)
    answer({"logs": rows, "beacons": beacons, "out": out}, summary(rows, beacons))


@click.command(epilog=LOGS)
@click.argument("log")
@log_options
@out_option("FILE", "Write the scenario file here, not to stdout.")
@force_option("Replace the file if it exists.")
@json_option("the keys with their values")
def fit(log: str, vehicle: str | None, speed: float, out: str | None, force: bool) -> None:
    """Find the noise in a recorded mission, as keys of a scenario.

    Spread, heavy tail and share of outliers of what was measured, random walk and velocity bias of
    dead reckoning: those under which the log is likeliest.  And how long losses last, of a log that
    tells which receptions were lost.
    """
    from ..recorded.fitting import fit as fitted
    from ..recorded.log import BadLog
    from ..recorded.replay_text import noise_file, noise_keys
    from ..recorded.replaying import placed_log

    if out is not None:
        check_file(Path(out), force)
    read = _read(log, vehicle, speed)
    with compiling_shown(), refusing(BadLog):
        placed, _ = placed_log(read)
        noise = fitted(placed)
    if out is not None:
        write_new(Path(out), noise_file(noise, placed), force)
    keys = {name: value for name, (value, _) in noise_keys(noise, placed).items()}
    answer(
        {"keys": keys, "log_likelihood": noise.log_likelihood, "out": out},
        noise_file(noise, placed).rstrip() if out is None else out,
    )


def _read(name: str, vehicle: str | None, speed: float) -> "Log":
    from ..recorded.log import BadLog
    from ..recorded.reading import read_log

    # warnings are lack as all commands tell them
    with refusing(BadLog), warnings.catch_warnings(action="ignore"):
        log = read_log(name, vehicle, speed)
    for lack in log.left_out:
        warn(lack)
    return log


def _navigator_of(scenario: "Scenario") -> Any:
    """Return the user-defined navigator that a scenario names; None for one that ships."""
    from ...core.scenario.families import NAVIGATOR
    from ...core.scenario.part_choice import own_part
    from ...support.plugins import PluginError, is_plugin

    chosen = scenario.navigation.filter
    if is_plugin(chosen):
        with refusing(PluginError):
            return own_part(NAVIGATOR, chosen).part
    if not scenario.navigation.weighs:
        talk(f"replay flies the Kalman filter and the smoother, not navigation.filter: {chosen}")
    return None


def _replayed(log: "Log", noise: Any, navigator: Any) -> "Replay":
    from ...support.plugins import PluginError
    from ..recorded.log import BadLog
    from ..recorded.replaying import replay as replayed

    with refusing(BadLog, PluginError), compiling_shown():
        flown = replayed(log, navigator=navigator, noise=noise)
    if flown.reference is None and log.stated is not None and log.has_ranges:
        lacks = "its ranges do not determine all poses"
        if find_spec("gtsam") is None:
            lacks = "python -m pip install 'bindusbl-des[replay]'"
        talk(f"{log.name}: no robust optimum to compare with: {lacks}")
    ranges, fixes = flown.over_land
    if ranges or fixes:
        warn(
            f"{log.name}: {ranges} of {len(log.ranges.times)} ranges cross land, and {fixes} of "
            f"{len(log.fixes.times)} fixes lie on it; is it where the scenario says?"
        )
    return flown


def _write(folder: Path, replays: "Sequence[Replay]", written: Any, force: bool) -> None:
    """Write tables and a figure of each log into a new folder."""
    from ...support.files import folder_draft
    from ..figures.style import save, styled
    from ..recorded.drawing import drawn
    from ..recorded.outcome import objection, write_tables

    with writing(folder), folder_draft(folder, objection, force=force) as draft, styled():
        write_tables(written, draft)
        for replayed in replays:
            save(drawn(replayed), draft / f"{replayed.log.name}.png")
