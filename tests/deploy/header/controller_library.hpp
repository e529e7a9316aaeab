// An exported controller, compiled on the spot, as the tests call it.
#pragma once

#include <gtest/gtest.h>

#include <optional>

#include "io/run_program.hpp"
#include "io/shared_library.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::deploy {

/// Behind the header.
inline constexpr const char* kControllerWrapper = R"(
const uint32_t w_size = sizeof(flappy_controller), w_observation = FLAPPY_CONTROLLER_OBS;
#define W_COPY(to, from, count) for (i = 0; i < (count); ++i) (to)[i] = (from)[i]
void w_start(flappy_controller *c, uint32_t us, const float *x) {
  flappy_quaternion q;
  q.w = x[3], q.x = x[4], q.y = x[5], q.z = x[6];
  flappy_controller_start(c, us, flappy_vector_from(x), q);
}
void w_load(flappy_controller *c, uint32_t us, const float *estimator, const float *estimate, const float *pid, uint32_t phase) {
  static const float origin[7] = {0, 0, 0, 1, 0, 0, 0};
  uint32_t i;
  w_start(c, us, origin);
  W_COPY((float *)&c->estimator, estimator, sizeof c->estimator / 4);
  W_COPY((float *)&c->estimate, estimate, sizeof c->estimate / 4);
  W_COPY((float *)&c->feedback, pid, sizeof c->feedback / 4);
  c->phase = phase;
}
void w_state(const flappy_controller *c, float *estimator, float *estimate, float *pid) {
  uint32_t i;
  W_COPY(estimator, (const float *)&c->estimator, sizeof c->estimator / 4);
  W_COPY(estimate, (const float *)&c->estimate, sizeof c->estimate / 4);
  W_COPY(pid, (const float *)&c->feedback, sizeof c->feedback / 4);
}
void w_begin(flappy_controller *c) { flappy_controller_begin(c); }
void w_act(flappy_controller *c, const float *added) { flappy_controller_act(c, added); }
void w_observe(const flappy_controller *c, float *row) { flappy_controller_observe(c, row); }
int w_due(const flappy_controller *c) { return flappy_controller_policy_due(c); }
void w_steer(flappy_controller *c, float *input) {
  uint32_t i;
  flappy_controller_steer(c);
  W_COPY(input, (const float *)&c->input, 4);
}
#if FLAPPY_CONTROLLER_INPUTS > 0
void w_drive(flappy_controller *c, float *inputs) { flappy_controller_inputs(c, inputs); }
#else
void w_drive(flappy_controller *c, float *volts) { flappy_controller_drive(c, volts, volts + 1); }
#endif
int w_imu(flappy_controller *c, uint32_t us, const float *x) {
  return flappy_controller_imu(c, us, flappy_vector_from(x), flappy_vector_from(x + 3));
}
int w_pose(flappy_controller *c, uint32_t us, int valid, const float *x) {
  flappy_quaternion q;
  q.w = x[3], q.x = x[4], q.y = x[5], q.z = x[6];
  return flappy_controller_pose(c, us, valid, flappy_vector_from(x), q);
}
int w_tick(flappy_controller *c, uint32_t us) { return flappy_controller_tick(c, us); }
int w_selftest(void) { return flappy_controller_selftest(); }
float w_selftest_error(void) { return flappy_controller_selftest_error(); }
void w_mathematics(const float *x, const float *y, float *out, uint32_t count) {
  uint32_t i;
  for (i = 0; i < count; ++i, out += 10) {
    const flappy_sin_cos a = flappy_sin_cos_of(x[i]), b = flappy_sin_cos_pi(x[i]), w = flappy_sin_cos_wide(x[i]);
    out[0] = flappy_sqrt(x[i]);
    out[1] = flappy_atan2(y[i], x[i]);
    out[2] = flappy_asin(x[i]);
    out[3] = a.sin, out[4] = a.cos, out[5] = b.sin, out[6] = b.cos, out[7] = w.sin, out[8] = w.cos;
    out[9] = flappy_cos_pi(x[i]);
  }
}
uint32_t w_constants(uint32_t which, uint32_t **words) {
#define W_LIST(n, x) if (which == n) { *words = (uint32_t *)&x; return (uint32_t)(sizeof x / 4); }
  W_LIST(0, flappy_controller_k)
  W_LIST(1, flappy_controller_path)
  W_LIST(2, flappy_controller_path_start)
  W_LIST(3, flappy_controller_test_state)
  W_LIST(4, flappy_controller_test_clock)
  W_LIST(5, flappy_controller_test_ring)
  W_LIST(6, flappy_controller_test_ring_us)
  W_LIST(7, flappy_controller_test_imu)
  W_LIST(8, flappy_controller_test_imu_us)
  W_LIST(9, flappy_controller_test_frames)
  W_LIST(10, flappy_controller_test_frames_us)
  W_LIST(11, flappy_controller_test_periods)
  W_LIST(12, flappy_controller_test_handed_back)
  W_LIST(13, flappy_controller_test_driven)
  return 0;
}
)";

