"""Commands about campaigns: sweep, resume, status and merge."""

import os
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...support.process import INTERRUPTED, duration
from ...support.wording import counted, file_name
from .console import (
    compiling_shown,
    is_quiet,
    mistakes_text,
    print_json,
    refuse_plugins,
    say,
    talk,
    talk_of,
    wants_json,
    weigh,
)
from .options import (
    anyway_option,
    experiment_argument,
    experiment_options,
    json_option,
    out_option,
    plugins_option,
    set_option,
    shard_option,
    worker_options,
)
from .plan import resume_plan
from .reports import leave_report

if TYPE_CHECKING:
    from ..campaigns.campaign import Campaign, CampaignState
    from ..campaigns.experiments.experiment import Experiment

SOME_FAILED = 3

# So many points of a sweep are weighed beforehand, evenly spread over all of them.
MOST_WEIGHED = 300


@click.command()
@experiment_argument
@experiment_options
@set_option
@out_option("DIR", "Campaign folder (default results/<name>).")
@worker_options
@shard_option
@click.option("--dry-run", is_flag=True, help="Tell missions, time and disk; write nothing.")
@anyway_option
@plugins_option
def sweep(
    file: str,
    vary: tuple[str, ...],
    seeds: int | None,
    until_ci: tuple[str, ...],
    detail: str | None,
    overrides: tuple[str, ...],
    out: str | None,
    workers: int | None,
    mission_timeout: float | None,
    backend: str,
    shard: tuple[int, int] | None,
    dry_run: bool,
    anyway: bool,
    allow_plugins: bool,
) -> None:
    """Run an experiment, or a scenario, over many points and seeds.

    Whatever is cut short, by Ctrl-C, a kill or a full disk, `resume` continues.  Exit code 3: some
    missions failed.
    """
    with mistakes_text():
        from ..campaigns.experiments.experiment_file import load_experiment
        from ..campaigns.experiments.options import Options

        options = Options(vary, until_ci, seeds, detail, overrides)
        plan = load_experiment(file, options, allow_plugins=allow_plugins and not dry_run)
        if not dry_run:
            refuse_plugins(plan.unloaded)
        talk_of(plan.warnings if allow_plugins else (*plan.warnings, *plan.unloaded))
        folder = Path(out) if out else default_folder(plan.name, shard)
        _weigh_heaviest(plan, workers if backend == "local" else 1, anyway)
        if dry_run:
            _tell_estimate(plan, shard, workers)
            return
        from ..campaigns.running import sweep as sweep_experiment

        with compiling_shown():
            campaign = _as_far_as_it_came(
                sweep_experiment,
                plan,
                folder,
                workers=workers,
                backend=backend,
                shard=shard,
                quiet=is_quiet(),
                mission_timeout_s=mission_timeout,
            )
    _report(campaign)


def _as_far_as_it_came(run: Callable[..., "Campaign"], *given: Any, **how: Any) -> "Campaign":
    """Return the campaign that is run, or what an interrupt left of it, which is reported too."""
    from ..campaigns.campaign import CampaignInterrupted

    try:
        return run(*given, **how)
    except CampaignInterrupted as error:
        return error.campaign


def _weigh_heaviest(experiment: "Experiment", workers: int | None, anyway: bool) -> None:
    """Tell what the heaviest point takes, or refuse it; of many points some are looked at."""
    from ...core.setup import Setup
    from ..preflight.effort import effort

    points = len(experiment.points)
    looked_at = {
        n * (points - 1) // max(min(points, MOST_WEIGHED) - 1, 1) for n in range(MOST_WEIGHED)
    }
    efforts = {n: effort(Setup.of(experiment.scenario(n))) for n in looked_at if n < points}
    at_once = min(workers or os.cpu_count() or 1, points * len(experiment.seeds))
    heaviest = max(efforts, key=lambda n: (bool(efforts[n].excess(at_once)), efforts[n].seconds))
    weigh(f"each mission of point {heaviest}", efforts[heaviest], anyway, at_once)


def default_folder(name: str, shard: tuple[int, int] | None) -> Path:
    """Return where a campaign's results go unless the user says."""
    share = f"-shard{shard[0]}of{shard[1]}" if shard else ""
    return Path("results") / f"{file_name(name)}{share}"


@click.command(short_help="Run what is missing of a campaign, or go on with a plan.")
@click.argument("folder", metavar="DIR")
@worker_options
@plugins_option
@click.option("--retry-failed", is_flag=True, help="Also run missions again that failed.")
def resume(
    folder: str,
    workers: int | None,
    mission_timeout: float | None,
    backend: str,
    allow_plugins: bool,
    retry_failed: bool,
) -> None:
    """Run what is missing of a campaign, or go on with a plan that was cut short."""
    with mistakes_text():
        from ..planning.folder import is_plan_folder

        if is_plan_folder(Path(folder)):
            resume_plan(Path(folder), workers, allow_plugins)
            return
        from ..campaigns.running import resume as resume_campaign

        with compiling_shown():
            campaign = _as_far_as_it_came(
                resume_campaign,
                folder,
                retry_failed=retry_failed,
                allow_plugins=allow_plugins,
                tell=lambda line: click.echo(line, err=True),
                workers=workers,
                backend=backend,
                quiet=is_quiet(),
                mission_timeout_s=mission_timeout,
            )
    _report(campaign)


