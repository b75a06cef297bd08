"""The files of plug-ins: found, not run, so that missions of two versions are not mixed."""

import hashlib
from importlib.machinery import PathFinder
from pathlib import Path

from .plugins import is_plugin


def source_sha256(name: str) -> str:
    """Return the fingerprint of the file that holds a ``module:object``, "" where none is found."""
    file = source_of(name)
    return hashlib.sha256(file.read_bytes()).hexdigest() if file else ""


def source_of(name: str) -> Path | None:
    """Return the file that holds a ``module:object``, None where none is found.

    Nothing is imported, nor are the packages that a module is in.
    """
    places, spec = None, None
    words = name.partition(":")[0].split(".") if is_plugin(name) else []
    for number in range(1, len(words) + 1):
        spec = PathFinder.find_spec(".".join(words[:number]), places)
        if spec is None:
            return None
        places = spec.submodule_search_locations
    file = Path(spec.origin) if spec and spec.origin else None
    return file if file and file.is_file() else None
