"""Commands about scenario files: validate, schema, init, params."""

from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from .console import BAD_INPUT, print_json, refuse, talk, write_new

if TYPE_CHECKING:
    from ..mistakes import Mistake
    from ..scenario_keys import Key


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@click.option("--json", "as_json", is_flag=True, help="Print the mistakes as JSON.")
@click.pass_context
def validate(context: click.Context, files: tuple[str, ...], as_json: bool) -> None:
    """List every mistake in scenario or experiment files, with its place and remedy."""
    found = {file: _mistakes(file) for file in files}
    if as_json:
        report = {file: [asdict(mistake) for mistake in found[file]] for file in found}
        print_json({"valid": not any(found.values()), "files": report})
    else:
        for file, mistakes in found.items():
            click.echo("\n".join(map(str, mistakes)) or f"{file}: ok")
    total = sum(map(len, found.values()))
    if total:
        talk(f"{total} mistake{'s' if total > 1 else ''}")
        context.exit(BAD_INPUT)


def _mistakes(file: str) -> "list[Mistake]":
    from ..campaigns.experiments.kinds import is_experiment
    from ..mistakes import ScenarioError
    from ..plain_yaml import read_yaml
    from ..scenario_file import load_scenario, read_text

    try:
        data = read_yaml(read_text(file), file).data
        if is_experiment(data):
            from ..campaigns.experiments.experiment_file import load_experiment

            load_experiment(file)
        else:
            load_scenario(file)
    except ScenarioError as error:
        return error.mistakes
    return []


@click.command()
@click.argument("kind", type=click.Choice(["scenario", "experiment"]), default="scenario")
def schema(kind: str) -> None:
    """Print the JSON Schema of scenario or experiment files, for completion in editors."""
    if kind == "experiment":
        from ..campaigns.experiments.experiment_schema import experiment_schema

        print_json(experiment_schema())
        return
    from ..scenario_keys import json_schema

    print_json(json_schema())


@click.command()
@click.argument("name", metavar="[TEMPLATE]", default="starter")
@click.option("--out", metavar="FILE", help="Write it to a file instead of stdout.")
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
def init(name: str, out: str | None, force: bool) -> None:
    """Write a commented starter scenario.

    TEMPLATE is starter (the default), paper, still or large.
    """
    from ..templates import template

    try:
        text = template(name)
    except LookupError as error:
        refuse(str(error.args[0]))
    if out is None:
        click.echo(text, nl=False)
        return
    write_new(out, text, force)
    talk(f"Now try: bindusbl-des run {out}")


@click.command()
@click.argument("pattern", default="")
@click.option("--json", "as_json", is_flag=True, help="Print the keys as JSON.")
def params(pattern: str, as_json: bool) -> None:
    """List the keys of a scenario: default, range, meaning, source.

    PATTERN selects keys that contain it, or match it if it has a * in it.
    """
    from ..scenario_keys import keys
    from ..wording import did_you_mean

    rows = [row for row in keys() if _matches(row, pattern)]
    if not rows:
        hint = did_you_mean(pattern, [row.name for row in keys()])
        refuse(f"no key matches {pattern!r}{hint or '; `bindusbl-des params` lists all'}")
    if as_json:
        print_json([asdict(row) for row in rows])
    else:
        click.echo("\n".join(_paragraph(row) for row in rows))


def _matches(row: "Key", pattern: str) -> bool:
    from fnmatch import fnmatchcase

    wanted = pattern.lower()
    return fnmatchcase(row.key, wanted if "*" in wanted else f"*{wanted}*")


def _paragraph(row: "Key") -> str:
    """Return the first line to grep for and the second to read."""
    unit = "" if row.unit in ("", "1") else f" {row.unit}"
    allowed = " | ".join(row.choices) or f"{row.kind} {row.range}".strip()
    only = f"; only auvs.route.kind: {row.only}" if row.only else ""
    source = f" [{row.source}]" if row.source else ""
    return f"{row.key}: {row.default}{unit}  ({allowed})\n    {row.meaning}{only}{source}"
