"""What campaigns are said to show, where the right conclusion is known: missions made by hand."""

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from campaigns_for_tests import UNSERVED, auv, hand_made, parts
from commands_for_tests import call

from bindusbl_des import Campaign, Scenario, compare, sweep
from bindusbl_des.apps.campaigns.statistics.findings import compared_with_best
from bindusbl_des.apps.campaigns.storage.parts import commit

Fleet = Sequence[dict[str, float | None]]
COUNT, GAIN = "asvs.count", "navigation.filter.gain"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., Campaign]:
    """Sweep missions that come to what a function of scenario and seed says."""
    monkeypatch.chdir(tmp_path)
    Path("base.yaml").write_text("name: base\nnavigation: {filter: fixed_gain}\n")

    def make(
        fleet: Callable[[Scenario, int], Fleet],
        seeds: int | list[int] = 4,
        out: str = "c",
        **vary: Any,
    ) -> Campaign:
        hand_made(monkeypatch, fleet)
        keys = {
            "count": COUNT, "gain": GAIN, "sd": "navigation.velocity_bias_sd_m_per_s",
            "clearance": "asvs.formation.clearance_m", "schedule": "protocol.schedule",
        }  # fmt: skip
        varied = {keys[name]: values for name, values in vary.items()}
        return sweep("base.yaml", out, vary=varied, seeds=seeds)

    return make


def test_columns_of_a_wide_table_can_be_read(made: Callable[..., Campaign]) -> None:
    """Keys that do not fit have letters, which are told; none is cut."""
    campaign = made(
        lambda *_: [auv(10.81)], count=[2, 3], clearance=[15, 20], gain=[0.9, 0.05],
        schedule=["round_robin", "one_per_slot"],
    )  # fmt: skip
    told, head, _, point, *more = campaign.summary().splitlines()
    assert told == "A: clearance_m, B: count"
    assert head.split()[:6] == ["point", "B", "A", "gain", "schedule", "ok"]
    assert point.split()[:6] == ["0", "2", "15", "0.9", "round_robin", "4"]
    assert max(map(len, (head, point, *more))) <= 80
    assert "~" not in head + point


@dataclass(frozen=True)
class Said:
    """The sentences on what a campaign shows: on the best point, on sure ones, on harm, ..."""

    sentences: list[str]

    def those(self, *words: str) -> tuple[str, ...]:
        return tuple(it for it in self.sentences if any(word in it for word in words))

    @property
    def best(self) -> str:
        return self.sentences[0]

    @property
    def sure(self) -> str:
        return self.those("surely below", "keeps every AUV", "nothing is surely")[0]

    @property
    def harm(self) -> tuple[str, ...]:
        return self.those("Fixes make", "fixes harm", "worse with fixes")

    @property
    def starved(self) -> tuple[str, ...]:
        return self.those("No fix at point")

    @property
    def collided(self) -> str:
        return "".join(self.those("collided"))


def said(campaign: Campaign) -> Said:
    told = call("resume", campaign.folder, "--json")
    return Said(json.loads(told.stdout)["findings"])


def flat(text: str) -> str:
    """Return what a terminal shows as one line."""
    return " ".join(text.split())


Make = Callable[..., Campaign]


def noise(seed: int) -> float:
    """Return a small error that the seed makes, zero on average over seeds 0 to 3."""
    return 0.01 * (seed % 4 - 1.5)


