"""Coverage failure and recovery: Table I and two ASVs over the formation angle, L = 140 m."""

from collections.abc import Iterator
from math import sqrt
from statistics import fmean

from ..published import Published, published
from ..readings.readings import Reading
from ..verdicts import Limit, predicted
from .ablations import changes
from .measured import Measured, Other, Reason, per_seed
from .running import Runs

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


def measure(row: Published, runs: Runs) -> Measured:
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
