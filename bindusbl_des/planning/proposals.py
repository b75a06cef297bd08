"""Teams that are proposed where the user varies nothing of the kind: numbers, places, protocols.

Places are chosen first, for each number of ASVs by themselves; other schedules and downlinks are
then tried with the best of them.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import Any

from ..advice.stations import Ways
from ..core.wording import counted
from ..scenario import declared
from ..scenario.scenario import Scenario
from ..setup import Setup
from .candidates import (
    COUNT,
    DOWNLINK,
    FORMATION,
    PLACEMENT,
    REPLY,
    SCHEDULE,
    SHORTEST_SLOT,
    Candidate,
    Keys,
    Predictor,
    candidate,
    place_keys,
    placed,
    ring_keys,
    unplaced,
)
from .placement import free_places
from .question import Question

# Proposed where the user varies nothing of the kind.
COUNTS = range(1, 7)
SCHEDULES = tuple(name for name, traits in declared.SCHEDULES.items() if traits.is_proposed)
DOWNLINKS = tuple(declared.DOWNLINKS)

# Of all pairs of these so many at most are flown beside the scenario's own: those predicted to be
# best.
MOST_PROTOCOLS = 3

# Regular formations of one number of ASVs that are predicted: radii up to the survey's corner, and
# angles between two that look alike.
RADII, ANGLES = 8, 4
# Of so many numbers of ASVs at so many points these are predicted; of more, coverage alone decides.
MOST_PREDICTED = 60

# More ASVs than these stay where their scenario has them.
MOST_PLACED = 50


def proposed(
    question: Question, predictor: Predictor, on_progress: Callable[[str], object]
) -> list[Candidate]:
    """Return all candidates of a plan: the user's points, each with what is proposed to go with it.

    `on_progress` is called with how far that is; by default nobody hears it.

    Raises:
        ValueError: when none of them is a valid scenario.
    """
    points = [_physical(question, point) for point in question.experiment.points]
    each = 1 if question.listed else len(COUNTS)
    widely = len(points) * each > MOST_PREDICTED
    found: list[Candidate | None] = []
    for number, point in enumerate(points, start=1):
        on_progress(f"proposing teams, {number} of {counted(len(points), 'choice')}")
        about = _as_listed if question.listed else _about
        found += about(question, predictor, point, widely)
    unlike = {team.scenario.model_dump_json(): team for team in reversed(found) if team is not None}
    return list(unlike.values())[::-1]


def _as_listed(
    question: Question, predictor: Predictor, point: Keys, widely: bool
) -> Iterator[Candidate | None]:
    """Yield a whole point as it was listed, and its vessels elsewhere where nobody says where they
    are to be, neither the point nor the scenario.
    """
    team = candidate(question, point)
    given = question.experiment.given.get("asvs", {})
    if team is not None and not (_is_placed(point) or given.get("formation")):
        yield from (team, *_placed(question, predictor, team, widely))
    else:
        yield team


def _is_placed(point: Keys) -> bool:
    """Tell whether a point says where vessels are to be, more than by the kind of placement."""
    return any(key.startswith(FORMATION) and key != PLACEMENT for key in point)


def _physical(question: Question, point: Keys) -> Keys:
    """Return a point whose direct replies take airtime: without, no modem can give them."""
    return {**point, REPLY: "frame"} if is_instant(question, point) else point


def is_instant(question: Question, point: Keys) -> bool:
    """Tell whether the user asks for direct replies without airtime."""
    team = candidate(question, point)
    return team is not None and not team.scenario.protocol.answer.takes_airtime


def _about(
    question: Question, predictor: Predictor, point: Keys, widely: bool
) -> Iterator[Candidate | None]:
    """Yield the candidates of one point."""
    base = candidate(question, point)
    if base is None:
        return
    for count in _counts(base.scenario, point):
        team = candidate(question, {**point, **count})
        if team is None:  # positions for another number of ASVs: they have to be placed anew
            team = candidate(question, {**point, **count, **unplaced(question)})
        if team is None:
            continue
        places = [team]
        # Where only the kind of placement varies, each is placed as well as if nobody had named it.
        if not _is_placed(point):
            places += _placed(question, predictor, team, widely)
        yield from places
        best = min(places, key=predictor.rank)
        others = [
            candidate(question, {**best.keys, **protocol})
            for protocol in _protocols(base.setup, point)
        ]
        ranked = sorted(filter(None, others), key=predictor.rank)[:MOST_PROTOCOLS]
        yield from _unlike([best, *ranked], predictor)


def _counts(scenario: Scenario, point: Keys) -> Iterator[dict[str, Any]]:
    """Yield the numbers of ASVs to try; none but the user's where he varies it, or places them."""
    varied = COUNT in point or f"{FORMATION}.positions_m" in point or FORMATION in point
    placement = scenario.asvs.formation
    if varied or (placement.moored is None and not placement.moves):
        yield {}
        return
    yield from ({COUNT: count} for count in COUNTS)


