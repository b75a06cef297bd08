"""Experiments from YAML files: every mistake at once, each with its place and a remedy."""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path as FilePath
from typing import Any

from ....core.results.schemas import schema
from ....core.scenario import keys as table
from ....core.scenario.files import former_keys
from ....core.scenario.files.scenario_file import Source
from ....core.scenario.scenario import Scenario
from ....support.mistakes import FilePlace, Mistake, ScenarioError
from ....support.plain_data import DIALECT, LONGEST_NAME, PRINTABLE
from ....support.plain_yaml import Document, read_text, read_yaml
from ....support.shipped import shipped
from ....support.wording import described, did_you_mean
from ...preflight.warnings import Reading, read_scenario
from ..storage.folder import LARGEST_SEED, MOST_MISSIONS
from .experiment import MOST_SEEDS, Detail, Experiment, as_written, targets_in, turn
from .experiment_points import (
    KEYS,
    METHODS,
    MOST_POINTS,
    Places,
    Points,
    is_experiment,
    is_scenario,
    points_in,
)
from .options import Options, PythonArguments, lay_over
from .point_checks import DETAIL, check_points, plugins_in, without_effect

DETAILS = ("summary", "full")

# The most points to try for one that completes an invalid base scenario.
MOST_TRIED = 100

NO_OPTIONS = Options()


def load_experiment(
    given: str | FilePath | Scenario,
    options: Options | PythonArguments = NO_OPTIONS,
    *,
    allow_plugins: bool = False,
) -> Experiment:
    """Read an experiment file and the scenario it names: a file beside it, or one that ships.

    A scenario, or its file, is an experiment of one point, which options may vary.  Plug-ins are
    loaded and checked with `allow_plugins` only.

    Raises:
        ScenarioError: listing every mistake in either.
        ScipyMissing: when points are to be sampled and scipy is not installed.
        TypeError: when `given` is neither a path nor a scenario.
    """
    document, source = document_of(given, options)
    return experiment_in(document, options, source, allow_plugins=allow_plugins)


def document_of(
    given: str | FilePath | Scenario, options: Options | PythonArguments = NO_OPTIONS
) -> tuple[Document, Source | None]:
    """Return the experiment of a path or a scenario, and the source of a scenario.

    Raises:
        ScenarioError: when the file cannot be read, or holds no keys.
        TypeError: when `given` is neither a path nor a scenario.
    """
    if isinstance(given, Scenario):
        source = Source.of(given)
        return of_scenario(source.name, {"name": given.name}, source.name), source
    if isinstance(given, str | FilePath):
        return _document(FilePath(given), options)
    raise TypeError(
        "a sweep needs a Scenario, or the path of a scenario or experiment file; got "
        + described(given)
    )


def experiment_in(
    document: Document,
    options: Options | PythonArguments = NO_OPTIONS,
    source: Source | None = None,
    *,
    allow_plugins: bool = False,
) -> Experiment:
    """Return the experiment in a document, with options laid over it.

    `source` is its scenario's source, if not a file that it names.

    Raises:
        ScenarioError: listing every mistake, with those that were in the document before.
        ScipyMissing: when points are to be sampled and scipy is not installed.
    """
    lay_over(document, options)
    _check_keys(document)
    name, detail = _name(document, FilePath(document.file).stem[:LONGEST_NAME]), _detail(document)
    seeds, until_ci = _seeds(document), targets_in(document)
    points, places = _as_now(document, *points_in(document))
    _check_overrides(document, options.overrides, points)
    source = source or _source(document, FilePath(document.file).parent, options.overrides)
    reading = _reading(document, source, points)
    base = None if reading is None else reading.scenario
    if base is not None and seeds and len(points) * len(seeds) > MOST_MISSIONS:
        count = len(points) * len(seeds)
        document.note(("seeds",), f"makes {count:,} missions; at most {MOST_MISSIONS:,} can run")
    elif source is not None and base is not None:
        points = check_points(document, source, base, points, places, allow_plugins)
    if reading is None or base is None or document.mistakes:
        raise _wrong(document)
    keys = base.model_dump(mode="json", exclude_unset=True)
    warnings = (
        *document.warnings,
        *_fixed(reading, {key for point in points for key in point}),
        *without_effect(document, base, points, places),
    )
    unloaded = () if allow_plugins else _unloaded(reading, document, points, places)
    return Experiment(name, keys, tuple(points), tuple(seeds), detail, until_ci, warnings, unloaded)


