"""Campaigns, or points within one, compared: paired differences with confidence intervals."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.kept_files import portable
from .campaign import Campaign, load_campaign
from .experiments.experiment import laid_over
from .statistics.comparison_table import sentence, unserved
from .statistics.contents import in_intervals
from .statistics.differences import Difference, difference, left_out
from .statistics.findings import harm_said, starved_said
from .statistics.fleets import Fleets, fleets, starved
from .statistics.harm import NEEDED, harmed
from .statistics.judging import JUDGED, of_an_auv
from .statistics.outcomes import Outcomes, check_metrics, outcomes, unit
from .statistics.pairing import Pair, pairs_between, pairs_within
from .storage.folder import CampaignError

if TYPE_CHECKING:
    import pandas as pd

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
    campaign: str | Path | Campaign,
    *others: str | Path | Campaign,
    by: str | None = None,
    metrics: Sequence[str] = JUDGED,
    baseline: str | None = None,
) -> "pd.DataFrame":
    """Compare campaigns with the first one, or the points of one campaign along the key `by`.

    Each is a campaign or its folder.  A row per pair of points and metric: means of both over the
    seeds that both have, the mean difference, its 95 % interval (Student's t over paired
    differences), and what that shows.  Each mission counts by its worst AUV unless other metrics
    are asked for.

    Raises:
        CampaignError: when a folder is no campaign's, or nothing in them can be compared.
        ValueError: when there is no such metric.
    """
    folders = [it.folder if isinstance(it, Campaign) else it for it in (campaign, *others)]
    return compared(folders, by=by, metrics=metrics, baseline=baseline).frame()


def compared(
    folders: Sequence[str | Path],
    *,
    by: str | None = None,
    metrics: Sequence[str] = JUDGED,
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
    served = {folder: _unserved(folder, it) for folder, it in found.items()}
    differences = tuple(
        difference(pair, metric, found, served) for pair in pairs for metric in metrics
    )
    if not any(it.missions for it in differences):
        raise CampaignError("nothing to compare: no seed has a result at both points of a pair")
    notes = (
        *left_out(pairs, found), *_differing(campaigns, pairs), *_waits(metrics),
        *_harms(campaigns, pairs, any(it.verdict == "unserved" for it in differences)),
        *_contents(campaigns, pairs),
    )  # fmt: skip
    return Comparison(differences, notes)


def _unserved(folder: Path, found: Outcomes) -> Fleets:
    """Return the AUVs of a campaign where some have no value, with what they lack."""
    lacked = [name for name, without in found.unserved.items() if (without & found.ok).any()]
    return fleets(folder, list(dict.fromkeys(map(of_an_auv, lacked))))


def _waits(metrics: Sequence[str]) -> Iterator[str]:
    """Yield what the paper's intervals leave out, where they are compared."""
    named = [name for name in metrics if of_an_auv(name).startswith("interval_")]
    if named:
        ages = named[0].replace("interval_", "fix_age_")
        yield (
            f"{named[0]} counts the waits between fixes alone, not that before the first nor that "
            f"after the last; {ages} counts all"
        )


def _harms(
    campaigns: Sequence[Campaign], pairs: Sequence[Pair], is_starved_said: bool
) -> Iterator[str]:
    """Yield at which of the points fixes make AUVs worse, and at which AUVs get none."""
    for campaign in campaigns:
        points, plan = _points(campaign, pairs), campaign.plan
        found = fleets(campaign.folder, NEEDED)
        said = list(harm_said(harmed(found, plan), plan, points))
        if not is_starved_said:
            said += starved_said(starved(found), plan, points)
        yield from (f"{campaign.folder}: {text}" if len(campaigns) > 1 else text for text in said)


def _contents(campaigns: Sequence[Campaign], pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield what the intervals contain, once where that is the same of all campaigns."""
    said = {it.folder: in_intervals(it.plan, _points(it, pairs)) for it in campaigns}
    if len(set(said.values())) == 1:
        yield said[campaigns[0].folder]
    else:
        yield from (f"{folder}: {text}" for folder, text in said.items())


def _points(campaign: Campaign, pairs: Sequence[Pair]) -> list[int]:
    sides = [side for pair in pairs for side in (pair.baseline, pair.other)]
    return sorted({side.point for side in sides if side.campaign is campaign})


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
        flat.append(dict(_leaves(portable(scenario.model_dump(mode="json")), "")))
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
        "missions": it.missions,
        "pairs": it.found.count,
        "baseline_mean": _known(it.baseline.mean),
        "baseline_whole": it.baseline.whole,
        "baseline_worst_auv": next(iter(it.baseline.who), None),
        "other_mean": _known(it.other.mean),
        "other_whole": it.other.whole,
        "other_worst_auv": next(iter(it.other.who), None),
        "difference": _known(it.found.mean),
        "low": _known(it.low),
        "high": _known(it.high),
        "relative": _known(it.relative),
        "verdict": it.verdict,
        "said": " ".join((sentence(it), *unserved(it))),
    }


def _known(value: float) -> float | None:
    return value if value == value else None
