"""Pages of Parquet files: what they unpack to is read from their headers, not from the footer."""

from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bindusbl_des.results.pages import lying_chunk

Claims = dict[tuple[int, int], int]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a file of two row groups, with dictionaries, nulls, and several pages a column."""
    draw, rows = np.random.default_rng(1), 5000
    words = pa.array(draw.choice(["AUV1", "ASV12", None], rows).tolist())
    gaps = pa.array([None if it < 0 else it for it in draw.normal(size=rows).tolist()])
    table = pa.table({"words": words, "numbers": draw.normal(size=rows), "gaps": gaps})
    pq.write_table(
        table, tmp_path / "x.parquet", compression="zstd", row_group_size=3000,
        data_page_size=4096, use_dictionary=["words"], write_page_checksum=True,
    )  # fmt: skip
    return tmp_path / "x.parquet"


def chunks(footer: pq.FileMetaData, claims: Claims | None = None) -> list[Any]:
    """Return the chunks of a footer, some of other sizes, by row group and column."""

    def chunk(group: int, number: int) -> Any:
        real = footer.row_group(group).column(number)
        return SimpleNamespace(
            path_in_schema=real.path_in_schema,
            compression=real.compression,
            total_compressed_size=real.total_compressed_size,
            total_uncompressed_size=(claims or {}).get(
                (group, number), real.total_uncompressed_size
            ),
            dictionary_page_offset=real.dictionary_page_offset,
            data_page_offset=real.data_page_offset,
        )

    places = product(range(footer.num_row_groups), range(footer.num_columns))
    return [chunk(group, number) for group, number in places]


def test_sizes_of_all_pages_add_up_to_what_a_true_footer_says(file: Path) -> None:
    """To the byte: one less of any chunk is a lie, one more is none."""
    footer = pq.read_metadata(file)
    assert lying_chunk(file, chunks(footer), 0) == ""
    for group in range(2):
        for number, name in enumerate(("words", "numbers", "gaps")):
            true = footer.row_group(group).column(number).total_uncompressed_size
            assert lying_chunk(file, chunks(footer, {(group, number): true - 1}), 0) == name
            assert lying_chunk(file, chunks(footer, {(group, number): true + 1}), 0) == ""


def test_what_cannot_be_large_is_not_looked_at(file: Path) -> None:
    """A chunk of a few kilobytes unpacks to no more than some hundred megabytes, whoever lies."""
    lie = chunks(pq.read_metadata(file), {(0, 1): 0})
    assert lying_chunk(file, lie, 10**10) == ""
    assert lying_chunk(file, lie, 10**6) == "numbers"


@pytest.mark.parametrize("garbage", [b"", b"\xff" * 50, b"\x1c" * 100_000, b"\x15\x00\x00"])
def test_headers_that_are_none_are_no_pages(file: Path, garbage: bytes) -> None:
    """A file that ends, numbers without end, structs in structs, and a header without sizes."""
    footer, text = pq.read_metadata(file), file.read_bytes()
    begin = footer.row_group(0).column(1).data_page_offset
    file.write_bytes(text[:begin] + garbage + text[begin + len(garbage) :] * bool(garbage))
    assert lying_chunk(file, chunks(footer), 0) == "numbers"
