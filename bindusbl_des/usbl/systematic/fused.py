"""Errors that outlast a ping: what they make of a fix, and how sure it is of that.

    fix = place + J c + noise

c are the heading misalignment of each ASV, the slow error of its GNSS position along x and y, the
share by which sound is taken for too fast, and how late the AUV's clock is.  What an ASV has by
itself is one more error of its measurement; sound speed and clock are those of all that hear a ping
at once, so that they are fused as unknowns beside the place (best linear unbiased estimate).
"""

from math import sqrt

import numpy as np

from ...core.compiled import compiled
from ...records.events import HEARD
from ...records.rows import NONE, Row
from ...vehicles.motion import Floats, Motion
from ..fusion import fuse_shared
from ..instrument import Instrument
from ..sights import note_sight, unknown_sights
from ..two_way import Heard, first_to_locate
from .by_one import Part, by_first, by_other, deviations
from .effects import CALLER, CLOCK, EFFECTS, SOUND_SPEED
from .errors import Systematic
from .levers import add, add_own, level_part, move, noise_of, spread_out

# What is fused: a place, the error of the call's way (m), sound speed and clock per sd
UNKNOWNS = 6

# As unlikely (sd) as consistent fixes of a ping contradict each other once in a thousand pings
CONTRADICTION = 3.0902


@compiled
def measured_astray(
    heard: Heard, asvs: Motion, instrument: Instrument, strayed: Floats | None, lasting: Systematic
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the fix (3,), m, of a ping, its covariance (3, 3), m2, J (3, 4 k), and what is left of
    the covariance without the errors that J is of, xx, yy, xy (3,), m2.

    `strayed` as of :class:`..protocol.hf.reception.Extras`.  Behind the columns of J at the fix are
    their derivatives along x, along y, and by what they belong to.
    """
    first, sds = first_to_locate(heard), deviations(heard, lasting.levels)
    begun = by_first(heard, first, asvs, instrument, strayed, sds, lasting)
    state, spread, squares = np.zeros(UNKNOWNS), _begun(begun, sds), 0.0
    state[:3] = begun.fix
    known = _columns(begun, heard, first, lasting)
    it, alone = heard.receptions[first], spread[:3, :3].copy()
    note_sight(it, begun.fix, begun.unit, begun.reach, alone, instrument)
    levers = np.zeros((UNKNOWNS, known.shape[1]))
    levers[:3] = known[:3]
    others = 0
    for row in range(len(heard.receptions)):
        if heard.receptions[row].outcome == HEARD and row != first:
            others += 1
            part = by_other(heard, row, begun.call_way, asvs, instrument, lasting)
            fix, own, beside = part.fix, part.covariance[:3, :3].copy(), _beside(part, sds)
            add_own(own, part.effects, part.bend, sds)
            note_sight(heard.receptions[row], part.fix, part.unit, part.reach, own, instrument)
            fused = fuse_shared(state, spread, fix, own, beside)
            off = _columns(part, heard, row, lasting)[:3]
            if begun.call_way > 0.0:  # its error is in every other range
                for i in range(3):
                    off[i] += part.unit[i] * known[3]
            for i in range(3):
                off[i] -= levers[i]
                for k in range(3, UNKNOWNS):
                    off[i] -= beside[i, k - 3] * levers[k]
            for i in range(UNKNOWNS):
                for j in range(3):
                    levers[i] += fused.gain[i, j] * off[j]
            state, spread, squares = fused.estimate, fused.covariance, squares + fused.square
    doubt = _doubt(squares, 3.0 * others, lasting.levels)
    count, covariance = lasting.variances.size, doubt * spread[:3, :3]
    left = noise_of(covariance, levers[:3, 3 * count :], lasting.variances)
    if others == 0 and begun.call_way == 0.0:
        note_sight(it, begun.fix, begun.unit, begun.reach, left, instrument)
    elif count > 0 or doubt > 1.0 or begun.call_way > 0.0 or sds[SOUND_SPEED] + sds[CLOCK] > 0.0:
        unknown_sights(heard.receptions)  # they err together
    move(levers, state)
    return state[:3].copy(), covariance, levers[:3, : 4 * count].copy(), level_part(left)


@compiled
def _begun(part: Part, sds: Floats) -> Floats:
    """Return the covariance (UNKNOWNS, UNKNOWNS) of what is fused, after the first measurement."""
    out = np.zeros((UNKNOWNS, UNKNOWNS))
    out[:4, :4] = part.covariance
    add_own(out[:4, :4], part.effects, part.bend, sds)
    for k in range(CALLER, EFFECTS):
        add(out[:4, :4], part.effects[:, k], sds[k] ** 2)
    for k in range(SOUND_SPEED, EFFECTS):
        for i in range(4):
            out[i, k - 1] = out[k - 1, i] = -sds[k] * part.effects[i, k]
        out[k - 1, k - 1] = 1.0
    return out


@compiled
def _beside(part: Part, sds: Floats) -> Floats:
    """Return how a fix depends (3, UNKNOWNS - 3) on what is fused beside the place."""
    out = np.zeros((3, UNKNOWNS - 3))
    for i in range(3):
        if part.call_way > 0.0:
            out[i, 0] = -part.unit[i]
        out[i, 1] = sds[SOUND_SPEED] * part.effects[i, SOUND_SPEED]
        out[i, 2] = sds[CLOCK] * part.effects[i, CLOCK]
    return out


@compiled
def _columns(part: Part, heard: Heard, row: int, lasting: Systematic) -> Floats:
    """Return effects in the columns of J, (4, 5 k): as they would be at the origin, how they change
    along x, along y, and with what they belong to, and as they are.
    """
    count = lasting.variances.size
    out = np.zeros((4, 5 * count))
    spread_out(part.effects, out[:, :count], heard, row, lasting.levels)
    for axis in range(2):
        moved = out[:, (1 + axis) * count : (2 + axis) * count]
        spread_out(part.changes[axis], moved, heard, row, lasting.levels)
    if lasting.levels.misalignment_at != NONE:
        asv = heard.receptions[row].asv
        out[:, 3 * count + lasting.levels.misalignment_at + asv] = part.bend
    out[:, 4 * count :] = out[:, :count]
    move(out, -part.fix)  # each from its own fix to where all can be added up
    return out


@compiled
def _doubt(squares: float, freedom: float, levels: Row) -> float:
    """Return the factor on the covariance of fixes that contradict each other, else 1.

    Where there may be outliers, an improbable sum of squares says that somebody has measured one;
    nobody knows who.  Sources: limit of chi-squared by Wilson and Hilferty, 1931; factor by Birge,
    Phys. Rev. 40, 1932.
    """
    if levels.outlier_sd_m <= 0.0 or freedom <= 0.0:
        return 1.0
    share = 2.0 / (9.0 * freedom)
    limit = freedom * (1.0 - share + CONTRADICTION * sqrt(share)) ** 3
    return squares / freedom if squares > limit else 1.0
