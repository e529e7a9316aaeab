#include "lab/blind/b/b_rig.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/blind/b/b_sensors.hpp"
#include "lab/blind/b/b_session.hpp"

namespace flappy::blind::b {
namespace {

// Choices. While one wing hides the other, 2 to 5 ms of a beat go; a glare lasts 10 to 50 ms.
constexpr double kShortestHide_s = 2e-3, kLongestHide_s = 5e-3, kShortestGlare_s = 10e-3, kLongestGlare_s = 50e-3;
constexpr double kMeanGlare_s = (kShortestGlare_s + kLongestGlare_s) / 2;
constexpr double kNoiseLow = 0.7, kNoiseHigh = 1.5;  // declared noise over true noise, as of the flight's sensors
constexpr double kRoundedLatency_s = 1e-4, kRoundedResonance_hz = 10;
constexpr double kFastClock = 50e-6;  // as of the flight's sensors
constexpr long kStepsPerFrame = 10;   // 2000 frames/s of 20,000 steps/s

static_assert(kStepsPerFrame * kStep_s * kFilm_hz > 0.999 && kStepsPerFrame * kStep_s * kFilm_hz < 1.001);

constexpr double kQuarter = std::numbers::sqrt2 / 2;
/// How sensors are screwed on (w, x, y, z): straight, by right angles about z, or upside down.
constexpr std::array<std::array<double, 4>, 6> kMountings = {
    {{1, 0, 0, 0}, {kQuarter, 0, 0, kQuarter}, {0, 0, 0, 1}, {kQuarter, 0, 0, -kQuarter}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

}  // namespace

RigTruth draw_rig(const Assignment& a, flightlog::RigHeader& header) {
  RigTruth t;
  Random random(a.seed, 0, Stream::kRig);
  const std::array<double, 5> rates = {1000, 2000, 2500, 5000, 10000};
  t.rate_hz = rates[random.below(rates.size())];
  t.late_s = random.uniform(2e-4, 1e-3);
  t.place_m = {random.uniform(-3e-3, 3e-3), random.uniform(-3e-3, 3e-3), random.uniform(-40e-3, -25e-3)};
  t.force_noise_N = 2e-3 * random.uniform(0.7, 1.4);
  t.moment_noise_Nm = 2e-3 * kSensorLever_m * random.uniform(0.7, 1.4);
  const double softest = random.uniform(kSoftest_hz, kStiffest_hz);
  const std::size_t soft = random.below(6);
  for (std::size_t i = 0; i < 6; ++i) {
    const double stiffer = random.uniform(1.05, 1.6);
    t.frequency_hz[i] = i == soft ? softest : softest * stiffer;
    t.damping[i] = random.uniform(0.01, 0.03);
  }
  const auto scale = [](Eigen::Index i) { return i < 3 ? kForceRange_N : kMomentRange_Nm; };
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j < 6; ++j) {
      const double talk = random.sign() * random.uniform(kMinCrossTalk, kMaxCrossTalk);
      if (i != j) t.cross_talk(i, j) = talk * scale(i) / scale(j);
    }
  t.hidden_at = random.uniform();
  header.rate_hz = t.rate_hz;
  header.latency_s = t.late_s;
  header.position_m = {t.place_m.x(), t.place_m.y(), t.place_m.z()};
  header.force_noise_N = std::hypot(t.force_noise_N, kForceStep_N / std::sqrt(12.0));
  header.moment_noise_Nm = std::hypot(t.moment_noise_Nm, kMomentStep_Nm / std::sqrt(12.0));
  header.resonance_hz = softest;

  // All draws are made in any case, so that one convention does not shift the others.
  Random c(a.seed, 0, Stream::kRigConventions);
  const std::array<double, 4>& mounted = kMountings[c.below(kMountings.size())];
  const Vector3d misturned = any_way(c, kMisturned_rad), misplaced = any_way(c, kMisplaced_m);
  std::array<double, 2> noise{};
  for (double& x : noise) x = kNoiseLow * std::pow(kNoiseHigh / kNoiseLow, c.uniform());
  const bool struck = c.uniform() < 0.5;
  const std::size_t fast = c.below(3);
  const double clock = 1 + c.uniform(0, kFastClock), camera_late = c.uniform(-1, 1) / kFilm_hz;
  if (!a.conventions) return t;

  header.attitude = mounted;
  t.turn = Eigen::Quaterniond(mounted[0], mounted[1], mounted[2], mounted[3]).toRotationMatrix() * turned(misturned);
  t.place_m += misplaced;
  header.latency_s = in_steps(t.late_s, kRoundedLatency_s);
  header.force_noise_N *= noise[0];
  header.moment_noise_Nm *= noise[1];
  // A laboratory that did not strike its stand does not know.
  header.resonance_hz = struck ? in_steps(softest, kRoundedResonance_hz) : 0;
  if (fast == 1) t.clock = clock;
  if (fast == 2) t.camera_clock = clock;
  t.camera_late_s = camera_late;
  return t;
}

ForceSensor::ForceSensor(const RigTruth& truth, std::uint64_t seed, std::uint64_t number, double begins_s)
    : truth_(truth), random_(seed, number, Stream::kForces) {
  for (Eigen::Index i = 0; i < 6; ++i)
    drift_N_s_[i] = random_.sign() * random_.uniform(kMinDrift_N_s, kMaxDrift_N_s) * (i < 3 ? 1 : kSensorLever_m);
  zeroed_s_ = random_.uniform(2, 8);  // the hand goes from the zero to the start
  next_s_ = begins_s + random_.uniform(0, 1 / truth_.rate_hz);
}

void ForceSensor::take(const Wrench& by_robot, double time) {
  Vector6d load;
  load << truth_.turn.transpose() * by_robot.f,
      truth_.turn.transpose() * (by_robot.n - truth_.place_m.cross(by_robot.f));
  if (!begun_) {
    strain_ = load_ = load;
    before_s_ = time;
    begun_ = true;
  }
  const double h = time - before_s_;
  const Vector6d before = strain_;
  if (h > 0) {
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double w = 2 * kPi * truth_.frequency_hz[k], z = truth_.damping[k], wd = w * std::sqrt(1 - z * z);
      const double slope = (load[i] - load_[i]) / h, lag = 2 * z * slope / w;
      const double keep = std::exp(-z * w * h), c = keep * std::cos(wd * h), s = keep * std::sin(wd * h) / wd;
      // away from the motion that follows the load's line
      const double y = strain_[i] - load_[i] + lag, v = rate_[i] - slope;
      strain_[i] = y * c + (v + z * w * y) * s + load[i] - lag;
      rate_[i] = v * c - (z * w * v + w * w * y) * s + slope;
    }
  }
  load_ = load;
  sum_ += strain_;
  ++count_;
  while (next_s_ <= time) {
    const double k = h > 0 ? std::clamp((next_s_ - before_s_) / h, 0.0, 1.0) : 1;
    sample(before + k * (strain_ - before), next_s_);
    next_s_ += 1 / truth_.rate_hz;
  }
  before_s_ = time;
}

void ForceSensor::zero() {
  if (count_ > 0) zero_ = truth_.cross_talk * sum_ / static_cast<double>(count_);
  sum_.setZero();
  count_ = 0;
}

void ForceSensor::sample(const Vector6d& strain, double time) {
  const double since = kDriftSettles_s * (1 - std::exp(-(time + zeroed_s_) / kDriftSettles_s));
  Vector6d read = truth_.cross_talk * strain - zero_ + since * drift_N_s_;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double range = i < 3 ? kForceRange_N : kMomentRange_Nm, step = i < 3 ? kForceStep_N : kMomentStep_Nm;
    read[i] += (i < 3 ? truth_.force_noise_N : truth_.moment_noise_Nm) * random_.normal();
    read[i] = in_steps(std::clamp(read[i], -range, range), step);
  }
  t_s_.push_back(time + truth_.late_s);
  samples_.push_back(read);
}

