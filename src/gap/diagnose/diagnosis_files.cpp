#include "gap/diagnose/diagnosis_files.hpp"

#include "gap/result/diagnosis_json.hpp"
#include "io/files.hpp"

namespace flappy::gap {
namespace {

std::string digits(const std::optional<double>& value) { return value ? io::shortest_digits(*value) : ""; }

std::string residuals_table(const Diagnosis& d) {
  std::string table = "stage,test,channel,regime,gap,noise_floor,unit,p_value,discovered\n";
  for (const ResidualLocation& l : d.locations)
    table += std::string(name_of(l.stage)) + "," + name_of(l.test) + "," + l.channel + "," + text_of(l.regime, l.test) +
             "," + digits(l.gap) + "," + digits(l.noise_floor) + "," + l.unit + "," + digits(l.p_value) + "," +
             (l.discovered ? "1" : "0") + "\n";
  return table;
}

std::string hypotheses_table(const Diagnosis& d) {
  std::string table =
      "rank,kind,effects,group,remainder,probability,log_evidence,loss,closure,closure_low,closure_high,parameter,"
      "value,low,high,unit\n";
  std::vector<RankedHypothesis> ranked = d.hypotheses;
  std::ranges::stable_sort(ranked, std::greater{}, &RankedHypothesis::probability);
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    const RankedHypothesis& h = ranked[i];
    const std::string closure =
        h.closure ? digits(h.closure->value) + "," + digits(h.closure->low) + "," + digits(h.closure->high) : ",,";
    const std::string first = std::to_string(i + 1) + "," + name_of(h.kind) + "," + io::joined(h.effects, "+") + "," +
                              h.group + "," + (h.remainder ? "1" : "0") + "," + digits(h.probability) + "," +
                              digits(h.log_evidence) + "," + digits(h.loss) + "," + closure + ",";
    if (h.parameters.empty()) table += first + ",,,,\n";
    for (const Estimate& e : h.parameters)
      table +=
          first + e.name + "," + digits(e.value) + "," + digits(e.low) + "," + digits(e.high) + "," + e.unit + "\n";
  }
  return table;
}

}  // namespace

void write_diagnosis(const std::filesystem::path& folder, const Diagnosis& diagnosis) {
  io::write_atomically(folder / kDiagnosisFile, to_json(diagnosis).dump(1) + "\n");
  io::write_atomically(folder / kResidualsFile, residuals_table(diagnosis));
  io::write_atomically(folder / kHypothesesFile, hypotheses_table(diagnosis));
}

}  // namespace flappy::gap
