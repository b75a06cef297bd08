"""Python that leaves asserts and docstrings out."""

import subprocess
import sys


def test_commands_have_their_help_without_docstrings() -> None:
    """`python -OO` validates a scenario, and tells what commands are for."""
    for words, said in (
        (("validate", "quickstart"), "quickstart: ok"),
        (("explain", "--help"), "Usage:"),
    ):
        ran = subprocess.run(
            [sys.executable, "-OO", "-m", "bindusbl_des.cli", *words],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (ran.returncode, said in ran.stdout + ran.stderr) == (0, True), ran.stderr
