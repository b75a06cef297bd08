"""Metrics of a finished mission: of each AUV, of the worst AUV, and of the whole."""

import math
from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Floats
from ..acoustics.energy import Hf, Powers, covered, energy, on_hf, on_mf, on_sea, together
from ..protocol.network import Network
from ..records.events import (
    BY_OWN_PACKET,
    BY_PACKET,
    COLLIDED,
    DELIVERED,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    Packet,
)
from ..records.metrics import WORST_IS_LARGEST, AuvMetrics, Utilisation
from ..records.rows import NONE, Recorder, Rows, row_type
from ..results.schemas import never_null
from ..scenario.sections.acoustics import Band
from ..vehicles.motion import places
from .service import MOST, note_errors, note_gnss, note_service, quantile_of
from .trajectories import instants
from .world import World

Counts = dict[str, list[Any]]

# Metrics that no AUV of some missions has; then no AUV is the worst.
UNDEFINED = (
    *("latency_from_slot_s", "path_error_m", "saturated_share"),
    *("least_altitude_m", "lock_share"),
)
_LARGEST = np.array(list(WORST_IS_LARGEST.values()))[:, np.newaxis]

AUV_METRICS = row_type(AuvMetrics)
NAMES = AUV_METRICS.names or ()

# Metrics that every AUV has ("") or every AUV with some of another metric, by name
NUMBERS = {name: "" for name in NAMES if name in never_null("auvs")}
NUMBERS |= {"fix_error_rms_m": "fixes", "latency_mean_s": "fixes_delivered"}
PLACES = [NAMES.index(name) for name in NUMBERS]
# An AUV's metrics before they are worked out: defaults, else all bits set (NaN as a float, NONE as
# an integer)
UNKNOWN = np.full(1, NONE).repeat(len(NAMES)).view(AUV_METRICS)
for _metric in fields(AuvMetrics):
    if isinstance(_metric.default, int):
        UNKNOWN[_metric.name] = _metric.default

Energies = tuple[Floats, Floats] | None


def metrics_of(world: World) -> tuple[Rows, dict[str, float | None]]:
    """Return the metrics of every AUV, (n,) :data:`AUV_METRICS`, and those of the mission."""
    energies = modem_energies(world)
    auvs = auv_metrics(world, energies)
    return auvs, mission_metrics(auvs, utilisation(world, energies))


def auv_metrics(world: World, energies: Energies) -> Rows:
    """Return the metrics of every AUV, in index order; NaN means none."""
    scenario, count = world.setup.scenario, len(world.auv_fleet)
    begin = scenario.record.metrics_from_s
    times = instants(scenario.duration_s, scenario.record.metrics_hz, begin)
    metrics, errors = UNKNOWN.repeat(count), np.empty(len(times))
    metrics["auv"] = np.arange(count)
    look = heard_by_auvs if scenario.protocol.asvs_ping else heard_of_auvs
    for name, its_own in (look(world.record, count, begin) | world.trajectories.metrics).items():
        metrics[name] = its_own
    fixes, judged_s = _since(world.record.fixes.rows, begin), scenario.duration_s - begin
    note_service(metrics, fixes, judged_s, _slot(world))
    if scenario.navigation.gnss_fix is not None:
        note_gnss(metrics, fixes, _since(world.record.gnss_fixes.rows, begin), judged_s)
    for auv in range(count):
        _note_accuracy(metrics, world, auv, times, errors)
    every = world.record.fixes.rows  # of the whole mission, as energies are
    delivered = np.bincount(every["auv"][every["outcome"] == DELIVERED], minlength=count)
    metrics["energy_j"] = metrics["energy_per_fix_j"] = math.nan
    if energies is not None:
        metrics["energy_j"] = energies[0]
        np.divide(energies[0], delivered, out=metrics["energy_per_fix_j"], where=delivered > 0)
    metrics["slots_missed"] = _missed(world.record, count)
    _refuse_missing(metrics)
    return metrics


