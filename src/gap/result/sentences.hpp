// Texts about a diagnosis that the printed summary (gap/diagnose/summary.hpp) and the page of the report (src/view)
// share. Texts begin with a small letter where they may stand within a line. Comments below show examples of results.
#pragma once

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// Turns the name of an effect into what is shown: the name as it is, or words, as on a page.
using Spoken = std::string (*)(std::string name);
inline std::string as_it_is(std::string name) { return name; }

inline constexpr const char* kStopped = "stopped before every effect was weighed";
inline constexpr const char* kNoVerdict = "this is no verdict, only what was weighed until then";
inline constexpr const char* kNothingStandsOut = "with parameters refitted nothing stands out of the noise";
inline constexpr const char* kClosureUnknown = "how much of the gap an effect closes cannot be told from noise";
inline constexpr const char* kMendLogs = "mend the logs, until flappy-gap check finds no fault";
inline constexpr const char* kReferenceDecides =
    "that would be decided by flights of the same robot without it, given as --reference";

/// `words` with a capital letter at their start.
std::string capitalised(std::string words);
/// "a, b and c".
std::string spoken_list(const std::vector<std::string>& words, const char* last = "and");
/// "Missing in the model: wind"; in a contrast "Changed since the reference: wind". `seen`: any_told() of the diagnosis.
std::string verdict_words(const Verdict& verdict, bool contrast, Spoken spoken, bool seen = false);
/// "probability 0.40, no more than a guess".
std::string probability_words(double probability);
/// "wind and tether and more", "parameters alone".
std::string hypothesis_words(const RankedHypothesis& hypothesis, Spoken spoken);
/// The same for a name from NextExperiment::separates, such as "wind+tether" or "parameters".
std::string hypothesis_words(const std::string& name, Spoken spoken);
/// "if an effect is missing, then most probably wind 0.40 (closes 30 %) or tether 0.20".
std::string suspects_words(const std::vector<Suspect>& suspects, Spoken spoken);
/// A quantity is reported if it changed by more standard deviations between sessions than this. Choice: of twenty
/// quantities one goes so far by chance.
inline constexpr double kTold = 2;
/// Whether any quantity changed by more than kTold, so that seen_words() is not empty.
bool any_told(const std::vector<SeenQuantity>& seen);
/// A line for each quantity that changed by more than kTold, whatever the cause; the largest change first: "thrust of
/// rotor_3 -9.4 %, 6.1 times what sessions differ by".
std::vector<std::string> seen_words(const std::vector<SeenQuantity>& seen, Spoken spoken);
/// A value of a quantity in the unit that people use: shares in %, metres in mm, seconds in ms. `sign`: with + or -.
std::string seen_value(const SeenQuantity& quantity, double value, bool sign);
/// "flight b differs from the others of its set, most in thrust (8.1 times what sessions differ by)"; "flight b changes
/// 12.3 s after its begin, in thrust by -0.094 (14 times its noise)".
std::string odd_words(const OddFlight& odd, Spoken spoken);
/// "mean of the beat", "harmonic 2 of the beat".
std::string harmonic_words(int harmonic);

}  // namespace flappy::gap
