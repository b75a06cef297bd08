"""Several ASVs broadcast at once: who sends what, when, and what becomes of it."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands_for_tests import explained
from worlds import merged, scenario

from bindusbl_des import Mission, Result, simulate

# Two pairs of AUVs 400 m apart, an ASV above each: MF reaches 100 m, HF 50 m.
FAR = [[0.0, 0.0], [5.0, 0.0], [400.0, 0.0], [405.0, 0.0]]


def pairs(
    asvs: list[list[float]], auvs: list[list[float]] = FAR, *, fail: Any = (), **changes: Any
) -> Any:
    """Return a scenario of AUVs that hold and of ASVs at places (m), which broadcast in parallel
    and may `fail`.
    """
    route = {"kind": "hold", "positions_m": auvs}
    base = {
        "duration_s": 8.0,
        "survey": {"side_m": 60.0},
        "auvs": {"count": len(auvs), "route": route},
        "asvs": {
            "count": len(asvs),
            "formation": {"model": "positions", "positions_m": asvs},
            "failures": list(fail),
        },
        "acoustics": {"loss": {"law": "none"}, "mf": {"range_m": 100.0}},
        "protocol": {"broadcaster": "parallel"},
    }
    return scenario(**merged(base, changes))


def sent_at_once(result: Result) -> dict[float, list[str]]:
    """Return which ASVs begin a frame at each instant (s)."""
    frames = result.tables["broadcasts"]
    return {at: list(own.asv) for at, own in frames.groupby("sent_at_s")}


def test_asvs_with_listeners_of_their_own_broadcast_at_once() -> None:
    """Each sends the fixes of the two AUVs below it; a round has one slot for a frame of two."""
    result = simulate(pairs([[0.0, 0.0], [400.0, 0.0]]), 1)
    assert set(map(tuple, sent_at_once(result).values())) == {("ASV0", "ASV1")}
    assert set(result.tables["broadcasts"].fixes) == {2}
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    assert dict(zip(fixes.auv, fixes.broadcast_by, strict=True)) == {
        "AUV0": "ASV0", "AUV1": "ASV0", "AUV2": "ASV1", "AUV3": "ASV1",
    }  # fmt: skip
    assert set(result.tables["frame_receptions"].outcome) <= {"heard", "out_of_range", "in_flight"}
    # (8 + 2 * 16) B take 0.32 s, the guard 1.25 t_C = 0.05 s, at least 10 t_C = 0.4 s
    assert result.tables["rounds"].downlink_s[:-1].to_numpy() == pytest.approx(0.4)


def test_asvs_that_an_auv_hears_both_of_broadcast_one_after_the_other() -> None:
    """150 m apart, with an AUV 75 m from each: frames of 0.448 s and 0.192 s, each with a guard."""
    auvs = [[0.0, 0.0], [5.0, 0.0], [150.0, 0.0], [74.0, 0.0]]
    run = pairs([[0.0, 0.0], [150.0, 0.0]], auvs, acoustics={"hf": {"range_m": 80.0}})
    result = simulate(run, 1)
    frames = result.tables["broadcasts"]
    assert all(len(asvs) == 1 for asvs in sent_at_once(result).values())
    assert frames.fixes[:2].tolist() == [3, 1]
    assert frames.sent_at_s[1] - frames.sent_at_s[0] == pytest.approx(0.448 + 0.05)
    assert result.tables["rounds"].downlink_s[0] == pytest.approx(0.74)
    assert "collided" not in set(result.tables["frame_receptions"].outcome)


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round", "pipelined_group"])
@pytest.mark.parametrize("payload_bytes", [None, 24])
def test_frames_of_listeners_of_their_own_never_collide(
    downlink: str, payload_bytes: int | None
) -> None:
    """Wherever AUVs hold still: each frame has one outcome at each AUV, and none is collided."""
    for seed in range(6):
        draw = np.random.default_rng(seed)
        auvs, asvs = (draw.uniform(-250.0, 250.0, (n, 2)).tolist() for n in (12, 7))
        run = pairs(
            asvs, auvs, duration_s=20.0, survey={"side_m": 500.0},
            acoustics={"hf": {"range_m": 150.0}, "mf": {"payload_bytes": payload_bytes}},
            protocol={"downlink": downlink, "shortest_downlink_slot_s": 0.0},
        )  # fmt: skip
        result = simulate(run, seed)
        frames, table = result.tables["broadcasts"], result.tables["frame_receptions"]
        assert len(table) == 12 * len(frames)
        assert set(table.outcome) <= {"heard", "out_of_range", "in_flight"}
        assert max(map(len, sent_at_once(result).values())) > 1
        assert not any(_overlaps(own) for _, own in frames.groupby("asv"))


def _overlaps(own: pd.DataFrame) -> int:
    """Return how often an ASV begins a frame before its last one is over."""
    ends = (own.sent_at_s + own.airtime_s).to_numpy()[:-1]
    return int((own.sent_at_s.to_numpy()[1:] < ends - 1e-9).sum())


def test_wrong_beliefs_let_frames_collide_and_it_is_told() -> None:
    """AUV1 passes the edge of ASV1's range between its ping and the broadcast of its fix."""
    still = [[[x, 5.0], [x + 0.5, 5.0]] for x in (0.0, 150.0)]
    ways = [still[0], [[20.0, 0.0], [120.0, 0.0]], still[1]]
    run = scenario(
        duration_s=15.0,
        survey={"side_m": 60.0},
        auvs={
            "count": 3, "speed_m_per_s": 5.0,
            "vehicle": {"model": "kinematic", "turning_radius_m": 0.1},
            "route": {"kind": "waypoints", "points_m": ways},
        },
        asvs={
            "count": 2,
            "formation": {"model": "positions", "positions_m": [[0.0, 0.0], [150.0, 0.0]]},
        },
        acoustics={"loss": {"law": "none"}, "mf": {"range_m": 100.0}, "hf": {"range_m": 80.0}},
        protocol={
            "broadcaster": "parallel", "positions": "last_fix", "downlink": "pipelined_round",
        },
    )  # fmt: skip
    result = simulate(run, 1)
    fixes = result.tables["fixes"]
    collided = fixes[fixes.outcome == "collided"]
    assert set(collided.auv) == {"AUV1"}
    assert collided.x_m.to_numpy() == pytest.approx(50.0, abs=6.0)
    auv = result.tables["auvs"].set_index("auv").loc["AUV1"]
    assert auv.fixes_lost == len(collided)
    told = explained(result, fix=int(collided.fix.iloc[0]))
    assert "overlapped by the frame of ASV1 from" in " ".join(told.split())


