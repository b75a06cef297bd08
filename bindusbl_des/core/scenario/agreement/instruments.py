"""Rules for water, instruments and the size of a mission: one statement of each, arrays that
resolve.
"""

from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from typing import Any, TypeVar

from ....support.mistakes import Problem
from ....support.wording import did_you_mean, plain
from ..groups import Vessels
from ..part_choice import PartChoice, mistakes
from ..scenario_keys import Environment, ScenarioKeys
from ..sections.usbl import ELEMENTS_OF_NAMED, size_m, usbl_values
from ..site import Site

AnyScenario = TypeVar("AnyScenario", bound=ScenarioKeys)

# The default speed of sound (m/s)
USUAL_SPEED = Environment.model_fields["sound_speed_m_per_s"].default


def water_problems(site: Site) -> Iterator[Problem]:
    """Yield contradictions about the position on Earth, and about the water."""
    yield from _origin(site)
    yield from _water(site)


def _origin(site: Site) -> Iterator[Problem]:
    given = site.scenario.environment.origin
    for name, other in (("lat_deg", "lon_deg"), ("lon_deg", "lat_deg")):
        if getattr(given, name) is not None and getattr(given, other) is None:
            yield Problem(
                f"environment.origin.{name}",
                f"needs {other} as well; add it",
                (f"environment.origin.{other}",),
            )


def _water(site: Site) -> Iterator[Problem]:
    water = site.scenario.environment
    key = "temperature_c" if water.ctd is None else "ctd"
    if getattr(water, key) is None:
        return
    if water.ctd is not None and water.temperature_c is not None:
        yield Problem(
            "environment.ctd",
            "says how warm the water is; remove temperature_c, or the CTD profile",
            ("environment.temperature_c",),
        )
    given, speed = water.model_fields_set, water.sound_speed_m_per_s
    written_out = {"ctd", "temperature_c"} <= given  # by a program, of this version or before
    if speed != USUAL_SPEED or ("sound_speed_m_per_s" in given and not written_out):
        yield Problem(
            "environment.sound_speed_m_per_s",
            f"follows from {key}; keep one of them (assumed_sound_speed_m_per_s is what the fleet "
            "takes it for)",
            (f"environment.{key}",),
        )
    if water.sound_speed_law == "teos10":
        yield from _teos10(site, key)


def _teos10(site: Site, key: str) -> Iterator[Problem]:
    if (place := site.origin_deg) is None:
        yield Problem(
            "environment.sound_speed_law",
            "teos10 needs to know where that is: set environment.origin, or use mackenzie",
            (f"environment.{key}", "environment.origin"),
        )
    elif find_spec("gsw") is None:
        yield Problem(
            "environment.sound_speed_law",
            "teos10 needs the package gsw (pip install 'bindusbl-des[ocean]'); or use mackenzie",
            (f"environment.{key}",),
        )
    else:
        from ...sea.water import SOUTHERNMOST_DEG  # imports numpy, as gsw does

        if place[0] < SOUTHERNMOST_DEG:
            yield Problem(
                "environment.sound_speed_law",
                f"teos10 knows no water south of {-SOUTHERNMOST_DEG:g} deg S; use mackenzie",
                (f"environment.{key}", "environment.origin"),
            )


# Keys that the data sheet of an inertial system replaces, with the values that mean no error
REPLACED_BY_DRIFT = {
    "velocity_bias_m_per_s": (0.0, 0.0),
    "velocity_bias_sd_m_per_s": 0.0,
    "velocity_bias_time_constant_s": None,
    "random_walk_m_per_sqrt_s": 0.0,
}


def instruments_problems(site: Site) -> Iterator[Problem]:
    """Yield contradictions about instruments: USBL, range rates, data sheets, assumed values."""
    for vessels in site.vessels:
        if vessels.is_first_with_usbl:
            yield from _usbl(site, vessels)
    yield from _range_rates(site)
    yield from _drift(site)
    yield from _assumed(site.scenario)


def _range_rates(site: Site) -> Iterator[Problem]:
    usbl, asked = site.scenario.usbl, site.scenario.navigation.filter.settings.get("range_rate")
    if asked is True and usbl.model.is_own:
        yield Problem(
            "navigation.filter.range_rate",
            "needs to know from where ASVs measured, which an instrument of one's own does not "
            "tell; remove it",
            ("usbl.model",),
        )
    if asked is True and usbl.range_rate_sd_m_per_s is None:
        yield Problem(
            "navigation.filter.range_rate",
            "needs range rates, which nobody measures; set usbl.range_rate_sd_m_per_s, or remove "
            "it",
            ("usbl.range_rate_sd_m_per_s",),
        )


