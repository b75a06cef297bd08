"""The scenario of a mission: keys that agree with each other (see `agreement`, a file a
subject).
"""

from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from html import escape
from operator import is_
from typing import TYPE_CHECKING, Any, Literal, Required, TypedDict, TypeVar, Unpack

from pydantic import ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from ...models.presets.catalogue import CATALOGUE
from ...support.mistakes import Problem
from ...support.plain_data import leaves
from ...support.plugins import is_plugin
from ...support.wording import LONG_S, did_you_mean, plain, shortened, timed
from .agreement.bottom import bottom_problems
from .agreement.instruments import instruments_problems, sizes_problems, water_problems
from .agreement.land import land_problems
from .agreement.protocol import (
    acoustics_problems,
    modems_problems,
    peers_problems,
    protocol_problems,
    telling_problems,
)
from .agreement.vehicles import (
    failures_problems,
    formation_problems,
    places_problems,
    route_problems,
    survey_problems,
    vehicles_problems,
)
from .chosen_parts import loaded_parts, parts_of
from .part_choice import shipped_mistakes
from .scenario_keys import Environment, Modems, Record, ScenarioKeys, Traffic
from .sections.acoustics import Acoustics
from .sections.navigation import Navigation
from .sections.protocol import Protocol
from .sections.survey import SURVEY, Survey, SurveyEnd
from .sections.usbl import UsblSection
from .sections.vehicles import Asvs, Auvs
from .site import Site

Keys = Mapping[str, Any]


class GivenKeys(TypedDict, total=False):
    """The keys of a scenario as Python gives them: a section may be a mapping, as in a file."""

    name: Required[str]
    duration_s: float | Literal["survey"]
    survey: Survey | Keys
    auvs: Auvs | Keys
    asvs: Asvs | Keys
    environment: Environment | Keys
    acoustics: Acoustics | Keys
    protocol: Protocol | Keys
    usbl: UsblSection | Keys
    navigation: Navigation | Keys
    traffic: Traffic | Keys | None
    modems: Modems | Keys | None
    record: Record | Keys


