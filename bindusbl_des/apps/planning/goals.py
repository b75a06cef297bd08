"""Goals of a plan: a metric of each mission's worst AUV, or of others, with a limit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import ceil, isfinite
from typing import Any, Literal

import numpy as np

from ...core.records.metrics import (
    LESS_IS_BETTER,
    METRICS_ARE,
    WORST,
    AuvMetrics,
    Utilisation,
    unit_of,
)
from ...support.arrays import Floats
from ...support.wording import described, did_you_mean, plain, refuse, significant

Of = float | Literal["worst", "mean"]

OF_AUVS = tuple(field.name for field in fields(AuvMetrics) if field.name != "auv")
# Metrics of whole missions alone; collisions are also an AUV's metric, which is the one meant.
OF_MISSIONS = tuple(field.name for field in fields(Utilisation) if field.name not in OF_AUVS)

KEYS = ("metric", "below", "above", "of", "lost")

# The most vessels that may be lost at once.
MOST_LOST = 20


@dataclass(frozen=True)
class Goal:
    """A metric of the tables `auvs` or `mission` that should stay `below` or `above` a limit.

    `of` selects the AUV that is judged: the "worst", the "mean" of all, or the worst within a share
    of the AUVs (0.9: of the best nine in ten).  A metric of the whole mission
    (`area_covered_share`) is judged itself.  With `lost` the goal must hold with any so many
    vessels lost, from the start or from halfway: missions are simulated with each loss, and the
    worst counts.

    Raises:
        ValueError: when there is no such metric, not just one limit, or a limit on the wrong side.
    """

    metric: str
    below: float | None = None
    above: float | None = None
    of: Of = "worst"
    lost: int = 0

    def __post_init__(self) -> None:
        known = (*OF_AUVS, *OF_MISSIONS)
        if self.metric not in known:
            asked = self.metric.removeprefix(WORST)
            # of several similar names, suggest the metric that plans mostly use
            hint = did_you_mean(asked, ("position_error_m", *known))
            hint = hint or METRICS_ARE
            raise ValueError(f"no metric {self.metric!r}{hint}")
        if (self.below is None) == (self.above is None):
            both = "neither" if self.below is None else "both"
            raise ValueError(f"{self.metric}: needs either below or above; got {both}")
        if not isfinite(self.limit):
            refuse(self.metric, plain(self.limit), "be a number", "give one in its unit")
        if self.below is not None and self.below < 0:
            rule = "be 0 or more where it is an upper limit"
            refuse(self.metric, plain(self.below), rule, "ask for one that a mission can keep")
        less = LESS_IS_BETTER.get(self.metric)
        if less is not None and less != self.is_below:
            better, right = ("less", "below") if less else ("more", "above")
            raise ValueError(
                f"{self.metric}: {better} of it is better; ask for {right} {plain(self.limit)}"
            )
        if isinstance(self.lost, bool) or not 0 <= self.lost <= MOST_LOST:
            rule, remedy = f"be 0 to {MOST_LOST} vessels", "leave it out where none is lost"
            refuse(f"{self.metric}: lost", plain(self.lost), rule, remedy)
        if isinstance(self.of, str):
            if self.of not in ("worst", "mean"):
                self._refuse_of()
        elif not 0 < self.of <= 1:
            self._refuse_of()

    def _refuse_of(self) -> None:
        rule = "be worst, mean, or a share of the AUVs in (0, 1]"
        refuse(f"{self.metric}: of", plain(self.of), rule, "leave it out to judge the worst AUV")

    @property
    def is_below(self) -> bool:
        """Whether the limit is an upper one."""
        return self.below is not None

    @property
    def limit(self) -> float:
        """The upper or lower limit, in the metric's unit."""
        limit = self.below if self.below is not None else self.above
        assert limit is not None
        return limit

    @property
    def is_of_auvs(self) -> bool:
        """Whether the metric is a column of table `auvs`."""
        return self.metric in OF_AUVS

    def of_fleets(self, values: Floats) -> Floats:
        """Return the goal's value (k,) of k missions from the metric of their n AUVs (k, n).

        An AUV without a value (nan) counts as the worst; the result is then nan, unless the judged
        share excludes that AUV.
        """
        if self.of == "mean":
            return np.asarray(values.mean(axis=1), np.float64)
        sign = 1.0 if self.is_below else -1.0
        share = 1.0 if isinstance(self.of, str) else self.of
        best_first = np.sort(sign * values, axis=1)  # nan comes last
        last = ceil(round(share * values.shape[1], 9)) - 1
        return np.asarray(sign * best_first[:, last], np.float64)

    def record(self) -> dict[str, Any]:
        """Return the goal as in files: metric, below or above, of, and lost if any."""
        side = "below" if self.is_below else "above"
        lost = {"lost": self.lost} if self.lost else {}
        return {"metric": self.metric, side: self.limit, "of": self.of, **lost}

    @property
    def name(self) -> str:
        """The metric, with the number of lost vessels if any.

        >>> Goal("position_error_m", below=2.0, lost=1).name
        'position_error_m with any ASV lost'
        """
        which = "ASV" if self.lost == 1 else f"{self.lost} ASVs"
        return f"{self.metric} with any {which} lost" if self.lost else self.metric

    def __str__(self) -> str:
        """Return the goal in words.

        >>> str(Goal("hf_coverage", above=0.9, of=0.5))
        'hf_coverage of 50 % of the AUVs at least 0.9'
        """
        whose = ""
        if self.is_of_auvs:
            of = self.of if isinstance(self.of, str) else f"{plain(round(100 * self.of, 6))} %"
            named = {"worst": "the worst AUV", "mean": "all AUVs in the mean"}
            whose = f" of {named.get(of, f'{of} of the AUVs')}"
        bound = "at most" if self.is_below else "at least"
        losing = self.name.removeprefix(self.metric)
        return f"{self.metric}{whose}{losing} {bound} {plain(self.limit)}"


