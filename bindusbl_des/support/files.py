"""Files: those of strangers read with distrust, ours written whole or not at all."""

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

# Files of strangers are read only where they are files, of a size that can be held.


Name = TypeVar("Name", str, Path, str | Path)

# A track of a week at ten samples a second has some 300 MB.
MOST_BYTES = 512 * 1024**2


def regular(path: Name, most: int | None = MOST_BYTES) -> Name:
    """Return a path whose file can be opened and read to its end.

    A device or a pipe has none, or waits for somebody to write.

    Raises:
        OSError: when it is missing, no regular file (a folder: as `open` tells it), or larger than
            so many bytes (None: of any size).
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
    """Return what to tell of a file or folder that the user may not read."""
    return f"{path} cannot be read ({error.strerror}); ask its owner for the right to"


# JSON files read with distrust: of bounded size and depth, and with nothing that is no JSON.


# A scenario file has at most 1 MB; spelt out, with all its defaults and warnings, some times that.
LARGEST_FILE = 32_000_000

# The key of a file's own checksum.
SEAL = "sha256"


def read_json(path: Path, most: int = LARGEST_FILE) -> Any:
    """Return what a JSON file holds.

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
    """Return what a JSON file shall hold, with the checksum of all of it (`sha256`) at its end."""
    data = {key: data[key] for key in data if key != SEAL}
    return {**data, SEAL: hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()}


def check_seal(data: Mapping[str, Any]) -> None:
    """Refuse what does not have its own checksum; files of earlier versions have none.

    Raises:
        ValueError: when it has another.
    """
    if SEAL in data and data[SEAL] != sealed(data)[SEAL]:
        raise ValueError("its own SHA-256 is another")


# Text, in whichever of the encodings that programs save it in.


def text_of(raw: bytes) -> str:
    """Return the text of a file: UTF-8 or UTF-16 with a mark, UTF-8 without, or else Windows-1252.

    Raises:
        UnicodeDecodeError: when it is none of these.
    """
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252")


# Files that are there whole or not at all, and that follow no link of a stranger's folder.


# What a draft is called until it takes its file's name: hidden, and known to whoever clears up.
DRAFT = ".draft"


@contextmanager
def draft_of(path: Path, *, replace: bool = True) -> Iterator[Path]:
    """Yield a new file beside `path` to be written; at the end it is synced and takes its name.

    The draft has a name that nobody can foretell, so that no symbolic link awaits it; a link at
    `path` itself is replaced, not followed.  Whatever goes wrong, no draft stays.

    Raises:
        FileExistsError: when `path` is there at the end, and not to be replaced.
        IsADirectoryError: when it is a folder.
        FileNotFoundError: when the folder that it lies in is not there.
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
        if not replace:  # an empty file of our own keeps the name free until the draft has it
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        os.replace(draft, path)
        sync(path.parent)
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(path)  # a disk that is full does not say of what
        raise
    finally:
        draft.unlink(missing_ok=True)


def write_text(path: Path, text: str, *, replace: bool = True) -> None:
    """Write a text file in UTF-8, all of it or nothing.

    Raises:
        FileExistsError: when it is there, and not to be replaced.
        OSError: when the folder cannot be written to, or is full.
    """
    with draft_of(path, replace=replace) as draft:
        draft.write_text(text, encoding="utf-8")


def sync(path: Path) -> None:
    """Have the operating system put a file or folder on its disk before going on.

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


# Folders that are there whole or not at all, and that replace nothing but what is ours.
#
# A folder is filled in a workshop beside its name: a hidden folder that nobody can foretell. Its
# name is taken by making an empty folder, which fails where anything is, and by renaming the full
# one onto it, which fails where something has come into it: so nothing is ever replaced unasked,
# on any POSIX system.


# Tells why a folder (or what stands in its place) is not ours to replace; None if it is.
Objection = Callable[[Path], str | None]

# In a workshop: the new folder, the earlier one on its way out, and later when it is replaced; the
# machine that works there.
NEW, OLD, REPLACED, HOST = "new", "old", "replaced", "host"

