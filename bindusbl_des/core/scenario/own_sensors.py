"""Errors of the AUVs' own sensors (dead reckoning), and errors of fixes that outlast a ping.

A sheet of an inertial system states its error after a straight leg without fixes, in percent of the
distance or in m per hour, for a circle that holds a stated share of errors.  Both mean a circular
Gaussian of s along each axis (:mod:`...support.spreads`):

* by default the error is met after `line_m`, by a velocity bias, ahead and aside, that is a
  Gauss-Markov process in the frame of `navigation.bias_frame`.  Its time constant is, unless given,
  the time that this leg takes: until then the error grows nearly in proportion to time, later as
  its square root;
* with `line_m: null` a percentage means a scale factor along track and a heading error across, each
  drawn once for the mission with s / distance; m per hour mean a velocity bias, drawn once with
  s / time.  Fixes reveal such constant errors for good, unlike those of a real system.

The sheet replaces velocity biases and random walk.  A scale factor and a heading error that are
given are further, independent errors.
"""

import math
from typing import NamedTuple, Self

from ...support.facts import fact
from ...support.spreads import drift_rms, per_axis_sd, wandering_rms
from .agreement.instruments import taken_for
from .groups import Group
from .site import Site


class OwnSensors(NamedTuple):
    """Errors of one AUV's log, compass and inertial sensors.

    A velocity bias common to all AUVs (m/s); the standard deviation per axis of a further one (m/s)
    with its time constant (s; None: constant); the random walk (m/sqrt(s)) per axis; the standard
    deviations of the scale factor less one, and of the heading (deg).
    """

    bias_m_per_s: tuple[float, float]
    bias_sd_m_per_s: float
    bias_time_constant_s: float | None
    random_walk_m_per_sqrt_s: float
    scale_factor_sd: float
    heading_sd_deg: float

    def straight_drift_rms(self, time: float, speed: float) -> float:
        """Return the RMS error (m) of a straight leg of `time` (s) at `speed` (m/s) without fixes.

        The common bias adds (|b| t)^2, the random walk 2 sigma^2 t, a drawn velocity bias 2 sd^2
        t^2 (less if it wanders), scale factor and heading their variances times the distance
        squared.
        """
        lasts = self.bias_time_constant_s or math.inf
        skew = math.hypot(self.scale_factor_sd, math.radians(self.heading_sd_deg))
        return math.hypot(
            drift_rms(time, self.bias_m_per_s, self.random_walk_m_per_sqrt_s),
            math.sqrt(2) * wandering_rms(time, self.bias_sd_m_per_s, lasts),
            skew * speed * time,
        )


class Kind(NamedTuple):
    """One kind of lasting error: name, standard deviations (rad, m, 1, s or s/s) of its states for
    one vessel, the number of vessels that have it, and its time constant (s).
    """

    name: str
    sds: tuple[float, ...]
    times: int
    time_constant_s: float = math.inf


# A filter models the errors of at most so many vessels: each adds up to three states in every AUV
MOST_TOLD = 16

# Slow acoustic errors of a pair of AUV and ASV: one of the range, three of the direction
SLOW_NUMBERS = 4


class Sensors(Site):
    """Errors of a scenario's sensors, drawn or constant, and which of them navigators model."""

    def drift_line_m(self, group: Group) -> float | None:
        """Return the leg (m) over which a sheet's errors wander; None if constant or not stated.

        They are also constant for AUVs without one planned speed (AUVs that hold, repeat tracks, or
        differ in speed), and with passive ranging, where the heading error rotates the array, too.
        """
        drift, route = group.navigation.drift, group.route
        speeds = {self.auvs[auv].speed_m_per_s for auv in group.members}
        planned = not (route.is_held or route.is_recorded) and len(speeds) == 1
        if not drift.is_stated or not planned or self.scenario.protocol.asvs_ping:
            return None
        return drift.line_m

    @fact
    def sensors(self) -> tuple[OwnSensors, ...]:
        """The errors of each AUV's log, compass and inertial sensors."""
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
        """The sensor errors of AUV0; of every AUV, unless groups differ."""
        return self.sensors[0]

    @fact
    def drift_words(self) -> str:
        """How the program draws what data sheets state, a sentence for each sheet; "" without.

        AUVs that hold or repeat tracks are left out: their speed is not the scenario's.
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
        """The share by which an assumed sound speed makes ranges too long."""
        return 1.0 - self.sound_speed_m_per_s / self.assumed_sound_speed_m_per_s

    @fact
    def misalignment_sd_rad(self) -> float:
        """The standard deviation (rad) of the constant heading error of measured directions.

        It is the array's; with passive ranging the AUV's compass adds its own.
        """
        passive = self.scenario.protocol.asvs_ping
        compass = self.own_sensors.heading_sd_deg if passive else 0.0
        return math.radians(math.hypot(self.scenario.usbl.misalignment_sd_deg, compass))

    @fact
    def lasting_errors(self) -> list[Kind]:
        """The kinds of errors that fixes have in common, in the order of the columns of J."""
        scenario, usbl, navigation = self.scenario, self.scenario.usbl, self.scenario.navigation
        asvs = scenario.asvs.count
        arrays = 1 if scenario.protocol.asvs_ping else asvs  # a passive fix has the AUV's own array
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
        """The facts that a filter assumes of its mission: the setting `assumes` replaces keys."""
        scenario = taken_for(self.scenario)
        return self if scenario is self.scenario else type(self)(scenario)

    @fact
    def estimated_errors(self) -> list[Kind]:
        """The kinds of lasting errors that navigators estimate as states.

        None for filters that do not weigh fixes; without those that `untold` names, and without
        kinds that more than MOST_TOLD vessels have, which would be too many states.
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
    """Return the groups as words behind "Dead reckoning"."""
    return f" of {', '.join(group.words for group in groups)}"
