"""Channels that ship beside the disc: curves and sonars, what they drown, frames on the MF band."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import each_explained
from scipy.stats import binom  # type: ignore[import-untyped,unused-ignore]
from worlds import QUIET_NAVIGATION, QUIET_USBL, merged, scenario

from bindusbl_des import Result, Scenario, simulate

CURVE = "range_m,note,delivery_ratio\n10,near,0.9\n50,a dip,0.3\n90,far,0.8\n"
RANGES = (5.0, 30.0, 50.0, 80.0, 90.0, 91.0)  # of AUVs at the surface
RATIOS = (0.9, 0.6, 0.3, 0.675, 0.8, 0.0)


@pytest.fixture
def curve(tmp_path: Path) -> dict[str, Any]:
    """A channel by a curve that falls and rises."""
    path = tmp_path / "curve.csv"
    path.write_text(CURVE)
    return {"model": "curve", "file": str(path)}


def lying(*places: tuple[float, float], **changes: Any) -> Scenario:
    """Return AUVs that hold still at the surface, and one ASV at the origin."""
    base = {
        "survey": {"side_m": 60.0, "depth_m": 0.0},
        "auvs": {"count": len(places), "route": {"kind": "hold", "positions_m": list(places)}},
        "asvs": {"count": 1},
        "acoustics": {"loss": {"law": "none"}},
        "usbl": QUIET_USBL,
        "navigation": QUIET_NAVIGATION,
    }
    return scenario(**merged(base, changes))


def at_ranges(duration_s: float, channel: Any, **hf: Any) -> Scenario:
    """Return AUVs in RANGES that listen to an ASV's pings."""
    return lying(
        *((away, 0.0) for away in RANGES), duration_s=duration_s,
        acoustics={"hf": {"channel": channel, **hf}}, protocol={"ranging": "passive"},
    )  # fmt: skip


def delivery(result: Result) -> list[tuple[int, int]]:
    """Return for each AUV how many pings were decoded, of how many."""
    met = result.tables["receptions"]
    decided = met[met.outcome != "in_flight"]
    heard = [decided[decided.auv == f"AUV{n}"].outcome == "heard" for n in range(len(RANGES))]
    return [(int(it.sum()), len(it)) for it in heard]


def within_bounds(found: list[tuple[int, int]], chances: Any) -> None:
    """Check shares against binomial bounds of 99.9 %, all of them together."""
    tail = 0.0005 / len(found)
    for (heard, pings), chance in zip(found, chances, strict=True):
        low, high = binom.ppf([tail, 1.0 - tail], pings, chance)
        assert low <= heard <= high, (chance, heard, pings)


def in_files(result: Result) -> tuple[Any, ...]:
    """Return the tables of a mission but for what only sonars know."""
    events = {name: table for name, table in result.tables.items() if name != "receptions"}
    levels = ["snr_db", "level_db", "margin_db"]
    return *events.values(), result.tables["receptions"].drop(columns=levels)


def same(one: Result, other: Result) -> bool:
    return all(a.equals(b) for a, b in zip(in_files(one), in_files(other), strict=True))


@pytest.mark.parametrize(
    "duration_s", [30.0, pytest.param(500.0, marks=pytest.mark.slow)], ids=["quick", "20000 pings"]
)
def test_a_curve_is_delivered_as_it_says(curve: dict[str, Any], duration_s: float) -> None:
    """Straight between its points, level before the first, nothing beyond the last."""
    result = simulate(at_ranges(duration_s, curve), 4)
    found = delivery(result)
    assert sum(pings for _, pings in found) > 40 * duration_s
    within_bounds(found, RATIOS)
    beyond = result.tables["receptions"].query("auv == 'AUV5'")
    assert set(beyond.outcome) <= {"out_of_range", "in_flight"}
    assert result.tables["receptions"].snr_db.isna().all()


