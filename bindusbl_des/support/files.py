"""Files: foreign ones are read with distrust, our own are written whole or not at all."""

import codecs
import errno
import hashlib
import json
import os
import re
import shutil
import socket
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, NoReturn, TypeVar

# Foreign files: only regular files are read, and only up to a size that fits into memory.


Name = TypeVar("Name", str, Path, str | Path)

# A track of a week at ten samples a second has some 300 MB.
MOST_BYTES = 512 * 1024**2


def regular(path: Name, most: int | None = MOST_BYTES) -> Name:
    """Return a path whose file can be opened and read to its end.

    A device may have no end, and a pipe may wait for a writer for ever.

    Raises:
        OSError: when it is missing, no regular file (a folder: as `open` raises it), or larger
            than `most` bytes (None: of any size).
    """
    found = os.stat(path)
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "no regular file; save it to one", str(path))
    if most is not None and found.st_size > most:
        message = f"larger than {most:,} bytes; leave in it what is needed"
        raise OSError(errno.EFBIG, message, str(path))
    return path


def unreadable(path: Name, error: PermissionError) -> str:
    """Return a message about a file or folder that the user has no permission to read."""
    return f"{path} cannot be read ({error.strerror}); ask its owner for the right to"


# JSON files, read with distrust: their size and depth are bounded, extensions of JSON refused.


# A scenario file has at most 1 MB; with all its defaults and warnings it is a few times as long.
LARGEST_FILE = 32_000_000

# The key of a file's checksum of itself.
SEAL = "sha256"


def read_json(path: Path, most: int = LARGEST_FILE) -> Any:
    """Return the data of a JSON file.

    Raises:
        OSError: when it cannot be read.
        ValueError: when it is no JSON in UTF-8 or UTF-16, too large (`most` bytes), or nested too
            deeply.
    """
    with open(regular(path, None), "rb") as file:
        raw = file.read(most + 1)
    if len(raw) > most:
        raise ValueError(f"it is larger than {most:,} bytes")
    try:
        data = json.loads(raw, parse_constant=_refused)  # with a mark of the byte order or without
        json.dumps(data, ensure_ascii=False).encode("utf-8")  # half a letter cannot be written
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except UnicodeEncodeError:
        raise ValueError("it has half a letter (a lone surrogate) in a text") from None
    return data


