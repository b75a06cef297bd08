"""Campaigns that must not be run: a folder that is taken, a model that has changed since."""

from pathlib import Path

from ..result import scenario_sha256
from .campaign import Campaign
from .experiments.plan import Plan
from .storage.folder import RECORD, CampaignError, is_locked, read_record


def check_new(folder: Path, plan: Plan) -> None:
    """Refuse a folder that holds something.

    Raises:
        CampaignError: naming what to do instead.
    """
    above = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    if not above.is_dir():
        raise CampaignError(f"{folder}: cannot be made, since {above} is a file")
    if (folder / RECORD).exists():
        if is_locked(folder):
            raise CampaignError(f"{folder}: another process is running this campaign")
        same = read_record(folder)["plan_sha256"] == plan.fingerprint()
        which = "this campaign" if same else "another campaign"
        command = f"`bindusbl-des resume {folder}` continues it"
        raise CampaignError(f"{folder}: holds {which}; {command}, or name another --out")
    if folder.exists() and any(path.name != "campaign.lock" for path in folder.iterdir()):
        raise CampaignError(f"{folder}: is not empty and no campaign; name another --out")


def check_unchanged(campaign: Campaign) -> None:
    """Refuse to continue what would mix two models or two scenarios.

    Raises:
        CampaignError: showing what differs.
    """
    now = Plan(campaign.plan.experiment)
    record, folder = campaign.record, campaign.folder
    if record["model_version"] != now.model_version:
        raise CampaignError(
            f"{folder}: began with model {record['model_version']}, this is model "
            f"{now.model_version}; their missions cannot be mixed. Sweep anew into another folder, "
            f"or install bindusbl-des {record['model_version'].partition('/')[0]}"
        )
    sha = scenario_sha256(now.experiment.base())
    if record["scenario_sha256"] != sha or record["plan_sha256"] != now.fingerprint():
        raise CampaignError(
            f"{folder / RECORD} was edited: its scenario was {record['scenario_sha256'][:12]} and "
            f"is {sha[:12]}, its plan {record['plan_sha256'][:12]} and "
            f"{now.fingerprint()[:12]}; sweep anew into another folder"
        )
