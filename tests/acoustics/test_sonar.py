"""The sonar equation, noise, detection and frames against outside numbers."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy import special, stats  # type: ignore[import-untyped,unused-ignore]

from bindusbl_des.core.acoustics.sonar_equation import (
    SoundMessage,
    ambient_noise_db,
    chance_decoded,
    detected,
    frame_error,
    link_budget,
    timing_sd_s,
)
from bindusbl_des.core.acoustics.sound_settings import Sonar

REFERENCE = Path(__file__).parents[1] / "reference"
CHECKS = json.loads((REFERENCE / "physics_checks.json").read_text())
PING = SoundMessage(0.010)
USUAL = link_budget(Sonar())
DETECTORS = ("non_coherent", "coherent", "rayleigh")


def check(name: str) -> float:
    return float(CHECKS[name]["value"])


def ratio(decibels: float) -> float:
    return float(10.0 ** (decibels / 10.0))


@pytest.mark.parametrize(
    ("frequency", "shipping", "wind", "level"),
    [
        (25.0, 0.5, 5.0, 38.548078),
        (25.0, 0.5, 0.0, 22.307034),
        (25.0, 0.5, 10.0, 45.484984),
        (10.0, 0.5, 5.0, 46.089937),
        (150.0, 0.5, 5.0, 29.640516),
    ],
)
def test_noise_table(frequency: float, shipping: float, wind: float, level: float) -> None:
    """The sea is as loud as tabulated, in calm and in storm, from 10 to 150 kHz."""
    assert ambient_noise_db(frequency, shipping, wind) == pytest.approx(level, abs=1e-6)


def test_checks() -> None:
    """Noise, SNR and detection agree with independent values to nine digits."""
    assert ambient_noise_db(25.0) == pytest.approx(check("wenz(25,.5,5)"), rel=1e-9)
    for reach in (50, 1000):
        assert USUAL.snr_db(reach) == pytest.approx(check(f"snr({reach})"), rel=1e-9)
    found = detected(ratio(10.0), 1e-4)
    assert found == pytest.approx(check("pd_nc(10dB,1e-4)"), rel=1e-9)


@pytest.mark.parametrize(
    ("reach", "loss", "snr"),
    [
        (50.0, 34.230088, 67.221835),
        (100.0, 40.501375, 60.950547),
        (500.0, 56.486276, 44.965646),
        (1000.0, 65.013753, 36.438170),
        (3500.0, 88.429495, 13.022427),
    ],
)
def test_snr_table(reach: float, loss: float, snr: float) -> None:
    """A 180 dB source at 25 kHz is heard over 50 m to 3.5 km as tabulated."""
    assert USUAL.snr_db(reach) == pytest.approx(snr, abs=1e-6)
    assert USUAL.level_db(reach) == pytest.approx(180.0 - loss, abs=1e-6)


def test_practical_spreading() -> None:
    """Spread over k = 1.5, the same sound is louder."""
    practical = link_budget(Sonar(spreading=1.5))
    for reach, loss, snr in ((50.0, 25.735238, 75.716685), (1000.0, 50.013753, 51.438170)):
        assert practical.level_db(reach) == pytest.approx(180.0 - loss, abs=1e-6)
        assert practical.snr_db(reach) == pytest.approx(snr, abs=1e-6)


def test_ranges_of_snr() -> None:
    """10, 15 and 20 dB are left at 3910.638, 3239.540 and 2613.983 m."""
    for snr, reach in ((10.0, 3910.638), (15.0, 3239.540), (20.0, 2613.983)):
        assert USUAL.snr_db(reach) == pytest.approx(snr, abs=1e-5)


def test_source_levels_of_short_ranges() -> None:
    """15 dB at 50 and 100 m need sources of 127.778 and 134.049 dB only."""
    for reach, level in ((50.0, 127.778), (100.0, 134.049)):
        assert 15.0 - USUAL.snr_db(reach) + 180.0 == pytest.approx(level, abs=5e-4)


def test_ns3_has_the_same_loss_and_noise() -> None:
    """Thorp's loss and the default noise are those of ns-3 3.44, to the last digit it prints."""
    with (REFERENCE / "ns3_sonar.csv").open() as file:
        rows = [{key: float(it) for key, it in row.items()} for row in csv.DictReader(file)]
    assert len(rows) == 135
    for row in rows:
        frequency, spreading = row["frequency_khz"], row["spreading"]
        noise = ambient_noise_db(frequency, row["shipping"], row["wind_m_per_s"])
        assert noise == pytest.approx(row["noise_db"], abs=1e-12)
        sonar = Sonar(
            frequency_khz=frequency, bandwidth_khz=0.001, source_level_db=170.0,
            spreading=spreading, absorption="thorp", shipping=row["shipping"],
            wind_m_per_s=row["wind_m_per_s"],
        )  # fmt: skip
        loss = 170.0 - link_budget(sonar).level_db(row["range_m"])
        assert loss == pytest.approx(row["path_loss_db"], abs=1e-12)
        chain = 170.0 - row["path_loss_db"] - row["noise_db"]  # in a band of 1 Hz
        assert link_budget(sonar).snr_db(row["range_m"]) == pytest.approx(chain, abs=2e-12)


