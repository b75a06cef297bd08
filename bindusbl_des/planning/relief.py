"""What would help, as predicted: a team were one thing twice as good, a scenario by a change."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..advice.changes import changed, proposals
from ..results.effects import Foreseen
from ..setup import Setup
from .candidates import Candidate, Predictor, excess, value_of
from .prediction.gathering import inputs_of
from .prediction.inputs import Chances, Inputs, SystematicErrors
from .prediction.predicting import predict
from .selection.goals import Goal, value_text

if TYPE_CHECKING:
    from ..results.result import Result


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
    systematic = _clocks_as_before(inputs)
    as_before = replace(
        slots, sound_speed_m_per_s=2 * slots.sound_speed_m_per_s, deepest_m=2 * slots.deepest_m
    )
    hf, mf = _longer(inputs.hf), _longer(inputs.mf)
    return replace(inputs, hf=hf, mf=mf, slots=as_before, systematic=systematic)


def _clocks_as_before(inputs: Inputs) -> SystematicErrors:
    """Keep what clocks err by in metres where slots are reckoned with twice the speed of sound."""
    return replace(inputs.systematic, clock_s=inputs.systematic.clock_s / 2)


def _longer(band: Chances) -> Chances:
    return replace(band, range_m=2 * band.range_m, step_m=2 * band.step_m)


def _uplink(inputs: Inputs) -> Inputs:
    slots = inputs.slots
    fixed = slots.fixed_uplink_s
    return replace(
        inputs,
        slots=replace(
            slots,
            ping_s=slots.ping_s / 2,
            turnaround_s=slots.turnaround_s / 2,
            uplink_guard_s=slots.uplink_guard_s / 2,
            shortest_uplink_s=slots.shortest_uplink_s / 2,
            fixed_uplink_s=None if fixed is None else fixed / 2,
            sound_speed_m_per_s=2 * slots.sound_speed_m_per_s,
        ),
        systematic=_clocks_as_before(inputs),
        access=replace(inputs.access, frame_s=inputs.access.frame_s / 2),
    )


def _downlink(inputs: Inputs) -> Inputs:
    slots = inputs.slots
    halved = replace(
        slots,
        downlink_s=slots.downlink_s / 2,
        frame_s=slots.frame_s / 2,
        answer_s=slots.answer_s / 2,
    )
    return replace(inputs, slots=halved)


def _noise(inputs: Inputs) -> Inputs:
    noise, systematic = inputs.noise, inputs.systematic
    return replace(
        inputs,
        noise=replace(
            noise,
            along_m2=noise.along_m2 / 4,
            across_m2=noise.across_m2 / 4,
            down_m2=noise.down_m2 / 4,
            leaning_m2=noise.leaning_m2 / 4,
        ),
        systematic=replace(
            systematic,
            misalignment_rad=systematic.misalignment_rad / 2,
            gnss_m=systematic.gnss_m / 2,
            sound_speed_share=systematic.sound_speed_share / 2,
            clock_s=systematic.clock_s / 2,
        ),
    )


def _drift(inputs: Inputs) -> Inputs:
    navigator = inputs.navigator
    sources = tuple(
        replace(
            source,
            mean=_halved(source.mean),
            drawn_sd=_halved(source.drawn_sd),
            assumed_sd=_halved(source.assumed_sd),
            wander_per_s=source.wander_per_s / 4,
        )
        for source in navigator.sources
    )
    return replace(
        inputs,
        navigator=replace(
            navigator,
            sources=sources,
            walk_m2_per_s=navigator.walk_m2_per_s / 4,
            assumed_walk_m2_per_s=navigator.assumed_walk_m2_per_s / 4,
        ),
    )


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
