"""Measured effects of changes to a plan, as plain data in reports and files.

An effect is a mean of differences between missions with a change and missions without it, paired by
seed, so that both had the same noise; with its confidence interval.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from shlex import quote
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from ...support.wording import decimals, number

HELPS, NEGLIGIBLE, NO_EFFECT, HARMS = "helps", "negligible", "no measurable effect", "harms"

# Messages name at most this many AUVs.
MOST_NAMED = 3
# Harm by fixes in a single mission is reported if it exceeds this share of the error without them.
NOTEWORTHY = 0.1

# Bound of numbers in a file, in any unit.
BEYOND_MEASURE = 1e100
Number = Annotated[float, Field(gt=-BEYOND_MEASURE, lt=BEYOND_MEASURE)]
Count = Annotated[int, Field(ge=0, lt=10**100)]

GAIN, FILTER = "gain", "filter"
REAL_REMEDY = (
    "The real remedy is a filter that weighs each fix by its covariance, as navigation.filter "
    "kalman does; a fixed gain trusts a poor fix as much as a good one."
)


def _options(settings: Sequence[str]) -> list[str]:
    return [f"--set {quote(setting)}" for setting in settings]


@dataclass(frozen=True)
class Effect:
    """The effect of a change on the worst AUV's mean position error (m); negative: the error falls.

    `settings` are the arguments of `--set`.  The true mean lies from `low_m` to `high_m`.
    """

    kind: str
    words: str
    settings: tuple[str, ...]
    mean_m: Number
    low_m: Number
    high_m: Number
    seeds: Count
    verdict: str

    @property
    def options(self) -> list[str]:
        """The options to copy, one `--set` each."""
        return _options(self.settings)


@dataclass(frozen=True)
class Harm:
    """An AUV that fixes harm: they raise its error by `mean_m` (m).

    `with_m` and `without_m` are its mean errors over `seeds` missions.
    """

    auv: str
    with_m: Number
    without_m: Number
    mean_m: Number
    low_m: Number
    high_m: Number
    seeds: Count


@dataclass(frozen=True)
class Foreseen:
    """The predicted effect of a change, where no mission could be flown: the worst AUV's mean error
    (m) without it (`now_m`) and with it (`then_m`).  `settings` are the arguments of `--set`.
    """

    words: str
    settings: tuple[str, ...]
    now_m: Number
    then_m: Number

    @property
    def options(self) -> list[str]:
        """The options to copy, one `--set` each."""
        return _options(self.settings)


@dataclass(frozen=True)
class Advice:
    """Changes to a mission that were tried, and their effects.

    The budget was `budget_missions` missions in `budget_s` (None: no limit); `is_cut` says whether
    that time ended the trials. `error_m` is the worst AUV's mean error of the unchanged plan, over
    the seeds of the effects. `effects` are ranked, the best first.  `harms` rest on `harm_seeds`
    missions, 0 where there were too few.  Changes without a result are named in words: `inert` left
    the worst AUV's error unchanged in the first trial, `needless` would have (each with its
    reason), `dropped` promised less than others in the first trials, `untried` were beyond the
    budget.  `shortage` says why nothing was measured; `foreseen` are then predictions, the best
    first. `fixed_gain` says whether the plan's filter has a fixed gain.
    """

    budget_missions: Count
    budget_s: Number | None = None
    is_cut: bool = False
    missions: Count = 0
    error_m: Number | None = None
    effects: tuple[Effect, ...] = ()
    harms: tuple[Harm, ...] = ()
    harm_seeds: Count = 0
    inert: tuple[str, ...] = ()
    needless: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    untried: tuple[str, ...] = ()
    shortage: str = ""
    fixed_gain: bool = True
    foreseen: tuple[Foreseen, ...] = ()

    def of(self, *verdicts: str) -> list[Effect]:
        """Return the effects with one of these verdicts, in their order."""
        return [effect for effect in self.effects if effect.verdict in verdicts]


# An interval narrower than this (m) is shown with three decimals or more, to tell its ends apart.
NARROW_M = 0.1


def interval(effect: Effect | Harm) -> str:
    """Return an effect with its confidence interval, in words.

    >>> interval(Effect("gain", "", (), -0.4, -0.5, -0.3, 8, HELPS))
    '-0.40 m [-0.50, -0.30]'
    >>> interval(Effect("gain", "", (), -0.015, -0.018, -0.012, 8, HELPS))
    '-0.015 m [-0.018, -0.012]'
    """
    width = effect.high_m - effect.low_m
    digits = max(2 if width >= NARROW_M else 3, decimals(width / 2, digits=1))
    mean, low, high = (
        f"{metres:+.{digits}f}" for metres in (effect.mean_m, effect.low_m, effect.high_m)
    )
    return f"{mean} m [{low}, {high}]"


def harm_text(auvs: Sequence[Mapping[str, Any]], advice: Advice | None) -> list[str]:
    """Return sentences about AUVs that navigate worse with fixes than without, if any.

    `auvs` are the metrics of each AUV.  One mission may be chance: missions with other seeds decide
    where they were flown; else the text says that none were.
    """
    if advice is None or not advice.harm_seeds:
        return _harm_of_one_mission(auvs)
    if not advice.harms:
        return []
    here = {str(row["auv"]): (row["position_error_m"], row["imu_error_m"]) for row in auvs}
    first, *others = advice.harms
    text = [f"Fixes make {_worse(first, here)}{_tried(advice)}."]
    if others:
        named = "; ".join(_worse(other, here) for other in others[:MOST_NAMED])
        more = len(others) - MOST_NAMED
        text.append(f"They also make {named}" + (f"; and {more} more AUVs." if more > 0 else "."))
    text.append(
        f"Over {first.seeds} missions with other seeds {first.auv} had {number(first.with_m)} m "
        f"with fixes and {number(first.without_m)} m without: {interval(first)}."
    )
    return [*text, REAL_REMEDY] if advice.fixed_gain else text


def _worse(harm: Harm, here: Mapping[str, tuple[float, float]]) -> str:
    """Return an AUV's errors with and without fixes; means if luck hid the harm in this mission."""
    errors = here[harm.auv]
    if errors[0] > errors[1]:
        return _with_and_without(harm.auv, errors)
    text = _with_and_without(harm.auv, (harm.with_m, harm.without_m))
    return f"{text}, on average (in this mission {number(errors[0])} and {number(errors[1])} m)"


