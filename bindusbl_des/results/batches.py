"""Tables made at once: all columns in one buffer, laid out as a record batch of Arrow's IPC format.

Such a batch is a message, which says how many rows there are and where the buffers of each column
lie, and those buffers behind it.  Arrow reads the columns where they are, all in one call; columns
made one by one take it longer than a mission takes to fill them.

Source: Apache Arrow, Columnar format 1.5, sec. Serialization and interprocess communication, with
Message.fbs and Schema.fbs; FlatBuffers internals for how a message is laid out.
"""

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..core.compiled import compiled, entry
from ..records.rows import Rows

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
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

# Longest number of a vehicle in a name, in digits
DIGITS = 19

# A column: of which of the parts it is and where in each row (words), what it becomes, and the
# first of its words.
COLUMN = np.dtype([(name, "i8") for name in ("part", "place", "kind", "word")])


class Message(NamedTuple):
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


class Body(NamedTuple):
    """The buffers of a batch under way, seen as words, as ends of texts and as letters."""

    words: Ints
    ends: Ends
    letters: Bytes


def message_of(schema: pa.Schema) -> Message:
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
    return Message(np.frombuffer(head, np.int64), *(place // WORD for place in places))


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


def batch(
    schema: pa.Schema, message: Message, columns: Rows, words: Words, parts: Sequence[Rows]
) -> pa.Table:
    """Return the rows of a table: `columns` (:data:`COLUMN`) say which numbers of the `parts`, one
    or two arrays of n records side by side, become what.
    """
    first, second = parts[0], parts[-1]
    rows, kind = len(first), columns["kind"]
    texts = int(np.count_nonzero(kind >= WORDS))
    longest = words.letters.shape[1] + DIGITS
    each = rows + rows // 64 + 2, rows // 2 + (rows * longest) // WORD + 3  # of a column, words
    head = len(message.words)
    all_words = np.empty(head + len(columns) * each[0] + texts * each[1], dtype=np.int64)
    all_words[:head] = message.words
    body = all_words[head:]
    used = _lay_out(
        all_words, body, body.view(np.int32), body.view(np.uint8), message.nodes, message.buffers,
        columns, *words, rows, *_numbers(first), *_numbers(second),
    )  # fmt: skip
    all_words[message.rows], all_words[message.body] = rows, used * WORD
    found = pa.ipc.read_record_batch(pa.py_buffer(all_words[: head + used]), schema)
    return pa.Table.from_batches([found], schema=schema)


def _numbers(rows: Rows) -> tuple[Any, ...]:
    """Return records, row by row, as floats and as whole numbers, and how many each row has."""
    flat: Any = np.ascontiguousarray(rows)
    return flat.view(np.float64), flat.view(np.int64), rows.dtype.itemsize // WORD


@entry
def _lay_out(
    message: Ints, words: Ints, ends: Ends, letters: Bytes, node: int, buffer: int,
    columns: Rows, spelt: Bytes, lengths: Ints, rows: int,
    first_floats: Floats, first_wholes: Ints, first_step: int,
    second_floats: Floats, second_wholes: Ints, second_step: int,
) -> int:  # fmt: skip
    """Write the columns one behind the other and where they are; return how many words they take.

    Of each a node says how many rows it has and how many of them are null; each of its buffers says
    where it begins and how long it is (bytes).
    """
    body, known, begin = Body(words, ends, letters), Words(spelt, lengths), 0
    for column in columns:
        floats, wholes, step = first_floats, first_wholes, first_step
        if column.part > 0:
            floats, wholes, step = second_floats, second_wholes, second_step
        own_floats, own_wholes = floats[column.place :: step], wholes[column.place :: step]
        missing = _missing(column.kind, rows, own_floats, own_wholes)
        message[node], message[node + 1] = rows, missing
        message[buffer], message[buffer + 1] = begin * 8, 0
        if missing > 0:
            message[buffer + 1] = (rows + 7) // 8
            begin = _write_known(body, begin, column.kind, rows, own_floats, own_wholes)
        buffer += 2
        if column.kind < WORDS:
            message[buffer], message[buffer + 1] = begin * 8, rows * 8
            _write_numbers(words[begin:], column.kind, rows, own_floats, own_wholes)
            begin += rows
        else:
            message[buffer], message[buffer + 1] = begin * 8, (rows + 1) * 4
            text, buffer = begin + rows // 2 + 1, buffer + 2
            length = _write_texts(body, begin, text, column, known, rows, own_wholes)
            message[buffer], message[buffer + 1] = text * 8, length
            begin = text + (length + 7) // 8
        node, buffer = node + 2, buffer + 2
    return begin


@compiled
def _is_missing(kind: int, number: float, whole: int) -> bool:
    """Tell whether there is no such number, or no name for it."""
    return number != number if kind == FLOATS else kind != WHOLES and whole < 0


@compiled
def _missing(kind: int, rows: int, floats: Floats, wholes: Ints) -> int:
    count = 0
    for k in range(rows):
        count += _is_missing(kind, floats[k], wholes[k])
    return count


@compiled
def _write_known(body: Body, begin: int, kind: int, rows: int, floats: Floats, wholes: Ints) -> int:
    """Write a bit for each row, set where there is a value; return the word after them."""
    end = begin + (rows + 63) // 64
    body.words[begin:end] = 0
    for k in range(rows):
        if not _is_missing(kind, floats[k], wholes[k]):
            body.letters[8 * begin + k // 8] |= 1 << k % 8
    return end


@compiled
def _write_numbers(out: Ints, kind: int, rows: int, floats: Floats, wholes: Ints) -> None:
    """Write numbers bit for bit, 0 for those that are missing."""
    for k in range(rows):
        out[k] = 0 if _is_missing(kind, floats[k], wholes[k]) else wholes[k]


@compiled
def _write_texts(
    body: Body, begin: int, text: int, column: Any, known: Words, rows: int, wholes: Ints
) -> int:
    """Write what numbers are called, from the word `text` on, and before, from `begin` on, where
    each ends; return how many letters there are.
    """
    letters, length = body.letters[8 * text :], 0
    body.ends[2 * begin] = 0
    for k in range(rows):
        number = wholes[k]
        if number >= 0:
            word = column.word + (number if column.kind == WORDS else 0)
            for letter in range(known.lengths[word]):
                letters[length + letter] = known.letters[word, letter]
            length += known.lengths[word]
            if column.kind == NUMBERED:
                length = _write_digits(letters, length, number)
        body.ends[2 * begin + 1 + k] = length
    return length


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
