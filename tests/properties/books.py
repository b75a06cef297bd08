"""What holds of the tables of every mission: causes before effects, and nothing lost of the books.

Each function takes a mission whose record is full, and asserts; nothing here knows the simulator,
but for the meaning of the tables' columns.
"""

from typing import Any

import numpy as np
import pandas as pd

from bindusbl_des import Result

# Rounding of instants, as the simulator has it (s)
TOUCH = 1e-9

# What a scenario may have sound in water be (m/s)
SLOWEST_SOUND, FASTEST_SOUND = 1300.0, 1700.0


def finite(result: Result) -> None:
    """No number is NaN or infinite: what is not known is null."""
    for name, table in result.arrow.items():
        for column in table.column_names:
            if str(table[column].type) == "double":
                values = table[column].drop_null().to_numpy()
                assert np.isfinite(values).all(), f"{name}.{column}"


def causal(result: Result) -> None:
    """Nothing is received before it was sent and has travelled, told before it was known, or
    happens after the end.
    """
    tables, end = result.tables, result.scenario.duration_s
    pings, receptions, fixes = tables["pings"], tables["receptions"], tables["fixes"]
    lasts = result.scenario.acoustics.hf.ping_s
    for name, column in (("rounds", "started_at_s"), ("pings", "sent_at_s"),
                         ("broadcasts", "sent_at_s"), ("fixes", "delivered_at_s")):  # fmt: skip
        at = tables[name][column].dropna()
        assert (at >= 0.0).all(), (name, column)
        assert (at <= end).all(), (name, column)
    assert pings.sent_at_s.is_monotonic_increasing
    both = receptions.merge(pings[["ping", "sent_at_s", "called_at_s"]], on="ping")
    both = both[both.arrived_at_s.notna()]
    under_way = both.arrived_at_s - both.sent_at_s
    assert (under_way >= both.slant_range_m / FASTEST_SOUND - TOUCH).all()
    assert np.allclose(under_way, both.travel_time_s, rtol=1e-9, atol=1e-6)
    called = both[both.called_at_s.notna()]
    assert (called.sent_at_s >= called.called_at_s).all()
    heard = receptions[receptions.outcome == "heard"]
    assert (heard.arrived_at_s + lasts <= end + TOUCH).all()
    if result.scenario.protocol.answer.reply_at == "ping_front":
        lasts = 0.0
    first = (heard.groupby("ping").arrived_at_s.min() + lasts).reindex(fixes.ping)
    told = fixes.broadcast_at_s.fillna(fixes.delivered_at_s).to_numpy()
    assert not (told < first.to_numpy() - TOUCH - 1.0 / _ticks(result)).any()
    delivered = fixes[fixes.outcome == "delivered"]
    assert (delivered.delivered_at_s >= delivered.broadcast_at_s.fillna(0.0)).all()
    assert np.allclose(delivered.latency_s, delivered.delivered_at_s - delivered.pinged_at_s)
    assert (delivered.pinged_at_s <= delivered.delivered_at_s).all()
    frames = tables["frame_receptions"]
    sent = tables["broadcasts"].sent_at_s.to_numpy()[frames.broadcast.to_numpy(dtype=int)]
    assert not (frames.arrived_at_s < sent).any()


def _ticks(result: Result) -> float:
    """Return how many ticks a second has: instants are rounded to these."""
    return float(result.scenario.protocol.tick_rate_hz or 1e12)


