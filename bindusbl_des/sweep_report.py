"""The report of a campaign: what it varied, what came of it, how sure that is, and what failed."""

import html
import json
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from .report.packing import Packer
from .report.page import assembled, asset, table
from .sweep_data import (
    Statistics,
    described,
    keys,
    labels,
    point_statistics,
    quantum,
    value_numbers,
    written,
)
from .tables import mission_numbers

if TYPE_CHECKING:
    from .campaigns.campaign import Campaign

SCRIPTS = ("plots.js", "heatmap.js", "lookup.js", "sweep.js")

# Metrics of a mission that a reader asks for first.
FIRST = ("position_error_m", "position_error_p95_m", "hf_coverage", "fixes_delivered")
# More failures than this are counted, and found in the folder.
MOST_FAILURES = 200
# A point counts as accurate when it is surely below this (m).
SUB_METRE = 1.0


def sweep_page(campaign: "Campaign") -> str:
    """Return the report of a campaign, finished or not, as HTML."""
    packer = Packer()
    metrics = [*FIRST, *(name for name in mission_numbers() if name not in FIRST)]
    found = point_statistics(campaign, metrics)
    data = {
        "keys": keys(campaign),
        "metrics": described(metrics),
        "points": [packer.add(column) for column in value_numbers(campaign)],
        "seeds": len(campaign.plan.experiment.seeds),
        "statistics": {
            name: {
                "mean": packer.add(found[name]["mean"], quantum=quantum(found[name]["mean"])),
                "half": packer.add(found[name]["half"], quantum=quantum(found[name]["half"])),
            }
            for name in metrics
        },
        "count": packer.add(found[FIRST[0]]["count"]),
    }
    failures = _failures(campaign)
    body = (
        _head(campaign)
        + f'<section id="story"><h2>What this sweep found</h2>{_story(campaign, found)}</section>'
        + asset("sweep.html")
        + _failure_section(campaign, failures)
        + _origin(campaign)
    )
    return assembled(f"{campaign.record['name']}: sweep", body, SCRIPTS, data, packer.text())


def _head(campaign: "Campaign") -> str:
    state, seeds = campaign.state(), len(campaign.plan.experiment.seeds)
    return (
        f"<header><div><h1>{html.escape(campaign.record['name'])}</h1><p>"
        f"{len(campaign.plan.points)} points with {seeds} seed{'s' * (seeds != 1)} each: "
        f"{state.done} missions done, {state.failed} failed, {state.missing} missing</p></div>"
        f"{asset('theme.html')}</header>"
    )


def _story(campaign: "Campaign", found: Statistics) -> str:
    error = found[FIRST[0]]
    if not np.isfinite(error["mean"]).any():
        return '<p class="verdict">No mission has gone well yet.</p>'
    best = int(np.nanargmin(error["mean"]))
    sure = int(np.sum(error["mean"] + error["half"] < SUB_METRE))
    settings = ", ".join(f"{k} {written(v)}" for k, v in campaign.plan.points[best].varied.items())
    said = (
        f"Smallest mean position error: {_interval(error, best)} m, at "
        f"{html.escape(settings) or 'the only point'} (point {best}). {sure} of "
        f"{len(campaign.plan.points)} points are surely below {SUB_METRE:g} m "
        "(upper end of their 95 % intervals)."
    )
    effects = sorted(_effects(campaign, error["mean"]), reverse=True)
    items = "".join(f"<li>{html.escape(text)}</li>" for _, text in effects)
    heading = "<p>Mean position error by one key, averaged over the others:</p>"
    return f'<p class="verdict">{said}</p>' + (f"{heading}<ul>{items}</ul>" if items else "")


def _interval(found: dict[str, np.ndarray], point: int) -> str:
    half = found["half"][point]
    return f"{found['mean'][point]:.3f}" + (f" &plusmn; {half:.3f}" if np.isfinite(half) else "")


def _effects(campaign: "Campaign", error: np.ndarray) -> list[tuple[float, str]]:
    """Return of each key how much the error differs between its values, and that in words."""
    effects = []
    for key, numbers in zip(campaign.plan.columns, value_numbers(campaign), strict=True):
        shown, places = labels(campaign, key), np.array(numbers)
        known = [n for n in range(len(shown)) if np.isfinite(error[places == n]).any()]
        if len(known) < 2 or len(shown) > len(places) / 2:  # sampled: no value comes twice
            continue
        means = [float(np.nanmean(error[places == n])) for n in known]
        low, high = int(np.argmin(means)), int(np.argmax(means))
        text = (
            f"{key}: {means[low]:.2f} m at {shown[known[low]]}, "
            f"{means[high]:.2f} m at {shown[known[high]]}"
        )
        effects.append((means[high] - means[low], text))
    return effects


def _failures(campaign: "Campaign") -> list[dict[str, Any]]:
    paths = (campaign.folder / "failures").glob("*.json")
    found = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    return sorted(found, key=lambda it: int(it["mission"]))


def _failure_section(campaign: "Campaign", failures: list[dict[str, Any]]) -> str:
    if not failures:
        return '<section id="failures"><h2>Failures</h2><p>No mission failed.</p></section>'
    rows = [
        [str(it["mission"]), _settings(it["varied"]), str(it["seed"]), it["error"], it["reproduce"]]
        for it in failures[:MOST_FAILURES]
    ]
    headings = [(name, "") for name in ("mission", "point", "seed", "error", "to see it again")]
    more = len(failures) - len(rows)
    rest = f"<p>{more} more are in the folder failures/.</p>" if more else ""
    shown = table(headings, rows, "Missions that failed")
    return (
        f'<section id="failures" class="texts"><h2>Failures</h2><p>{len(failures)} missions failed.'
        f"</p>{shown}{rest}</section>"
    )


def _settings(varied: dict[str, Any]) -> str:
    return ", ".join(f"{key}={written(value)}" for key, value in varied.items())


def _origin(campaign: "Campaign") -> str:
    record = campaign.record
    versions = ", ".join(f"{name} {number}" for name, number in record["versions"].items())
    seeds = ", ".join(map(str, campaign.plan.experiment.seeds[:40]))
    more = ", ..." if len(campaign.plan.experiment.seeds) > 40 else ""
    text = json.dumps(record["scenario"], indent=2, ensure_ascii=False)
    return (
        '<section id="origin"><h2>What made this sweep</h2><dl class="origin">'
        f"<dt>Base scenario</dt><dd>{html.escape(record['scenario']['name'])}, sha256 "
        f"<code>{record['scenario_sha256']}</code></dd>"
        f"<dt>Plan</dt><dd>sha256 <code>{record['plan_sha256']}</code></dd>"
        f"<dt>Seeds</dt><dd>{seeds}{more}</dd>"
        f"<dt>Versions</dt><dd>{html.escape(versions)}</dd></dl>"
        "<details><summary>The base scenario in full, as JSON (JSON is YAML)</summary>"
        f"<pre>{html.escape(text)}</pre></details></section>"
        f"<footer>Made by bindusbl-des {html.escape(version('bindusbl-des'))}; plots drawn with "
        "uPlot (MIT licence, in this file).</footer>"
    )
