"""What the missions of a campaign came to: metrics by point and seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ...tables import mission_numbers
from ...wording import did_you_mean
from ..storage.parts import MISSIONS, OK, metric_schema, read_table

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True)
class Outcomes:
    """Missions that have a row, in the order of the plan; a metric that has no value is nan."""

    mission: Whole
    point: Whole
    seed: Whole
    ok: NDArray[np.bool_]
    metrics: Mapping[str, Floats]

    def at(self, point: int, metric: str) -> tuple[Whole, Floats]:
        """Return the seeds of the missions of a point that went well, and their metric."""
        rows = self._rows(point)
        well = self.ok[rows]
        return self.seed[rows][well], self.metrics[metric][rows][well]

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
    """Read metrics of all missions of a campaign that have a row."""
    metrics = list(dict.fromkeys(metrics))
    rows = read_table(folder, MISSIONS, ("point", "seed", "status", *metrics))
    if rows is None:
        none = np.zeros(0, np.int64)
        return Outcomes(none, none, none, none == 0, {name: np.zeros(0) for name in metrics})
    whole = {name: rows[name].to_numpy() for name in ("mission", "point", "seed")}
    values = {name: rows[name].cast(pa.float64()).to_numpy() for name in metrics}
    ok = np.array(rows["status"].to_pylist()) == OK
    return Outcomes(**whole, ok=ok, metrics=values)


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
