"""What Stable-Baselines3 sees."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecNormalize

from flappy.sb3 import FlappyVecEnv

HOVER = "flappy/Hover-v0"
SHORT = ("task.end.time_s=0.05", "task.success.keep.from_s=0.03", "task.success.keep.until_s=0.05", "task.success.capture.by_s=0.03")


def test_single_environment_passes_their_checks() -> None:
    env = gymnasium.make("flappy:" + HOVER)
    check_env(env.unwrapped, warn=True, skip_render_check=True)
    env.close()


def test_rows_are_those_of_gymnasium() -> None:
    """Same seed and actions: the same observations, rewards, ends and last observations, bit for bit."""
    theirs, ours = gymnasium.make_vec("flappy:" + HOVER, num_envs=5), FlappyVecEnv(HOVER, 5)
    assert ours.seed(7) == [7] * 5
    observation, _ = theirs.reset(seed=7)
    np.testing.assert_array_equal(ours.reset(), observation)
    rng, ended = np.random.default_rng(0), 0
    for _ in range(400):
        action = rng.uniform(-1, 1, (5, 4)).astype(np.float32)
        observation, reward, terminated, truncated, info = theirs.step(action)
        row, gain, done, infos = ours.step(action)
        np.testing.assert_array_equal(row, observation)
        np.testing.assert_array_equal(gain, reward)
        np.testing.assert_array_equal(done, terminated | truncated)
        for i in range(5):
            assert bool(infos[i]) == done[i]
            if done[i]:
                ended += 1
                np.testing.assert_array_equal(infos[i]["terminal_observation"], info["final_obs"][i])
                assert infos[i]["TimeLimit.truncated"] == (truncated[i] and not terminated[i])
                assert infos[i]["episode"]["r"] == info["final_info"]["return"][i]
                assert infos[i]["episode"]["l"] == info["final_info"]["length"][i]
                assert infos[i]["is_success"] == info["final_info"]["is_success"][i]
    assert ended > 5
    ours.close()
    theirs.close()


def test_end_of_time_is_told_from_a_crash() -> None:
    short = FlappyVecEnv(HOVER, 3, overrides=SHORT)
    short.reset()
    for _ in range(4):
        assert not short.step(np.zeros((3, 4)))[2].any()
    _, _, done, infos = short.step(np.zeros((3, 4)))
    assert done.all()
    assert all(info["TimeLimit.truncated"] and info["episode"]["l"] == 5 for info in infos)
    crash = FlappyVecEnv(HOVER, 3, overrides=["task.end.distance_m=0.001"])
    crash.reset()
    _, _, done, infos = crash.step(np.zeros((3, 4)))
    assert done.all()
    assert not any(info["TimeLimit.truncated"] or info["is_success"] for info in infos)


def test_what_a_caller_writes_into_infos_does_not_last() -> None:
    env = FlappyVecEnv(HOVER, 3)
    env.reset()
    _, _, _, infos = env.step(np.zeros((3, 4)))
    infos[1]["mine"] = 1
    infos[2] = {"mine": 2}
    assert infos[0] == {}
    assert env.step(np.zeros((3, 4)))[3] == [{}, {}, {}]


def test_attributes_and_methods() -> None:
    env = FlappyVecEnv(HOVER, 3)
    env.reset()
    assert env.get_attr("step_s", [0, 2]) == [0.01, 0.01]
    assert env.has_attr("action_low")
    assert not env.has_attr("colour")
    poses = env.env_method("pose", indices=[2, 0])
    np.testing.assert_array_equal(poses[0]["position_m"], env.env.pose(2)["position_m"])
    env.set_attr("colour", "red")
    assert env.get_attr("colour") == ["red"] * 3
    with pytest.raises(ValueError, match="share"):
        env.set_attr("colour", "blue", indices=1)
    assert env.env_is_wrapped(Monitor) == [True] * 3


def test_ppo_learns_a_little_and_repeats_itself() -> None:
    def learn() -> tuple[PPO, FlappyVecEnv]:
        env = FlappyVecEnv(HOVER, 16, overrides=SHORT)
        model = PPO("MlpPolicy", VecNormalize(env), n_steps=16, batch_size=64, n_epochs=2, seed=3, device="cpu")
        return model.learn(1024), env

    (first, env), (second, _) = learn(), learn()
    assert len(first.ep_info_buffer) == 100
    assert len(first.ep_success_buffer) == 100
    for a, b in zip(first.policy.parameters(), second.policy.parameters(), strict=True):
        assert bool((a == b).all())
    returns, lengths = evaluate_policy(first, env, n_eval_episodes=16, return_episode_rewards=True)
    assert set(lengths) == {5}
    assert np.isfinite(returns).all()
