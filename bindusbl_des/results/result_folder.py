"""The folder of a run: what lies in it, and how it is written, all of it or nothing."""

import json
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from ..core.files import DRAFT, clear_killed, folder_draft
from ..core.kept_files import FOLDERS, KEPT
from .effects import Advice, as_data
from .schemas import TABLES

RECORD = "run.json"
# The key of the checksums of tables in it.
SUMS = "tables_sha256"
# The file of what would help, in folders whose mission was advised on.
ADVICE = "advice.json"

WRITTEN = {RECORD, "scenario.yaml", "data_dictionary.json", "report.html", ADVICE}
WRITTEN |= {f"{name}.parquet" for name in TABLES}

# What `plot` adds to the folder; the kinds stand here as well, since matplotlib is slow to import.
FIGURES = "figures"
KINDS = ("trajectory", "error", "fixes", "coverage", "timeline", "round", "latency")
DRAWN = {f"{kind}.{suffix}" for kind in KINDS for suffix in ("png", "svg", "pdf")}

# What `export` makes of it: one file, or a folder of them; campaigns have a table of missions
# as well.
EXPORTED = ("mcap", "ros2.mcap", "geojson", "kml")
CSV, CSV_DICTIONARY = "csv", "columns.csv"
CSV_FILES = {CSV_DICTIONARY, "missions.csv", *(f"{name}.csv" for name in TABLES)}

# Of what is not ours in a folder so much is named.
MOST_NAMED = 3


def result_draft(folder: Path, *, force: bool = False) -> AbstractContextManager[Path]:
    """Return the context in which a run's folder is filled: see `folder_draft`."""
    clear_killed(folder / CSV)  # an export within, which would be in the way
    return folder_draft(folder, objection, force=force)


def objection(folder: Path) -> str | None:
    """Return why force must not replace a folder; None for results of a run, or an empty folder."""
    if not (folder / RECORD).is_file():
        empty = folder.is_dir() and not any(folder.iterdir())
        return None if empty else "holds no results of a run, so it is not replaced"
    foreign = sorted(_foreign(folder))
    if not foreign:
        return None
    more = f" and {len(foreign) - MOST_NAMED} more" if len(foreign) > MOST_NAMED else ""
    named = ", ".join(foreign[:MOST_NAMED])
    return f"holds {named}{more}, which no run wrote, so it is not replaced"


def objection_to_csv(folder: Path) -> str | None:
    """Return why force must not replace a folder; None for an earlier export to CSV, or nothing."""
    found = list(folder.iterdir()) if folder.is_dir() else [folder]
    foreign = sorted(it.name for it in found if it.name not in CSV_FILES or not it.is_file())
    if not foreign and (not found or folder / CSV_DICTIONARY in found):
        return None
    which = f" (it holds {foreign[0]})" if folder.is_dir() and foreign else ""
    return f"is no earlier export{which}, so it is not replaced"


def _foreign(folder: Path) -> Iterator[str]:
    """Yield the names of what lies in a run's folder, but is neither its results nor made of them.

    That are also the files of `plot` and `export`, and drafts that killed processes left.
    """
    ours = {*WRITTEN, *(f"{exported_name(folder)}.{ending}" for ending in EXPORTED)}
    for path in folder.iterdir():
        if path.name == CSV and path.is_dir() and not objection_to_csv(path):
            continue
        if path.name == FIGURES and path.is_dir():
            yield from (f"{FIGURES}/{it.name}" for it in path.iterdir() if not _is(it, DRAWN))
        elif path.name in FOLDERS and path.is_dir():
            names = [f"{path.name}/{it.name}" for it in path.iterdir()]
            yield from (name for name in names if not KEPT.fullmatch(name))
        elif not _is(path, ours):
            yield path.name


def _is(path: Path, names: set[str]) -> bool:
    """Tell whether a path is a file of such a name, or a draft of one."""
    draft = path.name.startswith(".") and path.name.endswith(DRAFT)
    return path.is_file() and (draft or path.name in names)


def exported_name(folder: Path) -> str:
    """Return what `export` calls the mission of a folder, but for its ending."""
    try:
        name = json.loads((folder / RECORD).read_text(encoding="utf-8"))["scenario"]["name"]
        return exported_as(str(name))
    except (OSError, ValueError, KeyError, TypeError):
        return exported_as("")


def exported_as(name: str) -> str:
    """Return the file, but for its ending, that a mission of some name is exported to.

    >>> exported_as("two AUVs")
    'two_AUVs'
    """
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name)


def advice_text(advice: Advice) -> str:
    """Return what `advice.json` holds."""
    return json.dumps(as_data(advice), indent=2) + "\n"


def write_json(path: Path, data: Any) -> None:
    """Write a JSON file into a folder that is not there yet for others."""
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
