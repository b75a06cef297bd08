"""Trials at sea: what is predicted from stated figures, beside what was measured.

``python experiments/sea/predict.py`` prints both tables of docs/validation.md.  Nothing is fitted
to what it is compared with.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from bindusbl_des import Scenario, load_scenario, simulate
from bindusbl_des.core.acoustics.sonar_equation import SoundMessage, chance_decoded, link_budget
from bindusbl_des.core.acoustics.sound_settings import Sonar

HERE = Path(__file__).parent

# HERMES: 300 kHz, frames of 9,120 information bits; a symbol a bandwidth, one or two bits a symbol
FREQUENCY_KHZ, BITS = 300.0, {"BPSK": 1, "QPSK": 2}
FITTED = 0

# The maker's test: what a reading of each instrument is taken for
SHEETS = {
    "preset `cerulean_rovl` (its budget)": {"preset": "cerulean_rovl"},
    "sheet 1 deg, 0.3 m, slow GNSS 1.5 m": {
        "model": {"model": "datasheet", "bearing_sd_deg": 1.0, "range_sd_m": 0.3},
        "gnss_correlated_sd_m": 1.5,
    },
}
SEEDS = 8
MEASURED = (
    "| measured by the maker | range within 0.5 m | a band of 10 m, GNSS wandering 6 m | 2 deg |"
)


def by_mode() -> pd.DataFrame:
    """Return each mode's delivery as measured, and as predicted by a fit of mode 0 alone.

    Of that two numbers are found: a level (source less noise) and the shadowing.
    """
    rows = pd.read_csv(HERE / "delivery_by_mode.csv")
    fitted = rows[rows["mode"] == FITTED]
    levels_db, spreads_db = np.arange(120.0, 200.0, 0.5), np.arange(0.0, 12.1, 0.5)
    measured = fitted.delivery_ratio.to_numpy()[:, np.newaxis]
    off = [np.square(delivered(fitted, levels_db, it) - measured).sum(axis=0) for it in spreads_db]
    level, spread = divmod(int(np.argmin(np.transpose(off))), len(spreads_db))
    best = levels_db[level], spreads_db[spread]
    return rows.assign(predicted=delivered(rows, *best), level_db=best[0], shadowing_sd_db=best[1])


def delivered(
    rows: pd.DataFrame, level_db: float | np.ndarray, shadowing_sd_db: float
) -> np.ndarray:
    """Return the chance that each row's frame is decoded, at one level or at each (n, ...)."""
    told = []
    for it in rows.itertuples():
        per_symbol = BITS[it.modulation]
        sonar = Sonar(
            frequency_khz=FREQUENCY_KHZ, bandwidth_khz=it.bandwidth_khz, decoding="bpsk",
            shadowing_sd_db=shadowing_sd_db,
        )  # fmt: skip
        duration_s = it.info_bits_per_frame / (1e3 * it.bandwidth_khz * per_symbol)
        message = SoundMessage(duration_s=duration_s, bits=it.info_bits_per_frame)
        snr_db = link_budget(sonar).snr_db(it.range_m) + level_db - sonar.source_level_db
        told.append(chance_decoded(sonar, snr_db, message))
    return np.array(told)


def table_of_modes(rows: pd.DataFrame) -> str:
    """Return a table (Markdown): a row for each mode, measured / predicted over ranges."""
    ranges = sorted(rows.range_m.unique())
    lines = [
        f"| mode | {' | '.join(f'{it:g} m' for it in ranges)} | off by (rms) |",
        f"|---|{'---|' * (len(ranges) + 1)}",
    ]
    for mode, its in rows.groupby("mode"):
        first = its.iloc[0]
        name = f"{mode}: {first.modulation}, {first.bandwidth_khz:g} kHz, {first.day}"
        at = its.set_index("range_m")
        cells = [
            f"{at.delivery_ratio[it]:.2f} / {at.predicted[it]:.2f}" if it in at.index else "-"
            for it in ranges
        ]
        off = float(np.sqrt(np.square(its.predicted - its.delivery_ratio).mean()))
        told = f"{off:.2f}{' (fitted)' if mode == FITTED else ''}"
        lines.append(f"| {name} | {' | '.join(cells)} | {told} |")
    return "\n".join(lines)


def readings(usbl: dict[str, object], seeds: int) -> tuple[float, float, float, float]:
    """Return 5 to 95 % of fixes along the way (m, as a width) and across it (m, both ends), and
    half of that as an angle (deg); means of missions.
    """
    base = load_scenario(HERE / "cerulean_110m.yaml").model_dump(mode="json", exclude_unset=True)
    scenario, told = Scenario.model_validate({**base, "usbl": usbl}), []
    for seed in range(seeds):
        fixes = simulate(scenario, seed).tables["fixes"]
        along = np.hypot(fixes.x_m, fixes.z_m)
        low, high = np.percentile(along, (5, 95))
        told.append((high - low, *np.percentile(fixes.y_m, (5, 95))))
    width, left, right = np.mean(told, axis=0)
    return float(width), float(left), float(right), float(np.degrees((right - left) / 2 / 110.0))


def table_of_the_makers_test(seeds: int = SEEDS) -> str:
    """Return a table (Markdown): what each statement of the instrument says, and the maker."""
    lines = [
        "| | along the way, 5 to 95 % | across, 5 to 95 % | bearing, half of that |",
        "|---|---|---|---|",
    ]
    for name, usbl in SHEETS.items():
        width, left, right, bearing = readings(usbl, seeds)
        lines.append(
            f"| {name} | {width:.1f} m | {left:.1f} to {right:.1f} m | {bearing:.1f} deg |"
        )
    lines.append(MEASURED)
    return "\n".join(lines)


if __name__ == "__main__":
    print(table_of_modes(by_mode()))
    print()
    print(table_of_the_makers_test())
