"""Keys without effect in the mode that a scenario has chosen.

A rule lists keys that are idle where other keys have certain values, with the reason.  The parts of
a rule follow from what parts declare (`core/scenario/families.py`), so that a new part needs no
rule.  `tests/preflight/test_warnings.py` toggles every key in every mode and compares the missions'
tables: it fails where a key does nothing without a rule, or a rule is wrong.

At the end stand settings of channels, instruments and casts that make each other idle.
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any, NamedTuple

from ...core.scenario import families
from ...core.scenario.families import FAMILIES
from ...core.scenario.key_types import Part
from ...core.scenario.part_choice import PartChoice
from ...core.scenario.scenario_keys import ScenarioKeys
from ...core.scenario.sections.usbl import UsblSection
from ...core.scenario.sections.vehicles import VehicleChoice
from ...core.setup import Setup
from ...support.mistakes import Problem
from ...support.plugins import Family, Record, is_plugin
from ...support.wording import plain


class Idle(NamedTuple):
    """Keys without effect where other keys have one of these values; why; and what to do.

    `but` tells for a setup whether they have an effect after all.
    """

    mode: Mapping[str, tuple[Any, ...]]
    keys: tuple[str, ...]
    why: str
    effect: str = "has no effect"
    remedy: str = "remove it"
    but: Callable[[Setup], bool] = lambda _: False


def idle(mode: Mapping[str, tuple[Any, ...]], keys: str, why: str, **more: Any) -> Idle:
    """Return a rule; `keys` is written with braces that expand as in a shell.

    >>> idle({}, "duration_s protocol.{frame_s,duplex}", "").keys
    ('duration_s', 'protocol.frame_s', 'protocol.duplex')
    """
    found: list[str] = []
    for word in keys.split():
        section, _, names = word.rstrip("}").partition("{")
        found += [section + name for name in names.split(",")]
    return Idle(mode, tuple(found), why, **more)


class _Own(tuple[str, ...]):
    """The names of all user-defined parts."""

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and is_plugin(name)


class _Given(tuple[str, ...]):
    """Whatever is given at a key that is null by default."""

    def __contains__(self, value: object) -> bool:
        return value is not None


def names(family: Family[Record], has: Callable[[Record], bool]) -> tuple[str, ...]:
    """Return the names of the shipped parts of a family whose declarations satisfy `has`."""
    return tuple(family.having(has))


OWN, GIVEN = _Own(), _Given()
ASVS_PING = names(families.RANGING, lambda traits: traits.asvs_ping)
CALLS = names(families.RANGING, lambda traits: traits.calls)
OWN_CLOCKS = names(families.RANGING, lambda traits: traits.own_clocks)
REPLIES = names(families.DOWNLINK, lambda traits: traits.replies)
WAITS = names(families.DOWNLINK, lambda traits: traits.waits or traits.replies)
PROGRAMS = names(families.ACCESS, lambda traits: traits.law != "slots")
SCHEDULED = names(families.ACCESS, lambda traits: traits.law == "slots")
SLOTLESS = names(families.ACCESS, lambda traits: traits.law not in ("slots", "slotted"))
FRAMED = names(families.SCHEDULE, lambda traits: traits.framed)
UNFRAMED = names(families.SCHEDULE, lambda traits: not traits.framed and not traits.random_access)
RANDOM = names(families.SCHEDULE, lambda traits: traits.random_access)
UNSLOTTED = names(families.SCHEDULE, lambda traits: traits.access in ("poisson", "sensing"))
PACKED = names(families.SCHEDULE, lambda traits: traits.pace == "packed")
POLLED = names(families.SCHEDULE, lambda traits: traits.calls)
ALONE = names(
    families.SCHEDULE, lambda traits: traits.groups in ("each", "frame") and not traits.calls
)
AT_ONCE = names(families.KNOWLEDGE, lambda traits: not traits.by_frames)
EVERYWHERE = names(families.CURRENT, lambda traits: traits.is_uniform)
STATED = names(families.INSTRUMENT, lambda traits: traits.is_stated)
WITHOUT_GATE = names(families.NAVIGATOR, lambda traits: not traits.weighs)
ENDLESS = names(families.CHANNEL, lambda traits: not traits.ends_at_range)
MEASURED = names(families.CHANNEL, lambda traits: traits.reach_of_its_own)

BROADCASTS = (
    "acoustics.mf.{range_m,range_metric,channel,bit_rate_bps,overhead,header_bytes,fix_bytes} "
    "protocol.broadcaster "
    "acoustics.mf.{airtimes,processing_s,payload_bytes,overfull,modem,transmit_w,receive_w,idle_w} "
    "protocol.{downlink_guard_s,shortest_downlink_slot_s,duplex}"
)
SLOTS = "protocol.{uplink_guard_s,shortest_uplink_slot_s}"
TOLD = "protocol.{contention_chance,forget_after_s,recall_rounds}"
LOSS = "acoustics.loss.{law,combine,contention_per_auv,cap}"
CLOCKS = "navigation.{clock_offset_sd_s,clock_drift_sd}"
STEERING = "auvs.{vehicle.turning_radius_m,join_angle_deg,launch_m,recovery_m}"
# Keys of a USBL that have an effect on vessels, too, which keep their stations by GNSS.
BESIDES = (
    *("preset", "model", "gnss_sd_m", "gnss_correlated_sd_m", "gnss_time_constant_s"),
    "range_rate_sd_m_per_s",
)
ARRAY = f"usbl.{{{','.join(name for name in UsblSection.model_fields if name not in BESIDES)}}}"

COUNTED = "changes only the conflicts that are counted in `rounds`"
AS_THEY_LIKE = "AUVs ping as they like"


def _frames_late_or_random(setup: Setup) -> bool:
    """Tell whether frames may arrive after their slot has ended, or AUVs use random access."""
    mf, slots = setup.scenario.acoustics.mf, setup.slots
    late = mf.range_m > slots.downlink_guard * slots.sound_speed
    return late or setup.scenario.protocol.random_access


def _peers_by_clock(setup: Setup) -> bool:
    """Tell whether AUVs range each other by their clocks."""
    peers = setup.scenario.navigation.peers
    return peers is not None and peers.traits.ranges and not peers.traits.asks


def _wanders(setup: Setup) -> bool:
    """Tell whether a drift's errors wander, as velocity biases in a frame."""
    return any(setup.drift_line_m(group) is not None for group in setup.groups)


