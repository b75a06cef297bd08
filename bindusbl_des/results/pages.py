"""Pages of a Parquet file: what they would unpack to, by the headers that unpackers believe.

A chunk of a column is a row of pages, each a header and then its bytes, compressed.  The header is
a struct of Thrift's compact protocol; its first fields are kind, size unpacked and size.

Source: Apache Parquet format 2.10, parquet.thrift (PageHeader); Apache Thrift, compact protocol.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

# How our files are packed; it makes no less of bytes: four of them stand for a block of 128 KiB.
CODEC, SMALLEST_SHARE = "ZSTD", 1 << 15

# Headers are at most so long (bytes), with the least and the largest value of their page.
LONGEST_HEADER = 1 << 16

UNPACKED, PACKED = 2, 3
BYTE, SMALLEST_INT, LARGEST_INT, DOUBLE, BINARY, LIST, SET, STRUCT = 3, 4, 6, 7, 8, 9, 10, 12


class Thrift:
    """A struct that is read field by field."""

    def __init__(self, text: bytes) -> None:
        self.text, self.place = text, 0

    def fields(self) -> dict[int, int]:
        """Read a struct; return those of its fields that are whole numbers, by their number.

        Raises:
            IndexError: when it goes on behind the end.
            ValueError: when it is none.
        """
        found, number = {}, 0
        while head := self._byte():
            step, kind = head >> 4, head & 15
            number = number + step if step else self._whole()
            value = self._value(kind)
            if SMALLEST_INT <= kind <= LARGEST_INT:
                found[number] = value
        return found

    def _byte(self) -> int:
        self.place += 1
        return self.text[self.place - 1]

    def _unsigned(self) -> int:
        byte = self._byte()
        value, shift = byte & 127, 7
        while byte > 127:
            byte = self._byte()
            value |= (byte & 127) << shift
            shift += 7
        return value

    def _whole(self) -> int:
        value = self._unsigned()
        return (value >> 1) ^ -(value & 1)

    def _value(self, kind: int) -> int:
        """Read a value of a kind; whole numbers are returned."""
        if SMALLEST_INT <= kind <= LARGEST_INT:
            return self._whole()
        if kind == STRUCT:
            self.fields()
        elif kind in (BYTE, DOUBLE):
            self.place += 1 if kind == BYTE else 8
        elif kind == BINARY:
            length = self._unsigned()
            self.place += length
        elif kind in (LIST, SET):
            head = self._byte()
            for _ in range(head >> 4 if head < 0xF0 else self._unsigned()):
                self._value(head & 15)
        elif kind not in (1, 2):  # true and false, which are in the kind
            raise ValueError(f"{kind} is no kind of Thrift's")
        return 0


def lying_chunk(path: Path, chunks: Sequence[Any], harmless: int) -> str:
    """Return which column has pages that unpack to more than its chunk says; empty if none has.

    `chunks` are those of the file's footer.  Those that cannot be more than `harmless` (bytes) are
    not looked at.

    Raises:
        OSError: when the file cannot be read.
    """
    with open(path, "rb") as file:
        for chunk in chunks:
            most = chunk.total_compressed_size * SMALLEST_SHARE
            is_small = most <= harmless and chunk.compression == CODEC
            if not is_small and _unpacked(file, chunk) > chunk.total_uncompressed_size:
                return str(chunk.path_in_schema)
    return ""


def _unpacked(file: BinaryIO, chunk: Any) -> float:
    """Return what the pages of a chunk unpack to (bytes); infinite if they are none."""
    place = chunk.dictionary_page_offset or chunk.data_page_offset
    end, unpacked = place + chunk.total_compressed_size, 0
    while place < end:
        file.seek(place)
        header = Thrift(file.read(LONGEST_HEADER))
        try:
            fields = header.fields()
        except (IndexError, ValueError, RecursionError):
            return float("inf")
        if min(fields.get(UNPACKED, -1), fields.get(PACKED, -1)) < 0:
            return float("inf")
        place += header.place + fields[PACKED]
        unpacked += header.place + fields[UNPACKED]
    return unpacked
