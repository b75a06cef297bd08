"""Recorded tracks of vehicles: CSV, GPX and MCAP files, in metres or in degrees."""

import os
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.wording import shortened
from .csv_tracks import read_csv
from .gpx import read_gpx
from .mcap_tracks import read_mcap
from .samples import Sample
from .shapes import BadChart

Array = NDArray[np.float64]

READERS: Mapping[str, Callable[[str], Iterator[tuple[str, Sample]]]] = {
    ".csv": read_csv,
    ".gpx": read_gpx,
    ".mcap": read_mcap,
}
# Of the tracks in a file so many are named.
MOST_NAMED = 8


class Recording(NamedTuple):
    """A recorded track of n samples.

    `times` (n,), s, by whatever clock, rise strictly; `places` (n, 2) are x and y (m) or, if
    `in_degrees`, latitude and longitude; `depths` (n,), m, are nan where the file says none, and
    below the ellipsoid, not the sea, if `below_ellipsoid`.  `told` (n,) names the place of each
    sample in the file.
    """

    times: Array
    places: Array
    depths: Array
    in_degrees: bool
    told: tuple[str, ...]
    below_ellipsoid: bool = False

    @property
    def lacks_depths(self) -> bool:
        """Whether the file does not say how deep some of it is."""
        return bool(np.isnan(self.depths).any())


def read_recording(path: str | Path, which: str = "") -> Recording:
    """Return a recorded track; `which` names one of several in the file.

    A track is named by the column `vehicle` of a CSV, the name of a track of a GPX, the topic of
    an MCAP.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    try:
        found = os.stat(path)
    except OSError as error:
        raise BadChart(f"{path}: cannot be read as a track: {error}") from None
    return _read(str(path), which, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=64)
def _read(path: str, which: str, _changed_at: int, _size: int) -> Recording:
    """Return what is in a file; one that has not changed since is not read again."""
    return _recording(path, _chosen(path, _tracks(path), which))


def check_tracks(path: str) -> None:
    """Refuse a file in which there can be no track, whichever of them is meant.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    tracks = _tracks(path)
    if len(tracks) < 2:
        _recording(path, _chosen(path, tracks, ""))


def _tracks(path: str) -> dict[str, list[Sample]]:
    read = READERS.get(Path(path).suffix.lower(), read_csv)
    tracks: dict[str, list[Sample]] = {}
    for name, sample in read(path):
        tracks.setdefault(name, []).append(sample)
    return tracks


def _chosen(path: str, tracks: dict[str, list[Sample]], which: str) -> list[Sample]:
    if not which and len(tracks) < 2:
        return next(iter(tracks.values()), [])
    if which in tracks:
        return tracks[which]
    named = ", ".join(map(repr, list(tracks)[:MOST_NAMED]))
    more = f" and {len(tracks) - MOST_NAMED} more" if len(tracks) > MOST_NAMED else ""
    asked = f"no track {shortened(repr(which))}; " if which else ""
    raise BadChart(
        f"{path}: {asked}holds {named or 'no track'}{more}; name one for each AUV in "
        "auvs.route.tracks"
    )


def _recording(path: str, samples: list[Sample]) -> Recording:
    if len(samples) < 2:
        raise BadChart(f"{path}: has {len(samples)} samples; a track needs at least two")
    numbers = np.array([(it.time, *it.place, it.depth) for it in samples])
    stuck = np.flatnonzero(np.diff(numbers[:, 0]) <= 0.0)
    if len(stuck):
        first = int(stuck[0])
        raise BadChart(
            f"{samples[first + 1].told}: time_s must increase, but this sample "
            f"({numbers[first + 1, 0]:.15g} s) does not follow {numbers[first, 0]:.15g} s"
        )
    numbers.setflags(write=False)
    told = tuple(it.told for it in samples)
    kind = samples[0]
    return Recording(
        times=numbers[:, 0],
        places=numbers[:, 1:3],
        depths=numbers[:, 3],
        in_degrees=kind.in_degrees,
        told=told,
        below_ellipsoid=kind.below_ellipsoid,
    )
