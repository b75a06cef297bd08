"""Make inputs and tell how they end: `python -m tests.fuzzing KIND FIRST [END]`."""

import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parents[1]))

from .commands import command
from .files import Lines, experiment, scenario, track
from .folders import campaign, run
from .judging import as_line, shown, trouble
from .material import prepare

KINDS: dict[str, Callable[[int, Random], Lines]] = {
    "scenario": scenario,
    "experiment": experiment,
    "track": track,
    "command": command,
    "run": run,
    "campaign": campaign,
}


def judged(kind: str, seed: int, folder: Path, *, show: bool = False) -> list[tuple[list[str], str]]:
    """Make an input in a folder of its own; return the command lines that end as none may."""
    here = folder / f"{kind}{seed}"
    here.mkdir()
    os.chdir(here)
    try:
        lines = KINDS[kind](seed, Random(f"{kind} {seed}"))
        if show:
            print(shown(here))
        found = []
        for words in lines:
            why = trouble(words)
            if show:
                print(words, why or "ends well", sep="\n")
            if why:
                found.append((words, why))
        return found
    finally:
        os.chdir(folder)
        shutil.rmtree(here, ignore_errors=True)


def main(kind: str, first: int, end: int | None = None) -> None:
    """Go through inputs; what took too long may have been compiled, and gets a second trial."""
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        prepare(folder)
        for seed in range(first, first + 1 if end is None else end):
            found = judged(kind, seed, folder, show=end is None)
            if any(why.startswith("slow") for _, why in found):
                found = judged(kind, seed, folder)
            for words, why in found:
                print(as_line(kind, seed, words, why), flush=True)
        os.chdir("/")
    print(f"{kind} {first} to {seed}: done", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
