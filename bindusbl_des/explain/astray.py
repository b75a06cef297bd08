"""What was wrong all the time when a fix was made, as nobody on board knew."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plugins import is_plugin
from ..core.streams import Streams
from ..mission.closed_loop import slow_gnss
from ..mission.sensor_errors import clocks, misalignments
from ..scenario.instruments.lasting_kinds import kinds, sound_speed_error
from ..scenario.water import assumed_sound_speed_of, sound_speed_of
from ..vehicles.currents import CONTROL_S
from .numbers import row_of, rows_where

if TYPE_CHECKING:
    from ..results.result import Result


def wrong(result: "Result", fix: Any) -> tuple[list[str], dict[str, float]]:
    """Return in words, and as numbers, the lasting errors that a fix contains.

    They are drawn anew, as the mission of this seed drew them.
    """
    if is_plugin(result.scenario.usbl.model):
        return [], {}
    has = {kind.name for kind in kinds(result.scenario)}
    found = [*_of_vessels(result, fix, has), *_shared(result, fix, has)]
    return [told for told, _ in found], {
        name: it for _, facts in found for name, it in facts.items()
    }


def _of_vessels(
    result: "Result", fix: Any, has: set[str]
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield what is wrong with the ASVs that have measured a fix, or the AUV that has itself."""
    world, streams = result.scenario, Streams(result.seed)
    passive, names = world.protocol.is_passive, fix.asvs.split()
    asvs = [int(name.removeprefix("ASV")) for name in names]
    if "misalignment" in has:
        carriers = [fix.auv] if passive else names
        turns = np.degrees(misalignments(world, streams))[[int(it[3:]) for it in carriers]]
        told = ", ".join(f"{it} {turn:+.2f}" for it, turn in zip(carriers, turns, strict=True))
        facts = {
            f"{it}_misalignment_deg": float(turn) for it, turn in zip(carriers, turns, strict=True)
        }
        yield f"headings misaligned (deg): {told}", facts
    if "gnss" in has:
        met = rows_where(result.tables["receptions"], ping=fix.ping)
        arrived = [
            fix.pinged_at_s if passive else float(rows_where(met, asv=name).arrived_at_s.iloc[0])
            for name in names
        ]
        slow = slow_gnss(world, streams)
        off = [slow[asv, int(time / CONTROL_S)] for asv, time in zip(asvs, arrived, strict=True)]
        told = ", ".join(f"{n} {x:+.2f} {y:+.2f}" for n, (x, y) in zip(names, off, strict=True))
        facts = {
            f"{name}_gnss_{axis}_m": float(error)
            for name, place in zip(names, off, strict=True)
            for axis, error in zip("xy", place, strict=True)
        }
        yield f"GNSS slowly astray (x y, m): {told}", facts


def _shared(result: "Result", fix: Any, has: set[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield what is wrong for all ASVs at once."""
    world = result.scenario
    if "sound_speed" in has:
        share = sound_speed_error(world)
        way = "long" if share > 0 else "short"
        told = f"ranges {100 * abs(share):.2f} % too {way}: sound is assumed to travel at "
        told += f"{assumed_sound_speed_of(world):g}, not at "
        told += f"{sound_speed_of(world):g} m/s"
        yield told, {"sound_speed_error": share}
    ping = row_of(result, "pings", "ping", int(fix.ping))
    if "clock" in has and not isinstance(ping.get("call"), str):
        offset, drift = clocks(world, Streams(result.seed))[int(fix.auv.removeprefix("AUV"))]
        passive = world.protocol.is_passive  # it says when it hears, not when it pings
        late = offset + drift * (fix.valid_at_s if passive else fix.pinged_at_s)
        longer = late * assumed_sound_speed_of(world) * (-1 if passive else 1)
        told = (
            f"the clock of {fix.auv} is {1e3 * late:+.3f} ms late: ranges {longer:+.2f} m too long"
        )
        yield told, {"clock_late_s": float(late)}
