"""The folder of a campaign: its record, its lock, and where everything lies."""

import json
import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...durable import write_text

RECORD = "campaign.json"
LOCK = "campaign.lock"
STOP = "stop"
FORMAT = 1

# What every record has, and the only remedy when it is lost.
KEYS = ("name", "status", "shard", "plan_sha256", "model_version", "scenario_sha256", "experiment")
ANEW = "sweep the experiment anew into another folder"


class CampaignError(ValueError):
    """A campaign cannot be run, continued or read; the message says why and what to do."""


def read_record(folder: Path) -> dict[str, Any]:
    """Return what `campaign.json` holds.

    Raises:
        CampaignError: when the folder is no campaign's, or of another version.
    """
    path = folder / RECORD
    if not path.is_file():
        raise CampaignError(
            f"{folder} is no campaign folder (it has no {RECORD}); give the folder that "
            "`bindusbl-des sweep` wrote"
        )
    try:
        record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        found = record["format"]
        lacking = [key for key in KEYS if key not in record]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CampaignError(
            f"{path} is damaged ({type(error).__name__}: {error}); {ANEW}"
        ) from None
    if lacking:
        raise CampaignError(f"{path} is damaged: it has no {', '.join(lacking)}; {ANEW}")
    if found != FORMAT:
        raise CampaignError(f"{path} has format {found}; this version reads format {FORMAT}")
    return record


def write_scenario(folder: Path, given: Mapping[str, Any]) -> None:
    """Write `scenario.yaml`: JSON is YAML, but for its escapes of characters beyond U+FFFF."""
    write_text(folder / "scenario.yaml", json.dumps(given, indent=2, ensure_ascii=False) + "\n")


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file, all of it or nothing."""
    draft = path.with_name(f".{path.name}.tmp")
    try:
        with open(draft, "w", encoding="utf-8") as file:
            file.write(json.dumps(data, indent=2) + "\n")
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def clean(folder: Path) -> None:
    """Remove what killed processes left half written."""
    for leftover in (*folder.glob(".*.tmp"), *folder.glob("*/.*.tmp")):
        leftover.unlink(missing_ok=True)
    (folder / STOP).unlink(missing_ok=True)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a campaign's folder, so that no second process works in it.

    The operating system frees the lock of a process that was killed; a file system that is shared
    between machines may not, so the lock of another machine is believed.

    Raises:
        CampaignError: when another process holds it.
    """
    path = folder / LOCK
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        owner = _owner(path)
        if not _taken(descriptor, path):
            raise CampaignError(f"{folder}: {_told(owner)} is running this campaign; wait for it")
        if owner and owner.get("host") != socket.gethostname():
            raise CampaignError(
                f"{folder}: {_told(owner)} is running this campaign; if it is gone, delete {path}"
            )
        me = {"pid": os.getpid(), "host": socket.gethostname()}
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, json.dumps(me).encode(), 0)
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
    finally:
        os.close(descriptor)


def is_locked(folder: Path) -> bool:
    """Tell whether a process works in the folder."""
    path = folder / LOCK
    try:
        descriptor = os.open(path, os.O_RDWR)
    except OSError:
        return False
    try:
        owner = _owner(path)
        return not _taken(descriptor, path) or owner.get("host") != socket.gethostname()
    finally:
        os.close(descriptor)


def _taken(descriptor: int, path: Path) -> bool:
    """Take the operating system's lock; false when another process has it."""
    import fcntl  # of POSIX alone; reading results works everywhere

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # Its last holder may have removed the file between our opening and our locking it.
        return os.fstat(descriptor).st_ino == os.stat(path).st_ino
    except OSError:
        return False


def _owner(path: Path) -> dict[str, Any]:
    try:
        owner: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return owner


def _told(owner: Mapping[str, Any]) -> str:
    if not owner:
        return "another process"
    return f"process {owner.get('pid')} on {owner.get('host')}"
