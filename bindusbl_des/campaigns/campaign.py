"""Campaigns: begin, continue, merge and read them."""

import json
import os
import shutil
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..result import PACKAGES, scenario_sha256
from .batches import FAILED, NotWritten
from .crews import crew_for
from .experiment import Experiment
from .experiment_file import load_experiment
from .folder import FORMAT, RECORD, CampaignError, clean, is_locked, locked, read_record, write_json
from .interruption import interruptible
from .merging import compact, merge_parts
from .parts import clean_parts, committed, done, part_path, read_table
from .plan import Plan
from .progress import Progress
from .supervisor import Supervisor
from .warming import compile_kernels

if TYPE_CHECKING:
    import pandas as pd

Shard = tuple[int, int]


@dataclass(frozen=True)
class Settings:
    """How a campaign is run, which changes nothing of what it finds."""

    workers: int | None = None
    backend: str = "local"
    quiet: bool = True


@dataclass(frozen=True)
class State:
    """How far a campaign is."""

    missions: int
    done: int
    failed: int
    status: str
    missions_per_s: float | None = None

    @property
    def missing(self) -> int:
        """Missions that have no row yet."""
        return self.missions - self.done - self.failed

    @property
    def seconds_left(self) -> float | None:
        """Time until the end at the rate so far, None where none is known."""
        return self.missing / self.missions_per_s if self.missions_per_s else None


class Campaign:
    """A campaign's folder and what it holds."""

    def __init__(self, folder: Path, plan: Plan, record: Mapping[str, Any]) -> None:
        self.folder, self.plan, self.record = folder, plan, record

    @cached_property
    def missions(self) -> "pd.DataFrame":
        """One row per mission in the order of the plan: varied keys, seed, status, metrics."""
        return self._frame("missions")

    @cached_property
    def auvs(self) -> "pd.DataFrame":
        """One row per AUV of each mission, in the order of the plan."""
        return self._frame("auvs")

    def _frame(self, table: str) -> "pd.DataFrame":
        import pandas as pd

        rows = read_table(self.folder, table)
        frame: pd.DataFrame = pd.DataFrame() if rows is None else rows.to_pandas()
        return frame

    def numbers(self) -> Sequence[int]:
        """Return the numbers of this folder's missions in the plan: all, or those of its shard."""
        return list(self.plan.shard(*(self.record["shard"] or (1, 1))))

    def state(self) -> State:
        """Return how far the campaign is."""
        states = list(done(self.folder).values())
        failed = states.count(FAILED)
        status = "running" if is_locked(self.folder) else self.record["status"]
        if status == "running" and not is_locked(self.folder):
            status = "killed"
        total = len(self.numbers())
        return State(total, len(states) - failed, failed, status, self._rate(len(states)))

    def _rate(self, ran: int) -> float | None:
        session = self.record["session"]
        parts = [part_path(self.folder, "missions", part) for part in committed(self.folder)]
        latest = max((path.stat().st_mtime for path in parts), default=0.0)
        if self.record["status"] != "running" or latest <= session["began_at"]:
            return None
        return (ran - session["rows_before"]) / (latest - session["began_at"]) or None


def load_campaign(folder: str | Path) -> Campaign:
    """Read a campaign's folder, finished or not.

    Raises:
        CampaignError: when it is none or damaged.
    """
    folder = Path(folder)
    record = read_record(folder)
    try:
        plan = Plan(Experiment.from_record(record["experiment"]))
        plan.model_version = record["model_version"]
    except (KeyError, TypeError, ValueError) as error:
        raise CampaignError(f"{folder / RECORD} is damaged or was edited: {error}") from None
    return Campaign(folder, plan, record)


def sweep(
    experiment: str | Path | Experiment,
    out: str | Path,
    *,
    workers: int | None = None,
    backend: str = "local",
    shard: Shard | None = None,
    quiet: bool = True,
) -> Campaign:
    """Run every mission of an experiment; return the campaign, which its folder keeps.

    Interrupted or killed, it is continued by `resume`.

    Raises:
        ScenarioError: when the experiment file or its scenario is wrong.
        CampaignError: when the folder cannot take a new campaign.
        NotWritten: when the disk is full; what was written counts.
    """
    if not isinstance(experiment, Experiment):
        experiment = load_experiment(experiment)
    plan, folder = Plan(experiment), Path(out)
    check_new(folder, plan)
    settings = Settings(workers, backend, quiet)
    crew_for_check(settings)
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        check_new(folder, plan)
        record = first_record(plan, shard)
        write_json(folder / "scenario.yaml", experiment.given)  # JSON is YAML
        return _run(Campaign(folder, plan, record), settings)


