"""Passive ranging: ASVs ping in turn, and every AUV that hears one fixes itself."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import QUIET_USBL, merged, scenario, still

from bindusbl_des import (
    Result,
    Scenario,
    Setup,
    Signals,
    Sounding,
    airtime,
    downlink_slot,
    simulate,
)

PASSIVE: dict[str, Any] = {"protocol": {"ranging": "passive"}}


def number(names: Any) -> Any:
    return names.str.slice(3).astype(int)


def hand_worked(**changes: Any) -> Scenario:
    """Two AUVs hold at a depth of 40 m, 30 m beside an ASV each: 50 m of sound, 1/30 s."""
    base = {
        "duration_s": 0.995,
        "survey": {"side_m": 60.0, "depth_m": 40.0},
        "auvs": {"count": 2, "route": {"kind": "hold", "positions_m": [[30.0, 0.0], [90.0, 30.0]]}},
        "asvs": {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [90.0, 0.0]]}},
        "acoustics": {"hf": {"range_m": 80.0}},
        "usbl": QUIET_USBL,
        **PASSIVE,
    }
    return scenario(**merged(base, changes))


def conserved(result: Result) -> None:
    """Every ping is accounted for at every AUV, and every fix belongs to one that was heard."""
    tables, auvs = result.tables, result.auvs.set_index("auv")
    counts = tables["receptions"].groupby(["auv", "outcome"]).size().unstack(fill_value=0)
    for auv, row in counts.iterrows():
        found = auvs.loc[auv]
        assert row.sum() == found.pings == len(tables["pings"])
        near = row.sum() - row.get("out_of_range", 0)
        assert near == found.pings_in_range
        assert row.get("heard", 0) == found.pings_heard == found.fixes == found.fixes_delivered
        assert (row.get("lost", 0), row.get("collided", 0)) == (
            found.receptions_lost, found.collisions,
        )  # fmt: skip
    heard = tables["receptions"][tables["receptions"].outcome == "heard"]
    assert sorted(zip(heard.ping, heard.auv, strict=True)) == sorted(
        zip(tables["fixes"].ping, tables["fixes"].auv, strict=True)
    )
    assert tables["rounds"].fixes.sum() == len(tables["fixes"])
    assert tables["pings"].heard_by.sum() == len(tables["fixes"])
    assert not len(tables["broadcasts"])


def test_a_timeline_worked_by_hand() -> None:
    """Slots of 2.5 t_C = 0.1 s; each ping reaches its near AUV 1/30 s later, and is over in 10 ms.

    ASV1 is 60 m beside AUV0, within the range of 80 m: sqrt(60^2 + 40^2) m of sound.  ASV0 is
    sqrt(90^2 + 30^2) = 94.9 m beside AUV1: out of range.
    """
    result = simulate(hand_worked(), 1)
    pings, fixes, rounds = (result.tables[name] for name in ("pings", "fixes", "rounds"))
    assert pings.sent_at_s.to_numpy() == pytest.approx(np.arange(10) / 10)
    assert pings.asv.tolist() == ["ASV0", "ASV1"] * 5
    assert pings.auv.isna().all()
    assert pings[["round", "slot"]].to_numpy().tolist() == [[k // 2, k % 2] for k in range(10)]
    assert pings.in_range_of.tolist() == pings.heard_by.tolist() == [1, 2] * 5
    assert rounds.started_at_s.to_numpy() == pytest.approx(np.arange(5) / 5)
    assert rounds[["colours", "conflicts", "fixes"]].to_numpy().tolist() == [[2, 0, 3]] * 5
    assert rounds.uplink_s.tolist() == pytest.approx([0.2] * 4 + [0.1])  # the last slot has no end
    near, far = 1 / 30, math.hypot(60, 40) / 1500
    # in each round: AUV0 hears ASV0, then AUV1 its own ASV1, and last AUV0 the same ping
    valid = [0.2 * n + it for n in range(5) for it in (near, 0.1 + near, 0.1 + far)]
    assert fixes.auv.tolist() == ["AUV0", "AUV1", "AUV0"] * 5
    assert fixes.asvs.tolist() == ["ASV0", "ASV1", "ASV1"] * 5
    assert fixes.valid_at_s.to_numpy() == pytest.approx(valid, abs=1e-12)
    assert fixes.delivered_at_s.to_numpy() == pytest.approx(np.add(valid, 0.01), abs=1e-12)
    assert fixes.latency_s.tolist() == pytest.approx([near + 0.01, near + 0.01, far + 0.01] * 5)
    assert fixes.error_m.max() < 0.02  # a plane wave is taken for the sphere that it is
    assert fixes.z_m.to_numpy() == pytest.approx(40.0, abs=0.02)
    assert fixes.broadcast_at_s.isna().all()
    assert result.auvs.latency_from_broadcast_s.isna().all()
    assert result.auvs.fix_rate_hz.tolist() == pytest.approx([10 / 0.995, 5 / 0.995])
    assert result.mission.hf_utilisation[0] == pytest.approx(0.1 / 0.995)
    conserved(result)


def test_ticks_round_slots_but_no_fix() -> None:
    """On a clock of 7 Hz slots begin each 1/7 s; an AUV has its fix once it has decoded it."""
    tables = simulate(hand_worked(protocol={"tick_rate_hz": 7.0}), 1).tables
    assert np.diff(tables["pings"].sent_at_s) == pytest.approx(1 / 7)
    assert tables["fixes"].latency_s.min() == pytest.approx(1 / 30 + 0.01)


def test_what_has_not_ended_before_the_end_is_in_flight() -> None:
    """The mission covers [0, duration): a ping that ends at its last instant does not."""
    arrives = simulate(hand_worked(), 1).tables["receptions"].arrived_at_s[0]
    for end, outcomes in ((arrives + 0.01, "in_flight"), (arrives + 0.01 + 1e-9, "heard")):
        result = simulate(hand_worked(duration_s=end), 1)
        assert result.tables["receptions"].outcome.tolist() == [outcomes, "out_of_range"]
        assert len(result.tables["fixes"]) == (outcomes == "heard")
        assert result.auvs.hf_coverage.isna().tolist() == [outcomes == "in_flight", False]


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_no_two_pings_meet_at_any_auv(data: st.DataObject) -> None:
    """Whatever the geometry within the bounds, however fast the AUVs: slots keep pings apart."""
    side = data.draw(st.floats(20.0, 400.0))
    depth, ping = data.draw(st.floats(0.0, 80.0)), data.draw(st.floats(0.001, 0.2))
    place = st.tuples(*[st.floats(-side / 2, side / 2)] * 2).map(list)
    stations = data.draw(st.lists(place, min_size=1, max_size=4))
    count = data.draw(st.integers(1, 5))
    ends = data.draw(st.lists(st.lists(place, min_size=2, max_size=2), min_size=count,
                              max_size=count).filter(_ways))  # fmt: skip
    world = scenario(
        duration_s=4.0,
        survey={"side_m": side, "depth_m": depth},
        auvs={"count": count, "speed_m_per_s": data.draw(st.floats(0.1, 20.0)),
              "vehicle": {"model": "kinematic", "turning_radius_m": 1.0},
              "route": {"kind": "waypoints", "points_m": ends}},
        asvs={"count": len(stations), "formation": {"positions_m": stations}},
        acoustics={"hf": {"range_m": data.draw(st.floats(5.0, 600.0)), "ping_s": ping,
                          "range_metric": data.draw(st.sampled_from(["horizontal", "slant"]))}},
        protocol={"ranging": "passive",
                  "tick_rate_hz": data.draw(st.sampled_from([None, 7.0, 30.0]))},
    )  # fmt: skip
    result = simulate(world, 1)
    assert "collided" not in set(result.tables["receptions"].outcome)
    conserved(result)


def _ways(plans: list[list[list[float]]]) -> bool:
    return all(math.dist(*plan) > 0.01 for plan in plans)


def nees(result: Result, places: list[list[float]], depth: float) -> np.ndarray:
    """Return the NEES of the errors of all fixes of AUVs that hold still, (n,), 3 axes."""
    fixes = result.tables["fixes"]
    truth = np.array([[*places[it], depth] for it in number(fixes.auv)])
    error = fixes[["x_m", "y_m", "z_m"]].to_numpy() - truth
    assert np.hypot(*error[:, :2].T) == pytest.approx(fixes.error_m.to_numpy())
    covariance = np.empty((len(fixes), 3, 3))
    for i, a in enumerate("xyz"):
        for j, b in enumerate("xyz"):
            column = fixes[f"sd_{a}_m"] ** 2 if i == j else fixes[f"cov_{min(a, b)}{max(a, b)}_m2"]
            covariance[:, i, j] = column
    return np.asarray(np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error))


@pytest.mark.parametrize(
    "usbl",
    [{}, {"gnss_sd_m": 0.8}, {"heading_sd_deg": 4.0, "roll_sd_deg": 3.0, "pitch_sd_deg": 2.0},
     {"tdoa_sd_s": 2e-6, "travel_time_sd_s": 1e-3, "gnss_sd_m": 0.3}],
    ids=["thesis", "gnss", "ahrs", "array_and_clock"],
)  # fmt: skip
def test_fixes_are_as_good_as_they_say(usbl: dict[str, float]) -> None:
    """Monte Carlo: the errors of fixes agree with their own covariances, on all three axes."""
    places = [[20.0, 5.0], [-30.0, 12.0], [0.0, -33.0], [41.0, -17.0]]
    world = scenario(
        duration_s=60.0,
        survey={"side_m": 60.0, "depth_m": 12.0},
        auvs={"count": 4, "route": {"kind": "hold", "positions_m": places}},
        asvs={"count": 2, "formation": {"radius_m": 15.0}},
        acoustics={"hf": {"range_m": 100.0}, "loss": {"law": "none"}},
        usbl=usbl,
        **PASSIVE,
    )
    found = nees(simulate(world, 4), places, 12.0)
    assert len(found) > 2000
    # errors of one ASV's GNSS are common to the four that hear it: bounds as of a quarter of them
    assert found.mean() == pytest.approx(3.0, abs=4 * math.sqrt(6 / (len(found) / 4)))


def test_one_error_of_an_asv_is_that_of_all_who_hear_it() -> None:
    """Where an ASV takes itself for elsewhere all AUVs are off by as much, in its direction."""
    places = [[20.0, 5.0], [-30.0, 12.0], [0.0, -33.0]]
    world = still(3, auvs={"route": {"kind": "hold", "positions_m": places}},
                  usbl={**QUIET_USBL, "gnss_sd_m": 0.8}, **PASSIVE)  # fmt: skip
    fixes = simulate(world, 2).tables["fixes"]
    off = fixes[["x_m", "y_m"]].to_numpy() - np.array([places[it] for it in number(fixes.auv)])
    for ping in np.unique(fixes.ping)[:50]:
        assert np.ptp(off[(fixes.ping == ping).to_numpy()], axis=0) == pytest.approx(0.0, abs=0.05)
    assert off.std() == pytest.approx(0.8, rel=0.1)


def rate(auvs: int, ranging: str) -> float:
    """Return the fixes per second of each of so many AUVs that one ASV hears all of, L = 60 m."""
    world = still(auvs, protocol={"ranging": ranging, "tick_rate_hz": None},
                  duration_s=120.0, record={"detail": "summary"})  # fmt: skip
    found = simulate(world, 1).auvs.fix_rate_hz
    assert found.max() - found.min() <= 1 / 120 + 1e-9
    return float(found.mean())


def test_the_rate_of_an_auv_does_not_fall_with_the_team() -> None:
    """Passive: 1 / (K T_slot) for any N.  Uplink: 1 / (N T_UL + T_DL(N)), all heard by one ASV."""
    slots = Setup(still(3, **PASSIVE)).slots
    for auvs in (3, 10, 30):
        assert rate(auvs, "passive") == pytest.approx(1 / slots.uplink_slot, rel=0.01)
        down = downlink_slot(airtime(8 + 16 * auvs), slots.crossing_time)
        bound = 1 / (auvs * slots.uplink_slot + down)
        assert rate(auvs, "owtt_sync") == pytest.approx(bound, abs=1 / 120)
    assert rate(30, "passive") == rate(3, "passive")


@pytest.mark.parametrize("fleet", ["kinematic", "bluerov2"])
def test_a_seed_gives_the_same_mission_again(fleet: str) -> None:
    world = scenario(duration_s=20.0, auvs={"vehicle": fleet, "speed_m_per_s": 0.5}, **PASSIVE)
    one, other, third = (simulate(world, seed) for seed in (5, 5, 6))
    assert all(one.arrow[name].equals(other.arrow[name]) for name in one.arrow)
    assert not one.arrow["fixes"].equals(third.arrow["fixes"])


def everywhere(signals: Signals) -> np.ndarray:
    """A channel that carries sound as far as there is anybody, half of the time."""
    assert signals.calling
    assert signals.ranges.shape == (len(signals.auvs), len(signals.asvs))
    return np.full(signals.ranges.shape, 0.5)


def test_a_channel_of_ones_own_may_carry_sound_into_the_next_slot() -> None:
    """ASVs 150 m apart with slots of 0.1 s: what outlasts its slot meets the next ping."""
    world = hand_worked(
        asvs={"formation": {"positions_m": [[0.0, 0.0], [180.0, 30.0]]}}, duration_s=20.0,
        auvs={"route": {"positions_m": [[169.0, 0.0], [90.0, 30.0]]}},
        acoustics={"hf": {"channel": everywhere}},
    )  # fmt: skip
    result = simulate(world, 3)
    met = result.tables["receptions"]
    own = met[met.auv == "AUV0"]  # 173.7 m from one ASV and 51.2 m from the other: 15.8, 34 ms
    assert set(own.outcome) <= {"heard", "lost", "collided", "in_flight"}
    lost = (met.outcome == "lost").sum() / met.outcome.isin(["lost", "heard"]).sum()
    assert lost == pytest.approx(0.5, abs=0.08)
    conserved(result)
    near = hand_worked(
        survey={"side_m": 20.0, "depth_m": 0.0}, duration_s=20.0,
        asvs={"formation": {"positions_m": [[0.0, 0.0], [150.0, 0.0]]}},
        auvs={"route": {"positions_m": [[150.0, 1.0], [20.0, 0.0]]}},
        acoustics={"hf": {"range_m": 10.0, "channel": everywhere}},
    )  # fmt: skip
    result = simulate(near, 3)  # slots of 33 ms: 100 ms from ASV0, three slots, meet 1 ms of ASV1
    assert Setup(near).slots.uplink_slot == pytest.approx(1 / 30)
    met = result.tables["receptions"]
    assert (met[(met.auv == "AUV0") & met.asv.eq("ASV1")].outcome == "collided").mean() > 0.9
    conserved(result)


def half_as_far(sounding: Sounding) -> tuple[np.ndarray, np.ndarray]:
    """An instrument that finds every source half as far off as it is."""
    assert len(sounding.asvs) == 1
    here = sounding.poses[:, :3]
    return here + (sounding.source - here) / 2, np.eye(3)[None]


def test_an_instrument_of_ones_own_is_the_auvs() -> None:
    """It says where the ASV is, seen from the AUV; the AUV is as far off that as it was found."""
    fixes = simulate(hand_worked(usbl={"model": half_as_far}), 1).tables["fixes"]
    own = fixes[(fixes.auv == "AUV0") & (fixes.asvs == "ASV0")]
    places = own[["x_m", "y_m", "z_m"]].to_numpy()
    assert places == pytest.approx(np.tile([15.0, 0.0, 20.0], (len(own), 1)))
    assert own.error_m.to_numpy() == pytest.approx(15.0)


def test_row_counts_that_no_such_mission_has_are_told() -> None:
    """ASVs ping and AUVs hear: 2 x 2 receptions of a round, a fix for each at most, no frame."""
    world = hand_worked()
    rows = {name: len(table) for name, table in simulate(world, 1).tables.items()}
    assert (rows["pings"], rows["receptions"], rows["fixes"]) == (10, 20, 15)
    assert rows["broadcasts"] == rows["frame_receptions"] == 0


def test_fixes_have_no_columns_of_repeats_where_nothing_is_broadcast() -> None:
    """`repeat: 0` says that fixes are repeated no times: AUVs that fix themselves have none."""
    plain, none = (simulate(hand_worked(protocol=more)) for more in ({}, {"repeat": 0}))
    assert len(plain.tables["fixes"])
    assert none.tables["fixes"].equals(plain.tables["fixes"])
