"""Commands about scenario files: validate, schema, init, and params and presets to put in."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...support.shipped import (
    ENDINGS,
    KINDS,
    listed,
    located,
    shipped,
)
from ...support.wording import counted, did_you_mean, plain
from .console import BAD_INPUT, answer, print_json, refuse, refusing, talk, write_new
from .options import (
    bare_keys,
    force_option,
    json_option,
    out_option,
    plugins_option,
    set_option,
    shipped_or_file,
)
from .starters import TEMPLATES, template

if TYPE_CHECKING:
    from ...core.scenario import keys as table
    from ...core.scenario.scenario import Scenario
    from ...models.presets.preset import Preset
    from ...support.mistakes import Mistake
    from ...support.plain_yaml import Document


@click.command(short_help="List every mistake in scenario or experiment files.")
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, shell_complete=shipped_or_file()
)
@set_option
@click.option("--strict", is_flag=True, help="Let warnings count as mistakes.")
@plugins_option
@json_option("mistakes and warnings")
@click.pass_context
def validate(
    context: click.Context,
    files: tuple[str, ...],
    overrides: tuple[str, ...],
    strict: bool,
    allow_plugins: bool,
) -> None:
    """List every mistake in scenario or experiment files, with its place and remedy.

    Warnings are listed as well: keys without effect, tracks that end
    early, frames too short for their rounds, plug-ins that were not loaded.  Such warnings leave
    the exit code at 0.
    """
    findings_of = {file: _findings(file, overrides, allow_plugins) for file in files}
    mistakes, warnings = (
        sum(len(findings[n]) for findings in findings_of.values()) for n in (0, 1)
    )
    refused = bool(mistakes or (strict and warnings))
    listed = [
        {
            file: [asdict(finding) for finding in findings[n]]
            for file, findings in findings_of.items()
        }
        for n in (0, 1)
    ]
    answer(
        {"valid": not refused, "files": listed[0], "warnings": listed[1]},
        [
            "\n".join(map(str, (*wrong, *warned))) or f"{file}: ok"
            for file, (wrong, warned) in findings_of.items()
        ],
    )
    if mistakes or warnings:
        found_of = ((mistakes, "mistake"), (warnings, "warning"))
        talk(", ".join(counted(count, noun) for count, noun in found_of if count))
    if refused:
        context.exit(BAD_INPUT)


def _findings(
    file: str, overrides: tuple[str, ...], allow_plugins: bool
) -> "tuple[Sequence[Mistake], Sequence[Mistake]]":
    """Return the mistakes of a file, and warnings about it."""
    from ...core.scenario.files.scenario_file import Source
    from ...support.mistakes import ScenarioError
    from ...support.plain_yaml import read_yaml
    from ..campaigns.experiments.experiment_points import is_experiment, is_plan
    from ..preflight.warnings import read_scenario

    try:
        file = located(file)
        source = Source.file(file, overrides)
        document = read_yaml(source.text, file)
        if is_plan(document.data):
            from ..campaigns.experiments.options import Options
            from ..planning.question import Asking, read_plan

            options = Options(overrides=overrides)
            asked = read_plan(file, Asking(options=options, allow_plugins=allow_plugins)).experiment
            return (), (*asked.warnings, *asked.unloaded)
        if is_experiment(document.data):
            from ..campaigns.experiments.experiment_file import experiment_in
            from ..campaigns.experiments.options import Options

            options = Options(overrides=overrides)
            plan = experiment_in(document, options, allow_plugins=allow_plugins)
            return (), (*plan.warnings, *plan.unloaded)
        reading = read_scenario(source, allow_plugins=allow_plugins)
        refused: tuple[Mistake, ...] = ()
        if reading.scenario.plugins and not reading.unloaded:
            refused = tuple(_refused(document, reading.scenario))
        return refused, (*reading.warnings, *reading.unloaded)
    except ScenarioError as error:
        return error.mistakes, ()


def _refused(document: "Document", scenario: "Scenario") -> "Iterator[Mistake]":
    """Yield why a mission refuses user-defined parts, which it asks where vehicles go."""
    from ...core.mission.mission import Mission
    from ...support.mistakes import Problem
    from ...support.plugins import PluginError

    try:
        Mission(scenario)
    except PluginError as error:
        yield document.mistake(Problem(error.key, error.message))
    except (ValueError, ArithmeticError, RuntimeError) as error:  # of hulls on user-defined routes
        key = next(iter(scenario.plugins))
        yield document.mistake(Problem(key, str(error)))


@click.command(short_help="Print the JSON Schema of scenario or experiment files.")
@click.argument("kind", type=click.Choice(["scenario", "experiment"]), default="scenario")
@json_option("it, with or without this option,")
def schema(kind: str) -> None:
    """Print the JSON Schema of scenario or experiment files, for completion in editors."""
    if kind == "experiment":
        from ..campaigns.experiments.experiment_file import experiment_schema

        print_json(experiment_schema())
        return
    from ...core.scenario import keys as table

    print_json(table.json_schema())


@click.command()
@click.argument(
    "name", metavar="[NAME]", default="starter", shell_complete=lambda *asked: _begun(asked[-1])
)
@out_option("FILE", "Write it to a file instead of stdout.")
@force_option("Replace the file if it exists.")
def init(name: str, out: str | None, force: bool) -> None:
    """Write a commented starter scenario, or copy a file that ships.

    NAME is starter (the default), paper, still or large, or that of a scenario or an experiment
    that ships, such as quickstart or table_1.
    """
    text = _text_named(name)
    if out is None:
        click.echo(text, nl=False)
        return
    write_new(Path(out), text, force)
    talk(f"Now try: bindusbl-des {'sweep' if name in shipped('experiments') else 'run'} {out}")


def _begun(begun: str) -> list[str]:
    """Return the names that `init` knows and that begin so."""
    names = (name for kind in KINDS for name in shipped(kind))
    return [name for name in (*TEMPLATES, *names) if name.startswith(begun)]


def _text_named(name: str) -> str:
    """Return the text of a starter or of a file that ships, or end the command."""
    for kind in KINDS:
        if name in shipped(kind):
            return shipped(kind)[name].read_text(encoding="utf-8")
    if name not in TEMPLATES and Path(name).suffix in ENDINGS:
        refuse(f"{name}: init takes the name of a starter; `init --out {name}` writes one to it")
    if name not in TEMPLATES:
        hint = did_you_mean(
            name, [*TEMPLATES, *(known for kind in KINDS for known in shipped(kind))]
        )
        there = "? There" if hint else "; there"
        names = ", ".join(TEMPLATES)
        refuse(f"no template {name!r}{hint[:-1]}{there} are {names}; and of what ships {listed()}")
    return template(name)


@click.command()
@click.argument("pattern", metavar="[WORD]", default="", shell_complete=bare_keys)
@json_option("the keys")
def params(pattern: str) -> None:
    """List the keys of a scenario: default, range, meaning, source.

    WORD selects keys that have it in their name, their meaning or their choices, and metrics; with
    a * in it, as in acoustics.*.range_m, it must match the whole name.
    """
    from ...core.records.metrics import WORST, metrics
    from ...core.scenario import keys as table

    # of a mission's worst AUV the metric of each AUV has the meaning
    wanted = pattern.lower().removeprefix(WORST)
    known = table.keys()
    rows = [row for row in (*known, *table.items(), *table.settings()) if _matches(row, pattern)]
    measured = [
        {"key": name, "kind": "metric", "unit": unit, "meaning": meaning}
        for name, (unit, meaning) in metrics().items()
        if wanted and wanted in f"{name} {meaning}".lower()
    ]
    if not rows and not measured:
        hint = did_you_mean(pattern, [*(row.name for row in known), *metrics()])
        refuse(f"no key matches {pattern!r}{hint or '; `bindusbl-des params` lists all'}")
    columns = [
        f"{metric['key']}: metric, {metric['unit']}\n    {metric['meaning']}" for metric in measured
    ]
    answer([*map(asdict, rows), *measured], [*map(_paragraph, rows), *columns])


def _matches(row: "table.Key", pattern: str) -> bool:
    from fnmatch import fnmatchcase

    wanted = pattern.lower()
    if "*" in wanted:
        return fnmatchcase(row.key, wanted)
    return any(wanted in text.lower() for text in (row.key, row.meaning, *row.choices))


def _paragraph(row: "table.Key") -> str:
    """Return the first line to grep for and the second to read."""
    unit = "" if row.unit in ("", "1") else f" {row.unit}"
    allowed = " | ".join(row.choices) or f"{row.kind} {row.range}".strip()
    only = f"; only {row.condition}" if row.only else ""
    source = f" [{row.source}]" if row.source else ""
    return f"{row.key}: {row.default}{unit}  ({allowed})\n    {row.meaning}{only}{source}"


@click.command(short_help="List modems, USBLs and inertial systems by name.")
@click.argument("word", metavar="[KIND|NAME]", default="")
@json_option("the figures")
def presets(word: str) -> None:
    """List the modems, USBLs and inertial systems that a scenario can name, with their sources.

    KIND is modem, usbl or inertial.  Each figure is tagged: [M] the maker's own page, [S] the
    source code of a driver or simulator, [2] second hand, [calc] worked out from other figures.
    A preset is stated, often a worst case, or measured in a trial.  A sheet of an inertial system
    says how far, not how: navigation.drift.line_m is over which way its errors wander.
    """
    from ...models.presets.catalogue import selected

    with refusing(ValueError):
        chosen = list(selected(word))
    answer(
        [_plain(kind, preset) for kind, preset in chosen],
        "\n\n".join("\n".join(_lines(kind, preset)) for kind, preset in chosen)
        or f"{word}: none yet",
    )


def _plain(kind: str, preset: "Preset") -> dict[str, Any]:
    figures = {name: asdict(figure) for name, figure in preset.figures.items()}
    head = {"kind": kind, "name": preset.name, "title": preset.title, "basis": preset.basis}
    return {**head, "since": preset.since or None, "figures": figures}


def _lines(kind: str, preset: "Preset") -> Iterator[str]:
    """Yield a head line, and one for each figure."""
    shown = {name: f"{plain(fig.value)} {fig.unit}".strip() for name, fig in preset.figures.items()}
    since = preset.since or "no date stated"
    yield f"{preset.name}  ({kind}: {preset.title}; {preset.basis}, {since})"
    widths = max(map(len, shown)), max(map(len, shown.values()))
    for name, figure in preset.figures.items():
        unitless = shown[name].removesuffix(" 1")
        yield f"    {name:<{widths[0]}}  {unitless:<{widths[1]}}  [{figure.tag}] {figure.source}"
