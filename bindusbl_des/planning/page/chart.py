"""What the chart of a plan needs to know: the survey, the scenario's own team, and predictions."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

from ...report.run_data import survey_data
from ...scenario.families import FILTERS
from ...scenario.planned import asv_stations
from ...scenario.scenario import Scenario
from ...scenario.survey_area import area_of
from ..prediction.inputs import Inputs, inputs_of


def chart_of(
    scenario: Scenario, inputs: Inputs, candidates: Sequence[Inputs | None] = ()
) -> dict[str, Any]:
    """Return what a page needs to move the vessels of a scenario about, as plain data.

    `inputs` are those of the scenario, `candidates` those of each candidate of the plan, in its
    order.  Most candidates differ in their stations alone: `variants` holds each way in which
    some differ in more, as the parts that are not the scenario's, and `variant_of` the number of
    each candidate's (-1: none).  `filters` holds the same of each filter that AUVs could have.
    """
    own = inputs.plain()
    variants: list[dict[str, Any]] = []
    numbers = []
    for candidate in candidates:
        other = {} if candidate is None else _differing(candidate.plain(), own)
        if other and other not in variants:
            variants.append(other)
        numbers.append(variants.index(other) if other else -1)
    return {
        **survey_data(scenario),
        "centre": list(area_of(scenario).centroid),
        "stations": [list(place) for place in asv_stations(scenario)],
        "inputs": own,
        "variants": variants,
        "variant_of": numbers,
        "filters": dict(_filters(scenario, own)),
    }


def _differing(plain: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    return {part: value for part, value in plain.items() if value != own[part]}


def _filters(scenario: Scenario, own: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield each filter that the scenario can have beside its own settings, and what it changes."""
    data = scenario.model_dump()
    for name in FILTERS:
        own_filter = scenario.navigation.filter
        filtered = own_filter if own_filter == name else name  # with its settings
        changed = {**data, "navigation": {**data["navigation"], "filter": filtered}}
        with suppress(ValueError):
            plain = inputs_of(Scenario.model_validate(changed)).plain()
            yield name, {"navigator": plain["navigator"], **_differing(plain, own)}
