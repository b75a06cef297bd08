"""Checks that every point of an experiment is a valid scenario; errors name the experiment's
lines.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from ....core.scenario.chosen_parts import load_plugins
from ....core.scenario.families import FAMILIES
from ....core.scenario.files.scenario_file import Source
from ....core.scenario.scenario import Scenario
from ....core.setup import Setup
from ....support.kept_files import names_files, renamed_point
from ....support.mistakes import FilePlace, Mistake, ScenarioError
from ....support.plain_data import Path
from ....support.plain_yaml import Document
from ....support.plugins import Family, is_plugin, refusal
from ...preflight.idle_keys import idle_keys
from ...preflight.refusals import refusals, usable
from .experiment import as_written, laid_over, turn
from .experiment_points import Places, Points

# A grid of thousands of points repeats its mistakes; beyond these, only values not yet looked at
# are explained.
MOST_WRONG_POINTS = 20
MOST_MISTAKES = 100

DETAIL = "record.detail"
PARTS = tuple(family.key for family in FAMILIES)
NAMES = tuple(f"{family.key}.{family.word or 'model'}" for family in FAMILIES)


def check_points(
    document: Document,
    source: Source,
    base: Scenario,
    points: Points,
    places: Places,
    allow_plugins: bool = False,
) -> Points:
    """Return the points with absolute file names; mistakes go to the document."""
    given = base.model_dump(mode="json", exclude_unset=True)
    settled: Points = []
    seen: dict[str, int] = {}
    wrong = 0
    looked_at: set[Path] = set()
    for number, (point, where) in enumerate(zip(points, places, strict=True)):
        point = renamed_point(point, lambda name, _: str((source.folder / name).resolve()))
        settled.append(point)
        scenario = None if DETAIL in point else _valid(given, point, allow_plugins)
        if scenario is None:
            wrong += 1
            if wrong <= MOST_WRONG_POINTS or not looked_at.issuperset(where.values()):
                _explain(document, source, point, where, allow_plugins)
            looked_at.update(where.values())
        else:
            _check_repeated(document, scenario, seen, number, where)
        if len(document.mistakes) >= MOST_MISTAKES:
            break
    return settled


def plugins_in(document: Document, points: Points, places: Places) -> Iterator[Mistake]:
    """Yield the plug-ins of points, each once with its place."""
    checked: set[str] = set()
    for point, where in zip(points, places, strict=True):
        for key in (*PARTS, *NAMES):
            name = named(point.get(key))
            if is_plugin(name) and name not in checked:
                checked.add(name)
                yield Mistake.at(document.values[where[key]], key, refusal(name))


def without_effect(
    document: Document, base: Scenario, points: Points, places: Places
) -> Iterator[Mistake]:
    """Yield the varied keys without effect at any point, each once with its place."""
    given = base.model_dump(mode="json", exclude_unset=True)
    idle = dict.fromkeys(key for point in points for key in point)
    messages: dict[str, str] = {}
    for point in points:
        found = {
            problem.key: problem.message for problem in idle_keys(Setup.of(laid_over(given, point)))
        }
        messages = found | messages
        for key in point.keys() - found.keys():
            idle.pop(key, None)
        if not idle:
            return
    for key in idle:
        where = next(at[key] for at in places if key in at)
        yield Mistake.at(document.values[where], key, messages[key])


def _valid(
    given: Mapping[str, Any], point: Mapping[str, Any], allow_plugins: bool
) -> Scenario | None:
    try:
        scenario = laid_over(given, point)
    except ValueError:
        return None
    if any(map(names_files, point)) or (allow_plugins and any(load_plugins(scenario))):
        return None
    if any(refusals(Setup.of(scenario))):
        return None
    return scenario


def _check_repeated(
    document: Document,
    scenario: Scenario,
    seen: dict[str, int],
    number: int,
    where: Mapping[str, Any],
) -> None:
    text = scenario.model_dump_json()
    first = seen.setdefault(text, number)
    if first != number:
        message = f"point {number} is the same scenario as point {first}; keep one"
        key, place = _last(document, where)
        document.mistakes.append(Mistake.at(place, key, message))


def _last(document: Document, where: Mapping[str, Any]) -> tuple[str, FilePlace]:
    """Return the last key of a point and the place of its value."""
    if not where:
        return "points", document.values.get(("points",), FilePlace(document.file, 1, 1))
    key = list(where)[-1]
    return key, document.values.get(where[key], FilePlace(document.file, 1, 1))


def _explain(
    document: Document,
    source: Source,
    point: Mapping[str, Any],
    where: Mapping[str, Any],
    allow_plugins: bool,
) -> None:
    """Report a point's mistakes: of single values first, then of their combination."""
    if DETAIL in point:
        message = "belongs to the experiment: write `detail: full` at the top level"
        _add(document, document.keys.get(where[DETAIL], document.values[()]), DETAIL, message)
        return
    for key in point:
        if key != key.strip():  # which an option may have
            message = f"has a space before or behind it: write {key.strip()!r}"
            path = where[key]
            _add(document, document.keys[path[:2] if path[0] == "vary" else path], key, message)
    alone = [
        (key, mistake, of_part)
        for key, value in point.items()
        for mistake, of_part in _mistakes(source, {key: value}, allow_plugins)
    ]
    both = _mistakes(source, point, allow_plugins)
    together = [mistake for mistake, _ in both]
    for key, mistake, of_part in alone:
        # What another value of the point mends is no mistake.
        known = any((m.key, m.message) == (mistake.key, mistake.message) for m in together)
        if known or of_part:  # plug-ins are loaded for valid scenarios only
            _add(document, _place(document, where[key], mistake), mistake.key, mistake.message)
    checked = {(mistake.key, mistake.message) for _, mistake, _ in alone}
    for mistake, of_part in both:
        if of_part and not _is_given(mistake.key, where):
            # Of the scenario, at its place there.
            document.mistakes += [mistake] if mistake not in document.mistakes else []
        elif (mistake.key, mistake.message) not in checked:
            key, place = _last(document, where)
            if mistake.key in where:
                place = document.values[where[mistake.key]]
            values = ", ".join(f"{key}={as_written(value)}" for key, value in point.items())
            _add(document, place, mistake.key, f"{mistake.message} (with {values})")