def crew_for_check(settings: Settings) -> None:
    """Refuse a backend that does not exist before anything is written."""
    crew_for(settings.backend, 1).close(now=True)


def resume(folder: str | Path, *, retry_failed: bool = False, **settings: Any) -> Campaign:
    """Run what is missing of a campaign.

    Raises:
        CampaignError: when the model has changed since, or another process runs it.
        NotWritten: when the disk is full; what was written counts.
    """
    campaign = load_campaign(folder)
    check_unchanged(campaign)
    with locked(campaign.folder):
        clean(campaign.folder)
        clean_parts(campaign.folder)
        if retry_failed:
            states = done(campaign.folder)
            compact(campaign.folder, leave_out=[n for n, it in states.items() if it == FAILED])
        return _run(campaign, Settings(**settings))


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


def first_record(plan: Plan, shard: Shard | None) -> dict[str, Any]:
    """Return what `campaign.json` holds when a campaign begins."""
    base = plan.experiment.base()
    return {
        "format": FORMAT,
        "name": plan.experiment.name,
        "status": "running",
        "missions": len(plan),
        "shard": shard,
        "plan_sha256": plan.fingerprint(),
        "model_version": plan.model_version,
        "versions": {package: version(package) for package in PACKAGES},
        "scenario_sha256": scenario_sha256(base),
        "scenario": base.model_dump(mode="json"),
        "experiment": plan.experiment.record(),
    }


def _run(campaign: Campaign, settings: Settings) -> Campaign:
    """Run the missing missions of a campaign whose folder is ours."""
    folder, states = campaign.folder, done(campaign.folder)
    missing = [number for number in campaign.numbers() if number not in states]
    session = {"began_at": time.time(), "rows_before": len(states)}
    record = {**campaign.record, "status": "running", "session": session}
    write_json(folder / RECORD, record)
    status = "killed"
    try:
        status = _supervise(campaign, missing, settings)
    except KeyboardInterrupt:
        status = "interrupted"
        raise
    except NotWritten:
        status = "stopped: the disk is full or cannot be written"
        raise
    finally:
        _settle(folder, {**record, "status": status})
    return Campaign(folder, campaign.plan, {**record, "status": status})


def _settle(folder: Path, record: Mapping[str, Any]) -> None:
    with suppress(OSError):  # on a full disk the rows still say what is done
        clean(folder)
        write_json(folder / RECORD, record)


def _supervise(campaign: Campaign, missing: Sequence[int], settings: Settings) -> str:
    """Run missions; return `complete` or `interrupted`."""
    if missing:
        workers = settings.workers or os.cpu_count() or 1
        if settings.backend == "local":
            compile_kernels(campaign.plan)
        progress = Progress(len(missing), quiet=settings.quiet)
        crew = crew_for(settings.backend, min(workers, len(missing)))
        supervisor = Supervisor(campaign.plan, campaign.folder, crew, progress.note)
        ended = False
        try:
            with interruptible(supervisor.stop):
                supervisor.run(missing)
            ended = True
        finally:
            crew.close(now=not ended)
            progress.end()
        if supervisor.trouble:
            raise supervisor.trouble
        if supervisor.stopping and len(done(campaign.folder)) < len(campaign.numbers()):
            return "interrupted"
    with suppress(OSError):  # sorting needs room for a copy; unsorted parts hold the same rows
        compact(campaign.folder)
    return "complete"


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
    folder.mkdir(parents=True)
    merge_parts([campaign.folder for campaign in campaigns], folder)
    for campaign in campaigns:
        if (campaign.folder / "failures").is_dir():
            shutil.copytree(campaign.folder / "failures", folder / "failures", dirs_exist_ok=True)
    shutil.copy(first.folder / "scenario.yaml", folder / "scenario.yaml")
    states = done(folder)
    status = "complete" if len(states) == len(first.plan) else "interrupted"
    session = {"began_at": time.time(), "rows_before": len(states)}
    record = {**first.record, "shard": None, "status": status, "session": session}
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
