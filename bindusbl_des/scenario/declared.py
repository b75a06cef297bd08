"""What the whole program must know of each part that ships: a record for each, in a table a family.

Who needs to know something about a part asks its record; its name is tested nowhere else.  A part
of one's own declares the same by attributes of these names, each of which has a default.

The tables are the registry: what they list can be named in a scenario, in this order.  To add a
part: its line here, and the module in which it works.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from ..core.plugins import PluginError, asked, loaded
from .part_choice import Settings
from .shipped_settings import (
    BroadcastSettings,
    CarrierSense,
    Dacap,
    Datasheet,
    DirectReply,
    Fixed,
    FixedGain,
    Kalman,
    Kinematic,
    Macau,
    Polling,
    ScheduleSettings,
    Smoothing,
    SuperTdma,
    TLohi,
    TwoWaySettings,
    WorstFirst,
)


@dataclass(frozen=True, kw_only=True)
class Traits:
    """What a part of any family declares: the model of its `settings`, and in which place advice
    tries it where a scenario has another (`advised`; 0: it does not).
    """

    settings: type[Settings] = Settings
    advised: int = 0


@dataclass(frozen=True)
class ScheduleTraits(Traits):
    """Who pings when.

    How the ping groups of a round come about (`groups`): a round is one AUV's (`frame`), each AUV
    has a slot of its own (`each`), or those that no ASV hears two of share one, by the first that
    is free (`first_fit`) or the most constrained AUV first (`saturation`); "" where nobody knows
    beforehand.  With a frame, whose `turn` it is: by `rotation` or by `lot`.  AUVs ping in slots
    that they are given (`access`), or as they like: at the instants of a Poisson process
    (`poisson`), at the next of equal slots (`slotted`), once they hear nobody (`sensing`), or by
    another program (`program`, of `protocol.access`).

    `is_proved` says that the verifier's rules hold for it, `renumbers` that an AUV's slot is
    another in each round.  What a prediction leaves out of it is its `approximation`: then `groups`
    are what it is taken for.  How long slots are that are not all T_UL, its `pace` says: until a
    called AUV has `answered`, or until the next of the `packed` arrivals.  By what `explain` tells
    whose turn it is, beside the slot: `turn_by`.  If it `chooses`, some AUVs have no turn in a
    round.  A plan proposes it where its scenario has another, if it `is_proposed`.
    """

    settings: type[Settings] = ScheduleSettings
    framed: bool = False
    groups: Literal["frame", "each", "first_fit", "saturation", ""] = ""
    turn: Literal["each", "rotation", "lot"] = "each"
    access: Literal["slots", "poisson", "slotted", "sensing", "program"] = "slots"
    is_proved: bool = False
    renumbers: bool = False
    approximation: str = ""
    pace: Literal["", "answered", "packed"] = ""
    turn_by: Literal["", "expected_error", "calls", "arrivals"] = ""
    chooses: bool = False
    is_proposed: bool = False

    @property
    def calls(self) -> bool:
        """Whether ASVs call the AUVs."""
        return self.pace == "answered"

    @property
    def names_all(self) -> bool:
        """Whether each AUV has a turn in every round."""
        return not self.framed and not self.chooses

    @property
    def random_access(self) -> bool:
        """Whether AUVs ping as they like."""
        return self.access != "slots"

    @property
    def shares_slots(self) -> bool:
        """Whether AUVs that no ASV hears two of share a slot."""
        return self.groups in ("first_fit", "saturation")

    @property
    def is_shared_and_proved(self) -> bool:
        """Whether they do by rules that the verifier knows."""
        return self.shares_slots and self.is_proved

    @property
    def has_exact_groups(self) -> bool:
        """Whether its groups follow from who hears whom alone."""
        return self.groups not in ("", "frame") and not self.approximation


@dataclass(frozen=True)
class AccessTraits(Traits):
    """How AUVs ping that run a program each, as they like.

    By which `law` it pings is told as a schedule's `access` is: no closed form tells of a
    `program`.  Whether AUVs hear each other (`hears`), send `signals` beside pings, and ASVs run
    the program as well (`on_asvs`).
    """

    law: Literal["slots", "program", "poisson", "slotted", "sensing"] = "program"
    hears: bool = True
    signals: bool = True
    on_asvs: bool = True


@dataclass(frozen=True)
class DownlinkTraits(Traits):
    """When fixes travel, and what the next round waits for.

    Each ping is answered by itself (`replies`), or fixes are broadcast: after each group of a round
    (`by_group`) or after all of them; the next slot then waits for the end of the broadcast
    (`waits`), or does not.  Rounds of a downlink that `is_foreseen` begin at instants that a frame
    can tell a round before.  What becomes of a round's fixes, `in_words`.
    """

    replies: bool = False
    by_group: bool = False
    waits: bool = False
    is_foreseen: bool = False
    in_words: str = ""

    @property
    def tells_ahead(self) -> int:
        """How many rounds ahead is the one whose slots a frame tells."""
        return 1 if self.waits else 2


@dataclass(frozen=True)
class BroadcasterTraits(Traits):
    """Which ASV broadcasts.

    The next one (`turn`), one drawn by `lot`, always `one`, that which has measured the most fixes
    (`hearing`), or that nearest to them (`distance`): nearest to each, `at_once` with others, or to
    all together.
    """

    chosen_by: Literal["", "turn", "lot", "one", "hearing", "distance"] = ""
    at_once: bool = False

    @property
    def serves_nearest(self) -> bool:
        """Whether the ASV nearest to AUVs sends their fixes."""
        return self.chosen_by == "distance"


@dataclass(frozen=True)
class RangingTraits(Traits):
    """How a range is measured: ASVs ping and AUVs fix themselves (`asvs_ping`), or AUVs ping, at
    their `own_clocks`, which need no slot, or in answer to a call (`calls`), whose both ways are
    measured.
    """

    asvs_ping: bool = False
    calls: bool = False
    own_clocks: bool = False


@dataclass(frozen=True)
class KnowledgeTraits(Traits):
    """Who knows the slots of a round: everybody at once, or AUVs that frames name (`by_frames`)."""

    by_frames: bool = False


@dataclass(frozen=True)
class InstrumentTraits(Traits):
    """What is made of a ping: it `times_arrivals` at the elements of an array, or errs as a data
    sheet has it (`is_stated`).
    """

    times_arrivals: bool = False
    is_stated: bool = False


@dataclass(frozen=True)
class ChannelTraits(Traits):
    """What becomes of sound: if it `ends_at_range` nothing is heard beyond; with a channel that
    `has_levels` one knows how loud it is.  Within its range it may lose pings, and frames unless it
    `keeps_frames`.  Pings may have echoes (`has_echoes`), or rays are traced (`traces_rays`), where
    the bottom is given; what was measured has a `reach_of_its_own`.  Of one that goes `by_link`
    nobody can tell by places alone, but which vehicles there are.
    """

    ends_at_range: bool = False
    has_levels: bool = False
    keeps_frames: bool = False
    has_echoes: bool = False
    traces_rays: bool = False
    reach_of_its_own: bool = False
    by_link: bool = False


@dataclass(frozen=True)
class NavigatorTraits(Traits):
    """What an AUV makes of a fix: nothing (`ignores_fixes`), a fixed share of it (`has_gain`), or
    as much as it is worth by its covariance (`weighs`); `is_smoother` if it revises what was
    before.  One of somebody's own is given what it `wants`: fused fixes, or receptions.
    """

    weighs: bool = False
    ignores_fixes: bool = False
    has_gain: bool = False
    is_smoother: bool = False
    wants: Literal["fixes", "receptions"] = "fixes"


@dataclass(frozen=True)
class PeerTraits:
    """How AUVs measure each other: by asking first (`asks`), and whether that `ranges`."""

    asks: bool = False
    ranges: bool = True


PEERS: Mapping[str, PeerTraits] = {
    "owtt": PeerTraits(),
    "twtt": PeerTraits(asks=True),
    "angles": PeerTraits(ranges=False),
}


@dataclass(frozen=True)
class HullTraits(Traits):
    """What a vehicle is: it moves by equations of motion (`has_dynamics`), or as it is planned."""

    has_dynamics: bool = True


SCHEDULES: Mapping[str, ScheduleTraits] = {
    "spatial_reuse": ScheduleTraits(
        groups="first_fit", is_proved=True, is_proposed=True, advised=2
    ),
    "dsatur": ScheduleTraits(groups="saturation", is_proved=True, advised=3),
    "one_per_slot": ScheduleTraits(groups="each", is_proved=True, is_proposed=True, advised=1),
    "round_robin": ScheduleTraits(framed=True, groups="frame", turn="rotation", is_proved=True),
    "random": ScheduleTraits(framed=True, groups="frame", turn="lot", is_proved=True),
    "worst_first": ScheduleTraits(
        settings=WorstFirst,
        groups="first_fit",
        is_proved=True,
        renumbers=True,
        chooses=True,
        approximation="is taken for spatial_reuse: each AUV has a turn in every round.",
        turn_by="expected_error",
    ),
    "polling": ScheduleTraits(
        settings=Polling,
        groups="each",
        approximation=(
            "is taken for one_per_slot, AUVs answering from two thirds of the HF range."
        ),
        pace="answered",
        turn_by="calls",
    ),
    "super_tdma": ScheduleTraits(
        settings=SuperTdma,
        groups="first_fit",
        renumbers=True,
        approximation="is taken for spatial_reuse with slots of T_P + clear_s.",
        pace="packed",
        turn_by="arrivals",
    ),
    "aloha": ScheduleTraits(access="poisson"),
    "slotted_aloha": ScheduleTraits(access="slotted"),
    "csma": ScheduleTraits(settings=CarrierSense, access="sensing"),
}
ACCESSES: Mapping[str, AccessTraits] = {
    "scheduled": AccessTraits(law="slots", hears=False, signals=False, on_asvs=False),
    "aloha": AccessTraits(law="poisson", hears=False, signals=False, on_asvs=False),
    "slotted_aloha": AccessTraits(law="slotted", hears=False, signals=False, on_asvs=False),
    "csma": AccessTraits(settings=CarrierSense, law="sensing", signals=False, on_asvs=False),
    "t_lohi": AccessTraits(settings=TLohi, on_asvs=False),
    "macau": AccessTraits(settings=Macau),
    "dacap": AccessTraits(settings=Dacap),
}
# The programs of schedules by which AUVs ping as they like, by their `access`
BY_SCHEDULE = {
    "slots": "scheduled",
    "poisson": "aloha",
    "slotted": "slotted_aloha",
    "sensing": "csma",
}
DOWNLINKS: Mapping[str, DownlinkTraits] = {
    "sequential": DownlinkTraits(
        waits=True,
        is_foreseen=True,
        advised=3,
        in_words="the fixes of a round are broadcast after its last slot; then the next begins.",
    ),
    "pipelined_round": DownlinkTraits(
        is_foreseen=True,
        advised=1,
        in_words="the fixes of a round are broadcast while the next round pings.",
    ),
    "pipelined_group": DownlinkTraits(
        by_group=True,
        advised=4,
        in_words="the fixes of a ping group are broadcast while the next group pings.",
    ),
    "direct_reply": DownlinkTraits(
        settings=DirectReply, replies=True, advised=2, in_words="a round is its uplink slots."
    ),
}
BROADCASTERS: Mapping[str, BroadcasterTraits] = {
    "rotate": BroadcasterTraits("turn", advised=4),
    "random": BroadcasterTraits("lot", advised=5),
    "most_fixes": BroadcasterTraits("hearing", advised=3),
    "nearest": BroadcasterTraits("distance", advised=1),
    "fixed": BroadcasterTraits("one", settings=Fixed),
    "parallel": BroadcasterTraits("distance", at_once=True, advised=2),
}
RANGINGS: Mapping[str, RangingTraits] = {
    "owtt_sync": RangingTraits(own_clocks=True),
    "twtt": RangingTraits(settings=TwoWaySettings, calls=True),
    "passive": RangingTraits(asvs_ping=True),
}
KNOWLEDGES: Mapping[str, KnowledgeTraits] = {
    "shared": KnowledgeTraits(),
    "broadcast": KnowledgeTraits(settings=BroadcastSettings, by_frames=True),
}
INSTRUMENTS: Mapping[str, InstrumentTraits] = {
    "array": InstrumentTraits(times_arrivals=True),
    "datasheet": InstrumentTraits(settings=Datasheet, is_stated=True),
}
CHANNELS: Mapping[str, ChannelTraits] = {
    "disc": ChannelTraits(ends_at_range=True, keeps_frames=True),
    "curve": ChannelTraits(reach_of_its_own=True),
    "sonar": ChannelTraits(has_levels=True, has_echoes=True),
    "table": ChannelTraits(has_levels=True, traces_rays=True),
    "series": ChannelTraits(reach_of_its_own=True, by_link=True),
}
NAVIGATORS: Mapping[str, NavigatorTraits] = {
    "fixed_gain": NavigatorTraits(settings=FixedGain, has_gain=True),
    "kalman": NavigatorTraits(settings=Kalman, weighs=True),
    "smoother": NavigatorTraits(settings=Smoothing, weighs=True, is_smoother=True),
    "dead_reckoning": NavigatorTraits(ignores_fixes=True),
}
AUVS: Mapping[str, HullTraits] = {
    "kinematic": HullTraits(settings=Kinematic, has_dynamics=False),
    "remus100": HullTraits(),
    "bluerov2": HullTraits(),
}
ASVS: Mapping[str, HullTraits] = {
    "moored": HullTraits(has_dynamics=False),
    "otter": HullTraits(),
    "cybership2": HullTraits(),
}

Record = TypeVar("Record", bound=Traits)


def advised(table: Mapping[str, Traits]) -> tuple[str, ...]:
    """Return the parts of a family that advice tries, in the order in which it does."""
    tried = [name for name, traits in table.items() if traits.advised]
    return tuple(sorted(tried, key=lambda name: table[name].advised))


def _declared(key: str, table: Mapping[str, Record], default: Record, name: str) -> Record:
    """Return the record of a part; of one's own from its attributes, if it is loaded."""
    if name in table:
        return table[name]
    own = loaded(name)
    if own is None:
        return default

    def given() -> Record:
        return replace(default, **_given(own, default))

    return asked(key, name, given, when=" as it was asked what it declares")


