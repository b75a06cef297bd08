"""What becomes of a frame, and of its fixes, at each AUV: frames that overlap destroy each other.

Compiled, as :mod:`...acoustics.propagation`.  A frame is a sound at every AUV
(:mod:`...acoustics.sounds`): it begins when its front has come, and ends when the sound of its end
has, from where the ASV is by then.
"""

from dataclasses import dataclass
from math import nan
from typing import Annotated, NamedTuple

import numpy as np

from ...acoustics.propagation import TOUCH, drowns, within
from ...acoustics.sounds import Sea, emit, interference, place_of, solve
from ...acoustics.travel_time import travel_time_to
from ...core.arrays import Ints
from ...core.clock import after
from ...core.compiled import compiled
from ...core.packed import unpacked
from ...records.events import (
    BY_FRAME,
    COLLIDED,
    DELIVERED,
    FAILED,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
)
from ...records.rows import FIX, NONE, Row, Rows, row_type
from ...vehicles.motion import where


@dataclass(slots=True)
class Frame:
    """A frame: on the air for so long, though it would last `airtime_s`; what decodes it hands it
    over so long after its end.  Its sounds at AUVs, one for each, begin with the row `first`.
    """

    on_air_s: float
    airtime_s: float
    processing_s: float
    first: int


FRAME = row_type(Frame)

# What a channel other than the disc makes of a frame at an AUV: IN_FLIGHT if that decodes it where
# nothing overlaps it, else what becomes of it, and why; how likely it is lost, how strong it is,
# and how much later it is there than straight on (:data:`...acoustics.propagation.PROSPECT`).
PROMISE = np.dtype(
    [("outcome", "i8"), ("why", "i8"), ("loss", "f8"), ("sound", "f8"), ("late_s", "f8")]
)
DISC: Rows = np.empty(0, PROMISE)


class Sent(NamedTuple):
    """What frames are sent in, handed over once: all on record, with room for more, the fixes, and
    what decides at AUVs, as of :class:`.downlink.FrameBand`.  Instants are those of a clock of a
    `rate` (Hz, see :func:`after`).
    """

    frames: Annotated[Rows, FRAME]
    fixes: Annotated[Rows, FIX]
    slant: bool
    reach: float
    capture: float
    rate: float


@compiled
def begin_frame(
    packed: int, packed_sea: int, number: int, count: int, asv: int, time: float, on_air: float,
    airtime: float, processing: float, carried: Ints, foreseen: bool, promised: Rows,
    listeners: int,
) -> tuple[float, float]:  # fmt: skip
    """Let an ASV send fixes, the rows `carried` (k,), in a frame at an instant (s), which is to
    last `airtime` (s) and is on the air for `on_air` (s); write it as `number` of the frames, and
    its sounds behind the first `count`.

    `packed` is the address of a :class:`Sent`, `packed_sea` that of a :class:`Sea`, which have room
    for them.  It sounds at the first so many `listeners` of all vehicles, AUVs first, but at its
    sender.  What becomes of it at each is `promised` (listeners,), :data:`PROMISE`, or nothing on
    the disc.  The fixes tell when their AUVs will have them: `processing` (s) after the end has
    come.  An AUV out of range when the frame begins never gets its fix, nor one that loses it, and
    where its way is not `foreseen` the arrival is left open (NaN).  Return the last instant (s) of
    those known, or -1, and how long (s) after it was sent no sound is over later.
    """
    into, sea, last = unpacked(packed, Sent), unpacked(packed_sea, Sea), -1.0
    fixes, auvs, rate, frame = into.fixes, sea.auvs, into.rate, into.frames[number]
    frame.on_air_s, frame.airtime_s, frame.processing_s = on_air, airtime, processing
    frame.first = count
    ends = where(sea.asvs, asv, time + airtime)
    _sound(number, asv, time, frame, promised, into, sea, listeners)
    for row in carried:
        line, sound = fixes[row], sea.sounds[frame.first + fixes[row].auv]
        line.broadcast_at_s, line.broadcast_by, line.arrives_at_s = time, asv, nan
        line.frame = number
        if sound.outcome != IN_FLIGHT:
            line.outcome = sound.outcome
        elif foreseen and line.outcome == IN_FLIGHT:
            late = sound.late_s
            sent_at = time + airtime + late
            travel = late + travel_time_to(ends, auvs, line.auv, sent_at, sea.sound_speed)
            line.arrives_at_s = after(rate, time, airtime + travel + frame.processing_s)
            last = max(last, line.arrives_at_s)
    return last, sea.sounds[count + auvs.first.size - 2].longest_s


