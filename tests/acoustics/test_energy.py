"""What modems draw, worked by hand for vehicles that hold still."""

from typing import Any

import pytest
from played_for_tests import at, played
from worlds import scenario, still

from bindusbl_des import Result, simulate

HF = {"transmit_w": 20.0, "receive_w": 2.0, "idle_w": 0.5}
MF = {"transmit_w": 10.0, "receive_w": 1.0, "idle_w": 0.1}


def flown(acoustics: dict[str, Any], count: int = 2, **changes: Any) -> Result:
    """Return ten seconds of AUVs 20 m from an ASV that hears all."""
    return simulate(still(count, duration_s=10.0, acoustics=acoustics, **changes))


def test_pings_cost_who_sends_and_who_hears() -> None:
    """An AUV sends 10 ms for each of its pings, receives those of the other beside it, and waits
    else; the ASV hears all of them.
    """
    result = flown({"hf": HF, "loss": {"law": "none"}})
    pings = result.auvs.pings.tolist()
    assert result.auvs.energy_j.tolist() == pytest.approx(
        [
            20.0 * 0.01 * own + 2.0 * 0.01 * other + 0.5 * (10.0 - 0.01 * (own + other))
            for own, other in (pings, pings[::-1])
        ]
    )
    heard = 0.01 * sum(pings)
    asv = 2.0 * heard + 0.5 * (10.0 - heard)
    assert result.mission.energy_j[0] == pytest.approx(result.auvs.energy_j.sum() + asv)


def test_frames_cost_the_vessel_and_all_in_range() -> None:
    """Each frame is heard by both AUVs; the last is cut off by the mission's end."""
    result = flown({"mf": MF, "loss": {"law": "none"}})
    frames = result.tables["broadcasts"]
    on_air = (frames.sent_at_s + frames.airtime_s).clip(upper=10.0).sub(frames.sent_at_s).sum()
    auv, asv = (watts * on_air + 0.1 * (10.0 - on_air) for watts in (1.0, 10.0))
    assert result.auvs.energy_j.tolist() == pytest.approx([auv, auv])
    assert result.mission.energy_j[0] == pytest.approx(2 * auv + asv)
    fixes = result.auvs.fixes_delivered
    assert result.auvs.energy_per_fix_j[0] == pytest.approx(auv / fixes[0])
    assert result.mission.energy_per_fix_j[0] == pytest.approx((2 * auv + asv) / fixes.sum())


def test_who_receives_two_frames_at_once_does_so_once() -> None:
    """Frames from 1 s on and from 2.5 s on, which overlap, at an AUV in range of both."""
    world = played(
        [at(0.0), at(500.0)], [at(20.0), at(-20.0)], pings=[(0.01, 0)],
        frames=[(1.0, 0), (2.5, 1)], airtime=2.0, acoustics={"mf": {**MF, "range_m": 90.0}},
    )  # fmt: skip
    result = simulate(world)
    airtimes = result.tables["broadcasts"].airtime_s
    on_air = 1.5 + airtimes[1]  # from 1 s to the end of the second
    assert airtimes.tolist() == pytest.approx([2.0, 2.0 / 3.0])  # the second tells of nothing
    auv = 1.0 * on_air + 0.1 * (10.0 - on_air)
    assert result.auvs.energy_j.tolist() == pytest.approx([auv, 1.0], abs=1e-6)
    asvs = 10.0 * airtimes.sum() + 1.0 * airtimes.sum() + 0.1 * (20.0 - 2.0 * airtimes.sum())
    assert result.mission.energy_j[0] == pytest.approx(auv + 1.0 + asvs, abs=1e-6)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt", "passive"])
