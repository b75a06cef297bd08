"""The command that draws figures of a run or a campaign."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import (
    FIGURES,
    answer,
    check_figure,
    check_file,
    refuse,
    result_in,
    talk,
    writing,
)
from .options import (
    bare_keys,
    folder_argument,
    force_option,
    json_option,
    mission_metrics,
    out_option,
)

if TYPE_CHECKING:
    from ...core.results.result import Result

    # How to draw a figure of some width (in), or why it cannot be drawn
    Offers = dict[str, Callable[[float], Any] | str]

# Each kind of a campaign's figures and its usual width (in)
SWEEP_KINDS = {"curves": 4.5, "heatmap": 5.0}
# Options that choose rounds: the parameters of the figures that show rounds
ROUND_OPTIONS = {
    "timeline": {"first": "first", "last": "last"},
    "round": {"first": "number"},
}

WIDTHS = {"1": 3.5, "2": 7.16}


@click.command()
@folder_argument
@click.argument("kind", metavar="[KIND]", required=False)
@out_option("FILE", "Where one figure goes; its suffix is the format.")
@click.option(
    "--format",
    "suffix",
    type=click.Choice([name[1:] for name in FIGURES]),
    default="png",
    help="Format of the files in DIR/figures (default png).",
)
@click.option("--columns", type=click.Choice(list(WIDTHS)), help="As wide as columns of a paper.")
@click.option("--from", "first", type=click.IntRange(min=0), help="First round (timeline, round).")
@click.option("--to", "last", type=click.IntRange(min=0), help="Last round (timeline).")
@click.option(
    "--metric",
    shell_complete=mission_metrics,
    help="Metric of a campaign's figures (default worst_position_error_m).",
)
@click.option(
    "--x", metavar="KEY", shell_complete=bare_keys, help="Varied key along x (curves, heatmap)."
)
@click.option(
    "--series",
    metavar="KEY",
    shell_complete=bare_keys,
    help="Varied key of the curves, or along y (heatmap).",
)
@click.option("--no-title", is_flag=True, help="Leave the titles out, for a figure with a caption.")
@force_option("Replace figures that exist.")
@json_option("the figures' names")
def plot(
    folder: str,
    kind: str | None,
    out: str | None,
    suffix: str,
    columns: str | None,
    no_title: bool,
    force: bool,
    **options: Any,
) -> None:
    """Draw figures of a run or a campaign as PNG, SVG or PDF.

    KIND is trajectory, error, fixes, coverage, timeline, round or latency for the folder of a run,
    curves or heatmap for that of a campaign.  Without it every kind that the folder supports is
    drawn, into DIR/figures.
    """
    if out and not kind:
        raise click.UsageError("--out names one file, so give a KIND too")
    if out:
        check_figure(Path(out), force)
    from ..figures.kinds import KINDS, USUAL_WIDTHS

    if kind in KINDS and kind not in ROUND_OPTIONS and options["first"] is not None:
        refuse(f"--from is for {' and '.join(ROUND_OPTIONS)}; {kind} shows the whole mission")
    is_sweep = (Path(folder) / "campaign.json").is_file()
    offers = _sweep_offers(folder, options) if is_sweep else _run_offers(folder, options)
    usual = SWEEP_KINDS if is_sweep else USUAL_WIDTHS
    chosen = _chosen(offers, folder, kind)
    paths = {
        name: Path(out) if out else Path(folder) / "figures" / f"{name}.{suffix}" for name in chosen
    }
    if not out and (Path(folder) / "figures").is_symlink():
        refuse(
            f"{Path(folder) / 'figures'} is a link, which is not followed; remove it, or give --out"
        )
    for path in paths.values():
        if path.parent.exists():
            check_file(path, force)
    for name, path in paths.items():
        _save(chosen[name], WIDTHS.get(columns or "", usual[name]), path, no_title, force)
    answer({"figures": {name: str(path) for name, path in paths.items()}}, map(str, paths.values()))


def _chosen(offers: "Offers", folder: str, kind: str | None) -> "dict[str, Callable[[float], Any]]":
    """Return the kinds to draw: the one asked for, or all that can be drawn."""
    if kind is None:
        for name, offer in offers.items():
            if isinstance(offer, str):
                talk(f"no {name}: {offer}")
        able = {name: offer for name, offer in offers.items() if not isinstance(offer, str)}
        return able or refuse(f"{folder}: nothing can be drawn of it")
    if kind not in offers:
        from ...support.wording import did_you_mean

        which = "a campaign" if "curves" in offers else "a run"
        hint = did_you_mean(kind, offers)
        refuse(f"no figure {kind!r} of {which}{hint or '; there are ' + ', '.join(offers)}")
    offer = offers[kind]
    if isinstance(offer, str):
        refuse(f"{folder}: no {kind}: {offer}")
    return {kind: offer}


def _run_offers(folder: str, options: dict[str, Any]) -> "Offers":
    for name in ("metric", "x", "series"):
        if options[name] is not None:
            refuse(f"--{name} is for campaigns; {folder} holds a run")
    result = result_in(folder)
    from ..figures.kinds import KINDS, lacking

    return {
        name: lacking(result, name) or partial(kind, result, **_rounds(result, name, options))
        for name, kind in KINDS.items()
    }


def _rounds(result: "Result", kind: str, options: dict[str, Any]) -> dict[str, int]:
    """Return which rounds a figure shows, where it shows rounds and the user said which."""
    names = ROUND_OPTIONS.get(kind, {})
    given = {name: options[option] for option, name in names.items() if options[option] is not None}
    count = len(result.tables["rounds"]) if given else 0
    for value in given.values():
        if value >= count:
            refuse(f"there is no round {value}: the run has rounds 0 to {count - 1}")
    if len(given) == 2 and given["first"] > given["last"]:
        refuse(f"--from {given['first']} comes after --to {given['last']}")
    return given


def _sweep_offers(folder: str, options: dict[str, Any]) -> "Offers":
    for name, option in (("first", "--from"), ("last", "--to")):
        if options[name] is not None:
            refuse(f"{option} is for runs; {folder} holds a campaign")
    from ..campaigns.campaign import load_campaign
    from ..campaigns.drawing import means_of
    from ..campaigns.statistics.outcomes import JUDGED
    from ..figures.sweeps import curves, heatmap

    try:
        metric = options["metric"] or JUDGED[0]
        means = means_of(load_campaign(folder), metric, options["x"], options["series"])
    except ValueError as error:
        refuse(str(error))
    return {
        "curves": partial(curves, means),
        "heatmap": partial(heatmap, means) if means.series else "it needs two keys that vary",
    }


def _save(
    draw: "Callable[[float], Any]", width: float, path: Path, untitled: bool, force: bool
) -> None:
    from ..figures.style import save, styled, without_titles

    with writing(path), styled():
        path.parent.mkdir(exist_ok=True)
        figure = draw(width)
        save(without_titles(figure) if untitled else figure, path, replace=force)
