"""Tables of a mission: what was recorded, laid out at once as Arrow record batches."""

import struct
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..core.arrays import Ints
from ..core.compiled import compiled
from ..records.events import OUTCOMES
from ..records.rows import NONE, Row, Rows
from .schemas import VEHICLES, never_null, schema

# Tables made at once: all columns in one buffer, laid out as a record batch of Arrow's IPC format.
#
# Such a batch is a message, which says how many rows there are and where the buffers of each
# column lie, and those buffers behind it. Arrow reads the columns where they are, all in one call.
# Made by Arrow column by column, the same pings, receptions, broadcasts and fixes of a (3,3)
# mission of 300 s take it three times as long (0.7 and 0.2 ms of processor time).
#
# Source: Apache Arrow, Columnar format 1.5, sec. Serialization and interprocess communication,
# with Message.fbs and Schema.fbs; FlatBuffers internals for how a message is laid out.


Ends = NDArray[np.int32]
Bytes = NDArray[np.uint8]

# A message follows a mark and its length; all buffers begin at whole words (bytes).
PREFIX, WORD = 8, 8

# Fields of a message and of the batch that it tells of, in the order of Message.fbs
HEADER, BODY_LENGTH = 2, 3
LENGTH, NODES, BUFFERS = 0, 1, 2

# How numbers become a column: as they are, NaN null; whole, a negative one null or not; words that
# they count in; one word followed by the number.
FLOATS, WHOLES, WHOLES_OR_NULL, WORDS, NUMBERED = range(5)

# The bits of a float but for its sign, and those of infinity: what is beyond is not a number.
UNSIGNED, INFINITE = 0x7FFFFFFFFFFFFFFF, 0x7FF0000000000000

# Longest number of a vehicle in a name, in digits
DIGITS = 19

# Rows are written so many at a time, which stay in the processor's cache meanwhile.
BLOCK = 256

# A column: of which of the parts it is and where in each row (words), what it becomes, and the
# first of its words.
COLUMN = np.dtype([(name, "i8") for name in ("part", "place", "kind", "word")])

# Where the buffers of a column lie: the bits of rows that are not null and the numbers, or where
# texts end (words), and the letters (bytes); how many rows are null, and letters written.
PLACES = np.dtype([(name, "i8") for name in ("known", "numbers", "letters", "missing", "written")])


class BatchMessage(NamedTuple):
    """The message of a batch of one row, as words, and where in it (words) are the count of rows,
    the length of all buffers (bytes), and the first of the nodes and buffers of the columns.
    """

    words: Ints
    rows: int
    body: int
    nodes: int
    buffers: int


class Words(NamedTuple):
    """Words one below the other: their letters (n, longest), and how many each has (n,)."""

    letters: Bytes
    lengths: Ints


class BatchBody(NamedTuple):
    """The buffers of a batch, seen as words, as ends of texts and as letters."""

    words: Ints
    ends: Ends
    letters: Bytes