def _as_now(document: Document, points: Points, places: Places) -> tuple[Points, Places]:
    """Return points with present names of keys; each former name is a warning."""
    former = {key: at[key] for at in reversed(places) for key in at if former_keys.is_former(key)}
    for key, path in former.items():
        place = document.values.get(path, FilePlace(document.file))
        message = f"is a setting now: write {former_keys.key_now(key)}; {former_keys.READ_YET}"
        document.warnings.append(Mistake.at(place, key, message))
    if not former:
        return points, places
    renamed = [
        {former_keys.key_now(key): value for key, value in point.items()} for point in points
    ]
    return renamed, [{former_keys.key_now(key): path for key, path in at.items()} for at in places]


def _unloaded(
    reading: Reading, document: Document, points: Points, places: Places
) -> tuple[Mistake, ...]:
    """Return the plug-ins of points, and those of the scenario that some point keeps."""
    kept = (
        mistake for mistake in reading.unloaded if not all(mistake.key in point for point in points)
    )
    return (*kept, *plugins_in(document, points, places))


def _fixed(reading: Reading, varied: set[str]) -> tuple[Mistake, ...]:
    """Return the warnings that hold at every point, which depend on no varied key."""
    changed = {"record.detail", *varied}

    def holds(key: str) -> bool:
        return not any(f"{key}.".startswith(f"{other}.") for other in changed)

    return tuple(
        warning
        for warning, about in zip(reading.warnings, reading.about, strict=True)
        if all(map(holds, about))
    )


def _document(path: FilePath, options: Options | PythonArguments) -> tuple[Document, Source | None]:
    """Return the experiment of a file, or that of a scenario's file with the scenario."""
    text = read_text(path)
    document = read_yaml(text, str(path))
    if not is_experiment(document.data) and (options or is_scenario(document.data)):
        return of_scenario_file(path, text, document.data, options.overrides)
    if not isinstance(document.data, dict):
        raise _wrong_root(document)
    return document, None


def of_scenario_file(
    path: FilePath, text: str, data: Any, overrides: tuple[str, ...]
) -> tuple[Document, Source]:
    """Return the experiment that runs a scenario's file unchanged, and the scenario as read.

    The file is not read again, since a pipe can be read only once.
    """
    source = Source(text, str(path), path.parent, overrides)
    return of_scenario(str(path), data, path.name), source


def of_scenario(file: str, data: Any, scenario: str) -> Document:
    """Return the experiment that runs a scenario unchanged; its mistakes are reported later."""
    name = data.get("name") if isinstance(data, dict) else None
    named = {"name": name[:LONGEST_NAME]} if isinstance(name, str) and _is_name(name) else {}
    document = Document(file, {**named, "scenario": scenario})
    document.keys[()] = document.values[()] = FilePlace(file, 1, 1)
    return document


def _is_name(text: str) -> bool:
    return bool(text) and bool(re.fullmatch(PRINTABLE, text))


def _wrong(document: Document) -> ScenarioError:
    own = document.file
    document.mistakes.sort(key=lambda mistake: (mistake.file != own, mistake.line, mistake.column))
    return ScenarioError(dict.fromkeys(document.mistakes))


def _wrong_root(document: Document) -> ScenarioError:
    if document.mistakes:
        return _wrong(document)
    if document.data is None:
        message = "the file is empty; an experiment needs at least `scenario: FILE.yaml`"
    else:
        message = f"must hold keys such as `scenario: FILE.yaml`; it holds {_kind(document.data)}"
    document.note((), message)
    return _wrong(document)


def _kind(data: Any) -> str:
    return "a list" if isinstance(data, list) else "a single value"