def test_nobody_is_nearer_than_a_metre() -> None:
    """A receiver at the source hears its source level, not an infinite one."""
    assert USUAL.level_db([0.0, 0.5, 1.0]) == pytest.approx([179.994986] * 3, abs=1e-6)


def test_each_term_of_the_equation() -> None:
    """Directivity adds its index, bandwidth takes its own, and own noise drowns the sea."""
    usual = USUAL.snr_db(200.0)
    assert link_budget(Sonar(directivity_index_db=3.0)).snr_db(200.0) == pytest.approx(usual + 3.0)
    assert link_budget(Sonar(bandwidth_khz=1.0)).snr_db(200.0) == pytest.approx(usual + 10.0)
    as_loud = float(ambient_noise_db(25.0))
    noisy = link_budget(Sonar(own_noise_db=as_loud)).snr_db(200.0)
    assert noisy == pytest.approx(usual - 10.0 * math.log10(2.0))
    drowned = link_budget(Sonar(own_noise_db=120.0)).snr_db(200.0)
    assert drowned == pytest.approx(usual + as_loud - 120.0, abs=1e-6)


def test_absorption_laws_of_a_sonar() -> None:
    """Each law takes its tabulated share."""
    laws = {"francois_garrison": 5.01375259, "ainslie_mccolm": 5.12294415, "thorp": 6.10480510}
    for law, taken in laws.items():
        sonar = Sonar.model_validate({"absorption": law})
        assert link_budget(sonar).absorption_db_per_km == pytest.approx(taken, abs=1e-8)


@pytest.mark.parametrize(
    ("decibels", "non_coherent", "coherent", "rayleigh"),
    [
        (5.0, 0.052144219, 0.114265876, 0.109392540),
        (8.0, 0.270827286, 0.433813822, 0.283643245),
        (10.0, 0.616135849, 0.774310937, 0.432876128),
        (12.0, 0.925108105, 0.972002150, 0.578890240),
        (15.0, 0.999909969, 0.999988506, 0.754025928),
    ],
)
def test_detection_table(
    decibels: float, non_coherent: float, coherent: float, rayleigh: float
) -> None:
    """Pulses of 5 to 15 dB are detected as often as tabulated, at a false alarm in 10,000."""
    for detector, chance in zip(DETECTORS, (non_coherent, coherent, rayleigh), strict=True):
        assert detected(ratio(decibels), 1e-4, detector) == pytest.approx(chance, abs=5.1e-10)


@pytest.mark.parametrize("false_alarm", [0.5, 1e-2, 1e-4, 1e-9, 1e-15])
def test_marcum_is_the_non_central_chi_square(false_alarm: float) -> None:
    """The finite sum is Marcum's Q from no signal to an overwhelming one."""
    energy = np.concatenate(([0.0], np.logspace(-3, 5, 400)))
    wanted = stats.ncx2.sf(-2.0 * math.log(false_alarm), 2, 2.0 * energy[1:])
    found = detected(energy, false_alarm)
    assert found[0] == pytest.approx(false_alarm, abs=1e-13)
    assert found[1:] == pytest.approx(wanted, abs=1e-12)
    assert np.all((found >= 0.0) & (found <= 1.0))


@pytest.mark.parametrize(
    ("modulation", "at_8_db", "frame_at_8_db", "frame_at_10_db"),
    [
        ("bpsk", 1.909078e-4, 0.03599403, 7.431699e-4),
        ("dpsk", 9.094044e-4, 0.1602786, 4.348958e-3),
        ("nc_fsk", 2.132375e-2, 0.9840523, 0.4768751),
    ],
)
def test_frames_table(
    modulation: str, at_8_db: float, frame_at_8_db: float, frame_at_10_db: float
) -> None:
    """Bits and frames of 192 bits are wrong as often as tabulated at 8 and 10 dB a bit."""
    assert frame_error(ratio(8.0), 1, modulation) == pytest.approx(at_8_db, rel=5e-7)
    assert frame_error(ratio(8.0), 192, modulation) == pytest.approx(frame_at_8_db, rel=5e-7)
    assert frame_error(ratio(10.0), 192, modulation) == pytest.approx(frame_at_10_db, rel=5e-7)


def test_rare_frame_errors_keep_their_digits() -> None:
    """At 14 dB a frame of 10,000 bits is wrong 6.8e-9 times, which 1 - (1 - BER)^n cannot tell."""
    ber = float(frame_error(ratio(14.0), 1))
    assert ber == pytest.approx(float(special.ndtr(-math.sqrt(2 * ratio(14.0)))), rel=1e-12)
    assert frame_error(ratio(14.0), 10_000) == pytest.approx(1e4 * ber, rel=1e-8)


