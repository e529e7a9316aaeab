// The posterior of a vehicle: its table in the vehicle file, its factor for random draws, and its construction from a fit.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

/// Reads the table [posterior] of the file of `vehicle`. Throws io::InputError for a path that the vehicle does not
/// have, that is given twice, or that is the same for a whole batch; for a mean out of its range; for sizes that do not
/// match; and for a covariance that is not symmetric and positive semidefinite.
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
