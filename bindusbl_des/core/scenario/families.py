"""Parts: a schedule, a channel, a navigator... and the list of those that ship.

**Theory of operation.**  A part is one place: a function or class in one file, which holds its
settings (a pydantic model), what it declares (its traits), its code and its words.

    class WorstFirst(ScheduleSettings):
        slots: Whole = key(4, "1", "ping groups of a round, at most", ge=1, le=9_999)

    @ScheduleTraits(settings=WorstFirst, groups="first_fit", chooses=True, ...)
    def worst_first(view: View, *, settings: WorstFirst) -> Groups:
        ...

*The list.*  A family is a key of the scenario at which a part is named.  Its parts are one line
each: the name that a scenario uses, and ``module:object`` of this package, in the order in which
messages list them.  That text is the only arrow from the scenario to the rooms above it.

*What is asked when.*  A part is imported when somebody first asks what it declares: the chosen ones
as a scenario is validated, all of them for the reference, the schema, or a rule that compares
parts.  Validation must not wait for numpy, so that the file of a part imports little: what it works
with it imports where it works.  Equations that are compiled stand in a module beside it.

*What is declared.*  Whoever must know something of a part asks its traits: the planner what to
predict and what it leaves out (`approximation`), warnings what has no effect, `explain` its words.
No name of a part is tested anywhere (`tests/test_parts.py`).  A user-defined part declares the same
by attributes of the same names; what it does not declare has the traits' default.

*Who checks what.*  Settings of both kinds are checked with the scenario (:mod:`.part_choice`);
answers of a user-defined part as it is asked, by :class:`...support.plugins.OwnPart`, which names
the part, the question and the remedy.  Invariants: traits are frozen and never depend on the
scenario; whoever calls a part has its settings bound to it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeVar

from ...support.plugins import Family
from .key_types import Real, key
from .part_choice import Settings
from .shipped_settings import Datasheet, FixedGain, Kalman, Kinematic, Smoothing

Made = TypeVar("Made")


@dataclass(frozen=True, kw_only=True)
class Traits:
    """What a part of any family declares: the model of its `settings`, and in which place advice
    tries it where a scenario has another (`advised`; 0: it does not).
    """

    settings: type[Settings] = Settings
    advised: int = 0

    def __call__(self, part: Made) -> Made:
        """Let a function or class that ships declare this: its decorator."""
        part.traits = self  # type: ignore[attr-defined]  # a function has no such attribute
        return part


class ScheduleSettings(Settings):
    """What the settings of a schedule say of its rounds; those that have none say this."""

    @property
    def most_groups(self) -> int | None:
        """How many ping groups a round has at most; None for one for each AUV."""
        return None

    @property
    def shares_calls(self) -> bool:
        """Whether AUVs that no ASV hears two of may be called at once."""
        return False

    @property
    def pause_s(self) -> float:
        """The pause (s) between two arrivals that are packed."""
        return 0.0


@dataclass(frozen=True)
class ScheduleTraits(Traits):
    """Who pings when.

    `groups`: how the ping groups of a round come about.  `frame`: a round is one AUV's; `each`:
        every AUV has its own slot; `first_fit`: AUVs that no ASV hears two of share a slot,
        coloured greedily in the order of their numbers; `saturation`: the same, the most
        constrained AUV first; "": they cannot be known beforehand.  A schedule that colours in
        another order has an `approximation`.
    `framed`, `turn`: whose turn a frame is: by `rotation`, or by `lot`.
    `access`: AUVs ping in the `slots` that they are given; at the instants of a Poisson process
        (`poisson`); at the next of equal slots (`slotted`); once they hear no other (`sensing`); or
        by a `program` (`protocol.access`).
    `is_proved`: the verifier's rules (`apps/verification/rules.py`) hold for it: AUVs that share a
        slot are those that no ASV within range hears two of.
    `renumbers`: an AUV's slot may be another in each round.
    `approximation`: what a prediction leaves out; `groups` are then what it takes instead.
    `pace`: how long slots are that are not all T_UL: until the called AUV has `answered`, or until
        the next of the `packed` arrivals.
    `turn_by`: what `explain` names beside the slot as the reason of a turn.
    `chooses`: some AUVs have no turn in a round.
    `is_proposed`: plans try it where a scenario has another.
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