RULES = (
    # The protocol
    idle(
        {"protocol.ranging": ASVS_PING},
        f"{BROADCASTS} protocol.{{schedule,downlink,positions,frame_s,conflict_margin_m}}",
        "ASVs ping in turn and AUVs fix themselves; nobody calls, answers or broadcasts",
    ),
    idle(
        {"protocol.ranging": ASVS_PING},
        "acoustics.loss.{contention_per_auv,combine}",
        "no AUV pings, so none contends",
    ),
    idle(
        {"protocol.downlink": REPLIES, "protocol.downlink.reply": ("instant",)},
        BROADCASTS,
        "the ASV that hears a ping first answers it at once, without airtime",
    ),
    idle(
        {"protocol.downlink": REPLIES, "protocol.downlink.reply": ("frame",)},
        "protocol.{broadcaster,shortest_downlink_slot_s} acoustics.mf.{payload_bytes,overfull}",
        "the ASV that hears a ping first answers it, once it is decoded, in a frame of one fix",
    ),
    idle(
        {"protocol.downlink": REPLIES, "protocol.downlink.reply": ("frame",)},
        "protocol.downlink.reply_at",
        "answers are frames, sent once a ping is decoded",
        remedy="remove it, or set protocol.downlink.reply: instant, answers without airtime as in "
        "0.1",
    ),
    idle(
        {"protocol.downlink": REPLIES, "protocol.schedule": UNSLOTTED},
        "protocol.downlink_guard_s",
        "pings are answered as they come, in no slots",
    ),
    idle(
        {"protocol.downlink": WAITS},
        "protocol.duplex",
        "nobody pings while a frame is on the air or arriving",
        but=_frames_late_or_random,
    ),
    idle(
        {"protocol.schedule": PACKED},
        SLOTS,
        "arrivals are packed, there are no slots of T_UL",
        but=lambda setup: setup.scenario.protocol.asvs_ping,
    ),
    idle(
        {"protocol.schedule": UNFRAMED, "protocol.access": SCHEDULED},
        "protocol.frame_s",
        "a round begins as soon as the one before it has ended",
    ),
    idle(
        {"protocol.schedule": ALONE, "protocol.ranging": OWN_CLOCKS},
        "protocol.positions",
        "an AUV has its slot to itself wherever it is believed to be",
        effect=COUNTED,
    ),
    *(
        idle(mode, keys, f"{AS_THEY_LIKE}, wherever they are believed to be", effect=COUNTED)
        for mode, keys in (
            ({"protocol.schedule": RANDOM}, "protocol.positions"),
            ({"protocol.access": PROGRAMS}, "protocol.{positions,conflict_margin_m}"),
        )
    ),
    idle({"protocol.access": PROGRAMS}, "auvs.ping_late_s", AS_THEY_LIKE),
    idle({"protocol.access": SLOTLESS}, SLOTS, f"{AS_THEY_LIKE}, in no slots"),
    idle({"protocol.schedule": UNSLOTTED}, SLOTS, f"{AS_THEY_LIKE}, in no slots"),
    idle(
        {"protocol.schedule": ALONE + RANDOM},
        "protocol.conflict_margin_m",
        "an AUV has its slot to itself wherever it is believed to be",
        effect=COUNTED,
    ),
    idle(
        {"protocol.ranging": CALLS + ASVS_PING}, "auvs.ping_late_s", "no AUV pings by its own clock"
    ),
    idle({"protocol.schedule": POLLED}, "auvs.ping_late_s", "AUVs ping when they are called"),
    idle({"protocol.schedule": RANDOM}, "auvs.ping_late_s", AS_THEY_LIKE),
    # Routes, and how large a fleet is
    idle({"auvs.route.kind": ("hold",)}, STEERING, "the AUVs lie still"),
    idle({"auvs.route.kind": ("track",)}, STEERING, "the AUVs repeat their tracks"),
    idle(
        {"auvs.route.kind": ("hold", "track")},
        "auvs.{speed_m_per_s,speeds_m_per_s}",
        "the AUVs lie still, or repeat their tracks",
    ),
    idle(
        {
            "auvs.route.kind": ("track",),
            "environment.temperature_c": (None,),
            "environment.ctd": (None,),
        },
        "survey.{depth_m,depths_m}",
        "the tracks say how deep they are",
        but=lambda setup: setup.some_tracks_lack_depths,
    ),
    idle(
        {"auvs.route.kind": ("hold", "waypoints", "track")},
        "survey.rotation_deg",
        "the AUVs go where their route says, whichever way the survey is turned",
        effect="changes only what counts as survey",
    ),
    idle({"survey.area": (None,)}, "survey.{crs,area_name}", "no chart has the area"),
    idle(
        {
            "environment.origin.lat_deg": (None,),
            **{f"survey.{name}": (None,) for name in ("area", "polygon_deg")},
        },
        "environment.surface_m",
        "the site is nowhere on Earth",
    ),
    idle(
        {"auvs.route.kind": ("waypoints",), "auvs.route.files": ((),)},
        "auvs.route.{crs,routes}",
        "no chart has the ways",
    ),
    idle({"survey.depths_m": GIVEN}, "survey.depth_m", "each AUV has a depth of its own"),
    idle({"auvs.speeds_m_per_s": GIVEN}, "auvs.speed_m_per_s", "each AUV has its own speed"),
    idle({"auvs.launch_m": GIVEN}, "auvs.route.start", "the AUVs begin where they are launched"),
    idle(
        {"acoustics.mf.airtimes": GIVEN},
        "acoustics.mf.{bit_rate_bps,overhead}",
        "airtimes are those of the table",
    ),
    idle(
        {"acoustics.mf.payload_bytes": (None,), "acoustics.mf.airtimes": (None,)},
        "acoustics.mf.overfull",
        "a message holds any number of fixes",
    ),
    *(
        idle(mode, "acoustics.mf.{payload_bytes,overfull}", "no broadcast has more than one fix")
        for mode in ({"protocol.schedule": FRAMED}, {"auvs.count": (1,)})
    ),
    *(
        idle(
            {f"acoustics.{band}.transmit_w": (None,)},
            f"acoustics.{band}.{{receive_w,idle_w}}",
            "the energy of this band is reported where all its powers are known",
        )
        for band in ("hf", "mf")
    ),
    idle({"acoustics.hf.channel": OWN}, LOSS, "how likely signals are lost only the plug-in says"),
    idle(
        {"acoustics.hf.channel": ENDLESS},
        LOSS,
        "the law of the disc's loss; this channel says itself how likely signals are lost",
    ),
    idle(
        {"acoustics.mf.channel": MEASURED},
        "acoustics.mf.{range_m,range_metric}",
        "the curve says how far frames are decoded",
    ),
    idle(
        {"acoustics.loss.combine": ("off",)},
        "acoustics.loss.contention_per_auv",
        "the loss is that of the range alone",
    ),
    idle(
        {"acoustics.loss.combine": ("off",), "protocol.ranging": OWN_CLOCKS},
        "acoustics.loss.cap",
        "the loss is that of the range alone",
        but=lambda setup: setup.scenario.protocol.calls,
    ),
    idle(
        {"record.detail": ("summary",)},
        "record.tracks_hz navigation.depth_sd_m",
        "no tracks are kept, and depths stand in tracks alone",
    ),
    idle(
        {"asvs.count": (1,)},
        "asvs.formation.{angle_deg,clearance_m,radius_m}",
        "a single ASV lies at the centre",
    ),
    *(
        idle(
            {"asvs.formation.model": ("assign", "zigzag"), few: (1,)},
            "asvs.formation.hysteresis",
            "there is one way to split the AUVs",
        )
        for few in ("asvs.count", "auvs.count")
    ),
    idle(
        {"asvs.formation.model": ("visit",), "auvs.count": (1,)},
        "asvs.formation.{hysteresis,dwell_s}",
        "there is one AUV to visit",
    ),
    idle(
        {"asvs.formation.model": ("follow", "assign"), "auvs.route.kind": ("hold",)},
        "asvs.formation.horizon_s",
        "the AUVs lie still",
    ),
    idle({"asvs.count": (1,)}, "protocol.broadcaster", "there is no other ASV"),
    idle(
        {"protocol.acknowledge": ("none", "ping")},
        "protocol.acknowledgement_bytes",
        "AUVs send no frame to acknowledge",
    ),
    idle(
        {"auvs.count": (1,)}, "acoustics.loss.{contention_per_auv,combine}", "there is no other AUV"
    ),
    idle({"auvs.count": (1,)}, "protocol.conflict_margin_m", "there is no other AUV"),
    idle(
        {"auvs.count": (1,), "protocol.ranging": OWN_CLOCKS},
        "protocol.positions",
        "there is no other AUV",
        but=lambda setup: setup.schedule.pace != "",  # slots last as long as ways do
    ),
    idle(
        {"auvs.route.surface_every_s": (None,)},
        "auvs.route.{surface_for_s,climb_angle_deg}",
        "the AUVs stay at their depth",
    ),
    idle(
        {"auvs.depth.altitude_m": (None,)},
        "auvs.depth.{shallowest_m,climb_angle_deg}",
        "the AUVs keep a depth, not an altitude",
    ),
    # The water
    idle(
        {"environment.temperature_c": (None,)},
        "environment.salinity_psu",
        "only with a temperature does the speed of sound follow from it",
    ),
    idle(
        {"environment.temperature_c": (None,), "environment.ctd": (None,)},
        "environment.sound_speed_law",
        "the speed of sound is given",
    ),
    idle(
        {"environment.current_m_per_s": (0.0,)},
        "environment.current_direction_deg",
        "there is no mean current",
    ),
    idle(
        {"environment.current_variation_m_per_s": (0.0,)},
        "environment.current_variation_time_s",
        "the current does not vary",
    ),
    idle(
        {"survey.depth_m": (0.0,), "auvs.route.kind": ("lawnmower", "waypoints", "hold")},
        "acoustics.hf.range_metric acoustics.mf.range_metric",
        "AUVs at the surface are as far as they look from above",
    ),
    # Instruments and navigation
    idle(
        {"auvs.route.kind": ("hold",), "navigation.heading_sd_deg": (0.0,)},
        "navigation.bias_frame",
        "AUVs that hold still head along +x, so that both frames are one",
    ),
    idle(
        {"navigation.velocity_bias_sd_m_per_s": (0.0,)},
        "navigation.velocity_bias_time_constant_s",
        "no velocity bias is drawn, the constant one does not wander",
    ),
    idle(
        {"protocol.ranging": CALLS},
        CLOCKS,
        "AUVs answer calls, whatever their clocks say",
        but=_peers_by_clock,
    ),
    idle(
        {"auvs.count": (1,)},
        "navigation.peers.{every_s,kind,bearing,message_bytes,share,fusion}",
        "there is no other AUV",
    ),
    idle(
        {"navigation.peers.share": ("raw",)},
        "navigation.peers.fusion",
        "each AUV works out all from the measurements that have come to it, and fuses no estimates",
    ),
    idle(
        {"usbl.gnss_correlated_sd_m": (0.0,)},
        "usbl.gnss_time_constant_s",
        "GNSS has no slow error",
    ),
    idle({"usbl.slow_share": (0.0,)}, "usbl.correlation_s", "no acoustic error is slow"),
    idle({"usbl.outlier_share": (0.0,)}, "usbl.outlier_sd_m", "there are no outliers"),
    idle(
        {"usbl.model": STATED},
        "usbl.{array,tdoa_sd_s,travel_time_sd_s,quantum_s}",
        "the data sheet says what all of them make together",
        remedy="remove it, or set usbl.model: array",
    ),
    idle(
        {"usbl.model": OWN},
        f"{ARRAY} {CLOCKS}",
        "how well fixes are measured only the plug-in says",
    ),
    idle(
        {
            "environment.current_m_per_s": (0.0,),
            "environment.current_variation_m_per_s": (0.0,),
            "environment.current": EVERYWHERE,
            "auvs.feedback": ("truth",),
        },
        "navigation.velocity",
        "through still water is over ground",
    ),
    idle(
        {"navigation.filter": WITHOUT_GATE},
        "navigation.nis_gate",
        "only a filter that weighs refuses fixes",
    ),
    idle(
        {"navigation.filter": OWN},
        "navigation.nis_gate",
        "the plug-in is given every fix, and refuses which it likes",
    ),
    idle(
        {
            "navigation.velocity_bias_m_per_s": ((0.0, 0.0),),
            "navigation.velocity_bias_sd_m_per_s": (0.0,),
            "navigation.drift.m_per_hour": (None,),
        },
        "navigation.bias_frame",
        "there is no bias",
        but=_wanders,
    ),
    idle(
        {
            "navigation.drift.percent_of_distance": (None,),
            "navigation.drift.m_per_hour": (None,),
        },
        "navigation.drift.{statistic,line_m,time_constant_s}",
        "no drift is stated",
        remedy="remove it, or set navigation.drift.percent_of_distance or m_per_hour",
    ),
    *(
        idle(mode, "navigation.drift.{line_m,time_constant_s}", why, but=_wanders)
        for mode, why in (
            (
                {"auvs.route.kind": ("hold", "track")},
                "no speed is planned at which they would wander, the drift's errors are constant",
            ),
            (
                {"protocol.ranging": ASVS_PING},
                "the error of the heading turns the array as well, and is constant",
            ),
            (
                {"auvs.speeds_m_per_s": GIVEN},
                "AUVs that differ in speed have constant errors of scale and heading",
            ),
        )
    ),
    idle(
        {"navigation.drift.line_m": (None,)},
        "navigation.drift.time_constant_s",
        "the drift's errors are constant",
        remedy="remove it, or set navigation.drift.line_m",
    ),
    # Who knows the slots
    idle(
        {"protocol.ranging": ASVS_PING + CALLS},
        f"protocol.knowledge {TOLD}",
        "AUVs are called, or do not ping: they need no slot",
    ),
    idle(
        {"protocol.schedule": RANDOM + POLLED},
        f"protocol.knowledge {TOLD}",
        f"{AS_THEY_LIKE}, or are called: they need no slot",
    ),
    idle(
        {"protocol.access": PROGRAMS},
        f"protocol.schedule protocol.knowledge {TOLD}",
        f"{AS_THEY_LIKE}: they need no slot",
    ),
    idle({"protocol.knowledge": AT_ONCE}, TOLD, "all AUVs know the schedule at once"),
    idle(
        {"protocol.knowledge.missed": ("silent", "last_slot")},
        "protocol.contention_chance",
        "there is no contention slot",
    ),
    idle(
        {"protocol.knowledge.missed": ("contention",)},
        "protocol.recall_rounds",
        "lost AUVs come back by the contention slot",
    ),
    idle({"protocol.forget_after_s": (None,)}, "protocol.recall_rounds", "no AUV is ever lost"),
)


