"""Speed and absorption of sound in sea water against outside numbers."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from bindusbl_des import absorption, sound_speed
from bindusbl_des.core.sea.water import (
    absorption_ainslie_mccolm,
    absorption_thorp,
    sound_speed_medwin,
)

CHECKS = json.loads((Path(__file__).parents[1] / "reference" / "physics_checks.json").read_text())


def check(name: str) -> float:
    return float(CHECKS[name]["value"])


@pytest.mark.parametrize(
    ("temperature", "salinity", "depth", "mackenzie", "medwin"),
    [
        (25.0, 35.0, 1000.0, 1550.744027, 1550.356250),
        (10.0, 35.0, 10.0, 1489.966417, 1490.150000),
        (15.0, 35.0, 10.0, 1506.855242, 1506.963750),
        (20.0, 35.0, 10.0, 1521.626217, 1521.680000),
        (27.0, 35.0, 10.0, 1539.086601, 1539.173070),
        (4.0, 0.0, 10.0, 1421.188570, 1421.398560),
    ],
)
def test_sound_speed_table(
    temperature: float, salinity: float, depth: float, mackenzie: float, medwin: float
) -> None:
    """Seas from a cold lake to a warm deep have the tabulated sound speeds."""
    assert sound_speed(temperature, salinity, depth) == pytest.approx(mackenzie, abs=1e-6)
    assert sound_speed_medwin(temperature, salinity, depth) == pytest.approx(medwin, abs=1e-6)


def test_sound_speed_checks() -> None:
    """Sound speeds agree with an independent library to nine digits."""
    assert sound_speed(25.0, 35.0, 1000.0) == pytest.approx(
        check("mackenzie(25,35,1000)"), rel=1e-9
    )
    assert sound_speed(10.0, 35.0, 10.0) == pytest.approx(check("mackenzie(10,35,10)"), rel=1e-9)
    assert sound_speed_medwin(10.0, 35.0, 10.0) == pytest.approx(
        check("medwin(10,35,10)"), rel=1e-9
    )


def test_sound_speed_near_teos10() -> None:
    """The two fits stay within 0.25 m/s of the standard equation of sea water near the surface."""
    # TEOS-10 by gsw 3.6.20 at 47 N 30 W, for (T, 35, 10)
    for temperature, standard in ((10.0, 1489.981970), (15.0, 1506.821596), (27.0, 1539.029882)):
        assert sound_speed(temperature, 35.0, 10.0) == pytest.approx(standard, abs=0.07)
        assert sound_speed_medwin(temperature, 35.0, 10.0) == pytest.approx(standard, abs=0.25)


def test_sound_speed_profile() -> None:
    """A profile of temperatures and depths gives the same speeds as its points one by one."""
    temperatures, depths = np.array([18.0, 12.0, 4.0]), np.array([0.0, 100.0, 2000.0])
    for law in (sound_speed, sound_speed_medwin):
        profile = law(temperatures, 34.5, depths)
        points = [law(float(t), 34.5, float(d)) for t, d in zip(temperatures, depths, strict=True)]
        assert profile == pytest.approx(points, rel=1e-14)


@pytest.mark.parametrize(
    ("frequency", "thorp", "francois_garrison", "ainslie_mccolm"),
    [
        (10.0, 1.18702994, 0.98388274, 1.00860434),
        (18.0, 3.42418468, 2.78537698, 2.84829040),
        (25.0, 6.10480510, 5.01375259, 5.12294415),
        (50.0, 17.46712268, 15.39286650, 15.70837013),
        (100.0, 34.06866276, 33.60682080, 34.31142453),
        (150.0, 43.51854022, 45.23169642, 46.33851705),
    ],
)
def test_absorption_table(
    frequency: float, thorp: float, francois_garrison: float, ainslie_mccolm: float
) -> None:
    """Water takes the tabulated share of sounds from 10 to 150 kHz."""
    assert absorption_thorp(frequency) == pytest.approx(thorp, abs=1e-8)
    assert absorption(frequency) == pytest.approx(francois_garrison, abs=1e-8)
    assert absorption_ainslie_mccolm(frequency) == pytest.approx(ainslie_mccolm, abs=1e-8)


def test_absorption_checks() -> None:
    """Absorption agrees with an independent library to nine digits, in cold and in warm water."""
    for frequency in (10, 25, 50, 100):
        thorp, fg = check(f"thorp({frequency})"), check(f"fg({frequency},10,35,10,8.1)")
        assert absorption_thorp(float(frequency)) == pytest.approx(thorp, rel=1e-9)
        assert absorption(float(frequency)) == pytest.approx(fg, rel=1e-9)
    # the documented point of arlpy, warmer than 20 degC
    assert absorption(50.0, 27.0, 35.0, 10.0, 8.1) == pytest.approx(10.710332974759, rel=1e-12)


def test_absorption_spectrum() -> None:
    """A whole spectrum is absorbed as its lines are one by one, higher lines always more."""
    lines = np.linspace(1.0, 200.0, 50)
    for law in (absorption, absorption_ainslie_mccolm, absorption_thorp):
        spectrum = law(lines)
        assert spectrum == pytest.approx([law(float(line)) for line in lines], rel=1e-14)
        assert np.all(np.diff(spectrum) > 0.0)


def test_fresh_water_absorbs_less() -> None:
    """A lake takes far less of a 25 kHz sound than the sea, and only by the water itself."""
    lake = absorption(25.0, salinity_psu=0.0)
    assert 0.0 < lake < 0.1 * absorption(25.0)
    assert absorption(50.0, salinity_psu=0.0) == pytest.approx(4.0 * lake, rel=1e-12)


def test_absorption_is_continuous_at_20_degrees() -> None:
    """Water a hair warmer than 20 degC takes what water of 20 degC takes."""
    assert absorption(150.0, 20.0) == pytest.approx(absorption(150.0, 20.0 + 1e-9), rel=1e-4)


def test_impossible_water_is_refused() -> None:
    """No sea has a negative salinity, a height above itself, frost or a speed that is no number."""
    for law in (sound_speed, sound_speed_medwin):
        with pytest.raises(ValueError, match=r"salinity .* not below 0; met -1"):
            law(10.0, -1.0, 10.0)
        with pytest.raises(ValueError, match=r"depth .* met -5.0; count metres downwards"):
            law(10.0, 35.0, -5.0)
        with pytest.raises(ValueError, match=r"temperature .* not below -10; met -40"):
            law(-40.0, 35.0, 5.0)
        with pytest.raises(ValueError, match=r"temperature .* met .*nan"):
            law(np.array([4.0, math.nan]), 35.0, 5.0)
    with pytest.raises(ValueError, match=r"pH .* met nan"):
        absorption(25.0, ph=math.nan)
    for absorb in (absorption, absorption_ainslie_mccolm, absorption_thorp):
        with pytest.raises(ValueError, match=r"frequency .* positive .* met 0.0; give kilohertz"):
            absorb(0.0)
