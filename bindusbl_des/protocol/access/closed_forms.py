"""What is known of ALOHA in closed form: how often a ping meets no other."""

from math import exp, expm1


def offered_load(senders: int, lasts_s: float, interval_s: float) -> float:
    """Return the load G = N T / F that N senders offer: T (s) a ping, or a slot, every F (s).

    >>> offered_load(10, 0.010, 1.0)
    0.1
    """
    return senders * lasts_s / interval_s


def slot_share(slot_s: float, interval_s: float) -> float:
    """Return how likely a sender of slotted ALOHA pings in a slot (s), at mean intervals (s).

    >>> round(slot_share(0.1, 1.0), 4)
    0.0952
    """
    return -expm1(-slot_s / interval_s)


def aloha_success(load: float, senders: int) -> float:
    """Return how likely a ping of pure ALOHA is clear of all others' (Abramson 1970, N senders).

    >>> round(aloha_success(0.5, 10), 4), aloha_success(0.5, 1)
    (0.4066, 1.0)
    """
    return exp(-2.0 * load * (senders - 1) / senders)


def slotted_success(load: float, senders: int) -> float:
    """Return how likely a ping of slotted ALOHA is alone in its slot (Roberts 1975, N senders).

    Two of a slot are both heard where their ways differ by more than a ping is long.

    >>> round(slotted_success(0.5, 10), 4)
    0.6376
    """
    return exp(-load * (senders - 1) / senders)
