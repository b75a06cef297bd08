"""The simulator agrees event for event with a second implementation, over drawn scenarios."""

import pytest
from comparing import disagreements
from drawing import scenario


def agree(first: int, count: int) -> None:
    """Fly scenarios twice; fail with the first differences found."""
    rows = 0
    for number in range(first, first + count):
        found, counts = disagreements(scenario(number))
        assert not found, f"scenario {number}: " + "\n".join(found)
        rows += sum(counts.values())
    assert rows > 100 * count  # an empty mission agrees with anything


def test_a_second_implementation_agrees() -> None:
    """A hundred drawn scenarios: every ping, reception, frame and fix."""
    agree(0, 100)


@pytest.mark.slow
def test_a_second_implementation_agrees_a_thousand_times() -> None:
    """A thousand further ones."""
    agree(1000, 1000)
