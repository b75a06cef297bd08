"""What the instruments of a mission have measured, each at the instant at which it has it.

A vessel has GNSS, a compass and a USBL, an AUV its delivered fixes, a pressure sensor and what its
navigator makes of these.  Nothing here is the truth but :class:`Truth`, which is asked for by name.
"""

import math
from collections.abc import Collection, Generator, Iterator, Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
import simpy
from numpy.typing import NDArray

from ...core.geometry.geodesy import geodetic_from_ned
from ...core.mission.launch import slow_gnss
from ...core.mission.mission import Mission
from ...core.mission.sensor_errors import pressure_errors
from ...core.protocol.happenings import Happening, Watch
from ...core.protocol.outcomes import Sight
from ...core.records.events import Broadcast, Fix
from ...core.setup import Setup
from ...core.vehicles.currents import CONTROL_S
from ...support.streams import Purpose, Streams

# How often a second GNSS, compass and navigators say where they are: most receivers' default.
RATE_HZ = 1.0


class Gnss(NamedTuple):
    """Where an ASV takes itself to be: x, y (m), and its velocity over ground (m/s), None at first.

    The position has all errors of the scenario's GNSS, the velocity (Doppler) the slow one alone.
    Or a fix of an AUV at the surface, which tells no velocity.
    """

    at_s: float
    vehicle: str
    place: tuple[float, float]
    velocity: tuple[float, float] | None
    sd_m: float


class Compass(NamedTuple):
    """The heading of an ASV (rad, from north towards east) with the error of its compass."""

    at_s: float
    vehicle: str
    yaw: float


class UsblReading(NamedTuple):
    """What an ASV has measured of a ping that it has just decoded."""

    at_s: float
    vehicle: str
    auv: str
    ping: int
    sight: Sight


class FixReading(NamedTuple):
    """A fix that an AUV has just been given, or with passive ranging has measured itself."""

    at_s: float
    vehicle: str
    fix: Fix


class EstimateReading(NamedTuple):
    """Where an AUV believes to be: x, y of its navigator, z of its pressure sensor (m), and the
    covariance of x and y (2, 2), m2, the noise of the depth (m); and its height above the bottom
    (m) by its altimeter, which has no error, None where the bottom is not known.
    """

    at_s: float
    vehicle: str
    place: tuple[float, float, float]
    covariance: tuple[tuple[float, float], tuple[float, float]]
    depth_sd_m: float
    altitude_m: float | None = None


class Pinged(NamedTuple):
    """An AUV (passive ranging: an ASV) has begun to ping."""

    at_s: float
    vehicle: str
    ping: int


class FrameReading(NamedTuple):
    """An ASV has begun a frame of fixes, or an answer."""

    at_s: float
    vehicle: str
    frame: Broadcast


class Truth(NamedTuple):
    """Where a vehicle is: x, y, z (m), yaw (rad)."""

    at_s: float
    vehicle: str
    place: tuple[float, float, float]
    yaw: float


Reading = (
    Gnss | Compass | UsblReading | FixReading | EstimateReading | Pinged | FrameReading | Truth
)


class Earth(NamedTuple):
    """Where x = y = 0 lies at the surface (latitude, longitude, deg, height, m; None: nowhere), and
    when (UTC) 0 s was.
    """

    origin: tuple[float, float, float] | None
    start: datetime

    @property
    def surface_m(self) -> float:
        """The height of the water (m)."""
        return 0.0 if self.origin is None else self.origin[2]

    def utc(self, at_s: float) -> datetime:
        """Return the instant (UTC) of a mission's instant (s)."""
        return self.start + timedelta(seconds=at_s)

    def geodetic(self, place: Sequence[float]) -> tuple[float, float, float]:
        """Return latitude, longitude (deg) and height (m) of a place, x, y and z if given (m)."""
        assert self.origin is not None
        x, y, *z = place
        return geodetic_from_ned((x, y, *z) if z else (x, y, 0.0), *self.origin)


def earth_of(setup: Setup, start: datetime) -> Earth:
    """Return where and when a scenario takes place."""
    return Earth(setup.ground, start)


