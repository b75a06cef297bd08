"""Campaigns begun and continued."""

import errno
import math
import os
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.ctrl_c import answered, end_now, say
from ..core.durable import sync
from ..core.kept_tracks import keep, portable
from ..core.plugins import allow
from ..results.result import PACKAGES, scenario_sha256
from ..scenario.part_settings import own_part
from .campaign import Campaign, unfinished_campaign
from .experiments.experiment import Detail, Experiment
from .experiments.experiment_file import load_experiment
from .experiments.options import Options, written
from .experiments.plan import Plan
from .refusals import check_new, check_unchanged
from .storage.folder import (
    FORMAT,
    RECORD,
    check_no_links,
    clean,
    locked,
    write_json,
    write_scenario,
)
from .storage.joining import compact
from .storage.parts import clean_parts, done
from .storage.soundness import set_aside
from .workers.batches import NotWritten
from .workers.interruption import interruptible
from .workers.pools import pool_for
from .workers.progress import Progress
from .workers.supervisor import Supervisor
from .workers.warming import compile_kernels

Shard = tuple[int, int]

# The longest limit of a mission's time that the operating system can keep: thirty years.
LONGEST_LIMIT_S = 1e9


@dataclass(frozen=True)
class Settings:
    """How a campaign is run, which changes nothing of what it finds.

    Raises:
        ValueError: when the time that a mission may take is no time.
    """

    workers: int | None = None
    backend: str = "local"
    quiet: bool = True
    mission_timeout_s: float | None = None

    def __post_init__(self) -> None:
        limit = self.mission_timeout_s
        if limit is None or limit == math.inf:  # which means none
            object.__setattr__(self, "mission_timeout_s", None)
        elif not 0.0 < limit <= LONGEST_LIMIT_S:
            raise ValueError(
                f"--mission-timeout {limit:g}: needs a time (s) > 0 and <= {LONGEST_LIMIT_S:g}; "
                "leave it out for no limit"
            )


def sweep(
    experiment: str | Path | Experiment,
    out: str | Path,
    *,
    vary: Mapping[str, Sequence[Any]] | None = None,
    seeds: int | Sequence[int] | None = None,
    detail: Detail | None = None,
    until_ci: Mapping[str, float | str] | None = None,
    workers: int | None = None,
    backend: str = "local",
    shard: Shard | None = None,
    quiet: bool = True,
    mission_timeout_s: float | None = None,
    allow_plugins: bool = False,
) -> Campaign:
    """Run every mission of an experiment; return the campaign, which its folder keeps.

    `experiment` is an experiment file or a scenario file; `vary` (dotted keys with their values),
    `seeds`, `detail` and `until_ci` (metrics with the half width of their 95 % confidence interval
    at which a point stops, such as ``"5%"``) are laid over it.  A mission that takes longer than
    `mission_timeout_s` is ended and counts as failed.  Plug-ins (``module:object``) are loaded with
    `allow_plugins` only, or where they were admitted before.  Interrupted or killed, the campaign
    is continued by `resume`.

    Raises:
        ScenarioError: when the experiment file or its scenario is wrong.
        PluginError: when a plug-in is not allowed.
        CampaignError: when the folder cannot take a new campaign.
        NotWritten: when the disk is full or the folder gone; what was written counts.
    """
    settings = Settings(workers, backend, quiet, mission_timeout_s)
    if not isinstance(experiment, Experiment):
        targets = tuple(f"{metric}={width}" for metric, width in (until_ci or {}).items())
        options = Options(written(vary or {}), targets, seeds, detail)
        experiment = load_experiment(experiment, options, allow_plugins=allow_plugins)
    plan, folder = Plan(experiment), Path(out)
    check_plugins(plan, allow_plugins)
    check_new(folder, plan)
    crew_for_check(settings)
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.parent)
    with locked(folder):
        check_new(folder, plan)
        check_no_links(folder)
        keep(plan.tracks.values(), folder)
        record = first_record(plan, shard)
        write_scenario(folder, portable(experiment.given))
        return _run(Campaign(folder, plan, record), settings)


def crew_for_check(settings: Settings) -> None:
    """Refuse a backend that does not exist before anything is written."""
    pool_for(settings.backend, 1).close(now=True)


def check_plugins(plan: Plan, allowed: bool) -> None:
    """Load the plug-ins of a plan, before any worker does; refuse one that is not allowed."""
    if allowed:
        allow(name for _, name in plan.plugins.values())
    for family, name in plan.plugins.values():
        own_part(family, name)


