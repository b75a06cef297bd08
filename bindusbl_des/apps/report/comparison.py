"""Several runs side by side: what differs in their scenarios and in what came of them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...support.kept_files import portable
from ...support.plain_data import leaves
from ...support.wording import Shown, lettered, number, plain
from .page import THEME, Packer, assembled, asset, filled, table
from .recording import recording
from .run_data import run_data
from .run_page import AUV_COLUMNS, MAP, OF_MISSION, cell, described, footer, mission_row
from .story import story

if TYPE_CHECKING:
    from ...core.results.result import Result

SCRIPTS = (*MAP, "plots.js", "comparison.js")

# AUVs are compared by these metrics of AUV_COLUMNS.
AUV_METRICS = (
    "hf_coverage",
    "fixes_delivered",
    "fix_age_max_s",
    "latency_mean_s",
    "position_error_m",
    "position_error_p95_m",
    "imu_error_m",
)
# What the worst AUV of each run got
WORST = (
    Shown("position error, mean over time", "m", "position_error_m", 2),
    Shown("position error, 95 % of the time below", "m", "position_error_p95_m", 2),
    Shown("error saved by fixes (negative: they harm)", "m", "fix_benefit_m", 2),
    Shown("largest age of the last fix", "s", "fix_age_max_s", 1),
    Shown("pings in HF range", "%", "hf_coverage", 1, 100),
    Shown("latency", "s", "latency_mean_s", 3),
)

# Means over the AUVs of each run
MEANS = (
    Shown("mean position error", "m", "position_error_m", 2),
    Shown("95 % of the time below", "m", "position_error_p95_m", 2),
    Shown("without any fix", "m", "imu_error_m", 2),
    Shown("age of the last fix", "s", "fix_age_mean_s", 2),
    Shown("fixes per AUV", "", "fixes_delivered", 1),
    Shown("between fixes", "s", "interval_mean_s", 2),
    Shown("pings in HF range", "%", "hf_coverage", 1, 100),
    Shown("latency", "s", "latency_mean_s", 3),
    *OF_MISSION,
)

Named = tuple[str, "Result"]
Row = Mapping[str, Any]


def comparison_page(runs: Sequence[Named]) -> str:
    """Return the page of several runs, each with the folder that it came from, as HTML.

    The runs may differ in anything; those that recorded metrics only have no map.
    """
    packer = Packer()
    names = [lettered(number) for number in range(len(runs))]
    data: dict[str, Any] = {"runs": []}
    verdicts = []
    for name, (_, result) in zip(names, runs, strict=True):
        title = f"{name}: {result.scenario.name}, seed {result.seed}"
        verdict = "recorded metrics only (record.detail: summary)."
        if "tracks" in result.arrow:
            mission = recording(result)
            tale = story(mission)
            verdict = " ".join(filter(None, (tale.warning, tale.verdict, tale.reason)))
            data["runs"].append({**run_data(mission, tale.services, packer), "name": title})
        verdicts.append(filled("<li><b>{name}</b>: {verdict}</li>", name=name, verdict=verdict))
    body = (
        _head(names, runs)
        + _answer(names, runs)
        + _differences(names, runs)
        + f'<section id="story"><h2>Why</h2><ul>{"".join(verdicts)}</ul></section>'
        + _missions(names, runs)
        + (asset("comparison.html") if data["runs"] else "")
        + _auvs(names, runs)
        + _origins(names, runs)
    )
    return assembled(
        f"{len(runs)} runs side by side", body, SCRIPTS if data["runs"] else (), data,
        packer.text(),
    )  # fmt: skip


def _head(names: Sequence[str], runs: Sequence[Named]) -> str:
    lines = "".join(
        filled(
            "<p><b>{name}</b>: {scenario} ({folder})</p>",
            name=name,
            scenario=result.scenario.name,
            folder=folder,
        )
        for name, (folder, result) in zip(names, runs, strict=True)
    )
    return f"<header><div><h1>{len(runs)} runs side by side</h1>{lines}</div>{THEME}</header>"


def _answer(names: Sequence[str], runs: Sequence[Named]) -> str:
    """Return in a sentence in which run the worst AUV navigated best, and by how much."""
    errors = [mission_row(result).get("worst_position_error_m") for _, result in runs]
    known = [(error, name) for error, name in zip(errors, names, strict=True) if error is not None]
    if len(known) < 2:
        return ""
    (best, first), *others = sorted(known)
    if best == max(known)[0]:
        return filled(
            '<p class="verdict">The worst AUV navigated alike in all runs: its mean error was '
            "{best} m.</p>",
            best=number(best),
        )
    rest = ", ".join(f"{number(error)} m in {name}" for error, name in others)
    return filled(
        '<p class="verdict">In {first} the worst AUV navigated best: its mean error was {best} m, '
        "{rest}. One mission each: it may be chance.</p>",
        first=first,
        best=number(best),
        rest=rest,
    )


def _differences(names: Sequence[str], runs: Sequence[Named]) -> str:
    """Return the table of scenario keys that are not the same in all runs."""
    scenarios = [
        {"seed": result.seed, **dict(leaves(portable(result.scenario.model_dump(mode="json"))))}
        for _, result in runs
    ]
    keys = dict.fromkeys(key for scenario in scenarios for key in scenario if key != "name")
    rows = [
        [key, *(plain(scenario[key]) if key in scenario else "-" for scenario in scenarios)]
        for key in keys
        if any(scenario.get(key) != scenarios[0].get(key) for scenario in scenarios)
    ]
    shown = (
        table([("key", ""), *((name, "") for name in names)], rows, "What differs in the scenarios")
        if rows
        else "<p>Nothing: they are the same scenario with the same seed.</p>"
    )
    return f'<section id="differences"><h2>What differs in the scenarios</h2>{shown}</section>'


def _missions(names: Sequence[str], runs: Sequence[Named]) -> str:
    """Return the tables of what the worst AUV got and of the fleet's means, beside the first run's.

    What an AUV has not, because it got no fix, has no difference.
    """
    missions = [mission_row(result) for _, result in runs]
    headings = [("", ""), *((name, "") for name in names)]
    worst = [[_labelled(row), *_worst_beside(row, missions)] for row in WORST]
    means = [[_labelled(row), *_means_beside(row, missions)] for row in MEANS]
    return (
        '<section id="missions"><h2>The missions in numbers</h2><h3>The worst AUV of each</h3>'
        + table(headings, worst, "What the worst AUV got")
        + "<h3>Means over the AUVs</h3>"
        + table(headings, means, "Metrics of the missions")
        + '<p class="note">In brackets the difference from A. Of one mission each no difference is '
        "shown: it may be chance. <code>bindusbl-des sweep</code> and <code>compare</code> show "
        "over many seeds what is better or worse.</p></section>"
    )


def _labelled(shown: Shown) -> str:
    return f"{shown.words} ({shown.unit})" if shown.unit else shown.words


def _worst_beside(shown: Shown, missions: Sequence[Row]) -> list[str]:
    """Return the worst AUV's values of a metric, each with the AUV and its difference."""
    worst = f"worst_{shown.metric}"
    differences = _with_differences([row[worst] for row in missions], shown)
    return [
        f"{'none' if text == '-' else text}, {row[f'{worst}_auv']}" if row[f"{worst}_auv"] else "-"
        for text, row in zip(differences, missions, strict=True)
    ]


