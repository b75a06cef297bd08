"""The chance that a ping makes a fix is the share of pings of which missions make one."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom  # type: ignore[import-untyped,unused-ignore]
from worlds import QUIET_NAVIGATION, merged, scenario

from bindusbl_des import Scenario, Setup, Signals, simulate
from bindusbl_des.apps.preflight.fix_chance import fix_chance, heard_rings, survey_grid
from bindusbl_des.core.geometry.coverage import coverage_map, covered_by_rings

PLACES = [(30.0, 5.0), (-40.0, 10.0), (0.0, 60.0)]


def world(**changes: Any) -> Scenario:
    """Return AUVs that hold still 10 m deep under two ASVs, each in a slot of its own."""
    base = {
        "survey": {"side_m": 120.0},
        "auvs": {"count": 3, "route": {"kind": "hold", "positions_m": PLACES}},
        "asvs": {"count": 2, "formation": {"radius_m": 25.0}},
        "acoustics": {"hf": {"range_m": 45.0}, "mf": {"range_m": 60.0}},
        "protocol": {"schedule": "one_per_slot"},
        "navigation": QUIET_NAVIGATION,
    }
    return scenario(**merged(base, changes))


def test_who_hears_no_frame_that_tells_its_slot_gets_no_fix() -> None:
    """One ASV hears the AUV, and by turns the other one tells its slots, which it does not hear."""
    alone = scenario(
        survey={"side_m": 20.0},
        auvs={"count": 1, "route": {"kind": "hold", "positions_m": [(0.0, 0.0)]}},
        asvs={"count": 2, "formation": {"positions_m": [(120.0, 0.0), (20.0, 0.0)]}},
        acoustics={"hf": {"range_m": 50.0}, "mf": {"range_m": 90.0}, "loss": {"law": "none"}},
        protocol={"knowledge": "broadcast"},
    )
    found = fix_chance(Setup(alone), Setup(alone).stations_m, [(0.0, 0.0, 10.0)])
    assert found is not None
    assert found.tolist() == [0.0]
    assert simulate(alone, 0).auvs.fixes_delivered.tolist() == [0]


def chances(of: Scenario) -> np.ndarray:
    found = fix_chance(Setup(of), Setup(of).stations_m, [(*place, 10.0) for place in PLACES])
    assert found is not None
    return found


@pytest.mark.parametrize(
    "changes",
    [
        {"acoustics": {"loss": {"law": "head", "combine": "clamp_first"}}},
        {"acoustics": {"hf": {"channel": "sonar"}, "mf": {"channel": "sonar"}}},
        {"acoustics": {"hf": {"channel": "sonar"}}, "protocol": {"ranging": "twtt"}},
        {"acoustics": {"hf": {"channel": "sonar"}}, "protocol": {"ranging": "passive"}},
        {"acoustics": {"hf": {"channel": "sonar"}}, "protocol": {"broadcaster": "fixed"}},
        {"acoustics": {"hf": {"channel": "sonar"}}, "protocol": {"downlink": "direct_reply"}},
    ],
)
def test_missions_make_as_many_fixes(changes: dict[str, Any]) -> None:
    """Within binomial bounds of 99.9 %, whatever the channels and who broadcasts."""
    of = world(duration_s=400.0, **changes)
    result = simulate(of, 5)
    pings = result.auvs.pings - result.auvs.fixes_in_flight
    for chance, made, sent in zip(chances(of), result.auvs.fixes_delivered, pings, strict=True):
        low, high = binom.ppf([0.0005 / 3, 1.0 - 0.0005 / 3], sent, chance)
        assert low - 2 <= made <= high + 2  # a ping or two are under way at the end


def test_the_disc_without_loss_covers_or_does_not() -> None:
    """Who is in range of one ASV or more has every fix that he is in MF range to be told."""
    assert chances(world()).tolist() == [1.0, 0.5, 0.0]  # AUV1 is 65.8 m from the other ASV


@pytest.mark.parametrize(
    "survey",
    [
        {"size_m": [300.0, 0.1], "rotation_deg": 40.0},
        {"polygon_m": [[0, 0], [300, 299], [300, 300]]},
        {"size_m": [90.0, 130.0], "rotation_deg": 40.0},
    ],
    ids=["line", "sliver", "slanted"],
)
def test_without_loss_the_chance_is_what_is_covered(survey: dict[str, Any]) -> None:
    """However thin the survey and however it lies: each cell counts by its part in it."""
    places = {"count": 2, "formation": {"positions_m": [[0, 0], [60, 0]]}}
    acoustics = {"hf": {"range_m": 90.0}, "mf": {"range_m": 400.0}}
    of = scenario(survey=survey, auvs={"count": 1}, asvs=places, acoustics=acoustics)
    grid, area, stations = survey_grid(Setup(of), 48), Setup(of).area, Setup(of).stations_m
    assert (grid.share.sum() * (grid.box[2] - grid.box[0]) ** 2 / grid.across**2) == (
        pytest.approx(area.square_m)
    )
    chance = fix_chance(Setup(of), stations, grid.middles)
    assert chance is not None
    exact = covered_by_rings(area, stations, [(0.0, 90.0)])
    assert np.average(chance, weights=grid.share) == pytest.approx(exact, abs=0.01)
    rings = [(0.0, 30.0), (30.0, 90.0)]
    assert covered_by_rings(area, stations, rings) == pytest.approx(exact, abs=1e-3)


def half(signals: Signals) -> np.ndarray:
    """A channel of somebody's own."""
    return np.full(signals.ranges.shape, 0.5)


