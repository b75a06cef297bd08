"""What becomes of a frame, and of its fixes, at each AUV: frames that overlap destroy each other.

Compiled, as :mod:`...acoustics.propagation`.  A frame begins at an AUV when its front has come, and
ends when the sound of its end has, from where the ASV is by then.
"""

from dataclasses import dataclass
from math import inf, isinf, nan
from typing import Annotated, NamedTuple

import numpy as np

from ...acoustics.propagation import drowns, meet, within
from ...acoustics.travel_time import PASSED, distance, travel_time_by, travel_time_to
from ...core.arrays import Ints
from ...core.clock import after
from ...core.compiled import compiled
from ...core.packed import unpacked
from ...records.events import (
    BY_FRAME,
    BY_OWN_PING,
    COLLIDED,
    DELIVERED,
    FAILED,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
)
from ...records.rows import FIX, NONE, PING, Row, Rows, row_type
from ...vehicles.motion import Motion, where


@dataclass(slots=True)
class Frame:
    """A frame: on the air from an instant on, for so long, though it would last `airtime_s`; what
    decodes it hands it over so long after its end.

    By `passed_at_s` neither it nor any before it is on the air or arriving any more.
    """

    asv: int
    sent_at_s: float
    on_air_s: float
    airtime_s: float
    processing_s: float
    passed_at_s: float


FRAME = row_type(Frame)

# What a channel other than the disc makes of a frame at an AUV: IN_FLIGHT if that decodes it where
# nothing overlaps it, else what becomes of it, and why; how likely it is lost, how strong it is,
# and how much later it is there than straight on (:data:`...acoustics.propagation.PROSPECT`).
PROMISE = np.dtype(
    [("outcome", "i8"), ("why", "i8"), ("loss", "f8"), ("sound", "f8"), ("late_s", "f8")]
)
DISC: Rows = np.empty(0, PROMISE)


class Medium(NamedTuple):
    """All frames on record, in the order in which they were sent, and the `promises` of each for
    each AUV, where a channel was asked; what decides there, as of :class:`.downlink.FrameBand`.
    The motion of AUVs and ASVs is known up to an instant (s), `known`.  AUVs hear no frame while
    they send one of the `pings`, which last `ping_s` (s) each.
    """

    frames: Rows
    promises: Rows
    slant: bool
    reach: float
    sound_speed: float
    capture: float
    known: float
    auvs: Motion
    asvs: Motion
    pings: Rows
    ping_s: float


class Sent(NamedTuple):
    """What frames are sent in, handed over once: all of a :class:`Medium`, whose rows have room for
    more, and the fixes.  Instants are those of a clock of a `rate` (Hz, see :func:`after`).
    """

    frames: Annotated[Rows, FRAME]
    fixes: Annotated[Rows, FIX]
    promises: Annotated[Rows, PROMISE]
    pings: Annotated[Rows, PING]
    auvs: Motion
    asvs: Motion
    slant: bool
    reach: float
    sound_speed: float
    capture: float
    ping_s: float
    rate: float


@compiled
def begin_frame(
    packed: int, number: int, asv: int, time: float, on_air: float, airtime: float,
    processing: float, carried: Ints, foreseen: bool,
) -> tuple[float, float]:  # fmt: skip
    """Let an ASV send fixes, the rows `carried` (k,), in a frame at an instant (s), which is to
    last `airtime` (s) and is on the air for `on_air` (s); write it as `number` of the frames.

    `packed` is the address of a :class:`Sent`.  The fixes tell when their AUVs will have them:
    `processing` (s) after the end of the frame has come.  An AUV out of range when the frame begins
    never gets its fix, nor one that does not decode it (whose outcome says so already), and where
    its way is not `foreseen` the arrival is left open (NaN).  Return the last instant (s) of those
    known, or -1, and the frame's `passed_at_s`.
    """
    into = unpacked(packed, Sent)
    frames, fixes, auvs, asvs = into.frames, into.fixes, into.auvs, into.asvs
    reach, sound_speed, rate = into.reach, into.sound_speed, into.rate
    begins, ends = where(asvs, asv, time), where(asvs, asv, time + airtime)
    frame, last = frames[number], -1.0
    frame.asv, frame.sent_at_s, frame.on_air_s, frame.airtime_s = asv, time, on_air, airtime
    frame.processing_s = processing
    count = auvs.first.size - 1 if isinf(reach) else 0  # of a disc nothing is promised
    promised = into.promises[number * count : (number + 1) * count]
    frame.passed_at_s = _passed(frame, foreseen, into, promised)
    if number > 0:
        frame.passed_at_s = max(frame.passed_at_s, frames[number - 1].passed_at_s)
    for row in carried:
        line = fixes[row]
        line.broadcast_at_s, line.broadcast_by, line.arrives_at_s = time, asv, nan
        line.frame = number
        if not within(where(auvs, line.auv, time), begins, into.slant, reach):
            line.outcome = OUT_OF_RANGE
        elif foreseen and line.outcome == IN_FLIGHT:
            late = promised[line.auv].late_s if promised.size else 0.0
            travel = late + travel_time_to(ends, auvs, line.auv, time + airtime + late, sound_speed)
            line.arrives_at_s = after(rate, time, airtime + travel + processing)
            last = max(last, line.arrives_at_s)
    return last, frame.passed_at_s


