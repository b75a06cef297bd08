"""What the keys of a scenario mean before any sound: area, water, AUVs, routes and stations.

Validation asks a :class:`Site`, and :class:`..setup.Setup` extends it.  Positions in degrees
(WGS-84) become positions in the survey frame (m).  A user-defined placement or route is called
once.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, TypeVar

from ...support.facts import Facts, fact
from ...support.plugins import PluginError
from ..geometry.area import Area, Rings, polygon, rectangle, vertices
from . import families
from .families import (
    BroadcasterTraits,
    DownlinkTraits,
    InstrumentTraits,
    NavigatorTraits,
    RangingTraits,
    ScheduleSettings,
    ScheduleTraits,
)
from .groups import Auv, Group, Vessels, Wing, auvs_of, groups_of, wings_of
from .key_types import Point, Position
from .part_choice import shipped_part
from .scenario_keys import ScenarioKeys
from .sections.acoustics import Downlink, UplinkSection
from .sections.routes import Lawnmower, RouteTraits

if TYPE_CHECKING:
    from ...support.arrays import Flags, Floats
    from ..geometry.following import Slopes
    from ..geometry.land import Land
    from ..geometry.lanes import Share
    from ..geometry.paths import Path
    from ..geometry.routes import FlightPlan
    from ..sea.water import Water
    from ..sea.water_column import Column, Profile
    from ..vehicles.bottom import Bottom, Keeping
    from ..vehicles.currents import Flow, MissedCurrent
    from ..vehicles.fleet import Failures
    from ..vehicles.tracks import Track as RecordedTrack
    from .own_routes import PlanView
    from .sections.survey import SurveyEnd

AnyRoute = TypeVar("AnyRoute", bound=RouteTraits)
Stations = tuple[tuple[float, float], ...]
Ground = tuple[float, float, float]


class NoStations(ValueError):
    """ASVs move during the mission, so they keep no stations."""

    def __init__(self, model: str) -> None:
        super().__init__(
            f"asvs.formation.model: with {model} ASVs move and keep no stations; use ring or "
            "positions, or simulate the mission"
        )


class Site(Facts):
    """Facts that follow from a scenario's keys, in the survey frame (m).

    A fact is computed when it is first asked for.  Facts that need numpy import it, so that
    `validate` does not wait for it.
    """

    def __init__(self, scenario: ScenarioKeys) -> None:
        self.__dict__["scenario"] = scenario

    scenario: ScenarioKeys

    # What the parts declare

    @fact
    def schedule(self) -> ScheduleTraits:
        """What the schedule declares: which AUVs ping when."""
        return self.scenario.protocol.scheduling

    @fact
    def schedule_settings(self) -> ScheduleSettings:
        """What the settings of the schedule say about its rounds."""
        return self.scenario.protocol.schedule.settings_as(ScheduleSettings, self.schedule.settings)

    @fact
    def downlink(self) -> DownlinkTraits:
        """What the downlink declares: when ASVs send fixes."""
        return families.DOWNLINK.declared(self.scenario.protocol.downlink)

    @fact
    def broadcaster(self) -> BroadcasterTraits:
        """What the broadcaster declares: which ASV sends fixes."""
        return families.BROADCASTER.declared(self.scenario.protocol.broadcaster)

    @fact
    def ranging(self) -> RangingTraits:
        """What the ranging declares: which vehicles ping, and by whose clock."""
        return families.RANGING.declared(self.scenario.protocol.ranging)

    @fact
    def instrument(self) -> InstrumentTraits:
        """What the USBL instrument declares."""
        return families.INSTRUMENT.declared(self.scenario.usbl.model)

    @fact
    def navigator(self) -> NavigatorTraits:
        """What the navigator declares: how it weighs fixes."""
        return families.NAVIGATOR.declared(self.scenario.navigation.filter)

    @fact
    def tells_slots(self) -> bool:
        """Whether AUVs learn their slots from frames, and not all at once when a round is planned.

        Never for AUVs without slots, or that ASVs call.
        """
        protocol = self.scenario.protocol
        by_frames = families.KNOWLEDGE.declared(protocol.knowledge).by_frames
        return by_frames and not (protocol.asvs_ping or protocol.calls or protocol.random_access)

    @fact
    def positions(self) -> str:
        """Which AUV positions the schedule uses: `truth`, `last_fix` or `carried_forward`.

        Where AUVs learn their slots from frames, the fleet knows their fixes alone: not `truth`.
        """
        positions = str(self.scenario.protocol.positions)
        return "carried_forward" if positions == "truth" and self.tells_slots else positions

    # The area, and its position on Earth

    @fact
    def origin_deg(self) -> Position | None:
        """Latitude and longitude (deg) of x = y = 0, or None without a position on Earth.

        By default it is the centroid of an area that is given in degrees.
        """
        given = self.scenario.environment.origin.coordinates
        corners = self.scenario.survey.corners_deg
        return _centroid(corners) if given is None and corners else given

    @property
    def ground(self) -> Ground | None:
        """Latitude and longitude (deg) of x = y = 0, and the height (m) of its water; or None."""
        height = self.scenario.environment.surface_m
        return None if self.origin_deg is None else (*self.origin_deg, height)

    @fact
    def area(self) -> Area:
        """The open area of the survey (survey frame, m), without land and keep-outs.

        Raises:
            ValueError: when a polygon is invalid or land leaves nothing open, with the key in
                front where land is the reason.
        """
        survey = self.scenario.survey
        turn = math.radians(survey.rotation_deg)
        if survey.polygon_m is not None:
            whole = polygon(survey.polygon_m)
        elif survey.size_m is not None:
            whole = rectangle(*survey.size_m, turn)
        elif survey.side_m is not None:
            whole = rectangle(survey.side_m, survey.side_m, turn)
        else:
            whole = polygon(in_metres(survey.corners_deg, self._known_ground))
        if survey.land is survey.keep_out is survey.area is None or self.closed is None:
            return whole
        try:
            return whole.without(self.closed.polygons)
        except ValueError as error:
            named = [name for name in ("land", "keep_out", "area") if getattr(survey, name)]
            raise ValueError(f"survey.{named[0]}: {error}") from None

    @fact
    def land(self) -> "Land | None":
        """The land (survey frame, m): holes in the area's chart, and `survey.land`; else None.

        Raises:
            ValueError: when a polygon is invalid, with its key and the reason.
        """
        survey = self.scenario.survey
        if survey.land is survey.area is None:
            return None
        holes = tuple(
            (self._shore("survey.area", hole),)
            for _, *rings in survey.charted("area")
            for hole in rings
        )
        return _land((*holes, *self._polygons("land")))

    @fact
    def keep_out(self) -> "Land | None":
        """The keep-outs, which no vehicle enters (survey frame, m), or None.  Raises as `land`."""
        return _land(self._polygons("keep_out"))

    @fact
    def closed(self) -> "Land | None":
        """Land and keep-outs together (survey frame, m); None without.  Raises as `land`."""
        both = (what.polygons for what in (self.land, self.keep_out) if what is not None)
        return _land(tuple(chain.from_iterable(both)))

    def _polygons(self, name: str) -> tuple[Rings, ...]:
        """Return the polygons (m) given at `survey.land` or `survey.keep_out`."""
        given, key = getattr(self.scenario.survey, name), f"survey.{name}"
        if isinstance(given, str):
            charted = self.scenario.survey.charted(name)
            return tuple(tuple(self._shore(key, ring) for ring in rings) for rings in charted)
        return tuple((_ring(f"{key}.{n}", corners),) for n, corners in enumerate(given or ()))

    def _shore(self, key: str, ring: tuple[Position, ...]) -> tuple[Point, ...]:
        """Return a ring, latitude and longitude (deg), of the chart at a key in metres."""
        if self.ground is None:
            raise ValueError(
                f"{key}: is a chart, and nothing says where on Earth x = y = 0 is; add "
                "environment.origin.lat_deg and lon_deg"
            )
        return _ring(key, in_metres(ring, self.ground))

    def lanes_heading_rad(self, wing: Wing) -> float:
        """Return the heading (rad, from +x to +y) of the frame in which lanes are planned."""
        asked = getattr(wing.asked, "lane_heading_deg", None)
        return self.area.turn if asked is None else math.radians(asked)

    # The water

    @fact
    def sound_speed_m_per_s(self) -> float:
        """The true speed of sound (m/s): as given, or the harmonic mean of its profile.

        The mean is over the depths of the survey (:func:`..sea.water_column.mean_speed`);
        temperature or a cast give the profile.

        Raises:
            ValueError: when the cast is invalid, with the reason.
            ImportError: without gsw, when the law is `teos10`.
        """
        if self._column is None:
            return self.scenario.environment.sound_speed_m_per_s
        from ..sea.water_column import mean_speed

        return mean_speed(self.sound_profile, self.deepest_m)

    @fact
    def assumed_sound_speed_m_per_s(self) -> float:
        """The speed of sound (m/s) by which the fleet computes ranges."""
        assumed = self.scenario.environment.assumed_sound_speed_m_per_s
        return self.sound_speed_m_per_s if assumed is None else assumed

    @fact
    def sound_profile(self) -> "Profile":
        """The speed of sound (m/s) as a function of depth (m); raises as `sound_speed_m_per_s`."""
        if self._column is not None:
            return self._column.profile()
        from ..sea.water_column import uniform_profile

        return uniform_profile(self.scenario.environment.sound_speed_m_per_s)

    @fact
    def water(self) -> "Water":
        """The water that absorbs sound, down to the survey; raises as `sound_speed_m_per_s`."""
        if self._column is not None:
            return self._column.water()
        from ..sea.water import USUAL_WATER

        return USUAL_WATER

    @fact
    def flow(self) -> "Flow":
        """What the current has beyond its uniform part, and of it what AUVs meet on their planned
        ways and vessels at their stations.

        An AUV of a user-defined route counts as if it held the middle of the survey.

        Raises:
            ValueError: when the file of a current is unusable, with key and remedy.
        """
        from ..vehicles.currents import UNIFORM, flow_on

        if families.CURRENT.declared(self.scenario.environment.current).is_uniform:
            return UNIFORM
        ways = list(self.ways_that_ship)
        ways += [partial(_stay, (*place, 0.0)) for place in self.kept_stations_m]
        field = shipped_part(families.CURRENT, self.scenario.environment.current)(self)
        return flow_on(field, float(self.scenario.duration_s), ways, len(self.auvs))

    @fact
    def ways_that_ship(self) -> "tuple[Callable[[Floats], Floats], ...]":
        """For each AUV a function of instants (n,), s, to its planned positions (n, 3), m.

        User-defined routes are not called: their AUVs stay in the middle of the survey.
        """
        found: list[Callable[[Floats], Floats]] = []
        for auv, plan, track, held in zip(
            self.auvs, self.plans_that_ship, self.auv_tracks, self.held_places_m, strict=True
        ):
            place = held or self.area.centroid
            way = partial(_stay, (*place, self.depth_at(auv, place)))
            if track is not None:
                way = partial(_tracked, *track)
            elif plan is not None:
                tour = self.tour_of(auv, plan)
                way = partial(_toured, tour, auv.speed_m_per_s, auv.depth_m)
            found.append(way)
        return tuple(found)

    @fact
    def contours(self) -> "tuple[tuple[float, list[Floats]], ...]":
        """Depths (m) of the bottom that maps show, each with its lines, (n, 2), x and y in m."""
        if self.scenario.environment.bathymetry is None:
            return ()
        from ...models.charts.contours import contours

        return tuple(contours(*self.bottom))

    # The bottom, and what logs miss that do not see it

    @property
    def log_sees_m(self) -> float:
        """Up to which height (m) above the bottom logs measure over ground; none: -inf."""
        navigation = self.scenario.navigation
        if navigation.velocity == "through_water":
            return -math.inf
        return math.inf if navigation.dvl_range_m is None else float(navigation.dvl_range_m)

    def blind(self, places: "Floats") -> "Flags":
        """Return whether an AUV's log misses the current at positions (n, 3), m, (n,)."""
        if self.log_sees_m == math.inf:
            sees = places[:, 0] == places[:, 0]
        else:
            sees = self.bottom.below(places) - places[:, 2] <= self.log_sees_m
        found: Flags = ~sees
        return found

    @fact
    def missed(self) -> "MissedCurrent | None":
        """The current that logs miss on the AUVs' planned ways; None where they miss none.

        Of logs that see the bottom here and there all of it is in the flow, and nothing but its
        variation is uniform.
        """
        from ..vehicles.currents import SAMPLES, MissedCurrent, met_on

        water = self.scenario.environment
        speed, varies = water.current_m_per_s, water.current_variation_m_per_s
        towards, lasts = math.radians(water.current_direction_deg), water.current_variation_time_s
        if self.log_sees_m == math.inf:
            return None
        if self.scenario.navigation.velocity == "through_water":
            return MissedCurrent(speed, towards, varies, lasts, self.flow, water.has_field)
        import numpy as np

        times = np.linspace(0.0, float(self.scenario.duration_s), SAMPLES)
        steady, met, share = speed * np.array((math.cos(towards), math.sin(towards))), [], 0.0
        for way in self.ways_that_ship:
            places = way(times)
            blind = self.blind(places)
            share += float(blind.mean()) / len(self.auvs)
            met.append((steady + self.flow.at(times, places)) * blind[:, np.newaxis])
        flow = met_on(self.flow.field, np.stack(met), times, len(met))
        return MissedCurrent(0.0, 0.0, varies * math.sqrt(share), lasts, flow, True)

    @fact
    def bottom(self) -> "Bottom":
        """The depth of the bottom around survey, stations and ends of routes (survey frame, m).

        Raises:
            ValueError: with key and remedy, when its file is unusable, or a hull cannot turn.
        """
        from ..vehicles.bottom import UNKNOWN, Bottom

        asked = self.scenario.environment.bathymetry
        if asked is None:
            return UNKNOWN
        from ...models.charts.bottoms import Around, plane, read_bottom
        from ..geometry.geodesy import ned_at_depth

        places = [*self.area.outline]
        asked_auvs = auvs_of(self.scenario, self.groups)  # whose depths may follow from the bottom
        places += [end for auv in asked_auvs for end in auv[-2:] if end is not None]
        if self.scenario.asvs.formation.moored is not None:
            places += self.kept_stations_m
        for wing in self.wings:
            if not wing.asked.is_worked_out:
                for points in self._positioned(wing.asked).places:
                    places += points
        water = self.scenario.environment.surface_m
        around = Around.of(places, max(self.turning_radii_m), self.ground, water, ned_at_depth)
        key = "environment.bathymetry"
        if asked.file is None:
            if asked.depth_m is None:
                raise ValueError(f"{key}: gives neither depth_m nor file; give one of them")
            return Bottom(*plane(asked.depth_m, asked.slope_deg, asked.slope_towards_deg, around))
        try:
            if asked.depth_m is not None or asked.slope_deg:
                raise ValueError("excludes depth_m and slope_deg; keep one of them")
            return Bottom(*read_bottom(asked.file, asked.crs, asked.positive, around))
        except (ValueError, OSError) as error:
            raise ValueError(f"{key}.file: {error}") from None

    def keeping(self, group: Group) -> "Keeping | None":
        """Return how the AUVs of a group keep their altitude; None where they keep a depth, or the
        bottom is unusable, which `bottom` reports.
        """
        asked = group.altitude
        try:
            if asked.altitude_m is None or not self.bottom.is_known:
                return None
        except ValueError:
            return None
        from ..vehicles.bottom import Keeping

        deepest = max(float(self.bottom.deepest) - asked.altitude_m, asked.shallowest_m)
        return Keeping(asked.altitude_m, asked.shallowest_m, deepest)

    @fact
    def follows(self) -> "dict[Group, Slopes]":
        """For each group of AUVs that keeps an altitude: the depths that it follows."""
        from ..geometry.following import Slopes

        found = dict[Group, Slopes]()
        for group in self.groups:
            if (kept := self.keeping(group)) is not None:
                steepest = math.tan(math.radians(group.altitude.climb_angle_deg))
                wanted = partial(kept.depths, self.bottom)
                found[group] = Slopes(wanted, kept.deepest_m, steepest, self.bottom.step_m)
        return found

    def tour_of(self, auv: Auv, plan: "FlightPlan") -> "Path":
        """Return the tour of an AUV with its planned depths, which an autopilot finds itself."""
        slopes = self.follows.get(auv.group)
        if slopes is None or not auv.group.vehicle.is_steered:
            return plan.tour
        from ..geometry.following import following

        return following(plan.tour, slopes)

    def altitude_left(self, auv: Auv) -> tuple[float, float, Point]:
        """Return how far (m) an AUV is planned to leave its altitude at most, how steeply (m/m) it
        climbs and dives, and where that is (m).

        Raises:
            ValueError: when a route cannot be flown.
        """
        import numpy as np

        from ..geometry.following import following

        plan, slopes = self.plans_that_ship[auv.number], self.follows.get(auv.group)
        if plan is None or slopes is None:
            return 0.0, math.inf, self.area.centroid
        path, hull = plan.path, auv.group.vehicle
        if hull.has_dynamics:
            slopes = slopes._replace(steepest=hull.steepest_climb(auv.speed_m_per_s))
            path = following(path, slopes)
        count = min(math.ceil(path.length / slopes.step), 20_000) + 1
        along = np.linspace(0.0, path.length, count)
        places = path.sample(along)[:, :2]
        off = slopes.wanted(places) - (slopes.depth - path.heights(along))
        worst = int(off.argmax())
        x, y = places[worst].tolist()
        return float(off[worst]), slopes.steepest, (x, y)

    def depth_at(self, auv: Auv, place: Point) -> float:
        """Return the depth (m) at which an AUV goes at a position (m)."""
        kept = self.keeping(auv.group)
        return auv.depth_m if kept is None else float(kept.depths(self.bottom, [place])[0])

    @property
    def _column(self) -> "Column | None":
        """The water column of temperature or cast; None where the speed of sound is given."""
        given = self.scenario.environment
        if given.temperature_c is None and given.ctd is None:
            return None
        from ..sea.water_column import Column  # imports numpy, which a given speed does not need

        return Column(
            deepest_m=self.deepest_m,
            temperature_c=given.temperature_c,
            salinity_psu=given.salinity_psu,
            cast_file=given.ctd,
            law=given.sound_speed_law,
            place_deg=self.origin_deg,
        )

    @fact
    def pings_echo(self) -> bool:
        """Whether pings have echoes: those of AUVs, on a `sonar` channel with a bottom."""
        channel = self.scenario.acoustics.hf.channel
        given = channel == "sonar" and channel.settings.get("bottom_m") is not None
        return given and not self.scenario.protocol.asvs_ping

    # The vehicles, one by one

    @fact
    def vessels(self) -> tuple[Vessels, ...]:
        """The groups of equal ASVs: those of `asvs.groups`, or one group of all ASVs."""
        all_of, found, known = self.scenario.asvs, list[Vessels](), set[int]()
        for number, own in enumerate(all_of.groups or (None,)):
            begin = found[-1].members.stop if found else 0
            said = None if own is None else own.usbl
            usbl = {name: getattr(said, name) for name in type(said).model_fields} if said else {}
            usbl = {name: value for name, value in usbl.items() if value is not None}
            usbl_section = self.scenario.usbl.changed(usbl) if usbl else self.scenario.usbl
            vehicle, speed = (own.vehicle, own.speed_m_per_s) if own else (None, None)
            found.append(
                Vessels(
                    number,
                    range(begin, begin + (own.count if own else all_of.count)),
                    own,
                    vehicle or all_of.vehicle,
                    usbl_section,
                    id(usbl_section) not in known,
                    speed,
                )
            )
            known.add(id(usbl_section))
        return tuple(found)

    @property
    def keeps_still(self) -> bool:
        """Whether vessels move exactly as planned: none has dynamics or is user-defined."""
        return not any(group.vehicle.is_steered for group in self.vessels)

    @fact
    def groups(self) -> tuple[Group, ...]:
        """The groups of equal AUVs: those of `auvs.groups`, or one group of all AUVs."""
        return tuple(groups_of(self.scenario))

    @fact
    def auvs(self) -> tuple[Auv, ...]:
        """Each AUV's group, speed (m/s), depth (m), and where it is launched and recovered (m).

        The depth of AUVs that keep an altitude is the greatest that they go to around the survey.
        """
        asked = tuple(auvs_of(self.scenario, self.groups))
        kept = {
            group: self.keeping(group)
            for group in self.groups
            if group.altitude.altitude_m is not None
        }
        return tuple([
            auv if (own := kept.get(auv.group)) is None else auv._replace(depth_m=own.deepest_m)
            for auv in asked
        ])  # fmt: skip

    @fact
    def deepest_m(self) -> float:
        """The greatest depth (m) at which an AUV goes."""
        return max(auv.depth_m for auv in self.auvs)

    @fact
    def fastest_m_per_s(self) -> float:
        """The speed (m/s) of the fastest AUV."""
        return max(auv.speed_m_per_s for auv in self.auvs)

    @fact
    def wings(self) -> tuple[Wing, ...]:
        """The wings, AUVs that share a route, with the route of each."""
        return tuple(wings_of(self.groups))

    @fact
    def rising(self) -> frozenset[int]:
        """The numbers of the AUVs that surface during the mission."""
        rising = [wing for wing in self.wings if wing.asked.surfacing is not None]
        return frozenset(auv for wing in rising for auv in wing.members)

    @fact
    def overruled_keys(self) -> tuple[str, ...]:
        """The keys for all AUVs, or ASVs, that have no effect: every group gives its own value."""
        found = list[str]()
        for kinds in (self.groups, self.vessels):
            first, *others = (kind.own_keys for kind in kinds)
            found += [key for key in first if all(key in own for own in others)]
        return tuple(found)

    @fact
    def planned_speeds_m_per_s(self) -> tuple[float, ...]:
        """The planned speed (m/s) of each AUV along its route; 0 for an AUV that holds."""
        still = {auv for wing in self.wings if wing.asked.is_held for auv in wing.members}
        return tuple(0.0 if auv.number in still else auv.speed_m_per_s for auv in self.auvs)

    @fact
    def swaths_m(self) -> tuple[float | None, ...]:
        """The width (m) that each AUV surveys; None where no key gives it."""
        asked = self.scenario.survey.swath_m
        found = {
            auv: asked or getattr(wing.asked, "lane_spacing_m", None)
            for wing in self.wings
            for auv in wing.members
        }
        return tuple(map(found.get, range(len(self.auvs))))

    @fact
    def turning_radii_m(self) -> tuple[float, ...]:
        """The radius (m) of each AUV's planned turns: as given, or the smallest of its hull.

        Raises:
            ValueError: when a hull cannot go at the speed asked of it.
        """
        auvs = list(auvs_of(self.scenario, self.groups))  # whose depths may follow from this
        found = {(auv.group, auv.speed_m_per_s): 0.0 for auv in auvs}
        for group, speed in found:
            vehicle = group.vehicle
            if not vehicle.has_dynamics:
                found[group, speed] = group.turning_radius_m
                continue
            from ..vehicles.guidance.departure import smallest_turn

            try:
                found[group, speed] = smallest_turn(
                    vehicle.model, speed, dict(vehicle.coefficients)
                )
            except ValueError as error:
                key = group.key("speed_m_per_s")
                raise ValueError(f"{key}: {error}") from None
        return tuple(found[auv.group, auv.speed_m_per_s] for auv in auvs)

    # The routes of the AUVs

    @fact
    def routes(self) -> tuple[RouteTraits, ...]:
        """The route of each wing in metres; a user-defined route becomes waypoints or tracks.

        Raises:
            PluginError: when a user-defined route is not allowed or fails.
            ValueError: when positions are in degrees and the site has no position on Earth.
        """
        return tuple(map(self.route_of, self.wings))

    @property
    def route(self) -> RouteTraits:
        """The route of AUV0, which all AUVs have unless groups have routes of their own."""
        return next(
            route for wing, route in zip(self.wings, self.routes, strict=True) if 0 in wing.members
        )

    def route_of(self, wing: Wing) -> RouteTraits:
        """Return the route of one wing; see `routes`."""
        route = wing.asked
        if not route.is_worked_out:
            return self._positioned(route)
        from .own_routes import worked_out

        vehicle = self.auvs[wing.members[0]].group.vehicle
        return worked_out(route, self._view(wing.members), vehicle)

    @fact
    def plans(self) -> "tuple[FlightPlan | None, ...]":
        """Each AUV's flight plan: path, lanes and endless tour; None for an AUV that flies no path.

        Raises:
            ValueError: when a route cannot be flown.
        """
        return self._planned(zip(self.wings, self.routes, strict=True))

    @fact
    def plans_that_ship(self) -> "tuple[FlightPlan | None, ...]":
        """As `plans`, but None for user-defined routes, which are not called."""
        flown = [wing for wing in self.wings if wing.asked.is_flown]
        if len(flown) == len(self.wings):
            return self.plans
        return self._planned((wing, self.route_of(wing)) for wing in flown)

    def _planned(
        self, wings: Iterable[tuple[Wing, RouteTraits]]
    ) -> "tuple[FlightPlan | None, ...]":
        from .flight_plans import Planner

        planned: dict[int, FlightPlan] = {}
        for wing, route in wings:
            if route.is_flown:
                planner = Planner(
                    [self.auvs[auv] for auv in wing.members],
                    route,
                    self.area,
                    self.lanes_heading_rad(wing),
                    [self.turning_radii_m[auv] for auv in wing.members],
                    {
                        group: self.follows[group]
                        for group in self.groups
                        if group.altitude.altitude_m is not None
                        and not group.vehicle.is_steered
                        and group in self.follows
                    },
                )
                planned |= zip(wing.members, planner.plans(), strict=True)
        return tuple(map(planned.get, range(len(self.auvs))))

    @fact
    def lane_shares(self) -> "dict[int, Share]":
        """The lanes of each AUV that sweeps lanes, by its number, in the frame of the lanes.

        Raises:
            ValueError: when there are fewer lanes than AUVs to share them.
        """
        from .flight_plans import shares_of

        found: dict[int, Share] = {}
        for wing in self.wings:
            if (lanes := wing.asked.lanes) is not None:
                shares = shares_of(self.area, self.lanes_heading_rad(wing), lanes, len(wing))
                found |= zip(wing.members, shares, strict=True)
        return found

    @fact
    def survey_end_s(self) -> "SurveyEnd":
        """When (s) the last AUV has flown its lanes and reached its recovery, if it has one.

        Raises:
            ValueError: when a current leaves no headway, the survey exceeds the longest mission,
                or a route cannot be flown.
        """
        from .flight_plans import survey_end

        return survey_end(self.auvs, self._against_m_per_s, self.plans)

    @fact
    def flown_s(self) -> tuple[float, ...]:
        """When (s) each AUV has flown its lanes and reached its recovery, if any; 0 without lanes.

        Raises:
            ValueError: when a current leaves no headway, or a route cannot be flown.
        """
        from .flight_plans import flown_s

        return tuple(flown_s(self.auvs, self._against_m_per_s, self.plans))

    @property
    def _against_m_per_s(self) -> float:
        """The current (m/s) that plans allow for."""
        from .flight_plans import SIGMAS

        water = self.scenario.environment
        against = water.current_m_per_s + SIGMAS * water.current_variation_m_per_s
        return against + (self.flow.limit_m_per_s if water.has_field else 0.0)

    @fact
    def auv_tracks(self) -> "tuple[RecordedTrack | None, ...]":
        """For each AUV the recorded track that it repeats, or None.

        A track has times (n,), s, and positions (n, 3), m.

        Raises:
            ValueError: with key and remedy, when a track is unreadable or outside the mission.
        """
        found: dict[int, RecordedTrack] = {}
        for wing, route in zip(self.wings, self.routes, strict=True):
            recording, tracks = route.recording, getattr(route, "tracks", ())
            if recording is not None:
                tracks = self._within_the_mission(
                    [self.auv_track(wing, number) for number in range(len(recording.files))],
                    recording.time_offset_s,
                    wing.key,
                )
            if route.is_recorded:
                found |= zip(wing.members, tracks, strict=False)
        return tuple(map(found.get, range(len(self.auvs))))

    @fact
    def held_places_m(self) -> tuple[Point | None, ...]:
        """The position [x, y] (m) of each AUV that holds one; None for the others."""
        found: dict[int, Point] = {}
        for wing, route in zip(self.wings, self.routes, strict=True):
            if route.is_held:
                found |= zip(wing.members, (place for (place,) in route.places), strict=False)
        return tuple(map(found.get, range(len(self.auvs))))

    # Where the ASVs lie

    @fact
    def stations_m(self) -> Stations:
        """The stations (x, y) of the ASVs, m (eq. formation); () without an ASV.

        Raises:
            NoStations: when ASVs move.
            PluginError: when a user-defined placement is not allowed or fails.
        """
        asked, count = self.scenario.asvs.formation, self.scenario.asvs.count
        if not count:
            return ()
        ring = asked.moored
        if ring is None:
            from .own_routes import is_mover, placed, stations

            answer = None if asked.moves else placed(asked, self.plan_view)
            if asked.moves or is_mover(answer):
                raise NoStations(str(asked.choice))
            return tuple(stations(asked.choice, answer, count))
        given = self.given_stations_m
        if given is not None:
            return tuple(given)
        radius = ring.radius(self.scenario.acoustics.hf.range_m)
        return self._ring(radius, math.radians(ring.angle_deg))

    @fact
    def given_stations_m(self) -> tuple[Point, ...] | None:
        """The stations (x, y) that the scenario lists, m; None for a ring.

        Raises:
            ValueError: when they are in degrees and the site has no position on Earth.
        """
        asked = self.scenario.asvs.formation
        degrees = getattr(asked, "positions_deg", None)
        if degrees is not None:
            return in_metres(degrees, self._known_ground)
        metres: tuple[Point, ...] | None = getattr(asked, "positions_m", None)
        return metres

    @fact
    def kept_stations_m(self) -> Stations:
        """The stations (x, y) of the ASVs, m; empty where ASVs move."""
        try:
            return self.stations_m
        except NoStations:
            return ()

    @fact
    def nominal_stations_m(self) -> Stations:
        """Stations (x, y), m, for estimates: a ring at HF range replaces ASVs that move.

        The ring also replaces a user-defined placement that cannot be called.
        """
        try:
            return self.stations_m
        except (NoStations, PluginError):
            pass
        return self._ring(self.scenario.acoustics.hf.range_m, 0.0)

    @fact
    def nominal_routes(self) -> tuple[RouteTraits, ...]:
        """Routes for estimates: lanes replace user-defined routes that cannot be called."""
        try:
            return self.routes
        except PluginError:
            return (Lawnmower(),) * len(self.wings)

    @fact
    def are_steered(self) -> bool:
        """Whether ASVs get orders during the mission; raises as `stations_m`."""
        placement = self.scenario.asvs.formation
        if not self.scenario.asvs.count:
            return False
        if placement.moored is None and not placement.moves:
            return not self.kept_stations_m
        return placement.replanned is not None

    @fact
    def asv_tracks(self) -> "tuple[RecordedTrack, ...] | None":
        """The recorded tracks (times (n,), s; positions (n, 3), m) that ASVs repeat; None without.

        Raises:
            ValueError: with key and remedy, when a track is unreadable or outside the mission.
        """
        recording = self.scenario.asvs.formation.recording
        if recording is None or not self.scenario.asvs.count:
            return None
        tracks = [self.asv_track(asv) for asv in range(len(recording.files))]
        return self._within_the_mission(tracks, recording.time_offset_s, "asvs.formation")

    @fact
    def failures(self) -> "Failures | None":
        """Which ASVs fail, from when until when (s); None without failures of any ASVs."""
        given = self.scenario.asvs.failures
        if not given and self.scenario.asvs.count:
            return None
        import numpy as np

        from ..vehicles.fleet import Failures

        return Failures(
            self.scenario.asvs.count,
            np.array([failure.asv for failure in given], dtype=np.intp),
            np.array([failure.at_s for failure in given]),
            np.array([np.inf if failure.until_s is None else failure.until_s for failure in given]),
        )

    @fact
    def horizontal_reach_m(self) -> float:
        """The horizontal range (m) of HF from the surface to the greatest depth of an AUV."""
        return self._from_above(self.scenario.acoustics.hf)

    @fact
    def horizontal_mf_reach_m(self) -> float:
        """The horizontal range (m) of MF from the surface to the greatest depth of an AUV."""
        return self._from_above(self.scenario.acoustics.mf)

    def _from_above(self, band: UplinkSection | Downlink) -> float:
        if band.range_metric == "horizontal":
            return band.range_m
        return math.sqrt(max(band.range_m**2 - self.deepest_m**2, 0.0))

    @fact
    def plan_view(self) -> "PlanView":
        """The facts that a user-defined placement gets."""
        return self._view(tuple(range(len(self.auvs))))

    def _view(self, auvs: Sequence[int]) -> "PlanView":
        """Return the facts that a user-defined placement, or a route of some AUVs, gets."""
        from .own_routes import PlanView

        scenario, area = self.scenario, self.area
        return PlanView(
            auvs=len(auvs),
            asvs=scenario.asvs.count,
            side=area.across,
            depth=max(self.auvs[auv].depth_m for auv in auvs),
            hf_range=scenario.acoustics.hf.range_m,
            mf_range=scenario.acoustics.mf.range_m,
            speed=max(self.auvs[auv].speed_m_per_s for auv in auvs),
            turning_radius=max(self.turning_radii_m[auv] for auv in auvs),
            duration=scenario.duration_s,
            corners=area.outline,
        )

    def auv_track(self, wing: Wing, number: int) -> "RecordedTrack":
        """Return the track in the file `number` of a wing's recording; raises as `auv_tracks`."""
        from ..vehicles.tracks import read_track

        route = wing.asked.recording
        assert route is not None
        file, which = route.sources[number]
        auv = wing.members[min(number, len(wing) - 1)]  # surplus files are refused elsewhere
        return read_track(
            file,
            route.time_offset_s,
            which=which,
            origin=self.ground,
            depth_m=self.auvs[auv].depth_m,
        )

    def asv_track(self, asv: int) -> "RecordedTrack":
        """Return the track in the file of one ASV, at depth 0 whatever the file says."""
        from ..vehicles.tracks import read_track

        placement = self.scenario.asvs.formation.recording
        assert placement is not None
        file, which = placement.sources[asv]
        origin, offset_s = self.ground, placement.time_offset_s
        return read_track(file, offset_s, which=which, origin=origin, depth_m=0.0, afloat=True)

    def _within_the_mission(
        self, tracks: "Sequence[RecordedTrack]", offset_s: float, section: str
    ) -> "tuple[RecordedTrack, ...]":
        from ..vehicles.tracks import misplaced

        found = misplaced(tracks, offset_s, self.scenario.duration_s, section)
        for number, problem in found:
            raise ValueError(f"{section}.files.{number}: {problem}")
        return tuple(tracks)

    def on_earth(self, places: Iterable[Sequence[float]]) -> list[tuple[float, float, float]]:
        """Return latitude, longitude (deg) and height (m) of positions [x, y] or [x, y, z] (m).

        Raises:
            ValueError: when the site has no position on Earth.
        """
        from ..geometry.geodesy import geodetic_from_ned

        if self.ground is None:
            raise ValueError("the scenario has no environment.origin, so it is nowhere on Earth")
        return [geodetic_from_ned((*place, 0.0)[:3], *self.ground) for place in places]

    @property
    def _known_ground(self) -> Ground:
        if self.ground is None:
            raise ValueError(
                "latitude and longitude need environment.origin.lat_deg and lon_deg, where "
                "x = y = 0; add them"
            )
        return self.ground

    def _positioned(self, route: AnyRoute) -> AnyRoute:
        if not route.positions:
            return route
        ground = self._known_ground
        return route.in_metres(lambda positions: in_metres(positions, ground))

    @fact
    def some_tracks_lack_depths(self) -> bool:
        """Whether some track has no depths, so that its AUV goes at the depth of the survey."""
        recorded = [wing.asked.recording for wing in self.wings]
        sources = [source for route in recorded if route is not None for source in route.sources]
        if not sources:
            return False
        from ...models.charts.recordings import read_recording

        try:
            surface_m = self.scenario.environment.surface_m
            found = [read_recording(*source, surface_m) for source in sources]
        except ValueError:
            return False  # the reader of the file reports it
        return any(recording.lacks_depths for recording in found)

    def _ring(self, radius: float, angle_rad: float) -> Stations:
        """Return the stations of a regular formation about the centroid of the survey; a single ASV
        lies there, or on the open water nearest to it.
        """
        places, (x, y) = vertices(self.scenario.asvs.count, radius, angle_rad), self.area.centroid
        if len(places) == 1 and self.closed is not None:
            return (self.closed.afloat((x, y)),)
        if (x, y) == (0.0, 0.0):
            return tuple(places)
        return tuple((x + north, y + east) for north, east in places)


