"""Replays in a table for the terminal, and the noise of a log as a scenario file."""

import json
from collections.abc import Iterator, Mapping, Sequence
from math import sqrt
from typing import Any

from ...core.scenario.scenario import Scenario
from ...support.wording import aligned, counted, number, plain, significant
from .fitting import Fit
from .log import Log
from .losses import RARE

Row = Mapping[str, Any]

# heading, unit, column, digits, factor
COLUMNS = (
    ("way", "m", "distance_m", 0, 1),
    ("sights", "", "sights", 0, 1),
    ("outliers", "%", "filter_outlier_share", 1, 100),
    ("NIS", "", "filter_nis", 2, 1),
    ("walk", "m/√s", "random_walk_m_per_sqrt_s", 3, 1),
    ("range", "m", "range_sd_m", 2, 1),
    ("apart", "m", "filter_to_smoother_m", 2, 1),
    ("reckoned", "m", "reckoned_to_reference_m", 2, 1),
    ("filter", "m", "filter_to_reference_m", 2, 1),
    ("smoother", "m", "smoother_to_reference_m", 2, 1),
)
LEGEND = (
    "outliers, NIS (1 for ranges where noise is as stated, 2 for fixes): of the filter; walk,\n"
    "range: the noise stated; apart: RMS distance of filter and smoother; reckoned, filter,\n"
    "smoother: RMS distance from GTSAM's robust optimum, which is an estimate, no truth"
)

# So many standard deviations of a range a beacon's median residual must be off to be told of.
FAR_OFF = 3.0


def summary(logs: Sequence[Row], beacons: Sequence[Row]) -> str:
    """Return what replays came to: rows of the tables `logs` and `beacons`, by column."""
    rows = [("log", *(column[0] for column in COLUMNS)), ("", *(column[1] for column in COLUMNS))]
    rows += [_row(row | {"sights": row["ranges"] + row["fixes"]}) for row in map(dict, logs)]
    lines = aligned(rows)
    lines.insert(2, "-" * max(map(len, lines)))
    return "\n".join((*lines, LEGEND, *_remarks(logs, beacons)))


def _row(row: Row) -> tuple[str, ...]:
    cells = (number(row[name], digits, factor) for _, _, name, digits, factor in COLUMNS)
    return (str(row["log"]), *cells)


def _remarks(logs: Sequence[Row], beacons: Sequence[Row]) -> Iterator[str]:
    for log in logs:
        if not log["has_clock"]:
            yield f"{log['log']}: no instants are recorded; a second is what it takes at --speed"
        if log["start_loss"] is not None:
            place = f"x {log['start_x_m']:.1f}, y {log['start_y_m']:.1f} m"
            yield (
                f"{log['log']}: begins at {place}, heading {log['start_heading_deg']:.1f} deg, "
                f"found from the ranges{_rival(log)}"
            )
        if log["receptions"]:
            yield f"{log['log']}: {_lost(log)}"
        for row in beacons:
            middle, sd = row["residual_median_m"], log["range_sd_m"]
            if row["log"] == log["log"] and middle is not None and abs(middle) > FAR_OFF * sd:
                yield (
                    f"{log['log']}: the {row['ranges']} ranges to {row['beacon']} are off by "
                    f"{middle:.1f} m (median); is it where it is said to be?"
                )


def _lost(log: Row) -> str:
    if log["lost_share"] == 0.0:
        return f"all {counted(log['receptions'], 'signal')} were heard"
    words = f"{100 * log['lost_share']:.1f} % of {log['receptions']} receptions were lost"
    if log["burst_s"] is None:
        return f"{words}, each by itself as far as they tell"
    words = f"{words}, for {log['burst_s']:.2g} s on average"
    if log["outage_chance"] is not None and log["outage_chance"] < RARE:
        words += f"; {outage_text(log['longest_outage_s'], log['outage_chance'])}"
    return words


def outage_text(lasted_s: float, chance: float) -> str:
    """Tell of an outage that one mean does not explain."""
    return (
        f"the longest outage, {lasted_s:.2g} s, is met in {100 * chance:.1g} % of such logs: "
        "something else may have been in the way (a hull, a pile)"
    )


