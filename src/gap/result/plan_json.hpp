// Makes the contents of plan.json and matrix.csv from a plan (docs/reference/plan.md).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "gap/result/planned.hpp"

namespace flappy::gap {

inline constexpr const char* kPlanFile = "plan.json";
inline constexpr const char* kMatrixFile = "matrix.csv";

nlohmann::ordered_json to_json(const Plan& plan);
/// Expected nats with one decimal: a row for each effect, a column for each rival. The cell of an effect over itself is
/// empty.
std::string matrix_csv(const Plan& plan);

}  // namespace flappy::gap
