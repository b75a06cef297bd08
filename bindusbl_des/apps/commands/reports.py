"""The commands `compare` (are two campaigns, or two points of one, different, and how surely?) and
`report` (pages made again from the folders of runs and campaigns).
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...support.wording import filled, printable
from .console import (
    BadInput,
    answer,
    check_file,
    mistakes_text,
    refuse,
    refusing,
    result_in,
    talk,
    writing,
)
from .missions import AdviceOptions, advice_on, advice_options, read_again
from .options import (
    bare_keys,
    folders_argument,
    force_option,
    json_option,
    mission_metrics,
    out_option,
)

if TYPE_CHECKING:
    from ...core.scenario.scenario import Scenario
    from ..campaigns.campaign import Campaign
    from ..campaigns.compare import Comparison
    from ..campaigns.statistics.findings import Findings


TABLES = (".csv", ".parquet")


@click.command(short_help="Compare campaigns, plans, or points of one campaign.")
@folders_argument
@click.option(
    "--by",
    metavar="KEY",
    shell_complete=bare_keys,
    help="Compare the points of one campaign along this key.",
)
@click.option("--baseline", metavar="VALUE", help="Compare with this value of KEY, not the first.")
@click.option(
    "--metric",
    "metrics",
    multiple=True,
    shell_complete=mission_metrics,
    help="Metric to compare; repeatable.",
)
@click.option(
    "--mean", "by_mean", is_flag=True, help="Judge by the fleet's means, not each worst AUV."
)
@out_option("FILE", "Also write all rows to a .csv or .parquet file.")
@force_option("Replace the file if it exists.")
@json_option("all rows")
def compare(
    folders: tuple[str, ...],
    by: str | None,
    baseline: str | None,
    metrics: tuple[str, ...],
    by_mean: bool,
    out: str | None,
    force: bool,
) -> None:
    """Compare campaigns, points of one, or answers of plans.

    Missions with equal seeds are paired, so that the noise they share cancels; each is judged by
    its worst AUV.  Of plans of one goal a tender comes first: team, price, hours, error, what is
    left after a loss, and places.
    """
    if by_mean and metrics:
        refuse("--metric says what to compare; leave out --mean")
    if out:
        check_file(Path(out), force, TABLES, "table")
    with mistakes_text():
        from ..campaigns.compare import compared
        from ..campaigns.statistics.comparison_table import comparison_table
        from ..campaigns.statistics.differences import Chosen
        from ..campaigns.statistics.outcomes import JUDGED, MEANS
        from ..planning.folder import MISSIONS, drawn_team, is_plan_folder
        from ..planning.tender import tender, tender_table

        judged = metrics or (MEANS if by_mean else JUDGED)
        chosen: dict[Path, Chosen] = {}
        named = list(map(Path, folders))
        is_tender = len(named) > 1 and all(map(is_plan_folder, named))
        tenders = tender(named) if is_tender else []
        for number, folder in enumerate(named if len(named) > 1 else []):
            if is_plan_folder(folder):
                team, named[number] = drawn_team(folder), folder / MISSIONS
                name = f"{folder}, {team.whose}, {team.team}"
                chosen[folder / MISSIONS] = Chosen(team.number, name)
        comparison = compared(named, by=by, metrics=judged, baseline=baseline, chosen=chosen)
        if out:
            _write_table(comparison, Path(out), force)
    labels = [f"{label}: {meaning}" for label, meaning in comparison.labels.items()]
    labels[0] += " (baseline)"
    answer(
        {
            "labels": comparison.labels,
            "differences": comparison.records(),
            "notes": comparison.notes,
            **({"tender": tenders} if is_tender else {}),
        },
        [
            *map(filled, labels),
            "",
            *((*tender_table(tenders), "") if is_tender else ()),
            comparison_table(comparison.differences),
            *map(filled, comparison.notes),
        ],
    )
    if out:
        talk(f"Table: {out}")


def _write_table(comparison: "Comparison", path: Path, force: bool) -> None:
    """Write all rows, so that there is a whole table or none."""
    from ...support.files import draft_of

    frame = comparison.frame()
    with writing(path), draft_of(path, replace=force) as draft, open(draft, "wb") as file:
        if path.suffix.lower() == ".csv":
            frame.to_csv(file, index=False)
        else:
            frame.to_parquet(file, index=False)


PAGE, COMPARISON = "report.html", "comparison.html"
CAMPAIGN = "campaign.json"


@click.command(short_help="Write the HTML report of a run, several runs or a sweep.")
@folders_argument
@out_option("FILE", "Where to write the page.")
@force_option("Replace that file if it exists.")
@advice_options("Try changes of a run's plan; else what was tried before is shown, or not.")
@json_option("the page's name")
def report(
    folders: tuple[str, ...],
    out: str | None,
    force: bool,
    asked: AdviceOptions,
) -> None:
    """Write the HTML report of a run or a sweep; of several runs, side by side.

    The page is one file that opens offline.  It is DIR/report.html, made again, or comparison.html
    for several runs, unless --out names another.
    """
    alone = len(folders) == 1
    if asked.tries and (not alone or (Path(folders[0]) / CAMPAIGN).is_file()):
        refuse("--advice is for one run; name the folder of one")
    path = Path(out or COMPARISON) if out or not alone else Path(folders[0]) / PAGE
    again = alone and not out  # the folder's own page gives way unasked
    if not again:
        check_file(path, force)
    page = _page(folders[0], asked, keep=again) if alone else _comparison(folders)
    _write(path, page, replace=again or force)
    answer({"report": str(path)}, str(path))


def leave_report(campaign: "Campaign", findings: "Findings") -> None:
    """Write the report of a campaign into its folder; a sweep is no failure for want of one."""
    from ..campaigns.page import sweep_page

    try:
        _write(campaign.folder / PAGE, sweep_page(campaign, findings))
    except (BadInput, ValueError) as error:
        talk(str(error))
    else:
        talk(f"Open {campaign.folder / PAGE} in a browser.")


def _page(folder: str, asked: AdviceOptions, *, keep: bool) -> str:
    """Return the page of a folder; new advice on a run is kept in its folder, if so wanted."""
    if (Path(folder) / CAMPAIGN).is_file():
        from ..campaigns.campaign import load_campaign
        from ..campaigns.page import sweep_page

        with refusing(ValueError):
            return sweep_page(load_campaign(folder))
    from ...core.results.result_folder import ADVICE, advice_text
    from ..report.run_page import run_page

    result = result_in(folder)
    if asked.tries or asked.is_none:
        result.advice = advice_on(result, asked, _as_written(folder, result.scenario))
        if result.advice is not None and keep:
            _write(Path(folder) / ADVICE, advice_text(result.advice))
    return run_page(result)


def _as_written(folder: str, scenario: "Scenario") -> "Callable[[Sequence[str]], Scenario] | None":
    """Return what reads a folder's scenario file with further options; None if it is another's."""
    from ...support.mistakes import ScenarioError
    from ...support.plain_yaml import read_text

    path = Path(folder) / "scenario.yaml"
    try:
        again = read_again(read_text(path), path)
        return again if again and again(()) == scenario else None
    except ScenarioError:
        return None


def _comparison(folders: tuple[str, ...]) -> str:
    from ..report.comparison import comparison_page

    for folder in folders:
        if (Path(folder) / CAMPAIGN).is_file():
            refuse(
                f"{folder}: is a campaign; give it alone, or runs only "
                "(`bindusbl-des compare` compares campaigns)"
            )
    return comparison_page([(printable(folder), result_in(folder)) for folder in folders])


def _write(path: Path, text: str, *, replace: bool = True) -> None:
    from ...support.files import write_text

    with writing(path):
        write_text(path, text, replace=replace)