def _rival(log: Row) -> str:
    if log["rival_loss"] is None:
        return "; no other start fits"
    if log["start_loss"] == 0.0:
        return ", which fit it exactly"
    return f"; the best other one has {log['rival_loss'] / log['start_loss']:.1f} times the loss"


def noise_keys(fit: Fit, log: Log) -> dict[str, tuple[Any, str]]:
    """Return the scenario's keys that a log tells of: value, and what is to be said of it."""
    noise, usbl = fit.noise, Scenario(name="plain").usbl
    speed = Scenario(name="plain").environment.sound_speed_m_per_s
    keys: dict[str, tuple[Any, str]] = {}
    if log.has_ranges:
        travel_time = sqrt(max((noise.range_sd / speed) ** 2 - usbl.quantum_s**2 / 12.0, 0.0))
        keys["usbl.travel_time_sd_s"] = (
            travel_time, f"a range of {significant(noise.range_sd)} m at {plain(speed)} m/s",
        )  # fmt: skip
    if noise.outlier_share > 0.0:
        keys["usbl.outlier_share"] = noise.outlier_share, "of the sights"
        keys["usbl.outlier_sd_m"] = noise.outlier_sd, "their further error"
    else:
        keys["usbl.outlier_share"] = 0.0, "no outlier was found"
    unit = "" if log.has_clock else "; per second at the nominal speed, as the log has no clock"
    keys["navigation.random_walk_m_per_sqrt_s"] = noise.random_walk, f"of dead reckoning{unit}"
    sds = ", ".join(significant(sd, 2) for sd in fit.bias_sds)
    keys["navigation.velocity_bias_m_per_s"] = (
        list(noise.bias), f"ahead, and to the side of y; +- {sds}",
    )  # fmt: skip
    keys["navigation.velocity_bias_sd_m_per_s"] = noise.bias_sd, "how sure that is"
    if noise.start_sd > 0.0 and not log.start_found:
        most = 1e5  # of that key
        keys["navigation.initial_position_sd_m"] = (
            min(noise.start_sd, most), "odometry begins elsewhere",
        )  # fmt: skip
    losses = fit.losses
    if losses is not None and losses.burst_s is not None:
        low, high = losses.interval_s
        words = f"{100 * losses.share:.3g} % of {losses.receptions} receptions were lost; "
        words += f"{low:.2g} to {high:.2g} s; the model is yours to choose"
        if losses.longest is not None and losses.longest.is_rare:
            words += f"; {outage_text(losses.longest.lasted_s, losses.longest.chance)}"
        keys["acoustics.hf.channel"] = {"model": "disc", "burst_s": losses.burst_s}, words
    return {name: (_rounded(value), said) for name, (value, said) in keys.items()}


def _rounded(value: Any) -> Any:
    """Return numbers with the digits that a log can tell."""
    if isinstance(value, list):
        return [_rounded(inner) for inner in value]
    if isinstance(value, dict):
        return {name: _rounded(inner) for name, inner in value.items()}
    if isinstance(value, str):
        return value
    return float(f"{value:.3g}")


def noise_file(fit: Fit, log: Log) -> str:
    """Return a scenario file with the noise of a log; all other keys are defaults."""
    sights = len(log.ranges.times) + len(log.fixes.times)
    lines = [
        f"# The noise under which the {sights} sights of {log.name} are likeliest, by",
        "# `bindusbl-des fit`.  A scenario: copy the keys, or `replay --noise` this file.",
        f"name: {json.dumps(f'{log.name} noise')}",
    ]
    section = ""
    for name, (value, said) in noise_keys(fit, log).items():
        now, _, key = name.partition(".")
        if now != section:
            lines.append(f"{now}:")
            section = now
        for word in reversed(key.split(".")[1:]):
            value = {word: value}
        lines.append(f"  {key.split('.')[0]}: {_written(value)}  # {said}")
    return "\n".join(lines) + "\n"


def _written(value: Any) -> str:
    """Return a value as YAML has it, which wants a point before an exponent."""
    if isinstance(value, list):
        return f"[{', '.join(map(_written, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{name}: {_written(inner)}' for name, inner in value.items())}}}"
    if isinstance(value, str):
        return value
    text = repr(value)
    mantissa, mark, exponent = text.partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}e{exponent}" if mark else text
