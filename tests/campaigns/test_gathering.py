"""Rows of missions gathered into the tables of a part."""

import pyarrow as pa
import pytest

from bindusbl_des import Scenario, simulate
from bindusbl_des.campaigns.experiments.plan import Mission, PlannedPoint
from bindusbl_des.campaigns.workers import batches as gathering
from bindusbl_des.campaigns.workers.batches import Gathered, Ran

POINTS = {n: PlannedPoint("{}", {"a": float(n), "b": [n, None]}, {}) for n in range(3)}


@pytest.fixture(scope="module")
def ran() -> list[Ran]:
    """Five missions, of which the first and the fourth failed."""
    scenario = Scenario(name="short", duration_s=6.0)
    return [
        Ran(Mission(n, n // 2, n), 0.5, error="ValueError: no")
        if n % 3 == 0
        else Ran(Mission(n, n // 2, n), 0.5, simulate(scenario, n).arrow)
        for n in range(5)
    ]


def gathered(ran: list[Ran]) -> dict[str, pa.Table]:
    found = Gathered({"a": "float", "b": "json"}, POINTS, "model")
    for it in ran:
        found.add(it)
    return found.tables()


@pytest.mark.parametrize("most_apart", [1, 2, 4])
def test_tables_do_not_depend_on_when_rows_are_joined(
    ran: list[Ran], most_apart: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joined as they come or all at the end, rows and their order are the same."""
    whole = gathered(ran)
    assert whole["missions"]["mission"].to_pylist() == [0, 1, 2, 3, 4]
    assert whole["missions"]["status"].to_pylist() == ["failed", "ok", "ok", "failed", "ok"]
    assert whole["missions"]["b"].to_pylist() == [
        "[0, null]",
        "[0, null]",
        *2 * ["[1, null]"],
        "[2, null]",
    ]
    assert whole["auvs"]["mission"].to_pylist() == [1, 1, 1, 2, 2, 2, 4, 4, 4]
    assert whole["pings"]["seed"].unique().to_pylist() == [1, 2, 4]
    monkeypatch.setattr(gathering, "MOST_APART", most_apart)
    again = gathered(ran)
    assert again.keys() == whole.keys()
    for name, table in whole.items():
        assert again[name].equals(table), name


def test_what_rows_take_is_known(ran: list[Ran]) -> None:
    """The memory that rows are said to take is about what Arrow says that they take."""
    found = Gathered({"a": "float", "b": "json"}, POINTS, "model")
    assert found.nbytes == 0
    for it in ran:
        found.add(it)
    assert found.nbytes == pytest.approx(
        sum(table.nbytes for it in ran for table in it.tables.values()), rel=0.5
    )
