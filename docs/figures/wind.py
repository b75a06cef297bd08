"""Draw how vessels keep station by the wind, and print for how long they are near it.

`python docs/figures/wind.py` writes wind.png beside this file and prints the table of vehicles.md:
shares of 20 minutes within 5, 10 and 20 m of the station, eight seeds each.
"""

from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from bindusbl_des import Scenario, simulate
from bindusbl_des.apps.figures.style import styled

FOLDER = Path(__file__).parent
KEEPINGS = ("figure_of_eight", "beat", "hove_to")
LASTS_S, SEEDS, SHOWN_S = 1200.0, 8, 300.0


def kept(keeping: str, wind: float, current: float, seeds: int) -> Iterator[np.ndarray]:
    """Yield the way of one vessel (n, 2), m, from its station, of each seed; the wind blows from
    North (+x), the current flows to South.
    """
    scenario = Scenario.model_validate(
        {
            "name": "wind",
            "duration_s": LASTS_S,
            "auvs": {"count": 1},
            "asvs": {"count": 1, "vehicle": {"model": "sailboat", "keeping": keeping}},
            "environment": {
                "current_m_per_s": current,
                "current_direction_deg": 180,
                "wind": {"speed_m_per_s": wind, "gust_sd_m_per_s": wind / 6, "veer_sd_deg": 8},
            },
        }
    )
    for seed in range(seeds):
        result = simulate(scenario, seed)
        tracks = result.tables["tracks"]
        own = tracks[tracks["vehicle"] == "ASV0"][["x_m", "y_m"]].to_numpy()
        yield own - np.array(result.setup.stations_m[0])


def table() -> None:
    """Print the shares as a table."""
    print("| station is kept | wind | within 5, 10, 20 m | in 0.15 m/s of current | in 0.3 m/s |")
    print("|---|---|---|---|---|")
    for keeping in KEEPINGS:
        for wind in (2, 3, 6, 10):
            cells = []
            for current in (0.0, 0.15, 0.3):
                ways = kept(keeping, wind, current, SEEDS)
                far = np.concatenate([np.hypot(*way.T) for way in ways])
                cells.append(", ".join(f"{100 * (far < near).mean():.0f}" for near in (5, 10, 20)))
            print(f"| `{keeping}` | {wind} m/s | {cells[0]} % | {cells[1]} % | {cells[2]} % |")


def figure() -> None:
    """Draw five minutes of each way of keeping station, in 6 m/s of wind from North."""
    with styled():
        drawing, panels = plt.subplots(1, 3, figsize=(9.0, 3.4), sharex=True, sharey=True)
        for panel, keeping in zip(panels, KEEPINGS, strict=True):
            way = next(kept(keeping, 6.0, 0.0, 1))
            way = way[: int(len(way) * SHOWN_S / LASTS_S)]
            panel.plot(way[:, 1], way[:, 0], lw=1.0)
            panel.plot(0.0, 0.0, "k+", ms=10)
            circle = plt.Circle((0.0, 0.0), 10.0, fill=False, ls="--", lw=0.8, color="0.5")
            panel.add_patch(circle)
            panel.set(title=f"keeping: {keeping}", xlabel="east of the station (m)", aspect="equal")
        panels[0].set_ylabel("north of the station (m)")
        panels[0].annotate(
            "wind", (-10.5, 7.0), (-10.5, 12.5), ha="center",
            arrowprops={"arrowstyle": "->", "lw": 1.2},
        )  # fmt: skip
        panels[0].set(xlim=(-14, 14), ylim=(-14, 14))
        drawing.tight_layout()
        drawing.savefig(FOLDER / "wind.png", dpi=110)


if __name__ == "__main__":
    figure()
    table()
