"""Begin, run and continue a campaign; join its shards."""

import errno
import json
import math
import os
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from shutil import copytree, rmtree
from tempfile import mkdtemp
from typing import Any, TypedDict, Unpack
from weakref import finalize

from ...core.results.result import scenario_sha256, versions
from ...core.scenario.part_choice import own_part
from ...core.scenario.scenario import Scenario
from ...support.arrays import Ints
from ...support.files import FolderTaken, folder_draft, sync
from ...support.kept_files import keep, portable
from ...support.plugins import allow, refuse_here
from ...support.process import answered, end_now, in_notebook, say
from ...support.shipped import located
from ...support.wording import described, did_you_mean
from .campaign import (
    Campaign,
    CampaignInterrupted,
    CampaignState,
    load_campaign,
    unfinished_campaign,
)
from .experiments.experiment import Detail, Experiment, ExperimentPlan
from .experiments.experiment_file import load_experiment
from .experiments.options import PythonArguments
from .failures import check_files, check_name, check_new, check_unchanged, is_unfinished
from .storage.folder import (
    AS_ASKED,
    FORMAT,
    LOCK,
    RECORD,
    CampaignError,
    DamagedRecord,
    check_no_links,
    clean,
    is_locked,
    locked,
    read_record,
    write_record,
    write_scenario,
)
from .storage.part_rows import compact, done, merge_parts
from .storage.parts import clean_parts, plans_of_parts, set_aside
from .workers.batches import NotWritten, Row, as_not_written, compile_kernels
from .workers.pools import Progress, at_work, pool_for
from .workers.supervisor import Supervisor, interruptible

COMPLETE = "complete"

# The longest limit of a mission's time that the operating system can keep: thirty years.
LONGEST_LIMIT_S = 1e9


@dataclass(frozen=True)
class RunSettings:
    """How a campaign is run, without effect on its results.

    Raises:
        TypeError: when `progress` cannot be called.
        ValueError: when the time limit of a mission or the number of workers is invalid.
    """

    workers: int | None = None
    backend: str = "local"
    quiet: bool | None = None
    mission_timeout_s: float | None = None
    progress: Callable[[CampaignState], object] | None = None

    def __post_init__(self) -> None:
        workers = self.workers
        if workers is not None and (not isinstance(workers, int) or workers < 1):
            raise ValueError(f"workers needs a whole number >= 1; got {described(workers)}")
        if self.progress is not None and not callable(self.progress):
            raise TypeError(
                "progress needs a function, which is called with how far the campaign is; got "
                + described(self.progress)
            )
        limit = self.mission_timeout_s
        if limit is None or limit == math.inf:  # which means none
            object.__setattr__(self, "mission_timeout_s", None)
        elif not 0.0 < limit <= LONGEST_LIMIT_S:
            raise ValueError(
                f"--mission-timeout {limit:g}: needs a time (s) > 0 and <= {LONGEST_LIMIT_S:g}; "
                "leave it out for no limit"
            )


class HowToRun(TypedDict, total=False):
    """The settings of a campaign as keyword arguments, each with a default in `RunSettings`."""

    workers: int | None
    backend: str
    quiet: bool | None
    mission_timeout_s: float | None
    progress: Callable[[CampaignState], object] | None


def settings_of(given: Mapping[str, Any], function: Callable[..., Any]) -> RunSettings:
    """Return the settings given to a function by name.

    Raises:
        TypeError: when a name does not exist, naming the nearest.
        ValueError: when the time limit of a mission is invalid.
    """
    names = tuple(HowToRun.__annotations__)
    for name in given:
        if name not in names:
            hint = did_you_mean(name, (*signature(function).parameters, *names))
            raise TypeError(
                f"{function.__name__} has no argument {name!r}"
                f"{hint or '; its settings are ' + ', '.join(names)}"
            )
    return RunSettings(**given)


Shard = tuple[int, int]


