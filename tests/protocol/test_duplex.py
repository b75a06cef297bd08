"""Vehicles that send on one band and hear the other meanwhile, or do not."""

from typing import Any

import numpy as np
import pytest
from commands_for_tests import explained
from worlds import scenario

from bindusbl_des import Result, simulate


def flown(duplex: str, **protocol: Any) -> Result:
    """Return a mission of three AUVs that hold near two ASVs, frames of which they ping in."""
    return simulate(
        scenario(
            duration_s=12.0, survey={"side_m": 60.0},
            auvs={"count": 3, "route": {
                "kind": "hold", "positions_m": [[0.0, 0.0], [9.0, 4.0], [-12.0, 6.0]],
            }},
            asvs={"count": 2}, acoustics={"loss": {"law": "none"}},
            protocol={"downlink": "pipelined_round", "duplex": duplex, **protocol},
        ),
        1,
    )  # fmt: skip


def meetings(result: Result, listening: str, pinging: str) -> Any:
    """Return the rows of frames at AUVs, or of pings at ASVs, whose listener sends meanwhile."""
    frames, pings = result.tables["broadcasts"], result.tables["pings"]
    if listening == "auv":
        table = result.tables["frame_receptions"]
        lasts = frames.airtime_s.to_numpy()[table.broadcast]
        sounds = [(it.auv, it.sent_at_s, it.sent_at_s + 0.01) for it in pings.itertuples()]
    else:
        table = result.tables["receptions"]
        lasts = np.full(len(table), 0.01)
        sounds = [(it.asv, it.sent_at_s, it.sent_at_s + it.airtime_s) for it in frames.itertuples()]
    begins = table.arrived_at_s.to_numpy()
    met = np.zeros(len(table), dtype=bool)
    for who, begin, end in sounds:
        met |= (table[listening] == who) & (begins < end) & (begins + lasts > begin)
    return table[met & ~table.outcome.isin(("in_flight", "out_of_range"))]


@pytest.mark.parametrize(("listening", "pinging"), [("auv", "asv"), ("asv", "auv")])
def test_who_sends_on_one_band_is_deaf_on_the_other(listening: str, pinging: str) -> None:
    """With `per_node` alone; all else is heard, and told by the same rule from the tables."""
    band, node = flown("per_band"), flown("per_node")
    assert set(meetings(band, listening, pinging).outcome) == {"heard"}
    assert set(meetings(node, listening, pinging).outcome) == {"collided"}
    name = "frame_receptions" if listening == "auv" else "receptions"
    table = node.tables[name]
    others = table.drop(meetings(node, listening, pinging).index)
    assert set(others.outcome) <= {"heard", "in_flight", "out_of_range"}


def test_it_is_told_why_a_fix_or_a_ping_was_not_heard() -> None:
    result = flown("per_node")
    fixes, receptions = result.tables["fixes"], result.tables["receptions"]
    fix = fixes[fixes.outcome == "collided"].iloc[0]
    assert "its own ping at" in explained(result, fix=int(fix.fix))
    ping = receptions[receptions.outcome == "collided"].iloc[0].ping
    assert "it sends a frame from" in explained(result, ping=int(ping))


def test_sequential_rounds_let_nobody_ping_while_a_frame_arrives() -> None:
    band, node = (flown(it, downlink="sequential") for it in ("per_band", "per_node"))
    for name, table in band.tables.items():
        assert table.equals(node.tables[name])


def test_answers_are_no_frames() -> None:
    """Where ASVs answer pings directly there is nothing on MF to be deaf to."""
    one, other = (
        flown("per_band", downlink="direct_reply"),
        flown("per_node", downlink="direct_reply"),
    )
    assert len(one.tables["fixes"])
    assert one.tables["fixes"].equals(other.tables["fixes"])
