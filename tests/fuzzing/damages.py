"""Ways to damage a file of a folder of results, or what lies beside it."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .texts import bytes_mutated
from .trees import mutated
from .values import VALUES

# Files and folders that may turn up where they do not belong
NAMES = (
    "part-all-0001.parquet", "part-all-0007.parquet", "part-x.parquet", "\udcff", "x" * 250,
    "run.json", "campaign.json", "advice.json", "report.html", "figures", "csv", "failures",
    ".lock",
)  # fmt: skip


def _bytes(file: Path, draw: Random) -> None:
    file.write_bytes(bytes_mutated(file.read_bytes(), draw))


def _gone(file: Path, draw: Random) -> None:
    shutil.rmtree(file.parent) if draw.random() < 0.1 else file.unlink()


def _swapped(file: Path, draw: Random) -> None:
    other = draw.choice(sorted(it for it in file.parent.iterdir() if it.is_file()))
    text = other.read_bytes()
    other.write_bytes(file.read_bytes())
    file.write_bytes(text)


def _linked(file: Path, draw: Random) -> None:
    file.unlink()
    file.symlink_to(draw.choice((file.name, "nowhere", ".", "..", "../loop", "../null", "../full")))


def _folder(file: Path, draw: Random) -> None:
    file.unlink()
    file.mkdir()


def _pipe(file: Path, draw: Random) -> None:
    file.unlink()
    os.mkfifo(file)


def _forbidden(file: Path, draw: Random) -> None:
    draw.choice((file, file.parent)).chmod(draw.choice((0o000, 0o444, 0o222)))


def _foreign(file: Path, draw: Random) -> None:
    path = file.with_name(draw.choice(NAMES))
    if path.exists():
        return
    if draw.random() < 0.3:
        path.mkdir()
    else:
        path.write_bytes(
            draw.choice((b"", b"{}", b"PAR1", b"\xff" * 99, b"null", file.read_bytes()))
        )


def _json(file: Path, draw: Random) -> None:
    """Change the data of a record, or of a random one beside it."""
    records = sorted(it for it in file.parent.glob("*.json") if it.is_file()) or [file]
    record = draw.choice([it for it in records if it.name != "data_dictionary.json"] or records)
    if draw.random() < 0.05:
        record.write_text(draw.choice(("[", '{"a":')) * 100_000, encoding="utf-8")
        return
    try:
        data = json.loads(record.read_bytes())
    except (ValueError, RecursionError):
        return
    for _ in range(draw.choice((1, 1, 2, 5))):
        data = mutated(data, draw)
    record.write_text(json.dumps(data), encoding="utf-8", errors="surrogatepass")


def _table(file: Path, draw: Random) -> None:
    """Change the columns or the values of a table, in a file that is in order by itself."""
    tables = sorted(it for it in file.parent.glob("*.parquet") if it.is_file()) or [file]
    path = draw.choice(tables)
    try:
        table = pq.read_table(path)
    except (OSError, ValueError, pa.ArrowException):
        return
    if not table.num_columns:
        return
    draw.choice((_column, _column, _column, _rows))(table, path, draw)


def _column(table: Any, path: Path, draw: Random) -> None:
    at = draw.randrange(table.num_columns)
    name, old = table.column_names[at], table.column(at)
    value = draw.choice([it for it in VALUES if not isinstance(it, list | dict)])
    values = old.to_pylist()
    how = draw.random()
    if how < 0.15:
        table = table.remove_column(at)
    elif how < 0.25:
        table = table.rename_columns([*table.column_names[:at], "x", *table.column_names[at + 1 :]])
    else:
        some = (
            [value if draw.random() < 0.3 else it for it in values]
            if how < 0.7
            else [value] * len(values)
        )
        try:
            table = table.set_column(at, name, pa.array(some, old.type if how < 0.9 else None))
        except (pa.ArrowException, OverflowError, TypeError, ValueError):
            table = table.set_column(at, name, pa.nulls(len(values)))
    pq.write_table(table, path)


def _rows(table: Any, path: Path, draw: Random) -> None:
    rows = list(range(table.num_rows))
    draw.shuffle(rows)
    few = rows[: draw.randrange(len(rows) + 1)] * draw.choice((1, 1, 2, 100))
    pq.write_table(table.take(pa.array(few, pa.int64())), path)


DAMAGES: tuple[Callable[[Path, Random], None], ...] = (
    _bytes, _bytes, _bytes, _gone, _swapped, _linked, _folder, _pipe, _forbidden, _foreign,
    _json, _json, _json, _json, _table, _table, _table, _table,
)  # fmt: skip
