"""Currents of ocean models: files of three conventions, their mistakes, and how much is read."""

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bindusbl_des import Scenario, Setup, load_scenario, simulate

pytest.importorskip("xarray")
netCDF4 = pytest.importorskip("netCDF4")

ORIGIN = {"lat_deg": 54.0, "lon_deg": 10.0}
START = "2026-06-01T12:00:00Z"
DEGREE = 111_320.0


def north(x: Any, y: Any, depth: Any, hours: Any) -> Any:
    """Return a velocity (m/s) that is linear in everything but the product with time."""
    return 0.2 + 2e-5 * x - 1e-5 * y - 0.004 * depth + 0.05 * hours


def east(x: Any, y: Any, depth: Any, hours: Any) -> Any:
    return -0.1 + 1e-5 * x + 3e-5 * y + 0.002 * depth - 0.02 * hours


def metres(lat: Any, lon: Any) -> tuple[Any, Any]:
    """Return north and east (m) of the origin, to some 0.3 %."""
    return (lat - 54.0) * 111_300.0, (lon - 10.0) * DEGREE * np.cos(np.radians(54.0))


def on_axes(file: Path, kind: str, hours: Any = (0.0, 6.0, 12.0), **changes: Any) -> Path:
    """Write a file as CMEMS or HYCOM do."""
    cmems = kind == "cmems"
    names = ("uo", "vo") if cmems else ("water_u", "water_v")
    lat, lon = np.arange(53.9, 54.11, 0.02), np.arange(9.8, 10.21, 0.02)
    depths = np.array([0.5, 5.0, 15.0, 40.0]) if cmems else np.array([0.0, 8.0, 20.0, 50.0])
    with netCDF4.Dataset(file, "w") as out:
        for name, values, units in (
            ("time", np.array(hours) + 12.0 + 24.0 * 151, "hours since 2026-01-01 00:00:00"),
            ("depth", depths, "m"),
            ("latitude" if cmems else "lat", lat[:: 1 if cmems else -1], "degrees_north"),
            ("longitude" if cmems else "lon", lon if cmems else lon % 360.0, "degrees_east"),
        ):
            out.createDimension(name, len(values))
            out.createVariable(name, "f8", (name,))[:] = values
            out[name].units = units
        dims = tuple(out.dimensions)
        t, z, la, lo = np.meshgrid(*(out[name][:] for name in dims), indexing="ij")
        x, y = metres(la, lo)
        for name, of in zip(names, (east, north), strict=True):
            packed = {} if cmems else {"fill_value": np.int16(-30000)}
            values = of(x, y, z, t - 12.0 - 24.0 * 151)
            part = out.createVariable(name, "f4" if cmems else "i2", dims, **packed)
            if not cmems:
                part.scale_factor = 1e-4
            part.units = changes.get("units", "m s-1" if cmems else "m/s")
            part[:] = np.where(np.isnan(values), -3.0, values) if not cmems else values
            if "land" in changes:
                part[:] = np.ma.masked_where(changes["land"](x, y), values)
        if "drop" in changes:
            out.renameVariable("time", "step")
            out.renameDimension("time", "step")
    return file


def on_curves(file: Path, transform: int = 2) -> Path:
    """Write a file as ROMS does: a grid turned by 25 deg, 30 m deep, eight levels."""
    turn, levels, h, critical = np.radians(25.0), 8, 30.0, 5.0
    xi, eta = np.meshgrid(np.arange(-3000.0, 3001.0, 500.0), np.arange(-3000.0, 3001.0, 500.0))
    y, x = xi * np.cos(turn) - eta * np.sin(turn), xi * np.sin(turn) + eta * np.cos(turn)
    s = (np.arange(levels) - levels + 0.5) / levels
    stretched = -(np.exp(-2.0 * s) - 1.0) / (np.exp(2.0) - 1.0)
    if transform == 2:
        depth = -h * (critical * s + h * stretched) / (critical + h)
    else:
        depth = -(critical * (s - stretched) + h * stretched)
    with netCDF4.Dataset(file, "w") as out:
        rows, columns = xi.shape
        for name, size in (
            ("ocean_time", 2), ("s_rho", levels), ("eta_rho", rows), ("xi_rho", columns),
            ("eta_u", rows), ("xi_u", columns - 1), ("eta_v", rows - 1), ("xi_v", columns),
        ):  # fmt: skip
            out.createDimension(name, size)
        out.createVariable("ocean_time", "f8", ("ocean_time",))[:] = [0.0, 43200.0]
        out["ocean_time"].units = "seconds since 2026-06-01 12:00:00"
        rho = "eta_rho", "xi_rho"
        for name, dims, values in (
            ("s_rho", ("s_rho",), s), ("Cs_r", ("s_rho",), stretched), ("hc", (), critical),
            ("Vtransform", (), transform), ("h", rho, np.full(xi.shape, h)),
            ("angle", rho, np.full(xi.shape, turn)),
            ("lat_rho", rho, 54.0 + x / 111_300.0),
            ("lon_rho", rho, 10.0 + y / DEGREE / np.cos(np.radians(54.0))),
        ):  # fmt: skip
            out.createVariable(name, "f8", dims)[...] = values
        for name, axis in (("u", 1), ("v", 0)):
            dims = ("ocean_time", "s_rho", f"eta_{name}", f"xi_{name}")
            part = out.createVariable(name, "f8", dims)
            part.units = "meter second-1"
            for t, hours in enumerate((0.0, 12.0)):
                for k, below in enumerate(depth):
                    e, n = (of(x, y, below, hours) for of in (east, north))
                    along = e * np.cos(turn) + n * np.sin(turn)
                    aside = n * np.cos(turn) - e * np.sin(turn)
                    at = along if name == "u" else aside
                    a, b = (np.delete(at, end, axis) for end in (-1, 0))
                    part[t, k] = (a + b) / 2.0
    return file