def sweep(
    experiment: str | Path | Scenario | Experiment,
    out: str | Path | None = None,
    *,
    vary: Mapping[str, Iterable[Any]] | None = None,
    points: Iterable[Mapping[str, Any]] | None = None,
    seeds: int | Iterable[int] | None = None,
    detail: Detail | None = None,
    until_ci: Mapping[str, float | str] | None = None,
    shard: Shard | None = None,
    allow_plugins: bool = False,
    **settings: Unpack[HowToRun],
) -> Campaign:
    """Run every mission of an experiment; return the campaign, which the folder `out` keeps.

    `experiment` is a scenario, or the path of a scenario or an experiment file, or the name of one
    that ships.  These arguments replace its values: `vary` (dotted keys, each with its values, or
    with a range such as ``"2:5"``: every combination is a point) or `points` (a mapping of dotted
    keys to values for each, or a frame with a row for each), `seeds` (N for 0 to N - 1, or a list;
    default 1), `detail` ("summary" or "full", which keeps the event tables) and `until_ci` (metrics
    with the half width of their 95 % confidence interval at which a point stops, such as ``"5%"``).
    `shard` (i, N) runs the i-th of N shares.

    Without `out` the campaign lies in a temporary folder, which is removed with the campaign unless
    its `write` copies it.  `resume`, or the same call again, continues an interrupted campaign in a
    folder.

    Settings: `workers` (processes, default one per CPU), `backend` ("local" or "dask:ADDRESS"),
    `quiet` (False: progress is shown, True: it is not; None: not in notebooks), `progress` (a
    function that is called with the :class:`CampaignState` after each batch of missions) and
    `mission_timeout_s` (s; a longer mission is ended and counts as failed).  Plug-ins
    (``module:object``) are loaded only with `allow_plugins`, or after an earlier permission.

    Raises:
        ScenarioError: when a file, a key or a value is wrong, listing every mistake.
        TypeError: when an argument has another type, or a name that does not exist.
        PluginError: when a plug-in is not allowed.
        CampaignError: when the folder cannot take a new campaign.
        CampaignInterrupted: at Ctrl-C, once the missions under way are finished.
        NotWritten: when the disk is full or the folder gone; written rows count.
    """
    how = settings_of(settings, sweep)
    if out is not None and not isinstance(out, str | Path):
        remedy = "; what to vary is given as vary={...}" if isinstance(out, Mapping) else ""
        raise TypeError(f"out needs a folder; got {described(out)}{remedy}")
    if shard is not None and not (len(shard) == 2 and 1 <= shard[0] <= shard[1]):
        raise ValueError(f"shard needs (i, N) with 1 <= i <= N, such as (1, 4); got {shard!r}")
    asked = PythonArguments(vary, until_ci, seeds, detail, points)
    if isinstance(experiment, Experiment):
        if asked:
            raise TypeError("an Experiment has its points and seeds; nothing is laid over it")
    else:
        experiment = located(experiment) if isinstance(experiment, str) else experiment
        experiment = load_experiment(experiment, asked, allow_plugins=allow_plugins)
    plan = ExperimentPlan(experiment)
    check_plugins(plan, allow_plugins)
    if out is not None:
        return _swept(plan, Path(out), shard, how)
    folder = Path(mkdtemp(prefix="bindusbl-sweep-"))
    try:
        campaign = _swept(plan, folder, shard, how)
    except CampaignInterrupted as error:
        finalize(error.campaign, remove_own, folder, os.getpid())
        go_on = "`error.campaign.write(FOLDER)` keeps the others, and `resume(FOLDER)` goes on"
        raise CampaignInterrupted(error.campaign, go_on) from None
    except BaseException:
        rmtree(folder, ignore_errors=True)
        raise
    finalize(campaign, remove_own, folder, os.getpid())
    return campaign


def remove_own(folder: Path, owner: int) -> None:
    """Remove a temporary folder, but only in the process that made it."""
    if os.getpid() == owner:
        rmtree(folder, ignore_errors=True)


def _swept(
    plan: ExperimentPlan, folder: Path, shard: Shard | None, settings: RunSettings
) -> Campaign:
    """Run a campaign in a new folder, or continue it in its own."""
    check_name(folder)
    pool_for(settings.backend, 1).close()  # refused before anything is written
    if restore_record(folder, plan, shard) or is_unfinished(folder, plan, shard):
        if settings.quiet is False:
            say(f"{folder}: goes on with this campaign")
        return _resumed(folder, settings, _warn)
    check_new(folder, plan)
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.parent)
    with locked(folder):
        check_new(folder, plan)
        check_no_links(folder)
        try:
            return _run(laid_out(plan, folder, shard), settings)
        except OSError as error:
            if (folder / RECORD).exists():
                raise
            _empty(folder)
            why = f"{error.strerror or error}; nothing was kept: free some space, run it again"
            raise OSError(error.errno, why, str(folder)) from None


