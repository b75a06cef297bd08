"""The configuration sweep: team size, ASVs, angles and sides, and the latency over all of it."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...acoustics.modem import airtime, payload_bytes
from ..published import Published
from ..readings.readings import Reading
from ..verdicts import Claim, Limit, Prediction, predicted
from .case_study import READINGS
from .measured import Measured, Other, Reason, chosen
from .running import Runs

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
    ("all", "1-3", "latency_max"): "at most",
}

CELL = ["survey.side_m", "asvs.count", "auvs.count"]

ERRORS = Reason(
    "E7, E8, E31",
    "as in Table I, the published errors are not those of a body-frame bias across the track",
)
LATENCY = Reason("E24", "the airtime of a frame exceeds it")


def measure(row: Published, runs: Runs) -> Measured:
    """Measure one number of the sweep's text, or the conclusion's latency."""
    first = READINGS[0]
    reading = "largest mean latency" if _is_latency(row) else f"{first.error_words}, 300 s"
    return Measured(
        row,
        reading,
        over_cells(row, runs["sweep"].missions, column_of(row, first)),
        LATENCY if _is_latency(row) else ERRORS,
        () if _is_latency(row) else tuple(_others(row, runs)),
        claim_of(row),
        limit_of(row),
    )


def _is_latency(row: Published) -> bool:
    return row.quantity == "latency_max"


def column_of(row: Published, reading: Reading) -> str:
    """Return the metric of a mission that a number is about."""
    return "latency_mean_s" if _is_latency(row) else reading.metric


def claim_of(row: Published) -> Claim:
    """Return how a number is meant: as a value or as a bound."""
    return BOUNDS.get((row.side_m, row.asvs, row.quantity), "equals")


def limit_of(row: Published) -> Limit | None:
    """Return the limit that the paper's own equations set to a number."""
    if not _is_latency(row):
        return None
    shortest = airtime(payload_bytes(4))
    return Limit(
        shortest,
        float("inf"),
        f"a frame of four fixes takes {shortest:.3f} s on the air, and teams have up to ten AUVs",
    )


def _others(row: Published, runs: Runs) -> Iterator[Other]:
    for reading in READINGS[1:]:
        found = over_cells(row, _missions(runs, reading), reading.metric)
        yield Other(f"{reading.error_words}, 300 s", found)
    distance = runs["sweep_distance"].missions
    for reading in READINGS[:2]:
        found = over_cells(row, distance, reading.metric)
        yield Other(EQUAL_DISTANCE + reading.error_words, found)


def _missions(runs: Runs, reading: Reading) -> "pd.DataFrame":
    if reading.bias == "body":
        return runs["sweep"].missions
    return chosen(runs["sweep_readings"].missions, reading.fusion)


def over_cells(row: Published, missions: "pd.DataFrame", metric: str) -> Prediction:
    """Return the mean, least or largest cell of the sweep that a number is about.

    A cell is a side, a number of ASVs and a team size; its value is the mean over angles and seeds.
    """
    counts = range(1, 4) if row.asvs == "1-3" else [int(row.asvs)]
    sides = [60.0, 100.0, 140.0] if row.side_m == "all" else [float(row.side_m)]
    mine = missions[missions["survey.side_m"].isin(sides) & missions["asvs.count"].isin(counts)]
    if row.quantity == "cte_mean":
        return predicted(list(mine.groupby("seed")[metric].mean()), SEEDS_OF_THE_PAPER)
    seeds = mine.groupby([*CELL, "seed"])[metric].mean()
    cells = [predicted(list(cell), SEEDS_OF_THE_PAPER) for _, cell in seeds.groupby(level=CELL)]
    extreme = min if row.quantity.endswith("min") else max
    return extreme(cells, key=lambda cell: cell.mean)


def cells(missions: "pd.DataFrame", metric: str) -> "pd.DataFrame":
    """Return the mean of a metric for each side, number of ASVs and team size, over the angles."""
    means = missions.groupby(CELL)[metric].mean().reset_index()
    return means.rename(columns={metric: "value"})