def test_all_that_is_sent_within_range_is_received(ranging: str) -> None:
    """Two AUVs and two ASVs within range of each other, a third of each beyond: whatever one of
    four sends, pings, calls or frames, three receive.
    """
    places, stations = [[0.0, 0.0], [9.0, 0.0], [900.0, 0.0]], [[0.0, 9.0], [9.0, 9.0], [2e3, 0.0]]
    result = simulate(
        scenario(
            duration_s=20.0,
            auvs={"count": 3, "route": {"kind": "hold", "positions_m": places}},
            asvs={"count": 3, "formation": {"positions_m": stations}},
            acoustics={"hf": HF, "mf": MF, "loss": {"law": "none"}},
            protocol={"ranging": ranging, "schedule": "one_per_slot"},
        ),
        1,
    )
    pings, frames = result.tables["pings"], result.tables["broadcasts"]
    answered = pings.call.isna() | (pings.call == "heard")
    senders = pings[("asv" if ranging == "passive" else "auv")][answered].tolist()
    senders += pings[["called_at_s", "called_by"]].drop_duplicates().called_by.dropna().tolist()
    near = sum(it not in ("AUV2", "ASV2") for it in senders)
    on_mf = frames.airtime_s[frames.asv != "ASV2"].sum()
    drawn = len(senders) * 0.01 * (20.0 - 0.5) + near * 3 * 0.01 * (2.0 - 0.5) + 6 * 20.0 * 0.5
    if ranging != "passive":
        drawn += frames.airtime_s.sum() * (10.0 - 0.1) + 3 * on_mf * (1.0 - 0.1) + 6 * 20.0 * 0.1
    assert result.mission.energy_j[0] == pytest.approx(drawn, rel=2e-3)  # one may be under way


def test_who_is_out_of_range_only_waits() -> None:
    """Frames that do not reach an AUV cost it nothing; nor has it a fix to divide by."""
    result = flown({"mf": {**MF, "range_m": 5.0}, "loss": {"law": "none"}})
    assert result.auvs.energy_j.tolist() == pytest.approx([1.0, 1.0])
    assert result.auvs.energy_per_fix_j.isna().all()
    assert result.mission.energy_per_fix_j.isna().all()


def test_calls_are_sent_and_heard() -> None:
    """With two-way ranging an AUV hears a call for each ping, and the ASV sends it: 20 m away on
    the level, by which range goes, and 22 m along the slant.
    """
    acoustics = {"hf": {**HF, "range_m": 21.0}, "loss": {"law": "none"}}
    result = flown(acoustics, 1, protocol={"ranging": "twtt"})
    pings = len(result.tables["pings"])
    busy = 0.01 * pings
    each = 20.0 * busy + 2.0 * busy + 0.5 * (10.0 - 2 * busy)
    assert result.auvs.energy_j[0] == pytest.approx(each, rel=2e-3)  # one may be under way
    assert result.mission.energy_j[0] == pytest.approx(2 * each, rel=2e-3)


def test_passive_auvs_only_listen() -> None:
    """The ASV pings, AUVs hear; nothing is broadcast, so powers of MF count for nothing."""
    result = flown({"hf": HF, "mf": MF, "loss": {"law": "none"}}, protocol={"ranging": "passive"})
    sent = 0.01 * len(result.tables["pings"])
    auv = 2.0 * sent + 0.5 * (10.0 - sent)
    asv = 20.0 * sent + 0.5 * (10.0 - sent)
    assert result.auvs.energy_j.tolist() == pytest.approx([auv, auv], rel=1e-2)
    assert result.mission.energy_j[0] == pytest.approx(2 * auv + asv, rel=1e-2)


def test_energy_is_told_where_an_asv_fails_and_nobody_is_called() -> None:
    """The AUV sends its pings of 10 ms and waits else."""
    failing = {"count": 1, "failures": [{"asv": 0, "at_s": 5.0}]}
    result = flown({"hf": HF, "loss": {"law": "none"}}, 1, asvs=failing)
    sent = 0.01 * result.auvs.pings[0]
    assert sent > 0.0
    assert result.auvs.energy_j.tolist() == pytest.approx([20.0 * sent + 0.5 * (10.0 - sent)])


def test_a_modem_that_waits_draws_as_one_that_receives_unless_told() -> None:
    """The Micromodem's sheet has 158 mW: ten seconds of it, and of frames nothing more."""
    result = flown({"mf": {"modem": "micromodem_psk6"}})
    assert result.auvs.energy_j.tolist() == pytest.approx([1.58, 1.58])


def test_without_powers_energy_is_not_told() -> None:
    """Null, not 0: what a modem draws is not known unless somebody says so."""
    result = flown({"mf": {"receive_w": 1.0}})
    assert result.auvs.energy_j.isna().all()
    assert result.mission.energy_j.isna().all()
