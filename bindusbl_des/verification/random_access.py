"""Random access: AUVs that ping as they like, or on slots as they like."""

from collections.abc import Iterator
from functools import partial

from .case import Case
from .pair import ACCEPTED, REFUSED, Pair, undecided
from .witnesses.pings import out_of_hearing


def random_access(case: Case) -> Iterator[Pair]:
    """Yield that two AUVs within range of one ASV may ping at any two instants, and so at once."""
    scenario = case.scenario
    name, kind = str(scenario.protocol.schedule), "random access"
    if scenario.auvs.count == 1:
        yield Pair(kind, "pings of AUVs", ACCEPTED, "there is no other AUV")
    else:
        why = f"with {name} nothing keeps two AUVs from pinging at once"
        yield Pair(kind, "pings of AUVs", REFUSED, why, witnesses=partial(out_of_hearing, case))
    if scenario.protocol.replies_in_frames:
        why = f"with {name} pings come whether an ASV answers or not"
        yield undecided("consecutive answers", "pings at an ASV that answers", why)
    elif scenario.asvs.count > 1 and scenario.protocol.sends_frames:
        why = f"with {name} fixes are broadcast as they come"
        yield undecided("consecutive frames", "broadcasts at an AUV", why)
