"""Joint readings of the paper: their names, their missions, and the count of what each meets."""

import json
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaigns_for_tests import fly_with
from click.testing import Result
from commands_for_tests import call
from paper_for_tests import Measured, Prediction, Published, Reason, campaigns, published

from bindusbl_des.experiments.reproduction.counting import Tally, asked, gap, is_put_in, sign_test
from bindusbl_des.experiments.reproduction.readings import Reading, reading_named, readings

DEFAULT, LIKELY = Reading(), reading_named("likely")
PAGE = Path(__file__).parents[2] / "docs" / "reproduction.md"

LOADED = campaigns.load  # which a test replaces

TRUTH = Reading("position", "world", "shift", "paper_raw", "by_lot", speed="published_speeds")


def number(text: str) -> Published:
    return Published("tab:x", "140", "3", "1", "0", "AUV0", "fixes", text, "1")


def tally_of(*meets: Callable[[Reading], bool], put_in: int = 0) -> Tally:
    """Return the count of numbers of which each is met by the readings that a rule tells.

    The first `put_in` of them are taken from the paper by the readings that meet them.
    """
    met = np.array([[rule(reading) for rule in meets] for reading in readings()])
    taken = met & (np.arange(len(meets)) < put_in)
    rows = [number(str(n)) for n in range(len(meets))]
    return Tally(rows, met, (~met).astype(float), taken)


def makes(*choices: str) -> Callable[[Reading], bool]:
    return lambda reading: all(choice in reading.words for choice in choices)


# Names


def test_every_choice_has_one_factor_and_every_field_is_a_factor() -> None:
    """Choices can be named in any order, as no two factors share a word."""
    choices = [{it.words[n] for it in readings()} for n in range(len(DEFAULT.words))]
    assert sorted(map(len, choices)) == [2, 2, 2, 2, 2, 2, 4, 5]
    assert len(set.union(*choices)) == sum(map(len, choices))
    assert len(asdict(DEFAULT)) == len(choices)


def test_there_are_1280_readings_each_with_a_name() -> None:
    """4 x 2 x 2 x 5 x 2 x 2 x 2 x 2, and every name leads back to its reading."""
    known = list(readings())
    assert len(known) == len(set(known)) == 1280
    assert all(reading_named(reading.name) == reading for reading in known)


def test_names_begin_where_they_say() -> None:
    """What is not named stays as in `default`, or in the reading that is named first."""
    assert reading_named("default") == DEFAULT
    assert reading_named("shift/world") == Reading(bias="world", delay="shift")
    assert reading_named("likely/cross_track") == replace(LIKELY, error="cross_track")
    assert reading_named("none/world") == Reading(bias="world")


def test_an_unknown_name_is_told_with_the_nearest_and_the_list() -> None:
    """A slip of the pen finds its word; all words are listed."""
    with pytest.raises(ValueError, match="unknown") as error:
        reading_named("position/wrold")
    assert "'wrold' is unknown; did you mean 'world'?" in str(error.value)
    assert all(choice in str(error.value) for it in readings() for choice in it.words)


def test_two_choices_of_one_factor_are_refused() -> None:
    """A mission has one frame."""
    with pytest.raises(ValueError, match="body and world are both choices of bias"):
        reading_named("body/world")


# Missions


@pytest.mark.slow
def test_each_distinct_mission_is_run_once() -> None:
    """Readings that differ in nothing that a mission depends on share its row."""
    for experiment in campaigns.all_readings(quick=False):
        count = len(experiment.points)
        flown = {experiment.scenario(number).model_dump_json() for number in range(count)}
        assert len(flown) == count
    sizes = {it.name: len(it.points) for it in campaigns.all_readings(quick=False)}
    assert sizes == {
        "baseline": 3 * 2 * 2,  # losses, turns, replies
        "table_1": 2 * 3 * 2 * 2 * 4,  # ASVs, losses, bias, delay, speeds
        "two_asvs": 2 * 3 * 2 * 2 * 4,  # angles
        "sweep": 3 * 8 * (1 + 4 + 4) * 3 * 2 * 2,  # sides, teams, formations
        "sweep_distance": 3 * 8 * (1 + 4 + 4) * 3 * 2 * 2,
    }


