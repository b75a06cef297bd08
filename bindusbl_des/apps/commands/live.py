"""The command `live`: a mission against the clock, which speaks what instruments speak."""

import math
import re
import selectors
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ...support.process import ProgressLine
from .console import (
    RunFailed,
    answer,
    compiling_shown,
    is_quiet,
    reading_from,
    refuse,
    refuse_plugins,
    refusing,
    say,
    talk,
    talk_of,
    wants_json,
    warn,
    weigh,
    writing,
)
from .missions import answer_mission, as_given, check_folder, default_folder, models, text_of
from .options import (
    anyway_option,
    force_option,
    json_option,
    out_option,
    plugins_option,
    scenario_argument,
    seed_option,
    set_option,
)

if TYPE_CHECKING:
    from ...core.mission.mission import Mission
    from ...core.results.result import Result
    from ...core.scenario.scenario import Scenario
    from ...core.setup import Setup
    from ..live.outputs import AskedOutput, Opening
    from ..live.poses import Received
    from ..live.readings import Earth
    from ..live.session import Output, Session


class Mouth(NamedTuple):
    """What a session sends: outputs, the vehicles that are heard, where and when, whether truth is
    sent too, times real time, and whether it begins now.
    """

    outputs: "list[Output]"
    only: Sequence[str]
    earth: "Earth"
    truth: bool
    speed: float
    starts_now: bool


# In which missions may begin: GPS time began in 1980.
YEARS = range(1981, 2100)

# So often (s) it is looked whether AUVs have been heard of.
WAIT_S = 0.02

# So much (s) of a mission is rehearsed where hosts speak with modems.
REHEARSED_S = 5.0

# Until then (s of the mission) `--dry` waits for a telegram of each kind.
DRY_S = 600.0


def _speed(context: click.Context, parameter: click.Parameter, text: str) -> float:
    try:
        speed = math.inf if text == "max" else float(text)
    except ValueError:
        speed = math.nan
    if not speed > 0.0:
        raise click.BadParameter(f"{text!r} is none: 1, 10, 0.5 or max", context, parameter)
    return speed


def _start(context: click.Context, parameter: click.Parameter, text: str | None) -> datetime | None:
    if text is None:
        return None
    try:
        start = datetime.fromisoformat(text)
    except ValueError:
        raise click.BadParameter(
            f"{text!r} is no instant; write 2026-06-01T08:00:00Z", context, parameter
        ) from None
    if start.year not in YEARS:
        raise click.BadParameter(
            f"{text!r} is before GPS, or later than anybody plans; give a year from {YEARS[0]} to "
            f"{YEARS[-1]}", context, parameter,
        )  # fmt: skip
    return start.replace(tzinfo=UTC) if start.tzinfo is None else start.astimezone(UTC)


