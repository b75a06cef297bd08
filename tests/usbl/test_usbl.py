"""What a USBL measures, against closed forms, published check values and its own covariance."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from worlds import scenario

from bindusbl_des import Setup, fuse
from bindusbl_des.core.usbl.measuring import across_by_array, fix_covariance

CHECKS = json.loads((Path(__file__).parents[1] / "reference" / "physics_checks.json").read_text())
NAMED = {name: Setup(scenario(usbl={"array": name})).usbl for name in ("oem5", "cross5")}
ARRAYS = {name: it.array for name, it in NAMED.items()}
OEM, METRIC = NAMED["oem5"].array, NAMED["oem5"].metric
THESIS_TDOA = 2.60296781192103e-7
Array = NDArray[np.float64]


def instrument(**changes: Any) -> Any:
    """Return the thesis simulator's instrument with changes."""
    values: dict[str, Any] = {
        "array": OEM, "tdoa_sd": THESIS_TDOA, "travel_time_sd": 6.66667e-6, "quantum": 1e-6,
        "attitude_sd": tuple(np.radians((0.2, 0.2, 1.0)).tolist()), "gnss_sd": 0.0,
        "sound_speed": 1500.0,
    }  # fmt: skip
    return replace(NAMED["oem5"], **(values | changes))


QUIET = {"tdoa_sd": 0.0, "travel_time_sd": 0.0, "quantum": 0.0, "attitude_sd": (0.0, 0.0, 0.0)}


def measure(usbl: Any, source: Array, yaw: float, noise: Array) -> tuple[Array, Array]:
    travel = float(np.linalg.norm(source)) / usbl.sound_speed
    return usbl.locate(source, np.zeros(3), yaw, travel, noise)


def test_scatter_of_the_array() -> None:
    """The array resolves depth better than the horizontal directions."""
    assert METRIC.diagonal() == pytest.approx(CHECKS["scatter_OEM_diag"]["value"])
    assert np.allclose(METRIC - np.diag(METRIC.diagonal()), 0, atol=1e-18)
    pairs = np.array([OEM[i] - OEM[j] for i in range(5) for j in range(i + 1, 5)])
    assert pairs.T @ pairs == pytest.approx(5 * METRIC)


def test_a_quiet_instrument_finds_the_source_exactly() -> None:
    """Without noise a fix is right, but for the array's finite size (2 cm at 50 m)."""
    usbl = instrument(**QUIET)
    for azimuth in np.linspace(-3, 3, 7):
        source = np.array([49 * np.cos(azimuth), 49 * np.sin(azimuth), 10.0])
        fix, _ = measure(usbl, source, yaw=0.7, noise=np.ones(12))
        assert np.linalg.norm(fix - source) < 0.02
        assert fix[2] > 9.9  # z is down: a source below the array has positive z


@pytest.mark.parametrize(
    "source", [(0.0, 0.0, 10.0), (0.0, 0.0, 0.0), (1e-6, 0.0, 0.0), (30.0, 0, 0)]
)
def test_no_place_is_singular(source: tuple[float, float, float]) -> None:
    """A source straight below, level with, or at the array still gives finite numbers."""
    fix, covariance = measure(instrument(), np.array(source), 0.0, np.full(12, 0.5))
    assert np.isfinite(fix).all()
    assert np.isfinite(covariance).all()


def lots(draw: st.DrawFn, low: float, high: float) -> float:
    """Draw a noise level: none at all, or any order of magnitude between two."""
    return draw(st.just(0.0) | st.floats(low, high).map(lambda exponent: 10.0**exponent))


@st.composite
def noisy_instruments(draw: st.DrawFn) -> Any:
    """Draw an instrument whose noises and steps are nothing, small or absurd."""
    turns = tuple(math.radians(min(lots(draw, -3, 2), 45.0)) for _ in range(3))
    return instrument(
        array=ARRAYS[draw(st.sampled_from(sorted(ARRAYS)))], tdoa_sd=lots(draw, -9, 0),
        travel_time_sd=lots(draw, -9, 0), quantum=lots(draw, -9, 0), attitude_sd=turns,
        gnss_sd=lots(draw, -3, 3),
    )  # fmt: skip


# Where a source is seen from an ASV: at it, in any direction a hair or far away, or axes of it
OFFSETS = st.just((0.0, 0.0, 0.0)) | st.tuples(
    *[st.sampled_from([0.0, 1e-12, -1e-6, 1e-3, 0.03]) | st.floats(-200.0, 200.0)] * 3
)


