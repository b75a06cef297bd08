"""Frames at AUVs: what becomes of each at each of them, by hand."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import simpy
from test_reception import at, downlink, fleet, lasting, made, moving, steered
from worlds import scenario

from bindusbl_des import simulate
from bindusbl_des.acoustics.channel import PROSPECT, Signals
from bindusbl_des.protocol.mf.downlink import FrameBand
from bindusbl_des.records.events import COLLIDED, HEARD, IN_FLIGHT, OUT_OF_RANGE, OUTCOMES
from bindusbl_des.records.rows import Recorder
from bindusbl_des.vehicles.fleet import VehicleFleet

SOUND = 1500.0
Sent = tuple[float, int, float]  # when (s), by which ASV, for how long (s)


def sent(
    auvs: VehicleFleet,
    asvs: VehicleFleet,
    frames: Sequence[Sent],
    end: float = 10.0,
    **changes: Any,
) -> Any:
    """Send frames, each with a fix for each AUV; return the band and the record at the end (s)."""
    env, record = simpy.Environment(), Recorder()
    band = downlink(env, auvs, asvs, record, **changes)

    def send() -> Any:
        for time, asv, airtime in frames:
            yield env.timeout(time - env.now)
            rows = [made(record, auv, time, 0.0)[0] for auv in range(len(auvs))]
            band.send(0, np.array(rows), asv, time, lasting(airtime))

    env.process(send())
    env.run(end)
    band.close(end)
    return band, record


def outcomes(record: Recorder) -> list[list[int]]:
    """Return the outcomes of each frame, AUV after AUV."""
    return record.frame_receptions.rows["outcome"].reshape(-1, 2).tolist()


@pytest.mark.parametrize("steers", [False, True])
def test_two_frames_meet_at_one_auv_and_not_at_the_other(steers: bool) -> None:
    """ASVs 600 m apart, AUVs beside them: ASV1 begins 0.5 s after ASV0, whose frame takes 0.8 s.

    At AUV0, 0 m and 600 m away, they are from 0 to 0.8 s and from 0.9 s on; at AUV1 from 0.4 to
    1.2 s and from 0.5 s on.
    """
    auvs, asvs = fleet(at(0.0), at(600.0)), fleet(at(0.0), at(600.0))
    band, record = sent(
        steered(auvs) if steers else auvs, asvs, [(0.0, 0, 0.8), (0.5, 1, 0.8)],
        band=FrameBand(700.0, SOUND, None),
    )  # fmt: skip
    assert outcomes(record) == [[HEARD, COLLIDED], [HEARD, COLLIDED]]
    rows = record.frame_receptions.rows
    assert rows["arrived_at_s"] == pytest.approx([0.0, 0.4, 0.9, 0.5], abs=1e-12)
    assert rows["broadcast"].tolist() == [0, 0, 1, 1]
    fixes = record.fixes.rows
    assert [OUTCOMES[it] for it in fixes["outcome"]] == ["delivered", "collided"] * 2
    assert fixes["delivered_at_s"][[0, 2]] == pytest.approx([0.8, 1.7], abs=1e-12)
    assert band.decoded(1, 1.69).tolist() == [False, False]
    assert band.decoded(1, 1.71).tolist() == [True, False]


def test_touching_is_no_overlap() -> None:
    """A frame that begins at an AUV as another ends there leaves that whole; a little sooner not.

    From 300 m away it is on its way for 0.2 s.
    """
    auvs, asvs = fleet(at(0.0), at(0.0, 5.0)), fleet(at(0.0), at(300.0))
    for begins, found in ((0.3, HEARD), (0.3 - 1e-6, COLLIDED)):
        _, record = sent(auvs, asvs, [(0.0, 0, 0.5), (begins, 1, 0.5)])
        assert [line[0] for line in outcomes(record)] == [found, found]


def test_a_short_frame_meets_a_long_one_that_began_before_others() -> None:
    """The search goes back past a frame that was over before, to one that is not."""
    auvs, asvs = fleet(at(0.0), at(0.0, 5.0)), fleet(at(0.0), at(1.0), at(2.0))
    frames = [(0.0, 0, 3.0), (0.5, 1, 0.1), (2.0, 2, 0.1), (4.0, 1, 0.1)]
    _, record = sent(auvs, asvs, frames)
    assert [line[0] for line in outcomes(record)] == [COLLIDED] * 3 + [HEARD]


def test_what_is_out_of_range_drowns_nobody() -> None:
    """The disc has no sound beyond its reach; nor has a frame an outcome before its end."""
    auvs, asvs = fleet(at(0.0), at(900.0)), fleet(at(0.0), at(900.0))
    _, record = sent(auvs, asvs, [(0.0, 0, 1.0), (0.0, 1, 1.0), (9.5, 0, 1.0)])
    assert outcomes(record) == [
        [HEARD, OUT_OF_RANGE], [OUT_OF_RANGE, HEARD], [IN_FLIGHT, OUT_OF_RANGE],
    ]  # fmt: skip


def test_vehicles_that_move_stretch_a_frame() -> None:
    """An AUV that runs away at 30 m/s has a frame of 1 s for 1/0.98 s of its own way."""
    auvs, asvs = fleet(moving(300.0, 30.0), at(0.0)), fleet(at(0.0), at(0.0))
    _, record = sent(auvs, asvs, [(0.0, 0, 1.0)])
    row = record.frame_receptions.rows[0]
    assert row["arrived_at_s"] == pytest.approx(300 / 1470, abs=1e-12)
    assert row["ended_at_s"] == pytest.approx(1.0 + 330 / 1470, abs=1e-12)


class Loud:
    """A channel that loses nothing, of sounds that fade with the square of their range."""

    def prospects(self, signals: Signals) -> np.ndarray:
        told = np.zeros(signals.ranges.shape, PROSPECT)
        told["sound"] = 1e6 / signals.ranges**2
        return told


def test_a_frame_that_is_strong_enough_survives_another() -> None:
    """Of two at once AUV0 decodes that from 100 m, 9 times as strong as the other, by a capture of
    6 dB; AUV1, half way between both, decodes neither.
    """
    auvs, asvs = fleet(at(100.0), at(200.0)), fleet(at(0.0), at(400.0))
    band = FrameBand(500.0, SOUND, lambda fixes, airtime: Loud(), capture=10**0.6)
    _, record = sent(auvs, asvs, [(0.0, 0, 1.0), (0.0, 1, 1.0)], band=band)
    assert outcomes(record) == [[HEARD, COLLIDED], [COLLIDED, COLLIDED]]


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