class Scenario(ScenarioKeys):
    """One mission of ASVs and AUVs: everything that decides it but the seed.

    Make it from the keys of a scenario file: ``Scenario(name="m", asvs={"count": 2})``, or
    ``Scenario.model_validate({...})``.  ``scenario.model_dump()`` returns all keys.  A scenario
    cannot be changed.

    Raises:
        ValidationError: listing every mistake, a ValueError of pydantic's.
    """

    def __new__(cls, *given: object, **_: object) -> "Scenario":
        """Refuse a path or a mapping with a message that names the right call."""
        if given:
            raise TypeError(
                "a Scenario is made of keys: Scenario(name=...); load_scenario(path) reads a file, "
                "Scenario.model_validate({...}) takes a mapping"
            )
        return super().__new__(cls)

    if TYPE_CHECKING:  # else type checkers demand sections as models, and refuse mappings

        def __init__(self, **keys: Unpack[GivenKeys]) -> None: ...

    def __repr__(self) -> str:
        return (
            f"<Scenario {self.name}: {self.auvs.count} AUVs, {self.asvs.count} ASVs, "
            f"{site_of(self).area.words}, {self.lasting}>"
        )

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Return the keys that differ from their defaults as HTML, for notebooks."""
        usual = dict(leaves(Scenario(name=self.name).model_dump(mode="json")))
        own = leaves(self.model_dump(mode="json"))
        lines = [
            f"{key}: {shortened(plain(value))}"
            for key, value in own
            if usual.get(key, ...) != value
        ]
        text = "\n".join(lines) or "every key has its default"
        return f"<p>{escape(repr(self))}</p><pre>{escape(text)}</pre>"

    @property
    def ends_with_survey(self) -> bool:
        """Whether the mission lasts until every AUV has flown its lanes."""
        return isinstance(self.duration_s, SurveyEnd)

    @property
    def lasting(self) -> str:
        """The duration of the mission in words."""
        lasts = float(self.duration_s)
        told = timed(lasts) if lasts >= LONG_S else f"{lasts:g} s"
        return f"{told}, until its lanes are flown" if self.ends_with_survey else told

    @property
    def has_signals(self) -> bool:
        """Whether vehicles may send more than pings: for programs, peers, or hosts of modems."""
        return self.protocol.signals or self.has_peers or self.modems is not None

    @property
    def has_peers(self) -> bool:
        """Whether AUVs range each other; a single AUV has no peers."""
        return self.navigation.peers is not None and self.auvs.count > 1

    @property
    def plugins(self) -> dict[str, str]:
        """The user-defined parts that the scenario names (``module:object``), by key."""
        return {key: str(name) for key, _, name in parts_of(self) if is_plugin(name)}

    @property
    def leave(self) -> str:
        """The option that a command needs to run this scenario: " --allow-plugins", or ""."""
        return " --allow-plugins" if self.plugins else ""

    @model_validator(mode="wrap")
    @classmethod
    def _told_in_words(
        cls, data: Any, validate: ModelWrapValidatorHandler["Scenario"]
    ) -> "Scenario":
        try:
            return validate(data)
        except ValidationError as error:
            from .files.explanations import in_words  # which only mistakes need

            raise in_words(error, data) from None

    @model_validator(mode="after")
    def _consistent(self) -> "Scenario":
        site = site_of(self)
        found = problems(site)
        if not found and self.ends_with_survey:
            found = _ended(site)
        if found:
            text = "\n".join(f"{problem.key}: {problem.message}" for problem in found)
            raise PydanticCustomError("inconsistent", "{text}", {"text": text, "problems": found})
        return self


Ground = TypeVar("Ground", bound=Site)


def kept(derive: Callable[[Scenario], Ground]) -> Callable[[Scenario], Ground]:
    """Wrap `derive`, which makes facts of a scenario, so that the last facts are kept and reused.

    They are reused for the same scenario object (comparing two takes as long as most facts) with
    the same user-defined parts, since a notebook may define these anew.
    """
    last: tuple[tuple[object, ...], Ground] | None = None

    @wraps(derive)
    def answered(scenario: Scenario) -> Ground:
        nonlocal last
        of = (scenario, *loaded_parts(scenario))
        found = last  # another thread may replace `last`
        if found is None or not all(map(is_, of, found[0])):
            found = last = of, derive(scenario)
        return found[1]

    return answered


@kept
def site_of(scenario: Scenario) -> Site:
    """Return the facts that follow from the keys of a scenario without seed or sound."""
    return Site(scenario)


def _ended(site: Site) -> list[Problem]:
    """Set the duration of a mission that ends with its survey, or return why that fails."""
    scenario = site.scenario
    if not any(wing.asked.is_flown for wing in site.wings):
        message = f"{SURVEY} needs lanes or waypoints to be flown; give the seconds"
        return [Problem("duration_s", message, ("auvs.route.kind",))]
    try:
        end = site.survey_end_s
    except ValueError as error:
        key, _, message = str(error).partition(": ")
        if key.startswith(("auvs.", "environment.")):  # as a route that cannot be flown
            return [Problem(key, message, ("auvs.vehicle",))]
        return [Problem("duration_s", str(error), ("auvs.speed_m_per_s", "survey"))]
    scenario.__dict__["duration_s"] = end
    return problems(site)  # some rules need the duration


def problems(site: Site) -> list[Problem]:
    """Return every contradiction between keys: key, message with value and remedy, other keys."""
    return [found for subject in SUBJECTS for found in subject(site)]


def _parts_problems(site: Site) -> Iterator[Problem]:
    """Yield names of parts that do not exist, and wrong settings of shipped parts."""
    for key, family, name in parts_of(site.scenario):
        if name in family.siblings:
            for setting, message in shipped_mistakes(family, name):
                yield Problem(f"{key}.{setting}", message)
        elif not (family.is_open and is_plugin(name)):
            own = ", or your own as module:object" if family.is_open else ""
            yield Problem(
                key,
                f"{name!r} is no {family.noun}{did_you_mean(name, family.siblings)} (one of "
                f"{', '.join(family.siblings)}{own})"
                f"{_preset(key, name)}",
            )


def _preset(key: str, name: str) -> str:
    """Return a hint if `name`, given as a part, is the name of a preset; else ""."""
    section, _, _ = key.rpartition(".")
    kind, own = ("usbl", "preset") if section == "usbl" else ("modem", "modem")
    is_there = section.startswith(("usbl", "acoustics")) and any(
        name == entry.name for entry in CATALOGUE[kind]
    )
    return f"; it is a preset: set {section}.{own} to {name}" if is_there else ""


# Each yields the contradictions of one subject, in the order of the report.
SUBJECTS = (
    survey_problems,
    vehicles_problems,
    water_problems,
    places_problems,
    route_problems,
    formation_problems,
    land_problems,
    bottom_problems,
    failures_problems,
    _parts_problems,
    protocol_problems,
    peers_problems,
    modems_problems,
    telling_problems,
    acoustics_problems,
    instruments_problems,
    sizes_problems,
)
