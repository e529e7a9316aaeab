#include "gap/question/question.hpp"

#include "gap/question/alone.hpp"
#include "gap/question/beat_averaged_question.hpp"
#include "gap/question/contrast.hpp"
#include "gap/question/session_contrast.hpp"

namespace flappy::gap {
namespace {

/// Smallest gain of a step of a fit, of a vehicle with wings. Choice: each step costs a simulation.
constexpr double kWingStep_nats = 0.5;
/// Smallest gain of a step of a fit, of a beat-averaged vehicle. Choice: a step costs almost nothing.
constexpr double kBeatAveragedStep_nats = 0.05;

const Alone kAlone(kWingStep_nats), kReferencesOfBeatAveraged(kBeatAveragedStep_nats);
const Contrast kContrast(kWingStep_nats);
const SessionContrast kContrastOfBeatAveraged(kBeatAveragedStep_nats);
const BeatAveraged kBeatAveraged(kBeatAveragedStep_nats);

}  // namespace

const Question& question_of(const Flights& flights) {
  const bool averaged = flights.size() > 0 && flights[0]->is_averaged();
  if (!flights.references.empty() && !flights.tests.empty()) return averaged ? kContrastOfBeatAveraged : kContrast;
  if (!averaged) return kAlone;
  // what a beat-averaged model gets wrong counts as noise, but in a contrast it cancels
  if (flights.references.empty()) return kBeatAveraged;
  return kReferencesOfBeatAveraged;
}

const Question& question_beside(const FlightList& references) {
  if (references.empty()) return kAlone;
  return kContrast;
}

}  // namespace flappy::gap
