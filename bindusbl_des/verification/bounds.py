"""What is known of a mission before it begins: how fast, how wrong, how late anything may be."""

import math
from dataclasses import dataclass

import numpy as np

from ..scenario.on_earth import vessel_tracks
from ..scenario.planned import route_of, tracks_of
from ..scenario.scenario import Scenario
from ..scenario.sections.anchors import AsvTrack, Placed
from ..scenario.water import assumed_sound_speed_of, sound_speed_of
from ..vehicles.tracks import Track

# So many standard deviations are a bound.
SIGMAS = 3.0

# What a vehicle of a witness can be given, and with it the bound
FASTEST_M_PER_S = 20.0

# How long a witness can be played, and with it that bound
LATEST_S = 1000.0


@dataclass(frozen=True)
class Bounds:
    """Bounds that hold for a whole mission.

    AUVs are at most as fast over ground as `max_speed_m_per_s`, ASVs as `asv_speed_m_per_s`; each
    AUV's clock is at most `clock_error_s` early or late; sound travels at the speed that the fleet
    assumes, give or take `sound_speed_error_m_per_s`; a fix is off by `position_error_m` at most.
    """

    max_speed_m_per_s: float
    asv_speed_m_per_s: float
    clock_error_s: float
    sound_speed_error_m_per_s: float
    position_error_m: float


def bounds_of(
    scenario: Scenario,
    max_speed: float | None = None,
    clock_error: float | None = None,
    sound_speed_error: float | None = None,
) -> Bounds:
    """Return the bounds of a scenario; those given (m/s, s, m/s) stand in place of its own.

    Its own are planned speeds, with the current for vehicles that drift with it; three standard
    deviations of clocks, currents and fixes; and how far the assumed speed of sound is off.

    Raises:
        ValueError: naming a bound that is no number, negative or larger than a mission can have.
        PluginError: when a route of one's own is not allowed or cannot be asked.
    """
    planned = _planned_speed(scenario) if max_speed is None else max_speed
    found = Bounds(
        _checked("--max-speed", planned, FASTEST_M_PER_S, "m/s"),
        _asv_speed(scenario, planned),
        _checked("--clock-error", _or(clock_error, _clock_error(scenario)), LATEST_S, "s"),
        _checked(
            "--sound-speed-error",
            _or(sound_speed_error, _sound_speed_error(scenario)),
            1000.0,
            "m/s",
        ),
        _position_error(scenario),
    )
    assumed = assumed_sound_speed_of(scenario)
    slowest, fastest = (assumed + way * found.sound_speed_error_m_per_s for way in (-1, 1))
    if not (slowest >= 1300.0 and fastest <= 1700.0):
        raise ValueError(
            f"--sound-speed-error: {found.sound_speed_error_m_per_s:g} m/s about the {assumed:g} "
            "m/s that the fleet assumes leaves the 1300 to 1700 m/s of water; give less"
        )
    return found


def _or(given: float | None, own: float) -> float:
    return own if given is None else given


def _checked(option: str, value: float, most: float, unit: str) -> float:
    if not 0.0 <= value <= most:
        raise ValueError(
            f"{option}: must be at least 0 and at most {most:g} {unit}; got {value:g}; give another"
        )
    return value


def _current(scenario: Scenario) -> float:
    water = scenario.environment
    return water.current_m_per_s + SIGMAS * water.current_variation_m_per_s


def _planned_speed(scenario: Scenario) -> float:
    """Return how fast (m/s) the fastest AUV goes over ground, by what is planned."""
    route = route_of(scenario)
    if route.kind == "hold":
        return 0.0
    tracks = tracks_of(scenario)
    if tracks is not None:
        return max(map(_fastest, tracks))
    speed = max(scenario.auvs.speeds)
    return min(speed + _current(scenario), FASTEST_M_PER_S) if _drifts(scenario) else speed


def _drifts(scenario: Scenario) -> bool:
    vehicle = scenario.auvs.vehicle
    return vehicle.has_dynamics or vehicle.own is not None


def _fastest(track: Track) -> float:
    """Return the speed (m/s) of the fastest leg of a track."""
    times, places = track
    if len(times) < 2:
        return 0.0
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float((ways / np.diff(times)).max())


def _asv_speed(scenario: Scenario, auv_speed: float) -> float:
    """Return how fast (m/s) ASVs are: those that keep station by themselves as fast as AUVs."""
    placement, vehicle = scenario.asvs.formation, scenario.asvs.vehicle
    if isinstance(placement, AsvTrack):
        return max(map(_fastest, vessel_tracks(scenario, placement)))
    if isinstance(placement, Placed):
        return placement.speed_m_per_s
    return auv_speed if vehicle.has_dynamics or vehicle.own else 0.0


def _clock_error(scenario: Scenario) -> float:
    """Return how wrong (s) the worst AUV's clock is by the end of the mission.

    What AUVs are said to be late is between no lateness and the largest: half of it either way.
    """
    navigation = scenario.navigation
    drawn = navigation.clock_offset_sd_s + navigation.clock_drift_sd * scenario.duration_s
    return SIGMAS * drawn + max(scenario.auvs.ping_late_s or (0.0,)) / 2


def _sound_speed_error(scenario: Scenario) -> float:
    return abs(sound_speed_of(scenario) - assumed_sound_speed_of(scenario))


def _position_error(scenario: Scenario) -> float:
    """Return how far (m) a fix is off at HF range, by attitude, travel time and GNSS."""
    usbl, reach = scenario.usbl, scenario.acoustics.hf.range_m
    angles = (usbl.heading_sd_deg, usbl.roll_sd_deg, usbl.pitch_sd_deg)
    across = reach * math.radians(math.hypot(*angles))
    along = assumed_sound_speed_of(scenario) * usbl.travel_time_sd_s
    return SIGMAS * math.hypot(across, along, usbl.gnss_sd_m)