# A range that says nothing beside a direction that is nearly perfect: sums of such covariances are
# all but singular, and inverting them without their eigenvalues loses what is left.
NEARLY_SINGULAR = instrument(
    array=ARRAYS["oem5"], tdoa_sd=0.0, travel_time_sd=1.0, quantum=0.0,
    attitude_sd=(0.0, 0.0, 3.103683072560151e-05), gnss_sd=0.0,
)  # fmt: skip


@settings(max_examples=400, deadline=None)
@example(usbl=NEARLY_SINGULAR, offset=(27.0, 0.0, 2.0), seed=0, asvs=2)
@given(usbl=noisy_instruments(), offset=OFFSETS, seed=st.integers(0, 1000), asvs=st.integers(1, 4))
def test_no_fix_is_no_number_or_out_of_this_world(
    usbl: Any, offset: tuple[float, float, float], seed: int, asvs: int
) -> None:
    """Whatever the geometry and the noise: finite, no farther than was measured, a covariance."""
    rng = np.random.default_rng(seed)
    fixes, covariances = [], []
    for _ in range(asvs):
        source, noise = np.array(offset), rng.standard_normal(12)
        vessel = np.array([*rng.normal(0.0, 50.0, 2), 0.0]) if fixes else np.zeros(3)
        travel = float(np.linalg.norm(source - vessel)) / usbl.sound_speed
        fix, covariance = usbl.locate(source, vessel, float(rng.uniform(-4, 4)), travel, noise)
        stepped_sd = math.hypot(usbl.travel_time_sd, usbl.quantum / math.sqrt(12.0))
        measured = travel + stepped_sd * abs(noise[5])
        reach = usbl.sound_speed * measured + usbl.gnss_sd * float(np.linalg.norm(noise[9:]))
        assert float(np.linalg.norm(fix - vessel)) <= reach * (1 + 1e-9) + 1e-9
        fixes.append(fix)
        covariances.append(covariance)
    fused, spread = fuse(fixes, covariances)
    scale = max(1e-12, *(float(np.trace(covariance)) for covariance in covariances))
    for point, matrix in (*zip(fixes, covariances, strict=True), (fused, spread)):
        assert np.isfinite(point).all()
        assert np.isfinite(matrix).all()
        assert np.allclose(matrix, matrix.T, atol=1e-9 * scale)
        assert np.linalg.eigvalsh((matrix + matrix.T) / 2).min() >= -1e-6 * scale


@pytest.mark.parametrize("tdoa_sd", [1e-5, 1e-4, 1e-3, 0.5])
def test_who_cannot_tell_the_direction_says_so(tdoa_sd: float) -> None:
    """Fixes by noise alone are as bad as they say (NEES), and not 3e9 m away."""
    usbl, rng, count = instrument(tdoa_sd=tdoa_sd), np.random.default_rng(4), 3000
    total, farthest = 0.0, 0.0
    for _ in range(count):
        source = rng.uniform(-40.0, 40.0, 3)
        fix, covariance = measure(usbl, source, rng.uniform(0, 6), rng.standard_normal(12))
        error = fix - source
        total += error @ np.linalg.solve(covariance, error)
        farthest = max(farthest, float(np.linalg.norm(error)))
    assert total / count == pytest.approx(3.0, abs=0.4)
    assert farthest < 150.0


@pytest.mark.parametrize("array", sorted(ARRAYS))
def test_noise_larger_than_the_array_is_refused(array: str) -> None:
    """No difference of arrivals can exceed what the array's size allows; what is asked for runs."""
    size = max(
        float(np.linalg.norm(one - other)) for one in ARRAYS[array] for other in ARRAYS[array]
    )
    with pytest.raises(
        ValueError, match=rf"usbl.tdoa_sd_s: .* 750 m of sound, .*{array}"
    ) as refusal:
        scenario(usbl={"array": array, "tdoa_sd_s": 0.5})
    [most] = re.findall(r"use (\S+) at most", str(refusal.value))
    assert float(most) == pytest.approx(size / 1500.0, rel=0.1)
    scenario(usbl={"array": array, "tdoa_sd_s": float(most)})


def test_the_offset_is_shortened_by_what_the_direction_may_miss() -> None:
    """Along the direction measured, a source lies nearer by r tr(A) / 2 than range and cap say."""
    usbl, rng, count = instrument(attitude_sd=(0.0, 0.0, 0.1)), np.random.default_rng(5), 4000
    behind = np.empty(count)
    for k in range(count):
        turn = rng.uniform(0, 6)
        source = 50.0 * np.array([math.cos(turn), math.sin(turn), 0.0])
        fix, _ = measure(usbl, source, rng.uniform(0, 6), rng.standard_normal(12))
        unit = fix / np.linalg.norm(fix)
        behind[k] = unit @ (source - fix)
    # r sd^2 / 2 = 0.25 m of bias is taken out; its spread is 0.35 m, and the rest of fourth order
    assert behind.mean() == pytest.approx(0.0, abs=4 * 0.35 / math.sqrt(count) + 0.002)