def test_a_mean_does_not_hide_the_worst_auv(made: Make) -> None:
    """A fleet with a mean error of 0.8 m in which AUV0 has 1.5 m is not below a metre."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        worst = 1.5 if scenario.asvs.count == 2 else 0.9
        return [auv(worst + noise(seed)), auv(0.45), auv(0.45)]

    campaign = made(fleet, count=[2, 3])
    assert campaign.missions.position_error_m.round(1).unique().tolist() == [0.8, 0.6]
    found = said(campaign)
    assert found.best.startswith(
        "Smallest error of the worst AUV: point 1 (asvs.count=3), 0.900 +- 0.021 m over 4 seeds "
        "(AUV0 is the worst in all); 95 % of the time every AUV is below 1.800 +- 0.041 m."
    )
    assert found.sure == (
        "1 of 2 points keeps every AUV surely below 1 m in the mean over time, none of them for "
        "95 % of the time as well (upper ends of the 95 % intervals)."
    )
    assert (found.harm, found.starved) == ((), ())


def test_the_worst_of_each_mission_counts(made: Make) -> None:
    """Two AUVs that take turns at being lost are no fleet in which none is."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        if scenario.asvs.count == 2:  # each AUV has 1 m on average, no mission is below 1.5 m
            return [auv(1.5 if seed % 2 else 0.5), auv(0.5 if seed % 2 else 1.5)]
        return [auv(1.2), auv(1.1)]

    campaign = made(fleet, count=[2, 3])
    assert campaign.auvs.groupby(["point", "auv"]).position_error_m.mean().loc[0].max() == 1.0
    assert "point 1 (asvs.count=3), 1.20 +- 0 m" in said(campaign).best
    row = compare("c").iloc[0]
    assert (row.baseline_mean, row.other_mean, row.verdict) == (1.5, 1.2, "better")
    assert (row.baseline_worst_auv, row.other_worst_auv) == ("AUV0", "AUV0")
    told = flat(call("compare", "c").stdout)
    assert (
        "At A AUV0 is the worst in 2 of 4 seeds, AUV1 in 2; at B AUV0 is the worst in all" in told
    )
    assert "AUV0 2/4" in campaign.summary()


def starving(scenario: Scenario, seed: int) -> Fleet:
    """Two ASVs never hear AUV0, one hears AUV1 in half of the missions; three hear all."""
    count = scenario.asvs.count
    fast, slow = auv(0.5, latency_mean_s=0.8), auv(0.5, latency_mean_s=1.1)
    if count == 3:
        return [slow, slow]
    if count == 2:
        return [auv(3.0) | UNSERVED, fast]
    return [slow, auv(3.0) | UNSERVED if seed % 2 else fast]


@pytest.mark.parametrize("metric", ["latency_mean_s", "interval_mean_s", "worst_latency_mean_s"])
def test_who_leaves_an_auv_alone_is_not_better(made: Make, metric: str) -> None:
    """No verdict on latency or intervals where an AUV has none; the missions are counted."""
    made(starving, count=[1, 2, 3])
    one, two = compare("c", baseline="3", metrics=[metric]).to_dict("records")
    assert [row["verdict"] for row in (one, two)] == ["not comparable"] * 2
    assert [(row["baseline_whole"], row["other_whole"]) for row in (one, two)] == [(4, 2), (4, 0)]
    assert one["missions"] == 4
    assert pd.isna(
        [row[name] for row in (one, two) for name in ("difference", "low", "high")]
    ).all()
    lacked = "fewer than two fixes" if "interval" in metric else "no fix"
    assert [row["label"] for row in (one, two)] == ["B", "C"]
    assert one["said"].endswith(f"At B AUV1 got {lacked} in 2 of 4 seeds.")
    assert two["said"].endswith(f"At C AUV0 got {lacked} in 4 of 4 seeds.")
    told = call("compare", "c", "--baseline", 3, "--metric", metric)
    assert "(2/4)" in told.stdout
    assert "(0/4)" in told.stdout
    assert f"At C AUV0 got {lacked} in 4 of 4 seeds." in flat(told.stdout)
    note = "interval_mean_s counts the waits between fixes alone"
    assert (note in told.stdout) == (metric == "interval_mean_s")


def test_missions_are_counted_in_any_order_of_seeds(made: Make) -> None:
    """Who is unserved in which mission does not depend on the order in which seeds are named."""
    seeds = [3, 0, 2]
    made(starving, count=[1, 3], seeds=seeds)
    row = compare("c", metrics=["worst_latency_mean_s"]).iloc[0]
    assert (row.missions, row.baseline_whole, row.other_whole) == (3, 2, 3)
    assert row.said.endswith("AUV1 got no fix in 1 of 3 seeds.")


def test_starved_auvs_are_named(made: Make) -> None:
    """Sweep, and compare by metrics that all AUVs have, say who got no fix where."""
    campaign = made(starving, count=[1, 2, 3])
    sentences = (
        "No fix at point 1 (asvs.count=2): AUV0 in 4 of 4 seeds.",
        "No fix at point 0 (asvs.count=1): AUV1 in 2 of 4 seeds.",
    )
    assert said(campaign).starved == sentences
    told = flat(call("compare", "c", "--metric", "position_error_m").stdout)
    assert all(text in told for text in sentences)
    judged = json.loads(call("compare", "c", "--baseline", 3, "--json").stdout)["differences"]
    verdicts = {(row["other"], row["metric"]): row["verdict"] for row in judged}
    assert (
        verdicts["2", "worst_fix_age_p95_s"] == verdicts["2", "worst_position_error_m"] == "worse"
    )
    assert verdicts["2", "worst_latency_mean_s"] == "not comparable"


