"""Loss and travel time of sound against outside numbers."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq  # type: ignore[import-untyped,unused-ignore]

from bindusbl_des import range_loss, travel_time
from bindusbl_des.core.acoustics.loss import COMBINERS, LOSS_LAWS, contention_loss, loss_law

CHECKS = json.loads((Path(__file__).parents[1] / "reference" / "physics_checks.json").read_text())
C = 1500.0  # m/s, the paper's sound speed
CAP = 0.999  # eq. fix_loss_total
ranges = st.floats(0.0, 2000.0)
metres = st.floats(-5e3, 5e3)
speeds = st.floats(-10.0, 10.0)


def check(name: str) -> float:
    return float(CHECKS[name]["value"])


@pytest.mark.parametrize(
    ("slant_range", "paper", "thesis", "head"),
    [
        (0.0, -0.083000000, -0.082903574, 0.003700000),
        (25.0, -0.066967456, -0.066998320, 0.005716363),
        (30.0, -0.063519142, -0.063576654, 0.006235962),
        (50.0, -0.048873188, -0.049041389, 0.008831570),
        (100.0, -0.005761561, -0.006236467, 0.021080171),
        (110.0, 0.004077259, 0.003535624, 0.025086574),
        (150.0, 0.047955030, 0.047127491, 0.050316488),
        (200.0, 0.114151180, 0.112921177, 0.120100972),
        (250.0, 0.194993118, 0.193306925, 0.286670313),
        (300.0, 0.292981075, 0.290781175, 0.684256481),
    ],
)
def test_loss_table(slant_range: float, paper: float, thesis: float, head: float) -> None:
    """Pings are lost with range as each published set of coefficients says."""
    for law, value in (("paper", paper), ("thesis", thesis), ("head", head), ("none", 0.0)):
        assert range_loss(slant_range, LOSS_LAWS[law]) == pytest.approx(value, abs=1e-9)
    assert range_loss(slant_range) == pytest.approx(paper, abs=1e-9)  # as docs/model.md says


@pytest.mark.parametrize("name", [name for name in CHECKS if name.startswith("ploss_raw")])
def test_loss_checks(name: str) -> None:
    """The loss law agrees with independent values to nine digits."""
    law, _, slant_range = name.removeprefix("ploss_raw_").rstrip(")").partition("(")
    coefficients = LOSS_LAWS["thesis" if law == "full" else law]
    assert range_loss(float(slant_range), coefficients) == pytest.approx(check(name), rel=1e-9)


@pytest.mark.parametrize(
    ("law", "zero", "certain"),
    [
        ("paper", check("ploss_zero_paper"), 517.6331238797),
        ("thesis", check("ploss_zero_full"), 518.7587087237),
    ],
)
def test_loss_starts_and_becomes_certain(law: str, zero: float, certain: float) -> None:
    """No ping is lost by range within 106 m, and every ping is beyond 519 m."""
    assert brentq(lambda r: range_loss(r, LOSS_LAWS[law]), 50, 200) == pytest.approx(zero, rel=1e-9)
    assert range_loss(certain, LOSS_LAWS[law]) == pytest.approx(1.0, rel=1e-9)


def test_head_loses_everything_at_322_metres() -> None:
    """The OEM head's pings are certainly lost from 321.8 m on."""
    assert range_loss(321.8058885, LOSS_LAWS["head"]) == pytest.approx(1.0, abs=1e-8)


@given(ranges, st.floats(1.0, 5000.0))
def test_a_scaled_law_costs_at_its_range_what_the_papers_costs_at_100_metres(
    slant_range: float, hf_range: float
) -> None:
    """It is the paper's own up to 100 m, and beyond it at r 100 m / R_HF, wherever that is cut."""
    equivalent = slant_range * min(1.0, 100.0 / hf_range)
    expected = range_loss(equivalent, LOSS_LAWS["paper"])
    found = range_loss(slant_range, loss_law("scaled", hf_range))
    assert found == pytest.approx(expected, abs=1e-9)
    if hf_range <= 100.0:
        assert found == range_loss(slant_range, LOSS_LAWS["paper"])


@given(ranges, ranges)
def test_loss_never_falls_with_range(one: float, other: float) -> None:
    """A ping from farther away is never lost less often, and beyond 800 m equally often."""
    near, far = sorted((one, other))
    for law in LOSS_LAWS.values():
        # two terms of up to 40 that nearly cancel leave their rounding
        assert range_loss(near, law) <= range_loss(far, law) + 1e-13
        assert range_loss(800.0 + far, law) == range_loss(800.0, law)