@click.command(short_help="Fly a mission against the clock; send what it measures.")
@scenario_argument
@click.option(
    "--to",
    "wanted",
    metavar="FORMAT[/VEHICLES]:SINK",
    multiple=True,
    required=True,
    help="Where telegrams go, such as nmea:udp:127.0.0.1:10110, nmea/ASV0:pty, json:tcp:9000 or "
    "json:file:PATH; repeatable.",
)
@click.option(
    "--speed", default="1", metavar="1|N|max", callback=_speed, help="Times real time (default 1)."
)
@seed_option
@click.option(
    "--start", metavar="UTC", callback=_start, help="When the mission begins (default: now)."
)
@click.option("--only", metavar="VEHICLES", default="", help="Hear these alone: ASV0,AUV1.")
@click.option("--truth", is_flag=True, help="Add where vehicles truly are, named so.")
@click.option(
    "--bind", default="127.0.0.1", metavar="HOST", help="Where ports listen (default 127.0.0.1)."
)
@click.option(
    "--poses", metavar="udp:PORT", help="Have another program move the AUVs: NMEA, MAVLink or JSON."
)
@click.option("--dry", is_flag=True, help="Print the first telegram of each kind, and end.")
@out_option("DIR", "Result folder (default results/<name>-seed<N>-live).")
@set_option
@force_option("Replace the result folder and files that exist.")
@anyway_option
@plugins_option
@json_option("the mission's metrics")
def live(
    scenario: str,
    wanted: tuple[str, ...],
    speed: float,
    seed: int,
    start: datetime | None,
    only: str,
    truth: bool,
    bind: str,
    poses: str | None,
    dry: bool,
    out: str | None,
    overrides: tuple[str, ...],
    force: bool,
    anyway: bool,
    allow_plugins: bool,
) -> None:
    """Fly a mission against the clock, and send what its instruments measure.

    Formats: nmea (GGA, RMC, ZDA, HDT and $PSIMSSB of ASVs; of AUVs named by /VEHICLES or --only
    their estimates as GGA), json (a line for each reading), mavlink (GPS_INPUT of AUVs) and
    mavproxy (the same for its GPSInput).  Sinks: udp:HOST:PORT, tcp:PORT, pty, file:PATH.
    ugps:http:PORT is the HTTP API of a Water Linked UGPS topside, ros2:file:PATH.mcap a bag.
    seatrac and evologics, to pty or tcp:PORT, are the modem of a vehicle (ASV0, or /VEHICLES): your
    program speaks with it as with the maker's, and its messages sound in the mission.

    Ctrl-C ends the telegrams; the mission is finished at once, and its result folder is that of
    `run` with the same seed.
    """
    from ...core.setup import Setup
    from ..live.outputs import FORMATS, asked, chosen, each, makes_of
    from ..live.readings import earth_of

    with refusing(ValueError):
        make = makes_of(wanted)
    if make is not None:
        overrides = (*overrides, f"modems.make={make}")
    reading = reading_from(scenario, overrides, allow_plugins)
    refuse_plugins(reading.unloaded)
    mission = reading.scenario
    names = [f"ASV{asv}" for asv in range(mission.asvs.count)]
    names += [f"AUV{auv}" for auv in range(mission.auvs.count)]
    with refusing(ValueError):
        outputs = [one for option in wanted for one in each(asked(option, names))]
        heard = chosen(only, names, "--only")
    earth = earth_of(reading.setup, start or datetime.now(UTC))
    for output in outputs:
        if FORMATS[output.format].on_earth and earth.origin is None:
            refuse(
                f"{output.text}: {output.format} needs a place on Earth; add "
                "environment.origin.lat_deg and lon_deg to the scenario, or --set "
                "environment.origin.lat_deg=54.33 --set environment.origin.lon_deg=10.18"
            )
        if output.format in ("nmea", "ugps") and not mission.asvs.count and not output.only:
            talk(
                f"{output.text}: asvs.count is 0, and {output.format} tells of ASVs alone: nothing "
                "will be sent; for AUVs name them (nmea/AUV0:pty), or send json"
            )
    from ..preflight.effort import effort

    setup = Setup.of(mission)
    weigh(mission.name, effort(setup), anyway)
    if dry:
        telegrams = list(_dry(mission, seed, outputs, heard, earth, truth))
        answer(telegrams, [first["telegram"] for first in telegrams])
        return
    if (poses is not None or make is not None) and speed == math.inf:
        what = "--poses" if poses is not None else f"--to {make}"
        refuse(f"{what} comes with the clock of who sends; give --speed 1")
    folder = Path(out) if out else default_folder(mission, seed, "-live")
    check_folder(folder, force)
    talk(models(mission))
    talk_of(reading.warnings)
    from ...core.results.result_folder import result_draft
    from ..live.outputs import Opening

    text = as_given(text_of(scenario), mission, folder)
    with writing(folder), result_draft(folder, force=force) as draft, ExitStack() as stack:
        selector = stack.enter_context(selectors.DefaultSelector())
        opening = Opening(selector, talk if wants_json() else say, warn, bind, force)
        sinks = _opened(outputs, heard, opening, stack)
        mouth = Mouth(sinks, heard, earth, truth, speed, start is None)
        ear = None if poses is None else _listening(poses, bind, setup, stack)
        result = _flown(mission, seed, mouth, selector, ear, stack)
        result.overrides = overrides
        result.fill(draft, text)
    answer_mission(result, folder)


def _opened(
    outputs: "Sequence[AskedOutput]", heard: Sequence[str], opening: "Opening", stack: ExitStack
) -> "list[Output]":
    """Open what can be opened; each that cannot is told in a line.

    Raises:
        BadInput: when nothing can be.
    """
    from ..live.outputs import opened

    sinks = []
    for wanted in outputs:
        try:
            with refusing(ValueError):
                output = opened(wanted, heard, opening)
        except OSError as error:
            why = (error.strerror or str(error)).partition(" (while")[0]
            warn(f"{wanted.text}: cannot be opened ({why})")
            continue
        stack.callback(_close, output)
        sinks.append(output)
    if not sinks:
        refuse("nothing can be sent anywhere; free the port, or name another sink")
    return sinks


def _close(output: "Output") -> None:
    """End a sink; what cannot be ended is told, and costs no result."""
    try:
        output.sink.close()
    except OSError as error:
        warn(f"{output.sink.name}: {error.strerror or error}")


