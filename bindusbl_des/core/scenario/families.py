"""The families of parts (schedules, channels, navigators, ...), and the parts that ship.

**Theory of operation.**  A part is one place: a function or class in one file, which holds its
settings (a pydantic model), its declarations (traits), its code and its words.

    class WorstFirst(ScheduleSettings):
        slots: Whole = key(4, "1", "ping groups of a round, at most", ge=1, le=9_999)

    @ScheduleTraits(settings=WorstFirst, groups="first_fit", chooses=True, ...)
    def worst_first(view: View, *, settings: WorstFirst) -> Groups:
        ...

*The list.*  A family is a key of the scenario at which a part is named.  Its parts are one line
each: the name in a scenario, and ``module:object`` of this package, in the order in which messages
list them.  That text is the only reference from the scenario to the packages above it.

*When a part is imported.*  A part is imported when its declarations are first asked for: the chosen
ones as a scenario is validated, all of them for the reference, the schema, or a rule that compares
parts.  Validation must not wait for numpy, so the file of a part imports little; its functions
import what they work with.  Compiled equations have a module beside it.

*What is declared.*  Code that must know something about a part asks its traits: the planner what to
predict and what it leaves out (`approximation`), warnings what has no effect, `explain` its words.
No name of a part is tested anywhere (`tests/test_parts.py`).  A user-defined part declares the same
by attributes of the same names; what it does not declare has the default of the traits.

*Checks.*  Settings of both kinds are checked with the scenario (:mod:`.part_choice`); answers of a
user-defined part when it is asked, by :class:`...support.plugins.OwnPart`, whose message names the
part, the question and the remedy.  Invariants: traits are frozen and never depend on the scenario;
a part is called with its settings bound to it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeVar

from ...support.plugins import Family
from .key_types import Real, key
from .part_choice import Settings
from .shipped_settings import Datasheet, FixedGain, Kalman, Kinematic, Sailboat, Smoothing

Made = TypeVar("Made")


@dataclass(frozen=True, kw_only=True)
class Traits:
    """Declarations of a part of any family: the model of its `settings`; and its rank among the
    parts that advice tries in place of the chosen one (`advised`; 0: it is not tried).
    """

    settings: type[Settings] = Settings
    advised: int = 0

    def __call__(self, part: Made) -> Made:
        """Declare these traits of a shipped function or class, as its decorator."""
        part.traits = self  # type: ignore[attr-defined]  # a function has no such attribute
        return part


class ScheduleSettings(Settings):
    """What the settings of a schedule say about its rounds; these are the defaults."""

    @property
    def most_groups(self) -> int | None:
        """The largest number of ping groups in a round; None: as many as AUVs."""
        return None

    @property
    def shares_calls(self) -> bool:
        """Whether ASVs may call, at once, AUVs of which no ASV hears two."""
        return False

    @property
    def pause_s(self) -> float:
        """The pause (s) between two packed arrivals."""
        return 0.0


@dataclass(frozen=True)
class ScheduleTraits(Traits):
    """Declarations of a schedule, which decides when AUVs ping.

    `groups`: the ping groups of a round.  `frame`: a round is one AUV's; `each`: every AUV has a
        slot of its own; `first_fit`: AUVs share a slot if no ASV hears two of them, coloured
        greedily in the order of their numbers; `saturation`: the same, the most constrained AUV
        first; "": they are not known beforehand.  A schedule that colours in another order has an
        `approximation`.
    `framed`, `turn`: whose turn a frame is: by `rotation`, or by `lot`.
    `access`: AUVs ping in the `slots` that they are given; at the instants of a Poisson process
        (`poisson`); at the next of equal slots (`slotted`); when they hear no other (`sensing`); or
        by a `program` (`protocol.access`).
    `is_proved`: the verifier's rules (`apps/verification/rules.py`) hold: AUVs share a slot only if
        no ASV within range hears two of them.
    `renumbers`: an AUV's slot may differ from round to round.
    `approximation`: what a prediction leaves out; it then assumes these `groups`.
    `pace`: the length of slots that are not all T_UL: until the called AUV has `answered`, or until
        the next of the `packed` arrivals.
    `turn_by`: the reason of a turn that `explain` names beside the slot.
    `chooses`: some AUVs have no turn in a round.
    `is_proposed`: plans try it in place of another schedule.
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
        """Whether every round has a turn for each AUV."""
        return not self.framed and not self.chooses

    @property
    def random_access(self) -> bool:
        """Whether AUVs choose themselves when they ping."""
        return self.access != "slots"

    @property
    def shares_slots(self) -> bool:
        """Whether AUVs share a slot if no ASV hears two of them."""
        return self.groups in ("first_fit", "saturation")

    @property
    def is_shared_and_proved(self) -> bool:
        """Whether AUVs share slots by rules that the verifier knows."""
        return self.shares_slots and self.is_proved

    @property
    def has_exact_groups(self) -> bool:
        """Whether its ping groups can be predicted exactly from which ASV hears which AUV."""
        return self.groups not in ("", "frame") and not self.approximation


