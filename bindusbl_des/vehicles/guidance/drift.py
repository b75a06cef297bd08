"""What fixes tell of the drift: how fast a current that no log sees carries a vehicle off.

Dead reckoning falls behind by the current, and fixes bring it forward again; so the sum of all
corrections grows as fast as the water carries the vehicle (less what the log's bias makes of it).
A straight line through that sum, with a memory that fades, has that rate as its slope. It is not a
filter of the position: the vehicle goes on steering by the fused estimate as it is.
"""

from math import exp

import numpy as np

from ...core.compiled import compiled
from ...records.rows import Row

# s: a fix weighs 1/e when this old. With 5 to 30 s a BlueROV2 keeps its path equally well; a REMUS
# with fixes three seconds apart wants 20 s or more.
MEMORY = 20.0
# The memory is a third of the time since the start as long as that is shorter, a second at least:
# the line turns quickly while it is short, and noise of the first fix is no current.
YOUNG, YOUNGEST = 3.0, 3.0

AT_ONCE = 1e-9  # s, between two looks, at least

# What is remembered: the sum of corrections last seen (m), the line's end there (m) and its slope
# (m/s), north and east; when that was (s)
TREND = np.dtype(
    [("seen", "f8", (2,)), ("end", "f8", (2,)), ("rate", "f8", (2,)), ("seen_at", "f8")]
)


@compiled
def learn(time: float, north: float, east: float, line: Row) -> None:
    """Take in an AUV's sum of corrections (m) at an instant (s); nothing happens between fixes.

    `line`, a TREND, is zero at first, and begins with the first fix, which may put right a wrong
    initial position. With k = exp(-T / memory) after T without a fix, its end takes 1 - k^2 of what
    it is off, its slope (1 - k)^2 / T: at equal intervals that is least squares with fading weights
    (critically damped g-h filter, Brookner 1998, Tracking and Kalman Filtering Made Easy).
    """
    if north == line.seen[0] and east == line.seen[1]:
        return
    if line.seen_at == 0.0:
        line.end[0], line.end[1] = north, east
    past = max(time - line.seen_at, AT_ONCE)
    kept = exp(-past / min(MEMORY, (time + YOUNGEST) / YOUNG))
    for axis in range(2):
        carried = line.end[axis] + past * line.rate[axis]
        off = (north if axis == 0 else east) - carried
        line.end[axis] = carried + (1.0 - kept**2) * off
        line.rate[axis] += (1.0 - kept) ** 2 / past * off
    line.seen[0], line.seen[1], line.seen_at = north, east, time
