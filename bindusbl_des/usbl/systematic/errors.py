"""What lasts through a mission: how wrong it is, and how sure a navigator is told to be of it."""

from typing import Annotated, NamedTuple

import numpy as np

from ...core.compiled import compiled, written_out
from ...records.rows import Row, Rows
from ...vehicles.currents import CONTROL_S
from ...vehicles.motion import Floats
from ..instrument import NOISE_WIDTH
from ..usbl import Usbl
from ..vectors import Vector
from .effects import CLOCK

# What is known: standard deviations along these columns but for the clock, that of its offset (s)
# and of its drift, the standard normal number below which a measurement is an outlier and the
# spread of these (m), and the columns of J at which each kind begins (NONE: it is not told).
SYSTEMATIC = np.dtype(
    [
        ("sd", "f8", (CLOCK,)),
        ("clock_offset_sd_s", "f8"),
        ("clock_drift_sd", "f8"),
        ("outliers_below", "f8"),
        ("outlier_sd_m", "f8"),
        ("misalignment_at", "i8"),
        ("gnss_at", "i8"),
        ("sound_speed_at", "i8"),
        ("clock_at", "i8"),
    ]
)

# Numbers of a row of noise, after those of NOISE_WIDTH and of the loss, that make an outlier
OUTLIER_WIDTH = 3


class Systematic(NamedTuple):
    """What lasts through a mission.

    A record of SYSTEMATIC and the variances (k,) of what J belongs to; and the truth: heading
    misalignments of the ASVs (m,), rad, their GNSS errors (m, n, 2), m, each for CONTROL_S, and how
    late (s) each AUV's clock is at first, and how much later each second (auvs, 2).
    """

    levels: Row
    variances: Floats
    misalignments: Floats
    gnss: Floats
    clocks: Floats


class HandedErrors(NamedTuple):
    """What lasts (:class:`Systematic`) as compiled code is handed it once: levels (1,); and where
    it writes how each fix depends on that, `levers` (fixes, 2, 4 k), and the covariance that does
    not come from it, xx, yy, xy, `left` (fixes, 3), m2.
    """

    levels: Annotated[Rows, SYSTEMATIC]
    variances: Floats
    misalignments: Floats
    gnss: Annotated[Floats, 3]
    clocks: Annotated[Floats, 2]
    levers: Annotated[Floats, 3]
    left: Annotated[Floats, 2]


@written_out
def lasting_of(handed: HandedErrors) -> Systematic:
    """Return what lasts, of what was handed over."""
    return Systematic(
        handed.levels[0], handed.variances, handed.misalignments, handed.gnss, handed.clocks
    )


class Astray(NamedTuple):
    """The instrument that every ASV carries, and what is wrong all the time."""

    usbl: Usbl
    lasting: Systematic


@compiled
def astray(asv: int, time: float, lasting: Systematic) -> Vector:
    """Return the slow GNSS error (3,), m, of an ASV at an instant (s)."""
    own = lasting.gnss[asv]
    now = min(int(time / CONTROL_S), len(own) - 1)
    return own[now, 0], own[now, 1], 0.0


@compiled
def jump(fix: Floats, noise: Floats, levels: Row) -> None:
    """Make an outlier of a fix (3,), m, if its noise says so; no covariance knows of that."""
    if levels.outlier_sd_m > 0.0 and noise[NOISE_WIDTH + 1] < levels.outliers_below:
        for axis in range(2):
            fix[axis] += levels.outlier_sd_m * noise[NOISE_WIDTH + 2 + axis]
