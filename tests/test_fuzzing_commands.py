"""Command lines that nobody would type end as documented."""

import pytest
from fuzzing.checking import check


def test_odd_command_lines_end_as_documented() -> None:
    """Codes 0 to 3 and no traceback, within 5 s of processor time and 1 GB each."""
    check("command", 0, 60)


@pytest.mark.slow
def test_ten_times_as_many_odd_command_lines_end_as_documented() -> None:
    """The same for others."""
    check("command", 100_000, 15_000)
