"""Traced tables kept on disk, each under the hash of all that it was made of."""

import hashlib
import json
import os
import sys
import zipfile
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from ...core.durable import draft_of
from ...sea.profile import Profile
from .table import Grid, SoundTable
from .tracing import MISSING, ONE_ARRIVAL_S, SILENT_DB, case_of, traced

# What tables mean: another number makes all that were kept be traced anew.
FORM = 1


def kept_table(profile: Profile, grid: Grid, bottom_m: float) -> SoundTable:
    """Return the table that :func:`.tracing.traced` makes, from disk if it was made before.

    What cannot be kept is traced each time; what was damaged on disk is traced anew.  Errors are
    those of :func:`.tracing.traced`.
    """
    path = cache_folder() / f"{_made_of(profile, grid, bottom_m)}.npz"
    with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            longer, beyond = kept["longer_s"], kept["beyond_db"]
        if longer.shape == beyond.shape == tuple(map(len, grid)):
            return SoundTable(profile, grid, longer, beyond)
    table = traced(profile, grid, bottom_m)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(path) as draft, draft.open("wb") as new:
            np.savez_compressed(new, longer_s=table.longer_s, beyond_db=table.beyond_db)
    return table


def cache_folder() -> Path:
    """Return the folder of the user's cache in which tables are kept."""
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "bindusbl-des" / "sound"


def _made_of(profile: Profile, grid: Grid, bottom_m: float) -> str:
    try:
        tracer = version("pelagic")
    except PackageNotFoundError:
        raise ImportError(MISSING) from None
    made_of = [FORM, tracer, ONE_ARRIVAL_S, SILENT_DB, case_of(profile, grid, bottom_m)]
    return hashlib.sha256(json.dumps(made_of).encode()).hexdigest()[:32]
