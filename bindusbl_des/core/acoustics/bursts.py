"""Losses in bursts: the luck of a pair of vehicles lasts, so that a pair that loses a signal goes
on losing for a while.

Each pair is a two-state chain, continuous in time (E. N. Gilbert, Bell System Technical Journal 39,
1960): losses last `burst_s` (s) on average, and take the share p of the time, the channel's loss
probability at that range.  So the pair leaves the lost state at the rate 1 / burst_s, and enters it
at p / ((1 - p) burst_s).

The same chain in a form in which p may change with range: the pair's luck is drawn anew at the
instants of a Poisson process of rate 1 / ((1 - p) burst_s), and a signal is lost if its luck, as a
uniform number, is below p.  As p changes, the rate does: the instants at a lower rate are those at
a higher one, thinned.  Whatever the history of p, the share lost is p; where p is constant, losses
last for exponential times of mean burst_s.  Luck is a function of pair and instant alone: neither
how often vehicles ping nor what is decided first changes the sea.
"""

from math import ceil, floor, log2

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled
from ...support.streams import Purpose, Streams, normal, pair_keys, uniform
from ..records.rows import Row, Rows
from .loss import chance_of

# A pair of an AUV and an ASV: the key that draws its luck, and the mean length of losses (s)
PAIR = np.dtype([("key", "u8"), ("burst_s", "f8")])

# The largest p that counts, 1 - 2^-20: signals lost more often are out of range.
LAYERS = 20
MOST = 1.0 - 2.0**-LAYERS

# Random numbers of a cell: its number of renewals; of each its time, its mark, and two for its luck
EACH, MOST_IN_CELL = 4, 15


def pairs(burst_s: float, streams: Streams, purpose: Purpose, auvs: int, asvs: int) -> Rows:
    """Return the keys of each pair's luck, (auvs, asvs), :data:`PAIR`."""
    found = np.empty((auvs, asvs), PAIR)
    found["burst_s"] = burst_s
    for auv in range(auvs):
        found["key"][auv] = pair_keys(streams, purpose, auv, asvs)
    return found


@compiled
def _renewals_in(key: np.uint64, layer: int, cell: int) -> int:
    """Return the number of renewals in a cell, a Poisson number of mean 1."""
    chance, count, term = uniform(key, layer, cell, 0), 0, np.exp(-1.0)
    total = term
    while chance >= total and count < MOST_IN_CELL:
        count += 1
        term /= count
        total += term
    return count


@compiled
def renewed(key: np.uint64, burst_s: float, time: float, loss: float) -> tuple[float, float]:
    """Return the instant (s) of a pair's last renewal before an instant (s), and its luck since
    then, a standard normal; `loss` is the loss probability at the instant.

    Renewals at the largest rate are points of time and mark, with density 1 / burst_s per unit of
    the mark; at the rate `pace` / burst_s those with a mark below `pace` count.  Layer 0 has marks
    below 1, layer n marks from 2^(n-1) to 2^n, in cells that hold one point on average.  The search
    for the last one begins in layers where all marks count and points are dense, so that it ends
    early in the others.
    """
    pace = 1.0 / (1.0 - min(max(loss, 0.0), MOST))
    top = max(0, ceil(log2(pace)))
    since, luck = -np.inf, 0.0
    for step in range(top + 1):
        layer = top - 1 - step if step < top else top
        least = 0.0 if layer == 0 else 2.0 ** (layer - 1)
        span = max(least, 1.0)
        width = burst_s / span
        cell = floor(time / width)
        while (cell + 1) * width > since:
            for point in range(_renewals_in(key, layer, cell)):
                number = 1 + EACH * point
                at = (cell + uniform(key, layer, cell, number)) * width
                counts = least + span * uniform(key, layer, cell, number + 1) < pace
                if counts and since < at <= time:
                    since, luck = at, normal(key, layer, cell, number + 2)
            cell -= 1
    return since, luck


@compiled
def burst_luck(pair: Row, time: float, loss: float) -> float:
    """Return the luck of a pair at `time` (s), a standard normal; `loss` as of :func:`renewed`."""
    _, luck = renewed(pair.key, pair.burst_s, time, loss)
    return luck


@compiled
def lost_since(pair: Row, time: float, loss: float) -> float:
    """Return since when (s) a pair has lost all signals, had their loss probability been constant;
    NaN if it loses none at this instant (s).
    """
    if loss >= 1.0:  # no renewal ends this
        return 0.0
    begun = np.nan
    since, luck = renewed(pair.key, pair.burst_s, time, loss)
    while chance_of(luck) < loss and since > 0.0:
        begun = since
        since, luck = renewed(pair.key, pair.burst_s, np.nextafter(since, -np.inf), loss)
    return 0.0 if chance_of(luck) < loss else begun


@compiled
def burst_chances(of: Rows, time: float, losses: Floats) -> Floats:
    """Return the luck of pairs (n,), :data:`PAIR`, at an instant (s), as numbers in [0, 1), (n,): a
    signal is lost if its number is below its loss probability, `losses` (n,).
    """
    out = np.empty(losses.size)
    for k in range(losses.size):
        out[k] = chance_of(burst_luck(of[k], time, losses[k]))
    return out
