"""The predictor of the page says what Python's says, whatever the protocol and the instruments."""

from typing import Any

import numpy as np
import pytest
from in_node import NODE, asked, moved
from plans_for_tests import error_map, inputs_of, predict

from bindusbl_des import Scenario, Setup, load_scenario

pytestmark = pytest.mark.skipif(NODE is None, reason="Node is not installed")

METRICS = (
    *("hf_coverage", "fix_rate_hz", "fix_age_mean_s", "fix_age_p95_s", "fix_age_max_s"),
    *("position_error_m", "position_error_rms_m", "position_error_p95_m", "error_over_time"),
    "varies",
)
VARIED: dict[str, list[str]] = {
    "as it is": [],
    "dsatur": ["protocol.schedule=dsatur", "protocol.downlink=pipelined_round"],
    "a slot each": ["protocol.schedule=one_per_slot", "protocol.downlink=pipelined_group"],
    "round robin": ["protocol.schedule=round_robin", "protocol.broadcaster=nearest"],
    "in step": [
        *("protocol.schedule=round_robin", "auvs.count=6", "acoustics.mf.range_m=70"),
    ],
    "at random": ["protocol.schedule=random", "protocol.broadcaster=random"],
    "replies": ["protocol.downlink=direct_reply"],
    "replies to pings that are often lost": [
        "protocol.downlink=direct_reply",
        "acoustics.hf.channel={model: sonar, snr_threshold_db: 26}",
    ],
    "two ways": ["protocol.ranging=twtt", "protocol.broadcaster=most_fixes"],
    "passive": ["protocol.ranging=passive"],
    "one tells": ["protocol.broadcaster={model: fixed, asv: 1}", "protocol.tick_rate_hz=30"],
    "nearest tells a group": [
        *("protocol.broadcaster=nearest", "protocol.downlink=pipelined_group"),
        "acoustics.mf.range_m=70",
    ],
    "nearest tells": ["protocol.broadcaster=nearest", "acoustics.mf.range_m=70"],
    "paper": ["navigation.filter=fixed_gain", "navigation.filter.delay_compensation=none"],
    "no fixes": ["navigation.filter=dead_reckoning"],
    "smoother": ["navigation.filter=smoother"],
    "slant": ["acoustics.hf.range_metric=slant", "acoustics.loss.law=head"],
    "MF slant": [
        *("acoustics.mf.range_metric=slant", "acoustics.mf.range_m=60", "survey.depth_m=30"),
        "protocol.broadcaster=nearest",
    ],
    "sonar": ["acoustics.hf.channel=sonar"],
    "errors that last": [
        *("usbl.misalignment_sd_deg=0.5", "usbl.gnss_correlated_sd_m=0.5"),
        "navigation.clock_offset_sd_s=1e-4",
    ],
    "slow errors": ["usbl.slow_share=0.7", "usbl.gnss_correlated_sd_m=0.5"],
    "slow errors in passive": ["protocol.ranging=passive", "usbl.slow_share=0.7"],
    "and in passive": ["protocol.ranging=passive", "usbl.misalignment_sd_deg=0.5"],
    "drift": ["navigation.drift.percent_of_distance=2"],
    "bias that wanders": [
        *("navigation.velocity_bias_sd_m_per_s=0.05", "navigation.heading_sd_deg=1"),
        *("navigation.velocity_bias_time_constant_s=60", "navigation.scale_factor_sd=0.01"),
    ],
    "current": ["environment.current_m_per_s=0.2", "navigation.velocity=through_water"],
    "long": ["duration_s=4000", "protocol.downlink=direct_reply", "acoustics.hf.range_m=30"],
    "nobody hears": ["asvs.formation.radius_m=300"],
}


def plan(changes: list[str]) -> Scenario:
    """Return a survey of seven AUVs, some of whom are out of reach at times."""
    own = ["auvs.count=7", "survey.side_m=140", "duration_s=200", "asvs.count=3"]
    return load_scenario("quickstart", overrides=[*own, "acoustics.hf.range_m=45", *changes])


