#include "deploy/header/controller_trace.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "flight/flight_block.hpp"
#include "model/jointed.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"

namespace flappy::deploy {
namespace {

using flight::Fleet;
using flight::FlightBlock;
using Lane = model::Lanes<float, 1>;

std::int32_t whole_us(double s) { return static_cast<std::int32_t>(std::lround(s * 1e6)); }

/// The configuration for the trace: nominal vehicle, no excitation, hand-back by the estimate, as on board.
rollout::FlyConfig on_board(rollout::FlyConfig config) {
  config.draw_no_vehicles();
  config.excitation = {};
  config.fleet.task.action_late_most = 0;  // on board, an action comes late by itself
  config.fleet.task.constants.hand_back.on_estimate = 1;
  double& latency_s = config.fleet.sensors.imu.latency_s;
  latency_s = std::ceil(latency_s * config.fleet.control_hz - 1e-6) / config.fleet.control_hz;
  return config;
}

/// `count` rows of a flight's block, from the byte `offset` on.
std::vector<float> rows(const Fleet<float>& fleet, std::size_t offset, std::size_t count) {
  const auto all = fleet.snapshot(0).flight;
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(offset / sizeof(float[flight::kLanes<float>]));
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

/// The control period of the hand-back; the middle of the flight where there is none.
int hand_back_period(const rollout::FlyConfig& config) {
  rollout::Rollout<float> flight(config, 1);
  while (!flight.over()) {
    flight.step();
    if (flight.fleet().handed_back(0)) return static_cast<int>(flight.tick());
  }
  return std::max(2, static_cast<int>(flight.tick())) / 2;
}

void copy(const auto& from, float* to) {
  for (const auto x : from) *to++ = static_cast<float>(x);
}

ControllerTrace::Increment gathered(const std::vector<ControllerTrace::Imu>& samples, std::size_t first,
                                    std::size_t last) {
  flight::Increment<Lane> sum{{0, 0, 0}, {0, 0, 0}};
  const auto vector = [](const float(&x)[3]) { return model::Vec3<Lane>{x[0], x[1], x[2]}; };
  const auto before_us = [&](std::size_t i) { return i > 0 ? samples[i - 1].taken_us : 0; };
  for (std::size_t i = first; i < last; ++i)
    gather(sum, {vector(samples[i].gyro_rad_s), vector(samples[i].accel_m_s2)},
           Lane((samples[i].taken_us - before_us(i)) / 1e6));
  return {{sum.rotation_rad.x.raw[0], sum.rotation_rad.y.raw[0], sum.rotation_rad.z.raw[0]},
          {sum.velocity_m_s.x.raw[0], sum.velocity_m_s.y.raw[0], sum.velocity_m_s.z.raw[0]},
          before_us(first),
          samples[last - 1].taken_us};
}

/// The increments that have arrived by the end of `period`, one for each that contains a sample.
std::vector<ControllerTrace::Increment> arrived(const std::vector<ControllerTrace::Imu>& samples, int period,
                                                std::int32_t period_us, std::int32_t latency_us) {
  std::vector<ControllerTrace::Increment> list;
  std::size_t next = 0;
  for (int p = 1; p <= period; ++p) {
    std::size_t last = next;
    while (last < samples.size() && samples[last].taken_us <= p * period_us - latency_us) ++last;
    if (last > next) list.push_back(gathered(samples, next, last));
    next = last;
  }
  return list;
}

}  // namespace

ControllerTrace record_controller(const rollout::FlyConfig& given, int periods, int begin) {
  const rollout::FlyConfig config = on_board(given);
  if (begin < 0) begin = std::max(1, hand_back_period(config) - periods / 2);
  rollout::Rollout<float> flight(config, 1);
  Fleet<float>& fleet = flight.fleet();
  fleet.record(true);
  const flight::FleetOptions& o = fleet.options();
  flight::Schedule schedule(o.sensors, o.batch.step_s,
                            static_cast<int>(std::lround(fleet.period_s() / o.batch.step_s)));
  const std::int32_t period_us = whole_us(fleet.period_s()), zero_us = begin * period_us;
  const std::int32_t imu_latency_us = whole_us(o.sensors.imu.latency_s), lag_us = whole_us(schedule.imu_lag_s());
  const std::int32_t mocap_latency_us = whole_us(o.sensors.mocap.latency_s);

  ControllerTrace t;
  std::vector<ControllerTrace::Imu> imu;  // times since the start of the flight, as in `frames`
  std::vector<ControllerTrace::Frame> frames;
  for (int period = 0; period < begin + periods; ++period) {
    if (period == begin) {
      t.estimator = rows(fleet, offsetof(FlightBlock<float>, estimator), flight::kEstimatorRows);
      t.estimate = rows(fleet, offsetof(FlightBlock<float>, estimate), flight::kEstimateRows);
      flight::with_controller(o.controller.kind, [&]<class C>(C) {
        t.feedback = rows(fleet, offsetof(FlightBlock<float>, controller), model::kRows<C::template Memory>);
      });
      if (t.feedback.empty()) t.feedback = {0};  // the only number where there is no controller
      t.tick = fleet.tick(0);
      t.phase = fleet.snapshot(0).phase;
      t.handed_back = fleet.handed_back(0);
      t.horizon_us = -whole_us(schedule.horizon_age_s());
      t.present_us = -whole_us(schedule.present_age_s());
      const auto all = arrived(imu, begin, period_us, imu_latency_us);
      t.last_imu_us = all.empty() ? -zero_us : all.back().to_us - zero_us;
      for (ControllerTrace::Increment i : all) {
        i.from_us -= zero_us + lag_us;
        i.to_us -= zero_us + lag_us;
        if (i.to_us > t.horizon_us || i.to_us == t.last_imu_us - lag_us) t.ring.push_back(i);
      }
    }
    if (period == begin && t.ring.empty()) t.ring.push_back({{}, {}, t.horizon_us, t.horizon_us});  // zero duration
    flight.step();
    schedule.next();
    for (const auto& s : fleet.imu_samples(0)) {
      const std::int32_t arrived_us = whole_us(s.arrival_s);
      imu.push_back({arrived_us - imu_latency_us, arrived_us, {}, {}});
      copy(s.gyro_rad_s, imu.back().gyro_rad_s);
      copy(s.accel_m_s2, imu.back().accel_m_s2);
    }
    for (const auto& s : fleet.mocap_samples(0)) {
      const std::int32_t arrived_us = whole_us(s.arrival_s);
      frames.push_back({arrived_us - mocap_latency_us, arrived_us, s.valid, {}, {}});
      copy(s.position_m, frames.back().position_m);
      copy(s.attitude, frames.back().attitude);
    }
    if (period < begin) continue;
    const sim::Input u = fleet.input(0);
    ControllerTrace::Period& p = t.periods.emplace_back();
    copy(fleet.adds(0), p.added);
    copy(std::initializer_list<double>{u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle}, p.input);
    std::ranges::copy(rows(fleet, offsetof(FlightBlock<float>, estimate), flight::kEstimateRows), p.estimate);
    p.handed_back = fleet.handed_back(0);
    if (!model::mixed_inputs(config.vehicle).empty()) {
      copy(sim::storage_of(fleet.batch()).inputs_of(0),
           t.updates.emplace_back(model::mixed_inputs(config.vehicle).size()).data());
      continue;
    }
    for (const rollout::DriverUpdate& update : rollout::driver_updates(fleet, 0)) {
      if (t.updates.empty()) t.first_update_us = whole_us(static_cast<double>(update.step) * o.batch.step_s) - zero_us;
      t.updates.push_back({static_cast<float>(update.left_V), static_cast<float>(update.right_V)});
    }
  }
  const std::int32_t end_us = periods * period_us;
  for (ControllerTrace::Imu s : imu) {
    s.taken_us -= zero_us;
    s.arrived_us -= zero_us;
    if (s.taken_us > t.last_imu_us && s.arrived_us <= end_us) t.imu.push_back(s);
  }
  for (ControllerTrace::Frame f : frames) {
    f.taken_us -= zero_us;
    f.arrived_us -= zero_us;
    if (f.taken_us > t.horizon_us && f.arrived_us <= end_us) t.frames.push_back(f);
  }
  return t;
}

}  // namespace flappy::deploy
