"""The page of one run."""

import html
import json
from collections.abc import Sequence
from importlib.metadata import version
from string import Template
from typing import TYPE_CHECKING, Any

from ...core.records.metrics import WORST
from ...core.results.summary import rounds_text
from ...support.kept_files import portable
from ...support.plain_data import leaves
from ...support.wording import LONG_S, Shown, counted, number, plain, timed
from .calibration import calibration_text
from .envelope import envelope_made_of
from .gaps import intervals, latencies, spread_text
from .page import THEME, Packer, assembled, asset, filled, table
from .possible import possible_text
from .recording import metrics_of, recording
from .run_data import run_data
from .story import Story, short_story, story

if TYPE_CHECKING:
    from ...core.results.result import Result

Row = dict[str, Any]

MAP = ("saving.js", "mission.js", "seamap.js", "closeup.js", "playback.js")
SCRIPTS = (*MAP, "plots.js", "timeline.js", "inspector.js", "run.js")

# Narrow tables, which fit a phone and a sheet of paper.
AUV_TABLES: tuple[tuple[str, tuple[Shown, ...]], ...] = (
    ("Position error", (
        Shown("mean", "m", "position_error_m", 2),
        Shown("95 %", "m", "position_error_p95_m", 2),
        Shown("largest", "m", "position_error_max_m", 2),
        Shown("cross-track", "m", "cross_track_error_m", 2),
        Shown("without fixes", "m", "imu_error_m", 2),
    )),
    ("Waiting for fixes", (
        Shown("mean interval", "s", "interval_mean_s", 2),
        Shown("longest", "s", "interval_max_s", 1),
        Shown("mean age", "s", "fix_age_mean_s", 2),
        Shown("95 %", "s", "fix_age_p95_s", 1),
        Shown("largest", "s", "fix_age_max_s", 1),
    )),
    ("Pings", (
        Shown("sent", "", "pings", 0),
        Shown("in HF range", "%", "hf_coverage", 1, 100),
        Shown("decoded", "", "pings_heard", 0),
        Shown("lost", "", "receptions_lost", 0),
        Shown("collided", "", "collisions", 0),
    )),
    ("Fixes", (
        Shown("made", "", "fixes", 0),
        Shown("too far", "", "fixes_out_of_range", 0),
        Shown("delivered", "", "fixes_delivered", 0),
        Shown("refused", "", "fixes_refused", 0),
        Shown("collided", "", "frame_collisions", 0),
        Shown("latency", "s", "latency_mean_s", 3),
    )),
)  # fmt: skip
AUV_COLUMNS: tuple[Shown, ...] = tuple(column for _, columns in AUV_TABLES for column in columns)
# What a reader asks for first, each of the AUV that it is worst of.
TILES: tuple[Shown, ...] = (
    Shown("mean error", "m", "position_error_m", 2),
    Shown("95 % of the time below", "m", "position_error_p95_m", 2),
    Shown("longest without a fix", "s", "fix_age_max_s", 1),
    Shown("error without any fix", "m", "imu_error_m", 2),
)
# Of the mission as a whole, in a sentence below its AUVs.
OF_MISSION: tuple[Shown, ...] = (
    Shown("HF in use", "%", "hf_utilisation", 1, 100),
    Shown("MF in use", "%", "mf_utilisation", 1, 100),
    Shown("survey covered", "%", "area_covered_share", 1, 100),
    Shown("survey finished at", "s", "survey_finished_at_s", 0),
)


SUMMARY = """<section id="story">
<h2>Why</h2>
$story
<p class="note">This run recorded metrics only (<code>record.detail: summary</code>), so who was
starved when and why cannot be told, and there is nothing to play back. Run it with
<code>--set record.detail=full</code> to see.</p>
</section>
"""


def played(result: "Result") -> tuple[dict[str, Any], str]:
    """Return what a page needs to play a mission: plain data, and the columns packed for it.

    Raises:
        ValueError: when it was not recorded in full.
    """
    if "tracks" not in result.arrow:
        raise ValueError("only what was recorded in full is played; set record.detail to full")
    packer, mission = Packer(), recording(result)
    data = run_data(mission, story(mission).services, packer)
    return data, packer.text()


def run_page(result: "Result") -> str:
    """Return the report of one run as HTML.

    A run recorded with `detail: summary` has no events; its page holds the metrics and says so.
    """
    packer = Packer()
    data: dict[str, Any] = {}
    scripts: tuple[str, ...] = ()
    if "tracks" in result.arrow:
        mission = recording(result)
        tale = story(mission)
        data, scripts = run_data(mission, tale.services, packer), SCRIPTS
        middle = Template(asset("run.html")).substitute(
            story=_why(tale),
            latency=html.escape(spread_text(latencies(mission))),
            interval=html.escape(spread_text(intervals(mission))),
            thinned=_sentences(data["thinned"]),
            calibration=calibration_text(mission),
            envelope=html.escape(envelope_made_of(result.setup)),
        )
        middle += possible_text(mission)
    else:
        tale = short_story(metrics_of(result))
        middle = Template(SUMMARY).substitute(story=_why(tale))
    body = (
        _head(result)
        + _answer(tale)
        + _tiles(result)
        + _described(result)
        + middle
        + warnings_section(result)
        + auv_tables(result)
        + origin(result)
    )
    title = f"{_named(result)}, seed {result.seed}"
    return assembled(title, body, scripts, data, packer.text())


