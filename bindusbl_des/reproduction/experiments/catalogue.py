"""The experiments of the paper: their files, and what a quick look leaves out of them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from ...campaigns.experiments.experiment import Experiment, Point
from ...campaigns.experiments.experiment_file import load_experiment
from ...scenario.files.shipped import shipped


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
