"""A band's channel is that of its modem: its levels, and how long its frames are."""

from typing import Any

import numpy as np
import pytest

from bindusbl_des import Scenario, Setup, Signals, simulate


def bands(**acoustics: Any) -> Scenario:
    """Return the default scenario with other bands."""
    return Scenario.model_validate({"name": "m", "acoustics": acoustics})


def snr_db(channel: Any, away: float = 300.0) -> float:
    """Return the SNR (dB) over a range (m)."""
    assert channel is not None
    ranges = np.full((1, 1), away)
    signals = Signals(0.0, np.zeros((1, 3)), np.array([[away, 0.0, 0.0]]), ranges, 50.0, False)
    return float(channel.prospects(signals)["snr_db"][0, 0])


def test_the_figures_of_a_modem_stand_for_settings_of_the_sonar() -> None:
    """The ahoi modem: 156 dB at 50 kHz in 25 kHz; a level that is given wins."""
    sheet = {"source_level_db": 156.0, "frequency_khz": 50.0, "bandwidth_khz": 25.0}
    named = Setup(
        bands(hf={"modem": "ahoi", "channel": {"model": "sonar", "ph": 8.1}})
    ).ping_channel
    said = Setup(bands(hf={"channel": {"model": "sonar", **sheet}})).ping_channel
    assert (
        snr_db(named) == snr_db(said) < snr_db(Setup(bands(hf={"channel": "sonar"})).ping_channel)
    )
    louder = {"model": "sonar", "source_level_db": 166.0}
    given = Setup(bands(hf={"modem": "ahoi", "channel": louder})).ping_channel
    assert snr_db(given) == pytest.approx(snr_db(said) + 10.0)


def test_bits_of_frames_are_sent_as_long_as_the_table_says() -> None:
    """A frame of 56 B in 0.770 s has less energy for each bit than one sent in 1.54 s."""
    sonar = {"model": "sonar", "decoding": "bpsk", "source_level_db": 125.0, "shadowing_sd_db": 0.0}
    table, same, slower = (
        _loss(bands(mf={**modem, "channel": sonar}))
        for modem in (
            {"modem": "s2c_instant"},
            {"bit_rate_bps": 56 * 8 * 2 / 0.770201},
            {"bit_rate_bps": 56 * 8 / 0.770201},
        )
    )
    assert table == pytest.approx(same)
    assert slower < table


def _loss(scenario: Scenario) -> float:
    channel_of, airtime = Setup(scenario).frame_channel, Setup(scenario).slots.airtime(3)
    assert channel_of is not None
    ranges = np.full((1, 1), 300.0)
    signals = Signals(0.0, np.zeros((1, 3)), np.array([[300.0, 0.0, 0.0]]), ranges, 100.0, True)
    return float(channel_of(56, airtime).prospects(signals)["loss"][0, 0])


def test_a_frame_without_header_and_fixes_is_a_frame() -> None:
    """Where no ping was heard, what is sent after it has no bytes at all."""
    mf = {"channel": {"model": "sonar", "decoding": "dpsk"}, "header_bytes": 0}
    acoustics = {"hf": {"range_m": 1.0}, "mf": mf}
    data = {"name": "m", "acoustics": acoustics, "duration_s": 20.0}
    sent = simulate(Scenario.model_validate(data), 0).arrow["broadcasts"]
    assert 0 in sent["fixes"].to_pylist()