@compiled
def way_s(packed: int, asv: int, auv: int, time: float, late: float) -> float:
    """Return how long (s) the sound of an ASV at an instant (s) travels to an AUV that it meets, so
    much later (s) than straight on.

    `packed` is the address of a :class:`Sent`.
    """
    of = unpacked(packed, Sent)
    source = where(of.asvs, asv, time)
    return late + travel_time_to(source, of.auvs, auv, time + late, of.sound_speed)


@compiled
def _passed(frame: Row, foreseen: bool, into: Sent, promised: Rows) -> float:
    """Return an instant (s) by which a frame has passed all AUVs that are in reach as it begins."""
    auvs, asvs, latest = into.auvs, into.asvs, 0.0
    for promise in promised:
        latest = max(latest, promise.late_s)
    begins, later = frame.sent_at_s, frame.sent_at_s
    ends, margin = begins + frame.on_air_s, (PASSED - 1.0) * frame.on_air_s
    if foreseen:  # where everybody is when it ends
        later, margin = ends, 0.0
    source, leaves, farthest = where(asvs, frame.asv, begins), where(asvs, frame.asv, later), 0.0
    for auv in range(auvs.first.size - 1):
        if within(where(auvs, auv, begins), source, into.slant, into.reach):
            farthest = max(farthest, distance(leaves, where(auvs, auv, later)))
    return float(ends + margin + PASSED * farthest / into.sound_speed + latest)


@compiled
def receive(
    packed: int, receptions: Rows, known: float, frames: int, promises: int, pings: int
) -> None:  # fmt: skip
    """Write what has become of frames at AUVs by an instant (s), `known`, up to which their motion
    is: `receptions` say which frame, and at which AUV (:data:`...records.rows.FRAME_RECEPTION`).

    `packed` is the address of a :class:`Sent`, of which so many frames, promises and pings are on
    record: all that have begun by then.  What has not ended at its AUV is in flight.
    """
    of = unpacked(packed, Sent)
    medium = Medium(
        of.frames[:frames], of.promises[:promises], of.slant, of.reach, of.sound_speed, of.capture,
        known, of.auvs, of.asvs, of.pings[:pings], of.ping_s,
    )  # fmt: skip
    for line in receptions:
        begins, ends = _span(line.broadcast, line.auv, medium)
        line.arrived_at_s = begins if begins < inf else nan
        line.ended_at_s = ends
        line.outcome = _outcome(line.broadcast, line.auv, begins, ends, medium)
        _note_why(line, medium)


@compiled
def _span(number: int, auv: int, medium: Medium) -> tuple[float, float]:
    """Return when (s) a frame begins at an AUV and when it ends there; infinite if it has not."""
    frame, ends, late = medium.frames[number], inf, 0.0
    if medium.promises.size:
        late = medium.promises[number * (medium.auvs.first.size - 1) + auv].late_s
    begins = _arrival(frame.asv, frame.sent_at_s, auv, late, medium)
    if begins < inf:
        ends = _arrival(frame.asv, frame.sent_at_s + frame.on_air_s, auv, late, medium)
    return begins, ends


@compiled
def _arrival(asv: int, time: float, auv: int, late: float, medium: Medium) -> float:
    """Return when (s) the sound of an ASV of an instant (s) is at an AUV, so much later (s) than
    straight on; infinite if it is not.
    """
    if max(time, time + late) > medium.known:
        return inf
    source, begins = where(medium.asvs, asv, time), time + late
    way = travel_time_by(source, medium.auvs, auv, begins, medium.sound_speed, medium.known)
    return begins + way


@compiled
def _promise(number: int, auv: int, medium: Medium) -> tuple[int, float]:
    """Return what would become of a frame at an AUV if nothing overlapped it, and how strong it is
    there (:data:`PROMISE`).
    """
    if medium.promises.size:
        promise = medium.promises[number * (medium.auvs.first.size - 1) + auv]
        return promise.outcome, promise.sound
    frame = medium.frames[number]
    here = where(medium.asvs, frame.asv, frame.sent_at_s)
    there = where(medium.auvs, auv, frame.sent_at_s)
    if within(there, here, medium.slant, medium.reach):
        return IN_FLIGHT, 1.0
    return OUT_OF_RANGE, 0.0


