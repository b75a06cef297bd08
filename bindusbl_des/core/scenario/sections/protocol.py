"""The keys of the protocol: who pings when, how fixes travel, and what the clock is."""

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from ....support.wording import described
from ..families import (
    ACCESS,
    BY_SCHEDULE,
    DOWNLINK,
    KNOWLEDGE,
    RANGING,
    SCHEDULE,
    AnswerSettings,
    DisseminationSettings,
    RangingTraits,
    ScheduleTraits,
)
from ..key_types import PAPER, Moved, Part, Real, Section, Whole, formerly, key
from ..part_choice import SET, PartChoice, settings_with

MOST_REPEATS, MOST_AUVS = 1000, 10_000

UNTIL_ACKNOWLEDGED = "until_acknowledged"


NUMBERS = {"type": "integer", "minimum": 0}
REPEATS = {"anyOf": [{**NUMBERS, "maximum": MOST_REPEATS}, {"enum": ["none", UNTIL_ACKNOWLEDGED]}]}
RELAYING = {
    "anyOf": [
        {"type": "array", "items": {**NUMBERS, "maximum": MOST_AUVS}, "minItems": 1},
        {"const": "all"},
    ]
}


def _is_count(value: Any, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= most


def _repeats(value: Any) -> Any:
    if value in ("none", UNTIL_ACKNOWLEDGED) or _is_count(value, MOST_REPEATS):
        return value
    text = (
        f"must be none, {UNTIL_ACKNOWLEDGED}, or how many more times (0 to {MOST_REPEATS}); "
        f"got {described(value)}"
    )
    raise PydanticCustomError("part", "{text}", {"text": text})


def _relaying(value: Any) -> Any:
    if value == "all" or (
        isinstance(value, list | tuple)
        and value
        and all(_is_count(auv, MOST_AUVS) for auv in value)
        and len(set(value)) == len(value)
    ):
        return value
    text = f"must be all, or a list of AUVs by number, each once, as [0, 2]; got {described(value)}"
    raise PydanticCustomError("part", "{text}", {"text": text})


class RelaySection(Part):
    """AUVs that forward frames with fixes: which, and over how many hops."""

    hops: Whole = key(1, "1", "how many AUVs forward a frame one after another", ge=1, le=4)
    who: Annotated[
        tuple[int, ...] | Literal["all"], BeforeValidator(_relaying), WithJsonSchema(RELAYING)
    ] = key("all", "", "AUVs that forward: all, or a list of their numbers")


class Protocol(Section):
    """Who pings when, how fixes are sent, and what the clock is."""

    MOVED: ClassVar = (
        Moved("reply", "downlink", "direct_reply"),
        Moved("reply_at", "downlink", "direct_reply"),
        Moved("turnaround_s", "ranging", "twtt"),
        Moved("missed", "knowledge", "broadcast"),
        Moved("assignment_bytes", "knowledge", "broadcast"),
    )

    schedule: PartChoice = key("spatial_reuse", "", "which AUVs ping in which slot" + SET, PAPER)
    access: PartChoice = key(
        "scheduled",
        "",
        "by which program each AUV pings as it likes, in place of a schedule's slots" + SET,
    )
    downlink: PartChoice = key("sequential", "", "when fixes are broadcast" + SET, PAPER)
    broadcaster: PartChoice = key("rotate", "", "which ASV broadcasts a round's fixes" + SET)
    ranging: PartChoice = key(
        "owtt_sync",
        "",
        "one-way (synchronised clocks) or two-way travel times of AUVs' pings, or AUVs that fix "
        "themselves by ASVs' pings (passive; the array and AHRS of usbl are theirs)" + SET,
    )
    positions: Annotated[
        Literal["truth", "last_fix", "carried_forward"], formerly(estimate="last_fix")
    ] = key(
        "truth",
        "",
        "AUV positions that schedules use: the true ones, the last fix of each, or that fix "
        "advanced by planned course and speed",
        PAPER,
    )
    conflict_margin_m: Real = key(
        0.0,
        "m",
        "for slots an ASV counts as hearing AUVs that are estimated within its HF range plus "
        "this margin; `bindusbl-des verify` tells how much is needed",
        ge=0,
        le=1e6,
    )
    knowledge: PartChoice = key(
        "shared",
        "",
        "who knows the slots of a round: everybody at once, or AUVs that have decoded the frame "
        "which names them (broadcast; the fleet then knows AUVs by their fixes alone)" + SET,
        PAPER,
    )
    contention_chance: Real = key(
        0.5, "1", "chance to ping in a contention slot (contention)", gt=0, le=1
    )
    forget_after_s: Real | None = key(
        60.0,
        "s",
        "an AUV that is not heard for this time loses its slot (broadcast); null = it keeps it",
        gt=0,
        le=1e6,
    )
    recall_rounds: Whole = key(
        5,
        "1",
        "every so many rounds one AUV that lost its slot gets one, all such AUVs in turn "
        "(silent, last_slot)",
        ge=1,
        le=1_000_000,
    )
    tick_rate_hz: Real | None = key(
        None, "Hz", "slot starts and deliveries fall on ticks; null = exact clock", ge=0.001, le=1e6
    )
    frame_s: Real = key(
        1.0,
        "s",
        "frame of one AUV (round_robin, random); mean interval between pings that each AUV has "
        "to send (aloha, slotted_aloha, csma)",
        "sec:baseline (1 fix/s)",
        ge=0.001,
        le=1e6,
    )
    uplink_guard_s: Real | None = key(
        None, "s", "guard T_G of an uplink slot; null = 0.5 t_C", PAPER, ge=0, le=60
    )
    shortest_uplink_slot_s: Real | None = key(
        None, "s", "shortest uplink slot T_UL,min; null = 2.5 t_C", PAPER, ge=0, le=60
    )
    downlink_guard_s: Real | None = key(
        None, "s", "guard T_DL,G of a downlink slot; null = 1.25 t_C", PAPER, ge=0, le=60
    )
    shortest_downlink_slot_s: Real | None = key(
        None, "s", "shortest downlink slot T_DL,min; null = 10 t_C", PAPER, ge=0, le=60
    )
    duplex: Literal["per_band", "per_node"] = key(
        "per_band",
        "",
        "bands that a vehicle cannot hear while it sends: the sending band, or both (per_node)",
    )
    acknowledge: Literal["none", "ping", "frame"] = key(
        "none",
        "",
        "how AUVs acknowledge a fix: by their next ping, or by a frame of their own on MF",
    )
    acknowledgement_bytes: Whole = key(
        2,
        "B",
        "bytes of each fix that a frame of acknowledgement names, beside its header (frame)",
        ge=0,
        le=1000,
    )
    repeat: Annotated[
        int | Literal["none", "until_acknowledged"],
        BeforeValidator(_repeats),
        WithJsonSchema(REPEATS),
    ] = key(
        "none",
        "",
        "how often a fix is broadcast again, unless its AUV has acknowledged it or a newer "
        "fix exists: never, a number, or until_acknowledged",
    )
    relay: RelaySection | None = Field(
        default=None,
        description="AUVs forward frames of fixes that they have decoded, each once; null, unless "
        "one of its keys is given = they do not",
    )

    @property
    def exchanges(self) -> bool:
        """Whether AUVs acknowledge or forward frames, or ASVs repeat fixes."""
        asked = (self.acknowledge, self.repeat, self.relay) != ("none", "none", None)
        return asked and not self.asvs_ping

    @property
    def sends_auv_frames(self) -> bool:
        """Whether AUVs send frames on MF, to forward or to acknowledge."""
        return self.acknowledge == "frame" or self.relay is not None

    @property
    def most_repeats(self) -> int | None:
        """The number of further broadcasts of a fix; None: until the AUV acknowledges it."""
        if self.repeat == UNTIL_ACKNOWLEDGED:
            return None
        return 0 if self.repeat == "none" else int(self.repeat)

    def relays(self, auvs: int) -> tuple[int, ...]:
        """Return the numbers of the AUVs, of `auvs` in all, that forward frames, in their order."""
        if self.relay is None:
            return ()
        return tuple(range(auvs)) if self.relay.who == "all" else tuple(sorted(self.relay.who))

    @property
    def answer(self) -> AnswerSettings:
        """The settings of a downlink that `replies`: how it answers pings."""
        answer: AnswerSettings = settings_with(DOWNLINK, self.downlink, "reply")
        return answer

    @property
    def turnaround_s(self) -> float:
        """The time (s) from a call's arrival at an AUV to its answer."""
        return float(settings_with(RANGING, self.ranging, "turnaround_s").turnaround_s)

    @property
    def dissemination(self) -> DisseminationSettings:
        """The settings of a knowledge whose frames tell AUVs their slots."""
        told: DisseminationSettings = settings_with(KNOWLEDGE, self.knowledge, "missed")
        return told

    @property
    def asvs_ping(self) -> bool:
        """Whether ASVs ping and AUVs locate themselves (passive ranging)."""
        return RANGING.declared(self.ranging).asvs_ping

    @property
    def random_access(self) -> bool:
        """Whether AUVs ping without slots, by a program of their own."""
        return self.scheduling.access != "slots" and not self.asvs_ping

    @property
    def scheduling(self) -> ScheduleTraits:
        """What the schedule declares; for AUVs that run a program, the law of the program.

        The law is `program`, that is unknown, where ASVs acknowledge pings or AUVs repeat them.
        """
        traits, law = SCHEDULE.declared(self.schedule), ACCESS.declared(self.access).law
        if law != "slots":
            traits = ScheduleTraits(access=law)
        asked = "acknowledgement_bytes", "repeat"
        if traits.access != "slots" and any(map(self._asked_of_program, asked)):
            traits = replace(traits, access="program")
        return traits

    @property
    def program(self) -> PartChoice:
        """The program by which each AUV pings without slots; `scheduled` with slots.

        A schedule may be such a program (`aloha`), whose settings it then has.
        """
        if self.asvs_ping:
            return PartChoice("scheduled")
        if ACCESS.declared(self.access).law != "slots":
            return self.access
        named = BY_SCHEDULE.get(SCHEDULE.declared(self.schedule).access, "scheduled")
        return PartChoice(named, self.schedule.settings if named == self.schedule else None)

    def _asked_of_program(self, setting: str) -> bool:
        """Tell whether a shipped program has a setting that is not 0."""
        return not self.program.is_own and bool(self.program.settings.get(setting))

    @property
    def acknowledges_pings(self) -> bool:
        """Whether ASVs acknowledge the pings of a shipped program."""
        return self._asked_of_program("acknowledgement_bytes")

    @property
    def signals(self) -> bool:
        """Whether the programs of vehicles may send signals beside pings.

        A user-defined program always may, even where it is not loaded.
        """
        traits = ACCESS.declared(self.program)
        own = self.program.is_own or traits.signals
        return own or (traits.law != "slots" and self.acknowledges_pings)

    @property
    def rule(self) -> PartChoice:
        """The part that decides who pings when: the AUVs' program, or the schedule."""
        return self.program if self.random_access else self.schedule

    @property
    def replies(self) -> bool:
        """Whether an ASV answers each ping by itself."""
        return DOWNLINK.declared(self.downlink).replies and not self.asvs_ping

    @property
    def sends_frames(self) -> bool:
        """Whether ASVs send frames on MF: broadcasts, or answers that take airtime."""
        return not self.asvs_ping and (not self.replies or self.answer.takes_airtime)

    @property
    def replies_in_frames(self) -> bool:
        """Whether an ASV answers each ping by a frame of its own."""
        return self.replies and self.answer.takes_airtime

    @property
    def deafens_asvs(self) -> bool:
        """Whether an ASV hears no ping while it sends a frame; true where frames are answers."""
        return self.duplex == "per_node" or self.replies_in_frames

    @property
    def calls(self) -> bool:
        """Whether ASVs call the AUVs, which ping in answer."""
        asked = RANGING.declared(self.ranging)
        return asked.calls or (self.scheduling.calls and not asked.asvs_ping)

    @property
    def pings_by_steps(self) -> bool:
        """Whether AUVs ping in the steps of a function of their slot: a user-defined ranging, or
        one that ships as such.  Nobody knows beforehand what it does.
        """
        return self.ranging.is_own or not isinstance(RANGING.part(self.ranging), RangingTraits)

    @property
    def pinging(self) -> str:
        """The vehicles that ping, "auv" or "asv": also the column with their numbers."""
        return "asv" if self.asvs_ping else "auv"

    @property
    def listening(self) -> str:
        """The vehicles that hear pings, "auv" or "asv": also the column with their numbers."""
        return "auv" if self.asvs_ping else "asv"
