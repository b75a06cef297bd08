"""Charts of the bottom: GeoTIFF, NetCDF, text; against scipy, and what is said of bad ones."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bindusbl_des import Scenario, ScenarioError, Setup, load_scenario, simulate

rasterio = pytest.importorskip("rasterio")
xarray = pytest.importorskip("xarray")
pyproj = pytest.importorskip("pyproj")
RegularGridInterpolator = pytest.importorskip("scipy.interpolate").RegularGridInterpolator

ORIGIN = {"lat_deg": 54.0, "lon_deg": 10.0}
UTM = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True)
EAST0, NORTH0 = UTM.transform(10.0, 54.0)


def hills(east: Any, north: Any) -> Any:
    """Return a depth (m) east and north (m) of the origin."""
    return 30.0 + 0.03 * east - 0.02 * north + 4.0 * np.sin(east / 60.0) * np.cos(north / 80.0)


def setup_of(bathymetry: Any, origin: Any = ORIGIN, **water: Any) -> Setup:
    environment = {"bathymetry": bathymetry, **({"origin": origin} if origin else {}), **water}
    return Setup(Scenario.model_validate({"name": "x", "environment": environment}))


def tiff(file: Path, *, up: bool = False, step: float = 10.0, **changes: Any) -> Path:
    """Write a GeoTIFF in UTM, 1 km around the origin."""
    count = round(1000.0 / step)
    edge = count * step / 2.0
    east = np.arange(count) * step + step / 2.0 - edge
    values = hills(*np.meshgrid(east, -east)).astype("f4") * (-1.0 if up else 1.0)
    if "hole" in changes:
        values[changes.pop("hole")] = -9999.0
    west, north = EAST0 - edge, NORTH0 + edge
    given = {
        "transform": rasterio.Affine(step, 0.0, west, 0.0, -step, north),
        "crs": "EPSG:32632",
        "nodata": -9999.0,
    } | changes
    given = {name: value for name, value in given.items() if value is not None}
    with warnings.catch_warnings():  # of files without georeference
        warnings.simplefilter("ignore")
        with rasterio.open(
            file, "w", driver="GTiff", width=count, height=count, count=1, dtype="float32", **given
        ) as out:
            out.write(values, 1)
    return file


def gebco(file: Path, step: float = 0.0001) -> Path:
    """Write heights as GEBCO does, in degrees."""
    lat, lon = np.arange(53.99, 54.0101, step), np.arange(9.985, 10.0151, step)
    east, north = UTM.transform(*np.meshgrid(lon, lat))
    values = -hills(np.array(east) - EAST0, np.array(north) - NORTH0)
    xarray.Dataset(
        {"elevation": (("lat", "lon"), values, {"units": "m", "standard_name": "height_above"})},
        {"lat": ("lat", lat, {"units": "degrees_north"}), "lon": lon},
    ).to_netcdf(file)
    return file


def text(file: Path, header: str = "x_m,y_m,depth_m", sign: float = 1.0) -> Path:
    """Write soundings each 10 m, north, east, depth."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.arange(-200.0, 201.0, 10.0)]))
    rows = np.column_stack((x, y, sign * hills(y, x)))
    np.savetxt(file, rows, "%.4f", ",", header=header, comments="")
    return file


SPOTS = np.array([[12.3, -40.7], [-61.0, 55.5], [3.0, 4.0], [70.0, -70.0]])


def true_places() -> np.ndarray:
    """Return SPOTS east and north (m) of the origin in UTM, by way of degrees."""
    site = setup_of(None)
    lat, lon, _ = np.array(site.on_earth(SPOTS.tolist())).T
    east, north = UTM.transform(lon, lat)
    return np.column_stack((np.array(east) - EAST0, np.array(north) - NORTH0))


def test_geotiff_agrees_with_scipy(tmp_path: Path) -> None:
    """A grid in UTM: the nodes that it is turned into add less than 2 cm."""
    file = tiff(tmp_path / "b.tif")
    axis = np.arange(100) * 10.0 + 5.0 - 500.0
    grid = hills(*np.meshgrid(axis, axis, indexing="ij"))
    wanted = RegularGridInterpolator((axis, axis), grid)(true_places())
    assert setup_of(str(file)).bottom.below(SPOTS) == pytest.approx(wanted, abs=0.02)


