"""Scenarios from YAML files: every mistake at once, each with its line and a remedy.

Files that a scenario names are sought in its folder; a mistake in one is reported at its key.
"""

import copy
import json
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from ....models.presets.modems import airtime_table
from ....support.kept_files import EACH, FILES, Way, is_own, may_be_file
from ....support.mistakes import FilePlace, Mistake, Problem, ScenarioError
from ....support.plain_data import Path, dotted, path_of, value_at
from ....support.plain_yaml import Document, read_text, read_yaml
from ....support.shipped import located
from ....support.wording import described, printable
from ..chosen_parts import load_plugins
from ..families import ROUTE as ROUTES
from ..measured import read_measured
from ..scenario import Scenario, site_of
from ..scenario_keys import ScenarioKeys
from ..sections.placements import AsvTrack
from ..sections.routes import Track
from ..site import Site
from .explanations import Finding, guessed_kind
from .former_keys import as_now, is_former, is_of_old, move_keys
from .overrides import override

if TYPE_CHECKING:
    from ...vehicles.tracks import Track as RecordedTrack


class Source(NamedTuple):
    """A scenario as text: its name in messages, the folder of its files, and overrides.

    `overrides` are applied to it, each as ``dotted.key=value``.
    """

    text: str
    name: str = "scenario"
    folder: FilePath = FilePath()
    overrides: tuple[str, ...] = ()

    @classmethod
    def file(cls, path: str | FilePath, overrides: Sequence[str] = ()) -> "Source":
        """Read a scenario file.

        Raises:
            ScenarioError: when it cannot be read.
        """
        return cls(read_text(path), str(path), FilePath(path).parent, tuple(overrides))

    @classmethod
    def of(cls, scenario: Scenario) -> "Source":
        """Return the keys given of a scenario as JSON, which is valid YAML."""
        given = scenario.model_dump(mode="json", exclude_unset=True)
        return cls(json.dumps(given, ensure_ascii=False), f"scenario {scenario.name}", FilePath())

    def read(self, allow_plugins: bool = False) -> tuple[Document, Scenario]:
        """Return the document, which knows the line of each key, and the scenario.

        Raises:
            ScenarioError: listing every mistake.
        """
        document = read_yaml(self.text, self.name)
        if not document.mistakes or document.data is not None:
            _check_root(document)
        if isinstance(document.data, dict):
            if is_of_old(document.data):
                document.data = as_now(document.data)
            move_keys(document)
        # Options with former keys come last: they become settings of the parts chosen by then.
        for option in sorted(
            self.overrides, key=lambda option: is_former(option.partition("=")[0])
        ):
            override(document, option)
        if isinstance(document.data, dict):
            move_keys(document)
        scenario = _settled(document, self.folder) if isinstance(document.data, dict) else None
        if scenario is not None and allow_plugins and not document.mistakes:
            found = (Problem(error.key, error.message) for error in load_plugins(scenario))
            _note_contradictions(document, found)
        if scenario is None or document.mistakes:
            options = enumerate(self.overrides, 1)
            order = {printable(self.name): 0} | {
                printable(f"--set {option}"): n for n, option in options
            }
            document.mistakes.sort(
                key=lambda mistake: (order[mistake.file], mistake.line, mistake.column)
            )
            raise ScenarioError(dict.fromkeys(document.mistakes))  # an option may be given twice
        return document, scenario

    def sketch(self) -> Site | None:
        """Return the site of keys that each are right and may not agree; None where one is wrong.

        A scenario that :meth:`read` refuses, such as one with a vessel on land, is drawn by it.
        """
        data = read_yaml(self.text, self.name).data
        with suppress(ValueError, LookupError, TypeError):
            list(place_files(data, self.folder))
            return Site(ScenarioKeys.model_validate(data))
        return None


def load_scenario(
    path: str | FilePath, *, overrides: Sequence[str] = (), allow_plugins: bool = False
) -> Scenario:
    """Read a scenario file or, by its name, a scenario that ships, such as ``quickstart``.

    `overrides` are applied to it, each as ``dotted.key=value``.  Files that it names are sought in
    its folder.  Plug-ins that it names (``module:object``) are code of its author: with
    `allow_plugins` they are loaded and checked, without it they are not, and `simulate` refuses.

    Raises:
        ScenarioError: listing every mistake, when the file cannot be read or used.
    """
    path = located(path, ("scenarios",)) if isinstance(path, str) else path
    document, scenario = Source.file(path, overrides).read(allow_plugins)
    for warning in document.warnings:
        warnings.warn(str(warning), FutureWarning, stacklevel=2)
    return scenario


