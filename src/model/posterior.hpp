// The posterior of a vehicle: its table in the vehicle file, its factor for random draws, its construction from a fit.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

/// Reads [posterior]. Throws io::InputError for a path that `vehicle` does not have, given twice or the same for a
/// whole batch; a mean out of range; sizes that do not match; a covariance that is not symmetric and positive
/// semidefinite.
Posterior read_posterior(const io::Table& table, const Vehicle& vehicle);

/// Text that reads back as the same posterior.
std::string posterior_text(const Posterior& posterior);

/// Lower triangle L by rows, with covariance = L L^T; nullopt if the covariance is not positive semidefinite. The
/// column of a parameter that earlier parameters determine is 0.
std::optional<std::vector<std::vector<double>>> lower_factor(const Posterior& posterior);

/// The posterior of all parameters that depend on the coordinates of a fit, from the mean and covariance of the
/// coordinates. Means are the parameters of the best vehicle. The covariance is to first order: each slope is a
/// difference over one standard deviation, to the side on which the parameter moves more.
Posterior posterior_of(const std::function<Vehicle(const std::vector<double>& coordinates)>& vehicle_of,
                       const std::vector<double>& mean, const std::vector<std::vector<double>>& covariance);

}  // namespace flappy::model
