"""The vehicles of a scenario one by one: keys of `auvs.groups`, or else those for all AUVs;
`asvs.groups` likewise.

A fleet without groups is a single group, so code that needs an AUV's speed, depth or hull asks here
and need not know whether the fleet is mixed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

from .families import INSTRUMENT, InstrumentTraits
from .key_types import Point
from .part_choice import Settings
from .scenario_keys import ScenarioKeys
from .sections.navigation import Navigation
from .sections.usbl import UsblSection
from .sections.vehicles import (
    Altitude,
    AsvGroup,
    AsvUsbl,
    AsvVehicle,
    AuvGroup,
    AuvVehicle,
    Route,
)
from .shipped_settings import Kinematic

# Keys of a group that for all AUVs are not in `auvs`: the depth, and the errors of own sensors.
DEPTH = "depth_m"
ERRORS = tuple(name for name in AuvGroup.model_fields if name in Navigation.model_fields)


# Keys with one value for all AUVs, and the keys with one for each
LISTED = {"speed_m_per_s": "speeds_m_per_s", DEPTH: "depths_m"}


# The section that has a group's key for all AUVs
SECTIONS = {
    **dict.fromkeys(AuvGroup.model_fields, "auvs"),
    **dict.fromkeys(ERRORS, "navigation"),
    DEPTH: "survey",
}


@dataclass(frozen=True, eq=False)
class Group:
    """AUVs that are alike, by number (`members`), and the keys of their group (`own`), if any."""

    scenario: ScenarioKeys
    number: int
    members: range
    own: AuvGroup | None
    #: Their model, route and navigation.
    vehicle: AuvVehicle
    route: Route
    navigation: Navigation
    #: The smallest turning radius (m) without dynamics; the angle (deg) at which they rejoin a
    #: line; whether they steer by their estimates.
    turning_radius_m: float
    join_angle_deg: float
    by_estimate: bool
    #: How long (s) they can be in the water; None: no limit.
    endurance_s: float | None
    #: The altitude that they keep, if they keep one.
    altitude: Altitude

    def key(self, name: str) -> str:
        """Return the dotted key that sets a value of this group, by the key's name."""
        section, listed = SECTIONS[name], LISTED.get(name, name)
        key, given = f"{section}.{name}", getattr(getattr(self.scenario, section), listed)
        own = self.place(key)
        return f"{section}.{listed}" if own == key and given is not None else own

    def place(self, key: str) -> str:
        """Return the key of this group, if it has one, that replaces a dotted key for all AUVs.

        >>> from bindusbl_des import Scenario, Setup
        >>> own = {"groups": [{"count": 1, "depth_m": 5.0}, {"count": 2}]}
        >>> [group.place("survey.depth_m") for group in Setup(Scenario(name="m", auvs=own)).groups]
        ['auvs.groups.0.depth_m', 'survey.depth_m']
        """
        section, _, rest = key.partition(".")
        name = rest.partition(".")[0]
        is_own = getattr(self.own, name, None) is not None and section == SECTIONS.get(name)
        return f"auvs.groups.{self.number}.{rest}" if is_own else key

    @cached_property
    def alone(self) -> ScenarioKeys:
        """The scenario's keys as if all its AUVs were of this group; they are not validated."""
        if self.own is None:
            return self.scenario
        given = {name: getattr(self.own, name) for name in type(self.own).model_fields}
        changed: dict[str, dict[str, Any]] = {
            "auvs": {"groups": (), "depth": self.altitude},
            "survey": {},
        }
        for name, value in given.items():
            if value is not None and name != "count" and name not in ERRORS:
                section = SECTIONS[name]
                changed[section][name] = value
                listed = LISTED.get(name, name)
                if listed != name and getattr(getattr(self.scenario, section), listed) is not None:
                    changed[section][listed] = None
        sections = {
            name: getattr(self.scenario, name).model_copy(update=of) for name, of in changed.items()
        }
        return self.scenario.model_copy(update={**sections, "navigation": self.navigation})

    @property
    def own_keys(self) -> list[str]:
        """The keys for all AUVs that this group replaces."""
        names = [name for name in AuvGroup.model_fields if name != "count"]
        return [
            f"{SECTIONS[name]}.{name}"
            for name in names
            if getattr(self.own, name, None) is not None
        ]

    @property
    def words(self) -> str:
        """The AUVs' names, such as AUV0 or AUV1 to AUV3."""
        first, last = self.members[0], self.members[-1]
        return f"AUV{first}" if first == last else f"AUV{first} to AUV{last}"


