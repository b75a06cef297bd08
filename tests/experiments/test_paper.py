"""The paper's published numbers, as far as they come out untuned (docs/errata.md has the rest)."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from paper_for_tests import campaigns

from bindusbl_des import load_scenario, simulate

SCENARIOS = Path(__file__).parents[2] / "scenarios"
EXPERIMENTS = SCENARIOS.parent / "experiments"
SEEDS = range(12)


@pytest.mark.parametrize("name", [entry.name for entry in campaigns.CATALOGUE])
def test_the_paper_corrects_by_its_gain(name: str) -> None:
    """Every point of the paper's experiments has its gain, whatever the default filter is.

    The ablations have one line with another, and say so.
    """
    experiment = campaigns.load(name)
    navigator = experiment.given["navigation"]["filter"]
    assert (navigator["model"], navigator["gain"]) == ("fixed_gain", 0.9)
    others = {"navigation.filter", "navigation.filter.gain"} & set(experiment.varied())
    assert others == ({"navigation.filter"} if name == "ablations" else set())


def means(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return fixes delivered and HF coverage per AUV, averaged over seeds."""
    scenario = load_scenario(SCENARIOS / f"{name}.yaml", overrides=["record.detail=summary"])
    auvs = [simulate(scenario, seed).auvs for seed in SEEDS]
    fixes = np.mean([a.fixes_delivered for a in auvs], axis=0)
    return fixes, np.mean([a.hf_coverage for a in auvs], axis=0)


def test_one_asv_starves_an_auv() -> None:
    """Table I, upper half: AUV1 and AUV2 get about 149 and 123 fixes, AUV0 hardly any."""
    fixes, coverage = means("failure_140m")
    assert fixes[1:] == pytest.approx([149, 123], abs=12)
    assert coverage[1:] == pytest.approx([0.70, 0.58], abs=0.05)
    assert fixes[0] < 25
    assert coverage[0] < 0.1


def test_three_asvs_recover_it() -> None:
    """Table I, lower half: 92, 189 and 185 fixes; AUV0 is covered for four pings of five."""
    fixes, coverage = means("recovery_140m")
    assert fixes == pytest.approx([92, 189, 185], abs=12)
    assert coverage == pytest.approx([0.79, 1.0, 1.0], abs=0.05)


def test_two_asvs_in_line_leave_a_shadow() -> None:
    """Two ASVs along the lanes: AUV0 gets no fix at all."""
    fixes, coverage = means("two_asvs_140m_0deg")
    assert fixes[0] == coverage[0] == 0


def test_turning_the_pair_reaches_it() -> None:
    """Two ASVs turned by 30 degrees: about 71 fixes at 55 % coverage for AUV0."""
    fixes, coverage = means("two_asvs_140m_30deg")
    assert fixes[0] == pytest.approx(71, abs=12)
    assert coverage[0] == pytest.approx(0.55, abs=0.08)


def test_the_baseline_is_conventional_usbl() -> None:
    """The baseline: one fix per second for the team, 51 ms mean and 67 ms 95 % latency."""
    result = simulate(load_scenario(SCENARIOS / "baseline_60m.yaml"))
    latency = result.tables["fixes"].latency_s
    assert result.auvs.fixes_delivered.sum() == pytest.approx(298.2, abs=3)
    assert latency.mean() == pytest.approx(0.0505, abs=0.0025)
    assert latency.quantile(0.95) == pytest.approx(2 / 30)
    assert result.auvs.interval_mean_s.mean() == pytest.approx(4.02, abs=0.03)


def test_its_own_tdma_would_give_four_times_as_many() -> None:
    """The paper's TDMA in the baseline setting: 290 fixes for each AUV."""
    result = simulate(load_scenario(SCENARIOS / "baseline_60m_tdma.yaml"))
    assert result.auvs.fixes_delivered.tolist() == pytest.approx([290] * 4, abs=1)
