"""The command `doctor`: is everything there that a mission needs?

Compiling what missions need, once, where the package is installed (`doctor --warm`).
"""

import os
import re
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import click

from .console import answer, is_quiet, talk
from .options import json_option

# Scenarios that ship, and changes of them, that together need the code of nearly all missions.
KINDS: tuple[tuple[str, ...], ...] = (
    ("harbour_current",),
    ("quickstart", "protocol.ranging=twtt"),
    ("quickstart", "protocol.ranging=passive"),
    ("quickstart", "navigation.filter=smoother"),
    ("quickstart", "usbl.preset=seatrac_x150", "navigation.drift.percent_of_distance=0.3"),
    ("quickstart", "usbl.preset=seatrac_x150", "usbl.misalignment_sd_deg=1"),
    ("quickstart", "usbl.misalignment_sd_deg=1"),
    ("quickstart", "protocol.downlink=direct_reply"),
    ("quickstart", "protocol.knowledge=broadcast", "protocol.schedule=dsatur"),
    ("quickstart", "protocol.schedule=super_tdma", "protocol.positions=carried_forward"),
    ("quickstart", "protocol.schedule=polling"),
    ("recovery_140m",),
    ("quickstart",),
)

# Long enough for pings to be heard and fixes to be delivered.
SHORT_S = 12.0

# Side by side two compile sooner than one, although they wait for each other.
PROCESSES = 2


def warm(folder: Path) -> Iterator[int]:
    """Compile what missions of all kinds need; yield after each how many are done.

    What is kept already is loaded only.  The folder then says that it holds all.
    """
    from concurrent.futures import ProcessPoolExecutor, as_completed

    from ...support.compiled import warm_marker
    from ..campaigns.workers.pools import Spawn, go_with_parent

    workers = min(PROCESSES, os.cpu_count() or 1)
    with ProcessPoolExecutor(workers, Spawn(), go_with_parent) as pool:
        flown = [pool.submit(fly, kind) for kind in KINDS]
        for done, future in enumerate(as_completed(flown), start=1):
            future.result()
            yield done
    warm_marker(folder).touch()


def fly(kind: tuple[str, ...]) -> None:
    """Fly a short mission of a kind and predict its errors, as `run` and `plan` would."""
    from ...core.mission.simulation import simulate
    from ...core.scenario.files.scenario_file import load_scenario
    from ...core.setup import Setup
    from ..planning.prediction.forecast import COARSE, FINE, Forecast

    scenario = load_scenario(kind[0], overrides=(*kind[1:], f"duration_s={SHORT_S}"))
    simulate(scenario, 0).summary()
    if kind == KINDS[-1]:  # as `plan` predicts, and as the workbench does
        forecast = Forecast(Setup.of(scenario))
        for shade in ("lanes", "dwells", "chance"):
            forecast.at([(0.0, 0.0)], shade, FINE)
            forecast.at([(0.0, 0.0)], shade, COARSE)


State = Literal["ok", "missing", "broken", "note"]
BROKEN = ("missing", "broken")
PACKAGE = "bindusbl-des"
OLDEST_PYTHON = (3, 11)

# Distributions whose import name is another one.
IMPORT_NAMES = {"pyyaml": "yaml"}

CACHE_REMEDY = (
    "until then each process compiles anew; make the folder yours, writable by you alone and not "
    "full, or point NUMBA_CACHE_DIR to one that is"
)


@dataclass(frozen=True)
class Check:
    """One thing looked at: its name, how it is, and what was seen or what to do."""

    name: str
    state: State
    detail: str


@click.command(short_help="Check packages, compiled code and a tiny mission.")
@click.option("--warm", is_flag=True, help="First compile what missions need, once.")
@json_option("the findings")
@click.pass_context
def doctor(context: click.Context, warm: bool) -> None:
    """Check packages, compiled code and a tiny mission; exit 1 if broken.

    With `--warm`, after an installation, the first mission need not compile.
    """
    if warm:
        _compile_all()
    findings = list(examined())
    broken = [finding for finding in findings if finding.state in BROKEN]
    answer(
        {"ok": not broken, "findings": [asdict(finding) for finding in findings]},
        [f"{finding.state:<8}{finding.name:<16}{finding.detail}" for finding in findings],
    )
    if broken:
        context.exit(1)


