"""The folder of a run: which files it has, and how it is written, whole or not at all.

Tables are Parquet files.  Their SHA-256 is compared before they are parsed, because Parquet's
decoders end the process at some flipped bits.
"""

import hashlib
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import csv

from ...support.files import DRAFT, clear_killed, folder_draft, sealed
from ...support.kept_files import FOLDERS, KEPT
from ...support.wording import file_name
from ..records.events import LASTING_ERRORS, TOLD_WHY
from .effects import Advice
from .schemas import SCHEMA_VERSION, TABLES, schema

# A table with at most this many rows is read faster by one thread.
ROWS = 100_000

# The rows of a batch, for readers that go through a table in batches.
PIECE = 10_000


class DamagedFile(ValueError):
    """A file of results is missing, cannot be read, or is not what its name says."""

    def __init__(self, path: str, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(path, reason)

    def __str__(self) -> str:
        return f"{self.path} {self.reason}"


class SummedFile(io.FileIO):
    """A file written from beginning to end, which computes the SHA-256 of its contents."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "wb")
        self._sum = hashlib.sha256()

    def write(self, data: Any) -> int:
        """Write all bytes, or raise OSError."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        self._sum.update(rest)
        while len(rest):
            rest = rest[super().write(rest) :]
        return size

    def sha256(self) -> str:
        """Return the SHA-256 of what was written so far."""
        return self._sum.hexdigest()


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises:
        DamagedFile: when it is no file, or cannot be read.
    """
    with _read(path), open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def compare_sum(path: Path, expected: str | None, record: str) -> None:
    """Refuse a file whose SHA-256 is not the `expected` one of a `record`.

    Raises:
        DamagedFile: when it differs, or the record has none.
    """
    if expected is None:
        raise DamagedFile(str(path), f"has no checksum in {record}")
    if sha256_of(path) != expected:
        raise DamagedFile(str(path), f"is damaged or was edited (its SHA-256 is not in {record})")


def read_parquet(
    path: Path, columns: Sequence[str] | None = None, needed: Sequence[str] = ()
) -> pa.Table:
    """Return the table in a file, or those of `columns` that it has; all `needed` must be there.

    Mission metrics that an older file lacks are null.

    Raises:
        DamagedFile: saying what is wrong with the file.
    """
    with _opened(path) as file:
        known = file.schema_arrow.names
        _check_columns(path, known, needed)
        wanted = columns and [name for name in columns if name in known]
        rows = file.read(wanted, use_threads=file.metadata.num_rows > ROWS)
    for name in sorted(ADDED["mission"].intersection(columns or ()).difference(known)):
        kind = schema("mission").field(name).type
        rows = rows.append_column(name, pa.nulls(len(rows), kind))
    return rows


def read_pieces(path: Path) -> Iterator[pa.Table]:
    """Yield the rows of a table in batches of PIECE.

    Raises:
        DamagedFile: saying what is wrong with the file.
    """
    with _opened(path) as file:
        if file.metadata.num_rows <= PIECE:  # sooner than by batches
            yield file.read(use_threads=False)
            return
        for batch in file.iter_batches(PIECE):
            yield pa.Table.from_batches([batch])


def read_schema(path: Path) -> pa.Schema:
    """Return the columns of a file, with its metadata.

    Raises:
        DamagedFile: saying what is wrong with the file.
    """
    with _opened(path) as file:
        return file.schema_arrow


# Columns that older folders may lack
OF_THE_BOTTOM = ("least_altitude_m", "lock_share")
ADDED = {
    "auvs": {*OF_THE_BOTTOM},
    "tracks": {"altitude_m"},
    "pings": {"call_why"},
    "receptions": {*TOLD_WHY, *LASTING_ERRORS, "range_rate_m_per_s"},
    "frame_receptions": {*TOLD_WHY},
    "mission": {
        *("packet_delivery_ratio", "goodput_bps", "packet_latency_s", "packet_fairness"),
        *OF_THE_BOTTOM,
        *(f"worst_{name}{whose}" for name in OF_THE_BOTTOM for whose in ("", "_auv")),
    },
}


def read_table(path: Path, name: str, origin: Mapping[str, str]) -> pa.Table:
    """Return a mission's table with its columns, their units and meanings.

    Columns that older folders lack (`ADDED`) are null.  `origin` is the metadata, by key, of the
    mission that the file must belong to.

    Raises:
        DamagedFile: when it is another table, another mission's, or of another version.
    """
    with _opened(path) as file:
        stored = file.schema_arrow
        described = schema(name, stored.names)
        _check_origin(path, name, origin, stored.metadata or {})
        added = ADDED.get(name, set()).difference(stored.names)
        names = [column for column in described.names if column not in added]
        _check_columns(path, stored.names, names)
        read = file.read(names, use_threads=file.metadata.num_rows > ROWS)
    for field in (described.field(column) for column in added):
        read = read.append_column(field, pa.nulls(len(read), field.type))
    for field in described:
        kind = read.schema.field(field.name).type
        if kind != field.type:
            raise DamagedFile(str(path), f"has {kind} in its column {field.name}, not {field.type}")
    return pa.Table.from_arrays([read[column] for column in described.names], schema=described)


def write_parquet(
    table: pa.Table, name: str, path: Any, origin: Mapping[str, str], compression: str = "zstd"
) -> None:
    """Write one table as Parquet; `origin` (scenario hash, seed) goes into its metadata."""
    metadata = {"bindusbl.schema": f"{name}/{SCHEMA_VERSION}", **origin}
    pq.write_table(
        table.replace_schema_metadata(metadata),
        path,
        compression=compression,
        use_dictionary=[f.name for f in table.schema if f.type == pa.string()],
    )


@contextmanager
def _opened(path: Path) -> Iterator[pq.ParquetFile]:
    # pyarrow takes ~ in a name for a home, and refuses names that are no UTF-8
    with (
        _read(path),
        open(path, "rb") as file,
        pq.ParquetFile(file, page_checksum_verification=True) as opened,
    ):
        yield opened


@contextmanager
def _read(path: Path) -> Iterator[None]:
    """Raise DamagedFile, with the reason, for a file that cannot be read."""
    try:
        if path.exists() and not path.is_file():
            raise DamagedFile(str(path), "is no file")
        yield
    except DamagedFile:
        raise
    except FileNotFoundError:
        raise DamagedFile(str(path), "is missing") from None
    except (OSError, ValueError, TypeError, MemoryError, pa.ArrowException) as error:
        reason_given = (str(error).splitlines() or [type(error).__name__])[0]
        reason = "cannot be read" if isinstance(error, PermissionError) else "is damaged"
        raise DamagedFile(str(path), f"{reason} ({reason_given})") from None


def _check_origin(
    path: Path, name: str, origin: Mapping[str, str], metadata: Mapping[bytes, bytes]
) -> None:
    written = {
        key.decode(): value.decode() for key, value in metadata.items() if b"bindusbl" in key
    }
    kind, _, number = written.get("bindusbl.schema", "").partition("/")
    if kind != name:
        raise DamagedFile(str(path), f"holds {kind or 'another table'}, not {name}")
    if number != str(SCHEMA_VERSION):
        raise DamagedFile(
            str(path), f"is of version {number}; this package reads version {SCHEMA_VERSION}"
        )
    for key, expected in origin.items():
        if written.get(key) != expected:
            what = key.rpartition(".")[2]
            raise DamagedFile(
                str(path),
                f"is of another mission: its {what} is {written.get(key, 'missing')[:16]}, that of "
                f"run.json {expected[:16]}",
            )


def _check_columns(path: Path, columns: Sequence[str], needed: Sequence[str]) -> None:
    lacking = [name for name in needed if columns.count(name) != 1]
    if lacking:
        named = ", ".join(lacking[:3]) + (", ..." if len(lacking) > 3 else "")
        raise DamagedFile(
            str(path), f"has no column {named}: it is another table, or of another version"
        )


RECORD = "run.json"
# Its keys with checksums: of the tables, and of the scenario and the data dictionary.
SUMS, FILE_SUMS = "tables_sha256", "files_sha256"
SCENARIO, DICTIONARY = "scenario.yaml", "data_dictionary.json"
# The file of the advice, in folders of missions with advice.
ADVICE = "advice.json"

WRITTEN = {RECORD, SCENARIO, DICTIONARY, "report.html", ADVICE}
WRITTEN |= {f"{name}.parquet" for name in TABLES}

# Files that `plot` adds; the kinds are repeated here, since matplotlib is slow to import.
FIGURES = "figures"
KINDS = ("trajectory", "error", "fixes", "coverage", "timeline", "round", "latency")
DRAWN = {f"{kind}.{suffix}" for kind in KINDS for suffix in ("png", "svg", "pdf")}

# Files that `export` makes; a folder of CSV files of a campaign also has a table of missions.
EXPORTED = ("mcap", "ros2.mcap", "geojson", "kml", "kmz")
CSV, CSV_DICTIONARY = "csv", "columns.csv"
CSV_FILES = {CSV_DICTIONARY, "missions.csv", *(f"{name}.csv" for name in TABLES)}

# Messages name at most this many foreign files.
MOST_NAMED = 3


def result_draft(folder: Path, *, force: bool = False) -> AbstractContextManager[Path]:
    """Return the context in which a run's folder is filled, as by `folder_draft`."""
    clear_killed(folder / CSV)  # an export within, which would be in the way
    return folder_draft(folder, objection, force=force)


def objection(folder: Path) -> str | None:
    """Return why `force` must not replace a folder; None if it is empty, or holds a run."""
    if not (folder / RECORD).is_file():
        empty = folder.is_dir() and not any(folder.iterdir())
        return None if empty else "holds no results of a run, so it is not replaced"
    foreign = sorted(_foreign(folder))
    if not foreign:
        return None
    more = f" and {len(foreign) - MOST_NAMED} more" if len(foreign) > MOST_NAMED else ""
    named = ", ".join(foreign[:MOST_NAMED])
    return f"holds {named}{more}, which no run wrote, so it is not replaced"


def objection_to_csv(folder: Path) -> str | None:
    """Return why `force` must not replace a folder; None if it is empty, or an export to CSV."""
    files = list(folder.iterdir()) if folder.is_dir() else [folder]
    foreign = sorted(
        path.name for path in files if path.name not in CSV_FILES or not path.is_file()
    )
    if not foreign and (not files or folder / CSV_DICTIONARY in files):
        return None
    which = f" (it holds {foreign[0]})" if folder.is_dir() and foreign else ""
    return f"is no earlier export{which}, so it is not replaced"


def _foreign(folder: Path) -> Iterator[str]:
    """Yield the names of foreign files in a run's folder.

    Results, files of `plot` and `export`, and drafts of killed processes are not foreign.
    """
    ours = {*WRITTEN, *(f"{exported_name(folder)}.{ending}" for ending in EXPORTED)}
    for path in folder.iterdir():
        if path.name == CSV and path.is_dir() and not objection_to_csv(path):
            continue
        if path.name == FIGURES and path.is_dir():
            yield from (f"{FIGURES}/{file.name}" for file in path.iterdir() if not _is(file, DRAWN))
        elif path.name in FOLDERS and path.is_dir():
            names = [f"{path.name}/{file.name}" for file in path.iterdir()]
            yield from (name for name in names if not KEPT.fullmatch(name))
        elif not _is(path, ours):
            yield path.name


def _is(path: Path, names: set[str]) -> bool:
    """Return whether a path is a file with one of these names, or a draft of a file."""
    draft = path.name.startswith(".") and path.name.endswith(DRAFT)
    return path.is_file() and (draft or path.name in names)


def exported_name(folder: Path) -> str:
    """Return the stem of the files that `export` makes of a folder's mission."""
    try:
        name = json.loads((folder / RECORD).read_text(encoding="utf-8"))["scenario"]["name"]
        return file_name(str(name))
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def advice_text(advice: Advice) -> str:
    """Return the text of `advice.json`."""
    return json.dumps(sealed(asdict(advice)), indent=2) + "\n"


def write_json(path: Path, data: Any) -> None:
    """Write a JSON file into a folder that no other process uses yet."""
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")


def write_csv(
    tables: Mapping[str, pa.Table], folder: Path, *, force: bool = False
) -> Mapping[str, int]:
    """Write tables as a folder of CSV files, whole or not at all; return the rows of each.

    UTF-8, commas, decimal points, a header; a missing value is empty, and numbers read back
    exactly.  Units are in the names of the columns, and with their meaning in `columns.csv`.

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
