"""Keys that do nothing in the mode that a scenario has chosen; each rule was found by experiment.

`tests/preflight/test_warnings.py` toggles every key in every mode and compares the missions'
tables: it fails where a key does nothing and no rule here says so, and where a rule here is wrong.

Settings of channels, instruments and casts that another setting leaves nothing to do.
"""

from collections.abc import Iterator
from typing import Any

from ..core.mistakes import Problem
from ..core.wording import plain
from ..scenario import declared
from ..scenario.families import FAMILIES
from ..scenario.key_types import Part
from ..scenario.part_choice import PartChoice
from ..scenario.scenario import Scenario
from ..scenario.scenario_keys import Environment
from ..scenario.sections.vehicles import VehicleChoice
from ..setup import Setup
from .idle_rules import (
    FRAMED,
    GIVEN,
    KNOWLEDGE,
    MEASURING,
    OWN,
    OWN_CLOCKS,
    PROTOCOL,
    Idle,
    calls,
    names,
    times_by_place,
)

MATCHED_FILTERS = ("non_coherent", "coherent", "rayleigh")
USUAL_LAW = Environment.model_fields["sound_speed_law"].default


def sheet(setup: Setup) -> Iterator[Problem]:
    """Yield what a USBL's sheet says of signal-to-noise ratios where there are none."""
    scenario = setup.scenario
    hf = scenario.acoustics.hf
    if "reference_snr_db" in scenario.usbl.model.settings and not hf.traits.has_levels:
        yield Problem(
            "usbl.model.reference_snr_db",
            f"has no effect with acoustics.hf.channel: {hf.channel} (it gives no signal-to-noise "
            "ratio, angles are as stated); remove it",
            ("acoustics.hf.channel",),
        )


def receivers(setup: Setup) -> Iterator[Problem]:
    """Yield GNSS receivers of AUVs that are never at the surface, as far as that is planned."""
    scenario = setup.scenario
    receiver, route, survey = scenario.navigation.gnss_fix, scenario.auvs.route, scenario.survey
    planned = (route.is_flown or route.is_held) and not scenario.auvs.vehicle.own
    if receiver is None or not planned or route.surfacing is not None:
        return
    shallowest = min(survey.depths_m or (survey.depth_m,))
    if shallowest > receiver.depth_m:
        yield Problem(
            "navigation.gnss_fix",
            f"brings no fix: AUVs stay at {plain(shallowest)} m and deeper, and are at the surface "
            f"down to {plain(receiver.depth_m)} m; give auvs.route.surface_every_s, or remove it",
            ("auvs.route.surface_every_s", "survey.depth_m"),
        )


def sonar(setup: Setup) -> Iterator[Problem]:
    """Yield settings of a sonar that do nothing here."""
    scenario = setup.scenario
    settings, model = scenario.acoustics.hf.channel.settings, scenario.usbl.model
    if "timing" in settings and not setup.instrument.times_arrivals:
        yield Problem(
            "acoustics.hf.channel.timing",
            f"has no effect with usbl.model: {model} (how directions err is said there, arrivals "
            "at an array are not timed); remove it",
            ("usbl.model",),
        )
    if scenario.acoustics.hf.traits.has_echoes and scenario.protocol.asvs_ping:
        for name in {"bottom_m", "surface_sd_m", "transducer_m"} & settings.keys():
            yield Problem(
                f"acoustics.hf.channel.{name}",
                f"has no effect with protocol.ranging: {scenario.protocol.ranging} (the pings of "
                "ASVs have no echoes); remove it",
                ("protocol.ranging",),
            )


LEVELS = ("source_level_db", "directivity_index_db", "wind_m_per_s", "shipping", "own_noise_db")