def _with_and_without(auv: str, errors: tuple[float, float]) -> str:
    return f"{auv} worse: {number(errors[0])} m with, {number(errors[1])} m without"


def _tried(advice: Advice) -> str:
    """Return the gain and the filter that measurably lowered the worst AUV's error, in words."""
    best = {effect.kind: effect for effect in advice.of(HELPS)}
    named = [
        f"{best[kind].settings[0].replace('=', ' ')} ({interval(best[kind])})"
        for kind in (GAIN, FILTER)
        if kind in best
    ]
    if not named:
        return ""
    return f"; try {', or '.join(named)}; in brackets the change of the worst AUV's error"


def _harm_of_one_mission(auvs: Sequence[Mapping[str, Any]]) -> list[str]:
    worse = sorted(
        (auv for auv in auvs if auv.get("fix_benefit_m", 0.0) < -NOTEWORTHY * auv["imu_error_m"]),
        key=lambda row: float(row["fix_benefit_m"]),
    )
    if not worse:
        return []
    named = "; ".join(
        _with_and_without(row["auv"], (row["position_error_m"], row["imu_error_m"]))
        for row in worse[:MOST_NAMED]
    )
    return [
        f"In this mission fixes made {named}. It may be chance: other seeds, which would tell, "
        "were not tried (--advice)."
    ]


def from_data(data: Any) -> Advice:
    """Return the advice in the data of a file.

    Raises:
        ValueError: when it is no advice, naming the first key that is wrong.
    """
    if not isinstance(data, Mapping):
        raise ValueError("advice holds no keys")
    data = {"foreseen": [], **data}  # an older folder has no predictions
    for field in fields(Advice):
        if field.name not in data:
            raise ValueError(f"advice: {field.name} is missing")
    try:
        advice = TypeAdapter(Advice).validate_json(json.dumps(data), strict=True)
    except ValidationError as error:
        raise ValueError(_wrong(error.errors()[0])) from None
    if any(effect.kind in (GAIN, FILTER) and not effect.settings for effect in advice.effects):
        raise ValueError("effects: settings of a gain or filter is empty")
    if advice.of(HELPS) and advice.error_m is None:
        raise ValueError("advice: error_m is null beside effects")
    return advice


def _wrong(error: Mapping[str, Any]) -> str:
    """Return which key of the advice, its effects, harms or predictions is wrong."""
    first, *further = (step for step in error["loc"] if isinstance(step, str))
    if error["type"] == "dataclass_type":
        return f"{first} holds no keys"
    place = f"{first}: {further[0]}" if further else f"advice: {first}"
    return f"{place} is {'missing' if error['type'] == 'missing' else 'not what it should be'}"