def goal_of(written: str, is_below: bool = True, of: Of = "worst") -> Goal:
    """Return the goal written METRIC=VALUE, as on the command line.

    >>> goal_of("position_error_p95_m=1")
    Goal(metric='position_error_p95_m', below=1.0, above=None, of='worst', lost=0)

    Raises:
        ValueError: when the text has another form, or is no goal.
    """
    metric, equals, value = (part.strip() for part in written.partition("="))
    try:
        limit = float(value)
    except ValueError:
        equals = ""
    if not equals:
        raise ValueError(
            f"{written!r}: needs METRIC=VALUE, such as position_error_p95_m=1"
        ) from None
    return Goal(metric, limit if is_below else None, None if is_below else limit, of)


def goals_in(written: object) -> tuple[Goal, ...]:
    """Return the goals of a plan's file: one mapping of metric, below or above, and of; or a list.

    >>> goals_in({"metric": "hf_coverage", "above": 0.9, "of": "mean"})
    (Goal(metric='hf_coverage', below=None, above=0.9, of='mean', lost=0),)

    Raises:
        ValueError: when one is no goal; it names the key.
    """
    if isinstance(written, list) and written:
        return tuple(goal_in(goal, f"goal[{n}]") for n, goal in enumerate(written))
    return (goal_in(written),)


def goal_in(written: object, where: str = "goal") -> Goal:
    """Return the goal of one mapping; errors begin with `where`, its place in the file.

    Raises:
        ValueError: when the mapping is no goal.
    """
    if not isinstance(written, Mapping):
        example = "such as {metric: position_error_p95_m, below: 1}"
        raise ValueError(f"{where}: needs keys and values, {example}; got {described(written)}")
    for key in written:
        if key not in KEYS:
            hint = did_you_mean(str(key), KEYS) or f"; there are {', '.join(KEYS)}"
            raise ValueError(f"{where}: no key {key!r}{hint}")
    if not isinstance(written.get("metric"), str):
        raise ValueError(f"{where}.metric: needs the name of a metric; it is {described(None)}")
    for key in ("below", "above"):
        value = written.get(key)
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise ValueError(f"{where}.{key}: needs a number; got {described(value)}")
    of = written.get("of", "worst")
    if isinstance(of, bool) or not isinstance(of, str | int | float):
        raise ValueError(f"{where}.of: needs worst, mean or a share; got {described(of)}")
    lost = written.get("lost", 0)
    if isinstance(lost, bool) or not isinstance(lost, int):
        raise ValueError(f"{where}.lost: needs a number of lost vessels; got {described(lost)}")
    limits = {key: None if written.get(key) is None else float(written[key]) for key in KEYS[1:3]}
    below, above = limits["below"], limits["above"]
    try:
        return Goal(written["metric"], below, above, of, lost)  # type: ignore[arg-type]  # words refused there
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def limits_text(goals: Sequence[Goal]) -> str:
    """Return the goals in words.

    >>> limits_text([Goal("position_error_p95_m", below=1.0)])
    'position_error_p95_m of the worst AUV at most 1 m'
    """
    return " and ".join(f"{goal} {unit_of_goal(goal)}".strip() for goal in goals)


def unit_of_goal(goal: Goal) -> str:
    """Return the unit of a goal's metric; "" for shares and counts."""
    return "" if unit_of(goal.metric) in ("share", "count") else unit_of(goal.metric)


def value_text(goal: Goal, value: float) -> str:
    """Return a value of a goal's metric with its unit.

    >>> value_text(Goal("position_error_p95_m", below=1.0), 0.84123)
    '0.841 m'
    """
    return f"{significant(value)} {unit_of_goal(goal)}".strip()
