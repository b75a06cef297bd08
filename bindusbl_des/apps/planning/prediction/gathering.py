"""The inputs of a prediction, from a scenario: paths, errors, slots, and tables over distance; and,
in sentences, what the prediction leaves out.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import product
from math import cos, hypot, radians, sin, sqrt
from typing import Any

import numpy as np

from ....core.acoustics.channel import between
from ....core.protocol.slots import Slots
from ....core.scenario import families
from ....core.setup import Setup
from ....core.usbl.measuring import variances
from ....support.arrays import Floats
from ....support.wording import plain
from ...preflight.band_warnings import ALWAYS_HEARING, messages, shifted_bands
from ...preflight.fix_chance import below, frame_chance, loses_pings, ping_chance
from ...preflight.round_lengths import pace_of
from .inputs import (
    AccessPlan,
    Chances,
    DriftSource,
    FixNoise,
    Inputs,
    OtherDrift,
    PlannedWays,
    PredictedNavigator,
    SlotLengths,
    SystematicErrors,
)


def inputs_of(setup: Setup) -> Inputs:
    """Return the inputs of a scenario's prediction.

    Parts that do not depend on stations are computed once for all placements.

    Raises:
        ValueError: when the route cannot be driven, a channel's file cannot be read, or the
            scenario has random access, GNSS fixes by surfacing, a growing queue of fixes, or
            repeats, relays or acknowledgements in frames.
    """
    scenario = setup.scenario
    if scenario.protocol.random_access:
        raise ValueError(
            f"protocol.schedule: {scenario.protocol.rule} has no rounds to predict errors by; "
            "simulate it, or use a schedule with slots"
        )
    for key, is_asked in (
        ("acknowledge: frame", scenario.protocol.acknowledge == "frame"),
        ("repeat", scenario.protocol.most_repeats != 0),
        ("relay", scenario.protocol.relay is not None),
    ):
        if is_asked:
            raise ValueError(
                f"protocol.{key}: what AUVs send behind a broadcast, and what it brings them, is "
                "not predicted; simulate it"
            )
    rises = any(wing.asked.surfacing is not None for wing in setup.wings)
    if rises and scenario.navigation.gnss_fix is not None:
        raise ValueError(
            "navigation.gnss_fix: what AUVs gain that come up to fix is not predicted; simulate it"
        )
    if waiting := next(messages(setup), None):
        raise ValueError(
            f"{waiting.key}: fixes that wait ever longer are not predicted; simulate it"
        )
    return Inputs(
        float(scenario.duration_s),
        ways_of(setup),
        hf_chances(setup),
        mf_chances(setup),
        fix_noise(setup),
        _systematic_errors(setup),
        _slots(setup),
        _access(setup),
        _navigator(setup),
        tuple(approximations(setup)),
        tuple(_others(setup)),
        setup.land,
    )


def approximations(setup: Setup) -> Iterator[str]:
    """Yield sentences on what of a scenario the prediction approximates or leaves out."""
    scenario = setup.scenario
    for key, name in scenario.plugins.items():
        if not key.endswith((".formation", ".route")):
            yield f"{key} {name} is taken for the part that ships with the program."
    if taken := setup.schedule.approximation:
        yield f"{scenario.protocol.schedule} {taken}"
    if any(group.vehicle.has_dynamics for group in setup.groups):
        yield "AUVs are taken to follow their plans exactly, whatever moves them."
    if not setup.keeps_still:
        yield "ASVs are taken to keep their stations exactly."
    if scenario.has_peers:
        yield (
            "What AUVs learn from each other (navigation.peers) is left out, and what their "
            "messages cost on HF."
        )
    if scenario.modems is not None:
        yield "What hosts have modems send (modems) is left out, and what it costs on HF."
    if scenario.asvs.failures:
        yield "ASVs that fail are taken to serve all the time."
    if setup.tells_slots:
        yield "AUVs are taken to know their slots: in no round does one miss the frame that tells."
    if scenario.protocol.positions != "truth" or setup.tells_slots:
        yield "The schedule is taken to know where AUVs are: it may believe in fewer conflicts."
    if setup.broadcaster.at_once:
        yield (
            "All fixes are taken to be in one frame: where AUVs hear several ASVs, frames follow "
            "each other, rounds are longer, and fixes up to a sixth older."
        )
    elif setup.broadcaster.chosen_by in ("hearing", "distance") and loses_pings(setup):
        yield (
            f"{scenario.protocol.broadcaster} is taken to choose the ASV that it chooses most "
            "often: where many pings are lost, who never hears that one is served better than "
            "predicted."
        )
    bands = scenario.acoustics.bands.values()
    bursts = [burst for burst in (band.burst_s for band in bands) if burst is not None]
    if bursts:
        yield (
            f"Losses that last {plain(max(bursts))} s are taken to come one by one: times without "
            "a fix, and errors, may be several times those predicted."
        )
    if shifted_bands(setup):
        yield (
            "Signals that Doppler loses (doppler_limit_m_per_s) are taken to be decoded: where "
            "AUVs go towards an ASV or away from it there are fewer fixes, and errors are larger."
        )
    if scenario.navigation.filter.settings.get("range_rate"):
        yield "Range rates are left out: errors may be somewhat smaller than predicted."
    if any(auv.group.altitude.altitude_m is not None for auv in setup.auvs):
        yield (
            "AUVs that keep an altitude are taken to be at the greatest depth that they go to: "
            f"{plain(setup.deepest_m)} m."
        )
    if scenario.navigation.dvl_range_m is not None:
        yield (
            "The current that logs miss without bottom lock is taken for its mean on each AUV's "
            "way, about which it varies: errors are larger where an AUV has no lock for long."
        )
    open_ended = not all(band.traits.ends_at_range for band in bands)
    if len({auv.depth_m for auv in setup.auvs}) > 1 and open_ended:
        yield (
            f"All AUVs are taken to be heard, and to hear, as well as the deepest, from "
            f"{plain(setup.deepest_m)} m."
        )
    if any(band.traits.by_link for band in bands):
        yield (
            "Links are taken to be as good as the disc's within range_m, whatever was measured of "
            "each."
        )
    if scenario.acoustics.hf.traits.traces_rays:
        yield (
            "Sound is taken to come straight: by what bent rays and echoes make of ranges, fixes "
            "in a shadow may be tens of metres off."
        )
    if scenario.protocol.duplex == "per_node" and not scenario.protocol.asvs_ping:
        yield ALWAYS_HEARING
    if (lag := scenario.navigation.filter.settings.get("lag_s")) is not None:
        yield f"A smoother that waits for {plain(lag)} s is taken to know all later fixes."
    if setup.taken is not setup:
        yield "Errors that last are taken to be as slow as they are, whatever the filter assumes."
    if scenario.navigation.gnss_fix is not None:
        yield (
            "GNSS fixes at the surface are left out: where AUVs have them, errors and ages are "
            "smaller than predicted."
        )
    if any(wing.asked.surfacing is not None for wing in setup.wings):
        yield "AUVs that come up are taken to stay at their depth, seen from above where they are."
    if scenario.usbl.outlier_share:
        yield "Outliers of the fixes are left out."
    if (
        scenario.acoustics.mf.payload_bytes is not None
        and scenario.acoustics.mf.overfull != "split"
    ):
        yield "No fix waits for a later broadcast, however full the first is."


# The interval of instants (s), and the fewest and most instants of a mission.
STEP_S, FEWEST, MOST = 2.5, 121, 361


class _Plan:
    """The keys of a scenario that decide its AUVs' paths, as a hashable key."""

    def __init__(self, setup: Setup) -> None:
        self.setup, scenario = setup, setup.scenario
        water = scenario.environment.origin, setup.routes
        self.key: tuple[Any, ...] = (scenario.survey, scenario.auvs, scenario.duration_s, *water)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Plan) and self.key == other.key