class ControllerLibrary {
 public:
  /// `options`: the compiler and its flags, but for warnings.
  ControllerLibrary(const std::string& header, std::vector<std::string> options) : name_(join(options)) {
    const std::string source = folder_.write("c.c", header + kControllerWrapper);
    const std::string library = folder_ / "c.so";
    options.insert(options.end(), {"-std=gnu99", "-shared", "-fPIC", "-w", source, "-o", library});
    const io::Finished finished = io::run(options);
    if (finished.exit_code != 0) throw std::runtime_error(finished.err);
    library_.emplace(library);
  }

  const std::string& name() const { return name_; }
  template <class F>
  F* function(const char* name) const {
    return library_->function<F>(name);
  }
  std::uint32_t number(const char* name) const { return *static_cast<const std::uint32_t*>(library_->symbol(name)); }

 private:
  static std::string join(const std::vector<std::string>& words) {
    std::string all;
    for (const std::string& w : words) all += (all.empty() ? "" : " ") + w;
    return all;
  }
  flight::Folder folder_;
  std::string name_;
  std::optional<io::SharedLibrary> library_;
};

/// One controller in a library.
class ControllerUnit {
 public:
  explicit ControllerUnit(const ControllerLibrary& l)
      : load(l.function<void(void*, std::uint32_t, const float*, const float*, const float*, std::uint32_t)>("w_load")),
        start(l.function<void(void*, std::uint32_t, const float*)>("w_start")),
        state(l.function<void(const void*, float*, float*, float*)>("w_state")),
        begin(l.function<void(void*)>("w_begin")),
        act(l.function<void(void*, const float*)>("w_act")),
        observe(l.function<void(const void*, float*)>("w_observe")),
        due(l.function<int(const void*)>("w_due")),
        steer(l.function<void(void*, float*)>("w_steer")),
        drive(l.function<void(void*, float*)>("w_drive")),
        imu(l.function<int(void*, std::uint32_t, const float*)>("w_imu")),
        pose(l.function<int(void*, std::uint32_t, int, const float*)>("w_pose")),
        tick(l.function<int(void*, std::uint32_t)>("w_tick")),
        bytes_(l.number("w_size"), 0xaa) {}
  void* at() { return bytes_.data(); }

  void (*load)(void*, std::uint32_t, const float*, const float*, const float*, std::uint32_t);
  void (*start)(void*, std::uint32_t, const float*);
  void (*state)(const void*, float*, float*, float*);
  void (*begin)(void*);
  void (*act)(void*, const float*);
  void (*observe)(const void*, float*);
  int (*due)(const void*);
  void (*steer)(void*, float*);
  void (*drive)(void*, float*);
  int (*imu)(void*, std::uint32_t, const float*);
  int (*pose)(void*, std::uint32_t, int, const float*);
  int (*tick)(void*, std::uint32_t);

 private:
  std::vector<unsigned char> bytes_;
};

}  // namespace flappy::deploy
