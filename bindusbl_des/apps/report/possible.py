"""What a mission reached of what was possible (limits of its medium and of its conflict graph), and
what is to be expected over the survey: the chance of a fix, the last fix's age, the error.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Any

import numpy as np

from ...core.geometry.formation import keep_station
from ...support.arrays import Floats, Ints
from ...support.wording import number
from ..preflight.bounds import reuse_bound
from ..preflight.fix_chance import fix_chance, survey_grid
from ..preflight.limits import (
    MOST_PAIRS,
    Limits,
    SurveySights,
    each,
    groups_of,
    instants,
    least_latency,
    limits_of,
    rates_of,
    sights,
)
from ..preflight.round_lengths import rounds_of
from .page import Packer
from .recording import TRUTH, Recording

# The longer side of the survey has so many cells.
CELLS = 48

# Where one ping in so many makes a fix, or fewer, none is to be expected.
HARDLY_ANY = 1e-3

# How well a place is fixed is taken from so many fixes of the mission nearest to it, of so many;
# so many places are looked at at once.
NEAREST, MOST_FIXES, AT_ONCE = 8, 4000, CELLS

# From this share on a limit is reached, and told in a sentence.
FULL = 0.995

# Packed to steps of these: a probability, an age (s), an error (m).
QUANTA = {"chance": 1e-3, "age": 1e-2, "error": 1e-3}


def fields(mission: Recording, packer: Packer) -> dict[str, Any] | None:
    """Return the fields of a mission's survey, packed in the order of the cells of its grid.

    None where ASVs move, or there is none, and where a user-defined channel decides what is
    decoded: it is not asked again.
    """
    grid = survey_grid(mission.setup, CELLS)
    stations = np.stack([mission.truth[name][mission.auvs :] for name in ("x_m", "y_m")], axis=-1)
    if not len(stations) or not keep_station(stations, mission.scenario.acoustics.hf.range_m):
        return None
    chance = fix_chance(mission.setup, stations[:, 0], grid.middles)
    if chance is None:
        return None
    chance = np.where(grid.inside, chance, np.nan)
    columns = {"chance": chance, "age": expected_age(chance, _round(mission))}
    error = expected_error(mission, grid.middles, chance)
    if error is not None:
        columns["error"] = error
    packed = {name: packer.add(values, quantum=QUANTA[name]) for name, values in columns.items()}
    return {"box": grid.box, "across": grid.across, **packed}


def expected_age(chance: Floats, round_s: float) -> Floats:
    """Return the time mean of the time (s) since the last fix was made, a ping each `round_s` (s).

    Each ping makes a fix with a probability of its own: E[tau^2] / (2 E[tau]) = T (2 - p) / (2 p)
    of waits that are geometric.  NaN where hardly any makes one.
    """
    with np.errstate(divide="ignore"):
        age = round_s * (2.0 - chance) / (2.0 * chance)
    return np.where(chance > HARDLY_ANY, age, np.nan)


def expected_error(mission: Recording, places: Floats, chance: Floats) -> Floats | None:
    """Return the RMS (m) of the horizontal error to be expected of an AUV that is at a place.

    Waits for fixes are geometric with a mean of tau = T / p, and fixes as good as the mission's
    nearest ones.  A filter that weighs fixes and has learnt the bias: a random walk q and fixes r
    along each axis leave sqrt(q^2 tau^2 / 4 + q tau r).  The gain g on fixes: what it lets through
    of their noise, the bias b that it follows late, and the walk since.  NaN where hardly a ping
    makes a fix; None for filters that take none, and user-defined ones.
    Sources: steady states of the Riccati equation, and of the error of a fixed gain.
    """
    navigation = mission.scenario.navigation
    noise = _noise(mission, places)
    if noise is None or not (navigation.weighs or mission.setup.navigator.has_gain):
        return None
    wait = _round(mission) / np.where(chance > HARDLY_ANY, chance, np.nan)
    groups = range(len(mission.setup.groups))
    each = [_expected(mission, number, noise, chance, wait) for number in groups]
    return np.asarray(np.max(each, axis=0))


def _expected(
    mission: Recording, number: int, noise: Floats, chance: Floats, wait: Floats
) -> Floats:
    """Return the same of the AUVs of a group, by its number."""
    navigation, navigator = mission.setup.groups[number].navigation, mission.setup.navigator
    walk = navigation.random_walk_m_per_sqrt_s**2
    if not navigator.has_gain:
        return np.sqrt(2.0 * np.sqrt(walk**2 * wait**2 / 4.0 + walk * wait * noise))
    gain, p = navigation.fixed_gain.gain, chance
    bias = math.hypot(*navigation.velocity_bias_m_per_s, _drawn(mission, number))
    squares = wait**2 * (2.0 - p)
    cubes = wait**3 * (p * p - 6.0 * p + 6.0)
    left = (1.0 - gain) ** 2 * (2.0 * walk * wait + bias**2 * wait**2 * (1.0 - p))
    after = (left + 2.0 * gain**2 * noise) / (gain * (2.0 - gain))
    lag = (1.0 - gain) * bias * wait / gain
    drift = lag * bias * squares / wait + bias**2 * cubes / (3.0 * wait)
    return np.sqrt(after + lag**2 + drift + 2.0 * walk * squares / (2.0 * wait) + _late(mission))


def _noise(mission: Recording, places: Floats) -> Floats | None:
    """Return the variance (m2) along an axis of the fixes nearest to places; None without fixes."""
    fixes = mission.fixes
    step = max(1, -(-len(fixes["x_m"]) // MOST_FIXES))
    x, y, sd_x, sd_y = (fixes[f"{name}_m"][::step] for name in ("x", "y", "sd_x", "sd_y"))
    if not len(x):
        return None
    variance = (sd_x**2 + sd_y**2) / 2.0
    nearest = min(NEAREST, len(x))
    noise = np.empty(len(places))
    for first in range(0, len(places), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        away = (x - places[some, :1]) ** 2 + (y - places[some, 1:2]) ** 2
        near = np.argpartition(away, nearest - 1)[:, :nearest]
        noise[some] = variance[near].mean(axis=1)
    return noise


def _drawn(mission: Recording, number: int) -> float:
    """Return the sd (m/s) of what else drifts like a constant bias, both axes together."""
    group = mission.setup.groups[number]
    navigation = group.navigation
    speed = max(mission.setup.auvs[auv].speed_m_per_s for auv in group.members)
    skew = math.hypot(navigation.scale_factor_sd, math.radians(navigation.heading_sd_deg))
    return math.hypot(math.sqrt(2.0) * navigation.velocity_bias_sd_m_per_s, skew * speed)


def _late(mission: Recording) -> float:
    """Return the square (m2) of the way that an AUV goes on while a fix comes, if uncounted."""
    if mission.scenario.navigation.fixed_gain.delay_compensation == "shift":
        return 0.0
    latency = mission.metrics.mission["latency_mean_s"] or 0.0
    return float((mission.metrics.mission["speed_m_per_s"] * latency) ** 2)


def _round(mission: Recording) -> float:
    """Return the mean time (s) from one turn of an AUV to its next; passive: from ping to ping."""
    starts, duration = mission.rounds["started_at_s"], mission.scenario.duration_s
    length = float(np.diff(starts).mean()) if len(starts) > 1 else duration
    return length / mission.scenario.asvs.count if mission.scenario.protocol.asvs_ping else length


# Of a long mission so many rounds, and fixes, are looked at.
MOST_ROWS = 400

# Who is in range is averaged over so many instants.
MOST_INSTANTS = 2000

# When the ways of a fix begin and end.
ENDS = ("pinged_at_s", "delivered_at_s")


@dataclass(frozen=True)
class Reached:
    """One limit: its name, what was reached and what was possible (in `unit`, None: not known), and
    what the limit is.  `least` tells that less would be better.
    """

    name: str
    unit: str
    reached: float | None
    possible: float | None
    meaning: str
    least: bool = False

    @property
    def share(self) -> float | None:
        """What was reached / what was possible, 1 at the limit."""
        if not self.reached or not self.possible:
            return None if self.possible is None or self.reached is None else 0.0
        return self.possible / self.reached if self.least else self.reached / self.possible


def reached(mission: Recording) -> list[Reached]:
    """Return how near a mission came to its limits; what does not apply to it is left out."""
    limits = limits_of(mission.setup, _sights(mission, instants(mission.scenario)))
    rows = [*_range(mission), *_rates(mission, limits), *_slots(mission), *_medium(mission, limits)]
    return [row for row in rows if row.reached is not None and row.possible is not None]


def _evenly(mission: Recording, rows: Ints) -> Ints:
    """Return some of the rows of a table, evenly spread: as many as are looked at."""
    pairs = mission.scenario.auvs.count * mission.scenario.asvs.count
    most = min(MOST_ROWS, max(MOST_PAIRS // pairs, 1), len(rows))
    return rows[np.linspace(0, len(rows) - 1, most).astype(np.int64)]


def _places(mission: Recording, times: Floats) -> Floats:
    """Return where all vehicles, AUVs first, truly were at instants (k,), s: (k, n, 3), m."""
    places = np.empty((len(times), len(mission.truth["x_m"]), 3))
    for axis, name in enumerate(TRUTH[:3]):
        for vehicle, track in enumerate(mission.truth[name]):
            places[:, vehicle, axis] = np.interp(times, mission.times, track)
    return places


def _sights(mission: Recording, times: Floats) -> SurveySights:
    """Return who was within range of whom at instants (k,), s, by the true tracks."""
    places = _places(mission, times)
    return sights(mission.setup, times, places[:, : mission.auvs], places[:, mission.auvs :])


def _range(mission: Recording) -> Iterator[Reached]:
    """Yield how many pings were in range, and how many of them became fixes that AUVs have."""
    auvs, scenario = mission.metrics.auvs, mission.scenario
    judged_s = scenario.duration_s - scenario.record.metrics_from_s
    sent, near, fixed = (
        np.array([row[name] for row in auvs], dtype=np.float64)
        for name in ("pings", "pings_in_range", "fixes_delivered")
    )
    yield Reached("Pings in HF range", "", near.sum(), sent.sum(), "of all that were sent")
    worst = int(fixed.argmin())
    for whose, name in ((slice(None), ""), (slice(worst, worst + 1), f", AUV{worst}")):
        yield Reached(
            f"Fixes per AUV{name or ', mean'}",
            "/s",
            fixed[whose].mean() / judged_s,
            near[whose].mean() / judged_s,
            "a fix of each ping in range" + (", of the AUV with the fewest" if name else ""),
        )


def _rates(mission: Recording, limits: Limits) -> Iterator[Reached]:
    """Yield how often AUVs were fixed of what the downlink could carry."""
    if limits.records_hz is None:
        return
    scenario = mission.scenario
    setup = mission.setup
    seen = _sights(mission, instants(scenario, MOST_INSTANTS))
    possible = rates_of(setup, rounds_of(setup), seen, limits.senders)
    best = possible["back_to_back"]
    rates = np.array([row["fix_rate_hz"] for row in mission.metrics.auvs])
    meaning = "frame behind frame, with fixes of the AUVs in range"
    yield Reached("Fixes per AUV of the best protocol", "/s", rates.mean(), best.mean, meaning)
    worst = f"AUV{rates.argmin()} of an even share"
    yield Reached(worst, "/s", rates.min(), best.mean, "the AUV with the fewest fixes of that")


def _slots(mission: Recording) -> Iterator[Reached]:
    """Yield how few ping groups rounds had, and how many AUVs shared a slot, where each round has
    slots for all AUVs.

    A schedule that goes by where it believes AUVs to be may make fewer than are free of conflicts.
    """
    rounds, protocol = mission.rounds, mission.scenario.protocol
    schedule = mission.setup.schedule
    if (
        protocol.asvs_ping
        or schedule.framed
        or not schedule.has_exact_groups
        or protocol.positions != "truth"
    ):
        return
    at = _evenly(mission, np.arange(len(rounds["round"])))
    if not at.size:  # while no ASV works no round begins
        return
    colours = rounds["colours"][at]
    seen = _sights(mission, rounds["started_at_s"][at].astype(np.float64))
    groups = groups_of(schedule, seen.heard)
    what = "chromatic number of the conflict graph" if groups.is_exact else "at least: a clique"
    yield Reached("Ping groups in a round", "", colours.mean(), groups.fewest[0], what, least=True)
    in_range = seen.heard.any(axis=2).sum(axis=1)
    yield Reached(
        "AUVs in range that share a slot",
        "",
        float((in_range / colours).mean()),
        float(each(seen.heard, reuse_bound).mean()),
        "the fewest of the ASVs, and of the AUVs for each that the busiest ASV hears",
    )


def _medium(mission: Recording, limits: Limits) -> Iterator[Reached]:
    """Yield how busy receivers and the downlink were, and how late fixes."""
    scenario, duration = mission.scenario, mission.scenario.duration_s
    listening = scenario.protocol.listening
    heard = mission.receptions["outcome"] == "heard"
    decoded = np.bincount(mission.receptions[listening][heard], minlength=1)
    who = listening.upper()
    yield Reached(
        f"Pings decoded by the busiest {who}",
        "/s",
        decoded.max() / duration,
        limits.decodes_hz,
        f"arrivals that do not overlap; {limits.cleared_hz:.3g} /s if each has 20 ms to die away",
    )
    frames = mission.broadcasts
    if limits.records_hz is not None:
        ended = frames["sent_at_s"] + frames["airtime_s"] <= duration
        yield Reached(
            "Records on the downlink",
            "/s",
            frames["fixes"][ended].sum() / duration,
            limits.records_hz,
            f"frame behind frame, {limits.frames}",
        )
    yield _latency(mission, limits)


def _latency(mission: Recording, limits: Limits) -> Reached:
    """Return how late fixes were, and could have been by the ASVs nearest at ping and delivery."""
    fixes, scenario = mission.fixes, mission.scenario
    setup = mission.setup
    meaning = "up to the nearest ASV, a frame of one fix, and back"
    if scenario.protocol.asvs_ping:
        meaning = "a ping, and its way from the nearest ASV"
    elif limits.records_hz is None:
        meaning = "up to the nearest ASV, and back"
    arrived = np.flatnonzero(fixes["outcome"] == "delivered")
    late_s = least_s = None
    if arrived.size:
        late_s = float(fixes["latency_s"][arrived].astype(np.float64).mean())
        rows = _evenly(mission, arrived)
        up, down = (
            _nearest(mission, fixes[name][rows].astype(np.float64), fixes["auv"][rows])
            for name in ENDS
        )
        least_s = least_latency(setup, setup.slots, up, down)
    return Reached("Latency, mean of all fixes", "s", late_s, least_s, meaning, least=True)


def _nearest(mission: Recording, times: Floats, auvs: Ints) -> float:
    """Return how far (m) AUVs (k,) were from the ASV nearest to each at instants (k,), s: a mean.

    It may have failed by then: what was on its way from it still arrives.
    """
    places = _places(mission, times)
    own = places[np.arange(len(auvs)), auvs]
    apart = places[:, mission.auvs :] - own[:, np.newaxis]
    return float(np.linalg.norm(apart, axis=2).min(axis=1).mean())


def possible_text(mission: Recording) -> str:
    """Return the section of limits as HTML: a row each, with a bar of what was reached of it; ""
    without ASVs.
    """
    if not mission.scenario.asvs.count:
        return ""
    rows = reached(mission)
    full = [row for row in rows if (row.share or 0.0) >= FULL]
    lines = "".join(_line(row) for row in rows if row not in full)
    headings = "".join(
        f'<th scope="col">{name}</th>' for name in ("Limit", "reached", "possible", "share")
    )
    return (
        '<section id="possible"><h2>Reached of what was possible</h2>'
        '<div class="scroll" tabindex="0" role="region" aria-label="Limits and what was reached">'
        f'<table class="limits"><thead><tr>{headings}</tr></thead><tbody>{lines}</tbody></table>'
        f'</div>{_full(full)}<p class="note">The whole bar is the limit. Who is in range is '
        "counted where the vehicles truly were, for ping groups as rounds began.</p></section>"
    )


def _full(rows: list[Reached]) -> str:
    """Return what reached its limit, in a sentence."""
    if not rows:
        return ""
    words = "; ".join(
        f"{row.name} {_whole(row.reached)} {row.unit}".strip()
        + (f" (of {_whole(row.possible)}: {row.meaning})" if row.meaning else "")
        for row in rows
    )
    return f"<p>At their limit: {escape(words)}.</p>"


def _whole(value: float | None) -> str:
    """Return a value in words; a whole number has no decimals."""
    return number(value, 0 if value is not None and value == round(value) else 2)


def _line(row: Reached) -> str:
    shown = partial(number, digits=0 if row.unit == "" and (row.possible or 0) > 100 else 2)
    share, unit = row.share or 0.0, f" {row.unit}" if row.unit else ""
    return (
        f'<tr><th scope="row">{escape(row.name)}<small>{escape(row.meaning)}</small></th>'
        f"<td>{shown(row.reached)}{unit}</td><td>{shown(row.possible)}{unit}</td>"
        f'<td><span>{100 * share:.0f} %</span><svg viewBox="0 0 100 8" preserveAspectRatio="none" '
        f'aria-hidden="true"><rect class="whole" width="100" height="8"/>'
        f'<rect width="{100 * min(share, 1.0):.1f}" height="8"/></svg></td></tr>'
    )
