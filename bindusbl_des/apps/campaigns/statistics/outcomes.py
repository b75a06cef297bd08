"""Metrics of a campaign by point and seed, of missions and of AUVs, which may lack a value."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pyarrow as pa

from ....core.records.events import NONE
from ....core.records.metrics import METRICS_ARE, WORST, WORST_IS_LARGEST, AuvMetrics, of_an_auv
from ....core.results.columns import numpy_columns
from ....core.results.schemas import mission_numbers, schema
from ....support.arrays import Flags, Floats, Ints
from ....support.facts import cached_property
from ....support.wording import did_you_mean, printable
from ..experiments.experiment import ExperimentPlan
from ..storage.folder import CampaignError
from ..storage.part_rows import read_table
from ..storage.parts import MISSIONS, OK, coded, has_status
from .intervals import Intervals, intervals

# What a mission is for, first; what the network did for it, after.  A mission is as good as what
# its worst AUV got (interface: a plan is judged by it, averaged over seeds).
JUDGED = (
    "worst_position_error_m",
    "worst_position_error_p95_m",
    "worst_fix_age_p95_s",
    "worst_hf_coverage",
    "worst_latency_mean_s",
)
# The same of the fleet's means, in which an AUV that got little is hidden by those that got much.
MEANS = tuple(map(of_an_auv, JUDGED))

# What an AUV without a value did not get, by the beginning of the metric
LACKING = {
    "interval": "got fewer than two fixes",
    "latency": "got no fix",
    "fix_error": "was never located",
    "hf_coverage": "sent no ping that landed",
}


# Values of metrics that are in memory at a time: few metrics of many missions, or all of few
MOST_VALUES = 4_000_000

# So much of an error a sentence has.
MOST_LETTERS = 300


@cache
def may_be_missing(metric: str) -> bool:
    """Tell whether an AUV without fixes has no value of a metric.

    >>> may_be_missing("worst_latency_mean_s"), may_be_missing("position_error_m")
    (True, False)
    """
    if of_an_auv(metric) not in WORST_IS_LARGEST:
        return False
    return type(None) in get_args(get_type_hints(AuvMetrics)[of_an_auv(metric)])


def lacking(metric: str) -> str:
    """Return the words for an AUV without a value of a metric.

    >>> lacking("worst_interval_max_s"), lacking("path_error_m")
    ('got fewer than two fixes', 'had no path_error_m')
    """
    own = of_an_auv(metric)
    return next((said for name, said in LACKING.items() if own.startswith(name)), f"had no {own}")


@dataclass(frozen=True)
class Means(Intervals):
    """The means of a metric at each point, and numbers of missions.

    Of those that went `well`, the `whole` ones have a value for every AUV.
    """

    whole: Ints
    well: Ints

    def gap(self, point: int) -> str:
        """Return the numbers of whole and of all missions of a point; "" if all are whole."""
        whole, well = self.whole[point], self.well[point]
        return f"{whole}/{well}" if whole < well else ""


@dataclass(frozen=True)
class MissionOutcomes:
    """The missions with a row, in the order of the plan; a metric without a value is nan.

    `unserved` maps metrics to missions in which an AUV has none: the worst AUV's metric is nan
    there, the fleet's mean leaves that AUV out.  `worst` maps worst-AUV metrics to the number of
    that AUV in each mission, or NONE.
    """

    points: int
    mission: Ints
    point: Ints
    seed: Ints
    ok: Flags
    metrics: Mapping[str, Floats]
    unserved: Mapping[str, Flags] = field(default_factory=dict)
    worst: Mapping[str, Ints] = field(default_factory=dict)

    def at(self, point: int, metric: str) -> tuple[Ints, Floats]:
        """Return the seeds and the metric of a point's successful missions."""
        rows = self._rows(point)
        well = self.ok[rows]
        return self.seed[rows][well], self.metrics[metric][rows][well]

    def unserved_at(self, point: int, metric: str) -> Flags:
        """Tell in which successful missions of a point an AUV has no value."""
        rows = self._rows(point)
        well = self.ok[rows]
        without = self.unserved.get(metric)
        return np.zeros(int(well.sum()), bool) if without is None else without[rows][well]

    def who(self, point: int, metric: str, seeds: Ints | None = None) -> Counter[str]:
        """Return how often each AUV was the worst by a metric at a point, most often first."""
        rows = self._rows(point)
        if metric not in self.worst:
            return Counter()
        here = self.ok[rows]
        if seeds is not None:
            here = here & np.isin(self.seed[rows], seeds)
        auvs = self.worst[metric][rows][here]
        times = np.bincount(auvs[auvs != NONE])
        most = np.argsort(-times, kind="stable")
        return Counter({f"AUV{auv}": int(times[auv]) for auv in most.tolist() if times[auv]})

    def by_seed(self, metric: str) -> Floats:
        """Return a metric (points, seeds) over all seeds, nan without a value."""
        seeds, column = self._columns
        table = np.full((self.points, max(seeds, 1)), np.nan)
        table[self.point[self.ok], column[self.ok]] = self.metrics[metric][self.ok]
        return table

    @cached_property
    def _columns(self) -> tuple[int, Ints]:
        """The number of different seeds, and each mission's index among the sorted seeds."""
        seeds, column = np.unique(self.seed, return_inverse=True)
        return len(seeds), column

    def means(self, metric: str) -> Means:
        """Return the means of a metric at each point, with numbers of missions."""
        known = intervals(self.by_seed(metric))
        without = np.asarray(self.unserved.get(metric, False))
        has = self.ok & ~np.isnan(self.metrics[metric]) & ~without
        whole = np.bincount(self.point[has], minlength=self.points)
        return Means(known.mean, known.half_width, known.error, known.count, whole, self.well)

    @cached_property
    def well(self) -> Ints:
        """The number of successful missions (points,)."""
        return np.bincount(self.point[self.ok], minlength=self.points)

    @cached_property
    def ran(self) -> Ints:
        """The number of missions with a row (points,)."""
        return np.bincount(self.point, minlength=self.points)

    def seeds(self, point: int) -> set[int]:
        """Return the seeds of a point that have a row."""
        return set(self.seed[self._rows(point)].tolist())

    def failed(self, point: int) -> int:
        """Return how many missions of a point failed."""
        return int(self.ran[point] - self.well[point])

    def _rows(self, point: int) -> slice:
        first, end = np.searchsorted(self.point, (point, point + 1))
        return slice(first, end)