def _check_keys(document: Document) -> None:
    for key in document.data:
        if key not in KEYS:
            hint = did_you_mean(key, KEYS) or f"; the keys are {', '.join(KEYS)}"
            if key in Scenario.model_fields:
                hint = f"; a scenario's keys go under vary, as in `vary: {{{key}: [...]}}`"
            document.note((key,), f"unknown key{hint}", at_key=True)
    ways = [key for key in ("vary", "points", "sample") if key in document.data]
    for way in ways[1:]:
        document.note((way,), f"cannot be combined with {ways[0]}; keep one of them", True)


def _name(document: Document, default: str) -> str:
    name = document.data.get("name", default)
    if not isinstance(name, str) or not 1 <= len(name) <= LONGEST_NAME:
        message = f"needs a text of 1 to {LONGEST_NAME} characters; got {described(name)}"
        document.note(("name",), message)
        return default
    if not re.fullmatch(PRINTABLE, name):
        message = f"must not hold control characters; got {described(name)}"
        document.note(("name",), message)
        return default
    return name


def _detail(document: Document) -> Detail:
    detail: Any = document.data.get("detail", "summary")
    if detail not in DETAILS:
        hint = did_you_mean(str(detail), DETAILS)
        message = f"must be one of summary, full; got {described(detail)}{hint}"
        document.note(("detail",), message)
        return "summary"
    checked: Detail = detail
    return checked


def _seeds(document: Document) -> Sequence[int]:
    """Return the seeds: N stands for 0 to N - 1."""
    seeds: Any = document.data.get("seeds", MOST_SEEDS if "until_ci" in document.data else 1)
    if isinstance(seeds, list):
        return _listed_seeds(document, seeds)
    if isinstance(seeds, bool) or not isinstance(seeds, int):
        message = f"needs a whole number or a list of seeds; got {described(seeds)}"
        document.note(("seeds",), message)
        return ()
    if not 1 <= seeds <= MOST_MISSIONS:
        message = f"must be >= 1 and <= {MOST_MISSIONS}, the number of seeds; got {seeds}"
        document.note(("seeds",), message)
        return ()
    return range(seeds)


def _listed_seeds(document: Document, seeds: list[Any]) -> Sequence[int]:
    if not seeds:
        document.note(("seeds",), "is an empty list; give a number of seeds or name some")
    known: set[int] = set()
    for number, seed in enumerate(seeds):
        path = ("seeds", number)
        whole = isinstance(seed, int) and not isinstance(seed, bool)
        if not whole or not 0 <= seed <= LARGEST_SEED:
            document.note(path, f"a seed is a whole number >= 0; got {described(seed)}")
        elif seed in known:
            document.note(path, f"seed {seed} is given twice; keep one")
        else:
            known.add(seed)
    return seeds


def _check_overrides(document: Document, overrides: Sequence[str], points: Points) -> None:
    """Report `--set` of keys that points, or the experiment's `detail`, decide."""
    varied = dict.fromkeys(key for point in points for key in point)
    for text in overrides:
        key = former_keys.key_now(text.partition("=")[0].strip())
        message = ""
        if key == DETAIL:
            message = "belongs to the experiment; write --detail full instead"
        elif any(f"{key}.".startswith(f"{other}.") for other in varied):
            message = "is varied, so that setting it changes nothing; leave it out"
        if message:
            document.mistakes.append(Mistake.at(FilePlace(f"--set {text}"), key, message))


def _source(document: Document, folder: FilePath, overrides: tuple[str, ...]) -> Source | None:
    """Return the scenario that the experiment names; errors go to the document."""
    if "scenario" not in document.data:
        if not any(mistake.key in ("scenario", "") for mistake in document.mistakes):
            place = FilePlace(document.file, 1, 1)
            message = "missing; add it, such as `scenario: my_mission.yaml`"
            document.mistakes.append(Mistake.at(place, "scenario", message))
        return None
    named = document.data["scenario"]
    if not isinstance(named, str) or not named:
        document.note(("scenario",), f"needs the name of a file; got {described(named)}")
        return None
    file = folder / named
    if not file.is_file():
        file = shipped("scenarios").get(named, file)
    if not file.is_file():
        hint = did_you_mean(named, shipped("scenarios")) if FilePath(named).name == named else ""
        message = f"no such file: {file}; scenarios are sought beside the experiment file{hint}"
        document.note(("scenario",), message)
        return None
    try:
        return Source.file(file, overrides)
    except ScenarioError as error:
        document.mistakes += error.mistakes
        return None


