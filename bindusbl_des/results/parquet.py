"""Tables in Parquet files: what a file claims is checked before memory is spent on it."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..preflight.machine import machine_memory
from .arrow import numpy_array, spelt
from .pages import lying_chunk
from .schemas import SCHEMA_VERSION, schema

# Rows that are read, and written out, at a time; a table of fewer is read sooner by one thread.
ROWS = 100_000

# No file is refused for less, and a row takes no more than so much for each of its columns (bytes).
LEAST_BYTES, CELL_BYTES = 100_000_000, 256


class DamagedFile(ValueError):
    """A file of results is missing, cannot be read, or is not what its name says."""

    def __init__(self, path: str, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(path, reason)

    def __str__(self) -> str:
        return f"{self.path} {self.reason}"


@dataclass(frozen=True)
class Words:
    """A column of text as numbers: the different words, and in each row which one (-1: null)."""

    words: tuple[str, ...]
    codes: NDArray[np.int64]

    def are(self, word: str) -> NDArray[np.bool_]:
        """Return which rows have a word."""
        places = [place for place, known in enumerate(self.words) if known == word]
        found: NDArray[np.bool_] = np.isin(self.codes, places)
        return found

    @property
    def most_bytes(self) -> int:
        """How many bytes all rows take at most, written out."""
        return len(self.codes) * max([len(word.encode()) for word in self.words], default=0)

    @property
    def written_out(self) -> pa.ChunkedArray:
        """The column of text, some rows at a time, lest letters be many more than there are."""
        parts = range(0, len(self.codes), ROWS)
        chunks = [spelt(self.words, self.codes[begin : begin + ROWS]) for begin in parts]
        return pa.chunked_array(chunks, type=pa.string())


def read_parquet(
    path: Path,
    columns: Sequence[str] | None = None,
    needed: Sequence[str] = (),
    footer: pq.FileMetaData | None = None,
) -> pa.Table:
    """Return a table from its file, or those of some columns that it has; it must have all needed.

    A `footer` that is known is not read again.

    Raises:
        DamagedFile: saying what is wrong with the file.
    """
    with _opened(path, footer=footer) as file:
        known = file.schema_arrow.names
        _check_columns(path, known, needed)
        _check_size(path, file.metadata, len(known))
        wanted = columns and [name for name in columns if name in known]
        return file.read(wanted, use_threads=file.metadata.num_rows > ROWS)


def check_claims(path: Path, name: str, origin: Mapping[str, str]) -> pq.FileMetaData:
    """Return the footer of a mission's table, once it says what it should.

    `origin` is the metadata of the mission that it must be of, by keys with what each is called.

    Raises:
        DamagedFile: when it is another table, another mission's, or of another version.
    """
    with _opened(path) as file:
        found, described = file.schema_arrow, schema(name)
        _check_origin(path, name, origin, found.metadata or {})
        _check_columns(path, found.names, described.names)
        for field in described:
            kind = found.field(field.name).type
            if kind != field.type:
                raise DamagedFile(
                    str(path), f"has {kind} in its column {field.name}, not {field.type}"
                )
        _check_size(path, file.metadata, len(described))
        return file.metadata


def read_table(path: Path, name: str, footer: pq.FileMetaData) -> tuple[pa.Table, dict[str, Words]]:
    """Return a mission's table whose claims were checked, and its columns of text by their words.

    In the table these are numbers of words, until somebody knows that they are words to be written
    out (:func:`written_out`): each of a million rows could have one of a million letters.

    Raises:
        DamagedFile: when its pages are damaged, or its texts are too long.
    """
    described = schema(name)
    texts = [field.name for field in described if field.type == pa.string()]
    with _opened(path, texts, footer) as file:
        read = file.read(described.names, use_threads=footer.num_rows > ROWS)
        words = {column: _words(read[column]) for column in texts}
    size, most = sum(it.most_bytes for it in words.values()), _most(footer.num_rows, len(described))
    if size > most:
        raise _too_large(path, size, footer.num_rows)
    return read, words


def written_out(table: pa.Table, name: str, words: Mapping[str, Words]) -> pa.Table:
    """Return a table that was read with its texts written out, and the columns that are agreed.

    Units and meanings are this package's, whatever the file calls them.
    """
    described = schema(name)
    columns = [words[it].written_out if it in words else table[it] for it in described.names]
    return pa.Table.from_arrays(columns, schema=described)


def _words(column: pa.ChunkedArray) -> Words:
    """Return the words of a dictionary-encoded column, whose chunks each have their own."""
    words: list[str] = []
    codes = [np.zeros(0, dtype=np.int64)]
    for chunk in column.chunks:
        indices = numpy_array(chunk.indices)
        known = ~np.isnan(indices) if chunk.null_count else True
        codes.append(np.where(known, indices + len(words), -1).astype(np.int64))
        words += chunk.dictionary.to_pylist()
    return Words(tuple(words), np.concatenate(codes))


@contextmanager
def _opened(
    path: Path, texts: Sequence[str] = (), footer: pq.FileMetaData | None = None
) -> Iterator[pq.ParquetFile]:
    """Yield a Parquet file, columns of `texts` to be read as words; damage is told as such.

    A `footer` that is known is not read again.
    """
    try:
        if path.exists() and not path.is_file():
            raise DamagedFile(str(path), "is no file")
        with pq.ParquetFile(
            path, metadata=footer, read_dictionary=list(texts), page_checksum_verification=True
        ) as file:
            yield file
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


def _check_size(path: Path, footer: pq.FileMetaData, columns: int) -> None:
    """Refuse a file whose pages unpack to more than they should, than rows can hold, or memory."""
    groups = [footer.row_group(number) for number in range(footer.num_row_groups)]
    rows, most = footer.num_rows, _most(footer.num_rows, columns)
    chunks = [group.column(number) for group in groups for number in range(group.num_columns)]
    unpacked = sum(chunk.total_uncompressed_size for chunk in chunks)
    if sum(group.num_rows for group in groups) != rows:
        raise DamagedFile(str(path), "is damaged (its row groups do not add up to its rows)")
    if unpacked > most:
        raise _too_large(path, unpacked, rows)
    lying = lying_chunk(path, chunks, LEAST_BYTES)
    if lying:
        raise DamagedFile(
            str(path), f"is damaged (pages of its column {lying} unpack to more than it says)"
        )
    if max(8 * columns * rows, unpacked) > LEAST_BYTES:
        _check_memory(path, rows, max(8 * columns * rows, unpacked))


def _most(rows: int, columns: int) -> int:
    """Return how many bytes the columns of a table may take."""
    return LEAST_BYTES + CELL_BYTES * columns * rows


def _too_large(path: Path, size: int, rows: int) -> DamagedFile:
    return DamagedFile(
        str(path), f"would unpack to {size:,} bytes, more than {rows:,} rows can hold"
    )


def _check_memory(path: Path, rows: int, needed: int) -> None:
    if needed > machine_memory():
        raise DamagedFile(
            str(path), f"claims {rows:,} rows, more than this machine's memory can hold"
        )


def write_parquet(table: pa.Table, name: str, path: Any, origin: Mapping[str, str]) -> None:
    """Write one table as Parquet (zstd); `origin` (scenario hash, seed) goes into its metadata."""
    metadata = {"bindusbl.schema": f"{name}/{SCHEMA_VERSION}", **origin}
    pq.write_table(
        table.replace_schema_metadata(metadata),
        path,
        compression="zstd",
        use_dictionary=[f.name for f in table.schema if f.type == pa.string()],
        write_page_checksum=True,  # so that damage is found, not read
    )
