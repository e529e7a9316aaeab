"""A rollout with TorchRL: `python torchrl_hover.py`."""

import flappy  # noqa: F401
from torchrl.envs import GymEnv, RewardSum, StepCounter, TransformedEnv

env = TransformedEnv(GymEnv("flappy/Hover-v0", device="cpu"))
env.append_transform(RewardSum())
env.append_transform(StepCounter())
env.set_seed(0)
flight = env.rollout(300)
print(flight["next", "observation"].shape, flight["next", "episode_reward"][-1].item(), flight["next", "truncated"][-1].item())
env.close()
