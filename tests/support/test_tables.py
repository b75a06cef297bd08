"""Tables as programs save them: how fields are parted, how it is encoded, rows that cannot be."""

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bindusbl_des.support.tables import ordered, read_table

ROWS = [["time_s", "x_m", "name"], ["0", "1.5", "Ort"], ["10", "-2.25e-1", "Größe"]]
EXPECTED = [
    {"time_s": "0", "x_m": "1.5", "name": "Ort"},
    {"time_s": "10", "x_m": "-2.25e-1", "name": "Größe"},
]


def joined(by: str, decimal: str = ".") -> str:
    return "\n".join(by.join(cell.replace(".", decimal) for cell in row) for row in ROWS) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        joined(","),
        joined(", "),
        joined(";"),
        joined(";", ","),
        joined("\t", ","),
        joined("  "),
        joined(",").replace("\n", "\r\n"),
        joined(",").replace("\n", "\r"),
        "sep=;\n" + joined(";", ","),
        "# made by hand\n% on a Monday\n\n" + joined(",").replace("\n0", "\n\n# begin\n0"),
        joined(",") + joined(",").splitlines()[0] + "\n",
        joined(",").replace("\n0", "\ntime_s,x_m,name\n0"),
        '"time_s","x_m","name"\n"0","1.5","Ort"\n10,-2.25e-1,"Größe",,\n',
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_one_table_is_the_same_however_it_is_saved(
    text: str, encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode(encoding))
    assert [row.cells for row in read_table(path).rows()] == EXPECTED


def test_rows_are_named_by_their_lines(tmp_path: Path) -> None:
    """Whatever stands between them; a row that ends early is empty from there on."""
    path = tmp_path / "t.csv"
    path.write_text('# remark\na,b\n\n1,"two\nlines"\n# remark\n3\n')
    rows = [(row.where.rpartition(":")[2], row.cells) for row in read_table(path).rows()]
    assert rows == [("5", {"a": "1", "b": "two\nlines"}), ("7", {"a": "3", "b": ""})]


def test_the_last_remark_names_the_columns_of_numbers(tmp_path: Path) -> None:
    """As numpy.savetxt writes them."""
    path = tmp_path / "t.txt"
    path.write_text("# by numpy\n# depth_m sound_speed_m_per_s\n0.5 1500\n9 1490\n")
    table = read_table(path)
    assert table.names == ["depth_m", "sound_speed_m_per_s"]
    assert [row.where for row in table.rows()] == [f"{path}:3", f"{path}:4"]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (
            b"a,b,c\n0,5,19,0,33,0\n1,5,18,0,33,1\n",
            r"t.csv:2: has 6 values under 3 names .*decimal",
        ),
        (b"PK\x03\x04", "is a zip archive, such as a workbook of Excel; save the sheet as CSV"),
        (b"PAR1", "is a Parquet file; save it as CSV"),
        (b"a\x81\x00", "cannot be read as a CSV file"),
        (b"\xff\xfea", "cannot be read as a CSV file"),
    ],
)
def test_what_is_no_table_is_told(content: bytes, told: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=told):
        read_table(path)


def test_commas_part_thousands_beside_decimal_points(tmp_path: Path) -> None:
    """A number with a point says that commas are no decimal ones; what 1,234 is nobody knows."""
    path = tmp_path / "t.csv"
    path.write_text("x_m;y_m\n1,234;2.5\n")
    assert next(read_table(path).rows()).cells["x_m"] == "1,234"


def test_two_lines_in_one_do_not_cost_the_table(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("a,b\n1,2\n3,4,5,6\n7,8\n9,0\n")
    table = read_table(path)
    assert [cells for _, cells in table.lines] == [["1", "2"], ["7", "8"], ["9", "0"]]
    assert "1 of 4 rows is left out: " in table.left_out[0]
    assert "t.csv:3: has 4 values under 2 names" in table.left_out[0]


@given(st.lists(st.integers(0, 12), max_size=9))
def test_as_many_rows_as_can_be_rise(values: list[int]) -> None:
    """Compared with all subsets, once equal neighbours are one."""
    places = [f"line {n}" for n in range(len(values))]
    once = [n for n in range(len(values)) if not n or values[n] != values[n - 1]]
    most = max(
        sum(1 for n in range(len(once)) if mask >> n & 1)
        for mask in range(1 << len(once))
        if _rises([values[once[n]] for n in range(len(once)) if mask >> n & 1])
    )
    try:
        kept, told = ordered(places, [float(it) for it in values], "time_s", "s")
    except ValueError as error:
        assert 2 * most <= len(once)
        assert "time_s must increase, but" in str(error)  # noqa: PT017  # either may come
        return
    assert len(kept) == most
    assert _rises([values[n] for n in kept])
    assert bool(told) == (len(kept) < len(values))


def _rises(values: list[int]) -> bool:
    return all(one < following for one, following in pairwise(values))
