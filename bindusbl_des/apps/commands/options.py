"""The options and arguments that several commands have, each written once and meaning the same."""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from glob import escape, glob
from math import isfinite
from typing import Any

import click
from click.shell_completion import CompletionItem

from ...support.mistakes import ScenarioError
from ...support.plugins import allowed_everywhere
from ...support.shipped import KINDS, located, shipped
from .console import AS_JSON, QUIET, refusing

Command = Callable[[Any], Any]

# What may also stand before the name of a command, and is handed on to it.
JSON = "--json"
SET = "--set"

# Options that a command's talk and answer heed, wherever in it these are, and their notes.
NOTED = {"quiet": QUIET, "as_json": AS_JSON}


class Range(click.FloatRange):
    """A number within bounds; nan, which no bound holds, and infinity are none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number that was given."""
        number: float = super().convert(value, param, ctx)
        if not isfinite(number):
            self.fail(f"{value} is no number to count with; give a finite one", param, ctx)
        return number


def _note(context: click.Context, option: click.Parameter, given: bool) -> None:
    if given:
        context.meta[NOTED[str(option.name)]] = True


quiet_option = click.option(
    "-q",
    "--quiet",
    is_flag=True,
    expose_value=False,
    callback=_note,
    help="Say nothing on stderr but what is wrong.",
)


def json_option(what: str, *, exposed: bool = False) -> Command:
    """Give a command the option ``--json``: one JSON document on stdout and nothing else.

    What is printed is decided by :func:`.console.answer`; the program itself hands the option on.
    """
    return click.option(
        JSON, "as_json", is_flag=True, expose_value=exposed, callback=None if exposed else _note,
        help=f"Print {what} as JSON.",
    )  # fmt: skip


def out_option(metavar: str, explained: str, *, required: bool = False) -> Command:
    """Give a command the option ``--out``; a name that is empty, as that of a shell's variable
    which was not set, is refused.
    """
    return click.option(
        "--out", metavar=metavar, callback=_named, required=required, help=explained
    )


def _named(_: click.Context, __: click.Parameter, given: str | None) -> str | None:
    if given == "":
        raise click.BadParameter("is empty; give a name, or leave the option out")
    return given


def force_option(explained: str) -> Command:
    """Give a command the option ``--force``."""
    return click.option("--force", is_flag=True, help=explained)


