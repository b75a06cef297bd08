"""Tables as CSV for spreadsheets: one file each, and one that says what every column is."""

from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
from pyarrow import csv

from ..core.files import folder_draft
from ..results.result_folder import CSV_DICTIONARY, objection_to_csv


def write_csv(
    tables: Mapping[str, pa.Table], folder: Path, *, force: bool = False
) -> Mapping[str, int]:
    """Write tables as a folder of CSV files, all of it or nothing; return the rows of each.

    UTF-8, commas, decimal points, a header; what is missing is empty, numbers read back as they
    were.  Units are in the names of the columns, and with their meaning in `columns.csv`.

    Raises:
        FileExistsError: when the folder exists and must not be replaced, or came to exist.
        OSError: when the folder cannot be written.
    """
    with folder_draft(folder, objection_to_csv, force=force) as draft:
        for name, table in {**tables, Path(CSV_DICTIONARY).stem: columns(tables)}.items():
            with open(draft / f"{name}.csv", "wb") as file:
                csv.write_csv(table, file)
    return {name: len(table) for name, table in tables.items()}


def columns(tables: Mapping[str, pa.Table]) -> pa.Table:
    """Return table, column, type, unit, meaning and frame of every column, a row each."""
    described = [(name, field) for name, table in tables.items() for field in table.schema]
    record = {
        key: [(field.metadata or {}).get(key.encode(), b"").decode() for _, field in described]
        for key in ("unit", "meaning", "frame")
    }
    return pa.table(
        {
            "table": [name for name, _ in described],
            "column": [field.name for _, field in described],
            "type": [str(field.type) for _, field in described],
            **record,
        }
    )