def test_a_reading_sets_what_it_says() -> None:
    """The likely reading's missions: world bias, shifted fixes, each AUV at its own speed."""
    runs = {it.name: it for it in campaigns.one_reading(LIKELY, quick=True)}
    assert set(runs) == {"baseline", "table_1", "two_asvs", "sweep"}
    protocol = runs["baseline"].scenario(0).protocol
    assert (protocol.schedule, protocol.answer.reply_at) == ("random", "ping_front")
    navigation = runs["sweep"].scenario(0).navigation
    assert (navigation.bias_frame, navigation.fixed_gain.delay_compensation) == ("world", "shift")
    speeds = {point["auvs.speed_m_per_s"] for point in runs["table_1"].points}
    assert sorted(speeds) == pytest.approx([182 / 300, 190 / 300, 192 / 300], abs=1e-6)
    equal_distance = replace(LIKELY, sweep="equal_distance")
    names = {it.name for it in campaigns.one_reading(equal_distance, quick=True)}
    assert "sweep_distance" in names
    assert "sweep" not in names


def test_a_baseline_is_lossless_unless_the_loss_is_everywhere() -> None:
    """The paper calls the baseline's conditions ideal; a joint loss may hold there too."""
    losses = {
        choice: Reading(loss=choice).baseline["acoustics.loss.combine"]
        for choice in ("clamp_first", "clamp_first_everywhere", "paper_raw_everywhere", "off")
    }
    assert losses == {
        "clamp_first": "off",
        "clamp_first_everywhere": "clamp_first",
        "paper_raw_everywhere": "paper_raw",
        "off": "off",
    }
    assert Reading(loss="paper_raw_everywhere").missions["acoustics.loss.combine"] == "paper_raw"


def test_a_number_is_looked_up_where_its_reading_says() -> None:
    """AUV2's error in Table I under the likely reading is a position error at 182 m in 300 s."""
    row = next(r for r in published() if (r.auv, r.asvs, r.quantity) == ("AUV2", "3", "cte"))
    question = asked(row, LIKELY)
    assert (question.campaign, question.column) == ("table_1", "position_error_m")
    assert dict(question.where)["auvs.speed_m_per_s"] == pytest.approx(182 / 300, abs=1e-6)
    assert asked(row, LIKELY) == asked(row, replace(LIKELY, turns="in_turn"))  # not its baseline


def test_distances_are_put_in_by_the_speeds_taken_from_them() -> None:
    """A reading that takes its speeds from six distances meets them and explains nothing."""
    taken = [row for row in published() if is_put_in(row, LIKELY)]
    assert [row.quantity for row in taken] == ["distance"] * 6
    assert not any(is_put_in(row, DEFAULT) for row in published())


# The count


def test_the_best_reading_is_the_one_that_was_measured() -> None:
    """Of numbers that each depend on one choice of a known reading, that reading meets all."""
    counted = tally_of(*(makes(choice) for choice in TRUTH.words))
    assert counted.best == TRUTH
    assert counted.counts.max() == len(TRUTH.words)
    assert counted.foretold[counted.place(DEFAULT)] == 2  # ping_front, equal_time


def test_a_switch_is_worth_the_numbers_that_it_loses() -> None:
    """Three numbers want the world bias, two of them with shifted fixes as well."""
    counted = tally_of(makes("world"), *[makes("world", "shift")] * 2, makes("none"))
    assert counted.best.words[:3] == ("cross_track", "world", "shift")
    worth = {it.choice: (it.alone, it.best) for it in counted.switches()}
    assert worth["body"] == (0, 1)  # alone, the shift has nothing left to gain by
    assert worth["none"] == (2, 2)
    assert worth["off"] == (3, 3)
    assert "world" not in worth


