"""The campaigns of a reproduction: the paper's experiments, and those of joint readings."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bindusbl_des.apps.campaigns.campaign import Campaign, unfinished_campaign
from bindusbl_des.apps.campaigns.experiments.experiment import Experiment, ExperimentPlan, Point
from bindusbl_des.apps.campaigns.experiments.experiment_file import load_experiment
from bindusbl_des.apps.campaigns.running import resume, sweep
from bindusbl_des.apps.campaigns.statistics.outcomes import failed_because
from bindusbl_des.apps.campaigns.storage.folder import RECORD, CampaignError
from bindusbl_des.support.shipped import shipped
from bindusbl_des.support.wording import counted

from .numbers import published
from .readings import SWEEPS, Reading, Sets, readings

# The experiments of the paper: their files, and what a quick look leaves out of them.


def _every_point(_: Point) -> bool:
    return True


def few_teams(point: Point) -> bool:
    """Tell whether a point has the smallest or the largest team of the sweep."""
    return point["auvs.count"] in (3, 10)


def _some_teams(point: Point) -> bool:
    section = point.get("auvs")
    count = section["count"] if section else point["auvs.count"]
    angle = point.get("asvs.formation.angle_deg", 0)
    return count in (2, 4, 6, 8, 10) and angle in (0, 30)


def _some_at_140_m(point: Point) -> bool:
    return _some_teams(point) and point["survey.side_m"] == 140


def _some_readings(point: Point) -> bool:
    return few_teams(point) and point["asvs.formation.angle_deg"] in (0, 30)


@dataclass(frozen=True)
class Entry:
    """One experiment: the name of its file, and the seeds and points of its quick look."""

    name: str
    quick_seeds: int
    quick_points: Callable[[Point], bool] = _every_point


CATALOGUE = (
    Entry("baseline", 5),
    Entry("table_1", 4),
    Entry("two_asvs", 3),
    Entry("trajectories", 3),
    Entry("ablations", 3),
    Entry("downlinks", 1, _some_teams),
    Entry("schedulers_still", 1, _some_teams),
    Entry("schedulers", 1, _some_at_140_m),
    Entry("sweep", 3, few_teams),
    Entry("sweep_distance", 3, few_teams),
    Entry("sweep_readings", 2, _some_readings),
)


def experiments(*, quick: bool) -> Iterator[Experiment]:
    """Yield every experiment; a quick look has fewer seeds and points."""
    for entry in CATALOGUE:
        experiment = load(entry.name)
        if quick:
            points = tuple(point for point in experiment.points if entry.quick_points(point))
            experiment = replace(
                experiment, points=points, seeds=experiment.seeds[: entry.quick_seeds]
            )
        yield experiment


def load(name: str) -> Experiment:
    """Return an experiment of the paper by the name of its file.

    Raises:
        FileNotFoundError: when the files that ship are not where they were installed.
    """
    path = shipped("experiments").get(name)
    if path is None:
        raise FileNotFoundError(f"experiments/{name}.yaml is missing; install bindusbl-des anew")
    return load_experiment(path)


# The campaigns of a reproduction: begun, or continued where an earlier call was cut short.


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
        plan = ExperimentPlan(experiment)
        tell(f"{experiment.name}: {len(plan)} missions")
        campaign = _run(experiment, plan, folder / experiment.name, workers, quiet)
        state = campaign.state()
        if state.failed:
            failures = campaign.folder / "failures"
            failed = counted(state.failed, "mission")
            why = failed_because(campaign.folder)
            raise SomeFailed(f"{experiment.name}: {failed} failed{why}; see {failures}")
        runs[experiment.name] = campaign
    return runs


def _run(
    experiment: Experiment, plan: ExperimentPlan, folder: Path, workers: int | None, quiet: bool
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


# The paper's experiments crossed with joint readings: each distinct mission once.


# The folder, within that of a reproduction, for the campaigns of all joint readings
READINGS_FOLDER = "readings"

ANGLE = "asvs.formation.angle_deg"
SPEED = "auvs.speed_m_per_s"


def _direct(point: Point) -> bool:
    return "protocol.downlink" not in point


def _any(_: Point) -> bool:
    return True


def _published_angles(point: Point) -> bool:
    rows = (row for row in published() if row.source == "sec:case_study")
    return float(point[ANGLE]) in {float(row.angle_deg) for row in rows}


def _not_twice(point: Point) -> bool:
    """Leave out the further angles of one ASV, which is at the centre at any."""
    return bool(point["asvs.count"] > 1 or point[ANGLE] == 0)


def _few(point: Point) -> bool:
    return few_teams(point) and point[ANGLE] in (0, 30)


def _baseline(reading: Reading) -> Iterator[Sets]:
    yield reading.baseline


def _case_study(reading: Reading) -> Iterator[Sets]:
    """Yield the keys for each speed that an AUV has: its numbers are read where all have it.

    What the others' speeds would change is little: flown as recorded tracks, each at its own speed,
    the AUVs of the published numbers have the same fixes but for 1.1, the same coverage but for
    0.007 and the same position error but for 0.08 m (24 seeds, world bias, shifted fixes).
    """
    for speed in dict.fromkeys(map(reading.speed_of, ("AUV0", "AUV1", "AUV2"))):
        yield {**reading.missions, SPEED: speed}


def _sweep(reading: Reading) -> Iterator[Sets]:
    yield reading.missions


@dataclass(frozen=True)
class Crossed:
    """An experiment, which of its points bear on published numbers, and what readings set there."""

    name: str
    sets: Callable[[Reading], Iterator[Sets]]
    keeps: Callable[[Point], bool]
    quick_seeds: int
    seeds: int | None = None
    quick_keeps: Callable[[Point], bool] = _any


# The sweeps have fewer seeds than alone: there are a dozen of each.
CROSSED = (
    Crossed("baseline", _baseline, _direct, 5),
    Crossed("table_1", _case_study, _any, 3),
    Crossed("two_asvs", _case_study, _published_angles, 3),
    Crossed("sweep", _sweep, _not_twice, 2, 8, _few),
    Crossed("sweep_distance", _sweep, _not_twice, 2, 8, _few),
)


def all_readings(*, quick: bool) -> Iterator[Experiment]:
    """Yield the experiments of all joint readings."""
    for crossed in CROSSED:
        yield _crossed(crossed, readings(), quick=quick, seeds=crossed.seeds)


def one_reading(reading: Reading, *, quick: bool) -> Iterator[Experiment]:
    """Yield the experiments of one joint reading, with as many seeds as their files have."""
    unused = set(SWEEPS.values()) - {SWEEPS[reading.sweep]}
    for crossed in CROSSED:
        if crossed.name not in unused:
            yield _crossed(crossed, (reading,), quick=quick, seeds=None)


def _crossed(
    crossed: Crossed, readings: Iterable[Reading], *, quick: bool, seeds: int | None
) -> Experiment:
    experiment = load(crossed.name)
    sets = _distinct(sets for reading in readings for sets in crossed.sets(reading))
    points = [
        point
        for point in experiment.points
        if crossed.keeps(point) and (not quick or crossed.quick_keeps(point))
    ]
    bare = _distinct({k: v for k, v in point.items() if k not in sets[0]} for point in points)
    return replace(
        experiment,
        points=tuple({**point, **keys} for point in bare for keys in sets),
        seeds=experiment.seeds[: crossed.quick_seeds if quick else seeds],
        detail="summary",
    )


def _distinct(sets: Iterable[Point]) -> Sequence[Point]:
    return list({tuple(keys.items()): keys for keys in sets}.values())
