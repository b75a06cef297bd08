"""Files that are there whole or not at all, and that follow no link of a stranger's folder."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

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
