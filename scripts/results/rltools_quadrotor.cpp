// RLtools' own training loop on the task that it is known for, with the parameters it publishes (rl-tools/rl-tools, src/rl/zoo/l2f/environment.h and sac.h):
// a Crazyflie learns by soft actor-critic to fly to the origin, in 200,000 steps of 10 ms. For the headers of its PyPI package 2.2.1.
//
//   rltools_quadrotor SEED [DISTANCE_M]    prints a line of JSON after every 10,000 steps: {"steps", "wall_s", "cpu_s", "success"}
//
// Only training is timed. Success is that of configs/tasks/quadrotor.toml, over 500 flights without exploration; DISTANCE_M replaces its 0.5 m.
#include <rl_tools/operations/cpu_mux.h>

#include <rl_tools/nn/optimizers/adam/instance/operations_generic.h>
#include <rl_tools/nn/operations_cpu_mux.h>
#include <rl_tools/nn/layers/sample_and_squash/operations_generic.h>
#include <rl_tools/nn_models/mlp/operations_generic.h>
#include <rl_tools/nn_models/sequential/operations_generic.h>
#include <rl_tools/nn/optimizers/adam/operations_generic.h>
#include <rl_tools/rl/environments/l2f/operations_generic.h>
#include <rl_tools/rl/algorithms/sac/loop/core/config.h>
#include <rl_tools/rl/algorithms/sac/loop/core/operations_generic.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace rlt = rl_tools;
namespace l2f = rlt::rl::environments::l2f;
using Device = rlt::devices::DEVICE_FACTORY<>;
using Index = Device::index_t;
using Rng = Device::SPEC::RANDOM::ENGINE<>;
using T = float;
using Types = rlt::numeric_types::Policy<T>;

// The environment that the package holds, with the reward, ends and observations of the published task
using Defaults = l2f::parameters::DEFAULT_PARAMETERS_FACTORY<T, Index>;

template <typename Next>
using Rates = l2f::observation::AngularVelocity<l2f::observation::AngularVelocitySpecification<T, Index, Next>>;
template <typename Next>
using Pose = l2f::observation::Position<l2f::observation::PositionSpecification<
    T, Index,
    l2f::observation::OrientationRotationMatrix<l2f::observation::OrientationRotationMatrixSpecification<
        T, Index, l2f::observation::LinearVelocity<l2f::observation::LinearVelocitySpecification<T, Index, Rates<Next>>>>>>>;
template <typename Next>
using PrivilegedRates = l2f::observation::AngularVelocity<l2f::observation::AngularVelocitySpecificationPrivileged<T, Index, Next>>;
template <typename Next>
using PrivilegedPose = l2f::observation::Position<l2f::observation::PositionSpecificationPrivileged<
    T, Index,
    l2f::observation::OrientationRotationMatrix<l2f::observation::OrientationRotationMatrixSpecificationPrivileged<
        T, Index, l2f::observation::LinearVelocity<l2f::observation::LinearVelocitySpecificationPrivileged<T, Index, PrivilegedRates<Next>>>>>>>;

struct StaticParameters : Defaults::STATIC_PARAMETERS {
  using STATE_BASE = l2f::StateBase<l2f::StateSpecification<T, Index>>;
  using STATE_TYPE = l2f::StateRotorsHistory<
      l2f::StateRotorsHistorySpecification<T, Index, 16, false, l2f::StateRandomForce<l2f::StateSpecification<T, Index, STATE_BASE>>>>;
  using OBSERVATION_TYPE = Pose<l2f::observation::ActionHistory<l2f::observation::ActionHistorySpecification<T, Index, 16>>>;
  using OBSERVATION_TYPE_PRIVILEGED = PrivilegedPose<l2f::observation::RandomForce<
      l2f::observation::RandomForceSpecification<T, Index, l2f::observation::RotorSpeeds<l2f::observation::RotorSpeedsSpecification<T, Index>>>>>;
  static constexpr typename Defaults::PARAMETERS_TYPE PARAMETER_VALUES = [] {
    auto values = Defaults::nominal_parameters;
    auto& reward = values.mdp.reward;
    reward.scale = 0.1f;
    reward.constant = 1;
    reward.termination_penalty = 0;
    reward.position = 10;
    reward.orientation = 2.5f;
    reward.linear_velocity = 0.05f;
    reward.action = 0.1f;
    reward.d_action = 0;
    values.mdp.termination.linear_velocity_threshold = 10;
    return values;
  }();
};
using Environment = rlt::rl::environments::Multirotor<l2f::Specification<T, Index, StaticParameters>>;

