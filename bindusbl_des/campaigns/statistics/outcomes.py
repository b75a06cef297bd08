"""What the missions of a campaign came to: metrics by point and seed."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ...core.wording import did_you_mean
from ...records.metrics import WORST
from ...records.rows import NONE
from ...results.arrow import numpy_array, numpy_columns
from ...results.schemas import mission_numbers
from ..storage.folder import CampaignError
from ..storage.parts import MISSIONS, OK, metric_schema, read_table
from .intervals import Floats
from .judging import may_be_missing, of_an_auv

Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Outcomes:
    """Missions that have a row, in the order of the plan; a metric that has no value is nan.

    `unserved` tells of metrics in which missions some AUV has none: the worst AUV's metric is nan
    there, the fleet's mean leaves that AUV out.  `worst` is the number of the worst AUV of each
    mission, NONE where none is, by the metrics that are the worst AUV's.
    """

    mission: Whole
    point: Whole
    seed: Whole
    ok: Flags
    metrics: Mapping[str, Floats]
    unserved: Mapping[str, Flags] = field(default_factory=dict)
    worst: Mapping[str, Whole] = field(default_factory=dict)

    def at(self, point: int, metric: str) -> tuple[Whole, Floats]:
        """Return the seeds of the missions of a point that went well, and their metric."""
        rows = self._rows(point)
        well = self.ok[rows]
        return self.seed[rows][well], self.metrics[metric][rows][well]

    def unserved_at(self, point: int, metric: str) -> Flags:
        """Tell of the missions of a point that went well in which some AUV has no value."""
        rows = self._rows(point)
        well = self.ok[rows]
        without = self.unserved.get(metric)
        return np.zeros(int(well.sum()), bool) if without is None else without[rows][well]

    def who(self, point: int, metric: str) -> Counter[str]:
        """Return in how many missions of a point each AUV was the worst by a metric, most first."""
        rows = self._rows(point)
        if metric not in self.worst:
            return Counter()
        auvs = self.worst[metric][rows][self.ok[rows]]
        times = np.bincount(auvs[auvs != NONE])
        most = np.argsort(-times, kind="stable")
        return Counter({f"AUV{auv}": int(times[auv]) for auv in most.tolist() if times[auv]})

    def by_seed(self, metric: str, points: int) -> Floats:
        """Return a metric (points, seeds) over all seeds that occur, nan where it has no value."""
        seeds, column = np.unique(self.seed, return_inverse=True)
        table = np.full((points, max(len(seeds), 1)), np.nan)
        table[self.point[self.ok], column[self.ok]] = self.metrics[metric][self.ok]
        return table

    def whole(self, metric: str, points: int) -> Whole:
        """Return in how many missions (points,) every AUV has a value."""
        without = self.unserved.get(metric, False)
        known = self.ok & ~np.isnan(self.metrics[metric]) & ~np.asarray(without)
        return np.bincount(self.point[known], minlength=points)

    def well(self, points: int) -> Whole:
        """Return how many missions (points,) went well."""
        return np.bincount(self.point[self.ok], minlength=points)

    def seeds(self, point: int) -> set[int]:
        """Return the seeds of a point that have a row."""
        return set(self.seed[self._rows(point)].tolist())

    def failed(self, point: int) -> int:
        """Return how many missions of a point failed."""
        return int((~self.ok[self._rows(point)]).sum())

    def _rows(self, point: int) -> slice:
        first, end = np.searchsorted(self.point, (point, point + 1))
        return slice(first, end)


def outcomes(folder: Path, metrics: Sequence[str]) -> Outcomes:
    """Read metrics of all missions of a campaign that have a row.

    Raises:
        CampaignError: when an older version ran it, which did not record one of them.
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
        return Outcomes(none, none, none, none == 0, {name: np.zeros(0) for name in metrics})
    check_recorded(folder, rows, wanted)
    who = {name: auv_numbers(rows[name]) for name in named}
    found = numpy_columns(rows.drop_columns(["status", *who]))
    return Outcomes(
        **{name: found[name] for name in ("mission", "point", "seed")},
        ok=np.array(rows["status"].to_pylist()) == OK,
        metrics={name: found[name].astype(float, copy=False) for name in metrics},
        unserved={
            name: _unserved(found[own], who[f"{own}_auv"])
            for name, own in zip(lacking, served, strict=True)
        },
        worst={name: who[f"{name}_auv"] for name in worst},
    )


def _unserved(worst: Floats, who: Whole) -> Flags:
    """Tell of each mission whether an AUV has no value; it is named if it could have one."""
    unserved: Flags = (who != NONE) & np.isnan(worst)
    return unserved


def auv_numbers(names: pa.ChunkedArray) -> Whole:
    """Return the numbers of AUVs of which a column has the names; NONE where it has none."""
    each = names.combine_chunks().dictionary_encode()
    numbers = [int(name.removeprefix("AUV")) for name in each.dictionary.to_pylist()]
    places = np.nan_to_num(numpy_array(each.indices), nan=len(numbers)).astype(np.int64)
    found: Whole = np.array([*numbers, NONE], np.int64)[places]
    return found


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
            hint = did_you_mean(name, known) or f"; the metrics are {', '.join(known)}"
            raise ValueError(f"no metric {name!r}{hint}")


def unit(metric: str) -> str:
    """Return the unit of a metric, "1" where it is a count or a share.

    >>> unit("position_error_m"), unit("hf_coverage")
    ('m', '1')
    """
    named: bytes = metric_schema(MISSIONS).field(metric).metadata[b"unit"]
    return named.decode()
