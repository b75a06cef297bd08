"""Echoes of surface and bottom against worked values, energy and geometry."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import holding

from bindusbl_des import simulate
from bindusbl_des.core.acoustics.sonar_channel import Sea, blended, bottom_reflection, echoes

SHALLOW = Sea(30.0)
depths = st.floats(0.5, 29.5)
WAYS = echoes(SHALLOW, 25.0, 10.0, 1.0, 10.0, 5).ways


def later_ms(sea: Sea, away: float) -> dict[str, float]:
    """Return by name how much later (ms) echoes come of a source at 1 m, a receiver at 10 m."""
    found = echoes(sea, 25.0, away, 1.0, 10.0)
    return {
        way.name: 1e3 * float(late) for way, late in zip(found.ways, found.later_s, strict=True)
    }


def test_excess_delays() -> None:
    """Echoes come as much later as tabulated, straight down and from the side."""
    wanted = {
        "S": 1.333333, "B": 26.666667, "SB": 28.0, "BS": 40.0, "SBS": 41.333333, "BSB": 66.666667,
    }  # fmt: skip
    assert later_ms(SHALLOW, 0.0) == pytest.approx(wanted, abs=1e-6)
    aside = later_ms(SHALLOW, 50.0)
    for name, late in (("S", 0.261440), ("B", 12.802400), ("BS", 22.938639), ("BSB", 46.078176)):
        assert aside[name] == pytest.approx(late, abs=1e-6)
    shallower, deep = later_ms(Sea(20.0), 0.0), later_ms(Sea(100.0), 0.0)
    assert shallower["B"] == pytest.approx(13.333333, abs=1e-6)
    assert shallower["BSB"] == pytest.approx(40.0, abs=1e-6)
    assert deep["B"] == pytest.approx(120.0, abs=1e-6)


def test_a_surface_echo_blends_into_the_ping_from_130_m_on() -> None:
    """Beyond some 130 m it comes within a tenth of a millisecond, the resolution of 10 kHz."""
    late = [later_ms(SHALLOW, away)["S"] for away in (100.0, 130.0, 140.0)]
    assert late[0] > late[1] > 0.1 > late[2]


def test_bottom_of_sand() -> None:
    """Sand gives back 9.3 dB less straight down, more at 45 degrees, all below 24.6 degrees."""
    straight = bottom_reflection(SHALLOW, math.pi / 2)
    assert straight == pytest.approx(0.341894061, abs=1e-9)
    assert 20.0 * math.log10(abs(straight)) == pytest.approx(-9.322, abs=5e-4)
    assert bottom_reflection(SHALLOW, math.pi / 4) == pytest.approx(0.392850512, abs=1e-9)
    critical = math.acos(1500.0 / 1650.0)
    assert math.degrees(critical) == pytest.approx(24.62, abs=0.005)
    shallow = bottom_reflection(SHALLOW, np.linspace(1e-3, critical - 1e-6, 50))
    assert np.abs(shallow) == pytest.approx(np.ones(50), rel=1e-12)
    assert np.all(np.abs(bottom_reflection(SHALLOW, np.linspace(critical + 0.01, 1.57, 50))) < 1.0)
    same = Sea(30.0, bottom_density_kg_per_m3=1025.0, bottom_speed_m_per_s=1500.0)
    assert bottom_reflection(same, 0.3) == pytest.approx(0.0, abs=1e-12)  # more water


@given(st.floats(0.0, 500.0), depths, depths, st.sampled_from(list(WAYS)))
def test_ways_are_those_of_a_folded_line(away: float, source: float, receiver: float, way) -> None:  # type: ignore[no-untyped-def]
    """Summed from reflection to reflection a way is as long as that of its image."""
    upright, here = 0.0, source
    for side in way.name:
        there = 0.0 if side == "S" else SHALLOW.depth_m
        upright, here = upright + abs(there - here), there
    upright += abs(receiver - here)
    found = echoes(SHALLOW, 25.0, away, source, receiver, 5)
    number = found.ways.index(way)
    straight = math.hypot(away, source - receiver)
    wanted = (math.hypot(away, upright) - straight) / 1500.0
    assert float(found.later_s[number]) == pytest.approx(wanted, abs=1e-12)
    from_above = way.name[-1] == "S"
    assert (float(found.from_above[number]) > 0.0) == from_above


@given(st.floats(1.0, 500.0), depths, depths)
def test_there_and_back_are_the_same(away: float, source: float, receiver: float) -> None:
    """Exchanged source and receiver hear the same echoes, mirrored."""
    there = echoes(SHALLOW, 25.0, away, source, receiver)
    back = echoes(SHALLOW, 25.0, away, receiver, source)
    assert sorted(there.later_s.tolist()) == pytest.approx(sorted(back.later_s.tolist()), abs=1e-15)
    assert sorted(np.abs(there.gain)) == pytest.approx(sorted(np.abs(back.gain)), rel=1e-9)


def test_lloyds_mirror() -> None:
    """With the surface alone the field is 2 |sin(k zs zr / r)|: the interference of its image."""
    away, wave = np.linspace(300.0, 900.0, 200), 2.0 * math.pi * 5e3 / 1500.0
    found = echoes(Sea(1000.0), 5.0, away, 1.0, 2.0, most_reflections=1)
    field = np.abs(1.0 + found.gain[0])
    assert field == pytest.approx(2.0 * np.abs(np.sin(wave * 2.0 / away)), abs=5e-3)
    blend = blended(found, 1.0 / np.hypot(away, 1.0), 0.1)
    assert blend.amplitude == pytest.approx(field, abs=5e-3)  # 10 ms: told from nothing


def test_rough_surfaces_scatter() -> None:
    """A surface of 5 cm takes nearly all of 25 kHz at steep angles, hardly any at flat ones."""
    rough = SHALLOW._replace(surface_sd_m=0.05)
    for away, least, most in ((0.0, 0.0, 1e-6), (600.0, 0.98, 1.0)):
        plain, scattered = (echoes(it, 25.0, away, 1.0, 10.0, 1).gain[0] for it in (SHALLOW, rough))
        assert least <= abs(scattered / plain) <= most


def test_echoes_that_are_told_apart_change_nothing() -> None:
    """At 50 m and 10 kHz all echoes come later than 0.1 ms: the ping is itself."""
    found = echoes(SHALLOW, 25.0, 50.0, 1.0, 10.0)
    blend = blended(found, 9.0 / math.hypot(50.0, 9.0), 10.0)
    assert blend.later_s == 0.0
    assert blend.amplitude == 1.0
    assert blend.from_above == pytest.approx(9.0 / math.hypot(50.0, 9.0))


def test_blended_directions_stray() -> None:
    """From 150 m on the surface echo pulls pings, most where they cancel."""
    away = np.linspace(150.0, 3000.0, 20_000)
    found = echoes(SHALLOW, 25.0, away, 1.0, 10.0, 1)
    elevation = 9.0 / np.hypot(away, 9.0)
    blend = blended(found, elevation, 10.0)
    astray = np.degrees(np.abs(np.arcsin(np.clip(blend.from_above, -1, 1)) - np.arcsin(elevation)))
    strong, weak = blend.amplitude > 1.5, blend.amplitude < 0.5
    assert strong.any()
    assert weak.any()
    assert astray[strong].max() < 0.5
    assert np.median(astray[weak]) > 2.0 * astray[strong].max()
    assert blend.later_s[strong].max() < 1e-4


def test_depths_outside_the_sea_are_refused() -> None:
    for source, receiver in ((-1.0, 5.0), (5.0, 31.0)):
        with pytest.raises(ValueError, match="between 0 and 30 m"):
            echoes(SHALLOW, 25.0, 10.0, source, receiver)


def test_a_ping_fades_and_turns_as_its_echoes_do() -> None:
    """What a matched filter of 1 / B makes of ping and echoes, from levels to fixes."""
    for away in np.linspace(100.0, 400.0, 7):
        wide = {"hf": {"range_m": 450.0}, "mf": {"range_m": 500.0}}
        tables, plain = (
            simulate(holding((away, 0.0), channel=it, acoustics=wide), 1).tables
            for it in ({"bottom_m": 30.0}, {})
        )
        found = echoes(Sea(30.0), 25.0, away, 10.0, 0.5)
        straight, reach = math.hypot(away, 9.5), math.hypot(away, 10.0)
        blend = blended(found, -9.5 / straight, 10.0)
        met = tables["receptions"].query("outcome == 'heard'")
        straight_db = plain["receptions"].query("outcome == 'heard'").snr_db.iloc[0]
        level = straight_db + 20.0 * math.log10(blend.amplitude)
        assert np.allclose(met.snr_db, level, atol=0.01)
        fix = tables["fixes"].iloc[0]
        sine = 10.0 / reach - 9.5 / straight - float(blend.from_above)
        heard_at = reach + 1500.0 * float(blend.later_s)
        assert fix.x_m == pytest.approx(heard_at * math.sqrt(1.0 - sine**2), abs=0.05)
        assert fix.y_m == pytest.approx(0.0, abs=1e-6)
