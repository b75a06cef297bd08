"""Travel times of sound to a receiver that moves meanwhile."""

import math
from collections.abc import Callable, Sequence

from ...support.compiled import compiled, inlined
from ...support.wording import refuse
from ..vehicles.motion import Motion, Place, where

# The iteration of the light-time equation ends when the delay changes by less than this (s).
SETTLED = 1e-13

# A step shrinks the error by speed / sound speed: 200 suffice up to 0.86 of the sound speed.
MOST_STEPS = 200

# An arrival up to so much (s) after an instant counts as before it; rounding is far smaller.
NO_TIME = 1e-9

# Vehicles are slower than a fiftieth of the sound speed.  Factor on the longest travel time after
# which a sound has passed all in range, and share of it after which its arrival is worked out.
PASSED, NEARLY_THERE = 1.05, 0.98

# Relative rounding error of an instant; a delay's is four times as large.
LAST_DIGIT = 2.3e-16


def travel_time(
    source: Sequence[float],
    receiver_at: Callable[[float], Sequence[float]],
    sent_at: float,
    sound_speed: float,
) -> float:
    """Return how long (s) a sound sent at `sent_at` travels until it meets a receiver that moves.

    `source` begins with x, y, z (m) of where it was sent, `receiver_at(t)` with those of the
    receiver at time t (s).  Fixed point of D = |receiver_at(sent_at + D) - source| / c, within
    1e-13 s; a receiver at rest is asked twice.  The source's motion after sending does not matter.
    Raises ValueError for a sound speed that is not positive, for positions that are not finite and
    for a receiver that outruns the sound.  Source: light-time equation.

    >>> round(travel_time((0, 0, 0), lambda t: (100 + 1.5 * t, 0, 0), 0.0, 1500.0), 12)
    0.066733400067
    """
    if not 0.0 < sound_speed < math.inf:
        refuse("sound speed", sound_speed, "be positive and finite", "sea water has about 1500")
    x, y, z = source[0], source[1], source[2]
    settled = SETTLED + math.ulp(sent_at)  # no clock is finer than its own last digit
    delay = 0.0
    for _ in range(MOST_STEPS):
        place = receiver_at(sent_at + delay)
        ahead, aside, below = place[0] - x, place[1] - y, place[2] - z
        reached = math.sqrt(ahead * ahead + aside * aside + below * below) / sound_speed
        if abs(reached - delay) < settled + 4 * LAST_DIGIT * delay:
            return reached
        delay = reached
    raise ValueError(
        "a receiver must have a finite position and move slower than sound; after "
        f"{MOST_STEPS} steps the delay of the sound sent from ({x}, {y}, {z}) at {sent_at} s was "
        f"{delay} s and unsettled; check the positions and the speed of the receiver"
    )


@compiled
def travel_time_to(
    source: Place, motion: Motion, vehicle: int, sent_at: float, sound_speed: float
) -> float:
    """Return how long (s) a sound sent from a position (m) at `sent_at` travels to a vehicle:
    :func:`travel_time` for a known motion.

    Raises ValueError when the vehicle outruns the sound.
    """
    return _met(source, motion, vehicle, sent_at, sound_speed, math.inf)


@compiled
def travel_time_by(
    source: Place, motion: Motion, vehicle: int, sent_at: float, sound_speed: float, known: float
) -> float:
    """Return :func:`travel_time_to` for a vehicle whose motion is known up to an instant (s), not
    before `sent_at`; infinite if the sound has not met it by then.
    """
    there = where(motion, vehicle, known)
    if distance(source, there) > sound_speed * (known - sent_at + NO_TIME):
        return math.inf
    return _met(source, motion, vehicle, sent_at, sound_speed, known)


@inlined
def _met(
    source: Place, motion: Motion, vehicle: int, sent_at: float, sound_speed: float, known: float
) -> float:
    """Return :func:`travel_time_to` (s) for a vehicle that rests from `known` (s) on."""
    settled = SETTLED + LAST_DIGIT * sent_at
    delay = 0.0
    for _ in range(MOST_STEPS):
        there = where(motion, vehicle, min(sent_at + delay, known))
        reached = distance(source, there) / sound_speed
        if abs(reached - delay) < settled + 4 * LAST_DIGIT * delay:
            return reached
        delay = reached
    raise ValueError("a vehicle outruns the sound; check its track, its speed and the sound speed")


@compiled
def distance(source: Place, there: Place) -> float:
    """Return the distance (m) between two positions."""
    ahead, aside, below = there[0] - source[0], there[1] - source[1], there[2] - source[2]
    return math.sqrt(ahead * ahead + aside * aside + below * below)
