"""Echoes of pings in missions: they fade and turn what they blend into, and drown others later."""

import math
from typing import Any

import numpy as np
import pytest
from commands_for_tests import explained
from worlds import QUIET_NAVIGATION, QUIET_USBL, merged, scenario

from bindusbl_des import Scenario, Setup, simulate, verify, warnings_of
from bindusbl_des.acoustics.channel import between
from bindusbl_des.acoustics.sonar_channel import EchoingSonar, Sea, blended, echoes
from bindusbl_des.acoustics.sonar_equation import link_budget
from bindusbl_des.scenario.channel_settings import PingSonar
from bindusbl_des.verification.verdict_text import verdict_text

LOUD: dict[str, Any] = {"model": "sonar", "shadowing_sd_db": 0.0, "snr_threshold_db": 10.0}


def holding(*places: tuple[float, float], channel: dict[str, Any], **changes: Any) -> Scenario:
    """Return AUVs that hold still 10 m deep, heard by an ASV at the origin without noise."""
    base = {
        "duration_s": 20.0,
        "survey": {"side_m": 60.0, "depth_m": 10.0},
        "auvs": {"count": len(places), "route": {"kind": "hold", "positions_m": list(places)}},
        "asvs": {"count": 1},
        "acoustics": {"hf": {"range_m": 50.0, "channel": {**LOUD, **channel}}},
        "usbl": {**QUIET_USBL, "gnss_sd_m": 0.0},
        "navigation": QUIET_NAVIGATION,
        "record": {"detail": "full"},
    }
    return scenario(**merged(base, changes))


def outcomes(world: Scenario, auv: str) -> set[str]:
    met = simulate(world, 1).tables["receptions"]
    return set(met[met.auv == auv].outcome) - {"in_flight"}


def test_the_echo_of_a_ping_drowns_another() -> None:
    """AUV0's ping by way of surface and bottom comes 21.7 ms after the straight one, AUV1's 20.7;
    one that is 6 dB above it survives where the stronger does.
    """
    near, far = (math.sqrt(20.0**2 - 100.0), 0.0), (0.0, -math.sqrt(51.0**2 - 100.0))
    sea: dict[str, Any] = {"bottom_m": 20.0, "interference_db": 0.0}
    hf = {"acoustics": {"hf": {"range_m": 45.0}, "mf": {"range_m": 100.0}}}
    found = [
        outcomes(holding(near, far, channel=it, **hf), "AUV1")
        for it in ({}, sea, {**sea, "capture_db": 6.0})
    ]
    assert found == [{"heard"}, {"collided"}, {"heard"}]
    assert outcomes(holding(near, far, channel=sea, **hf), "AUV0") == {"heard"}
    result = simulate(holding(near, far, channel=sea, **hf), 1)
    assert "overlaps the echo of ping 0 of AUV0" in explained(result, ping=1)
    verdict = verify(holding(near, far, channel=sea, **hf))
    told = " ".join(verdict_text(verdict).split())
    assert verdict.verdict == "undecided"
    assert "not proved safe, and signals are lost" in told
    assert "(round 0, slot 0) was overlapped at ASV0." in told


def test_a_ping_fades_and_turns_as_its_echoes_do() -> None:
    """What a matched filter of 1 / B makes of ping and echoes, from levels to fixes."""
    for away in np.linspace(100.0, 400.0, 7):
        world = holding(
            (away, 0.0), channel={"bottom_m": 30.0},
            acoustics={"hf": {"range_m": 450.0}, "mf": {"range_m": 500.0}},
        )  # fmt: skip
        tables = simulate(world, 1).tables
        found = echoes(Sea(30.0), 25.0, away, 10.0, 0.5)
        straight, reach = math.hypot(away, 9.5), math.hypot(away, 10.0)
        blend = blended(found, -9.5 / straight, 10.0)
        met = tables["receptions"].query("outcome == 'heard'")
        level = float(link_budget(PingSonar()).snr_db(reach)) + 20.0 * math.log10(blend.amplitude)
        assert np.allclose(met.snr_db, level, atol=0.01)
        fix = tables["fixes"].iloc[0]
        sine = 10.0 / reach - 9.5 / straight - float(blend.from_above)
        heard_at = reach + 1500.0 * float(blend.later_s)
        assert fix.x_m == pytest.approx(heard_at * math.sqrt(1.0 - sine**2), abs=0.05)
        assert fix.y_m == pytest.approx(0.0, abs=1e-6)