def harming(scenario: Scenario, seed: int) -> Fleet:
    """Fixes that are believed too much make AUV2 worse, and AUV1 not surely."""
    gain = scenario.navigation.fixed_gain.gain
    shaky = 1.3 if seed % 2 else 0.9
    return [
        auv(0.5, imu_error_m=0.9),
        auv(shaky, imu_error_m=1.0),
        auv((1.39 if gain == 0.9 else 0.6) + noise(seed), imu_error_m=0.77),
    ]


def test_fixes_that_harm_are_said_to(made: Make) -> None:
    """Who is worse with fixes, by how much, how surely, and what else was tried there."""
    found = said(made(harming, gain=[0.9, 0.05]))
    assert found.harm == (
        "Fixes make AUV2 worse at point 0 (gain=0.9): 1.39 m with, 0.77 m without, +0.620 m "
        "[+0.599, +0.641] over 4 paired seeds. At point 1 (gain=0.05) it has 0.60 m.",
        "What may help where fixes harm: a navigation.filter.gain below 0.9, or "
        "navigation.filter=kalman, which weighs each fix by its covariance.",
    )
    told = call("compare", "c").stdout
    assert found.harm[0] in flat(told)
    page = made(harming, out="d", gain=[0.9]).report()
    assert "Fixes make AUV2 worse at point 0 (gain=0.9): 1.39 m with, 0.77 m without" in page


GOOD_INERTIAL = """
name: survey_500m
survey: {side_m: 500}
auvs: {count: 3, speed_m_per_s: 1.5}
asvs: {count: 3, formation: {radius_m: 160}}
acoustics: {hf: {range_m: 180}, mf: {range_m: 400}}
navigation: {filter: fixed_gain, velocity_bias_m_per_s: [0.0032, 0.0032], bias_frame: world}
"""


@pytest.mark.slow
def test_a_good_inertial_system_is_told_the_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Real missions: far fixes with the paper's gain harm every AUV; a fix more would not help."""
    monkeypatch.chdir(tmp_path)
    Path("survey.yaml").write_text(GOOD_INERTIAL)
    campaign = sweep(
        "survey.yaml", "c", vary={COUNT: [2, 3], GAIN: [0.9, 0.05]}, seeds=8, workers=1
    )
    means = campaign.auvs[campaign.auvs.point == 2].groupby("auv")[
        ["position_error_m", "imu_error_m"]
    ]
    with_fixes, without = means.mean().loc["AUV0"].round(2)
    assert with_fixes > 1.2 > 0.9 > without
    told = " ".join(said(campaign).harm)
    assert "Fixes make AUV0, AUV1 and AUV2 worse at point 2 (asvs.count=3, gain=0.9)" in told
    assert f"{with_fixes:.2f} m with, {without:.2f} m without" in told
    assert "(asvs.count=2, gain=0.05)" not in told.replace(
        "At point 1 (asvs.count=2, gain=0.05)", ""
    )
    compared = flat(call("compare", "c", "--by", "count", "--metric", "latency_mean_s").stdout)
    assert "No fix at point 0 (asvs.count=2, gain=0.9): AUV0 in 8 of 8 seeds." in compared
    assert "worse at point 2 (asvs.count=3, gain=0.9)" in compared


def test_chance_is_not_taken_for_harm(made: Make) -> None:
    """Of 500 AUVs that fixes neither help nor harm, hardly one is said to be harmed."""
    draws = np.random.default_rng(1)

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        errors = draws.uniform(0.5, 1.5, (5, 2)).tolist()
        return [auv(error, imu_error_m=alone) for error, alone in errors]

    campaign = made(fleet, seeds=5, count=list(range(1, 101)))
    change = campaign.auvs.position_error_m - campaign.auvs.imu_error_m
    groups = change.groupby([campaign.auvs.point, campaign.auvs.auv])
    assert (groups.mean() > 2.776 * groups.std() / 5**0.5).sum() > 5  # each for itself misses
    assert said(campaign).harm == ()


