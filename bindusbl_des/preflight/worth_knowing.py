"""What a scenario leaves unsaid though it changes the answers: warnings, each with its numbers.

Nothing here is wrong: the mission runs as it is described, but perhaps not as it was meant.
"""

import math
from collections.abc import Iterator, Sequence

from ..scenario.consistency import FRAMED_SCHEDULES, Problem
from ..scenario.instruments.lasting_kinds import MOST_TOLD, kinds
from ..scenario.key_types import Renamed
from ..scenario.places.on_earth import positioned, recorded_track
from ..scenario.scenario import Scenario
from ..scenario.sections.anchors import Placed
from ..scenario.sections.environment import Environment
from ..scenario.sections.routes import Hold, Waypoints
from ..scenario.sections.vehicles import Formation
from ..scenario.survey_area import area_of
from .failing import failing
from .idle_keys import idle_keys
from .messages import believed, guards, messages, modems

# Vehicles of which the same is to be said are named up to so many.
MOST_NAMED = 5

# Means over fewer samples than this say little.
FEWEST_SAMPLES = 10

# Channels of the HF band that tell how much louder than the noise a ping is
WITH_SNR = ("sonar", "table")
MATCHED_FILTERS = ("non_coherent", "coherent", "rayleigh")
USUAL_LAW = Environment.model_fields["sound_speed_law"].default

# Instants at which a track is looked at, to tell for how long it is outside the survey.
LOOKS = 2001


class Caution(Problem):
    """Something worth knowing about a key: the key, what is to be known, and the keys behind it."""

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


def cautions(scenario: Scenario) -> list[Caution]:
    """Return what is worth knowing about a scenario before its results are believed.

    >>> small = {"name": "m", "survey": {"side_m": 60}, "acoustics": {"hf": {"range_m": 50}}}
    >>> print(cautions(Scenario.model_validate(small))[0])  # doctest: +ELLIPSIS
    asvs.formation.radius_m: is by default hf.range_m + clearance_m = 50 m, ...
    """
    return [
        Caution(*found)
        for look in (
            _former_words,
            believed,
            modems,
            messages,
            guards,
            _formation,
            _anchors,
            failing,
            _told,
            _sheet,
            _sonar,
            _levels,
            _cast,
            _route,
            _tracks,
            _frames,
            _ticks,
            _samples,
        )
        for found in look(scenario)
    ] + [Caution(*found) for found in idle_keys(scenario)]


def _former_words(scenario: Scenario) -> Iterator[Problem]:
    positions = scenario.protocol.positions
    if isinstance(positions, Renamed):
        yield Problem(
            "protocol.positions",
            f"{positions.written!r} is the former name of {str(positions)!r}, the last fix as it "
            "was made; write that, or 'carried_forward' for the fix carried on by planned course "
            "and speed",
        )


