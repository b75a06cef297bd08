"""The rows of a batch's missions, gathered into the tables of a part as the missions end."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import pyarrow as pa

from ...results.arrow import arrow
from ..experiments.plan import Mission, PlannedPoint, mission_id
from ..storage.parts import ARROW_TYPES, FAILED, MISSIONS, OK, labelled, metric_schema

# So many missions have tables of their own: one of a single row takes a kilobyte for each column.
MOST_APART = 32
CELL_BYTES = 8


@dataclass
class Ran:
    """One mission as it was run: its tables, or why there are none."""

    mission: Mission
    wall_time_s: float
    tables: Mapping[str, pa.Table] = field(default_factory=dict)
    error: str | None = None


class Gathered:
    """Missions that were run, and their rows.

    `columns` has the type of each varied key, `points` what is planned at each point.
    """

    def __init__(
        self, columns: Mapping[str, str], points: Mapping[int, PlannedPoint], model_version: str
    ) -> None:
        self._columns, self._points, self._model_version = columns, points, model_version
        self._apart: list[Ran] = []
        self._joined: dict[str, list[pa.Table]] = {}
        #: About how much memory (bytes) the rows take: to ask Arrow takes longer than to run some.
        self.nbytes = 0

    def add(self, ran: Ran) -> None:
        """Take the rows of one more mission."""
        self._apart.append(ran)
        self.nbytes += sum(CELL_BYTES * it.num_rows * it.num_columns for it in ran.tables.values())
        if len(self._apart) == MOST_APART:
            self._join()

    def tables(self) -> dict[str, pa.Table]:
        """Return the tables of all missions so far, each row with what says which one it is of."""
        self._join()
        return {name: pa.concat_tables(tables) for name, tables in self._joined.items()}

    def _join(self) -> None:
        ran, self._apart = self._apart, []
        if not ran:
            return
        names = dict.fromkeys(name for it in ran for name in it.tables if name != "mission")
        found = {name: self._table(name, ran) for name in names}
        for name, table in {**found, MISSIONS: self._missions(ran)}.items():
            self._joined.setdefault(name, []).append(table.combine_chunks())

    def _table(self, name: str, ran: Sequence[Ran]) -> pa.Table:
        lengths = [len(it.tables[name]) if name in it.tables else 0 for it in ran]
        owner = arrow([n for n, length in enumerate(lengths) for _ in range(length)], pa.int64())
        labels = self._labels(ran, with_point=name == "auvs")
        return labelled(
            pa.concat_tables([it.tables[name] for it in ran if name in it.tables]),
            {key: array.take(owner) for key, array in labels.items()},
        )

    def _missions(self, ran: Sequence[Ran]) -> pa.Table:
        described = metric_schema(MISSIONS)
        nothing = pa.table([pa.nulls(1, field.type) for field in described], schema=described)
        labels = self._labels(ran, with_point=True)
        labels["status"] = arrow([FAILED if it.error else OK for it in ran], pa.string())
        labels["error"] = arrow([it.error for it in ran], pa.string())
        labels["wall_time_s"] = arrow([it.wall_time_s for it in ran], pa.float64())
        return labelled(
            pa.concat_tables([it.tables["mission"] if it.tables else nothing for it in ran]), labels
        )

    def _labels(self, ran: Sequence[Ran], *, with_point: bool) -> dict[str, pa.Array]:
        """Return the columns that say which mission it was, a value for each mission."""
        points = [self._points[it.mission.point] for it in ran]
        ids = [
            mission_id(point.scenario, it.mission.seed, self._model_version)
            for it, point in zip(ran, points, strict=True)
        ]
        labels = {
            "mission": arrow([it.mission.number for it in ran], pa.int64()),
            "mission_id": arrow(ids, pa.string()),
            "seed": arrow([it.mission.seed for it in ran], pa.int64()),
        }
        if with_point:
            labels["point"] = arrow([it.mission.point for it in ran], pa.int64())
            for key, kind in self._columns.items():
                values = [point.varied[key] for point in points]
                if kind == "json":
                    values = [None if value is None else json.dumps(value) for value in values]
                labels[key] = arrow(values, ARROW_TYPES[kind])
        return labels
