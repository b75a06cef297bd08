"""What the parts of a scenario must agree on; every contradiction is listed, not just the first."""

from ..scenario_keys import Problem, ScenarioKeys
from .instruments import instruments_problems, sizes_problems, water_problems
from .protocol import acoustics_problems, parts_problems, protocol_problems, telling_problems
from .vehicles import (
    failures_problems,
    formation_problems,
    places_problems,
    route_problems,
    survey_problems,
    vehicles_problems,
)

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
