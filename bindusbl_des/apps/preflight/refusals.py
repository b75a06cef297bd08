"""Why a mission cannot begin, found before it is made.

Contradictions between keys are found when the scenario is read.  These checks take longer: at which
speed a hull settles, how often a path surfaces, what a table of rays holds.
"""

from collections.abc import Iterator
from math import cos, exp, radians, sin

from ...core.scenario.files.scenario_file import Source
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.mistakes import Problem, ScenarioError
from ...support.plain_yaml import Document

# One seed in forty draws a mean current beyond so many standard deviations.
SIGMAS = 2.0


def usable(source: Source, allow_plugins: bool = False) -> tuple[Document, Scenario]:
    """Return the scenario of a file whose mission can begin, and its document.

    Raises:
        ScenarioError: listing every mistake.
    """
    document, scenario = source.read(allow_plugins)
    found = tuple(map(document.mistake, refusals(Setup.of(scenario))))
    if found:
        raise ScenarioError(found)
    return document, scenario


def refusals(setup: Setup) -> Iterator[Problem]:
    """Yield why no mission of a scenario can begin."""
    yield from _tables(setup)
    yield from _ways(setup)
    try:
        _ = setup.scenario.environment.has_field and setup.flow
    except ValueError as error:
        key, _, message = str(error).partition(": ")
        if key.startswith("environment."):
            yield Problem(key, message)
        return
    yield from _carried_away(setup, setup.scenario.environment.current_m_per_s, is_sure=True)


def perhaps_carried_away(setup: Setup) -> Iterator[Problem]:
    """Yield vehicles that are too slow for the current of some seeds."""
    scenario = setup.scenario
    water, span = scenario.environment, scenario.duration_s
    sd, memory = water.current_variation_m_per_s, water.current_variation_time_s
    if sd > 0.0:
        # of the mean of a Gauss-Markov process over the mission
        share = 2.0 * memory / span * (1.0 - memory / span * (1.0 - exp(-span / memory)))
        fastest = water.current_m_per_s + SIGMAS * sd * share**0.5
        yield from _carried_away(setup, fastest, is_sure=False)


def _tables(setup: Setup) -> Iterator[Problem]:
    """Yield tables of rays that do not fit the water, and links that do not fit the vehicles."""
    for band in ("hf", "mf"):
        channel = setup.scenario.acoustics.bands[band].channel
        if setup.scenario.acoustics.bands[band].traits.by_link and not channel.is_own:
            try:
                _ = setup.ping_channel if band == "hf" else setup.frame_channel
            except ValueError as error:
                yield Problem(f"acoustics.{band}.channel.file", str(error))
        file = channel.settings.get("rays") if channel == "table" else None
        if file is None:
            continue
        from ...models.channels.ray_tables import read_table  # brings pyarrow

        try:
            read_table(file, setup.sound_profile)
        except ValueError as error:
            yield Problem(f"acoustics.{band}.channel.rays", str(error))


def _ways(setup: Setup) -> Iterator[Problem]:
    """Yield why AUVs that have dynamics, or surface, cannot fly their plans."""
    comes_up = [wing for wing in setup.wings if wing.asked.surfacing is not None]
    steered = [group for group in setup.groups if group.vehicle.has_dynamics]
    if not (steered or comes_up) or any(wing.asked.choice.is_own for wing in setup.wings):
        return
    try:
        _ = setup.plans
    except (ValueError, ArithmeticError) as error:
        key, _, message = str(error).partition(": ")
        hull = (*steered, *setup.groups)[0].key("vehicle")
        own = f"{comes_up[0].key}.surface_every_s" if comes_up else hull
        known = key.startswith("auvs.")
        yield Problem(key if known else own, message if known else str(error), (hull,))


def _carried_away(setup: Setup, current: float, *, is_sure: bool) -> Iterator[Problem]:
    """Yield fleets that a current (m/s) carries away, for all seeds (`is_sure`) or for some."""
    scenario, asvs = setup.scenario, setup.scenario.asvs
    water = scenario.environment
    varies = water.current_variation_m_per_s > 0.0
    if (current == 0.0 and not water.has_field) or is_sure == varies:
        return
    currents = [current] * (len(setup.auvs) + asvs.count)
    if water.has_field:
        from numpy import hypot  # loaded for currents that differ already

        towards = radians(water.current_direction_deg)
        x, y = setup.flow.means.T
        met = hypot(x + current * cos(towards), y + current * sin(towards))
        currents[: len(met)] = met.tolist()
    fleets = [
        (
            (group.key("vehicle"), "AUV", group.members.start),
            group.vehicle.carried_away if group.vehicle.has_dynamics else None,
            [setup.auvs[auv].speed_m_per_s for auv in group.members],
        )
        for group in setup.groups
    ]
    fleets += [
        (
            (group.key("asvs.vehicle"), "ASV", group.members.start),
            group.vehicle.carried_away if group.vehicle.has_dynamics else None,
            [0.0] * len(group.members),
        )
        for group in setup.vessels
    ]
    for (hull, word, first), carried_away, speeds in fleets:
        after = first + len(setup.auvs) * (word == "ASV")
        own = currents[after : after + len(speeds)]
        found = None if carried_away is None else carried_away(speeds, own)
        if found is not None:
            number, reason = found[0] + first, found[1]
            often = "" if is_sure else "; missions of such seeds end at 0 s"
            when = "" if is_sure else " for some seeds"
            key = "current_m_per_s" if is_sure else "current_variation_m_per_s"
            key = "current" if is_sure and water.has_field else key
            yield Problem(
                f"environment.{key}",
                f"is too much for {word}{number}{when}: {reason}{often}",
                (hull, f"{hull}.model"),
            )
