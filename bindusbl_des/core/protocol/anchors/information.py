"""ASVs that go where their fixes are expected to leave the least error of all AUVs.

Theory of operation
-------------------
The fleet knows of each AUV's estimate what its last fix left, and what dead reckoning has added
since (:class:`..view.KnownFixes`): a covariance P = P_0 + d(age)^2 / 2 I.  It looks a horizon
ahead in `STEPS` equal steps.  At the end of each step every AUV within reach of an ASV is fixed
once, with the chance p that its ping is decoded there.  A fix has the information (physics of the
USBL fix, 3.1)

    J = e e^T / sd_along^2 + t t^T / sd_across^2

with e along the line of sight and t across it; the errors are those of the instrument at that
distance.  With sum p J over the ASVs and the chance q that any of them decodes, the fix leaves

    P_0 = (1 - q) P + q (P^-1 + sum p J / q)^-1

and dead reckoning begins anew.  The cost of a placement is the mean over AUVs and time of tr P, or
of 2 sqrt(det P), in m2.

ASVs go to their targets in straight lines at their speed, so a target beyond the horizon counts
by what is heard on the way.  Each ASV in turn takes the best of its targets, given those of the
others, until none gains: its present one, its own position, `TRIED` positions all over the circle
that it can reach, and the AUVs themselves; then it searches around the best in steps that halve.
They do so from their present targets and from the k-centre of the AUVs at the end of the horizon,
since what each finds best depends on where the others are.
"""

from collections.abc import Sequence
from math import hypot, pi, sqrt
from operator import itemgetter
from typing import Annotated, NamedTuple

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled, inlined
from ...acoustics.loss import LossTerms
from ...geometry.placement import assignment
from ...usbl.instrument import Usbl
from ...usbl.measuring import variances
from .follow import best_places
from .view import AnchorView

#: Steps of a horizon, and positions that an ASV tries before it searches around the best.
STEPS, TRIED = 8, 256
# ASVs choose in turn so often at most; a search begins with this share of what one can travel and
# ends at so many metres.
TURNS, FIRST_STEP, LEAST_STEP_M = 4, 0.0625, 0.5
# Distances at which errors of fixes are tabulated, up to the reach, or to this (m)
TABULATED, LEAST_REACH_M = 64, 1e-3
# No estimate is surer than this (m2): divisions stay finite.
SUREST_M2 = 1e-6

# Positions evenly over a circle of radius 1 (Vogel's spiral), and eight directions
_NUMBERS = np.arange(TRIED) + 0.5
SPIRAL = np.sqrt(_NUMBERS / TRIED)[:, None] * np.column_stack(
    (np.cos(pi * (3.0 - sqrt(5.0)) * _NUMBERS), np.sin(pi * (3.0 - sqrt(5.0)) * _NUMBERS))
)
COMPASS = np.column_stack((np.cos(pi * np.arange(8) / 4.0), np.sin(pi * np.arange(8) / 4.0)))


class FixErrors(NamedTuple):
    """What one ASV's fix of an AUV is expected to be, at horizontal distances 0, `step_m`, ...

    `table` (n, g, 3) has for each AUV the chance that a ping is decoded, and the variances along
    and across the line of sight (m2); beyond the last distance nothing is heard.
    """

    step_m: float
    table: Annotated[Floats, 3]


def fix_errors(usbl: Usbl, loss: LossTerms, depths: Floats, reach: float) -> FixErrors:
    """Return the expected fixes of AUVs at depths (n,), m, within a horizontal reach (m)."""
    away = np.linspace(0.0, reach, TABULATED + 1)
    table = np.empty((len(depths), len(away), 3))
    for auv, depth in enumerate(depths.tolist()):
        table[auv, :, 0] = 1.0 - loss.over(np.hypot(away, depth))
        unknown_snr = np.full(len(away), np.nan)
        table[auv, :, 1:] = variances(away, depth, unknown_snr, -1.0, False, *usbl.packed)[:, :2]
    return FixErrors(max(reach, LEAST_REACH_M) / TABULATED, table)


class Outlook(NamedTuple):
    """What is expected of n AUVs in the k steps of a horizon, each `step_s` (s) long.

    `courses` (k, n, 2), m; `left_m2` (n,), the variance of both axes together that the last fix
    left; the squared drift (m2) since that fix, `older_m2` (n, k), and since a fix at the end of a
    step so many steps ago, `drift_m2` (n, k + 1).
    """

    step_s: float
    courses: Annotated[Floats, 3]
    left_m2: Floats
    older_m2: Annotated[Floats, 2]
    drift_m2: Annotated[Floats, 2]


