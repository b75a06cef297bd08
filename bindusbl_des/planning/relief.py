"""What would help, as predicted: a team were one thing twice as good, a scenario by a change."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from ..advice.changes import changed, proposals
from ..results.effects import Foreseen
from ..setup import Setup
from .candidates import Candidate, Predictor, excess, value_of
from .prediction.gathering import inputs_of
from .prediction.inputs import Chances, Inputs
from .prediction.predicting import predict
from .selection.goals import Goal, value_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from ..results.result import Result


Record = TypeVar("Record", bound="DataclassInstance")

# Less than this share of a value is no gain.
NOTEWORTHY = 0.01

# A reader compares a few, one of each kind; predictions are off by more than a smaller share.
MOST, WORTHWHILE = 5, 0.1

# A fleet with more pairs of an AUV and an ASV takes seconds to predict, with each change anew.
LARGEST = 3_000


@dataclass(frozen=True)
class Relief:
    """What would be twice as good: a goal's value as predicted then, and whether that meets it."""

    what: str
    value: float
    text: str
    meets: bool

    def record(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {"what": self.what, "told": self.text, "value": self.value}


def binding(candidate: Candidate, predictor: Predictor, goals: Sequence[Goal]) -> list[Relief]:
    """Return what would help a team most, the most first; nothing where it is not predicted.

    The goal that is the farthest from being met, as predicted, is what counts.
    """
    inputs, now = predictor.inputs(candidate.scenario), predictor.prediction(candidate)
    known = [goal for goal in goals if value_of(goal, now) == value_of(goal, now)]
    if inputs is None or not known:
        return []
    goal = max(known, key=lambda goal: excess(goal, value_of(goal, now)))
    found = list(_reliefs(inputs, candidate, goal, value_of(goal, now)))
    return sorted(found, key=lambda relief: excess(goal, relief.value))


def _reliefs(inputs: Inputs, candidate: Candidate, goal: Goal, now: float) -> Iterator[Relief]:
    for what, words, improved in IMPROVED:
        value = value_of(goal, predict(improved(inputs), candidate.stations))
        if excess(goal, value) < excess(goal, now) - NOTEWORTHY:
            values = f"{value_text(goal, value)} instead of {value_text(goal, now)}, as predicted"
            text = f"{words}: {goal.metric} {values}"
            yield Relief(what, value, text, excess(goal, value) < 0)


def _reach(inputs: Inputs) -> Inputs:
    """Double the ranges, and nothing of the slots that depend on them."""
    slots = inputs.slots
    # what clocks err by in metres, where slots are reckoned with twice the speed of sound
    systematic = _over(2, inputs.systematic, "clock_s")
    as_before = replace(
        slots, sound_speed_m_per_s=2 * slots.sound_speed_m_per_s, deepest_m=2 * slots.deepest_m
    )
    hf, mf = _longer(inputs.hf), _longer(inputs.mf)
    return replace(inputs, hf=hf, mf=mf, slots=as_before, systematic=systematic)


def _longer(band: Chances) -> Chances:
    return replace(band, range_m=2 * band.range_m, step_m=2 * band.step_m)


def _over(divisor: float, whole: Record, *names: str) -> Record:
    """Return a record in which some numbers, those that it has, are divided."""
    own = {name: getattr(whole, name) for name in names}
    return replace(whole, **{name: one / divisor for name, one in own.items() if one is not None})


def _uplink(inputs: Inputs) -> Inputs:
    times = "ping_s", "turnaround_s", "uplink_guard_s", "shortest_uplink_s", "fixed_uplink_s"
    slots = _over(2, inputs.slots, *times)
    return replace(
        inputs,
        slots=replace(slots, sound_speed_m_per_s=2 * slots.sound_speed_m_per_s),
        systematic=_over(2, inputs.systematic, "clock_s"),
        access=_over(2, inputs.access, "frame_s"),
    )


def _downlink(inputs: Inputs) -> Inputs:
    return replace(inputs, slots=_over(2, inputs.slots, "downlink_s", "frame_s", "answer_s"))


def _noise(inputs: Inputs) -> Inputs:
    variances = "along_m2", "across_m2", "down_m2", "leaning_m2"
    lasting = "misalignment_rad", "gnss_m", "sound_speed_share", "clock_s"
    return replace(
        inputs,
        noise=_over(4, inputs.noise, *variances),
        systematic=_over(2, inputs.systematic, *lasting),
    )


def _drift(inputs: Inputs) -> Inputs:
    sources = tuple(
        replace(
            _over(4, source, "wander_per_s"),
            mean=_halved(source.mean),
            drawn_sd=_halved(source.drawn_sd),
            assumed_sd=_halved(source.assumed_sd),
        )
        for source in inputs.navigator.sources
    )
    navigator = _over(4, inputs.navigator, "walk_m2_per_s", "assumed_walk_m2_per_s")
    return replace(inputs, navigator=replace(navigator, sources=sources))


def _halved(pair: tuple[float, float]) -> tuple[float, float]:
    return pair[0] / 2, pair[1] / 2


# What may bind, how its relief is told, and the inputs with it.
IMPROVED: tuple[tuple[str, str, Callable[[Inputs], Inputs]], ...] = (
    ("coverage", "coverage: were HF and MF ranges twice as long", _reach),
    ("uplink", "uplink slots: were they half as long", _uplink),
    ("downlink", "downlink bits: were frames half as long", _downlink),
    ("fix_noise", "fix noise: were it half as large", _noise),
    ("drift", "drift of dead reckoning: were it half as large", _drift),
)


def foreseen(result: "Result") -> tuple[Foreseen, ...]:
    """Return what is predicted to lower the worst AUV's mean error, the best first.

    Nothing where the scenario cannot be predicted, or its fleet is too large.
    """
    if result.scenario.auvs.count * result.scenario.asvs.count > LARGEST:
        return ()
    try:
        now = _error(result.setup)
    except ValueError:
        return ()
    best: dict[str, Foreseen] = {}
    for change in proposals(result)[0]:
        with suppress(ValueError):  # it cannot be predicted
            scenario = changed(result.scenario, change.settings)
            assert scenario is not None  # as it was proposed
            then = _error(Setup.of(scenario))
            known = best.get(change.kind)
            if then < (1.0 - WORTHWHILE) * now and (known is None or then < known.then_m):
                best[change.kind] = Foreseen(change.words, change.lines, now, then)
    return tuple(sorted(best.values(), key=lambda predicted: predicted.then_m)[:MOST])


def _error(setup: Setup) -> float:
    return predict(inputs_of(setup), setup.stations_m).worst("position_error_m")