def levels(setup: Setup) -> Iterator[Problem]:
    """Yield settings of channels with levels that another of their settings leaves out."""
    scenario = setup.scenario
    for band, section in scenario.acoustics.bands.items():
        if not section.traits.has_levels:
            continue
        given = section.channel.settings
        decoding = given.get("decoding", "threshold")
        for name, chooser, chosen, idle in (
            ("ph", "absorption", given.get("absorption"), given.get("absorption") == "thorp"),
            ("false_alarm", "decoding", decoding, decoding not in MATCHED_FILTERS),
        ):
            if idle and name in given:
                yield Problem(
                    f"acoustics.{band}.channel.{name}",
                    f"has no effect with {chooser}: {chosen}; remove it",
                    (f"acoustics.{band}.channel.{chooser}",),
                )
        relative = decoding == "threshold" and given.get("snr_threshold_db") is None
        relative &= given.get("capture_db") is None
        relative &= given.get("timing", "constant") == "constant"
        for name in LEVELS if relative else ():
            if name not in given:
                continue
            yield Problem(
                f"acoustics.{band}.channel.{name}",
                f"{'has no effect' if band == 'mf' else 'changes only the SNR that is told'} with "
                "snr_threshold_db: null (the threshold is then the SNR at range_m, whatever that "
                "is); give snr_threshold_db, or remove it",
                (f"acoustics.{band}.channel.snr_threshold_db",),
            )


def bursts(setup: Setup) -> Iterator[Problem]:
    """Yield how long losses last where nothing is lost."""
    scenario = setup.scenario
    hf, mf = scenario.acoustics.hf, scenario.acoustics.mf
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
        law = scenario.acoustics.loss.law
        yield Problem(
            "acoustics.hf.channel.burst_s",
            f"has no effect with acoustics.loss.law: {law} over acoustics.hf.range_m: "
            f"{plain(hf.range_m)} (no ping is lost on its way); remove it",
            ("acoustics.loss.law", "acoustics.hf.range_m"),
        )


def cast(setup: Setup) -> Iterator[Problem]:
    """Yield a law of sound speed where the cast says what it is."""
    scenario = setup.scenario
    water = scenario.environment
    if water.ctd is None or "sound_speed_law" not in water.model_fields_set:
        return
    from ..sea.water_column import read_cast  # needs numpy, which few scenarios wait for here

    if water.sound_speed_law != USUAL_LAW and read_cast(water.ctd).speeds_m_per_s is not None:
        yield Problem(
            "environment.sound_speed_law",
            "has no effect on a CTD profile that has speeds of sound itself; remove it",
            ("environment.ctd",),
        )


STEERING = tuple(
    f"auvs.{name}"
    for name in (
        "vehicle.turning_radius_m", "join_angle_deg", "launch_m", "recovery_m",
    )
)  # fmt: skip


