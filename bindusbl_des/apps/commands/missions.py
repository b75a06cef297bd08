"""The commands about one mission, `run` and `explain`; and how commands say what would help one."""

import shlex
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import wraps
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ...support.plugins import is_allowed, refusal
from ...support.process import ProgressLine, answered, duration, end_now
from ...support.wording import counted, file_name
from .console import (
    RunFailed,
    answer,
    compiling_shown,
    is_quiet,
    reading_from,
    refuse,
    refuse_plugins,
    talk,
    talk_of,
    wants_json,
    warn,
    weigh,
    writing,
)
from .options import (
    Range,
    anyway_option,
    folder_argument,
    force_option,
    json_option,
    out_option,
    plugins_option,
    scenario_argument,
    seed_option,
    set_option,
)

if TYPE_CHECKING:
    from ...core.results.effects import Advice
    from ...core.results.result import Result
    from ...core.scenario.scenario import Scenario


class AdviceOptions(NamedTuple):
    """What a user asks for of changes to be tried: whether (None: not said), and how long."""

    advice: bool | None = None
    missions: int | None = None
    seconds: float | None = None

    @property
    def is_none(self) -> bool:
        """Whether none are to be tried, and none that were tried shown."""
        return self.advice is False or 0 in (self.missions, self.seconds)

    @property
    def tries(self) -> bool:
        """Whether changes are to be tried: who says how many, or how long, asks for that."""
        asked = self.advice or self.missions is not None or self.seconds is not None
        return asked and not self.is_none


def advice_options(meaning: str) -> Callable[[Any], Any]:
    """Give a command the options `--advice`, `--advice-missions` and `--advice-s`."""

    def options(command: Any) -> Any:
        @wraps(command)
        def given(
            advice: bool | None, advice_missions: int | None, advice_s: float | None, **others: Any
        ) -> Any:
            return command(asked=AdviceOptions(advice, advice_missions, advice_s), **others)

        tried = click.option("--advice/--no-advice", default=None, help=meaning)
        missions = click.option(
            "--advice-missions",
            metavar="N",
            type=click.IntRange(min=0),
            help="Try them in so many missions (default: 20 to 150, by the scenario's size).",
        )
        within = click.option(
            "--advice-s",
            metavar="SECONDS",
            type=Range(min=0),
            help="Begin no further one after so long (default: all are flown).",
        )
        return tried(missions(within(given)))

    return options


def advice_on(
    result: "Result",
    asked: AdviceOptions,
    again: "Callable[[Sequence[str]], Scenario] | None",
) -> "Advice | None":
    """Return what would help a mission, as tried in others; None if none are asked for.

    Whoever interrupts the trials keeps the mission.
    """
    if not asked.tries:
        return None
    from ..advice.advising import advise

    for key, name in result.scenario.plugins.items():
        if not is_allowed(name):
            refuse(f"{key}: {refusal(name)}")

    line, began = ProgressLine(quiet=is_quiet()), monotonic()
    now = "trying changes"

    def on_progress(flown: int, left: int) -> None:
        nonlocal now
        seconds_left = (monotonic() - began) / max(flown, 1) * left
        now = f"trying changes: {flown} missions, about {duration(seconds_left)} left"
        line.tell(lambda: now)

    try:
        advice = advise(
            result, asked.seconds, missions=asked.missions, again=again, progress=on_progress
        )
    except KeyboardInterrupt:
        talk("Interrupted while changes were tried; the mission is written without advice.")
        return None
    finally:
        line.end(lambda: now)
    if advice.is_cut:
        warn(
            f"Cut off by --advice-s after {advice.missions} of {advice.budget_missions} missions: "
            "other machines may advise otherwise; `report DIR --advice-missions N` tries anew."
        )
    if advice.shortage:
        from ..planning.relief import foreseen

        advice = replace(advice, foreseen=foreseen(result))
    return advice


