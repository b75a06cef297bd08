"""The errors of each AUV over time, propagated through the fixes that it may expect.

A fix that may fail to come leaves a mixture of both cases, weighted with their probabilities.  A
smoother combines two marches, one of them from the end, each with its estimate of the position;
what both know of the sources of drift, and a smoother's lag, are left out.
"""

from dataclasses import replace
from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from ....core.navigation.fix_update import WEIGHED, joseph, write_gain
from ....support.arrays import Floats, Ints
from ....support.compiled import compiled, inlined
from .drift import FRAMES, NOT_AT_ALL, Drifts, DriftState, carry, moment_at
from .inputs import DriftSource, Inputs, PredictedNavigator
from .rounds import Turns
from .sights import Fixes

Noise = tuple[float, float, float]


class ExpectedFix(NamedTuple):
    """A fix: its noise xx, yy, xy (m2), true and the filter's, and its slopes over states (2, k).

    The last two states may be the error that it has in common with other fixes.
    """

    noise: Noise
    thought: Noise
    slopes: Floats


@compiled
def correct(
    state: DriftState, fix: ExpectedFix, fixes: float, gain: float, behind: tuple[float, float]
) -> None:
    """Update `state` in place with `fixes` equal fixes at once.

    Fewer than one is a probability; the errors are then those of a mixture, exact in mean and
    covariance for a fixed gain and an upper bound for a weighed one (Sinopoli et al., IEEE Trans.
    Automatic Control 49(9), 2004).  The compared estimate is `behind` (x, y; m) the position of the
    fix.
    """
    rows, true, believed = state
    chance, share = min(fixes, 1.0), 1.0 / max(fixes, 1.0)
    noise, thought = _scaled(fix.noise, share), _scaled(fix.thought, share)
    gains, moved = np.empty(fix.slopes.shape), np.empty(len(true))
    write_gain(gains, believed, fix.slopes, thought, gain)
    for row in range(len(rows) - 1, -1, -1):
        x, y = behind if row == 0 else (0.0, 0.0)
        for k in range(len(true)):
            x += fix.slopes[0, k] * rows[row, k]
            y += fix.slopes[1, k] * rows[row, k]
        for k in range(len(true)):
            moved[k] = gains[0, k] * x + gains[1, k] * y
            rows[row, k] -= chance * moved[k]
    for spread, own in ((true, noise), (believed, thought)):
        before = spread.copy()
        joseph(spread, gains, fix.slopes, own)
        spread[:] = before + chance * (spread - before)
    for i in range(len(true)):
        for j in range(len(true)):
            true[i, j] += chance * (1.0 - chance) * moved[i] * moved[j]


@inlined
def _scaled(noise: Noise, share: float) -> Noise:
    return noise[0] * share, noise[1] * share, noise[2] * share


# A smaller probability of a fix counts as none.
NONE = 1e-9

# The number of instants whose errors are correlated with all later ones.
ANCHORS = 6


class Errors(NamedTuple):
    """The errors of n AUVs at k instants: mean (n, k, 2; m), xx, yy, xy (n, k, 3; m2).

    `alike` (n, a, k) is the correlation of squared errors with those at the a earlier instants
    `since` (n, a); -1 marks an unused one.
    """

    mean: Floats
    covariance: Floats
    alike: Floats
    since: Ints


class MarchedWays(NamedTuple):
    """The paths of n AUVs at k instants, `step` (s) apart: positions (n, k, 2; m), and the
    integrals of cosine and sine of headings (n, k, 2; s).
    """

    step: float
    places: Floats
    headings: Floats


def errors_of(inputs: Inputs, turns: Turns, fixes: Fixes) -> Errors:
    """Return the errors of all AUVs with the fixes that their rounds may bring."""
    found = [
        _errors_of(inputs, navigator, *_of(members, inputs, turns, fixes))
        for members, navigator in inputs.navigators
    ]
    if len(found) == 1:
        return found[0]
    order = np.argsort([auv for members, _ in inputs.navigators for auv in members])
    return Errors(*(np.concatenate(parts)[order] for parts in zip(*found, strict=True)))


