"""Pages, figures and exports of passive ranging: who pings has changed, what is told adds up."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from commands_for_tests import call
from damage_for_tests import changed, column_set
from pages_for_tests import page_data, told
from worlds import scenario

from bindusbl_des import Result, load_result, simulate


@pytest.fixture(scope="module")
def lossy() -> Result:
    """Three AUVs under two ASVs, which do not reach all of them; some pings are lost."""
    return simulate(
        scenario(
            duration_s=40.0,
            asvs={"count": 2},
            survey={"side_m": 400.0},
            acoustics={"loss": {"law": "head"}, "hf": {"range_m": 200.0}},
            navigation={"velocity_bias_m_per_s": [0.3, 0.1], "filter": "fixed_gain"},
            protocol={"ranging": "passive"},
        ),
        seed=2,
    )


def test_gaps_and_fates_add_up(lossy: Result) -> None:
    """A ping of an ASV is a chance for each AUV: their fates are those of the receptions."""
    data, tables = page_data(lossy), lossy.tables
    fates = [data["fates"][int(code)] for code in data["pings"]["fate"]]
    outcomes = tables["receptions"].outcome.replace(
        {"heard": "delivered", "out_of_range": "out_of_hf"}
    )
    assert fates == outcomes.tolist()
    assert {"delivered", "out_of_hf", "lost"} <= set(fates)
    told_of = re.findall(r"<b>Why:</b> of (\d+) pings of the ASVs in those gaps", told(lossy))
    sent, inside = tables["pings"].sent_at_s.to_numpy(), set()
    for auv in data["auvs"]:
        in_gaps = [(sent > start - (start == 0.0)) & (sent < end) for start, end in auv["gaps"]]
        inside.add(str(np.sum(np.any(in_gaps, axis=0))))
    assert told_of
    assert set(told_of) <= inside


def test_the_story_is_of_who_hears(lossy: Result) -> None:
    """AUVs send nothing; what they miss was the ASVs'."""
    text = told(lossy)
    assert "pings of the ASVs in those gaps" in text
    assert "it sent" not in text
    missed = (lossy.tables["receptions"].outcome == "lost").sum()
    near = (lossy.tables["receptions"].outcome != "out_of_range").sum()
    assert f"<b>Losses:</b> {missed} of {near} receptions in range" in text


def test_a_page_plays_who_pings_and_who_hears(lossy: Result) -> None:
    """Each AUV has a row for each ping, with its ASV's place; receptions are of these rows."""
    data = page_data(lossy)
    pings, receptions = lossy.tables["pings"], lossy.tables["receptions"]
    assert data["asvsPing"]
    rows = data["pings"]
    assert rows["id"].tolist() == receptions.ping.tolist()
    assert [f"AUV{it:.0f}" for it in rows["auv"]] == receptions.auv.tolist()
    assert [f"ASV{it:.0f}" for it in rows["asv"]] == receptions.asv.tolist()
    assert rows["x"] == pytest.approx(pings.x_m.to_numpy()[receptions.ping], abs=0.01)
    shown = data["receptions"]["ping"]
    assert shown.tolist() == np.flatnonzero(receptions.outcome != "out_of_range").tolist()
    assert "passive ranging, fixed_gain navigation" in lossy.report()


@pytest.mark.parametrize("kind", ["fixes", "coverage", "timeline", "round", "latency"])
def test_figures_are_drawn(lossy: Result, kind: str) -> None:
    lossy.plot(kind)


def test_rays_go_from_asvs_to_auvs(lossy: Result, tmp_path: Path) -> None:
    """The MCAP has the pings of each ASV on its topic, and all that is in the tables."""
    words = ("--to", "mcap", "--out", tmp_path / "run.mcap", "--json")
    counts = json.loads(call("export", lossy.write(tmp_path / "run"), *words).stdout)["counts"]
    pings = lossy.tables["pings"]
    for asv in ("ASV0", "ASV1"):
        assert counts[f"/{asv}/pings"] == (pings.asv == asv).sum()
    assert counts["/scene/pings"] == len(pings)
    assert not any(topic.endswith("/broadcasts") and count for topic, count in counts.items()
                   if topic.startswith("/ASV"))  # fmt: skip


def test_a_folder_comes_back_and_a_wrong_one_is_refused(lossy: Result, tmp_path: Path) -> None:
    """ASVs ping, each fix has been had, and none was broadcast."""
    folder = tmp_path / "run"
    lossy.write(folder)
    again = load_result(folder)
    assert all(again.arrow[name].equals(lossy.arrow[name]) for name in lossy.arrow)
    changed("pings", lambda it: column_set(it, "auv", ["AUV0"]))(folder)
    with pytest.raises(ValueError, match="was edited"):
        load_result(folder)