def _note_accuracy(metrics: Rows, world: World, auv: int, times: Floats, errors: Floats) -> None:
    """Write to the metrics of the fleet (n,) the errors of one AUV at instants (k,), s.

    `errors` (k,), m, gets its horizontal errors.

    Raises:
        ArithmeticError: naming the first instant at which its estimate is no number.
    """
    found, metric = world.sample(auv, times), metrics[auv : auv + 1]
    sure = world.navigator.covariance(auv, found.odometry)
    note_errors(metric, errors, found.way.lines, found.odometry.position, found.estimate, sure)
    if not np.isfinite(metric["position_error_m"][0]):
        lost_at = times[np.flatnonzero(~np.isfinite(errors))[0]]
        _refuse(auv, f"estimate is no number from {lost_at:g} s on")
    metric["position_error_p95_m"] = quantile_of(errors, MOST)


def _refuse(auv: int, trouble: str) -> NoReturn:
    """End the run: a NaN in a table would pass for a missing value, and be left out of means."""
    raise ArithmeticError(
        f"AUV{auv}'s {trouble}; this is a mistake of the program, not of the scenario: please "
        "report it with scenario and seed"
    )


def _refuse_missing(metrics: Rows) -> None:
    """Refuse metrics (n,) if one that every AUV should have is missing, naming it and the AUV: it
    is no number, or was not worked out.
    """
    numbers: Any = metrics.view(np.float64)
    if not np.isnan(numbers.reshape(len(metrics), -1)[:, PLACES]).any():
        return
    for name, made_of in NUMBERS.items():
        unknown: Any = metrics[name].view(np.float64)
        lost = np.isnan(unknown) & ((metrics[made_of] > 0) if made_of else True)
        if lost.any():
            _refuse(int(lost.argmax()), f"{name} is no number")


def _since(fixes: Rows, begin: float) -> Rows:
    """Return the fixes that were made or delivered from an instant (s) on, with times counted from
    it, so that an age begins there at the earliest.
    """
    if begin == 0.0:
        return fixes
    late = fixes[(fixes["pinged_at_s"] >= begin) | (fixes["delivered_at_s"] >= begin)].copy()
    for name in ("pinged_at_s", "broadcast_at_s", "delivered_at_s"):
        late[name] -= begin
    return late


def _slot(world: World) -> float:
    """Return the length of uplink slots (s); NaN where no fix waits for the end of one, or pings do
    not begin with them.
    """
    protocol, slots = world.setup.scenario.protocol, world.network.slots
    regular = world.setup.ranging.own_clocks and not world.setup.schedule.pace
    if regular and not protocol.replies and not protocol.random_access:
        return slots.clock.after(0.0, slots.uplink_slot)
    return math.nan


def _missed(record: Recorder, auvs: int) -> NDArray[np.int64]:
    """Return the number of slots that each AUV did not know as they began, (n,)."""
    owners = [assignment.auv for assignment in record.assignments if assignment.outcome == "missed"]
    return np.bincount(np.array(owners, dtype=np.int64), minlength=auvs)


def utilisation(world: World, energies: Energies) -> Utilisation:
    """Return the metrics that only the mission as a whole has."""
    record, duration = world.record, world.setup.scenario.duration_s
    ping, frames = world.network.slots.ping_duration, world.broadcasts
    swept, area = world.trajectories.covered_m2, world.setup.area
    drawn = None if energies is None else float(energies[0].sum() + energies[1].sum())
    delivered = int(np.sum(record.fixes.rows["outcome"] == DELIVERED))
    return Utilisation(
        rounds=len(record.rounds),
        collisions=len(destroyed(record)) + len(calls_destroyed(record)),
        frame_collisions=len(frames_destroyed(record)),
        hf_utilisation=_hf_in_use(record, ping, duration) / duration,
        mf_utilisation=_mf_in_use(frames, record, duration) / duration,
        energy_j=drawn,
        energy_per_fix_j=None if drawn is None or not delivered else drawn / delivered,
        duration_s=float(duration),
        area_covered_m2=swept,
        area_covered_share=None if swept is None else swept / area.square_m,
        survey_finished_at_s=world.trajectories.finished_at_s,
        **_service(world),
    )


