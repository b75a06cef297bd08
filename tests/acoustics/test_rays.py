"""Tables of sound along bent rays against closed forms: no gradient, a linear one."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as arrow_csv
import pyarrow.parquet as parquet
import pytest
from numpy.typing import NDArray

from bindusbl_des.core.sea.water_column import Profile
from bindusbl_des.models.channels.ray_tables import TableAxes, read_table
from bindusbl_des.models.channels.table_channel import kept_table, traced

Floats = NDArray[np.float64]
SURFACE, GRADIENT = 1480.0, 0.5
LINEAR = Profile(np.array([0.0, 100.0]), np.array([SURFACE, SURFACE + 100.0 * GRADIENT]))
GRID = TableAxes(
    np.geomspace(5.0, 1000.0, 30), np.array([0.5, 1.0, 2.0]), np.linspace(1.0, 60.0, 13)
)
UNIFORM = Profile(np.array([0.0, 100.0]), np.array([1500.0, 1500.0]))
TENTH_OF_MS = 1e-4


def circular(away: Floats, one: Floats, other: Floats) -> Floats:
    """Return how long (s) sound travels on the arc of a circle: where speed is linear in depth."""
    speeds = (SURFACE + GRADIENT * one) * (SURFACE + GRADIENT * other)
    apart = away**2 + (one - other) ** 2
    return np.asarray(np.arccosh(1.0 + GRADIENT**2 * apart / (2.0 * speeds)) / GRADIENT)


@pytest.fixture(scope="module")
def bent() -> Any:
    return traced(LINEAR, GRID, 100.0)


def drawn(count: int, least: float = 1.0) -> tuple[Floats, Floats, Floats]:
    draw = np.random.default_rng(1)
    return (
        draw.uniform(least, 1000.0, count),
        draw.uniform(0.5, 2.0, count),
        draw.uniform(1.0, 60.0, count),
    )


def test_circular_rays(bent: Any) -> None:
    """In a linear gradient BELLHOP's times are those of circles, within 5 us on the grid."""
    places = np.meshgrid(*GRID, indexing="ij")
    assert np.abs(bent.travel_time_s(*places) - circular(*places)).max() < 5e-6


def test_between_places_of_the_grid(bent: Any) -> None:
    """Interpolated times are within 0.1 ms; straight ways would be 3 ms too long."""
    places = drawn(5000)
    assert np.abs(bent.travel_time_s(*places) - circular(*places)).max() < TENTH_OF_MS
    (away, one, other), rise = places, 1480.0 + GRADIENT * np.array(places[1:])
    slowness = np.log(rise[1] / rise[0]) / (GRADIENT * (other - one))
    straight = np.hypot(away, other - one) * slowness
    assert 3e-3 < np.abs(straight - circular(*places)).max() < 4e-3
    assert (bent.excess_time_s(*places) <= 1e-5).all()  # a ray is never slower, by Fermat


def test_nearer_than_the_grid_and_beyond_it(bent: Any) -> None:
    """Straight below its source sound takes the way straight down; far off nothing breaks."""
    down = bent.travel_time_s(0.0, 1.0, 41.0)
    assert down == pytest.approx(np.log((1480.0 + 20.5) / 1480.5) / GRADIENT, abs=2e-6)
    assert bent.loss_db(0.0, 1.0, 1.2) == pytest.approx(0.0, abs=0.2)  # nearer than 1 m
    assert np.isfinite(bent.loss_db([1500.0, 900.0], 5.0, 80.0)).all()


def test_without_a_gradient_rays_are_straight() -> None:
    """Times are distance over speed within 1 us, and losses those of spherical spreading."""
    grid = TableAxes(np.geomspace(5.0, 1000.0, 12), np.array([1.0]), np.linspace(1.0, 60.0, 5))
    table = traced(UNIFORM, grid, 80.0)
    away, _, other = drawn(1000)
    slant = np.hypot(away, other - 1.0)
    assert np.abs(table.travel_time_s(away, 1.0, other) - slant / 1500.0).max() < 1e-6
    assert np.abs(table.loss_db(away, 1.0, other) - 20.0 * np.log10(slant)).max() < 1e-3