def _flown(
    scenario: "Scenario",
    seed: int,
    mouth: "Mouth",
    selector: selectors.BaseSelector,
    ear: "Received | None",
    sinks: ExitStack,
) -> "Result":
    """Fly a mission against the clock, then, its sinks closed, to its end; return its result."""
    from ...core.mission.mission import Mission
    from ..live.readings import Instruments
    from ..live.session import Session

    line = ProgressLine(quiet=is_quiet(), on_terminals=True)
    try:
        with compiling_shown():
            begun = partial(Mission, scenario, seed)
            mission = begun(poses=ear)
            if mission.modems:
                _rehearse(begun())
            instruments = Instruments(mission, truth=mouth.truth, only=mouth.only)
            session = Session(
                instruments, mouth.earth, mouth.outputs, selector, warn,
                speed=mouth.speed, follows=ear is not None, wires=bool(mission.modems),
            )  # fmt: skip
            session.connect(mission.modems)
            session.starts_now = mouth.starts_now
            with _stopped_by_ctrl_c(session):
                session.fly(lambda now: line.tell(lambda: status(now, scenario.duration_s)))
        line.end(lambda: status(session, scenario.duration_s))
        if instruments.is_unsighted:
            warn("usbl.model is one's own: what one vessel alone measures is not known, nor sent")
        talk(_summary(session))
        if ear is not None:
            talk(ear.words())
        sinks.close()
        return mission.result()
    except (ValueError, ArithmeticError, RuntimeError, MemoryError) as error:
        raise RunFailed(f"{scenario.name}: the run failed: {error}") from error


def _rehearse(mission: "Mission") -> None:
    """Let modems speak once in a mission that is thrown away: what is compiled, or loaded, when it
    is first wanted makes no host wait.
    """
    *_, asker = mission.modems.values()
    asker.hear(asker.ping(1))
    mission.advance(min(REHEARSED_S, mission.scenario.duration_s))


def _listening(poses: str, bind: str, setup: "Setup", stack: ExitStack) -> "Received":
    """Return the poses that are received, once each AUV has been heard of."""
    from ..live.poses import Received, missing_text

    sink, _, port = poses.partition(":")
    if sink != "udp" or not re.fullmatch("[0-9]{1,5}", port) or int(port) > 65535:
        refuse(f"--poses {poses}: write udp:PORT")
    try:
        depths = [auv.depth_m for auv in setup.auvs]
        ear = Received(bind, int(port), len(depths), setup.ground, depths)
    except OSError as error:
        refuse(f"--poses {poses}: cannot be opened ({error.strerror or error})")
    stack.callback(ear.close)
    talk(missing_text(ear.missing, ear.port))
    warned = {"taken"}
    while ear.missing:
        time.sleep(WAIT_S)
        ear.listen()
        for why in ear.counts.keys() - warned:
            warn(f"poses are refused: {why}")
        warned |= ear.counts.keys()
    return ear


@contextmanager
def _stopped_by_ctrl_c(session: "Session") -> Iterator[None]:
    """Have the first Ctrl-C end the telegrams, and the second the program."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def stop(*_: Any) -> None:
        signal.signal(signal.SIGINT, before)
        session.stop()

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def status(session: "Session", duration_s: float) -> str:
    """Return how far a session is: time, telegrams, clients, lateness."""
    late = 1e3 * session.lateness.quantile(0.99)
    clients = f", {session.clients} connected" if session.clients else ""
    return (
        f"{session.time:.0f} of {duration_s:.0f} s, {session.rate:.0f} telegrams a second"
        f"{clients}, 99 % within {late:.1f} ms"
    )


def _summary(session: "Session") -> str:
    late = session.lateness
    if not late.counts:
        return f"{session.sent} telegrams sent."
    median, most = (1e3 * late.quantile(share) for share in (0.5, 0.99))
    return f"{session.sent} telegrams sent; late by {median:.1f} ms (median), {most:.1f} ms (99 %)."


def readable(telegram: bytes) -> str:
    """Return a telegram as text, what is none in hexadecimal digits."""
    try:
        return telegram.decode("utf-8").rstrip()
    except UnicodeDecodeError:
        return telegram.hex(" ")


def _dry(
    scenario: "Scenario",
    seed: int,
    outputs: "Sequence[AskedOutput]",
    heard: Sequence[str],
    earth: "Earth",
    truth: bool,
) -> Iterator[dict[str, str]]:
    """Yield the first telegram of each kind and output; nothing is opened."""
    from ...core.mission.mission import Mission
    from ..live.outputs import FORMATS, WHOLE, encoder
    from ..live.readings import Instruments

    for output in outputs:
        if output.format in WHOLE:
            talk(
                f"{output.text}: {FORMATS[output.format].meaning}, of which there is no telegram "
                "to show"
            )
    with compiling_shown():
        instruments = Instruments(Mission(scenario, seed), truth=truth, only=heard)
        seen: set[tuple[str, type]] = set()
        encoders = [(output, encoder(output, heard)) for output in outputs]
        while instruments.time < DRY_S and not instruments.is_over:
            for reading in instruments.advance(instruments.time + 1.0):
                for output, encode in encoders:
                    key = output.text, type(reading)
                    if key in seen or (output.only and reading.vehicle not in output.only):
                        continue
                    for telegram in encode(reading, earth):
                        seen.add(key)
                        yield {"to": output.text, "telegram": readable(telegram)}
