"""How an Otter keeps its station: bow against what pushes it, two propellers, ahead or astern.

The Otter cannot push sideways. It feels the sea by an integrator, lies with its bow against it like
a weathervane, and bears away a little to move across. In still water it does not turn after every
gust of noise: it rests within its watch circle and goes back when it has left it.
Method: nonlinear PID with weathervaning, Fossen 2021, sections 15.2 and 15.3.
"""

from math import atan2, cos, hypot, sin, sqrt

from ...core.compiled import compiled
from ..hulls import otter as hull
from ..hulls.frames import Floats
from .signals import half_turn, within

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

# What the controller remembers: averaged offset from station (m), integrator (N), heading wanted
# (rad), whether it lies like a weathervane, whether it is going back, whether it has begun
OFF_N, OFF_E, PUSH_N, PUSH_E, BOW, VANE, RETURNING, BEGUN = range(8)


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
def average_fixes(
    off_north: float, off_east: float, north_rate: float, east_rate: float, interval: float,
    memory: Floats,
) -> None:  # fmt: skip
    """Average noisy fixes (m, off the station) in `memory[:2]`, carried along by the velocity."""
    share = interval / FIX_MEMORY
    memory[0] += share * (off_north - memory[0]) + interval * north_rate
    memory[1] += share * (off_east - memory[1]) + interval * east_rate


@compiled
def _bow(north: float, east: float, memory: Floats) -> tuple[float, bool]:
    """Return the heading to take (rad) under a wanted force (N), and whether astern will do."""
    push = hypot(memory[PUSH_N], memory[PUSH_E])
    off = hypot(memory[OFF_N], memory[OFF_E])
    if push > PUSHED:
        memory[VANE] = 1.0
    elif push < CALM:
        memory[VANE] = 0.0
    if off > WATCH_CIRCLE:
        memory[RETURNING] = 1.0
    elif off < HOME:
        memory[RETURNING] = 0.0
    if memory[VANE] > 0.0 and off <= 2.0 * WATCH_CIRCLE:
        along = (north * memory[PUSH_N] + east * memory[PUSH_E]) / push
        across = (east * memory[PUSH_N] - north * memory[PUSH_E]) / push
        away = within(atan2(across, max(along, push)), FARTHEST_OFF)
        memory[BOW] = atan2(memory[PUSH_E], memory[PUSH_N]) + away
        return memory[BOW], True
    if memory[RETURNING] > 0.0:
        memory[BOW] = atan2(east, north)
        return memory[BOW], off <= WATCH_CIRCLE
    return memory[BOW], True


@compiled
def steer(
    state: Floats, off_north: float, off_east: float, north_rate: float, east_rate: float,
    interval: float, p: Floats, gains: Floats, memory: Floats, command: Floats,
) -> bool:  # fmt: skip
    """Write the revolutions (rad/s) that keep the Otter at its station.

    `state` (8,); its offset from station by GNSS (m) and velocity over ground (m/s), north and
    east; `gains` (2,) the largest thrust (N) of one propeller ahead and astern. Returns whether a
    propeller was saturated; the integrators then wait.
    """
    if memory[BEGUN] == 0.0:  # it has lain at its station for long
        memory[BEGUN], memory[BOW] = 1.0, state[2]
    average_fixes(off_north, off_east, north_rate, east_rate, interval, memory)
    stiff = p[hull.M11] * FREQUENCY**2
    damping = 2.0 * DAMPING * FREQUENCY * p[hull.M11]
    reach = hypot(memory[OFF_N], memory[OFF_E])
    near = min(1.0, FAR / reach) if reach > 0.0 else 1.0
    north = memory[PUSH_N] - stiff * near * memory[OFF_N] - damping * north_rate
    east = memory[PUSH_E] - stiff * near * memory[OFF_E] - damping * east_rate
    bow, astern = _bow(north, east, memory)
    turn = half_turn(bow - state[2])
    wanted = north * cos(state[2]) + east * sin(state[2])
    if not astern:
        wanted = max(wanted, 0.0)
    twist = YAW_FREQUENCY**2 * turn - 2.0 * YAW_DAMPING * YAW_FREQUENCY * state[5]
    moment = twist / p[hull.I33] + p[hull.NR] * state[5]
    difference = within(0.5 * moment / p[hull.LEVER], YAW_THRUST)
    ahead_most, astern_most = gains[0] - abs(difference), gains[1] - abs(difference)
    half = min(max(0.5 * wanted, -max(astern_most, 0.0)), ahead_most)
    command[0], command[1] = _propeller(half + difference, p), _propeller(half - difference, p)
    full: bool = half != 0.5 * wanted
    if not full:
        learning = LEARNING * FREQUENCY * stiff * near * interval
        memory[PUSH_N] -= learning * memory[OFF_N]
        memory[PUSH_E] -= learning * memory[OFF_E]
    return full