class AnswerSettings(Protocol):
    """What is asked of a downlink that answers pings: what an answer is, and when it sets out."""

    reply: str
    reply_at: str
    takes_airtime: bool


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


class DisseminationSettings(Protocol):
    """What is asked of knowledge by frames: the bytes that tell an AUV its slot, and what an AUV
    does that missed them.
    """

    assignment_bytes: int
    missed: str


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


class Lossy(Settings):
    """What every channel has, a user-defined one as well: how long losses last, which speed it
    bears.
    """

    burst_s: Real | None = key(
        None,
        "s",
        "how long signals between a pair of vehicles are lost once they are, on average, the "
        "share lost being the channel's; null = each is lost by itself",
        gt=0,
        le=1e5,
    )
    doppler_limit_m_per_s: Real | None = key(
        None,
        "m/s",
        "how fast the way between two vehicles may change, either way, for a signal to be decoded; "
        "null = as the band's modem states, else any",
        gt=0,
        le=100,
    )


@dataclass(frozen=True)
class ChannelTraits(Traits):
    """What becomes of sound: if it `ends_at_range` nothing is heard beyond; with a channel that
    `has_levels` one knows how loud it is.  Within its range it may lose pings, and frames unless it
    `keeps_frames`.  Pings may have echoes (`has_echoes`), or rays are traced (`traces_rays`), where
    the bottom is given; what was measured has a `reach_of_its_own`.  Of one that goes `by_link`
    nobody can tell by places alone, but which vehicles there are.
    """

    frame_settings: type[Settings] = Settings
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