def conserved(result: Result) -> None:
    """Each ping has one row at each receiver, each frame too, each fix one end; and sums agree."""
    tables, scenario = result.tables, result.scenario
    pings, receptions, fixes = tables["pings"], tables["receptions"], tables["fixes"]
    passive = scenario.protocol.ranging == "passive"
    receivers = scenario.auvs.count if passive else scenario.asvs.count
    assert (pings.ping.to_numpy() == np.arange(len(pings))).all()
    assert len(receptions) == len(pings) * receivers
    assert not receptions.duplicated(["ping", "auv" if passive else "asv"]).any()
    assert set(receptions.outcome) <= {"heard", "out_of_range", "lost", "collided", "in_flight"}
    ends = receptions.groupby(["ping", "outcome"]).size().unstack(fill_value=0)
    ends = ends.reindex(pings.ping, fill_value=0)
    assert (ends.sum(axis=1) == receivers).all()
    assert (ends.get("heard", 0) == pings.heard_by.to_numpy()).all()
    away = ends.get("out_of_range", 0)
    assert (pings.in_range_of.to_numpy() <= receivers).all()
    if not scenario.asvs.failures:  # without a ping, an outcome is its call's
        same = receivers - away == pings.in_range_of.to_numpy()
        assert (same | (pings.call == "out_of_range").to_numpy()).all()
    frames, protocol = tables["frame_receptions"], scenario.protocol
    is_frame = protocol.replies_in_frames or not protocol.replies  # instant replies are none
    assert len(frames) == is_frame * len(tables["broadcasts"]) * scenario.auvs.count
    assert not frames.duplicated(["broadcast", "auv"]).any()
    assert fixes.fix.is_unique
    assert set(fixes.outcome) <= {"delivered", "out_of_range", "lost", "collided", "in_flight"}
    assert (fixes.delivered_at_s.notna() == (fixes.outcome == "delivered")).all()
    heard = receptions[receptions.outcome == "heard"]
    under_way = set(receptions[receptions.outcome == "in_flight"].ping)
    assert set(fixes.ping) <= set(heard.ping)
    assert set(heard.ping) - under_way <= set(fixes.ping)
    if passive:
        assert not fixes.duplicated(["ping", "auv"]).any()
    else:
        assert fixes.ping.is_unique or scenario.protocol.downlink == "direct_reply"
        assert tables["broadcasts"].fixes.sum() == _broadcast(fixes)


def _broadcast(fixes: pd.DataFrame) -> int:
    return int((fixes.broadcast_at_s.notna() & fixes.broadcast_by.notna()).sum())


def alone_on_a_band(result: Result) -> None:
    """No vehicle sends a signal before its last one on the same band is over."""
    pings, broadcasts = result.tables["pings"], result.tables["broadcasts"]
    lasts = result.scenario.acoustics.hf.ping_s
    sent = pings[pings.call.isna() | (pings.call == "heard")]
    for owner in ("auv", "asv"):
        for _, own in sent.groupby(owner):
            apart = np.diff(np.sort(own.sent_at_s.to_numpy()))
            assert (apart >= lasts - TOUCH).all(), owner
    for _, own in broadcasts.groupby("asv"):
        own = own.sort_values("sent_at_s", kind="stable")
        over = (own.sent_at_s + own.airtime_s).to_numpy()[:-1]
        assert (own.sent_at_s.to_numpy()[1:] >= over - TOUCH).all()


def collide_by_overlap(result: Result) -> None:
    """Where sound reaches as far as the range and no farther, signals are destroyed where they
    overlap at a receiver, and nowhere else.
    """
    bands, protocol, tables = result.scenario.acoustics, result.scenario.protocol, result.tables
    if protocol.duplex == "per_node":
        return
    # an ASV hears no ping while it calls or replies, and other signals and data destroy some
    sends = protocol.replies_in_frames or tables["pings"].call.notna().any()
    sends |= not {"signals", "packets"}.isdisjoint(tables)
    if bands.hf.channel == "disc":
        receiver = "auv" if protocol.ranging == "passive" else "asv"
        at = tables["receptions"][lambda it: it.arrived_at_s.notna()]
        at = at[at.outcome != "out_of_range"]
        lasts = bands.hf.ping_s
        for _, own in at.groupby(receiver):
            begins = own.arrived_at_s.to_numpy()
            _judge(own.outcome, begins, begins + lasts, 2 * TOUCH, also_else=bool(sends))
    if bands.mf.channel == "disc":
        frames = tables["frame_receptions"]
        airtime = tables["broadcasts"].airtime_s.to_numpy()
        frames = frames.assign(airtime=airtime[frames.broadcast.to_numpy(dtype=int)])
        frames = frames[frames.arrived_at_s.notna() & (frames.airtime > 0.0)]
        frames = frames[frames.outcome != "out_of_range"]
        speed = _fastest(tables["tracks"])
        for _, own in frames.groupby("auv"):
            begins = own.arrived_at_s.to_numpy()
            slack = 2 * speed * own.airtime.max() / SLOWEST_SOUND + 2 * TOUCH
            ends = begins + own.airtime.to_numpy()
            _judge(own.outcome, begins, ends, slack, also_else="auv_frames" in tables)


