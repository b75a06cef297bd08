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

from ..core.mistakes import ScenarioError
from ..core.plugins import allowed_everywhere
from ..core.shipped import KINDS, located, shipped
from .console import be_quiet, refuse

Command = Callable[[Any], Any]

# What may also stand before the name of a command, and is handed on to it.
JSON = "--json"
SET = "--set"


class Range(click.FloatRange):
    """A number within bounds; nan, which no bound holds, and infinity are none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number that somebody has given."""
        found: float = super().convert(value, param, ctx)
        if not isfinite(found):
            self.fail(f"{value} is no number to count with; give a finite one", param, ctx)
        return found


def quiet_option(command: Any) -> Any:
    """Give the program or a command the option ``-q``."""

    def note(context: click.Context, _: click.Parameter, given: bool) -> None:
        if given:
            be_quiet(context)

    return click.option(
        "-q",
        "--quiet",
        is_flag=True,
        expose_value=False,
        callback=note,
        help="Say nothing on stderr but what is wrong.",
    )(command)


def json_option(what: str) -> Command:
    """Give a command the option ``--json``: one JSON document on stdout and nothing else."""
    return click.option(JSON, "as_json", is_flag=True, help=f"Print {what} as JSON.")


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
    from ..records.metrics import metrics

    return [CompletionItem(f"{name}=") for name in metrics() if name.startswith(begun)]


def mission_metrics(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
    """Return what a shell offers for the METRIC of a mission: also those of its worst AUV."""
    from ..records.metrics import WORST, AuvMetrics, metrics

    bad = [f"{WORST}{field.name}" for field in fields(AuvMetrics) if field.metadata["worst"]]
    names = [*bad, *metrics()]
    return [CompletionItem(name) for name in names if name.startswith(begun)]


def stopping_metrics(*asked: Any) -> list[CompletionItem]:
    """Return what a shell offers for METRIC=WIDTH."""
    return [CompletionItem(f"{metric.value}=") for metric in mission_metrics(*asked)]


def set_option(command: Any) -> Any:
    """Give a command the option ``--set dotted.key=value``."""
    return click.option(
        SET,
        "overrides",
        metavar="KEY=VALUE",
        multiple=True,
        shell_complete=scenario_keys,
        help="Override a key of the scenario, such as acoustics.hf.range_m=100; repeatable.",
    )(command)


def shared_options(program: Any) -> Any:
    """Give the program the options that may stand before the name of a command."""
    return set_option(json_option("what is found")(quiet_option(program)))


def handed_on(given: Mapping[str, Any], command: click.Command) -> list[str]:
    """Return the words for a command that stood before its name; refuse what it does not have."""
    words = [JSON] if given["as_json"] else []
    words += [f"{SET}={text}" for text in given["overrides"]]
    known = {name for param in command.params for name in param.opts}
    for option in (word.partition("=")[0] for word in words):
        if option not in known:
            raise click.UsageError(f"{command.name} has no option {option}")
    return words


def anyway_option(command: Any) -> Any:
    """Give a command the option ``--anyway``."""
    return click.option(
        "--anyway",
        is_flag=True,
        help="Begin even a mission that needs more memory than the machine has, or over a day.",
    )(command)


def plugins_option(command: Any) -> Any:
    """Give a command that runs missions the option ``--allow-plugins``."""
    return click.option(
        "--allow-plugins",
        is_flag=True,
        callback=lambda context, parameter, given: given or allowed_everywhere(),
        help="Load the code that the file names as module:object (or BINDUSBL_ALLOW_PLUGINS=1).",
    )(command)


def scenario_argument(command: Any) -> Any:
    """Give a command the argument of a scenario: a file, or the name of one that ships."""
    return _file_argument("scenario", "SCENARIO", KINDS[:1])(command)


def experiment_argument(command: Any) -> Any:
    """Give a command the argument of an experiment or a scenario: a file, or a shipped name."""
    return _file_argument("file", "FILE", KINDS)(command)


def plan_argument(command: Any) -> Any:
    """Give a command the argument of a plan's file or a scenario's, or of a shipped name."""
    return _file_argument("file", "SCENARIO|PLAN.yaml", KINDS[:1])(command)


def _file_argument(name: str, metavar: str, kinds: tuple[str, ...]) -> Command:
    def found(context: click.Context, _: click.Parameter, given: str) -> str:
        try:
            return located(given, kinds)
        except ScenarioError as error:
            refuse(str(error))

    return click.argument(
        name, metavar=metavar, callback=found, shell_complete=shipped_or_file(kinds)
    )


def shipped_or_file(kinds: tuple[str, ...] = KINDS) -> Callable[..., list[CompletionItem]]:
    """Return what a shell offers for an argument: names that ship and files, or files alone."""

    def offered(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
        names = [name for kind in kinds for name in shipped(kind) if name.startswith(begun)]
        if not names:  # the shell completes files by itself
            return [CompletionItem(begun, type="file")]
        files = sorted(glob(f"{escape(begun)}*"))
        return [*map(CompletionItem, names), *map(CompletionItem, files)]

    return offered


def shard_option(command: Any) -> Any:
    """Give a command the option ``--shard i/N``."""
    return click.option(
        "--shard",
        metavar="i/N",
        callback=_shard,
        help="Run the i-th of N shares; `merge` joins them.",
    )(command)


def _shard(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Return the two numbers of a share of a campaign, written ``i/N``: the i-th of N."""
    if text is None:
        return None
    numbers = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if not numbers or not 1 <= int(numbers[1]) <= int(numbers[2]):
        raise click.BadParameter(f"{text!r} is no share; write i/N with 1 <= i <= N, such as 1/4")
    return int(numbers[1]), int(numbers[2])


def workers_option(command: Any) -> Any:
    """Give a command the option that says how many processes work."""
    return click.option(
        "--workers",
        type=click.IntRange(min=1),
        metavar="N",
        help="Processes at once (default: one per CPU).",
    )(command)


def worker_options(command: Any) -> Any:
    """Give a command the options that say who does the work."""
    command = json_option("a summary")(command)
    command = click.option(
        "--backend", default="local", metavar="local|dask:ADDRESS", help="Who does the work."
    )(command)
    command = click.option(
        "--mission-timeout",
        type=float,
        metavar="SECONDS",
        help="End a mission that takes longer; it counts as failed.",
    )(command)
    return workers_option(command)


def experiment_options(command: Any) -> Any:
    """Give a command the options that are laid over an experiment or a scenario."""
    command = click.option(
        "--detail", type=click.Choice(["summary", "full"]), help="Keep metrics only, or all events."
    )(command)
    command = click.option(
        "--until-ci",
        metavar="METRIC=WIDTH",
        shell_complete=stopping_metrics,
        multiple=True,
        help="Stop a point when half the width of the metric's 95 % CI is at most this, such as "
        "5% of the mean or 0.02; --seeds is the largest number of seeds then (default 256).",
    )(command)
    command = click.option(
        "--seeds", type=click.IntRange(min=1), metavar="N", help="Seeds 0 to N - 1 at each point."
    )(command)
    return click.option(
        "--vary",
        metavar="KEY=V1,V2",
        multiple=True,
        shell_complete=scenario_keys,
        help="Vary a key, such as asvs.count=2,3, 2:5 (2, 3, 4, 5) or 0:90:15 (first:last:step); "
        "several make a grid.",
    )(command)