@pytest.fixture(scope="module")
def answers() -> dict[str, tuple[Any, Any, dict[str, Any]]]:
    """What is predicted of each plan, by Python and by the page."""
    questions, expected = [], []
    rng = np.random.default_rng(4)
    for changes in VARIED.values():
        scenario = plan(changes)
        inputs, stations = inputs_of(Setup(scenario)), np.array(Setup(scenario).stations_m)
        stations = stations + rng.normal(0.0, 5.0, stations.shape)
        places = rng.uniform(-90.0, 90.0, (40, 2))
        expected.append((predict(inputs, stations), error_map(inputs, stations, places).error_m))
        question = {"inputs": inputs.plain(), "stations": stations.tolist()}
        questions.append({**question, "places": places.tolist()})
    found = asked(questions)
    return {name: (*both, it) for name, both, it in zip(VARIED, expected, found, strict=True)}


def numbers(values: Any) -> np.ndarray:
    """Return numbers of JSON, nan for null."""
    return np.array(values, dtype=np.float64)


@pytest.mark.parametrize("name", VARIED)
def test_the_page_predicts_as_python(answers: dict[str, Any], name: str) -> None:
    """To 1e-6 of each number; what has no value has none in both."""
    expected, field, found = answers[name]
    for metric in METRICS:
        own = getattr(expected, metric)
        assert numbers(found[metric]) == pytest.approx(own, rel=1e-6, abs=1e-12, nan_ok=True), (
            metric
        )
    for metric in METRICS[:8]:
        assert found["worst"][metric] == pytest.approx(expected.worst(metric), rel=1e-6), metric
    assert numbers(found["map"]) == pytest.approx(field, rel=1e-6, nan_ok=True)
    served = name not in ("nobody hears", "no fixes")
    assert (field < field.max()).any() == served
    assert (expected.hf_coverage.max() > 0.0) == (name != "nobody hears")


def test_ranges_and_gains_change_as_in_python() -> None:
    """What sliders set is what the scenario with that range, and that gain, is predicted as."""
    scenario = plan(["navigation.filter=fixed_gain"])
    changes = ["acoustics.mf.range_m=80", "acoustics.hf.range_m=40", "navigation.filter.gain=0.4"]
    changed = plan(["navigation.filter=fixed_gain", *changes])
    inputs, stations = inputs_of(Setup(scenario)), Setup(scenario).stations_m
    equipment = {"hf": 40.0, "mf": 80.0, "gain": 0.4}
    question = {"inputs": inputs.plain(), "stations": stations, "equipment": equipment}
    (found,) = asked([question])
    expected = predict(inputs_of(Setup(changed)), stations)
    for metric in METRICS:  # tables of what depends on distance have other steps, by the range
        assert numbers(found[metric]) == pytest.approx(getattr(expected, metric), rel=1e-4), metric


@pytest.mark.parametrize(("hf", "mf"), [(30.0, 100.0), (66.0, 100.0), (45.0, 60.0)])
def test_the_command_of_a_slider_flies_what_the_page_predicts(hf: float, mf: float) -> None:
    """A sonar's threshold is that at the range unless it is given: the command gives it."""
    sonar = [f"acoustics.{it}.channel=sonar" for it in ("hf", "mf")]
    scenario = plan(["acoustics.mf.range_m=100", *sonar])
    inputs, stations = (
        inputs_of(Setup(scenario)).plain(),
        [list(it) for it in Setup(scenario).stations_m],
    )
    chart = {"centre": [0.0, 0.0], "stations": stations, "inputs": inputs}
    keys, worst = moved({**chart, "variants": [], "variant_of": {}, "filters": {}}, hf=hf, mf=mf)
    own = ["acoustics.mf.range_m=100", *sonar, *(f"{key}={value}" for key, value in keys)]
    flown = plan(own)
    assert (flown.acoustics.hf.range_m, flown.acoustics.mf.range_m) == (hf, mf)
    expected = predict(inputs_of(Setup(flown)), Setup(flown).stations_m).worst("position_error_m")
    assert worst == pytest.approx(expected, rel=2e-3)  # tables have other steps


def test_slower_rounds_are_predicted_where_ranges_are_longer() -> None:
    """The slider of the HF range does not only reach further, its slots last longer."""
    inputs, stations = inputs_of(Setup(plan([]))).plain(), Setup(plan([])).stations_m
    far = {"hf": 120.0, "mf": 500.0, "gain": 0.9}
    near, wide = asked([
        {"inputs": inputs, "stations": stations},
        {"inputs": inputs, "stations": stations, "equipment": far},
    ])  # fmt: skip
    assert min(wide["hf_coverage"]) > min(near["hf_coverage"])
    assert max(wide["fix_rate_hz"]) < max(near["fix_rate_hz"])