# The fields of turns with a row for each AUV
OF_EACH = tuple(name for name in Turns._fields if name != "many")


def _of(
    members: list[int], inputs: Inputs, turns: Turns, fixes: Fixes
) -> tuple[MarchedWays, Turns, Fixes]:
    """Return the paths, turns and fixes of some AUVs."""
    ways = inputs.ways
    own = MarchedWays(float(ways.times_s[1]), ways.places_m, ways.headings_s)
    if len(members) == len(ways.depths_m):
        return own, turns, fixes
    return (
        own._replace(places=own.places[members], headings=own.headings[members]),
        turns._replace(**{name: getattr(turns, name)[members] for name in OF_EACH}),
        Fixes(*(part[members] for part in fixes)),
    )


def _errors_of(
    inputs: Inputs, navigator: PredictedNavigator, ways: MarchedWays, turns: Turns, fixes: Fixes
) -> Errors:
    """Return the predicted errors of AUVs that have the same navigation."""
    drifts, begin = drifts_of(inputs, navigator)
    gain = 0.0 if navigator.kind.ignores_fixes else WEIGHED
    if navigator.kind.has_gain:
        gain = navigator.gain
    return Errors(*_march(ways, turns, fixes, gain, navigator.at_ping, drifts, begin))


def drifts_of(inputs: Inputs, navigator: PredictedNavigator) -> tuple[Drifts, DriftState]:
    """Return the sources of drift, and the errors at the start.

    The fixes' common error is a pair without a unit, which slopes of fixes (m) multiply.
    """
    systematic = inputs.systematic
    sources, frames = navigator.sources, [FRAMES[own.frame] for own in navigator.sources]
    if not systematic.is_none:
        assumed = (1.0, 1.0) if systematic.is_estimated else (0.0, 0.0)
        sources = (*sources, DriftSource("none", (0.0, 0.0), (1.0, 1.0), assumed))
        frames.append(NOT_AT_ALL)
    rows = np.zeros((1 + 2 * ANCHORS, 2 + 2 * len(sources)))
    rows[0, 2:] = [mean for own in sources for mean in own.mean]
    drawn = np.array([sd * sd for own in sources for sd in own.drawn_sd])
    thought = np.array([sd * sd for own in sources for sd in own.assumed_sd])
    start, believed = navigator.start_sd_m**2, navigator.assumed_start_sd_m**2
    state = DriftState(
        rows,
        np.diag([start, start, *drawn]),
        np.diag([believed, believed, *thought]),
    )
    drifts = Drifts(
        np.array(frames, dtype=np.int64),
        np.array([own.time_constant_s or inf for own in sources], dtype=np.float64),
        np.array([own.wander_per_s for own in sources], dtype=np.float64),
        drawn,
        thought,
        navigator.walk_m2_per_s,
        navigator.assumed_walk_m2_per_s,
        not systematic.is_none,
    )
    return drifts, state


