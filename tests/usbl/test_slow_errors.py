"""Acoustic errors that change slowly: what is drawn, and what fixes say of them."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_systematic import NOISE_WIDTH, STATIONS, Sea
from worlds import QUIET_USBL, scenario, still

from bindusbl_des import Setup, simulate
from bindusbl_des.core.usbl.systematic_effects import SLOW

Array = NDArray[np.float64]

SOURCE = np.array([25.0, 18.0, 12.0])
SHARE = 0.6
FIRST = 6  # numbers of a measurement that may change slowly: five elements and the range


def sheet(**stated: float) -> Any:
    return Setup(scenario(usbl={"model": {"model": "datasheet", **stated}})).usbl.sheet


SHEETS = {
    "array": None,
    "angles": sheet(
        bearing_sd_deg=0.6, elevation_sd_deg=0.45, range_sd_m=0.1, range_sd_percent=0.2
    ),
    "place": sheet(accuracy_m=0.7, accuracy_percent=1.4),
}
WAYS: dict[str, dict[str, Any]] = {
    "one": {"heard": (1,)}, "three": {}, "call": {"called_by": 0},
    "call of another": {"called_by": 2, "heard": (0, 1)},
}  # fmt: skip


def measured(
    noise: Array, sheet: Any, share: float = SHARE, source: Array = SOURCE, **way: Any
) -> tuple[Array, Array, Array, Array]:
    """Return fix, covariance, J and what is left, where ASVs tell slow errors from others."""
    told = Sea(noise=noise, sheet=sheet, slow_share=share, source=source, **way)
    return told.measured()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", SHEETS)
def test_j_holds_what_slow_numbers_move(kind: str, way: str) -> None:
    """J J^T of each ASV is that of the fix's differences by the numbers that are slow."""
    sheet, quiet, step = SHEETS[kind], np.zeros((3, NOISE_WIDTH + 4)), 1e-3
    jacobian = measured(quiet, sheet, **WAYS[way])[2]
    for asv in range(3):
        found = np.zeros((2, 2))
        for number in range(FIRST):
            moved = quiet.copy()
            moved[asv, number] = np.sqrt(SHARE) * step
            up = measured(moved, sheet, **WAYS[way])[0]
            by = (up - measured(-moved, sheet, **WAYS[way])[0])[:2] / (2 * step)
            found += np.outer(by, by)
        own = jacobian[:2, SLOW * asv : SLOW * (asv + 1)]
        assert own @ own.T == pytest.approx(found, rel=0.02, abs=0.02 * np.abs(found).max())
        assert (np.abs(own).max() > 0.0) == (asv in WAYS[way].get("heard", (0, 1, 2)))


@pytest.mark.parametrize("kind", SHEETS)
def test_j_has_no_edge_straight_below(kind: str) -> None:
    """Straight below an ASV, where every way is level, J turns no more than elsewhere: what its
    derivatives say of a place a metre on, on whichever side, is J there.
    """
    quiet, below = np.zeros((3, NOISE_WIDTH + 4)), STATIONS[1] + np.array([0.3, -0.2, 30.0])
    count, whole = 3 * SLOW, measured(quiet, SHEETS[kind], heard=(1,), source=below)[2]
    for step in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)):
        there = measured(quiet, SHEETS[kind], heard=(1,), source=below + np.array(step))[2]
        along = step[0] * whole[:2, count : 2 * count] + step[1] * whole[:2, 2 * count : 3 * count]
        size = np.abs(there[:2, :count]).max()
        assert whole[:2, :count] + along == pytest.approx(there[:2, :count], abs=0.05 * size)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", SHEETS)
def test_the_covariance_of_a_fix_is_what_it_was(kind: str, way: str) -> None:
    """A single fix errs as it does without slow errors; J and what is left add up to that."""
    sheet, quiet = SHEETS[kind], np.zeros((3, NOISE_WIDTH + 4))
    _, covariance, jacobian, left = measured(quiet, sheet, **WAYS[way])
    plain = measured(quiet, sheet, **WAYS[way], share=0.0)[1]
    assert covariance == pytest.approx(plain, rel=0.02, abs=0.02 * np.abs(plain).max())
    own = jacobian[:2, : 3 * SLOW]
    rest = np.array([[left[0], left[2]], [left[2], left[1]]])
    assert own @ own.T + rest == pytest.approx(covariance[:2, :2], rel=0.02, abs=1e-3)


@pytest.mark.parametrize("elements", [5, 7])
def test_slow_errors_last_as_long_as_they_say(elements: int) -> None:
    """Bearing, elevation and range of a ping every second: a share of the variance has the
    correlation exp(-T / tau), the rest has none.
    """
    tau, share = 4.0, 0.7
    places = [[0.04, 0.01, 0.0], [-0.01, 0.04, 0.01], [-0.04, -0.02, -0.01], [0.02, -0.04, 0.005],
              [0.01, 0.0, 0.06], [0.03, 0.03, -0.03], [-0.02, 0.01, 0.02]]  # fmt: skip
    world = still(
        1,
        duration_s=8000.0,
        asvs={"count": 2, "formation": {"positions_m": [[0.0, 0.0], [5.0, 25.0]]}},
        usbl={
            **QUIET_USBL, "tdoa_sd_s": 1e-6, "travel_time_sd_s": 1e-5, "slow_share": share,
            "correlation_s": tau, "array": "oem5" if elements == 5 else places,
        },
        protocol={"shortest_uplink_slot_s": 1.0},
        navigation={"filter": "dead_reckoning"},
        record={"tracks_hz": 0.01},
    )  # fmt: skip
    met = simulate(world, 3).tables["receptions"].query("outcome == 'heard'")
    each = {}
    for asv, own in met.groupby("asv", observed=True):
        every_s = float(np.median(np.diff(own.arrived_at_s)))
        for name in ("body_azimuth_deg", "body_elevation_deg", "slow_range_error_m"):
            found = (own[name].to_numpy() + 90.0) % 360.0
            each[asv, name] = (found - found.mean()) / found.std()
        assert own.slow_range_error_m.std() == pytest.approx(1500.0 * 1e-5 * share**0.5, rel=0.1)
    for (_, name), found in each.items():
        lasting = 1.0 if name == "slow_range_error_m" else share
        for lag in (2, 8):
            beside = float((found[lag:] * found[:-lag]).mean())
            assert beside == pytest.approx(lasting * np.exp(-lag * every_s / tau), abs=0.07), name
    both = np.abs(np.corrcoef(list(each.values())))
    assert both[:3, 3:].max() < 0.12  # each ASV errs by itself
    assert max(both[2, :2].max(), both[5, 3:5].max()) < 0.12
