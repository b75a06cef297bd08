"""Data of AUVs beside their pings: timelines worked out by hand, and what shares the band."""

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest
from played_for_tests import at, played
from worlds import merged, scenario

from bindusbl_des import Scenario, Setup, simulate, verify
from bindusbl_des.apps.explain.hearing import why_unanswered

C, PING, GAP = 1500.0, 0.01, 0.0002


def held(*places: tuple[float, float], **changes: Any) -> Scenario:
    """Return AUVs at the surface that hold still about an ASV at the origin, with 50 B every 3 s:
    at 1,000 bit/s 0.4 s; slots of 0.1 s without them.
    """
    base = {
        "duration_s": 9.0,
        "survey": {"side_m": 60.0, "depth_m": 0.0},
        "auvs": {"count": len(places), "route": {"kind": "hold", "positions_m": list(places)}},
        "asvs": {"count": 1, "formation": {"model": "positions", "positions_m": [[0.0, 0.0]]}},
        "acoustics": {"loss": {"law": "none"}, "hf": {"range_m": 100.0}},
        "protocol": {"schedule": "one_per_slot"},
        "traffic": {"bytes": 50, "every_s": 3.0},
    }
    return scenario(**merged(base, changes))


def test_a_packet_follows_a_ping_in_its_slot() -> None:
    """Slots are 0.1 + 0.4002 s; a round ends 0.4 s of downlink later.  What is made at 3 s waits
    for the next ping of its AUV, in the third round.
    """
    found = simulate(held((30.0, 0.0), (0.0, 45.0)))
    packets, slot = found.tables["packets"], 0.1 + 0.4 + GAP
    assert found.tables["rounds"].uplink_s[0] == pytest.approx(2 * slot)
    every = 2 * slot + 0.4
    assert packets.made_at_s.tolist() == [0.0, 0.0, 3.0, 3.0, 6.0, 6.0]
    pinged = [0.0, slot, 3 * every, 2 * every + slot]  # AUV1's slot of round 2 is after 3 s
    assert packets.sent_at_s[:4].tolist() == pytest.approx([at + PING + GAP for at in pinged])
    over = packets.sent_at_s[:4] + 0.4 + np.array([0.02, 0.03, 0.02, 0.03])
    assert packets.delivered_at_s[:4].tolist() == pytest.approx(over.tolist())
    assert packets.latency_s[2] == pytest.approx(over[2] - 3.0)
    assert packets.delivered_to[:4].tolist() == ["ASV0"] * 4
    assert set(found.tables["receptions"].outcome) <= {"heard", "in_flight"}


def test_metrics_of_data() -> None:
    """Six packets are made in 9 s, and all are delivered."""
    found = simulate(held((30.0, 0.0), (0.0, 45.0)))
    mission, packets = found.mission.iloc[0], found.tables["packets"]
    assert (mission.packet_delivery_ratio, mission.packet_fairness) == (1.0, 1.0)
    assert mission.goodput_bps == pytest.approx(8 * 50 * 6 / 9.0)
    assert mission.packet_latency_s == pytest.approx(packets.latency_s.mean())
    without = held((30.0, 0.0), (0.0, 45.0)).model_copy(update={"traffic": None})
    other = simulate(without).mission.iloc[0]
    assert other[["packet_delivery_ratio", "goodput_bps", "packet_latency_s"]].isna().all()


def test_what_still_waits_counts_against_delivery() -> None:
    """AUV1 is beyond HF range, and more is made than slots carry."""
    found = simulate(held((30.0, 0.0), (0.0, 105.0), traffic={"every_s": 0.5}))
    mission, packets = found.mission.iloc[0], found.tables["packets"]
    far = packets[packets.auv == "AUV1"]
    assert set(far.outcome) == {"out_of_range", "in_flight"}
    near = packets[packets.auv == "AUV0"]
    assert near.sent_at_s.isna().sum() > 5
    delivered = int((packets.outcome == "delivered").sum())
    assert mission.packet_delivery_ratio == pytest.approx(delivered / 36)
    assert mission.packet_fairness == pytest.approx(0.5)


def test_data_and_pings_drown_each_other() -> None:
    """Two AUVs ping as they like: a packet of 4 s, 500 B, meets the other's pings and data."""
    changes: dict[str, Any] = {
        "protocol": {"access": "aloha", "frame_s": 1.0}, "duration_s": 60.0,
        "traffic": {"bytes": 500, "every_s": 10.0},
    }  # fmt: skip
    found = simulate(held((30.0, 0.0), (0.0, 45.0), **changes), seed=1)
    packets, met = found.tables["packets"], found.tables["receptions"]
    lost = met[met.why == "packet"]
    assert (packets.outcome == "collided").any()
    assert len(lost) > 3
    pings = found.tables["pings"].set_index("ping")
    for row in lost.itertuples():
        by = packets.loc[int(row.overlapped_by)]
        way = 0.02 if by.auv == "AUV0" else 0.03
        assert by.auv != pings.auv[row.ping]
        assert row.arrived_at_s < by.sent_at_s + way + by.airtime_s
        assert row.arrived_at_s + PING > by.sent_at_s + way
    sent = packets[packets.sent_at_s.notna()]
    for auv in ("AUV0", "AUV1"):  # who sends data does not ping
        for begins in sent[sent.auv == auv].sent_at_s:
            own = pings[pings.auv == auv].sent_at_s
            assert not ((own > begins) & (own < begins + 4.0)).any()


