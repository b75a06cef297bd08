"""Places of a scenario in the survey frame (m), where they were given in degrees (WGS-84)."""

from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

from ..geometry.area import polygon
from .key_types import Point, Position
from .scenario_keys import ScenarioKeys
from .sections.placements import AsvTrack
from .sections.routes import RouteTraits, Track

if TYPE_CHECKING:
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

    file, which = _recordings(route)[auv]
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

    file, which = _recordings(placement)[asv]
    times, places = read_track(
        file, placement.time_offset_s, which=which, origin=origin_of(scenario), depth_m=0.0
    )
    return times, places * (1.0, 1.0, 0.0)


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
        found = [read_recording(*it) for it in _recordings(route)]
    except ValueError:
        return False  # which is told where they are read
    return any(recording.lacks_depths for recording in found)


def _recordings(route: Track | AsvTrack) -> list[tuple[str, str]]:
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
