"""Folders of a run and of a campaign that are damaged, and every command that reads folders."""

import shutil
from contextlib import suppress
from pathlib import Path
from random import Random

from commands_for_tests import COMMANDS

from .damages import DAMAGES
from .files import Lines
from .material import lay_out


def run(seed: int, draw: Random) -> Lines:
    """Damage the folder of a run; return what reads it."""
    return _damaged("run", draw)


def campaign(seed: int, draw: Random) -> Lines:
    """Damage the folder of a campaign; return what reads it."""
    return _damaged("campaign", draw)


def _damaged(name: str, draw: Random) -> Lines:
    lay_out([name])
    shutil.copytree(name, "whole")
    # all that tells is under a checksum: whole folders are read, damaged ones refused
    for _ in range(draw.choice((0, 0, 1, 1, 1, 2, 3))):
        files = sorted(it for it in Path(name).rglob("*") if it.is_file() and not it.is_symlink())
        telling = [it for it in files if it.suffix in (".json", ".parquet")]
        if not files:
            break
        with suppress(OSError):  # whoever is not root may be kept out by an earlier damage
            draw.choice(DAMAGES)(draw.choice(telling or files), draw)
    return _lines(name, draw)


def _lines(name: str, draw: Random) -> Lines:
    """Return a line for each command that takes a folder, and for each reader in Python."""
    lines = [["load_result", name], ["load_campaign", name]]
    for command in _reading_folders():
        lines.append([command, name, *draw.choice(_options(command, name, draw))])
    return lines


def _reading_folders() -> list[str]:
    """Return the names of all commands with an argument that is a folder."""
    return [
        name
        for name, command in COMMANDS.items()
        if any((it.metavar or "").startswith("DIR") for it in command.params[:1])
    ]


def _options(command: str, name: str, draw: Random) -> Lines:
    """Return the options a command is tried with, some of them; one not known here gets none."""
    of_runs = ("trajectory", "error", "fixes", "coverage", "timeline", "round", "latency")
    kinds = of_runs if name == "run" else ("curves", "heatmap")
    return {
        "explain": [["--ping", str(draw.randrange(9))], ["--fix", str(draw.randrange(9))]],
        "export": [["--to", "csv", "--out", "out"], ["--to", "mcap", "--out", "out.mcap"]],
        "plot": [[draw.choice(kinds), "--out", "out.svg"]],
        "report": [[], ["whole", "--out", "out.html"]],
        "compare": [["whole"], ["--by", "asvs.count", "--out", "out.csv"]],
        "merge": [["--out", "merged"], ["whole", "--out", "twice"]],
        "resume": [["--retry-failed"]],
    }.get(command, [[]])
