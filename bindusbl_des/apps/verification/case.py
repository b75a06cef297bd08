"""The case to be proved: a scenario and the bounds that hold for its vehicles, clocks and sound.

Who may be where, how late and how fast is said here once, as intervals: :mod:`.rules` prove with
them that no two signals overlap, :mod:`.witnesses` put vehicles at their ends.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.acoustics.propagation import TOUCH
from ...core.protocol.slots import Slots
from ...core.scenario.scenario import Scenario
from ...core.scenario.sections.acoustics import UplinkSection
from ...core.scenario.sections.vehicles import VehicleChoice
from ...core.setup import Setup
from ...core.vehicles.currents import CONTROL_S
from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.plugins import PluginError
from ..preflight.band_warnings import planned_speeds_m_per_s
from ..preflight.round_lengths import Rounds, rounds_of
from .bounds import exceeded

Plan = dict[str, Any]

ACCEPTED, REFUSED, UNDECIDED = "accepted", "refused", "undecided"


@dataclass(frozen=True)
class SignalPair:
    """Whether signals of a kind may overlap, and by how much they fail to.

    `margin_s` is the least time between the end of one and the beginning of the other, `margin_m`
    how much farther the conflict graph looks than it must; either is None where it is not what
    decides.  `witnesses` yields scenarios (plain data) in which two of them overlap, the likeliest
    first.  They are sent on a `band`, hf or mf; None: on either.
    """

    kind: str
    what: str
    verdict: str
    why: str
    margin_s: float | None = None
    margin_m: float | None = None
    witnesses: Callable[[], Iterator[Plan]] | None = None
    band: str | None = "hf"

    @property
    def is_safe(self) -> bool:
        """Whether no two signals of the kind may overlap."""
        return self.verdict == ACCEPTED


def by_time(
    kind: str,
    what: str,
    margin_s: float,
    why: str,
    witnesses: Callable[[], Iterator[Plan]],
    band: str | None = "hf",
) -> SignalPair:
    """Return a pair that a time between two signals decides; touching is no overlap."""
    if margin_s > -TOUCH:
        return SignalPair(kind, what, ACCEPTED, why, margin_s, band=band)
    return SignalPair(kind, what, REFUSED, why, margin_s, None, witnesses, band)


def undecided(kind: str, what: str, why: str, band: str | None = "hf") -> SignalPair:
    """Return a pair that nothing here proves safe; a mission that is played may prove it unsafe."""
    return SignalPair(kind, what, UNDECIDED, why, band=band)


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
    setup: Setup,
    max_speed: float | None = None,
    clock_error: float | None = None,
    sound_speed_error: float | None = None,
) -> Bounds:
    """Return the bounds of a scenario; those given (m/s, s, m/s) stand in place of its own.

    Its own are planned speeds, of vehicles with equations of motion the highest that they reach and
    the current's, which they drift with; so many standard deviations of clocks, currents and fixes
    as none exceeds in a mission but with a chance of CHANCE; and how far the assumed speed of sound
    is off.

    Raises:
        ValueError: naming a bound that is no number, negative or larger than a mission can have.
        PluginError: when a user-defined route is not allowed or cannot be asked.
    """
    scenario, assumed = setup.scenario, setup.assumed_sound_speed_m_per_s
    auvs, asvs, lasts = scenario.auvs.count, scenario.asvs.count, scenario.duration_s
    # Gaussian errors, or norms of such, that a mission draws at most: of each ping at each ASV, of
    # each interval in which currents and GNSS wander, and of each vehicle
    pings = auvs * (1.0 + lasts / scenario.acoustics.hf.ping_s)
    wandering = (1.0 + lasts / CONTROL_S) * (asvs + 1)
    draws = OF_A_PING * pings * asvs + 2 * wandering + OF_A_VEHICLE * (auvs + asvs)
    sigmas = exceeded(CHANCE, draws)
    speed = _planned_speed(setup, sigmas) if max_speed is None else max_speed
    late = _clock_error(scenario, sigmas) if clock_error is None else clock_error
    error = abs(setup.sound_speed_m_per_s - assumed)
    error = error if sound_speed_error is None else sound_speed_error
    for option, value, most, unit in (
        ("--max-speed", speed, FASTEST_M_PER_S, "m/s"),
        ("--clock-error", late, LATEST_S, "s"),
        ("--sound-speed-error", error, 1000.0, "m/s"),
    ):
        if not 0.0 <= value <= most:
            raise ValueError(
                f"{option}: must be at least 0 and at most {most:g} {unit}; got {value:g}; give "
                "another"
            )
    is_water = SLOWEST <= assumed - error <= assumed + error <= FASTEST
    if sound_speed_error is not None and not is_water:
        raise ValueError(
            f"--sound-speed-error: {error:g} m/s about the {assumed:g} m/s that the fleet assumes "
            f"leaves the {SLOWEST:g} to {FASTEST:g} m/s of water; give less"
        )
    return Bounds(speed, _asv_speed(setup, speed, sigmas), late, error, sigmas)


def _planned_speed(setup: Setup, sigmas: float) -> float:
    """Return how fast (m/s) the fastest AUV goes over ground, by what is planned."""
    speeds = planned_speeds_m_per_s(setup)
    return max(
        _fastest(track)
        if track is not None
        else speed
        if held is not None
        else _driven(setup, auv.group.vehicle, speed, sigmas)
        for auv, track, held, speed in zip(
            setup.auvs, setup.auv_tracks, setup.held_places_m, speeds, strict=True
        )
    )


def _driven(setup: Setup, vehicle: VehicleChoice, speed: float, sigmas: float) -> float:
    """Return how fast (m/s) a vehicle is over ground that is to go at a speed: one with equations
    of motion at times as fast as it can, and the current with it.
    """
    if not vehicle.is_steered:
        return speed
    if vehicle.has_dynamics or vehicle.sails:
        speed = max(speed, vehicle.top_speed)
    water = setup.scenario.environment
    current = water.current_m_per_s + (sigmas + math.sqrt(2)) * water.current_variation_m_per_s
    current += setup.flow.limit_m_per_s
    return min(speed + current, FASTEST_M_PER_S)


def _fastest(track: tuple[Floats, Floats]) -> float:
    """Return the speed (m/s) of the fastest leg of a track."""
    times, places = track
    if len(times) < 2:
        return 0.0
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float((ways / np.diff(times)).max())


def _asv_speed(setup: Setup, auv_speed: float, sigmas: float) -> float:
    """Return how fast (m/s) ASVs are; user-defined ones as fast as AUVs at least."""
    placement = setup.scenario.asvs.formation
    if placement.recording is not None:
        return max(map(_fastest, setup.asv_tracks or ()))
    if placement.replanned is not None:
        usual = placement.replanned.speed_m_per_s
        return max(group.speed_m_per_s or usual for group in setup.vessels)
    steered = [group.vehicle for group in setup.vessels if group.vehicle.is_steered]
    driven = [_driven(setup, vehicle, auv_speed, sigmas) for vehicle in steered]
    return max(driven, default=0.0)


def _clock_error(scenario: Scenario, sigmas: float) -> float:
    """Return how wrong (s) the worst AUV's clock is by the end of the mission.

    What AUVs are said to be late is between no lateness and the largest: half of it either way.
    """
    navigation = scenario.navigation
    drawn = navigation.clock_offset_sd_s + navigation.clock_drift_sd * scenario.duration_s
    return sigmas * drawn + max(scenario.auvs.ping_late_s or (0.0,)) / 2


# Autopilots may take an AUV so much deeper than it is told to be.
OVERSHOOT_M = 1.0


@dataclass(frozen=True)
class Case:
    """The facts of a scenario, and the bounds that it is to hold for."""

    setup: Setup
    bounds: Bounds

    @property
    def scenario(self) -> Scenario:
        """The scenario."""
        return self.setup.scenario

    @property
    def auvs(self) -> int:
        """How many AUVs there are."""
        return self.scenario.auvs.count

    @property
    def hf(self) -> UplinkSection:
        """The band of pings."""
        return self.scenario.acoustics.hf

    @property
    def slots(self) -> Slots:
        """The durations of the protocol."""
        return self.setup.slots

    @cached_property
    def rounds(self) -> Rounds:
        """How long rounds last."""
        return rounds_of(self.setup)

    @property
    def shares_slots(self) -> bool:
        """Whether several AUVs may ping in a slot, by rules that are known here."""
        return self.setup.schedule.is_shared_and_proved and self.auvs > 1

    @cached_property
    def slot_s(self) -> float:
        """The uplink slot on the clock (s): from one slot of a round to the next, at least."""
        return self.slots.clock.after(0.0, self.slots.uplink_slot)

    @cached_property
    def sound_speeds(self) -> tuple[float, float]:
        """The slowest and the fastest that sound may travel (m/s)."""
        assumed = self.setup.assumed_sound_speed_m_per_s
        error = self.bounds.sound_speed_error_m_per_s
        return max(assumed - error, SLOWEST), min(assumed + error, FASTEST)

    @property
    def late_s(self) -> float:
        """How much later (s) one AUV may ping than another whose slot is the same."""
        return 2 * self.bounds.clock_error_s if not self.setup.ranging.calls else 0.0

    @property
    def recalls(self) -> int:
        """How many AUVs a round may call back that have not been heard for long: 1, else 0."""
        protocol = self.scenario.protocol
        if not self.setup.tells_slots or protocol.dissemination.missed == "contention":
            return 0
        return int((protocol.forget_after_s or math.inf) < self.scenario.duration_s)

    @property
    def closing_m_per_s(self) -> float:
        """How fast an AUV and an ASV may approach each other (m/s)."""
        return self.bounds.max_speed_m_per_s + self.bounds.asv_speed_m_per_s

    @cached_property
    def stations(self) -> Floats | None:
        """Where the ASVs lie (m), shape (m, 2); None where they move or are not known."""
        if self.bounds.asv_speed_m_per_s > 0.0:
            return None
        try:
            return np.array(self.setup.stations_m, dtype=float).reshape(-1, 2)
        except (ValueError, PluginError):
            return None

    @cached_property
    def apart_m(self) -> Floats:
        """Distances (m) of pairs of ASVs at different places; where they move, any: 0 alone."""
        if self.scenario.asvs.count == 1:
            return np.empty(0)
        if self.stations is None:
            return np.zeros(1)
        found = np.linalg.norm(self.stations[:, None] - self.stations, axis=2)
        return np.asarray(np.unique(found[found > 0.0]))

    @cached_property
    def in_turn_m(self) -> Floats:
        """The same of pairs of which one sends after the other, in the order of their numbers."""
        if self.stations is None or self.scenario.asvs.failures:
            return self.apart_m
        ways = self.stations - np.roll(self.stations, -1, axis=0)
        found = np.linalg.norm(ways, axis=1)
        return np.asarray(np.unique(found[found > 0.0]))

    @cached_property
    def depths(self) -> tuple[tuple[float, float], ...]:
        """The least and greatest depth of each AUV (m).

        AUVs with equations of motion, and such as keep an altitude, are taken to be anywhere down
        to their depth.
        """
        found = []
        for auv, track in zip(self.setup.auvs, self.setup.auv_tracks, strict=True):
            if track is not None:
                found.append((float(track[1][:, 2].min()), float(track[1][:, 2].max())))
                continue
            flies = auv.group.vehicle.is_steered or auv.number in self.setup.rising
            flies = flies or auv.group.altitude.altitude_m is not None
            found.append((0.0 if flies else auv.depth_m, auv.depth_m))
        return tuple(found)

    def longest_m(self, auv: int) -> float:
        """Return the longest way (m) that a ping of an AUV is heard over."""
        deepest = self.depths[auv][1]
        if self.setup.auvs[auv].group.vehicle.is_steered:
            deepest += OVERSHOOT_M
        return self.hf.longest_path_m(deepest)

    def shortest_m(self, auv: int) -> float:
        """Return the shortest way (m) of a ping of an AUV: straight up."""
        return self.depths[auv][0]

    @property
    def farthest_m(self) -> float:
        """The longest way (m) that a ping of any AUV is heard over."""
        return max(map(self.longest_m, range(self.auvs)))

    @property
    def nearest_m(self) -> float:
        """The shortest way (m) of a ping of any AUV."""
        return min(map(self.shortest_m, range(self.auvs)))
