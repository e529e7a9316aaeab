// What a blind benchmark keeps on disk: DIR/manifest.json for everybody, DIR/sealed/labels.json for after the predictions,
// DIR/predictions/NNNN.json.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmark/plan.hpp"
#include "benchmark/score.hpp"

namespace flappy::benchmark {

using Json = nlohmann::ordered_json;

/// "0007"
std::string number_text(std::size_t number);

/// A JSON file. InputError where it cannot be read or is none.
Json read_json(const std::filesystem::path& file);

/// What the diagnosing side may know of a case.
struct PublicCase {
  std::size_t number = 0;
  std::vector<std::string> withheld;
  std::map<std::string, std::string> files;  ///< SHA-256 by path below the benchmark's folder
  /// Its flights, below the folder of a benchmark.
  std::vector<std::filesystem::path> flights(const std::filesystem::path& folder) const;
};

struct Manifest {
  std::string family, set, vehicle, vehicle_sha256, labels_sha256, commit;
  std::vector<PublicCase> cases;
};
Json to_json(const Manifest& manifest);
Manifest read_manifest(const std::filesystem::path& folder);

/// Hashes of all predictions, as sha256sum writes and checks them: made once none is open any more.
inline constexpr const char* kSums = "predictions.sha256";
std::filesystem::path prediction_file(const std::filesystem::path& folder, std::size_t number);
/// The line of a prediction.
std::string sum_line(const std::filesystem::path& folder, std::size_t number);
/// InputError where they are not sealed, or one has changed since.
void check_predictions(const std::filesystem::path& folder, const Manifest& manifest);
/// sealed/labels.json. InputError where it has changed.
Json open_labels(const std::filesystem::path& folder, const Manifest& manifest);

struct Label {
  PlannedCase planned;
  std::uint64_t draw = 0;                      ///< of the robots of its seed, the first that did not crash
  std::vector<std::string> channels, regimes;  ///< of its effects, as blind::FamilyEffect has them
  std::map<std::string, double> true_values;   ///< by "effect.parameter"
  CaseTruth truth() const;
  /// The robot that flew.
  blind::Assignment robot(const std::filesystem::path& vehicle) const;
};
Json to_json(const PlannedCase& planned);
Json to_json(const Label& label);
Label label_from(const Json& json);

Json to_json(const Prediction& prediction);
/// InputError where the file holds none.
Prediction read_prediction(const std::filesystem::path& file);

}  // namespace flappy::benchmark
