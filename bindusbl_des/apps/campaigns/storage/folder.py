"""The folder of a campaign: its lock, its files, and its record `campaign.json`.

Another user may have written the record, so it is checked before use.
"""

import json
import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ....support.files import DRAFT, SEAL, check_seal, sealed, unreadable, write_text
from ....support.plain_data import PRINTABLE
from ....support.wording import printable

# A seed is at most what a column of whole numbers holds.
LARGEST_SEED = 2**63 - 1

# Each mission is a line of the plan.
MOST_MISSIONS = 5_000_000

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Words = Annotated[str, Field(pattern=PRINTABLE, max_length=200)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
Count = Annotated[int, Field(ge=0)]
Width = (
    Annotated[float, Field(gt=0)] | Annotated[str, Field(pattern=r"^[0-9]{1,9}(\.[0-9]{1,9})? ?%$")]
)


class _Section(BaseModel):
    model_config = ConfigDict(strict=True, allow_inf_nan=False)


class _Named(_Section):
    name: Words


class _Experiment(_Section):
    name: Words
    scenario_as_given: dict[str, Any]
    points: Annotated[list[dict[str, Any]], Field(min_length=1)]
    seeds: Annotated[list[Seed], Field(min_length=1, max_length=MOST_MISSIONS)]
    detail: Literal["summary", "full"]
    until_ci: dict[str, Width]


class _Session(_Section):
    began_at: float
    rows_before: Count


class _Record(_Section):
    name: Words
    status: Words
    missions: Count
    shard: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2, max_length=2)] | None
    plan_sha256: Sha256
    model_version: Words
    versions: dict[Words, Words]
    scenario_sha256: Sha256
    scenario: _Named
    own_parts: dict[Words, Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")]]
    experiment: _Experiment
    session: _Session


def check_record(record: Any) -> None:
    """Refuse an incomplete or invalid record.

    Raises:
        ValueError: naming the first wrong key.
    """
    try:
        _Record.model_validate(record)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, first["loc"][:4]))
        raise ValueError(f"{key}: {first['msg']}") from None
    count = len(record["experiment"]["points"]) * len(record["experiment"]["seeds"])
    if count > MOST_MISSIONS:
        raise ValueError(f"experiment: makes {count:,} missions; at most {MOST_MISSIONS:,} can run")
    shard = record["shard"]
    if shard and shard[0] > shard[1]:
        raise ValueError(f"shard: there is no share {shard[0]} of {shard[1]}")


RECORD = "campaign.json"
LOCK = "campaign.lock"
STOP = "stop"

# The status of a campaign of which a plan asks for missions by number: it need not be finished.
AS_ASKED = "flown as far as a plan asked"
# Where its record says which mean error (m) is asked of every AUV.
LIMIT = "position_error_below_m"

# 2: parts say what belongs to them, and track files lie in the folder.
FORMAT = 2

# The remedies when a record is lost.
AGAIN = "sweep the same experiment into this folder again, which keeps missions, or into another"
ANEW = "sweep the experiment anew into another folder"


class CampaignError(ValueError):
    """A campaign cannot be run, continued or read; the message says why, and the remedy."""


class DamagedRecord(CampaignError):
    """What `campaign.json` holds cannot be used; the same experiment, swept again, writes it."""


