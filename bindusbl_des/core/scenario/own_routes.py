"""Plans of user-defined placements, routes and vehicles, which are checked here."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import dist
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from ...models.charts.shapes import HIGHEST
from ...support.arrays import Floats, real_numbers
from ...support.plugins import Family, PluginError, asked, shown
from ..geometry.lanes import SHORTEST_LANE
from ..vehicles.tracks import FARTHEST, FASTEST, Track, is_in_air
from .families import ASV, PLACEMENT, ROUTE
from .part_choice import PartChoice, own_part
from .sections.routes import RouteTraits
from .sections.vehicles import Placement, Route, VehicleChoice


@dataclass(frozen=True)
class PlanView:
    """What a user-defined placement or route may know: fleet, survey and ranges (m, s, m/s).

    The survey is a square of side `side` about the origin, x and y along its sides; or it has other
    `corners`, x and y in order around it, and `side` is the longer side of the smallest rectangle
    around it.  AUVs have `depth`, `speed` and smallest `turning_radius`, for `duration`: where AUVs
    differ, the greatest value of each.
    """

    auvs: int
    asvs: int
    side: float
    depth: float
    hf_range: float
    mf_range: float
    speed: float
    turning_radius: float
    duration: float
    corners: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class WayView:
    """What a user-defined vehicle may know: its number, its planned path, and its duration.

    An AUV is to follow its path at `speed` (m/s) and `depth` (m) for `duration` (s); for an ASV,
    which is to keep its station, both are 0.
    """

    number: int
    speed: float
    depth: float
    duration: float
    _places: Callable[[Floats], Floats]

    def planned(self, distances: ArrayLike) -> Floats:
        """Return x, y (m), heading (rad, from +x to +y) at distances (n,), m, along the path: (n,
        3).

        The path goes on there and back.
        """
        return self._places(np.asarray(distances, dtype=np.float64))[:, :3].copy()


@dataclass(frozen=True, eq=False)
class Tracks(RouteTraits):
    """A user-defined route of time-tagged tracks: each times (n,), s, positions (n, 3), m.

    It equals only itself, because facts of a scenario are cached by identity.
    """

    is_recorded = True

    tracks: tuple[Track, ...]


@dataclass(frozen=True)
class Points(RouteTraits):
    """A user-defined route of way points, x and y (m), for each AUV."""

    is_flown = True

    points_m: tuple[tuple[tuple[float, float], ...], ...]

    @property
    def places(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """The way points, [x, y] in m, of each AUV."""
        return self.points_m


def is_mover(answer: Any) -> bool:
    """Return whether a placement's answer moves ASVs during the mission: it has `targets`."""
    return callable(getattr(answer, "targets", None))


def placed(asked: Placement, view: PlanView) -> Any:
    """Return what a placement answers to a plan: stations, or an object that moves ASVs.

    Raises:
        PluginError: when a user-defined one cannot be used.
    """
    choice = asked.choice
    return own_part(PLACEMENT, choice)(view) if choice.is_own else asked.stations(view)


def stations(choice: PartChoice, answer: Any, count: int) -> list[tuple[float, float]]:
    """Return the stations, [x, y] in m, of `count` ASVs in a placement's answer.

    Raises:
        PluginError: when the answer has not one station for each ASV.
    """
    places = _numbers(PLACEMENT, choice, answer)
    afloat = places is not None and (places.shape == (count, 2) or _is_level(places, count))
    if places is None or not afloat:
        _refuse(
            PLACEMENT,
            choice,
            answer,
            f"it must be places of shape ({count}, 2), x and y in m, one for each ASV, or "
            f"({count}, 3) with depths of 0; finite, within {FARTHEST:g} m",
        )
    return [(float(x), float(y)) for x, y in places[:, :2]]