@pytest.mark.parametrize(
    ("auv_count", "clamped", "raw"),
    [(3, 0.10, 0.051127), (4, 0.15, 0.101127), (6, 0.25, 0.201127), (10, 0.45, 0.401127)],
)
def test_contention_at_the_edge_of_hf_range(auv_count: int, clamped: float, raw: float) -> None:
    """At 50 m a fleet's contention is taken whole, or less the negative law, or not at all."""
    loss, contention = range_loss(50.0, LOSS_LAWS["paper"]), contention_loss(auv_count)
    assert COMBINERS["clamp_first"](loss, contention, CAP) == pytest.approx(clamped, abs=1e-12)
    assert COMBINERS["paper_raw"](loss, contention, CAP) == pytest.approx(raw, abs=1e-6)
    assert COMBINERS["off"](loss, contention, CAP) == 0.0


@given(ranges, st.integers(1, 60), st.floats(0.0, 1.0))
def test_combined_loss_is_a_probability(slant_range: float, auv_count: int, cap: float) -> None:
    """Whatever range, fleet and cap, a ping is lost with a probability between 0 and the cap."""
    for law in LOSS_LAWS.values():
        loss, contention = range_loss(slant_range, law), contention_loss(auv_count)
        values = {name: f(loss, contention, cap) for name, f in COMBINERS.items()}
        assert all(0.0 <= value <= cap for value in values.values())
        assert values["off"] <= values["clamp_first"]
        # beyond certain loss the literal sum may exceed the clamped one, by the clamp alone
        assert values["paper_raw"] <= values["clamp_first"] + 0.001 + 1e-12


def test_far_pings_of_a_lone_auv() -> None:
    """A lone AUV at 600 m loses 999 of 1000 pings under every combiner."""
    loss = range_loss(600.0, LOSS_LAWS["thesis"])
    assert loss > 1.0
    assert {f(loss, contention_loss(1), CAP) for f in COMBINERS.values()} == {CAP}
    assert COMBINERS["clamp_first"](loss, contention_loss(1), 1.0) == 0.999  # by range alone
    assert COMBINERS["off"](loss, contention_loss(1), 1.0) == 1.0


# |d|, |v| and the delay of physics' light-time table
LIGHT_TIMES = [
    ((100.0, 0.0, 0.0), (1.5, 0.0, 0.0), 0.066733400066733),
    ((100.0, 0.0, 0.0), (-1.5, 0.0, 0.0), 0.066600066600067),
    ((100.0, 0.0, 0.0), (0.0, 1.5, 0.0), 0.066666700000025),
    ((50.0, 0.0, 10.0), (1.5, 0.0, 0.0), 0.034026830130395),
    ((1000.0, 0.0, 0.0), (1.5, 0.0, 0.0), 0.667334000667334),
]
Vector = tuple[float, float, float]


def closed_form(offset: Sequence[float], velocity: Sequence[float]) -> float:
    """Return the delay D with |d + v D| = c D, of sound to a receiver that keeps its course."""
    receding = sum(d * v for d, v in zip(offset, velocity, strict=True))
    excess, distance = C**2 - math.hypot(*velocity) ** 2, math.hypot(*offset)
    root = math.sqrt(receding**2 + excess * distance**2)
    if receding >= 0.0:
        return (receding + root) / excess
    return distance**2 / (root - receding)  # the same, without a difference of near equals


@pytest.mark.parametrize(("offset", "velocity", "delay"), LIGHT_TIMES)
def test_light_time_table(offset: Vector, velocity: Vector, delay: float) -> None:
    """A ping meets a receding, closing or crossing AUV when the closed form says."""
    assert closed_form(offset, velocity) == pytest.approx(delay, abs=1e-15)

    def receiver_at(time: float) -> Vector:
        x, y, z = (d + v * (time - 20.0) for d, v in zip(offset, velocity, strict=True))
        return x, y, z

    assert travel_time((0.0, 0.0, 0.0), receiver_at, 20.0, C) == pytest.approx(delay, abs=1e-13)