def as_scenario(given: Scenario | str | FilePath, *, allow_plugins: bool = False) -> Scenario:
    """Return a scenario as it is, or the scenario of a file by its path.

    Raises:
        PluginError: when a user-defined part of a given scenario cannot be used.
        ScenarioError: listing every mistake, when the file cannot be read or used.
        TypeError: when `given` is neither a scenario nor a path.
    """
    if isinstance(given, Scenario):
        for mistake in load_plugins(given) if allow_plugins else ():
            raise mistake
        return given
    if isinstance(given, str | FilePath):
        return load_scenario(given, allow_plugins=allow_plugins)
    remedy = "; use Scenario.model_validate" if isinstance(given, dict) else ""
    raise TypeError(
        f"a mission needs a Scenario or the path of a scenario file; got {described(given)}{remedy}"
    )


def _check_root(document: Document) -> None:
    place = document.values.get((), FilePlace(document.file, 1, 1))
    if document.data is None:
        message = "the file is empty; a scenario needs at least `name: my_mission`"
        document.mistakes.append(Mistake.at(place, "", message))
    elif not isinstance(document.data, dict):
        kind = "a list" if isinstance(document.data, list) else "a single value"
        message = f"must hold keys and values such as `name: my_mission`; it holds {kind}"
        document.mistakes.append(Mistake.at(place, "", message))


def _settled(document: Document, folder: FilePath) -> Scenario | None:
    """Validate, remove wrong values and validate again until none is left; note every mistake.

    A contradiction that involves a removed key is not noted: it may vanish with the mistake.
    """
    data = copy.deepcopy(document.data)
    misread = set()
    for path, message in place_files(data, folder):
        misread.add(dotted(path))
        document.mistakes.append(Mistake.at(document.place(path), dotted(path), message))
    while True:
        try:
            scenario = Scenario.model_validate(data)
            found = (
                problem
                for problem in misplaced_tracks(scenario)
                if not _is_below(problem.key, misread)
            )
            _note_contradictions(document, found)
            _note_contradictions(document, _short_cast(scenario))
            return scenario
        except ValidationError as error:
            details = error.errors(include_url=False)
        if details[0]["type"] == "inconsistent":
            problems = details[0]["ctx"]["problems"]
            _note_contradictions(
                document,
                (problem for problem in problems if not _is_below(problem.key, misread)),
            )
            return None
        findings = [detail["ctx"]["finding"] for detail in details]
        # Unknown keys first: a misspelt key must not be reported as missing, too.
        findings.sort(key=lambda finding: finding.message.startswith("missing"))
        for finding in findings:
            if dotted(finding.path) not in misread:
                _note(document, finding)
            _set_aside(data, finding.path)


def _is_below(key: str, others: set[str]) -> bool:
    """Return whether a dotted key is one of others, or below it."""
    return any(key == other or key.startswith(f"{other}.") for other in others)


def _note(document: Document, finding: Finding) -> None:
    if finding.path not in document.unsettled or not finding.message.startswith("missing"):
        place = document.place(finding.path, finding.at_key)
        document.mistakes.append(Mistake.at(place, dotted(finding.path), finding.message))
    document.unsettled |= {finding.path, *finding.unsettled}


def _set_aside(data: Any, path: Path) -> None:
    """Remove the value at a path from the data, or replace it where the data needs one."""
    if path == ("name",):
        data["name"] = "unnamed"
        return
    if path[-2:] == ("route", "kind"):
        route = value_at(data, path[:-1])
        route["kind"] = guessed_kind(route)
        return
    # Remove the whole list: one item less would cause an error about its length.
    whole = path[: next((n for n, part in enumerate(path) if isinstance(part, int)), len(path))]
    section = data
    for part in whole[:-1]:
        section = section.get(part, {})
    section.pop(whole[-1], None)


def _note_contradictions(document: Document, problems: Iterable[Problem]) -> None:
    unsettled = {tuple(p for p in path if isinstance(p, str)) for path in document.unsettled}
    for problem in problems:
        paths = [path_of(key) for key in (problem.key, *problem.others)]
        if any(_overlap(path, doubtful) for path in paths for doubtful in unsettled):
            continue
        document.mistakes.append(document.mistake(problem))


