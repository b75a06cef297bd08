"""Waits for fixes: as metrics count them where they are certain, closed forms where not."""

import numpy as np
import pytest
from plans_for_tests import Turns

from bindusbl_des.apps.planning.prediction.predicting import Waiting, waiting
from bindusbl_des.core.mission.service import fix_ages

# How old fixes are as they come (s)
LAG = 0.7


def waited(told: np.ndarray, chance: float, end: float, many: int = 1) -> Waiting:
    rows = np.atleast_2d(np.asarray(told, dtype=float))
    none = np.zeros(rows.shape, dtype=np.int64)
    return waiting(Turns(rows - LAG, rows, np.full(rows.shape, chance), none, none, many), end)


def ages(told: np.ndarray, end: float) -> tuple[float, float, float]:
    """Return mean, 95 % quantile and maximum of the age of the last fix (s)."""
    return fix_ages(told, told - LAG, end)


def test_certain_fixes_are_counted_as_metrics_count_them() -> None:
    told = np.array([3.0, 4.5, 20.0, 21.0, 60.0])
    found, exact = waited(told, 1.0, 100.0), ages(told, 100.0)
    assert found.rate_hz[0] == 0.05
    assert (found.mean_s[0], found.p95_s[0], found.longest_s[0]) == pytest.approx(exact)


def test_without_fixes_the_wait_is_the_mission() -> None:
    found = waited(np.array([1.0, 2.0]), 0.0, 100.0)
    assert [it[0] for it in found] == pytest.approx([0.0, 50.0, 95.0, 100.0])


def test_fixes_by_chance_are_awaited_longer() -> None:
    """Mean age over time (2 - p) T / (2 p) and what fixes are old; the rest as drawn."""
    told, chance = np.linspace(2.0, 798.0, 399), 0.4
    found = waited(told, chance, 800.0)
    assert found.mean_s[0] == pytest.approx(2.0 * (2 - chance) / (2 * chance) + LAG, rel=0.01)
    draw, drawn = np.random.default_rng(2), []
    for _ in range(1000):
        drawn.append(ages(told[draw.random(len(told)) < chance], 800.0))
    expected = np.mean(drawn, axis=0)[1:]
    assert (found.p95_s[0], found.longest_s[0]) == pytest.approx(expected, rel=0.03)


def test_rounds_taken_together_are_awaited_one_by_one() -> None:
    each, twos = np.arange(1, 201) * 1.0, np.arange(1, 201, 2) * 1.0
    assert waited(twos, 1.0, 201.0, many=2).mean_s == pytest.approx(waited(each, 1.0, 201.0).mean_s)
