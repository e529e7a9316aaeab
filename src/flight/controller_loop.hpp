// Constants of the control loop that every controller gets. The constants of each controller begin with them.
#pragma once

namespace flappy::flight {

template <class T>
struct LoopConstants {
  T velocity_share, rate_share;  // share of a new value in the low-passed velocity and body rate
  T period_s, per_period_Hz, gravity_m_s2;
};

}  // namespace flappy::flight
