"""What an AUV measures of an ASV's ping with its own array: where it is itself (inverted USBL).

Everything is that of :mod:`.instrument` seen from the other end: the array and the AHRS are the
AUV's, the source is the ASV.  Synchronised clocks make the travel time a range.  Source: Rypkema,
Fischell and Schmidt, "One-way travel-time inverted ultra-short baseline localization for low-cost
autonomous underwater vehicles", ICRA 2017.
"""

from ..core.compiled import compiled
from .instrument import Instrument, Vector, locate


@compiled
def locate_itself(
    source: Vector,
    place: Vector,
    yaw: float,
    travel_time: float,
    noise: Vector,
    instrument: Instrument,
) -> tuple[Vector, Vector]:
    """Measure one ping: return a fix (3,), m, of the receiver, and its covariance (3, 3), m2.

    `source` is where the ping was sent, `place` and `yaw` (rad) where the array is when it arrives
    (survey frame, m), and where the fix holds.  `noise` are NOISE_WIDTH standard normal numbers, of
    which the last three make the error of what the receiver takes the source's place for (GNSS).

    The fix is that place less the offset measured.  With the source as the origin it is the mirror
    image of a fix of the source, and a covariance is that of its mirror image.
    """
    image, covariance = locate(-place, -source, yaw, travel_time, noise, instrument)
    return -image, covariance
