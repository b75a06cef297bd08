"""How tests run the command line."""

from typing import Any

from click.testing import CliRunner, Result

from bindusbl_des.cli import main

COMMANDS = main.commands


def call(*words: object, **settings: Any) -> Result:
    """Run a command; an exception that is no exit is a failure of the test."""
    line = [str(word) for word in words]
    return CliRunner().invoke(main, line, **{"catch_exceptions": False, **settings})
