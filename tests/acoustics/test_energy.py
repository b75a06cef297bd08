"""What modems draw, worked by hand for vehicles that hold still."""

from typing import Any

import numpy as np
import pytest
from worlds import still

from bindusbl_des import Result, simulate
from bindusbl_des.acoustics.energy import on_mf
from bindusbl_des.records.events import Broadcast

HF = {"transmit_w": 20.0, "receive_w": 2.0, "idle_w": 0.5}
MF = {"transmit_w": 10.0, "receive_w": 1.0, "idle_w": 0.1}


def flown(acoustics: dict[str, Any], count: int = 2, **changes: Any) -> Result:
    """Return ten seconds of AUVs 20 m from an ASV that hears all."""
    return simulate(still(count, duration_s=10.0, acoustics=acoustics, **changes))


def test_pings_cost_who_sends_and_who_hears() -> None:
    """An AUV sends 10 ms for each of its pings and waits else; the ASV hears all of them."""
    result = flown({"hf": HF, "loss": {"law": "none"}})
    pings = result.auvs.pings.tolist()
    assert result.auvs.energy_j.tolist() == pytest.approx(
        [20.0 * 0.01 * n + 0.5 * (10.0 - 0.01 * n) for n in pings]
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
    """Frames of 2 s from 0 s and from 1.5 s on last 3.5 s together at an AUV in range of both."""
    frames = [Broadcast(0, 0, 0.0, 2.0, 8, 0), Broadcast(0, 1, 1.5, 2.0, 8, 0)]
    auvs, asvs = np.array([[0.0, 0.0], [80.0, 0.0]]), np.array([[20.0, 0.0], [-20.0, 0.0]])
    heard, sent = on_mf(frames, (lambda _: auvs, lambda _: asvs), 90.0, 60.0)
    assert heard.receiving.tolist() == [3.5, 2.0]
    assert sent.sending.tolist() == [2.0, 2.0]


def test_who_is_out_of_range_only_waits() -> None:
    """Frames that do not reach an AUV cost it nothing; nor has it a fix to divide by."""
    result = flown({"mf": {**MF, "range_m": 5.0}, "loss": {"law": "none"}})
    assert result.auvs.energy_j.tolist() == pytest.approx([1.0, 1.0])
    assert result.auvs.energy_per_fix_j.isna().all()
    assert result.mission.energy_per_fix_j.isna().all()


def test_calls_are_sent_and_heard() -> None:
    """With two-way ranging an AUV hears a call for each ping, and the ASV sends it."""
    result = flown({"hf": HF, "loss": {"law": "none"}}, 1, protocol={"ranging": "twtt"})
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


def test_a_modem_that_waits_draws_as_one_that_receives_unless_told() -> None:
    """The Micromodem's sheet has 158 mW: ten seconds of it, and of frames nothing more."""
    result = flown({"mf": {"modem": "micromodem_psk6"}})
    assert result.auvs.energy_j.tolist() == pytest.approx([1.58, 1.58])


def test_without_powers_energy_is_not_told() -> None:
    """Null, not 0: what a modem draws is not known unless somebody says so."""
    result = flown({"mf": {"receive_w": 1.0}})
    assert result.auvs.energy_j.isna().all()
    assert result.mission.energy_j.isna().all()
