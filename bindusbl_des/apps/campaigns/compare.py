"""Campaigns, or points within one, compared: paired differences with confidence intervals."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ...core.records.metrics import of_an_auv
from ...support.kept_files import portable
from ...support.plain_data import leaves
from ...support.wording import lettered, plain, shortened
from .campaign import Campaign, load_campaign
from .experiments.experiment import laid_over
from .statistics.comparison_table import by_label, is_alone, sentence, unserved
from .statistics.differences import (
    Chosen,
    Difference,
    Pair,
    difference,
    left_out,
    pairs_between,
    pairs_within,
    unpaired,
)
from .statistics.findings import NEEDED, harm_said, harmed, starved_said
from .statistics.outcomes import (
    JUDGED,
    Fleets,
    MissionOutcomes,
    check_metrics,
    fleets,
    outcomes,
    starved,
    unit,
)
from .statistics.points_table import in_intervals
from .storage.folder import CampaignError

if TYPE_CHECKING:
    import pandas as pd

MOST_KEYS_NAMED = 4


@dataclass(frozen=True)
class Comparison:
    """Differences for every pair and metric, the names of the letters A, B, ..., and notes."""

    differences: tuple[Difference, ...]
    labels: Mapping[str, str]
    notes: tuple[str, ...]

    def records(self) -> list[dict[str, Any]]:
        """Return a row for each pair and metric as plain data; None is unknown."""
        return [_record(row) for row in self.differences]

    def frame(self) -> "pd.DataFrame":
        """Return a row for each pair and metric; its `attrs` hold the notes."""
        import pandas as pd

        frame = pd.DataFrame(self.records())
        frame.attrs["notes"] = list(self.notes)
        return frame


def compare(
    campaign: str | Path | Campaign,
    *others: str | Path | Campaign,
    by: str | None = None,
    metrics: Sequence[str] = JUDGED,
    baseline: str | None = None,
) -> "pd.DataFrame":
    """Compare campaigns with the first one, or the points of one campaign along the key `by`.

    Each argument is a campaign or its folder.  A row for each pair of points and metric has both
    means over common seeds, the mean difference with its 95 % interval (Student's t over paired
    differences), and a verdict.  Sentences call the baseline A and the others by their `label`.
    Each mission counts by its worst AUV by default.  `attrs["notes"]` lists caveats, such as points
    without a pair.

    Raises:
        CampaignError: when a folder holds no campaign, or nothing can be compared.
        ValueError: when there is no such metric.
    """
    folders = [
        given.folder if isinstance(given, Campaign) else given for given in (campaign, *others)
    ]
    return compared(folders, by=by, metrics=metrics, baseline=baseline).frame()


def compared(
    folders: Sequence[str | Path],
    *,
    by: str | None = None,
    metrics: Sequence[str] = JUDGED,
    baseline: str | None = None,
    chosen: Mapping[Path, Chosen] = MappingProxyType({}),
) -> Comparison:
    """Return the comparison for :func:`compare`; folders in `chosen` contribute one point each."""
    check_metrics(metrics)
    if len({Path(folder).resolve() for folder in folders}) < len(folders):
        raise CampaignError(f"{folders[-1]}: the same campaign is named twice")
    campaigns = [_campaign(Path(folder)) for folder in folders]
    if len(campaigns) == 1:
        matched = [(campaigns[0], list(pairs_within(campaigns[0], by, baseline)))]
    elif by is not None or baseline is not None:
        raise CampaignError(
            "--by and --baseline compare points within one campaign; name one folder, or leave "
            "them out: the first campaign is the baseline of the others"
        )
    else:
        matched = [
            (other, list(pairs_between(campaigns[0], other, lettered(number), chosen)))
            for number, other in enumerate(campaigns[1:], 1)
        ]
    pairs = [pair for _, them in matched for pair in them]
    alike = [] if chosen else matched  # chosen points leave out all others on purpose
    found = {
        campaign.folder: outcomes(campaign.folder, metrics, len(campaign.plan.points))
        for campaign in campaigns
    }
    served = {folder: _unserved(folder, missions) for folder, missions in found.items()}
    differences = tuple(
        difference(pair, metric, found, served) for pair in pairs for metric in metrics
    )
    if not any(row.missions for row in differences):
        left = "; ".join(left_out(pairs, found))
        why = f"; {left}" if left else ""
        raise CampaignError(f"nothing to compare: no seed has a result at both points{why}")
    notes = (
        *(text for other, them in alike for text in unpaired(campaigns[0], other, them)),
        *left_out(pairs, found), *_versions(campaigns), *_waits(metrics),
        *_harms(campaigns, pairs, _unserved_said(differences)),
        *_contents(campaigns, pairs),
    )  # fmt: skip
    return Comparison(differences, dict(_labels(pairs)), notes)


def _unserved_said(differences: Sequence[Difference]) -> bool:
    """Tell whether the tables of single pairs name AUVs without a value."""
    tables = by_label(differences).values()
    return any(row.lacks for rows in tables for row in rows) and all(map(is_alone, tables))


def _unserved(folder: Path, found: MissionOutcomes) -> Fleets:
    """Return the AUVs of a campaign that lack a value, with these metrics."""
    lacked = [name for name, without in found.unserved.items() if (without & found.ok).any()]
    return fleets(folder, list(dict.fromkeys(map(of_an_auv, lacked))))


def _waits(metrics: Sequence[str]) -> Iterator[str]:
    """Yield which waits the paper's interval metrics leave out."""
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
    """Yield points at which fixes make AUVs worse, and points at which AUVs get none."""
    for number, campaign in enumerate(campaigns):
        points, plan = _points(campaign, pairs), campaign.plan
        found = fleets(campaign.folder, NEEDED)
        said = list(harm_said(harmed(found, plan), plan, points))
        if not is_starved_said:
            said += starved_said(starved(found), plan, points)
        whose = f"{lettered(number)}: " * (len(campaigns) > 1)
        yield from (f"{whose}{text}" for text in said)


