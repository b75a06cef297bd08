"""Parts put together in the order of the plan, read forward: some thousand rows are in memory.

Shards of a campaign joined in a new folder.
"""

import json
import shutil
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ...core.files import FolderTaken, folder_draft
from ...core.kept_files import keep, portable
from ...results.columns import arrow
from ..campaign import Campaign, load_campaign
from ..failures import check_files, check_name
from .done import mission_numbers
from .folder import CampaignError, is_locked, write_record, write_scenario
from .part_rows import done_of, in_order, part_pieces, part_schema
from .parts import MISSIONS, TABLES, PartWriter, clean_parts, committed, part_path, part_record

# So many rows are written together, whatever parts they come from: equal campaigns, equal files.
ROWS_IN_GROUP = 10_000

# What a joined table keeps of the metadata of its parts: which table it is.
SCHEMA = b"bindusbl.schema"

Source = tuple[Path, str]
Numbers = NDArray[np.int64]


def compact(folder: Path, *, leave_out: Iterable[int] = ()) -> None:
    """Replace the parts of a campaign by one, sorted; equal campaigns get equal tables.

    Raises:
        OSError: when it cannot be written; the parts are then as before.
    """
    parts = committed(folder)
    whole = [name for name in parts if name.startswith("all-")]
    number = 1 + max((int(name.removeprefix("all-")) for name in whole), default=0)
    left_out = set(leave_out)
    if parts != whole or left_out:
        _join([(folder, part) for part in parts], folder, f"all-{number:04d}", left_out, parts)
        clean_parts(folder)


def merge_parts(folders: Sequence[Path], out: Path) -> None:
    """Write the missions of several folders as one part of another, each mission once."""
    sources = [(folder, part) for folder in folders for part in committed(folder)]
    _join(sources, out, "all-0001", set(), [])


def _join(
    sources: Sequence[Source], out: Path, part: str, leave_out: set[int], replaces: Sequence[str]
) -> None:
    if not sources:
        return
    taken = _taken(sources, leave_out)
    writer = PartWriter(out, part, part_record(*sources[0]).plan_sha256, replaces)
    for table in TABLES:
        _join_table(table, sources, taken, writer)


def _taken(sources: Sequence[Source], leave_out: set[int]) -> dict[Source, Numbers]:
    """Return which missions are taken from which part: each from the first that has it."""
    each = [done_of(*source).numbers for source in sources]
    numbers, first = np.unique(np.concatenate(each), return_index=True)
    of = np.repeat(np.arange(len(each)), [len(own) for own in each])[first]
    kept = ~np.isin(numbers, sorted(leave_out))
    numbers, of = numbers[kept], of[kept]
    order = np.argsort(of, kind="stable")
    shares = np.split(numbers[order], np.searchsorted(of[order], np.arange(1, len(each))))
    return {source: share for source, share in zip(sources, shares, strict=True) if len(share)}


def _at(source: Source, table: str) -> tuple[Path, str, str]:
    return source[0], table, source[1]


def _join_table(
    table: str, sources: Sequence[Source], taken: Mapping[Source, Numbers], writer: PartWriter
) -> None:
    """Write a table of the joined part, if any of the parts has it."""
    first = next((s for s in sources if part_path(*_at(s, table)).exists()), None)
    if first is None:
        return
    kind = part_schema(*_at(first, table))
    kind = kind.with_metadata({SCHEMA: (kind.metadata or {}).get(SCHEMA, b"")})
    with writer.file(table) as file, pq.ParquetWriter(file, kind, compression="zstd") as rows_of:
        is_empty = True
        for rows in _grouped(_pieces(table, taken)):
            rows_of.write_table(rows.cast(kind), row_group_size=ROWS_IN_GROUP)
            if table == MISSIONS:
                writer.count(rows)
            is_empty = False
        if is_empty:  # pyarrow 18 reads no file without a group of rows
            rows_of.write_table(kind.empty_table())


def _grouped(pieces: Iterable[pa.Table]) -> Iterator[pa.Table]:
    """Yield pieces put together and cut to groups of equal length."""
    waiting: list[pa.Table] = []
    count = 0
    for rows in pieces:
        waiting.append(rows)
        count += len(rows)
        while count >= ROWS_IN_GROUP:
            together = pa.concat_tables(waiting)
            yield together.slice(0, ROWS_IN_GROUP)
            waiting, count = [together.slice(ROWS_IN_GROUP)], count - ROWS_IN_GROUP
    if count:
        yield pa.concat_tables(waiting)


