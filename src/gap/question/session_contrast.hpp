// Answers the question: what changed in a beat-averaged vehicle since the references? Each flight is compared by a few
// numbers, the quantities y (gap/session/quantities.hpp). The robot's own reference sessions say how much quantities
// differ while nothing is done to the robot, by a density t (gap/session/session_scatter.hpp). A hypothesis shifts the
// quantities by what its effects change in the rows:
//   p(y | effects) = integral of t(y - shift(z)) N(z; 0, 1) dz
// z are the unknowns of the effects. Laplace's method computes the integral around the most probable z (MacKay,
// Information Theory, Inference, and Learning Algorithms, 2003, ch. 27).
#pragma once

#include "gap/question/contrast.hpp"
#include "gap/session/session_scatter.hpp"

namespace flappy::gap {

class SessionContrast final : public Contrast {
 public:
  using Contrast::Contrast;
  /// The whole answer: infer() returns it, and calls none of Contrast's functions.
  std::optional<Inference> by_sessions(const Flights& flights, const sim::Randomisation& uncertain,
                                       const InferenceOptions& options, const ReferenceFit& reference) const override;
};

}  // namespace flappy::gap
