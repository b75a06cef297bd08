"""How an Otter keeps its station: bow against what pushes it, two propellers, ahead or astern.

The Otter cannot push sideways. It feels the sea by an integrator, lies with its bow against it like
a weathervane, and bears away a little to move across. In still water it does not turn after every
gust of noise: it rests within its watch circle and goes back when it has left it.
Method: nonlinear PID with weathervaning, Fossen 2021, sections 15.2 and 15.3.
"""

from math import atan2, hypot, sqrt

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from ...records.rows import Row
from ..hulls import otter as hull
from .sensing import Sensed, half_turn, within

WATCH_CIRCLE = 2.0  # m: leaving it sends the Otter back to within HOME
HOME = 0.4  # m
FAR = 10.0  # m, beyond which it is not drawn home any harder
FREQUENCY, DAMPING = 0.25, 1.0  # rad/s, position; Fossen 2021: 0.1 to 0.5 rad/s for station keeping
LEARNING = 0.1  # of frequency times stiffness: the integrator (Fossen 2021, algorithm 15.1)
YAW_FREQUENCY, YAW_DAMPING = 1.0, 0.9  # rad/s, four times that of position
FIX_MEMORY = 5.0  # s over which position fixes are averaged, velocity carrying them meanwhile
PUSHED, CALM = 6.0, 3.0  # N: against more it lies like a weathervane, under less it rests
FARTHEST_OFF = 0.9  # rad by which it bears away at most while it lies so
YAW_THRUST = 60.0  # N of difference between the propellers that steering may take: half of one

# What the controller is told at first, the largest thrust (N) of one propeller ahead and astern,
# and what it remembers: averaged offset from station (m), integrator (N), heading wanted (rad),
# whether it lies like a weathervane, whether it is going back, whether it has begun
_NUMBERS = ("most_ahead", "most_astern", "off_n", "off_e", "push_n", "push_e", "bow")
MEMORY = np.dtype(
    [(name, "f8") for name in _NUMBERS] + [(name, "?") for name in ("is_vane", "returns", "begun")]
)


@compiled
def _propeller(thrust: float, p: Floats) -> float:
    """Return the revolutions (rad/s) that give a thrust (N)."""
    if thrust >= 0.0:
        return sqrt(thrust / p[hull.AHEAD])
    return -sqrt(-thrust / p[hull.ASTERN])


def greatest_thrust(p: Floats) -> tuple[float, float]:
    """Return the largest thrust (N) of one propeller ahead and astern."""
    ahead, astern = p[hull.FASTEST], p[hull.SLOWEST]
    return p[hull.AHEAD] * ahead * ahead, p[hull.ASTERN] * astern * astern


@compiled
def average_fixes(sensed: Sensed, interval: float, memory: Row) -> None:
    """Average noisy fixes (m, off the station) in a memory, carried along by the velocity."""
    share = interval / FIX_MEMORY
    memory.off_n += share * (sensed.off_n - memory.off_n) + interval * sensed.log_n
    memory.off_e += share * (sensed.off_e - memory.off_e) + interval * sensed.log_e


@compiled
def _bow(north: float, east: float, memory: Row) -> tuple[float, bool]:
    """Return the heading to take (rad) under a wanted force (N), and whether astern will do."""
    push = hypot(memory.push_n, memory.push_e)
    off = hypot(memory.off_n, memory.off_e)
    if push > PUSHED:
        memory.is_vane = True
    elif push < CALM:
        memory.is_vane = False
    if off > WATCH_CIRCLE:
        memory.returns = True
    elif off < HOME:
        memory.returns = False
    if memory.is_vane and off <= 2.0 * WATCH_CIRCLE:
        along = (north * memory.push_n + east * memory.push_e) / push
        across = (east * memory.push_n - north * memory.push_e) / push
        away = within(atan2(across, max(along, push)), FARTHEST_OFF)
        memory.bow = atan2(memory.push_e, memory.push_n) + away
        return memory.bow, True
    if memory.returns:
        memory.bow = atan2(east, north)
        return memory.bow, off <= WATCH_CIRCLE
    return memory.bow, True


@compiled
def steer(sensed: Sensed, interval: float, p: Floats, memory: Row, command: Floats) -> bool:
    """Write the revolutions (rad/s) that keep the Otter at its station.

    It knows its offset from there by GNSS and its velocity over ground. Returns whether a propeller
    was saturated; the integrators then wait.
    """
    posture = sensed.posture
    if not memory.begun:  # it has lain at its station for long
        memory.begun, memory.bow = True, posture.yaw
    average_fixes(sensed, interval, memory)
    stiff = p[hull.M11] * FREQUENCY**2
    damping = 2.0 * DAMPING * FREQUENCY * p[hull.M11]
    reach = hypot(memory.off_n, memory.off_e)
    near = min(1.0, FAR / reach) if reach > 0.0 else 1.0
    north = memory.push_n - stiff * near * memory.off_n - damping * sensed.log_n
    east = memory.push_e - stiff * near * memory.off_e - damping * sensed.log_e
    bow, astern = _bow(north, east, memory)
    turn = half_turn(bow - posture.yaw)
    wanted = north * posture.c_yaw + east * posture.s_yaw
    if not astern:
        wanted = max(wanted, 0.0)
    twist = YAW_FREQUENCY**2 * turn - 2.0 * YAW_DAMPING * YAW_FREQUENCY * posture.turning
    moment = twist / p[hull.I33] + p[hull.NR] * posture.turning
    difference = within(0.5 * moment / p[hull.LEVER], YAW_THRUST)
    ahead_most = memory.most_ahead - abs(difference)
    astern_most = memory.most_astern - abs(difference)
    half = min(max(0.5 * wanted, -max(astern_most, 0.0)), ahead_most)
    command[0], command[1] = _propeller(half + difference, p), _propeller(half - difference, p)
    full: bool = half != 0.5 * wanted
    if not full:
        learning = LEARNING * FREQUENCY * stiff * near * interval
        memory.push_n -= learning * memory.off_n
        memory.push_e -= learning * memory.off_e
    return full
