"""J, how fixes depend on errors that last, and what these make of a covariance."""

from math import isnan

import numpy as np

from ...core.compiled import compiled
from ...records.rows import NONE, Row
from ...vehicles.motion import Floats
from ..two_way import Heard
from .effects import CALLER, CLOCK, GNSS, MISALIGNMENT, SOUND_SPEED


@compiled
def noise_of(covariance: Floats, levers: Floats, variances: Floats) -> Floats:
    """Return what is left of a covariance (3, 3), m2, without errors of some `variances` (k,);
    `levers` (3, 2 k) are what it holds of their squares, then of themselves.
    """
    out, count = covariance.copy(), variances.size
    for k in range(2 * count):
        variance = variances[k - count] if k >= count else 0.75 * variances[k] ** 2
        for i in range(3):
            for j in range(3):
                out[i, j] -= variance * levers[i, k] * levers[j, k]
    for i in range(3):
        out[i, i] = max(out[i, i], 0.0)
    return out


@compiled
def level_part(covariance: Floats) -> Floats:
    """Return xx, yy, xy (3,) of a covariance (3, 3)."""
    return np.array((covariance[0, 0], covariance[1, 1], covariance[0, 1]))


@compiled
def add_own(covariance: Floats, effects: Floats, bend: Floats, sds: Floats) -> None:
    """Add what the misalignment and the GNSS of who measures make to a covariance (n, n), m2.

    A misalignment turns the offset on a circle: its square has a mean, too, E x^4 / 4 = 3 sd^4 / 4.
    """
    for k in range(MISALIGNMENT, GNSS + 2):
        add(covariance, effects[:, k], sds[k] ** 2)
    add(covariance, bend, 0.75 * sds[MISALIGNMENT] ** 4)


@compiled
def add(covariance: Floats, effect: Floats, variance: float) -> None:
    """Add what an error of some variance makes to a covariance (n, n), m2, in its place."""
    for i in range(len(covariance)):
        for j in range(len(covariance)):
            covariance[i, j] += variance * effect[i] * effect[j]


@compiled
def spread_out(effects: Floats, out: Floats, heard: Heard, row: int, levels: Row) -> None:
    """Write effects (4, EFFECTS) to their columns of J (4, k)."""
    ping, asv = heard.ping, heard.receptions[row].asv
    if levels.misalignment_at != NONE:
        out[:, levels.misalignment_at + asv] = effects[:, MISALIGNMENT]
    if levels.gnss_at != NONE:
        for axis in range(2):
            out[:, levels.gnss_at + 2 * asv + axis] += effects[:, GNSS + axis]
            if ping.called_by != NONE:
                out[:, levels.gnss_at + 2 * ping.called_by + axis] += effects[:, CALLER + axis]
    if levels.sound_speed_at != NONE:
        out[:, levels.sound_speed_at] = effects[:, SOUND_SPEED]
    if levels.clock_at != NONE and isnan(ping.call_time_s):
        out[:, levels.clock_at] = effects[:, CLOCK]
        out[:, levels.clock_at + 1] = ping.sent_at_s * effects[:, CLOCK]


@compiled
def move(levers: Floats, way: Floats) -> None:
    """Move the place at which J (n, 5 k) holds by a `way` (m)."""
    count = levers.shape[1] // 5
    for axis in range(2):
        levers[:, :count] += way[axis] * levers[:, (1 + axis) * count : (2 + axis) * count]