def outcomes(folder: Path, metrics: Sequence[str], points: int) -> MissionOutcomes:
    """Read metrics of all missions of a campaign that have a row.

    Raises:
        CampaignError: when an older version did not record one of them.
    """
    metrics = list(dict.fromkeys(metrics))
    lacking = [name for name in metrics if may_be_missing(name)]
    worst = [name for name in metrics if name.startswith(WORST)]
    served = [f"{WORST}{of_an_auv(name)}" for name in lacking]
    named = [f"{name}_auv" for name in (*worst, *served)]
    wanted = list(dict.fromkeys([*metrics, *served, *named]))
    rows = read_table(folder, MISSIONS, ("point", "seed", "status", *wanted))
    if rows is None:
        none = np.zeros(0, np.int64)
        values = {name: np.zeros(0) for name in metrics}
        return MissionOutcomes(points, none, none, none, none == 0, values)
    check_recorded(folder, rows, wanted)
    who = {name: auv_numbers(rows[name]) for name in named}
    found = numpy_columns(rows.drop_columns(["status", *who]))
    return MissionOutcomes(
        points,
        **{name: found[name] for name in ("mission", "point", "seed")},
        ok=has_status(rows, OK),
        metrics={name: found[name].astype(float, copy=False) for name in metrics},
        unserved={
            name: _unserved(found[own], who[f"{own}_auv"])
            for name, own in zip(lacking, served, strict=True)
        },
        worst={name: who[f"{name}_auv"] for name in worst},
    )


def _unserved(worst: Floats, who: Ints) -> Flags:
    """Tell of each mission whether an AUV has no value; it is named if it could have one."""
    unserved: Flags = (who != NONE) & np.isnan(worst)
    return unserved


def auv_numbers(names: pa.ChunkedArray) -> Ints:
    """Return the numbers of AUVs from a column of names; NONE for a missing name."""
    places, words = coded(names)
    numbers = [NONE if name is None else int(name.removeprefix("AUV")) for name in words]
    found: Ints = np.array(numbers, np.int64)[places]
    return found


