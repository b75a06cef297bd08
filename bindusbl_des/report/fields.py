"""What is to be expected over the survey: the chance of a fix, the last fix's age, the error."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..acoustics.fix_chance import fix_chance, survey_grid
from ..geometry.formation import keep_station
from ..scenario.declared import navigator_of
from .packing import Packer
from .recording import Recording

Floats = NDArray[np.float64]

# The longer side of the survey has so many cells.
CELLS = 48

# Where one ping in so many makes a fix, or fewer, none is to be expected.
HARDLY_ANY = 1e-3

# How well a place is fixed is taken from so many fixes of the mission nearest to it, of so many;
# so many places are looked at at once.
NEAREST, MOST_FIXES, AT_ONCE = 8, 4000, CELLS

# Packed to steps of these: a probability, an age (s), an error (m).
QUANTA = {"chance": 1e-3, "age": 1e-2, "error": 1e-3}


def fields(mission: Recording, packer: Packer) -> dict[str, Any] | None:
    """Return the fields of a mission's survey, packed in the order of the cells of its grid.

    None where ASVs move, and where somebody's own channel decides what is decoded: it is not asked
    again.
    """
    grid = survey_grid(mission.scenario, CELLS)
    ways = np.stack([mission.truth[name][mission.auvs :] for name in ("x_m", "y_m")], axis=-1)
    if not keep_station(ways, mission.scenario.acoustics.hf.range_m):
        return None
    chance = fix_chance(mission.scenario, ways[:, 0], grid.middles)
    if chance is None:
        return None
    chance = np.where(grid.inside, chance, np.nan)
    found = {"chance": chance, "age": expected_age(chance, _round(mission))}
    error = expected_error(mission, grid.middles, chance)
    if error is not None:
        found["error"] = error
    packed = {name: packer.add(values, quantum=QUANTA[name]) for name, values in found.items()}
    return {"box": grid.box, "across": grid.across, **packed}


def expected_age(chance: Floats, round_s: float) -> Floats:
    """Return the time mean of the time (s) since the last fix was made, a ping each `round_s` (s).

    Each ping makes a fix with a probability of its own: E[tau^2] / (2 E[tau]) = T (2 - p) / (2 p)
    of waits that are geometric.  NaN where hardly any makes one.
    """
    with np.errstate(divide="ignore"):
        age = round_s * (2.0 - chance) / (2.0 * chance)
    return np.where(chance > HARDLY_ANY, age, np.nan)


def expected_error(mission: Recording, places: Floats, chance: Floats) -> Floats | None:
    """Return the RMS (m) of the horizontal error to be expected of an AUV that is at a place.

    Waits for fixes are geometric with a mean of tau = T / p, and fixes as good as the mission's
    nearest ones.  A filter that weighs fixes and has learnt the bias: a random walk q and fixes r
    along each axis leave sqrt(q^2 tau^2 / 4 + q tau r).  The gain g on fixes: what it lets through
    of their noise, the bias b that it follows late, and the walk since.  NaN where hardly a ping
    makes a fix; None for filters that take none, and those of somebody's own.
    Sources: steady states of the Riccati equation, and of the error of a fixed gain.
    """
    navigation = mission.scenario.navigation
    noise = _noise(mission, places)
    navigator = navigator_of(mission.scenario)
    if noise is None or not (navigation.weighs or navigator.has_gain):
        return None
    wait = _round(mission) / np.where(chance > HARDLY_ANY, chance, np.nan)
    walk = navigation.random_walk_m_per_sqrt_s**2
    if not navigator.has_gain:
        return np.sqrt(2.0 * np.sqrt(walk**2 * wait**2 / 4.0 + walk * wait * noise))
    gain, p = navigation.fixed_gain.gain, chance
    bias = math.hypot(*navigation.velocity_bias_m_per_s, _drawn(mission))
    squares = wait**2 * (2.0 - p)
    cubes = wait**3 * (p * p - 6.0 * p + 6.0)
    left = (1.0 - gain) ** 2 * (2.0 * walk * wait + bias**2 * wait**2 * (1.0 - p))
    after = (left + 2.0 * gain**2 * noise) / (gain * (2.0 - gain))
    lag = (1.0 - gain) * bias * wait / gain
    drift = lag * bias * squares / wait + bias**2 * cubes / (3.0 * wait)
    return np.sqrt(after + lag**2 + drift + 2.0 * walk * squares / (2.0 * wait) + _late(mission))


def _noise(mission: Recording, places: Floats) -> Floats | None:
    """Return the variance (m2) along an axis of the fixes nearest to places; None without fixes."""
    fixes = mission.fixes
    step = max(1, -(-len(fixes["x_m"]) // MOST_FIXES))
    x, y, sd_x, sd_y = (fixes[f"{name}_m"][::step] for name in ("x", "y", "sd_x", "sd_y"))
    if not len(x):
        return None
    variance = (sd_x**2 + sd_y**2) / 2.0
    nearest = min(NEAREST, len(x))
    found = np.empty(len(places))
    for first in range(0, len(places), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        away = (x - places[some, :1]) ** 2 + (y - places[some, 1:2]) ** 2
        near = np.argpartition(away, nearest - 1)[:, :nearest]
        found[some] = variance[near].mean(axis=1)
    return found


def _drawn(mission: Recording) -> float:
    """Return the sd (m/s) of what else drifts like a constant bias, both axes together."""
    navigation, speed = mission.scenario.navigation, max(mission.scenario.auvs.speeds)
    skew = math.hypot(navigation.scale_factor_sd, math.radians(navigation.heading_sd_deg))
    return math.hypot(math.sqrt(2.0) * navigation.velocity_bias_sd_m_per_s, skew * speed)


def _late(mission: Recording) -> float:
    """Return the square (m2) of the way that an AUV goes on while a fix comes, if uncounted."""
    if mission.scenario.navigation.fixed_gain.delay_compensation == "shift":
        return 0.0
    latency = mission.metrics.mission["latency_mean_s"] or 0.0
    return float((mission.metrics.mission["speed_m_per_s"] * latency) ** 2)


def _round(mission: Recording) -> float:
    """Return the mean time (s) from one turn of an AUV to its next; passive: from ping to ping."""
    starts, duration = mission.rounds["started_at_s"], mission.scenario.duration_s
    length = float(np.diff(starts).mean()) if len(starts) > 1 else duration
    return length / mission.scenario.asvs.count if mission.scenario.protocol.is_passive else length
