// Working constants of sensors, estimator, controller and task, derived from the options of a fleet.
#pragma once

#include "flight/fleet.hpp"

namespace flappy::flight {

template <class T, template <class> class S>
S<T> rounded(const S<double>& from) {
  static_assert(sizeof(S<T>) / sizeof(T) == sizeof(from) / sizeof(double));
  S<T> to;
  for (std::size_t i = 0; i < sizeof to / sizeof(T); ++i)
    reinterpret_cast<T*>(&to)[i] = static_cast<T>(reinterpret_cast<const double*>(&from)[i]);
  return to;
}

struct FlightConstants {
  double period_s;
  ImuConstants<double> imu;
  MocapConstants<double> mocap;
  EstimatorConstants<double> estimator;
  ControllerConstants<double> controller;
  TaskConstants<double> task;
};

/// Derives the constants. The control period is rounded to whole physics steps.
FlightConstants flight_constants(const FleetOptions& options);

/// Covariance of the estimate at the start of a flight.
Covariance<double> start_covariance(const Sensors& sensors);

}  // namespace flappy::flight