def test_there_are_outliers_where_echoes_cancel_pings() -> None:
    """Over ranges of a wave of the pattern: most directions are a bit off, a few are far off."""
    settings = {**LOUD, "bottom_m": 30.0}
    world = holding((200.0, 0.0), channel=settings)
    channel = Setup(world).ping_channel
    assert isinstance(channel, EchoingSonar)
    away = np.linspace(150.0, 400.0, 20_001)
    auvs = np.column_stack((away, np.zeros_like(away), np.full_like(away, 10.0)))
    told, found = channel.heard(between(0.0, auvs, np.zeros((1, 3)), 500.0, calling=False))
    off, fade = np.abs(found["lowered"][:, 0]), told["snr_db"][:, 0]
    fade -= channel.plain.prospects(between(0.0, auvs, np.zeros((1, 3)), 500.0, False))["snr_db"][
        :, 0
    ]
    assert np.corrcoef(off > 3.0 * np.median(off), fade)[0, 1] < 0.0
    assert np.median(off) < 0.2
    assert off.max() > 3.0 * np.median(off)
    near = between(0.0, auvs[:5] * [0.1, 1.0, 1.0], np.zeros((1, 3)), 500.0, calling=False)
    assert np.isnan(channel.heard(near)[1]["lowered"]).all()  # echoes come apart
    by = np.array([[37.0, -12.0, 0.0]])  # elsewhere in the sea it is the same
    moved = channel.heard(between(0.0, auvs[:50] + by, by, 500.0, calling=False))[1]
    assert moved["lowered"] == pytest.approx(found["lowered"][:50], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("ranging", "lasting"),
    [
        ("owtt_sync", 0.0),
        pytest.param("twtt", 1.0, marks=pytest.mark.slow),
        pytest.param("owtt_sync", 1.0, marks=pytest.mark.slow),
        pytest.param("twtt", 0.0, marks=pytest.mark.slow),
    ],
)
def test_fixes_go_astray_by_echoes_however_they_are_ranged(ranging: str, lasting: float) -> None:
    """Each setting of the echoes changes them; passive ranging knows none, and is told so."""
    errors = {}
    for name, value in {"": 0.0, "surface_sd_m": 0.02, "transducer_m": 0.7, "none": None}.items():
        channel = {"bottom_m": 30.0, **({name: value} if name not in ("", "none") else {})}
        world = holding(
            (120.0, 0.0), channel={} if name == "none" else channel,
            protocol={"ranging": ranging}, usbl={"misalignment_sd_deg": lasting},
            acoustics={"hf": {"range_m": 150.0}, "mf": {"range_m": 200.0}},
        )  # fmt: skip
        errors[name] = simulate(world, 1).tables["fixes"].error_m.mean()
    assert len({round(it, 4) for it in errors.values()}) == 4
    quiet = holding((20.0, 0.0), channel={"bottom_m": 30.0}, protocol={"ranging": "passive"})
    assert "acoustics.hf.channel.bottom_m" in {it.key for it in warnings_of(quiet)}


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ({"transducer_m": 1.0}, "add bottom_m"),
        ({"bottom_m": 9.0}, "ends above the survey"),
        ({"bottom_m": 30.0, "transducer_m": 30.0}, "lies on the bottom"),
    ],
)
def test_a_sea_that_cannot_be_is_refused(channel: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        holding((20.0, 0.0), channel=channel)
