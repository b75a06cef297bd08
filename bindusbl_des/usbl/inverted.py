"""What an AUV measures of an ASV's ping with its own array: where it is itself (inverted USBL).

Everything is that of :mod:`.measuring` seen from the other end: the array and the AHRS are the
AUV's, the source is the ASV.  Synchronised clocks make the travel time a range.  With the source as
the origin a fix is the mirror image of a fix of the source, and so is its covariance.  Source:
Rypkema, Fischell and Schmidt, "One-way travel-time inverted ultra-short baseline localization for
low-cost autonomous underwater vehicles", ICRA 2017.
"""

from typing import NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiled
from ..records.rows import NONE, Row
from .array import NOTHING, Vector, negative
from .measuring import Instrument, Sighting, path_sd, placed
from .sights import note_sight
from .systematic_effects import (
    CLOCK,
    EFFECTS,
    GNSS,
    SOUND_SPEED,
    Systematic,
    Whose,
    add,
    add_own,
    astray,
    deviations,
    level_part,
    noise_of,
)
from .systematic_fixes import by_range, jump, write_columns
from .two_way import View, measure


class HeardBeacon(NamedTuple):
    """A ping and its reception at an AUV: where that is as it arrives (3,), m, and heads (rad), and
    the noise of the measurement, standard normal numbers (NOISE_WIDTH or more).

    The three of GNSS make the error of what the AUV takes the ASV's place for.
    """

    ping: Row
    reception: Row
    place: Vector
    yaw: float
    noise: Floats


@compiled
def located_itself(own: HeardBeacon, instrument: Instrument) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, of an AUV where a ping has reached it, and its covariance (3, 3), m2.

    It is the ASV's place less the offset measured.
    """
    seen, levels = _sighting(own, instrument, None), instrument.levels
    image, covariance = placed(seen, seen.path, path_sd(seen.path, levels), own.noise, instrument)
    note_sight(own.reception, -image, _mirrored(seen), seen.path, covariance, instrument)
    return -image, covariance


@compiled
def located_astray(
    own: HeardBeacon, instrument: Instrument, systematic: Systematic
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the fix (3,), m, of an AUV, its covariance (3, 3), m2, J with its changes
    (3, 4 k + 2), and what is left, as of :func:`.systematic_fixes.measured_astray`: the array is
    turned in the AUV by its misalignment, its clock is late, the ASV is slowly astray.
    """
    reception, count = own.reception, systematic.variances.size
    sds = deviations(reception.arrived_at_s, systematic.levels)
    seen = _sighting(own, instrument, systematic)
    # a clock that is late takes the way for shorter than it was
    image = by_range(seen, 0.0, -1.0, sds[CLOCK], own.noise, instrument)
    covariance, effects, bends = image.covariance[:3, :3].copy(), image.effects, -image.bends
    for k in range(EFFECTS):  # of the mirror image, whose AUV moves the other way
        if k < GNSS or k >= SOUND_SPEED:
            for i in range(3):
                effects[i, k] = -effects[i, k]
    add_own(covariance, effects, bends, sds)
    for k in (SOUND_SPEED, CLOCK):
        add(covariance, effects[:, k], sds[k] ** 2)
    fix = -image.fix
    jump(fix, own.noise, systematic.levels)
    columns = np.zeros((4, 4 * count + 2))
    whose = Whose(0, reception.asv, NONE, reception.arrived_at_s)
    write_columns(columns, effects, image.changes, bends, whose, systematic)
    jacobians = columns[:3]
    each = np.concatenate((jacobians[:, 3 * count : 4 * count], jacobians[:, :count]), axis=1)
    left = noise_of(covariance, each, systematic.variances)
    note_sight(reception, fix, _mirrored(seen), seen.path, left, instrument)
    return fix, covariance, jacobians, level_part(left)


@compiled
def _sighting(own: HeardBeacon, instrument: Instrument, errors: Systematic | None) -> Sighting:
    """Return what an AUV measures of an ASV, as the image of it where the ASV is the origin."""
    ping, reception = own.ping, own.reception
    beneath, above = negative(own.place), negative((ping.x_m, ping.y_m, ping.z_m))
    took, off = reception.travel_time_s, NOTHING
    if errors is not None:
        late, later = errors.clocks[reception.auv]
        took = took - late - later * reception.arrived_at_s
        off = negative(astray(reception.asv, ping.sent_at_s, errors))
    view = View(beneath, above, own.yaw, took, beneath[2] - above[2], off)
    return measure(view, reception, reception.auv, own.noise, instrument, errors)


@compiled
def _mirrored(seen: Sighting) -> Sighting:
    """Return a sighting as seen from the other end."""
    return Sighting(
        seen.vessel, negative(seen.unit), -seen.believed, seen.path, seen.snr_db, seen.below
    )
