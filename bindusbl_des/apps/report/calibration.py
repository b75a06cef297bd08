"""Whether a filter knows how far off it is: the truth against the ellipses that it reports.

Where it does, the truth is inside the ellipse of p for a share p of the time: two normal errors are
within a Mahalanobis distance d with the probability 1 - exp(-d^2 / 2).
"""

from dataclasses import dataclass

import numpy as np

from ...core.navigation.fix_update import SURE
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.wording import number
from .page import filled, table
from .recording import Recording

LEVELS = (0.50, 0.95, 0.99)

# So many standard errors away from its level a share is not by chance; of fewer independent errors
# than these, as of a drift that no fix has corrected, nothing can be said.
SIGNIFICANT, FEWEST = 3.0, 5.0

# A sentence names so many AUVs; the rest is in the table.
MOST_NAMED = 12

CONSISTENT, UNDECIDED = "consistent", "cannot be told"
OVERCONFIDENT, UNDERCONFIDENT = "overconfident", "underconfident"


@dataclass(frozen=True)
class Calibration:
    """Shares of time in which the truth lay inside the ellipses of LEVELS.

    `independent` is how many independent errors the instants are worth: errors of neighbouring
    instants are alike.
    """

    inside: tuple[float, ...]
    independent: float

    @property
    def verdict(self) -> str:
        """Whether the shares are those of a filter that knows its errors, or on which side.

        Too few inside 95 % are worse than too many inside 50 %, and are told first.
        """
        half, most, _ = self.inside
        if self.independent < FEWEST:
            return UNDECIDED
        if most < 0.95 - SIGNIFICANT * np.sqrt(0.95 * 0.05 / self.independent):
            return OVERCONFIDENT
        if half > 0.5 + SIGNIFICANT * np.sqrt(0.5 * 0.5 / self.independent):
            return UNDERCONFIDENT
        return CONSISTENT


def normalised(errors: Floats, covariances: Floats) -> Floats:
    """Return L^-1 e (m, 2) of errors (n, 2), m, with covariances L L' = xx, yy, xy (n, 3), m2.

    Both numbers are standard normal where the covariance is right.  Instants at which an AUV is
    sure in some direction, as at the start, are left out.
    """
    xx, yy, xy = covariances.T
    unsure = xx * yy - xy**2 > SURE * (xx + yy) ** 2
    (x, y), (xx, yy, xy) = errors[unsure].T, covariances[unsure].T
    slope = xy / xx
    return np.column_stack((x / np.sqrt(xx), (y - slope * x) / np.sqrt(yy - slope * xy)))


def calibration(errors: Floats, fixes: int) -> Calibration | None:
    """Return how normalised errors (n, 2) in the order of time lie; None where there are none.

    There are no more independent errors than `fixes` and the beginning: in between they drift.
    """
    if not errors.size:
        return None
    squares = (errors**2).sum(axis=1)
    inside = tuple(float((squares <= -2 * np.log(1 - p)).mean()) for p in LEVELS)
    return Calibration(inside, min(independent(errors), fixes + 1.0))


def of_auv(mission: Recording, auv: int) -> Calibration | None:
    """Return the calibration of one AUV; None where it is never unsure."""
    own, truth = mission.own, mission.truth
    errors = np.column_stack(
        [own[f"estimate_{name}"][auv] - truth[name][auv] for name in ("x_m", "y_m")]
    )
    moved = mission.fixes["correction_m"][mission.delivered_to(auv)]
    return calibration(normalised(errors, mission.covariance(auv)), int((moved > 0.0).sum()))


def of_fleet(calibrations: list[Calibration]) -> Calibration:
    """Return the mean over AUVs, whose errors are independent of each other."""
    inside = np.mean([own.inside for own in calibrations], axis=0)
    return Calibration(tuple(inside.tolist()), sum(own.independent for own in calibrations))