def test_what_is_not_below_a_metre_is_below_something(made: Make) -> None:
    """One point is told with what its AUVs are surely below; of several of which none is below the
    limit, the best is.
    """

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        return [auv(4.0 / scenario.asvs.count + noise(seed), position_error_p95_m=3.0)]

    alone = said(made(fleet, count=[2]))
    upper = 2.0 + 3.182446 * np.std([noise(seed) for seed in range(4)], ddof=1) / 2.0
    assert alone.sure == (
        f"Every AUV is surely below {upper:.2f} m in the mean over time, and below 3.00 m for 95 % "
        "of the time (upper ends of the 95 % intervals)."
    )
    several = said(made(fleet, count=[1, 2], out="d"))
    assert several.sure == (
        "None of 2 points keeps every AUV surely below 1 m in the mean over time: point 1 "
        f"(asvs.count=2) keeps them below {upper:.2f} m (upper ends of the 95 % intervals)."
    )


def test_one_seed_is_not_sure(made: Make) -> None:
    """Of one mission it is said what was, not that it will be."""
    campaign = made(harming, seeds=1, gain=[0.9, 0.05])
    found = said(campaign)
    assert "point 1 (gain=0.05), 0.900 m over 1 seed (AUV1 is the worst)" in found.best
    assert found.best.endswith(
        "One seed shows no interval: whether another point is as good is not known."
    )
    assert found.sure == "With one seed a point nothing is surely below 1 m; run more."
    assert found.harm[0] == (
        "In 1 of 2 missions of points with one seed an AUV was worse with fixes than without, most "
        "AUV2 at point 0 (gain=0.9): 1.38 m with, 0.77 m without. One mission may be chance; run "
        "more seeds."
    )
    assert len(found.harm) == 1
    assert "+-" not in campaign.summary().partition("Of each mission's worst AUV")[0]


def test_equal_points_are_the_same(made: Make) -> None:
    """What differs by how numbers are rounded does not differ."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        error = 0.5 + 0.1 * seed + (1e-16 * seed if scenario.asvs.count == 3 else 0.0)
        return [auv(error * (1 + 2e-16 * scenario.asvs.count))]

    campaign = made(fleet, count=[2, 3])
    assert compare("c").verdict.unique().tolist() == ["equal"]
    assert "Equal in every seed: point 1." in said(campaign).best


def test_nearly_as_good_points_are_named(made: Make) -> None:
    """The smallest mean need not be the best: points without a difference shown are named."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        return [auv({1: 0.5, 2: 0.51 + 3 * noise(seed), 3: 0.9}[scenario.asvs.count])]

    assert said(made(fleet, count=[1, 2, 3])).best.endswith(
        " No difference shown, paired by seed: point 1; which is best is partly chance."
    )


def test_the_best_of_many_points_is_not_surely_worse_than_one_that_was_lucky() -> None:
    """Twenty points are equally good.  Whichever is called the best in truth, say the first, it is
    not surely worse than the luckiest: in 95 % of 400 campaigns, but for 3 standard errors.
    """
    rng, named = np.random.default_rng(9), 0
    for _ in range(400):
        table = 1.0 + 0.1 * rng.standard_normal((20, 8))
        found = compared_with_best(table, int(table.mean(axis=1).argmin()))
        named += bool(found.mean[0] <= found.half_width[0])
    assert named / 400 > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 400)


def test_collisions_of_a_schedule_are_told(tmp_path: Path) -> None:
    """Those of pings that the sonar carries beyond the range by which they share slots; not those
    of random access, whose nature they are.
    """
    common = "duration_s: 20\nsurvey: {side_m: 140}\nauvs: {count: 3}\nasvs: {count: 3}\n"
    sonar = "acoustics: {hf: {channel: {model: sonar}}}\n"
    for name, keys in (("shared", sonar), ("random", "protocol: {schedule: aloha}\n")):
        path = tmp_path / f"{name}.yaml"
        path.write_text(f"name: {name}\n{common}{keys}")
        campaign = sweep(path, tmp_path / name, seeds=2, workers=1)
        assert campaign.missions.collisions.min() > 0
        told = said(campaign).collided
        if name == "shared":
            times = re.fullmatch(
                r"Signals of the schedule collided in 2 of 2 missions, ([\d.]+) times a mission in "
                "the mean; `verify` tells why.", told,
            )  # fmt: skip
            assert times is not None
            assert float(times[1]) == pytest.approx(campaign.missions.collisions.mean(), rel=0.01)
        else:
            assert told == ""
        assert ("Signals of the schedule collided" in campaign.report()) == (name == "shared")


