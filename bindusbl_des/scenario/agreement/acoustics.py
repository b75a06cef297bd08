"""What the two bands must agree on: tables that reach deep enough, messages that hold a fix."""

from collections.abc import Iterator
from importlib.util import find_spec

from ...presets.modems import airtime_table
from ..channel_settings import Table
from ..declared import channel_named
from ..part_choice import PartChoice
from ..scenario_keys import ScenarioKeys
from .problem import Problem


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what is wrong with channels, and with messages of the downlink."""
    yield from _channels(scenario)
    yield from _messages(scenario)


def _channels(scenario: ScenarioKeys) -> Iterator[Problem]:
    for band in ("hf", "mf"):
        channel = getattr(scenario.acoustics, band).channel
        for setting, message in _bottom_mistakes(channel, scenario.survey.deepest):
            yield Problem(
                f"acoustics.{band}.channel.{setting}",
                message,
                ("survey.depth_m", "survey.depths_m"),
            )


def _bottom_mistakes(channel: PartChoice, deepest_m: float) -> Iterator[tuple[str, str]]:
    """Yield what keeps rays from being traced, or pings from having echoes, for a survey as deep
    (m), each with its setting.
    """
    declared = channel_named(channel)
    traced = declared.traces_rays and channel.settings.get("rays") is None
    if not traced and not declared.has_echoes:
        return
    usual = Table.model_fields["bottom_m"].default if traced else None
    bottom = channel.settings.get("bottom_m", usual)
    if isinstance(bottom, int | float) and bottom <= deepest_m:
        yield (
            "bottom_m",
            f"the sea, {bottom:g} m deep, ends above the survey at {deepest_m:g} m; give its depth",
        )
    if traced and find_spec("pelagic") is None:
        yield (
            "rays",
            "rays are traced by the package pelagic (pip install 'bindusbl-des[bellhop]'); or give "
            "a table of them",
        )


def _messages(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield why messages of the downlink cannot be sent, where there are any."""
    mf, protocol = scenario.acoustics.mf, scenario.protocol
    try:
        measured = None if mf.airtimes is None else airtime_table(mf.airtimes).most_bytes
    except ValueError as error:
        yield Problem("acoustics.mf.airtimes", str(error))
        return
    if not protocol.sends_frames:
        return
    most, key = mf.payload_bytes, "acoustics.mf.payload_bytes"
    if measured is not None:
        if most is not None and most > measured:
            yield Problem(
                key,
                f"{most} B are more than the table of airtimes tells of, which ends at "
                f"{measured} B; use that at most",
                ("acoustics.mf.airtimes", "acoustics.mf.modem"),
            )
        most = min(measured, most or measured)
    needed = mf.header_bytes + mf.fix_bytes
    if most is not None and most < needed:
        yield Problem(
            key,
            f"a message of {most} B holds no fix, which with its header takes header_bytes + "
            f"fix_bytes = {needed} B; make these smaller, or use a modem with larger messages",
            ("acoustics.mf.header_bytes", "acoustics.mf.fix_bytes", "acoustics.mf.modem"),
        )
