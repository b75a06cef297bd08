"""What the parts of a scenario must agree on; every contradiction is listed, not just the first."""

from ..scenario_keys import ScenarioKeys
from . import (
    acoustics,
    failures,
    formation,
    instruments,
    parts,
    places,
    protocol,
    route,
    sizes,
    survey,
    telling,
    vehicles,
    water,
)
from .problem import Problem

# Each has a function `problems`, which yields what keys of its subject contradict.
SUBJECTS = (
    *(survey, vehicles, water, places, route, formation, failures, parts),
    *(protocol, telling, acoustics, instruments, sizes),
)


def problems(scenario: ScenarioKeys) -> list[Problem]:
    """Return every contradiction: dotted key, rule, value and remedy."""
    return [found for subject in SUBJECTS for found in subject.problems(scenario)]
