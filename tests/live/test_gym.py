"""Environments to learn in: as Gymnasium has them, seeded, and missions like any other."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test

import bindusbl_des.gym
from bindusbl_des import Mission, Scenario, Setup
from bindusbl_des.gym import GymVessels, Placement, Schedule

NAMES = ("Placement-v0", "Schedule-v0")


def short() -> Scenario:
    return Scenario(name="short", duration_s=20.0)


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_finds_nothing_wrong(name: str) -> None:
    env = gymnasium.make(f"bindusbl_des.gym:{name}", scenario=short())
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


@pytest.mark.parametrize("name", NAMES)
def test_an_episode_is_a_mission(name: str) -> None:
    """Seeded, it repeats bit for bit; another seed is another mission; it ends with the mission."""

    def flown(seed: int) -> list[float]:
        env = gymnasium.make(name, scenario=short())
        env.action_space.seed(0)
        first, info = env.reset(seed=seed)
        assert env.observation_space.contains(first)
        assert first[-1] == 0.0  # of the mission's time
        assert info["seed"] >= 0
        found, is_over = [], False
        while not is_over:
            seen, reward, is_terminal, is_over, info = env.step(env.action_space.sample())
            assert env.observation_space.contains(seen)
            assert reward == -info["worst_error_m"]
            assert not is_terminal  # a limit of time truncates, as Gymnasium has it
            found += [float(reward), *seen.tolist()]
        assert seen[-1] == 1.0
        return found

    assert flown(1) == flown(1)
    assert flown(1) != flown(2)


def test_vessels_go_as_they_are_told() -> None:
    """North at full speed for a step, then not at all; never faster, also aslant."""
    env = Placement(short(), step_s=5.0, speed_m_per_s=2.0)
    env.reset(seed=0)
    count = env.scenario.asvs.count
    before = env._mission.asvs()[:, :2]
    env.step(np.array([1.0, 0.0] * count, np.float32))
    moved = env._mission.asvs()[:, :2] - before
    assert moved == pytest.approx(np.array([[10.0, 0.0]] * count), abs=0.7)
    env.step(np.array([1.0, 1.0] * count, np.float32))
    assert np.hypot(*env._vessels.velocity.T) == pytest.approx(np.full(count, 2.0))


@pytest.mark.parametrize("downlink", ["sequential", "direct_reply"])
def test_vessels_are_seen_to_know_what_they_measured(downlink: str) -> None:
    """Their newest fixes, whether or not AUVs have them yet: looked at in the midst of rounds, they
    are those that the mission has made by then; and looking changes nothing.
    """
    protocol = {"downlink": downlink}
    flown = Scenario(name="m", duration_s=20.0, protocol=protocol, asvs={"count": 3})
    env = Placement(flown, step_s=1.3)
    env.reset(seed=2)
    auvs, rest = flown.auvs.count, np.zeros(env.action_space.shape, np.float32)
    newest, is_over, undelivered = [], False, 0
    while not is_over:
        seen, _, _, is_over, _ = env.step(rest)
        ages = seen[-1 - auvs : -1] * bindusbl_des.gym.TIME_S
        newest.append((env._mission.time, env._mission.time - ages))
    fixes = env._mission.result().tables["fixes"]
    for time, pinged in newest[1:-1]:
        for auv in range(auvs):
            own = fixes[fixes.auv == f"AUV{auv}"]
            known = own[own.pinged_at_s <= pinged[auv] + 1e-3].pinged_at_s.max()
            assert pinged[auv] == pytest.approx(0.0 if np.isnan(known) else known, abs=1e-4)
            over = own[own.pinged_at_s < time - 0.1].pinged_at_s.max()  # has passed all by now
            assert np.isnan(over) or pinged[auv] >= over - 1e-3
            told = own[own.delivered_at_s <= time].pinged_at_s.max()
            undelivered += bool(pinged[auv] > (0.0 if np.isnan(told) else told) + 1e-3)
    assert undelivered > 5 or downlink == "direct_reply"
    alone = GymVessels(np.array(Setup(flown).stations_m), env._middle, 2.0 * env._scale)
    same = Mission(flown, env._mission.seed, poses=alone, pose_step_s=0.5).result()
    assert same.tables["fixes"].equals(fixes)


def test_who_is_chosen_pings() -> None:
    """A round each, in the order of the actions."""
    env = Schedule(short())
    env.reset(seed=0)
    chosen, is_over = [], False
    while not is_over:
        chosen.append(len(chosen) * 2 % 3)
        _, _, _, is_over, _ = env.step(np.int64(chosen[-1]))
    pings = env._mission.result().tables["pings"]
    wanted = ["AUV0", *(f"AUV{it}" for it in chosen)]
    assert pings.auv.tolist() == wanted[: len(pings)]
    assert len(pings) >= len(chosen) - 1


def test_environments_run_beside_each_other() -> None:
    """In processes of their own, seeded apart."""
    envs = gymnasium.make_vec(
        "bindusbl_des.gym:Placement-v0", num_envs=2, vectorization_mode="async", scenario=short()
    )
    try:
        envs.reset(seed=3)
        _, rewards, _, _, _ = envs.step(np.zeros(envs.action_space.shape, np.float32))
        assert rewards.shape == (2,)
        assert rewards[0] != rewards[1]
    finally:
        envs.close()


def test_what_cannot_be_learnt_in_is_refused() -> None:
    passive = Scenario(name="x", duration_s=20.0, protocol={"ranging": "passive"})
    for env in (Placement, Schedule):
        with pytest.raises(ValueError, match="vessels know of no fixes"):
            env(passive)
    with pytest.raises(ValueError, match="must be above 0"):
        Placement(short(), step_s=0.0)
    assert bindusbl_des.gym.MOST > 1.0


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_policy_that_learnt_beats_a_resting_ring() -> None:
    """20,000 steps of PPO on the failure scenario, judged on 10 missions that it has not seen: the
    worst AUV's error is less than half of that beside a vessel at rest.
    """
    ppo = pytest.importorskip("stable_baselines3").PPO
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import VecNormalize

    def error(policy: Any) -> float:
        env, found = gymnasium.make("Placement-v0"), []
        for seed in range(100, 110):
            seen, _ = env.reset(seed=seed)
            is_over = False
            while not is_over:
                seen, reward, _, is_over, _ = env.step(policy(seen))
                found.append(-float(reward))
        return float(np.mean(found))

    envs = make_vec_env(lambda: gymnasium.make("Placement-v0"), n_envs=4)
    learner = ppo(
        "MlpPolicy", VecNormalize(envs, norm_obs=False, gamma=0.95), seed=0, n_steps=256,
        batch_size=128, gamma=0.95, learning_rate=1e-3, device="cpu",
        policy_kwargs={"log_std_init": -0.5},
    )  # fmt: skip
    learner.learn(20_000)
    resting = error(lambda _: np.zeros(2, np.float32))
    assert error(lambda it: learner.predict(it, deterministic=True)[0]) < 0.5 * resting


def test_vessels_stay_about_a_survey_that_is_elsewhere() -> None:
    """Those that are told to stay do; they are seen as those of a survey about the origin."""
    seen = []
    for x, y in ((0.0, 0.0), (900.0, -400.0)):
        corners = [[x, y], [x + 100.0, y], [x + 100.0, y + 100.0], [x, y + 100.0]]
        env = Placement(Scenario(name="m", duration_s=20.0, survey={"polygon_m": corners}))
        first, _ = env.reset(seed=1)
        then = env.step(np.zeros(env.action_space.shape))[0]
        count = 2 * env.scenario.asvs.count
        assert then[:count] == pytest.approx(first[:count])
        seen.append(then)
    assert seen[0][:count] == pytest.approx(seen[1][:count], abs=1e-5)


def test_vessels_decide_each_for_itself() -> None:
    """PettingZoo finds nothing wrong; together they do what one does who moves all of them."""
    scenario = Scenario(name="short", duration_s=25.0, asvs={"count": 3})
    parallel_api_test(bindusbl_des.gym.Vessels(scenario), num_cycles=20)
    fleet, one = bindusbl_des.gym.Vessels(scenario), Placement(scenario)
    seen, infos = fleet.reset(seed=4)
    alone, info = one.reset(seed=4)
    assert infos == dict.fromkeys(fleet.agents, info)
    moves, lasts = np.random.default_rng(0).uniform(-1, 1, (3, 6)).astype(np.float32), []
    for move in moves:
        seen, rewards, ended, over, _ = fleet.step(
            {agent: move[2 * k : 2 * k + 2] for k, agent in enumerate(fleet.possible_agents)}
        )
        alone, reward, _, is_over, _ = one.step(move)
        assert set(rewards.values()) == {reward}
        assert not any(ended.values())
        assert set(over.values()) == {is_over}
        lasts.append(is_over)
        for k, agent in enumerate(fleet.possible_agents):
            assert seen[agent][:2].tolist() == alone[2 * k : 2 * k + 2].tolist()
            assert seen[agent][6:].tolist() == alone[6:].tolist()
    assert lasts == [False, False, True]
    assert fleet.agents == []
