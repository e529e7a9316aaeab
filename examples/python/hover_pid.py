"""Hovers with a PID in Python: `python hover_pid.py`."""

import gymnasium
import numpy as np

env = gymnasium.make("flappy:flappy/Hover-v0")
to_action, dt = env.get_wrapper_attr("to_action"), env.get_wrapper_attr("step_s")
observation, info = env.reset(seed=0)
integral, total, done = np.array([9.8, 0.0, 0.0, 0.0]), 0.0, False  # V, V, V, split cycle: 9.8 V carry about the weight
while not done:
    rotation, (position, velocity, rate) = observation[:9].reshape(3, 3), observation[9:].reshape(3, 3)
    pitch, minus_roll = np.clip(-(8 * position + 4 * velocity) / 9.81, -0.5, 0.5)[:2]  # tilt towards the target, rad
    error = np.array([-position[2], -minus_roll - rotation[2, 1], pitch + rotation[2, 0], -rotation[1, 0]])
    integral += np.array([6.0, 4.0, 4.0, 0.4]) * error * dt
    inputs = np.array([8, 15, 15, 0.18]) * error - np.array([4, 0.5, 0.4, 0.01]) * [velocity[2], *rate] + integral
    observation, reward, terminated, truncated, info = env.step(to_action(inputs))
    total, done = total + float(reward), terminated or truncated
print(f"success {info['is_success']}, return {total:.1f}")
