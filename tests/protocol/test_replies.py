"""Answers of `direct_reply` that are frames: airtime, half duplex, collisions, who answers."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from commands_for_tests import explained
from verification_cases import drawn_case
from worlds import scenario

from bindusbl_des import Result, Scenario, load_result, simulate, verify

PING, SOUND = 0.01, 1500.0
# Header and one fix: 24 B at 2000 bit/s and overhead 2
AIRTIME = 0.192

PLACES = [[20.0, 0.0], [-36.0, 0.0]]


def answered(places: Any = PLACES, stations: Any = ((0.0, 0.0),), **protocol: Any) -> Result:
    """Return AUVs that hold still, 10 m deep, pinging on the exact clock without loss."""
    return simulate(
        scenario(
            duration_s=10.0,
            survey={"side_m": 60.0, "depth_m": 10.0},
            auvs={"count": len(places), "route": {"kind": "hold", "positions_m": places}},
            asvs={"count": len(stations), "formation": {"positions_m": stations}},
            acoustics={"loss": {"law": "none"}, "mf": {"transmit_w": 10.0, "receive_w": 1.0}},
            protocol={"downlink": "direct_reply", "schedule": "one_per_slot", **protocol},
        ),
        1,
    )


def way(auv: Any, asv: Any = (0.0, 0.0)) -> float:
    """Return how long (s) sound is under way between an AUV and an ASV."""
    return math.hypot(auv[0] - asv[0], auv[1] - asv[1], 10.0) / SOUND


def test_a_round_goes_as_worked_out_by_hand() -> None:
    """L = 60 m: T_UL = 2.5 t_C = 0.1 s, an answer 0.192 s, its guard 1.25 t_C = 0.05 s.

    AUV0 pings at 0 s; the ping is at the ASV after D = sqrt(20^2 + 10^2) m / c = 14.907 ms and
    decoded 10 ms later; the frame of 24 B is on the air for 192 ms and its end under way for D
    again: delivered after 2 D + 10 ms + 192 ms = 231.814 ms.  AUV1 pings a slot of 0.342 s later.
    """
    result = answered()
    pings, fixes, frames = (result.tables[it] for it in ("pings", "fixes", "broadcasts"))
    slot = 0.1 + AIRTIME + 0.05
    count = len(pings)
    assert pings.sent_at_s.to_numpy() == pytest.approx(slot * np.arange(count), abs=1e-9)
    assert fixes.delivered_at_s[0] == pytest.approx(0.2318142397, abs=1e-9)
    ways = np.array([way(PLACES[n % 2]) for n in range(count)])
    sent = pings.sent_at_s.to_numpy() + ways + PING
    assert frames.sent_at_s.to_numpy() == pytest.approx(sent[: len(frames)], abs=1e-9)
    assert set(zip(frames.airtime_s, frames.payload_bytes, frames.fixes, strict=True)) == {
        (AIRTIME, 24, 1)
    }
    done = fixes[fixes.outcome == "delivered"]
    expected = (sent + AIRTIME + ways)[: len(done)]
    assert done.delivered_at_s.to_numpy() == pytest.approx(expected, abs=1e-9)
    assert len(done) >= count - 1
    received = result.tables["frame_receptions"]
    assert len(received) == 2 * len(frames)  # each AUV overhears the other's answers
    assert set(received.outcome) <= {"heard", "in_flight"}
    on_air = np.minimum(10.0 - frames.sent_at_s, AIRTIME).sum()
    mission = result.mission.iloc[0]
    assert mission.mf_utilisation == pytest.approx(on_air / 10.0, abs=1e-9)
    # one ASV sends, two AUVs receive; all else waits, at what receiving takes
    assert mission.energy_j == pytest.approx(9.0 * on_air + 3 * 10.0, abs=1e-6)


def test_answers_to_two_that_share_a_slot_destroy_each_other() -> None:
    """Two ASVs 80 m apart hear one AUV each; both AUVs hear both ASVs (MF 100 m), and no fix."""
    places, stations = [[-40.0, 0.0], [40.0, 0.0]], [[-40.0, 0.0], [40.0, 0.0]]
    result = answered(places, stations, schedule="spatial_reuse")
    assert set(result.tables["receptions"].outcome) == {"heard", "out_of_range"}
    assert set(result.tables["frame_receptions"].outcome) <= {"collided", "in_flight"}
    fixes = result.tables["fixes"]
    assert set(fixes.outcome) <= {"collided", "in_flight"}
    assert result.auvs.fixes_delivered.sum() == 0
    assert result.auvs.fixes_lost.sum() == (fixes.outcome == "collided").sum() > 40
    told = explained(result, fix=0)
    assert "overlapped by the frame of ASV1" in told
    one_by_one = answered(places, stations)
    assert set(one_by_one.tables["frame_receptions"].outcome) <= {"heard", "in_flight"}


def test_who_answers_hears_no_ping_meanwhile() -> None:
    """ALOHA: of pings at the ASV that overlap no other, those in its own frame are lost."""
    result = answered(schedule="aloha", frame_s=0.5)
    met, frames = result.tables["receptions"], result.tables["broadcasts"]
    begins = met.arrived_at_s.to_numpy()[:, None]
    sent, over = frames.sent_at_s.to_numpy(), (frames.sent_at_s + frames.airtime_s).to_numpy()
    deaf = ((begins < over) & (begins + PING > sent)).any(axis=1)
    assert 5 < deaf.sum() < len(met) - 5
    assert set(met.outcome[deaf]) <= {"collided", "in_flight"}
    assert (np.diff(frames.sent_at_s) >= AIRTIME).all()
    ping = int(met.ping[deaf].iloc[0])
    assert "it sends a frame from" in explained(result, ping=int(ping))


def test_another_asv_answers_for_one_that_is_busy() -> None:
    """Of two ASVs at one place but for 1 m the first to decode answers, unless it is answering."""
    result = answered(stations=[[0.0, 0.0], [0.0, 1.0]], schedule="aloha", frame_s=0.2)
    frames, fixes = result.tables["broadcasts"], result.tables["fixes"]
    assert set(frames.asv) == {"ASV0", "ASV1"}
    for _, own in frames.groupby("asv"):
        assert (np.diff(own.sent_at_s) >= AIRTIME).all()
    assert "collided" in set(fixes.outcome)  # two at once, at AUVs that hear both


@pytest.mark.parametrize(
    "protocol",
    [
        {"schedule": "spatial_reuse"},
        {"schedule": "worst_first"},
        {"schedule": "super_tdma"},
        {"schedule": "polling", "ranging": "twtt"},
        {"schedule": "round_robin", "ranging": "twtt"},
        {"schedule": "csma", "frame_s": 0.4},
        {"schedule": "slotted_aloha", "frame_s": 0.4, "duplex": "per_node"},
    ],
)
def test_every_fix_has_its_frame_and_its_fate(protocol: Any) -> None:
    """As many frames as fixes, an ASV never sends two at once, each fix is counted once."""
    failures = [{"asv": 1, "at_s": 6.0}]
    result = simulate(
        scenario(
            duration_s=20.0,
            survey={"side_m": 100.0},
            auvs={"count": 4},
            asvs={"count": 2, "formation": {"radius_m": 30.0}, "failures": failures},
            acoustics={"hf": {"range_m": 80.0}},
            protocol={"downlink": "direct_reply", **protocol},
        ),
        2,
    )
    frames, fixes, auvs = (*(result.tables[it] for it in ("broadcasts", "fixes")), result.auvs)
    assert len(frames) == len(fixes) == result.tables["rounds"].fixes.sum() > 10
    assert frames.sent_at_s.tolist() == sorted(frames.sent_at_s)
    for _, own in frames.groupby("asv"):
        assert (np.diff(own.sent_at_s) >= own.airtime_s.to_numpy()[:-1] - 1e-9).all()
    assert frames.sent_at_s[frames.asv == "ASV1"].max() < 6.0
    counted = auvs.fixes_delivered + auvs.fixes_out_of_range + auvs.fixes_lost
    assert (counted + auvs.fixes_in_flight).tolist() == auvs.fixes.tolist()
    assert auvs.fixes.sum() == len(fixes)
    heard = result.tables["frame_receptions"].query("outcome == 'heard'")
    told = set(zip(heard.broadcast, heard.auv, strict=True))
    done = fixes[fixes.outcome == "delivered"]
    assert set(zip(done.index, done.auv, strict=True)) <= told


def test_answers_that_verify_accepts_meet_nothing() -> None:
    """Of drawn scenarios with direct replies some are accepted, and in none does anything collide;
    where AUVs share slots that several ASVs answer, nothing is proved.
    """
    accepted = 0
    for seed in range(60):
        data, _ = drawn_case(seed)
        data["protocol"] |= {"downlink": "direct_reply", "downlink_guard_s": (None, 0.0)[seed % 2]}
        data["duration_s"], data["acoustics"]["loss"] = 15.0, {"law": "none"}
        plan = Scenario.model_validate(data)
        found = verify(plan)
        if plan.protocol.replies and plan.asvs.count > 1 and plan.auvs.count > 1:
            shares = plan.protocol.schedule in ("spatial_reuse", "worst_first", "dsatur")
            assert not (shares and found.accepted)
        if found.accepted:
            accepted += 1
            tables = simulate(plan, seed).tables
            for name in ("receptions", "frame_receptions"):
                assert "collided" not in set(tables[name].outcome), seed
    assert accepted > 10


def test_a_folder_from_before_answers_took_airtime_is_read(tmp_path: Path) -> None:
    """Its record has no `reply`: they were instant; nor has it checksums."""
    result = answered(downlink={"model": "direct_reply", "reply": "instant"})
    folder = result.write(tmp_path / "run")
    run = json.loads((folder / "run.json").read_text())
    run["scenario"]["protocol"] |= {"downlink": "direct_reply", "reply_at": "ping_end"}
    run["scenario"]["navigation"] |= {"gain": 0.9}
    run["scenario"]["auvs"] |= {"turning_radius_m": 5.0}
    run["scenario"]["protocol"] |= {"turnaround_s": 0.0}
    del run["tables_sha256"], run["sha256"]
    canonical = json.dumps(run["scenario"], sort_keys=True, separators=(",", ":"))
    run["scenario_sha256"] = hashlib.sha256(canonical.encode()).hexdigest()
    (folder / "run.json").write_text(json.dumps(run))
    for table in folder.glob("*.parquet"):
        read = pq.read_table(table)
        origin = {b"bindusbl.scenario_sha256": run["scenario_sha256"].encode()}
        pq.write_table(read.replace_schema_metadata({**read.schema.metadata, **origin}), table)
    read = load_result(folder)
    assert read.scenario.protocol.answer.reply == "instant"
    assert read.tables["fixes"].equals(result.tables["fixes"])
