"""The site of a scenario: its area, its place on Earth, its water.

Places in degrees (WGS-84) become places in the survey frame (m); the speed of sound is as given,
or follows from what is known of the water.
"""

import math
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

from ..geometry.area import Area, polygon, rectangle
from .key_types import Point, Position
from .scenario_keys import ScenarioKeys
from .sections.placements import AsvTrack
from .sections.routes import RouteTraits, Track
from .sections.survey import Survey

if TYPE_CHECKING:
    from ..sea.water import Water
    from ..sea.water_column import Column, Profile
    from ..vehicles.tracks import Track as RecordedTrack


def origin_of(scenario: ScenarioKeys) -> Position | None:
    """Return latitude and longitude (deg) of the place from which x and y go; None if nowhere.

    It is as given, or the centroid of the area that a file describes.
    """
    given, corners = scenario.environment.origin.coordinates, scenario.survey.corners_deg
    return _centroid(corners) if given is None and corners else given


@lru_cache(maxsize=16)
def _centroid(corners: tuple[Position, ...]) -> Position:
    """Return the centroid of a polygon, latitude and longitude (deg).

    That of corners which make none is the first: whoever asks for their area is told what is wrong.
    """
    from ..geometry.geodesy import geodetic_from_ned

    try:
        middle = polygon(in_metres(corners, corners[0])).centroid
    except ValueError:
        return corners[0]
    lat, lon, _ = geodetic_from_ned((*middle, 0.0), *corners[0])
    return lat, lon


AnyRoute = TypeVar("AnyRoute", bound=RouteTraits)


def positioned(scenario: ScenarioKeys, route: AnyRoute) -> AnyRoute:
    """Return the route of a scenario, its places in metres.

    Raises:
        ValueError: when they are in degrees, and the scenario is nowhere on Earth.
    """
    if not route.positions:
        return route
    origin = _known_origin(scenario)
    return route.in_metres(lambda positions: in_metres(positions, origin))


def positioned_stations(scenario: ScenarioKeys) -> tuple[Point, ...] | None:
    """Return where ASVs were given places, [x, y] in m; None where they form a ring.

    Raises:
        ValueError: as of :func:`positioned`.
    """
    asked = scenario.asvs.formation
    degrees = getattr(asked, "positions_deg", None)
    if degrees is not None:
        return in_metres(degrees, _known_origin(scenario))
    metres: tuple[Point, ...] | None = getattr(asked, "positions_m", None)
    return metres


def recorded_track(scenario: ScenarioKeys, route: Track, auv: int) -> "RecordedTrack":
    """Return the track that an AUV repeats: times (n,), s, of the mission, places (n, 3), m.

    Raises:
        ValueError: naming file and remedy, when it is none.
    """
    from ..vehicles.tracks import read_track  # brings numpy, which other routes do not need

    file, which = recordings(route)[auv]
    return read_track(
        file,
        route.time_offset_s,
        which=which,
        origin=origin_of(scenario),
        depth_m=scenario.survey.depth(auv),
    )


def recorded_tracks(scenario: ScenarioKeys, route: Track) -> "list[RecordedTrack]":
    """Return the tracks of a fleet.

    Raises:
        ValueError: naming key and remedy, when one cannot be read or none of it is in the mission.
    """
    from ..vehicles.tracks import misplaced

    tracks = [recorded_track(scenario, route, auv) for auv in range(len(route.files))]
    for number, problem in misplaced(tracks, route.time_offset_s, scenario.duration_s):
        raise ValueError(f"auvs.route.files.{number}: {problem}")
    return tracks


def vessel_track(scenario: ScenarioKeys, placement: AsvTrack, asv: int) -> "RecordedTrack":
    """Return the track that an ASV repeats: times (n,), s, of the mission, places (n, 3), m, at the
    surface whatever depths the file tells.

    Raises:
        ValueError: naming file and remedy, when it is none.
    """
    from ..vehicles.tracks import read_track

    file, which = recordings(placement)[asv]
    origin, offset_s = origin_of(scenario), placement.time_offset_s
    return read_track(file, offset_s, which=which, origin=origin, depth_m=0.0, afloat=True)


def vessel_tracks(scenario: ScenarioKeys, placement: AsvTrack) -> "list[RecordedTrack]":
    """Return the tracks of the ASVs.

    Raises:
        ValueError: naming key and remedy, when one cannot be read or none of it is in the mission.
    """
    from ..vehicles.tracks import misplaced

    tracks = [vessel_track(scenario, placement, asv) for asv in range(len(placement.files))]
    message = misplaced(tracks, placement.time_offset_s, scenario.duration_s, "asvs.formation")
    for number, problem in message:
        raise ValueError(f"asvs.formation.files.{number}: {problem}")
    return tracks