def test_gebco_agrees_with_scipy(tmp_path: Path) -> None:
    """Heights in degrees, of which the numbers are depths with the other sign."""
    file = gebco(tmp_path / "b.nc")
    assert setup_of(str(file)).bottom.below(SPOTS) == pytest.approx(
        hills(*true_places().T), abs=0.15
    )
    with xarray.open_dataset(file) as data:
        lat, lon, _ = np.array(setup_of(None).on_earth(SPOTS.tolist())).T
        found = RegularGridInterpolator((data.lat.values, data.lon.values), -data.elevation.values)(
            np.column_stack((lat, lon))
        )
    assert setup_of(str(file)).bottom.below(SPOTS) == pytest.approx(found, abs=0.1)


def test_texts_keep_their_nodes(tmp_path: Path) -> None:
    """In metres of the survey nothing is lost: bilinear between the soundings."""
    axis = np.arange(-200.0, 201.0, 10.0)
    grid = hills(*np.meshgrid(axis, axis, indexing="xy"))  # x (north) by y (east)
    wanted = RegularGridInterpolator((axis, axis), grid)(SPOTS)
    found = setup_of(str(text(tmp_path / "b.csv")), origin=None).bottom.below(SPOTS)
    assert found == pytest.approx(wanted, abs=1e-3)
    heights = text(tmp_path / "h.csv", "x_m,y_m,height_m", -1.0)
    assert setup_of(str(heights), origin=None).bottom.below(SPOTS) == pytest.approx(found)
    plain = tmp_path / "b.xyz"  # east, north, height, as GDAL writes it
    rows = np.loadtxt(tmp_path / "h.csv", delimiter=",", skiprows=1)
    np.savetxt(plain, rows[:, [1, 0, 2]], "%.4f")
    local = {"file": str(plain), "crs": "local"}
    assert setup_of(local, origin=None).bottom.below(SPOTS) == pytest.approx(found)


def test_scattered_soundings_are_joined_by_triangles(tmp_path: Path) -> None:
    file, rng = tmp_path / "b.xyz", np.random.default_rng(5)
    places = rng.uniform(-150.0, 150.0, (4000, 2))
    np.savetxt(file, np.column_stack((places, hills(*places.T))), "%.3f")
    found = setup_of({"file": str(file), "crs": "local", "positive": "down"}).bottom.below(SPOTS)
    assert found == pytest.approx(hills(SPOTS[:, 1], SPOTS[:, 0]), abs=0.2)


