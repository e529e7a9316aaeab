// Files of a blind benchmark: DIR/manifest.json, which is public; DIR/sealed/labels.json, which is opened after all
// predictions are made; DIR/predictions/NNNN.json.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "lab/benchmark/case_plan.hpp"
#include "lab/benchmark/change_over_sessions.hpp"
#include "lab/benchmark/score.hpp"

namespace flappy::benchmark {

using Json = nlohmann::ordered_json;

/// "0007"
std::string number_text(std::size_t number);
/// Folders of flights in that of a case: flight_1, ..., and of its references: reference_1, ...
inline constexpr const char *kFlightFolder = "flight_", *kReferenceFolder = "reference_";

/// InputError if the file cannot be read or is not JSON.
Json read_json(const std::filesystem::path& file);

/// The public part of a case.
struct PublicCase {
  std::size_t number = 0;
  std::vector<std::string> withheld;
  std::map<std::string, std::string> files;  ///< SHA-256 by path relative to the folder of the benchmark
  /// Folders of its flights, and of its reference flights. `folder`: of the benchmark.
  std::vector<std::filesystem::path> flights(const std::filesystem::path& folder) const;
  std::vector<std::filesystem::path> references(const std::filesystem::path& folder) const;
};

struct Manifest {
  std::string family, set, vehicle, vehicle_sha256, labels_sha256, commit;
  std::string engine;  ///< blind::Family::engine() of the maker; empty: none, or not recorded
  std::vector<PublicCase> cases;
};
Json to_json(const Manifest& manifest);
Manifest read_manifest(const std::filesystem::path& folder);

/// Hashes of all predictions, in sha256sum's format: written once all are made, and seals them.
inline constexpr const char* kSums = "predictions.sha256";
/// The verdict file by which they were made.
std::filesystem::path verdict_of_predictions(const std::filesystem::path& folder);
std::filesystem::path prediction_file(const std::filesystem::path& folder, std::size_t number);
std::string sum_line(const std::filesystem::path& folder, std::size_t number);
/// InputError if the predictions are not sealed, or if one has changed since.
void check_predictions(const std::filesystem::path& folder, const Manifest& manifest);
/// Folder that is made when the labels are opened; from then on, no prediction is accepted.
std::filesystem::path true_fits(const std::filesystem::path& folder);
/// The content of sealed/labels.json. InputError if it has changed.
Json open_labels(const std::filesystem::path& folder, const Manifest& manifest);

struct Label {
  PlannedCase planned;
  std::uint64_t draw = 0;                      ///< number of the first draw of its seed that did not crash
  std::vector<std::string> channels, regimes;  ///< where its effects act (blind::FamilyEffect)
  std::vector<OverSessions> over_sessions;     ///< of each effect; empty: not computed
  CaseTruth truth() const;
  blind::Assignment robot(const std::filesystem::path& vehicle) const;
};
Json to_json(const PlannedCase& planned);
Json to_json(const Label& label);
Label label_from(const Json& json);

/// What the scores need of a case: a line of cases.jsonl. Of hypotheses and sets, those that no score reads are left out.
struct CaseRecord {
  std::string family, set, commit;  ///< `commit`: of the prediction
  std::size_t number = 0;           ///< in its benchmark
  bool bench = false;               ///< clamped
  std::string row;                  ///< its line in score.csv
  ScoredCase scored;
};
Json to_json(const CaseRecord& record);
/// InputError at `where` (file:line) if it is no record.
CaseRecord case_record_from(const Json& json, const std::string& where);

Json to_json(const Prediction& prediction);
/// InputError if the file is not a prediction.
Prediction read_prediction(const std::filesystem::path& file);

}  // namespace flappy::benchmark
