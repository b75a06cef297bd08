"""How tests run the command line."""

from click.testing import CliRunner, Result

from bindusbl_des.cli import main


def call(*words: object) -> Result:
    """Run a command; an exception that is no exit is a failure of the test."""
    return CliRunner().invoke(main, [str(word) for word in words], catch_exceptions=False)
