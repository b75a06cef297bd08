"""Metrics of a mission worked out again from its tables, in pandas."""

from typing import Any

import numpy as np
import pandas as pd

from bindusbl_des import Result
from bindusbl_des.core.records.metrics import WORST_IS_LARGEST

Metrics = dict[str, float]


def agree(result: Result) -> None:
    """The tables auvs and mission are what the tables of events come to."""
    found = {auv: _of_auv(result, auv) for auv in result.auvs.auv}
    for row in result.auvs.to_dict("records"):
        # What is small of an estimate a million metres off is a difference of large numbers.
        rounding = max(1e-9, 1e-15 * row["position_error_max_m"])
        for name, value in found[row["auv"]].items():
            assert np.isclose(row[name], value, rtol=1e-9, atol=rounding, equal_nan=True), (
                row["auv"], name, row[name], value,
            )  # fmt: skip
    mission = result.mission.iloc[0]
    for name, value in _of_mission(result).items():
        same = np.isclose(_number(mission[name]), value, rtol=1e-9, atol=1e-9, equal_nan=True)
        assert same, (name, mission[name], value)
    _worst(result)


def _number(value: Any) -> float:
    return float("nan") if pd.isna(value) else float(value)


def _of_auv(result: Result, auv: str) -> Metrics:
    tables, record = result.tables, result.scenario.record
    begin, end = record.metrics_from_s, result.scenario.duration_s
    fixes = tables["fixes"][lambda it: it.auv == auv]
    fixes = fixes[(fixes.pinged_at_s >= begin) | (fixes.delivered_at_s >= begin)]
    done = fixes[fixes.outcome == "delivered"]
    taken = done[done.correction_m.notna()].sort_values("delivered_at_s", kind="stable")
    between = np.diff(np.sort(done.delivered_at_s))
    ages = _ages(taken.delivered_at_s - begin, taken.pinged_at_s - begin, end - begin)
    found = {
        **_signals(result, auv, begin),
        "fixes": len(fixes),
        "fixes_delivered": len(done),
        "fixes_out_of_range": (fixes.outcome == "out_of_range").sum(),
        "fixes_lost": fixes.outcome.isin(("lost", "collided")).sum(),
        "fixes_in_flight": (fixes.outcome == "in_flight").sum(),
        "fixes_refused": len(done) - len(taken),
        "fix_rate_hz": len(done) / (end - begin),
        "fix_error_rms_m": _mean(fixes.error_m**2) ** 0.5,
        "latency_mean_s": _mean(done.latency_s),
        "latency_p95_s": _most(done.latency_s),
        "latency_max_s": done.latency_s.max(),
        "nis": _mean(done.nis.dropna()),
        "interval_mean_s": _mean(between),
        "interval_p95_s": _most(between),
        "interval_max_s": between.max() if len(between) else np.nan,
    }
    if result.scenario.navigation.gnss_fix is None:  # fixes at the surface have no rows
        found |= dict(zip(("fix_age_mean_s", "fix_age_p95_s", "fix_age_max_s"), ages, strict=True))
    if result.scenario.protocol.ranging != "passive":
        found["latency_from_broadcast_s"] = _mean(done.delivered_at_s - done.broadcast_at_s)
    if begin == 0.0 and record.tracks_hz == record.metrics_hz:
        found |= _accuracy(tables["tracks"][lambda it: it.vehicle == auv])
    row = result.auvs[lambda it: it.auv == auv].iloc[0]
    each = row.energy_j / len(done) if len(done) else np.nan
    return {**found, "energy_per_fix_j": each, "fix_benefit_m": row.imu_error_m
            - row.position_error_m}  # fmt: skip


def _signals(result: Result, auv: str, begin: float) -> Metrics:
    """What became of the pings of an AUV (passive: of all, at the AUV), and of frames there."""
    tables = result.tables
    pings = tables["pings"][lambda it: it.sent_at_s >= begin]
    rows = tables["receptions"][lambda it: it.auv == auv]
    rows = rows[rows.ping.isin(pings.ping)]
    frames = tables["frame_receptions"][lambda it: (it.auv == auv) & (it.arrived_at_s >= begin)]
    under_way = set(rows[rows.outcome == "in_flight"].ping)
    if result.scenario.protocol.ranging == "passive":
        reached = set(rows[rows.outcome != "out_of_range"].ping)
        heard = set(rows[rows.outcome == "heard"].ping)
    else:
        pings = pings[pings.auv == auv]
        reached, heard = (set(pings[pings[of] > 0].ping) for of in ("in_range_of", "heard_by"))
    landed = set(pings.ping) - under_way
    met = ((rows.outcome == "collided") & rows.arrived_at_s.notna()).sum()
    return {
        "pings": len(pings),
        "pings_in_range": len(reached),
        "pings_heard": len(heard),
        "hf_coverage": len(landed & reached) / len(landed) if landed else np.nan,
        "receptions_lost": (rows.outcome == "lost").sum(),
        "collisions": met + (pings.call == "collided").sum(),
        "frame_collisions": (frames.outcome == "collided").sum(),
        "slots_missed": (tables["assignments"][lambda it: it.auv == auv].outcome == "missed").sum(),
    }