def scenario_keys(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return what a shell offers for KEY=VALUE: keys, of the schema that ships for editors."""
    path = next(iter(shipped("scenarios").values())).parent / "scenario.schema.json"
    schema = json.loads(path.read_text(encoding="utf-8"))

    def within(part: Any, above: str) -> Iterator[str]:
        if "$ref" in part:
            yield from within(schema["$defs"][part["$ref"].rpartition("/")[2]], above)
        for name, inner in part.get("properties", {}).items():
            key = f"{above}{name}"
            below = list(within(inner, f"{key}."))
            yield from below or (f"{key}=",)
        for arm in part.get("anyOf", ()):
            yield from within(arm, above)

    names = dict.fromkeys(key for key in within(schema, "") if key.startswith(begun))
    return [CompletionItem(key) for key in names]


def bare_keys(*asked: Any) -> list[CompletionItem]:
    """Return what a shell offers for KEY."""
    return [CompletionItem(key.value.removesuffix("=")) for key in scenario_keys(*asked)]


def goal_metrics(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return what a shell offers for METRIC=VALUE."""
    from ...core.records.metrics import metrics

    return [CompletionItem(f"{name}=") for name in metrics() if name.startswith(begun)]


def mission_metrics(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return what a shell offers for the METRIC of a mission: also those of its worst AUV."""
    from ...core.records.metrics import WORST, AuvMetrics, metrics

    bad = [f"{WORST}{field.name}" for field in fields(AuvMetrics) if field.metadata["worst"]]
    names = [*bad, *metrics()]
    return [CompletionItem(name) for name in names if name.startswith(begun)]


def stopping_metrics(*asked: Any) -> list[CompletionItem]:
    """Return what a shell offers for METRIC=WIDTH."""
    return [CompletionItem(f"{metric.value}=") for metric in mission_metrics(*asked)]


set_option = click.option(
    SET,
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    shell_complete=scenario_keys,
    help="Override a key of the scenario, such as acoustics.hf.range_m=100; repeatable.",
)


def shared_options(program: Any) -> Any:
    """Give the program the options that may stand before the name of a command."""
    return set_option(json_option("what is found", exposed=True)(quiet_option(program)))


def handed_on(given: Mapping[str, Any], command: click.Command) -> list[str]:
    """Return the words for a command that stood before its name; refuse what it does not have."""
    words = [JSON] if given["as_json"] else []
    words += [f"{SET}={text}" for text in given["overrides"]]
    known = {name for param in command.params for name in param.opts}
    for option in (word.partition("=")[0] for word in words):
        if option not in known:
            raise click.UsageError(f"{command.name} has no option {option}")
    return words


anyway_option = click.option(
    "--anyway",
    is_flag=True,
    help="Begin even a mission that needs more memory than the machine has, or over a day.",
)

plugins_option = click.option(
    "--allow-plugins",
    is_flag=True,
    callback=lambda context, parameter, given: given or allowed_everywhere(),
    help="Load the code that the file names as module:object (or BINDUSBL_ALLOW_PLUGINS=1).",
)

seed_option = click.option(
    "--seed", type=click.IntRange(min=0), default=0, help="Random seed (default 0)."
)

folder_argument = click.argument("folder", metavar="DIR")
folders_argument = click.argument("folders", metavar="DIR...", nargs=-1, required=True)


def shipped_or_file(kinds: tuple[str, ...] = KINDS) -> Callable[..., list[CompletionItem]]:
    """Return what a shell offers for an argument: names that ship and files, or files alone."""

    def offered(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
        names = [name for kind in kinds for name in shipped(kind) if name.startswith(begun)]
        if not names:  # the shell completes files by itself
            return [CompletionItem(begun, type="file")]
        files = sorted(glob(f"{escape(begun)}*"))
        return [*map(CompletionItem, names), *map(CompletionItem, files)]

    return offered


def _file_argument(name: str, metavar: str, kinds: tuple[str, ...]) -> Command:
    """Return the argument of a file, or of the name of one that ships."""

    def found(context: click.Context, _: click.Parameter, given: str) -> str:
        with refusing(ScenarioError):
            return located(given, kinds)

    return click.argument(
        name, metavar=metavar, callback=found, shell_complete=shipped_or_file(kinds)
    )


scenario_argument = _file_argument("scenario", "SCENARIO", KINDS[:1])
experiment_argument = _file_argument("file", "FILE", KINDS)
plan_argument = _file_argument("file", "SCENARIO|PLAN.yaml", KINDS[:1])


def _shard(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Return the two numbers of a share of a campaign, written ``i/N``: the i-th of N."""
    if text is None:
        return None
    numbers = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if not numbers or not 1 <= int(numbers[1]) <= int(numbers[2]):
        raise click.BadParameter(f"{text!r} is no share; write i/N with 1 <= i <= N, such as 1/4")
    return int(numbers[1]), int(numbers[2])


shard_option = click.option(
    "--shard", metavar="i/N", callback=_shard, help="Run the i-th of N shares; `merge` joins them."
)

workers_option = click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes at once (default: one per CPU).",
)


def given_options(*options: Command) -> Command:
    """Return the decorator that gives a command several options, which help lists in this order."""

    def give(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return give


worker_options = given_options(
    workers_option,
    click.option(
        "--mission-timeout",
        type=float,
        metavar="SECONDS",
        help="End a mission that takes longer; it counts as failed.",
    ),
    click.option(
        "--backend", default="local", metavar="local|dask:ADDRESS", help="Who does the work."
    ),
    json_option("a summary"),
)

# What is laid over an experiment or a scenario
experiment_options = given_options(
    click.option(
        "--vary",
        metavar="KEY=V1,V2",
        multiple=True,
        shell_complete=scenario_keys,
        help="Vary a key, such as asvs.count=2,3, 2:5 (2, 3, 4, 5) or 0:90:15 (first:last:step); "
        "several make a grid.",
    ),
    click.option(
        "--seeds", type=click.IntRange(min=1), metavar="N", help="Seeds 0 to N - 1 at each point."
    ),
    click.option(
        "--until-ci",
        metavar="METRIC=WIDTH",
        shell_complete=stopping_metrics,
        multiple=True,
        help="Stop a point when half the width of the metric's 95 % CI is at most this, such as "
        "5% of the mean or 0.02; --seeds is the largest number of seeds then (default 256).",
    ),
    click.option(
        "--detail", type=click.Choice(["summary", "full"]), help="Keep metrics only, or all events."
    ),
)
