"""What each published number is here: baseline, case study, configuration sweep, ablations."""

from collections.abc import Iterator
from math import sqrt
from statistics import fmean
from typing import TYPE_CHECKING

from bindusbl_des.apps.campaigns.campaign import Campaign
from bindusbl_des.apps.campaigns.statistics.intervals import interval
from bindusbl_des.core.acoustics.messages import airtime, payload_bytes

from .campaigns import Runs
from .numbers import (
    Claim,
    Limit,
    Measured,
    Other,
    Prediction,
    Published,
    Reason,
    chosen,
    per_seed,
    predicted,
    published,
)
from .readings import Reading

if TYPE_CHECKING:
    import pandas as pd

# Ablations: what each choice that the paper leaves open does to Table I.


UNCHANGED = "as the paper writes"
AUVS = ("AUV0", "AUV1", "AUV2")


def changes(campaign: Campaign, asvs: int) -> dict[str, int]:
    """Return what was changed (``key=value``) and the point of the campaign, for an ASV count."""
    found: dict[str, int] = {}
    for number, point in enumerate(campaign.plan.points):
        if point.sets["asvs.count"] == asvs:
            rest = {key: value for key, value in point.sets.items() if key != "asvs.count"}
            found[_named(rest)] = number
    return found


def _named(rest: dict[str, object]) -> str:
    return ", ".join(f"{key}={_written(value)}" for key, value in rest.items()) or UNCHANGED


def _written(value: object) -> str:
    return "null" if value is None else str(value)


def ablated(runs: Runs) -> "pd.DataFrame":
    """Return a row per ASV count and change: fixes and errors of each AUV, and collisions."""
    import pandas as pd

    campaign = runs["ablations"]
    return pd.DataFrame(
        [
            _row(campaign, asvs, change, point)
            for asvs in (1, 3)
            for change, point in changes(campaign, asvs).items()
        ]
    )


def _row(campaign: Campaign, asvs: int, change: str, point: int) -> dict[str, object]:
    found: dict[str, object] = {"asvs": asvs, "change": change}
    for auv in AUVS:
        where = {"point": point, "auv": auv}
        for name, column in (("fixes", "fixes_delivered"), ("error", "position_error_m")):
            it = interval(per_seed(campaign.auvs, column, where))
            found[f"{name}_{auv}"], found[f"{name}_{auv}_half_width"] = it.mean, it.half_width
    rows = chosen(campaign.missions, {"point": point})
    return {**found, "collisions": rows.collisions.mean()}


# The baseline: one ASV that hears four AUVs, L = 60 m.


# "Across five independent runs"
BASELINE_RUNS = 5

BASELINE_READINGS = {
    "round_robin": "one AUV per second in turn",
    "random": "one AUV per second by lot",
}
TDMA = "the paper's TDMA"

PINGS = Reason(
    "E3, E26",
    "one ping per second and none lost makes 300 in 300 s; the published 298.2 are 0.6 % fewer, "
    "far from the 7-15 % that the paper's loss law would take",
)
LOT = Reason("E26", "taking turns makes equal shares; by lot the published ones are likely")
AIRTIME = Reason("E23", "the paper's own airtime alone is 192 ms")


def measure_baseline(row: Published, runs: Runs) -> Measured:
    """Measure one number of the baseline: conventional USBL, AUVs in turn; by lot; by TDMA."""
    auvs = runs["baseline"].auvs
    found = {
        schedule: predicted(
            values(row, chosen(auvs, {"protocol.schedule": schedule})), BASELINE_RUNS
        )
        for schedule in (*BASELINE_READINGS, "spatial_reuse")
    }
    return Measured(
        row,
        BASELINE_READINGS["round_robin"],
        found["round_robin"],
        _reason(row),
        (Other(BASELINE_READINGS["random"], found["random"]), Other(TDMA, found["spatial_reuse"])),
    )


def values(row: Published, auvs: "pd.DataFrame") -> list[float]:
    """Return the published quantity for each seed."""
    seeds = auvs.groupby("seed")
    if row.quantity == "fix_share":
        mine = auvs[auvs.auv == row.auv].set_index("seed").fixes_delivered
        found = mine / seeds.fixes_delivered.sum()
    elif row.quantity == "fixes":
        found = seeds.fixes_delivered.sum()
    elif row.quantity == "fix_rate":
        found = seeds.fix_rate_hz.sum() if row.auv == "fleet" else seeds.fix_rate_hz.mean()
    else:
        columns = {
            "inter_fix_interval": "interval_mean_s",
            "latency_mean": "latency_mean_s",
            "latency_p95": "latency_p95_s",
        }
        found = seeds[columns[row.quantity]].mean()
    return [float(value) for value in found]


def _reason(row: Published) -> Reason:
    if row.quantity == "fix_share":
        return LOT
    return AIRTIME if row.quantity.startswith("latency") else PINGS


# Coverage failure and recovery: Table I and two ASVs over the formation angle, L = 140 m.


COLUMNS = {
    "fixes": "fixes_delivered",
    "coverage": "hf_coverage",
    "distance": "distance_m",
    "cte": "cross_track_error_m",
}

# Table I is of a "single representative run".
RUNS_OF_THE_PAPER = 1


