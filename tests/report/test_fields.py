"""Fields over the survey: what is expected there is what missions have there."""

from typing import Any

import numpy as np
import pytest
from pages_for_tests import page_data
from worlds import scenario

from bindusbl_des import Result, Scenario, Signals, simulate
from bindusbl_des.apps.report.possible import expected_age


def world(**changes: Any) -> Scenario:
    """Return the default mission over 60 m, which 45 m of HF range nearly cover."""
    base = {"duration_s": 300.0, "survey": {"side_m": 60.0}, "asvs": {"count": 2}}
    return scenario(**{**base, **changes})


def field_of(result: Result) -> dict[str, np.ndarray]:
    """Return the fields of a report, row by row."""
    found: dict[str, np.ndarray] = page_data(result)["fields"]
    return found


def test_a_survey_thinner_than_a_cell_has_cells_all_the_same() -> None:
    """Their middles lie beside it: all of them count, for none would be no answer."""
    thin = {"survey": {"size_m": [0.1, 1000.0]}, "auvs": {"route": {"end_margin_m": 0.0}}}
    field = field_of(simulate(scenario(duration_s=5.0, **thin), 1))
    assert len(field["chance"]) > 0
    assert np.isfinite(field["chance"]).all()


def test_ages_are_those_of_geometric_waits() -> None:
    """Of pings once a second of which a third make a fix: the time mean of the age, drawn."""
    random = np.random.default_rng(1)
    waits = random.geometric(1 / 3, 400_000).astype(float)
    age = expected_age(np.array([1 / 3, 1.0, 0.0]), 1.0)
    assert age[0] == pytest.approx((waits**2).sum() / (2 * waits.sum()), rel=0.01)
    assert age[1] == 0.5
    assert np.isnan(age[2])


@pytest.mark.parametrize(
    "navigation",
    [
        {"filter": "kalman"},
        {"filter": "fixed_gain"},
        {"filter": {"model": "fixed_gain", "gain": 0.4, "delay_compensation": "none"}},
    ],
)
def test_expected_errors_are_of_the_size_that_missions_have(navigation: dict[str, Any]) -> None:
    """Where every ping makes a fix the field's mean and the mission's error agree within a third,
    once the filter has learnt the bias.
    """
    result = simulate(world(navigation=navigation), 2)
    field = field_of(result)
    assert (field["chance"] > 0.9995).mean() > 0.5
    tracks = result.tables["tracks"].query("time_s > 60 and vehicle.str.startswith('AUV')")
    rms = float(np.sqrt((tracks.position_error_m**2).mean()))
    expected = float(np.sqrt(np.nanmean(field["error"] ** 2)))
    assert expected == pytest.approx(rms, rel=0.35)


def test_who_takes_no_fixes_has_no_expected_error() -> None:
    found = field_of(simulate(world(duration_s=20.0, navigation={"filter": "dead_reckoning"}), 1))
    assert set(found) == {"box", "across", "chance", "age"}


def half(signals: Signals) -> np.ndarray:
    """A channel of somebody's own."""
    return np.full(signals.ranges.shape, 0.5)


def test_nothing_is_shaded_where_ones_own_channel_decides() -> None:
    """It is not asked again, and no legend speaks of a range that cuts nothing."""
    page = simulate(world(duration_s=20.0, acoustics={"hf": {"channel": half}}), 1).report()
    assert '"fields":null' in page.replace(" ", "")
    assert '"hf":false' in page.replace(" ", "")