RULES = (
    *PROTOCOL,
    Idle({"auvs.route.kind": ("hold",)}, STEERING, "the AUVs lie still"),
    Idle({"auvs.route.kind": ("track",)}, STEERING, "the AUVs repeat their tracks"),
    Idle(
        {"auvs.route.kind": ("hold", "track")},
        ("auvs.speed_m_per_s", "auvs.speeds_m_per_s"),
        "the AUVs lie still, or repeat their tracks",
    ),
    Idle(
        {
            "auvs.route.kind": ("track",),
            "environment.temperature_c": (None,),
            "environment.ctd": (None,),
        },
        ("survey.depth_m", "survey.depths_m"),
        "the tracks say how deep they are",
        but=lambda setup: setup.some_tracks_lack_depths,
    ),
    Idle(
        {"auvs.route.kind": ("hold", "waypoints", "track")},
        ("survey.rotation_deg",),
        "the AUVs go where their route says, whichever way the survey is turned",
        "changes only what counts as survey",
    ),
    Idle({"survey.depths_m": GIVEN}, ("survey.depth_m",), "each AUV has a depth of its own"),
    Idle({"auvs.speeds_m_per_s": GIVEN}, ("auvs.speed_m_per_s",), "each AUV has its own speed"),
    Idle({"auvs.launch_m": GIVEN}, ("auvs.route.start",), "the AUVs begin where they are launched"),
    Idle(
        {"acoustics.mf.airtimes": GIVEN},
        ("acoustics.mf.bit_rate_bps", "acoustics.mf.overhead"),
        "airtimes are those of the table",
    ),
    Idle(
        {"acoustics.mf.payload_bytes": (None,), "acoustics.mf.airtimes": (None,)},
        ("acoustics.mf.overfull",),
        "a message holds any number of fixes",
    ),
    *(
        Idle(
            mode,
            ("acoustics.mf.payload_bytes", "acoustics.mf.overfull"),
            "no broadcast has more than one fix",
        )
        for mode in ({"protocol.schedule": FRAMED}, {"auvs.count": (1,)})
    ),
    *(
        Idle(
            {f"acoustics.{band}.transmit_w": (None,)},
            (f"acoustics.{band}.receive_w", f"acoustics.{band}.idle_w"),
            "the energy of this band is reported where all its powers are known",
        )
        for band in ("hf", "mf")
    ),
    Idle(
        {"acoustics.hf.channel": OWN},
        tuple(f"acoustics.loss.{name}" for name in ("law", "combine", "contention_per_auv", "cap")),
        "how likely signals are lost only the plug-in says",
    ),
    Idle(
        {"acoustics.hf.channel": names(declared.CHANNELS, lambda traits: not traits.ends_at_range)},
        tuple(f"acoustics.loss.{name}" for name in ("law", "combine", "contention_per_auv", "cap")),
        "the law of the disc's loss; this channel says itself how likely signals are lost",
    ),
    Idle(
        {"acoustics.mf.channel": names(declared.CHANNELS, lambda traits: traits.reach_of_its_own)},
        ("acoustics.mf.range_m", "acoustics.mf.range_metric"),
        "the curve says how far frames are decoded",
    ),
    Idle(
        {"acoustics.loss.combine": ("off",)},
        ("acoustics.loss.contention_per_auv",),
        "the loss is that of the range alone",
    ),
    Idle(
        {"acoustics.loss.combine": ("off",), "protocol.ranging": OWN_CLOCKS},
        ("acoustics.loss.cap",),
        "the loss is that of the range alone",
        but=calls,
    ),
    Idle(
        {"record.detail": ("summary",)},
        ("record.tracks_hz", "navigation.depth_sd_m"),
        "no tracks are kept, and depths stand in tracks alone",
    ),
    Idle(
        {"asvs.count": (1,)},
        tuple(f"asvs.formation.{name}" for name in ("angle_deg", "clearance_m", "radius_m")),
        "a single ASV lies at the centre",
    ),
    *(
        Idle(
            {"asvs.formation.model": ("assign", "zigzag"), few: (1,)},
            ("asvs.formation.hysteresis",),
            "there is one way to split the AUVs",
        )
        for few in ("asvs.count", "auvs.count")
    ),
    Idle(
        {"asvs.formation.model": ("follow", "assign"), "auvs.route.kind": ("hold",)},
        ("asvs.formation.horizon_s",),
        "the AUVs lie still",
    ),
    Idle({"asvs.count": (1,)}, ("protocol.broadcaster",), "there is no other ASV"),
    Idle(
        {"protocol.acknowledge": ("none", "ping")},
        ("protocol.acknowledgement_bytes",),
        "AUVs send no frame to acknowledge",
    ),
    Idle(
        {"auvs.count": (1,)},
        ("acoustics.loss.contention_per_auv", "acoustics.loss.combine"),
        "there is no other AUV",
    ),
    Idle({"auvs.count": (1,)}, ("protocol.conflict_margin_m",), "there is no other AUV"),
    Idle(
        {"auvs.count": (1,), "protocol.ranging": OWN_CLOCKS},
        ("protocol.positions",),
        "there is no other AUV",
        but=times_by_place,
    ),
    Idle(
        {"auvs.route.surface_every_s": (None,)},
        ("auvs.route.surface_for_s", "auvs.route.climb_angle_deg"),
        "the AUVs stay at their depth",
    ),
    Idle(
        {"environment.temperature_c": (None,)},
        ("environment.salinity_psu",),
        "only with a temperature does the speed of sound follow from it",
    ),
    Idle(
        {"environment.temperature_c": (None,), "environment.ctd": (None,)},
        ("environment.sound_speed_law",),
        "the speed of sound is given",
    ),
    Idle(
        {"environment.current_m_per_s": (0.0,)},
        ("environment.current_direction_deg",),
        "there is no mean current",
    ),
    Idle(
        {"environment.current_variation_m_per_s": (0.0,)},
        ("environment.current_variation_time_s",),
        "the current does not vary",
    ),
    Idle(
        {
            "survey.depth_m": (0.0,),
            "auvs.route.kind": ("lawnmower", "waypoints", "hold"),
        },
        ("acoustics.hf.range_metric", "acoustics.mf.range_metric"),
        "AUVs at the surface are as far as they look from above",
    ),
    *MEASURING,
    *KNOWLEDGE,
)


