"""The command `benchmark`: how methods score in tasks that all enter alike."""

from pathlib import Path

import click

from .console import answer, refuse, refusing, talk, writing
from .options import force_option, json_option, out_option, plugins_option


def _seeds(_: click.Context, __: click.Parameter, asked: str | None) -> slice:
    """Return which of a task's seeds are asked for."""
    if asked is None:
        return slice(None)
    first, last = asked.rpartition("-")[::2]
    try:
        begin, end = int(first or 1) - 1, int(last)
    except ValueError:
        raise click.BadParameter(f"{asked!r} is neither a number nor A-B, as in 7-12") from None
    if not 0 <= begin < end - 1:
        raise click.BadParameter(f"{asked!r} are fewer than two seeds, or none; the first is 1")
    return slice(begin, end)


@click.command(short_help="Score methods of navigation, peers, schedules, placement in tasks.")
@click.argument("methods", metavar="[METHOD...]", nargs=-1)
@click.option("--task", "names", metavar="NAME", multiple=True, help="Only this task; repeatable.")
@click.option(
    "--seeds",
    metavar="N | A-B",
    callback=_seeds,
    help="Only the first N, or those from A to B, for a first look (default: all).",
)
@out_option("DIR", "Write scores.csv and index.html there.")
@force_option("Replace the scores in that folder.")
@click.option(
    "--inputs",
    metavar="DIR",
    help="Write what AUVs know in each mission there, for other programs, and score nothing.",
)
@plugins_option
@json_option("the scores")
def benchmark(
    methods: tuple[str, ...],
    names: tuple[str, ...],
    seeds: slice,
    out: str | None,
    force: bool,
    inputs: str | None,
    allow_plugins: bool,
) -> None:
    """Score methods in the tasks of the benchmark, each against a baseline on the same seeds.

    A METHOD is one that ships (default: all), a part of one's own (`module:object`), or a Parquet
    file of estimates.
    """
    from ...support.plugins import PluginError, allow, is_plugin, refusal
    from ..benchmark.methods import check, fits, method_names
    from ..benchmark.page import benchmark_page, lines
    from ..benchmark.recorded import write_inputs
    from ..benchmark.scoring import Score, frame, scores
    from ..benchmark.tasks import task_named, tasks

    with refusing(ValueError):
        chosen = [task_named(name) for name in names] or list(tasks().values())
        for method in methods:
            check(method)
    own = [method for method in methods if is_plugin(method)]
    if own and not allow_plugins:
        refuse("\n".join(refusal(method) for method in own))
    allow(own)
    if inputs is not None:
        with writing(Path(inputs)):
            count = sum(write_inputs(task, Path(inputs), seeds) for task in chosen)
        talk(f"Inputs of {count} missions: {inputs}")
        return
    folder = Path(out) if out else None
    if folder is not None and not force and (folder / "scores.csv").exists():
        refuse(f"{folder}: holds scores already; name another folder, or give --force")
    marks: list[Score] = []
    for task in chosen:
        for method in methods or method_names(task.kind):
            if fits(method, task):
                talk(f"{task.name}: {method}")
                try:
                    marks += scores(method, task, task.seeds[seeds])
                except (PluginError, ValueError) as error:
                    if len(chosen) == 1 or not is_plugin(method):
                        refuse(f"{task.name}: {method}: {error}")
                    talk(f"{task.name}: {method} does not fit ({str(error).splitlines()[0]})")
    if not marks:
        refuse(f"none of {', '.join(methods)} enters {', '.join(task.name for task in chosen)}")
    if folder is not None:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            frame(marks).to_csv(folder / "scores.csv", index=False, float_format="%.6g")
            (folder / "index.html").write_text(benchmark_page(marks), encoding="utf-8")
    answer(frame(marks).to_dict(orient="records"), lines(marks))
    if folder is not None:
        talk(f"Open {folder / 'index.html'} in a browser.")
