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

/// The channels of one flight, or of one run on a bench. Logs with one header and duration have the same names, and as many values.
std::vector<WindowedChannel> windowed_channels(const flightlog::FlightLog& log);

struct OverSessions {
  std::string channel;  ///< in which the ratio is largest, as every second session has it
  double ratio = 0;
};

/// Another session, in which a robot without the effect flew one of the tests' flights again.
struct OtherSession {
  std::size_t flight;  ///< index in `change` of that flight
  std::vector<WindowedChannel> channels;
};

/// `change[flight]`: logs with the effect and without it, of one session, programme and noise. `sessions`: the two of a
/// pair, which follow one another, flew the same flight; at least two pairs. In each channel, over all windows of the
/// flight f of a session,
///
///   e_f = with - without   x_s = <e_f, session s - without> / |e_f|   ratio = sum |e_f|^2 / sum |e_f| / sd of x_s
///
/// how many standard deviations of a session, with its noise, a matched filter for the change sees it high (Kay,
/// Fundamentals of Statistical Signal Processing II, 1998, ch. 4), if a session differs alike in all flights; if it
/// differs independently, the ratio is too small by up to the root of the number of flights. The variance is half the
/// mean square of the differences of pairs. The largest ratio of some forty channels would be large by chance: so each
/// pair gives the variance of the channel that the other pairs chose, and the mean of these counts. No channel: the
/// effect changes nothing.
OverSessions over_sessions(const std::vector<std::pair<flightlog::FlightLog, flightlog::FlightLog>>& change,
                           const std::vector<OtherSession>& sessions);

/// From here on an effect counts. Fixed before any robot was judged by it.
inline constexpr double kCounts = 3;
/// Other sessions that a robot flies for it, one flight each.
inline constexpr std::size_t kOtherSessions = 6;

/// Flies what is needed in addition to what `robot` has `flown`, and compares each of its effects. Empty, so not known, with
/// fewer than four other sessions, or where the robot crashes in nearly all.
std::vector<OverSessions> change_over_sessions(const blind::Family& family, const blind::Assignment& robot,
                                               const std::vector<flightlog::FlightLog>& flown,
                                               std::size_t other_sessions = kOtherSessions);

/// For each effect, the entry with the larger ratio. An empty list, where nothing is known, counts as ratios of 0.
std::vector<OverSessions> larger_of(std::vector<OverSessions> in_flight, const std::vector<OverSessions>& on_bench);

}  // namespace flappy::benchmark
