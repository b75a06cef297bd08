"""A mission as a report reads it: the result tables as plain arrays, vehicles by number.

With passive ranging a ping of an ASV is a chance of each AUV to be fixed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.results.columns import numpy_columns
from ...core.setup import Setup
from ...support.arrays import Floats, Ints

if TYPE_CHECKING:
    from ...core.results.effects import Advice
    from ...core.results.result import Result
    from ...core.scenario.scenario import Scenario


Columns = dict[str, NDArray[Any]]


def chances(
    auvs: int, fixes: Columns, pings: Columns, receptions: Columns
) -> tuple[Ints, Columns, Columns]:
    """Return the rows of chances that fixes are made of; the chances, as pings; and the receptions.

    There is a reception of each ping at each of so many AUVs, one after the other, and so a chance
    for each, in the same order.  It has the columns of its ping, but is that of the AUV.
    """
    ping, near = receptions["ping"], ~np.isin(receptions["outcome"], UNREACHED)
    rows = {name: column[ping] for name, column in pings.items()}
    rows |= {
        "auv": receptions["auv"],
        "in_range_of": near.astype(np.int64),
        "heard_by": (receptions["outcome"] == "heard").astype(np.int64),
    }
    own = np.arange(len(ping), dtype=np.int64)
    return fixes["ping"] * auvs + fixes["auv"], rows, {**receptions, "ping": own}


def depth_at(times: Floats, depths: Floats, receptions: Columns) -> Floats:
    """Return how deep (m) the AUV of each reception was as the ping arrived.

    `depths` (vehicles, instants), m, are those of all vehicles at the instants `times` (s).
    """
    depth = np.empty(len(receptions["ping"]))
    for auv in np.unique(receptions["auv"]):
        own = receptions["auv"] == auv
        depth[own] = np.interp(receptions["arrived_at_s"][own], times, depths[auv])
    return depth


TRUTH = ("x_m", "y_m", "z_m", "yaw_rad")
COVARIANCE = ("estimate_sd_x_m", "estimate_sd_y_m", "estimate_cov_xy_m2")
OWN = ("estimate_x_m", "estimate_y_m", *COVARIANCE, "imu_x_m", "imu_y_m", "position_error_m")

# Outcomes of what never came near: it was too far away, or land was between.
UNREACHED = ("out_of_range", "blocked")

# What can become of a ping, from the AUV's point of view; `fate` holds their numbers.
FATES = ("delivered", "out_of_hf", "lost", "collided", "out_of_mf", "in_flight")
DELIVERED, OUT_OF_HF, LOST, COLLIDED, OUT_OF_MF, IN_FLIGHT = range(len(FATES))


@dataclass(frozen=True)
class Metrics:
    """What a mission achieved: metrics of each AUV and of the mission, what would help,
    and what broke its schedule (empty if nothing did).
    """

    auvs: list[dict[str, Any]]
    mission: dict[str, Any]
    advice: "Advice | None"
    broken: str = ""


def metrics_of(result: "Result") -> Metrics:
    """Return the metrics of a mission, whatever was recorded of it."""
    mission = result.arrow["mission"].to_pylist()[0]
    broken = "" if result.violations is None else result.violations.text
    return Metrics(result.arrow["auvs"].to_pylist(), mission, result.advice, broken)


@dataclass(frozen=True)
class Recording:
    """What was recorded of a mission with `record.detail: full`.

    Tracks have the shape (vehicles, instants): `truth` of AUVs then ASVs by TRUTH, `own` of AUVs by
    OWN; `swept` (instants,) is what of the survey all have swept by then (m2), None if not known.
    Events are columns by their names in the tables, vehicles by number (-1: none).  `fate` says
    what became of each ping, `nearest` how far (m) the nearest ASV that works, as HF range counts,
    `metrics` what came of it all.

    `signals` are what came to a vehicle beside pings and broadcasts, a row for each of these, by
    number: AUVs come first; none where vehicles send nothing else.

    With passive ranging each AUV has a row of `pings` for each ping of an ASV, its own chance to be
    fixed; `receptions` count these rows.
    """

    setup: "Setup"
    times: Floats
    truth: dict[str, Floats]
    own: dict[str, Floats]
    swept: Floats | None
    pings: Columns
    receptions: Columns
    fixes: Columns
    broadcasts: Columns
    rounds: Columns
    signals: Columns
    fate: Ints
    nearest: Floats
    metrics: "Metrics"

    @property
    def scenario(self) -> "Scenario":
        """The scenario of the mission."""
        return self.setup.scenario

    @property
    def auvs(self) -> int:
        """Number of AUVs."""
        return self.scenario.auvs.count

    def covariance(self, auv: int) -> Floats:
        """Return how sure an AUV's filter is of its position: xx, yy, xy (n, 3), m2."""
        x, y, xy = (self.own[name][auv] for name in COVARIANCE)
        return np.column_stack((x**2, y**2, xy))

    def delivered_to(self, auv: int) -> Ints:
        """Return which rows of `fixes` reached an AUV, in the order in which they did."""
        fixes = self.fixes
        rows = np.flatnonzero((fixes["auv"] == auv) & (fixes["outcome"] == "delivered"))
        return rows[np.argsort(fixes["delivered_at_s"][rows], kind="stable")]


