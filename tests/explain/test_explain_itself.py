"""Chains of passive ranging: an ASV's ping at all AUVs, and the fix that one of them made of it."""

import math

import pytest
from explain_for_tests import chain_of_fix, chain_of_ping
from test_explain import PLANE_WAVE, step
from worlds import QUIET_NAVIGATION, QUIET_USBL, merged, scenario

from bindusbl_des import Result, simulate

WORLD = {
    "duration_s": 3.0,
    "survey": {"side_m": 60.0},
    "auvs": {"count": 3, "route": {"kind": "hold",
                                   "positions_m": [[20.0, 0.0], [0.0, 63.2], [-30.0, 0.0]]}},
    "asvs": {"count": 1},
    "acoustics": {"loss": {"law": "none"}},
    "navigation": QUIET_NAVIGATION,
    "usbl": QUIET_USBL,
    "protocol": {"ranging": "passive"},
}  # fmt: skip


@pytest.fixture(scope="module")
def heard() -> Result:
    """Of three AUVs two are within the HF range of 50 m."""
    return simulate(scenario(**WORLD), 1)


def test_a_ping_is_told_at_every_auv(heard: Result) -> None:
    """Horizontal 20 m and 30 m are within, 63.2 m beyond the range; slant ranges are 10 m deep."""
    chain = chain_of_ping(heard, 0)
    assert (chain.asv, chain.auv, chain.fix) == ("ASV0", None, None)
    assert chain.told == "AUV0, AUV2 fix themselves by it (fixes 0, 1)"
    near, far = step(chain, "AUV0"), step(chain, "AUV1")
    assert near.why.startswith("horizontal range 20.0 m <= 50 m HF range; no other ping overlaps")
    assert far.why == "horizontal range 63.2 m > 50 m HF range"
    assert near.time_s == pytest.approx(math.hypot(20.0, 10.0) / 1500.0)
    assert [it.time_s for it in chain.steps] == sorted(it.time_s for it in chain.steps)
    assert chain.text().startswith("Ping 0 of ASV0: AUV0, AUV2 fix themselves by it")


def test_a_fix_is_told_of_its_auv_alone(heard: Result) -> None:
    """The way down and the ping's own length make the latency; nobody broadcasts."""
    chain = chain_of_fix(heard, 1)
    assert (chain.asv, chain.auv, chain.fix, chain.outcome) == ("ASV0", "AUV2", 1, "delivered")
    assert {it.who for it in chain.steps} == {"Round 0", "ASV0", "AUV2", "Fix 1"}
    assert [part.duration_s for part in chain.parts] == pytest.approx(
        [math.hypot(30.0, 10.0) / 1500.0, 0.010]
    )
    assert step(chain, "Fix 1").facts["error_m"] < PLANE_WAVE
    assert "is made by AUV2 itself, of where it was as the ping" in chain_of_fix(heard, 1).text()


@pytest.mark.parametrize(
    ("changes", "outcome", "told"),
    [
        ({"acoustics": {"hf": {"range_m": 5.0}}}, "out_of_range",
         "no fix: every AUV is out of HF range (5 m horizontal)"),
        ({"duration_s": 0.02}, "in_flight", "no fix: the mission ends while it is under way"),
    ],
)  # fmt: skip
def test_a_ping_without_fixes_is_told_why(changes: dict, outcome: str, told: str) -> None:
    chain = chain_of_ping(simulate(scenario(**merged(WORLD, changes)), 1), 0)
    assert (chain.outcome, chain.told) == (outcome, told)


def test_what_was_wrong_all_the_time_is_told() -> None:
    """The AUV's own array and clock, and where the ASV took itself for."""
    systematic = {
        "usbl": {"misalignment_sd_deg": 3.0, "gnss_correlated_sd_m": 0.8},
        "navigation": {"clock_offset_sd_s": 1e-3},
    }
    result = simulate(scenario(**merged(WORLD, systematic)), 1)
    facts = step(chain_of_fix(result, 1), "Fix 1").facts
    assert {"AUV2_misalignment_deg", "ASV0_gnss_x_m", "ASV0_gnss_y_m", "clock_late_s"} <= set(facts)
    way = "short" if facts["clock_late_s"] > 0 else "long"
    told = step(chain_of_fix(result, 1), "Fix 1").why
    longer = -1500.0 * facts["clock_late_s"]
    assert f"ranges {longer:+.2f} m too long" in told, way