class InformationPlacement:
    """Moves ASVs to where the expected covariance of the AUVs' estimates is least.

    `errors` are those of each ASV's fixes, `criterion` is `trace` (A-optimality) or `determinant`
    (D-optimality).  New targets are taken where they lower the cost by more than a share,
    `hysteresis`.
    """

    def __init__(
        self, errors: Sequence[FixErrors], *, horizon_s: float, hysteresis: float, criterion: str
    ) -> None:
        self._errors, self._horizon, self._hysteresis = errors, horizon_s, hysteresis
        self._by_trace = criterion == "trace"

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m."""
        step = self._horizon / STEPS
        ends = view.begins + step * np.arange(1, STEPS + 1)
        courses = np.stack([view.auvs(float(end))[:, :2] for end in ends])
        left, since = view.left_m2, view.since_s + view.begins - view.time
        older = view.drifted_m2(since[:, None] + step * np.arange(1, STEPS + 1))
        drift = view.drifted_m2(np.tile(step * np.arange(STEPS + 1), (len(left), 1)))
        outlook = Outlook(step, courses, np.maximum(left, SUREST_M2), older, drift)
        number = np.flatnonzero(view.working)
        if view.is_first:  # they are launched at the answer, and need not go there
            here = best_places(view.auvs(view.begins)[:, :2], len(number), view.reach)
            bound, speeds, far = here.copy(), np.full(len(number), np.inf), view.reach
        else:
            here, bound = view.vessels[number], view.bound_for[number]
            speeds, far = view.speeds[number], view.speeds.max() * self._horizon
        errors = [self._errors[asv] for asv in number.tolist()]
        asked = outlook, errors, here, speeds, self._by_trace
        before = cost(bound, *asked)
        middle = best_places(courses[-1], len(number), view.reach)
        if not view.is_first:
            middle = middle[assignment(here, middle)]
        found = [_searched(start, far, *asked) for start in (bound, middle)]
        there, after = min(found, key=itemgetter(1))
        if view.is_first:
            return there
        targets = view.bound_for.copy()
        if after < (1.0 - self._hysteresis) * before:
            targets[number] = there
        return targets


def cost(
    targets: Floats,
    outlook: Outlook,
    errors: Sequence[FixErrors],
    here: Floats,
    speeds: Floats,
    by_trace: bool = True,
) -> float:
    """Return the expected squared error (m2) of AUVs while ASVs go from `here` to targets (m, 2).

    Positions in m, speeds in m/s: infinite for ASVs that are launched at their targets.  The
    mean over AUVs and over the steps of the horizon, before and after each step's fixes.
    """
    others = _told(targets[1:], here[1:], speeds[1:], outlook, errors[1:])
    own = here[0], speeds[0], outlook, errors[0]
    return float(_costs(targets[:1], *own, others, by_trace)[0])


def _searched(
    targets: Floats,
    far: float,
    outlook: Outlook,
    errors: Sequence[FixErrors],
    here: Floats,
    speeds: Floats,
    by_trace: bool,
) -> tuple[Floats, float]:
    """Return the best targets (m, 2), m, that ASVs find in turn from given ones, and their cost.

    `far` is what the fastest ASV can travel within the horizon (m); other arguments as of
    :func:`cost`.
    """
    best, least = targets.copy(), cost(targets, outlook, errors, here, speeds, by_trace)
    for _ in range(TURNS):
        before = least
        for vessel, origin in enumerate(here):
            there, begun, paces = (np.delete(of, vessel, axis=0) for of in (best, here, speeds))
            beside = [*errors[:vessel], *errors[vessel + 1 :]]
            told = _told(there, begun, paces, outlook, beside)
            asked = origin, speeds[vessel], outlook, errors[vessel], told, by_trace
            tried = _tried(best[vessel], origin, far, outlook.courses[-1])
            step = max(FIRST_STEP * far, LEAST_STEP_M)
            while step >= LEAST_STEP_M:
                found = _costs(tried, *asked)
                lowest = int(found.argmin())
                if found[lowest] < least:
                    best[vessel], least = tried[lowest], float(found[lowest])
                else:
                    step /= 2.0
                tried = best[vessel] + step * COMPASS
        if len(here) == 1 or not least < before:
            break
    return best, least


def _tried(bound: Floats, here: Floats, far: float, courses: Floats) -> Floats:
    """Return targets (c, 2), m, from which the search of an ASV at `here` (2,) begins: its present
    target `bound` (2,), `here`, positions up to `far` (m) from there, and AUVs (n, 2).
    """
    return np.concatenate((bound[None], here[None], here + far * SPIRAL, courses))


def _told(
    targets: Floats, here: Floats, speeds: Floats, outlook: Outlook, errors: Sequence[FixErrors]
) -> Floats:
    """Return the information on each AUV, (k, n, 4) as of :func:`_hear`, from ASVs on their way
    from `here` to targets (m, 2), m.
    """
    heard = np.zeros((*outlook.courses.shape[:2], 4))
    heard[..., 3] = 1.0
    for target, origin, speed, own in zip(targets, here, speeds, errors, strict=True):
        _hear(target, origin, speed, outlook, own, heard)
    return heard


@compiled
def _hear(
    target: Floats, here: Floats, speed: float, outlook: Outlook, errors: FixErrors, heard: Floats
) -> None:
    """Add an ASV on its way from `here` to a target, (2,), m, at a speed (m/s) to `heard` (k steps,
    n AUVs, 4): xx, xy, yy of its information p J (m^-2) on each AUV; multiply the last by 1 - p,
    the chance that it decodes nothing.
    """
    steps, auvs = outlook.courses.shape[0], outlook.courses.shape[1]
    ahead, aside = target[0] - here[0], target[1] - here[1]
    way = hypot(ahead, aside)
    for k in range(steps):
        gone = speed * outlook.step_s * (k + 1)
        share = 1.0 if gone >= way else gone / way
        x, y = here[0] + share * ahead, here[1] + share * aside
        for i in range(auvs):
            off_x, off_y = outlook.courses[k, i, 0] - x, outlook.courses[k, i, 1] - y
            apart = hypot(off_x, off_y)
            place = apart / errors.step_m
            if place > errors.table.shape[1] - 1:
                continue
            low = min(int(place), errors.table.shape[1] - 2)
            part = place - low
            row, further = errors.table[i, low], errors.table[i, low + 1]
            chance = row[0] + part * (further[0] - row[0])
            along = chance / (row[1] + part * (further[1] - row[1]))
            across = chance / (row[2] + part * (further[2] - row[2]))
            cosine, sine = (off_x / apart, off_y / apart) if apart > 0.0 else (1.0, 0.0)
            heard[k, i, 0] += along * cosine**2 + across * sine**2
            heard[k, i, 1] += (along - across) * cosine * sine
            heard[k, i, 2] += along * sine**2 + across * cosine**2
            heard[k, i, 3] *= 1.0 - chance


@inlined
def _size(xx: float, xy: float, yy: float, by_trace: bool) -> float:
    """Return the size (m2) of a covariance: its trace, or twice the root of its determinant."""
    return xx + yy if by_trace else 2.0 * sqrt(max(xx * yy - xy * xy, 0.0))


@compiled
def _costs(
    tried: Floats, here: Floats, speed: float, outlook: Outlook, errors: FixErrors,
    others: Floats, by_trace: bool,
) -> Floats:  # fmt: skip
    """Return the cost (m2) of each target `tried` (c, 2), m, of one ASV at `here` (2,), given what
    `others` hear, (k, n, 4) as of :func:`_hear`.
    """
    steps, auvs = outlook.courses.shape[0], outlook.courses.shape[1]
    found, heard = np.empty(tried.shape[0]), np.empty_like(others)
    for c in range(tried.shape[0]):
        heard[:] = others
        _hear(tried[c], here, speed, outlook, errors, heard)
        total = 0.0
        for i in range(auvs):
            xx = yy = 0.5 * outlook.left_m2[i]
            xy, fixed = 0.0, 0  # the step at whose end it was fixed last; 0: before the horizon
            for k in range(steps):
                past = outlook.drift_m2[i, k + 1 - fixed] if fixed else outlook.older_m2[i, k]
                pxx, pyy = xx + 0.5 * past, yy + 0.5 * past
                total += _size(pxx, xy, pyy, by_trace)
                chance = 1.0 - heard[k, i, 3]
                if chance > 0.0:
                    jxx, jxy, jyy = heard[k, i, 0], heard[k, i, 1], heard[k, i, 2]
                    jxx, jxy, jyy = jxx / chance, jxy / chance, jyy / chance
                    det = pxx * pyy - xy * xy
                    axx, axy, ayy = pyy / det + jxx, jxy - xy / det, pxx / det + jyy
                    det = axx * ayy - axy * axy
                    xx = (1.0 - chance) * pxx + chance * ayy / det
                    yy = (1.0 - chance) * pyy + chance * axx / det
                    xy = (1.0 - chance) * xy - chance * axy / det
                    fixed, past = k + 1, 0.0
                total += _size(xx + 0.5 * past, xy, yy + 0.5 * past, by_trace)
        found[c] = total / (2.0 * steps * auvs)
    return found