def ways_of(setup: Setup) -> PlannedWays:
    """Return the paths of a scenario's AUVs as planned.

    AUVs with dynamics are treated as without, at their commanded speed.

    Raises:
        ValueError: when the route cannot be driven.
    """
    return _ways(_Plan(setup))


@lru_cache(maxsize=32)
def _ways(plan: _Plan) -> PlannedWays:
    scenario = plan.setup.scenario
    count = min(max(round(scenario.duration_s / STEP_S) + 1, FEWEST), MOST)
    times = np.linspace(0.0, scenario.duration_s, count)
    vehicles = plan.setup.planned_auvs
    return PlannedWays(
        times,
        np.stack([vehicle.sample(times)[:, :2] for vehicle in vehicles]),
        np.stack([vehicle.heading_integral(times) for vehicle in vehicles]),
        np.array([auv.depth_m for auv in plan.setup.auvs]),
    )


def _systematic_errors(setup: Setup) -> SystematicErrors:
    """Return the systematic errors of fixes; a drifting clock has its error of half the mission."""
    scenario = setup.scenario
    found = {kind.name: kind.sds for kind in setup.lasting_errors}
    offset, drift = found.get("clock", (0.0, 0.0))
    return SystematicErrors(
        found.get("misalignment", (0.0,))[0],
        found.get("gnss", (0.0,))[0],
        scenario.usbl.gnss_time_constant_s,
        found.get("sound_speed", (0.0,))[0],
        hypot(offset, drift * float(scenario.duration_s) / 2),
        scenario.usbl.correlation_s if "slow" in found else 0.0,
        len(setup.estimated_errors) == len(found),
    )


