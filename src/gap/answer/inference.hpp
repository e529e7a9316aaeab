// The whole of a diagnosis, from flights to the probabilities of all hypotheses.
#pragma once

#include "gap/question/inferred.hpp"

namespace flappy::gap {

/// Diagnoses the flights of one robot. After a stop it decides among the hypotheses fitted by then.
/// `reference`: of its references; null: there are none.
Inference infer(const Flights& flights, const sim::Randomisation& uncertain, InferenceOptions options,
                const ReferenceFit* reference = nullptr);

}  // namespace flappy::gap