def _empty(folder: Path) -> None:
    """Remove the contents of a folder that was empty when this process locked it."""
    for path in folder.iterdir():
        if path.name == LOCK:
            continue
        if path.is_dir():
            rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def check_plugins(plan: ExperimentPlan, allowed: bool) -> None:
    """Load the plug-ins of a plan; refuse one that is not allowed, or that workers lack."""
    if allowed:
        allow(name for _, name in plan.plugins.values())
    for family, name in plan.plugins.values():
        refuse_here(family.key, name)
        own_part(family, name)


def _warn(text: str) -> None:
    warnings.warn(text, stacklevel=3)


def resume(
    folder: str | Path,
    *,
    retry_failed: bool = False,
    allow_plugins: bool = False,
    tell: Callable[[str], None] = _warn,
    **settings: Unpack[HowToRun],
) -> Campaign:
    """Run the missing missions of a campaign, and those of damaged parts, each reported by `tell`.

    With `retry_failed` failed missions run again, too.  Plug-ins must be allowed again. Settings:
    as for `sweep`.

    Raises:
        PluginError: when a plug-in is not allowed.
        CampaignError: when the model, a track or a user-defined part has changed since, when the
            folder holds links, or another process runs it.
        CampaignInterrupted: at Ctrl-C, once the missions under way are finished.
        NotWritten: when the disk is full or the folder gone; written rows count.
    """
    how = settings_of(settings, resume)
    return _resumed(Path(folder), how, tell, retry_failed, allow_plugins)


def _resumed(
    folder: Path,
    settings: RunSettings,
    tell: Callable[[str], None],
    retry_failed: bool = False,
    allow_plugins: bool = False,
) -> Campaign:
    """Run the missing missions of a campaign."""
    campaign = unfinished_campaign(folder)
    check_unchanged(campaign)
    check_plugins(campaign.plan, allow_plugins)
    with locked(campaign.folder):
        check_no_links(campaign.folder)
        for line in mended(campaign):
            tell(line)
        if retry_failed:
            rows = done(campaign.folder)
            compact(campaign.folder, leave_out=rows.numbers[rows.failed].tolist())
        return _run(campaign, settings)


def laid_out(plan: ExperimentPlan, folder: Path, shard: Shard | None = None) -> Campaign:
    """Write the record, scenario and files of a plan into an empty folder; return the campaign."""
    keep(plan.files, folder)
    write_scenario(folder, portable(plan.experiment.given))
    return Campaign(folder, plan, first_record(plan, shard))


def mended(campaign: Campaign) -> list[str]:
    """Remove leftovers of killed processes; set damaged parts aside, return a line for each."""
    clean(campaign.folder)
    damaged = set_aside(campaign.folder, campaign.record["plan_sha256"])
    clean_parts(campaign.folder)
    return damaged


def first_record(plan: ExperimentPlan, shard: Shard | None) -> dict[str, Any]:
    """Return the first record `campaign.json` of a campaign."""
    base = plan.experiment.base()
    return {
        "format": FORMAT,
        "name": plan.experiment.name,
        "status": "running",
        "missions": len(plan),
        "shard": shard,
        "plan_sha256": plan.fingerprint(),
        "model_version": plan.model_version,
        "versions": versions(),
        "scenario_sha256": scenario_sha256(base),
        "own_parts": plan.own_parts,
        "scenario": portable(base.model_dump(mode="json")),
        "experiment": plan.experiment.record(),
    }


def restore_record(folder: Path, plan: ExperimentPlan, shard: Shard | None) -> bool:
    """Rewrite a damaged `campaign.json` beside missions of the same plan; tell whether it did."""
    if not (folder / RECORD).is_file() or is_locked(folder):
        return False
    try:
        read_record(folder)
    except DamagedRecord:
        if plan.fingerprint() in plans_of_parts(folder):
            session = {"began_at": 0.0, "rows_before": 0}
            with locked(folder):
                write_record(
                    folder, {**first_record(plan, shard), "status": "killed", "session": session}
                )
            return True
    except CampaignError:
        pass  # told where it is read
    return False


