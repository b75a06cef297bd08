"""The page of one joint reading, and the section on all of them."""

from collections.abc import Container, Iterator, Sequence

from .campaigns import Runs
from .counting import PROBABILITY, SHUFFLES, Foretelling, Tally
from .document import (
    READINGS_CAPTION,
    SECTIONS,
    count,
    digits,
    figure,
    markdown,
    numbers_in_markdown,
    origin,
    warning,
)
from .numbers import REPRODUCED, Measured, Published
from .readings import DEFAULT, FACTORS, LIKELY, Reading

# The joint readings in words: which meets most, what its choices are worth, what is luck.


# On the terminal; on the page
SHOWN, LISTED, WIDTH = 10, 5, 80
TITLE = "The paper in one reading"

QUESTION = """\
Often another reading reproduces a number that the paper's words do not, but not every number the
same one. Which *single* reading meets most of the {numbers} numbers? Of the choices, the first is
that of `default`:"""

FIXED = """\
All {readings:,} joint readings were counted. `bindusbl-des reproduce --reading NAME` runs one:
`default`, `likely`, or choices joined by `/`, the others as in `default`. Sequential rounds,
rotating broadcasters and starts at the centre of strips are not varied (E25, E27, E28): the fix
counts of Table I settled them, and are weak evidence here."""

PUT_IN = """\
*Put in*: `published_speeds` meets those {put_in} distances by construction. *Foretold*: met, of the
other {free} numbers. *Off by*: the sum over all {numbers} numbers of the relative difference, which
decides between equal counts."""


def readings_document(counted: Tally, runs: Runs, *, quick: bool) -> str:
    """Return the document of all joint readings in Markdown."""
    command = f"reproduce{' --quick' if quick else ''} --readings"
    first, *rest = section(counted, runs)
    made = ("## How it was made", *origin(runs, command))
    return "\n\n".join((first.removeprefix("#"), *warning(quick), *rest, *made)) + "\n"


def section(counted: Tally, runs: Runs) -> Iterator[str]:
    """Yield the parts of the section on joint readings, in Markdown."""
    numbers, free = len(counted.rows), int(counted.free.sum())
    yield f"## {TITLE}"
    yield QUESTION.format(numbers=numbers)
    yield choices_in_markdown()
    yield FIXED.format(readings=len(counted.readings))
    yield figure("readings", READINGS_CAPTION)
    yield best_in_markdown(counted)
    yield PUT_IN.format(put_in=numbers - free, free=free, numbers=numbers)
    yield "What each choice is worth, beside the best reading:"
    yield switches_in_markdown(counted)
    yield likely_in_words(counted)
    yield chance_in_words(counted)
    yield from _remaining(counted, runs)


def choices_in_markdown() -> str:
    """Return the table of all factors and their choices."""
    rows = [
        (
            factor.question,
            "; ".join(f"`{word}`: {meaning}" for word, meaning in factor.choices.items()),
            factor.errata,
        )
        for factor in FACTORS
    ]
    return markdown(("left open", "choices", "errata"), rows)


def best_in_markdown(counted: Tally) -> str:
    """Return the table of the best readings, with `default` below."""
    shown = [(str(rank), place) for rank, place in enumerate(counted.ranks[:LISTED], 1)]
    default = counted.place(DEFAULT)
    if counted.ranks.index(default) >= LISTED:
        shown.append((str(counted.ranks.index(default) + 1), default))
    rows = [(rank, *_line(counted, place)) for rank, place in shown]
    return markdown(("", "reading", "met", "put in", "foretold", "off by"), rows)


def _line(counted: Tally, place: int) -> tuple[str, ...]:
    return (
        f"`{counted.readings[place].name}`",
        str(counted.counts[place]),
        str(counted.put_in[place].sum()),
        str(counted.foretold[place]),
        f"{counted.deviations[place]:.2f}",
    )


def switches_in_markdown(counted: Tally) -> str:
    """Return the table of what each other choice would change."""
    met = int(counted.counts.max())
    rows = [
        (
            getattr(counted.best, switch.factor),
            switch.choice,
            f"{switch.alone - met:+d}",
            f"{switch.best - met:+d}",
        )
        for switch in counted.switches()
    ]
    heads = ("the best has", "with", "it alone changed", "all else chosen anew")
    return markdown(heads, [(f"`{a}`", f"`{b}`", c, d) for a, b, c, d in rows])