# What may have decided of a signal with each outcome
REASONS = {
    "heard": {None}, "in_flight": {None}, "out_of_range": {"out_of_range", "failed"},
    "lost": {"chance", "burst", "failed", "failed_meanwhile", "doppler"},
    "collided": {
        "ping", "echo", "call", "frame", "own_frame", "own_ping", "signal", "own_signal",
        "packet", "own_packet", "auv_frame",
    },
}  # fmt: skip


def told_why(result: Result) -> None:
    """A reason fits its outcome, and what is said to have overlapped a signal was there with it."""
    tables, protocol = result.tables, result.scenario.protocol
    for name in ("receptions", "frame_receptions"):
        told = tables[name][["outcome", "why"]].astype(object)
        for outcome, why in told.where(told.notna(), None).itertuples(index=False):
            unanswered = why == "unanswered" and outcome != "heard"
            assert unanswered or why in REASONS[outcome], (name, outcome, why)
    here, met = "auv" if protocol.ranging == "passive" else "asv", tables["receptions"]
    arrived = met.set_index([here, "ping"]).arrived_at_s.to_dict()
    for row in met[met.why == "ping"].itertuples():
        apart = arrived[getattr(row, here), int(row.overlapped_by)] - row.arrived_at_s
        assert row.overlapped_by != row.ping
        assert abs(apart) < result.scenario.acoustics.hf.ping_s + TOUCH
    frames, sent = tables["frame_receptions"], tables["broadcasts"]
    begun = frames.set_index(["auv", "broadcast"]).arrived_at_s.to_dict()
    for row in frames[frames.why == "frame"].itertuples():
        by = int(row.overlapped_by)
        apart = begun[row.auv, by] - row.arrived_at_s
        earlier = by if apart < 0.0 else int(row.broadcast)
        slack = 2 * _fastest(tables["tracks"]) * sent.airtime_s.max() / SLOWEST_SOUND + 2 * TOUCH
        assert abs(apart) < sent.airtime_s[earlier] + slack


def _fastest(tracks: pd.DataFrame) -> float:
    """Return how fast any vehicle has gone between two points of its track (m/s)."""
    fastest = 0.0
    for _, own in tracks.groupby("vehicle"):
        way = np.hypot(own.x_m.diff(), own.y_m.diff()) / own.time_s.diff()
        fastest = max(fastest, float(np.nan_to_num(way.max())))
    return 2.0 * fastest + 1.0


def _judge(outcomes: pd.Series, begins: Any, ends: Any, slack: float, also_else: bool) -> None:
    """Signals at one receiver (n,): outcomes must be those of the overlaps, but within `slack`."""
    n = len(outcomes)
    meet = (begins[:, None] < ends - slack) & (ends[:, None] > begins + slack)
    near = (begins[:, None] < ends + slack) & (ends[:, None] > begins - slack)
    np.fill_diagonal(meet, False)
    np.fill_diagonal(near, False)
    destroyed = (outcomes == "collided").to_numpy()
    decided = outcomes.isin(("heard", "lost", "collided")).to_numpy()
    survived = decided & (outcomes == "heard").to_numpy()
    assert not (survived & meet.any(axis=1)).any(), n
    assert also_else or not (destroyed & ~near.any(axis=1)).any(), n
