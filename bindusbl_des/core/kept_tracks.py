"""Track files named by what is in them, so that a scenario means the same in every folder.

In memory a scenario names its track files by their absolute paths.  Whatever is written or
fingerprinted names them ``tracks/<name>-<hash of the contents>.csv`` instead, and a folder of
results takes along copies of that name.
"""

import hashlib
import os
import re
import stat
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from .durable import draft_of, sync

FOLDER = "tracks"

# Where a scenario names its track files, and what names that hold a hash look like.
FILES = ("auvs", "route", "files")
KEPT = re.compile(rf"{FOLDER}/[\w.-]{{0,60}}-[0-9a-f]{{16}}\.csv")


def kept_name(file: str) -> str:
    """Return the name of a track file's copy, which tells its contents.

    A file that cannot be read keeps its own name, which is that of a copy if it is one.
    """
    path = Path(file)
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            return f"{FOLDER}/{path.name}"
        told = _sha256(file, found.st_mtime_ns, found.st_size)[:16]
    except OSError:
        return f"{FOLDER}/{path.name}"
    stem = re.sub(r"[^\w.-]", "_", path.stem).removesuffix(f"-{told}")
    return f"{FOLDER}/{stem[:60]}-{told}.csv"


@lru_cache(maxsize=4096)
def _sha256(file: str, _changed_at: int, _size: int) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def portable(data: Any) -> Any:
    """Return the data of a scenario, its track files named by their contents."""
    return renamed(data, kept_name)


def placed(data: Any, folder: str | Path) -> Any:
    """Return the data of a scenario, the names of its track files made absolute in a folder."""
    return renamed(data, lambda name: str((Path(folder) / name).resolve()))


def renamed(data: Any, change: Callable[[str], str], below: tuple[str, ...] = FILES) -> Any:
    """Return data in which track files have other names; `below` is the way to them."""
    if not below:
        items = data if isinstance(data, list | tuple) else [data]
        names = [change(it) if isinstance(it, str) and "\0" not in it else it for it in items]
        return names if isinstance(data, list | tuple) else names[0]
    if isinstance(data, Mapping) and below[0] in data:
        return {**data, below[0]: renamed(data[below[0]], change, below[1:])}
    return data


def renamed_point(point: Mapping[str, Any], change: Callable[[str], str]) -> dict[str, Any]:
    """Return dotted keys and their values, in which track files have other names."""
    return {
        key: value if (below := _below(key)) is None else renamed(value, change, below)
        for key, value in point.items()
    }


def names_tracks(key: str) -> bool:
    """Tell whether a dotted key holds, or may hold, names of track files.

    >>> [names_tracks(key) for key in ("auvs.route", "auvs.route.files.0", "auvs.count")]
    [True, True, False]
    """
    return _below(key) is not None


@lru_cache(maxsize=256)
def _below(key: str) -> tuple[str, ...] | None:
    """Return the way from what a dotted key holds to track files, None where it leads to none."""
    parts = tuple(key.split("."))
    return FILES[len(parts) :] if parts[: len(FILES)] == FILES[: len(parts)] else None


def keep(files: Iterable[str], folder: Path) -> None:
    """Copy track files into the folder `tracks` of a folder, each under the name of its contents.

    Raises:
        ValueError: when a file is changed meanwhile.
        OSError: when one cannot be read or written.
    """
    for name, file in {kept_name(file): file for file in files}.items():
        contents = Path(file).read_bytes()
        if hashlib.sha256(contents).hexdigest()[:16] not in name:
            raise ValueError(f"{file}: was changed while it was copied; run it again")
        (folder / FOLDER).mkdir(exist_ok=True)
        with draft_of(folder / name) as draft:
            draft.write_bytes(contents)
        sync(folder)


def check_kept(names: Iterable[str], folder: Path) -> None:
    """Refuse copies in a folder that are no longer what their names say.

    Raises:
        ValueError: naming the file.
    """
    for name in names:
        file = folder / name
        if not file.is_file():
            raise ValueError(f"{file}: is missing; put the track file back as it was")
        if kept_name(str(file)) != name:
            raise ValueError(f"{file}: has been changed since; put the track file back as it was")
