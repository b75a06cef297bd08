"""Parts of the mission that are named: they are there, and have the settings given."""

from collections.abc import Iterator

from ...core.plugins import is_plugin
from ...core.wording import did_you_mean
from ...presets.catalogue import CATALOGUE
from ..families import parts_of
from ..part_settings import shipped_mistakes
from ..scenario_keys import ScenarioKeys
from .problem import Problem


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield names of parts that there are not, and wrong settings of those that ship."""
    for family, name in parts_of(scenario):
        if name in family.siblings:
            for setting, message in shipped_mistakes(family, name):
                yield Problem(f"{family.key}.{setting}", message)
        elif not (family.is_open and is_plugin(name)):
            own = ", or your own as module:object" if family.is_open else ""
            yield Problem(
                family.key,
                f"{name!r} is no {family.noun}{did_you_mean(name, family.siblings)} (one of "
                f"{', '.join(family.siblings)}{own})"
                f"{_preset(family.key, name)}",
            )


def _preset(key: str, name: str) -> str:
    """Return where a preset belongs that is named in a part's place; "" for what is none."""
    section, _, _ = key.rpartition(".")
    kind, own = ("usbl", "preset") if section == "usbl" else ("modem", "modem")
    is_there = section.startswith(("usbl", "acoustics")) and any(
        name == it.name for it in CATALOGUE[kind]
    )
    return f"; it is a preset: set {section}.{own} to {name}" if is_there else ""
