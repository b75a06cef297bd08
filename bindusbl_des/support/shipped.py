"""Files that the program ships: scenarios and experiments, named by their stems."""

import os
from functools import cache
from pathlib import Path

from .mistakes import FilePlace, Mistake, ScenarioError
from .wording import did_you_mean

PACKAGE = Path(__file__).parents[1]
KINDS = ("scenarios", "experiments")
ENDINGS = (".yaml", ".yml")


@cache
def shipped(kind: str) -> dict[str, Path]:
    """Return the shipped files of a kind by name: in the wheel, or at the top of a source checkout.

    >>> shipped("scenarios")["quickstart"].name
    'quickstart.yaml'
    """
    for folder in (PACKAGE / kind, PACKAGE.parent / kind):
        if folder.is_dir():
            return {path.stem: path for path in sorted(folder.glob("*.yaml"))}
    return {}


def located(given: str, kinds: tuple[str, ...] = KINDS) -> str:
    """Return the path of a file, or else of a shipped file by its bare name.

    Raises:
        ScenarioError: when nothing has that name, or what has it is of another kind.
    """
    if os.path.exists(given) and not os.path.isdir(given):
        return given
    for kind in kinds:
        if given in shipped(kind):
            return str(shipped(kind)[given])
    message = _objection(given, kinds)
    if message:
        raise ScenarioError([Mistake.at(FilePlace(given or "''"), "", message)])
    return given


def listed(kinds: tuple[str, ...] = KINDS) -> str:
    """Return the names of all shipped files, for a message."""
    return "; ".join(f"the {kind} {', '.join(shipped(kind))}" for kind in kinds)


def _objection(given: str, kinds: tuple[str, ...]) -> str:
    """Return why a name is no shipped one; empty if opening the file will tell."""
    stem, ending = os.path.splitext(os.path.basename(given))
    if given in shipped("experiments"):
        return f"is an experiment, of many missions; `bindusbl-des sweep {given}` runs it"
    if os.path.isdir(given):
        return ""
    if ending in ENDINGS or os.path.basename(given) != given:
        ships = any(stem in shipped(kind) for kind in kinds)
        return f"no such file; {stem} ships, so write `{stem}` alone" if ships else ""
    hint = did_you_mean(given, [name for kind in kinds for name in shipped(kind)])
    these = "? These" if hint else "; these"
    return f"no such file, and nothing of that name ships{hint[:-1]}{these} do: {listed(kinds)}"