@compiled
def _march(
    ways: MarchedWays,
    turns: Turns,
    fixes: Fixes,
    gain: float,
    at_ping: bool,
    drifts: Drifts,
    first: DriftState,
) -> tuple[Floats, Floats, Floats, Ints]:
    """Return the fields of :class:`Errors`.

    Fixes hold at their ping (`at_ping`) or at their delivery, and have a fixed `gain` or are
    WEIGHED.
    """
    step, (auvs, instants, _) = ways.step, ways.places.shape
    means, spreads = np.empty((auvs, instants, 2)), np.empty((auvs, instants, 3))
    alike, since = np.zeros((auvs, ANCHORS, instants)), np.full((auvs, ANCHORS), -1)
    state, ahead = _copied(first), _copied(first)
    for auv in range(auvs):
        _copy(first, state)
        way, turned = ways.places[auv], ways.headings[auv]
        known, next_one, anchors = moment_at(0.0, step, way, turned), 0, 0
        for turn in range(turns.pinged_s.shape[1] + 1):
            until = holds = inf
            if turn < turns.pinged_s.shape[1]:
                if turns.chance[auv, turn] < NONE:
                    continue
                until = turns.delivered_s[auv, turn]
                holds = turns.pinged_s[auv, turn] if at_ping else until
            while next_one < instants and next_one * step < until:
                then = moment_at(next_one * step, step, way, turned)
                is_anchor = anchors < ANCHORS and then.time <= holds
                if is_anchor and next_one >= (2 * anchors + 1) * instants // (2 * ANCHORS):
                    carry(state, known, then, drifts)
                    known = then
                    for axis in range(2):
                        state.rows[1 + 2 * anchors + axis] = state.true[axis]
                    since[auv, anchors] = next_one
                    anchors += 1
                _copy(state, ahead)
                carry(ahead, known, then, drifts)
                _note(ahead, means[auv, next_one], spreads[auv, next_one])
                for anchor in range(anchors):
                    begin = since[auv, anchor]
                    alike[auv, anchor, next_one] = _alike(
                        ahead.rows, anchor, means[auv], spreads[auv], begin, next_one
                    )
                next_one += 1
            if next_one == instants:
                break
            then = moment_at(holds, step, way, turned)
            carry(state, known, then, drifts)
            at, kind = turns.at[auv, turn], turns.kind[auv, turn]
            fix = _fix(fixes.noise[auv, at, kind], fixes.lasts[auv, at, kind], drifts)
            here = moment_at(turns.pinged_s[auv, turn], step, way, turned)
            behind = then.x - here.x, then.y - here.y
            correct(state, fix, turns.many * turns.chance[auv, turn], gain, behind)
            if drifts.has_common:
                drifts.time_constants[-1] = 1.0 / fixes.rate[auv, at, kind]
            known = then
    return means, spreads, alike, since


@compiled
def _copied(state: DriftState) -> DriftState:
    return DriftState(state.rows.copy(), state.true.copy(), state.believed.copy())


@compiled
def _copy(state: DriftState, out: DriftState) -> None:
    for i in range(state.rows.shape[0]):
        for j in range(state.rows.shape[1]):
            out.rows[i, j] = state.rows[i, j]
    for i in range(len(state.true)):
        for j in range(len(state.true)):
            out.true[i, j], out.believed[i, j] = state.true[i, j], state.believed[i, j]


@compiled
def _note(state: DriftState, mean: Floats, spread: Floats) -> None:
    mean[0], mean[1] = state.rows[0, 0], state.rows[0, 1]
    spread[0], spread[1], spread[2] = state.true[0, 0], state.true[1, 1], state.true[0, 1]


@compiled
def _alike(
    rows: Floats, anchor: int, means: Floats, spreads: Floats, begin: int, end: int
) -> float:
    """Return the correlation of the squared errors at two instants."""
    first, second = rows[1 + 2 * anchor], rows[2 + 2 * anchor]
    m, n = means[begin], means[end]
    together = 2.0 * (first[0] ** 2 + first[1] ** 2 + second[0] ** 2 + second[1] ** 2)
    together += 4.0 * m[0] * (first[0] * n[0] + first[1] * n[1])
    together += 4.0 * m[1] * (second[0] * n[0] + second[1] * n[1])
    apart = _varies(m, spreads[begin]) * _varies(n, spreads[end])
    return float(together / sqrt(apart)) if apart > 0.0 else 0.0


@compiled
def _varies(m: Floats, spread: Floats) -> float:
    """Return the variance (m4) of an error's square, from its mean (2,) and xx, yy, xy (3,)."""
    xx, yy, xy = spread[0], spread[1], spread[2]
    own = 2.0 * (xx * xx + yy * yy + 2.0 * xy * xy)
    return float(own + 4.0 * (m[0] * m[0] * xx + m[1] * m[1] * yy + 2.0 * m[0] * m[1] * xy))