@compiled
def _outcome(number: int, auv: int, begins: float, ends: float, medium: Medium) -> int:
    """Return what has become of a frame that begins and ends at an AUV at two instants (s)."""
    frame = medium.frames[number]
    outcome, strength = _promise(number, auv, medium)
    if outcome == OUT_OF_RANGE or not ends < inf:
        return outcome if outcome == OUT_OF_RANGE else IN_FLIGHT
    if outcome == LOST or frame.on_air_s < frame.airtime_s:  # it is cut
        return LOST
    others, _ = _interference(number, auv, begins, ends, medium)
    if drowns(strength, others, medium.capture) or _pings(auv, begins, ends, medium) != NONE:
        return COLLIDED
    return HEARD


@compiled
def _note_why(line: Row, medium: Medium) -> None:
    """Write why a frame was not decoded at an AUV, and by what it was overlapped."""
    frame, count = medium.frames[line.broadcast], medium.auvs.first.size - 1
    line.why, line.overlapped_by, line.loss_probability = NONE, NONE, nan
    if medium.promises.size:
        promise = medium.promises[line.broadcast * count + line.auv]
        line.why, line.loss_probability = promise.why, promise.loss
    if line.outcome == OUT_OF_RANGE:
        line.why = OUT_OF_RANGE
    elif line.outcome == LOST and frame.on_air_s < frame.airtime_s:
        line.why = FAILED_MEANWHILE if frame.on_air_s > 0.0 else FAILED
    elif line.outcome == COLLIDED:
        begins, ends, strength = line.arrived_at_s, line.ended_at_s, 1.0
        if medium.promises.size:
            strength = medium.promises[line.broadcast * count + line.auv].sound
        others, strongest = _interference(line.broadcast, line.auv, begins, ends, medium)
        if drowns(strength, others, medium.capture):
            line.why, line.overlapped_by = BY_FRAME, strongest
        else:
            line.why, line.overlapped_by = BY_OWN_PING, _pings(line.auv, begins, ends, medium)


@compiled
def _pings(auv: int, begins: float, ends: float, medium: Medium) -> int:
    """Return the ping that an AUV sends between two instants (s), or NONE."""
    pings = medium.pings
    low, high = 0, len(pings)
    while low < high:  # the first that is not over by then; they are in order
        middle = (low + high) // 2
        if pings[middle].sent_at_s + medium.ping_s > begins:
            high = middle
        else:
            low = middle + 1
    for number in range(low, len(pings)):
        ping = pings[number]
        if ping.sent_at_s >= ends:
            break
        sounds = ping.auv == auv and (ping.call == NONE or ping.call == HEARD)
        if sounds and meet(begins, ends, ping.sent_at_s, ping.sent_at_s + medium.ping_s):
            return number
    return NONE


@compiled
def frame_sent(asv: int, begins: float, ends: float, frames: Rows) -> int:
    """Return the frame that an ASV sends between two instants (s), or NONE."""
    for number in range(len(frames) - 1, -1, -1):
        frame = frames[number]
        if frame.passed_at_s <= begins:
            break
        over = frame.sent_at_s + frame.on_air_s
        if frame.asv == asv and frame.on_air_s > 0.0 and meet(begins, ends, frame.sent_at_s, over):
            return number
    return NONE


@compiled
def _interference(
    number: int, auv: int, begins: float, ends: float, medium: Medium
) -> tuple[float, int]:
    """Return how strong the frames that overlap one at an AUV are together, and the strongest.

    The search ends at a frame by which all before it had passed, or one that was sent later.
    """
    frames, others, most, strongest = medium.frames, 0.0, 0.0, NONE
    for other in range(number - 1, -1, -1):
        if frames[other].passed_at_s <= begins:
            break
        strength = _interference_of(other, auv, begins, ends, medium)
        others += strength
        if strength > most:
            most, strongest = strength, other
    for other in range(number + 1, len(frames)):
        if frames[other].sent_at_s >= ends:
            break
        strength = _interference_of(other, auv, begins, ends, medium)
        others += strength
        if strength > most:
            most, strongest = strength, other
    return others, strongest


@compiled
def _interference_of(other: int, auv: int, begins: float, ends: float, medium: Medium) -> float:
    """Return how strong another frame is at an AUV, if it is there between two instants (s)."""
    _, strength = _promise(other, auv, medium)
    if medium.frames[other].on_air_s == 0.0:  # its ASV had failed
        strength = 0.0
    if strength > 0.0:
        its_begin, its_end = _span(other, auv, medium)
        if not meet(begins, ends, its_begin, its_end):
            strength = 0.0
    return strength


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
