"""The errors of each AUV over time: a march through the fixes that it may expect."""

from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled, entry
from .correction import WEIGHED, correct
from .drift import FRAMES, Drifts, State, carry, moment_at
from .inputs import Inputs
from .parts import Navigator
from .rounds import Turns
from .sights import Fixes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Fixes less likely than this are none.
NONE = 1e-9


class Errors(NamedTuple):
    """The errors of n AUVs at k instants: true mean (n, k, 2), m, and covariance xx, yy, xy
    (n, k, 3), m2.
    """

    mean: Floats
    covariance: Floats


def errors_of(inputs: Inputs, turns: Turns, fixes: Fixes) -> Errors:
    """Return the errors of all AUVs by what they may expect of the rounds."""
    navigator, ways = inputs.navigator, inputs.ways
    drifts, begin = drifts_of(navigator)
    gain = {"fixed_gain": navigator.gain, "dead_reckoning": 0.0}.get(navigator.filter, WEIGHED)
    out = _march(
        float(ways.times_s[1]), ways.places_m, ways.headings_s, *turns, fixes.noise, fixes.lasts,
        gain, navigator.at_ping, *drifts, *begin,
    )  # fmt: skip
    return Errors(*out)


def drifts_of(navigator: Navigator) -> tuple[Drifts, State]:
    """Return what makes errors grow, and what they are at the start."""
    sources = navigator.sources
    mean = np.array([0.0, 0.0, *(it for own in sources for it in own.mean)])
    drawn = np.array([it * it for own in sources for it in own.drawn_sd])
    told = np.array([it * it for own in sources for it in own.told_sd])
    start, believed = navigator.start_sd_m**2, navigator.told_start_sd_m**2
    state = State(
        mean,
        np.diag(np.concatenate(([start, start], drawn))),
        np.diag(np.concatenate(([believed, believed], told))),
    )
    drifts = Drifts(
        np.array([FRAMES[own.frame] for own in sources], dtype=np.int64),
        np.array([own.time_constant_s or inf for own in sources], dtype=np.float64),
        np.array([own.wander_per_s for own in sources], dtype=np.float64),
        drawn,
        told,
        navigator.walk_m2_per_s,
        navigator.told_walk_m2_per_s,
    )
    return drifts, state


@entry
def _march(
    step: float, places: Floats, headings: Floats,
    pinged: Floats, told: Floats, chance: Floats, at: Ints, kind: Ints, many: int,
    noise: Floats, lasts: Floats, gain: float, at_ping: bool,
    frames: Ints, time_constants: Floats, wanders: Floats, variances: Floats, believed: Floats,
    walk: float, told_walk: float, mean: Floats, true: Floats, thought: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    drifts = Drifts(frames, time_constants, wanders, variances, believed, walk, told_walk)
    auvs, instants = places.shape[0], places.shape[1]
    means, spreads = np.empty((auvs, instants, 2)), np.empty((auvs, instants, 3))
    ahead = State(mean.copy(), true.copy(), thought.copy())
    for auv in range(auvs):
        state = State(mean.copy(), true.copy(), thought.copy())
        way, turned = places[auv], headings[auv]
        known, lasting, next_one = moment_at(0.0, step, way, turned), np.zeros(3), 0
        for turn in range(pinged.shape[1] + 1):
            until = inf
            if turn < pinged.shape[1]:
                if chance[auv, turn] < NONE:
                    continue
                until = told[auv, turn]
            while next_one < instants and next_one * step < until:
                _copy(state, ahead)
                carry(ahead, known, moment_at(next_one * step, step, way, turned), drifts)
                _note(ahead, lasting, means[auv, next_one], spreads[auv, next_one])
                next_one += 1
            if next_one == instants:
                break
            holds = pinged[auv, turn] if at_ping else until
            then = moment_at(holds, step, way, turned)
            carry(state, known, then, drifts)
            place, which = at[auv, turn], kind[auv, turn]
            own = noise[auv, place, which]
            here = moment_at(pinged[auv, turn], step, way, turned)
            behind = then.x - here.x, then.y - here.y
            fixes = many * chance[auv, turn]
            correct(state, (own[0], own[1], own[2]), fixes, gain, behind)
            share = min(fixes, 1.0)
            for k in range(3):
                lasting[k] += share * (lasts[auv, place, which, k] - lasting[k])
            known = then
    return means, spreads


@compiled
def _copy(state: State, out: State) -> None:
    for i in range(state.mean.size):
        out.mean[i] = state.mean[i]
        for j in range(state.mean.size):
            out.true[i, j], out.believed[i, j] = state.true[i, j], state.believed[i, j]


@compiled
def _note(state: State, lasting: Floats, mean: Floats, spread: Floats) -> None:
    mean[0], mean[1] = state.mean[0], state.mean[1]
    spread[0] = state.true[0, 0] + lasting[0]
    spread[1] = state.true[1, 1] + lasting[1]
    spread[2] = state.true[0, 1] + lasting[2]
