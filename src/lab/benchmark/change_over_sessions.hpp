// Which effects count: how much more an effect changes flights than another session of the same robot, and noise, do.
// The maker computes it from robots that only it knows, and seals it with the case.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "lab/blind/family.hpp"

namespace flappy::benchmark {

/// A channel of a log, cut into windows of whole beats: for each window the mean, or the cosine and sine of a harmonic of the beat.
/// A window without enough samples has NaNs. Some channels say how far motion capture and IMU disagree.
struct WindowedChannel {
  std::string name;  ///< a column of the log and "mean", "harmonic 1" or "harmonic 2"
  std::vector<double> values;
};

/// Of one flight, or one run on a bench; the same names, and as many values, for all logs with one header and duration.
std::vector<WindowedChannel> windowed_channels(const flightlog::FlightLog& log);

struct OverSessions {
  std::string channel;  ///< in which the ratio is largest
  double ratio = 0;
};

/// `change[flight]`: logs with the effect and without it, of one session, programme and noise. `sessions[s][flight]`: without it, the
/// same programme in other sessions. In each channel,
///
///   e = with - without     d_s = session s - without     sd^2 = sum over s of (<e, d_s> / |e|)^2 / (2 S)     ratio = |e| / sd
///
/// over all windows of all flights. A matched filter for the change would so see it `ratio` standard deviations of a session with its noise
/// high: each d_s holds two sessions, hence the 2 (Kay, Fundamentals of Statistical Signal Processing II, 1998, ch. 4).
OverSessions over_sessions(const std::vector<std::pair<flightlog::FlightLog, flightlog::FlightLog>>& change,
                           const std::vector<std::vector<flightlog::FlightLog>>& sessions);

/// From here on an effect counts. Fixed before any robot was judged by it.
inline constexpr double kCounts = 3;
/// Other sessions that a robot flies for it.
inline constexpr std::size_t kOtherSessions = 6;

/// Of each effect of `robot`, which has `flown` these flights: flies what else is needed. None without other sessions.
std::vector<OverSessions> change_over_sessions(const blind::Family& family, const blind::Assignment& robot,
                                               const std::vector<flightlog::FlightLog>& flown,
                                               std::size_t other_sessions = kOtherSessions);

}  // namespace flappy::benchmark
