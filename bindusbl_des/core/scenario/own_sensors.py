"""What is wrong with AUVs' own sensors, as keys say it or the sheet of an inertial system; and
which errors of instruments and clocks last through a mission, and who is told of them.

A sheet says how far off a system is after a straight way without fixes, in percent of that way or
in m per hour, with the circle that it means.  Both are read as a circular Gaussian of s along each
axis (:mod:`...support.spreads`):

* by default it is met at the end of a way of `line_m`, by scale and heading errors that wander: a
  velocity bias, ahead and aside, that is a Gauss-Markov process of the body (or of
  `navigation.bias_frame`).  Its time constant is, unless given, the time that the way takes: until
  then the error grows nearly in proportion, later as the square root;
* with `line_m: null` a percentage is a scale factor along the way and a heading error across, each
  drawn for the mission with s / way, and m per hour are a velocity bias, drawn for the mission with
  s / time.  Fixes learn such errors once and for all, which no real system's are.

What a sheet says stands in the place of velocity biases and random walk; a scale factor and a
heading error that are given are further errors, independent of it.
"""

import math
from typing import NamedTuple, Self

from ...support.facts import fact
from ...support.spreads import drift_rms, per_axis_sd, wandering_rms
from .agreement.instruments import taken_for
from .groups import Group
from .site import Site


class OwnSensors(NamedTuple):
    """How wrong an AUV's log, compass and inertial sensors are.

    A velocity bias that all share (m/s) and the standard deviation per axis of a further one, with
    its time constant (s; None: it never changes); the random walk (m/sqrt(s)) per axis; the
    standard deviations of the scale factor less one and of the heading (deg).
    """

    bias_m_per_s: tuple[float, float]
    bias_sd_m_per_s: float
    bias_time_constant_s: float | None
    random_walk_m_per_sqrt_s: float
    scale_factor_sd: float
    heading_sd_deg: float

    def straight_drift_rms(self, time: float, speed: float) -> float:
        """Return the RMS (m) of what a straight way of some `time` (s) without fixes adds to the
        error.

        Beside the known bias (|b| t)^2 and the random walk's 2 sigma^2 t, a drawn velocity bias
        adds 2 sd^2 t^2 (less if it wanders), a scale factor and a heading their variances times
        the square of the way, at a `speed` (m/s).
        """
        lasts = self.bias_time_constant_s or math.inf
        skew = math.hypot(self.scale_factor_sd, math.radians(self.heading_sd_deg))
        return math.hypot(
            drift_rms(time, self.bias_m_per_s, self.random_walk_m_per_sqrt_s),
            math.sqrt(2) * wandering_rms(time, self.bias_sd_m_per_s, lasts),
            skew * speed * time,
        )


class Kind(NamedTuple):
    """Errors of one kind that last: the standard deviations (rad, m, 1, s and s/s) of those of one
    vessel, how many times these are there, and their time constant (s).
    """

    name: str
    sds: tuple[float, ...]
    times: int
    time_constant_s: float = math.inf


# Vessels whose own errors a filter is told of: each has up to three states in every AUV
MOST_TOLD = 16

# Slow acoustic errors of an AUV and an ASV: of the range, and three that make that of the direction
SLOW_NUMBERS = 4