def _reading(document: Document, source: Source | None, points: Points) -> Reading | None:
    """Return the scenario of the experiment; its mistakes join the experiment's.

    Keys that every point sets may be missing: an invalid scenario takes them from the first point
    that makes it valid.
    """
    if source is None:
        return None
    try:
        return read_scenario(source)
    except ScenarioError as error:
        if not document.mistakes:
            for options in _set_by_all(points):
                with suppress(ScenarioError):
                    return read_scenario(source._replace(overrides=(*source.overrides, *options)))
        document.mistakes += error.mistakes
        return None


def _set_by_all(points: Points) -> Iterator[list[str]]:
    """Yield as options, for some points, the values of the keys that all points set."""
    shared = [key for key in points[0] if all(key in point for point in points)] if points else []
    for point in points[: MOST_TRIED * bool(shared)]:
        keys = {key: point[key] for key in shared}
        yield [f"{key}={as_written(value)}" for key, value in sorted(keys.items(), key=turn)]


def experiment_schema() -> dict[str, Any]:
    """Return the JSON Schema of experiment files; keys that may be varied are suggested."""
    known = {row.key: row.meaning for row in table.settable() if row.key != "record.detail"}
    seed = {"type": "integer", "minimum": 0, "maximum": LARGEST_SEED}
    properties = {
        "name": {"description": "name of the campaign; else the file's", "type": "string"},
        "scenario": {
            "description": "scenario file, relative to this file, or the name of one that ships",
            "type": "string",
        },
        "vary": _by_key(
            known,
            "every combination of these values; 2:5 stands for 2, 3, 4, 5, and 0:90:15 for 0, "
            "15 and so on up to 90",
            ["array", "string"],
        ),
        "points": {
            "description": "the points one by one",
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "properties": {key: {"description": known[key]} for key in known},
            },
        },
        "sample": {
            "description": "points spread over ranges (needs scipy)",
            "type": "object",
            "required": ["points", "ranges"],
            "additionalProperties": False,
            "properties": {
                "method": {"enum": list(METHODS), "default": "lhs"},
                "points": {"type": "integer", "minimum": 1, "maximum": MOST_POINTS},
                "seed": {"type": "integer", "minimum": 0, "default": 0},
                "ranges": _by_key(known, "[low, high] of each key", "array"),
            },
        },
        "seeds": {
            "description": "number of seeds (0, 1, ...) or a list of them",
            "default": 1,
            "oneOf": [
                {"type": "integer", "minimum": 1, "maximum": MOST_MISSIONS},
                {"type": "array", "items": seed, "minItems": 1, "uniqueItems": True},
            ],
        },
        "until_ci": {
            "description": "run seeds until half the width of the 95 % confidence interval is at "
            "most this: a share of the mean such as 5%, or a number; seeds is the largest number "
            "then",
            "type": "object",
            "properties": {name: {} for name in schema("mission").names},
            "additionalProperties": False,
            "minProperties": 1,
        },
        "detail": {"description": "metrics only, or every event", "enum": list(DETAILS)},
    }
    return {
        "$schema": DIALECT,
        "title": "Experiment",
        "description": "One scenario varied over points and seeds.",
        "type": "object",
        "required": ["scenario"],
        "additionalProperties": False,
        "properties": properties,
    }


def _by_key(known: dict[str, str], meaning: str, kind: str | list[str]) -> dict[str, Any]:
    """Return the schema of a section with dotted keys; lists of lists are keys of their own."""
    return {
        "description": meaning,
        "type": "object",
        "properties": {key: {"description": known[key], "type": kind} for key in known},
        "additionalProperties": {"type": kind, "minItems": 1},
        "minProperties": 1,
    }
