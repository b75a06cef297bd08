"""Draw how AUVs keep an altitude, and what bottom lock is worth; print the tables of vehicles.md.

`python docs/figures/bottom.py` writes bottom.png beside this file: an AUV over a bank, by hull, and
the drift of its dead reckoning without fixes by `navigation.dvl_range_m` over a bottom that rises.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from bindusbl_des import Result, Scenario, simulate
from bindusbl_des.apps.figures.style import styled

FOLDER = Path(__file__).parent
SPEEDS = {"kinematic": 1.0, "bluerov2": 0.5, "remus100": 1.0}
RANGES_M, SEEDS, WAY_M = (10.0, 20.0, 30.0, 50.0), 8, 300.0


def bank(x: np.ndarray, height: float) -> np.ndarray:
    """Return the depth (m) of a bottom of 25 m with a bank across the way."""
    return 25.0 - height * np.exp(-((x / 45.0) ** 2))


def over_bank(vehicle: str, height: float, folder: Path) -> Result:
    """Return the mission of an AUV that keeps 5 m above a bank, along x."""
    x, y = np.meshgrid(np.arange(-320.0, 321.0, 2.0), (-160.0, 160.0), indexing="ij")
    chart = folder / f"bank{height:g}.csv"
    points = np.column_stack((x.ravel(), y.ravel(), bank(x.ravel(), height)))
    np.savetxt(chart, points, "%.3f", ",", header="x_m,y_m,depth_m", comments="")
    route = {"kind": "waypoints", "points_m": [[[-WAY_M / 2, 0.0], [WAY_M / 2, 0.0]]]}
    return simulate(
        Scenario.model_validate(
            {
                "name": "bank",
                "duration_s": WAY_M / SPEEDS[vehicle],
                "survey": {"side_m": 100.0},
                "auvs": {
                    "count": 1,
                    "vehicle": vehicle,
                    "speed_m_per_s": SPEEDS[vehicle],
                    "route": route,
                    "depth": {"altitude_m": 5.0},
                },
                "environment": {"bathymetry": str(chart)},
            }
        ),
        seed=1,
    )


def rising(range_m: float) -> Scenario:
    """Return a mission without fixes over a bottom that rises from 45 to 15 m, in 0.2 m/s."""
    route = {"kind": "waypoints", "points_m": [[[-WAY_M / 2, 0.0], [WAY_M / 2, 0.0]]]}
    return Scenario.model_validate(
        {
            "name": "rising",
            "duration_s": WAY_M,
            "survey": {"side_m": 100.0, "depth_m": 5.0},
            "auvs": {"count": 1, "speed_m_per_s": 1.0, "route": route},
            "asvs": {"count": 0},
            "environment": {
                "bathymetry": {"depth_m": 30.0, "slope_deg": 5.71, "slope_towards_deg": 180.0},
                "current_m_per_s": 0.2,
                "current_direction_deg": 90.0,
                "current_variation_m_per_s": 0.05,
            },
            "navigation": {"dvl_range_m": range_m, "drift": {"percent_of_distance": 0.5}},
        }
    )


def track(result: Result) -> pd.DataFrame:
    tracks = result.tables["tracks"]
    return tracks[tracks["vehicle"] == "AUV0"]


def altitudes() -> dict[tuple[str, float], pd.DataFrame]:
    """Print how altitudes are kept, and return the tracks over the banks."""
    print("| over a bank of 25 m | kinematic | BlueROV2, 0.5 m/s | REMUS, 1 m/s |")
    print("|---|---|---|---|")
    found = {}
    with TemporaryDirectory() as folder:
        for height in (5.0, 10.0, 18.0):
            steepest = np.degrees(np.arctan(height / 45.0 * np.sqrt(2.0 / np.e)))
            cells = []
            for vehicle in SPEEDS:
                own = found[vehicle, height] = track(over_bank(vehicle, height, Path(folder)))
                high = own["altitude_m"]
                cells.append(f"{high.min():.2f}, {high.max():.2f}")
            print(f"| {height:g} m high, up to {steepest:.0f} deg | {' | '.join(cells)} |")
    return found


def locks() -> dict[float, pd.DataFrame]:
    """Print what bottom lock is worth, and return tracks by its range."""
    print("| `dvl_range_m` | with lock | error after 300 m | expected by the filter |")
    print("|---|---|---|---|")
    found: dict[float, pd.DataFrame] = {}
    for range_m in RANGES_M:
        errors, sds, share = [], [], 0.0
        for seed in range(SEEDS):
            result = simulate(rising(range_m), seed)
            own = track(result)
            found.setdefault(range_m, own)
            errors.append(own["position_error_m"].iloc[-1])
            sds.append(np.hypot(own["estimate_sd_x_m"], own["estimate_sd_y_m"]).iloc[-1])
            share = float(result.auvs["lock_share"].iloc[0])
        rms = float(np.sqrt(np.mean(np.square(errors))))
        print(f"| {range_m:g} | {100 * share:.0f} % | {rms:.1f} m | {np.mean(sds):.1f} m |")
    return found


def figure() -> None:
    """Draw a way over the steep bank, and drift by range of bottom lock."""
    banks, drifts = altitudes(), locks()
    with styled():
        drawing, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.6))
        x = np.linspace(-WAY_M / 2, WAY_M / 2, 301)
        floor = bank(x, 18.0)
        left.fill_between(x, floor, 27.0, color="0.8", lw=0.0)
        left.plot(x, floor - 5.0, "k:", lw=1.0, label="5 m above the bottom")
        for vehicle in SPEEDS:
            own = banks[vehicle, 18.0]
            left.plot(own["x_m"], own["z_m"], lw=1.4, label=vehicle)
        left.set(xlabel="along the way (m)", ylabel="depth (m)", ylim=(27.0, 0.0))
        left.set_xlim(-WAY_M / 2, WAY_M / 2)
        left.legend(fontsize=8, loc="upper left")
        for range_m, own in drifts.items():
            label = f"up to {range_m:g} m"
            right.plot(own["x_m"], own["position_error_m"], lw=1.4, label=label)
        right.set(xlabel="along the way (m)", ylabel="position error without fixes (m)")
        right.set_xlim(-WAY_M / 2, WAY_M / 2)
        right.legend(fontsize=8, title="bottom lock", title_fontsize=8)
        drawing.tight_layout()
        drawing.savefig(FOLDER / "bottom.png", dpi=110)


if __name__ == "__main__":
    figure()
