"""Whatever is typed, written into a file or done to a folder ends as documented."""

import pytest
from fuzzing.checking import check


def test_inputs_that_nobody_would_give_end_as_documented() -> None:
    """Files, command lines and folders that are damaged: codes 0 to 3 and no traceback, within 10 s
    of processor time and 1 GB each.
    """
    check(
        0,
        scenario=20,
        experiment=12,
        track=12,
        named=16,
        log=14,
        command=24,
        run=4,
        campaign=2,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count"),
    [
        *(("scenario", 15_000), ("experiment", 10_000), ("track", 10_000), ("named", 10_000)),
        *(("plan", 1000), ("log", 6000)),
        *(("command", 15_000), ("run", 4000), ("campaign", 1000)),
    ],
)
def test_many_times_as_many_end_as_documented(kind: str, count: int) -> None:
    """The same for others."""
    check(100_000, **{kind: count})
