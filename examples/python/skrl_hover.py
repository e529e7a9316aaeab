"""Learns to hover with PPO of skrl: `python skrl_hover.py`. Prints how many of 1,000 flights of another seed succeed."""

import gymnasium
import numpy as np
import torch
from evaluation import evaluate
from numpy.typing import NDArray
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.resources.preprocessors.torch import RunningStandardScaler
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from skrl.utils.model_instantiators.torch import deterministic_model, gaussian_model

torch.set_num_threads(1)
set_seed(1)
env = wrap_env(gymnasium.make_vec("flappy:flappy/Hover-v0", num_envs=256))
spaces = {"observation_space": env.observation_space, "action_space": env.action_space, "device": env.device}
network = [{"name": "net", "input": "OBSERVATIONS", "layers": [64, 64], "activations": "tanh"}]
policy = gaussian_model(**spaces, network=network, output="ACTIONS", initial_log_std=-1, clip_actions=True)
value = deterministic_model(**spaces, network=network, output="ONE")
cfg = PPO_CFG(rollouts=32, learning_epochs=10, mini_batches=8, learning_rate=1e-3, time_limit_bootstrap=True)
cfg.observation_preprocessor, cfg.observation_preprocessor_kwargs = RunningStandardScaler, {"size": env.observation_space}
cfg.value_preprocessor, cfg.value_preprocessor_kwargs = RunningStandardScaler, {"size": 1}
cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
agent = PPO(models={"policy": policy, "value": value}, memory=RandomMemory(memory_size=32, num_envs=256), cfg=cfg, **spaces)
SequentialTrainer(env=env, agents=agent, cfg={"timesteps": 1200, "headless": True}).train()


def act(observation: NDArray[np.float32]) -> NDArray[np.float32]:
    """Without exploration."""
    with torch.no_grad():
        normal = agent._observation_preprocessor(torch.from_numpy(observation), train=False)
        _, outputs = policy.act({"observations": normal}, role="policy")
    action: NDArray[np.float32] = outputs["mean_actions"].clamp(-1, 1).numpy()
    return action


print("success {:.1%}, return {:.1f}".format(*evaluate(act)))