def _contents(campaigns: Sequence[Campaign], pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield what the intervals contain, once if it is the same for all campaigns."""
    said = [in_intervals(campaign.plan, _points(campaign, pairs)) for campaign in campaigns]
    if len(set(said)) == 1:
        yield said[0]
    else:
        yield from (f"{lettered(number)}: {text}" for number, text in enumerate(said))


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
    if (folder / "question.json").is_file():
        raise CampaignError(
            f"{folder}: is a plan; compare the campaign of its missions, {folder / 'missions'}, or "
            "its answer with that of another plan: `bindusbl-des compare PLAN OTHER`"
        )
    return load_campaign(folder)


def _versions(campaigns: Sequence[Campaign]) -> Iterator[str]:
    """Yield campaigns of another model version than the first."""
    first = campaigns[0]
    for other in campaigns[1:]:
        one, two = first.record["model_version"], other.record["model_version"]
        if one != two:
            yield f"{first.folder} was run with model {one}, {other.folder} with {two}"


def _labels(pairs: Sequence[Pair]) -> Iterator[tuple[str, str]]:
    """Yield each letter with its name, and its differences from the baseline."""
    for pair in pairs[:1]:
        side = pair.baseline
        yield side.label, f"{pair.key}={side.name}" if pair.key else side.name
    firsts = {pair.other.label: pair for pair in reversed(pairs)}
    for label, pair in sorted(firsts.items(), key=lambda item: pairs.index(item[1])):
        named = f"{pair.key}={pair.other.name}" if pair.key else pair.other.name
        yield label, f"{named}, {_differing(pair)}" if not pair.key else named


def _differing(pair: Pair) -> str:
    """Return the differences between two scenarios, apart from keys that both campaigns vary."""
    flat = []
    for side in (pair.baseline, pair.other):
        experiment = side.campaign.plan.experiment
        scenario = laid_over(experiment.given, experiment.points[side.point])
        flat.append(dict(leaves(portable(scenario.model_dump(mode="json")))))
    one, other = flat
    keys = [key for key in {**one, **other} if one.get(key) != other.get(key)]
    keys = [key for key in keys if key not in ("name", *pair.held)]
    if not keys:
        return "otherwise the same scenario" if pair.held else "the same scenario"
    named = ", ".join(
        f"{key}={shortened(plain(other.get(key)))} instead of {shortened(plain(one.get(key)))}"
        for key in keys[:MOST_KEYS_NAMED]
    )
    more = f" and {len(keys) - MOST_KEYS_NAMED} more keys" * (len(keys) > MOST_KEYS_NAMED)
    return f"{named}{more}"


def _record(row: Difference) -> dict[str, Any]:
    return {
        **row.pair.held,
        "label": row.pair.other.label,
        "baseline": row.pair.baseline.name,
        "other": row.pair.other.name,
        "metric": row.metric,
        "unit": unit(row.metric),
        "missions": row.missions,
        "pairs": row.found.count,
        "baseline_mean": _known(row.baseline.mean),
        "baseline_whole": row.baseline.whole,
        "baseline_worst_auv": next(iter(row.baseline.who), None),
        "other_mean": _known(row.other.mean),
        "other_whole": row.other.whole,
        "other_worst_auv": next(iter(row.other.who), None),
        "difference": _known(row.found.mean),
        "low": _known(row.found.low),
        "high": _known(row.found.high),
        "relative": _known(row.relative),
        "verdict": row.verdict,
        "said": " ".join((sentence(row), *unserved(row))),
    }


def _known(value: float) -> float | None:
    return value if value == value else None
