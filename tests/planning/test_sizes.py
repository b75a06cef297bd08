"""How large errors are: closed forms of lengths, quantiles, and of the largest of several."""

import math

import numpy as np
import pytest

from bindusbl_des.apps.planning.prediction.mapping import (
    expected_largest,
    gamma_quotient,
    mean_size,
    quantile,
    sizes_of_all,
    squares,
)


def mean_of(x: float, y: float, xx: float, yy: float, xy: float = 0.0) -> float:
    return float(mean_size(*squares(np.array([x, y]), np.array([xx, yy, xy]))))


@pytest.mark.parametrize("shape", [0.5, 1.0, 2.5, 40.0, 1e4])
def test_the_quotient_of_gamma_functions(shape: float) -> None:
    exact = math.exp(math.lgamma(shape + 0.5) - math.lgamma(shape))
    assert float(gamma_quotient(np.array(shape))) == pytest.approx(exact, rel=1e-7)


def test_lengths_are_exact_where_errors_are_round_or_lie_along_a_line_or_do_not_vary() -> None:
    assert mean_of(0, 0, 4, 4) == pytest.approx(2 * math.sqrt(math.pi / 2), rel=1e-7)
    assert mean_of(0, 0, 4, 4, 4) == pytest.approx(math.sqrt(8) * math.sqrt(2 / math.pi), rel=1e-7)
    assert mean_of(3, 4, 0, 0) == 5.0
    assert mean_of(0, 0, 0, 0) == 0.0


@pytest.mark.parametrize(
    ("x", "y", "xx", "yy"), [(0, 0, 1, 0.04), (0, 0, 1, 0.3), (1, 0, 1, 1), (2, 1, 1, 0.1)]
)
def test_lengths_in_between_are_right_within_two_per_cent(
    x: float, y: float, xx: float, yy: float
) -> None:
    normal = np.random.default_rng(1).standard_normal((200_000, 2))
    drawn = np.hypot(x + math.sqrt(xx) * normal[:, 0], y + math.sqrt(yy) * normal[:, 1])
    assert mean_of(x, y, xx, yy) == pytest.approx(drawn.mean(), rel=0.02)


def test_quantiles_of_a_round_error_are_those_of_rayleigh() -> None:
    square, shape = squares(np.zeros((1, 1, 2)), np.array([[[1.0, 1.0, 0.0]]]))
    sizes = sizes_of_all(square, shape).reshape(1, -1)
    shares = (np.arange(20) + 0.5) / 20
    assert sizes[0, 4:] == pytest.approx(np.sqrt(-2 * np.log(1 - shares[4:])), rel=0.015)
    assert quantile(np.arange(101.0)[np.newaxis], 0.95)[0] == pytest.approx(95.0)


@pytest.mark.parametrize(("count", "standard"), [(1, 0.0), (2, 0.5642), (3, 0.8463), (10, 1.5388)])
def test_the_largest_of_several_is_more_than_each(count: int, standard: float) -> None:
    """Expected largest of normal numbers (order statistics), here of a spread of 5 %."""
    found = expected_largest(np.full(count, 2.0), np.full(count, 0.05))
    assert found == pytest.approx(2.0 * (1 + 0.05 * standard), rel=0.006)


def test_the_largest_of_unlike_numbers_is_the_largest() -> None:
    assert expected_largest(np.array([1.0, 9.0]), np.array([0.1, 0.0])) == pytest.approx(9.0)