def _usbl(site: Site, vessels: Vessels) -> Iterator[Problem]:
    usbl, name, model = vessels.usbl, vessels.usbl.preset, vessels.usbl.model
    if usbl is not site.scenario.usbl:
        yield from _differs(site, vessels)
    if name is not None and model != PartChoice.read(usbl_values(name)["model"], str):
        yield Problem(
            vessels.key("usbl.model"),
            f"is not that of the preset {name}, which says what an arrival measures; keep one of "
            f"them; got {model.words}",
            (vessels.key("usbl.preset"),),
        )
    array, speed = usbl.array, site.scenario.environment.sound_speed_m_per_s
    named = array if isinstance(array, str) else "that is given"
    size, time = size_m(array), usbl.tdoa_sd_s
    if time * speed > size:
        yield Problem(
            vessels.key("usbl.tdoa_sd_s"),
            f"noise of {time:g} s is {time * speed:.3g} m of sound, more than the "
            f"{1e3 * size:.0f} mm of the array {named}: no direction could be "
            f"told; use {0.9 * size / speed:.1e} at most",
            (vessels.key("usbl.array"), "environment.sound_speed_m_per_s"),
        )


def _differs(site: Site, vessels: Vessels) -> Iterator[Problem]:
    """Yield why vessels cannot have a USBL that differs from that of the others."""
    key, scenario = f"asvs.groups.{vessels.number}.usbl", site.scenario
    if site.ranging.asvs_ping:
        yield Problem(
            key,
            f"has no effect with {scenario.protocol.ranging} ranging, where AUVs carry the arrays; "
            "remove it",
            ("protocol.ranging",),
        )
    elif vessels.usbl.model.is_own or scenario.usbl.model.is_own:
        yield Problem(
            key,
            "stands beside an instrument of one's own, which measures for all vessels; keep one of "
            "both",
            ("usbl.model",),
        )
    elif vessels.instrument.times_arrivals:
        sizes = {
            len(group.usbl.array) if not isinstance(group.usbl.array, str) else ELEMENTS_OF_NAMED
            for group in site.vessels
            if group.instrument.times_arrivals
        }
        if len(sizes) > 1:
            yield Problem(
                vessels.key("usbl.array"),
                f"must have as many elements as those of other vessels; they have "
                f"{' and '.join(map(str, sorted(sizes)))}",
                ("usbl.array",),
            )


def _drift(site: Site) -> Iterator[Problem]:
    navigation, drift = site.scenario.navigation, site.scenario.navigation.drift
    if not drift.is_stated:
        return
    stated = "percent_of_distance" if drift.m_per_hour is None else "m_per_hour"
    if drift.percent_of_distance is not None and drift.m_per_hour is not None:
        yield Problem(
            "navigation.drift.m_per_hour",
            "is another statement of the same as percent_of_distance; keep one of them",
            ("navigation.drift.percent_of_distance",),
        )
    for name, none in REPLACED_BY_DRIFT.items():
        if (value := getattr(navigation, name)) != none:
            yield Problem(
                f"navigation.{name}",
                f"is replaced by navigation.drift, which says how far dead reckoning goes astray "
                f"in all; remove it or set it to {plain(none)}; got {plain(value)}",
                (f"navigation.drift.{stated}",),
            )


# Keys that a filter models (lasting errors of dead reckoning and of fixes, the water), and of which
# it may assume other values than the true ones.
ASSUMED = {
    "environment": (
        *("sound_speed_m_per_s", "assumed_sound_speed_m_per_s", "current_m_per_s"),
        *("current_variation_m_per_s", "current_variation_time_s", "current"),
    ),
    "usbl": (
        *("misalignment_sd_deg", "gnss_correlated_sd_m", "gnss_time_constant_s"),
        *("slow_share", "correlation_s"),
    ),
    "navigation": (
        *(*REPLACED_BY_DRIFT, "drift", "scale_factor_sd", "heading_sd_deg"),
        *("initial_position_sd_m", "clock_offset_sd_s", "clock_drift_sd"),
    ),
    "auvs": ("groups",),
}