@dataclass(frozen=True)
class AccessTraits(Traits):
    """Declarations of a program by which each AUV decides itself when it pings.

    `law`: when it pings, as in a schedule's `access`; for `program` there is no closed form.  AUVs
    hear each other (`hears`), send `signals` beside pings, and ASVs run the program, too
    (`on_asvs`).
    """

    law: Literal["slots", "program", "poisson", "slotted", "sensing"] = "program"
    hears: bool = True
    signals: bool = True
    on_asvs: bool = True


class AnswerSettings(Protocol):
    """The settings of a downlink that answers pings: the kind of answer, and when it is sent."""

    reply: str
    reply_at: str
    takes_airtime: bool


@dataclass(frozen=True)
class DownlinkTraits(Traits):
    """Declarations of a downlink: when fixes are sent, and whether the next slot waits for them.

    Each ping is answered by itself (`replies`), or fixes are broadcast after each group of a round
    (`by_group`) or after all groups.  The next slot `waits` for the end of the broadcast, or does
    not. If `is_foreseen`, a frame can announce when the next round begins.  `in_words` says what
    happens to a round's fixes.
    """

    replies: bool = False
    by_group: bool = False
    waits: bool = False
    is_foreseen: bool = False
    in_words: str = ""

    @property
    def tells_ahead(self) -> int:
        """How many rounds ahead a frame announces slots."""
        return 1 if self.waits else 2


@dataclass(frozen=True)
class BroadcasterTraits(Traits):
    """Declarations of a broadcaster, which chooses the ASV that broadcasts.

    It is the next ASV (`turn`), one drawn by `lot`, always `one`, the one that has measured the
    most fixes (`hearing`), or the one nearest to the AUVs (`distance`): with `at_once` each AUV's
    nearest ASV, all at once, else the nearest to all of them.
    """

    chosen_by: Literal["", "turn", "lot", "one", "hearing", "distance"] = ""
    at_once: bool = False

    @property
    def serves_nearest(self) -> bool:
        """Whether the ASV nearest to AUVs sends their fixes."""
        return self.chosen_by == "distance"


@dataclass(frozen=True)
class RangingTraits(Traits):
    """Declarations of a ranging: how a range is measured.

    ASVs ping and AUVs compute their own fixes (`asvs_ping`); or AUVs ping, by their `own_clocks`,
    so that no slot is needed, or in answer to a call (`calls`), and the two-way travel time is
    measured.
    """

    asvs_ping: bool = False
    calls: bool = False
    own_clocks: bool = False


class DisseminationSettings(Protocol):
    """The settings of knowledge by frames: the bytes that announce a slot to an AUV, and what an
    AUV does that `missed` them.
    """

    assignment_bytes: int
    missed: str


@dataclass(frozen=True)
class KnowledgeTraits(Traits):
    """Whether AUVs learn the slots of a round `by_frames`; else all know them at once."""

    by_frames: bool = False