struct Parameters : rlt::rl::algorithms::sac::loop::core::DefaultParameters<Types, Index, Environment> {
  struct SAC_PARAMETERS : rlt::rl::algorithms::sac::DefaultParameters<Types, Index, 4> {
    static constexpr Index ACTOR_BATCH_SIZE = 64;
    static constexpr Index CRITIC_BATCH_SIZE = 64;
    static constexpr Index CRITIC_TRAINING_INTERVAL = 5;
    static constexpr Index ACTOR_TRAINING_INTERVAL = 10;
    static constexpr Index CRITIC_TARGET_UPDATE_INTERVAL = 5;
    static constexpr T TARGET_ENTROPY = -4;
  };
  static constexpr Index STEP_LIMIT = 200'000;
  static constexpr Index REPLAY_BUFFER_CAP = STEP_LIMIT;
  static constexpr Index ACTOR_HIDDEN_DIM = 32;
  static constexpr Index CRITIC_HIDDEN_DIM = 32;
  static constexpr auto ACTOR_ACTIVATION_FUNCTION = rlt::nn::activation_functions::ActivationFunction::FAST_TANH;
  static constexpr auto CRITIC_ACTIVATION_FUNCTION = rlt::nn::activation_functions::ActivationFunction::FAST_TANH;
  struct Optimizer : rlt::nn::optimizers::adam::DEFAULT_PARAMETERS_TENSORFLOW<Types> {
    static constexpr bool ENABLE_GRADIENT_CLIPPING = true;
    static constexpr T GRADIENT_CLIP_VALUE = 1;
    static constexpr bool ENABLE_WEIGHT_DECAY = true;
    static constexpr T WEIGHT_DECAY = 1e-4f;
  };
  using ACTOR_OPTIMIZER_PARAMETERS = Optimizer;
  using CRITIC_OPTIMIZER_PARAMETERS = Optimizer;
  using ALPHA_OPTIMIZER_PARAMETERS = Optimizer;
};
using Loop = rlt::rl::algorithms::sac::loop::core::Config<Types, Index, Rng, Environment, Parameters>;
using LoopState = Loop::State<Loop>;
using Actor = Loop::NN::ACTOR_TYPE::CHANGE_BATCH_SIZE<Index, 1>::CHANGE_CAPABILITY<rlt::nn::capability::Forward<>>;

// The share of 500 flights that succeed as configs/tasks/quadrotor.toml says; every start is drawn, none is at the goal.
double success(Device& device, LoopState& loop, T distance_m) {
  Actor actor;
  Actor::State<> memory;
  Actor::Buffer<> buffer;
  rlt::malloc(device, actor);
  rlt::malloc(device, memory);
  rlt::malloc(device, buffer);
  rlt::copy(device, device, rlt::get_actor(loop), actor);
  Rng rng;
  rlt::init(device, rng, 1'000'000);
  Environment env;
  Environment::Parameters parameters;
  rlt::initial_parameters(device, env, parameters);
  parameters.mdp.init.guidance = 0;
  rlt::Tensor<rlt::tensor::Specification<T, Index, rlt::tensor::Shape<Index, 1, Environment::Observation::DIM>, false>> seen;
  rlt::Tensor<rlt::tensor::Specification<T, Index, rlt::tensor::Shape<Index, 1, 4>, false>> action;
  auto seen_row = rlt::matrix_view(device, seen);
  auto action_row = rlt::matrix_view(device, action);
  int reached = 0;
  for (int flight = 0; flight < 500; ++flight) {
    Environment::State state, next;
    rlt::sample_initial_state(device, env, parameters, state, rng);
    bool captured = false, kept = true;
    for (int step = 1; step <= 500 && kept; ++step) {
      rlt::observe(device, env, parameters, state, Environment::Observation{}, seen_row, rng);
      rlt::Mode<rlt::mode::Evaluation<>> mode;
      rlt::evaluate_step(device, actor, seen, memory, action, buffer, rng, mode);
      rlt::step(device, env, parameters, state, action_row, next, rng);
      state = next;
      const auto length = [](const T* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); };
      const T* q = state.orientation;
      const T tilt = std::acos(std::clamp(1 - 2 * (q[1] * q[1] + q[2] * q[2]), -1.0f, 1.0f));
      const T heading = std::abs(std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3])));
      const bool near = length(state.position) <= distance_m && tilt <= 0.5f && heading <= 1;
      captured = captured || (step <= 300 && near && length(state.linear_velocity) <= 1 && length(state.angular_velocity) <= 15);
      kept = (step < 300 || (captured && near)) && !rlt::terminated(device, env, parameters, state, rng);
    }
    reached += captured && kept;
  }
  rlt::free(device, actor);
  rlt::free(device, memory);
  rlt::free(device, buffer);
  return reached / 500.0;
}

int main(int argc, char** argv) {
  const auto now = [] { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); };
  double wall = 0, cpu = 0, since = now();
  std::clock_t since_cpu = std::clock();
  const T distance_m = argc > 2 ? std::strtof(argv[2], nullptr) : 0.5f;
  Device device;
  rlt::init(device);
  static LoopState loop;
  rlt::malloc(device, loop);
  rlt::init(device, loop, argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 0);
  for (Index step = 1; step <= Parameters::STEP_LIMIT; ++step) {
    rlt::step(device, loop);
    if (step % 10'000 != 0) continue;
    wall += now() - since;
    cpu += static_cast<double>(std::clock() - since_cpu) / CLOCKS_PER_SEC;
    std::printf("{\"steps\": %zu, \"wall_s\": %.4f, \"cpu_s\": %.4f, \"success\": %.4f}\n", static_cast<std::size_t>(step), wall, cpu, success(device, loop, distance_m));
    std::fflush(stdout);
    since = now();
    since_cpu = std::clock();
  }
}