def recording(result: "Result") -> Recording:
    """Return a mission's tables as arrays.

    Raises:
        KeyError: when the result holds metrics only.
        ValueError: when its tracks are not those of its scenario.
    """
    scenario = result.scenario
    setup = result.setup
    tracks = numpy_columns(result.arrow["tracks"])
    vehicles = scenario.auvs.count + scenario.asvs.count
    rows = len(tracks["time_s"])
    if rows % vehicles:
        raise ValueError(f"tracks: {rows} rows do not belong to {vehicles} vehicles")

    def track(name: str) -> Floats:
        column: Floats = tracks[name].astype(np.float64)
        return column.reshape(vehicles, -1)

    pings, receptions = _events(result, "pings"), _events(result, "receptions")
    fixes, times = _events(result, "fixes"), track("time_s")[0]
    truth = {name: track(name) for name in TRUTH}
    of, depth = fixes["ping"], pings["z_m"]
    if scenario.protocol.asvs_ping:
        of, pings, receptions = chances(scenario.auvs.count, fixes, pings, receptions)
        depth = depth_at(times, truth["z_m"], receptions)
    return Recording(
        setup=setup,
        times=times,
        truth=truth,
        own={name: track(name)[: scenario.auvs.count] for name in OWN},
        swept=_swept(tracks.get("swept_m2"), scenario),
        pings=pings,
        receptions=receptions,
        fixes=fixes,
        broadcasts=_events(result, "broadcasts"),
        rounds=_events(result, "rounds"),
        signals=_signals(result),
        fate=_fates(len(pings["ping"]), receptions, fixes, of),
        nearest=_nearest(setup, depth, pings["sent_at_s"], receptions),
        metrics=metrics_of(result),
    )


def _swept(column: NDArray[Any] | None, scenario: "Scenario") -> Floats | None:
    """Return what all AUVs have swept by each instant (m2); None where that is not told."""
    if column is None:  # an older folder
        return None
    vehicles = scenario.auvs.count + scenario.asvs.count
    swept = column.astype(np.float64).reshape(vehicles, -1)[: scenario.auvs.count]
    return None if np.isnan(swept).all() else np.nansum(swept, axis=0)


def _events(result: "Result", name: str) -> Columns:
    columns = numpy_columns(result.arrow[name])
    for column in ("auv", "asv", "broadcast_by", "called_by"):
        if column in columns:
            columns[column] = np.array(
                [int(vehicle[3:]) if vehicle else -1 for vehicle in columns[column]], dtype=np.int64
            )
    return columns