def lacks_depths(scenario: ScenarioKeys) -> bool:
    """Tell whether a track says no depths, so that its AUV is at that of the survey."""
    route = scenario.auvs.route.recording
    if route is None:
        return False
    from ..charts.recordings import read_recording

    try:
        found = [read_recording(*source) for source in recordings(route)]
    except ValueError:
        return False  # which is told where they are read
    return any(recording.lacks_depths for recording in found)


def recordings(route: Track | AsvTrack) -> list[tuple[str, str]]:
    """Return the files of tracks, and which of the tracks in each is meant."""
    return list(zip(route.files, route.tracks or ("",) * len(route.files), strict=False))


def _known_origin(scenario: ScenarioKeys) -> Position:
    origin = origin_of(scenario)
    if origin is None:
        raise ValueError(
            "latitude and longitude need environment.origin.lat_deg and lon_deg, where "
            "x = y = 0; add them"
        )
    return origin


@lru_cache(maxsize=256)
def in_metres(positions: tuple[Position, ...], origin: Position) -> tuple[Point, ...]:
    """Return positions, latitude and longitude (deg), as [x, y] (m) about an origin (deg).

    >>> [(round(x), round(y)) for x, y in in_metres(((54.331, 10.18),), (54.33, 10.18))]
    [(111, 0)]
    """
    import numpy as np  # which scenarios in metres do not need

    from ..geometry.geodesy import ned_at_depth

    lat, lon = np.array(positions, dtype=np.float64).reshape(-1, 2).T
    places = ned_at_depth(lat, lon, np.zeros(len(lat)), origin)
    return tuple((float(x), float(y)) for x, y in places[:, :2])


def area_of(scenario: ScenarioKeys) -> Area:
    """Return the area to be surveyed.

    Raises:
        ValueError: when its polygon is none, saying why.
    """
    return _area(scenario.survey, origin_of(scenario) if scenario.survey.area else None)


@lru_cache(maxsize=16)
def _area(survey: Survey, origin: Position | None) -> Area:
    turn = math.radians(survey.rotation_deg)
    if origin is not None:
        return polygon(in_metres(survey.corners_deg, origin))
    if survey.polygon_m is not None:
        return polygon(survey.polygon_m)
    if survey.size_m is not None:
        return rectangle(*survey.size_m, turn)
    assert survey.side_m is not None, "a scenario has one shape"
    return rectangle(survey.side_m, survey.side_m, turn)


def swath_of(scenario: ScenarioKeys) -> float | None:
    """Return how wide (m) a strip an AUV surveys; None where nobody says."""
    return scenario.survey.swath_m or getattr(scenario.auvs.route, "lane_spacing_m", None)


def lanes_heading(scenario: ScenarioKeys) -> float:
    """Return the heading of the frame in which routes are planned (rad): that of the lanes."""
    asked = getattr(scenario.auvs.route, "lane_heading_deg", None)
    return area_of(scenario).turn if asked is None else math.radians(asked)


def _is_measured(scenario: ScenarioKeys) -> bool:
    """Tell whether a scenario gives the water, and not the speed of sound in it."""
    given = scenario.environment
    return given.temperature_c is not None or given.ctd is not None


def sound_speed_of(scenario: ScenarioKeys) -> float:
    """Return how fast sound travels (m/s) in the water of a scenario.

    It is the number given, or the harmonic mean between the surface and the depth of the survey
    (:func:`..sea.water_column.mean_speed`) of what temperature and salinity or the cast make of it.

    Raises:
        ValueError: naming what is wrong with the cast.
        ImportError: without gsw, where that is asked for.
    """
    if not _is_measured(scenario):
        return scenario.environment.sound_speed_m_per_s
    from ..sea.water_column import (
        mean_speed,  # brings numpy, which speeds that are given do not need
    )

    return mean_speed(profile_of(scenario), scenario.survey.deepest)


def assumed_sound_speed_of(scenario: ScenarioKeys) -> float:
    """Return the speed of sound (m/s) that the fleet works with; see :func:`sound_speed_of`."""
    assumed = scenario.environment.assumed_sound_speed_m_per_s
    return sound_speed_of(scenario) if assumed is None else assumed


def profile_of(scenario: ScenarioKeys) -> "Profile":
    """Return the speed of sound over depth (raises as :func:`sound_speed_of`)."""
    from ..sea.water_column import uniform_profile

    if _is_measured(scenario):
        return _column(scenario).profile()
    return uniform_profile(scenario.environment.sound_speed_m_per_s)


def water_of(scenario: ScenarioKeys) -> "Water":
    """Return the water that absorbs sound down to the survey (raises as :func:`sound_speed_of`)."""
    from ..sea.water import USUAL_WATER

    return _column(scenario).water() if _is_measured(scenario) else USUAL_WATER


def _column(scenario: ScenarioKeys) -> "Column":
    from ..sea.water_column import Column

    given = scenario.environment
    return Column(
        deepest_m=scenario.survey.deepest,
        temperature_c=given.temperature_c,
        salinity_psu=given.salinity_psu,
        cast_file=given.ctd,
        law=given.sound_speed_law,
        place_deg=origin_of(scenario),
    )