def _means_beside(shown: Shown, missions: Sequence[Row]) -> list[str]:
    """Return the fleet's means of a metric with their differences, and whom they leave out."""
    values, worst = [row[shown.metric] for row in missions], f"worst_{shown.metric}"
    lost = [row.get(f"{worst}_auv") if row.get(worst) is None else None for row in missions]
    if not any(lost):
        return list(_with_differences(values, shown))
    return [
        f"{cell(value, shown)}, without {auv}" if auv else cell(value, shown)
        for value, auv in zip(values, lost, strict=True)
    ]


def _with_differences(values: Sequence[float | None], shown: Shown) -> Iterator[str]:
    """Yield values of one metric as text, those after the first with their difference from it."""
    first = values[0]
    for place, value in enumerate(values):
        text = cell(value, shown)
        if place and value is not None and first is not None:
            sign = "-" if value < first else "+"
            text += f" ({sign}{cell(abs(value - first), shown)})"
        yield text


def _auvs(names: Sequence[str], runs: Sequence[Named]) -> str:
    """Return the table of AUV metrics, the runs of one AUV below each other."""
    columns = [column for column in AUV_COLUMNS if column.metric in AUV_METRICS]
    rows = []
    fleets = [
        {str(row["auv"]): row for row in result.arrow["auvs"].to_pylist()} for _, result in runs
    ]
    for auv in dict.fromkeys(auv for fleet in fleets for auv in fleet):
        for name, fleet in zip(names, fleets, strict=True):
            if auv in fleet:
                cells = (cell(fleet[auv][column.metric], column) for column in columns)
                rows.append([auv, name, *cells])
    headings = [("AUV", ""), ("run", ""), *(column[:2] for column in columns)]
    return (
        '<section id="auvs" class="named"><h2>Each AUV</h2>'
        + table(headings, rows, "Metrics of each AUV")
        + "</section>"
    )


def _origins(names: Sequence[str], runs: Sequence[Named]) -> str:
    rows = []
    for name, (folder, result) in zip(names, runs, strict=True):
        run = result.run_record()
        what = described(result)
        rows.append([name, folder, str(run["seed"]), run["scenario_sha256"][:16], what])
    headings = [("run", ""), ("folder", ""), ("seed", ""), ("scenario sha256", ""), ("what", "")]
    return (
        '<section id="origin" class="texts"><h2>What made these runs</h2>'
        + table(headings, rows, "What made these runs")
        + f"</section>{footer()}"
    )
