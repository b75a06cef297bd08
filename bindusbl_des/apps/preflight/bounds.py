"""Bounds for any protocol: slots of a round, pings at an ASV, records and fixes.

Two AUVs that the same ASV hears conflict, so the conflict graph is a union of cliques, one of each
ASV; it bounds the slots of a conflict-free round from below, and their reuse from above.  `heard`
(n, m) tells which AUVs are in range of which ASVs.  Rates and latencies do not depend on a
schedule.
"""

import math
from collections.abc import Callable

import numpy as np

from ...core.protocol.conflicts import GROUPINGS
from ...support.arrays import Flags

# Up to so many AUVs the chromatic number is found exactly; beyond, it may stay between two bounds.
EXACT_UP_TO = 20

# DSATUR looks at each pair of AUVs, which takes minutes for larger fleets.
MOST_BY_DSATUR = 10_000


def most_heard(heard: Flags) -> int:
    """Return max_k n_k, the number of AUVs that the busiest ASV hears: each needs a slot of its
    own.

    >>> most_heard(np.array([[True, False], [True, True], [False, True]]))
    2
    """
    return int(heard.sum(axis=0).max(initial=0))


def reuse_bound(heard: Flags) -> float:
    """Return the largest possible mean number of heard AUVs that ping in one slot.

    In a slot an ASV hears one ping, so it is min(K, N / max_k n_k) for N AUVs that K ASVs hear; 1
    where no AUV is heard.

    >>> reuse_bound(np.array([[True, False], [True, True], [False, True]]))
    1.5
    """
    most = most_heard(heard)
    if not most:
        return 1.0
    listeners, auvs = int(heard.any(axis=0).sum()), int(heard.any(axis=1).sum())
    return min(float(listeners), auvs / most)


def clique_number(heard: Flags) -> int | None:
    """Return the largest number of AUVs that all conflict with each other; None for large fleets.

    It may exceed `most_heard`: of three AUVs, each pair may have an ASV of its own.

    >>> clique_number(np.array([[True, True, False], [True, False, True], [False, True, True]]))
    3
    """
    if len(heard) > EXACT_UP_TO:
        return None
    neighbours = _neighbours(heard)
    return _largest_clique(neighbours, 0, (1 << len(heard)) - 1, 0)


def _largest_clique(neighbours: list[int], size: int, candidates: int, best: int) -> int:
    """Return `best`, or the size of the largest clique that extends one of `size` by
    `candidates`.
    """
    while candidates:
        if size + candidates.bit_count() <= best:
            return best
        auv = candidates.bit_length() - 1
        candidates ^= 1 << auv
        best = _largest_clique(neighbours, size + 1, candidates & neighbours[auv], best)
    return max(best, size)


def fewest_groups(heard: Flags) -> tuple[int, int]:
    """Return bounds of the chromatic number of the conflict graph, equal where it is known.

    It is known for small fleets, and wherever a colouring (DSATUR, or first fit for fleets too
    large for that) needs no more groups than one ASV hears AUVs.

    >>> fewest_groups(np.array([[True, True, False], [True, False, True], [False, True, True]]))
    (3, 3)
    """
    made = GROUPINGS["saturation" if len(heard) <= MOST_BY_DSATUR else "first_fit"]
    low, high = max(most_heard(heard), 1), len(made(heard))
    if low == high or len(heard) > EXACT_UP_TO:
        return low, high
    neighbours = _neighbours(heard)
    low = max(low, clique_number(heard) or 1)
    while low < high and not _colourable(neighbours, [0] * low, low):
        low += 1
    return low, low


def _colourable(neighbours: list[int], groups: list[int], most: int) -> bool:
    """Tell whether all AUVs not yet in a group fit into `groups` (bit sets), at most `most` of
    them.
    """
    placed = sum(groups)
    if placed.bit_count() == len(neighbours):
        return True
    free = [auv for auv in range(len(neighbours)) if not placed >> auv & 1]
    rooms = {
        auv: [number for number in range(most) if not groups[number] & neighbours[auv]]
        for auv in free
    }
    auv = min(free, key=lambda auv: (len(rooms[auv]), -neighbours[auv].bit_count()))
    begun = sum(map(bool, groups))  # empty groups are all alike
    for number in rooms[auv]:
        if number > begun:
            break
        groups[number] |= 1 << auv
        if _colourable(neighbours, groups, most):
            return True
        groups[number] ^= 1 << auv
    return False


def _neighbours(heard: Flags) -> list[int]:
    """Return the AUVs with which each AUV conflicts, as bit sets."""
    together = heard.astype(np.int64) @ heard.T.astype(np.int64) > 0
    np.fill_diagonal(together, val=False)
    return [sum(1 << other for other in np.flatnonzero(row).tolist()) for row in together]