@compiled
def _sound(
    number: int, asv: int, time: float, frame: Row, promised: Rows, into: Sent, sea: Sea,
    listeners: int,
) -> None:  # fmt: skip
    """Write the sounds of a frame at those who listen; arguments as of :func:`begin_frame`."""
    here, sender = where(sea.asvs, asv, time), sea.auvs.first.size - 1 + asv
    strengths, lates = np.zeros(listeners), np.zeros(listeners)
    for listener in range(listeners):
        if listener == sender:
            strengths[listener] = nan
        elif promised.size:
            strengths[listener] = promised[listener].sound
            lates[listener] = promised[listener].late_s
        elif within(place_of(listener, time, sea), here, into.slant, into.reach):
            strengths[listener] = 1.0
    lasts = frame.on_air_s
    end = emit(sea, frame.first, BY_FRAME, number, sender, time, lasts, strengths, lates)
    for row in range(frame.first, end):
        sound = sea.sounds[row]
        if promised.size:
            promise = promised[sound.listener]
            sound.outcome, sound.why, sound.loss = promise.outcome, promise.why, promise.loss
        elif sound.sound == 0.0:
            sound.outcome = OUT_OF_RANGE
        if lasts == 0.0:  # its ASV had failed
            sound.sound = 0.0


@compiled
def way_s(packed: int, asv: int, auv: int, time: float, late: float) -> float:
    """Return how long (s) the sound of an ASV at an instant (s) travels to an AUV that it meets, so
    much later (s) than straight on.

    `packed` is the address of a :class:`Sea`.
    """
    of = unpacked(packed, Sea)
    source = where(of.asvs, asv, time)
    return late + travel_time_to(source, of.auvs, auv, time + late, of.sound_speed)


@compiled
def receive(packed: int, packed_sea: int, receptions: Rows, known: float, count: int) -> None:
    """Write what has become of frames at AUVs by an instant (s), `known`, up to which their motion
    is: `receptions` say which frame, and at which AUV (:data:`...records.rows.FRAME_RECEPTION`).

    `packed` is the address of a :class:`Sent`, `packed_sea` that of a :class:`Sea`, of which so
    many sounds are on record: all that have begun by then.  What has not ended at its AUV is in
    flight.
    """
    of, sea = unpacked(packed, Sent), unpacked(packed_sea, Sea)
    for line in receptions:
        frame = of.frames[line.broadcast]
        row = frame.first + line.auv
        sound = sea.sounds[row]
        solve(sound, known, sea)
        line.arrived_at_s = sound.arrived_at_s if sound.arrived_at_s <= known + TOUCH else nan
        line.ended_at_s, line.loss_probability = sound.ended_at_s, sound.loss
        line.outcome, line.why, line.overlapped_by = _outcome(row, frame, known, count, of, sea)


@compiled
def _outcome(
    row: int, frame: Row, known: float, count: int, of: Sent, sea: Sea
) -> tuple[int, int, int]:
    """Return what has become of a frame at an AUV, where it is the sound of a row, why, and what
    overlapped it; other arguments as of :func:`receive`.
    """
    sound, sounds = sea.sounds[row], sea.sounds[:count]
    if sound.outcome == OUT_OF_RANGE:
        return OUT_OF_RANGE, OUT_OF_RANGE, NONE
    if sound.ended_at_s > known + TOUCH:
        return IN_FLIGHT, NONE, NONE
    if frame.on_air_s < frame.airtime_s:  # it is cut
        return LOST, FAILED_MEANWHILE if frame.on_air_s > 0.0 else FAILED, NONE
    if sound.outcome == LOST:
        return LOST, sound.why, NONE
    others, strongest = interference(
        sounds, row, row + 1, sound.listener, sound.arrived_at_s, sound.ended_at_s,
        sounds[count - 1].longest_s, None, sea, known,
    )  # fmt: skip
    if drowns(sound.sound, others, of.capture):
        return COLLIDED, sounds[strongest].kind, sounds[strongest].signal
    return HEARD, NONE, NONE


@compiled
def delivered(fixes: Rows, first: int, end: int, time: float, due: Ints) -> tuple[int, int]:
    """Note the fixes first..end that have arrived by an instant (s); write their rows to `due`.

    They stand there in the order of their arrival.  Return how many there are, and the first row
    that is still under way.
    """
    count, waiting = 0, end
    for row in range(first, end):
        line = fixes[row]
        if line.outcome != IN_FLIGHT:
            continue
        if line.arrives_at_s <= time:
            line.delivered_at_s, line.outcome = line.arrives_at_s, DELIVERED
            line.latency_s = line.arrives_at_s - line.pinged_at_s
            place = count
            while place > 0 and fixes[due[place - 1]].arrives_at_s > line.arrives_at_s:
                due[place] = due[place - 1]
                place -= 1
            due[place] = row
            count += 1
        elif waiting == end:
            waiting = row
    return count, waiting
