"""The reference of commands, keys and tables, from what the program itself goes by.

python docs/make_reference.py > docs/reference.md
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import click

from bindusbl_des.apps.campaigns.experiments.experiment_file import experiment_schema
from bindusbl_des.cli import main
from bindusbl_des.core.results.schemas import data_dictionary
from bindusbl_des.core.scenario.keys import Key, items, keys, sections, settings

HEAD = """\
# Reference

Written by `python docs/make_reference.py` from the program itself. The same at the command line:
`bindusbl-des COMMAND --help`, `params [WORD]`, `schema`; and `data_dictionary.json` in each
result folder.
"""

SHARED = """\
`-q` (say nothing on stderr but what is wrong) is an option of every command, `--json` (one JSON
document on stdout and nothing else) of all but `init`, `--set KEY=VALUE` of those that read a
scenario. They mean the same everywhere and may stand before the command's name as well. Mistakes
are told on stderr in lines, with `--json` too; those that `validate` lists are its document.

A scenario or experiment is a file or the name of one that ships, such as `quickstart` or `table_1`;
a file of that name wins.
"""

RANGES = """\
Values of `--vary` are written as in a file, with commas between them. `2:5` stands for 2, 3, 4, 5
and `0:90:15` (first:last:step) for 0, 15 and so on up to 90; the last is in if the steps meet it.
Ranges mix with values: `asvs.count=1,3:5`; `protocol.schedule=dsatur,my_module:mine` names a
plug-in. Experiment files have ranges as well, in a list or in its stead: `vary: {asvs.count: 2:5}`.
"""

COMPLETION = """\
### Completion in shells

Commands, options, files, the names of what ships, keys (after `--set`, `--vary`, `--by`, `params`)
and metrics (after `--below`, `--metric`, `--until-ci`) are completed after one line in the shell's
own file (bash 4.4 or newer):

