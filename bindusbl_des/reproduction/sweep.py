"""The configuration sweep: team size, ASVs, angles and sides, and the latency over all of it."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..slots import airtime, payload_bytes
from .case_study import READINGS, Reading
from .measured import Measured, Other, Reason, Where, per_seed
from .published import Published
from .running import Runs
from .verdicts import Claim, Limit, Prediction, predicted

if TYPE_CHECKING:
    import pandas as pd

# "Results are averaged over 20 independent seeds and all four formation angles."
SEEDS_OF_THE_PAPER = 20
EQUAL_DISTANCE = "equal distance, "

# What the text says of an extreme: a range of values, or a bound ("below 0.8 m", "exceeds 4.4 m").
BOUNDS: dict[tuple[str, str, str], Claim] = {
    ("60", "1-3", "cte_max"): "at most",
    ("100", "3", "cte_max"): "at most",
    ("140", "1", "cte_min"): "at least",
}

ERRORS = Reason(
    "E7, E8, E31",
    "as in Table I, the published errors are not those of a body-frame bias across the track",
)
LATENCY = Reason("E24", "the airtime of a frame exceeds it")


def measure(row: Published, runs: Runs) -> Measured:
    """Measure one number of the sweep's text, or the conclusion's latency."""
    if row.quantity == "latency_max":
        return _latency(row, runs)
    found = _over_cells(row, runs["sweep"].missions, READINGS[0].metric, {})
    return Measured(
        row,
        f"{READINGS[0].name}, 300 s",
        found,
        ERRORS,
        tuple(_others(row, runs)),
        BOUNDS.get((row.side_m, row.asvs, row.quantity), "equals"),
    )


def _others(row: Published, runs: Runs) -> Iterator[Other]:
    for reading in READINGS[1:]:
        yield Other(f"{reading.name}, 300 s", _read(row, runs, reading))
    distance = runs["sweep_distance"].missions
    for reading in READINGS[:2]:
        found = _over_cells(row, distance, reading.metric, {})
        yield Other(EQUAL_DISTANCE + reading.name, found)


def _read(row: Published, runs: Runs, reading: Reading) -> Prediction:
    if reading.frame == "body":
        return _over_cells(row, runs["sweep"].missions, reading.metric, {})
    return _over_cells(row, runs["sweep_readings"].missions, reading.metric, reading.where)


def _over_cells(row: Published, missions: "pd.DataFrame", metric: str, where: Where) -> Prediction:
    """Return the mean, least or largest cell of the sweep that a number is about.

    A cell is a side, a number of ASVs and a team size; its value is the mean over angles and seeds.
    """
    counts = range(1, 4) if row.asvs == "1-3" else [int(row.asvs)]
    teams = sorted(missions["auvs.count"].unique())
    sides = [60.0, 100.0, 140.0] if row.side_m == "all" else [float(row.side_m)]
    mine = {**where, "survey.side_m": sides[0]}
    if row.quantity == "cte_mean":
        values = per_seed(missions, metric, {**mine, "asvs.count": counts[0]})
        return predicted(values, SEEDS_OF_THE_PAPER)
    cells = [
        predicted(
            per_seed(
                missions,
                metric,
                {**where, "survey.side_m": side, "asvs.count": asvs, "auvs.count": auvs},
            ),
            SEEDS_OF_THE_PAPER,
        )
        for side in sides
        for asvs in counts
        for auvs in teams
    ]
    extreme = min if row.quantity.endswith("min") else max
    return extreme(cells, key=lambda cell: cell.mean)


def _latency(row: Published, runs: Runs) -> Measured:
    """Measure the longest mean latency of all configurations; it has a lower limit."""
    shortest = airtime(payload_bytes(4))
    limit = Limit(
        shortest,
        float("inf"),
        f"a frame of four fixes takes {shortest:.3f} s on the air, and teams have up to ten AUVs",
    )
    found = _over_cells(row, runs["sweep"].missions, "latency_mean_s", {})
    return Measured(row, "largest mean latency", found, LATENCY, claim="at most", limit=limit)


def cells(missions: "pd.DataFrame", metric: str) -> "pd.DataFrame":
    """Return the mean of a metric for each side, number of ASVs and team size, over the angles."""
    keys = ["survey.side_m", "asvs.count", "auvs.count"]
    means = missions.groupby(keys)[metric].mean().reset_index()
    return means.rename(columns={metric: "value"})