def test_equal_counts_are_decided_by_the_gaps() -> None:
    """Of two readings that meet as many numbers the nearer one is better."""
    met = np.zeros((1280, 1), dtype=bool)
    gaps = np.ones((1280, 1))
    counted = Tally([number("1")], met, gaps, met)
    place = counted.place(TRUTH)
    gaps[place] = 0.5
    assert counted.best == TRUTH


def test_what_is_put_in_counts_as_met_but_not_as_foretold() -> None:
    """Numbers that a reading takes from the paper rank it, and are left out of every test."""
    speeds = [makes("published_speeds")] * 2
    counted = tally_of(*speeds, makes("common_speed"), put_in=2)
    assert counted.best.speed == "published_speeds"
    assert counted.best_foretold.speed == "common_speed"
    assert counted.foretold.max() == 1
    assert counted.free.tolist() == [False, False, True]


def test_readings_are_told_apart_by_the_numbers_they_do_not_share() -> None:
    """Six numbers against none tell two readings apart (1/32 < 5 %), five do not."""
    assert sign_test(6, 0) == 2 / 2**6
    assert sign_test(5, 0) == 2 / 2**5
    assert sign_test(4, 4) == sign_test(0, 0) == 1.0
    six = tally_of(*[makes("world")] * 6)
    assert all("world" in rival.words for rival in six.rivals())
    five = tally_of(*[makes("world")] * 5)
    assert len(five.rivals()) == 1279


def test_luck_finds_a_best_reading_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers that favour one reading together are beyond luck; numbers on their own are not."""
    monkeypatch.setattr(f"{Tally.__module__}.SHUFFLES", 60)
    joint = tally_of(*[makes("position", "paper_raw", "shift")] * 8)
    assert joint.by_chance.share == 0.0
    assert joint.by_chance.mean < 6
    alone = tally_of(*(makes(*reading.words[:4]) for reading in [*readings()][:: 1280 // 8]))
    assert alone.by_chance.share > 0.5


def test_gaps_are_shares_of_what_was_published() -> None:
    """Off by a tenth is 0.1; a bound that is kept has no gap; 0 fixes are off by what is met."""

    def measured(text: str, mean: float, claim: str = "equals") -> Measured:
        found = Prediction(mean, mean, mean, 9)
        return Measured(number(text), "", found, Reason("", ""), (), claim)  # type: ignore[arg-type]  # any text

    assert gap(measured("10", 9.0)) == pytest.approx(0.1)
    assert gap(measured("10", 5.0, "at most")) == 0.0
    assert gap(measured("10", 12.0, "at most")) == pytest.approx(0.2)
    assert gap(measured("0", 0.25)) == 0.25


# The command


def tiny(name: str) -> Any:
    """Return an experiment of the paper with 30 s missions, small teams and two seeds."""
    experiment = LOADED(name)
    points = tuple(
        {**point, "duration_s": 30.0}
        for point in experiment.points
        if point.get("auvs.count", 3) == 3
        and (name == "two_asvs" or not point.get("asvs.formation.angle_deg"))
    )
    return replace(experiment, points=points, seeds=(0, 1))


def run(*options: str) -> Result:
    """Run `reproduce --quick` with tiny missions in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(campaigns, "load", tiny)
        patch.setattr(f"{Tally.__module__}.SHUFFLES", 20)
        fly_with(patch)
        return call("-q", "reproduce", "--quick", *options)