def _overlap(path: Path, other: Path) -> bool:
    words = tuple(part for part in path if isinstance(part, str))
    shared = min(len(words), len(other))
    return words[:shared] == other[:shared]


def _short_cast(scenario: Scenario) -> Iterator[Problem]:
    """Yield that a cast ends above the survey's depth."""
    if scenario.environment.ctd is None:
        return
    from ...sea.water_column import read_cast

    try:
        read_cast(scenario.environment.ctd)
    except ValueError:
        return  # reported already
    try:
        site_of(scenario).sound_speed_m_per_s  # noqa: B018  # it raises what is wrong
    except ValueError as error:
        yield Problem("environment.ctd", str(error), ("survey.depth_m",))


def place_files(data: Any, folder: FilePath) -> Iterator[tuple[Path, str]]:
    """Make file names in a scenario's data absolute; yield (path, message) for unusable files."""
    for way in FILES:
        for path, section in _sections(data, way):
            given = section[way[-1]]
            listed = isinstance(given, list)
            names = given if listed else [given]
            for number, name in enumerate(names):
                if may_be_file(name):
                    names[number] = str((folder / name).resolve())
                    problem = _problem(names[number], way, section)
                    if problem:
                        yield ((*path, number) if listed else path), problem
            section[way[-1]] = names if listed else names[0]


def _sections(data: Any, way: Way, path: Path = ()) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the mappings that hold the last key of a way, each with the path to its file.

    A way is a path of keys in which EACH stands for every item of a list.
    """
    if way[0] == EACH:
        for number, item in enumerate(data if isinstance(data, list) else ()):
            yield from _sections(item, way[1:], (*path, number))
    elif isinstance(data, dict) and way[0] in data:
        if len(way) > 1:
            yield from _sections(data[way[0]], way[1:], (*path, way[0]))
        elif not is_own(data):
            yield (*path, way[0]), data


def _problem(file: str, way: Way, section: Mapping[str, Any]) -> str:
    if not FilePath(file).is_file():
        if FilePath(file).exists():
            return f"is no regular file: {file}; save it to one"
        return f"no such file: {file}; files are sought beside the scenario file"
    kind = ROUTES.traits.get(str(section.get("kind")))
    read = READERS.get(way) if kind is None or kind.is_recorded else None
    try:
        if read is not None:
            read(file)
    except ValueError as error:
        return str(error)
    return ""


def _check_track(file: str) -> None:
    from ....models.charts.recordings import (
        check_tracks,  # imports numpy, which other routes do not need
    )

    check_tracks(file)


def _check_cast(file: str) -> None:
    from ...sea.water_column import read_cast

    read_cast(file)


def _check_wind(file: str) -> None:
    from ...vehicles.wind import read_wind

    read_wind(file)


def _check_polar(file: str) -> None:
    from ...vehicles.wind import read_polar

    read_polar(file)


# The check of a file's content, by the way to its name; it raises a ValueError with the reason.
# Files not listed here are read when the scenario is validated.
READERS: Mapping[Way, Callable[[str], object]] = {
    ("auvs", "route", "files"): _check_track,
    ("auvs", "groups", EACH, "route", "files"): _check_track,
    ("asvs", "formation", "files"): _check_track,
    ("environment", "ctd"): _check_cast,
    ("environment", "wind", "file"): _check_wind,
    ("asvs", "vehicle", "polar"): _check_polar,
    ("acoustics", "hf", "channel", "file"): read_measured,
    ("acoustics", "mf", "channel", "file"): read_measured,
    ("acoustics", "mf", "airtimes"): airtime_table,
}


def misplaced_tracks(scenario: Scenario) -> Iterator[Problem]:
    """Yield tracks that begin after the mission's end, or end before its start."""
    placement, lasts = scenario.asvs.formation.recording, scenario.duration_s
    site = site_of(scenario)
    for wing in site.wings:
        if (route := wing.asked.recording) is not None:
            yield from _misplaced(wing.key, route, partial(site.auv_track, wing), lasts)
    if placement is not None:
        yield from _misplaced("asvs.formation", placement, site.asv_track, lasts)


def _misplaced(
    section: str,
    asked: Track | AsvTrack,
    read: "Callable[[int], RecordedTrack]",
    lasts: float,
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
    for number, message in misplaced(tracks, asked.time_offset_s, lasts, section):
        yield Problem(f"{section}.files.{number}", message, behind)
