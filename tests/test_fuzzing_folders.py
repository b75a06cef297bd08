"""Whatever was done to a folder of results, every command that reads it says what is wrong."""

import pytest
from fuzzing.checking import check

KINDS = ("run", "campaign")


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_folders_end_as_documented(kind: str) -> None:
    """Codes 0 to 3 and no traceback, within 5 s of processor time and 1 GB each."""
    check(kind, 0, 250)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_ten_times_as_many_damaged_folders_end_as_documented(kind: str) -> None:
    """The same for others."""
    check(kind, 100_000, 2500)