def examined() -> Iterator[Check]:
    """Look at everything, one after the other."""
    yield _python()
    yield Check("processors", "note", str(os.cpu_count()))
    requirements = list(_requirements())
    for name, oldest in requirements:
        yield _dependency(name, oldest)
    yield _compiled_code()
    yield _tiny_mission()


def _python() -> Check:
    version = ".".join(map(str, sys.version_info[:3]))
    if sys.version_info < OLDEST_PYTHON:
        return Check("python", "broken", f"{version}; needs {'.'.join(map(str, OLDEST_PYTHON))}")
    return Check("python", "ok", version)


def _requirements() -> Iterator[tuple[str, str]]:
    """Yield the name and oldest version of each package that is needed, from our own metadata."""
    from importlib.metadata import PackageNotFoundError, requires

    try:
        lines = requires(PACKAGE) or []
    except PackageNotFoundError:  # run from a copied folder
        return
    for line in lines:
        parts = re.match(r"([A-Za-z0-9._-]+)\s*(?:>=\s*([0-9.]+))?", line)
        if parts and "extra ==" not in line:
            yield parts[1], parts[2] or "0"


def _dependency(name: str, oldest: str) -> Check:
    """Import a package, since one that is installed may still be broken."""
    from importlib import import_module
    from importlib.metadata import PackageNotFoundError, version

    remedy = f'python -m pip install "{name}>={oldest}"'
    try:
        installed = version(name)
        import_module(IMPORT_NAMES.get(name.lower(), name))
    except (PackageNotFoundError, ModuleNotFoundError):
        return Check(name, "missing", remedy)
    except Exception as error:  # a package may break in any way while it is imported
        return Check(name, "broken", f"{_first_line(error)}; {remedy} --force-reinstall")
    if _numbers(installed) < _numbers(oldest):
        return Check(name, "broken", f"{installed} is older than {oldest}; {remedy}")
    return Check(name, "ok", installed)


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version.partition("+")[0])[:3])


def _first_line(error: Exception) -> str:
    return f"{type(error).__name__}: {str(error).partition(chr(10))[0]}"


def _compiled_code() -> Check:
    """Keep and load a piece of code."""
    try:
        from ...support.compiled import (
            UNCOMPILED,
            is_uncompiled,
            kept_and_loaded,
            kept_in,
            troubles,
        )

        if is_uncompiled():
            return Check("compiled code", "note", UNCOMPILED)
        works = kept_and_loaded()
    except Exception as error:  # the doctor tells rather than falls ill itself
        return Check("compiled code", "broken", _first_line(error))
    if troubles:
        return Check("compiled code", "broken", f"{troubles[0]}; {CACHE_REMEDY}")
    if not works:
        return Check("compiled code", "broken", f"does not keep what it is given; {CACHE_REMEDY}")
    return Check("compiled code", "ok", str(kept_in()))


def _compile_all() -> None:
    """Compile what missions need, unless that was done, and tell how far it is."""
    from ...support.compiled import is_uncompiled, kept_in, warm_marker
    from ...support.process import ProgressLine

    folder = None if is_uncompiled() else kept_in()
    if folder is None or warm_marker(folder).exists():
        return  # without a folder the findings say what to do
    talk(f"Compiling what missions need, once, in {folder}; this takes a minute or two ...")
    line, done = ProgressLine(quiet=is_quiet()), 0

    def words() -> str:
        return f"{done} of {len(KINDS)} kinds of missions compiled"

    for done in warm(folder):  # noqa: B007 (words says it)
        line.tell(words)
    line.end(words)


def _tiny_mission() -> Check:
    """Run ten seconds of a mission from end to end, in memory."""
    import time

    try:
        began = time.perf_counter()
        pings = _pings_of_tiny_mission()
        spent = time.perf_counter() - began
    except Exception as error:  # whatever breaks, the doctor tells rather than falls ill itself
        return Check("tiny mission", "broken", _first_line(error))
    if pings == 0:
        return Check("tiny mission", "broken", "ran, but nobody pinged")
    return Check("tiny mission", "ok", f"{pings} pings in {spent:.1f} s")


def _pings_of_tiny_mission() -> int:
    from ...core.mission.simulation import simulate
    from ...core.scenario.scenario import Scenario

    result = simulate(Scenario(name="doctor", duration_s=10.0), seed=0)
    return int(result.auvs["pings"].sum())
