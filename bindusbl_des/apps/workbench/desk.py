"""A scenario file and all that it was: undone, redone, and there again after a kill."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from ...support.files import read_json, write_text
from ...support.plain_data import Path as KeyPath
from ...support.plain_data import leaves, path_of
from ...support.plain_yaml import read_text, read_yaml
from ...support.wording import file_name
from ...support.yaml_edits import REMOVED, edited

# So many states of a file are kept.
MOST_KEPT = 500

STARTER = """\
# Drawn in the workbench; `bindusbl-des params` lists every key.
name: my_survey
duration_s: survey
survey: {side_m: 300, depth_m: 12}
auvs:
  count: 3
  speed_m_per_s: 1.5
  route: {kind: lawnmower, lane_spacing_m: 25, division: equal_length, start: strip_corner}
asvs:
  count: 2
  formation: {positions_m: [[-60, -80], [60, 80]]}
acoustics:
  hf: {range_m: 250}
  mf: {range_m: 500}
usbl: {heading_sd_deg: 0.5, gnss_sd_m: 0.5}
navigation:
  initial_position_sd_m: 3
  drift: {percent_of_distance: 0.5, statistic: cep}
"""

Change = tuple[KeyPath, Any]
Point = Sequence[float]


class Ground(Protocol):
    """What is drawn on: a setup, or the site of keys that do not agree (`Source.sketch`)."""

    scenario: Any

    @property
    def area(self) -> Any:
        """The area that is surveyed, with its `outline` (n, 2), m."""

    @property
    def land(self) -> Any:
        """Land, with its `polygons`, each its rings of corners (m); None without any."""

    @property
    def keep_out(self) -> Any:
        """Water where nobody goes, likewise."""

    @property
    def origin_deg(self) -> tuple[float, float] | None:
        """Latitude and longitude (deg) of x = y = 0; None where that is nowhere on Earth."""

    @property
    def kept_stations_m(self) -> Sequence[Sequence[float]]:
        """Places (n, 2), m, of vessels that keep theirs."""


class Stale(ValueError):
    """A change was made on what is no longer the scenario: another window was faster."""

    def __init__(self) -> None:
        super().__init__("another window has changed the scenario meanwhile; look, and do it again")


class Desk:
    """The scenario `file`, its text, and its earlier states in `folder`.

    Each change is on the disk before anything is made of it.  What another program writes to the
    file is taken in as a change.
    """

    def __init__(self, file: Path) -> None:
        """Take a file, which is written where there is none.

        Raises:
            ScenarioError: when it is no text.
            OSError: when nothing can be written beside it.
        """
        self.file = file.absolute()
        self.folder = self.file.parent / "workbench" / file_name(self.file.stem)
        self._states = self.folder / "history"
        self._states.mkdir(parents=True, exist_ok=True)
        if not self.file.exists():
            write_text(self.file, STARTER, replace=False)
        self.text = read_text(self.file)
        self.version = self._last_known()
        self.take_in()

    def _last_known(self) -> int:
        """Return the number of the state that the file has, or had before others changed it."""
        try:
            version = int(read_json(self.folder / "history.json")["at"])
        except (OSError, ValueError, LookupError, TypeError):
            version = max(self._numbers(), default=0)
        killed = self._state(version + 1)  # a change of which only the number was not written
        return version + 1 if killed == self.text != self._state(version) else version

    def _numbers(self) -> list[int]:
        return sorted(int(path.stem) for path in self._states.glob("*.yaml") if path.stem.isdigit())

    def _path(self, version: int) -> Path:
        return self._states / f"{version:06}.yaml"

    def _state(self, version: int) -> str | None:
        try:
            return self._path(version).read_text(encoding="utf-8")
        except OSError:
            return None

    @property
    def can_undo(self) -> bool:
        """Whether there is a state before this one."""
        return self._path(self.version - 1).exists()

    @property
    def can_redo(self) -> bool:
        """Whether this state was gone back to."""
        return self._path(self.version + 1).exists()

    def take_in(self) -> bool:
        """Take in what another program has written to the file; tell whether it has.

        Raises:
            ScenarioError: when the file is gone, or no text.
        """
        self.text = read_text(self.file)
        if self.text == self._state(self.version):
            return False
        self._keep(self.text)
        return True

    def _keep(self, text: str) -> None:
        """Write a state behind this one, in place of those that were gone back from."""
        for number in self._numbers():
            if number > self.version or number <= self.version - MOST_KEPT:
                self._path(number).unlink(missing_ok=True)
        write_text(self._path(self.version + 1), text)
        self._at(self.version + 1, text)

    def _at(self, version: int, text: str) -> None:
        if read_text(self.file) != text:
            write_text(self.file, text)
        write_text(self.folder / "history.json", f"{json.dumps({'at': version})}\n")
        self.version, self.text = version, text

    def write(self, text: str, version: int) -> None:
        """Give the scenario another text, made of that of a version.

        Raises:
            Stale: when it has another version by now.
            OSError: when it cannot be written; then it is as it was.
        """
        if self.take_in() or version != self.version:
            raise Stale
        if text != self.text:
            self._keep(text)

    def change(self, changes: Iterable[Change], version: int) -> None:
        """Change keys of the scenario (raises as `write`).

        Raises:
            ValueError: when a key cannot be changed where it stands.
        """
        self.write(edited(self.text, changes), version)

    def step(self, by: int) -> None:
        """Go back in the history (-1), or forth again (1), if there is a state."""
        self.take_in()
        text = self._state(self.version + by)
        if text is not None:
            self._at(self.version + by, text)

    def given(self) -> dict[str, Any]:
        """Return the dotted keys that the text gives, with their values."""
        data = read_yaml(self.text, str(self.file)).data
        return dict(leaves(data)) if isinstance(data, dict) else {}


def _rounded(places: Iterable[Point]) -> list[list[float]]:
    """Return places to the centimetre, as they are told, predicted and copied."""
    return [[round(float(axis), 2) + 0.0 for axis in place] for place in places]


def vessels(
    stations: Iterable[Point],
    groups: Sequence[Mapping[str, Any]] = (),
    before: Iterable[Point] = (),
) -> list[Change]:
    """Return the changes that moor ASVs at stations (m).

    Of `groups`, as the file has them, whoever is gone from the places `before` is taken from its
    own, and whoever is new joins the last.
    """
    places, former = _rounded(stations), _rounded(before)
    formation = {"positions_m": places}
    whose = [n for n, own in enumerate(groups) for _ in range(own["count"])]
    while len(whose) > len(places):
        pairs = enumerate(zip(former, places, strict=False))
        gone = next((n for n, (one, other) in pairs if one != other), len(places))
        del whose[gone], former[gone : gone + 1]
    whose += whose[-1:] * (len(places) - len(whose))
    if not whose:
        return [(("asvs", "count"), len(places)), (("asvs", "formation"), formation)]
    left = [{**own, "count": whose.count(n)} for n, own in enumerate(groups) if n in whose]
    return [
        (("asvs", "count"), REMOVED),
        *([] if left == groups else [(("asvs", "groups"), left)]),
        (("asvs", "formation"), formation),
    ]


def area(site: Ground, corners: Iterable[Point]) -> list[Change]:
    """Return the changes that make the survey a polygon of corners (m), which stays on its place on
    Earth, as land in holes of its chart does.
    """
    gone = ("side_m", "size_m", "rotation_deg", "polygon_deg", "area", "area_name")
    changes: list[Change] = [(("survey", name), REMOVED) for name in gone]
    changes += [(("survey", "polygon_m"), _rounded(corners)), *_at_origin(site.origin_deg)]
    if _has_holes(site):
        changes.append((("survey", "land"), [_rounded(ring) for ring in drawn(site)["land"]]))
    return changes


def _has_holes(site: Ground) -> bool:
    return any(len(rings) > 1 for rings in site.scenario.survey.charted("area"))


def drawn(site: Ground) -> dict[str, list[list[list[float]]]]:
    """Return the corners (m) of each polygon of land, and of water where nobody goes.

    Raises:
        ValueError: when one is none.
    """
    return {
        name: [[list(corner) for corner in rings[0]] for rings in what.polygons] if what else []
        for name, what in (("land", site.land), ("keep_out", site.keep_out))
    }


def shapes(site: Ground, name: str, polygons: Iterable[Iterable[Point]]) -> list[Change]:
    """Return the changes that make `land`, or `keep_out`, polygons of corners (m).

    Raises:
        ValueError: when lakes would be lost.
    """
    known = site.land.polygons if site.land else ()
    charted = site.scenario.survey.charted("keep_out") if name == "keep_out" else known
    if any(len(rings) > 1 for rings in charted):
        raise ValueError(f"survey.{name}: has lakes, which cannot be drawn; change its chart")
    outline = area(site, site.area.outline) if name == "land" and _has_holes(site) else []
    each = [_rounded(corners) for corners in polygons]
    return [*outline, (("survey", name), each or REMOVED), *_at_origin(site.origin_deg)]


def _at_origin(origin: Point | None) -> list[Change]:
    if origin is None:
        return []
    place = {"lat_deg": round(origin[0], 9), "lon_deg": round(origin[1], 9)}
    return [(("environment", "origin"), place)]


def ways(points: Iterable[Iterable[Point]], origin: Point | None) -> list[Change]:
    """Return the changes that send each AUV along points (m) of its own; over lanes without any."""
    each = [_rounded(way) for way in points]
    if not each:
        return [(("auvs", "route"), {"kind": "lawnmower"})]
    route = {"kind": "waypoints", "points_m": each}
    return [(("auvs", "count"), len(each)), (("auvs", "route"), route), *_at_origin(origin)]


# A file that is no part of a scenario
A_LOG = "a recorded log to replay"


def meanings(file: str, areas: Sequence[str] = ()) -> dict[str, list[Change]]:
    """Return what the name of a file may be meant for, in words, and the changes for each; of a
    chart of several polygons, each of the `areas` by its name.
    """
    shapes = ("side_m", "size_m", "rotation_deg", "polygon_m", "polygon_deg", "area", "area_name")
    gone: list[Change] = [(("survey", name), REMOVED) for name in shapes]
    area: list[Change] = [*gone, (("survey", "area"), file)]
    each = {f"the area {name}": [*area, (("survey", "area_name"), name)] for name in areas}
    charts: dict[str, list[Change]] = {
        **(each if len(areas) > 1 else {"the area": area}),
        "land": [(("survey", "land"), file)],
        "water where nobody goes": [(("survey", "keep_out"), file)],
        "ways of the AUVs": [(("auvs", "route"), {"kind": "waypoints", "files": [file]})],
    }
    track: list[Change] = [
        (("auvs", "count"), 1),
        (("auvs", "route"), {"kind": "track", "files": [file]}),
    ]
    tracks = {"the way that an AUV repeats": track}
    if file.endswith((".csv", ".cnv", ".mcap")):
        logs: dict[str, list[Change]] = {A_LOG: []} if file.endswith(".mcap") else {}
        return {"a cast of the water": [(("environment", "ctd"), file)], **tracks, **logs}
    return {**charts, **tracks} if file.endswith(".gpx") else charts


def key(name: str, text: str) -> list[Change]:
    """Return the change of one dotted key to a value, written as in a file; of "" to its default.

    Raises:
        ValueError: when the text is no value.
    """
    path = path_of(name)
    if not text.strip():
        return [(path, REMOVED)]
    document = read_yaml(f"value: {text}\n", name)
    if document.mistakes or set(document.data or ()) != {"value"}:
        raise ValueError(f"{name}: {text!r} is no value; write it as in a scenario file")
    return [(path, document.data["value"])]
