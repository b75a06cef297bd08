"""Measurements that a log holds more than once: it was polled, and the last one was written again.

Whoever polls a USBL faster than it measures logs each fix several times under new instants.  Taken
for as many measurements they make a filter far too sure.  A row is a repetition if it equals one
shortly before to the last digit although the vehicle has moved by more than that digit; unless the
digits are so coarse that as many would be equal by chance, as those that differ by one digit tell.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...support.arrays import Flags, Floats
from .log import Log

# Rows so far apart are compared: those of several vessels may take turns.
FARTHEST = 8


class Sighted(NamedTuple):
    """A row that tells of a measurement: where it stands, its instant (s), of which beacon or
    vessel it is, what was measured as it is written, and what else the row holds.
    """

    place: str
    time: float
    source: str
    measured: tuple[float, ...]
    rest: tuple[float, ...] = ()


def measured_once(
    rows: Sequence[Sighted], log: Log, first: float, what: str, unit_m: float = 1.0
) -> tuple[list[Sighted], tuple[str, ...]]:
    """Return rows in the order of their instants, the first of each measurement alone, and what is
    to be said of the others.

    The odometry of the log began at `first` (s); `unit_m` (m) is as far as what is measured reaches
    when it is larger by 1.
    """
    rows = sorted(rows, key=lambda row: row.time)
    places = log.at(log.places, np.array([row.time - first for row in rows]))
    is_repeated = np.zeros(len(rows), dtype=bool)
    sources = np.array([row.source for row in rows])
    for source in dict.fromkeys(row.source for row in rows):
        own = np.flatnonzero(sources == source)
        times = np.array([rows[n].time for n in own])
        values = np.array([rows[n].measured for n in own])
        is_repeated[own] = _repeated(times, values, places[own], log.distance > 0.0, unit_m)
    again = np.flatnonzero(is_repeated)
    kept = [row for row, is_out in zip(rows, is_repeated, strict=True) if not is_out]
    if not len(again):
        return kept, ()
    place = rows[int(again[0])].place
    return kept, (
        f"{len(again)} of {len(rows)} {what} repeat one before to the last digit, first {place}: "
        "each measurement counts once (was the log polled?)",
    )


def _repeated(
    times: Floats, values: Floats, places: Floats, is_moving: bool, unit_m: float
) -> Flags:
    """Tell which measurements (n, k) at instants (n,), s, and places (n, 2), m, are repetitions."""
    digit = _last_digit(values)
    is_equal, is_sure, is_same = (np.zeros(len(times), dtype=bool) for _ in range(3))
    by_spread = near = 0.0
    for lag in range(1, min(FARTHEST, len(times) - 1) + 1):
        off = np.abs(values[lag:] - values[:-lag])
        equal = (off == 0.0).all(axis=1)
        moved = np.hypot(*(places[lag:] - places[:-lag]).T) if is_moving else np.inf
        is_equal[lag:] |= equal & (moved > 0.0)
        is_sure[lag:] |= equal
        is_same[lag:] |= equal & (times[lag:] == times[:-lag])
        near += np.count_nonzero((off < 1.5 * digit).all(axis=1) & ~equal)
        known = off[~equal & np.isfinite(off).all(axis=1)]
        if len(known):
            by_spread += len(off) * float(np.prod(digit / (digit + np.median(known, axis=0))))
    # As many as of each pair of numbers one digit aside, where there are such.
    by_chance = min(by_spread, max(near, 1.0) / (3 ** values.shape[1] - 1))
    is_polled = np.count_nonzero(is_sure) > 2.0 * by_chance + 3.0 * np.sqrt(by_chance)
    return is_same | is_equal if is_polled else is_same


def _last_digit(values: Floats) -> float:
    """Return what the last digit is worth that numbers are written with: 0.01 of 3.1 and 2.25."""
    texts = (repr(value) for value in values.ravel().tolist() if np.isfinite(value))
    digits = (17 if "e-" in text else len(text.partition(".")[2].rstrip("0")) for text in texts)
    return 10.0 ** -max(digits, default=0)