@pytest.mark.parametrize("access", ["slotted_aloha", "csma", "t_lohi", "macau"])
def test_programs_carry_data(access: str) -> None:
    plan = held((30.0, 0.0), (0.0, 45.0), protocol={"access": access}, duration_s=30.0)
    found = simulate(plan, seed=2)
    packets = found.tables["packets"]
    assert (packets.outcome == "delivered").sum() >= 10
    pings = found.tables["pings"]
    for row in packets[packets.sent_at_s.notna()].itertuples():
        own = pings[pings.auv == row.auv].sent_at_s
        assert np.isclose(own + PING + GAP, row.sent_at_s, atol=1e-9).sum() == 1


def test_called_auvs_send_behind_their_answers() -> None:
    found = simulate(held((30.0, 0.0), (0.0, 45.0), protocol={"ranging": "twtt"}))
    packets, pings = found.tables["packets"], found.tables["pings"]
    assert packets.sent_at_s[0] == pytest.approx(pings.sent_at_s[0] + PING + GAP)
    assert (packets.outcome == "delivered").all()
    assert (pings.call == "heard").all()


def test_a_call_that_data_drown_says_so() -> None:
    """AUV0 sends 4 s of data behind its ping, when ASV0 calls both."""

    def ranging(slot: Any, time: float) -> Generator[Any, Any, None]:
        slot.ping([0], 0.0)
        yield slot.until(1.0)
        calls = slot.call([0, 1], [0, 0], 1.0)
        for auv in (0, 1):
            slot.ping([auv], 1.0, calls[auv : auv + 1])

    changes = {"duration_s": 6.0, "traffic": {"bytes": 500, "every_s": 10.0}}
    found = simulate(played([at(30.0), at(45.0)], [at(0.0)], pings=[], ranging=ranging, **changes))
    turns = found.tables["pings"]
    assert turns.call.tolist()[1:] == ["collided", "collided"]
    assert turns.call_why.tolist()[1:] == ["own_packet", "packet"]
    assert "AUV0 sends a packet itself" in why_unanswered(found, turns.iloc[1])


def test_arrivals_at_random_are_as_many_on_average() -> None:
    plan = held(
        *[(30.0, 0.0)] * 4, traffic={"every_s": 1.0, "arrivals": "poisson"}, duration_s=300.0
    )
    made = simulate(plan, seed=5).tables["packets"]
    assert len(made) == pytest.approx(1200, abs=4 * 1200**0.5)
    first = made[made.auv == "AUV0"].made_at_s.diff().dropna()
    assert first.std() == pytest.approx(first.mean(), rel=0.2)  # as of a Poisson process


def test_moving_auvs_do_not_mix_ping_and_data() -> None:
    plan = scenario(
        duration_s=60.0, survey={"side_m": 100.0}, auvs={"count": 2, "speed_m_per_s": 10.0},
        asvs={"count": 2, "formation": {"model": "positions", "positions_m": [[-20, 0], [20, 9]]}},
        acoustics={"hf": {"range_m": 300.0}, "loss": {"law": "none"}},
        protocol={"schedule": "one_per_slot"}, traffic={"every_s": 1.0},
    )  # fmt: skip
    found = simulate(plan)
    assert set(found.tables["receptions"].outcome) <= {"heard", "in_flight"}
    assert set(found.tables["packets"].outcome) <= {"delivered", "in_flight"}
    assert (found.tables["packets"].heard_by == 2).any()


def test_data_cost_energy_and_airtime() -> None:
    """Three packets of 0.4 s of one AUV: 10 W of that instead of 1 W; its ASV draws 2 W instead of
    1 W while it hears them and pings.
    """
    power = {"transmit_w": 10.0, "receive_w": 2.0, "idle_w": 1.0}
    found = simulate(held((30.0, 0.0), acoustics={"hf": power}))
    pings = len(found.tables["pings"])
    heard = int((found.tables["receptions"].outcome == "heard").sum())
    assert found.auvs.energy_j[0] == pytest.approx(9.0 + 9.0 * (3 * 0.4 + pings * PING))
    asv = found.mission.energy_j[0] - found.auvs.energy_j[0]
    assert asv == pytest.approx(9.0 + 3 * 0.4 + heard * PING)
    assert found.mission.hf_utilisation[0] == pytest.approx((1.2 + pings * PING) / 9.0)


def test_slots_are_longer_by_a_packet() -> None:
    """Whoever asks how long a slot is has it so, and nothing is proved of what follows pings."""
    plan = held((30.0, 0.0))
    without = plan.model_copy(update={"traffic": None})
    longer = Setup.of(plan).slots.uplink_slot - Setup.of(without).slots.uplink_slot
    assert longer == pytest.approx(0.4 + GAP)
    assert verify(plan).verdict == "undecided"
    assert verify(without).accepted
