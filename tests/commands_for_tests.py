"""How tests run the command line."""

import json
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from click.testing import CliRunner, Result

import bindusbl_des
from bindusbl_des.cli import main

COMMANDS = main.commands


def params(word: str = "") -> list[dict[str, Any]]:
    """Return the keys of a scenario, and metrics, as `params` lists them, or those of a word."""
    found: list[dict[str, Any]] = json.loads(
        call("params", *([word] * bool(word)), "--json").stdout
    )
    return found


def call(*words: object, **settings: Any) -> Result:
    """Run a command; an exception that is no exit is a failure of the test."""
    line = [str(word) for word in words]
    return CliRunner().invoke(main, line, **{"catch_exceptions": False, **settings})


def explained(result: bindusbl_des.Result, **which: int) -> str:
    """Return what `explain` tells of a mission's ping or fix, as one line."""
    [(kind, number)] = which.items()
    return each_explained(result, kind, [number])[0]


def each_explained(result: bindusbl_des.Result, kind: str, numbers: Iterable[int]) -> list[str]:
    """Return what `explain` tells of each of some pings or fixes, a line for each."""
    with TemporaryDirectory() as folder:
        written = result.write(Path(folder) / "r")
        told = [call("explain", written, f"--{kind}", number) for number in numbers]
    assert {it.exit_code for it in told} <= {0}, told[-1].output
    return [" ".join(it.stdout.split()) for it in told]
