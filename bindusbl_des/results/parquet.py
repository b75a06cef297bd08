"""Tables in Parquet files: written with their SHA-256, compared with it before they are parsed.

Parquet's own decoders end the process at some flipped bits, so a file that has a checksum on record
is read only if it still has it.
"""

import hashlib
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .schemas import SCHEMA_VERSION, schema

# A table of fewer rows is read sooner by one thread.
ROWS = 100_000


class DamagedFile(ValueError):
    """A file of results is missing, cannot be read, or is not what its name says."""

    def __init__(self, path: str, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(path, reason)

    def __str__(self) -> str:
        return f"{self.path} {self.reason}"


class SummedFile(io.FileIO):
    """A file that is written from its beginning to its end, and the SHA-256 of what was written."""

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
        """Return the checksum of what was written so far."""
        return self._sum.hexdigest()


def sha256_of(path: Path) -> str:
    """Return the checksum of a file.

    Raises:
        DamagedFile: when it is none, or cannot be read.
    """
    with _read(path), open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def compare_sum(path: Path, expected: str | None, record: str) -> None:
    """Refuse a file that has not the checksum that a `record` has of it.

    Raises:
        DamagedFile: when it has not, or the record has none.
    """
    if expected is None:
        raise DamagedFile(str(path), f"has no checksum in {record}")
    if sha256_of(path) != expected:
        raise DamagedFile(str(path), f"is damaged or was edited (its SHA-256 is not in {record})")


def read_parquet(
    path: Path, columns: Sequence[str] | None = None, needed: Sequence[str] = ()
) -> pa.Table:
    """Return a table from its file, or those of some columns that it has; it must have all needed.

    Raises:
        DamagedFile: saying what is wrong with the file.
    """
    with _opened(path) as file:
        known = file.schema_arrow.names
        _check_columns(path, known, needed)
        wanted = columns and [name for name in columns if name in known]
        return file.read(wanted, use_threads=file.metadata.num_rows > ROWS)


def read_schema(path: Path) -> pa.Schema:
    """Return the columns of a file, with its metadata.

    Raises:
        DamagedFile: saying what is wrong with the file.
    """
    with _opened(path) as file:
        return file.schema_arrow


def read_table(path: Path, name: str, origin: Mapping[str, str]) -> pa.Table:
    """Return a mission's table with the columns that are agreed, their units and meanings.

    `origin` is the metadata of the mission that it must be of, by keys with what each is called.

    Raises:
        DamagedFile: when it is another table, another mission's, or of another version.
    """
    described = schema(name)
    with _opened(path) as file:
        found = file.schema_arrow
        _check_origin(path, name, origin, found.metadata or {})
        _check_columns(path, found.names, described.names)
        read = file.read(described.names, use_threads=file.metadata.num_rows > ROWS)
    for field in described:
        kind = read.schema.field(field.name).type
        if kind != field.type:
            raise DamagedFile(str(path), f"has {kind} in its column {field.name}, not {field.type}")
    return pa.Table.from_arrays([read[it] for it in described.names], schema=described)


def write_parquet(table: pa.Table, name: str, path: Any, origin: Mapping[str, str]) -> None:
    """Write one table as Parquet (zstd); `origin` (scenario hash, seed) goes into its metadata."""
    metadata = {"bindusbl.schema": f"{name}/{SCHEMA_VERSION}", **origin}
    pq.write_table(
        table.replace_schema_metadata(metadata),
        path,
        compression="zstd",
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
    """Say of a file that cannot be read why."""
    try:
        if path.exists() and not path.is_file():
            raise DamagedFile(str(path), "is no file")
        yield
    except DamagedFile:
        raise
    except FileNotFoundError:
        raise DamagedFile(str(path), "is missing") from None
    except (OSError, ValueError, TypeError, MemoryError, pa.ArrowException) as error:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        reason = "cannot be read" if isinstance(error, PermissionError) else "is damaged"
        raise DamagedFile(str(path), f"{reason} ({said})") from None


def _check_origin(
    path: Path, name: str, origin: Mapping[str, str], found: Mapping[bytes, bytes]
) -> None:
    told = {key.decode(): value.decode() for key, value in found.items() if b"bindusbl" in key}
    kind, _, number = told.get("bindusbl.schema", "").partition("/")
    if kind != name:
        raise DamagedFile(str(path), f"holds {kind or 'another table'}, not {name}")
    if number != str(SCHEMA_VERSION):
        raise DamagedFile(
            str(path), f"is of version {number}; this package reads version {SCHEMA_VERSION}"
        )
    for key, expected in origin.items():
        if told.get(key) != expected:
            what = key.rpartition(".")[2]
            raise DamagedFile(
                str(path),
                f"is of another mission: its {what} is {told.get(key, 'missing')[:16]}, that of "
                f"run.json {expected[:16]}",
            )


def _check_columns(path: Path, found: Sequence[str], needed: Sequence[str]) -> None:
    lacking = [name for name in needed if found.count(name) != 1]
    if lacking:
        named = ", ".join(lacking[:3]) + (", ..." if len(lacking) > 3 else "")
        raise DamagedFile(
            str(path), f"has no column {named}: it is another table, or of another version"
        )
