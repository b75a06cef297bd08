"""Carrier sense: an AUV that hears another's ping holds back, by the rule and by nothing else."""

from bisect import bisect_right
from itertools import takewhile
from math import exp
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from test_aloha import crowd, share_heard
from worlds import merged, packets_of, scenario

from bindusbl_des import Mission, Scenario, simulate, travel_time

SPEED, PING_S = 1500.0, 0.010
CURVE = "bindusbl_des/models/presets/ahoi_delivery.csv"


def sensing(
    every_s: float, window: int = 4, slot_s: float | None = 0.03, **changes: Any
) -> Scenario:
    """AUVs over one another's lanes, some of which hear each other some of the time."""
    base = {
        "duration_s": 20.0,
        "survey": {"side_m": 120.0},
        "auvs": {"count": 5, "speed_m_per_s": 3.0},
        "asvs": {"count": 1},
        "protocol": {
            "schedule": {"model": "csma", "window": window, "slot_s": slot_s},
            "frame_s": every_s,
        },
    }
    return scenario(**merged(base, changes))


def flown(plan: Scenario, seed: int) -> tuple[list[list[float]], list[list[tuple[float, float]]]]:
    """Return when each AUV pinged, with how long it had waited, and when others' pings arrived at
    it, by the light-time equation alone.
    """
    mission = Mission(plan, seed)
    result = mission.result()
    vehicles = mission._world.auv_fleet.vehicles
    pings = result.tables["pings"]
    sent = list(zip(pings.auv.str[3:].astype(int), pings.sent_at_s, pings.waited_s, strict=True))
    own: list[list[tuple[float, float]]] = [[] for _ in vehicles]
    heard: list[list[float]] = [[] for _ in vehicles]
    for auv, at, waited in sent:
        own[auv].append((at, waited))
        here = vehicles[auv].at(at)
        for other, vehicle in enumerate(vehicles):
            there = vehicle.at(at)
            away = np.hypot(there.x - here.x, there.y - here.y)
            if other != auv and away <= plan.acoustics.hf.range_m:
                heard[other].append(at + travel_time(here, vehicle.at, at, SPEED))
    return [sorted(it) for it in heard], own


def quiet_s(begun: list[float], since: float, until: float) -> float:
    """Return how long (s) nothing is heard between two instants (s), of pings that begin then."""
    edges = sorted((max(at, since), min(at + PING_S, until)) for at in begun)
    quiet, reached = 0.0, since
    for begins, ends in edges:
        if ends > since and begins < until:
            quiet += max(begins - reached, 0.0)
            reached = max(reached, ends)
    return quiet + max(until - reached, 0.0)


@given(
    seed=st.integers(0, 2**16),
    every_s=st.sampled_from([0.04, 0.1, 0.4]),
    window=st.sampled_from([1, 2, 7]),
    places=st.none() | st.integers(0, 2**16),
)
@settings(max_examples=15, deadline=None)
def test_an_auv_pings_by_the_rule_and_by_nothing_else(
    seed: int, every_s: float, window: int, places: int | None
) -> None:
    """Of every ping: when there was one to send, that it never begins while another is heard, that
    it is sent at once in quiet, and else after a whole number of slots of quiet below the window.
    """
    slot_s, changes = 0.021, {"duration_s": 6.0}
    if places is not None:
        spots = np.random.default_rng(places).uniform(-55.0, 55.0, (5, 2)).tolist()
        changes["auvs"] = {"route": {"kind": "hold", "positions_m": spots}}
    plan = sensing(every_s, window, slot_s, **changes)
    heard, own = flown(plan, seed)
    packets = packets_of(plan, seed, 400)
    for auv, sent in enumerate(own):
        instants = list(takewhile(lambda it: it < 6.0, packets[auv]))
        before = -1.0
        for at, waited in sent:
            packet = instants[bisect_right(instants, before)]
            assert at - waited == pytest.approx(packet, abs=1e-9)
            begun = [*heard[auv], *([before] if before >= 0.0 else [])]
            assert not any(it + 1e-9 < at < it + PING_S - 1e-9 for it in begun)
            was_busy = any(it + 1e-9 < packet < it + PING_S - 1e-9 for it in begun)
            assert was_busy or waited == 0.0
            if waited > 0.0:
                slots = quiet_s(begun, packet, at) / slot_s
                assert slots == pytest.approx(round(slots), abs=1e-6)
                assert 0 <= round(slots) < window
            before = at