def test_many_asvs_are_looked_at_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """No array has a row for each place and a column for each ASV, and no bit changes by that."""
    of = scenario()
    stations, grid = Setup(of).stations_m, survey_grid(Setup(of), 20)
    whole = fix_chance(Setup(of), stations, grid.middles)
    monkeypatch.setattr("bindusbl_des.apps.preflight.fix_chance.MOST_PAIRS", 10)
    parts = fix_chance(Setup(of), stations, grid.middles)
    assert whole is not None
    assert np.array_equal(whole, parts)


def test_a_channel_of_ones_own_is_not_asked() -> None:
    of = world(acoustics={"hf": {"channel": half}})
    assert fix_chance(Setup(of), Setup(of).stations_m, [(0.0, 0.0, 0.0)]) is None


FAR = {
    "survey": {"side_m": 1600.0, "depth_m": 20.0},
    "auvs": {"count": 1, "route": {"kind": "hold", "positions_m": [(1190.0, 0.0)]}},
    "asvs": {"count": 1, "formation": {"positions_m": [(0.0, 0.0)]}},
    "acoustics": {"hf": {"range_m": 1200.0}, "mf": {"range_m": 2400.0}},
    "navigation": QUIET_NAVIGATION,
}


@pytest.mark.parametrize(("law", "heard"), [("scaled", True), ("paper", False)])
def test_pings_over_the_range_that_one_sets_are_heard_unless_the_law_is_the_papers(
    law: str, heard: bool
) -> None:
    """Over 1200 m the paper's law takes 999 of 1000 pings, the default none."""
    of = scenario(**merged(FAR, {"acoustics": {"loss": {"law": law}}, "duration_s": 300.0}))
    row = simulate(of, 0).auvs.iloc[0]
    assert row.pings_in_range == row.pings > 10
    assert row.pings_heard == (row.pings if heard else 0)
    [(begin, end)] = heard_rings(Setup(of))
    assert (begin, end) == pytest.approx((0.0, 1200.0 if heard else 381.2), rel=5e-3)


def test_a_dip_of_the_channel_is_a_gap_in_the_coverage(tmp_path: Path) -> None:
    """Half the pings up to 105 m, then from 198 m to 221 m: map and area leave out what lies in
    between, as missions do, whose AUV 130 m away is heard in a tenth of its pings.
    """
    (tmp_path / "dip.csv").write_text(
        "range_m,delivery_ratio\n0,1\n100,0.95\n110,0.1\n190,0.1\n200,0.6\n220,0.6\n230,0\n"
    )
    channel = {"model": "curve", "file": str(tmp_path / "dip.csv")}
    place = {"route": {"kind": "hold", "positions_m": [(70.0, -60.0)]}, "count": 1}
    corner = {"count": 1, "formation": {"positions_m": [(-60.0, -60.0)]}}
    hf = {"range_m": 200.0, "channel": channel}
    of = scenario(
        duration_s=300.0, survey={"side_m": 300.0, "depth_m": 0.0}, auvs=place, asvs=corner,
        acoustics={"hf": hf, "mf": {"range_m": 600.0}},
    )  # fmt: skip
    rings = heard_rings(Setup(of))
    edges = np.array([(0.0, 100.0 + 45.0 / 8.5), (198.0, 220.0 + 10.0 / 6.0)])
    assert np.array(rings) == pytest.approx(edges, abs=1e-6)
    wide = of.model_copy(update={"survey": of.survey.model_copy(update={"side_m": 3e4})})
    assert heard_rings(Setup(wide)) == rings  # whatever is surveyed
    x, y = np.meshgrid(*[np.arange(-149.75, 150.0, 0.5)] * 2, indexing="ij")
    away = np.hypot(x + 60.0, y + 60.0)
    heard = (away <= rings[0][1]) | ((away >= rings[1][0]) & (away <= rings[1][1]))
    found = covered_by_rings(Setup(of).area, Setup(of).stations_m, rings)
    assert found == pytest.approx(heard.mean(), abs=2e-3)
    lines = coverage_map(Setup(of).area, Setup(of).stations_m, rings)
    assert sum(map(list.count, map(list, lines), "o" * len(lines))) / 48 / len(lines) == (
        pytest.approx(found, abs=0.02)
    )
    row = simulate(of, 0).auvs.iloc[0]
    assert row.pings_heard / row.pings < 0.25


def test_the_default_law_is_made_for_the_range() -> None:
    assert scenario().acoustics.loss.law == "scaled"