def _navigator(setup: Setup) -> PredictedNavigator:
    """Return the predicted navigator; a Kalman filter stands for user-defined filters."""
    scenario = setup.scenario
    navigation = scenario.navigation
    own = navigation.filter.is_own
    name = NAVIGATOR if own else str(navigation.filter)
    first, _ = setup.beliefs
    return PredictedNavigator(
        name,
        families.NAVIGATOR.traits[name],
        navigation.fixed_gain.gain,
        navigation.weighs or own or navigation.fixed_gain.delay_compensation == "shift",
        navigation.initial_position_sd_m,
        sqrt(first.covariances[0, 0, 0]),
        *_drift(setup, 0),
    )


def _others(setup: Setup) -> Iterator[OtherDrift]:
    """Yield the dead reckoning of AUVs whose sensors differ from AUV0's."""
    for sensors in dict.fromkeys(setup.sensors):
        members = tuple(auv for auv, own in enumerate(setup.sensors) if own == sensors)
        if members[0] != 0:
            yield OtherDrift(members, *_drift(setup, members[0]))


def _drift(setup: Setup, auv: int) -> tuple[float, float, tuple[DriftSource, ...]]:
    """Return the random walk of an AUV's dead reckoning (m2/s), true and assumed; its sources."""
    sensors, (first, growth) = setup.sensors[auv], setup.beliefs
    assumed = [sqrt(first.covariances[auv, k, k]) for k in range(first.states.shape[1])]
    sources = (
        *_bias(setup, auv, (assumed[2], assumed[3])),
        *_current(setup, auv, assumed[4], growth.wander),
        *_wandering(setup, auv, assumed[growth.wandering] if growth.wandering else 0.0),
        *_skew(setup, auv, (assumed[6], assumed[7]) if growth.stretched > 0 else (0.0, 0.0)),
    )
    return sensors.random_walk_m_per_sqrt_s**2, float(growth.walks[auv]), sources


def _bias(setup: Setup, auv: int, assumed: tuple[float, float]) -> list[DriftSource]:
    sensors, frame = setup.sensors[auv], setup.scenario.navigation.bias_frame
    drawn = 0.0 if sensors.bias_time_constant_s is not None else sensors.bias_sd_m_per_s
    mean = sensors.bias_m_per_s
    if not any((*mean, drawn, *assumed)):
        return []
    return [DriftSource(frame, mean, (drawn, drawn), assumed)]


def _current(setup: Setup, auv: int, assumed: float, wander: float) -> list[DriftSource]:
    """Return the current as a velocity error of dead reckoning through the water; a field as its
    mean along the AUV's way, about which it varies.
    """
    water = setup.missed
    moves = water and (assumed or water.speed_m_per_s or water.varies_m_per_s)
    if water is None or not (moves or water.has_field):
        return []
    heading, speed = water.towards_rad, water.speed_m_per_s
    mean, varies = (-speed * cos(heading), -speed * sin(heading)), water.varies_m_per_s
    lasts = None if wander else water.lasts_s if varies else None
    if water.has_field:
        (north, east), rms = water.flow.means[auv].tolist(), water.flow.rms[auv]
        mean = mean[0] - north, mean[1] - east
        square = max(float(rms) ** 2 - north**2 - east**2, 0.0) / 2.0 + varies**2
        rate = water.flow.wander
        if varies:
            rate += 2.0 * varies**2 / water.lasts_s
        varies, lasts = sqrt(square), None if wander or not rate else 2.0 * square / rate
    return [DriftSource("world", mean, (varies, varies), (assumed, assumed), lasts, wander)]