def _refused(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def sealed(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of a JSON file with a checksum of the rest (`sha256`) as last key."""
    data = {key: data[key] for key in data if key != SEAL}
    return {**data, SEAL: hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()}


def check_seal(data: Mapping[str, Any]) -> None:
    """Refuse data whose checksum is wrong; data without one, of earlier versions, pass.

    Raises:
        ValueError: when the checksum is wrong.
    """
    if SEAL in data and data[SEAL] != sealed(data)[SEAL]:
        raise ValueError("its own SHA-256 is another")


# Text, in any of the encodings in which programs save it.


def text_of(raw: bytes) -> str:
    """Return the text of a file in UTF-8, in UTF-16 with a byte order mark, or in Windows-1252.

    Raises:
        UnicodeDecodeError: when it is none of these.
    """
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252")


# Our own files: written whole or not at all, never through a link in a foreign folder.


# Ending of a draft, which is hidden until it takes its file's name; `clear_killed` looks for it.
DRAFT = ".draft"


@contextmanager
def draft_of(path: Path, *, replace: bool = True) -> Iterator[Path]:
    """Yield a new file beside `path` to be written; at the end it is synced and renamed to `path`.

    The draft's name is random, so no symbolic link can await it; a link at `path` itself is
    replaced, not followed.  The draft is removed if anything fails.

    Raises:
        FileExistsError: when `path` exists at the end, and is not to be replaced.
        IsADirectoryError: when it is a folder.
        FileNotFoundError: when its folder does not exist.
        OSError: when that cannot be written to, or is full.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder; name a file in it", str(path))
    if not path.parent.exists():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name[:40]}-", suffix=DRAFT, dir=path.parent)
    os.close(descriptor)
    draft = Path(name)
    try:
        yield draft
        draft.chmod(0o666 & ~_umask())
        sync(draft)
        if not replace:  # an empty file reserves the name until the draft takes it
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        os.replace(draft, path)
        sync(path.parent)
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(path)  # the error of a full disk names no file
        raise
    finally:
        draft.unlink(missing_ok=True)


def write_text(path: Path, text: str, *, replace: bool = True) -> None:
    """Write a text file in UTF-8, whole or not at all.

    Raises:
        FileExistsError: when it exists, and is not to be replaced.
        OSError: when the folder cannot be written to, or is full.
    """
    with draft_of(path, replace=replace) as draft:
        draft.write_text(text, encoding="utf-8")


def sync(path: Path) -> None:
    """Wait until the operating system has written a file or folder to its disk.

    Raises:
        OSError: when the disk is full or broken.
    """
    descriptor = os.open(path, os.O_RDONLY)
    unable = (OSError,) if path.is_dir() else ()  # some file systems do not sync folders
    try:
        with suppress(*unable):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


# Our own folders: written whole or not at all; they replace only folders of our own.
#
# A folder is filled in a workshop beside it: a hidden folder with a random name. Then an empty
# folder reserves the name, which fails where anything has it; and the full folder is renamed onto
# it, which fails where the empty one was filled meanwhile. So nothing is replaced unasked, on any
# POSIX system.


# Returns why a folder (or what has its name) must not be replaced; None if it may be.
Objection = Callable[[Path], str | None]

# In a workshop: the new folder; the earlier folder while it is moved out, and once it is replaced;
# a file with the name of the machine.
NEW, OLD, REPLACED, HOST = "new", "old", "replaced", "host"

# Errors of renaming onto a folder that is not empty.
FILLED = (errno.EEXIST, errno.ENOTEMPTY)


class FolderTaken(FileExistsError):
    """A folder's name is taken; the message says why, and the new folder's name, if it has one."""


@contextmanager
def folder_draft(folder: Path, objection: Objection, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder to be filled; at the end it is synced and renamed to `folder`.

    With `force` an earlier folder is replaced if there is no `objection`.  If the name was taken
    meanwhile, the new folder stays beside it (`folder-2`).  On an error the new folder is removed,
    and an earlier one left as it was.  Remains of killed processes are cleared first.

    Raises:
        FolderTaken: at once, when the name cannot be taken; at the end, naming the other folder.
        OSError: when it cannot be written, or the disk is full.
    """
    clear_killed(folder)
    taken = refusal(folder, objection, force=force)
    if taken:
        raise FolderTaken(f"{folder}: {taken}")
    missing = [parent for parent in folder.absolute().parents if not parent.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with _workshop(folder) as workshop:
            new = workshop / NEW
            new.mkdir()
            yield new
            for path in (*new.rglob("*"), new):
                sync(path)
            place, why = _place(workshop, folder, objection, force=force)
    finally:
        for parent in missing:  # the innermost first; those that are not empty stay
            with suppress(OSError):
                parent.rmdir()
    if place != folder:
        raise FolderTaken(f"{folder}: {why}; what was to be written there is in {place}")


def refusal(folder: Path, objection: Objection, *, force: bool) -> str | None:
    """Return why a folder's name cannot be taken; None if it can.

    Raises:
        OSError: when no folder can have that name, or its status cannot be read.
    """
    if folder.name in ("", ".."):
        return "exists and has no name of its own; name another folder"
    try:
        mode = os.lstat(folder).st_mode
        objected = objection(folder) if force else None
    except FileNotFoundError:  # or removed meanwhile
        return None
    except NotADirectoryError:
        above = next(parent for parent in folder.absolute().parents if parent.exists())
        return f"cannot be made, since {above} is a file; name another folder"
    if not force:
        return "exists; use --force (in Python force=True) to replace it, or name another folder"
    if stat.S_ISLNK(mode):
        return "is a link, so it is not replaced; name the folder itself"
    return objected


def clear_killed(folder: Path) -> list[Path]:
    """Clear workshops of `folder` left by killed processes; return those that may be in use.

    The operating system frees the lock of a killed process, but a lock of another machine is not
    visible on every file system.  An earlier folder that was being moved out is put back.
    """
    ours = re.compile(rf"{re.escape(_prefix(folder))}[a-z0-9_]{{8}}{re.escape(DRAFT)}")
    try:
        found = sorted(folder.parent.iterdir())
    except OSError:  # missing, or not to be listed; writing to it will tell
        return []
    left = [
        path
        for path in found
        if ours.fullmatch(path.name) and path.is_dir() and not path.is_symlink()
    ]
    return [path for path in left if not _cleared_if_dead(path, folder)]


def _prefix(folder: Path) -> str:
    return f".{folder.name[:40]}-"


@contextmanager
def _workshop(folder: Path) -> Iterator[Path]:
    """Yield a new locked workshop for `folder`; remove it at the end."""
    made = tempfile.mkdtemp(prefix=_prefix(folder), suffix=DRAFT, dir=folder.parent)
    path = Path(made)
    try:
        lock = os.open(path, os.O_RDONLY)
        try:
            with suppress(
                OSError
            ):  # file systems without locks: a killed process leaves its workshop
                _lock(lock)
                (path / HOST).write_text(socket.gethostname())
            yield path
        finally:
            os.close(lock)
    finally:
        _clear(path, folder)


def _place(
    workshop: Path, folder: Path, objection: Objection, *, force: bool
) -> tuple[Path, str | None]:
    """Rename the new folder to `folder`, or beside it; return its path, and why it is another."""
    why = None
    if force:
        with suppress(FileNotFoundError):  # another process moved it aside just now
            why = _moved_aside(folder, workshop / OLD, objection)
    place = _settle(workshop / NEW, folder)
    if (workshop / OLD).exists():  # replaced: it must not be put back
        os.rename(workshop / OLD, workshop / REPLACED)
    sync(folder.parent)
    return place, why or "came to exist meanwhile"


def _moved_aside(folder: Path, old: Path, objection: Objection) -> str | None:
    """Move an earlier folder into the workshop, or return why it stays."""
    why = refusal(folder, objection, force=True)
    if why or not os.path.lexists(folder):
        return why
    os.rename(folder, old)
    why = objection(old)  # to files that were added until it was moved
    if why:
        _settle(old, folder)
    return why


def _settle(source: Path, folder: Path) -> Path:
    """Rename a folder to the first free name of `folder`, `folder-2`, ...; return its path."""
    for number in count(1):
        place = folder if number == 1 else folder.with_name(f"{folder.name[:200]}-{number}")
        try:
            place.mkdir()
        except FileExistsError:
            continue
        try:
            os.rename(source, place)
            break
        except BaseException as error:
            with suppress(OSError):
                place.rmdir()
            if not isinstance(error, OSError) or error.errno not in FILLED:
                raise
    return place


def _clear(workshop: Path, folder: Path) -> None:
    """Remove a workshop; put an earlier folder in it back if its name is still free."""
    if (workshop / OLD).exists() and not os.path.lexists(folder):
        _settle(workshop / OLD, folder)
    shutil.rmtree(workshop, ignore_errors=True)


def _cleared_if_dead(workshop: Path, folder: Path) -> bool:
    """Clear the workshop (a hidden draft folder) of an ended process; return False if unknown."""
    try:
        if (workshop / HOST).read_text() != socket.gethostname():
            return False
        lock = os.open(workshop, os.O_RDONLY)
    except (OSError, ValueError):
        return False
    try:
        _lock(lock)
        _clear(workshop, folder)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(lock)
    return True


def _lock(descriptor: int) -> None:
    """Lock a folder; the operating system frees the lock when the process ends.

    Raises:
        BlockingIOError: when another process has the lock.
        OSError: when the file system has no locks.
    """
    import fcntl  # of POSIX alone; reading results works everywhere

    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