# The first is what the paper writes; the others are tried for all numbers alike.
READINGS = (
    Reading(),
    Reading(error="position"),
    Reading(error="position", bias="world"),
    Reading(error="position", bias="world", delay="shift"),
)

UNSTATED = Reason(
    "E28", "where AUVs start and how they turn is never stated, and decides who is in range when"
)
BROADCASTER = Reason("E27, E28", "which ASV broadcasts and where AUVs start is never stated")
ERRORS = Reason(
    "E7, E8, E10",
    "the published errors are not those of a body-frame bias across the track; "
    "other readings are beside",
)

# Changes of one unstated choice under which fixes and coverage are shown too.
CHANGES = (
    "protocol.broadcaster=random",
    "acoustics.loss.combine=paper_raw",
    "acoustics.loss.combine=off",
    "auvs.route.start=strip_corner",
)


def measure_case_study(row: Published, runs: Runs) -> Measured:
    """Measure one number of Table I or of the text beside it."""
    if row.quantity == "cte":
        return _error(row, runs)
    first = READINGS[0]
    return Measured(
        row,
        "mean of runs",
        predicted(_values(row, runs, COLUMNS[row.quantity], first), RUNS_OF_THE_PAPER),
        reason(row),
        tuple(_others(row, runs)) if row.quantity != "distance" else (),
    )


def _values(row: Published, runs: Runs, column: str, reading: Reading) -> list[float]:
    where = {"auv": row.auv, **reading.fusion}
    if row.asvs == "2":
        turned = {"asvs.formation.angle_deg": float(row.angle_deg)}
        return per_seed(runs["two_asvs"].auvs, column, {**where, **turned})
    return per_seed(runs["table_1"].auvs, column, {**where, "asvs.count": int(row.asvs)})


def _error(row: Published, runs: Runs) -> Measured:
    found = [
        predicted(_values(row, runs, reading.metric, reading), RUNS_OF_THE_PAPER)
        for reading in READINGS
    ]
    others = [Other(r.error_words, p) for r, p in zip(READINGS[1:], found[1:], strict=True)]
    limit = across_track_limit()
    return Measured(row, READINGS[0].error_words, found[0], ERRORS, tuple(others), limit=limit)


def across_track_limit(bias: float = 0.06, walk: float = 0.027, duration: float = 300.0) -> Limit:
    """Return how large the mean cross-track error can be without any fix (docs/errata.md, E8).

    Across lanes along x the bias drifts `bias` (m/s): `bias * duration / 2` on average, to which
    the random walk of `walk` (m/sqrt(s)) adds less than two sigma of its time mean in 97.5 % of
    runs.
    """
    mean, sd = bias * duration / 2, walk * sqrt(duration / 3)
    highest = mean + 2 * sd
    return Limit(
        0.0,
        highest,
        f"without any fix the mean error across the lanes is {bias:g} m/s x {duration:g} s / 2 = "
        f"{mean:.1f} m, and at most {highest:.1f} m with two sigma of the random walk; "
        "it is a position error",
    )


def reason(row: Published) -> Reason:
    """Return why fixes, coverage or distance may differ."""
    if row.quantity == "distance":
        return Reason("E28", _distance_argument())
    return BROADCASTER if row.quantity == "fixes" and row.asvs == "3" else UNSTATED


def _distance_argument() -> str:
    distances = [r.value for r in published() if r.quantity == "distance"]
    mean, spread = fmean(distances), max(distances) - min(distances)
    return (
        f"every AUV here flies at {mean / 300:.3f} m/s, the mean of the published distances "
        f"({mean:.0f} m in 300 s); the paper's vehicles differ by {spread:.0f} m"
    )


def _others(row: Published, runs: Runs) -> Iterator[Other]:
    if row.asvs == "2":
        return
    campaign = runs["ablations"]
    for change, point in changes(campaign, int(row.asvs)).items():
        if change in CHANGES:
            where = {"point": point, "auv": row.auv}
            values = per_seed(campaign.auvs, COLUMNS[row.quantity], where)
            yield Other(change, predicted(values, RUNS_OF_THE_PAPER))


# The configuration sweep: team size, ASVs, angles and sides, and the latency over all of it.


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

SWEEP_ERRORS = Reason(
    "E7, E8, E31",
    "as in Table I, the published errors are not those of a body-frame bias across the track",
)
LATENCY = Reason("E24", "the airtime of a frame exceeds it")


def measure_sweep(row: Published, runs: Runs) -> Measured:
    """Measure one number of the sweep's text, or the conclusion's latency."""
    first = READINGS[0]
    reading = "largest mean latency" if _is_latency(row) else f"{first.error_words}, 300 s"
    return Measured(
        row,
        reading,
        over_cells(row, runs["sweep"].missions, column_of(row, first)),
        LATENCY if _is_latency(row) else SWEEP_ERRORS,
        () if _is_latency(row) else tuple(_other_cells(row, runs)),
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
    shortest, largest = airtime(payload_bytes(4)), airtime(payload_bytes(10))
    return Limit(
        shortest,
        float("inf"),
        f"a frame of four fixes takes {shortest:.3f} s on the air, of the ten AUVs of the largest "
        f"teams {largest:.3f} s",
    )


def _other_cells(row: Published, runs: Runs) -> Iterator[Other]:
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
