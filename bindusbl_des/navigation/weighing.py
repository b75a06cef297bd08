"""How a fix changes a belief: what it says of the error, and how much of that is taken in."""

from math import hypot, nan
from typing import NamedTuple

from ..core.compiled import compiled
from ..vehicles.expected_drift import Told
from ..vehicles.motion import Floats
from .belief import Belief
from .common_errors import Noise, Said

# A gain that is worked out anew for each fix from the covariances.
WEIGHED = -1.0

# After so many refused in a row it is the belief that is wrong, and the next fix is taken in.
MOST_REFUSED = 5

# An AUV is sure in a direction when det P is below this share of the square of tr P.
SURE = 1e-12


class Rule(NamedTuple):
    """How a fix changes a belief.

    `gain` is the share of the innovation that goes to the position, or WEIGHED; a fix is compared
    with what is believed of the instant at which it holds (`at_ping`), or of its delivery, as the
    paper does.  A fix whose normalised innovation squared exceeds the `gate` is refused; 0: none.
    """

    gain: float
    at_ping: bool
    gate: float


@compiled
def weigh(belief: Belief, gain: Floats, x: float, y: float, noise: Noise, common: Floats) -> None:
    """Take a measured error of dead reckoning in, in the place of `belief`, by a gain (k, 2).

    It is off (`x`, `y`), m, from the one believed; its covariance is `noise` (xx, yy, xy), m2.
    `common` (2, n), m per unit, is what the last n states add to the fix that it comes from.
    Joseph's form, P = (1 - K H) P (1 - K H)^T + K R K^T, is right for any gain.  Source: Y.
    Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation,
    2001, eq. 5.2.3-18.
    """
    state, spread = belief.state, belief.covariance
    xx, yy, xy = noise
    begin = state.size - common.shape[1]
    for k in range(state.size):
        state[k] += gain[k, 0] * x + gain[k, 1] * y
    for k in range(state.size):
        first, second = spread[0, k], spread[1, k]
        for c in range(common.shape[1]):
            first -= common[0, c] * spread[begin + c, k]
            second -= common[1, c] * spread[begin + c, k]
        for i in range(state.size):
            spread[i, k] -= gain[i, 0] * first + gain[i, 1] * second
    for k in range(state.size):
        first, second = spread[k, 0], spread[k, 1]
        for c in range(common.shape[1]):
            first -= common[0, c] * spread[k, begin + c]
            second -= common[1, c] * spread[k, begin + c]
        for i in range(state.size):
            spread[k, i] -= gain[i, 0] * first + gain[i, 1] * second
    for i in range(state.size):
        over, beside = gain[i, 0] * xx + gain[i, 1] * xy, gain[i, 0] * xy + gain[i, 1] * yy
        for k in range(state.size):
            spread[i, k] += over * gain[k, 0] + beside * gain[k, 1]


@compiled
def take(
    belief: Belief, said: Said, common: Floats, told: Told, rule: Rule, share: Floats
) -> tuple[float, float, bool]:
    """Correct a belief by what a fix says, in its place; `told` is dead reckoning of its instant.

    `common` as of :func:`weigh`; `share` (k, 2) is written over.  Return the length of the
    innovation (m), its normalised square (NaN where nothing is unsure), and whether the gate let
    it pass.
    """
    moment, state, noise = belief.moment[0], belief.state, said.noise
    begin = state.size - common.shape[1]
    ahead = said.x - (told.x - state[0])
    aside = said.y - (told.y - state[1])
    _tell(share, belief.covariance, common)
    xx, yy, xy = share[0, 0], share[1, 1], share[0, 1]
    for c in range(common.shape[1]):
        ahead -= common[0, c] * state[begin + c]
        aside -= common[1, c] * state[begin + c]
        xx -= common[0, c] * share[begin + c, 0]
        yy -= common[1, c] * share[begin + c, 1]
        xy -= common[0, c] * share[begin + c, 1]
    xx, yy, xy = xx + noise[0], yy + noise[1], xy + noise[2]
    determinant = xx * yy - xy * xy
    unsure = determinant > SURE * (xx + yy) ** 2
    weight = nan
    if unsure:
        weight = (yy * ahead * ahead - 2.0 * xy * ahead * aside + xx * aside * aside) / determinant
    if rule.gate > 0.0 and weight > rule.gate and moment.refused < MOST_REFUSED:
        moment.refused += 1
        return hypot(ahead, aside), weight, False
    moment.refused = 0
    for k in range(state.size):
        first, second = share[k, 0], share[k, 1]
        share[k, 0] = share[k, 1] = 0.0
        if rule.gain != WEIGHED:
            if k < 2:
                share[k, k] = rule.gain
        elif unsure:
            share[k, 0] = (first * yy - second * xy) / determinant
            share[k, 1] = (second * xx - first * xy) / determinant
    # a fix ahead of the estimate says that dead reckoning is less far ahead than believed
    weigh(belief, share, -ahead, -aside, noise, common)
    return hypot(ahead, aside), weight, True


@compiled
def _tell(share: Floats, spread: Floats, common: Floats) -> None:
    """Write the covariances (k, 2) of all states with what a fix says of the error."""
    begin = spread.shape[0] - common.shape[1]
    for k in range(spread.shape[0]):
        for axis in range(2):
            share[k, axis] = spread[k, axis]
            for c in range(common.shape[1]):
                share[k, axis] -= common[axis, c] * spread[k, begin + c]