def test_slots_are_drawn_evenly_and_by_a_stream_of_their_own() -> None:
    """All numbers of slots below the window come as often; a further AUV changes no one's."""
    places = [[0.0, 0.0], [20.0, 0.0]]
    still = {"auvs": {"count": 2, "route": {"kind": "hold", "positions_m": places}}}
    heard, own = flown(sensing(0.05, 4, 0.02, duration_s=60.0, **still), 1)
    drawn = []
    for auv, sent in enumerate(own):
        before = -1.0
        for at, waited in sent:
            if waited > 0.0:
                drawn.append(round(quiet_s([*heard[auv], before], at - waited, at) / 0.02))
            before = at
    counts = np.bincount(drawn, minlength=4)
    assert len(drawn) > 300
    assert counts == pytest.approx(len(drawn) / 4, abs=4.0 * np.sqrt(len(drawn) * 3 / 16))


def test_who_hears_nobody_pings_as_in_aloha() -> None:
    """Two AUVs 60 m apart, of whom the ASV between them hears both: hidden terminals."""
    hidden = {
        "survey": {"side_m": 100.0},
        "auvs": {"route": {"kind": "hold", "positions_m": [[-30.0, 0.0], [30.0, 0.0]]}},
    }
    plan = crowd(2, "csma", 0.25, 20_000, **hidden)
    assert share_heard(simulate(plan, 1)) == pytest.approx(exp(-2.0 * PING_S / 0.25), rel=0.01)
    hearing = merged(hidden, {"acoustics": {"hf": {"range_m": 61.0}}})
    shares = [
        share_heard(simulate(crowd(2, "csma", 0.1, 4_000, **it), 1)) for it in (hidden, hearing)
    ]
    assert shares[1] > shares[0] + 0.02  # 40 ms late, so that not all is avoided


def test_side_by_side_only_equal_backoffs_collide() -> None:
    """AUVs at one place hear each other at once: with many slots to draw hardly any collide."""
    many = {"protocol": {"schedule": {"model": "csma", "window": 1000, "slot_s": 0.02}}}
    one = {"protocol": {"schedule": {"model": "csma", "window": 1}}}
    loss = [
        1.0 - share_heard(simulate(crowd(4, "csma", 0.1, 4_000, **it), 1)) for it in (one, many)
    ]
    assert loss[0] > 0.05  # all who wait for the end of a ping begin with it
    assert loss[1] < 0.01


@pytest.mark.parametrize(
    "changes",
    [
        {"acoustics": {"hf": {"channel": {"model": "curve", "file": CURVE}}}},
        {"acoustics": {"hf": {"channel": "sonar", "range_metric": "slant"}}},
        pytest.param(
            {"acoustics": {"hf": {"channel": {"model": "sonar", "bottom_m": 30.0}}}},
            marks=pytest.mark.slow,
        ),
        {"auvs": {"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.6}},
    ],
    ids=["curve", "sonar", "echoes", "steered"],
)
def test_any_channel_and_vehicle_will_do(changes: dict[str, Any]) -> None:
    """AUVs hold back, and stopping to look changes nothing."""
    plan = sensing(0.1, **merged(changes, {"duration_s": 5.0}))
    result, mission = simulate(plan, 1), Mission(plan, 1)
    assert (result.tables["pings"].waited_s > 0.0).sum() > 10
    for instant in (0.7, 2.2, 2.3):
        mission.advance(instant)
        mission.auvs()
    other = mission.result()
    assert all(table.equals(other.arrow[name]) for name, table in result.arrow.items())


def test_sounds_too_weak_to_decode_are_heard() -> None:
    """A curve's sounds drown others up to `interference_m`: so far AUVs hold back as well."""
    places = [[-150.0, 0.0], [150.0, 0.0]]
    waits = []
    for reach in (150.0, 400.0):
        curve = {"model": "curve", "file": CURVE, "interference_m": reach}
        plan = sensing(
            0.1,
            duration_s=60.0,
            survey={"side_m": 400.0},
            auvs={"count": 2, "route": {"kind": "hold", "positions_m": places}},
            acoustics={"hf": {"channel": curve}},
        )
        pings = simulate(plan, 1).tables["pings"]
        waits.append((pings.waited_s > PING_S).sum())
    assert waits[1] > 1.5 * waits[0] > 0  # who pings itself waits in any case


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"model": "csma", "windw": 3}, "did you mean 'window'"),
        ({"model": "csma", "window": 0}, "must be >= 1; got 0"),
        ({"model": "csma", "slot_s": 0.0}, "must be > 0; got 0"),
        ({"model": "aloha", "window": 3}, "remove it, or choose csma, aloha has no such setting"),
    ],
)
def test_settings_are_checked(given: dict[str, Any], told: str) -> None:
    """A setting that is wrong is told with its value and the remedy."""
    with pytest.raises(ValidationError, match=told):
        scenario(protocol={"schedule": given})
