"""How long slots must be, how long they are, and what of their guards is wasted."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..scenario.declared import downlink_of, ranging_of
from .case import Case
from .frames import downlink_gap, fewest_slots, frame_spread, sizes
from .pair import Pair
from .uplink import answering_s

# Pairs whose margin grows by as much as an uplink slot does
OF_SLOTS = (
    "consecutive slots", "answer and next call", "consecutive beacons", "consecutive answers",
)  # fmt: skip


@dataclass(frozen=True)
class Guard:
    """The time left in a slot once its signals and the longest way are taken off (s): how much
    there is, and how much it takes for no two signals to overlap.
    """

    set_s: float
    needed_s: float

    @property
    def wasted_s(self) -> float:
        """What could be left out (s); negative is what lacks."""
        return self.set_s - self.needed_s


def uplink_guard(case: Case, pairs: Sequence[Pair]) -> Guard | None:
    """Return the guard of an uplink slot (T_G and whatever the shortest slot adds), on the clock.

    Guards against echoes are not in what is needed: echoes are not verified.
    """
    margins = [it.margin_s for it in pairs if it.kind in OF_SLOTS and it.margin_s is not None]
    if not margins:
        return None
    guard = case.slot_s - _busy_s(case)
    return Guard(guard, max(guard - min(margins), 0.0))


def _busy_s(case: Case) -> float:
    """Return what an uplink slot holds beside its guard (s), at the speed of sound assumed."""
    slots = case.slots
    if ranging_of(case.scenario).calls:
        answered = slots.ping_duration + answering_s(case) + 2 * slots.longest_travel_time
        return answered + slots.answer
    return slots.ping_duration + slots.longest_travel_time + slots.answer


def downlink_guard(case: Case) -> Guard | None:
    """Return the guard of a downlink slot, the least of all sizes of a frame, on the clock.

    What uplink slots between two broadcasts add is not taken for a guard, but makes less needed.
    """
    downlink, slots = downlink_of(case.scenario), case.slots
    if ranging_of(case.scenario).asvs_ping or downlink.replies:
        return None
    guard = min(
        slots.clock.after(0.0, slots.downlink_slot(*size)) - slots.airtime(*size)
        for size in sizes(case)
    )
    needed = frame_spread(case)
    if downlink.waits:
        needed -= fewest_slots(case) * case.slot_s
    if downlink_gap(case) >= frame_spread(case):  # whatever comes between
        needed = min(needed, guard)
    return Guard(guard, max(needed, 0.0))
