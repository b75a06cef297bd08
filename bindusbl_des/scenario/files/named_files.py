"""Files that a scenario names: sought beside it, and what is wrong with one is told at its key.

What is wrong with recorded tracks of a scenario: they cannot be read, or lie beside its time.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from ...core.kept_files import FILES, Way, is_own
from ...presets.modems import airtime_table
from ..on_earth import recorded_track, vessel_track
from ..scenario import Scenario
from ..scenario_keys import Problem
from ..sections.placements import AsvTrack
from ..sections.routes import Track
from .plain_yaml import Path


def place_files(data: Any, folder: FilePath) -> Iterator[tuple[Path, str]]:
    """Make the names of files absolute in the data of a scenario; yield what is wrong with them."""
    for way in FILES:
        section = _section(data, way)
        if section is None or way[-1] not in section:
            continue
        given = section[way[-1]]
        listed = isinstance(given, list)
        names = given if listed else [given]
        for number, name in enumerate(names):
            if isinstance(name, str) and "\0" not in name:
                names[number] = str((folder / name).resolve())
                problem = _problem(names[number], way)
                if problem:
                    yield ((*way, number) if listed else way), problem
        section[way[-1]] = names if listed else names[0]


def _section(data: Any, way: Way) -> dict[str, Any] | None:
    """Return the mapping in which a way ends, None where there is none."""
    for name in way[:-1]:
        data = data.get(name) if isinstance(data, dict) else None
    return data if isinstance(data, dict) and not is_own(data) else None


def _problem(file: str, way: Way) -> str:
    if not FilePath(file).is_file():
        if FilePath(file).exists():
            return f"is no regular file: {file}; save it to one"
        return f"no such file: {file}; files are sought beside the scenario file"
    read = READERS.get(way)
    try:
        if read is not None:
            read(file)
    except ValueError as error:
        return str(error)
    return ""


def _track(file: str) -> None:
    from ...charts.recordings import check_tracks  # brings numpy, which other routes do not need

    check_tracks(file)


def _cast(file: str) -> None:
    from ...sea.water_column import read_cast

    read_cast(file)


def _curve(file: str) -> None:
    from .curve_file import read_curve

    read_curve(file)


# How what is in a file is looked at, by the way to its name; it raises a ValueError that says it.
# Other files are read when the scenario is made.
READERS: Mapping[Way, Callable[[str], object]] = {
    ("auvs", "route", "files"): _track,
    ("asvs", "formation", "files"): _track,
    ("environment", "ctd"): _cast,
    ("acoustics", "hf", "channel", "file"): _curve,
    ("acoustics", "mf", "channel", "file"): _curve,
    ("acoustics", "mf", "airtimes"): airtime_table,
}


if TYPE_CHECKING:
    from ...vehicles.tracks import Track as RecordedTrack


def misplaced_tracks(scenario: Scenario) -> Iterator[Problem]:
    """Yield which tracks begin after the mission's end, or have ended before its start."""
    route, placement = scenario.auvs.route.recording, scenario.asvs.formation.recording
    if route is not None:
        yield from _misplaced(
            scenario, "auvs.route", route, partial(recorded_track, scenario, route)
        )
    if placement is not None:
        read = partial(vessel_track, scenario, placement)
        yield from _misplaced(scenario, "asvs.formation", placement, read)


def _misplaced(
    scenario: Scenario,
    section: str,
    asked: Track | AsvTrack,
    read: "Callable[[int], RecordedTrack]",
) -> Iterator[Problem]:
    from ...vehicles.tracks import misplaced

    behind, tracks = ("duration_s", f"{section}.time_offset_s"), []
    for number in range(len(asked.files)):
        try:
            tracks.append(read(number))
        except ValueError as error:
            yield Problem(f"{section}.files.{number}", str(error), behind)
    if len(tracks) < len(asked.files):
        return
    offset, lasts = asked.time_offset_s, scenario.duration_s
    for number, message in misplaced(tracks, offset, lasts, section):
        yield Problem(f"{section}.files.{number}", message, behind)