@pytest.mark.parametrize(
    ("name", "elevation_sine", "azimuth"),
    [("fixcov(50,0,0)", 0.0, 0.0), ("fixcov(50,30deg,asin.2)", 0.2, 30.0)],
)
def test_first_order_covariance(name: str, elevation_sine: float, azimuth: float) -> None:
    """The covariance of a fix at 50 m equals the published first-order values."""
    level, turn = math.sqrt(1 - elevation_sine**2), math.radians(azimuth)
    offset = 50 * level * math.cos(turn), 50 * level * math.sin(turn), 50 * elevation_sine
    found = fix_covariance(
        offset, np.eye(3),
        across_by_array(offset, np.eye(3), METRIC, 1500 * THESIS_TDOA / math.sqrt(2.0)),
        instrument(travel_time_sd=0.01 / 1500).range_sd(2),
        np.radians([0.2, 0.2, 1.0]), 0.0,
    )  # fmt: skip
    assert found == pytest.approx(np.array(CHECKS[name]["value"]), abs=2e-8)


def test_covariance_turns_with_the_vessel() -> None:
    """A vessel that turns with its surroundings has the same errors, turned."""
    usbl, yaw = instrument(gnss_sd=0.02), 0.8
    turn = np.array([
        [math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]
    ])  # fmt: skip
    offset, quiet = np.array([30.0, 20.0, 10.0]), np.zeros(12)
    one, still = measure(usbl, offset, 0.0, quiet)
    other, turned = measure(usbl, turn @ offset, yaw, quiet)
    assert other == pytest.approx(turn @ one, abs=1e-9)
    assert turned == pytest.approx(turn @ still @ turn.T, abs=1e-9)


@pytest.mark.parametrize("elevation", [-5.0, -20.0, -45.0, -70.0])
def test_direction_attains_the_cramer_rao_bound(elevation: float) -> None:
    """Gauss-Newton on the sphere is efficient: its errors are the bound's, within 3 %."""
    rng, count, sigma = np.random.default_rng(1), 6000, 1.84057619e-7
    az, el = math.radians(30.0), math.radians(elevation)
    unit = np.array([math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el)])
    angles = []
    usbl = instrument(**QUIET | {"tdoa_sd": sigma * math.sqrt(2.0)})
    for noise in rng.standard_normal((count, 12)):
        found, _ = measure(usbl, 1e5 * unit, 0.0, noise)
        angles.append(
            (math.atan2(found[1], found[0]), math.atan2(found[2], math.hypot(found[0], found[1])))
        )
    tangent = np.array(
        [[-math.sin(az) * math.cos(el), math.cos(az) * math.cos(el), 0.0],
         [-math.cos(az) * math.sin(el), -math.sin(az) * math.sin(el), math.cos(el)]]
    )  # fmt: skip
    bound = np.sqrt(np.diag(np.linalg.inv(tangent @ METRIC @ tangent.T))) * 1500 * sigma
    # the sample standard deviation of n draws is uncertain by 1 / sqrt(2 n) = 0.9 %
    assert np.std(angles, axis=0) == pytest.approx(bound, rel=0.03)


def sample_nees(usbl: Any, count: int, axes: int) -> float:
    rng = np.random.default_rng(2)
    total = 0.0
    for _ in range(count):
        reach, turn = 50 * math.sqrt(rng.uniform(0.02, 1)), rng.uniform(0, 2 * math.pi)
        source = np.array([reach * math.cos(turn), reach * math.sin(turn), 10.0])
        fix, covariance = measure(usbl, source, rng.uniform(0, 6), rng.standard_normal(12))
        error = (fix - source)[:axes]
        total += error @ np.linalg.solve(covariance[:axes, :axes], error)
    return total / count


@pytest.mark.parametrize("axes", [2, 3])
def test_fixes_are_as_good_as_they_say(axes: int) -> None:
    """Errors over a disc of 50 m agree with each fix's own covariance (NEES), rounding included."""
    count = 4000
    found = sample_nees(instrument(), count, axes)
    # chi-square bounds at 3 sigma, plus 1 % for the array's finite size and third order terms
    assert found == pytest.approx(axes, abs=3 * math.sqrt(2 * axes / count) + 0.01 * axes)