def _signals(result: "Result") -> Columns:
    """Return which vehicle had what another sent beside pings and broadcasts, when (s), and what
    became of it there: signals, frames that AUVs forward to others or acknowledge to ASVs, and the
    data that came to an ASV.
    """
    parts = [*_sent(result, "signal", "sender"), *_sent(result, "auv_frame", "auv")]
    if "packets" in result.arrow:
        packets = numpy_columns(result.arrow["packets"])
        came = packets["outcome"] == "delivered"
        rows = {name: column[came] for name, column in packets.items()}
        heard, data = np.full(came.sum(), "heard"), np.full(came.sum(), "data")
        end = rows["delivered_at_s"].astype(np.float64)
        arrived = end - rows["airtime_s"].astype(np.float64)
        parts.append((data, rows["auv"], rows["delivered_to"], rows["sent_at_s"], arrived, heard))
    if not parts:
        return {}
    kind, sender, listener, sent, arrived, outcome = map(np.concatenate, zip(*parts, strict=True))
    auvs = result.scenario.auvs.count

    def vehicles(names: NDArray[Any]) -> Ints:
        return np.array([int(name[3:]) + auvs * name.startswith("ASV") for name in names], np.int64)

    return {
        "kind": kind,
        "sender": vehicles(sender),
        "listener": vehicles(listener),
        "sent_at_s": sent.astype(np.float64),
        "arrived_at_s": arrived.astype(np.float64),
        "outcome": outcome,
    }


# Who listens to frames of AUVs; all hear all signals.
LISTENING = {"relay": "AUV", "acknowledgement": "ASV"}


def _sent(result: "Result", one: str, sender: str) -> Iterator[tuple[NDArray[Any], ...]]:
    """Yield kinds, senders, listeners, instants (s) of sending and arrival, and outcomes of what
    came to whom it is for, by the table of each `one` sent and that of its receptions.
    """
    if f"{one}s" not in result.arrow:
        return
    sent, came = (numpy_columns(result.arrow[name]) for name in (f"{one}s", f"{one}_receptions"))
    own = ~np.isnan(came[one].astype(np.float64)) & ~np.isin(came["outcome"], UNREACHED)
    own &= ~np.isnan(came["arrived_at_s"].astype(np.float64))
    number = np.full(len(own), -1)
    number[own] = came[one][own].astype(np.int64)
    if one == "auv_frame":
        pairs = zip(came["listener"], sent["kind"][number], strict=True)
        own &= np.array([who.startswith(LISTENING[kind]) for who, kind in pairs], dtype=np.bool_)
    rows = {name: sent[name][number[own]] for name in ("kind", sender, "sent_at_s")}
    yield (
        rows["kind"], rows[sender], came["listener"][own], rows["sent_at_s"],
        came["arrived_at_s"][own], came["outcome"][own],
    )  # fmt: skip


def _fates(pings: int, receptions: Columns, fixes: Columns, of: Ints) -> Ints:
    """Return what became of each of so many pings; what happened later in its life counts.

    `of` are the rows of the pings that fixes are made of.
    """
    fate = np.full(pings, OUT_OF_HF, dtype=np.int64)
    for outcome, code in (("in_flight", IN_FLIGHT), ("lost", LOST), ("collided", COLLIDED)):
        fate[receptions["ping"][receptions["outcome"] == outcome]] = code
    codes = {
        "in_flight": IN_FLIGHT,
        "out_of_range": OUT_OF_MF,
        "blocked": OUT_OF_MF,
        "lost": OUT_OF_MF,
        "collided": OUT_OF_MF,
        "delivered": DELIVERED,
    }
    for outcome, code in codes.items():
        fate[of[fixes["outcome"] == outcome]] = code
    return fate


def works(setup: Setup, asvs: Ints, times: Floats) -> NDArray[np.bool_]:
    """Return whether ASVs work at instants (s), by their numbers; both broadcast."""
    failures = setup.failures
    if failures is None:
        return np.ones(np.broadcast_shapes(asvs.shape, times.shape), dtype=np.bool_)
    return ~failures.met(asvs, times, times)[0]


def _nearest(setup: Setup, depth: Floats, sent: Floats, receptions: Columns) -> Floats:
    """Return each ping's distance (m) to the nearest ASV that works, slant or horizontal as for the
    range; infinite if none does.

    `depth` (pings,), m, is that of the AUV, `sent` the instants (s) of the pings.
    """
    away = receptions["slant_range_m"].astype(np.float64)
    if setup.scenario.acoustics.hf.range_metric == "horizontal":  # ASVs float at the surface
        away = np.sqrt(np.maximum(away**2 - depth[receptions["ping"]] ** 2, 0.0))
    nearest = np.full(len(depth), np.inf)
    away[~works(setup, receptions["asv"], sent[receptions["ping"]])] = np.inf
    np.minimum.at(nearest, receptions["ping"], away)
    return nearest