def worked_out(route: Route, view: PlanView, vehicle: VehicleChoice) -> Points | Tracks:
    """Return what a route answers to the plan of AUVs of a `vehicle`: way points or a track for
    each.

    Raises:
        PluginError: when a user-defined one cannot be used, or the answer is no route for each AUV.
    """
    choice = route.choice
    answer = own_part(ROUTE, choice)(view) if choice.is_own else route.ways(view)
    answer = asked(ROUTE.key, str(choice), _listed, answer)
    count = view.auvs
    ways = [_numbers(ROUTE, choice, way) for way in answer or ()]
    widths = {way.shape[1] for way in ways if way is not None and way.ndim == 2 and len(way) > 1}
    good = [way for way in ways if way is not None and way.ndim == 2 and len(way) > 1]
    if len(ways) != count or len(good) != count or widths not in ({2}, {4}):
        _refuse(
            ROUTE,
            choice,
            answer,
            f"it must be a list of {count} arrays, one for each AUV: way points (n, 2), x and y "
            f"in m, or tracks (n, 4), time in s, x, y and depth in m; n >= 2, finite, within "
            f"{FARTHEST:g} m",
        )
    for auv, way in enumerate(good):
        problem = (
            _way_problem(way) if widths == {2} else _track_problem(way, vehicle, view.duration)
        )
        if problem:
            _refuse(ROUTE, choice, way, f"{problem} (AUV{auv})")
    if widths == {2}:
        return Points(tuple(tuple((float(x), float(y)) for x, y in way) for way in good))
    return Tracks(tuple((way[:, 0], way[:, 1:]) for way in good))


def own_motion(family: Family[Any], choice: PartChoice, ways: Sequence[WayView]) -> list[Track]:
    """Return the tracks of user-defined vehicles: times (n,), s, positions (n, 3), m, each.

    Raises:
        PluginError: when the part cannot be used, or its answer is no motion.
    """
    part, tracks = own_part(family, choice), []
    for way in ways:
        vehicle = f"{'ASV' if family is ASV else 'AUV'}{way.number}"
        answer = part(way, when=f" for {vehicle}")
        found = _numbers(family, choice, answer)
        if found is None or found.ndim != 2 or found.shape[1] != 4 or len(found) < 2:
            needed = "it must be an array (n, 4), time in s, x, y and depth in m; n >= 2, finite"
            _refuse(family, choice, answer, f"{needed}, within {FARTHEST:g} m ({vehicle})")
        problem = _motion_problem(found, way.duration)
        if family is ASV and found[:, 3].any():
            problem = "ASVs are at the surface, at a depth of 0"
        if problem:
            _refuse(family, choice, found, f"{problem} ({vehicle})")
        tracks.append((found[:, 0], found[:, 1:]))
    return tracks


def _way_problem(way: Floats) -> str:
    near = any(dist(a, b) < SHORTEST_LANE for a, b in pairwise(way))
    return f"way points in a row must be {SHORTEST_LANE:g} m apart or more" if near else ""


def _track_problem(way: Floats, vehicle: VehicleChoice, duration: float) -> str:
    if vehicle.is_steered:
        return f"{vehicle} flies way points; with tracks use kinematic"
    return _motion_problem(way, duration)


def _motion_problem(way: Floats, duration: float) -> str:
    steps = np.diff(way, axis=0)
    if (steps[:, 0] <= 0.0).any():
        return "the times of a track must increase"
    if (np.hypot(steps[:, 1], steps[:, 2]) > FASTEST * steps[:, 0]).any():
        return f"a track must be slower than {FASTEST:g} m/s; are its columns time, x, y, depth?"
    if (way[:, 3] < -HIGHEST).any() or is_in_air(way[:, 3]):
        return "a track must be in the sea; depths are positive below its surface"
    if way[0, 0] >= duration or way[-1, 0] <= 0.0:
        return f"a track must be in the mission, which lasts from 0 to {duration:g} s"
    return ""


def _listed(answer: Any) -> list[Any] | None:
    return list(answer) if isinstance(answer, Sequence | np.ndarray) else None


def _numbers(family: Family[Any], choice: PartChoice, answer: Any) -> Floats | None:
    """Return an answer as an array of finite numbers; None if it is no such array."""

    found: Floats | None = asked(family.key, str(choice), real_numbers, answer)
    return found if found is not None and (np.abs(found) <= FARTHEST).all() else None


def _is_level(places: Floats, count: int) -> bool:
    return places.shape == (count, 3) and not places[:, 2].any()


def _refuse(family: Family[Any], choice: PartChoice, answer: Any, needed: str) -> NoReturn:
    said = shown(family.key, str(choice), answer)
    raise PluginError(family.key, f"{str(choice)!r} returned {said}; {needed}")