def _wandering(setup: Setup, auv: int, assumed: float) -> list[DriftSource]:
    sensors, frame = setup.sensors[auv], setup.scenario.navigation.bias_frame
    lasts = sensors.bias_time_constant_s
    sd = 0.0 if lasts is None else sensors.bias_sd_m_per_s
    if not sd:
        lasts = setup.taken.sensors[auv].bias_time_constant_s
    if not (sd or assumed):
        return []
    return [DriftSource(frame, (0.0, 0.0), (sd, sd), (assumed, assumed), lasts)]


def _skew(setup: Setup, auv: int, assumed: tuple[float, float]) -> list[DriftSource]:
    sensors = setup.sensors[auv]
    turned = radians(sensors.heading_sd_deg)
    if not (sensors.scale_factor_sd or turned or any(assumed)):
        return []
    return [DriftSource("way", (0.0, 0.0), (sensors.scale_factor_sd, turned), assumed)]


# Substitutes for user-defined parts that declare nothing.
SCHEDULE = families.ScheduleTraits(groups="first_fit")
DOWNLINK = families.DownlinkTraits(waits=True)
BROADCASTER = families.BroadcasterTraits("turn")
NAVIGATOR = next(name for name, traits in families.NAVIGATOR.traits.items() if traits.weighs)


def _slots(setup: Setup) -> SlotLengths:
    """Return the slot lengths; without its code a user-defined ranging has slots of one ping."""
    scenario = setup.scenario
    slots, protocol = setup.slots, scenario.protocol
    fixes = range(scenario.auvs.count + 1)
    clock, messages = slots.clock, slots.messages
    two_way = protocol.calls
    named = scenario.auvs.count if setup.tells_slots else 0
    own = hasattr(families.RANGING.known(protocol.ranging), "slot_s")
    return SlotLengths(
        slots.ping_duration,
        2 if two_way else 1,
        protocol.turnaround_s if two_way else 0.0,
        slots.uplink_guard,
        slots.shortest_uplink,
        slots.uplink_slot if own else _usual_slot(setup, slots),
        setup.deepest_m,
        setup.assumed_sound_speed_m_per_s,
        clock.rate,
        slots.answer,
        np.array([clock.after(0.0, slots.downlink_slot(count, named)) for count in fixes]),
        np.array([
            slots.airtime(count, named) + messages.packed(count, named)[-1].delay_s
            for count in fixes
        ]),
    )  # fmt: skip


def _usual_slot(setup: Setup, slots: Slots) -> float | None:
    """Return the mean length of a slot (s) if the schedule has no fixed length, else None.

    A polled AUV is at two thirds of the largest distance, the mean over a disc.
    """
    pace = pace_of(setup, slots)
    if setup.schedule.pace == "answered":
        ways = 4.0 / 3.0 * slots.longest_travel_time
        answered = 2.0 * slots.ping_duration + setup.scenario.protocol.turnaround_s + ways
        return answered + slots.answer
    return None if pace is None else pace[0].uplink_slot


def _reply_s(setup: Setup) -> float:
    """Return the time (s) from a ping's front to the end of its reply, with the modem's delay."""
    delay, messages = setup.reply_delay_s, setup.messages
    if not setup.scenario.protocol.replies_in_frames:
        return delay
    return delay + messages.airtime(1) + messages.delay(1)


def _access(setup: Setup) -> AccessPlan:
    """Return which vehicle pings when, and which ASV answers how."""
    protocol = setup.scenario.protocol
    schedule, broadcaster = setup.schedule, setup.broadcaster
    framed = schedule.framed
    return AccessPlan(
        schedule if schedule.groups else SCHEDULE,
        DOWNLINK if protocol.downlink.is_own else setup.downlink,
        broadcaster if broadcaster.chosen_by else BROADCASTER,
        setup.ranging,
        fixed_asv=protocol.broadcaster.settings.get("asv", 0),
        frame_s=protocol.frame_s if framed else 0.0,
        reply_s=_reply_s(setup),
        replies_in_frames=protocol.replies_in_frames,
    )


