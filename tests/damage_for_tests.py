"""Ways in which the files of a result folder come to harm, each with a name."""

import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

Damage = tuple[str, Callable[[Path], None]]

FLIPS = 8
WRONG: tuple[Any, ...] = (
    None, True, -1, 10**400, 1.5, 1e999, float("nan"), "", "AUV0", "\x1b[31m", [], [None], {},
    {"a": 1},
)  # fmt: skip


def of_any_file(name: str, seed: int) -> Iterator[Damage]:
    """Yield damage that a disk does: cut, emptied, overwritten, bits turned at seeded places."""
    yield f"{name} missing", lambda folder: (folder / name).unlink()
    yield f"{name} empty", lambda folder: _put(folder / name, b"")
    yield f"{name} halved", lambda folder: _put(folder / name, _bytes(folder / name, 0.5))
    yield f"{name} noise", lambda folder: _put(folder / name, random.Random(seed).randbytes(999))
    yield f"{name} a folder", lambda folder: _folder(folder / name)
    for number in range(FLIPS):
        yield f"{name} bit {number}", _flip(name, random.Random(f"{seed} {number}"))


def of_a_table(name: str, others: list[str]) -> Iterator[Damage]:
    """Yield damage that a person does to a Parquet file."""
    for other in others:
        yield (
            f"{name} is {other}",
            lambda folder, other=other: _put(
                folder / f"{name}.parquet", (folder / f"{other}.parquet").read_bytes()
            ),
        )
    yield f"{name} first column gone", changed(name, lambda it: it.drop_columns(it.column_names[0]))
    yield f"{name} last column gone", changed(name, lambda it: it.drop_columns(it.column_names[-1]))
    yield f"{name} twice", changed(name, lambda it: pa.concat_tables([it, it]))
    yield f"{name} no rows", changed(name, lambda it: it.slice(0, 0))
    yield f"{name} backwards", changed(name, lambda it: it.take(np.arange(len(it))[::-1]))
    yield f"{name} unsigned", changed(name, lambda it: it.replace_schema_metadata({}))
    for place in (0, -1):
        yield f"{name} as text {place}", changed(name, lambda it, place=place: _as_text(it, place))
        yield f"{name} null {place}", changed(name, lambda it, place=place: _all_null(it, place))


def of_json(name: str, keys: list[str]) -> Iterator[Damage]:
    """Yield damage to a JSON file: other kinds of it, keys lost, and values of every wrong type."""
    path = name
    for text in (
        "[]",
        "null",
        "1",
        '""',
        "{}",
        "[" * 100_000,
        '{"a":' * 100_000,
        "NaN",
        "\ufeff{}",
    ):
        yield f"{name} {text[:8]}", lambda folder, text=text: _put(folder / path, text.encode())
    yield f"{name} not UTF-8", lambda folder: _put(folder / path, b'{"seed": "\xff"}')
    for key in keys:
        yield f"{name} without {key}", lambda folder, key=key: _without(folder / name, key)
        for value in WRONG:
            yield f"{name} {key}={str(value)[:20]!r}", with_value(name, key, value)


def with_value(name: str, key: str, value: Any) -> Callable[[Path], None]:
    """Return what sets a key of a JSON file, outermost only."""

    def change(folder: Path) -> None:
        data = json.loads((folder / name).read_text())
        (folder / name).write_text(json.dumps({**data, key: value}))

    return change


def changed(name: str, change: Callable[[pa.Table], pa.Table]) -> Callable[[Path], None]:
    """Return what writes a table anew with its own metadata."""

    def rewrite(folder: Path) -> None:
        path = folder / f"{name}.parquet"
        pq.write_table(change(pq.read_table(path)), path)

    return rewrite


def column_set(table: pa.Table, name: str, values: list[Any]) -> pa.Table:
    """Return a table with other values at the beginning of a column."""
    place, field = table.column_names.index(name), table.schema.field(name)
    column = [*values, *table[name].to_pylist()[len(values) :]]
    return table.set_column(place, field, pa.array(column, field.type))


def _as_text(table: pa.Table, place: int) -> pa.Table:
    place %= table.num_columns
    texts = pa.array([str(value) for value in table.column(place).to_pylist()], pa.large_string())
    return table.set_column(place, table.column_names[place], texts)


def _all_null(table: pa.Table, place: int) -> pa.Table:
    field = table.schema.field(place)
    return table.set_column(place % table.num_columns, field, pa.nulls(len(table), field.type))


def _flip(name: str, dice: random.Random) -> Callable[[Path], None]:
    def turn(folder: Path) -> None:
        data = bytearray((folder / name).read_bytes())
        data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
        _put(folder / name, bytes(data))

    return turn


def _without(path: Path, key: str) -> None:
    path.write_text(json.dumps({k: v for k, v in json.loads(path.read_text()).items() if k != key}))


def _folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _bytes(path: Path, share: float) -> bytes:
    data = path.read_bytes()
    return data[: int(len(data) * share)]


def _put(path: Path, data: bytes) -> None:
    path.write_bytes(data)
