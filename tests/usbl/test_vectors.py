"""Vectors of three numbers say what numpy's arrays say."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bindusbl_des.core.compiled import compiled
from bindusbl_des.usbl.array import (
    Vector,
    cross,
    divided,
    dot,
    length,
    minus,
    negative,
    plus,
    scaled,
    turned,
    turned_back,
    weighted,
)

Array = NDArray[np.float64]
NUMBER = st.floats(-1e3, 1e3)


@compiled
def everything(a: Vector, b: Vector, matrix: Array, factor: float) -> Any:
    """Return what all of them make of two vectors, a matrix and a number."""
    same = plus(a, b), minus(a, b), negative(a), scaled(a, factor), divided(a, factor)
    return same, (cross(a, b), turned(matrix, a), turned_back(matrix, a)), (
        dot(a, b), length(a), weighted(matrix, a, b)
    )  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(
    a=st.tuples(NUMBER, NUMBER, NUMBER), b=st.tuples(NUMBER, NUMBER, NUMBER),
    factor=st.floats(0.1, 10.0), seed=st.integers(0, 99),
)  # fmt: skip
def test_vectors_are_those_of_numpy(a: Any, b: Any, factor: float, seed: int) -> None:
    matrix = np.random.default_rng(seed).standard_normal((3, 3))
    same, sums, numbers = everything(a, b, matrix, factor)
    x, y = np.array(a), np.array(b)
    for found, told in zip(same, (x + y, x - y, -x, x * factor, x / factor), strict=True):
        assert found == tuple(told)
    for found, told in zip(sums, (np.cross(x, y), matrix @ x, matrix.T @ x), strict=True):
        assert np.allclose(found, told, rtol=1e-12, atol=1e-9)
    weights = np.triu(matrix) + np.triu(matrix, 1).T  # symmetric
    assert np.allclose(numbers, (x @ y, np.linalg.norm(x), x @ weights @ y), rtol=1e-12, atol=1e-9)
