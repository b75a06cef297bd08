"""Shards of a campaign joined in a new folder."""

import json
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .campaign import Campaign, load_campaign
from .storage.folder import RECORD, CampaignError, is_locked, write_json, write_scenario
from .storage.joining import merge_parts
from .storage.parts import done


def merge(folders: Sequence[str | Path], out: str | Path) -> Campaign:
    """Join the shards of one campaign in a new folder.

    Raises:
        CampaignError: when they belong to different campaigns, or the folder is not new.
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
        if is_locked(campaign.folder):
            raise CampaignError(f"{campaign.folder}: is still running; merge it when it has ended")
    if folder.exists():
        raise CampaignError(f"{folder}: exists; name another --out")
    for campaign in campaigns:
        done(campaign.folder)  # a damaged part is told before anything is written
    folder.mkdir(parents=True)
    merge_parts([campaign.folder for campaign in campaigns], folder)
    for campaign in campaigns:
        if (campaign.folder / "failures").is_dir():
            shutil.copytree(campaign.folder / "failures", folder / "failures", dirs_exist_ok=True)
    write_scenario(folder, first.plan.experiment.given)
    session = {"began_at": time.time(), "rows_before": len(done(folder))}
    record = {**first.record, "shard": None, "session": session}
    missing = Campaign(folder, first.plan, record).missing()
    record["status"] = "interrupted" if len(missing) else "complete"
    write_json(folder / RECORD, record)
    return Campaign(folder, first.plan, record)


def _difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Return the first thing in which two campaigns differ."""
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