def idle_keys(setup: Setup) -> Iterator[Problem]:
    """Yield the keys that somebody has set and that do nothing, each told once."""
    scenario = setup.scenario
    seen: set[str] = set()
    wholly_dumped = _is_whole(scenario)
    for rule in RULES:
        if not all(_value(scenario, key) in values for key, values in rule.mode.items()):
            continue
        given = [key for key in rule.keys if _is_given(scenario, key, but_defaults=wholly_dumped)]
        if not given or rule.but(setup):
            continue
        for key in given:
            if key not in seen:
                seen.add(key)
                yield Problem(key, f"{rule.effect} {_with(scenario, rule)}", tuple(rule.mode))


def _with(scenario: Scenario, rule: Idle) -> str:
    chosen = ", ".join(f"{key}: {plain(_value(scenario, key))}" for key in rule.mode)
    return f"with {chosen} ({rule.why}); {rule.remedy}"


def _value(scenario: Scenario, key: str) -> Any:
    """Return the value of a dotted key, of a vehicle its model; None where there is no such key."""
    value: Any = scenario
    for name in key.split("."):
        if isinstance(value, PartChoice):
            return _setting(key.removesuffix(f".{name}"), value, name)
        value = getattr(value, name, None)
    return value.model if isinstance(value, VehicleChoice) else value


def _setting(key: str, part: PartChoice, name: str) -> Any:
    """Return the value of a setting of the part that is chosen at a key; None where it has none."""
    model = next(family.settings for family in FAMILIES if family.key == key).get(str(part))
    field = model.model_fields.get(name) if model else None
    return part.settings.get(name, field.default if field else None)


def _is_given(scenario: Scenario, key: str, *, but_defaults: bool) -> bool:
    """Tell whether somebody has set a key; `but_defaults`: to another value than its default."""
    part: Any = scenario
    *sections, last = key.split(".")
    for name in sections:
        if part is None or name not in part.model_fields_set:
            return False
        part = getattr(part, name)
    if part is None:
        return False
    choice = part.choice if isinstance(part, VehicleChoice) else part
    if isinstance(choice, PartChoice):
        return last in choice.settings
    if last not in part.model_fields_set or last not in type(part).model_fields:
        return False
    return not but_defaults or getattr(part, last) != type(part).model_fields[last].default


def _is_whole(part: Part) -> bool:
    """Tell whether every key is set, as where a scenario was written out by the program itself."""
    values = [getattr(part, name) for name in type(part).model_fields]
    return part.model_fields_set == set(type(part).model_fields) and all(
        _is_whole(value) for value in values if isinstance(value, Part)
    )
