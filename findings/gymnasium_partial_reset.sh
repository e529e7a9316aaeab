#!/bin/bash
# Gymnasium's vector environments take "reset_mask" out of the options of reset(). The wrappers around them, which look for it afterwards, then clear
# what they know of all environments, although only some of them start anew. NormalizeReward does so behind any vector environment.
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q gymnasium==1.4.0 numpy==2.4.6 cloudpickle==3.1.3
cd "$here"
cat > partial_reset.py <<'PYTHON'
import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeReward, RecordEpisodeStatistics


class LeavesOptions(SyncVectorEnv):
    """The same, but what the caller passes stays as it is."""

    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed, options=None if options is None else dict(options))


def after_a_reset_of_the_first(kind, wrapper, read):
    env = wrapper(kind([lambda: gymnasium.make("Pendulum-v1")] * 2, autoreset_mode=AutoresetMode.DISABLED))
    env.reset(seed=1)
    for _ in range(3):
        env.step(np.zeros(env.action_space.shape, np.float32))
    env.reset(options={"reset_mask": np.array([True, False])})
    left = [bool(x) for x in read(env)]
    env.close()
    return left


print("gymnasium", gymnasium.__version__)
seen = {}
for kind in (SyncVectorEnv, AsyncVectorEnv, LeavesOptions):
    seen[kind.__name__] = (
        after_a_reset_of_the_first(kind, RecordEpisodeStatistics, lambda env: env.episode_lengths),
        after_a_reset_of_the_first(kind, NormalizeReward, lambda env: env.accumulated_reward),
    )
    print(f"{kind.__name__}: environment 0 is reset alone; kept by RecordEpisodeStatistics {seen[kind.__name__][0]}, by NormalizeReward {seen[kind.__name__][1]}")
cleared, kept = [False, False], [False, True]
assert seen == {"SyncVectorEnv": (cleared, cleared), "AsyncVectorEnv": (cleared, cleared), "LeavesOptions": (kept, cleared)}, "that has changed"
print("as found: reset_mask is gone before RecordEpisodeStatistics looks for it, and NormalizeReward never looks")
PYTHON
"$here/venv/bin/python" partial_reset.py