@contextmanager
def at_run(campaign: Campaign, **more: Any) -> Iterator[Campaign]:
    """Mark a campaign's record as running in the block, with `more`, and write its status after it.

    This process holds the folder's lock.  The caller sets the status of the yielded record; an
    interrupt and an error of writing set their own.

    Raises:
        NotWritten: when the record cannot be written.
    """
    folder = campaign.folder
    session = {"began_at": time.time(), "rows_before": len(campaign.done())}
    record = {**campaign.record, **more, "status": "running", "session": session}
    with as_not_written():
        write_record(folder, record)
    record["status"] = "killed"
    try:
        yield Campaign(folder, campaign.plan, record)
    except KeyboardInterrupt:
        record["status"] = "interrupted"
        raise
    except NotWritten:
        record["status"] = "stopped: the folder cannot be written"
        raise
    finally:
        with suppress(OSError):  # on a full disk the rows still say what is done
            clean(folder)
            if record["status"] in (COMPLETE, AS_ASKED):
                with suppress(OSError):  # sorting needs room for a copy
                    compact(folder)
            write_record(folder, record)


def _run(campaign: Campaign, settings: RunSettings) -> Campaign:
    """Run the missing missions of a campaign whose folder this process has locked."""
    folder = campaign.folder
    with at_run(campaign) as campaign:
        missing = campaign.missing()
        if len(missing):
            missing = _run_missing(campaign, missing, settings)
        if not folder.is_dir():  # removed when the last row was in it
            raise NotWritten(errno.ENOENT, os.strerror(errno.ENOENT))
        if len(missing):
            how = f"`resume({str(folder)!r})` or the same sweep goes on"
            raise CampaignInterrupted(campaign, how)
        campaign.record["status"] = COMPLETE
    return campaign


def _wait_or_end(asked: int) -> None:
    """Answer Ctrl-C while the equations are compiled, when no mission is under way."""
    if asked > 1:
        end_now(asked)
    say("interrupted: ends once this equation is compiled; Ctrl-C again ends at once")


def _run_missing(campaign: Campaign, missing: Ints, settings: RunSettings) -> Ints:
    """Run missions, and those that targets then need; return the ones that an interrupt left."""
    workers = min(settings.workers or os.cpu_count() or 1, len(missing))
    is_quiet = not in_notebook() if settings.quiet is None else settings.quiet
    progress, before = Progress(quiet=is_quiet), campaign.done()
    pool = pool_for(settings.backend, workers)

    def note(rows: Sequence[Row]) -> None:
        progress.note(rows)
        if settings.progress is not None:
            failed = int(before.failed.sum()) + progress.failed
            well = len(before) + progress.ran - failed
            missions = len(before) + progress.total
            settings.progress(CampaignState(missions, well, failed, "running", progress.rate))

    limit = settings.mission_timeout_s
    supervisor = Supervisor(campaign.plan, campaign.folder, pool, note, limit)

    def stop() -> None:
        supervisor.stop()
        if settings.quiet is False:
            say("stopping: the missions under way are finished; Ctrl-C again ends at once")

    try:
        with at_work(pool):
            if settings.backend == "local":
                with answered(_wait_or_end):
                    compile_kernels(campaign.plan, campaign.folder)
            with interruptible(stop):
                while len(missing) and not supervisor.stopping:
                    progress.total += len(missing)
                    supervisor.run(missing)
                    missing = campaign.missing()
    finally:
        progress.end()
    return missing


def merge(folders: Sequence[str | Path], out: str | Path) -> Campaign:
    """Join the shards of one campaign in a new folder.

    Raises:
        CampaignError: when they belong to different campaigns, or the folder is not new; if it
            came to exist meanwhile, the message names the folder beside it with the result.
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
    try:
        with folder_draft(folder, lambda _: "exists") as draft:
            merged = _joined(campaigns, draft)
    except FolderTaken as error:  # meanwhile
        raise CampaignError(str(error)) from None
    return Campaign(folder, merged.plan, merged.record)


def _joined(campaigns: Sequence[Campaign], folder: Path) -> Campaign:
    """Write the missions of several shards into an existing empty folder."""
    first = campaigns[0]
    merged = laid_out(first.plan, folder)
    merge_parts([campaign.folder for campaign in campaigns], folder)
    for campaign in campaigns:
        if (campaign.folder / "failures").is_dir():
            copytree(campaign.folder / "failures", folder / "failures", dirs_exist_ok=True)
    session = {"began_at": time.time(), "rows_before": len(merged.done())}
    merged.record |= {**first.record, "shard": None, "session": session}
    merged.record["status"] = "interrupted" if len(merged.missing()) else COMPLETE
    write_record(folder, merged.record)
    return merged


def _difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Return the first difference between two campaigns."""
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
