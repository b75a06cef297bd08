"""Files of strangers are read only where they are files, of a size that can be held."""

import errno
import os
import stat
from pathlib import Path
from typing import TypeVar

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
        told = f"larger than {most:,} bytes; leave in it what is needed"
        raise OSError(errno.EFBIG, told, str(path))
    return path