def read_record(folder: Path) -> dict[str, Any]:
    """Return the record `campaign.json`.

    Raises:
        CampaignError: when the folder is no campaign's, or of another version.
    """
    path = folder / RECORD
    try:  # globbing takes a folder that may not be read for an empty one
        for inside in (folder, *(entry for entry in folder.iterdir() if entry.is_dir())):
            next(inside.iterdir(), None)
    except PermissionError as error:
        raise CampaignError(unreadable(error.filename, error)) from None
    except OSError:
        pass  # it is none, which is told below
    if not path.is_file():
        raise CampaignError(
            f"{folder} is no campaign folder (it has no {RECORD}); give the folder that "
            "`bindusbl-des sweep` wrote"
        )
    try:
        record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        check_seal(record)
        found = record["format"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise damaged_record(folder, error) from None
    if found != FORMAT:
        raise CampaignError(
            f"{path} has format {printable(str(found))[:20]}, of another version of bindusbl-des; "
            f"this one reads and continues format {FORMAT}; {ANEW}"
        )
    try:
        check_record(record)
    except (ValueError, RecursionError) as error:
        raise damaged_record(folder, error) from None
    return {key: record[key] for key in record if key != SEAL}


def write_record(folder: Path, record: Mapping[str, Any]) -> None:
    """Write `campaign.json`, all of it or nothing, with its checksum.

    Raises:
        OSError: when it cannot be written.
    """
    write_json(folder / RECORD, sealed(record))


def write_scenario(folder: Path, given: Mapping[str, Any]) -> None:
    """Write `scenario.yaml`: JSON is YAML, but for its escapes of characters beyond U+FFFF."""
    write_text(folder / "scenario.yaml", json.dumps(given, indent=2, ensure_ascii=False) + "\n")


def damaged_record(folder: Path, error: Exception) -> CampaignError:
    """Return the error for a `campaign.json` that cannot be used, in one line."""
    if isinstance(error, PermissionError):
        return CampaignError(unreadable(folder / RECORD, error))
    said = printable((str(error).splitlines() or [""])[0])[:200]
    return DamagedRecord(
        f"{folder / RECORD} is damaged or was edited ({type(error).__name__}: {said}); {AGAIN}"
    )


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file, all of it or nothing."""
    write_text(path, json.dumps(data, indent=2) + "\n")


def clean(folder: Path) -> None:
    """Remove half-written files of killed processes."""
    for pattern in (".*.tmp", f".*{DRAFT}"):
        for leftover in (*folder.glob(pattern), *folder.glob(f"*/{pattern}")):
            leftover.unlink(missing_ok=True)
    (folder / STOP).unlink(missing_ok=True)


def check_no_links(folder: Path) -> None:
    """Refuse a folder in which symbolic links lead elsewhere: what is written would go there.

    Raises:
        CampaignError: naming the first one.
    """
    for path in (*folder.iterdir(), *folder.glob("*/*")):
        if path.is_symlink():
            raise CampaignError(
                f"{path}: is a symbolic link, which a campaign's folder has none of; remove it, or "
                "put what it leads to in its place"
            )


def ask_to_stop(folder: Path) -> None:
    """Leave the file that workers look for after each mission; through no link.

    Raises:
        OSError: when it cannot be written.
    """
    with suppress(FileExistsError):
        os.close(os.open(folder / STOP, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644))


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a campaign's folder, so that no second process works in it.

    The operating system frees the lock of a process that was killed; a file system that is shared
    between machines may not, so the lock of another machine is believed.

    Raises:
        CampaignError: when another process holds it.
    """
    path = folder / LOCK
    descriptor = _opened(path)
    try:
        owner = _owner(descriptor)
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


def _opened(path: Path) -> int:
    """Open the lock's file to be written, if it is one of this folder and nothing else."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644)
    except OSError as error:
        if not path.is_symlink():
            raise
        raise CampaignError(f"{path}: is a symbolic link; remove it") from error
    if os.fstat(descriptor).st_nlink > 1:
        os.close(descriptor)
        raise CampaignError(f"{path}: is a file of another folder, too; remove it")
    return descriptor


def is_locked(folder: Path) -> bool:
    """Tell whether a process works in the folder, which need not be writable."""
    path = folder / LOCK
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except PermissionError:
        return True  # it is there, and another user's
    except OSError:
        return False
    try:
        owner = _owner(descriptor)
        elsewhere = bool(owner) and owner.get("host") != socket.gethostname()
        return not _taken(descriptor, path, shared=True) or elsewhere
    finally:
        os.close(descriptor)


def _taken(descriptor: int, path: Path, *, shared: bool = False) -> bool:
    """Take the operating system's lock; false when another process has it.

    Shared, it tells whether a process has it for itself.
    """
    import fcntl  # of POSIX alone; reading results works everywhere

    try:
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
        # Its last holder may have removed the file between our opening and our locking it.
        return os.fstat(descriptor).st_ino == os.stat(path).st_ino
    except OSError:
        return False


def _owner(descriptor: int) -> dict[str, Any]:
    try:
        owner = json.loads(os.pread(descriptor, 4096, 0))
    except (OSError, ValueError, RecursionError):
        return {}
    return owner if isinstance(owner, dict) else {}


def _told(owner: Mapping[str, Any]) -> str:
    if not owner:
        return "another process"
    return printable(f"process {owner.get('pid')} on {owner.get('host')}")[:200]
