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
from .array import Vector, minus, negative, rotation, turned
from .fusion import product
from .measuring import Instrument, clocked, offset_of, path_sd, placed, sighted, slow_path_sd
from .sights import note_direction, note_sight
from .systematic_effects import (
    CLOCK,
    EFFECTS,
    GNSS,
    SLOW_RANGE,
    SOUND_SPEED,
    Whose,
    across,
    add,
    add_own,
    add_unknown_turn,
    bent,
    changes,
    kept,
    lengthen,
    level_part,
    noise_of,
)
from .systematic_fixes import Systematic, astray, deviations, jump, write_columns
from .two_way import Sighting


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
    reception, levels = own.reception, instrument.levels
    beneath, above = negative(own.place), negative(_source(own))
    unit, believed = sighted(beneath, above, own.yaw, reception.snr_db, own.noise, instrument)
    note_direction(reception, unit, believed)
    reach = levels.sound_speed_m_per_s * clocked(reception.travel_time_s, own.noise, instrument)
    image, covariance = placed(
        above, unit, believed, reach, path_sd(reach, levels), reception.snr_db, own.noise,
        instrument,
    )  # fmt: skip
    note_sight(reception, -image, negative(unit), -believed, reach, covariance, instrument)
    return -image, covariance


@compiled
def located_astray(
    own: HeardBeacon, instrument: Instrument, systematic: Systematic
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the fix (3,), m, of an AUV, its covariance (3, 3), m2, J with its changes
    (3, 4 k + 2), and what is left, as of :func:`.systematic_fixes.measured_astray`: the array is
    turned in the AUV by its misalignment, its clock is late, the ASV is slowly astray.
    """
    ping, reception, levels = own.ping, own.reception, instrument.levels
    beneath, above = negative(own.place), negative(_source(own))
    unit, believed = sighted(beneath, above, own.yaw, reception.snr_db, own.noise, instrument)
    turn = rotation(0.0, 0.0, systematic.misalignments[reception.auv])
    late, later = systematic.clocks[reception.auv]
    took = reception.travel_time_s - late - later * reception.arrived_at_s
    path = levels.sound_speed_m_per_s * clocked(took, own.noise, instrument)
    origin = minus(above, astray(reception.asv, ping.sent_at_s, systematic))
    below = beneath[2] - above[2]
    seen = Sighting(
        origin, turned(turn, unit), product(turn, believed), path, reception.snr_db, below
    )
    note_direction(reception, seen.unit, seen.believed)
    image, covariance = placed(
        origin, seen.unit, seen.believed, path, path_sd(path, levels), seen.snr_db, own.noise,
        instrument,
    )  # fmt: skip
    ahead = offset_of(image, origin, path, own.noise, instrument)
    sds = deviations(reception.arrived_at_s, systematic.levels)
    clock_m = levels.sound_speed_m_per_s * sds[CLOCK]
    add_unknown_turn(covariance, ahead, clock_m, seen, instrument)
    effects, moved = _effects(seen, ahead, instrument, clock_m)
    bends = -bent(effects, ahead, instrument)
    add_own(covariance, effects, bends, sds)
    for k in (SOUND_SPEED, CLOCK):
        add(covariance, effects[:, k], sds[k] ** 2)
    fix = -image
    jump(fix, own.noise, systematic.levels)
    count = systematic.variances.size
    columns = np.zeros((4, 4 * count + 2))
    whose = Whose(0, reception.asv, NONE, reception.arrived_at_s)
    write_columns(columns, effects, moved, bends, whose, systematic)
    jacobians = columns[:3]
    each = np.concatenate((jacobians[:, 3 * count : 4 * count], jacobians[:, :count]), axis=1)
    left = noise_of(covariance, each, systematic.variances)
    note_sight(reception, fix, negative(seen.unit), -seen.believed, path, left, instrument)
    return fix, covariance, jacobians, level_part(left)


@compiled
def _source(own: HeardBeacon) -> Vector:
    return own.ping.x_m, own.ping.y_m, own.ping.z_m


@compiled
def _effects(
    seen: Sighting, ahead: Vector, instrument: Instrument, clock_m: float
) -> tuple[Floats, Floats]:
    """Return the effects (4, EFFECTS) on a fix that is the ASV's place less the offset `ahead`, and
    how they change per m that the AUV is farther along x and along y (2, 4, EFFECTS).

    A clock that is late takes the way for shorter than it was.
    """
    effects, farther = across(seen, ahead, instrument), np.zeros(EFFECTS)
    farther[SOUND_SPEED], farther[CLOCK] = seen.path, -instrument.levels.sound_speed_m_per_s
    farther[SLOW_RANGE] = slow_path_sd(seen.path, instrument.levels)
    lengthen(effects, seen.unit, farther, kept(ahead, seen.path))
    # of the mirror image, whose AUV moves the other way
    moved = changes(effects, ahead, seen, instrument, clock_m)
    for k in range(EFFECTS):
        if k < GNSS or k >= SOUND_SPEED:
            for i in range(3):
                effects[i, k] = -effects[i, k]
    return effects, moved