def _service(world: World) -> dict[str, float | None]:
    """Return the network's metrics of fixes that were delivered."""
    scenario, begin = world.setup.scenario, world.setup.scenario.record.metrics_from_s
    fixes, lasts = _since(world.record.fixes.rows, begin), scenario.duration_s - begin
    delivered = fixes["outcome"] == DELIVERED
    latencies, auvs = fixes["latency_s"][delivered], fixes["auv"][delivered]
    each = np.bincount(auvs, minlength=len(world.auv_fleet)).astype(np.float64)
    throughput = 8.0 * scenario.acoustics.mf.fix_bytes * len(auvs) / lasts
    found = {"throughput_bps": throughput if scenario.protocol.sends_frames else None}
    if scenario.traffic is not None:
        found |= _carried(world.record.packets, len(world.auv_fleet), begin, lasts)
    if not len(auvs):
        return found
    median, most = np.quantile(latencies, (0.5, MOST)).tolist()
    return {
        **found, "fairness": _fairness(each), "fix_latency_p50_s": median, "fix_latency_p95_s": most
    }  # fmt: skip


def _fairness(each: Floats) -> float:
    """Return Jain's fairness index of AUVs, from 1 / n to 1 (Jain et al., DEC-TR-301)."""
    return float(each.sum() ** 2 / (each.size * (each**2).sum()))


def _carried(
    packets: Sequence[Packet], auvs: int, begin: float, lasts: float
) -> dict[str, float | None]:
    """Return the metrics of data that AUVs made from an instant (s) on, in a time (s)."""
    made = [packet for packet in packets if packet.made_at_s >= begin]
    delivered = [packet for packet in made if packet.latency_s is not None]
    bits = 8.0 * sum(packet.size_bytes for packet in delivered)
    found: dict[str, float | None] = {"goodput_bps": bits / lasts}
    if made:
        found["packet_delivery_ratio"] = len(delivered) / len(made)
    if delivered:
        late = [packet.latency_s for packet in delivered if packet.latency_s is not None]
        found["packet_latency_s"] = math.fsum(late) / len(late)
        each = np.bincount([packet.auv for packet in delivered], minlength=auvs).astype(float)
        found["packet_fairness"] = _fairness(each)
    return found


def modem_energies(world: World) -> Energies:
    """Return the energy (J) of the modems of the n AUVs and the m ASVs, (n,) and (m,); None if no
    band in use has powers.
    """
    scenario, record = world.setup.scenario, world.record
    bands, protocol, end = scenario.acoustics, scenario.protocol, scenario.duration_s
    fleets = world.auv_fleet, world.asv_fleet
    drawn: list[tuple[Floats, Floats]] = []
    failures = fleets[1].failures
    worked = end if failures is None else failures.worked_s(end)
    if (powers := _powers(bands.hf)) is not None:
        hf, sounds = bands.hf, world.network.uplink.sounds.rows
        if scenario.has_signals:
            on_air = on_sea(record, sounds, len(fleets[0]), len(fleets[1]), end)
        else:
            by_slant, speed = hf.range_metric == "slant", world.setup.sound_speed_m_per_s
            signals = Hf(hf.ping_s, hf.range_m, by_slant, speed, end)
            packets = sounds[np.isin(sounds["kind"], (BY_PACKET, BY_OWN_PACKET))]
            both = {"auv": fleets[0], "asv": fleets[1]}
            on_air = on_hf(record, protocol.pinging, both, signals, packets)
        of_both = energy(on_air["auv"], powers, end), energy(on_air["asv"], powers, worked)
        if isinstance(world.network, Network) and world.network.air is not None:
            spared = powers.sending * world.network.air.spared_s(end)
            of_both = of_both[0] - spared[: len(fleets[0])], of_both[1] - spared[len(fleets[0]) :]
        drawn.append(of_both)
    if protocol.sends_frames and (powers := _powers(bands.mf)) is not None:
        where = partial(places, fleets[0].motion), partial(places, fleets[1].motion)
        auvs, asvs = on_mf(
            record.frames, where, bands.mf.range_m, end, fleets[1].failed,
            bands.mf.range_metric == "slant",
        )  # fmt: skip
        drawn.append((energy(auvs, powers, end), energy(asvs, powers, worked)))
    if not drawn:
        return None
    of_auvs, of_asvs = zip(*drawn, strict=True)
    return np.sum(of_auvs, axis=0), np.sum(of_asvs, axis=0)


