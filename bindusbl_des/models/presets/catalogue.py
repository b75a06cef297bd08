"""All presets by kind and name."""

from collections.abc import Iterator

from ...support.wording import did_you_mean
from .modems import MODEMS
from .preset import INERTIALS, USBLS, Preset

CATALOGUE = {"modem": MODEMS, "usbl": USBLS, "inertial": INERTIALS}


def preset(kind: str, name: str) -> Preset:
    """Return a preset of a kind by its name.

    Raises:
        ValueError: when there is none of that name, with the nearest one or all there are.
    """
    known = {entry.name: entry for entry in CATALOGUE[kind]}
    if name not in known:
        listed = f"; there are {', '.join(known) or 'none yet'}"
        raise ValueError(f"no {kind} preset is named {name!r}{did_you_mean(name, known) or listed}")
    return known[name]


def selected(word: str) -> Iterator[tuple[str, Preset]]:
    """Yield the presets of a kind, or of a name, or all for "", each with its kind.

    Raises:
        ValueError: when nothing has that name.
    """
    found = [
        (kind, entry)
        for kind, presets in CATALOGUE.items()
        for entry in presets
        if word in ("", kind, entry.name)
    ]
    if not found and word not in CATALOGUE:
        names = [*CATALOGUE, *(entry.name for presets in CATALOGUE.values() for entry in presets)]
        hint = did_you_mean(word, names) or "; `bindusbl-des presets` lists all"
        raise ValueError(f"no preset, and no kind of presets, is named {word!r}{hint}")
    yield from found
