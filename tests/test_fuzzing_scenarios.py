"""Damaged scenario files, experiment files and tracks are told of, never a reason to break."""

import pytest
from fuzzing.checking import check


@pytest.mark.parametrize(("kind", "count"), [("scenario", 50), ("experiment", 40), ("track", 40)])
def test_damaged_files_end_as_documented(kind: str, count: int) -> None:
    """Codes 0 to 3 and no traceback, within 5 s of processor time and 1 GB each."""
    check(kind, 0, count)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count"), [("scenario", 15_000), ("experiment", 10_000), ("track", 10_000)]
)
def test_ten_times_as_many_damaged_files_end_as_documented(kind: str, count: int) -> None:
    """The same for others."""
    check(kind, 100_000, count)