def _powers(band: Band) -> Powers | None:
    """Return the powers of a band's modem, None if they are not known."""
    if band.transmit_w is None:
        return None
    waiting = band.receive_w if band.idle_w is None else band.idle_w
    return Powers(band.transmit_w, band.receive_w, waiting)


def _hf_in_use(record: Recorder, ping: float, end: float) -> float:
    """Return the time (s) before `end` in which a signal is sent on HF; pings and calls last `ping`
    (s).
    """
    pings = record.pings.rows
    called = pings["call"] != NONE
    answered = ~called | (pings["call"] == HEARD)
    begun = np.sort(np.concatenate((pings["called_at_s"][called], pings["sent_at_s"][answered])))
    further = [(signal.sent_at_s, signal.lasts_s) for signal in record.signals]
    further += [(data.sent_at_s, data.airtime_s) for data in record.packets
                if data.sent_at_s is not None and data.airtime_s is not None]  # fmt: skip
    if not further:
        return covered(begun, ping, end)
    return _in_use(begun, np.full(len(begun), ping), further, end)


def _mf_in_use(frames: Rows, record: Recorder, end: float) -> float:
    """Return the time (s) before `end` in which an ASV or AUV sends a frame on MF."""
    begins, lasts = frames["sent_at_s"], frames["airtime_s"]
    if not record.auv_frames:
        return together(begins, lasts, end)
    further = [(frame.sent_at_s, frame.airtime_s) for frame in record.auv_frames]
    return _in_use(begins, lasts, further, end)


def _in_use(
    begins: Floats, lasts: Floats, further: Sequence[tuple[float, float]], end: float
) -> float:
    """Return the time (s) before `end` in which at least one of some signals is sent, and of
    `further` ones: when each begins and how long it lasts (s).
    """
    more = np.array(further)
    begins, lasts = np.concatenate((begins, more[:, 0])), np.concatenate((lasts, more[:, 1]))
    order = np.argsort(begins)
    return together(begins[order], lasts[order], end)


def mission_metrics(auvs: Rows, whole: Utilisation) -> dict[str, float | None]:
    """Return the fleet means of all AUV metrics (without AUVs that have no value), the mission's
    own metrics, and the worst AUV's with its number.
    """
    means: dict[str, float | None] = {}
    for name in NAMES[1:]:
        known = [value for value in auvs[name].tolist() if value == value]
        means[name] = math.fsum(known) / len(known) if known else None
    own = {column.name: getattr(whole, column.name) for column in fields(Utilisation)}
    return {**means, **own, **worst_of(auvs)}


def worst_of(auvs: Rows) -> dict[str, float | None]:
    """Return `worst_<metric>` of a fleet and `worst_<metric>_auv`, the number of that AUV.

    The worst value of errors, ages, intervals, latencies and losses is the largest, of coverage,
    fixes and rates the smallest (:class:`AuvMetrics` says which).  An AUV without a value, because
    it got no fix, is worse than any with one.  Among equals the first counts.

    `auvs` (n,) has the metrics of each, NaN for none.  A value is None where the worst AUV has
    none, both are where no AUV can have one.
    """
    names = list(WORST_IS_LARGEST)
    values = np.array([auvs[name] for name in names], dtype=np.float64)
    missing = np.isnan(values)
    badness = np.where(missing, np.inf, np.where(_LARGEST, values, -values))
    which: list[int] = badness.argmax(axis=1).tolist()
    none_has: list[bool] = np.logical_and.reduce(missing, axis=1).tolist()
    found: dict[str, float | None] = {}
    for name, its_own, auv, none in zip(names, values, which, none_has, strict=True):
        value = float(its_own[auv])
        found[f"worst_{name}"] = None if math.isnan(value) else value
        found[f"worst_{name}_auv"] = None if none and name in UNDEFINED else auv
    return found