def likely_in_words(counted: Tally) -> str:
    """Return which reading the authors most likely ran, and how far that is known."""
    best, rivals = counted.best, counted.rivals()
    name = "`likely`" if best == LIKELY else f"not `likely`, which is kept as `{LIKELY.name}`"
    shared = [word for word in best.words if all(word in rival.words for rival in rivals)]
    told = ", ".join(f"`{word}`" for word in shared)
    return (
        f"**The authors most likely ran `{best.name}`** ({name}): {meaning(best)}. It meets "
        f"{counted.counts.max()} of the {len(counted.rows)} numbers, `default` "
        f"{counted.counts[counted.place(DEFAULT)]}. Chance may have put {len(rivals):,} of the "
        f"other {len(counted.readings) - 1:,} readings behind it (sign test, "
        f"{100 * PROBABILITY:.0f} %), "
        + (f"which share no choice but {told}." if told else "which share no choice.")
        + f" {_besides(counted)}"
    )


def _besides(counted: Tally) -> str:
    """Return what else than the count speaks for the best reading, and what does not."""
    best, alone = counted.best, counted.best_foretold
    said = ""
    if best.error != "cross_track":
        said += "Two numbers cannot lie across the track, which speaks against `cross_track` (E8). "
    if best.speed != alone.speed:
        said += (
            f"Without the numbers put in, `{alone.name}` is the best with "
            f"{counted.foretold[counted.place(alone)]}. "
        )
    return said.strip()


def meaning(reading: Reading) -> str:
    """Return a reading's choices in words."""
    return "; ".join(
        factor.choices[word] for factor, word in zip(FACTORS, reading.words, strict=True)
    )


def chance_in_words(counted: Tally) -> str:
    """Return how many numbers some reading would have met by luck."""
    chance, foretold = counted.by_chance, counted.foretold
    lucky = chance.share >= PROBABILITY
    return (
        f"**How much of it is luck.** Of the {int(counted.free.sum())} numbers that none puts in, "
        f"a reading foretells {foretold.mean():.1f} on average (sd {foretold.std():.1f}), "
        f"{foretold.min()} to {foretold.max()}. If numbers had no reading in common, the best of "
        f"{len(foretold):,} would still foretell {chance.mean:.1f} ({SHUFFLES:,} shuffles; "
        f"{chance.low} to {chance.high} in nine of ten), and {foretold.max()} or more in "
        f"{100 * chance.share:.1f} % of cases. "
        + (
            "So the best may owe its rank to the many that were tried."
            if lucky
            else "So the numbers have more of a reading in common than luck gives, if not much."
        )
    )


def _remaining(counted: Tally, runs: Runs) -> Iterator[str]:
    foretelling = Foretelling(runs)
    found = [foretelling.measured(row, counted.best) for row in counted.rows]
    left = [it for it in found if it.verdict != REPRODUCED]
    never = {row for row, met in zip(counted.rows, counted.met.T, strict=True) if not met.any()}
    yield (
        f"Under the best reading {len(left)} numbers remain, {count(left)['near']} of them within "
        f"5 % of what was published; {len(never)}, with a star, no reading meets (published, here):"
    )
    yield markdown(("mission", "numbers"), named(left, never))


def named(left: Sequence[Measured], never: Container[Published]) -> list[tuple[str, str]]:
    """Return numbers in a few words each, those of one mission together."""
    by_case: dict[str, list[str]] = {}
    for it in left:
        text = f"{it.row.auv} {it.row.quantity} {it.row.text}, {it.prediction.mean:.{digits(it)}f}"
        by_case.setdefault(it.row.case, []).append(text + " *" * (it.row in never))
    return [(case, "; ".join(texts)) for case, texts in by_case.items()]


def _cells(counted: Tally, place: int) -> str:
    _, *texts = _line(counted, place)
    return "".join(f"{text:>{w}}" for text, w in zip(texts, (4, 8, 10, 8), strict=True)) + "  "


def _cut(line: str) -> str:
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 3]}..."


def for_terminal(counted: Tally) -> str:
    """Return the best readings and what other choices would change, in 80 columns."""
    met, best = int(counted.counts.max()), counted.best
    lines = [f"{len(counted.readings)} joint readings of {len(counted.rows)} numbers; the best:"]
    lines += [f"  {best.name}", "", f"{'met':>4}{'put in':>8}{'foretold':>10}{'off by':>8}"]
    for place in counted.ranks[:SHOWN]:
        reading = counted.readings[place]
        others = ", ".join(word for word in reading.words if word not in best.words)
        lines.append(_cut(_cells(counted, place) + (f"with {others}" if others else "best")))
    lines.append(f"{_cells(counted, counted.place(DEFAULT))}default")
    lines += ["", f"{'best with':<26}{'alone':>8}{'others anew':>14}"]
    lines += [
        f"{it.choice:<26}{it.alone - met:>+8d}{it.best - met:>+14d}" for it in counted.switches()
    ]
    lines += ["", f"Not told apart from the best: {len(counted.rivals())} readings"]
    return "\n".join(lines)


# The document of one joint reading: every number of the paper as it becomes under it.


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