def _given(own: Any, default: Record) -> dict[str, Any]:
    """Return what of a record a part of one's own declares."""
    names = [field.name for field in fields(default) if field.name != "settings"]
    return {name: getattr(own, name) for name in names if hasattr(own, name)}


def declared_mistakes(key: str, name: str) -> Iterator[PluginError]:
    """Yield what a part of one's own, which is loaded, declares that no part can."""
    own, default = loaded(name), DEFAULTS.get(key)
    if own is None or default is None:
        return
    hints = get_type_hints(type(default))
    for word, value in _given(own, default).items():
        allowed = (False, True) if hints[word] is bool else get_args(hints[word])
        is_listed = hints[word] is bool or get_origin(hints[word]) is Literal
        if is_listed and not any(
            type(value) is type(option) and value == option for option in allowed
        ):
            options = ", ".join(map(repr, allowed))
            yield PluginError(key, f"{name!r} declares {word} = {value!r}; give one of {options}")


# What a part declares, by its name.
schedule_named = partial(_declared, "protocol.schedule", SCHEDULES, ScheduleTraits())
access_named = partial(_declared, "protocol.access", ACCESSES, AccessTraits())
downlink_named = partial(_declared, "protocol.downlink", DOWNLINKS, DownlinkTraits())
broadcaster_named = partial(_declared, "protocol.broadcaster", BROADCASTERS, BroadcasterTraits())
ranging_named = partial(_declared, "protocol.ranging", RANGINGS, RangingTraits())
knowledge_named = partial(_declared, "protocol.knowledge", KNOWLEDGES, KnowledgeTraits())
channel_named = partial(_declared, "acoustics.hf.channel", CHANNELS, ChannelTraits())
instrument_named = partial(_declared, "usbl.model", INSTRUMENTS, InstrumentTraits())
navigator_named = partial(_declared, "navigation.filter", NAVIGATORS, NavigatorTraits())

# What a part of one's own declares that says nothing, by the key that names it
DEFAULTS: dict[str, Traits] = {
    "protocol.schedule": ScheduleTraits(),
    "protocol.access": AccessTraits(),
    "protocol.downlink": DownlinkTraits(),
    "protocol.broadcaster": BroadcasterTraits(),
    "protocol.ranging": RangingTraits(),
    "acoustics.hf.channel": ChannelTraits(),
    "acoustics.mf.channel": ChannelTraits(),
    "usbl.model": InstrumentTraits(),
    "navigation.filter": NavigatorTraits(),
}
