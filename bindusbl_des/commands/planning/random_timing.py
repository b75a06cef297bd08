"""What `timing` tells of random access: the load that AUVs offer, and cycles of the downlink."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ...preflight.offered_load import OfferedLoad
    from ...preflight.round_lengths import Rounds
    from ...protocol.slots import Slots
    from ...scenario.scenario import Scenario


def random_told(scenario: "Scenario", rounds: "Rounds", fixes: list[int]) -> Iterator[str]:
    """Yield the load that AUVs offer, and how long broadcasts of some numbers of fixes take."""
    from ...preflight.offered_load import offered

    yield from _load(scenario, offered(scenario, rounds.slots))
    yield from _cycles(rounds, fixes)


def access_data(scenario: "Scenario", slots: "Slots") -> dict[str, Any] | None:
    """Return the load that AUVs offer as data; None where they have slots."""
    from ...preflight.offered_load import offered
    from ...scenario.families import is_random

    return asdict(offered(scenario, slots)) if is_random(scenario) else None


def answered(slots: "Slots") -> str:
    """Tell how each ping is answered (direct_reply)."""
    if not slots.answer:
        return "each ping is answered as it is heard, without airtime"
    size, airtime = slots.payload_bytes(1), 1e3 * slots.airtime(1)
    return f"each ping is answered as it is heard, in a frame of {size} B, {airtime:.1f} ms"


def _load(scenario: "Scenario", load: "OfferedLoad") -> Iterator[str]:
    """Yield how often AUVs ping, and how many of these pings meet no other."""
    protocol = scenario.protocol
    yield (
        f"{protocol.schedule.told}: each AUV has something to send every {protocol.frame_s:g} s on "
        "average, at Poisson instants."
    )
    unit = "slots" if protocol.schedule == "slotted_aloha" else "pings"
    yield f"{'offered load G':<22}{load.load:>10.3f} {unit} of {1e3 * load.lasts_s:.3f} ms"
    yield f"{'pings of all AUVs':<22}{load.pings_per_s:>10.3f} per s, about"
    if load.success is not None:
        alone = "alone in their slot" if unit == "slots" else "meet no other"
        yield f"{alone:<22}{100 * load.success:>10.1f} % at an ASV that hears all AUVs"
        throughput = load.load * load.success
        yield f"{'throughput S':<22}{throughput:>10.3f} {unit} clear, per {unit[:-1]}'s length"
    else:
        assert load.window is not None
        assert load.slot_s is not None
        most = load.window - 1
        yield (
            f"{'held back':<22}{f'0 to {most}':>10} slots of {1e3 * load.slot_s:.3f} ms, at most "
            f"{most * load.slot_s:.3f} s in quiet, by who hears another AUV"
        )


def _cycles(rounds: "Rounds", fixes: list[int]) -> Iterator[str]:
    """Yield how long MF is taken by a broadcast of each number of fixes."""
    if not rounds.broadcasts:
        yield f"{rounds.policy}: {answered(rounds.slots)}; there are no rounds."
        return
    yield "A fix is broadcast as soon as MF is free, with all that wait; a round of K fixes takes"
    yield f"{'K':>6}{'bytes':>8}{'T_tx ms':>10}{'T_DL ms':>10}{'fixes/s':>10}"
    for count in fixes:
        length = rounds.length(0, count)
        yield (
            f"{count:>6}{rounds.slots.payload_bytes(count):>8}"
            f"{1e3 * rounds.slots.airtime(count):>10.1f}{1e3 * length:>10.1f}"
            f"{count / length:>10.3f}"
        )
