"""The paper's experiments crossed with joint readings: each distinct mission once."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from ...campaigns.experiments.experiment import Experiment, Point
from ..experiments.catalogue import few_teams, load
from ..published import published
from .readings import SWEEPS, Reading, Sets, readings

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