def _stay(place: tuple[float, float, float], times: "Floats") -> "Floats":
    """Return a position (m) at instants (s), (n, 3)."""
    import numpy as np

    return np.tile(place, (len(times), 1))


def _tracked(instants: "Floats", places: "Floats", times: "Floats") -> "Floats":
    """Return the positions (m) of a track at instants (s), (n, 3)."""
    import numpy as np

    return np.column_stack([np.interp(times, instants, column) for column in places.T])


def _toured(tour: "Path", speed: float, depth: float, times: "Floats") -> "Floats":
    """Return the positions (m) on a tour at a speed (m/s) and depth (m) at instants (s), (n, 3)."""
    import numpy as np

    along = speed * times
    return np.column_stack((tour.sample(along)[:, :2], depth - tour.heights(along)))


def _land(polygons: tuple[Rings, ...]) -> "Land | None":
    """Return polygons (m) as `Land`; None without any."""
    if not polygons:
        return None
    from ..geometry.land import Land  # imports numba, which few scenarios need

    return Land(polygons)


def _ring(key: str, corners: Sequence[Point]) -> tuple[Point, ...]:
    """Return the corners (m) of the polygon at a key.

    Raises:
        ValueError: with the key in front, when the corners make no polygon.
    """
    try:
        return polygon(corners).corners
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None


def _centroid(corners: tuple[Position, ...]) -> Position:
    """Return the centroid of a polygon as latitude and longitude (deg).

    For corners that make no polygon it is the first corner; `Site.area` reports the mistake.
    """
    from ..geometry.geodesy import geodetic_from_ned

    try:
        middle = polygon(in_metres(corners, corners[0])).centroid
    except ValueError:
        return corners[0]
    lat, lon, _ = geodetic_from_ned((*middle, 0.0), *corners[0])
    return lat, lon


def in_metres(positions: tuple[Position, ...], origin: Sequence[float]) -> tuple[Point, ...]:
    """Return positions (latitude, longitude, deg) as [x, y] (m) about an origin.

    The origin is latitude and longitude (deg) and, if not 0, the height of the water (m).

    >>> [(round(x), round(y)) for x, y in in_metres(((54.331, 10.18),), (54.33, 10.18))]
    [(111, 0)]
    """
    import numpy as np  # scenarios in metres do not need it

    from ..geometry.geodesy import ned_at_depth

    lat, lon = np.array(positions, dtype=np.float64).reshape(-1, 2).T
    places = ned_at_depth(lat, lon, np.zeros(len(lat)), origin)
    return tuple((float(x), float(y)) for x, y in places[:, :2])
