"""Families of parts that tests run through."""

from collections.abc import Iterable

import pytest

from bindusbl_des.core.plugins import Family


def each_but_slow_ones(families: Iterable[Family], daily: Family) -> pytest.MarkDecorator:
    """Return a mark that runs a test with each family; every day with one of them only."""
    cases = [pytest.param(it, marks=() if it is daily else pytest.mark.slow) for it in families]
    return pytest.mark.parametrize("family", cases, ids=lambda family: family.noun)
