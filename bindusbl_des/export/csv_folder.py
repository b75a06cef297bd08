"""Tables as CSV for spreadsheets: one file each, and one that says what every column is."""

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
from pyarrow import csv

DICTIONARY = "columns.csv"


def write_csv(tables: Mapping[str, pa.Table], folder: Path) -> Mapping[str, int]:
    """Write tables as a folder of CSV files, all of it or nothing; return the rows of each.

    UTF-8, commas, decimal points, a header; what is missing is empty, numbers read back as they
    were.  Units are in the names of the columns, and with their meaning in `columns.csv`.

    Raises:
        OSError: when the folder cannot be written.
    """
    draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        for name, table in {**tables, Path(DICTIONARY).stem: columns(tables)}.items():
            csv.write_csv(table, draft / f"{name}.csv")
        draft.chmod(0o755)
        if folder.exists():
            shutil.rmtree(folder)
        draft.rename(folder)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
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


def replaceable(folder: Path) -> bool:
    """Tell whether a folder holds an earlier export and nothing else, or nothing at all."""
    return folder.is_dir() and all(
        path.suffix == ".csv" and (folder / DICTIONARY).is_file() for path in folder.iterdir()
    )