def test_a_mission_that_is_stepped_through_is_the_same() -> None:
    """Looks and waits change nothing; several frames are on the air at once."""
    run = pairs([[0.0, 0.0], [400.0, 0.0]])
    mission, most = Mission(run, 1), 0
    for time in np.linspace(0.1, 8.0, 60):
        mission.advance(float(time))
        most = max(most, len(mission.broadcasts_on_air()))
    stepped, whole = mission.result(), simulate(run, 1)
    assert most == 2
    for name, table in whole.tables.items():
        pd.testing.assert_frame_equal(table, stepped.tables[name], check_exact=True)


def test_the_band_is_in_use_while_any_frame_is_on_the_air() -> None:
    """Two frames at once use it once."""
    result = simulate(pairs([[0.0, 0.0], [400.0, 0.0]]), 1)
    frames = result.tables["broadcasts"].drop_duplicates("sent_at_s")
    used = np.minimum(frames.airtime_s, 8.0 - frames.sent_at_s).sum() / 8.0
    assert result.tables["mission"].mf_utilisation[0] == pytest.approx(used)


def test_an_asv_that_has_failed_by_its_turn_sends_nothing() -> None:
    """ASV1 fails while ASV0 sends: its frame is never on the air, its fixes are lost."""
    auvs = [[0.0, 0.0], [5.0, 0.0], [150.0, 0.0], [74.0, 0.0]]

    def flown(*failures: Any) -> Result:
        hears = {"hf": {"range_m": 80.0}}
        asvs = [[0.0, 0.0], [150.0, 0.0]]
        return simulate(pairs(asvs, auvs, fail=failures, acoustics=hears, duration_s=3.0), 1)

    second = flown().tables["broadcasts"].sent_at_s[1]
    result = flown({"asv": 1, "at_s": second - 0.1})
    frames, fixes = result.tables["broadcasts"], result.tables["fixes"]
    assert (frames.asv[1], frames.airtime_s[1]) == ("ASV1", 0.0)
    lost = fixes[fixes.broadcast_by == "ASV1"]
    assert set(lost.outcome) == {"lost"}
    assert "ASV1 had failed" in explained(result, fix=int(lost.fix.iloc[0]))
    assert set(frames.asv[2:]) == {"ASV0"}
