"""The document of one joint reading: every number of the paper as it becomes under it."""

from collections.abc import Iterator, Sequence

from ..document import SECTIONS, origin, warning
from ..experiments.measured import Measured
from ..experiments.running import Runs
from ..tables import count, markdown, numbers_in_markdown
from .factors import FACTORS
from .readings import Reading
from .readings_section import meaning

INTRODUCTION = """\
All {numbers} numbers of the paper under the joint reading

    bindusbl-des reproduce{option} --reading {name}

that is: {meaning}. Verdicts follow the rule of a whole reproduction, `bindusbl-des reproduce`,
which says how many numbers every other joint reading meets; E-numbers are sections of the
errata."""


def page(reading: Reading, found: Sequence[Measured], runs: Runs, *, quick: bool) -> str:
    """Return the whole document in Markdown."""
    option = " --quick" if quick else ""
    introduction = INTRODUCTION.format(
        numbers=len(found), option=option, name=reading.name, meaning=meaning(reading)
    )
    parts = [
        f"# The paper in one reading: {reading.name}",
        introduction,
        *warning(quick),
        _choices(reading),
        "## In short",
        _in_short(found),
        *_sections(found),
        "## How it was made",
        *origin(runs, f"reproduce{option} --reading {reading.name}"),
    ]
    return "\n\n".join(parts) + "\n"


def _choices(reading: Reading) -> str:
    rows = [
        (factor.name, f"`{word}`", factor.choices[word], factor.errata)
        for factor, word in zip(FACTORS, reading.words, strict=True)
    ]
    return markdown(("left open", "choice", "meaning", "errata"), rows)


def _by_section(found: Sequence[Measured]) -> Iterator[tuple[str, list[Measured]]]:
    for title, sources in SECTIONS.items():
        yield title, [it for it in found if it.row.source in sources]


def _in_short(found: Sequence[Measured]) -> str:
    rows: list[tuple[object, ...]] = []
    for title, mine in (*_by_section(found), ("all", found)):
        counts = count(mine)
        kinds = (counts[kind] for kind in ("reproduced", "differs", "cannot be", "near"))
        rows.append((title, len(mine), *kinds))
    heads = ("numbers", "of", "reproduced", "differ", "cannot be", "not reproduced, within 5 %")
    return markdown(heads, rows)


def _sections(found: Sequence[Measured]) -> Iterator[str]:
    for title, mine in _by_section(found):
        yield f"## {title}"
        yield numbers_in_markdown(mine)
