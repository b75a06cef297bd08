"""What is known of a mission before it begins: how fast, how wrong, how late anything may be."""

import math
from dataclasses import dataclass

import numpy as np

from ..scenario.on_earth import vessel_tracks
from ..scenario.planned import route_of, tracks_of
from ..scenario.scenario import Scenario
from ..scenario.sections.anchors import AsvTrack, Placed
from ..scenario.sections.vehicle_choice import VehicleChoice
from ..scenario.water import assumed_sound_speed_of, sound_speed_of
from ..usbl.bounds import exceeded
from ..vehicles.currents import CONTROL_S
from ..vehicles.guidance.limits import top_speed
from ..vehicles.tracks import Track

# With this chance a mission is worse than its bounds: Gaussian errors, and outliers, have none.
CHANCE = 1e-6

# Norms of errors drawn for each ping at each ASV (range, angles, AHRS, GNSS, spread, outlier), and
# for each vehicle (clock, compass, misalignment)
OF_A_PING, OF_A_VEHICLE = 8, 4

# What a vehicle of a witness can be given, and with it the bound
FASTEST_M_PER_S = 20.0

# How slow and how fast (m/s) sound may be in a scenario
SLOWEST, FASTEST = 1300.0, 1700.0

# How long a witness can be played, and with it that bound
LATEST_S = 1000.0


@dataclass(frozen=True)
class Bounds:
    """Bounds that hold for a whole mission: no Gaussian error is larger than `sigmas` standard
    deviations, but with a chance of CHANCE.

    AUVs are at most as fast over ground as `max_speed_m_per_s`, ASVs as `asv_speed_m_per_s`; each
    AUV's clock is at most `clock_error_s` early or late; sound travels at the speed that the fleet
    assumes, give or take `sound_speed_error_m_per_s`.
    """

    max_speed_m_per_s: float
    asv_speed_m_per_s: float
    clock_error_s: float
    sound_speed_error_m_per_s: float
    sigmas: float


def bounds_of(
    scenario: Scenario,
    max_speed: float | None = None,
    clock_error: float | None = None,
    sound_speed_error: float | None = None,
) -> Bounds:
    """Return the bounds of a scenario; those given (m/s, s, m/s) stand in place of its own.

    Its own are planned speeds, of vehicles with equations of motion the highest that they reach and
    the current's, which they drift with; so many standard
    deviations of clocks, currents and fixes as none exceeds in a mission but with a chance of
    CHANCE; and how far the assumed speed of sound is off.

    Raises:
        ValueError: naming a bound that is no number, negative or larger than a mission can have.
        PluginError: when a route of one's own is not allowed or cannot be asked.
    """
    sigmas = exceeded(CHANCE, _draws(scenario))
    planned = _planned_speed(scenario, sigmas) if max_speed is None else max_speed
    found = Bounds(
        _checked("--max-speed", planned, FASTEST_M_PER_S, "m/s"),
        _asv_speed(scenario, planned, sigmas),
        _checked("--clock-error", _or(clock_error, _clock_error(scenario, sigmas)), LATEST_S, "s"),
        _checked(
            "--sound-speed-error",
            _or(sound_speed_error, _sound_speed_error(scenario)),
            1000.0,
            "m/s",
        ),
        sigmas,
    )
    assumed, error = assumed_sound_speed_of(scenario), found.sound_speed_error_m_per_s
    is_water = SLOWEST <= assumed - error <= assumed + error <= FASTEST
    if sound_speed_error is not None and not is_water:
        raise ValueError(
            f"--sound-speed-error: {error:g} m/s about the {assumed:g} m/s that the fleet assumes "
            f"leaves the {SLOWEST:g} to {FASTEST:g} m/s of water; give less"
        )
    return found


def _draws(scenario: Scenario) -> float:
    """Return how many Gaussian errors a mission draws, or norms of such, at most: of each ping at
    each ASV, of each interval in which currents and GNSS wander, and of each vehicle.
    """
    auvs, asvs, lasts = scenario.auvs.count, scenario.asvs.count, scenario.duration_s
    pings = auvs * (1.0 + lasts / scenario.acoustics.hf.ping_s)
    wandering = (1.0 + lasts / CONTROL_S) * (asvs + 1)
    return OF_A_PING * pings * asvs + 2 * wandering + OF_A_VEHICLE * (auvs + asvs)


def _or(given: float | None, own: float) -> float:
    return own if given is None else given


def _checked(option: str, value: float, most: float, unit: str) -> float:
    if not 0.0 <= value <= most:
        raise ValueError(
            f"{option}: must be at least 0 and at most {most:g} {unit}; got {value:g}; give another"
        )
    return value


def _current(scenario: Scenario, sigmas: float) -> float:
    water = scenario.environment
    return water.current_m_per_s + (sigmas + math.sqrt(2)) * water.current_variation_m_per_s


def _planned_speed(scenario: Scenario, sigmas: float) -> float:
    """Return how fast (m/s) the fastest AUV goes over ground, by what is planned."""
    route = route_of(scenario)
    if route.kind == "hold":
        return 0.0
    tracks = tracks_of(scenario)
    if tracks is not None:
        return max(map(_fastest, tracks))
    return _driven(scenario, scenario.auvs.vehicle, max(scenario.auvs.speeds), sigmas)


def _driven(scenario: Scenario, vehicle: VehicleChoice, speed: float, sigmas: float) -> float:
    """Return how fast (m/s) a vehicle is over ground that is to go at a speed: one with equations
    of motion at times as fast as it can, and the current with it.
    """
    if vehicle.own is None and not vehicle.has_dynamics:
        return speed
    if vehicle.has_dynamics:
        speed = max(speed, top_speed(vehicle.model, dict(vehicle.coefficients)))
    return min(speed + _current(scenario, sigmas), FASTEST_M_PER_S)


def _fastest(track: Track) -> float:
    """Return the speed (m/s) of the fastest leg of a track."""
    times, places = track
    if len(times) < 2:
        return 0.0
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float((ways / np.diff(times)).max())


def _asv_speed(scenario: Scenario, auv_speed: float, sigmas: float) -> float:
    """Return how fast (m/s) ASVs are; of one's own, as fast as AUVs at least."""
    placement, vehicle = scenario.asvs.formation, scenario.asvs.vehicle
    if isinstance(placement, AsvTrack):
        return max(map(_fastest, vessel_tracks(scenario, placement)))
    if isinstance(placement, Placed):
        return placement.speed_m_per_s
    if not (vehicle.has_dynamics or vehicle.own):
        return 0.0
    return _driven(scenario, vehicle, auv_speed, sigmas)


def _clock_error(scenario: Scenario, sigmas: float) -> float:
    """Return how wrong (s) the worst AUV's clock is by the end of the mission.

    What AUVs are said to be late is between no lateness and the largest: half of it either way.
    """
    navigation = scenario.navigation
    drawn = navigation.clock_offset_sd_s + navigation.clock_drift_sd * scenario.duration_s
    return sigmas * drawn + max(scenario.auvs.ping_late_s or (0.0,)) / 2


def _sound_speed_error(scenario: Scenario) -> float:
    return abs(sound_speed_of(scenario) - assumed_sound_speed_of(scenario))
