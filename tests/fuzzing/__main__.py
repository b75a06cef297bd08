"""Make inputs and tell how they end: `python -m tests.fuzzing KIND NUMBER` shows one whole.

`python -m tests.fuzzing KIND FIRST END [KIND FIRST END ...]` prints a line of JSON for each.
"""

import json
import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parents[1]))

from .commands import command
from .files import Lines, experiment, scenario, track
from .folders import campaign, run
from .judging import Ending, ending, shown
from .material import prepare
from .named import named
from .planned import log, plan

KINDS: dict[str, Callable[[int, Random], Lines]] = {
    "scenario": scenario,
    "experiment": experiment,
    "track": track,
    "named": named,
    "plan": plan,
    "log": log,
    "command": command,
    "run": run,
    "campaign": campaign,
}


@contextmanager
def made(kind: str, seed: int, folder: Path) -> Iterator[Lines]:
    """Make an input in a folder of its own, and go there; yield the command lines about it."""
    here = Path(tempfile.mkdtemp(dir=folder))
    os.chdir(here)
    try:
        with warnings.catch_warnings():
            if kind in ("run", "campaign"):  # numbers of a damaged table may overflow anything
                warnings.simplefilter("ignore", RuntimeWarning)
            yield KINDS[kind](seed, Random(f"{kind} {seed}"))
    finally:
        os.chdir(folder)
        shutil.rmtree(here, ignore_errors=True)


def endings(kind: str, seed: int, folder: Path) -> list[Ending]:
    """Return how the commands about an input end; one that was slow may try once more.

    The first time it may have compiled what was needed for the first time.
    """
    for _ in range(2):
        with made(kind, seed, folder) as lines:
            found = [ending(words) for words in lines]
        if not any(it.why.startswith("slow") for it in found):
            break
    return found


def one(kind: str, seed: int, folder: Path) -> None:
    """Show an input whole, each command line about it, and how it ends."""
    with made(kind, seed, folder) as lines:
        print(shown(Path.cwd()))
        for words in lines:
            print(f"{words}\n{ending(words, told=print).why or 'as documented'}\n")


def many(kind: str, first: int, end: int, folder: Path) -> None:
    """Print a line of JSON for each input: kind, number, exit codes, and what should not be."""
    for seed in range(first, end):
        found = endings(kind, seed, folder)
        wrong = [(it.words, it.why) for it in found if it.why]
        print(json.dumps([kind, seed, [it.code for it in found], wrong]), flush=True)


def main(*words: str) -> None:
    """Show one input, or go through many, kind by kind."""
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        prepare(folder)
        if len(words) == 2:
            one(words[0], int(words[1]), folder)
        for at in range(0, len(words) - 2, 3):
            many(words[at], int(words[at + 1]), int(words[at + 2]), folder)
        os.chdir("/")


if __name__ == "__main__":
    main(*sys.argv[1:])
