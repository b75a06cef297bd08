"""Files that a scenario names, identified by their contents, so that it means the same anywhere.

In memory a scenario names its files by their absolute paths.  Written or fingerprinted it names
them ``<folder>/<name>-<hash of the contents>.<ending>`` instead, such as
``tracks/auv0-0123456789abcdef.csv``; a folder of results has copies with these names.
"""

import hashlib
import os
import re
import stat
from collections.abc import Callable, Mapping
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from .files import draft_of, sync
from .plugins import is_plugin

Way = tuple[str, ...]

# A step of a key's path that stands for each item of a list
EACH = "*"

# Paths of the keys that name files, and the folders of their copies.
FILES: Mapping[Way, str] = {
    ("auvs", "route", "files"): "tracks",
    ("auvs", "groups", EACH, "route", "files"): "tracks",
    ("asvs", "formation", "files"): "tracks",
    ("survey", "area"): "charts",
    ("survey", "land"): "charts",
    ("survey", "keep_out"): "charts",
    ("environment", "ctd"): "casts",
    ("environment", "current", "file"): "currents",
    ("environment", "bathymetry"): "bottoms",
    ("environment", "bathymetry", "file"): "bottoms",
    ("environment", "wind", "file"): "winds",
    ("asvs", "vehicle", "polar"): "polars",
    ("acoustics", "hf", "channel", "file"): "curves",
    ("acoustics", "mf", "channel", "file"): "curves",
    ("acoustics", "mf", "airtimes"): "airtimes",
    ("acoustics", "hf", "channel", "rays"): "sound",
    ("acoustics", "mf", "channel", "rays"): "sound",
}
FOLDERS = frozenset(FILES.values())

# What may stand in the place of a file: polars that ship.
POLARS = ("dinghy", "swarm")

# The names of copies.
KEPT = re.compile(rf"({'|'.join(sorted(FOLDERS))})/[\w.-]{{0,60}}-[0-9a-f]{{16}}(\.\w{{1,8}})?")

# Returns a file's new name, given its name and the folder of its copy.
Change = Callable[[str, str], str]


def kept_name(file: str, folder: str) -> str:
    """Return the name of a file's copy in a folder such as `tracks`, with a hash of its contents.

    A file that cannot be read keeps its name, which may be that of a copy.
    """
    path = Path(file)
    try:
        found = [os.stat(member) for member in members(path)]
        if not all(stat.S_ISREG(each.st_mode) for each in found):
            return f"{folder}/{path.name}"
        digest = _sha256(file, *((each.st_mtime_ns, each.st_size) for each in found))[:16]
    except OSError:
        return f"{folder}/{path.name}"
    stem = re.sub(r"[^\w.-]", "_", path.stem).removesuffix(f"-{digest}")
    ending = path.suffix if re.fullmatch(r"\.\w{1,8}", path.suffix) else ""
    ending = PACKED if path.suffix.lower() == SHAPEFILE else ending
    return f"{folder}/{stem[:60]}-{digest}{ending}"


@lru_cache(maxsize=4096)
def _sha256(file: str, *_changed: tuple[int, int]) -> str:
    return hashlib.sha256(contents_of(Path(file))).hexdigest()


# A shapefile is several files; its copy is a zip archive of them, which GDAL reads as one.
SHAPEFILE, PACKED = ".shp", ".shz"
BESIDE = (".shx", ".dbf", ".prj", ".cpg")


def members(path: Path) -> list[Path]:
    """Return a file, and for a shapefile the files that belong to it."""
    if path.suffix.lower() != SHAPEFILE:
        return [path]
    cases = [(path.with_suffix(part), path.with_suffix(part.upper())) for part in BESIDE]
    return [path, *(case for both in cases for case in both if case.is_file())]


def contents_of(path: Path) -> bytes:
    """Return the contents of a file's copy.

    Raises:
        OSError: when it cannot be read.
    """
    if path.suffix.lower() != SHAPEFILE:
        return path.read_bytes()
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        for member in members(path):  # without times, so that equal contents have equal hashes
            archive.writestr(ZipInfo(f"{path.stem}{member.suffix.lower()}"), member.read_bytes())
    return packed.getvalue()


def portable(data: Any) -> Any:
    """Return the data of a scenario with its files named as their copies."""
    return renamed(data, kept_name)