def test_what_comes_into_a_shadow_is_reflected() -> None:
    """Below warm water the direct ray bends away: far off the bottom's echo comes first, late."""
    downwards = Profile(np.array([0.0, 50.0]), np.array([1540.0, 1480.0]))
    grid = TableAxes(np.array([100.0, 900.0]), np.array([1.0]), np.array([2.0, 20.0]))
    table = traced(downwards, grid, 50.0)
    assert table.longer_s[0, 0, 0] <= 0.0  # a direct ray
    assert abs(table.beyond_db[0, 0, 0]) < 3.0
    assert table.longer_s[1, 0, 0] > 1e-3
    assert table.beyond_db[1, 0, 0] < 100.0  # heard


def test_nothing_is_mixed_at_the_edge_of_a_shadow() -> None:
    """Speed falls with depth: each time is that of a direct ray or of the bottom's echo, both arcs
    of circles, never of something between; where direct rays are sure it is theirs.
    """
    top, gradient, bottom, source = 1516.0, -31.5 / 30.0, 30.0, 0.5
    falling = Profile(np.array([0.0, bottom]), np.array([top, top + bottom * gradient]))
    grid = TableAxes(np.geomspace(5.0, 400.0, 40), np.array([source]), np.linspace(0.5, 29.75, 16))
    table = traced(falling, grid, bottom)
    draw = np.random.default_rng(3)
    away, depth = draw.uniform(20.0, 300.0, 2000), draw.uniform(2.0, 29.0, 2000)
    taken = table.travel_time_s(away, source, depth)

    def arc(far: Floats, one: Any, other: Any) -> Floats:
        speeds = (top + gradient * one) * (top + gradient * other)
        apart = far**2 + (one - other) ** 2
        return np.asarray(np.arccosh(1.0 + gradient**2 * apart / (2.0 * speeds)) / abs(gradient))

    # the ray that grazes the surface at its apex has a circle of this radius about z = radius
    radius = top / abs(gradient)
    grazing = np.sqrt(2 * radius * source - source**2) + np.sqrt(2 * radius * depth - depth**2)
    shares = np.linspace(0.02, 0.98, 3000)[:, None]
    echo = (arc(shares * away, source, bottom) + arc((1 - shares) * away, bottom, depth)).min(0)
    direct = arc(away, source, depth)
    off = np.minimum(np.abs(taken - direct), np.abs(taken - echo))
    assert off.max() < 5 * TENTH_OF_MS  # of the 14 ms between the two
    assert (off < TENTH_OF_MS).mean() > 0.985
    sure = away < 0.93 * grazing
    assert sure.mean() > 0.2
    assert (np.abs(taken - direct)[sure] < TENTH_OF_MS).all()
    shadow = away > 1.07 * grazing
    assert shadow.mean() > 0.1
    assert (np.abs(taken - echo)[shadow] < 3 * TENTH_OF_MS).mean() > 0.98


