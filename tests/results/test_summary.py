"""The summary of a mission: a table that fits a terminal, whatever the size of the fleet."""

from dataclasses import replace
from pathlib import Path

import pytest
from advice_for_tests import advised, effect
from worlds import GOOD, paper_case, scenario

from bindusbl_des import Result, simulate


def table(result: Result) -> list[str]:
    """Return the lines of the table, the last part of a summary without advice."""
    return result.summary().split("\n\n")[-1].splitlines()


@pytest.mark.parametrize("count", [1, 12, 20, 21, 150])
def test_the_summary_fits_a_terminal(count: int) -> None:
    """At most 80 columns and 30 lines; every AUV of a fleet of 20 has its row."""
    summary = {"detail": "summary"}
    result = simulate(scenario(duration_s=4.0, auvs={"count": count}, record=summary))
    rows = table(result)
    assert max(map(len, result.summary().splitlines())) <= 80
    assert len(rows) <= 30
    named = [row for row in rows if row.startswith("AUV") and not row.startswith("AUV ")]
    assert len(named) == (count if count <= 20 else 10)


def test_a_large_fleet_shows_between_what_its_values_lie() -> None:
    """Least, mean and largest are those of all AUVs, also of those that have no row."""
    result = simulate(scenario(duration_s=6.0, auvs={"count": 40}, record={"detail": "summary"}))
    rows = {row.split()[0]: row.split() for row in table(result)}
    error = result.auvs.position_error_m
    for name, value in (("min", error.min()), ("mean", error.mean()), ("max", error.max())):
        assert rows[name][-3] == f"{value:.2f}"
    assert rows["+30"][1:] == ["..."] * 8


def test_the_worst_auv_stands_below_the_mean() -> None:
    """One ASV in 140 m: the fleet's mean hides AUV0, whom the last rows give value and number."""
    result = simulate(paper_case(1), seed=0)
    *_, worst, of, _ = table(result)
    row = result.auvs.iloc[0]
    assert worst.split() == [
        "worst", f"{100 * row.hf_coverage:.0f}", f"{row.fixes_delivered}",
        f"{result.auvs.interval_mean_s.max():.2f}", f"{row.fix_age_max_s:.1f}",
        f"{row.latency_mean_s:.3f}", f"{row.position_error_m:.2f}",
        f"{row.position_error_p95_m:.2f}", f"{result.auvs.imu_error_m.max():.2f}",
    ]  # fmt: skip
    assert of.split()[:4] == ["of", "AUV", "0", "0"]
    assert "worse" not in result.summary()  # fixes are worth 2.5 m here


# An inertial system so good that fixes at 300 m do harm with the paper's gain.


def test_harm_is_said_first_and_as_a_fact_where_nothing_was_tried() -> None:
    """1.87 m with fixes, 0.88 m without: one mission says so, and that it may be chance."""
    result = simulate(scenario(**GOOD), seed=0)
    said = " ".join(result.summary().split())
    assert said.startswith(
        "In this mission fixes made AUV2 worse: 1.87 m with, 0.88 m without; AUV0 worse: "
    )
    assert "It may be chance: other seeds, which would tell, were not tried" in said


def test_harm_that_was_measured_names_the_gain_that_was_tried(tmp_path: Path) -> None:
    """Harm over many seeds is said first, with the gain that helps and the real remedy."""
    result = simulate(scenario(**GOOD), seed=0)
    gain = effect("gain", "navigation.filter.gain=0.05", mean_m=-1.4, low_m=-1.5, high_m=-1.3)
    kalman = effect("filter", "navigation.filter=kalman", mean_m=-1.9, low_m=-2.0, high_m=-1.8)
    harm = {
        "auv": "AUV2", "with_m": 2.0, "without_m": 0.7, "mean_m": 1.3, "low_m": 1.1,
        "high_m": 1.5, "seeds": 26,
    }  # fmt: skip
    measured = {"error_m": 2.1, "effects": [kalman, gain], "harms": [harm], "harm_seeds": 26}
    result = advised(result, tmp_path / "run", **measured)
    assert result.advice is not None
    said = " ".join(result.summary().split())
    assert said.startswith(
        "Fixes make AUV2 worse: 1.87 m with, 0.88 m without; try navigation.filter.gain 0.05 "
        "(-1.40 m [-1.50, -1.30]), or navigation.filter kalman (-1.90 m [-2.00, -1.80]); in "
        "brackets the change of the worst AUV's error. Over 26 missions with other seeds "
        "AUV2 had 2.00 m with fixes and 0.70 m without: +1.30 m [+1.10, +1.50]. The real remedy "
        "is a filter that weighs each fix by its covariance"
    )
    result.advice = replace(result.advice, fixed_gain=False)
    assert "real remedy" not in result.summary()
    result.advice = replace(result.advice, harms=())  # measured, and found to be chance
    assert "worse" not in result.summary()


def test_options_can_be_copied_from_a_terminal(tmp_path: Path) -> None:
    """Options that do not fit into 80 columns are continued on the next line."""
    result = simulate(paper_case(1, duration_s=20.0), seed=0)
    settings = tuple(f"asvs.formation.{name}=12.5" for name in ("radius_m", "angle_deg", "other"))
    helps = effect("formation", *settings, words="a formation " * 9)
    none = {**helps, "words": "nothing", "verdict": "no measurable effect"}
    untried = ["more", "most"]
    result = advised(result, tmp_path / "run", error_m=4.5, effects=[helps, none], untried=untried)
    lines = result.summary().splitlines()
    assert max(map(len, lines)) <= 80
    start = lines.index(
        "    --set asvs.formation.radius_m=12.5 --set asvs.formation.angle_deg=12.5 \\"
    )
    assert lines[start + 1] == "    --set asvs.formation.other=12.5"
    assert "No measurable effect: nothing. 2 changes were not tried" in result.summary()