@compiled
def _fix(noise: Floats, lasts: Floats, drifts: Drifts) -> ExpectedFix:
    """Return a fix from its own noise and its common error `lasts`, each xx, yy, xy (3,; m2)."""
    own, last = (noise[0], noise[1], noise[2]), 2 * drifts.frames.size
    thought, slopes = own, np.eye(2, 2 + last)
    if drifts.has_common:
        if drifts.assumed[last - 2] == 0.0:  # a filter without that state takes it for noise
            thought = own[0] + lasts[0], own[1] + lasts[1], own[2] + lasts[2]
        xx = sqrt(lasts[0])
        yx = lasts[2] / xx if xx > 0.0 else 0.0
        slopes[0, last], slopes[1, last] = xx, yx
        slopes[1, last + 1] = sqrt(max(lasts[1] - yx * yx, 0.0))
    return ExpectedFix(own, thought, slopes)


# The standard deviation (m) of an unknown position.
ANYWHERE_M = 1e4


def smoothed(inputs: Inputs, turns: Turns, fixes: Fixes) -> Errors:
    """Return the errors of all AUVs with all fixes of the mission, earlier and later."""
    forward = errors_of(inputs, turns._replace(delivered_s=turns.pinged_s), fixes)
    back = errors_of(*_backwards(inputs, turns, fixes))
    before, after = _second_moments(forward), _second_moments(back)[:, ::-1]
    covariance = _both(before, after)
    return forward._replace(mean=np.zeros(forward.mean.shape), covariance=covariance)


def _backwards(inputs: Inputs, turns: Turns, fixes: Fixes) -> tuple[Inputs, Turns, Fixes]:
    """Return the mission in reverse, from an unknown state at its end."""
    ways, navigator, end = inputs.ways, inputs.navigator, inputs.duration_s
    last = len(ways.times_s) - 1
    headings = ways.headings_s[:, -1:] - ways.headings_s[:, ::-1]
    way = replace(ways, places_m=ways.places_m[:, ::-1].copy(), headings_s=headings)
    unknown = replace(
        navigator,
        start_sd_m=ANYWHERE_M,
        assumed_start_sd_m=ANYWHERE_M,
        sources=_unknown(navigator.sources),
    )
    others = tuple(replace(own, sources=_unknown(own.sources)) for own in inputs.others)
    pinged = end - turns.pinged_s[:, ::-1]
    turned = turns._replace(
        pinged_s=pinged,
        delivered_s=pinged,
        chance=turns.chance[:, ::-1].copy(),
        at=last - turns.at[:, ::-1],
        kind=np.ascontiguousarray(turns.kind[:, ::-1]),
    )
    own = Fixes(*(np.ascontiguousarray(part[:, ::-1]) for part in fixes))
    return replace(inputs, ways=way, navigator=unknown, others=others), turned, own


def _unknown(sources: tuple[DriftSource, ...]) -> tuple[DriftSource, ...]:
    """Return sources of drift whose values are unknown at first, as the filter assumes them."""
    return tuple(replace(source, mean=(0.0, 0.0), drawn_sd=source.assumed_sd) for source in sources)


def _second_moments(errors: Errors) -> Floats:
    """Return the second moments xx, yy, xy (n, k, 3; m2) of errors about zero."""
    x, y = errors.mean[..., 0], errors.mean[..., 1]
    return np.asarray(errors.covariance + np.stack((x * x, y * y, x * y), axis=-1))


def _both(one: Floats, other: Floats) -> Floats:
    """Return the covariance A - A (A + B)^-1 A of two independent estimates combined, (n, k, 3)."""
    xx, yy, xy = (one[..., k] for k in range(3))
    a, b, c = (one[..., k] + other[..., k] for k in range(3))
    determinant = np.maximum(a * b - c * c, 1e-30)
    out = np.empty(one.shape)
    out[..., 0] = xx - (b * xx * xx - 2.0 * c * xx * xy + a * xy * xy) / determinant
    out[..., 1] = yy - (b * xy * xy - 2.0 * c * xy * yy + a * yy * yy) / determinant
    out[..., 2] = xy - (b * xx * xy - c * (xx * yy + xy * xy) + a * xy * yy) / determinant
    return np.asarray(np.maximum(out, np.array((0.0, 0.0, -np.inf))))
