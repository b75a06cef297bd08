"""Profiles, casts and columns of water: how fast sound gets through them."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad  # type: ignore[import-untyped,unused-ignore]

from bindusbl_des import sound_speed
from bindusbl_des.core.sea.water import sound_speed_medwin, sound_speed_teos10
from bindusbl_des.core.sea.water_column import (
    Column,
    Profile,
    mean_speed,
    read_cast,
)

ATLANTIC = 47.0, -30.0
SUMMER = """depth_m, temperature_c, salinity_psu, oxygen
0.5, 22.0, 33.0, 8
5, 21.5, 33.2, 8
12, 14.0, 34.6, 7
30, 9.0, 35.0, 6
"""


def cast(folder: Path, text: str) -> str:
    """Return the file of a cast."""
    file = folder / "cast.csv"
    file.write_text(text)
    return str(file)


@pytest.mark.parametrize(
    ("temperature", "salinity", "depth", "speed"),
    [
        (25.0, 35.0, 1000.0, 1550.956453),
        (10.0, 35.0, 10.0, 1489.981970),
        (15.0, 35.0, 10.0, 1506.821596),
        (20.0, 35.0, 10.0, 1521.558957),
        (27.0, 35.0, 10.0, 1539.029882),
        (4.0, 0.0, 10.0, 1421.901308),
    ],
)
def test_teos10_table(temperature: float, salinity: float, depth: float, speed: float) -> None:
    """The standard equation gives the tabulated speeds at 47 N 30 W."""
    found = sound_speed_teos10(temperature, salinity, depth, ATLANTIC)
    assert found == pytest.approx(speed, abs=1e-6)


def test_teos10_ends_in_the_south() -> None:
    """Its atlas does: farther south it has no number."""
    assert 1470.0 < sound_speed_teos10(5.0, 35.0, 10.0, (-86.0, 0.0)) < 1472.0
    with pytest.raises(ValueError, match="no water farther south"):
        sound_speed_teos10(5.0, 35.0, 10.0, (-86.1, 0.0))


def test_without_gsw_its_remedy_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "gsw", None)
    with pytest.raises(ImportError, match=r"pip install 'bindusbl-des\[ocean\]'"):
        sound_speed_teos10(10.0, 35.0, 10.0, ATLANTIC)


@given(
    st.lists(st.floats(1400.0, 1600.0), min_size=2, max_size=6),
    st.floats(0.1, 60.0),
)
def test_sound_takes_the_integral_of_slowness(speeds: list[float], depth: float) -> None:
    """The mean speed is depth over the integral of 1 / c, as quadrature has it."""
    depths = np.linspace(2.0, 42.0, len(speeds))  # its ends lie below the surface, above the end
    profile = Profile(depths, np.array(speeds))
    inner = [it for it in depths.tolist() if it < depth]
    taken = quad(lambda z: 1.0 / float(profile.at(z)), 0.0, depth, points=inner, limit=200)[0]
    assert mean_speed(profile, depth) == pytest.approx(depth / taken, rel=1e-9)


def test_a_slanted_way_is_as_fast() -> None:
    """Any straight way down to a depth has the same mean speed, and it is the harmonic mean."""
    profile = Profile(np.array([0.0, 20.0]), np.array([1520.0, 1480.0]))
    mean = mean_speed(profile, 20.0)
    assert mean == pytest.approx(40.0 / math.log(1520.0 / 1480.0), rel=1e-12)
    for away in (0.0, 30.0, 500.0):
        way = math.hypot(away, 20.0)
        taken = quad(lambda s, w=way: 1.0 / float(profile.at(20.0 * s / w)), 0.0, way)[0]
        assert way / taken == pytest.approx(mean, rel=1e-9)


def test_the_ends_of_profiles() -> None:
    """Above and below its samples the water stays as it is; at the surface there is no way."""
    profile = Profile(np.array([5.0, 10.0]), np.array([1510.0, 1490.0]))
    assert profile.at([0.0, 5.0, 7.5, 10.0, 99.0]).tolist() == [1510, 1510, 1500, 1490, 1490]
    assert mean_speed(profile, 0.0) == 1510.0
    same = Profile(np.array([0.0, 9.0]), np.array([1483.0, 1483.0]))
    assert mean_speed(same, 77.0) == pytest.approx(1483.0, rel=1e-15)
    with pytest.raises(ValueError, match=r"depth .* met -1"):
        mean_speed(profile, -1.0)


@pytest.mark.parametrize("depth", [0.0, 10.0, 137.0, 4000.0])
def test_water_that_is_the_same_all_the_way(depth: float) -> None:
    """A temperature and a salinity have the mean speed of the law over the way down."""
    for name, law in (("mackenzie", sound_speed), ("medwin", sound_speed_medwin)):
        profile = Column(depth, 12.0, 34.0, law=name).profile()  # type: ignore[arg-type]
        found = mean_speed(profile, depth)
        taken = quad(lambda z, f=law: 1.0 / f(12.0, 34.0, z), 0.0, depth)[0]
        wanted = depth / taken if depth else law(12.0, 34.0, 0.0)
        assert found == pytest.approx(wanted, abs=1e-3)


def test_a_cast_of_temperature_and_salinity(tmp_path: Path) -> None:
    """The law makes speeds of its samples; the water that absorbs has their means."""
    file = cast(tmp_path, SUMMER)
    column = Column(20.0, cast_file=file)
    samples = read_cast(file)
    assert samples.speeds_m_per_s is None
    wanted = [
        sound_speed(22.0, 33.0, 0.5), sound_speed(21.5, 33.2, 5.0),
        sound_speed(14.0, 34.6, 12.0), sound_speed(9.0, 35.0, 30.0),
    ]  # fmt: skip
    assert column.profile().speeds_m_per_s == pytest.approx(wanted, rel=1e-14)
    water = column.water()
    # 0.5 m of 22.0, then trapezia of 4.5, 7 and 8 m
    at_20 = 14.0 - 5.0 * 8.0 / 18.0
    area = 11.0 + 4.5 * 21.75 + 7.0 * 17.75 + 8.0 * (14.0 + at_20) / 2.0
    assert water.temperature_c == pytest.approx(area / 20.0)
    assert 33.0 < water.salinity_psu < 34.9
    assert water.depth_m == 20.0
    standard = Column(20.0, cast_file=file, law="teos10", place_deg=ATLANTIC).profile()
    assert standard.speeds_m_per_s == pytest.approx(wanted, abs=0.2)
    assert np.all(standard.speeds_m_per_s != column.profile().speeds_m_per_s)


def test_a_cast_of_speeds(tmp_path: Path) -> None:
    """Speeds that were measured are taken as they are, also beside temperatures."""
    file = cast(tmp_path, "sound_speed_m_per_s,depth_m\n1500,0\n1480,10\n\n")
    column = Column(10.0, cast_file=file)
    assert column.profile().speeds_m_per_s.tolist() == [1500.0, 1480.0]
    assert column.water()[:2] == (10.0, 35.0)
    text = "depth_m,temperature_c,salinity_psu,sound_speed_m_per_s\n0,12,20,1470\n9,8,30,1460\n"
    both = Column(9.0, cast_file=cast(tmp_path, text))
    assert both.profile().speeds_m_per_s.tolist() == [1470.0, 1460.0]
    assert both.water() == pytest.approx((10.0, 25.0, 9.0))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", r":1: has the columns ; it needs depth_m and sound_speed_m_per_s, or depth_m, temp"),
        ("depth_m,temperature_c\n0,4\n9,4\n", r":1: has the columns depth_m, temperature_c; it ne"),
        (
            "depth_m,sound_speed_m_per_s\n0,1500\n",
            r"has 1 samples; a CTD profile needs",
        ),
        ("depth_m,sound_speed_m_per_s\n0,1500\n5,\n", r":3: sound_speed_m_per_s must be a number"),
        ("depth_m,sound_speed_m_per_s\n0,1500\n5\n", r":3: sound_speed_m_per_s .* got ''"),
        ("depth_m,sound_speed_m_per_s\n0,1500\n5,4921\n", r":3: .* from 1300 to 1700; got '4921'"),
        ("depth_m,sound_speed_m_per_s\n0,1500\n-5,1500\n", r":3: depth_m .* from 0 to"),
        ("depth_m,sound_speed_m_per_s\n0,nan\n5,1500\n", r":2: .* got 'nan'"),
        (
            "depth_m,temperature_c,salinity_psu\n9,4,35\n\n8,4,35\n",
            r":4: depth_m must increase, but 8 m follows 9 m; keep the way down",
        ),
    ],
)
def test_wrong_casts_are_refused(tmp_path: Path, text: str, problem: str) -> None:
    """What is no cast is refused with file, line and remedy."""
    with pytest.raises(ValueError, match=problem) as told:
        read_cast(cast(tmp_path, text))
    assert str(told.value).startswith(str(tmp_path))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="cannot be read as a CSV file"):
        read_cast(tmp_path / "no.csv")
    file = tmp_path / "cast.csv"
    file.write_bytes(b"depth_m\x81\xfe")
    with pytest.raises(ValueError, match="cannot be read as a CSV file"):
        read_cast(file)


def test_a_cast_must_reach_the_survey(tmp_path: Path) -> None:
    file = cast(tmp_path, SUMMER)
    with pytest.raises(ValueError, match="ends at 30 m, above the survey at 31 m; add samples"):
        Column(31.0, cast_file=file).profile()
    assert Column(30.0, cast_file=file).profile().depths_m[-1] == 30.0