def _ages(taken: Any, pinged: Any, end: float) -> tuple[float, float, float]:
    """Mean, 95 % quantile and maximum over time of the time since the newest ping (s)."""
    at = np.concatenate(([0.0], taken, [end]))
    newest = np.maximum.accumulate(np.concatenate(([0.0], pinged)))
    young, old = at[:-1] - newest, at[1:] - newest
    mean = ((old**2 - young**2) / 2).sum() / end
    low, high = 0.0, old.max()
    for _ in range(200):  # the age that is exceeded for 5 % of the time
        age = (low + high) / 2
        exceeded = np.maximum(old - np.maximum(young, age), 0.0).sum()
        low, high = (age, high) if exceeded > 0.05 * end else (low, age)
    return mean, high, old.max()


def _accuracy(track: pd.DataFrame) -> Metrics:
    x, y = track.estimate_x_m - track.x_m, track.estimate_y_m - track.y_m
    error = np.hypot(x, y)
    across = np.cos(track.yaw_rad) * y - np.sin(track.yaw_rad) * x
    return {
        "position_error_m": error.mean(),
        "position_error_rms_m": (error**2).mean() ** 0.5,
        "position_error_p95_m": _most(error),
        "position_error_max_m": error.max(),
        "cross_track_error_m": across.abs().mean(),
        "imu_error_m": np.hypot(track.imu_x_m - track.x_m, track.imu_y_m - track.y_m).mean(),
    }


def _of_mission(result: Result) -> Metrics:
    auvs, tables, scenario = result.auvs, result.tables, result.scenario
    begin, end = scenario.record.metrics_from_s, scenario.duration_s
    pings, frames, fixes = tables["pings"], tables["broadcasts"], tables["fixes"]
    fixes = fixes[(fixes.pinged_at_s >= begin) | (fixes.delivered_at_s >= begin)]
    done = fixes[fixes.outcome == "delivered"]
    each = done.groupby("auv").size().reindex(auvs.auv, fill_value=0)
    own = [name for name in auvs.columns[1:] if name not in (
        "collisions", "frame_collisions", "energy_j", "energy_per_fix_j")]  # fmt: skip
    found = {name: auvs[name].astype(float).mean() for name in own}
    sent = pings[pings.call.isna() | (pings.call == "heard")].sent_at_s
    begun = np.concatenate((sent, pings.called_at_s.dropna()))
    over = begun + scenario.acoustics.hf.ping_s
    if "signals" in tables:  # what programs of access sent beside pings
        signals = tables["signals"]
        begun = np.append(begun, signals.sent_at_s)
        over = np.append(over, signals.sent_at_s + signals.lasts_s)
    if "packets" in tables:  # data of AUVs
        sent = tables["packets"].dropna(subset="sent_at_s")
        begun = np.append(begun, sent.sent_at_s)
        over = np.append(over, sent.sent_at_s + sent.airtime_s)
    on_mf = frames[["sent_at_s", "airtime_s"]]
    if "auv_frames" in tables:
        on_mf = pd.concat((on_mf, tables["auv_frames"][["sent_at_s", "airtime_s"]]))
    met = tables["receptions"][lambda it: (it.outcome == "collided") & it.arrived_at_s.notna()]
    destroyed = (tables["frame_receptions"].outcome == "collided").sum()
    return found | {
        "rounds": len(tables["rounds"]),
        "collisions": len(met) + (pings.call == "collided").sum(),
        "frame_collisions": destroyed,
        "hf_utilisation": _covered(begun, over, end) / end,
        "mf_utilisation": _covered(on_mf.sent_at_s, on_mf.sent_at_s + on_mf.airtime_s, end) / end,
        "fix_latency_p50_s": done.latency_s.median(),
        "fix_latency_p95_s": _most(done.latency_s),
        "fairness": each.sum() ** 2 / (len(each) * (each**2).sum()) if len(done) else np.nan,
        "duration_s": end,
    }


def _covered(begins: Any, ends: Any, end: float) -> float:
    """Return how long some of the intervals last together, up to an instant."""
    total, until = 0.0, 0.0
    for first, last in sorted(zip(begins, ends, strict=True)):
        total += max(min(last, end) - max(first, until), 0.0)
        until = max(until, min(last, end))
    return total


def _worst(result: Result) -> None:
    """Whoever lacks a value is the worst; else whoever has the most, or least, and first."""
    mission = result.mission.iloc[0]
    for name, largest in WORST_IS_LARGEST.items():
        values, whose = result.auvs[name].astype(float), mission[f"worst_{name}_auv"]
        if values.isna().any():
            assert pd.isna(mission[f"worst_{name}"]), name
            continue
        value = values.max() if largest else values.min()
        assert mission[f"worst_{name}"] == value, name
        assert whose == f"AUV{int(np.argmax(values == value))}", name


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else np.nan


def _most(values: Any) -> float:
    return float(np.quantile(values, 0.95)) if len(values) else np.nan