def independent(errors: Floats) -> float:
    """Return how many independent errors correlated ones (n, 2), of mean 0, are worth.

    That is n over the sum of their autocorrelation, up to where pairs of it are no longer positive.
    The mean of 0 is known: errors that last all the mission are one, not many about their own mean.
    Source: C. J. Geyer, Practical Markov Chain Monte Carlo, Statistical Science 7, 1992, sec. 3.3.
    """
    count = len(errors)
    if count < 4 or not errors.any():
        return 1.0
    power = np.abs(np.fft.rfft(errors, 2 * count, axis=0)) ** 2
    correlation = np.fft.irfft(power, axis=0).sum(axis=1)[: count - count % 2]
    pairs = (correlation / correlation[0]).reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    summed = 2 * pairs[: ends[0] if ends.size else None].sum() - 1
    return float(count / max(summed, 1.0))


def calibration_text(mission: Recording) -> str:
    """Return in HTML how often the truth lay inside the ellipses; empty where there are none."""
    auvs = {f"AUV{auv}": of_auv(mission, auv) for auv in range(mission.auvs)}
    known = {name: own for name, own in auvs.items() if own is not None}
    if not known:
        return ""
    fleet = of_fleet(list(known.values()))
    rows = [_row(name, own) for name, own in auvs.items()]
    rows += [_row("fleet", fleet)] * (len(auvs) > 1)
    headings = [
        ("AUV", ""),
        *((f"inside {100 * p:.0f} %", "% of time") for p in LEVELS),
        ("filter", ""),
    ]
    words = _said(mission.setup, fleet)
    others: dict[str, list[str]] = {}
    for name, own in known.items():
        if own.verdict != fleet.verdict:
            others.setdefault(own.verdict, []).append(name)
    if 0 < sum(map(len, others.values())) <= MOST_NAMED:
        alone = "; ".join(f"{verdict}: {', '.join(names)}" for verdict, names in others.items())
        words += f" Of the AUVs alone, {alone}."
    shown = table(headings, rows, "Share of time with the truth inside each AUV's ellipses")
    return (
        filled('<h3>Truth inside the ellipses</h3><p class="note">{words}</p>', words=words)
        + f'<div class="pair">{shown}</div>'
    )


def _row(name: str, own: Calibration | None) -> list[str]:
    if own is None:
        return [name, *("-" for _ in LEVELS), "never unsure"]
    return [name, *(number(share, 1, 100) for share in own.inside), own.verdict]


def _said(setup: Setup, fleet: Calibration) -> str:
    """Return in words whether the filter knows how far off it is."""
    navigation = setup.scenario.navigation
    half, most, _ = (f"{100 * share:.0f} %" for share in fleet.inside)
    name = navigation.filter
    over, under = f"The filter {name} is over", f"The filter {name} is under"
    text = {
        OVERCONFIDENT: f"{over}confident, further off than it believes: the",
        UNDERCONFIDENT: f"{under}confident, less far off than it believes: the",
        CONSISTENT: f"Nothing says that the filter {name} is over- or underconfident: the",
        UNDECIDED: "The",
    }[fleet.verdict]
    worth = round(fleet.independent)
    chance = (
        "too few to say whether it is over- or underconfident"
        if fleet.verdict == UNDECIDED
        else f"and shares within {SIGNIFICANT:g} standard errors of those are taken for chance"
    )
    late = setup.navigator.has_gain and navigation.fixed_gain.delay_compensation == "none"
    why = (
        " Its delay_compensation is none: it takes a fix for where the AUV is now, and its "
        "covariance does not know of the way gone since the ping."
    ) * (late and fleet.verdict == OVERCONFIDENT)
    return (
        f"{text} truth was inside its 50 % ellipses {half} of the time, inside those of 95 % "
        f"{most}.{why} Errors are alike from instant to instant: they are worth some {worth} "
        f"independent one{'s' * (worth != 1)}, {chance}."
    )
