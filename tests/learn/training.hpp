// Small trainings for tests.
#pragma once

#include <string>
#include <vector>

#include "learn/train_config.hpp"
#include "vehicles.hpp"

namespace flappy::learn {

using Overrides = std::vector<std::string>;

/// The escape, or another training, with a few flappers and small networks; later overrides win.
inline TrainConfig small_training(const Overrides& overrides = {}, const std::string& name = "escape") {
  Overrides all = {"seed=3",
                   "threads=1",
                   "networks.actor=[16]",
                   "networks.critic=[16, 16]",
                   "collect.flappers=40",
                   "collect.vehicles=8",
                   "collect.steps_before=5",
                   "learn.updates=24",
                   "learn.updates_per_step=2",
                   "learn.batch=64",
                   "learn.replay=1500",
                   "evaluate.every=8",
                   "evaluate.vehicles=16",
                   "checkpoint.every=8",
                   "flight.duration_s=0.4",
                   "task.success.keep.from_s=0.36",
                   "task.success.keep.until_s=0.4"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  return read_train_config(test::source_path("configs/train/" + name + ".toml"), all);
}

}  // namespace flappy::learn
