"""What is wrong with recorded tracks of a scenario: they cannot be read, or lie beside its time."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

from ..agreement.problem import Problem
from ..on_earth import recorded_track, vessel_track
from ..scenario import Scenario
from ..sections.anchors import AsvTrack
from ..sections.routes import Track

if TYPE_CHECKING:
    from ...vehicles.tracks import Track as RecordedTrack


def misplaced_tracks(scenario: Scenario) -> Iterator[Problem]:
    """Yield which tracks begin after the mission's end, or have ended before its start."""
    route, placement = scenario.auvs.route, scenario.asvs.formation
    if isinstance(route, Track):
        yield from _misplaced(
            scenario, "auvs.route", route, partial(recorded_track, scenario, route)
        )
    if isinstance(placement, AsvTrack):
        read = partial(vessel_track, scenario, placement)
        yield from _misplaced(scenario, "asvs.formation", placement, read)


def _misplaced(
    scenario: Scenario,
    section: str,
    asked: Track | AsvTrack,
    read: "Callable[[int], RecordedTrack]",
) -> Iterator[Problem]:
    from ...vehicles.tracks import misplaced

    behind, tracks = ("duration_s", f"{section}.time_offset_s"), []
    for number in range(len(asked.files)):
        try:
            tracks.append(read(number))
        except ValueError as error:
            yield Problem(f"{section}.files.{number}", str(error), behind)
    if len(tracks) < len(asked.files):
        return
    offset, lasts = asked.time_offset_s, scenario.duration_s
    for number, message in misplaced(tracks, offset, lasts, section):
        yield Problem(f"{section}.files.{number}", message, behind)
