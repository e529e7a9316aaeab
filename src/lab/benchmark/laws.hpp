// The laws of effects by themselves: no two families of blind robots, and no family and the catalogue, may share one.
// Each law is evaluated on a grid (blind::Family::law). Arguments and outcomes are in SI units; the robot is the shipped
// vehicle. Directions that a robot draws are left out: what turns or mirrors a law does not make it another.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lab/blind/family.hpp"

namespace flappy::benchmark {

/// What a law is asked: uniform values of one argument.
struct LawArgument {
  const char* name;  ///< with its unit
  double low, high;
  std::size_t points;
};

struct LawQuestion {
  const char* effect;
  std::vector<LawArgument> arguments;
  std::vector<const char*> outcomes;
  /// How outcomes on the grid become numbers that do not depend on drawn directions. Null: they are compared as they are.
  std::vector<std::vector<double>> (*invariants)(const std::vector<std::vector<double>>& at,
                                                 const std::vector<std::vector<double>>& outcomes) = nullptr;
  bool (*occurs)(const std::vector<double>& at) = nullptr;  ///< leaves points out that flight does not have; null: none
};

/// For every effect of the catalogue that has a law. Others are geometry: a mass or an axis lies elsewhere.
const std::vector<LawQuestion>& law_questions();

/// All points of the grid.
std::vector<std::vector<double>> grid_of(const LawQuestion& question);

/// The catalogue's law at its typical parameters, with the same arguments and outcomes.
std::vector<double> catalogue_law(const std::string& effect, std::span<const double> at);

/// Root of the sum of squares that the best scale factor leaves of one law, as a share of the other's: 0 for equal shapes, 1 for
/// orthogonal ones. Each outcome counts by the geometric mean of its two root mean squares, so that no unit matters.
double law_distance(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b);

/// Least distance of two laws of one effect. Part of the benchmark's rules.
inline constexpr double kMinDistance = 0.03;
/// Numbers of two laws that differ by less, as a share, are equal.
inline constexpr double kEqualNumbers = 1e-3;

struct LawPair {
  std::string effect, first, second;   ///< `second` is a family, or "catalogue"
  std::optional<double> distance;      ///< none: geometry, or outside the catalogue
  std::optional<double> equal_number;  ///< in both
  std::string missing;                 ///< what a family has not written down: "law", "source" or "numbers"
  bool refused() const { return !missing.empty() || equal_number || (distance && *distance < kMinDistance); }
};

/// All pairs of the families, and each with the catalogue. A law that is not finite, is 0 everywhere or has other
/// outcomes than asked counts as missing. Effects outside the catalogue are compared by their id alone.
std::vector<LawPair> compare_laws(const std::vector<const blind::Family*>& families);

/// A page for readers: each effect's law and source, by family.
std::string laws_page(const std::vector<const blind::Family*>& families);

}  // namespace flappy::benchmark