@click.command()
@scenario_argument
@seed_option
@out_option("DIR", "Result folder (default results/<name>-seed<N>).")
@set_option
@force_option("Replace the result folder if it exists.")
@anyway_option
@plugins_option
@json_option("the mission's metrics")
@advice_options("Try changes of the plan in other missions, and say what helps.")
def run(
    scenario: str,
    seed: int,
    out: str | None,
    overrides: tuple[str, ...],
    force: bool,
    anyway: bool,
    allow_plugins: bool,
    asked: AdviceOptions,
) -> None:
    """Run one mission; write its result folder and print a summary."""
    began_s = monotonic()
    reading = reading_from(scenario, overrides, allow_plugins)
    refuse_plugins(reading.unloaded)
    mission = reading.scenario
    folder = Path(out) if out else default_folder(mission, seed)
    check_folder(folder, force)
    talk(models(mission))
    talk_of(reading.warnings)
    from ...core.results.result_folder import result_draft
    from ...core.scenario.files import former_keys
    from ..preflight.effort import effort

    cost = effort(reading.setup)
    weigh(mission.name, cost, anyway)
    written = text_of(scenario)
    again = read_again(written, scenario, overrides)
    text = as_given(written, mission, folder)
    # Made before the mission is run, so that a place that cannot be written to is told at once.
    with writing(folder), result_draft(folder, force=force) as draft:
        result = _simulated(mission, seed, draft)
        result.overrides = tuple(map(former_keys.option_now, overrides))
        result.advice = advice_on(result, asked, again)
        result.fill(draft, text, began_s)
    answer_mission(result, folder, result.summary())
    if wants_json():
        return
    talk(f"Open {folder / 'report.html'} in a browser.")
    if not asked.tries:
        talk(f"What would help? bindusbl-des report {shlex.quote(str(folder))} --advice")


def answer_mission(result: "Result", folder: Path, *text: str) -> None:
    """Print the metrics of a mission as data, or its text, and where its results are."""
    where = f"Results: {folder}"
    answer(result.arrow["mission"].to_pylist()[0], [*text, where])
    if wants_json():
        talk(where)


def default_folder(scenario: "Scenario", seed: int, ending: str = "") -> Path:
    """Return where a mission's results go unless the user says: results/<name>-seed<N>."""
    return Path("results") / f"{file_name(scenario.name)}-seed{seed}{ending}"


def as_given(text: str | None, scenario: "Scenario", folder: Path) -> str | None:
    """Return the text of a scenario file, if that is what is flown, lying in the folder.

    It is not if there were overrides, or tracks that are named from where the file lay; and what
    is spelt otherwise now is written anew.
    """
    from ...core.scenario.files.scenario_file import Source
    from ...support.mistakes import ScenarioError

    try:
        document, read = Source(text or "", folder=folder).read()
    except ScenarioError:
        return None
    return text if read == scenario and not document.warnings else None


def check_folder(folder: Path, force: bool) -> None:
    """Refuse, before anything is computed, a folder that cannot take the results.

    `--force` replaces the results of an earlier run, never a folder that holds other things.  What
    runs and exports left there that were killed is removed, or told where it may be of one that
    goes on.
    """
    from ...core.results.result_folder import CSV, objection
    from ...support.files import clear_killed, refusal

    with writing(folder):
        for left in (*clear_killed(folder), *clear_killed(folder / CSV)):
            what = "a run" if left.parent == folder.parent else "an export"
            talk(f"{left}: of {what} that was killed, or goes on; delete it if none does")
    taken = refusal(folder, objection, force=force)
    if taken:
        refuse(f"{folder}: {taken}")


def models(scenario: "Scenario") -> str:
    """Return in one line which models take part in a mission."""
    auvs, asvs, protocol = scenario.auvs, scenario.asvs, scenario.protocol
    rate = protocol.tick_rate_hz
    clock = "exact clock" if rate is None else f"{rate:g} Hz ticks"
    parts = f"{protocol.rule} / {protocol.downlink} / {protocol.broadcaster}, "
    if protocol.asvs_ping:
        parts = ""
    return (
        f"{scenario.name}: {counted(auvs.count, 'AUV')} ({auvs.words}), "
        f"{counted(asvs.count, 'ASV')} ({asvs.words}), {scenario.lasting}, "
        f"{parts}{protocol.ranging}, {scenario.navigation.filter}, {clock}"
    )


