"""Echoes of pings in missions: they fade and turn what they blend into, and drown others later."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from commands_for_tests import call, explained
from played_for_tests import at, moving, played
from worlds import LOUD, holding

from bindusbl_des import Scenario, simulate, verify, warnings_of


def outcomes(world: Scenario, auv: str) -> set[str]:
    met = simulate(world, 1).tables["receptions"]
    return set(met[met.auv == auv].outcome) - {"in_flight"}


def test_the_echo_of_a_ping_drowns_another(tmp_path: Path) -> None:
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
    world = holding(near, far, channel=sea, **hf)
    assert verify(world).verdict == "undecided"
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(world.model_dump(mode="json")))
    told = " ".join(call("verify", tmp_path / "m.yaml").output.split())
    assert "not proved safe, and signals are lost" in told
    assert "(round 0, slot 0) was overlapped at ASV0." in told


def test_there_are_outliers_where_echoes_cancel_pings() -> None:
    """Over ranges of a wave of the pattern: most directions are a bit off, a few are far off."""

    def told(shift: float, **channel: Any) -> pd.DataFrame:
        world = played(
            [moving(150.0 + shift, 1.0, z=10.0)], [at(shift)], duration_s=100.0,
            ranging="owtt_sync", downlink="sequential", airtime=0.05, usbl={"gnss_sd_m": 0.0},
            acoustics={"hf": {"range_m": 500.0, "channel": {**LOUD, **channel}}},
            protocol={"shortest_uplink_slot_s": 0.0, "broadcaster": "rotate"},
        )  # fmt: skip
        tables = simulate(world, 1).tables
        met = tables["receptions"].query("outcome == 'heard'").merge(
            tables["pings"][["ping", "x_m", "z_m"]], on="ping"
        )  # fmt: skip
        straight = np.degrees(np.arctan2(met.z_m, met.x_m - shift))
        return met.assign(off_deg=met.elevation_deg - straight)

    plain, echoing = told(0.0), told(0.0, bottom_m=30.0)
    assert len(plain) == len(echoing) > 100
    assert plain.off_deg.abs().max() < 0.2
    off, fade = echoing.off_deg.abs(), echoing.snr_db - plain.snr_db
    assert np.corrcoef(off > 3.0 * off.median(), fade)[0, 1] < 0.0
    assert off.max() > 3.0 * off.median()
    elsewhere = told(37.0, bottom_m=30.0)  # in the sea it is the same
    assert elsewhere.off_deg.to_numpy() == pytest.approx(echoing.off_deg.to_numpy(), abs=1e-6)
    near = [
        simulate(holding((15.0, 0.0), channel=it), 1).tables["receptions"].elevation_deg
        for it in ({}, {"bottom_m": 30.0})
    ]
    assert near[0].equals(near[1])  # echoes come apart


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