flightlog::ForcesStream ForceSensor::stream(double end) const {
  flightlog::ForcesStream out;
  for (std::size_t i = 0; i < t_s_.size(); ++i) {
    const double t = t_s_[i] * truth_.clock;
    if (t < 0 || t > end) continue;
    out.t_s.push_back(t);
    const Vector6d& s = samples_[i];
    out.force_x_N.push_back(s[0]);
    out.force_y_N.push_back(s[1]);
    out.force_z_N.push_back(s[2]);
    out.moment_x_Nm.push_back(s[3]);
    out.moment_y_Nm.push_back(s[4]);
    out.moment_z_Nm.push_back(s[5]);
  }
  return out;
}

Film::Film(const RigTruth& truth, std::uint64_t seed, std::uint64_t number, double flapping_Hz, double from_s,
           double to_s)
    : truth_(truth),
      random_(seed, number, Stream::kFilm),
      flapping_Hz_(flapping_Hz),
      from_s_(from_s),
      to_s_(to_s),
      first_step_(static_cast<long>(random_.below(kStepsPerFrame))),
      glare_begins_s_(from_s),
      glare_ends_s_(from_s) {}

bool Film::hidden(double time) {
  // Hidden beats and glare are independent, so their clear shares multiply.
  const double each_beat = (kShortestHide_s + kLongestHide_s) / 2 * flapping_Hz_;
  const double glare = std::max(0.0, 1 - (1 - kHidden) / (1 - each_beat));
  while (glare > 0 && time >= glare_ends_s_) {
    glare_begins_s_ = glare_ends_s_ + kMeanGlare_s * (1 / glare - 1) * random_.uniform(0, 2);
    glare_ends_s_ = glare_begins_s_ + random_.uniform(kShortestGlare_s, kLongestGlare_s);
  }
  const double beats = time * flapping_Hz_ - truth_.hidden_at + 0.5;
  if (const long beat = static_cast<long>(std::floor(beats)); beat != beat_) {
    beat_ = beat;
    hides_s_ = random_.uniform(kShortestHide_s, kLongestHide_s);
  }
  const double off_s = std::abs(beats - std::floor(beats) - 0.5) / flapping_Hz_;
  return off_s < hides_s_ / 2 || (time >= glare_begins_s_ && time < glare_ends_s_);
}