def disjoint_senders(heard: Flags) -> int:
    """Return an upper bound of the number of ASVs that can broadcast at once without a common
    listener.

    It is the number of AUVs chosen until they hear every ASV: each of them hears one sender at a
    time.

    >>> disjoint_senders(np.array([[True, True, False], [False, False, True]]))
    2
    """
    left, count = heard[:, heard.any(axis=0)].copy(), 0
    while left.size:
        auv = int(left.sum(axis=1).argmax())
        left, count = left[:, ~left[auv]], count + 1
    return max(count, 1)


# The assumed time (s) in which the echoes of a ping die away at a receiver.
CLEARING_S = 0.020


def decode_bound(ping_s: float, clearing_s: float = CLEARING_S) -> float:
    """Return how many pings (1/s) an ASV can decode: arrivals do not overlap, 1/(T_P + T_clear).

    For several ASVs it is multiplied by their number.

    >>> round(decode_bound(0.010), 1)
    33.3
    """
    return 1.0 / (ping_s + clearing_s)


def aloha_capacity(ping_s: float, auvs: int) -> float:
    """Return how many pings (1/s) of `auvs` in ALOHA an ASV decodes at the best load.

    All AUVs are heard and ping at Poisson instants: max over G of G exp(-2 G (N-1)/N) / T_P, at G =
    N / (2 (N-1)).  For many AUVs it is the 1/(2e) of Abramson (1970); a single AUV collides with no
    other and may ping without a pause.

    >>> round(aloha_capacity(1.0, 1000), 3), aloha_capacity(0.5, 1)
    (0.184, 2.0)
    """
    return _best_of(auvs, vulnerable=2) / ping_s


def slotted_aloha_capacity(slot_s: float, auvs: int) -> float:
    """Return the capacity (1/s) of slotted ALOHA, as :func:`aloha_capacity`: 1/e per slot of many
    AUVs.

    A ping is decoded if it is alone in its slot.  More are decoded where paths differ by more than
    a ping is long, so that arrivals of one slot follow each other.

    >>> round(slotted_aloha_capacity(1.0, 1000), 3)
    0.368
    """
    return _best_of(auvs, vulnerable=1) / slot_s


def _best_of(auvs: int, vulnerable: int) -> float:
    """Return the largest share of time in which an ASV decodes pings, for the best load.

    Others that begin within `vulnerable` ping lengths destroy a ping.
    """
    others = vulnerable * (auvs - 1) / auvs
    return min(1.0 / (math.e * others), 1.0) if others else 1.0


def record_bound(
    airtime: Callable[[int], float], fixes: int, senders: int, most: int
) -> tuple[float, int]:
    """Return how many records (1/s) frames can carry, back to back, and the number in a frame then.

    `senders` share `fixes` evenly, at once; `airtime` is that of a frame (s) with so many records,
    of which it holds `most`; headers count.  N AUVs with one record each in one frame make N /
    T_tx(N).

    >>> record_bound(lambda fixes: 0.0625 + 0.125 * fixes, 4, senders=2, most=10)
    (12.8, 2)
    """
    frames = range(1, min(-(-fixes // senders), most) + 1)
    return max((min(senders * each, fixes) / airtime(each), each) for each in frames)


def latency_bound(up_m: float, airtime_s: float, down_m: float, sound_speed: float) -> float:
    """Return the least latency (s) of a fix: path of its ping (m), airtime, path of its frame (m).

    >>> round(latency_bound(50.0, 0.192, 50.0, 1500.0), 4)
    0.2587
    """
    return (up_m + down_m) / sound_speed + airtime_s


def offered_load(senders: int, lasts_s: float, interval_s: float) -> float:
    """Return the load G = N T / F that N senders offer: T (s) a ping, or a slot, every F (s).

    >>> offered_load(10, 0.010, 1.0)
    0.1
    """
    return senders * lasts_s / interval_s


def slot_share(slot_s: float, interval_s: float) -> float:
    """Return the chance that a sender of slotted ALOHA pings in a slot (s), at mean intervals (s).

    >>> round(slot_share(0.1, 1.0), 4)
    0.0952
    """
    return -math.expm1(-slot_s / interval_s)


def aloha_success(load: float, senders: int) -> float:
    """Return the chance that a ping of pure ALOHA meets no other (Abramson 1970, N senders).

    >>> round(aloha_success(0.5, 10), 4), aloha_success(0.5, 1)
    (0.4066, 1.0)
    """
    return math.exp(-2.0 * load * (senders - 1) / senders)


def slotted_success(load: float, senders: int) -> float:
    """Return the chance that a ping of slotted ALOHA is alone in its slot (Roberts 1975, N
    senders).

    Two pings of a slot are both heard where their paths differ by more than a ping is long.

    >>> round(slotted_success(0.5, 10), 4)
    0.6376
    """
    return math.exp(-load * (senders - 1) / senders)
