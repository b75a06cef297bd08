"""Frames at AUVs: what becomes of each at each of them, by hand."""

from typing import Any

import numpy as np
import pytest
from played_for_tests import at, moving, played
from worlds import scenario

from bindusbl_des import Result, simulate


def outcomes(result: Result, auvs: int = 2) -> list[list[str]]:
    """Return the outcomes of each frame, AUV after AUV."""
    table = result.tables["frame_receptions"].sort_values(["broadcast", "auv"])
    return np.asarray(table.outcome).reshape(-1, auvs).tolist()


def test_two_frames_meet_at_one_auv_and_not_at_the_other() -> None:
    """ASVs 600 m apart, AUVs beside them: ASV1 begins 0.5 s after ASV0, whose frame takes 0.8 s.

    At AUV0, 0 m and 600 m away, they are from 0 to 0.8 s and from 0.9 s on; at AUV1 from 0.4 to
    1.2 s and from 0.5 s on.
    """
    world = played(
        [at(0.0), at(600.0)], [at(0.0), at(600.0)], pings=[(0.0, 0), (2.0, 0)],
        frames=[(2.0, 0), (2.5, 1)], airtime=0.8, hf_range=1.0,
        acoustics={"mf": {"range_m": 700.0}},
    )  # fmt: skip
    result = simulate(world)
    assert outcomes(result) == [["heard", "collided"], ["heard", "collided"]]
    table = result.tables["frame_receptions"]
    assert table.arrived_at_s.to_numpy() == pytest.approx([2.0, 2.4, 2.9, 2.5], abs=1e-12)
    assert table.broadcast.tolist() == [0, 0, 1, 1]
    fixes = result.tables["fixes"]
    assert fixes.outcome.tolist() == ["delivered", "delivered"]
    assert fixes.delivered_at_s.to_numpy() == pytest.approx([2.8, 3.7], abs=1e-12)


def test_a_fix_of_a_frame_that_collided_is_lost() -> None:
    """At AUV1 the frames of both ASVs overlap: neither its fix nor the other arrives."""
    world = played(
        [at(0.0), at(600.0)], [at(0.0), at(600.0)], pings=[(0.0, 1), (2.0, 1)],
        frames=[(2.0, 0), (2.5, 1)], airtime=0.8, hf_range=1.0,
        acoustics={"mf": {"range_m": 700.0}},
    )  # fmt: skip
    fixes = simulate(world).tables["fixes"]
    assert fixes.outcome.tolist() == ["collided", "collided"]
    assert fixes.delivered_at_s.isna().all()


def test_touching_is_no_overlap() -> None:
    """A frame that begins at an AUV as another ends there leaves that whole; a little sooner not.

    From 300 m away it is on its way for 0.2 s; headers alone take a third of 1.5 s.
    """
    for begins, found in ((1.3, "heard"), (1.3 - 1e-6, "collided")):
        world = played([at(0.0)], [at(0.0), at(300.0)], frames=[(1.0, 0), (begins, 1)], airtime=1.5)
        assert outcomes(simulate(world), 1) == [[found], [found]]


def test_a_short_frame_meets_a_long_one_that_began_before_others() -> None:
    """The search goes back past a frame that was over before, to one that is not."""
    world = played(
        [at(0.0)], [at(0.0), at(1.0), at(2.0)], pings=[(0.1 * k, 0) for k in range(9)],
        frames=[(1.0, 0), (1.5, 1), (3.0, 2), (5.0, 1)], airtime=0.5,
    )  # fmt: skip
    result = simulate(world)
    broadcasts = result.tables["broadcasts"]
    assert broadcasts.fixes.tolist() == [9, 0, 0, 0]
    assert broadcasts.airtime_s.to_numpy() == pytest.approx([19 / 6, *[1 / 6] * 3])
    assert outcomes(result, 1) == [["collided"]] * 3 + [["heard"]]


def test_what_is_out_of_range_drowns_nobody() -> None:
    """The disc has no sound beyond its reach; nor has a frame an outcome before its end."""
    world = played(
        [at(0.0), at(900.0)], [at(0.0), at(900.0)], frames=[(1.0, 0), (1.1, 1), (9.8, 0)],
        airtime=1.5,
    )  # fmt: skip
    assert outcomes(simulate(world)) == [
        ["heard", "out_of_range"], ["out_of_range", "heard"], ["in_flight", "out_of_range"],
    ]  # fmt: skip


def test_vehicles_that_move_stretch_a_frame() -> None:
    """An AUV that runs away at 30 m/s has a frame of 1 s for 1/0.98 s of its own way."""
    world = played(
        [moving(240.0, 30.0)], [at(0.0)], pings=[(0.0, 0)], frames=[(2.0, 0)], airtime=1.0
    )
    tables = simulate(world).tables
    assert tables["frame_receptions"].arrived_at_s[0] == pytest.approx(2.0 + 300 / 1470, abs=1e-12)
    assert tables["fixes"].delivered_at_s[0] == pytest.approx(3.0 + 330 / 1470, abs=1e-12)


def test_a_frame_that_is_strong_enough_survives_another() -> None:
    """Of two at once AUV0 decodes that from 100 m, more than 6 dB stronger than that from 300 m;
    AUV1, half way between both, decodes neither.
    """
    sonar = {"model": "sonar", "capture_db": 6.0, "shadowing_sd_db": 0.0}
    world = played(
        [at(100.0), at(200.0)], [at(0.0), at(400.0)], frames=[(1.0, 0), (1.0, 1)],
        acoustics={"mf": {"channel": sonar}},
    )  # fmt: skip
    assert outcomes(simulate(world)) == [["heard", "collided"], ["collided", "collided"]]


STEERING = {"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.6}
SONAR = {"channel": {"model": "sonar", "capture_db": 6.0}}


@pytest.mark.parametrize("broadcaster", ["rotate", "parallel"])
@pytest.mark.parametrize(
    ("protocol", "auvs", "mf"),
    [
        ({"downlink": "sequential"}, {}, {}),
        ({"downlink": "pipelined_round", "downlink_guard_s": 0.0}, {}, SONAR),
        ({"downlink": "pipelined_group", "duplex": "per_node"}, {}, {"payload_bytes": 24}),
        ({"downlink": "pipelined_round", "duplex": "per_node"}, STEERING, {}),
        ({"schedule": "aloha", "duplex": "per_node"}, {}, {}),
        ({"knowledge": "broadcast"}, {}, {}),
    ],
)
def test_every_frame_has_one_outcome_at_every_auv(
    protocol: dict[str, Any], auvs: dict[str, Any], mf: dict[str, Any], broadcaster: str
) -> None:
    """A row for each; fixes are delivered by the frames that were heard, and lost by the others."""
    result = simulate(
        scenario(
            duration_s=12.0, auvs={"count": 3, **auvs}, asvs={"count": 3}, acoustics={"mf": mf},
            protocol={**protocol, "broadcaster": broadcaster},
        ),
        1,
    )  # fmt: skip
    table, fixes = result.tables["frame_receptions"], result.tables["fixes"]
    broadcasts = result.tables["broadcasts"]
    assert len(table) == 3 * len(broadcasts) > 0
    assert not table[["broadcast", "auv"]].duplicated().any()
    outcome = table.set_index(["broadcast", "auv"]).outcome
    for fix in fixes[fixes.outcome != "in_flight"].itertuples():
        own = (broadcasts.sent_at_s == fix.broadcast_at_s) & (broadcasts.asv == fix.broadcast_by)
        became = outcome[broadcasts.index[own][0], fix.auv]
        assert became == ("heard" if fix.outcome == "delivered" else fix.outcome)