def message_of(schema: pa.Schema) -> BatchMessage:
    """Return how batches with the columns of a schema begin."""
    one = pa.RecordBatch.from_arrays([pa.nulls(1, it.type) for it in schema], schema=schema)
    text = one.serialize().to_pybytes()
    head = text[: PREFIX + struct.unpack_from("<i", text, 4)[0]]
    message = PREFIX + struct.unpack_from("<I", head, PREFIX)[0]
    batch = _pointed(head, _place(head, message, HEADER))
    places = (
        _place(head, batch, LENGTH),
        _place(head, message, BODY_LENGTH),
        *(_pointed(head, _place(head, batch, of)) + 4 for of in (NODES, BUFFERS)),  # past a count
    )
    return BatchMessage(np.frombuffer(head, np.int64), *(place // WORD for place in places))


def _pointed(head: bytes, place: int) -> int:
    """Return where (bytes) the offset at a place leads."""
    return place + int(struct.unpack_from("<I", head, place)[0])


def _place(head: bytes, table: int, field: int) -> int:
    """Return where (bytes) a table, which begins at `table`, has one of its fields."""
    fields = table - struct.unpack_from("<i", head, table)[0]
    return table + int(struct.unpack_from("<H", head, fields + 4 + 2 * field)[0])


def words_of(words: Sequence[str]) -> Words:
    """Return words as compiled equations take them."""
    encoded = [word.encode() for word in words]
    letters = np.array(encoded or [b"-"])
    spelt = letters.view(np.uint8).reshape(len(letters), -1)
    return Words(spelt, np.array([len(word) for word in encoded], dtype=np.int64))


class TableBatch:
    """A table under way: room for its rows, which are written some at a time."""

    def __init__(
        self, schema: pa.Schema, message: BatchMessage, columns: Rows, words: Words, rows: int
    ) -> None:
        """Have room for rows; `columns` (:data:`COLUMN`) say which numbers become what."""
        self._schema, self._message, self._columns, self._words = schema, message, columns, words
        self._rows, self._written = rows, 0
        self._places, head = np.zeros(len(columns), dtype=PLACES), len(message.words)
        longest = words.letters.shape[1] + DIGITS
        self._buffer = np.empty(head + _plan(self._places, columns, rows, longest), dtype=np.int64)
        self._buffer[:head] = message.words
        body = self._buffer[head:]
        self._body = BatchBody(body, body.view(np.int32), body.view(np.uint8))
        _begin(body, self._places, columns, rows)

    def write(self, *parts: Rows) -> None:
        """Write the next rows: one array of records, or two side by side."""
        first, second = parts[0], parts[-1]
        _write(
            *self._body, self._places, self._columns, *self._words, self._written,
            _numbers(first), _numbers(second),
        )  # fmt: skip
        self._written += len(first)

    def table(self) -> pa.Table:
        """Return the table, when all rows are written."""
        message, buffer = self._message, self._buffer
        body = len(buffer) - len(message.words)
        buffer[message.rows], buffer[message.body] = self._rows, body * WORD
        _tell(buffer, message.nodes, message.buffers, self._places, self._columns, self._rows)
        found = pa.ipc.read_record_batch(pa.py_buffer(buffer), self._schema)
        return pa.Table.from_batches([found], schema=self._schema)


def _numbers(rows: Rows) -> Ints:
    """Return records as whole numbers, whatever they are, a row for each."""
    flat: Any = np.ascontiguousarray(rows).view(np.int64)
    return np.asarray(flat.reshape(len(rows), rows.dtype.itemsize // WORD))


@compiled
def _plan(places: Rows, columns: Rows, rows: int, longest: int) -> int:
    """Find room for the buffers of all columns, of texts as long as the `longest`; return how many
    words they take.
    """
    end = 0
    for k in range(len(columns)):
        place = places[k]
        place.known, place.numbers = end, end + (rows + 63) // 64
        end = place.numbers + (rows // 2 + 1 if columns[k].kind >= WORDS else rows)
    for k in range(len(columns)):  # letters behind, for which there is more room than need be
        if columns[k].kind >= WORDS:
            places[k].letters = end * 8
            end += (rows * longest + 7) // 8
    return end


@compiled
def _begin(words: Ints, places: Rows, columns: Rows, rows: int) -> None:
    """Have all known, and texts begin at 0."""
    for k in range(len(columns)):
        place = places[k]
        words[place.known : place.known + (rows + 63) // 64] = -1
        if columns[k].kind >= WORDS:
            words[place.numbers] = 0


@compiled
def _tell(message: Ints, node: int, buffer: int, places: Rows, columns: Rows, rows: int) -> None:
    """Write the nodes of a message, which say of each column how many rows it has and how many of
    them are null, and its buffers: where each begins and how long it is (bytes).
    """
    for k in range(len(columns)):
        place = places[k]
        message[node], message[node + 1] = rows, place.missing
        message[buffer], message[buffer + 1] = place.known * 8, 0
        if place.missing > 0:
            message[buffer + 1] = (rows + 7) // 8
        message[buffer + 2], message[buffer + 3] = place.numbers * 8, rows * 8
        if columns[k].kind >= WORDS:
            message[buffer + 3] = (rows + 1) * 4
            message[buffer + 4], message[buffer + 5] = place.letters, place.written
            buffer += 2
        node, buffer = node + 2, buffer + 4


@compiled
def _write(
    words: Ints, ends: Ends, letters: Bytes, places: Rows, columns: Rows,
    spelt: Bytes, lengths: Ints, begin: int, first: Ints, second: Ints,
) -> None:  # fmt: skip
    """Write rows from the row `begin` on: those of one array (rows, words) or of two."""
    body, known = BatchBody(words, ends, letters), Words(spelt, lengths)
    for done in range(0, len(first), BLOCK):
        end = min(done + BLOCK, len(first))
        for k in range(len(columns)):
            column, place = columns[k], places[k]
            part = first if column.part == 0 else second
            wholes = part[done:end, column.place]
            if column.kind < WORDS:
                _write_numbers(body, place, column.kind, begin + done, wholes)
            else:
                _write_texts(body, place, column, known, begin + done, wholes)


@compiled
def _write_numbers(body: BatchBody, place: Row, kind: int, begin: int, wholes: Ints) -> None:
    """Write numbers bit for bit, 0 for those that are missing."""
    out, known, missing = place.numbers + begin, 8 * place.known, 0
    for k in range(len(wholes)):
        whole = wholes[k]
        is_nan = kind == FLOATS and whole & UNSIGNED > INFINITE
        is_missing = is_nan or (kind == WHOLES_OR_NULL and whole < 0)
        body.words[out + k] = 0 if is_missing else whole
        if is_missing:
            body.letters[known + (begin + k) // 8] &= ~(1 << (begin + k) % 8)
            missing += 1
    place.missing += missing


@compiled
def _write_texts(
    body: BatchBody, place: Row, column: Row, known: Words, begin: int, wholes: Ints
) -> None:
    """Write what numbers are called, and where each ends; a negative one is missing."""
    letters, length, ends = body.letters, place.written, 2 * place.numbers
    for k in range(len(wholes)):
        number = wholes[k]
        if number < 0:
            letters[8 * place.known + (begin + k) // 8] &= ~(1 << (begin + k) % 8)
            place.missing += 1
        else:
            word = column.word + (number if column.kind == WORDS else 0)
            for letter in range(known.lengths[word]):
                letters[place.letters + length + letter] = known.letters[word, letter]
            length += known.lengths[word]
            if column.kind == NUMBERED:
                length = _write_digits(letters[place.letters :], length, number)
        body.ends[ends + 1 + begin + k] = length
    place.written = length


@compiled
def _write_digits(letters: Bytes, begin: int, number: int) -> int:
    """Write a whole number >= 0; return where it ends."""
    end, rest = begin + 1, number // 10
    while rest > 0:
        end, rest = end + 1, rest // 10
    for place in range(end - 1, begin - 1, -1):
        letters[place] = 48 + number % 10  # "0" and on
        number //= 10
    return end


# Result tables: the rows of a mission as Arrow tables whose columns say what they are.


def from_rows(table: str, rows: Sequence[Any]) -> pa.Table:
    """Return the rows of a table, objects with its columns, as an Arrow table; None becomes null.

    Vehicles are numbers.
    """
    if not rows:
        return _nothing(table)
    numbers, words = _numbered(table, list(map(attrgetter(*schema(table).names), rows)))
    return from_numbers(table, numbers, words=words)


@cache
def _nothing(table: str) -> pa.Table:
    return from_numbers(table, np.empty(0, dtype=_kind(table)))


def numbers_of(table: str, rows: Sequence[Any]) -> Rows:
    """Return the rows of a table without words as :func:`from_numbers` takes them."""
    return _numbered(table, list(map(attrgetter(*schema(table).names), rows)))[0]


def from_row(table: str, row: Mapping[str, Any]) -> pa.Table:
    """Return the one row of a table without words as :func:`from_rows` does; a missing column is
    null.
    """
    kind, counted = _kind(table), _counted(table)
    values = [row.get(name) for name in kind.names or ()]
    for place in counted:
        if values[place] is None:
            values[place] = NONE
    return from_numbers(table, np.array([tuple(values)], dtype=kind))


def _numbered(table: str, rows: Sequence[tuple[Any, ...]]) -> tuple[Rows, tuple[str, ...]]:
    """Return rows as numbers, and the words that some of these count in, as they come up."""
    words, counted = dict[str, int](), _counted(table)
    numbers = np.empty(len(rows), dtype=_kind(table))
    names = (numbers.dtype.names or ()) if rows else ()
    for place, (name, column) in enumerate(zip(names, zip(*rows, strict=True), strict=True)):
        if counted.get(place) == WORDS:
            numbers[name] = [
                NONE if it is None else words.setdefault(it, len(words)) for it in column
            ]
        elif place in counted:
            numbers[name] = [NONE if it is None else it for it in column]
        else:
            numbers[name] = column
    return numbers, tuple(words)


@cache
def _kind(table: str) -> np.dtype[np.void]:
    """Return the record of a row whose words and names are numbers."""
    kinds = ("f8" if field.type == pa.float64() else "i8" for field in schema(table))
    return np.dtype(list(zip(schema(table).names, kinds, strict=True)))


@cache
def _counted(table: str) -> dict[int, int]:
    """Return the places of columns that hold words, WORDS, or no whole number in some rows."""
    found = {}
    for place, field in enumerate(schema(table)):
        if field.type == pa.string() and not _prefix(field.name):
            found[place] = WORDS
        elif field.type != pa.float64() and field.name not in never_null(table):
            found[place] = WHOLES_OR_NULL
    return found


def from_numbers(table: str, *parts: Rows, words: tuple[str, ...] = OUTCOMES) -> pa.Table:
    """Return the rows of one or two buffers side by side, of numbers, as an Arrow table.

    Vehicles have their names; in other columns of text numbers count in `words`.  NaN becomes null,
    as does NONE where there may be no name or whole number.
    """
    dtypes = tuple([part.dtype for part in parts])
    under_way = begun(table, len(parts[0]), *dtypes, words=words)
    under_way.write(*parts)
    return under_way.table()


def begun(
    table: str, rows: int, *dtypes: np.dtype[np.void], words: tuple[str, ...] = OUTCOMES
) -> TableBatch:
    """Return room for the rows of a table, to be written as :func:`from_numbers` has them."""
    described, message = _described_as(table)
    return TableBatch(described, message, _columns(table, dtypes), _spelt(words), rows)


@cache
def _described_as(table: str) -> tuple[pa.Schema, BatchMessage]:
    return schema(table), message_of(schema(table))


@lru_cache(maxsize=8)
def _spelt(words: tuple[str, ...]) -> Words:
    return words_of(("AUV", "ASV", *words))


@cache
def _columns(table: str, parts: tuple[np.dtype[np.void], ...]) -> Rows:
    """Return where the columns of a table are in the records of its parts (:data:`COLUMN`)."""
    columns = np.empty(len(schema(table)), dtype=COLUMN)
    for column, field in zip(columns, schema(table), strict=True):
        part = next(k for k, of in enumerate(parts) if field.name in (of.names or ()))
        found = parts[part].fields
        assert found is not None  # as it has names
        column["part"], column["place"] = part, found[field.name][1] // WORD
        prefix = _prefix(field.name)
        if field.type == pa.string():
            column["kind"] = NUMBERED if prefix else WORDS
            column["word"] = int(prefix == "ASV") if prefix else 2  # behind the prefixes
        elif field.type == pa.float64():
            column["kind"] = FLOATS
        else:
            column["kind"] = WHOLES if field.name in never_null(table) else WHOLES_OR_NULL
    return columns


def _prefix(column: str) -> str:
    """Return what the names of a column's vehicles begin with; empty where it has none."""
    return VEHICLES.get(column, "AUV" if column.endswith("_auv") else "")
