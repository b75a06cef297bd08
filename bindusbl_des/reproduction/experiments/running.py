"""The campaigns of a reproduction: begun, or continued where an earlier call was cut short."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from ...campaigns.campaign import Campaign, unfinished_campaign
from ...campaigns.experiments.experiment import Experiment
from ...campaigns.experiments.plan import Plan
from ...campaigns.running import resume, sweep
from ...campaigns.storage.folder import RECORD, CampaignError

Runs = Mapping[str, Campaign]


class SomeFailed(RuntimeError):
    """Missions failed, so that there is no number to compare."""


def run_all(
    experiments: Iterable[Experiment],
    folder: Path,
    *,
    workers: int | None = None,
    quiet: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> Runs:
    """Run every experiment as a campaign in ``folder/<name>``; return them by name.

    Campaigns that are complete are read, those cut short continued.

    Raises:
        CampaignError: when a folder holds something else.
        CampaignInterrupted: when the user stopped it; the next call continues.
        SomeFailed: when a mission failed.
    """
    runs: dict[str, Campaign] = {}
    for experiment in experiments:
        plan = Plan(experiment)
        tell(f"{experiment.name}: {len(plan)} missions")
        campaign = _run(experiment, plan, folder / experiment.name, workers, quiet)
        state = campaign.state()
        if state.failed:
            failures = campaign.folder / "failures"
            raise SomeFailed(f"{experiment.name}: {state.failed} missions failed; see {failures}")
        runs[experiment.name] = campaign
    return runs


def _run(
    experiment: Experiment, plan: Plan, folder: Path, workers: int | None, quiet: bool
) -> Campaign:
    if not (folder / RECORD).is_file():
        return sweep(experiment, folder, workers=workers, quiet=quiet)
    campaign = unfinished_campaign(folder)
    if campaign.record["plan_sha256"] != plan.fingerprint():
        raise CampaignError(
            f"{folder}: holds other missions than `reproduce` would run (of another version, "
            "another reading, or with and without --quick); name another folder, or remove it"
        )
    if not campaign.state().missing:
        return campaign
    return resume(folder, workers=workers, quiet=quiet)
