"""Range rates: what is measured of a ping by its Doppler shift, and what filters make of it."""

from math import dist
from typing import Any

import numpy as np
import pytest
from explain_for_tests import chain_of_fix

from bindusbl_des import Mission, Scenario, simulate, verify

RANGINGS = ("owtt_sync", "twtt", "passive")


def scenario(sd: float | None = 0.0, **keys: Any) -> Scenario:
    usbl = {} if sd is None else {"range_rate_sd_m_per_s": sd}
    return Scenario.model_validate({"name": "rates", "duration_s": 60, "usbl": usbl} | keys)


def where(mission: Mission, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the true places of AUVs and ASVs (m) at an instant, x, y, z."""
    mission.advance(time)
    return mission.auvs().truth[:, :3], mission.asvs()[:, :3]


@pytest.mark.parametrize("ranging", RANGINGS)
@pytest.mark.parametrize("vehicle", ["kinematic", "bluerov2"])
def test_a_rate_is_the_finite_difference_of_the_range(ranging: str, vehicle: str) -> None:
    """Of the true way, by where both were shortly before and after: of the sender as it pinged, of
    the receiver as the ping was there.
    """
    world = scenario(
        protocol={"ranging": ranging}, auvs={"vehicle": vehicle, "count": 2}, duration_s=20,
        asvs={"count": 2, "vehicle": "otter"}, environment={"current_m_per_s": 0.1},
        survey={"side_m": 40},
    )  # fmt: skip
    result = simulate(world, 1)
    sent = result.tables["pings"].set_index("ping").sent_at_s
    heard = result.tables["receptions"].query("outcome == 'heard'").iloc[2:20:2]
    assert len(heard) > 6
    step, instants = 0.02, set[float]()
    for row in heard.itertuples():
        at = float(sent[row.ping]), float(row.arrived_at_s)
        instants |= {t + off for t in at for off in (-step, 0.0, step)}
    mission = Mission(world, 1)
    places = {time: where(mission, time) for time in sorted(instants)}
    for row in heard.itertuples():
        auv, asv = int(row.auv[3:]), int(row.asv[3:])
        by_auv, by_asv = float(sent[row.ping]), float(row.arrived_at_s)
        if ranging == "passive":
            by_auv, by_asv = by_asv, by_auv
        after, before = [
            dist(places[by_auv + off][0][auv], places[by_asv + off][1][asv])
            for off in (step, -step)
        ]
        assert row.range_rate_m_per_s == pytest.approx((after - before) / (2 * step), abs=2e-3)


def test_nothing_else_changes_and_noise_is_as_large_as_stated() -> None:
    silent, exact, noisy = [simulate(scenario(sd), 3) for sd in (None, 0.0, 0.1)]
    for name, table in silent.tables.items():
        for other in (exact, noisy):
            kept = [column for column in table if column != "range_rate_m_per_s"]
            assert table[kept].equals(other.tables[name][kept]), name
    assert silent.tables["receptions"].range_rate_m_per_s.isna().all()
    rates = [each.tables["receptions"].range_rate_m_per_s for each in (exact, noisy)]
    heard = noisy.tables["receptions"].outcome == "heard"
    assert rates[1].notna().equals(heard)
    off = (rates[1] - rates[0])[heard]
    assert 0.08 < off.std() < 0.12
    assert abs(off.mean()) < 0.04


def test_a_sound_speed_taken_too_high_tells_rates_too_large() -> None:
    """What is measured is a ratio of frequencies."""
    water = {"sound_speed_m_per_s": 1500.0, "assumed_sound_speed_m_per_s": 1515.0}
    true, told = [
        simulate(scenario(environment=each, duration_s=2), 0).tables["receptions"].query("ping < 2")
        for each in ({}, water)
    ]
    rates = true.range_rate_m_per_s.dropna()
    assert len(rates) > 1
    assert np.allclose(told.range_rate_m_per_s.dropna(), 1.01 * rates, rtol=1e-9)


def flown(range_rate: bool, seeds: range, model: str = "kalman", **navigation: Any) -> np.ndarray:
    world = scenario(
        0.02, duration_s=200, record={"detail": "summary"},
        navigation={"filter": {"model": model, "range_rate": range_rate}} | navigation,
    )  # fmt: skip
    rows = [simulate(world, seed).auvs for seed in seeds]
    return np.array([(auvs.position_error_m.mean(), auvs.nees.mean()) for auvs in rows])


WANDERING = {
    "random_walk_m_per_sqrt_s": 0.005, "velocity_bias_m_per_s": [0.0, 0.0],
    "velocity_bias_sd_m_per_s": 0.06, "velocity_bias_time_constant_s": 60.0,
}  # fmt: skip


@pytest.mark.parametrize("model", ["kalman", "smoother"])
def test_a_bias_that_wanders_is_known_better_and_ellipses_stay_right(model: str) -> None:
    """Pairs of missions with the same noise, of which one takes the rates in."""
    without, with_rates = [flown(rates, range(16), model, **WANDERING) for rates in (False, True)]
    gained = without[:, 0] - with_rates[:, 0]
    least = 2.0 if model == "kalman" else 0.0  # who knows what came later gains less
    assert gained.mean() > least * gained.std(ddof=1) / np.sqrt(len(gained))
    assert 1.8 < with_rates[:, 1].mean() < 2.25


def test_rates_that_say_nothing_change_nothing() -> None:
    """Noise of 100 m/s leaves the estimate where it was."""
    worlds = [
        scenario(100.0, navigation={"filter": {"model": "kalman", "range_rate": rates}})
        for rates in (False, True)
    ]
    one, other = [simulate(world, 0).auvs.position_error_m for world in worlds]
    assert np.allclose(one, other, rtol=1e-4)
    assert not one.equals(other)


LIMITED = {"model": "disc", "doppler_limit_m_per_s": 0.4}


@pytest.mark.parametrize("ranging", RANGINGS)
def test_pings_are_lost_whose_way_changes_too_fast(ranging: str) -> None:
    keys = {"protocol": {"ranging": ranging}}
    free = simulate(scenario(**keys), 1).tables["receptions"]
    result = simulate(scenario(acoustics={"hf": {"channel": LIMITED}}, **keys), 1)
    cut, calls = result.tables["receptions"], result.tables["pings"].call_why
    lost = cut[cut.why == "doppler"]
    if ranging == "twtt":
        assert (calls == "doppler").sum() > 20
    else:
        assert set(lost.outcome) == {"lost"}
        both = lost.merge(free, on=["ping", "auv", "asv"], suffixes=("", "_free"))
        rates = both.range_rate_m_per_s_free[both.outcome_free == "heard"].abs()
        assert len(rates) > 30
        assert rates.min() > 0.399
    assert cut.range_rate_m_per_s.abs().max() <= 0.401
    assert lost.loss_probability.isna().all()


def test_frames_are_lost_and_explained() -> None:
    result = simulate(scenario(acoustics={"mf": {"channel": LIMITED}}), 1)
    lost = result.tables["frame_receptions"].query("why == 'doppler'")
    fixes = result.tables["fixes"].query("outcome == 'lost'")
    assert len(lost) >= len(fixes) > 5
    assert fixes.delivered_at_s.isna().all()
    told = chain_of_fix(result, int(fixes.fix.iloc[0])).text()
    assert "either way is lost to Doppler (doppler_limit_m_per_s)" in " ".join(told.split())


def test_signals_of_programs_are_lost_as_well() -> None:
    keys = {"protocol": {"access": "macau", "frame_s": 5}}
    result = simulate(scenario(acoustics={"hf": {"channel": LIMITED}}, **keys), 1)
    assert (result.tables["signal_receptions"].why == "doppler").any()


def test_data_and_frames_of_auvs_are_lost_as_well() -> None:
    """Where the way changes faster than the limit, by the tracks; data only for that reason."""
    keys = {
        "duration_s": 120.0,
        "traffic": {"bytes": 16, "every_s": 4.0},
        "protocol": {"relay": {"hops": 1}},
        "asvs": {"formation": {"model": "ring", "radius_m": 50.0}},
        "record": {"tracks_hz": 10.0},
    }
    hf = {"bit_rate_bps": 4000.0, "range_m": 200.0}
    heard = {}
    for limit in (None, 0.4):
        channel = {"model": "disc", "doppler_limit_m_per_s": limit}
        acoustics = {
            "loss": {"law": "none"},
            "hf": {**hf, "channel": channel},
            "mf": {"channel": channel},
        }
        result = simulate(scenario(**keys, acoustics=acoustics), 1)
        heard[limit] = result.tables["packets"].heard_by.to_numpy()
    assert set(heard[None]) == {3}  # all vessels
    assert (heard[0.4] < 3).mean() > 0.2
    met = result.tables["auv_frame_receptions"]
    frames = result.tables["auv_frames"].iloc[met.auv_frame]
    tracks = dict(list(result.tables["tracks"].groupby("vehicle")))

    def place(vehicle: str, time: float) -> np.ndarray:
        rows = tracks[vehicle]
        return np.array(
            [np.interp(time, rows.time_s, rows[axis]) for axis in ("x_m", "y_m", "z_m")]
        )

    rates = {"doppler": [], "heard": []}
    for sender, time, row in zip(frames.auv, frames.sent_at_s, met.itertuples(), strict=True):
        away = [
            np.linalg.norm(place(sender, at) - place(row.listener, at))
            for at in (time - 0.05, time + 0.05)
        ]
        word = row.outcome if row.outcome == "heard" else row.why
        if word in rates and time > 0.1:
            rates[word].append(abs(away[1] - away[0]) / 0.1)
    assert min(map(len, rates.values())) > 20
    assert min(rates["doppler"]) > 0.38
    assert max(rates["heard"]) < 0.42


def test_a_modem_states_its_limit() -> None:
    """The data sheet of uWAVE states 1 m/s; a limit that is given wins."""
    keys = {"auvs": {"speed_m_per_s": 1.5}}
    own = {"modem": "uwave", "range_m": 50.0}
    result = simulate(scenario(acoustics={"hf": own}, **keys), 0)
    assert (result.tables["receptions"].why == "doppler").any()
    own["channel"] = {"model": "disc", "doppler_limit_m_per_s": 5.0}
    result = simulate(scenario(acoustics={"hf": own}, **keys), 0)
    assert not (result.tables["receptions"].why == "doppler").any()


def test_a_limit_that_can_strike_leaves_the_verdict_open() -> None:
    safe = {"protocol": {"schedule": "one_per_slot"}}
    for limit, verdict in ((0.5, "undecided"), (0.7, "accepted")):
        channel = {"model": "disc", "doppler_limit_m_per_s": limit}
        found = verify(scenario(acoustics={"hf": {"channel": channel}}, **safe))
        assert found.verdict == verdict
