"""What the paper says in words of its results, and whether it holds here."""

from typing import TYPE_CHECKING

from ..claims import Claimed
from ..experiments.case_study import READINGS
from ..experiments.measured import chosen, per_seed
from ..experiments.running import Runs
from ..verdicts import CANNOT_BE, DIFFERS, REPRODUCED
from .readings import Reading

if TYPE_CHECKING:
    import pandas as pd

# "Nearly identical" curves differ by no more than this share.
NEARLY = 0.10

SIDE, ASVS, AUVS, ANGLE = "survey.side_m", "asvs.count", "auvs.count", "asvs.formation.angle_deg"


def claims(runs: Runs) -> list[Claimed]:
    """Return the sentences about case study and sweep that are not single numbers."""
    sweep = runs["sweep"].missions
    return [
        _rotation(runs),
        *(_factor(runs, side, low, high) for side, low, high in ((100, 3, 6), (140, 4, 5))),
        _rate_falls(sweep),
        _same_rates(sweep),
        _collapse(sweep),
        _best_angle(sweep),
    ]


def _of(reading: Reading, runs: Runs, campaign: str) -> "pd.DataFrame":
    """Return the missions of the sweep in a reading."""
    missions = runs[campaign if reading.bias == "body" else "sweep_readings"].missions
    return missions if reading.bias == "body" else chosen(missions, reading.fusion)


def _rotation(runs: Runs) -> Claimed:
    """Judge the error of AUV0 at 0 deg over that at 30 deg."""
    found = []
    for reading in READINGS:
        means = [
            sum(values) / len(values)
            for angle in (0.0, 30.0)
            for values in [
                per_seed(
                    runs["two_asvs"].auvs,
                    reading.metric,
                    {**reading.fusion, "auv": "AUV0", ANGLE: angle},
                )
            ]
        ]
        found.append((reading.error_words, means[0] / means[1]))
    return _judged("turning two ASVs by 30 deg reduces AUV0's error 8-fold", found, 7.5, 8.5)


def _judged(sentence: str, found: list[tuple[str, float]], low: float, high: float) -> Claimed:
    holds = low <= found[0][1] <= high
    return Claimed(
        sentence,
        REPRODUCED if holds else DIFFERS,
        ", ".join(f"{value:.1f} as {name}" for name, value in found),
        "" if holds else "errors depend on the reading (E7, E8)",
    )


def _factor(runs: Runs, side: float, low: float, high: float) -> Claimed:
    """Judge the error with one ASV over that with three, over all team sizes."""
    found = []
    for reading in READINGS:
        missions = chosen(_of(reading, runs, "sweep"), {SIDE: float(side)})
        one, three = (chosen(missions, {ASVS: n})[reading.metric].mean() for n in (1, 3))
        found.append((reading.error_words, float(one / three)))
    sentence = f"at L = {side:.0f} m three ASVs have {low:.0f}-{high:.0f} times less error than one"
    return _judged(sentence, found, low - 0.5, high + 0.5)


def _rate_falls(sweep: "pd.DataFrame") -> Claimed:
    rates = sweep.pivot_table(index=[SIDE, ASVS, ANGLE], columns=AUVS, values="fix_rate_hz")
    steps = rates.diff(axis=1).iloc[:, 1:]
    rising = int((steps > 0).to_numpy().sum())
    return Claimed(
        "the fix rate per AUV falls monotonically with the team size",
        DIFFERS if rising else REPRODUCED,
        f"{rising} of {steps.size} steps from one team size to the next rise",
        "which strip an AUV gets, and so its coverage, depends on the team size" if rising else "",
    )


def _same_rates(sweep: "pd.DataFrame") -> Claimed:
    mine = chosen(sweep, {SIDE: 140.0})
    rates = mine.pivot_table(index=AUVS, columns=ASVS, values="fix_rate_hz")
    ratio = rates[3] / rates[1]
    holds = bool(((ratio - 1).abs() <= NEARLY).all())
    return Claimed(
        "fix rates are nearly identical across ASV counts (L = 140 m)",
        REPRODUCED if holds else CANNOT_BE,
        f"three ASVs give {ratio.min():.2f}-{ratio.max():.2f} times the rate of one",
        "" if holds else "Table I itself has 291 fixes with one ASV and 466 with three (E29)",
    )


def _collapse(sweep: "pd.DataFrame") -> Claimed:
    mine = chosen(sweep, {SIDE: 60.0})
    errors = mine.pivot_table(index=AUVS, columns=[ASVS, ANGLE], values="position_error_m")
    spread = errors.max(axis=1) / errors.min(axis=1)
    holds = bool((spread - 1 <= NEARLY).all())
    return Claimed(
        "at L = 60 m all curves collapse regardless of ASV count and angle",
        REPRODUCED if holds else DIFFERS,
        f"the largest mean position error is {spread.min():.1f}-{spread.max():.1f} times the "
        "smallest of the same team",
        "" if holds else "two ASVs at 50 m cover 83-89 % of the square (E30)",
    )


def _best_angle(sweep: "pd.DataFrame") -> Claimed:
    mine = chosen(sweep, {ASVS: 3, SIDE: 140.0})
    coverage = mine.groupby(ANGLE).hf_coverage.mean()
    holds = coverage.idxmax() == 0.0 and coverage.idxmin() == 90.0
    shown = ", ".join(f"{value:.3f} at {angle:.0f}" for angle, value in coverage.items())
    return Claimed(
        "of three ASVs 0 deg is the best angle, 90 deg the worst (140 m)",
        REPRODUCED if holds else DIFFERS,
        f"coverage {shown} deg",
        "" if holds else "the four are one formation up to symmetries of the square (E15)",
    )