def heard_of_auvs(record: Recorder, auvs: int, begin: float) -> Counts:
    """Return each AUV's metrics of its pings that were sent from an instant (s) on."""
    pings, receptions = record.pings.rows, record.receptions.rows
    landed = np.ones(len(pings), dtype=bool)
    outcome = receptions["outcome"].copy()  # rows are long: a copy is contiguous
    landed[receptions["ping"][outcome == IN_FLIGHT]] = False
    late, sender = pings["sent_at_s"] >= begin, pings["auv"]
    in_range, landed = late & (pings["in_range_of"] > 0), late & landed
    lost = np.flatnonzero(outcome == LOST)
    covered = _count(sender[landed & in_range], auvs)
    return {
        "pings": _count(sender[late], auvs),
        "pings_in_range": _count(sender[in_range], auvs),
        "pings_heard": _count(sender[late & (pings["heard_by"] > 0)], auvs),
        "hf_coverage": _shares(covered, _count(sender[landed], auvs)),
        "receptions_lost": _count(receptions["auv"][lost[late[receptions["ping"][lost]]]], auvs),
        "collisions": _count(
            np.append(destroyed(record, begin)["auv"], calls_destroyed(record, begin)["auv"]), auvs
        ),
        "frame_collisions": _count(frames_destroyed(record, begin)["auv"], auvs),
    }


def destroyed(record: Recorder, begin: float = 0.0) -> Rows:
    """Return the receptions of pings, sent from an instant (s) on, that another signal destroyed.

    A ping whose call was destroyed was never sent: its call counts, in :func:`calls_destroyed`.
    """
    rows = record.receptions.rows
    met = rows[rows["outcome"] == COLLIDED]
    met = met[~np.isnan(met["arrived_at_s"])]
    since: Rows = met[record.pings.rows["sent_at_s"][met["ping"]] >= begin]
    return since


def calls_destroyed(record: Recorder, begin: float = 0.0) -> Rows:
    """Return the pings whose call, sent from an instant (s) on, was destroyed at its AUV."""
    rows = record.pings.rows
    found: Rows = rows[(rows["call"] == COLLIDED) & (rows["sent_at_s"] >= begin)]
    return found


def frames_destroyed(record: Recorder, begin: float = 0.0) -> Rows:
    """Return the receptions of frames, from an instant (s) on, destroyed by another frame or the
    AUV's own ping.
    """
    rows = record.frame_receptions.rows
    found: Rows = rows[(rows["outcome"] == COLLIDED) & (rows["arrived_at_s"] >= begin)]
    return found


def heard_by_auvs(record: Recorder, auvs: int, begin: float) -> Counts:
    """Return each AUV's metrics of the pings of all ASVs (passive ranging) that were sent from an
    instant (s) on.
    """
    late = record.pings.rows["sent_at_s"] >= begin
    receptions, pings = record.receptions.rows, int(late.sum())
    receptions = receptions[late[receptions["ping"]]]
    listener, outcome = receptions["auv"], receptions["outcome"]
    in_range = _count(listener[outcome != OUT_OF_RANGE], auvs)
    under_way = _count(listener[outcome == IN_FLIGHT], auvs)
    covered = [near - late for near, late in zip(in_range, under_way, strict=True)]
    return {
        "pings": [pings] * auvs,
        "pings_in_range": in_range,
        "pings_heard": _count(listener[outcome == HEARD], auvs),
        "hf_coverage": _shares(covered, [pings - late for late in under_way]),
        "receptions_lost": _count(listener[outcome == LOST], auvs),
        "collisions": _count(destroyed(record, begin)["auv"], auvs),
        "frame_collisions": [0] * auvs,
    }


def _count(of: NDArray[np.int64], auvs: int) -> list[int]:
    counts: list[int] = np.bincount(of, minlength=auvs).tolist()
    return counts


def _shares(parts: list[int], wholes: list[int]) -> list[float | None]:
    return [part / whole if whole else None for part, whole in zip(parts, wholes, strict=True)]
