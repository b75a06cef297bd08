"""Errors of sensors in one mission: the AUVs' own, and the systematic errors of USBL."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from ...support.arrays import Floats
from ...support.streams import Purpose, Streams, normals
from ..navigation.dead_reckoning import random_walk
from ..records.events import HEARD, LASTING_ERRORS
from ..records.rows import NONE, Rows
from ..setup import Setup
from ..usbl.instrument import packed
from ..usbl.systematic_effects import SYSTEMATIC, Systematic
from ..vehicles.currents import CONTROL_S, gauss_markov
from ..vehicles.reckoning import Wrong, skews_of
from .launch import MissionCurrent, slow_gnss


def wrong_reckoning(setup: Setup, streams: Streams, water: MissionCurrent) -> Wrong:
    """Return the errors of the AUVs' dead reckoning in this mission.

    The effects of wandering biases, and of a current that differs from place to place, are summed
    up as the AUVs' motion becomes known.
    """
    navigation, skews = setup.scenario.navigation, _skews(setup, streams)
    biases = _velocity_biases(setup, streams)
    swept = navigation.velocity == "through_water" and setup.flow.limit_m_per_s > 0.0
    swept = swept or navigation.dvl_range_m is not None
    return Wrong(
        _walks(setup, streams, water, skews),
        navigation.imu_rate_hz,
        biases,
        np.zeros_like(biases),
        CONTROL_S if biases.shape[1] > 1 else math.inf,
        navigation.bias_frame == "body",
        skews,
        np.zeros((len(biases), 1 + setup.control_intervals if swept else 1, 2)),
    )


def _velocity_biases(setup: Setup, streams: Streams) -> Floats:
    """Return the velocity biases (m/s) of each AUV's dead reckoning, (n, k, 2): k = 1 where they
    are constant, else one for each control interval.
    """
    sensors = setup.sensors
    constant = np.array([own.bias_m_per_s for own in sensors], dtype=np.float64)
    wander = [own.bias_time_constant_s if own.bias_sd_m_per_s else None for own in sensors]
    sds = [own.bias_sd_m_per_s for own in sensors]
    fixed = [sd if time is None else 0.0 for sd, time in zip(sds, wander, strict=True)]
    biases = (constant + _drawn(streams, Purpose.VELOCITY_BIAS, fixed))[:, np.newaxis]
    if not any(wander):
        return biases
    steps = setup.control_intervals, 2
    biases = np.repeat(biases, steps[0], axis=1)
    for auv, (sd, time) in enumerate(zip(sds, wander, strict=True)):
        if time is not None:
            noise = streams.of(Purpose.VELOCITY_BIAS, auv).standard_normal(steps)
            biases[auv] = constant[auv] + gauss_markov(sd, time, CONTROL_S, noise)
    return biases


def _skews(setup: Setup, streams: Streams) -> Rows:
    """Return what the AUVs' logs and compasses make of their ways (n,)."""
    scales = [own.scale_factor_sd for own in setup.sensors]
    return skews_of(_drawn(streams, Purpose.SCALE_FACTOR, scales)[:, 0], headings(setup, streams))


def headings(setup: Setup, streams: Streams) -> Floats:
    """Return the constant error of each AUV's heading (rad), (n,)."""
    sds = [math.radians(own.heading_sd_deg) for own in setup.sensors]
    return _drawn(streams, Purpose.HEADING, sds)[:, 0]


def _drawn(streams: Streams, purpose: Purpose, sds: Sequence[float]) -> Floats:
    """Return what AUVs have drawn once for the mission, along two axes, (n, 2), each by the
    standard deviation of its own.
    """
    found = np.zeros((len(sds), 2))
    for auv, sd in enumerate(sds):
        if sd != 0.0:
            found[auv] = sd * streams.of(purpose, auv).standard_normal(2)
    return found


def _walks(setup: Setup, streams: Streams, water: MissionCurrent, skews: Rows) -> Floats:
    """Return each AUV's dead-reckoning error (m) without biases and skew, at its IMU's samples, (n,
    k, 2).

    A walk begins with the error of the initial position.  Dead reckoning through the water misses
    the current: its error is minus the water's displacement, as log and compass measure it.
    """
    navigation, rate = setup.scenario.navigation, setup.scenario.navigation.imu_rate_hz
    count = max(1, math.ceil(setup.scenario.duration_s * rate))
    noise = np.empty((setup.scenario.auvs.count, count + 1, 2))
    starts = [navigation.initial_position_sd_m] * len(noise)
    noise[:, 0] = _drawn(streams, Purpose.INITIAL_POSITION, starts)
    for auv, its_own in enumerate(noise):
        streams.of(Purpose.DRIFT, auv).standard_normal(out=its_own[1:])
    sds = np.array([own.random_walk_m_per_sqrt_s for own in setup.sensors])
    lost = random_walk(rate, sds, noise)
    if navigation.velocity == "through_water":
        moved = water.carried(np.arange(count + 1) / rate)
        lost -= moved
        for auv in np.flatnonzero((skews["along"] != 0.0) | (skews["across"] != 0.0)).tolist():
            along, across = skews[auv]["along"], skews[auv]["across"]
            lost[auv] -= moved @ np.array([[along, across], [-across, along]])
    return lost


