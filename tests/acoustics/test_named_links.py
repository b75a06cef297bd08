"""Channels that know which vehicles they are asked about: of one's own, and measured links."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call

from bindusbl_des import Scenario, Setup, Signals, limits, simulate


def flown(hf: Any = "disc", mf: Any = "disc", seed: int = 0, **keys: Any) -> Any:
    bands = {"hf": {"channel": hf}, "mf": {"channel": mf}}
    data = {"name": "links", "duration_s": 40, "acoustics": bands} | keys
    return simulate(Scenario.model_validate(data), seed)


ASKED: list[tuple[Any, ...]] = []


def listed(signals: Signals) -> Any:
    """AUV1 is heard by ASV2 alone, and says what it was asked."""
    assert signals.auv_numbers is not None
    assert signals.asv_numbers is not None
    assert isinstance(signals.random, np.random.Generator)
    ASKED.append((signals.band, signals.calling, signals.asv_numbers.tolist()))
    chance = np.ones(signals.ranges.shape)
    chance[signals.auv_numbers == 1] = signals.asv_numbers == 2
    return chance


def test_ones_own_knows_who_is_asked_about() -> None:
    ASKED.clear()
    result = flown(listed, listed, protocol={"schedule": "one_per_slot"})
    heard = result.tables["receptions"].query("outcome == 'heard'")
    assert set(heard[heard.auv == "AUV1"].asv) == {"ASV2"}
    assert set(heard[heard.auv == "AUV0"].asv) == {"ASV0", "ASV1", "ASV2"}
    frames = result.tables["frame_receptions"].query("outcome == 'heard' and auv == 'AUV1'")
    assert set(result.tables["broadcasts"].asv[frames.broadcast]) == {"ASV2"}
    assert ("hf", False, [0, 1, 2]) in ASKED
    assert ("mf", True, [2]) in ASKED


def loud(signals: Signals) -> Any:
    """20 dB less for each ASV by its number; what comes is late, by 2 ms and some more."""
    shape = signals.ranges.shape
    level = np.broadcast_to(120.0 - 20.0 * signals.asv_numbers, shape)
    late, more = np.full(shape, 2e-3), np.full(shape, 1e-4)
    return {"chance": np.ones(shape), "level_db": level, "delay_s": late, "delay_sd_s": more}


loud.noise_db = 60.0  # type: ignore[attr-defined]  # as a part declares it


def test_a_mapping_tells_levels_and_delays() -> None:
    result = flown(loud, protocol={"schedule": "one_per_slot"})
    table = result.tables["receptions"]
    number = table.asv.str[3:].astype(int)
    assert np.allclose(table.level_db, 120.0 - 20.0 * number)
    assert np.allclose(table.snr_db, 60.0 - 20.0 * number)
    assert table.margin_db.isna().all()
    late = table.travel_time_s - table.slant_range_m / 1500.0
    assert late.mean() == pytest.approx(2e-3, abs=2e-5)
    assert late.std() == pytest.approx(1e-4, rel=0.2)
    again = flown(loud, protocol={"schedule": "one_per_slot"}).tables["receptions"]
    assert table.equals(again)


def captured(signals: Signals) -> Any:
    return loud(signals)


captured.noise_db, captured.capture_db = 60.0, 6.0  # type: ignore[attr-defined]


def test_the_louder_of_two_survives_where_capture_is_declared() -> None:
    """Two AUVs of one slot at one ASV: 20 dB apart by what their channel says."""

    def apart(signals: Signals) -> Any:
        level = 120.0 - 20.0 * signals.auv_numbers[:, None] + 0.0 * signals.ranges
        return {"chance": np.ones(signals.ranges.shape), "level_db": level}

    apart.capture_db = 6.0  # type: ignore[attr-defined]
    keys = {"protocol": {"access": "aloha", "frame_s": 0.2}, "auvs": {"count": 2}}
    table = flown(apart, **keys).tables["receptions"]
    assert not (table[table.auv == "AUV0"].outcome == "collided").any()
    assert (table[table.auv == "AUV1"].outcome == "collided").any()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ({"level_db": 1.0}, "returned no chance at 0 s; a mapping has chance, level_db, delay_s"),
        ({"chance": 1.0, "phase": 0.0}, "returned phase as well at 0 s"),
        ({"chance": 1.0, "delay_s": np.nan}, "as delay_s at 0 s; it must be an array of times"),
        ({"chance": 1.0, "delay_sd_s": -1.0}, "as delay_sd_s at 0 s; it must be an array of times"),
        ({"chance": 1.0, "level_db": 1e9}, "as level_db at 0 s; it must be an array of levels"),
        ({"chance": 2.0}, "it must be an array of probabilities in"),
    ],
)
def test_answers_are_checked(answer: dict[str, float], words: str) -> None:
    def wrong(signals: Signals) -> Any:
        return {name: np.full(signals.ranges.shape, value) for name, value in answer.items()}

    with pytest.raises(ValueError, match=r"acoustics\.hf\.channel") as error:
        flown(wrong)
    assert words in str(error.value)


LINKS = """time_s,from,to,chance
0,AUV0,ASV0,1
20,AUV0,ASV0,0
0,AUV1,ASV1,0.5
0,ASV2,AUV2,1
"""


def series(folder: Path, text: str = LINKS, **settings: Any) -> dict[str, Any]:
    (folder / "links.csv").write_text(text)
    return {"model": "series", "file": str(folder / "links.csv"), **settings}


def test_links_are_as_good_as_was_measured(tmp_path: Path) -> None:
    """The last value holds; a link in one direction holds both ways; others hear nothing."""
    table = flown(series(tmp_path), duration_s=200).tables["receptions"]
    table = table[table.outcome != "in_flight"]
    pairs = table.auv + "-" + table.asv
    early = table.arrived_at_s < 20.0
    assert set(table[(pairs == "AUV0-ASV0") & early].outcome) == {"heard"}
    assert set(table[(pairs == "AUV0-ASV0") & ~early].outcome) == {"out_of_range"}
    half = table[pairs == "AUV1-ASV1"].outcome == "heard"
    assert 0.35 < half.mean() < 0.65
    assert set(table[pairs == "AUV2-ASV2"].outcome) == {"heard"}
    rest = table[~pairs.isin(["AUV0-ASV0", "AUV1-ASV1", "AUV2-ASV2"])]
    assert set(rest.outcome) == {"out_of_range"}


def test_a_direction_of_its_own_counts_for_itself(tmp_path: Path) -> None:
    """Calls go down, answers up."""
    text = "time_s,from,to,chance\n0,AUV0,ASV0,0\n0,ASV0,AUV0,1\n"
    both = {"ranging": "twtt"}, {"count": 1}
    result = flown(series(tmp_path, text), protocol=both[0], auvs=both[1], asvs=both[1])
    assert set(result.tables["pings"].call) == {"heard"}
    assert set(result.tables["receptions"].outcome) == {"out_of_range"}


def test_levels_are_decoded_above_their_threshold(tmp_path: Path) -> None:
    text = "time_s;from;to;level_db\n0;AUV0;ASV0;90\n0;AUV1;ASV1;85\n0;AUV2;ASV2;70\n"
    told = {"threshold_db": 85.0, "noise_db": 60.0, "shadowing_sd_db": 2.0}
    table = flown(series(tmp_path, text, **told), duration_s=200).tables["receptions"]
    shares = (table.outcome == "heard").groupby(table.auv + table.asv).mean()
    assert shares["AUV0ASV0"] > 0.97
    assert 0.35 < shares["AUV1ASV1"] < 0.65
    assert shares["AUV2ASV2"] == 0.0
    heard = table[table.outcome == "heard"]
    assert np.allclose(heard.margin_db, heard.level_db - 85.0)
    assert (heard.margin_db >= 0.0).all()
    assert np.allclose(heard.snr_db, heard.level_db - 60.0)


def test_frames_go_by_links_as_well(tmp_path: Path) -> None:
    result = flown(mf=series(tmp_path))
    frames, met = result.tables["broadcasts"], result.tables["frame_receptions"]
    pairs = met.auv + "-" + frames.asv[met.broadcast].to_numpy()
    assert set(pairs[met.outcome == "heard"]) <= {"AUV0-ASV0", "AUV1-ASV1", "AUV2-ASV2"}
    assert (met.outcome == "heard").any()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,from,to\n0,AUV0,ASV0\n", ":1: column chance or level_db missing"),
        ("time_s,from,chance\n0,AUV0,1\n", ":1: column to missing"),
        ("time_s,from,to,chance\n0,AUV0,boat,1\n", ":2: to is 'boat'; name a vehicle"),
        ("time_s,from,to,chance\n0,AUV0,ASV0,90\n", ":2: chance is 90, not within 0 and 1; divide"),
        ("time_s,from,to,chance\nnow,AUV0,ASV0,1\n", ":2: time_s is 'now'; give a number"),
        ("time_s,from,to,chance\n0,AUV9,ASV0,1\n", ":2: from is 'AUV9', and the mission has 3"),
        ("time_s,from,to,chance\n5,AUV0,ASV0,1\n5,AUV0,ASV0,0\n", ":3: time_s is 5 after 5"),
        ("time_s,from,to,level_db\n0,AUV0,ASV0,90\n", "give threshold_db"),
        ("time_s,from,to,chance,level_db\n0,AUV0,ASV0,1,9\n", "has both chance and level_db"),
    ],
)
def test_a_file_that_is_none_is_refused_with_its_line(
    text: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / "links.csv").write_text(text)
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("name: m\nacoustics:\n  hf: {channel: {model: series, file: links.csv}}\n")
    result = call("validate", scenario)
    said = result.output
    assert result.exit_code == 2
    assert "scenario.yaml:3:" in said
    assert "acoustics.hf.channel.file" in said
    assert words in said
    assert "Traceback" not in said


def test_predictions_do_not_ask_links_about_places(tmp_path: Path) -> None:
    scenario = Scenario.model_validate(
        {"name": "m", "acoustics": {"hf": {"channel": series(tmp_path)}}}
    )
    assert limits(scenario)
    channel = Setup(scenario).ping_channel
    assert channel is not None
    with pytest.raises(ValueError, match="tells of no places"):
        channel.prospects(
            Signals(0.0, np.zeros((1, 3)), np.zeros((1, 3)), np.ones((1, 1)), 50.0, False)
        )
