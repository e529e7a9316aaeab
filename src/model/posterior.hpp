// The posterior of a vehicle: as a table of its file, as what draws are made of, and made from what a fit found.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

/// The table [posterior] of a file of this vehicle. io::InputError for a path that the vehicle does not have, has twice, or that
/// no flapper can have of its own; a mean out of its range; sizes that do not fit; and what is no covariance.
Posterior read_posterior(const io::Table& table, const Vehicle& vehicle);

/// The text that reads back the same.
std::string posterior_text(const Posterior& posterior);

/// Lower triangle L, rows of it, with covariance = L L^T; nothing where the covariance is not positive semidefinite. A
/// parameter that those before it settle has nothing in its own column.
std::optional<std::vector<std::vector<double>>> lower_factor(const Posterior& posterior);

/// The posterior of all parameters that move with the coordinates of a fit, their mean and covariance given: the best vehicle's
/// figures as means, and to first order, one standard deviation to the side that moves more, how they vary.
Posterior posterior_of(const std::function<Vehicle(const std::vector<double>& coordinates)>& vehicle_of,
                       const std::vector<double>& mean, const std::vector<std::vector<double>>& covariance);

}  // namespace flappy::model
