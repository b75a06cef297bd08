"""The command `verify`: whether signals of a protocol may overlap, decided before the mission."""

from pathlib import Path

import click

from .console import (
    compiling_shown,
    print_json,
    reading_from,
    refuse,
    refuse_plugins,
    say,
    talk,
    wants_json,
    writing,
)
from .options import json_option, out_option, plugins_option, scenario_argument, set_option

EXIT_CODES = {"accepted": 0, "refused": 1, "undecided": 3}


@click.command(short_help="Decide whether any two signals of a protocol may overlap.")
@scenario_argument
@click.option(
    "--max-speed",
    type=float,
    metavar="M_PER_S",
    help="No AUV is faster over ground (default: as planned, with the current where it drifts).",
)
@click.option(
    "--clock-error",
    type=float,
    metavar="SECONDS",
    help="No AUV's clock is farther off (default: three standard deviations of navigation).",
)
@click.option(
    "--sound-speed-error",
    type=float,
    metavar="M_PER_S",
    help="The assumed speed of sound is off by no more (default: what it is off by).",
)
@out_option("DIR", "Write verify.json there, and the witness.yaml.")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier verdict.")
@set_option
@plugins_option
@json_option("the verdict")
@click.pass_context
def verify(
    context: click.Context,
    scenario: str,
    max_speed: float | None,
    clock_error: float | None,
    sound_speed_error: float | None,
    out: str | None,
    force: bool,
    overrides: tuple[str, ...],
    allow_plugins: bool,
) -> None:
    """Decide whether any two signals of a protocol may overlap at a receiver.

    Whatever AUVs, clocks and sound do within their bounds: accepted (exit code 0); refused (1) with
    a witness, a scenario in which two signals do overlap; undecided (3), neither proved nor seen.
    """
    reading = reading_from(scenario, overrides, allow_plugins)
    refuse_plugins(reading.unloaded)
    from ...support.files import refusal
    from ..verification.verdict import verify as decided
    from ..verification.verdict_text import objection, record, verdict_text, write

    folder = Path(out) if out else None
    if folder is not None:
        with writing(folder):
            taken = refusal(folder, objection, force=force)
        if taken:
            refuse(f"{folder}: {taken}")
    try:
        with compiling_shown():
            verdict = decided(
                reading.scenario,
                max_speed=max_speed,
                clock_error=clock_error,
                sound_speed_error=sound_speed_error,
            )
    except ValueError as error:
        refuse(f"{scenario}: {error}")
    if folder is not None:
        with writing(folder):
            write(verdict, folder, force=force)
    if wants_json():
        print_json(record(verdict))
    else:
        say(verdict_text(verdict))
    if folder is not None:
        talk(f"Results: {folder}")
    elif verdict.witness is not None:
        talk("--out DIR writes the witness, a scenario to be run.")
    context.exit(EXIT_CODES[verdict.verdict])
