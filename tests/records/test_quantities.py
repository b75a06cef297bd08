"""Quantities: every metric has a name of its own and a unit, for axes and menus."""

from dataclasses import fields

import pytest

from bindusbl_des.core.wording import significant
from bindusbl_des.records.metrics import AuvMetrics, Utilisation, name_of, quantity, unit_of
from bindusbl_des.results.schemas import mission_numbers


def test_every_metric_has_a_name() -> None:
    """Metrics of AUVs and missions, worst ones too: no two are called the same, none by its key."""
    metrics = {*mission_numbers(), *(column.name for column in fields(AuvMetrics)[1:])}
    assert {column.name for column in fields(Utilisation)} <= metrics
    named = {quantity(metric) for metric in metrics}
    assert len(named) == len(metrics)
    assert not any("_" in name for name in named)


def test_the_worst_auv_is_named() -> None:
    """A metric of the worst AUV says so and has the metric's unit."""
    assert quantity("worst_position_error_m") == "worst AUV's mean position error (m)"
    assert name_of("fix_age_max_s") == "largest age of the last fix"
    assert [unit_of(it) for it in ("speed_m_per_s", "worst_hf_coverage", "rounds")] == [
        "m/s", "share", "count",
    ]  # fmt: skip


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