def test_an_overconfident_covariance_is_caught() -> None:
    """The test above can fail: with half of the noise of arrivals in the books it shows."""
    coarse = instrument(attitude_sd=(0.0, 0.0, 0.0), travel_time_sd=0.0, quantum=0.0)
    stated = instrument(
        attitude_sd=(0.0, 0.0, 0.0), travel_time_sd=0.0, quantum=0.0, tdoa_sd=THESIS_TDOA / 2
    )
    rng, total = np.random.default_rng(2), 0.0
    for _ in range(2000):
        source, noise = np.array([*rng.uniform(-35.0, 35.0, 2), 10.0]), rng.standard_normal(12)
        error = (measure(coarse, source, 0.0, noise)[0] - source)[:2]
        spread = measure(stated, source, 0.0, noise)[1][:2, :2]
        total += error @ np.linalg.solve(spread, error)
    assert total / 2000 > 4.0


def test_steps_of_the_clock_are_noise_of_ranges_alone() -> None:
    """A source that stays where it is: arrival differences are not rounded, so that no mean of many
    fixes is off by the step, and the covariance has a step / sqrt(12) along the range.
    """
    usbl = instrument(
        tdoa_sd=0.0, travel_time_sd=0.0, quantum=1e-4, attitude_sd=(0.0, 0.0, 0.0), gnss_sd=0.0
    )
    source, rng = np.array([0.6, 0.3, 80.0]), np.random.default_rng(0)
    found = [measure(usbl, source, 0.0, noise) for noise in rng.standard_normal((2000, 12))]
    errors = np.array([fix - source for fix, _ in found])
    step = 1500.0 * 1e-4 / math.sqrt(12.0)
    along = errors @ source / np.linalg.norm(source)
    assert np.std(along) == pytest.approx(step, rel=0.05)
    assert abs(np.mean(along)) < 4.0 * step / math.sqrt(2000)
    assert np.abs(errors[:, :2]).max() < 0.01  # rounded by 1e-6 s: off by 3.6 m, always alike
    assert np.trace(found[0][1]) == pytest.approx(step**2, rel=0.01)


def test_two_way_ranges_are_twice_as_good() -> None:
    """A round trip halves the range noise of one travel time."""
    usbl = instrument()
    assert usbl.range_sd(1) == pytest.approx(2 * usbl.range_sd(2))


def test_fusion_of_the_worked_example() -> None:
    """Three fixes of the worked example fuse to the published estimate and covariance."""
    fixes = [np.array([1.0, 2]), np.array([2.0, 1]), np.array([3.0, 3])]
    covariances = [np.diag([1.0, 4]), np.array([[2.0, 1], [1, 2]]), np.diag([0.5, 0.5])]
    estimate, covariance = fuse(fixes, covariances)
    assert estimate == pytest.approx(CHECKS["mvlue_z"]["value"])
    assert covariance == pytest.approx(np.array(CHECKS["mvlue_P"]["value"]))


def test_fusion_keeps_perfect_directions() -> None:
    """Two fixes, each perfect along another axis, fuse to a perfect one."""
    fixes = [np.array([1.0, 5]), np.array([3.0, 2])]
    estimate, covariance = fuse(fixes, [np.diag([0.0, 1]), np.diag([1.0, 0])])
    assert estimate == pytest.approx(CHECKS["fuse_singular_z"]["value"])
    assert covariance == pytest.approx(np.zeros((2, 2)))


@given(st.integers(1, 6), st.integers(0, 1000))
def test_fusion_of_equals_shrinks_by_their_number(count: int, seed: int) -> None:
    """K fixes of equal covariance R, of any shape, fuse to R / K and to their mean."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    covariance, fixes = root @ root.T + 0.1 * np.eye(3), rng.standard_normal((count, 3))
    estimate, fused = fuse(list(fixes), [covariance] * count)
    assert fused == pytest.approx(covariance / count, abs=1e-9)
    assert estimate == pytest.approx(fixes.mean(axis=0), abs=1e-8)


@given(st.integers(2, 5), st.integers(0, 1000))
def test_fusion_equals_inverse_covariance_weighting(count: int, seed: int) -> None:
    """For regular covariances the additive form is the information form."""
    rng = np.random.default_rng(seed)
    roots = rng.standard_normal((count, 3, 3))
    covariances = roots @ roots.transpose(0, 2, 1) + 0.05 * np.eye(3)
    fixes = rng.standard_normal((count, 3))
    information = np.linalg.inv(covariances)
    expected = np.linalg.inv(information.sum(axis=0))
    estimate, fused = fuse(list(fixes), list(covariances))
    assert fused == pytest.approx(expected, abs=1e-8)
    assert estimate == pytest.approx(
        expected @ np.einsum("kij,kj->i", information, fixes), abs=1e-7
    )


def test_fusion_needs_a_covariance_for_each_fix() -> None:
    """Nothing to fuse, or a missing covariance, is refused."""
    with pytest.raises(ValueError, match="one covariance per fix"):
        fuse([], [])