@pytest.fixture(scope="module")
def counted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a whole, tiny count made by the command; its answer is in answer.json."""
    folder = tmp_path_factory.mktemp("readings") / "out"
    result = run("--readings", "--json", "--out", str(folder))
    assert result.exit_code == 0, result.output
    (folder / "answer.json").write_text(result.stdout)
    return folder


@pytest.mark.slow
def test_readings_are_counted_by_the_command(counted: Path) -> None:
    """Table, page and answer agree on the best reading."""
    import pandas as pd

    answer = json.loads((counted / "answer.json").read_text())
    table = pd.read_csv(counted / "readings.csv")
    assert len(table) == answer["readings"] == 1280
    best = answer["best"][0]
    assert table.reading[0] == best["reading"]
    assert table.met[0] == best["met"] == table.met.max()
    numbers = table.columns[list(table.columns).index("off_by") + 1 :]
    assert len(numbers) == answer["numbers"] == 49
    assert (table[numbers].sum(axis=1) == table.met).all()
    page = (counted / "readings.md").read_text()
    assert f"**The authors most likely ran `{best['reading']}`**" in page
    assert (counted / "figures" / "reproduction" / "readings.png").stat().st_size > 3000


@pytest.mark.slow
def test_the_count_is_told_in_80_columns(counted: Path) -> None:
    """A second call runs nothing again and tells the best readings and every switch."""
    result = run("--readings", "--out", str(counted))
    lines = result.stdout.splitlines()
    assert lines[0] == "1280 joint readings of 49 numbers; the best:"
    assert max(map(len, lines[:-1])) <= 80
    assert sum("  with " in line or line.endswith("best") for line in lines) >= 10


def test_one_reading_is_run_by_name(tmp_path: Path) -> None:
    """Page, table and answer say which reading they are of."""
    import pandas as pd

    options = ("--reading", "world/position", "--out", str(tmp_path / "out"))
    result = run(*options, "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert answer["reading"] == "position/world"
    assert answer["choices"]["bias"] == "world"
    assert len(answer["numbers"]) == 49
    page = (tmp_path / "out" / "reproduction.md").read_text()
    assert page.startswith("# The paper in one reading: position/world\n")
    assert "| bias | `world` |" in page
    table = pd.read_parquet(tmp_path / "out" / "paper_vs_measured.parquet")
    assert set(table.reading) == {"position/world"}
    assert run(*options).stdout.startswith("Reading: position/world\n")


def test_an_unknown_reading_ends_with_2(tmp_path: Path) -> None:
    """The nearest word and the whole list are told; nothing is written."""
    out = tmp_path / "out"
    result = call("reproduce", "--reading", "likly", "--out", out)
    assert result.exit_code == 2
    assert "did you mean 'likely'?" in result.output
    assert "published_speeds" in result.output
    assert not out.exists()


def test_one_reading_and_all_of_them_are_two_commands() -> None:
    """Both at once have no meaning."""
    result = call("reproduce", "--readings", "--reading", "likely")
    assert result.exit_code == 2
    assert "give one of them" in result.output


# The manual


@pytest.mark.slow
def test_the_page_in_the_manual_is_what_the_program_writes(counted: Path) -> None:
    """Titles, tables and wording of the section are the program's, its best reading is `likely`."""
    section = PAGE.read_text().partition("## The paper in one reading\n")[2]
    section = section.partition("\n## ")[0]
    assert f"**The authors most likely ran `{LIKELY.name}`** (`likely`)" in section
    assert f"| 1 | `{LIKELY.name}` |" in section
    assert (PAGE.parent / "figures" / "reproduction" / "readings.png").is_file()
    page = (counted / "readings.md").read_text().partition("\n## ")[0]
    assert heads(section) == heads(page)
    told = [line for line in page.splitlines() if re.match(r"\|[^|]*\| `\w+`:|\*[A-Z]", line)]
    assert len(told) > 3
    assert not [line for line in told if line not in section]  # choices, and the caption


def heads(text: str) -> list[str]:
    """Return the first line of each table."""
    lines = text.splitlines()
    return [line for line, below in pairwise(lines) if below.startswith("|---")]
