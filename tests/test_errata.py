"""The errata of the paper are computed, not asserted: every snippet of the page is run."""

import doctest
from pathlib import Path

ERRATA = Path(__file__).parents[1] / "docs" / "errata.md"


def test_errata_are_computed() -> None:
    """Each snippet of docs/errata.md gives what the page says."""
    outcome = doctest.testfile(
        str(ERRATA),
        module_relative=False,
        optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE,
    )
    assert outcome.failed == 0
    assert outcome.attempted > 20