def test_nothing_is_found_where_all_fails(made: Make) -> None:
    """Table, page and comparison say that every mission failed."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        raise RuntimeError("no water")

    campaign = made(fleet, count=[2, 3])
    why = "No mission has gone well: all 8 failed: RuntimeError: no water."
    assert said(campaign).sentences == [why]
    assert "0/4      -" in campaign.summary()
    assert why in campaign.summary()
    assert why in campaign.report()
    assert " ".join(call("compare", "c").stderr.split()) == (
        "nothing to compare: no seed has a result at both points; 8 failed missions and those they "
        "would be paired with are left out: RuntimeError: no water"
    )
    with pytest.raises(ValueError, match=r"no mission with a .* 8 failed: RuntimeError: no"):
        campaign.plot()
    assert "failed    8: RuntimeError: no water\n" in call("status", "c").stdout


def test_why_missions_failed_is_told_wherever_they_are_counted(made: Make) -> None:
    """Of several reasons that of most; long ones are cut."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        if scenario.asvs.count == 3 and seed:
            raise RuntimeError("no water" if seed > 1 else "no power")
        return [auv(0.5 + noise(seed))]

    campaign = made(fleet, count=[2, 3])
    why = "3 of 8 missions failed, 2 of them: RuntimeError: no water."
    assert why in said(campaign).sentences
    assert why in " ".join(campaign.summary().split())
    assert why in campaign.report()
    told = " ".join(call("compare", "c", "--by", "count").stdout.split())
    assert (
        "3 failed missions and those they would be paired with are left out, 2 of them: "
        "RuntimeError: no water" in told
    )
    assert "failed    3, 2 of them: RuntimeError: no water\n" in call("status", "c").stdout


def test_intervals_of_many_seeds_do_not_look_like_nothing(made: Make) -> None:
    """Nor do the ends of what is compared, or the errors of good navigation."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        less = 1e-3 * (scenario.asvs.count == 3)
        return [auv((0.1234 + 3e-4 * (-1) ** seed) * (1 - less), imu_error_m=0.0011)]

    campaign = made(fleet, seeds=1000, count=[2, 3])
    told = campaign.summary()
    assert "0.123400 +- 0.000019  0.246800 +- 0.000037    1.0" in told
    assert "0.12 m with, 0.0011 m without, +0.122300 m [+0.122281, +0.122319]" in flat(told)
    assert "0.123277 ± 0.000019" in campaign.report()
    rows = call("compare", "c", "--by", "count").stdout
    assert "0.123400  0.123277  -0.000123 [-0.000123, -0.000123]" in rows


def test_a_reason_is_a_line_of_some_length(made: Make) -> None:
    def fleet(scenario: Scenario, seed: int) -> Fleet:
        raise RuntimeError("no\n" + "w" * 1000)

    (told,) = said(made(fleet, count=[2])).sentences
    assert told.startswith("No mission has gone well: all 4 failed: RuntimeError: no\\nwww")
    assert told.endswith("www...")
    assert len(told) < 360


def test_values_that_are_missing_are_counted(made: Make) -> None:
    """A number that is none is left out with the count of those that remain."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        broken = scenario.asvs.count == 2 and seed == 3
        return [auv(float("nan") if broken else 0.5 + noise(seed))]

    campaign = made(fleet, count=[2, 3])
    assert "(3/4)" in campaign.summary()
    row = compare("c", metrics=["position_error_m"]).iloc[0]
    assert (row.missions, row.pairs, row.baseline_whole, row.other_whole) == (4, 3, 3, 3)
    assert "3 of 4 paired seeds" in call("compare", "c", "--metric", "position_error_m").stdout


def test_a_campaign_without_numbers_says_so(made: Make) -> None:
    """Where no mission has an error there is no best point."""
    campaign = made(lambda scenario, seed: [auv(float("nan"))], count=[2, 3])
    assert said(campaign).sentences == ["No mission that went well has a worst_position_error_m."]
    assert "No mission that went well has a" in campaign.report()


