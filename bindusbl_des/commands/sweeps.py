"""Commands about campaigns: sweep, resume, status and merge."""

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import (
    RunFailed,
    anyway_option,
    is_quiet,
    plugins_option,
    print_json,
    refuse,
    refuse_plugins,
    say,
    talk,
    talk_of,
    tell_of_compiling,
    weigh,
)
from .reports import leave_report

if TYPE_CHECKING:
    from ..campaigns.campaign import Campaign
    from ..campaigns.experiments.experiment import Experiment

SOME_FAILED = 3

# So many points of a sweep are weighed beforehand, evenly spread over all of them.
MOST_WEIGHED = 300
INTERRUPTED = 130


def _shard(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Return the two numbers of a share of a campaign, written ``i/N``: the i-th of N."""
    if text is None:
        return None
    numbers = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if not numbers or not 1 <= int(numbers[1]) <= int(numbers[2]):
        raise click.BadParameter(f"{text!r} is no share; write i/N with 1 <= i <= N, such as 1/4")
    return int(numbers[1]), int(numbers[2])


def _worker_options(command: Any) -> Any:
    """Give a command the options that say who does the work."""
    command = click.option("--json", "as_json", is_flag=True, help="Print a summary as JSON.")(
        command
    )
    command = click.option(
        "--backend", default="local", metavar="local|dask:ADDRESS", help="Who does the work."
    )(command)
    command = click.option(
        "--mission-timeout",
        type=float,
        metavar="SECONDS",
        help="End a mission that takes longer; it counts as failed.",
    )(command)
    return click.option(
        "--workers",
        type=click.IntRange(min=1),
        metavar="N",
        help="Processes at once (default: one per CPU).",
    )(command)


def _experiment_options(command: Any) -> Any:
    """Give a command the options that are laid over an experiment or a scenario."""
    command = click.option(
        "--detail", type=click.Choice(["summary", "full"]), help="Keep metrics only, or all events."
    )(command)
    command = click.option(
        "--until-ci",
        metavar="METRIC=WIDTH",
        multiple=True,
        help="Stop a point when half the width of the metric's 95 % CI is at most this, such as "
        "5% of the mean or 0.02; --seeds is the largest number of seeds then (default 256).",
    )(command)
    command = click.option(
        "--seeds", type=click.IntRange(min=1), metavar="N", help="Seeds 0 to N - 1 at each point."
    )(command)
    return click.option(
        "--vary",
        metavar="KEY=V1,V2",
        multiple=True,
        help="Vary a key, such as asvs.count=2,3; several make a grid.",
    )(command)


@click.command()
@click.argument("file", metavar="FILE.yaml")
@_experiment_options
@click.option("--out", metavar="DIR", help="Campaign folder (default results/<name>).")
@_worker_options
@click.option(
    "--shard", metavar="i/N", callback=_shard, help="Run the i-th of N shares; `merge` joins them."
)
@click.option("--dry-run", is_flag=True, help="Tell missions, time and disk; write nothing.")
@anyway_option
@plugins_option
def sweep(
    file: str,
    vary: tuple[str, ...],
    seeds: int | None,
    until_ci: tuple[str, ...],
    detail: str | None,
    out: str | None,
    workers: int | None,
    mission_timeout: float | None,
    backend: str,
    as_json: bool,
    shard: tuple[int, int] | None,
    dry_run: bool,
    anyway: bool,
    allow_plugins: bool,
) -> None:
    """Run an experiment, or a scenario, over many points and seeds.

    Whatever is cut short, by Ctrl-C, a kill or a full disk, `resume` continues.  Exit code 3: some
    missions failed.
    """
    with mistakes_told():
        from ..campaigns.experiments.experiment_file import load_experiment
        from ..campaigns.experiments.options import Options

        options, load = Options(vary, until_ci, seeds, detail), allow_plugins and not dry_run
        plan = load_experiment(file, options, allow_plugins=load)
        if not dry_run:
            refuse_plugins(plan.unloaded)
        talk_of((*plan.warnings, *plan.unloaded))
        folder = Path(out) if out else default_folder(plan.name, shard)
        _weigh_heaviest(plan, workers if backend == "local" else 1, anyway)
        if dry_run:
            _tell_estimate(plan, shard, workers, as_json)
            return
        from ..campaigns.running import sweep as sweep_experiment

        tell_of_compiling()
        campaign = sweep_experiment(
            plan,
            folder,
            workers=workers,
            backend=backend,
            shard=shard,
            quiet=is_quiet(),
            mission_timeout_s=mission_timeout,
        )
    _report(campaign, as_json)


def _weigh_heaviest(experiment: "Experiment", workers: int | None, anyway: bool) -> None:
    """Tell what the heaviest point takes, or refuse it; of many points some are looked at."""
    from ..preflight.effort import effort

    points = len(experiment.points)
    looked_at = {
        n * (points - 1) // max(min(points, MOST_WEIGHED) - 1, 1) for n in range(MOST_WEIGHED)
    }
    efforts = {n: effort(experiment.scenario(n)) for n in looked_at if n < points}
    at_once = min(workers or os.cpu_count() or 1, points * len(experiment.seeds))
    heaviest = max(efforts, key=lambda n: (bool(efforts[n].excess(at_once)), efforts[n].seconds))
    weigh(f"each mission of point {heaviest}", efforts[heaviest], anyway, at_once)


def default_folder(name: str, shard: tuple[int, int] | None) -> Path:
    """Return where a campaign's results go unless the user says."""
    share = f"-shard{shard[0]}of{shard[1]}" if shard else ""
    return Path("results") / f"{re.sub(r'[^A-Za-z0-9._-]+', '_', name)}{share}"


@click.command()
@click.argument("folder", metavar="DIR")
@_worker_options
@plugins_option
@click.option("--retry-failed", is_flag=True, help="Also run missions again that failed.")
def resume(
    folder: str,
    workers: int | None,
    mission_timeout: float | None,
    backend: str,
    as_json: bool,
    allow_plugins: bool,
    retry_failed: bool,
) -> None:
    """Run what is missing of a campaign."""
    with mistakes_told():
        from ..campaigns.running import resume as resume_campaign

        tell_of_compiling()
        campaign = resume_campaign(
            folder,
            retry_failed=retry_failed,
            allow_plugins=allow_plugins,
            tell=lambda line: click.echo(line, err=True),
            workers=workers,
            backend=backend,
            quiet=is_quiet(),
            mission_timeout_s=mission_timeout,
        )
    _report(campaign, as_json)


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def status(folder: str, as_json: bool) -> None:
    """Tell how far a campaign is."""
    with mistakes_told():
        from ..campaigns.campaign import load_campaign
        from ..core.progress import duration

        campaign = load_campaign(folder)
        state = campaign.state()
    if as_json:
        print_json({**_summary(campaign), "seconds_left": state.seconds_left})
        return
    rows = {
        "campaign": campaign.record["name"],
        "status": state.status,
        "missions": state.missions,
        "done": state.done,
        "failed": state.failed,
        "missing": state.missing,
    }
    if state.missions_per_s:
        rows["rate"] = f"{state.missions_per_s:.1f} missions/s"
    if state.seconds_left is not None and state.status == "running":
        rows["left"] = duration(state.seconds_left)
    say("\n".join(f"{name:<10}{value}" for name, value in rows.items()))


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True)
@click.option("--out", metavar="DIR", required=True, help="Folder of the whole campaign.")
@click.option("--json", "as_json", is_flag=True, help="Print a summary as JSON.")
def merge(folders: tuple[str, ...], out: str, as_json: bool) -> None:
    """Join the shards of a campaign."""
    with mistakes_told():
        from ..campaigns.merging import merge as merge_campaigns

        campaign = merge_campaigns(folders, out)
        missing = campaign.state().missing
    if missing:
        talk(f"{missing} missions are in none of them; `bindusbl-des resume {out}` runs them")
    _report(campaign, as_json, merged=True)