void Film::take(const State& x, long step) {
  const double time = static_cast<double>(step) * kStep_s;
  if (step % kStepsPerFrame != first_step_ || time < from_s_ || time >= to_s_) return;
  std::array<double, 4> angle = {x[kStroke], x[kRotation], x[kStroke + 1], x[kRotation + 1]};
  for (double& each : angle) each += kFilmNoise_rad * random_.normal();
  if (hidden(time)) return;
  film_.t_s.push_back(time * truth_.camera_clock + truth_.camera_late_s);
  film_.left_stroke_rad.push_back(angle[0]);
  film_.left_rotation_rad.push_back(angle[1]);
  film_.right_stroke_rad.push_back(angle[2]);
  film_.right_rotation_rad.push_back(angle[3]);
}

flightlog::WingsStream Film::stream(double end) const {
  flightlog::WingsStream out;
  for (std::size_t i = 0; i < film_.t_s.size(); ++i) {
    if (film_.t_s[i] < 0 || film_.t_s[i] > end) continue;
    out.t_s.push_back(film_.t_s[i]);
    out.left_stroke_rad.push_back(film_.left_stroke_rad[i]);
    out.left_rotation_rad.push_back(film_.left_rotation_rad[i]);
    out.right_stroke_rad.push_back(film_.right_stroke_rad[i]);
    out.right_rotation_rad.push_back(film_.right_rotation_rad[i]);
  }
  return out;
}

}  // namespace flappy::blind::b
