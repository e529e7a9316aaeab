// Policies as ONNX files: written by the ONNX library, flown by the onnxruntime of the Python in PATH.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "policy/policy.hpp"
#include "policy/policy_network.hpp"

namespace flappy::policy {

/// Version of the default operator set that is written: the first with LayerNormalization (ONNX 1.12).
inline constexpr int kOnnxOpset = 17;

/// Names and values, as they stand in the file.
using OnnxMetadata = std::vector<std::pair<std::string, std::string>>;

/// Whether this build or installation has the ONNX library's plugin.
bool writes_onnx();

/// The bytes of an ONNX file from `observation`, float[n][observations], to `action`, float[n][actions]: raw numbers in their
/// units, normalisation, clip and output range inside; zeros for an observation with a NaN. Equal arguments give equal
/// bytes. A recurrent policy has the further input `memory` and output `next_memory`, float[n][units]. Throws
/// std::invalid_argument without the plugin.
std::string onnx_model(const PolicyNetwork& network, const OnnxMetadata& metadata);

/// load_policy() for ONNX files, of any opset that onnxruntime reads: one input, one output, both float[n][numbers] or
/// float[1][numbers]; or two of each, of which the second is the memory. Throws io::InputError, where python3 has no onnxruntime, too.
std::unique_ptr<const Policy> load_onnx(const std::filesystem::path& path, int observations, int actions);

/// The version of the onnxruntime of python3; empty where it has none.
std::string onnxruntime_version();

/// The functions of the plugin.
struct OnnxFunctions {
  std::string (*write)(const PolicyNetwork& network, const OnnxMetadata& metadata);
};
extern "C" const OnnxFunctions flappy_onnx_functions;  ///< the only symbol that the plugin exports

}  // namespace flappy::policy
