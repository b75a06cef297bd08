"""Travel times of rays as pygenray integrates them, kept as a reference for the tests.

    pip install pygenray
    python benchmarks/peers/pygenray_rays.py > tests/reference/pygenray_rays.csv

A summer sea, 60 m deep: warm down to 8 m, a thermocline, cold below 25 m.  Rays leave at a depth
at angles below level, and are told where they are at a range and when.
"""

import numpy as np
import pygenray
import xarray

# Depth (m) and speed of sound (m/s) of that sea
DEPTHS, SPEEDS = (0.0, 8.0, 25.0, 60.0), (1525.0, 1524.0, 1492.0, 1490.0)
SOURCES_M, RANGES_M = (1.0, 12.0), (50.0, 150.0, 400.0)
ANGLES_DEG = (2.0, 4.0, 6.0, 10.0, 20.0, 40.0)


def main() -> None:
    """Print the reference."""
    depths = np.linspace(0.0, 100.0, 401)  # pygenray knows slopes by differences
    speeds = np.interp(depths, DEPTHS, SPEEDS)
    away = np.linspace(0.0, 1000.0, 11)
    sound = xarray.DataArray(
        np.tile(speeds, (len(away), 1)), dims=["range", "depth"],
        coords={"range": away, "depth": depths},
    )  # fmt: skip
    bottom = xarray.DataArray(np.full(len(away), 95.0), dims=["range"], coords={"range": away})
    sea = pygenray.OceanEnvironment2D(sound, bottom, flat_earth_transform=False)
    print("range_m,source_depth_m,receiver_depth_m,travel_time_s")
    for source in SOURCES_M:
        for reach in RANGES_M:
            for angle in ANGLES_DEG:
                try:
                    ray = pygenray.shoot_ray(
                        source, 0.0, -angle, reach, 2, sea, rtol=1e-8, flatearth=False, debug=False
                    )
                except ZeroDivisionError:  # it gives some rays up at the bottom
                    continue
                bounced = ray is None or ray.n_bottom or ray.n_surface
                if bounced or not 1.0 <= abs(ray.z[-1]) <= 59.0:
                    continue
                print(f"{reach:g},{source:g},{abs(ray.z[-1]):.9f},{ray.t[-1]:.12f}")


if __name__ == "__main__":
    main()