@dataclass(frozen=True)
class InstrumentTraits(Traits):
    """Declarations of a USBL instrument: it `times_arrivals` at the elements of an array, or has
    the errors that a data sheet states (`is_stated`).
    """

    times_arrivals: bool = False
    is_stated: bool = False


class Lossy(Settings):
    """Settings of every channel, user-defined ones too: duration of losses, largest Doppler."""

    burst_s: Real | None = key(
        None,
        "s",
        "mean duration of a burst of losses between a pair of vehicles, at the channel's "
        "share of lost signals; null = losses are independent",
        gt=0,
        le=1e5,
    )
    doppler_limit_m_per_s: Real | None = key(
        None,
        "m/s",
        "largest range rate, in either direction, at which signals are decoded; null = the "
        "modem's limit, else none",
        gt=0,
        le=100,
    )


@dataclass(frozen=True)
class ChannelTraits(Traits):
    """Declarations of a channel, which decides whether a signal is decoded.

    Nothing is decoded beyond the range (`ends_at_range`); received levels are known (`has_levels`).
    Within range it may lose pings, and frames unless it `keeps_frames`.  Where the bottom is given,
    pings have echoes (`has_echoes`) or rays are traced (`traces_rays`).  A measured channel has a
    `reach_of_its_own`.  `by_link`: it depends on which vehicles send and listen, not on their
    positions alone.
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
    """Declarations of a navigator, which corrects dead reckoning by fixes.

    It ignores fixes (`ignores_fixes`), applies a fixed gain (`has_gain`), or weighs them by
    covariance (`weighs`); `is_smoother`: it revises earlier estimates.  A user-defined one gets
    what it `wants`: fused fixes, or receptions.
    """

    weighs: bool = False
    ignores_fixes: bool = False
    has_gain: bool = False
    is_smoother: bool = False
    wants: Literal["fixes", "receptions"] = "fixes"


@dataclass(frozen=True)
class CurrentTraits(Traits):
    """Declarations of a current: whether it is the same everywhere (`is_uniform`), or is read from
    a file (`of_a_file`).
    """

    is_uniform: bool = False
    of_a_file: bool = False


@dataclass(frozen=True)
class PeerTraits:
    """How AUVs measure each other: whether one `asks` another before that answers, and whether the
    answer gives a range (`ranges`) or a direction only.
    """

    asks: bool = False
    ranges: bool = True


PEERS: Mapping[str, PeerTraits] = {
    "owtt": PeerTraits(),
    "twtt": PeerTraits(asks=True),
    "angles": PeerTraits(ranges=False),
}


@dataclass(frozen=True)
class HullTraits(Traits):
    """Whether a vehicle moves by equations of motion (`has_dynamics`), or by the wind (`sails`);
    else exactly as planned.
    """

    has_dynamics: bool = True
    sails: bool = False


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
# The programs of random access, by the `access` of their schedules
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
        "follow": "models.placements:Follow",
        "assign": "models.placements:Assign",
        "zigzag": "models.placements:Zigzag",
        "visit": "models.placements:Visit",
        "information": "models.placements:Information",
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
        "sailboat": HullTraits(settings=Sailboat, has_dynamics=False, sails=True),
    },
)
CURRENT = Family(
    *("environment.current", "current", ("site",)),
    {
        "uniform": CurrentTraits(is_uniform=True),
        "shear": "models.currents:shear",
        "tide": "models.currents:tide",
        "vortex": "models.currents:vortex",
        "netcdf": "models.currents:netcdf",
    },
    CurrentTraits(),
    is_open=False,
)
FAMILIES: tuple[Family[Any], ...] = (
    *(SCHEDULE, ACCESS, DOWNLINK, BROADCASTER, RANGING, KNOWLEDGE, CHANNEL, MF_CHANNEL),
    *(INSTRUMENT, NAVIGATOR, PLACEMENT, ROUTE, AUV, ASV, CURRENT),
)


def advised(family: Family[Any]) -> tuple[str, ...]:
    """Return the parts of a family that advice tries, in that order."""
    tried = [name for name, traits in family.traits.items() if traits.advised]
    return tuple(sorted(tried, key=lambda name: family.traits[name].advised))
