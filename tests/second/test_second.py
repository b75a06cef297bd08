"""The simulator agrees event for event with a second implementation, over drawn scenarios."""

from pathlib import Path

import pytest
from comparing import disagreements
from drawing import scenario


def agree(first: int, count: int, folder: Path) -> None:
    """Fly scenarios twice; fail with the first differences found."""
    rows = 0
    for number in range(first, first + count):
        found, counts = disagreements(scenario(number, folder))
        assert not found, f"scenario {number}: " + "\n".join(found)
        rows += sum(counts.values())
    assert rows > 100 * count  # an empty mission agrees with anything


def test_a_second_implementation_agrees(tmp_path: Path) -> None:
    """A hundred drawn scenarios: every ping, reception, frame and fix."""
    agree(0, 100, tmp_path)


@pytest.mark.slow
def test_a_second_implementation_agrees_a_thousand_times(tmp_path: Path) -> None:
    """A thousand further ones."""
    agree(1000, 1000, tmp_path)