@click.command()
@click.argument("folder", metavar="DIR")
@json_option("how far it is")
def status(folder: str) -> None:
    """Tell how far a campaign or a plan is."""
    with mistakes_text():
        from ..campaigns.campaign import load_campaign
        from ..campaigns.statistics.outcomes import failed_because
        from ..planning.folder import MISSIONS, is_plan_folder

        path = Path(folder)
        is_plan = is_plan_folder(path)
        campaign = load_campaign(path / MISSIONS if is_plan else path)
        state = campaign.state()
    summary = _summary(campaign, state)
    if wants_json():
        print_json({**summary, "seconds_left": state.seconds_left})
        return
    rows = {"campaign": summary.pop("name"), **summary}
    del rows["folder"]
    if is_plan:  # which flies no more of its missions than it takes
        rows = {"plan": campaign.record["name"], "status": state.status}
        rows |= {"flown": state.done, "failed": state.failed}
    if state.failed:
        with mistakes_text():
            rows["failed"] = f"{state.failed}{failed_because(campaign.folder)}"
    if state.missions_per_s:
        rows["rate"] = f"{state.missions_per_s:.1f} missions/s"
    if state.seconds_left is not None and state.status == "running":
        rows["left"] = duration(state.seconds_left)
    say("\n".join(f"{name:<10}{value}" for name, value in rows.items()))


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True)
@out_option("DIR", "Folder of the whole campaign.", required=True)
@json_option("a summary")
def merge(folders: tuple[str, ...], out: str) -> None:
    """Join the shards of a campaign."""
    with mistakes_text():
        from ..campaigns.running import merge as merge_campaigns

        campaign = merge_campaigns(folders, out)
        missing = campaign.state().missing
    if missing:
        talk(f"{missing} missions are in none of them; `bindusbl-des resume {out}` runs them")
    _report(campaign, merged=True)


def _tell_estimate(
    experiment: "Experiment", shard: tuple[int, int] | None, workers: int | None
) -> None:
    from ..campaigns.experiments.experiment import ExperimentPlan
    from ..campaigns.workers.supervisor import estimated

    plan = ExperimentPlan(experiment)
    missions = len(plan.experiment.shard(*(shard or (1, 1))))
    cost = estimated(plan, missions, workers)
    if wants_json():
        print_json(asdict(cost))
        return
    share = f" in this shard of {len(plan)}" if shard else ""
    most = "at most " if experiment.until_ci else ""
    say(f"missions  {most}{missions}{share} ({cost.points} points x {cost.seeds} seeds)")
    say(f"time      about {duration(cost.seconds)}")
    size = f"{cost.bytes / 1e6:.1f} MB" if cost.bytes < 1e9 else f"{cost.bytes / 1e9:.1f} GB"
    say(f"disk      about {size}")


def _summary(campaign: "Campaign", state: "CampaignState") -> dict[str, Any]:
    return {
        "folder": str(campaign.folder),
        "name": campaign.record["name"],
        "status": state.status,
        "missions": state.missions,
        "done": state.done,
        "failed": state.failed,
        "missing": state.missing,
    }


def _report(campaign: "Campaign", *, merged: bool = False) -> None:
    """Print what a campaign found; end with 3 or 130 where that is how it went."""
    from ..campaigns.statistics.findings import findings
    from ..campaigns.statistics.outcomes import failed_because
    from ..campaigns.statistics.points_table import points_table

    with mistakes_text():  # what an older version ran may lack a metric
        state = campaign.state()
        said = findings(campaign.folder, campaign.plan)
        shown = "" if wants_json() else points_table(campaign.folder, campaign.plan, said)
    if wants_json():
        print_json({**_summary(campaign, campaign.state()), "findings": said.sentences()})
    else:
        say(shown)
        say(f"Results: {campaign.folder}")
    leave_report(campaign, said)
    context = click.get_current_context()
    if state.failed:
        with mistakes_text():
            why = failed_because(campaign.folder)
        failed = counted(state.failed, "mission")
        talk(f"{failed} failed{why}; see {campaign.folder / 'failures'}")
    if state.status == "interrupted" and not merged:
        talk(f"interrupted; `bindusbl-des resume {campaign.folder}` runs the other {state.missing}")
        context.exit(INTERRUPTED)
    if state.failed:
        context.exit(SOME_FAILED)
