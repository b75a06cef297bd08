"""Specular echoes of surface and bottom: when they come, how strong, and what they do to a ping.

A flat sea of constant depth and one speed of sound; each echo comes from an image of its source.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Sea(NamedTuple):
    """A flat sea: its depth (m), its water (kg/m3, m/s), the bottom's sediment (kg/m3, m/s), and
    the standard deviation of the surface's height (m).

    The sediment is fluid and takes nothing; the usual one is sand.
    """

    depth_m: float
    density_kg_per_m3: float = 1025.0
    sound_speed_m_per_s: float = 1500.0
    bottom_density_kg_per_m3: float = 1900.0
    bottom_speed_m_per_s: float = 1650.0
    surface_sd_m: float = 0.0


class Way(NamedTuple):
    """How an echo goes: its reflections, such as SB for surface, then bottom.

    Its vertical extent is 2 `depths` H + `source` zs + `receiver` zr.
    """

    name: str
    depths: int
    source: int
    receiver: int


def ways(most_reflections: int) -> Iterator[Way]:
    """Yield the ways of all echoes of up to so many reflections, fewest first.

    >>> [way.name for way in ways(3)]
    ['S', 'B', 'SB', 'BS', 'SBS', 'BSB']
    """
    for count in range(1, most_reflections + 1):
        for first in "SB":
            name = "".join("SB"[("SB".index(first) + n) % 2] for n in range(count))
            up, down = (1 if first == "S" else -1), (1 if name[-1] == "S" else -1)
            yield Way(name, name.count("B"), up, down)


class Echoes(NamedTuple):
    """Echoes beside the sound that came straight: each of `ways` along the first axis.

    How much later (s) they arrive; their amplitude in units of the straight sound's, with its sign
    and phase, also those that surface and bottom give it; and the sine of the elevation from which
    they arrive, positive from above.
    """

    ways: tuple[Way, ...]
    later_s: Floats
    gain: Complex
    from_above: Floats


def echoes(
    sea: Sea,
    frequency_khz: float,
    range_m: ArrayLike,
    source_depth_m: ArrayLike,
    receiver_depth_m: ArrayLike,
    most_reflections: int = 3,
) -> Echoes:
    """Return the echoes over horizontal ranges (m) between two depths (m), arrays of one shape.

    Spherical spreading along the straight ways of images.  The surface turns the phase and, rough,
    scatters: -exp(-2 (k sd sin g)^2) at a grazing angle g; the bottom takes
    :func:`bottom_reflection`.  Raises ValueError for depths outside the sea.
    Source: F. B. Jensen et al., Computational Ocean Acoustics (2011), 2.4; L. M. Brekhovskikh,
    Yu. P. Lysanov, Fundamentals of Ocean Acoustics (2003), 9.
    """
    away, source, receiver = np.broadcast_arrays(
        *(np.asarray(it, dtype=float) for it in (range_m, source_depth_m, receiver_depth_m))
    )
    if not all(((it >= 0.0) & (it <= sea.depth_m)).all() for it in (source, receiver)):
        raise ValueError(f"depths must lie in the sea, between 0 and {sea.depth_m:g} m")
    taken = tuple(ways(most_reflections))
    upright = np.array(
        [2 * it.depths * sea.depth_m + it.source * source + it.receiver * receiver for it in taken]
    )
    straight = np.hypot(away, source - receiver)
    lengths = np.hypot(away, upright)
    grazing = np.arctan2(upright, away)
    surface = _surface(sea, frequency_khz, grazing)
    bottom = bottom_reflection(sea, grazing)
    counts = [(it.name.count("S"), it.name.count("B")) for it in taken]
    reflected = np.array(
        [surface[n] ** up * bottom[n] ** down for n, (up, down) in enumerate(counts)]
    )
    wave = 2.0 * math.pi * frequency_khz * 1e3 / sea.sound_speed_m_per_s
    phase = np.exp(1j * wave * (lengths - straight))
    above = np.array([it.receiver for it in taken]).reshape(-1, *np.ones(away.ndim, dtype=int))
    return Echoes(
        taken,
        (lengths - straight) / sea.sound_speed_m_per_s,
        reflected * straight / lengths * phase,
        above * upright / lengths,
    )


def bottom_reflection(sea: Sea, grazing_rad: ArrayLike) -> Complex:
    """Return the Rayleigh reflection coefficient of the bottom at grazing angles (rad).

    Below the critical angle all comes back, turned in phase.
    Source: F. B. Jensen et al., Computational Ocean Acoustics (2011), eq. 1.57.

    >>> round(float(bottom_reflection(Sea(30.0), math.pi / 2).real), 6)
    0.341894
    """
    grazing = np.asarray(grazing_rad, dtype=float)
    denser = sea.bottom_density_kg_per_m3 / sea.density_kg_per_m3
    index = sea.sound_speed_m_per_s / sea.bottom_speed_m_per_s
    # what is under the root is negative below the critical angle, where the wave decays downwards
    below = np.sqrt(index**2 - np.cos(grazing) ** 2 + 0j)
    steep = denser * np.sin(grazing)
    return np.asarray((steep - below) / (steep + below))


def _surface(sea: Sea, frequency_khz: float, grazing: Floats) -> Floats:
    wave = 2.0 * math.pi * frequency_khz * 1e3 / sea.sound_speed_m_per_s
    return np.asarray(-np.exp(-2.0 * (wave * sea.surface_sd_m * np.sin(grazing)) ** 2))


class Blend(NamedTuple):
    """What a receiver makes of a ping whose echoes it cannot tell from it: how much later (s) it
    seems to arrive, its amplitude in units of the straight sound's, and the sine of the elevation
    from which it seems to come.
    """

    later_s: Floats
    amplitude: Floats
    from_above: Floats


def blended(found: Echoes, straight_from_above: ArrayLike, bandwidth_khz: float) -> Blend:
    """Return what a matched filter sees of pings with echoes that come within 1 / B of them.

    The compressed pulse is a triangle of 1 / B on each side, so much of an echo adds up with the
    ping, by phase.  Delay and direction are those of the sum's local slowness, Re(sum a x / sum a):
    what small arrays measure.  Where echo and ping cancel, it is far from either: an outlier.
    `straight_from_above` is the sine of the elevation from which the straight sound comes.
    """
    direct = np.asarray(straight_from_above, dtype=float)
    overlap = np.maximum(1.0 - found.later_s * bandwidth_khz * 1e3, 0.0)
    weights = found.gain * overlap
    total = 1.0 + weights.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        later = ((weights * found.later_s).sum(axis=0) / total).real
        above = ((direct + (weights * found.from_above).sum(axis=0)) / total).real
    return Blend(np.asarray(later), np.abs(total), np.asarray(above))
