"""What the parts of a scenario must agree on; every contradiction is listed, not just the first."""

from collections.abc import Iterator

from ...core.plugins import is_plugin
from ...core.wording import did_you_mean
from ...presets.catalogue import CATALOGUE
from ..families import parts_of
from ..part_settings import shipped_mistakes
from ..scenario_keys import Problem, ScenarioKeys
from .instruments import instruments_problems, sizes_problems, water_problems
from .protocol import acoustics_problems, protocol_problems, telling_problems
from .vehicles import (
    failures_problems,
    formation_problems,
    places_problems,
    route_problems,
    survey_problems,
    vehicles_problems,
)


def parts_problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield names of parts that there are not, and wrong settings of those that ship."""
    for family, name in parts_of(scenario):
        if name in family.siblings:
            for setting, message in shipped_mistakes(family, name):
                yield Problem(f"{family.key}.{setting}", message)
        elif not (family.is_open and is_plugin(name)):
            own = ", or your own as module:object" if family.is_open else ""
            yield Problem(
                family.key,
                f"{name!r} is no {family.noun}{did_you_mean(name, family.siblings)} (one of "
                f"{', '.join(family.siblings)}{own})"
                f"{_preset(family.key, name)}",
            )


def _preset(key: str, name: str) -> str:
    """Return where a preset belongs that is named in a part's place; "" for what is none."""
    section, _, _ = key.rpartition(".")
    kind, own = ("usbl", "preset") if section == "usbl" else ("modem", "modem")
    is_there = section.startswith(("usbl", "acoustics")) and any(
        name == it.name for it in CATALOGUE[kind]
    )
    return f"; it is a preset: set {section}.{own} to {name}" if is_there else ""


# Each yields what keys of its subject contradict, in the order in which they are told.
SUBJECTS = (
    survey_problems,
    vehicles_problems,
    water_problems,
    places_problems,
    route_problems,
    formation_problems,
    failures_problems,
    parts_problems,
    protocol_problems,
    telling_problems,
    acoustics_problems,
    instruments_problems,
    sizes_problems,
)


def problems(scenario: ScenarioKeys) -> list[Problem]:
    """Return every contradiction: dotted key, rule, value and remedy."""
    return [found for subject in SUBJECTS for found in subject(scenario)]