def asked(file: Path, **keys: Any) -> Scenario:
    environment = {"origin": ORIGIN, "current": {"file": str(file), "start": START}}
    environment |= keys.pop("environment", {})
    return Scenario.model_validate(
        {"name": "x", "duration_s": 3600.0, "survey": {"side_m": 400.0, "depth_m": 10.0}}
        | {"navigation": {"velocity": "through_water"}, "environment": environment, **keys}
    )


@pytest.mark.parametrize("kind", ["cmems", "hycom", "roms1", "roms2"])
def test_each_convention_is_read(kind: str, tmp_path: Path) -> None:
    """A velocity that is linear in time and space is met, but for flat Earth and packing."""
    file = tmp_path / f"{kind}.nc"
    made = on_curves(file, int(kind[-1])) if kind.startswith("roms") else on_axes(file, kind)
    setup, rng = Setup(asked(made)), np.random.default_rng(0)
    times = rng.uniform(0.0, 3600.0, 50)
    places = np.column_stack((*rng.uniform(-200.0, 200.0, (2, 50)), rng.uniform(2.0, 9.5, 50)))
    found = setup.flow.at(times, places)
    x, y, z = places.T
    wanted = np.column_stack([of(x, y, z, times / 3600.0) for of in (north, east)])
    loose = 3e-3 if kind.startswith("roms") else 3e-4  # ROMS: by a grid and twelve depths
    assert np.abs(found - wanted).max() < loose
    assert np.ptp(found, axis=0).min() > 10.0 * loose


def test_a_mission_flies_in_a_file_beside_its_scenario(tmp_path: Path) -> None:
    on_axes(tmp_path / "sea.nc", "cmems")
    text = "name: m\nduration_s: 10\nnavigation: {velocity: through_water}\nenvironment:\n"
    text += "  origin: {lat_deg: 54, lon_deg: 10}\n  current: {file: sea.nc}\n"
    (tmp_path / "m.yaml").write_text(text)
    result = simulate(load_scenario(tmp_path / "m.yaml"), seed=1)
    tracks = result.tables["tracks"]
    last = tracks[tracks["vehicle"] == "AUV0"].iloc[-1]
    assert last["imu_x_m"] - last["x_m"] == pytest.approx(-0.16 * last["time_s"], abs=1.5)


@pytest.mark.parametrize(
    ("change", "keys", "message"),
    [
        ({"drop": "time"}, {}, "has no time axis"),
        ({"units": "cm/s"}, {}, "in 'cm/s'; convert it to m s-1"),
        ({"land": lambda x, y: y > -2000.0}, {}, "has no water where AUV"),
        ({}, {"survey": {"side_m": 40_000.0}}, "ends within"),
        ({}, {"survey": {"side_m": 400.0, "depth_m": 80.0}}, "ends at a depth of 40 m"),
        ({}, {"duration_s": 90_000.0}, "not of all 90000 s"),
        ({}, {"environment": {"origin": None}}, "needs environment.origin"),
    ],
)
def test_files_that_do_not_fit_end_in_a_line(
    change: dict[str, Any], keys: dict[str, Any], message: str, tmp_path: Path
) -> None:
    file = on_axes(tmp_path / "bad.nc", "cmems", **change)
    with pytest.raises(ValueError, match=r"environment\.current\.file: ") as told:
        _ = Setup(asked(file, **keys)).flow
    assert message in str(told.value)
    assert "\n" not in str(told.value)


def test_cells_beside_water_count_as_water(tmp_path: Path) -> None:
    """A shore between two cells leaves a current up to the land's own cell."""
    file = on_axes(tmp_path / "shore.nc", "cmems", land=lambda x, y: y > 900.0)
    assert np.isfinite(Setup(asked(file)).flow.means).all()


def test_what_is_no_netcdf_ends_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "text.nc").write_text("lat,lon\n")
    with pytest.raises(ValueError, match="cannot be read as NetCDF"):
        _ = Setup(asked(tmp_path / "text.nc")).flow


def test_of_a_large_file_only_the_missions_part_is_read(tmp_path: Path) -> None:
    """4 GB by its header, of which the disk holds little: less than 40 MB of memory."""
    file = tmp_path / "large.nc"
    with netCDF4.Dataset(file, "w") as out:
        for name, values, units in (
            ("time", np.arange(2000.0), "hours since 2026-06-01 12:00:00"),
            ("depth", np.array([0.0, 5.0, 10.0, 20.0, 50.0]), "m"),
            ("latitude", np.linspace(44.0, 64.0, 223), "degrees_north"),
            ("longitude", np.linspace(0.0, 20.0, 224), "degrees_east"),
        ):
            out.createDimension(name, len(values))
            out.createVariable(name, "f8", (name,))[:] = values
            out[name].units = units
        dims = tuple(out.dimensions)
        for name in ("uo", "vo"):
            part = out.createVariable(name, "f4", dims, chunksizes=(1, 1, 32, 32))
            part.units = "m s-1"
            part[0:3, :, 100:125, 100:125] = 0.25
        assert 2 * part.size * 4 > 3.9e9
    assert file.stat().st_size < 20e6
    tracemalloc.start()
    found = Setup(asked(file)).flow
    assert tracemalloc.get_traced_memory()[1] < 40e6
    tracemalloc.stop()
    assert found.rms_m_per_s == pytest.approx(0.25 * 2**0.5)