@pytest.mark.parametrize(
    "duration_s", [30.0, pytest.param(500.0, marks=pytest.mark.slow)], ids=["quick", "20000 pings"]
)
def test_a_sonar_is_delivered_as_its_levels_say(duration_s: float) -> None:
    """Half of all pings at the range it is calibrated at; each is heard whose margin is not
    negative.
    """
    clear = at_ranges(3.0, {"model": "sonar", "shadowing_sd_db": 0.0}, range_m=50.0)
    first = simulate(clear, 4).tables["receptions"].drop_duplicates("auv").sort_values("auv")
    mean = first.snr_db.to_numpy(float)
    result = simulate(at_ranges(duration_s, "sonar", range_m=50.0), 4)
    threshold = float((first.snr_db - first.margin_db).iloc[0])
    chances = [0.5 * math.erfc((threshold - it) / 3.0 / math.sqrt(2.0)) for it in mean]
    assert chances[2] == pytest.approx(0.5, abs=1e-3)
    within_bounds(delivery(result), chances)
    met = result.tables["receptions"].query("outcome in ('heard', 'lost')")
    assert ((met.margin_db >= 0.0) == (met.outcome == "heard")).all()
    assert np.allclose(met.snr_db - met.margin_db, threshold)
    spread = met.snr_db - mean[met.auv.str.slice(3).astype(int)]
    assert spread.std() == pytest.approx(3.0, rel=4.0 / math.sqrt(2 * len(met)))
    assert np.allclose(met.level_db - met.snr_db, (first.level_db - first.snr_db).iloc[0])


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt", "passive"])
def test_a_sharp_sonar_and_a_square_curve_are_the_disc(ranging: str, tmp_path: Path) -> None:
    """Without shadowing, and drowning only what could be decoded, every table is the disc's."""
    (tmp_path / "square.csv").write_text("range_m,delivery_ratio\n0,1\n45,1\n")
    channels: list[Any] = [
        "disc",
        {"model": "sonar", "shadowing_sd_db": 0.0, "interference_db": 0.0},
        {"model": "curve", "file": str(tmp_path / "square.csv")},
    ]
    worlds = [
        scenario(
            duration_s=30.0, survey={"side_m": 90.0}, protocol={"ranging": ranging},
            acoustics={
                "hf": {"range_m": 45.0, "range_metric": "slant", "channel": it},
                "loss": {"law": "none"},
            },
        )
        for it in channels
    ]  # fmt: skip
    disc, *others = (simulate(world, 3) for world in worlds)
    assert {"heard", "out_of_range"} <= set(disc.tables["receptions"].outcome)
    assert all(same(disc, other) for other in others)


@pytest.mark.parametrize("model", ["curve", "sonar"])
def test_who_cannot_be_decoded_may_still_drown(model: str, tmp_path: Path) -> None:
    """A ping from 40 m and one from 70 m, too weak to decode, arrive together: only a channel that
    carries sound so far lets them collide, for that the 30 m are no range of the protocol.
    """
    (tmp_path / "near.csv").write_text("range_m,delivery_ratio\n0,1\n50,1\n")
    settings: dict[str, tuple[Any, Any]] = {
        "curve": ({"file": str(tmp_path / "near.csv")}, {"interference_m": 80.0}),
        "sonar": ({"shadowing_sd_db": 0.0, "interference_db": 0.0}, {"interference_db": 6.0}),
    }
    alone, drowned = settings[model]
    outcomes = []
    for given in (alone, {**alone, **drowned}):
        world = lying(
            (40.0, 0.0), (0.0, -50.3), duration_s=20.0,
            acoustics={"hf": {"range_m": 50.0, "channel": {"model": model, **given}}},
        )  # fmt: skip
        met = simulate(world, 1).tables["receptions"]
        outcomes.append([set(met[met.auv == name].outcome) for name in ("AUV0", "AUV1")])
    beyond = {"out_of_range"}
    assert outcomes == [[{"heard"}, beyond], [{"collided"}, beyond]]


def test_the_stronger_of_two_survives_where_it_may() -> None:
    """Of pings from 20 m and 30 m, 3.5 dB apart, one is captured at 3 dB, none at 6."""
    found = []
    for capture in (None, 3.0, 6.0):
        channel = {"model": "sonar", "shadowing_sd_db": 0.0, "capture_db": capture}
        world = lying(
            (20.0, 0.0), (0.0, -30.0), duration_s=20.0,
            acoustics={"hf": {"range_m": 25.0, "channel": channel}},
        )  # fmt: skip
        met = simulate(world, 1).tables["receptions"]
        found.append(set(met[met.auv == "AUV0"].outcome))
    assert found == [{"collided"}, {"heard"}, {"collided"}]