def test_soft_disc_table() -> None:
    """Calibrated at 50 m, signals with 3 dB of shadowing come through as tabulated."""
    ranges = [10.0, 25.0, 40.0, 45.0, 50.0, 55.0, 60.0, 75.0, 100.0]
    wanted = [
        0.999998859, 0.979751722, 0.746264031, 0.623013960, 0.5,
        0.388087374, 0.293018633, 0.112045230, 0.018289632,
    ]  # fmt: skip
    found = chance_decoded(Sonar(), USUAL.snr_db(ranges), PING, USUAL.snr_db(50.0))
    assert found == pytest.approx(wanted, abs=6e-10)


@given(st.floats(1.0, 5e3), st.floats(2.0, 5e3), st.floats(100.0, 220.0))
def test_without_shadowing_there_is_a_disc(reach: float, edge: float, level: float) -> None:
    """Without shadowing all within the band's range is decoded, however loud sources are."""
    sonar = Sonar(shadowing_sd_db=0.0, source_level_db=level)
    budget = link_budget(sonar)
    chance = chance_decoded(sonar, budget.snr_db(reach), PING, budget.snr_db(edge))
    assert chance == (reach <= edge)


def test_a_threshold_of_ones_own() -> None:
    """A threshold that is given is taken: half of the signals come through where the SNR is it."""
    sonar = Sonar(snr_threshold_db=15.0)
    assert chance_decoded(sonar, 15.0, PING, 15.0) == 0.5


@pytest.mark.parametrize("decoding", [*DETECTORS, "bpsk", "dpsk", "nc_fsk"])
@pytest.mark.parametrize("spread", [0.5, 3.0, 12.0])
def test_shadowing_is_averaged(decoding: str, spread: float) -> None:
    """The chance of a shadowed signal is the mean over its SNR, as a rule 60 times finer has it."""
    message = SoundMessage(0.8, 2000)
    shadowed = Sonar.model_validate({"decoding": decoding, "shadowing_sd_db": spread})
    clear = Sonar.model_validate({"decoding": decoding, "shadowing_sd_db": 0.0})
    for snr in (-25.0, -10.0, 0.0, 5.0):
        # an independent rule, fine enough for the sharpest of them
        steps = np.linspace(-8.0, 8.0, 20_001)
        density = stats.norm.pdf(steps)
        chances = chance_decoded(clear, snr + spread * steps, message)
        wanted = np.trapezoid(chances * density, steps)
        assert chance_decoded(shadowed, snr, message) == pytest.approx(wanted, abs=1e-6)


def test_bits_share_the_energy_of_a_frame() -> None:
    """At 0 dB in 10 kHz a frame of 192 bits in 0.192 s has 10 dB a bit."""
    sonar = Sonar(decoding="nc_fsk", shadowing_sd_db=0.0)
    chance = chance_decoded(sonar, 0.0, SoundMessage(0.192, 192))
    assert chance == pytest.approx(1.0 - 0.4768751, abs=1e-6)


def test_frames_without_bits_are_refused() -> None:
    """A ping carries no bits, so a decoding of bits says which to take."""
    with pytest.raises(ValueError, match=r"decoding bpsk is one of bits.*choose threshold"):
        chance_decoded(Sonar(decoding="bpsk"), 10.0, PING)


@given(st.floats(-60.0, 60.0), st.floats(0.0, 30.0))
def test_louder_is_never_worse(snr: float, more: float) -> None:
    """Of two signals the louder is decoded no less often, and timed no worse."""
    for decoding in ("threshold", *DETECTORS, "bpsk", "dpsk", "nc_fsk"):
        sonar = Sonar.model_validate({"decoding": decoding})
        low, high = chance_decoded(sonar, np.array([snr, snr + more]), SoundMessage(0.1, 100), 5.0)
        assert 0.0 <= low <= high + 1e-12
        assert high <= 1.0
    low, high = timing_sd_s(Sonar(), np.array([snr, snr + more]), 0.01)
    assert low >= high > 0.0


def test_timing_table() -> None:
    """100 times the energy of noise times arrivals to 3.9 us by envelope, 0.45 us by carrier."""
    energy_db = 20.0 - 10.0 * math.log10(100.0)  # B T = 100
    for carrier, wanted in ((False, 3.898484006e-6), (True, 0.4471867846e-6)):
        found = timing_sd_s(Sonar(), energy_db, 0.010, carrier)
        assert found == pytest.approx(wanted, rel=1e-9)


def test_wrong_sonars_are_refused() -> None:
    """What contradicts itself, or no sea has, is refused with what to do."""
    with pytest.raises(ValidationError, match="snr_threshold_db belongs to decoding threshold"):
        Sonar(decoding="bpsk", snr_threshold_db=10.0)
    with pytest.raises(ValidationError, match="reaches below 0 Hz"):
        Sonar(frequency_khz=4.0, bandwidth_khz=9.0)
    with pytest.raises(ValueError, match=r"shipping must lie in \[0, 1\]; met 2"):
        ambient_noise_db(25.0, 2.0)
    with pytest.raises(ValueError, match=r"wind .* met -1.0"):
        ambient_noise_db(25.0, 0.5, -1.0)
    with pytest.raises(ValueError, match=r"frequency .* met 0.0; give kilohertz"):
        ambient_noise_db(0.0)
    with pytest.raises(ValueError, match=r"false-alarm .* met 1.0"):
        detected(10.0, 1.0)
