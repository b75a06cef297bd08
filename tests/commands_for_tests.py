"""How tests run the command line."""

from pathlib import Path
from tempfile import TemporaryDirectory

from click.testing import CliRunner, Result

import bindusbl_des
from bindusbl_des.cli import main


def call(*words: object) -> Result:
    """Run a command; an exception that is no exit is a failure of the test."""
    return CliRunner().invoke(main, [str(word) for word in words], catch_exceptions=False)


def explained(result: bindusbl_des.Result, **which: int) -> str:
    """Return what `explain` tells of a mission's ping or fix, as one line."""
    [(kind, number)] = which.items()
    with TemporaryDirectory() as folder:
        told = call("explain", result.write(Path(folder) / "r"), f"--{kind}", number)
    assert told.exit_code == 0, told.output
    return " ".join(told.stdout.split())