@pytest.mark.parametrize("name", [name for name in CHECKS if name.startswith("light_time")])
def test_light_time_checks(name: str) -> None:
    """Travel times agree with independent values to twelve digits."""
    offset, velocity = (
        [float(number) for number in part.split(",")]
        for part in name.removeprefix("light_time(").rstrip(")").split(")(")
    )
    assert closed_form(offset, velocity) == pytest.approx(check(name), rel=1e-12)


@given(st.tuples(metres, metres, metres), st.tuples(speeds, speeds, speeds), st.floats(0.0, 1e3))
def test_sound_arrives_where_the_receiver_is(offset: Vector, velocity: Vector, sent: float) -> None:
    """When the sound arrives, the receiver is exactly as far as sound has travelled."""
    source = (7.0, -8.0, 9.0)

    def receiver_at(time: float) -> Vector:
        x, y, z = (
            s + d + v * (time - sent) for s, d, v in zip(source, offset, velocity, strict=True)
        )
        return x, y, z

    delay = travel_time(source, receiver_at, sent, C)
    assert delay == pytest.approx(closed_form(offset, velocity), abs=1e-12)
    assert math.dist(receiver_at(sent + delay), source) == pytest.approx(C * delay, abs=1e-8)


def test_sound_meets_a_circling_auv() -> None:
    """A ping meets an AUV on a circle where both equations of motion agree."""

    def circling(time: float) -> tuple[float, float, float, float]:
        return 80.0 + 20.0 * math.cos(0.1 * time), 20.0 * math.sin(0.1 * time), 10.0, 0.0

    def mismatch(delay: float) -> float:
        return math.dist(circling(50.0 + delay)[:3], (0.0, 0.0, 0.0)) - C * delay

    exact = brentq(mismatch, 0.0, 1.0, xtol=1e-15, rtol=1e-15)
    source = (0.0, 0.0, 0.0, 3.0)  # what follows x, y, z is a heading and does not matter
    assert travel_time(source, circling, 50.0, C) == pytest.approx(exact, abs=1e-13)


def test_still_receiver_is_asked_twice() -> None:
    """A moored ASV is asked for its place twice, and the delay is the distance over the speed."""
    asked: list[float] = []

    def moored(time: float) -> Vector:
        asked.append(time)
        return 30.0, 40.0, 0.0

    assert travel_time((0.0, 0.0, 0.0), moored, 5.0, C) == 50.0 / C
    assert len(asked) == 2


def test_a_receiver_at_the_source_hears_at_once() -> None:
    """Sound needs no time to where it already is."""
    assert travel_time((1.0, 2.0, 3.0), lambda _: (1.0, 2.0, 3.0), 0.0, C) == 0.0


def test_impossible_losses_are_refused() -> None:
    """No ping comes from a negative range, from nobody or with a chance above one."""
    for wrong in (-1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match=f"slant range .* met {wrong}; give it in metres"):
            range_loss(wrong)
    with pytest.raises(ValueError, match=r"AUV count must be at least 1; met 0"):
        contention_loss(0)
    with pytest.raises(ValueError, match=r"lie in \[0, 1\]; met 5"):
        contention_loss(3, 5.0)


def test_impossible_journeys_are_refused() -> None:
    """Sound cannot stand still, catch what is faster or find what is nowhere."""
    origin = (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"sound speed must be positive and finite; met 0.0"):
        travel_time(origin, lambda _: origin, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"slower than sound"):
        travel_time(origin, lambda t: (1.0 + 1600.0 * t, 0.0, 0.0), 0.0, C)
    with pytest.raises(ValueError, match=r"finite position"):
        travel_time(origin, lambda _: (math.nan, 0.0, 0.0), 0.0, C)


@pytest.mark.parametrize("speed", [5.132958340602671, -16.823618711636165, 20.0])
def test_sound_goes_on_to_who_is_a_thousand_kilometres_away(speed: float) -> None:
    """Places there are known to 1e-10 m only, so that no delay settles to 1e-13 s."""
    for n in range(200):
        away = 6e5 + 4e5 * n / 200 + n * math.pi
        found = travel_time((1.1, 0.3, 0.0), lambda t, x=away: (x + speed * t, x / 3, 0.0), 7.0, C)
        ahead, aside = away + speed * 7.0 - 1.1, away / 3 - 0.3
        square, product = C * C - speed * speed, ahead * speed
        exact = (product + math.sqrt(product**2 + square * (ahead**2 + aside**2))) / square
        assert found == pytest.approx(exact, rel=1e-13)