def _formation(scenario: Scenario) -> Iterator[Problem]:
    asked, count = scenario.asvs.formation, scenario.asvs.count
    if not isinstance(asked, Formation):
        return
    if asked.is_placed or asked.radius_m is not None or count == 1:
        return
    # `planned` says the same, with numpy, for which `validate` does not wait
    radius, area = scenario.acoustics.hf.range_m + asked.clearance_m, area_of(scenario)
    angles = [math.radians(asked.angle_deg) + math.tau * asv / count for asv in range(count)]
    x, y = area.centroid
    beyond = [area.beyond(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]
    outside = sum(excess > 1e-9 * radius for excess in beyond)
    if outside:
        edge = f" ({area.side / 2:g} m from the centre)" if area.side else ""
        yield Problem(
            "asvs.formation.radius_m",
            f"is by default hf.range_m + clearance_m = {radius:g} m, which puts {outside} of "
            f"{count} ASVs outside the survey, up to {max(beyond):.3g} m beyond its edge"
            f"{edge}; set it to have them elsewhere",
            ("asvs.formation.clearance_m", "acoustics.hf.range_m", *_shapes(scenario)),
        )


def _anchors(scenario: Scenario) -> Iterator[Problem]:
    """Yield what keeps ASVs that are placed anew from being where AUVs are."""
    asked, auvs = scenario.asvs.formation, scenario.auvs
    if not isinstance(asked, Placed):
        return
    if scenario.protocol.is_passive:
        yield Problem(
            "asvs.formation.model",
            f"{asked.MODEL} goes by what is planned alone: with passive ranging AUVs fix "
            "themselves, and the fleet knows of no fix",
            ("protocol.ranging",),
        )
    fastest = max(auvs.speeds)
    if auvs.route.kind in ("lawnmower", "waypoints") and asked.speed_m_per_s < fastest:
        yield Problem(
            "asvs.formation.speed_m_per_s",
            f"is {asked.speed_m_per_s:g} m/s and AUVs go at {fastest:g} m/s: ASVs fall behind on "
            "every lane",
            ("auvs.speed_m_per_s", "auvs.speeds_m_per_s"),
        )


def _shapes(scenario: Scenario) -> list[str]:
    return [f"survey.{name}" for name in scenario.survey.shapes]


def _told(scenario: Scenario) -> Iterator[Problem]:
    """Yield which errors of ASVs a filter takes for noise, because these are too many."""
    if not scenario.navigation.weighs:
        return
    keys = {"misalignment": "misalignment_sd_deg", "gnss": "gnss_correlated_sd_m"}
    for kind in kinds(scenario):
        if kind.times > MOST_TOLD:
            yield Problem(
                f"usbl.{keys[kind.name]}",
                f"counts as noise of each fix, so that the filter will be too sure: it is told of "
                f"each ASV's own errors with up to {MOST_TOLD} ASVs, not with {kind.times}",
                ("asvs.count", "navigation.filter"),
            )


def _sheet(scenario: Scenario) -> Iterator[Problem]:
    """Yield what a USBL's sheet says of signal-to-noise ratios where there are none."""
    channel = scenario.acoustics.hf.channel
    if "reference_snr_db" in scenario.usbl.model.settings and channel not in WITH_SNR:
        yield Problem(
            "usbl.model.reference_snr_db",
            f"has no effect with acoustics.hf.channel: {channel} (it tells of no signal-to-noise "
            "ratio, angles are as stated); remove it",
            ("acoustics.hf.channel",),
        )


def _sonar(scenario: Scenario) -> Iterator[Problem]:
    """Yield settings of a sonar that do nothing here."""
    settings, model = scenario.acoustics.hf.channel.settings, scenario.usbl.model
    if "timing" in settings and model != "array":
        yield Problem(
            "acoustics.hf.channel.timing",
            f"has no effect with usbl.model: {model} (how directions err is said there, arrivals "
            "at an array are not timed); remove it",
            ("usbl.model",),
        )
    if scenario.acoustics.hf.channel == "sonar" and scenario.protocol.is_passive:
        for name in {"bottom_m", "surface_sd_m", "transducer_m"} & settings.keys():
            yield Problem(
                f"acoustics.hf.channel.{name}",
                "has no effect with protocol.ranging: passive (the pings of ASVs have no echoes); "
                "remove it",
                ("protocol.ranging",),
            )


def _levels(scenario: Scenario) -> Iterator[Problem]:
    """Yield settings of channels with levels that another of their settings leaves out."""
    for band in ("hf", "mf"):
        channel = getattr(scenario.acoustics, band).channel
        if channel not in WITH_SNR:
            continue
        given = channel.settings
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


def _cast(scenario: Scenario) -> Iterator[Problem]:
    """Yield a law of sound speed where the cast says what it is."""
    water = scenario.environment
    if water.ctd is None or "sound_speed_law" not in water.model_fields_set:
        return
    from ..sea.cast import read_cast  # needs numpy, which few scenarios wait for here

    if water.sound_speed_law != USUAL_LAW and read_cast(water.ctd).speeds_m_per_s is not None:
        yield Problem(
            "environment.sound_speed_law",
            "has no effect on a cast that has speeds of sound itself; remove it",
            ("environment.ctd",),
        )


def _route(scenario: Scenario) -> Iterator[Problem]:
    """Yield which AUVs have places to go to or to hold outside the survey."""
    route, area = scenario.auvs.route, area_of(scenario)
    if isinstance(route, Hold):
        key = "positions_deg" if route.positions_deg else "positions_m"
        plans = [[place] for place in positioned(scenario, route).positions_m]
    elif isinstance(route, Waypoints):
        key = "points_deg" if route.points_deg else "points_m"
        plans = [list(points) for points in positioned(scenario, route).points_m]
    else:
        return
    beyond = {auv: max(area.beyond(x, y) for x, y in plan) for auv, plan in enumerate(plans)}
    outside = {auv: excess for auv, excess in beyond.items() if excess > 0.0}
    if outside:
        yield Problem(
            f"auvs.route.{key}",
            f"{_named(list(outside))} outside the survey of {area.told}, up to "
            f"{max(outside.values()):.3g} m beyond its edge; slots are made for sound that crosses "
            "the survey",
            tuple(_shapes(scenario)),
        )


def _named(auvs: Sequence[int]) -> str:
    names = [f"AUV{auv}" for auv in auvs[:MOST_NAMED]]
    if len(auvs) > MOST_NAMED:
        return f"{', '.join(names)} and {len(auvs) - MOST_NAMED} more are"
    return f"{', '.join(names)} {'is' if len(auvs) == 1 else 'are'}"


def _tracks(scenario: Scenario) -> Iterator[Problem]:
    route = scenario.auvs.route
    if route.kind != "track":
        return
    import numpy as np  # which other routes do not need

    area, duration = area_of(scenario), scenario.duration_s
    instants = np.linspace(0.0, duration, LOOKS)
    late: dict[int, float] = {}
    early: dict[int, float] = {}
    outside: dict[int, tuple[float, float]] = {}
    for auv in range(len(route.files)):
        try:
            times, places = recorded_track(scenario, route, auv)
        except ValueError:
            continue  # which is told as a mistake
        late[auv], early[auv] = max(times[0], 0.0), max(duration - times[-1], 0.0)
        ways = [np.interp(instants, times, places[:, axis]) for axis in (0, 1)]
        beyond = np.array([area.beyond(x, y) for x, y in zip(*ways, strict=True)])
        outside[auv] = float(beyond.max()), float(np.mean(beyond > 0.0))
    yield from _standing("begins late", "first", late, duration)
    yield from _standing("ends early", "last", early, duration)
    away = {auv: it for auv, it in outside.items() if it[0] > 0.0}
    for auv, (excess, share) in list(away.items())[:MOST_NAMED]:
        yield Problem(
            f"auvs.route.files.{auv}",
            f"the track of AUV{auv} leaves the survey of {area.told}, by up to {excess:.3g} m "
            f"and for {100 * share:.2g} % of the mission{_more(away)}; slots are made for sound "
            "that crosses the survey",
            tuple(_shapes(scenario)),
        )


def _standing(what: str, when: str, still: dict[int, float], duration: float) -> Iterator[Problem]:
    """Yield whose tracks leave them standing still for a while (s), and how long."""
    found = {auv: time for auv, time in still.items() if time > 0.0}
    for auv, time in list(found.items())[:MOST_NAMED]:
        yield Problem(
            f"auvs.route.files.{auv}",
            f"the track of AUV{auv} {what}: it lies still for the {when} {time:.4g} s of "
            f"{duration:g} s ({100 * time / duration:.2g} %){_more(found)}",
            ("duration_s", "auvs.route.time_offset_s"),
        )


def _more(found: dict[int, object] | dict[int, float] | dict[int, tuple[float, float]]) -> str:
    left = len(found) - MOST_NAMED
    return f", as do {left} more" if left > 0 else ""


def _frames(scenario: Scenario) -> Iterator[Problem]:
    protocol = scenario.protocol
    if protocol.schedule not in FRAMED_SCHEDULES or protocol.is_passive:
        return
    from .round_lengths import rounds_of  # brings the whole protocol, which others do not need

    rounds = rounds_of(scenario)
    frame, count = protocol.frame_s, scenario.auvs.count
    empty, full = rounds.length(1, 0), rounds.length(1, 1)
    if full <= frame or not rounds.are_known:
        return
    if empty > frame:
        consequence = (
            f"which has no effect: each AUV pings every {count * empty:.4g} s, not every "
            f"{count * frame:.4g} s; a frame needs at least {full:.4g} s"
        )
    else:
        consequence = f"the others {empty:.4g} s: after a fix the next frame begins late"
    yield Problem(
        "protocol.frame_s",
        f"a round with a fix takes {full:.4g} s, longer than the frame of {frame:g} s, "
        f"{consequence}",
        ("protocol.downlink", *_shapes(scenario), "protocol.schedule"),
    )


def _ticks(scenario: Scenario) -> Iterator[Problem]:
    rate = scenario.protocol.tick_rate_hz
    if rate is None or rate >= 1.0:
        return
    from .round_lengths import rounds_of

    slot = rounds_of(scenario).slots.uplink_slot
    if slot * rate < 1.0:
        yield Problem(
            "protocol.tick_rate_hz",
            f"ticks of {1 / rate:.4g} s make the uplink slot of {slot:.3g} s as long as a tick",
        )


def _samples(scenario: Scenario) -> Iterator[Problem]:
    count = max(1, math.ceil(scenario.duration_s * scenario.record.metrics_hz))
    if count < FEWEST_SAMPLES:
        instants = "1 instant" if count == 1 else f"{count} instants"
        yield Problem(
            "record.metrics_hz",
            f"time means are of {instants} ({scenario.duration_s:g} s x "
            f"{scenario.record.metrics_hz:g} Hz), the first of them at the start, where nothing "
            "has drifted yet",
            ("duration_s",),
        )
