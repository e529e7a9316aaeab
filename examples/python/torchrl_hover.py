"""Many flights with TorchRL: `python torchrl_hover.py`."""

import gymnasium
from torchrl.envs import GymWrapper, RewardSum, TransformedEnv

env = TransformedEnv(GymWrapper(gymnasium.make_vec("flappy:flappy/Hover-v0", num_envs=256)), RewardSum())
flights = env.rollout(300, break_when_any_done=False)  # of random actions
ended = flights["next", "done"].squeeze(-1)
print(flights["next", "observation"].shape, f"{int(ended.sum())} flights, return {flights['next', 'episode_reward'][ended].mean():.2f}")
env.close()
