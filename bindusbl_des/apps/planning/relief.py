"""What limits a team, as predicted with one thing twice as good; and which changes help a
mission.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core.results.effects import Foreseen
from ...core.setup import Setup
from ..advice.changes import changed, proposals
from .goals import value_text
from .prediction.gathering import inputs_of
from .prediction.predicting import predict
from .teams import Team, excess, value_of

if TYPE_CHECKING:
    from ...core.results.result import Result

# A smaller gain, as a logarithm, does not count.
NOTEWORTHY = 0.01

# The most changes to name, one of each kind; and the least gain, given the errors of predictions.
MOST, WORTHWHILE = 5, 0.1

# The most pairs of an AUV and an ASV: of more, each change takes seconds to predict.
LARGEST = 3_000

TWICE, HALF, QUARTER = 0.5, 2, 4

LESS_DRIFT = {
    "walk_m2_per_s": QUARTER,
    "assumed_walk_m2_per_s": QUARTER,
    "sources": {"mean": HALF, "drawn_sd": HALF, "assumed_sd": HALF, "wander_per_s": QUARTER},
}

# Each possible limit, its relief in words, and divisors of numbers of the inputs.  Where ranges
# double, slots keep their lengths: the speed of sound and the depth in them double too, and clock
# errors halve, so that they remain as many metres.
IMPROVED: tuple[tuple[str, str, Mapping[str, Any]], ...] = (
    (
        "coverage",
        "coverage: were HF and MF ranges twice as long",
        {
            "hf": {"range_m": TWICE, "step_m": TWICE},
            "mf": {"range_m": TWICE, "step_m": TWICE},
            "slots": {"sound_speed_m_per_s": TWICE, "deepest_m": TWICE},
            "systematic": {"clock_s": HALF},
        },
    ),
    (
        "uplink",
        "uplink slots: were they half as long",
        {
            "slots": {
                **dict.fromkeys(("ping_s", "turnaround_s", "uplink_guard_s"), HALF),
                **dict.fromkeys(("shortest_uplink_s", "fixed_uplink_s"), HALF),
                "sound_speed_m_per_s": TWICE,
            },
            "systematic": {"clock_s": HALF},
            "access": {"frame_s": HALF},
        },
    ),
    (
        "downlink",
        "downlink bits: were frames half as long",
        {"slots": {"downlink_s": HALF, "frame_s": HALF, "answer_s": HALF}},
    ),
    (
        "fix_noise",
        "fix noise: were it half as large",
        {
            "noise": dict.fromkeys(("along_m2", "across_m2", "down_m2", "leaning_m2"), QUARTER),
            "systematic": dict.fromkeys(
                ("misalignment_rad", "gnss_m", "sound_speed_share", "clock_s"), HALF
            ),
        },
    ),
    (
        "drift",
        "drift of dead reckoning: were it half as large",
        {
            "navigator": LESS_DRIFT, "others": LESS_DRIFT,
        },
    ),
)  # fmt: skip


def improved(whole: Any, divisors: Any) -> Any:
    """Return a record with some numbers divided, unless they are None; of a tuple each record."""
    if isinstance(whole, tuple):
        return tuple(improved(part, divisors) for part in whole)
    if isinstance(divisors, Mapping):
        parts = {name: improved(getattr(whole, name), own) for name, own in divisors.items()}
        return replace(whole, **parts)
    return None if whole is None else whole / divisors


class Relief(NamedTuple):
    """A limit that is twice as good, in words, with the goal's predicted value and its verdict."""

    what: str
    told: str
    value: float
    meets: bool


def binding(team: Team) -> list[Relief]:
    """Return what would help a team most, the most first; [] if nothing is predicted.

    It judges the goal without losses that is predicted to be farthest from being met.
    """
    pairs = zip(team.question.goals, team.values, strict=True)
    known = [
        (excess(goal, value), goal, value)
        for goal, value in pairs
        if value == value and not goal.lost
    ]
    if team.inputs is None or not known:
        return []
    far, goal, now = max(known, key=lambda pair: pair[0])
    found = []
    for what, words, divisors in IMPROVED:
        value = value_of(goal, predict(improved(team.inputs, divisors), team.predicted_from))
        if excess(goal, value) < far - NOTEWORTHY:
            values = f"{value_text(goal, value)} instead of {value_text(goal, now)}, as predicted"
            told = f"{words}: {goal.metric} {values}"
            found.append(Relief(what, told, value, excess(goal, value) < 0))
    return sorted(found, key=lambda relief: excess(goal, relief.value))


def foreseen(result: "Result") -> tuple[Foreseen, ...]:
    """Return the changes that are predicted to lower the worst AUV's mean error, the best first.

    () if the scenario cannot be predicted, has no ASV, or has too large a fleet.
    """
    if not 0 < result.scenario.auvs.count * result.scenario.asvs.count <= LARGEST:
        return ()
    try:
        now = _error(result.setup)
    except ValueError:
        return ()
    best: dict[str, Foreseen] = {}
    for change in proposals(result)[0]:
        with suppress(ValueError):  # it cannot be predicted
            scenario = changed(result.scenario, change.settings)
            assert scenario is not None  # since only valid changes are proposed
            then = _error(Setup.of(scenario))
            known = best.get(change.kind)
            if then < (1.0 - WORTHWHILE) * now and (known is None or then < known.then_m):
                best[change.kind] = Foreseen(change.words, change.lines, now, then)
    return tuple(sorted(best.values(), key=lambda predicted: predicted.then_m)[:MOST])


def _error(setup: Setup) -> float:
    return predict(inputs_of(setup), setup.stations_m).worst("position_error_m")
