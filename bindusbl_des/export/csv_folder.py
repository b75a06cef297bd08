"""Tables as CSV for spreadsheets: one file each, and one that says what every column is."""

from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
from pyarrow import csv

from ..durable_folder import folder_draft
from ..tables import TABLES

DICTIONARY = "columns.csv"
# Campaigns have a table of missions as well.
WRITTEN = {DICTIONARY, "missions.csv", *(f"{name}.csv" for name in TABLES)}


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
    with folder_draft(folder, objection, force=force) as draft:
        for name, table in {**tables, Path(DICTIONARY).stem: columns(tables)}.items():
            with open(draft / f"{name}.csv", "wb") as file:
                csv.write_csv(table, file)
    return {name: len(table) for name, table in tables.items()}


def columns(tables: Mapping[str, pa.Table]) -> pa.Table:
    """Return table, column, type, unit, meaning and frame of every column, a row each."""
    described = [(name, field) for name, table in tables.items() for field in table.schema]
    told = {
        key: [(field.metadata or {}).get(key.encode(), b"").decode() for _, field in described]
        for key in ("unit", "meaning", "frame")
    }
    return pa.table(
        {
            "table": [name for name, _ in described],
            "column": [field.name for _, field in described],
            "type": [str(field.type) for _, field in described],
            **told,
        }
    )


def objection(folder: Path) -> str | None:
    """Return why force must not replace a folder; None for an earlier export, or nothing."""
    found = list(folder.iterdir()) if folder.is_dir() else [folder]
    foreign = sorted(it.name for it in found if it.name not in WRITTEN or not it.is_file())
    if not foreign and (not found or folder / DICTIONARY in found):
        return None
    which = f" (it holds {foreign[0]})" if folder.is_dir() and foreign else ""
    return f"is no earlier export{which}, so --force will not replace it"
