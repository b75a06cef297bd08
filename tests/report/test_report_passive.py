"""Pages, figures and exports of passive ranging: who pings has changed, what is told adds up."""

from pathlib import Path

import numpy as np
import pytest
from damage_for_tests import changed, column_set
from test_report import told, unpacked
from worlds import scenario

from bindusbl_des import Result, load_result, simulate
from bindusbl_des.export.mcap_file import write_mcap
from bindusbl_des.report.gaps import patience, service
from bindusbl_des.report.page import Packer
from bindusbl_des.report.recording import FATES, recording
from bindusbl_des.report.run_data import run_data


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
    mission, tables = recording(lossy), lossy.tables
    fates = [FATES[code] for code in mission.fate]
    outcomes = tables["receptions"].outcome.replace(
        {"heard": "delivered", "out_of_range": "out_of_hf"}
    )
    assert fates == outcomes.tolist()
    assert {"delivered", "out_of_hf", "lost"} <= set(fates)
    wait, sent = patience(mission), np.array([it.sent_at_s for it in tables["pings"].itertuples()])
    for auv in range(3):
        own = service(mission, auv, wait)
        inside = sum(
            any((it.is_first or it.start < ping) and ping < it.end for it in own.gaps)
            for ping in sent
        )
        assert sum(own.fates.values()) == inside
    beyond = mission.nearest[np.array(fates) == "out_of_hf"]
    assert beyond.min() > 199.9
    assert mission.nearest[np.array(fates) == "delivered"].max() < 200.1


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
    mission, packer = recording(lossy), Packer()
    data = run_data(mission, (), packer)
    packed = packer.text()
    pings, receptions = lossy.tables["pings"], lossy.tables["receptions"]
    assert data["asvsPing"]
    rows = {name: unpacked(data["pings"][name], packed) for name in ("id", "auv", "asv", "x")}
    assert rows["id"].tolist() == receptions.ping.tolist()
    assert [f"AUV{it:.0f}" for it in rows["auv"]] == receptions.auv.tolist()
    assert [f"ASV{it:.0f}" for it in rows["asv"]] == receptions.asv.tolist()
    assert rows["x"] == pytest.approx(pings.x_m.to_numpy()[receptions.ping], abs=0.01)
    shown = unpacked(data["receptions"]["ping"], packed)
    assert shown.tolist() == np.flatnonzero(receptions.outcome != "out_of_range").tolist()
    assert "passive ranging, fixed_gain navigation" in lossy.report()


@pytest.mark.parametrize("kind", ["fixes", "coverage", "timeline", "round", "latency"])
def test_figures_are_drawn(lossy: Result, kind: str) -> None:
    lossy.plot(kind)


def test_rays_go_from_asvs_to_auvs(lossy: Result, tmp_path: Path) -> None:
    """The MCAP has the pings of each ASV on its topic, and all that is in the tables."""
    counts = write_mcap(lossy, tmp_path / "run.mcap")
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
