// Paths of family C's robots, and the excitation of their inputs.
#pragma once

#include "lab/blind/c/c_pilot.hpp"

namespace flappy::blind::c {

class Programme {
 public:
  Programme(const Assignment& a, std::size_t flight, const RobotParameters& parameters);
  Target target(double t_s) const;
  /// Excitation to add to the pilot's inputs; zero before t = 0, in hover, and in calm flights.
  Inputs excitation(double t_s) const;
  Eigen::Vector3d start_W() const { return legs_.front().to_W; }

 private:
  struct Leg {
    double from_s, until_s;
    Eigen::Vector3d from_W, to_W;
    double from_heading, to_heading;
  };
  struct Tone {
    double frequency_Hz, phase;
  };

  /// Speeds are those half way, where they are highest.
  void add_leg(const Eigen::Vector3d& to_W, double heading, double speed_m_s, double turn_rad_s = 3);

  const ProposedFlight* proposed_;  ///< may be null
  std::vector<Leg> legs_;
  bool quiet_;  ///< hovers or flies calmly, without excitation
  std::array<std::vector<Tone>, 4> tones_;
  std::array<std::vector<double>, 4> levels_;
};

}  // namespace flappy::blind::c
