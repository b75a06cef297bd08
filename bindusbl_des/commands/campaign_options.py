"""The options of the commands that run campaigns: what is varied, and who does the work."""

import re
from typing import Any

import click

from .options import json_option


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
    return click.option(
        "--workers",
        type=click.IntRange(min=1),
        metavar="N",
        help="Processes at once (default: one per CPU).",
    )(command)


def experiment_options(command: Any) -> Any:
    """Give a command the options that are laid over an experiment or a scenario."""
    command = click.option(
        "--detail", type=click.Choice(["summary", "full"]), help="Keep metrics only, or all events."
    )(command)
    command = click.option(
        "--until-ci",
        metavar="METRIC=WIDTH",
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
        help="Vary a key, such as asvs.count=2,3, 2:5 (2, 3, 4, 5) or 0:90:15 (first:last:step); "
        "several make a grid.",
    )(command)