def assumed_sections(scenario: ScenarioKeys) -> dict[str, Any]:
    """Return the data of the sections of which a filter assumes other values, with these values."""
    assumes: Mapping[str, Any] = scenario.navigation.filter.settings.get("assumes", {})
    return {
        name: _laid_over(getattr(scenario, name).model_dump(mode="json", exclude_unset=True), keys)
        for name, keys in assumes.items()
    }


def _laid_over(data: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return data with some keys replaced; a mapping replaces keys within a section."""
    return {
        **data,
        **{
            name: _laid_over(data.get(name, {}), value) if isinstance(value, Mapping) else value
            for name, value in keys.items()
        },
    }


def _assumed(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield assumptions that a filter cannot make: keys it does not model, values out of range."""
    where, assumes = "navigation.filter.assumes", scenario.navigation.filter.settings.get("assumes")
    if not (isinstance(assumes, Mapping) and scenario.navigation.weighs):
        return
    if not all(isinstance(keys, Mapping) for keys in assumes.values()):
        return  # reported with the settings of the part
    known = [f"{section}.{name}" for section, names in ASSUMED.items() for name in names]
    wrong = [
        f"{section}.{name}"
        for section, keys in assumes.items()
        for name in keys
        if f"{section}.{name}" not in known
    ]
    for asked in wrong:
        hint = did_you_mean(asked, known) or f"; it assumes {', '.join(known)}"
        yield Problem(f"{where}.{asked}", f"is nothing that a filter assumes{hint}")
    if wrong:
        return
    found = [
        Problem(f"{where}.{section}.{name}", message)
        for section, data in assumed_sections(scenario).items()
        for name, message in mistakes(type(getattr(scenario, section)), data, section)
    ]
    yield from found or (
        problem._replace(key=f"{where}.{problem.key}")
        for problem in _drift(Site(taken_for(scenario)))
    )


def taken_for(scenario: AnyScenario) -> AnyScenario:
    """Return the scenario that a filter assumes: its setting `assumes` replaces keys."""
    chosen = scenario.navigation.filter
    if not chosen.settings.get("assumes"):
        return scenario
    taken = {
        name: type(getattr(scenario, name)).model_validate(data)
        for name, data in assumed_sections(scenario).items()
    }
    navigation = taken.get("navigation", scenario.navigation)
    rest = {name: value for name, value in chosen.settings.items() if name != "assumes"}
    told = navigation.model_copy(update={"filter": PartChoice(str(chosen), rest)})
    return scenario.model_copy(update={**taken, "navigation": told})


# More samples than this would exhaust the memory of any workstation.
LARGEST_SAMPLES = 5e8

# The highest rate of samples.
OFTENEST_HZ = 1e3


def sizes_problems(site: Site) -> Iterator[Problem]:
    """Yield rates that record more samples than memory holds, or none at all."""
    begin, rate = site.scenario.record.metrics_from_s, site.scenario.record.metrics_hz
    if begin >= site.scenario.duration_s - 1 / rate and begin > 0:
        left = site.scenario.duration_s - begin
        if left * OFTENEST_HZ >= 2.0:
            message = (
                f"{left:.3g} s are left to judge, and record.metrics_hz takes a sample each "
                f"{1 / rate:.3g} s; set it to {2.0 / left:.3g}, or begin earlier"
            )
        else:
            message = (
                f"nothing is left to judge of {site.scenario.duration_s:g} s from {begin:g} s on; "
                "begin earlier"
            )
        yield Problem("record.metrics_from_s", message, ("duration_s", "record.metrics_hz"))
    vehicles = site.scenario.auvs.count + site.scenario.asvs.count
    for name, rate in (
        ("record.metrics_hz", site.scenario.record.metrics_hz),
        ("record.tracks_hz", site.scenario.record.tracks_hz),
        ("navigation.imu_rate_hz", site.scenario.navigation.imu_rate_hz),
    ):
        samples = site.scenario.duration_s * rate * vehicles
        if samples > LARGEST_SAMPLES:
            yield Problem(
                name,
                f"{samples:.2g} samples ({site.scenario.duration_s:g} s x {rate:g} Hz x {vehicles} "
                f"vehicles) exceed {LARGEST_SAMPLES:.0e}; lower rate, duration or fleet",
                ("duration_s", "auvs.count", "asvs.count"),
            )
