// The numbers that sensors, estimator, controller and task of a fleet work with, from what its user states.
#pragma once

#include "flight/fleet.hpp"

namespace flappy::flight {

/// The same numbers in another precision.
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

/// Of the control period that the options ask for, in whole physics steps.
FlightConstants flight_constants(const FleetOptions& options);

/// What the estimator knows at the start of a flight.
Covariance<double> start_covariance(const Sensors& sensors);

}  // namespace flappy::flight
