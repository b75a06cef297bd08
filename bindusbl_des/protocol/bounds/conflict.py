"""Limits of the conflict graph: no conflict-free round has fewer slots, none reuses more.

AUVs are in conflict that some ASV hears both of, so the graph is a union of cliques, one of each
ASV.  `heard` (n, m) tells which ASVs each AUV is within range of.
"""

import numpy as np

from ..conflicts import Hearing, dsatur_groups

# Graphs of more AUVs that DSATUR does not settle are left with what is known of them.
EXACT_UP_TO = 20


def most_heard(heard: Hearing) -> int:
    """Return max_k n_k, how many AUVs the ASV hears that hears most: each needs a slot of its own.

    >>> most_heard(np.array([[True, False], [True, True], [False, True]]))
    2
    """
    return int(heard.sum(axis=0).max(initial=0))


def reuse_bound(heard: Hearing) -> float:
    """Return how many AUVs that are heard can ping in a slot on average, at most: in a slot an ASV
    hears one, so min(K, N / max_k n_k) of N that K ASVs hear; 1 where nobody is heard.

    >>> reuse_bound(np.array([[True, False], [True, True], [False, True]]))
    1.5
    """
    most = most_heard(heard)
    if not most:
        return 1.0
    listeners, auvs = int(heard.any(axis=0).sum()), int(heard.any(axis=1).sum())
    return min(float(listeners), auvs / most)


def clique_number(heard: Hearing) -> int | None:
    """Return how many AUVs are in conflict with each other, at most; None of a fleet that is large.

    It may be more than any ASV hears: of three AUVs each pair may have an ASV of its own.

    >>> clique_number(np.array([[True, True, False], [True, False, True], [False, True, True]]))
    3
    """
    if len(heard) > EXACT_UP_TO:
        return None
    neighbours = _neighbours(heard)
    return _largest_clique(neighbours, 0, (1 << len(heard)) - 1, 0)


def _largest_clique(neighbours: list[int], size: int, candidates: int, best: int) -> int:
    """Return the size of the largest clique that grows one of `size` by `candidates`, or `best`."""
    while candidates:
        if size + candidates.bit_count() <= best:
            return best
        auv = candidates.bit_length() - 1
        candidates ^= 1 << auv
        best = _largest_clique(neighbours, size + 1, candidates & neighbours[auv], best)
    return max(best, size)


def fewest_groups(heard: Hearing) -> tuple[int, int]:
    """Return between what the chromatic number of the conflict graph lies, the two equal where it
    is known: it is of small fleets, and wherever DSATUR needs no more groups than one ASV hears.

    >>> fewest_groups(np.array([[True, True, False], [True, False, True], [False, True, True]]))
    (3, 3)
    """
    low, high = max(most_heard(heard), 1), len(dsatur_groups(heard))
    if low == high or len(heard) > EXACT_UP_TO:
        return low, high
    neighbours = _neighbours(heard)
    low = max(low, clique_number(heard) or 1)
    while low < high and not _colourable(neighbours, [0] * low, low):
        low += 1
    return low, low


def _colourable(neighbours: list[int], groups: list[int], most: int) -> bool:
    """Tell whether all AUVs that are in no group yet find room in groups, sets of bits."""
    placed = sum(groups)
    if placed.bit_count() == len(neighbours):
        return True
    free = [auv for auv in range(len(neighbours)) if not placed >> auv & 1]
    rooms = {
        auv: [number for number in range(most) if not groups[number] & neighbours[auv]]
        for auv in free
    }
    auv = min(free, key=lambda it: (len(rooms[it]), -neighbours[it].bit_count()))
    begun = sum(map(bool, groups))  # groups without anybody yet are all alike
    for number in rooms[auv]:
        if number > begun:
            break
        groups[number] |= 1 << auv
        if _colourable(neighbours, groups, most):
            return True
        groups[number] ^= 1 << auv
    return False


def _neighbours(heard: Hearing) -> list[int]:
    """Return with whom each AUV is in conflict, as bits."""
    together = heard.astype(np.int64) @ heard.T.astype(np.int64) > 0
    np.fill_diagonal(together, val=False)
    return [sum(1 << other for other in np.flatnonzero(row).tolist()) for row in together]


def disjoint_senders(heard: Hearing) -> int:
    """Return at most how many ASVs can broadcast at once without a listener in common.

    Who is heard by somebody alone may send together with others; as many AUVs as it takes to hear
    every ASV are a bound, since each of them hears one sender at a time.

    >>> disjoint_senders(np.array([[True, True, False], [False, False, True]]))
    2
    """
    left, count = heard[:, heard.any(axis=0)].copy(), 0
    while left.size:
        auv = int(left.sum(axis=1).argmax())
        left, count = left[:, ~left[auv]], count + 1
    return max(count, 1)
