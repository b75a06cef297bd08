"""Failed missions, each kept as a file in the folder `failures`; and campaigns that must not run,
since the folder is in use, or the model has changed.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.results.result import scenario_sha256
from ...support.files import read_json
from ...support.kept_files import check_kept
from ...support.plugins import source_sha256, sources_of
from ...support.wording import printable
from .campaign import Campaign, unfinished_campaign
from .experiments.experiment import ExperimentPlan, model_version
from .storage.folder import ANEW, RECORD, CampaignError, is_locked, read_record

# What such a file holds.
FAILURE: dict[str, type] = {
    "mission": int, "varied": dict, "seed": object, "error": str, "reproduce": str,
}  # fmt: skip


def failures_in(folder: Path) -> list[dict[str, Any]]:
    """Return the records of failed missions, in the order of the plan.

    Raises:
        ValueError: when a file is damaged.
    """
    found = [_failure(path) for path in (folder / "failures").glob("*.json")]
    return sorted(found, key=lambda failure: int(failure["mission"]))


def _failure(path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = read_json(path)
        for key, kind in FAILURE.items():
            if not isinstance(found[key], kind):
                raise ValueError(f"{key} is not what it should be")
    except (KeyError, OSError, TypeError, ValueError) as error:
        raise ValueError(
            f"{path} is damaged ({type(error).__name__}: {error}); delete it, then "
            f"`bindusbl-des resume {path.parents[1]} --retry-failed`"
        ) from None
    return found


def check_name(folder: Path) -> None:
    """Refuse a folder's name that cannot exist.

    Raises:
        CampaignError: naming what is in the way.
    """
    if "\0" in str(folder):
        raise CampaignError(f"{printable(str(folder))}: no folder can have that name; give another")
    above = next(p for p in (folder.absolute(), *folder.absolute().parents) if os.path.lexists(p))
    if not above.is_dir():
        what = "a file" if above.exists() else "a link that leads nowhere"
        raise CampaignError(f"{folder}: cannot be made, since {above} is {what}; name another")


def is_unfinished(folder: Path, plan: ExperimentPlan, shard: tuple[int, int] | None) -> bool:
    """Tell whether a folder holds this plan's campaign, or this shard of it, with missions left."""
    if not (folder / RECORD).exists() or is_locked(folder):
        return False
    record = read_record(folder)
    if record["plan_sha256"] != plan.fingerprint() or record["shard"] != (shard and list(shard)):
        return False
    return bool(len(unfinished_campaign(folder).missing()))


def check_new(folder: Path, plan: ExperimentPlan) -> None:
    """Refuse a folder that is not empty.

    Raises:
        CampaignError: naming the remedy.
    """
    check_name(folder)
    if (folder / RECORD).exists():
        if is_locked(folder):
            raise CampaignError(f"{folder}: another process is running this campaign")
        record = read_record(folder)
        same = record["plan_sha256"] == plan.fingerprint()
        if why := _changed(folder, record):
            raise CampaignError(why)
        which = "this campaign, complete" if same else "another campaign"
        raise CampaignError(f"{folder}: holds {which}; name another folder")
    if folder.exists() and any(path.name != "campaign.lock" for path in folder.iterdir()):
        raise CampaignError(f"{folder}: is not empty and no campaign; name another folder")


def check_unchanged(campaign: Campaign) -> None:
    """Refuse to continue with another model, scenario, file or user-defined part.

    Raises:
        CampaignError: naming the difference.
    """
    now, record, folder = campaign.plan, campaign.record, campaign.folder
    if why := _changed(folder, record):
        raise CampaignError(why)
    check_files(campaign)
    sha = scenario_sha256(now.experiment.base())
    if record["scenario_sha256"] != sha or record["plan_sha256"] != now.fingerprint():
        raise CampaignError(
            f"{folder / RECORD} was edited: its scenario was {record['scenario_sha256'][:12]} and "
            f"is {sha[:12]}, its plan {record['plan_sha256'][:12]} and "
            f"{now.fingerprint()[:12]}; sweep anew into another folder"
        )


def check_files(campaign: Campaign) -> None:
    """Refuse a campaign whose copies of files have changed.

    Raises:
        CampaignError: naming the file.
    """
    names = []
    for copy, name in campaign.plan.files.items():
        file = Path(name)  # as the record has it, or what a modem brings
        is_copy = file.parent.parent == campaign.folder.absolute()
        names.append(f"{file.parent.name}/{file.name}" if is_copy else copy)
    try:
        check_kept(names, campaign.folder)
    except ValueError as error:
        raise CampaignError(f"{error}, or {ANEW}") from None


def _changed(folder: Path, record: Mapping[str, Any]) -> str:
    """Return why a campaign's missions and those of today cannot be mixed, "" if they can."""
    then, now = record["model_version"], model_version()
    if then != now:
        other, _, code = then.partition("+")
        own = code and other == now.partition("+")[0]
        remedy = (
            "put its code back as it was"
            if own
            else f"install bindusbl-des {other.partition('/')[0]}"
        )
        return (
            f"{folder}: began with model {then}, this is model {now}; their missions cannot be "
            f"mixed. Sweep anew into another folder, or {remedy}"
        )
    changed = (
        part for part, recorded in record["own_parts"].items() if source_sha256(part) != recorded
    )
    name = next(changed, None)
    return _changed_part(folder, name) if name else ""


def _changed_part(folder: Path, name: str) -> str:
    files = sources_of(name)
    if not files:
        return (
            f"{folder}: began with {name}, which is not found now; put its folder on PYTHONPATH, "
            f"or {ANEW}"
        )
    which = " or ".join(map(str, files))
    return (
        f"{folder}: {which} has changed since the campaign began with {name}, and missions of both "
        f"cannot be mixed; put it back as it was, or {ANEW}"
    )