class Instruments:
    """All that the instruments of a mission measure, as it is advanced.

    Who listens changes nothing of the mission: its tables are those of `simulate`.
    """

    def __init__(
        self, mission: Mission, *, truth: bool = False, only: Collection[str] = ()
    ) -> None:
        """Listen to a mission that is at 0 s; to `only` some vehicles, by name, if any is given."""
        scenario, streams = mission.scenario, Streams(mission.seed)
        self._mission, self._truth, self._only = mission, truth, frozenset(only)
        self._streams, asvs = streams, range(scenario.asvs.count)
        self._gnss = [streams.of(Purpose.GNSS_TELEGRAM, asv) for asv in asvs]
        self._compass = [streams.of(Purpose.COMPASS_TELEGRAM, asv) for asv in asvs]
        self._slow, self._before = (
            slow_gnss(Setup.of(scenario), streams),
            [(math.nan, math.nan)] * len(asvs),
        )
        carried = [group.usbl for group in Setup.of(scenario).vessels for _ in group.members]
        self._sds_m = [usbl.gnss_sd_m for usbl in carried]
        self._heading_sds = [math.radians(usbl.heading_sd_deg) for usbl in carried]
        begun = [
            (ping.ping, f"AUV{ping.auv}" if ping.asv is None else f"ASV{ping.asv}")
            for ping in mission.pings_under_way()
        ]
        self._heard: list[Reading] = [
            Pinged(mission.time, name, ping) for ping, name in begun if self._is_wanted(name)
        ]
        self._grid, self._by_gnss = 0, 0
        #: Whether a vessel's own measurements are unknown: by an instrument of somebody's own.
        self.is_unsighted = False
        watch = mission.watch("ping", "reception", "broadcast", "delivery")
        mission.env.process(self._listen(watch))

    @property
    def time(self) -> float:
        """The instant (s) up to which all readings are known."""
        return self._mission.time

    @property
    def is_over(self) -> bool:
        """Whether the mission has ended."""
        return self.time >= self._mission.scenario.duration_s

    def advance(self, time: float) -> list[Reading]:
        """Advance the mission up to an instant (s), or its end; return what has been measured."""
        end = self._mission.scenario.duration_s
        until = min(time, end)
        while (instant := self._grid / RATE_HZ) <= until and instant < end:
            self._mission.advance(instant)
            self._heard += self._regular(instant)
            self._grid += 1
        self._mission.advance(until)
        found, self._heard = self._heard, []
        return sorted(found, key=lambda reading: reading.at_s)

    def _listen(self, watch: Watch) -> Generator[simpy.Event, Any, None]:
        """Note what happens, at the instant at which it does."""
        while True:
            happening: Happening = yield watch.next()
            for reading in self._readings_of(happening.kind, happening.time, happening.row):
                if self._is_wanted(reading.vehicle):
                    self._heard.append(reading)

    def _is_wanted(self, vehicle: str) -> bool:
        return not self._only or vehicle in self._only

    def _readings_of(self, kind: str, at_s: float, row: Any) -> Iterator[Reading]:
        """Yield what instruments have of a happening."""
        if kind == "ping":
            name = f"ASV{row.asv}" if row.auv is None else f"AUV{row.auv}"
            yield Pinged(at_s, name, row.ping)
        elif kind == "broadcast":
            yield FrameReading(at_s, f"ASV{row.asv}", row)
        elif kind == "delivery":
            yield FixReading(at_s, f"AUV{row.auv}", row)
        elif row.outcome == "heard":
            sight = self._mission.sight_of(row.ping, row.asv)
            if sight is not None:
                yield UsblReading(at_s, f"ASV{row.asv}", f"AUV{row.auv}", row.ping, sight)
            else:
                self.is_unsighted = not self._mission.scenario.protocol.asvs_ping

    def _regular(self, at_s: float) -> Iterator[Reading]:
        """Yield what is measured at equal steps."""
        failed = self._mission.failed_asvs()
        for asv, (x, y, z, yaw) in enumerate(self._mission.asvs().tolist()):
            name = f"ASV{asv}"
            gnss, turn = self._gnss[asv].standard_normal(2), self._compass[asv].standard_normal()
            if asv not in failed and self._is_wanted(name):
                yield self._position(at_s, asv, (x, y), gnss * self._sds_m[asv])
                heading = math.remainder(yaw + self._heading_sds[asv] * turn, math.tau)
                yield Compass(at_s, name, heading)
            if self._truth and self._is_wanted(name):
                yield Truth(at_s, name, (x, y, z), yaw)
        for fix in self._mission.gnss_fixes(self._by_gnss):
            self._by_gnss += 1
            if self._is_wanted(name := f"AUV{fix.auv}"):
                yield Gnss(fix.fixed_at_s, name, (fix.x_m, fix.y_m), None, fix.sd_m)
        scenario, states = self._mission.scenario, self._mission.auvs()
        depth_sd, now = scenario.navigation.depth_sd_m, np.array([at_s])
        setup = Setup.of(scenario)
        high = (setup.bottom.below(states.truth) - states.truth[:, 2]).tolist()
        for auv, (x, y, z, yaw) in enumerate(states.truth.tolist()):
            name, (north, east) = f"AUV{auv}", states.estimate[auv].tolist()
            if self._is_wanted(name):
                depth = z + float(pressure_errors(setup, self._streams, auv, now)[0])
                covariance = states.covariance[auv].tolist()
                altitude = None if math.isnan(high[auv]) else high[auv]
                place = north, east, depth
                yield EstimateReading(at_s, name, place, covariance, depth_sd, altitude)
                if self._truth:
                    yield Truth(at_s, name, (x, y, z), yaw)

    def _position(
        self, at_s: float, asv: int, place: tuple[float, float], noise: NDArray[Any]
    ) -> Gnss:
        own = self._slow[asv]
        slow = own[min(int(at_s / CONTROL_S), len(own) - 1)].tolist()
        x, y = place[0] + slow[0], place[1] + slow[1]
        was, self._before[asv] = self._before[asv], (x, y)
        velocity = None
        if not math.isnan(was[0]):
            velocity = (x - was[0]) * RATE_HZ, (y - was[1]) * RATE_HZ
        sd = math.hypot(self._sds_m[asv], self._mission.scenario.usbl.gnss_correlated_sd_m)
        seen = x + float(noise[0]), y + float(noise[1])
        return Gnss(at_s, f"ASV{asv}", seen, velocity, sd)