def placed(data: Any, folder: str | Path) -> Any:
    """Return the data of a scenario with the names of its files made absolute, from a folder."""
    return renamed(data, lambda name, _: str((Path(folder) / name).resolve()))


def _named(data: Any) -> list[tuple[str, str]]:
    """Return the files that the data of a scenario name, each with the folder of its copy."""
    found: list[tuple[str, str]] = []

    def note(name: str, folder: str) -> str:
        found.append((name, folder))
        return name

    renamed(data, note)
    return found


def named_files(data: Any) -> list[str]:
    """Return the files that the data of a scenario name, as they are written there."""
    return [name for name, _ in _named(data)]


def copies_of(data: Any) -> dict[str, str]:
    """Return the files that the data of a scenario name, by the names of their copies."""
    return {kept_name(name, folder): name for name, folder in _named(data)}


def renamed(data: Any, change: Change) -> Any:
    """Return the data of a scenario with `change` applied to the names of its files."""
    for way, folder in FILES.items():
        data = _renamed(data, change, way, folder)
    return data


def renamed_point(point: Mapping[str, Any], change: Change) -> dict[str, Any]:
    """Return dotted keys and their values with `change` applied to the names of files."""
    changed = dict(point)
    for key in point:
        for way, folder in FILES.items():
            below = _below(key, way)
            if below is not None:
                changed[key] = _renamed(changed[key], change, below, folder)
    return changed


def _renamed(data: Any, change: Change, below: Way, folder: str) -> Any:
    """Return data with `change` applied to the names of files at the path `below`."""
    if not below:
        items = data if isinstance(data, list | tuple) else [data]
        usable = [may_be_file(item) for item in items]
        names = [
            change(item, folder) if good else item for item, good in zip(items, usable, strict=True)
        ]
        return names if isinstance(data, list | tuple) else names[0]
    if below[0] == EACH and isinstance(data, list | tuple):
        return [_renamed(item, change, below[1:], folder) for item in data]
    if isinstance(data, Mapping) and below[0] in data and not is_own(data):
        return {**data, below[0]: _renamed(data[below[0]], change, below[1:], folder)}
    return data


def may_be_file(given: Any) -> bool:
    """Return whether what stands in the place of a file names one."""
    return isinstance(given, str) and "\0" not in given and given not in POLARS


def is_own(part: Mapping[str, Any]) -> bool:
    """Return whether data choose a user-defined part, whose settings may have any meaning."""
    model = part.get("model")
    return isinstance(model, str) and is_plugin(model)


def names_files(key: str) -> bool:
    """Return whether a dotted key, or a key below it, names files.

    >>> [names_files(key) for key in ("auvs.route", "auvs.route.files.0", "auvs.count")]
    [True, True, False]
    """
    return any(_below(key, way) is not None for way in FILES)


@lru_cache(maxsize=1024)
def _below(key: str, way: Way) -> Way | None:
    """Return the rest of a key's path `way` below a dotted key; None where the key is not on it."""
    parts = key.split(".")
    pairs = zip(parts, way, strict=False)
    is_on = all(part == step or (step == EACH and part.isdigit()) for part, step in pairs)
    return way[len(parts) :] if is_on else None


def keep(copies: Mapping[str, str], folder: Path) -> None:
    """Copy files into a folder; `copies` has the files by the names of their copies.

    Raises:
        ValueError: when a file is changed meanwhile.
        OSError: when one cannot be read or written.
    """
    for name, file in copies.items():
        contents = contents_of(Path(file))
        if hashlib.sha256(contents).hexdigest()[:16] not in name:
            raise ValueError(f"{file}: was changed while it was copied; run it again")
        (folder / name).parent.mkdir(exist_ok=True)
        with draft_of(folder / name) as draft:
            draft.write_bytes(contents)
        sync(folder)


def check_kept(names: list[str], folder: Path) -> None:
    """Refuse copies in a folder whose contents do not match the hashes in their names.

    Raises:
        ValueError: naming the file.
    """
    for name in names:
        file = folder / name
        if not file.is_file():
            raise ValueError(f"{file}: is missing; put the file back as it was")
        if kept_name(str(file), Path(name).parent.name) != name:
            raise ValueError(f"{file}: has been changed since; put the file back as it was")