def _pieces(table: str, taken: Mapping[Source, Numbers]) -> Iterator[pa.Table]:
    """Yield the rows of the missions in their order, each from the part that it is taken from.

    Of all parts that are open, that one goes on whose rows in memory end first; a part is opened
    when its first mission is reached, so that parts that follow one another are not held together.
    """
    closed = deque(sorted(taken, key=lambda source: taken[source][0]))
    parts: list[_Forward] = []
    while parts or closed:
        while closed and (not parts or taken[closed[0]][0] <= min(part.last for part in parts)):
            source = closed.popleft()
            part = _Forward(_at(source, table), taken[source])
            if part.rest:
                parts.append(part)
        if parts:
            last = min(part.last for part in parts)
            rows = [piece for part in parts for piece in part.until(last)]
            yield in_order(pa.concat_tables(rows))
        parts = [part for part in parts if part.rest]


class _Forward:
    """The rows of missions that are taken from a part of a table, from the first to the last.

    `rest` is what has not been yielded of the piece in memory; None when all has been.
    """

    def __init__(self, at: tuple[Path, str, str], taken: Numbers) -> None:
        self._pieces = part_pieces(*at)
        self._taken = taken
        self.rest = next(self._pieces, None)

    @property
    def last(self) -> int:
        """Return the number of the last mission of the piece in memory."""
        return int(mission_numbers(self.rest)[-1])

    def until(self, last: int) -> Iterator[pa.Table]:
        """Yield the rows that have not been yielded yet, of missions up to a number."""
        while self.rest is not None:
            numbers = mission_numbers(self.rest)
            cut = int(np.searchsorted(numbers, last, side="right"))
            is_taken = np.isin(numbers[:cut], self._taken)
            yield self.rest.slice(0, cut).filter(arrow(is_taken, pa.bool_()))
            if cut < len(numbers):
                self.rest = self.rest.slice(cut)
                return
            self.rest = next(self._pieces, None)


def merge(folders: Sequence[str | Path], out: str | Path) -> Campaign:
    """Join the shards of one campaign in a new folder.

    Raises:
        CampaignError: when they belong to different campaigns, or the folder is not new; if it
            came to exist meanwhile, they are joined in one beside it, which the message names.
        OSError: when it cannot be written; nothing of it is left then.
    """
    campaigns = [load_campaign(folder) for folder in folders]
    first, folder = campaigns[0], Path(out)
    for other in campaigns[1:]:
        if other.record["plan_sha256"] != first.record["plan_sha256"]:
            raise CampaignError(
                f"{other.folder} is not of the same campaign as {first.folder}: "
                f"{_difference(first.record, other.record)}"
            )
    for campaign in campaigns:
        check_files(campaign)
        if is_locked(campaign.folder):
            raise CampaignError(f"{campaign.folder}: is still running; merge it when it has ended")
    check_name(folder)
    if folder.exists() or folder.is_symlink():
        raise CampaignError(f"{folder}: exists; name another folder")
    try:
        with folder_draft(folder, lambda _: "exists") as draft:
            merged = _joined(campaigns, draft)
    except FolderTaken as error:  # meanwhile
        raise CampaignError(str(error)) from None
    return Campaign(folder, merged.plan, merged.record)


def _joined(campaigns: Sequence[Campaign], folder: Path) -> Campaign:
    """Write the missions of several shards into a folder that is there and empty."""
    first = campaigns[0]
    keep(first.plan.files, folder)
    merge_parts([campaign.folder for campaign in campaigns], folder)
    for campaign in campaigns:
        if (campaign.folder / "failures").is_dir():
            shutil.copytree(campaign.folder / "failures", folder / "failures", dirs_exist_ok=True)
    write_scenario(folder, portable(first.plan.experiment.given))
    record = {**first.record, "shard": None}
    merged = Campaign(folder, first.plan, record)
    record["session"] = {"began_at": time.time(), "rows_before": len(merged.done())}
    record["status"] = "interrupted" if len(merged.missing()) else "complete"
    write_record(folder, record)
    return merged


def _difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Return the first thing in which two campaigns differ."""
    for part in {**one["own_parts"], **other["own_parts"]}:
        if one["own_parts"].get(part) != other["own_parts"].get(part):
            return f"the source of {part} is another"
    for name in ("model_version", "name", "missions"):
        if one[name] != other[name]:
            return f"{name} is {other[name]}, not {one[name]}"
    for name in one["experiment"]:
        if one["experiment"][name] != other["experiment"][name]:
            return f"{name} differ: {_short(other, name)}, not {_short(one, name)}"
    return "their plans differ"


def _short(record: Mapping[str, Any], name: str) -> str:
    text = json.dumps(record["experiment"][name])
    return text if len(text) <= 80 else f"{text[:77]}..."