CONTENTS = {
    (0.0,): "the velocity bias is the same for every AUV and seed "
    "(navigation.velocity_bias_sd_m_per_s is 0), so the uncertainty of the inertial system is not",
    (0.01, 0.02): "a velocity bias is drawn for each AUV and seed "
    "(navigation.velocity_bias_sd_m_per_s is 0.01 to 0.02)",
    (0.0, 0.01): "Where navigation.velocity_bias_sd_m_per_s is 0, the velocity bias is the same",
}


@pytest.mark.parametrize("sd", CONTENTS)
def test_intervals_say_what_they_contain(made: Make, sd: tuple[float, ...]) -> None:
    """Table, page and comparison tell whether the inertial system's uncertainty is in them."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        return [auv(0.5 + noise(seed) + scenario.navigation.velocity_bias_sd_m_per_s)]

    campaign = made(fleet, sd=list(sd), count=[2, 3])
    told = flat(campaign.summary())
    compared = flat(call("compare", "c", "--by", "count").stdout)
    for text in (told, compared, campaign.report()):
        assert CONTENTS[sd].lower() in text.lower()


def test_figures_count_missing_values(made: Make) -> None:
    """A mean that leaves AUVs out is marked; where none has a value the line has a gap."""
    campaign = made(starving, count=[1, 2, 3], gain=[0.9, 0.05])
    for metric, seen in (("latency_mean_s", [0, 1, 2]), ("worst_latency_mean_s", [0, 2])):
        line, grid = (campaign.plot(it, metric=metric, x=COUNT) for it in ("curves", "heatmap"))
        texts = [text.get_text() for text in line.axes[0].texts]
        assert texts == ["2/4", "0/4"] * 2
        drawn = np.asarray(line.axes[0].containers[0].lines[0].get_ydata(), float)
        assert np.flatnonzero(~np.isnan(drawn)).tolist() == seen
        cells = [text.get_text() for text in grid.axes[0].texts]
        assert sum(text.endswith("\n2/4") for text in cells) == 2
        assert sum(text.endswith("\n0/4") for text in cells) == 2
    whole = campaign.plot(metric="position_error_m", x=COUNT)
    assert not whole.axes[0].texts


def test_figures_have_no_powers_of_ten(made: Make) -> None:
    """Means of any size are written out; round-off is nothing."""

    def fleet(scenario: Scenario, seed: int) -> Fleet:
        return [auv(1234.5 + 230 * seed, fix_age_p95_s=7.0 + 1e-15 * seed)]

    campaign = made(fleet, count=[2, 3], gain=[0.9, 0.05])
    for metric in ("position_error_m", "fix_age_p95_s"):
        texts = campaign.plot("heatmap", metric=metric).axes[0].texts
        assert len(texts) == 4
        assert not [text for text in texts if "e" in text.get_text()]
    assert texts[0].get_text() == "7.00\n±0"


def test_what_was_found_is_data_too(made: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """`sweep --json` has the sentences; a campaign without any row has one."""
    found = said(made(harming, gain=[0.9, 0.05]))
    told = call(
        "sweep", "base.yaml", "--vary", f"{GAIN}=0.9,0.05", "--seeds", 4, "--json", "--out", "j"
    )
    assert json.loads(told.stdout)["findings"] == found.sentences
    for part in Path("j/missions").glob("*.parquet"):
        part.unlink()
    lost = call("report", "j")
    assert lost.exit_code == 2
    assert "has lost the rows of 8 of 8 missions; `bindusbl-des resume j`" in lost.stderr


def test_an_older_campaign_is_refused(made: Make) -> None:
    """What was not recorded cannot be judged; one line says so, and what to do."""
    campaign = made(starving, count=[2, 3])
    assert campaign.folder is not None
    (part,) = parts(campaign.folder)
    files = {it: campaign.folder / it / f"part-{part}.parquet" for it in ("auvs", "missions")}
    tables = {it: pq.read_table(file, partitioning=None) for it, file in files.items()}
    recorded = [it for it in tables["missions"].column_names if not it.startswith("worst_")]
    tables["missions"] = tables["missions"].select(recorded)
    commit(campaign.folder, part, tables, campaign.record["plan_sha256"])
    for words in (("compare", "c"), ("report", "c"), ("plot", "c")):
        told = call(*words)
        assert (told.exit_code, told.stdout) == (2, ""), words
        assert told.stderr.startswith("c: was run by an older version, which did not record worst_")
        assert told.stderr.count("\n") == 1