def test_lakes_have_heights_above_the_same_zero(tmp_path: Path) -> None:
    """A lake at 400 m: a height of 380 m is 20 m deep."""
    file = text(tmp_path / "b.csv", "x_m,y_m,height_m", -1.0)
    rows = np.loadtxt(file, delimiter=",", skiprows=1) + np.array([0.0, 0.0, 400.0])
    np.savetxt(file, rows, "%.4f", ",", header="x_m,y_m,height_m", comments="")
    found = setup_of(str(file), origin=None, surface_m=400.0).bottom.below([(0.0, 0.0)])
    assert found == pytest.approx([30.0], abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "keys", "words"),
    [
        ({"crs": None}, {}, "does not say where on Earth it is (no georeference); set environment"),
        ({"crs": None, "transform": None}, {}, "has no georeference at all"),
        ({}, {"crs": "EPSG:1"}, "EPSG:1 is no code of a coordinate system"),
        ({"crs": "EPSG:32633"}, {}, "is of another place, the survey is at "),
        (
            {"hole": (slice(45, 50), slice(40, 60))},
            {},
            "has no depth where AUV",
        ),
        ({}, {"positive": "up"}, "on land by environment.bathymetry"),
    ],
)
def test_bad_grids_are_told_in_a_line(
    tmp_path: Path, changes: dict[str, Any], keys: dict[str, Any], words: str
) -> None:
    file = tiff(tmp_path / "b.tif", **changes)
    scenario = tmp_path / "x.yaml"
    extra = "".join(f", {name}: {value}" for name, value in keys.items())
    scenario.write_text(
        f"name: x\nenvironment:\n  origin: {{lat_deg: 54.0, lon_deg: 10.0}}\n"
        f"  bathymetry: {{file: {file.name}{extra}}}\n"
    )
    with pytest.raises(ScenarioError) as found:
        load_scenario(scenario)
    lines = str(found.value).splitlines()
    assert any(words in line and ":4:" in line for line in lines), lines


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("1 2\n3 4\n5 6\n", "needs three lines or more of east, north, and a depth"),
        ("a,b,c\n1,2,3\n1,2,3\n4,5,6\n", "has columns a, b, c; name them lon, lat, depth_m"),
        ("1 2 3\n2 x 4\n5 6 7\n", "a line is no three numbers"),
        ("0 0 5\n0 1 5\n1 0 5\n1 1 5\n", "does not say in which grid its positions are"),
        (
            "x_m y_m z\n-900 -900 -5\n-900 900 9\n900 -900 -5\n900 900 9\n",
            "does not say whether these are depths or heights; set environment.bathymetry.positive",
        ),
        (
            "x_m y_m depth_m\n0 0 5\n0 9 5\n9 0 5\n9 9 5\n",
            "has no depth where AUV0 is to go",
        ),
        (
            "x_m y_m depth_m\n5000 0 5\n5000 9 5\n5009 0 5\n5009 9 5\n",
            "reaches from 5000 to 5009 m",
        ),
        (
            "x_m y_m depth_m\n-900 -900 5e7\n-900 900 5\n900 -900 5\n900 900 5\n",
            "has a depth or height of 5e+07 m; declare that number as no data",
        ),
    ],
)
def test_bad_texts_are_told_in_a_line(tmp_path: Path, lines: str, words: str) -> None:
    (tmp_path / "b.xyz").write_text(lines)
    (tmp_path / "x.yaml").write_text("name: x\nenvironment:\n  bathymetry: b.xyz\n")
    with pytest.raises(ScenarioError) as found:
        load_scenario(tmp_path / "x.yaml")
    told = str(found.value).splitlines()
    assert any(words in line and ":3:" in line for line in told), told


def test_a_missing_file_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text("name: x\nenvironment: {bathymetry: none.tif}\n")
    with pytest.raises(ScenarioError) as found:
        load_scenario(tmp_path / "x.yaml")
    assert str(found.value).count("none.tif") == 1


def test_large_files_are_read_around_the_survey(tmp_path: Path) -> None:
    """Of 30 km x 30 km at 10 m, 9 million depths, some 30 x 30 are read."""
    file = tmp_path / "b.tif"
    given = {"transform": rasterio.Affine(10.0, 0.0, EAST0 - 15e3, 0.0, -10.0, NORTH0 + 15e3)}
    with rasterio.open(
        file, "w", driver="GTiff", width=3000, height=3000, count=1, dtype="uint8", tiled=True,
        compress="deflate", crs="EPSG:32632", **given,
    ) as out:  # fmt: skip
        out.write(np.full((3000, 3000), 30, dtype="u1"), 1)
    bottom = setup_of({"file": str(file), "positive": "down"}).bottom
    assert bottom.depths.size < 100 * 100
    assert bottom.below(SPOTS).tolist() == [30.0] * 4


def test_results_keep_a_copy_of_the_chart(tmp_path: Path) -> None:
    file = text(tmp_path / "b.csv")
    scenario = {"name": "x", "duration_s": 5.0, "environment": {"bathymetry": str(file)}}
    result = simulate(Scenario.model_validate(scenario), seed=1)
    result.write(tmp_path / "out")
    file.unlink()
    assert list((tmp_path / "out" / "bottoms").iterdir())
    assert load_scenario(tmp_path / "out" / "scenario.yaml").environment.bathymetry is not None
