"""Whatever was done to a folder of results, every command that reads it says what is wrong."""

import pytest
from fuzzing.checking import check

COUNTS = (("run", 7), ("campaign", 2))
MANY = (("run", 4000), ("campaign", 1000))


@pytest.mark.parametrize(("kind", "count"), COUNTS)
def test_damaged_folders_end_as_documented(kind: str, count: int) -> None:
    """Codes 0 to 3 and no traceback, within 5 s of processor time and 1 GB each."""
    check(kind, 0, count)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), MANY)
def test_many_times_as_many_damaged_folders_end_as_documented(kind: str, count: int) -> None:
    """The same for others."""
    check(kind, 100_000, count)
