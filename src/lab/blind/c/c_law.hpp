// The laws of family C's effects by themselves, for a judge of their likeness.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace flappy::blind::c {

/// Family::law(). Throws io::InputError for an unknown effect, or where `at` does not have an effect's arguments.
std::vector<double> law_of(const std::string& effect, std::span<const double> at);

}  // namespace flappy::blind::c
