"""What is known afterwards, beside the filter and the truth."""

import numpy as np
import pytest

from bindusbl_des import load_scenario, simulate


def test_guidance_goes_on_with_the_filter() -> None:
    """AUVs that steer by their estimates go where they went; what is told of them is smoothed."""
    filtered_run, smoothed = (
        simulate(
            load_scenario(
                "harbour_current", overrides=["duration_s=60", f"navigation.filter={name}"]
            ),
            seed=2,
        )
        for name in ("kalman", "smoother")
    )
    for table in ("pings", "fixes"):
        assert filtered_run.arrow[table].equals(smoothed.arrow[table])
    ways = [it.tables["tracks"][["x_m", "y_m"]] for it in (filtered_run, smoothed)]
    assert ways[0].equals(ways[1])
    assert smoothed.auvs.position_error_m.mean() < filtered_run.auvs.position_error_m.mean()


def test_what_the_filter_is_told_of_the_smoother_is_told_of() -> None:
    """Scale, heading, a bias that wanders and errors of ASVs: without a lag it is the filter, but
    for what is not linear; afterwards it is nearer to the truth.
    """
    changes = [
        "duration_s=100", "usbl.misalignment_sd_deg=1",
        "navigation.filter.delay_compensation=shift",
        "navigation.velocity_bias_m_per_s=[0,0]", "navigation.velocity_bias_sd_m_per_s=0.06",
        "navigation.velocity_bias_time_constant_s=60", "navigation.heading_sd_deg=2",
        "navigation.scale_factor_sd=0.02",
    ]  # fmt: skip
    runs = [
        simulate(load_scenario("recovery_140m", overrides=[*changes, f"navigation.filter={name}"]))
        for name in ("kalman", "{model: smoother, lag_s: 0}", "smoother")
    ]
    columns = ["estimate_x_m", "estimate_y_m", "estimate_sd_x_m", "estimate_sd_y_m"]
    kalman, at_once, _ = (run.tables["tracks"][columns].to_numpy(float) for run in runs)
    assert np.nanmax(np.abs(at_once - kalman)) < 0.12  # of a standard deviation of 0.43 m there
    assert runs[2].auvs.position_error_rms_m.mean() < 0.9 * runs[0].auvs.position_error_rms_m.mean()


def test_afterwards_one_knows_better_and_knows_how_well() -> None:
    """Twelve seeds with a bias drawn from what the filter is told: nearer, and NEES about 2."""
    changes = ["record.detail=summary", "record.metrics_hz=1", "duration_s=120"]
    changes += ["navigation.velocity_bias_m_per_s=[0,0]"]
    changes += ["navigation.velocity_bias_sd_m_per_s=0.06"]
    errors, nees = [], []
    for name in ("kalman", "{model: smoother, lag_s: 10}", "smoother"):
        own = load_scenario("quickstart", overrides=[*changes, f"navigation.filter={name}"])
        found = [simulate(own, seed=seed).auvs for seed in range(12)]
        errors.append(np.mean([it.position_error_rms_m.mean() for it in found]))
        nees.append(np.mean([it.nees.mean() for it in found]))
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 0.75 * errors[0]
    assert nees == pytest.approx([2.0, 2.0, 2.0], abs=0.4)