def _is_given(key: str, where: Mapping[str, Any]) -> bool:
    """Tell whether a point gives a key, a section around it or a value in it."""
    return any(f"{key}.".startswith(f"{own}.") or f"{own}.".startswith(f"{key}.") for own in where)


def _place(document: Document, path: Path, mistake: Mistake) -> FilePlace:
    """Return the place of an unknown key or of a wrong value."""
    if not mistake.message.startswith(("unknown key", "no key")):
        return document.values[path]
    return document.keys[path[:2] if path[0] == "vary" else path]


def _add(document: Document, place: FilePlace, key: str, message: str) -> None:
    mistake = Mistake.at(place, key, message)
    if mistake not in document.mistakes:
        document.mistakes.append(mistake)


def _mistakes(
    source: Source, point: Mapping[str, Any], allow_plugins: bool
) -> list[tuple[Mistake, bool]]:
    """Return the scenario loader's mistakes at a point, and whether a plug-in made them."""
    options = (f"{key}={as_written(value)}" for key, value in sorted(point.items(), key=turn))
    changed = source._replace(overrides=(*source.overrides, *options))
    for loading in (False, True)[: 1 + allow_plugins]:
        try:
            usable(changed, loading)
        except ScenarioError as error:
            return [(mistake, loading) for mistake in error.mistakes]
    return []


def without_plugins(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the plain data of a scenario with the first shipped part in place of each plug-in."""
    plain: Any = data
    for family in FAMILIES:
        plain = _without(plain, family.key.split("."), family)
    return dict(plain)


def _without(data: Any, words: list[str], family: Family[Any]) -> Any:
    if words:
        return {**data, words[0]: _without(data[words[0]], words[1:], family)}
    if not is_plugin(named(data)):
        return data
    return {family.word: family.siblings[0]} if family.word else family.siblings[0]


def named(value: Any) -> str:
    """Return the name of the part in a key's value; "" without a part.

    >>> named("dsatur"), named({"model": "my_parts:fast", "depth": 2}), named(3)
    ('dsatur', 'my_parts:fast', '')
    """
    name = value.get("model", value.get("kind")) if isinstance(value, Mapping) else value
    return name if isinstance(name, str) else ""
