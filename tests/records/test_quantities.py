"""Quantities: every metric has a name of its own and a unit, for axes and menus."""

import pytest

from bindusbl_des import Scenario, simulate
from bindusbl_des.core.records.metrics import quantity
from bindusbl_des.support.wording import number, plus_minus, significant


def test_every_metric_has_a_name() -> None:
    """Metrics of AUVs and missions, worst ones too: no two are called the same, none by its key."""
    result = simulate(Scenario(name="m", duration_s=2.0))
    numbers = [it.select_dtypes("number").columns for it in (result.mission, result.auvs)]
    metrics = {*numbers[0], *numbers[1]} - {"seed"}
    assert len(metrics) > 60
    named = {quantity(metric) for metric in metrics}
    assert len(named) == len(metrics)
    assert not any("_" in name for name in named)


def test_the_worst_auv_is_named() -> None:
    """A metric of the worst AUV says so and has the metric's unit."""
    assert [quantity(it) for it in ("worst_position_error_m", "fix_age_max_s")] == [
        "worst AUV's mean position error (m)", "largest age of the last fix (s)",
    ]  # fmt: skip
    units = [quantity(it).split()[-1] for it in ("speed_m_per_s", "worst_hf_coverage", "rounds")]
    assert units == ["(m/s)", "(share)", "(count)"]


@pytest.mark.parametrize(
    ("value", "digits", "told"),
    [
        (231.4, 2, "231"), (5.3e-15, 2, "0"), (-5.3e-15, 2, "0"), (0.0, 3, "0"),
        (0.05349, 3, "0.0535"), (-1.005, 2, "-1.0"), (12345.6, 3, "12346"), (2.5e-6, 2, "0.000003"),
        (1e7, 3, "10000000"), (float("inf"), 3, "-"),
    ],
)  # fmt: skip
def test_numbers_have_no_exponents(value: float, digits: int, told: str) -> None:
    """Few digits, no powers of ten, and what is left of rounding is nothing."""
    assert significant(value, digits) == told


@pytest.mark.parametrize(
    ("mean", "half", "told"),
    [
        (0.12345, 0.00213, "0.1235 +- 0.0021"), (0.12345, 2.13e-5, "0.123450 +- 0.000021"),
        (264.43, 0.0132, "264.430 +- 0.013"), (3.61, 3.07, "3.6 +- 3.1"), (0.35, 14.2, "0 +- 14"),
        (-0.5, 0.0996, "-0.500 +- 0.100"), (1234.5, 5.3e-15, "1234 +- 0"), (5.0, 0.0, "5.00 +- 0"),
        (0.5, 3e-8, "0.500000 +- <0.000001"), (0.5, float("nan"), "0.500"),
        (0.0, 0.25, "0.00 +- 0.25"),
    ],
)  # fmt: skip
def test_half_an_interval_has_two_digits(mean: float, half: float, told: str) -> None:
    """However narrow it is, and the mean is told as finely; none looks like zero that is not."""
    assert plus_minus(mean, half) == told


@pytest.mark.parametrize(
    ("value", "digits", "told"),
    [
        (0.0042, 2, "0.0042"), (-3e-5, 1, "-0.000030"), (0.004, 0, "0.0040"), (0.0, 2, "0.00"),
        (-1e-9, 2, "-0.00"), (0.005, 2, "0.01"), (12.0, 0, "12"),
    ],
)  # fmt: skip
def test_what_is_not_zero_does_not_look_so(value: float, digits: int, told: str) -> None:
    assert number(value, digits) == told
