"""Shards of a campaign joined in a new folder."""

import json
import os
import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.durable import sync
from ..core.kept_files import keep, portable
from .campaign import Campaign, load_campaign
from .refusals import check_files, check_name
from .storage.folder import RECORD, CampaignError, is_locked, write_json, write_scenario
from .storage.joining import merge_parts


def merge(folders: Sequence[str | Path], out: str | Path) -> Campaign:
    """Join the shards of one campaign in a new folder.

    Raises:
        CampaignError: when they belong to different campaigns, or the folder is not new.
        OSError: when it cannot be written; nothing of it is left then.
    """
    campaigns = [load_campaign(folder) for folder in folders]
    first, folder = campaigns[0], Path(out)
    for other in campaigns[1:]:
        if other.record["plan_sha256"] != first.record["plan_sha256"]:
            raise CampaignError(
                f"{other.folder} is not of the same campaign as {first.folder}: "
                f"{_difference(first.record, other.record)}"
            )
    for campaign in campaigns:
        check_files(campaign)
        if is_locked(campaign.folder):
            raise CampaignError(f"{campaign.folder}: is still running; merge it when it has ended")
    check_name(folder)
    if folder.exists() or folder.is_symlink():
        raise CampaignError(f"{folder}: exists; name another folder")
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=f".{folder.name[:40]}-", dir=folder.parent))
    try:
        merged = _joined(campaigns, draft)
        draft.chmod(0o755)
        os.rename(draft, folder)
        sync(folder.parent)
    finally:
        shutil.rmtree(draft, ignore_errors=True)  # what a failure leaves; else it has gone
    return Campaign(folder, merged.plan, merged.record)


def _joined(campaigns: Sequence[Campaign], folder: Path) -> Campaign:
    """Write the missions of several shards into a folder that is there and empty."""
    first = campaigns[0]
    keep(first.plan.files, folder)
    merge_parts([campaign.folder for campaign in campaigns], folder)
    for campaign in campaigns:
        if (campaign.folder / "failures").is_dir():
            shutil.copytree(campaign.folder / "failures", folder / "failures", dirs_exist_ok=True)
    write_scenario(folder, portable(first.plan.experiment.given))
    record = {**first.record, "shard": None}
    merged = Campaign(folder, first.plan, record)
    record["session"] = {"began_at": time.time(), "rows_before": len(merged.done())}
    record["status"] = "interrupted" if len(merged.missing()) else "complete"
    write_json(folder / RECORD, record)
    return merged


def _difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Return the first thing in which two campaigns differ."""
    for part in {**one["own_parts"], **other["own_parts"]}:
        if one["own_parts"].get(part) != other["own_parts"].get(part):
            return f"the source of {part} is another"
    for name in ("model_version", "name", "missions"):
        if one[name] != other[name]:
            return f"{name} is {other[name]}, not {one[name]}"
    for name in one["experiment"]:
        if one["experiment"][name] != other["experiment"][name]:
            return f"{name} differ: {_short(other, name)}, not {_short(one, name)}"
    return "their plans differ"


def _short(record: Mapping[str, Any], name: str) -> str:
    text = json.dumps(record["experiment"][name])
    return text if len(text) <= 80 else f"{text[:77]}..."
