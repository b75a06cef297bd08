"""What would be accepted: guards and margins as long as they must be, and no longer."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..core.wording import plain
from ..scenario.declared import broadcaster_of
from ..scenario.files.overrides import put
from ..scenario.scenario import Scenario
from .case import Case
from .deciding import pairs_of
from .guards import downlink_guard, uplink_guard
from .pair import Pair
from .reuse import margin_needed

Changes = dict[str, Any]

# What is proposed is rounded up to so much: seconds of a guard, metres of a margin.
STEP_S, STEP_M = 1e-4, 0.01

# No margin beyond the range itself is proposed: hardly any AUVs would share a slot.
MOST_RANGES = 1.0

# One change may ask for another: a longer slot lets AUVs go farther.
MOST_ROUNDS = 4


@dataclass(frozen=True)
class Remedy:
    """Keys of the scenario and the values with which its protocol is accepted."""

    changes: tuple[tuple[str, Any], ...]

    @property
    def options(self) -> tuple[str, ...]:
        """The changes as options of a command."""
        return tuple(f"--set {key}={plain(value)}" for key, value in self.changes)


def remedy_of(case: Case) -> Remedy | None:
    """Return the least change that is accepted: of guards and margin, else with a slot for each AUV
    as well; None where there is none such.
    """
    for first in ({}, {"schedule": "one_per_slot"}):
        changes: Changes = dict(first)
        for _ in range(MOST_ROUNDS):
            try:
                now = _changed(case, changes)
            except ValueError:  # a longer guard than a scenario may have
                break
            pairs = pairs_of(now)
            if all(pair.is_safe for pair in pairs):
                return Remedy(tuple((f"protocol.{key}", it) for key, it in changes.items()))
            changes |= dict(_lacking(now, pairs))
    return None


def _lacking(case: Case, pairs: list[Pair]) -> Iterator[tuple[str, Any]]:
    """Yield keys of the protocol, and values by which its pairs would be kept apart."""
    refused = {pair.kind: pair for pair in pairs if not pair.is_safe}
    for key, guard in (
        ("uplink_guard_s", uplink_guard(case, pairs)),
        ("downlink_guard_s", downlink_guard(case)),
    ):
        if guard is not None and guard.wasted_s < 0.0:
            yield key, _up(guard.needed_s, STEP_S)
    margin = margin_needed(case)
    if "same slot" in refused and margin <= MOST_RANGES * case.scenario.acoustics.hf.range_m:
        yield "conflict_margin_m", _up(margin, STEP_M)
    if broadcaster_of(case.scenario).at_once:
        yield "broadcaster", "rotate"
    if "call and answer" in refused:
        lacks = -(refused["call and answer"].margin_s or 0.0)
        yield "ranging.turnaround_s", _up(case.scenario.protocol.turnaround_s + lacks, STEP_S)


def _changed(case: Case, changes: Changes) -> Case:
    """Return the case of a scenario with other values of some keys of its protocol."""
    data = case.scenario.model_dump(mode="json")
    for key, value in changes.items():
        put(data, f"protocol.{key}", value)
    return Case(Scenario.model_validate(data), case.bounds)


def _up(value: float, step: float) -> float:
    return round(math.ceil(value / step + 1e-6) * step, 6)
