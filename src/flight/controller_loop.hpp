// What every controller is told of the loop that it flies in; its constants begin with it.
#pragma once

namespace flappy::flight {

template <class T>
struct LoopConstants {
  T velocity_share, rate_share;  // of a new value in the low-passed one
  T period_s, per_period_Hz, gravity_m_s2;
};

}  // namespace flappy::flight
