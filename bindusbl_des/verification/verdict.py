"""The verdict on a scenario's protocol: accepted, refused with two signals that overlap, or
undecided.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..preflight.round_lengths import rounds_of
from ..scenario.families import ranging_of, schedule_of
from ..scenario.files.scenario_file import load_scenario
from ..scenario.scenario import Scenario
from .case import ACCEPTED, REFUSED, UNDECIDED, Bounds, Case, SignalPair, bounds_of
from .deciding import Guard, Remedy, downlink_guard, pairs_of, remedy_of, uplink_guard
from .playing import Witness, witnessed
from .reuse import age_s, believed_off_m, bounded, margin_needed
from .uplink import round_s


@dataclass(frozen=True)
class Verdict:
    """What was decided of a scenario, for which bounds, and why.

    `pairs` are all kinds of pairs of signals that may meet; a `witness` shows two that overlap:
    there is one if anything is refused.  `remedy` is what would be accepted, None where all is, or
    nothing is known that would be.
    """

    case: Case
    pairs: tuple[SignalPair, ...]
    witness: Witness | None
    remedy: Remedy | None

    @property
    def accepted(self) -> bool:
        """Whether no two signals may overlap."""
        return self.verdict == ACCEPTED

    @property
    def verdict(self) -> str:
        """Accepted: no two signals may overlap; refused: some do in a scenario that has been run;
        else undecided.
        """
        if self.witness is not None:
            return REFUSED
        return ACCEPTED if all(pair.is_safe for pair in self.pairs) else UNDECIDED

    @property
    def scenario(self) -> Scenario:
        """The scenario that was verified."""
        return self.case.scenario

    @property
    def bounds(self) -> Bounds:
        """The bounds for which that holds."""
        return self.case.bounds

    @cached_property
    def uplink(self) -> Guard | None:
        """The guard of uplink slots; None where none is needed or nothing is known."""
        return uplink_guard(self.case, self.pairs)

    @cached_property
    def downlink(self) -> Guard | None:
        """The guard of downlink slots; None where there are none."""
        decided = any(pair.kind == "consecutive frames" for pair in self.pairs)
        return downlink_guard(self.case) if decided else None

    @property
    def reuses(self) -> bool:
        """Whether AUVs may share a slot."""
        shared = schedule_of(self.scenario).is_shared_and_proved
        return shared and not ranging_of(self.scenario).asvs_ping

    @property
    def position_age_s(self) -> float | None:
        """How old positions may be by which AUVs share a slot (s); None where none do."""
        return age_s(self.case) if self.reuses else None

    @property
    def position_error_m(self) -> float | None:
        """How far (m) fixes may be off by which AUVs share a slot; None where none do, or nothing
        bounds it.
        """
        return bounded(believed_off_m(self.case)) if self.reuses else None

    @property
    def conflict_margin(self) -> dict[str, float | None] | None:
        """The conflict margin that is set and the least that is needed (m), None for none."""
        if not self.reuses:
            return None
        is_set = self.scenario.protocol.conflict_margin_m
        return {"set_m": is_set, "needed_m": bounded(margin_needed(self.case))}

    @property
    def frame(self) -> dict[str, Any] | None:
        """How long frames are, and the longest rounds (s); None where rounds have no frames."""
        frame = rounds_of(self.scenario).frame
        if not frame:
            return None
        lasts = round_s(self.case)
        return {"frame_s": frame, "round_s": lasts, "fits": lasts <= frame}


def verify(
    scenario: Scenario | str | Path,
    *,
    max_speed: float | None = None,
    clock_error: float | None = None,
    sound_speed_error: float | None = None,
) -> Verdict:
    """Decide before a mission whether any two signals of its protocol may overlap at a receiver.

    Bounds that are not given are the scenario's own: speed of AUVs over ground (m/s), error of
    their clocks (s, either way), error of the assumed speed of sound (m/s).

    Raises:
        ScenarioError: when the scenario file cannot be read or used.
        ValueError: for a bound that is no number or impossible.

    >>> verify("recovery_140m").accepted
    False
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    case = Case(scenario, bounds_of(scenario, max_speed, clock_error, sound_speed_error))
    found = [witnessed(pair) for pair in pairs_of(case)]
    pairs = tuple(pair for pair, _ in found)
    if all(pair.is_safe for pair in pairs):
        return Verdict(case, pairs, None, None)
    witness = next((it for _, it in found if it is not None), None)
    return Verdict(case, pairs, witness, remedy_of(case))