# What renaming onto a folder that is not empty ends with.
FILLED = (errno.EEXIST, errno.ENOTEMPTY)


class FolderTaken(FileExistsError):
    """A folder's name is taken; the message says by what, and where the new one is, if any."""


@contextmanager
def folder_draft(folder: Path, objection: Objection, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder to be filled; at the end it is synced and takes the name `folder`.

    By force an earlier folder gives way if there is no `objection` to that.  If the name was taken
    meanwhile, the new folder is kept beside it (`folder-2`).  Whatever goes wrong before, nothing
    of it stays, and an earlier folder is as it was.  What killed processes left goes first.

    Raises:
        FolderTaken: at once, when the name cannot be taken; at the end, naming where it went.
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
        for parent in missing:  # the innermost first; those that hold something stay
            with suppress(OSError):
                parent.rmdir()
    if place != folder:
        raise FolderTaken(f"{folder}: {why}; what was to be written there is in {place}")


def refusal(folder: Path, objection: Objection, *, force: bool) -> str | None:
    """Return why a folder's name cannot be taken; None if it can.

    Raises:
        OSError: when no folder can have that name, or it cannot be looked at.
    """
    if folder.name in ("", ".."):
        return "exists and has no name of its own; name another folder"
    try:
        mode = os.lstat(folder).st_mode
        objected = objection(folder) if force else None
    except FileNotFoundError:  # or gone while it was looked at
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
    """Remove what killed processes left of `folder`; return what may be of one that still runs.

    The operating system frees the lock of a process that was killed; that of another machine
    cannot be seen on every file system.  An earlier folder that was on its way out comes back.
    """
    ours = re.compile(rf"{re.escape(_prefix(folder))}[a-z0-9_]{{8}}{re.escape(DRAFT)}")
    try:
        found = sorted(folder.parent.iterdir())
    except OSError:  # not there, or not to be listed; whether it can be written shows by itself
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
    """Yield a locked folder beside `folder`; at the end it is gone."""
    made = tempfile.mkdtemp(prefix=_prefix(folder), suffix=DRAFT, dir=folder.parent)
    path = Path(made)
    try:
        lock = os.open(path, os.O_RDONLY)
        try:
            with suppress(OSError):  # file systems without locks: nobody clears up after us
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
    """Give the new folder its name, or one beside it; return that, and why it is another."""
    why = None
    if force:
        with suppress(FileNotFoundError):  # another process moved it aside just now
            why = _moved_aside(folder, workshop / OLD, objection)
    place = _settle(workshop / NEW, folder)
    if (workshop / OLD).exists():  # replaced: it must not come back
        os.rename(workshop / OLD, workshop / REPLACED)
    sync(folder.parent)
    return place, why or "came to exist meanwhile"


def _moved_aside(folder: Path, old: Path, objection: Objection) -> str | None:
    """Move an earlier folder out of the way, or return why it stays."""
    why = refusal(folder, objection, force=True)
    if why or not os.path.lexists(folder):
        return why
    os.rename(folder, old)
    why = objection(old)  # what came into it until it was moved
    if why:
        _settle(old, folder)
    return why


def _settle(source: Path, folder: Path) -> Path:
    """Rename a folder to a name that nothing has: `folder`, `folder-2`, ...; return it."""
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
    """Remove a workshop; an earlier folder in it comes back where nothing has taken its place."""
    if (workshop / OLD).exists() and not os.path.lexists(folder):
        _settle(workshop / OLD, folder)
    shutil.rmtree(workshop, ignore_errors=True)


def _cleared_if_dead(workshop: Path, folder: Path) -> bool:
    """Clear a workshop whose process is gone; return whether it is known to be gone or to run."""
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
    """Take the operating system's lock of a folder, which it frees when the process ends.

    Raises:
        BlockingIOError: when another process has it.
        OSError: when the file system has no locks.
    """
    import fcntl  # of POSIX alone; reading results works everywhere

    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