def test_a_table_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same sea is traced once; another, or a damaged file, is traced anew."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    grid = TableAxes(np.array([10.0, 100.0]), np.array([1.0]), np.array([5.0, 20.0]))

    def files() -> dict[Path, int]:
        return {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.npz")}

    first, before = kept_table(LINEAR, grid, 60.0), files()
    again = kept_table(LINEAR, grid, 60.0)
    assert files() == before
    assert len(before) == 1
    assert np.array_equal(first.longer_s, again.longer_s)
    assert np.array_equal(first.beyond_db, again.beyond_db)
    kept_table(LINEAR, grid, 61.0)
    kept_table(UNIFORM, grid, 60.0)
    assert len(files()) == 3
    for file in files():
        file.write_bytes(file.read_bytes()[:-20])
    damaged = files()
    assert np.array_equal(kept_table(LINEAR, grid, 60.0).longer_s, first.longer_s)
    assert len(set(files().items()) - set(damaged.items())) == 1


def test_a_disk_that_cannot_be_written_does_not_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    grid = TableAxes(np.array([10.0, 100.0]), np.array([1.0]), np.array([5.0]))
    assert kept_table(LINEAR, grid, 60.0).longer_s.shape == (2, 1, 1)


def test_without_pelagic_its_remedy_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pelagic", None)
    with pytest.raises(ImportError, match=r"pip install 'bindusbl-des\[bellhop\]'"):
        traced(LINEAR, GRID, 100.0)


def test_grids_that_no_sea_has_are_refused() -> None:
    with pytest.raises(ValueError, match="a depth of 60 m lies below the bottom at 40 m"):
        traced(LINEAR, GRID, 40.0)
    with pytest.raises(ValueError, match="must be positive; met 0 m"):
        traced(LINEAR, GRID._replace(ranges_m=np.array([0.0, 10.0])), 100.0)


def rows_of(table: Any) -> pa.Table:
    """Return a table as the rows of a file, in no order."""
    away, one, other = (it.ravel() for it in np.meshgrid(*table.grid, indexing="ij"))
    mixed = np.random.default_rng(0).permutation(away.size)
    columns = {
        "loss_db": table.loss_db(away, one, other),
        "range_m": away,
        "travel_time_s": table.travel_time_s(away, one, other),
        "source_depth_m": one,
        "receiver_depth_m": other,
    }
    return pa.table({name: values[mixed] for name, values in columns.items()})


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_table_of_ones_own(tmp_path: Path, bent: Any, ending: str) -> None:
    """A file with the rows of a table is that table."""
    write: Callable[..., Any] = arrow_csv.write_csv if ending == "csv" else parquet.write_table
    write(rows_of(bent), tmp_path / f"sound.{ending}")
    found = read_table(tmp_path / f"sound.{ending}", LINEAR)
    places = drawn(200)
    assert found.travel_time_s(*places) == pytest.approx(bent.travel_time_s(*places), abs=1e-12)
    assert found.loss_db(*places) == pytest.approx(bent.loss_db(*places), abs=1e-9)


HEAD = "range_m,source_depth_m,receiver_depth_m,travel_time_s,loss_db\n"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "range_m,loss_db\n1,2\n",
            "source_depth_m, receiver_depth_m, travel_time_s missing",
        ),
        ("", "column range_m, .* missing; it needs"),
        (HEAD + "10,1,5,0.007,20\n", "needs at least two values of range_m"),
        (HEAD + "10,1,5,0.007,20\n20,1,6,0.014,26\n", "has 2 rows; a full grid of its 2 ranges"),
        (HEAD + "10,1,5,0.007,20\n20,1,5,,26\n", "travel_time_s must hold numbers; row 2 has none"),
        (HEAD + "10,1,5,0.007,x\n20,1,5,0.014,26\n", "loss_db must hold numbers"),
        (HEAD + "-10,1,5,0.007,20\n20,1,5,0.014,26\n", "range_m must not be negative; met -10"),
        (HEAD + "10,1,5,0.007,-1e5\n20,1,5,0.014,26\n", "loss_db must be at least -100"),
        (HEAD + "10,1,5,0.007,-20\n20,1,5,0.014,-26\n", "losses are positive: turn their sign"),
        (HEAD + "10,1,5,7,20\n20,1,5,14,26\n", "a travel time of 14 s, where a straight way"),
        (
            HEAD + "10,1,5,.007,2\n10,1,5,.007,2\n20,1,5,.014,2\n20,1,6,.014,2\n",
            "has a place twice, and another not at all",
        ),
    ],
)
def test_wrong_tables_are_refused(tmp_path: Path, text: str, problem: str) -> None:
    file = tmp_path / "sound.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=problem) as told:
        read_table(file, LINEAR)
    assert str(told.value).startswith(str(file))
    with pytest.raises(ValueError, match="cannot be read"):
        read_table(tmp_path / "no.parquet", LINEAR)


def test_pygenray_finds_the_same_times() -> None:
    """In a summer sea with a thermocline BELLHOP's times are pygenray's within 0.1 ms."""
    file = Path(__file__).parents[1] / "reference" / "pygenray_rays.csv"
    rays = np.genfromtxt(file, delimiter=",", names=True)
    assert len(rays) >= 20
    summer = Profile(np.array([0.0, 8.0, 25.0, 60.0]), np.array([1525.0, 1524.0, 1492.0, 1490.0]))
    for source in np.unique(rays["source_depth_m"]):
        of_it = rays[rays["source_depth_m"] == source]
        ranges, depths = np.unique(of_it["range_m"]), np.unique(of_it["receiver_depth_m"])
        table = traced(summer, TableAxes(ranges, np.array([source]), depths), 95.0)
        places = of_it["range_m"], source, of_it["receiver_depth_m"]
        off = table.travel_time_s(*places) - of_it["travel_time_s"]
        assert np.abs(off).max() < TENTH_OF_MS
        assert np.abs(table.excess_time_s(*places)).max() > 5.0 * np.abs(off).max()
