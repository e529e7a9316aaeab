#include "gap/result/sentences.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "io/text.hpp"

namespace flappy::gap {
namespace {

std::string effects_words(const std::vector<std::string>& effects, Spoken spoken, const char* last = "and") {
  std::vector<std::string> words;
  for (const std::string& effect : effects) words.push_back(spoken(effect));
  return spoken_list(words, last);
}

}  // namespace

std::string capitalised(std::string words) {
  if (!words.empty()) words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return words;
}

std::string spoken_list(const std::vector<std::string>& words, const char* last) {
  std::string all;
  for (std::size_t i = 0; i < words.size(); ++i)
    all += (i == 0 ? "" : i + 1 == words.size() ? std::string(" ") + last + " " : ", ") + words[i];
  return all;
}

std::string verdict_words(const Verdict& v, bool contrast, Spoken spoken, bool seen) {
  const std::string what = contrast ? "Changed since the reference: " : "Missing in the model: ";
  switch (v.kind) {
    case VerdictKind::effect:
      return what + effects_words(v.effects, spoken) + (v.remainder ? ", and something more" : "");
    case VerdictKind::group:
      return what + "one of " + effects_words(v.effects, spoken, "or") + ", which these flights cannot tell apart";
    case VerdictKind::parameters:
      return !contrast ? "Nothing is missing in the model, its parameters are off"
             : seen    ? "What is seen may be no more than sessions differ by"
                       : "Changed by no more than sessions differ by";
    case VerdictKind::none:
      return contrast ? "Unchanged since the reference"
                      : "No gap beyond noise: the vehicle's file explains the flights";
    case VerdictKind::unknown:
      return contrast ? "Changed since the reference by something that no effect of the catalogue explains"
                      : "Something is missing in the model that no effect of the catalogue explains";
    case VerdictKind::data:
      return "The data are at fault; nothing was diagnosed";
  }
  return "";
}

std::string probability_words(double probability) {
  return io::format("probability %.2f%s", probability, probability < 0.5 ? ", no more than a guess" : "");
}

std::string hypothesis_words(const RankedHypothesis& h, Spoken spoken) {
  if (h.kind != HypothesisKind::effect) return hypothesis_words(name_of(h.kind), spoken);
  return effects_words(h.effects, spoken) + (h.remainder ? " and more" : "");
}

std::string hypothesis_words(const std::string& name, Spoken spoken) {
  if (name == name_of(HypothesisKind::none)) return "no gap";
  if (name == name_of(HypothesisKind::parameters)) return "parameters alone";
  if (name == name_of(HypothesisKind::unknown)) return "something unknown";
  std::vector<std::string> effects;
  for (std::size_t at = 0, end = 0; end != std::string::npos; at = end + 1)
    effects.push_back(name.substr(at, (end = name.find('+', at)) - at));
  return effects_words(effects, spoken);
}

std::string suspects_words(const std::vector<Suspect>& suspects, Spoken spoken) {
  std::vector<std::string> words;
  for (const Suspect& s : suspects)
    words.push_back(spoken(s.effect) + io::format(" %.2f", s.probability) +
                    (s.closure ? io::format(" (closes %.0f %%)", 100 * s.closure->value) : ""));
  return "if an effect is missing, then most probably " + spoken_list(words, "or");
}

std::string harmonic_words(int harmonic) {
  return harmonic == 0 ? "mean of the beat" : "harmonic " + std::to_string(harmonic) + " of the beat";
}

std::string seen_value(const SeenQuantity& quantity, double value, bool sign) {
  const std::string& u = quantity.unit;
  const auto [factor, unit] = u == "share" ? std::pair(100.0, "%")
                              : u == "m"   ? std::pair(1e3, "mm")
                              : u == "s"   ? std::pair(1e3, "ms")
                                           : std::pair(1.0, u.c_str());
  return io::format(sign ? "%+.3g" : "%.3g", factor * value) + (*unit ? std::string(" ") + unit : "");
}

bool any_told(const std::vector<SeenQuantity>& seen) {
  return std::ranges::any_of(seen, [](const SeenQuantity& s) { return std::abs(s.times()) > kTold; });
}

std::vector<std::string> seen_words(const std::vector<SeenQuantity>& seen, Spoken spoken) {
  std::vector<const SeenQuantity*> told;
  for (const SeenQuantity& s : seen)
    if (std::abs(s.times()) > kTold) told.push_back(&s);
  std::ranges::stable_sort(told, std::greater{}, [](const SeenQuantity* s) { return std::abs(s->times()); });
  std::vector<std::string> lines;
  for (const SeenQuantity* s : told)
    lines.push_back(io::format("%s %s, %.1f times what sessions differ by", spoken(s->name).c_str(),
                               seen_value(*s, s->tests - s->reference, true).c_str(), std::abs(s->times())));
  return lines;
}

std::string odd_words(const OddFlight& odd, Spoken spoken) {
  if (odd.since_s)
    return io::format("%s changes %.1f s after its begin, in %s by %.2g (%.0f times its noise)", odd.flight.c_str(),
                      *odd.since_s, spoken(odd.quantity).c_str(), odd.step.value_or(0), odd.times);
  return io::format("%s differs from the others of its set, most in %s (%.1f times what sessions differ by)",
                    odd.flight.c_str(), spoken(odd.quantity).c_str(), std::abs(odd.times));
}

}  // namespace flappy::gap