def metric_by_metric(
    folder: Path, metrics: Sequence[str], plan: ExperimentPlan
) -> Iterator[tuple[str, MissionOutcomes]]:
    """Yield each metric with outcomes that hold it, so that few metrics are in memory at a time.

    Raises:
        CampaignError: as :func:`outcomes`.
    """
    at_a_time = max(1, MOST_VALUES // len(plan))
    for begin in range(0, len(metrics), at_a_time):
        names = metrics[begin : begin + at_a_time]
        found = outcomes(folder, names, len(plan.points))
        yield from ((name, found) for name in names)


def failed_because(folder: Path) -> str:
    """Return the most frequent error of failed missions, as words after their number; or ""."""
    rows = read_table(folder, MISSIONS, ("error",))
    if rows is None or rows["error"].null_count == len(rows):
        return ""
    places, errors = coded(rows["error"])
    times = np.bincount(places, minlength=len(errors))[:-1]  # without those that have none
    most = int(np.argmax(times))
    said = printable(str(errors[most]))
    said = said if len(said) <= MOST_LETTERS else f"{said[:MOST_LETTERS]}..."
    which = f", {times[most]} of them" if times[most] < times.sum() else ""
    return f"{which}: {said.removesuffix('.')}"


def check_recorded(folder: Path, rows: pa.Table, names: Sequence[str]) -> None:
    """Refuse rows that lack columns.

    Raises:
        CampaignError: saying which, and what to do.
    """
    absent = [name for name in names if name not in rows.schema.names]
    if absent:
        raise CampaignError(
            f"{folder}: was run by an older version, which did not record {absent[0]}; sweep it "
            "again into another folder (--out)"
        )


def check_metrics(names: Sequence[str]) -> None:
    """Refuse metrics that missions do not have.

    Raises:
        ValueError: naming the nearest one, or all.
    """
    known = mission_numbers()
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known) or METRICS_ARE
            raise ValueError(f"no metric {name!r}{hint}")


def unit(metric: str) -> str:
    """Return the unit of a metric, "1" where it is a count or a share.

    >>> unit("position_error_m"), unit("hf_coverage")
    ('m', '1')
    """
    named: bytes = schema("mission").field(metric).metadata[b"unit"]
    return named.decode()


@dataclass(frozen=True)
class Fleets:
    """A row for each AUV of each successful mission: its point, seed, number and metrics.

    A metric without a value is nan.
    """

    point: Ints
    seed: Ints
    auv: Ints
    metrics: Mapping[str, Floats]

    def by_seed(self, metric: str) -> tuple[list[tuple[int, int]], Floats]:
        """Return point and number of every AUV, and their metric (AUVs, seeds), nan if missing."""
        who, row, seeds, column = self._cells
        table = np.full((len(who), seeds), np.nan)
        table[row, column] = self.metrics[metric]
        return who, table

    @cached_property
    def _cells(self) -> tuple[list[tuple[int, int]], Ints, int, Ints]:
        """Point and number of every AUV, which of them each row is of; the same of seeds."""
        auvs = int(self.auv.max(initial=0)) + 1
        who, row = np.unique(self.point * auvs + self.auv, return_inverse=True)
        seeds, column = np.unique(self.seed, return_inverse=True)
        return [divmod(number, auvs) for number in who.tolist()], row, len(seeds), column

    def without(self, point: int, metric: str, seeds: Ints) -> dict[str, int]:
        """Return how many missions of a point leave each AUV without a value, most first."""
        here = (self.point == point) & np.isin(self.seed, seeds)
        return _counted(self.auv[here & np.isnan(self.metrics[metric])])


@dataclass(frozen=True)
class Starved:
    """AUVs without any fix at a point, each with the number of such missions."""

    point: int
    missions: int
    auvs: Mapping[str, int]


def fleets(folder: Path, metrics: Sequence[str]) -> Fleets:
    """Read metrics of all AUVs of a campaign's successful missions.

    Raises:
        CampaignError: when an older version did not record one of them.
    """
    rows = read_table(folder, "auvs", ("point", "seed", "auv", *metrics))
    if rows is None:
        none = np.zeros(0, np.int64)
        return Fleets(none, none, none, {name: np.zeros(0) for name in metrics})
    check_recorded(folder, rows, metrics)
    columns = numpy_columns(rows.drop_columns("auv"))
    return Fleets(
        columns["point"],
        columns["seed"],
        auv_numbers(rows["auv"]),
        {name: columns[name].astype(float, copy=False) for name in metrics},
    )


def starved(found: Fleets) -> list[Starved]:
    """Return the points at which an AUV got no fix in some mission, most missions first."""
    none = found.metrics["fixes_delivered"] == 0
    well = np.bincount(found.point[found.auv == 0])  # every mission has that AUV
    order = np.argsort(found.point[none], kind="stable")
    points, starts = np.unique(found.point[none][order], return_index=True)
    auvs = np.split(found.auv[none][order], starts)[1:]
    at = [
        Starved(point, int(well[point]), _counted(who))
        for point, who in zip(points.tolist(), auvs, strict=True)
    ]
    return sorted(
        at, key=lambda unserved: (-max(unserved.auvs.values()) / unserved.missions, unserved.point)
    )


def _counted(auvs: Ints) -> dict[str, int]:
    numbers, counts = np.unique(auvs, return_counts=True)
    found = {f"AUV{n}": int(c) for n, c in zip(numbers, counts, strict=True)}
    return dict(sorted(found.items(), key=lambda item: -item[1]))
