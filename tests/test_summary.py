"""The summary of a mission: a table that fits a terminal, whatever the size of the fleet."""

import pytest
from worlds import scenario

from bindusbl_des import simulate


@pytest.mark.parametrize("count", [1, 12, 20, 21, 150])
def test_the_summary_fits_a_terminal(count: int) -> None:
    """At most 80 columns and 30 lines; every AUV of a fleet of 20 has its row."""
    summary = {"detail": "summary"}
    lines = simulate(scenario(duration_s=4.0, auvs={"count": count}, record=summary)).summary()
    rows = lines.splitlines()
    assert max(map(len, rows)) <= 80
    assert len(rows) <= 30
    named = [row for row in rows if row.startswith("AUV") and not row.startswith("AUV ")]
    assert len(named) == (count if count <= 20 else 10)


def test_a_large_fleet_shows_between_what_its_values_lie() -> None:
    """Least, mean and largest are those of all AUVs, also of those that have no row."""
    result = simulate(scenario(duration_s=6.0, auvs={"count": 40}, record={"detail": "summary"}))
    rows = {row.split()[0]: row.split() for row in result.summary().splitlines() if row}
    error = result.auvs.position_error_m
    for name, value in (("min", error.min()), ("mean", error.mean()), ("max", error.max())):
        assert rows[name][-3] == f"{value:.2f}"
    assert rows["+30"][1:] == ["..."] * 8