def pressure_errors(setup: Setup, streams: Streams, auv: int, times: Floats) -> Floats:
    """Return the errors (m) of an AUV's pressure sensor at instants (n,), s.

    It samples at the IMU's rate, and may be asked for any instant.
    """
    navigation = setup.scenario.navigation
    key = streams.of(Purpose.DEPTH, auv).integers(2**64, dtype=np.uint64)
    return navigation.depth_sd_m * normals(key, (times * navigation.imu_rate_hz).astype(np.int64))


def misalignments(setup: Setup, streams: Streams) -> Floats:
    """Return the constant heading error of each ASV (rad), (m,); with passive ranging of each AUV
    (n,), whose compass and array rotate what it measures.
    """
    passive = setup.scenario.protocol.asvs_ping
    turned = headings(setup, streams) if passive else np.zeros(setup.scenario.asvs.count)
    sd = math.radians(setup.scenario.usbl.misalignment_sd_deg)
    if sd == 0.0:
        return turned
    drawn = [
        streams.of(Purpose.MISALIGNMENT, carrier).standard_normal()
        for carrier in range(len(turned))
    ]
    return np.asarray(turned + sd * np.array(drawn))


def turned_arrays(setup: Setup, streams: Streams) -> Floats:
    """Return the constant error (rad) of directions that AUVs measure by arrays of their own, (n,):
    of compass and array.
    """
    turned = headings(setup, streams)
    sd = math.radians(setup.scenario.usbl.misalignment_sd_deg)
    own = _drawn(streams, Purpose.PEER_ARRAY, [sd] * len(turned))[:, 0]
    return np.asarray(turned + own)


def clocks(setup: Setup, streams: Streams) -> Floats:
    """Return how late (s) each AUV's clock is at first, and its drift (s/s), (n, 2)."""
    navigation, count = setup.scenario.navigation, setup.scenario.auvs.count
    sds = np.array((navigation.clock_offset_sd_s, navigation.clock_drift_sd))
    if not sds.any():
        return np.zeros((count, 2))
    drawn = [streams.of(Purpose.CLOCK, auv).standard_normal(2) for auv in range(count)]
    return np.asarray(sds * np.array(drawn))


def systematic_errors_of(setup: Setup, streams: Streams) -> Systematic | None:
    """Return the systematic errors of USBL, or None without any.

    Fixes carry Jacobians of the errors that navigators estimate, so that covariances include these.
    """
    usbl, has_outliers = setup.scenario.usbl, setup.scenario.usbl.outlier_share > 0.0
    found = {kind.name: kind for kind in setup.taken.lasting_errors}
    if usbl.model.is_own or not (setup.lasting_errors or found or has_outliers):
        return None
    levels, variances = np.zeros(1, dtype=SYSTEMATIC), list[float]()
    known = levels[0]
    for name in ("misalignment", "gnss", "sound_speed", "clock", "slow"):
        known[f"{name}_at"] = NONE
    for kind in setup.estimated_errors:
        known[f"{kind.name}_at"] = len(variances)
        variances += [sd**2 for sd in kind.sds] * kind.times
    one, two = {name: kind.sds for name, kind in found.items()}, (0.0, 0.0)
    gnss = one.get("gnss", two)
    known["sd"] = (*one.get("misalignment", (0.0,)), *gnss, *gnss, *one.get("sound_speed", (0.0,)))
    known["clock_offset_sd_s"], known["clock_drift_sd"] = one.get("clock", two)
    if has_outliers:
        known["outliers_below"] = NormalDist().inv_cdf(usbl.outlier_share)
        known["outlier_sd_m"] = usbl.outlier_sd_m
    return Systematic(
        levels,
        np.array(variances),
        np.ascontiguousarray(misalignments(setup, streams)),
        slow_gnss(setup, streams),
        clocks(setup, streams),
    )


def lasting_errors(
    setup: Setup, systematic: Systematic | None, receptions: Rows, pings: Rows
) -> dict[str, Floats]:
    """Return the systematic errors of receptions that were heard, by their columns, (n,) each; NaN
    where there is none of a kind.  `pings` are all on record.
    """
    found = {name: np.full(len(receptions), np.nan) for name in LASTING_ERRORS}
    if systematic is None or not len(receptions):
        return found
    kinds, passive = {kind.name for kind in setup.lasting_errors}, setup.scenario.protocol.asvs_ping
    auv, asv, arrived = (receptions[name] for name in ("auv", "asv", "arrived_at_s"))
    sent_by = pings[receptions["ping"]]
    one_way, heard = np.isnan(sent_by["call_time_s"]), receptions["outcome"] == HEARD
    if "misalignment" in kinds:
        turned = systematic.misalignments[auv if passive else asv]
        found["misalignment_deg"][heard] = np.degrees(turned)[heard]
    if "gnss" in kinds:
        instants = (sent_by["sent_at_s"] if passive else arrived)[heard]
        off = systematic.gnss[asv[heard], (instants / CONTROL_S).astype(np.int64)]
        found["gnss_error_x_m"][heard], found["gnss_error_y_m"][heard] = off.T
    if "slow" in kinds:
        levels = packed(setup.usbls).levels[asv]
        fixed, way = levels["travel_time_sd_s"], receptions["travel_time_s"]
        sd = setup.usbl.sound_speed * np.hypot(fixed, levels["path_share"] * way)
        found["slow_range_error_m"][:] = np.where(
            one_way & heard, receptions["slow_range"] * sd, np.nan
        )
    if "clock" in kinds:
        late = systematic.clocks[auv]
        late = late[:, 0] + late[:, 1] * (arrived if passive else sent_by["sent_at_s"])
        found["clock_late_s"][:] = np.where(one_way & heard, late, np.nan)
    return found
