"""A scenario as it stands in its file, with its warnings at their lines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..core.plugins import refusal
from ..scenario.families import plugins_of
from ..scenario.files.mistakes import Mistake, ScenarioError
from ..scenario.files.plain_yaml import Document
from ..scenario.files.scenario_file import Source, parsed, place_of, told_at
from ..scenario.scenario import Scenario
from ..scenario.water import profile_of
from .worth_knowing import cautions


@dataclass(frozen=True)
class Reading:
    """A scenario as it was read from a file, and warnings about it, each at its place.

    `about` are the keys of each warning: that at which it is told, and those behind it.
    `unloaded` are the plug-ins that it names and that were not to be loaded, each at its place.
    """

    scenario: Scenario
    warnings: tuple[Mistake, ...]
    about: tuple[tuple[str, ...], ...]
    unloaded: tuple[Mistake, ...] = ()


def read_scenario(
    source: str | Path | Source, *, overrides: Sequence[str] = (), allow_plugins: bool = False
) -> Reading:
    """Read a scenario file, or its text, as `load_scenario` does; return its warnings as well.

    Raises:
        ScenarioError: listing every mistake, when the file cannot be read or used.
    """
    source = source if isinstance(source, Source) else Source.file(source, overrides)
    document, scenario = parsed(source, allow_plugins)
    unusable = tuple(_tables(document, scenario))
    if unusable:
        raise ScenarioError(unusable)
    places = {found: told_at(document, found) for found in cautions(scenario)}
    found = sorted(places, key=lambda it: (places[it].file != source.name, places[it].line))
    warnings = (
        *document.warnings,
        *(Mistake.at(places[it], it.key, it.message) for it in found),
    )
    about = (*((it.key,) for it in document.warnings), *((it.key, *it.others) for it in found))
    unloaded = () if allow_plugins else tuple(_plugins(document, scenario))
    return Reading(scenario, warnings, about, unloaded)


def _tables(document: Document, scenario: Scenario) -> Iterator[Mistake]:
    """Yield what is wrong with tables of sound, which are held to the scenario's water."""
    for band in ("hf", "mf"):
        channel = getattr(scenario.acoustics, band).channel
        file = channel.settings.get("rays") if channel == "table" else None
        if file is None:
            continue
        from ..acoustics.ray_tables import read_table  # brings pyarrow

        key = f"acoustics.{band}.channel.rays"
        try:
            read_table(file, profile_of(scenario))
        except ValueError as error:
            yield Mistake.at(place_of(document, key), key, str(error))


def _plugins(document: Document, scenario: Scenario) -> Iterator[Mistake]:
    for key, name in plugins_of(scenario).items():
        yield Mistake.at(place_of(document, key), key, refusal(name))