def _warn(text: str) -> None:
    warnings.warn(text, stacklevel=3)


def resume(
    folder: str | Path,
    *,
    retry_failed: bool = False,
    allow_plugins: bool = False,
    tell: Callable[[str], None] = _warn,
    **settings: Any,
) -> Campaign:
    """Run what is missing of a campaign, and again what is damaged, of which it will `tell`.

    Its plug-ins must be allowed again.

    Raises:
        PluginError: when a plug-in is not allowed.
        CampaignError: when the model, a track or an own part has changed since, when the folder
            holds links, or another process runs it.
        NotWritten: when the disk is full or the folder gone; what was written counts.
    """
    how = Settings(**settings)
    campaign = unfinished_campaign(folder)
    check_unchanged(campaign)
    check_plugins(campaign.plan, allow_plugins)
    with locked(campaign.folder):
        check_no_links(campaign.folder)
        clean(campaign.folder)
        for line in set_aside(campaign.folder, campaign.record["plan_sha256"]):
            tell(line)
        clean_parts(campaign.folder)
        if retry_failed:
            rows = done(campaign.folder)
            compact(campaign.folder, leave_out=rows.numbers[rows.failed].tolist())
        return _run(campaign, how)


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
        "own_parts": plan.own_parts,
        "scenario": portable(base.model_dump(mode="json")),
        "experiment": plan.experiment.record(),
    }


def _run(campaign: Campaign, settings: Settings) -> Campaign:
    """Run the missing missions of a campaign whose folder is ours."""
    folder = campaign.folder
    session = {"began_at": time.time(), "rows_before": len(campaign.done())}
    record = {**campaign.record, "status": "running", "session": session}
    status = "killed"
    try:
        _begin(folder, record)
        status = _supervise(campaign, settings)
        if not folder.is_dir():  # removed when the last row was in it
            raise NotWritten(errno.ENOENT, os.strerror(errno.ENOENT))
    except KeyboardInterrupt:
        status = "interrupted"
        raise
    except NotWritten:
        status = "stopped: the folder cannot be written"
        raise
    finally:
        _settle(folder, {**record, "status": status})
    return Campaign(folder, campaign.plan, {**record, "status": status})


def _begin(folder: Path, record: Mapping[str, Any]) -> None:
    try:
        write_json(folder / RECORD, record)
    except OSError as error:
        raise NotWritten(error.errno, error.strerror or str(error)) from None


def _settle(folder: Path, record: Mapping[str, Any]) -> None:
    with suppress(OSError):  # on a full disk the rows still say what is done
        clean(folder)
        write_json(folder / RECORD, record)


def _supervise(campaign: Campaign, settings: Settings) -> str:
    """Run what is missing; return `complete` or `interrupted`."""
    folder, missing = campaign.folder, campaign.missing()
    if len(missing):
        if settings.backend == "local":
            with answered(_wait_or_end):
                compile_kernels(campaign.plan, folder)
        missing = _run_missing(campaign, missing, settings)
        if len(missing):
            return "interrupted"
    with suppress(OSError):  # sorting needs room for a copy; unsorted parts hold the same rows
        compact(folder)
    return "complete"


def _wait_or_end(asked: int) -> None:
    """Answer Ctrl-C while the equations are compiled, when no mission is under way."""
    if asked > 1:
        end_now(asked)
    say("interrupted: ends once this equation is compiled; Ctrl-C again ends at once")


def _run_missing(
    campaign: Campaign, missing: NDArray[np.int64], settings: Settings
) -> NDArray[np.int64]:
    """Run missions, and those that turn out to be wanted; return what an interrupt left."""
    workers = min(settings.workers or os.cpu_count() or 1, len(missing))
    progress = Progress(quiet=settings.quiet)
    pool = pool_for(settings.backend, workers)
    limit = settings.mission_timeout_s
    supervisor = Supervisor(campaign.plan, campaign.folder, pool, progress.note, limit)

    def stop() -> None:
        supervisor.stop()
        if not settings.quiet:
            say("stopping: the missions under way are finished; Ctrl-C again ends at once")

    ended = False
    try:
        with interruptible(stop):
            while len(missing) and not supervisor.stopping:
                progress.total += len(missing)
                supervisor.run(missing)
                missing = campaign.missing()
        ended = True
    finally:
        pool.close(now=not ended)
        progress.end()
    if supervisor.trouble:
        raise supervisor.trouble
    return missing
