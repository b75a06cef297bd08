"""Limits of rates and latencies: of pings at an ASV, of records on the downlink, of fixes.

Nothing here knows of a schedule; how long its rounds are is worked out before a mission is run.
"""

import math
from collections.abc import Callable, Iterable

# How long (s) a ping's echoes take to die away at a receiver, if nothing else is known of them.
CLEARING_S = 0.020


def decode_bound(ping_s: float, clearing_s: float = CLEARING_S) -> float:
    """Return how many pings an ASV can decode (1/s): arrivals do not overlap, 1/(T_P + T_clear).

    Several ASVs decode at most as many times that.

    >>> round(decode_bound(0.010), 1)
    33.3
    """
    return 1.0 / (ping_s + clearing_s)


def aloha_capacity(ping_s: float, auvs: int) -> float:
    """Return how many pings an ASV decodes (1/s) of `auvs` that it hears and that ping at Poisson
    instants, at the best of rates: max over G of G exp(-2 G (N-1)/N) / T_P.

    The maximum is at G = N / (2 (N-1)).  Of many it is the 1/(2e) of Abramson (1970); who is alone
    collides with nobody, and sends at most without a pause.

    >>> round(aloha_capacity(1.0, 1000), 3), aloha_capacity(0.5, 1)
    (0.184, 2.0)
    """
    return _best_of(auvs, vulnerable=2) / ping_s


def slotted_aloha_capacity(slot_s: float, auvs: int) -> float:
    """Return what :func:`aloha_capacity` does where pings begin with slots (s): 1/e of many.

    A ping is decoded if it is alone in its slot.  More are where ways differ by more than it is
    long, so that arrivals of one slot follow each other.

    >>> round(slotted_aloha_capacity(1.0, 1000), 3)
    0.368
    """
    return _best_of(auvs, vulnerable=1) / slot_s


def _best_of(auvs: int, vulnerable: int) -> float:
    """Return the largest share of the time in which one of so many is decoded, whose pings are
    destroyed by others that begin within so many lengths of one.
    """
    others = vulnerable * (auvs - 1) / auvs
    return min(1.0 / (math.e * others), 1.0) if others else 1.0


def record_bound(airtime: Callable[[int], float], fixes: Iterable[int]) -> float:
    """Return how many records one broadcaster can send (1/s), frame behind frame, headers included.

    `airtime` is that of a frame (s) of so many fixes; the best of the numbers `fixes` is taken.
    With one record each of N AUVs in a frame it is N / T_tx(N).

    >>> round(record_bound(lambda fixes: 0.064 + 0.128 * fixes, range(1, 4)), 3)
    6.696
    """
    return max(fixes / airtime(fixes) for fixes in fixes)


def record_limit(record_bytes: int, bit_rate: float = 2000.0, overhead: float = 2.0) -> float:
    """Return what :func:`record_bound` tends to as frames grow and headers (bytes) no longer count.

    >>> record_limit(16)
    7.8125
    """
    return bit_rate / (8 * overhead * record_bytes)


def latency_bound(up_m: float, airtime_s: float, down_m: float, sound_speed: float) -> float:
    """Return the least latency (s) of a fix: its ping's way up (m), its frame, its way down (m).

    >>> round(latency_bound(50.0, 0.192, 50.0, 1500.0), 4)
    0.2587
    """
    return (up_m + down_m) / sound_speed + airtime_s


def sequential_rate(groups: int, uplink_slot: float, downlink_slot: float) -> float:
    """Return how often (1/s) each AUV is fixed if each is in each round, and frames follow pings.

    >>> round(sequential_rate(3, 0.1, 0.5), 6)
    1.25
    """
    return 1.0 / (groups * uplink_slot + downlink_slot)


def pipelined_rate(groups: int, uplink_slot: float, downlink_slot: float) -> float:
    """Return what :func:`sequential_rate` does where frames are sent as the next round pings.

    It is at most twice as much: (a + b) / max(a, b) <= 2.

    >>> pipelined_rate(3, 0.1, 0.5)
    2.0
    """
    return 1.0 / max(groups * uplink_slot, downlink_slot)


def optimum_rate(auvs: int, airtime: Callable[[int], float]) -> float:
    """Return how often (1/s) each of so many AUVs can be told of a fix, frame behind frame.

    Pings are packed meanwhile so that no ASV waits: the downlink is what binds.

    >>> round(optimum_rate(3, lambda fixes: 0.064 + 0.128 * fixes), 6)
    2.232143
    """
    return 1.0 / airtime(auvs)