@contextmanager
def mistakes_told() -> Iterator[None]:
    """Tell what a user can mend as such: exit code 2, or 1 where a campaign broke off."""
    from ..campaigns.experiments.sampling import ScipyMissing
    from ..campaigns.storage.folder import CampaignError
    from ..campaigns.workers.batches import NotWritten
    from ..campaigns.workers.pools import BackendMissing
    from ..campaigns.workers.supervisor import WorkersDie

    try:
        yield
    except NotWritten as error:
        raise RunFailed(
            f"stopped, because results cannot be written: {error.strerror or error}. What was "
            f"written counts; {_remedy(error)}"
        ) from error
    except (BackendMissing, ScipyMissing, WorkersDie) as error:
        raise RunFailed(str(error)) from error
    except (CampaignError, ValueError) as error:
        refuse(str(error))
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:  # bad input, which `cli` tells
            raise
        reason = error.strerror or str(error)
        raise RunFailed(f"{error.filename or 'the folder'}: {reason}") from error


def _remedy(error: OSError) -> str:
    """Return what to do about a folder that cannot be written."""
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return (
            "the folder was moved or removed meanwhile: `bindusbl-des resume` it where it is now, "
            "or sweep anew"
        )
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return "free some space, then `bindusbl-des resume` the folder"
    return "make the folder writable, then `bindusbl-des resume` it"


def _tell_estimate(
    experiment: "Experiment", shard: tuple[int, int] | None, workers: int | None, as_json: bool
) -> None:
    from ..campaigns.experiments.plan import Plan
    from ..campaigns.workers.estimate import estimated
    from ..core.progress import duration

    plan = Plan(experiment)
    missions = len(plan.shard(*(shard or (1, 1))))
    cost = estimated(plan, missions, workers)
    if as_json:
        print_json(asdict(cost))
        return
    share = f" in this shard of {len(plan)}" if shard else ""
    most = "at most " if experiment.until_ci else ""
    say(f"missions  {most}{missions}{share} ({cost.points} points x {cost.seeds} seeds)")
    say(f"time      about {duration(cost.seconds)}")
    say(f"disk      about {cost.bytes / 1e6:.1f} MB")


def _summary(campaign: "Campaign") -> dict[str, Any]:
    state = campaign.state()
    return {
        "folder": str(campaign.folder),
        "name": campaign.record["name"],
        "status": state.status,
        "missions": state.missions,
        "done": state.done,
        "failed": state.failed,
        "missing": state.missing,
    }


def _report(campaign: "Campaign", as_json: bool, *, merged: bool = False) -> None:
    """Print what a campaign found; end with 3 or 130 where that is how it went."""
    from ..campaigns.statistics.findings import findings
    from ..campaigns.statistics.points_table import points_table

    with mistakes_told():  # what an older version ran may lack a metric
        state = campaign.state()
        if as_json:
            said = findings(campaign.folder, campaign.plan).sentences()
        else:
            shown = points_table(campaign.folder, campaign.plan)
    if as_json:
        print_json({**_summary(campaign), "findings": said})
    else:
        say(shown)
        say(f"Results: {campaign.folder}")
    leave_report(campaign)
    context = click.get_current_context()
    if state.failed:
        talk(f"{state.failed} missions failed; see {campaign.folder / 'failures'}")
    if state.status == "interrupted" and not merged:
        talk(f"interrupted; `bindusbl-des resume {campaign.folder}` runs the other {state.missing}")
        context.exit(INTERRUPTED)
    if state.failed:
        context.exit(SOME_FAILED)