def idle_keys(setup: Setup) -> Iterator[Problem]:
    """Yield given keys that have no effect for any group of AUVs or ASVs that uses them, once."""
    mixes = list(product(setup.groups, setup.vessels))
    found = [
        {problem.key: problem for problem in _idle(setup, vessels.alone(group.alone))}
        for group, vessels in mixes
    ]
    for key, problem in {key: own for idles in found for key, own in idles.items()}.items():
        places = [vessels.key(group.place(key)) for group, vessels in mixes]
        for place in dict.fromkeys(places):
            followers = [idles for idles, own in zip(found, places, strict=True) if own == place]
            if all(key in idles for idles in followers):
                yield problem._replace(key=place)


def overruled(setup: Setup) -> Iterator[Problem]:
    """Yield keys for all AUVs, or ASVs, that every group replaces by its own."""
    dumped = _is_whole(setup.scenario)
    protocol, peers = setup.scenario.protocol, setup.scenario.navigation.peers
    carried = peers is not None or protocol.random_access  # AUVs may have what `usbl` says
    for key in setup.overruled_keys:
        if _is_given(setup.scenario, key, dumped) and not (carried and key.startswith("usbl.")):
            kind = "asvs" if key.startswith(("usbl.", "asvs.")) else "auvs"
            message = f"has no effect: each group of {kind.upper()[:3]}s says its own; remove it"
            yield Problem(key, message, (f"{kind}.groups",))