def _simulated(scenario: "Scenario", seed: int, draft: Path) -> "Result":
    """Return a mission's result; a Ctrl-C that Python cannot obey yet takes the draft along."""
    from ...core.mission.simulation import simulate

    def end(asked: int) -> None:
        shutil.rmtree(draft.parent, ignore_errors=True)
        end_now(asked)

    progress = MissionProgress(scenario.duration_s, quiet=is_quiet())
    try:
        with answered(end), compiling_shown():
            return simulate(scenario, seed=seed, progress=progress.note)
    except (ValueError, ArithmeticError, RuntimeError, MemoryError, OSError) as error:
        raise RunFailed(
            f"{scenario.name}: the run failed: {str(error) or type(error).__name__}"
        ) from error
    finally:
        progress.end()


class MissionProgress:
    """Says how much of a mission has been simulated, and how long the rest will take."""

    def __init__(self, duration_s: float, *, quiet: bool) -> None:
        self._duration, self._line = duration_s, ProgressLine(quiet=quiet)
        self._now = self._first = self._compiling = 0.0
        self._began: float | None = None

    def note(self, time: float) -> None:
        """Note the instant (s) that the mission has come to."""
        from ...support.compiled import compiling_s

        self._now, self._compiling = time, compiling_s()
        if self._began is None:  # what came before was set-up
            self._first, self._began = time, monotonic() - self._compiling
        self._line.tell(self._text)

    def end(self) -> None:
        """End the line, if there was one."""
        self._line.end(self._text)

    def _text(self) -> str:
        simulated, left = self._now - self._first, ""
        if self._began is not None and simulated:
            spent = monotonic() - self._began - self._compiling
            left = f", {duration(spent * (self._duration - self._now) / simulated)} left"
        return f"{self._now:.0f} of {self._duration:.0f} s simulated{left}"


def text_of(path: str) -> str | None:
    """Return the text of the scenario file; None if it can be read only once (a pipe)."""
    from ...support.mistakes import ScenarioError
    from ...support.plain_yaml import read_text

    try:
        return read_text(path) if Path(path).is_file() else None
    except ScenarioError:
        return None


def read_again(
    text: str | None, path: str | Path, overrides: Sequence[str] = ()
) -> "Callable[[Sequence[str]], Scenario] | None":
    """Return what reads a scenario's text again with further options; None for a pipe."""
    from ...core.scenario.files.scenario_file import Source

    if text is None:
        return None
    source = Source(text, str(path), Path(path).parent)
    return lambda options: source._replace(overrides=(*overrides, *options)).read()[1]


@click.command()
@folder_argument
@click.option("--ping", type=click.IntRange(min=0), help="Number of the ping.")
@click.option("--fix", type=click.IntRange(min=0), help="Number of the fix.")
@json_option("the chain")
def explain(folder: str, ping: int | None, fix: int | None) -> None:
    """Tell what became of one ping or fix of a run, and why.

    Each step has its instant, its distance and the rule that decided it; the parts of the latency
    add up.
    """
    if (ping is None) == (fix is None):
        raise click.UsageError("give either --ping ID or --fix ID")
    from ...core.results.loading import load_result
    from ..explain import chain_of_fix, chain_of_ping

    try:
        result = load_result(folder)
        chain = chain_of_ping(result, ping) if ping is not None else chain_of_fix(result, fix or 0)
    except (FileNotFoundError, NotADirectoryError, ValueError, LookupError) as error:
        refuse(str(error.args[-1]) if isinstance(error, LookupError) else str(error))
    answer(chain.data(), chain.text())