def _head(result: "Result") -> str:
    return f"<header><h1>{html.escape(_named(result))}</h1>{THEME}</header>"


def _described(result: "Result") -> str:
    return (
        f'<p class="note">{html.escape(described(result))}. '
        f"{html.escape(result.setup.drift_words)}</p>"
    )


def _named(result: "Result") -> str:
    """Return the scenario's name, and what was set beside its file (`--set`)."""
    changed = ", ".join(result.overrides)
    return f"{result.scenario.name} with {changed}" if changed else result.scenario.name


def described(result: "Result") -> str:
    """Return in a line who was where for how long, and the seed."""
    scenario, protocol = result.scenario, result.scenario.protocol
    setup = result.setup
    auvs, asvs, area = scenario.auvs, scenario.asvs, setup.area
    over = f"{area.side:g} m by {area.side:g} m" if area.side else area.words
    parts = f"{protocol.rule}, {protocol.downlink} downlink, {protocol.ranging} ranging"
    if protocol.asvs_ping:
        parts = "passive ranging"
    elif protocol.calls:
        parts += " (an AUV pings when an ASV calls it)"
    return (
        f"{counted(auvs.count, 'AUV')} ({auvs.words}) and "
        f"{counted(asvs.count, 'ASV')} ({asvs.words}) over {over} for "
        f"{timed(scenario.duration_s)}; {parts}, {scenario.navigation.filter} navigation; "
        f"seed {result.seed}"
    )


def warnings_section(result: "Result") -> str:
    """Return the section of the scenario's warnings, nothing where there is none."""
    if not result.warnings:
        return ""
    items = "".join(
        filled("<li><code>{key}</code>: {message}</li>", key=warning.key, message=warning.message)
        for warning in result.warnings
    )
    return f'<section id="knowing"><h2>Warnings</h2><ul>{items}</ul></section>'


def _answer(tale: Story) -> str:
    warning = f'<p class="verdict warning">{html.escape(tale.warning)}</p>' if tale.warning else ""
    return f'{warning}<p class="verdict">{html.escape(tale.verdict)}</p>'


def _why(tale: Story) -> str:
    parts = [f"<p>{html.escape(tale.reason)}</p>"] if tale.reason else []
    parts.append('<div class="cards">')
    for heading, paragraphs in tale.sections:
        text = "".join(f"<div>{paragraph}</div>" for paragraph in paragraphs)
        parts.append(f"<article><h3>{html.escape(heading)}</h3>{text}</article>")
    return "".join(parts) + "</div>"


def _sentences(sentences: list[str]) -> str:
    return f'<p class="note">{html.escape(" ".join(sentences))}</p>' if sentences else ""


def worst_first(auvs: Sequence[Row]) -> list[Row]:
    """Return the AUVs' metrics, those of the AUV that navigated worst first."""
    return sorted(auvs, key=lambda row: -(row["position_error_m"] or 0.0))


def _tiles(result: "Result") -> str:
    """Return what was worst in numbers, each with its AUV and the mean of the fleet."""
    row, several = mission_row(result), result.arrow["auvs"].num_rows > 1
    tiles = ""
    for tile in TILES:
        worst = f"{WORST}{tile.metric}"  # older folders lack some
        value, _, unit = told(row.get(worst), tile).partition(" ")
        whose = f"{row.get(f'{worst}_auv')}; fleet {told(row.get(tile.metric), tile)}"
        beside = filled("<dd><small>{whose}</small></dd>", whose=whose) if several else ""
        tiles += (
            f'<div><dt>{tile.words}</dt><dd>{value}<span class="unit">{unit or tile.unit}</span>'
            f"</dd>{beside}</div>"
        )
    return f'<dl class="tiles" aria-label="The worst of the AUVs in numbers">{tiles}</dl>'


def told(value: float | None, column: Shown) -> str:
    """Return a value with its unit, "-" if none; times as :func:`...support.wording.timed`.

    >>> error, age = Shown("error", "m", "", 2), Shown("age", "s", "", 1)
    >>> told(0.834, error), told(13_529.0, age), told(None, error)
    ('0.83 m', '3:45 h', '-')
    """
    if column.unit == "s":
        return timed(value, column.digits)
    text = number(value, column.digits, column.factor)
    return text if value is None else f"{text} {column.unit}".strip()