class Sensors(Site):
    """What is wrong with the sensors of a scenario, drawn or constant, and who is told of it."""

    def drift_line_m(self, group: Group) -> float | None:
        """Return the way (m) over which the errors of an inertial system's sheet wander; None: they
        are constant, or there is no sheet.

        They are constant as well where no one speed is planned by which a way takes a time (AUVs
        that hold, that repeat tracks, or that differ in speed), and where the heading error turns
        an array, too (passive ranging).
        """
        drift, route = group.navigation.drift, group.route
        speeds = {self.auvs[auv].speed_m_per_s for auv in group.members}
        planned = not (route.is_held or route.is_recorded) and len(speeds) == 1
        if not drift.is_stated or not planned or self.scenario.protocol.asvs_ping:
            return None
        return drift.line_m

    @fact
    def sensors(self) -> tuple[OwnSensors, ...]:
        """What is wrong with the log, compass and inertial sensors of each AUV."""
        found: list[OwnSensors] = []
        for group in self.groups:
            navigation, drift = group.navigation, group.navigation.drift
            own = OwnSensors(
                navigation.velocity_bias_m_per_s,
                navigation.velocity_bias_sd_m_per_s,
                navigation.velocity_bias_time_constant_s,
                navigation.random_walk_m_per_sqrt_s,
                navigation.scale_factor_sd,
                navigation.heading_sd_deg,
            )
            if not drift.is_stated:
                pass
            elif (line := self.drift_line_m(group)) is not None:
                time = line / self.auvs[group.members[0]].speed_m_per_s
                lasts = time if drift.time_constant_s is None else drift.time_constant_s
                off = per_axis_sd(drift.off_m(line, time), drift.statistic)
                sd = off / wandering_rms(time, 1.0, lasts)
                own = own._replace(bias_sd_m_per_s=sd, bias_time_constant_s=lasts)
            elif drift.m_per_hour is not None:
                off = per_axis_sd(drift.off_m(0.0, 1.0), drift.statistic)
                own = own._replace(bias_sd_m_per_s=off)
            else:
                share = per_axis_sd(drift.off_m(1.0, 0.0), drift.statistic)
                own = own._replace(
                    scale_factor_sd=math.hypot(share, own.scale_factor_sd),
                    heading_sd_deg=math.hypot(math.degrees(share), own.heading_sd_deg),
                )
            found += [own] * len(group.members)
        return tuple(found)

    @property
    def own_sensors(self) -> OwnSensors:
        """What is wrong with those of AUV0; of all AUVs, unless groups differ in it."""
        return self.sensors[0]

    @fact
    def drift_words(self) -> str:
        """How what inertial systems' sheets say is drawn, a sentence each; "" without a sheet.

        Of AUVs that follow no plan of the scenario, whose speed is another, nothing can be said.
        """
        said: dict[str, list[Group]] = {}
        for group in self.groups:
            if words := self._drawn_words(group):
                said.setdefault(words, []).append(group)
        everybody = [list(self.groups)]
        return " ".join(
            f"Dead reckoning{'' if [groups] == everybody else _of(groups)}: {words}"
            for words, groups in said.items()
        )

    def _drawn_words(self, group: Group) -> str:
        drift, route, sensors = group.navigation.drift, group.route, self.sensors[group.members[0]]
        if not drift.is_stated or route.is_held or route.is_recorded:
            return ""
        line, sd = self.drift_line_m(group), sensors.bias_sd_m_per_s
        fastest = max(self.auvs[auv].speed_m_per_s for auv in group.members)
        share = sensors.scale_factor_sd if sd == 0.0 else sd / fastest
        drawn = (
            f"a scale factor of {100 * share:.3g} % and a heading error of "
            f"{math.degrees(share):.3g} deg"
            if drift.m_per_hour is None
            else f"a velocity bias of {sd:.3g} m/s per axis"
        )
        lasts = "constant for the mission" if line is None else f"wandering over {line:g} m"
        return (
            f"its data sheet's {drift.words} is {drawn} (standard deviations), "
            f"drawn for each AUV and seed, {lasts}."
        )

    @fact
    def sound_speed_error(self) -> float:
        """The share of a range by which it is measured too long, by the sound speed assumed."""
        return 1.0 - self.sound_speed_m_per_s / self.assumed_sound_speed_m_per_s

    @fact
    def misalignment_sd_rad(self) -> float:
        """The standard deviation (rad) of the constant error by which directions are turned: that
        of the array, with passive ranging also of the AUV's compass.
        """
        passive = self.scenario.protocol.asvs_ping
        compass = self.own_sensors.heading_sd_deg if passive else 0.0
        return math.radians(math.hypot(self.scenario.usbl.misalignment_sd_deg, compass))

    @fact
    def lasting_errors(self) -> list[Kind]:
        """The kinds of errors that fixes have in common, in the order of their Jacobian J."""
        scenario, usbl, navigation = self.scenario, self.scenario.usbl, self.scenario.navigation
        asvs = scenario.asvs.count
        arrays = 1 if scenario.protocol.asvs_ping else asvs  # that a fix may be of: else its own
        clock = navigation.clock_offset_sd_s, navigation.clock_drift_sd
        slow = (1.0,) * SLOW_NUMBERS if usbl.slow_share > 0.0 else (0.0,)
        found = [
            Kind("misalignment", (self.misalignment_sd_rad,), arrays),
            Kind("gnss", (usbl.gnss_correlated_sd_m,) * 2, asvs, usbl.gnss_time_constant_s),
            Kind("sound_speed", (abs(self.sound_speed_error),), 1),
            Kind("clock", (0.0, 0.0) if self.ranging.calls else clock, 1),
            Kind("slow", slow, asvs, usbl.correlation_s),
        ]
        return [kind for kind in found if any(kind.sds)]

    @fact
    def taken(self) -> Self:
        """The facts that a filter takes for those of its mission: with what its setting `assumes`
        says in the place of keys, or else these themselves.
        """
        scenario = taken_for(self.scenario)
        return self if scenario is self.scenario else type(self)(scenario)

    @fact
    def estimated_errors(self) -> list[Kind]:
        """Those kinds of lasting errors that navigators are told of, to estimate them.

        They are none of filters that do not weigh, nor of those that are left `untold`; and with
        more than MOST_TOLD ASVs none of each of these, which would be too many states.
        """
        navigation = self.scenario.navigation
        if not navigation.weighs or self.scenario.usbl.model.is_own:
            return []
        untold = navigation.filter.settings.get("untold", ())
        return [
            kind
            for kind in self.taken.lasting_errors
            if kind.name not in untold and kind.times <= MOST_TOLD
        ]


def _of(groups: list[Group]) -> str:
    """Return whose dead reckoning is meant."""
    return f" of {', '.join(group.words for group in groups)}"
