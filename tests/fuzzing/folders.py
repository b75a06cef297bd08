"""Folders of a run and of a campaign that are damaged, and every command that reads folders."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from bindusbl_des.cli import main
from bindusbl_des.commands.plot import RUN_KINDS, SWEEP_KINDS

from .files import Lines
from .material import lay_out
from .texts import bytes_mutated
from .trees import mutated
from .values import VALUES


def run(seed: int, draw: Random) -> Lines:
    """Damage the folder of a run; return what reads it."""
    return _damaged("run", draw)


def campaign(seed: int, draw: Random) -> Lines:
    """Damage the folder of a campaign; return what reads it."""
    return _damaged("campaign", draw)


def _damaged(name: str, draw: Random) -> Lines:
    lay_out([name])
    shutil.copytree(name, "whole")
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        files = sorted(it for it in Path(name).rglob("*") if it.is_file() and not it.is_symlink())
        telling = [it for it in files if it.suffix in (".json", ".parquet")]
        if not files:
            break
        draw.choice(DAMAGES)(draw.choice(telling or files), draw)
    return _lines(name, draw)


def _lines(name: str, draw: Random) -> Lines:
    """Return a line for each command that takes a folder, and for each reader in Python."""
    lines = [["load_result", name], ["load_campaign", name]]
    for command in _reading_folders():
        lines.append([command, name, *draw.choice(_options(command, name, draw))])
    return lines


def _reading_folders() -> list[str]:
    """Return the names of all commands with an argument that is a folder."""
    return [
        name
        for name, command in main.commands.items()
        if any((it.metavar or "").startswith("DIR") for it in command.params[:1])
    ]


def _options(command: str, name: str, draw: Random) -> Lines:
    """Return the options a command is tried with, some of them; one not known here gets none."""
    kinds = RUN_KINDS if name == "run" else SWEEP_KINDS
    return {
        "explain": [["--ping", str(draw.randrange(9))], ["--fix", str(draw.randrange(9))]],
        "export": [["--to", "csv", "--out", "out"], ["--to", "mcap", "--out", "out.mcap"]],
        "plot": [[draw.choice(list(kinds)), "--out", "out.svg"]],
        "report": [[], ["whole", "--out", "out.html"]],
        "compare": [["whole"], ["--by", "asvs.count", "--out", "out.csv"]],
        "merge": [["--out", "merged"], ["whole", "--out", "twice"]],
        "resume": [["--retry-failed"]],
    }.get(command, [[]])


def _bytes(file: Path, draw: Random) -> None:
    file.write_bytes(bytes_mutated(file.read_bytes(), draw))


def _gone(file: Path, draw: Random) -> None:
    shutil.rmtree(file.parent) if draw.random() < 0.1 else file.unlink()


def _swapped(file: Path, draw: Random) -> None:
    other = draw.choice([it for it in file.parent.iterdir() if it.is_file()])
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
    names = (f"part-all-{draw.randrange(10)}.parquet", "part-x.parquet", "\udcff", "x" * 250, "run.json",
             "campaign.json", "advice.json", "report.html", "figures", "csv", "failures", ".lock")  # fmt: skip
    path = file.with_name(draw.choice(names))
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
    _bytes, _bytes, _bytes, _gone, _swapped, _linked, _folder, _forbidden, _foreign,
    _json, _json, _json, _json, _table, _table, _table, _table,
)  # fmt: skip
