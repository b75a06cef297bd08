"""Warnings about a scenario, each with its numbers and at its line of the file.

Nothing here is wrong: the mission runs as described, but perhaps not as meant.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.scenario.files.scenario_file import Source
from ...core.scenario.measured import read_measured
from ...core.scenario.own_sensors import MOST_TOLD
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...models.presets.modems import airtime_table
from ...support.mistakes import Mistake, Problem, ScenarioWarning
from ...support.plugins import is_plugin, refusal
from . import band_warnings as bands
from . import idle_keys as idle
from . import whereabouts as places
from .refusals import perhaps_carried_away, usable


def failing(setup: Setup) -> Iterator[Problem]:
    """Yield failures without effect, and instants from which no ASV works, or that none exists."""
    scenario = setup.scenario
    end, seen = float(scenario.duration_s), set[float]()  # several ASVs may fail at one instant
    if not (scenario.asvs.count or scenario.navigation.gnss_fix or scenario.has_peers):
        yield Problem(
            "asvs.count",
            "is 0: no round begins, and AUVs keep to dead reckoning; let them come up to fix "
            "(navigation.gnss_fix, auvs.route.surface_every_s), or range each other "
            "(navigation.peers), if they are not to drift",
        )
    for number, failure in enumerate(scenario.asvs.failures):
        key = f"asvs.failures.{number}.at_s"
        if failure.at_s >= end:
            yield Problem(
                key,
                f"has no effect: it is for {failure.at_s:g} s, and the mission ends at {end:g} s; "
                "remove it",
                ("duration_s",),
            )
        elif failure.at_s not in seen and not any(scenario.asvs.alive(failure.at_s)):
            seen.add(failure.at_s)
            yield Problem(
                key,
                f"leaves no ASV at {failure.at_s:g} s: until one works again nobody begins a "
                "round, and AUVs keep to dead reckoning",
                ("asvs.count",),
            )


# Means over fewer samples than this are poor.
FEWEST_SAMPLES = 10


def warnings_of(scenario: Scenario) -> list[ScenarioWarning]:
    """Return warnings about a scenario, to be read before its results are trusted.

    >>> small = {"name": "m", "survey": {"side_m": 60}, "acoustics": {"hf": {"range_m": 50}}}
    >>> print(warnings_of(Scenario.model_validate(small))[0])  # doctest: +ELLIPSIS
    asvs.formation.radius_m: is by default hf.range_m + clearance_m = 50 m, ...
    """
    setup = Setup.of(scenario)
    return [ScenarioWarning(*problem) for look in _LOOKS for problem in look(setup)]


def _left_out(setup: Setup) -> Iterator[Problem]:
    """Yield rows of files that are ignored."""
    for key, read, *source in _readings(setup):
        with suppress(ValueError):  # reported as a mistake
            for told in read(*source).left_out:
                yield Problem(key, told)


def _readings(setup: Setup) -> Iterator[tuple[Any, ...]]:
    """Yield for each file with rows its key, the function that reads it, and that function's
    arguments.
    """
    scenario = setup.scenario
    surface_m = scenario.environment.surface_m
    routes = [(wing.key, wing.asked.recording) for wing in setup.wings]
    for section, asked in (*routes, ("asvs.formation", scenario.asvs.formation.recording)):
        for number, source in enumerate(asked.sources if asked else ()):
            from ...models.charts.recordings import read_recording  # brings numpy, as tracks do

            yield f"{section}.files.{number}", read_recording, *source, surface_m
    if scenario.environment.ctd is not None:
        from ...core.sea.water_column import read_cast

        yield "environment.ctd", read_cast, scenario.environment.ctd
    acoustics = scenario.acoustics
    for name, channel in (("hf", acoustics.hf.channel), ("mf", acoustics.mf.channel)):
        if "file" in channel.settings and not is_plugin(str(channel)):
            yield f"acoustics.{name}.channel.file", read_measured, channel.settings["file"]
    if acoustics.mf.airtimes is not None:
        yield "acoustics.mf.airtimes", airtime_table, acoustics.mf.airtimes


def _former_words(setup: Setup) -> Iterator[Problem]:
    positions = setup.scenario.protocol.positions
    if written := getattr(positions, "written", ""):
        yield Problem(
            "protocol.positions",
            f"{written!r} is the former name of {str(positions)!r}, the last fix as it "
            "was made; write that, or 'carried_forward' for the fix carried on by planned course "
            "and speed",
        )


def _spacing_m(array: Sequence[Sequence[float]]) -> float:
    """Return the largest distance (m) from an element to its nearest neighbour."""
    return max(
        min(math.dist(one, other) for there, other in enumerate(array) if there != here)
        for here, one in enumerate(array)
    )


def _lobes(setup: Setup) -> Iterator[Problem]:
    """Yield elements so far apart that phases alone leave directions ambiguous."""
    scenario = setup.scenario
    hf = scenario.acoustics.hf
    for vessels in setup.vessels if hf.traits.has_levels else ():
        if not vessels.is_first_with_usbl or (array := vessels.timed_array) is None:
            continue
        wave_m = scenario.environment.sound_speed_m_per_s / (1e3 * hf.frequency_khz)
        if (apart := _spacing_m(array)) <= wave_m / 2:
            continue
        yield Problem(
            vessels.key("usbl.array"),
            f"has an element {1e3 * apart:.0f} mm from the nearest other, more than half a "
            f"wavelength ({1e3 * wave_m / 2:.0f} mm): an instrument that compares phases would "
            "take some directions for others (grating lobes); here times of arrival are compared, "
            "as of a wideband ping, and are not ambiguous",
            ("acoustics.hf.channel.frequency_khz",),
        )


# Directions more than so many standard deviations off the plane are not confused with their mirror.
SURE = 3.0


def _installation(setup: Setup) -> Iterator[Problem]:
    """Yield errors of compass, GNSS and mounting that neither preset nor user gives."""
    for vessels in setup.vessels:
        usbl = vessels.usbl
        if not vessels.is_first_with_usbl or not (perfect := usbl.taken_for_perfect):
            continue
        which = ", ".join(f"{what} ({' or '.join(keys)})" for what, keys in perfect.items())
        yield Problem(
            vessels.key("usbl.preset"),
            f"{usbl.preset}: its sheet says nothing of what it is installed with, which is taken "
            f"to be perfect: {which}; give what yours err by, or 0",
            tuple(f"usbl.{key}" for keys in perfect.values() for key in keys),
        )


def _flat(setup: Setup) -> Iterator[Problem]:
    """Yield that an array is so thin that AUVs near its plane are confused with their mirror
    images.

    Along the thin axis w, a direction s is measured by s.w, with an sd of sigma / sqrt(a); sigma is
    the noise of an element (m), a and b the least and greatest eigenvalue of the scatter matrix.
    The wide axes measure |s.w|, since s has length 1: with weight b (s.w)^2, more than a where
    |s.w| > sqrt(a / b).  If noise alone reaches that, 3 sigma sqrt(b) > a, the covariance is that
    of |s.w|, and its sign is a guess where |s.w| < 3 sigma / sqrt(a).
    """
    for vessels in setup.vessels:
        if not vessels.is_first_with_usbl or (array := vessels.timed_array) is None:
            continue
        import numpy as np

        scenario, noise_s = setup.scenario, vessels.usbl.tdoa_sd_s
        places = np.array(array) - np.mean(array, axis=0)
        squares, axes = np.linalg.eigh(places.T @ places)
        sigma = scenario.environment.sound_speed_m_per_s * noise_s / math.sqrt(2.0)
        if SURE * sigma * math.sqrt(squares[2]) <= squares[0]:
            continue
        flat = math.asin(min(SURE * sigma / math.sqrt(squares[0]), 1.0))
        depth = min(auv.depth_m for auv in setup.auvs)
        hf = scenario.acoustics.hf
        down = math.asin(min(depth / hf.longest_path_m(depth), 1.0))
        tilt = math.acos(min(abs(axes[2, 0]), 1.0))  # of the thin axis from the vertical
        if down - tilt >= flat:
            continue
        thick = np.ptp(places @ axes[:, 0])
        needed = thick * math.sqrt(SURE * sigma * math.sqrt(squares[2]) / squares[0])
        noise = vessels.key("usbl.tdoa_sd_s")
        yield Problem(
            vessels.key("usbl.array"),
            f"is {1e3 * thick:.2g} mm thick, too little for {noise} of {noise_s:.2g} s: AUVs less "
            f"than {math.degrees(flat):.2g} degrees off its plane (they are seen down to "
            f"{math.degrees(down):.2g} degrees below the horizon) may be taken for their mirror "
            "images, of which covariances of fixes know nothing; make it "
            f"{1e3 * needed:.2g} mm thick, and trust no z of fixes so near that plane",
            (noise, "survey.depth_m", "acoustics.hf.range_m"),
        )


def _dissemination(setup: Setup) -> Iterator[Problem]:
    """Yield lasting errors of ASVs that a filter treats as noise, since there are too many ASVs."""
    if not setup.scenario.navigation.weighs:
        return
    keys = {
        "misalignment": "misalignment_sd_deg",
        "gnss": "gnss_correlated_sd_m",
        "slow": "slow_share",
    }
    for kind in setup.lasting_errors:
        if kind.times > MOST_TOLD:
            yield Problem(
                f"usbl.{keys[kind.name]}",
                f"counts as noise of each fix, so that the filter will be too sure: it models "
                f"each ASV's own errors with up to {MOST_TOLD} ASVs, not with {kind.times}",
                ("asvs.count", "navigation.filter"),
            )


def _frames(setup: Setup) -> Iterator[Problem]:
    scenario = setup.scenario
    protocol = scenario.protocol
    if not setup.schedule.framed or protocol.asvs_ping:
        return
    from .round_lengths import rounds_of  # brings the whole protocol, which others do not need

    rounds = rounds_of(setup)
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
        ("protocol.downlink", *places.shapes(scenario), "protocol.schedule"),
    )


def _ticks(setup: Setup) -> Iterator[Problem]:
    rate = setup.scenario.protocol.tick_rate_hz
    if rate is None or rate >= 1.0:
        return
    from .round_lengths import rounds_of

    slot = rounds_of(setup).slots.uplink_slot
    if slot * rate < 1.0:
        yield Problem(
            "protocol.tick_rate_hz",
            f"ticks of {1 / rate:.4g} s make the uplink slot of {slot:.3g} s as long as a tick",
        )


def _samples(setup: Setup) -> Iterator[Problem]:
    scenario = setup.scenario
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


# The checks, in the order of their warnings
_LOOKS: tuple[Callable[[Setup], Iterator[Problem]], ...] = (
    *(_former_words, bands.believed, bands.modems, bands.overheads, bands.deliveries),
    *(bands.tables, bands.echoes, bands.messages, bands.last_slots, bands.answers),
    *(bands.backlog, bands.guards, places.formation, places.deep, bands.steep),
    *(bands.frames, places.anchors, failing, _dissemination, idle.sheet),
    *(_lobes, _flat, _installation),
    *(
        idle.sonar,
        idle.receivers,
        idle.levels,
        idle.bursts,
        bands.shifts,
        idle.cast,
        idle.above_ground,
    ),
    *(
        places.routes,
        places.idle,
        places.tired,
        places.leaving,
        places.low,
        places.tracks,
        places.ashore,
        perhaps_carried_away,
    ),
    *(_left_out, _frames, _ticks, _samples, idle.idle_keys, idle.overruled),
)


@dataclass(frozen=True)
class Reading:
    """A scenario read from a file, and the warnings about it, each at its line.

    `about` holds the keys of each warning, first the one at which it is reported.  `unloaded` are
    the plug-ins that the scenario names and that were not loaded, each at its line.
    """

    scenario: Scenario
    warnings: tuple[Mistake, ...]
    about: tuple[tuple[str, ...], ...]
    unloaded: tuple[Mistake, ...] = ()

    @property
    def setup(self) -> Setup:
        """The facts of the scenario."""
        return Setup.of(self.scenario)


def read_scenario(
    source: str | Path | Source, *, overrides: Sequence[str] = (), allow_plugins: bool = False
) -> Reading:
    """Read a scenario file, or its text, as `load_scenario` does; return its warnings, too.

    Raises:
        ScenarioError: listing every mistake, when the file cannot be read or used.
    """
    source = source if isinstance(source, Source) else Source.file(source, overrides)
    document, scenario = usable(source, allow_plugins)
    problems = dict.fromkeys(warnings_of(scenario))  # each once
    told = [(document.mistake(problem), problem) for problem in problems]
    told.sort(key=lambda pair: (pair[0].file != source.name, pair[0].line))
    warnings = (*document.warnings, *(mistake for mistake, _ in told))
    about = (
        *((warning.key,) for warning in document.warnings),
        *((problem.key, *problem.others) for _, problem in told),
    )
    plugins = {} if allow_plugins else scenario.plugins
    unloaded = [document.mistake(Problem(key, refusal(name))) for key, name in plugins.items()]
    return Reading(scenario, warnings, about, tuple(unloaded))