def _placed(
    question: Question, predictor: Predictor, team: Candidate, widely: bool
) -> Iterator[Candidate]:
    """Yield the best regular formations of a team, for coverage and for what is predicted, and the
    places that cover most.
    """
    if team.scenario.asvs.formation.moored is None or team.asvs > MOST_PLACED:
        return
    if team.asvs > 1:
        ring = ring_keys(question, *Ways(team.scenario).best(team.asvs))
        yield from _those(placed(question, team.keys, ring))
    inputs = predictor.inputs(team.scenario)
    if widely or inputs is None:
        return
    if team.asvs > 1:
        keys = (ring_keys(question, *ring) for ring in _rings(team))
        rings = _those(*(placed(question, team.keys, ring) for ring in keys))
        yield from sorted(rings, key=predictor.rank)[:1]
    free = place_keys(question, free_places(team.setup, team.asvs, "coverage", inputs))
    yield from _those(placed(question, team.keys, free))


def _unlike(teams: Sequence[Candidate], predictor: Predictor) -> Iterator[Candidate]:
    """Yield all but the first of teams that differ in their protocols alone, without those whose
    schedule is predicted to change nothing: where no two AUVs ever ping together, it has nothing
    to choose.
    """
    known = set[tuple[str, bytes]]()
    for number, team in enumerate(teams):
        prediction = predictor.prediction(team)
        if prediction is not None:
            found = (
                str(team.scenario.protocol.downlink),
                b"".join(array.tobytes() for array in prediction),
            )
            if found in known:
                continue
            known.add(found)
        if number:
            yield team


def _those(*found: Candidate | None) -> list[Candidate]:
    return [team for team in found if team is not None]


def _rings(team: Candidate) -> Iterator[tuple[float, float]]:
    """Yield radii (m) and angles (deg) of regular formations."""
    area = team.setup.area
    corner = max(math.dist(area.centroid, place) for place in area.outline)
    radii = [float(f"{corner * k / RADII:.3g}") for k in range(1, RADII + 1)]
    angles = [round(360 * k / team.asvs / ANGLES, 1) for k in range(ANGLES)]
    yield from product(radii, angles)


def _protocols(setup: Setup, point: Keys) -> Iterator[dict[str, Any]]:
    """Yield the schedules and downlinks to try besides those of the scenario, and downlink slots
    that are no longer than their frames and guards; not where the user names both of the first.
    """
    scenario = setup.scenario
    protocol = scenario.protocol
    if protocol.asvs_ping:  # nobody is scheduled or told
        return
    own = protocol.schedule, protocol.downlink
    is_alone = scenario.auvs.count == 1
    schedules = own[:1] if SCHEDULE in point or is_alone else dict.fromkeys((own[0], *SCHEDULES))
    downlinks = own[1:] if DOWNLINK in point else dict.fromkeys((own[1], *DOWNLINKS))
    is_named = {SCHEDULE, DOWNLINK} <= point.keys() or SHORTEST_SLOT in point
    waits = not is_named and _waits(setup)
    for schedule, downlink in product(schedules, downlinks):
        changed = {SCHEDULE: (schedule, own[0]), DOWNLINK: (downlink, own[1])}
        keys = {key: new for key, (new, old) in changed.items() if new != old}
        yield from [keys] if keys else []
        if waits and not declared.downlink_named(downlink).replies:
            yield {**keys, SHORTEST_SLOT: 0.0}


def _waits(setup: Setup) -> bool:
    """Tell whether downlink slots last longer than a frame of all fixes and its guard, as nobody
    has asked for: by default they are ten times what sound takes across the survey.
    """
    scenario = setup.scenario
    slots = setup.slots
    is_asked = scenario.protocol.shortest_downlink_slot_s is not None
    return not is_asked and slots.shortest_downlink > slots.frame_slot(scenario.auvs.count)