# The steps of a table, and its length as a multiple of the largest relevant distance.
STEPS, FARTHER = 400, 1.25


def farthest_of(setup: Setup) -> float:
    """Return the length (m) of tables: the larger of survey and formation, or twice the range."""
    scenario = setup.scenario
    hf, mf, area = scenario.acoustics.hf, scenario.acoustics.mf, setup.area
    return FARTHER * max(2.0 * hf.range_m, mf.range_m, 1.5 * area.across)


def hf_chances(setup: Setup) -> Chances:
    """Return the probability that one array decodes a ping."""
    scenario = setup.scenario
    hf, farthest = scenario.acoustics.hf, farthest_of(setup)
    ranges = np.linspace(0.0, farthest, STEPS + 1)
    is_cut = hf.traits.ends_at_range or not hf.by_place
    chances = ping_chance(setup, ranges, setup.deepest_m)
    if chances is None:
        chances = 1.0 - setup.ping_loss.over(ranges)
    return Chances(hf.range_m, is_cut, hf.range_metric == "slant", ranges[1], chances)


def mf_chances(setup: Setup) -> Chances:
    """Return the probability that an AUV decodes a frame with the fixes of all."""
    scenario = setup.scenario
    mf, farthest = scenario.acoustics.mf, farthest_of(setup)
    is_cut = mf.traits.ends_at_range or not mf.by_place
    ranges = np.linspace(0.0, farthest, STEPS + 1)
    chances = frame_chance(setup, ranges, setup.deepest_m)
    if chances is None:
        chances = np.ones(len(ranges))
    by_slant = not is_cut or mf.range_metric == "slant"
    return Chances(mf.range_m, is_cut, by_slant, ranges[1], chances)


def fix_noise(setup: Setup) -> FixNoise:
    """Return the error variances of a fix by one array, for each AUV's depth.

    Shipped arrays have the same errors at all azimuths.  The default array stands for user-defined
    instruments.
    """
    scenario = setup.scenario
    farthest, away = farthest_of(setup), np.linspace(0.0, farthest_of(setup), STEPS + 1)
    hf = scenario.acoustics.hf
    channel = setup.ping_channel if hf.by_place else None
    rows: dict[tuple[float, int], Floats] = {}
    shares = 0.0, scenario.usbl.slow_share
    carried = [group.members.start for group in setup.vessels if group.members]
    arrays = [setup.usbls[asv] for asv in carried] or [setup.usbl]
    depths = [auv.depth_m for auv in setup.auvs]
    for depth, (number, usbl) in product({*depths}, enumerate(arrays)):
        snr = np.full(len(away), math.nan)
        if channel is not None:
            asked = between(0.0, *below(np.hypot(away, depth), depth), hf.range_m, calling=False)
            snr = np.ascontiguousarray(channel.prospects(asked)["snr_db"][:, 0])
        moved = _moved_m2(setup)
        found, rest = (
            variances(away, depth, snr, moved, scenario.navigation.weighs, *noisy.packed)
            for noisy in (replace(usbl, slow_share=share) for share in shares)
        )
        level = np.maximum(found[:, 0] + found[:, 1], 1e-30)
        slow = np.clip(1.0 - (rest[:, 0] + rest[:, 1]) / level, 0.0, 1.0)
        rows[depth, number] = np.column_stack((found, slow))
    whose = [0]
    if len(arrays) > 1:
        whose = [number for number, group in enumerate(setup.vessels) for _ in group.members]
    own = np.stack([[rows[depth, number] for number in whose] for depth in depths])
    step = farthest / STEPS
    return FixNoise(step, *(np.ascontiguousarray(own[..., k]) for k in range(5)))


def _moved_m2(setup: Setup) -> float:
    """Return the variance (m2) of an AUV's displacement from call to reply; below 0 without calls.

    A filter that weighs fixes knows it by dead reckoning, but for the random walk.
    """
    scenario = setup.scenario
    protocol = scenario.protocol
    if not setup.ranging.calls:
        return -1.0
    lasts = scenario.acoustics.hf.ping_s + protocol.turnaround_s
    if scenario.navigation.weighs:
        return max(own.random_walk_m_per_sqrt_s for own in setup.sensors) ** 2 * lasts
    return (max(setup.planned_speeds_m_per_s) * lasts) ** 2 / 2
