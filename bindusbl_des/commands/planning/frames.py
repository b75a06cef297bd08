"""What `timing` tells of frames: how many fixes they hold, and what it costs to tell slots."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...core.wording import counted

if TYPE_CHECKING:
    from ...preflight.round_lengths import Rounds
    from ...protocol.slots import Slots
    from ...scenario.scenario import Scenario


def assignments(scenario: "Scenario", rounds: "Rounds") -> Iterator[str]:
    """Yield what it takes to tell AUVs their slots, where they have to be told."""
    if not rounds.named:
        return
    slots, protocol, auvs = rounds.slots, scenario.protocol, rounds.auvs
    size = slots.payload_bytes(auvs, rounds.named) - slots.payload_bytes(auvs)
    longer = slots.airtime(auvs, rounds.named) - slots.airtime(auvs)
    yield (
        f"AUVs are told their slots (knowledge: broadcast): {counted(rounds.named, 'record')} of "
        f"{protocol.dissemination.assignment_bytes} B in each broadcast."
    )
    yield f"Beside the records of all fixes they take {size} B and {1e3 * longer:.1f} ms."
    if rounds.contention:
        yield f"A contention slot makes each round {1e3 * slots.uplink_slot:.1f} ms longer."


def messages(slots: "Slots") -> Iterator[str]:
    """Yield what a modem does with messages, where it does more than to send them at its rate."""
    messages = slots.messages
    if messages.most is not None:
        rest = "further ones follow in others" if messages.splits else "further ones wait"
        yield f"A message holds {messages.most} {'fix' if messages.most == 1 else 'fixes'}; {rest}."
    delays = messages.delay(0), messages.delay(messages.most or 0)
    if any(delays):
        told = span([1e3 * it for it in sorted({*delays})])
        yield f"A modem hands a message over {told} ms after its end."


def span(values: list[float]) -> str:
    """Return values from the first to the last, those that look the same once."""
    return " .. ".join(dict.fromkeys(f"{value:.3f}" for value in values))