def _idle(setup: Setup, scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield given keys of a scenario that have no effect, each once."""
    seen: set[str] = set()
    dumped = _is_whole(scenario)
    for rule in RULES:
        now = {key: _value(scenario, key) for key in rule.mode}
        if not all(now[key] in values for key, values in rule.mode.items()):
            continue
        given = [key for key in rule.keys if key not in seen and _is_given(scenario, key, dumped)]
        if not given or rule.but(setup):
            continue
        seen.update(given)
        chosen = ", ".join(f"{key}: {plain(value)}" for key, value in now.items())
        message = f"{rule.effect} with {chosen} ({rule.why}); {rule.remedy}"
        yield from (Problem(key, message, tuple(rule.mode)) for key in given)


def _value(scenario: ScenarioKeys, key: str) -> Any:
    """Return the value at a dotted key; of a vehicle its model; None without such a key."""
    value: Any = scenario
    for name in key.split("."):
        if isinstance(value, PartChoice):
            return _setting(key.removesuffix(f".{name}"), value, name)
        value = getattr(value, name, None)
    return value.model if isinstance(value, VehicleChoice) else value


def _setting(key: str, part: PartChoice, name: str) -> Any:
    """Return the value of a setting of the part at a key; None if it has no such setting."""
    family = next(family for family in FAMILIES if family.key == key)
    model = family.settings.get(str(part))
    field = model.model_fields.get(name) if model else None
    return part.settings.get(name, field.default if field else None)


def _is_given(scenario: ScenarioKeys, key: str, dumped: bool) -> bool:
    """Tell whether a key is given; in a scenario `dumped` whole, whether it differs from its
    default.
    """
    part: Any = scenario
    *sections, last = key.split(".")
    for name in sections:
        if part is None or name not in part.model_fields_set:
            return False
        part = getattr(part, name)
    choice = part.choice if isinstance(part, VehicleChoice) else part
    if isinstance(choice, PartChoice):
        return last in choice.settings
    if part is None or last not in part.model_fields_set or last not in type(part).model_fields:
        return False
    return not dumped or getattr(part, last) != type(part).model_fields[last].default


def _is_whole(part: Part) -> bool:
    """Tell whether every key is set, as in a scenario that the program wrote."""
    values = [getattr(part, name) for name in type(part).model_fields]
    return part.model_fields_set == set(type(part).model_fields) and all(
        _is_whole(value) for value in values if isinstance(value, Part)
    )


def sheet(setup: Setup) -> Iterator[Problem]:
    """Yield a USBL's reference SNR where the channel has no SNR."""
    hf = setup.scenario.acoustics.hf
    for vessels in setup.vessels if not hf.traits.has_levels else ():
        is_given = "reference_snr_db" in vessels.usbl.model.settings
        if not vessels.is_first_with_usbl or not is_given:
            continue
        yield Problem(
            vessels.key("usbl.model.reference_snr_db"),
            f"has no effect with acoustics.hf.channel: {hf.channel} (it gives no signal-to-noise "
            "ratio, angles are as stated); remove it",
            ("acoustics.hf.channel",),
        )


def receivers(setup: Setup) -> Iterator[Problem]:
    """Yield GNSS receivers of AUVs that are not planned to surface."""
    scenario = setup.scenario
    receiver, routes = scenario.navigation.gnss_fix, [wing.asked for wing in setup.wings]
    planned = all(route.is_flown or route.is_held for route in routes)
    own = any(group.vehicle.own for group in setup.groups)
    rises = any(route.surfacing is not None for route in routes)
    if receiver is None or not planned or own or rises:
        return
    shallowest = min(auv.depth_m for auv in setup.auvs)
    if shallowest > receiver.depth_m:
        yield Problem(
            "navigation.gnss_fix",
            f"brings no fix: AUVs stay at {plain(shallowest)} m and deeper, and are at the surface "
            f"down to {plain(receiver.depth_m)} m; give auvs.route.surface_every_s, or remove it",
            ("auvs.route.surface_every_s", "survey.depth_m"),
        )


def sonar(setup: Setup) -> Iterator[Problem]:
    """Yield settings of a sonar that have no effect."""
    scenario = setup.scenario
    hf, ranging = scenario.acoustics.hf, scenario.protocol.ranging
    times_arrivals = any(vessels.instrument.times_arrivals for vessels in setup.vessels)
    if "timing" in hf.channel.settings and not times_arrivals:
        yield Problem(
            "acoustics.hf.channel.timing",
            f"has no effect with usbl.model: {scenario.usbl.model} (how directions err is said "
            "there, arrivals at an array are not timed); remove it",
            ("usbl.model",),
        )
    if hf.traits.has_echoes and scenario.protocol.asvs_ping:
        for name in {"bottom_m", "surface_sd_m", "transducer_m"} & hf.channel.settings.keys():
            yield Problem(
                f"acoustics.hf.channel.{name}",
                f"has no effect with protocol.ranging: {ranging} (the pings of ASVs have no "
                "echoes); remove it",
                ("protocol.ranging",),
            )


MATCHED_FILTERS = ("non_coherent", "coherent", "rayleigh")
LEVELS = ("source_level_db", "directivity_index_db", "wind_m_per_s", "shipping", "own_noise_db")


def levels(setup: Setup) -> Iterator[Problem]:
    """Yield settings of channels with levels that another setting makes idle."""
    for band, section in setup.scenario.acoustics.bands.items():
        if not section.traits.has_levels:
            continue
        key, given = f"acoustics.{band}.channel", section.channel.settings
        decoding, absorption = given.get("decoding", "threshold"), given.get("absorption")
        for name, chooser, chosen, is_idle in (
            ("ph", "absorption", absorption, absorption == "thorp"),
            ("false_alarm", "decoding", decoding, decoding not in MATCHED_FILTERS),
        ):
            if is_idle and name in given:
                message = f"has no effect with {chooser}: {chosen}; remove it"
                yield Problem(f"{key}.{name}", message, (f"{key}.{chooser}",))
        relative = decoding == "threshold" and given.get("timing", "constant") == "constant"
        relative &= given.get("snr_threshold_db") is None and given.get("capture_db") is None
        effect = "has no effect" if band == "mf" else "changes only the SNR that is told"
        for name in LEVELS:
            if relative and name in given:
                yield Problem(
                    f"{key}.{name}",
                    f"{effect} with snr_threshold_db: null (the threshold is then the SNR at "
                    "range_m, whatever that is); give snr_threshold_db, or remove it",
                    (f"{key}.snr_threshold_db",),
                )


def bursts(setup: Setup) -> Iterator[Problem]:
    """Yield durations of bursts of losses where nothing is lost."""
    acoustics = setup.scenario.acoustics
    hf, mf = acoustics.hf, acoustics.mf
    if mf.burst_s is not None and mf.traits.keeps_frames:
        yield Problem(
            "acoustics.mf.channel.burst_s",
            f"has no effect with acoustics.mf.channel: {mf.channel} (within its range it "
            "loses no frame); remove it",
            ("acoustics.mf.channel",),
        )
    if hf.burst_s is None:
        return
    from .fix_chance import loses_pings  # brings numpy, which few scenarios wait for

    if not loses_pings(setup):
        yield Problem(
            "acoustics.hf.channel.burst_s",
            f"has no effect with acoustics.loss.law: {acoustics.loss.law} over "
            f"acoustics.hf.range_m: {plain(hf.range_m)} (no ping is lost on its way); remove it",
            ("acoustics.loss.law", "acoustics.hf.range_m"),
        )


def cast(setup: Setup) -> Iterator[Problem]:
    """Yield a law of sound speed where the cast has sound speeds itself."""
    water = setup.scenario.environment
    usual = type(water).model_fields["sound_speed_law"].default
    if water.ctd is None or water.sound_speed_law == usual:
        return
    from ...core.sea.water_column import read_cast  # needs numpy, which few scenarios wait for here

    if read_cast(water.ctd).speeds_m_per_s is not None:
        yield Problem(
            "environment.sound_speed_law",
            "has no effect on a CTD profile that has speeds of sound itself; remove it",
            ("environment.ctd",),
        )


def above_ground(setup: Setup) -> Iterator[Problem]:
    """Yield keys of a bottom, and of what is above it, that nothing makes use of."""
    scenario, water = setup.scenario, setup.scenario.environment
    bottom, still = water.bathymetry, not (water.current_m_per_s or water.has_field)
    if bottom and bottom.slope_towards_deg and not bottom.slope_deg:
        yield Problem(
            "environment.bathymetry.slope_towards_deg",
            "has no effect with environment.bathymetry.slope_deg: 0 (the bottom is flat); remove "
            "it, or give the slope",
            ("environment.bathymetry.slope_deg",),
        )
    if scenario.navigation.dvl_range_m and still and not water.current_variation_m_per_s:
        yield Problem(
            "navigation.dvl_range_m",
            "has no effect without a current: logs measure the same over ground and through the "
            "water; remove it, or give environment.current_m_per_s",
            ("environment.current_m_per_s",),
        )
    kept = all(group.altitude.altitude_m is not None for group in setup.groups)
    if kept and "depth_m" in scenario.survey.model_fields_set:
        yield Problem(
            "survey.depth_m",
            "has no effect with auvs.depth.altitude_m (the AUVs keep an altitude); remove it",
            ("auvs.depth.altitude_m",),
        )