SCHEDULE = Family(
    *("protocol.schedule", "schedule", ("view",)),
    {
        "spatial_reuse": "models.schedules.colouring:spatial_reuse",
        "dsatur": "models.schedules.colouring:dsatur",
        "one_per_slot": "models.schedules.colouring:one_per_slot",
        "round_robin": "models.schedules.frames:round_robin",
        "random": "models.schedules.frames:random",
        "worst_first": "models.schedules.worst_first:worst_first",
        "polling": "models.schedules.polling:polling",
        "super_tdma": "models.schedules.super_tdma:super_tdma",
        "aloha": "models.access.aloha:by_aloha",
        "slotted_aloha": "models.access.aloha:by_slotted_aloha",
        "csma": "models.access.csma:by_csma",
    },
    ScheduleTraits(),
)
ACCESS = Family(
    *("protocol.access", "access", ("node",)),
    {
        "scheduled": AccessTraits(law="slots", hears=False, signals=False, on_asvs=False),
        "aloha": "models.access.aloha:aloha",
        "slotted_aloha": "models.access.aloha:slotted_aloha",
        "csma": "models.access.csma:csma",
        "t_lohi": "models.access.t_lohi:t_lohi",
        "macau": "models.access.macau:macau",
        "dacap": "models.access.dacap:dacap",
    },
    AccessTraits(),
)
# The programs of schedules by which AUVs ping as they like, by their `access`
BY_SCHEDULE = {
    "slots": "scheduled",
    "poisson": "aloha",
    "slotted": "slotted_aloha",
    "sensing": "csma",
}
DOWNLINK = Family(
    *("protocol.downlink", "downlink", ("network", "turn", "time")),
    {
        "sequential": "core.protocol.downlinks:sequential",
        "pipelined_round": "core.protocol.downlinks:pipelined_round",
        "pipelined_group": "core.protocol.downlinks:pipelined_group",
        "direct_reply": "core.protocol.downlinks:direct_reply",
    },
    DownlinkTraits(),
)
BROADCASTER = Family(
    *("protocol.broadcaster", "broadcaster", ("view",)),
    {
        "rotate": "models.broadcasters:rotate",
        "random": "models.broadcasters:random",
        "most_fixes": "models.broadcasters:most_fixes",
        "nearest": "models.broadcasters:nearest",
        "fixed": "models.broadcasters:fixed",
        "parallel": "models.broadcasters:parallel",
    },
    BroadcasterTraits(),
)
RANGING = Family(
    *("protocol.ranging", "ranging", ("slot", "time")),
    {
        "owtt_sync": "models.rangings:owtt_sync",
        "twtt": "models.rangings:twtt",
        "passive": "models.rangings:passive",
    },
    RangingTraits(),
)
KNOWLEDGE = Family(
    *("protocol.knowledge", "knowledge", ()),
    {"shared": KnowledgeTraits(), "broadcast": "core.protocol.announcing:BROADCAST"},
    KnowledgeTraits(),
    is_open=False,
)
_CHANNELS = {
    "disc": "models.channels.disc:disc",
    "curve": "models.channels.curve:curve",
    "sonar": "models.channels.sonar:sonar",
    "table": "models.channels.table:table",
    "series": "models.channels.series:series",
}
CHANNEL = Family(
    *("acoustics.hf.channel", "channel", ("signals",)), _CHANNELS, ChannelTraits(), common=Lossy
)
MF_CHANNEL = Family(
    *("acoustics.mf.channel", "mf_channel", ("signals",)),
    _CHANNELS,
    ChannelTraits(),
    common=Lossy,
    models="frame_settings",
)
INSTRUMENT = Family(
    *("usbl.model", "instrument", ("sounding",)),
    {
        "array": InstrumentTraits(times_arrivals=True),
        "datasheet": InstrumentTraits(settings=Datasheet, is_stated=True),
    },
    InstrumentTraits(),
)
NAVIGATOR = Family(
    *("navigation.filter", "filter", ("reckoning", "auvs")),
    {
        "fixed_gain": NavigatorTraits(settings=FixedGain, has_gain=True),
        "kalman": NavigatorTraits(settings=Kalman, weighs=True),
        "smoother": NavigatorTraits(settings=Smoothing, weighs=True, is_smoother=True),
        "dead_reckoning": NavigatorTraits(ignores_fixes=True),
    },
    NavigatorTraits(),
)
PLACEMENT: Family[Any] = Family(
    *("asvs.formation", "placement", ("plan",)),
    {
        "ring": "core.scenario.sections.placements:Formation",
        "positions": "core.scenario.sections.placements:Formation",
        "follow": "core.scenario.sections.placements:Follow",
        "assign": "core.scenario.sections.placements:Assign",
        "zigzag": "core.scenario.sections.placements:Zigzag",
        "track": "core.scenario.sections.placements:AsvTrack",
    },
    word="model",
)
ROUTE: Family[Any] = Family(
    *("auvs.route", "route", ("plan",)),
    {
        "lawnmower": "core.scenario.sections.routes:Lawnmower",
        "hold": "core.scenario.sections.routes:Hold",
        "waypoints": "core.scenario.sections.routes:Waypoints",
        "track": "core.scenario.sections.routes:Track",
    },
    word="kind",
)
AUV: Family[HullTraits] = Family(
    *("auvs.vehicle", "vehicle", ("way",)),
    {
        "kinematic": HullTraits(settings=Kinematic, has_dynamics=False),
        "remus100": HullTraits(),
        "bluerov2": HullTraits(),
    },
)
ASV: Family[HullTraits] = Family(
    *("asvs.vehicle", "vessel", ("way",)),
    {
        "moored": HullTraits(has_dynamics=False),
        "otter": HullTraits(),
        "cybership2": HullTraits(),
    },
)
FAMILIES: tuple[Family[Any], ...] = (
    *(SCHEDULE, ACCESS, DOWNLINK, BROADCASTER, RANGING, KNOWLEDGE, CHANNEL, MF_CHANNEL),
    *(INSTRUMENT, NAVIGATOR, PLACEMENT, ROUTE, AUV, ASV),
)


def advised(family: Family[Any]) -> tuple[str, ...]:
    """Return the parts of a family that advice tries, in the order in which it does."""
    tried = [name for name, traits in family.traits.items() if traits.advised]
    return tuple(sorted(tried, key=lambda name: family.traits[name].advised))
