"""What one ASV makes of a ping, whose errors that last are still apart from its noise."""

from math import hypot, isnan
from typing import NamedTuple

import numpy as np

from ...core.compiled import compiled
from ...records.rows import Row
from ...vehicles.motion import Floats, Motion
from ..array import rotation
from ..fusion import product
from ..instrument import Instrument, offset_of, placed
from ..sheet import path_sd
from ..two_way import Heard, Sighting, by_itself, sighting, travelled, way_to_caller
from ..vectors import Vector, plus, turned
from .effects import (
    CALLER,
    CLOCK,
    EFFECTS,
    GNSS,
    MISALIGNMENT,
    SOUND_SPEED,
    across,
    bent,
    changes,
    kept,
    lengthen,
    limit,
)
from .errors import Systematic, astray, jump


class Part(NamedTuple):
    """What one ASV makes of a ping: a fix (3,), m, in the direction of a unit vector (3,) at a
    range `reach` (m); the covariance (4, 4), m2, of it and of (less) the length of the call's way,
    with no error that lasts; its effects (4, EFFECTS), their changes along x and y (2, 4, EFFECTS),
    the `bend` (4,) that a misalignment (rad) squared makes half of, and that length (m), 0 without
    a call.
    """

    fix: Floats
    unit: Vector
    reach: float
    covariance: Floats
    effects: Floats
    changes: Floats
    bend: Floats
    call_way: float


@compiled
def by_first(
    heard: Heard, row: int, asvs: Motion, instrument: Instrument, strayed: Floats | None,
    sds: Floats, lasting: Systematic,
) -> Part:  # fmt: skip
    """Return what the ASV makes of a ping that locates its AUV first."""
    if strayed is not None:  # noqa: SIM102 - else the two ways are not even compiled
        if _called(heard):
            return _by_whole_way(heard, row, asvs, instrument, strayed, sds, lasting)
    return by_other(heard, row, 0.0, asvs, instrument, lasting)


@compiled
def by_other(
    heard: Heard, row: int, call_way: float, asvs: Motion, instrument: Instrument,
    lasting: Systematic,
) -> Part:  # fmt: skip
    """Return what an ASV makes of a ping, or of an answer whose call went a known way (m)."""
    seen, noise = _seen(heard, row, asvs, instrument, lasting), heard.noise[row]
    reach, spread, levels = max(seen.path - call_way, 0.0), np.zeros((4, 4)), instrument.levels
    ranging_sd = path_sd(seen.path, levels)
    fix, spread[:3, :3] = placed(
        seen.vessel, seen.unit, seen.believed, reach, ranging_sd, seen.snr_db, noise, instrument
    )
    ahead = offset_of(fix, seen.vessel, reach, noise, instrument)
    effects, farther = across(seen, ahead, instrument), np.zeros(EFFECTS)
    farther[SOUND_SPEED], farther[CLOCK] = seen.path, levels.sound_speed_m_per_s
    lengthen(effects, seen.unit, farther, kept(ahead, reach))
    effects[3] = 0.0  # the length of the call's way is given
    jump(fix, noise, lasting.levels)
    return Part(
        fix, seen.unit, reach, spread, effects, changes(effects, ahead), bent(ahead), call_way
    )


@compiled
def _by_whole_way(
    heard: Heard, row: int, asvs: Motion, instrument: Instrument, strayed: Floats, sds: Floats,
    lasting: Systematic,
) -> Part:  # fmt: skip
    """Return what an ASV makes of an answer by the whole way of call and answer."""
    ping, noise = heard.ping, heard.noise[row]
    seen = _seen(heard, row, asvs, instrument, lasting)
    baseline = way_to_caller(heard, row, seen, asvs, instrument)
    baseline = plus(baseline, astray(ping.called_by, ping.called_at_s, lasting))
    fix, spread, own = by_itself(seen, baseline, heard, row, instrument, strayed[ping.auv])
    ahead = offset_of(fix, seen.vessel, own.reach, noise, instrument)
    effects, farther = across(seen, ahead, instrument), np.zeros(EFFECTS)
    for k in range(3):
        for effect in (MISALIGNMENT, SOUND_SPEED):
            farther[effect] += own.lean[k] * effects[k, effect]
    if heard.receptions[row].asv != ping.called_by:  # else its own error is the caller's
        for axis in range(2):
            farther[GNSS + axis] = -own.share * own.bearing[axis]
            farther[CALLER + axis] = own.share * own.bearing[axis]
    farther[SOUND_SPEED] += own.share * seen.path
    limit(farther, sds, baseline, seen.path)
    lengthen(effects, seen.unit, farther, kept(ahead, own.reach))
    effects[3, SOUND_SPEED] -= seen.path
    jump(fix, noise, lasting.levels)
    return Part(
        fix, seen.unit, own.reach, spread, effects, changes(effects, ahead), bent(ahead),
        seen.path - own.reach,
    )  # fmt: skip


@compiled
def _seen(
    heard: Heard, row: int, asvs: Motion, instrument: Instrument, lasting: Systematic
) -> Sighting:
    """Return what an ASV measures that is turned and astray, by the clock of the AUV or of all."""
    ping, it = heard.ping, heard.receptions[row]
    if _called(heard):
        under_way = ping.call_time_s + travelled(it)
    else:
        late, later = lasting.clocks[ping.auv]
        under_way = travelled(it) + late + later * ping.sent_at_s
    seen = sighting(heard, row, under_way, asvs, instrument)
    turn = rotation(0.0, 0.0, lasting.misalignments[it.asv])
    unit, believed = turned(turn, seen.unit), product(turn, seen.believed)
    vessel = plus(seen.vessel, astray(it.asv, it.arrived_at_s, lasting))
    return Sighting(vessel, unit, believed, seen.path, seen.snr_db)


@compiled
def deviations(heard: Heard, levels: Row) -> Floats:
    """Return the standard deviations (EFFECTS,) of all that lasts, at the instant of a ping."""
    sds = np.zeros(EFFECTS)
    sds[:CLOCK] = levels.sd
    if not _called(heard):
        sds[CLOCK] = hypot(levels.clock_offset_sd_s, levels.clock_drift_sd * heard.ping.sent_at_s)
    return sds


@compiled
def _called(heard: Heard) -> bool:
    return not isnan(heard.ping.call_time_s)
