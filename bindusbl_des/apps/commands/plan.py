"""The command `plan`: the least team of ASVs that keeps AUVs on their way, and how sure that is."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...support.wording import file_name
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
    warn,
    weigh,
)
from .options import (
    Range,
    anyway_option,
    goal_metrics,
    json_option,
    out_option,
    plan_argument,
    plugins_option,
    set_option,
    workers_option,
)

if TYPE_CHECKING:
    from ..planning.goals import Of
    from ..planning.question import Question


CUT = "cut"
CUT_OFF = "Cut off before all was flown; the same command, or `bindusbl-des resume {}`, goes on."


@click.command()
@plan_argument
@click.option(
    "--below",
    metavar="METRIC=VALUE",
    multiple=True,
    shell_complete=goal_metrics,
    help="A goal, such as position_error_p95_m=1 (m): that metric of each mission's worst AUV, "
    "averaged over missions; repeatable.",
)
@click.option(
    "--above",
    metavar="METRIC=VALUE",
    multiple=True,
    shell_complete=goal_metrics,
    help="The same where more is better, such as fix_rate_hz=0.1.",
)
@click.option(
    "--survive",
    type=int,
    metavar="N",
    help="Keep the goals also where any N vessels are lost, from the start on or halfway.",
)
@click.option("--mean", is_flag=True, help="Judge the mean over AUVs, not the worst AUV.")
@click.option(
    "--share",
    type=Range(min=0, max=1, min_open=True),
    metavar="SHARE",
    help="Judge what this share of the AUVs keeps to, such as 0.8.",
)
@click.option(
    "--vary",
    metavar="KEY=V1,V2",
    multiple=True,
    help="What may be chosen, such as asvs.count=2:4 or acoustics.mf.range_m=100,200; of numbers, "
    "formations, schedules and downlinks that are not varied, some are proposed.",
)
@click.option(
    "--confidence", type=float, metavar="SHARE", help="How sure to be of the answer (default 0.95)."
)
@click.option(
    "--budget-missions",
    type=int,
    metavar="N",
    help="Cut off after so many missions (default: when the answer is settled).",
)
@click.option(
    "--budget-s", type=float, metavar="SECONDS", help="Cut off after so long a time of flying."
)
@workers_option
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Other missions (default 0).")
@out_option("DIR", "Folder of the plan (default results/<name>-plan).")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier plan.")
@set_option
@anyway_option
@plugins_option
@json_option("the plan")
def plan(
    file: str,
    below: tuple[str, ...],
    above: tuple[str, ...],
    survive: int | None,
    mean: bool,
    share: float | None,
    vary: tuple[str, ...],
    confidence: float | None,
    budget_missions: int | None,
    budget_s: float | None,
    workers: int | None,
    seed: int | None,
    out: str | None,
    force: bool,
    overrides: tuple[str, ...],
    anyway: bool,
    allow_plugins: bool,
) -> None:
    """Find the least team of ASVs that keeps to a goal.

    Teams are proposed, predicted and flown, with as many seeds as it takes to be sure; the answer
    is flown again in worse conditions.  What is cut off goes on with the same command, or with
    `resume`.  A plan's file holds scenario, goal, survive, candidates, confidence, budgets,
    cost.
    """
    if mean and share is not None:
        raise click.UsageError("give either --mean or --share")
    with mistakes_text():
        from ...core.setup import Setup
        from ..campaigns.experiments.options import Options
        from ..planning.folder import begin
        from ..planning.planning import admitted
        from ..planning.question import Asking, goals_of_options, read_plan
        from ..preflight.effort import effort

        of: Of | None = "mean" if mean else share
        goals = goals_of_options(below, above, of)
        options = Options(vary=vary, overrides=overrides)
        numbers = {"confidence": confidence, "budget_s": budget_s, "seed": seed}
        numbers |= {"budget_missions": budget_missions, "survive": survive}
        asking = Asking(goals, of, options, numbers, allow_plugins)
        question = read_plan(file, asking)
        experiment = question.experiment
        refuse_plugins(experiment.unloaded)
        talk_of(experiment.warnings)
        weigh(f"each mission of {question.name}", effort(Setup.of(question.base)), anyway)
        admitted(question, allow_plugins)
        folder = Path(out) if out else default_folder(question.name)
        begun = begin(question, folder, force=force)
    _make(begun, folder, workers)


def default_folder(name: str) -> Path:
    """Return where a plan goes unless the user says."""
    return Path("results") / f"{file_name(name)}-plan"


def resume_plan(folder: Path, workers: int | None, allow_plugins: bool) -> None:
    """Go on with a plan that was cut short."""
    with mistakes_text():
        from ..planning.folder import resumed
        from ..planning.planning import admitted

        question = resumed(folder)
        admitted(question, allow_plugins)
    _make(question, folder, workers)


def _make(question: "Question", folder: Path, workers: int | None) -> None:
    """Make a plan and print it."""
    with mistakes_text():
        from ..planning.flying import Budget
        from ..planning.planning import planned

        budget = Budget(question, quiet=is_quiet())
        try:
            with compiling_shown():
                made = planned(question, folder, budget, workers)
        except KeyboardInterrupt:
            talk(f"What was flown is kept; `bindusbl-des resume {folder}` goes on from there.")
            raise
    if made.record["status"] == CUT:
        warn(CUT_OFF.format(folder))
    if wants_json():
        print_json(made.record)
        talk(f"Results: {folder}")
    else:
        say(made.summary())
        talk(f"Open {folder / 'plan.html'} in a browser.")