def test_directions_are_worse_where_signals_are_weak() -> None:
    """The array's timing loses what the SNR says: fixes say so, and err as they say."""
    sds, nees = [], []
    for level in (200.0, 124.5):  # dB: an SNR of 86 and of 10 dB at 60 m
        channel = {"model": "sonar", "source_level_db": level, "shadowing_sd_db": 0.0}
        channel["timing"] = "envelope"
        world = lying(
            (60.0, 0.0), duration_s=200.0,
            acoustics={"hf": {"range_m": 61.0, "channel": channel}, "mf": {"range_m": 100.0}},
            usbl={"tdoa_sd_s": 2.6e-7, "travel_time_sd_s": 6.7e-6},
        )  # fmt: skip
        fixes = simulate(world, 2).tables["fixes"]
        sds.append(fixes.sd_y_m.mean())
        nees.append((((fixes.y_m - 0.0) / fixes.sd_y_m) ** 2).mean())
    assert sds[1] > 4.0 * sds[0]
    assert nees == pytest.approx([1.0, 1.0], abs=4.0 * math.sqrt(2.0 / 100.0))


def test_frames_are_decoded_by_chance_of_their_own(curve: dict[str, Any]) -> None:
    """On the MF band the share delivered is the curve's, and pings are what they were without."""
    mf = {"channel": curve, "range_m": 100.0}
    worlds = [
        lying((30.0, 0.0), (0.0, 50.0), duration_s=200.0, acoustics={"mf": it})
        for it in (mf, {"range_m": 100.0})
    ]
    result, plain = (simulate(world, 2) for world in worlds)
    fixes = result.tables["fixes"].query("outcome != 'in_flight'")
    assert set(fixes.outcome) == {"delivered", "lost"}
    for auv, chance in (("AUV0", 0.6), ("AUV1", 0.3)):
        own = fixes[fixes.auv == auv].outcome == "delivered"
        low, high = binom.ppf([0.0005, 0.9995], len(own), chance)
        assert low <= own.sum() <= high
    assert result.auvs.fixes_lost.tolist() == [
        (fixes[fixes.auv == name].outcome == "lost").sum() for name in ("AUV0", "AUV1")
    ]
    assert result.tables["receptions"].equals(plain.tables["receptions"])
    assert (plain.auvs.fixes_lost == 0).all()


def test_frames_beyond_a_curve_are_out_of_range(curve: dict[str, Any]) -> None:
    world = lying((95.0, 0.0), duration_s=10.0,
                  acoustics={"hf": {"range_m": 100.0}, "mf": {"channel": curve}})  # fmt: skip
    result = simulate(world, 1)
    broadcast = result.tables["fixes"].query("outcome != 'in_flight'")
    assert set(broadcast.outcome) == {"out_of_range"}
    assert (result.auvs.fixes_out_of_range == len(broadcast)).all()


def test_larger_frames_are_lost_more_often() -> None:
    """All bits of a frame must be right, and six fixes have more of them than one."""
    rates = []
    for count in (1, 6):
        sonar = {"model": "sonar", "decoding": "dpsk", "source_level_db": 107.0}
        world = lying(
            *[(30.0, 0.1 * n) for n in range(count)], duration_s=60.0,
            acoustics={"mf": {"channel": sonar}}, protocol={"schedule": "one_per_slot"},
        )  # fmt: skip
        fixes = simulate(world, 2).tables["fixes"].query("outcome != 'in_flight'")
        rates.append((fixes.outcome == "delivered").mean())
    assert 0.0 < rates[1] < rates[0] < 1.0


@pytest.mark.parametrize(
    ("hf", "told"),
    [
        ({"channel": "sonar", "range_m": 28.0}, "dB below the 7"),
        ({"channel": "sonar", "range_m": 35.0}, "dB above the"),
        (
            {"channel": {"model": "sonar", "capture_db": 6.0}, "range_m": 25.0},
            "6 dB above noise and others",
        ),
    ],
)
def test_explain_tells_levels(hf: dict[str, Any], told: str) -> None:
    """What was too weak, what was loud enough and what drowned it, in dB."""
    world = lying((30.0, 0.0), (0.0, -30.0), duration_s=4.0, acoustics={"hf": hf})
    result = simulate(world, 1)
    text = " ".join(each_explained(result, "ping", range(4)))
    assert told in text


def test_explain_tells_the_curve(curve: dict[str, Any]) -> None:
    world = lying((30.0, 0.0), (95.0, 0.0), duration_s=4.0, acoustics={"hf": {"channel": curve}})
    result = simulate(world, 1)
    text = " ".join(each_explained(result, "ping", range(4)))
    assert re.search(r"loss probability 0\.400 by the curve \S+\.csv at 30\.0 m", text)
    assert "lets nothing be decoded" in text