* bash, `~/.bashrc`: `eval "$(_BINDUSBL_DES_COMPLETE=bash_source bindusbl-des)"`
* zsh, `~/.zshrc`: `eval "$(_BINDUSBL_DES_COMPLETE=zsh_source bindusbl-des)"`
* fish, `~/.config/fish/config.fish`: `_BINDUSBL_DES_COMPLETE=fish_source bindusbl-des | source`
"""

EXIT_CODES = {
    0: "done",
    1: "a run failed although its input was in order; `verify` refused",
    2: "bad input: a wrong file, key, value, option or folder, or one that cannot be written; "
    "nothing was replaced",
    3: "a campaign finished, but some of its missions failed; `verify` is undecided",
    129: "ended by SIGHUP",
    130: "interrupted (Ctrl-C)",
    143: "ended by SIGTERM",
}

TABLE_MEANING = {
    "rounds": "a round",
    "pings": "a ping",
    "receptions": "a ping at an ASV",
    "broadcasts": "an MF frame",
    "frame_receptions": "an MF frame at an AUV; instant answers are none",
    "assignments": "a slot of an AUV that it has to be told (`knowledge: broadcast`)",
    "fixes": "a fix, fused over the ASVs that heard the same ping; columns from `hops` on are "
    "written with `protocol.acknowledge`, `repeat` or `relay`",
    "gnss_fixes": "a fix of an AUV at the surface; written with `navigation.gnss_fix`",
    "packets": "a data packet of an AUV; written with `traffic`",
    "auv_frames": "a frame that an AUV sent; written with `protocol.relay` or `acknowledge: frame`",
    "auv_frame_receptions": "such a frame at a vehicle that it reaches; written with them",
    "signals": "a signal sent beside pings; written with `protocol.access` or `navigation.peers`",
    "signal_receptions": "a signal, or AUV's ping, at a vehicle; written with those",
    "peer_ranges": "what an AUV measured of another; written with `navigation.peers`",
    "modem_lines": "a line between a modem and its host; written with `modems`",
    "tracks": "a vehicle at an instant, at `record.tracks_hz`",
    "auvs": "the metrics of an AUV",
    "mission": "the metrics of the mission: fleet means of `auvs`, and what it has as a whole",
}


def reference() -> str:
    """Return the reference page: commands, exit codes, scenario and experiment keys, tables."""
    parts = [_commands(), _exit_codes(), _scenario_keys(), _experiment_keys(), _tables()]
    return "\n".join([HEAD, *(line for part in parts for line in part)])


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    for row in (head, ["---"] * len(head), *rows):
        yield "| " + " | ".join(map(_cell, row)) + " |"
    yield ""


def _cell(text: str) -> str:
    """Return text that neither a table nor a browser takes for its own."""
    return text.replace("|", "\\|").replace("<", "&lt;")


def _commands() -> Iterator[str]:
    yield "## Commands\n"
    yield SHARED
    for name, command in main.commands.items():
        context = click.Context(command, info_name=f"bindusbl-des {name}")
        yield f"### {name}\n"
        usage = command.get_usage(context).removeprefix("Usage: ").replace("[OPTIONS] ", "")
        yield f"`{usage.replace('[[', '[').replace(']]', ']')}`\n"  # older versions say it twice
        yield _paragraphs(command.help or "")
        options = [it for it in command.params if isinstance(it, click.Option)]
        records = [it.get_help_record(context) for it in options if "-q" not in it.opts]
        # A bar in code needs a backslash in some dialects of Markdown, and shows it in others.
        rows = [(f"`{record[0].replace('|', ' or ')}`", record[1]) for record in records if record]
        if rows:
            yield from _table(("option", "meaning"), rows)
        if name == "sweep":
            yield RANGES
    yield COMPLETION


def _paragraphs(text: str) -> str:
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n")) + "\n"


def _exit_codes() -> Iterator[str]:
    yield "## Exit codes\n"
    rows = [(str(code), meaning) for code, meaning in EXIT_CODES.items()]
    yield from _table(("code", "meaning"), rows)


def _scenario_keys() -> Iterator[str]:
    yield "## Scenario keys\n"
    yield "Unknown keys are errors; every key has a default but `name`.\n"
    yield from _key_table("")
    for section, meaning in sections().items():
        if any(row.section == section for row in keys()):
            yield f"### {section}\n"
            yield f"{meaning[0].upper()}{meaning[1:]}.\n"
            yield from _key_table(section)
    yield "### Items of lists\n"
    yield "Keys of which each item of a list has its own.\n"
    rows = [(f"`{row.key}`", *_key_row(row)[1:5]) for row in items()]
    yield from _table(("key", *KEY_COLUMNS[1:5]), rows)
    yield "### Settings of parts\n"
    yield (
        "Where `module:object` is among the choices, the key takes a name or a mapping of the part "
        "and its settings, `{model: name-or-module:object, setting: value}`. The settings of your "
        "own part are its keyword-only parameters (docs/extending.md); of parts that ship these "
        "have some:\n"
    )
    rows = [
        (f"`{row.key}`", *_key_row(row)[1:4], f"{row.meaning}; only `model: {row.only}`")
        for row in settings()
    ]
    yield from _table(("setting", *KEY_COLUMNS[1:5]), rows)


KEY_COLUMNS = ("key", "default", "unit", "range or choices", "meaning", "source")


def _key_table(section: str) -> Iterator[str]:
    rows = [_key_row(row) for row in keys() if row.section == section]
    yield from _table(KEY_COLUMNS, rows)


def _key_row(row: Key) -> tuple[str, ...]:
    allowed = " ".join(f"`{choice}`" for choice in row.choices) or f"{row.kind} {row.range}".strip()
    only = f"; only `{row.chooser}: {row.only}`" if row.only else ""
    default = "" if row.default.startswith("(") else f"`{row.default}`"
    return f"`{row.name}`", default, row.unit, allowed, row.meaning + only, row.source


def _experiment_keys() -> Iterator[str]:
    yield "## Experiment keys\n"
    yield "For `bindusbl-des sweep`; `bindusbl-des schema experiment` has them for editors.\n"
    schema: dict[str, Any] = experiment_schema()
    rows = [(f"`{key}`", value["description"]) for key, value in schema["properties"].items()]
    yield from _table(("key", "meaning"), rows)


def _tables() -> Iterator[str]:
    yield "## Tables\n"
    yield (
        "Parquet files of a result folder. A value that does not exist is null; vehicles are named "
        "AUV0, ASV0, ...; positions and headings are in the survey frame: x north, y east, "
        "z down.\n"
    )
    for table, columns in data_dictionary().items():
        yield f"### {table}\n"
        yield f"A row is {TABLE_MEANING[table]}.\n"
        rows = [
            (f"`{name}`", told["type"], told["unit"], told["meaning"])
            for name, told in columns.items()
        ]
        yield from _table(("column", "type", "unit", "meaning"), rows)


if __name__ == "__main__":
    print(reference(), end="")