def cell(value: float | None, column: Shown) -> str:
    """Return a value below the unit of its column, which times from ten minutes on have beside
    them.
    """
    is_long = column.unit == "s" and value is not None and value >= LONG_S
    return timed(value) if is_long else number(value, column.digits, column.factor)


def _differ(auvs: Sequence[Row], metric: str) -> bool:
    return any(row[metric] != auvs[0][metric] for row in auvs)


def mission_row(result: "Result") -> dict[str, Any]:
    """Return the mission's metrics by name."""
    row: dict[str, Any] = result.arrow["mission"].to_pylist()[0]
    return row


def auv_tables(result: "Result") -> str:
    """Return the tables with a row per AUV and the fleet's means; the worst AUV's cells stand out.

    Each is narrow enough for a phone and for a sheet of paper.
    """
    auvs, mission = worst_first(result.arrow["auvs"].to_pylist()), mission_row(result)
    whole = "; ".join(
        f"{column.words} {told(mission[column.metric], column)}"
        for column in OF_MISSION
        if mission.get(column.metric) is not None
    )
    shown = "".join(
        f"<figure><h3>{title}</h3>{_auv_table(title, columns, auvs, mission)}</figure>"
        for title, columns in AUV_TABLES
    )
    return (
        f'<section id="auvs"><h2>Each AUV</h2><p>The mission: {rounds_text(mission)}; {whole}.</p>'
        f'<div class="pair">{shown}</div>'
        '<p class="note">First the AUV that navigated worst; bold: the worst of a column. '
        "Errors are horizontal |estimate &minus; truth|, "
        "means over time; “without fixes” is dead reckoning alone, latency the mean. Intervals are "
        "between delivered fixes; the age of the last fix also counts the waits before the first "
        "and after the last. Of pings “lost” and “collided” count receptions, one ping at one ASV "
        "each; of fixes “too far” are beyond MF range, “refused” those that the AUV's filter did "
        "not believe (<code>navigation.nis_gate</code>), “collided” counts frames that were "
        "destroyed at the AUV.</p></section>"
    )


def _auv_table(title: str, columns: Sequence[Shown], auvs: Sequence[Row], mission: Row) -> str:
    # The mission counts collisions of the whole fleet; a mean beside its AUVs would be another.
    rows = [(str(row["auv"]), row) for row in auvs]
    rows.append(("mean", {**mission, "collisions": None, "frame_collisions": None}))
    cells = [[name, *(cell(row[each.metric], each) for each in columns)] for name, row in rows]
    worst = {
        (place, column): "worst"
        for column, (_, _, metric, *_) in enumerate(columns, 1)
        for place, row in enumerate(auvs)
        if mission.get(f"worst_{metric}_auv") == row["auv"] and _differ(auvs, metric)
    }
    headings = [("AUV", ""), *(each[:2] for each in columns)]
    return table(headings, cells, f"{title} of each AUV", worst)


def origin(result: "Result") -> str:
    """Return the section that says which scenario, seed and version made the run."""
    run, whole = result.run_record(), result.whole_time_s
    versions = ", ".join(f"{name} {number}" for name, number in run["versions"].items())
    leave = result.scenario.leave
    command = f"bindusbl-des run scenario.yaml --seed {result.seed}{leave}"
    text = json.dumps(run["scenario"], indent=2, ensure_ascii=False)
    defaults = dict(leaves(portable(type(result.scenario)(name="x").model_dump(mode="json"))))
    changed = ", ".join(
        f"{key}: {plain(value)}"
        for key, value in leaves(run["scenario"])
        if key != "name" and (key not in defaults or defaults[key] != value)
    )
    return (
        filled(
            '<section id="origin"><h2>What made this run</h2><dl class="origin">'
            "<dt>Scenario</dt><dd>{name}, sha256 <code>{sha256}</code></dd>"
            "<dt>Seed</dt><dd>{seed}</dd><dt>Versions</dt><dd>{versions}</dd>"
            "<dt>Not as the package's defaults</dt><dd>{changed}</dd>"
            "<dt>Computed</dt><dd>{computed} s of computing for {duration} of mission{whole}</dd>"
            "<dt>Again</dt><dd><code>{command}</code> with the scenario.yaml of this folder</dd>"
            "</dl><details><summary>The scenario in full, as JSON (JSON is YAML)</summary>"
            "<pre>{text}</pre></details></section>",
            name=result.scenario.name,
            sha256=run["scenario_sha256"],
            seed=result.seed,
            versions=versions,
            changed=changed or "nothing",
            computed=f"{run['wall_time_s']:.2f}",
            whole=f"; {whole:.2f} s from reading the scenario to this page" if whole else "",
            duration=timed(result.scenario.duration_s),
            command=command,
            text=text,
        )
        + footer()
    )


def footer() -> str:
    """Return the end of a page: what made it."""
    return filled(
        "<footer>Made by bindusbl-des {version}; plots drawn with uPlot (MIT licence, in this "
        "file).</footer>",
        version=version("bindusbl-des"),
    )