@dataclass(frozen=True, eq=False)
class Vessels:
    """ASVs that are alike, by number (`members`), and the keys of their group (`own`), if any."""

    number: int
    members: range
    own: AsvGroup | None
    #: Their hull and USBL, and whether no group before has that USBL.
    vehicle: AsvVehicle
    usbl: UsblSection
    is_first_with_usbl: bool
    #: Their speed (m/s) under way; None: that of the placement.
    speed_m_per_s: float | None

    def key(self, key: str) -> str:
        """Return the dotted key that sets a value of these vessels, by that for all of them.

        >>> from bindusbl_des import Scenario, Setup
        >>> own = {"groups": [{"count": 1, "usbl": {"gnss_sd_m": 0.5}}, {"count": 2}]}
        >>> one, two = Setup(Scenario(name="m", asvs=own)).vessels
        >>> one.key("usbl.gnss_sd_m"), two.key("usbl.gnss_sd_m"), one.key("asvs.vehicle")
        ('asvs.groups.0.usbl.gnss_sd_m', 'usbl.gnss_sd_m', 'asvs.vehicle')
        """
        for replaced in self.own_keys:
            if f"{key}.".startswith(f"{replaced}."):
                name = key.removeprefix("asvs.").removeprefix("formation.")
                return f"asvs.groups.{self.number}.{name}"
        return key

    @property
    def instrument(self) -> InstrumentTraits:
        """What their USBL instrument declares."""
        return INSTRUMENT.declared(self.usbl.model)

    @property
    def timed_array(self) -> "tuple[tuple[float, ...], ...] | None":
        """The elements (m) of an array of their own that times arrivals; else None."""
        array = self.usbl.array
        return None if isinstance(array, str) or not self.instrument.times_arrivals else array

    @property
    def own_keys(self) -> list[str]:
        """The keys for all ASVs that these vessels replace."""
        of = {"asvs.vehicle": self.own, "asvs.formation.speed_m_per_s": self.own}
        of |= dict.fromkeys(
            map("usbl.{}".format, AsvUsbl.model_fields), getattr(self.own, "usbl", None)
        )
        return [
            key for key, own in of.items() if getattr(own, key.rpartition(".")[2], None) is not None
        ]

    def alone(self, scenario: ScenarioKeys) -> ScenarioKeys:
        """Return the keys of a scenario as if all its ASVs were these; they are not validated."""
        if self.own is None:
            return scenario
        asvs = scenario.asvs.model_copy(update={"groups": (), "vehicle": self.vehicle})
        return scenario.model_copy(update={"asvs": asvs, "usbl": self.usbl})


class Auv(NamedTuple):
    """An AUV: its number and group, speed (m/s) and depth (m), and the places (m) of launch and
    recovery, None where its route decides.
    """

    number: int
    group: Group
    speed_m_per_s: float
    depth_m: float
    launch_m: Point | None
    recovery_m: Point | None


@dataclass(frozen=True)
class Wing:
    """AUVs that share a route, by number, and its key; `is_partial` if other AUVs have others."""

    key: str
    asked: Route
    members: tuple[int, ...]
    is_partial: bool

    def __len__(self) -> int:
        return len(self.members)


def groups_of(scenario: ScenarioKeys) -> Iterator[Group]:
    """Yield the groups of the AUVs of a scenario."""
    all_of, begin = scenario.auvs, 0
    for number, own in enumerate(all_of.groups or (None,)):
        count = all_of.count if own is None else own.count
        said = {name: getattr(own, name, None) for name in AuvGroup.model_fields}
        errors = {name: said[name] for name in ERRORS if said[name] is not None}
        vehicle: AuvVehicle = said["vehicle"] or all_of.vehicle
        settings = Settings if vehicle.own else vehicle.MODELS[vehicle.model].settings
        yield Group(
            scenario,
            number,
            range(begin, begin + count),
            own,
            vehicle,
            said["route"] or all_of.route,
            scenario.navigation.changed(errors) if errors else scenario.navigation,
            vehicle.choice.settings_as(Kinematic, settings).turning_radius_m,
            said["join_angle_deg"] or all_of.join_angle_deg,
            (said["feedback"] or all_of.feedback) == "estimate",
            said["endurance_s"] or all_of.endurance_s,
            said["depth"] or (all_of.depth if said[DEPTH] is None else Altitude()),
        )
        begin += count


def auvs_of(scenario: ScenarioKeys, groups: Sequence[Group]) -> Iterator[Auv]:
    """Yield the AUVs of groups; a list that is too short, an error elsewhere, gives None."""
    for group in groups:
        columns: list[list[Any]] = []
        count, start = len(group.members), group.members.start
        for name in ("speed_m_per_s", DEPTH, "launch_m", "recovery_m"):
            section, own = getattr(scenario, SECTIONS[name]), getattr(group.own, name, None)
            usual, first = (getattr(section, name), start) if own is None else (own, 0)
            each: Sequence[Any] = usual or ()  # places: one for all, or one for each
            if name in LISTED:
                each = (getattr(section, LISTED[name]) or ()) if own is None else ()
            else:
                usual = each[0] if len(each) == 1 else None
            numbers = range(first, first + count)
            columns.append([each[k] if k < len(each) else usual for k in numbers])
        speeds, depths, launches, recoveries = columns
        for number, auv in enumerate(group.members):
            launch, recovery = launches[number], recoveries[number]
            yield Auv(auv, group, speeds[number], depths[number], launch, recovery)


def wings_of(groups: "tuple[Group, ...]") -> Iterator[Wing]:
    """Yield the AUVs that share a route: those with the route for all, then each other group."""
    routes = [None if group.own is None else group.own.route for group in groups]
    pairs = list(zip(groups, routes, strict=True))
    shared = tuple(chain.from_iterable(group.members for group, route in pairs if route is None))
    if shared:
        is_partial = any(route is not None for route in routes)
        yield Wing("auvs.route", groups[0].scenario.auvs.route, shared, is_partial)
    for group, route in pairs:
        if route is not None:
            yield Wing(group.key("route"), route, tuple(group.members), len(groups) > 1)
