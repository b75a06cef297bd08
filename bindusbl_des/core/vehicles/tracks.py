"""Recorded tracks of real vehicles, in the frame and time of a mission."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...models.charts.recordings import RecordedTrack, read_recording
from ...models.charts.shapes import Degrees, above_sea
from ...support.arrays import Floats
from ...support.wording import plain
from ..geometry.geodesy import far_apart_m, ned_at_depth, ned_from_geodetic

Track = tuple[Floats, Floats]

# A faster track (m/s) is no vehicle's, and would outrun its own sound.
FASTEST = 1000.0

# Depths at the surface lie within the error of a pressure gauge (m) and the height of waves (m).
ERRING, LIFTED = 0.5, 1.0

# No position of a scenario is farther from the survey's centre (m).
FARTHEST = 1e6


# Two samples have a gap between them, not a leg, if their interval is GAP_STEPS times the median
# and above GAP_S (s), their distance above GAP_M (m), and the speed between them GAP_PACE times
# lower or higher than elsewhere.
GAP_STEPS, GAP_S, GAP_M, GAP_PACE = 10.0, 60.0, 10.0, 2.0


def misplaced(
    tracks: Sequence[Track], offset_s: float, duration_s: float, section: str = "auvs.route"
) -> list[tuple[int, str]]:
    """Return which tracks lie outside a mission of `duration_s` (s) or have a gap in it; and
    remedies.

    Their vehicles would stand still throughout, or crawl through the gap.  `section` is the section
    of their keys.
    """
    away = [n for n, (times, _) in enumerate(tracks) if times[0] >= duration_s or times[-1] <= 0.0]
    first = min((float(tracks[number][0][0]) for number in away), default=0.0)
    remedy = f"set {section}.time_offset_s: {plain(first + offset_s)} to begin the mission with it"
    found = [(number, f"{_span(tracks[number][0], duration_s)}; {remedy}") for number in away]
    for number, track in enumerate(tracks):
        for begin, end, metres in gaps(track):
            if begin < duration_s and end > 0.0:
                found.append((number, _gap(begin, end, metres, offset_s, section)))
                break
    return found


def gaps(track: Track) -> list[tuple[float, float, float]]:
    """Return the gaps in a track, its unknown stretches: begin and end (s) and distance (m).

    >>> times, x = np.array([0.0, 40.0, 80.0, 3600.0, 3640.0]), np.array([0.0, 40, 80, 210, 250])
    >>> gaps((times, np.column_stack((x, 0 * x, 0 * x))))
    [(80.0, 3600.0, 130.0)]
    """
    times, positions = track
    steps, ways = np.diff(times), np.hypot(*np.diff(positions[:, :2], axis=0).T)
    is_long = steps > GAP_STEPS * np.percentile(steps, 50, method="lower")
    paces = ways / steps
    others = paces[~is_long & (paces > 0.0)]
    usual = float(np.median(others)) if len(others) else 0.0
    is_odd = (paces * GAP_PACE < usual) | (paces > usual * GAP_PACE)
    found = np.flatnonzero(is_long & is_odd & (steps > GAP_S) & (ways > GAP_M))
    return [(float(times[n]), float(times[n + 1]), float(ways[n])) for n in found]


def _gap(begin: float, end: float, metres: float, offset_s: float, section: str) -> str:
    """Describe a gap, and how to fly the track before or after it."""
    before = f"end the mission before it (duration_s: {plain(begin)}), " if begin > 0.0 else ""
    return (
        f"it has a gap from {plain(begin)} to {plain(end)} s of the mission, in which nobody knows "
        f"its way ({metres:.3g} m); {before}begin it after it ({section}.time_offset_s: "
        f"{plain(end + offset_s)}), or add samples of the way to the file"
    )


def _span(times: Floats, duration_s: float) -> str:
    return (
        f"its times, {plain(float(times[0]))} to {plain(float(times[-1]))} s of the mission, lie "
        f"outside it (0 to {plain(duration_s)} s)"
    )


def read_track(
    path: str | Path,
    offset_s: float = 0.0,
    *,
    which: str = "",
    origin: Sequence[float] | None = None,
    depth_m: float = math.nan,
    afloat: bool = False,
) -> Track:
    """Return the times (n,), s, and positions (n, 3), m, z down, of a recorded track.

    CSV, GPX and MCAP files are read (:mod:`...models.charts.recordings`); `which` names one of
    several tracks in a file.  `offset_s` is subtracted from its times.  Latitude and longitude
    become metres about `origin`: latitude and longitude (deg) and the height of the water (m, 0 if
    left out). Heights become depths below the survey's plane.  `depth_m` applies where the file has
    no depth; a vehicle `afloat` is at the surface, whatever the file says.

    Raises:
        ValueError: naming file, line and remedy, when the file is not such a track.
    """
    surface_m = 0.0 if origin is None else (*origin, 0.0)[2]
    recording = read_recording(path, which, surface_m)
    if recording.in_degrees:
        positions = _in_metres(path, recording, depth_m, origin)
    else:
        positions = np.column_stack((recording.places, _depths(recording, depth_m)))
    _check_speed(path, recording, positions)
    if afloat:
        positions[:, 2] = 0.0
    elif is_in_air(positions[:, 2]):
        highest = int(positions[:, 2].argmin())
        raise ValueError(
            f"{recording.where[highest]}: is {-positions[highest, 2]:.4g} m above the sea, and no "
            f"sample is more than {ERRING:g} m below it; depths must be positive below the sea, "
            "heights negative. Turn their sign; or remove them (GPX, MCAP) to have the AUV at "
            "survey.depth_m"
        )
    positions.setflags(write=False)
    return recording.times - offset_s, positions


def is_in_air(depths: Floats) -> bool:
    """Return whether the depths (m) of a track are heights: some above the waves, none in the sea.

    >>> is_in_air(np.array([0.1, -3.0])), is_in_air(np.array([0.3, -0.9]))
    (True, False)
    >>> is_in_air(np.array([8.0, -2.0]))
    False
    """
    return bool(depths.min() < -LIFTED and depths.max() <= ERRING)


def _depths(recording: RecordedTrack, depth_m: float) -> Floats:
    return np.where(np.isnan(recording.depths), depth_m, recording.depths)


def _in_metres(
    path: str | Path, recording: RecordedTrack, depth_m: float, origin: Sequence[float] | None
) -> Floats:
    if origin is None:
        raise ValueError(
            f"{path}: is in latitude and longitude; set environment.origin.lat_deg and lon_deg, "
            "where x = y = 0"
        )
    lat, lon = recording.places.T
    is_far = far_apart_m(lat, lon, origin) > FARTHEST
    if is_far.any():
        first = int(is_far.argmax())
        raise ValueError(f"{recording.where[first]}: {too_far((lat[first], lon[first]), origin)}")
    positions = ned_at_depth(lat, lon, _depths(recording, depth_m), origin)
    if recording.below_ellipsoid:
        known = np.flatnonzero(~np.isnan(recording.depths))
        positions[known] = ned_from_geodetic(
            lat[known], lon[known], -recording.depths[known], *origin
        )
        for sample in known[np.argsort(positions[known, 2])][:1]:  # the highest
            above_sea(recording.where[sample], -float(positions[sample, 2]))
    return positions


def too_far(position: Degrees, origin: Sequence[float]) -> str:
    """Return a message on a position (deg) far from the survey's origin (deg), naming the likely
    slip.
    """
    lat, lon = position
    away = float(far_apart_m([lat], [lon], origin)[0])
    where = (
        f"latitude {lat:.9g}, longitude {lon:.9g} is {away / 1e3:,.0f} km from environment.origin"
    )
    swapped = abs(lon) <= 90.0 and far_apart_m([lon], [lat], origin)[0] < FARTHEST
    if swapped:
        return f"{where}, but near it with latitude and longitude swapped; swap them"
    return f"{where} ({origin[0]:.9g}, {origin[1]:.9g}); correct one of them"


def _check_speed(path: str | Path, recording: RecordedTrack, positions: Floats) -> None:
    """Refuse a track that is faster than any vehicle."""
    speeds = np.hypot(*np.diff(positions[:, :2], axis=0).T) / np.diff(recording.times)
    fastest = int(np.argmax(speeds))
    if speeds[fastest] > FASTEST:
        units = (
            "lat_deg and lon_deg in degrees" if recording.in_degrees else "x_m and y_m in metres"
        )
        raise ValueError(
            f"{path}: sample {fastest + 2} is reached at {speeds[fastest]:.3g} m/s from that "
            f"before it; a vehicle slower than {FASTEST:g} m/s was expected: are {units}, time_s "
            "in seconds?"
        )
