"""Campaigns, or points within one, compared: paired differences with confidence intervals."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .campaign import Campaign, load_campaign
from .experiments.experiment import laid_over
from .statistics.differences import Difference, difference, left_out
from .statistics.outcomes import check_metrics, outcomes, unit
from .statistics.pairing import Pair, pairs_between, pairs_within
from .storage.folder import CampaignError

if TYPE_CHECKING:
    import pandas as pd

# What a mission is for, first; what the network did for it, after.
METRICS = (
    "position_error_m",
    "cross_track_error_m",
    "fix_rate_hz",
    "hf_coverage",
    "latency_mean_s",
)
MOST_KEYS_NAMED = 4


@dataclass(frozen=True)
class Comparison:
    """Differences of every pair and metric, and what must be said with them."""

    differences: tuple[Difference, ...]
    notes: tuple[str, ...]

    def records(self) -> list[dict[str, Any]]:
        """Return a row per pair and metric as plain data; what is not known is None."""
        return [_record(it) for it in self.differences]

    def frame(self) -> "pd.DataFrame":
        """Return a row per pair and metric."""
        import pandas as pd

        return pd.DataFrame(self.records())


def compare(
    campaign: str | Path,
    *others: str | Path,
    by: str | None = None,
    metrics: Sequence[str] = METRICS,
    baseline: str | None = None,
) -> "pd.DataFrame":
    """Compare campaigns with the first one, or the points of one campaign along the key `by`.

    A row per pair of points and metric: means of both over the seeds that both have, the mean
    difference, its 95 % interval (Student's t over paired differences), and what that shows.

    Raises:
        CampaignError: when a folder is no campaign's, or nothing in them can be compared.
        ValueError: when there is no such metric.
    """
    return compared([campaign, *others], by=by, metrics=metrics, baseline=baseline).frame()


def compared(
    folders: Sequence[str | Path],
    *,
    by: str | None = None,
    metrics: Sequence[str] = METRICS,
    baseline: str | None = None,
) -> Comparison:
    """Return what `compare` tabulates, with notes on what was left out."""
    check_metrics(metrics)
    if len({Path(folder).resolve() for folder in folders}) < len(folders):
        raise CampaignError(f"{folders[-1]}: the same campaign is named twice")
    campaigns = [_campaign(Path(folder)) for folder in folders]
    if len(campaigns) == 1:
        pairs = list(pairs_within(campaigns[0], by, baseline))
    elif by is not None or baseline is not None:
        raise CampaignError(
            "--by and --baseline compare points within one campaign; name one folder, or leave "
            "them out: the first campaign is the baseline of the others"
        )
    else:
        pairs = [pair for other in campaigns[1:] for pair in pairs_between(campaigns[0], other)]
    found = {campaign.folder: outcomes(campaign.folder, metrics) for campaign in campaigns}
    differences = tuple(difference(pair, metric, found) for pair in pairs for metric in metrics)
    if all(it.found.count == 0 for it in differences):
        raise CampaignError("nothing to compare: no seed has a result at both points of a pair")
    return Comparison(differences, (*left_out(pairs, found), *_differing(campaigns, pairs)))


def _campaign(folder: Path) -> Campaign:
    if (folder / "run.json").is_file():
        raise CampaignError(
            f"{folder}: is one mission, and chance alone makes two missions differ; sweep seeds "
            "(`bindusbl-des sweep SCENARIO.yaml --seeds 20 --out DIR`) and compare the campaigns, "
            "or see missions side by side with `bindusbl-des report A B`"
        )
    return load_campaign(folder)


def _differing(campaigns: Sequence[Campaign], pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield in what the campaigns differ besides their folders."""
    first = campaigns[0]
    for other in campaigns[1:]:
        one, two = first.record["model_version"], other.record["model_version"]
        if one != two:
            yield f"{first.folder} was run with model {one}, {other.folder} with {two}"
        pair = next(pair for pair in pairs if pair.other.campaign is other)
        keys = [key for key in _keys_that_differ(pair) if key != "name"]
        named = ", ".join(keys[:MOST_KEYS_NAMED])
        more = f" and {len(keys) - MOST_KEYS_NAMED} more keys" * (len(keys) > MOST_KEYS_NAMED)
        what = f"differ in {named}{more}" if keys else "have the same scenario"
        yield f"{first.folder} and {other.folder} {what}"


def _keys_that_differ(pair: Pair) -> list[str]:
    flat = []
    for side in (pair.baseline, pair.other):
        experiment = side.campaign.plan.experiment
        scenario = laid_over(experiment.given, experiment.points[side.point])
        flat.append(dict(_leaves(scenario.model_dump(mode="json"), "")))
    one, other = flat
    return [key for key in {**one, **other} if one.get(key) != other.get(key)]


def _leaves(data: Any, name: str) -> Iterator[tuple[str, Any]]:
    if not isinstance(data, dict):
        yield name, data
        return
    for key, value in data.items():
        yield from _leaves(value, f"{name}.{key}" if name else key)


def _record(it: Difference) -> dict[str, Any]:
    return {
        **it.pair.held,
        "baseline": it.pair.baseline.name,
        "other": it.pair.other.name,
        "metric": it.metric,
        "unit": unit(it.metric),
        "pairs": it.found.count,
        "baseline_mean": _known(it.baseline),
        "other_mean": _known(it.other),
        "difference": _known(it.found.mean),
        "low": _known(it.low),
        "high": _known(it.high),
        "relative": _known(it.relative),
        "verdict": it.verdict,
    }


def _known(value: float) -> float | None:
    return value if value == value else None
