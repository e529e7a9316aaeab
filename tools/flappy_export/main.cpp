// flappy-export: exports a finished run as TorchScript, as ONNX, and as C headers that test themselves.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "deploy/firmware/firmware.hpp"
#include "deploy/header/controller_header.hpp"
#include "deploy/header/exported_files.hpp"
#include "deploy/header/policy_header.hpp"
#include "deploy/proof/file_proof.hpp"
#include "deploy/proof/proof.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"
#include "io/temporary_folder.hpp"
#include "learn/run_folder.hpp"
#include "policy/onnx.hpp"
#include "policy/torch_script.hpp"

namespace flappy::exports {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using policy::PolicyVectors;

/// Numbers of flights and vectors: for test vectors and proofs of the headers, and for the fit of 8-bit scales.
constexpr std::size_t kProofFlights = 64, kFitFlights = 512, kComparedFlights = 256;
constexpr std::size_t kTestVectors = 24, kProofVectors = 1000, kFitVectors = 10000, kComparedVectors = 4000;

struct Request {
  std::string run, out, name{policy::kPrefix}, firmware;
  bool int8 = false, prove = false;
};

/// The files of an export, kept in memory until all of them are proven.
struct Export {
  std::map<std::string, std::string> files;
  std::map<std::string, PolicyVectors> proofs;  ///< [policy header] vectors with the actions that it has to compute
  PolicyVectors flown;
};

/// Vectors of flights with the actions that a network has to compute.
template <class Network>
PolicyVectors for_proof(const Export& e, const Network& network) {
  PolicyVectors own = deploy::some_of(e.flown, kProofVectors);
  own.action = deploy::evaluate(network, own.observation);
  return own;
}

/// The largest and the root-mean-square difference of each output, as shares of its range.
struct OutputError {
  std::vector<double> largest, rms;
};
OutputError output_error(const std::vector<float>& action, const std::vector<float>& wanted,
                         const std::vector<float>& half) {
  OutputError e{std::vector<double>(half.size(), 0), std::vector<double>(half.size(), 0)};
  for (std::size_t i = 0; i < action.size(); ++i) {
    const std::size_t k = i % half.size();
    const double d = half[k] > 0 ? (static_cast<double>(action[i]) - static_cast<double>(wanted[i])) /
                                       (2 * static_cast<double>(half[k]))
                                 : 0;
    e.largest[k] = std::max(e.largest[k], std::abs(d));
    e.rms[k] += d * d;
  }
  for (double& x : e.rms) x = std::sqrt(x * static_cast<double>(half.size()) / static_cast<double>(action.size()));
  return e;
}

void print(const char* what, const OutputError& e, const std::vector<flight::Signal>& action) {
  std::printf("%s, %% of an output's range: ", what);
  for (std::size_t k = 0; k < action.size(); ++k)
    std::printf("%s%s %.2g (rms %.2g)", k > 0 ? ", " : "", action[k].name.c_str(), 100 * e.largest[k], 100 * e.rms[k]);
  std::printf("\n");
}

Json json_of(const OutputError& e) { return {{"largest", e.largest}, {"rms", e.rms}}; }

/// Writes all files or none, except for a power failure between two renames. Removes files of an earlier export.
void write_all(const fs::path& folder, const std::string& prefix, const std::map<std::string, std::string>& files) {
  std::vector<std::unique_ptr<io::AtomicFile>> written;
  for (const auto& [name, text] : files) {
    io::make_folder((folder / name).parent_path());
    written.push_back(std::make_unique<io::AtomicFile>(folder / name));
    written.back()->write(text);
  }
  for (const auto& file : written) file->commit();
  for (const std::string& name : {prefix + "_policy.h", prefix + "_policy_int8.h", prefix + "_controller.h",
                                  std::string("policy.pt"), std::string("policy.onnx")})
    if (!files.contains(name)) fs::remove(folder / name);
  for (const char* firmware : deploy::kFirmwares)  // an app of another run could be flashed by mistake
    if (deploy::is_app(folder / firmware, firmware) &&
        std::ranges::none_of(files, [&](const auto& f) { return f.first.starts_with(std::string(firmware) + "/"); }))
      fs::remove_all(folder / firmware);
  io::sync_folder(folder);
}

/// One line of JSON: the signals' names, or their units.
std::string list_of(const std::vector<flight::Signal>& signals, std::string flight::Signal::*text) {
  Json all = Json::array();
  for (const flight::Signal& s : signals) all.push_back(s.*text);
  return all.dump();
}

/// Adds policy.pt and policy.onnx, and tries them out: sums are in another order, so last bits differ.
void write_for_runtimes(Export& e, const Request& request, const learn::FinishedRun& run,
                        const policy::PolicyNetwork& network, const io::TemporaryFolder& work, Json& json) {
  constexpr double kMaxError = 1e-5;  // of an output's range
  const auto observation = run.fly.fleet.task.observation(), action = run.fly.fleet.task.action();
  policy::PolicyVectors vectors;
  if (request.prove) vectors = deploy::some_of(deploy::roll_out(run.fly, 0, kComparedFlights), kComparedVectors);
  const policy::PolicyNetwork loud = deploy::louder(network);
  std::vector<deploy::Agreement> rows;
  const auto far_out = [&](const std::string& file, const std::string& runtime, const policy::PolicyNetwork& of) {
    const auto policy = policy::load_policy(work / file, of.observations(), of.actions());
    deploy::Agreement asked;
    deploy::ask_far_out(asked, *policy, of, deploy::saturating(of, e.flown));
    if (asked.beyond_range > 0) throw std::runtime_error(file + " leaves the range of actions in " + runtime);
    return asked.saturated;
  };
  const auto try_out = [&](const std::string& name, const std::string& runtime, const char* key,
                           const std::string& loud_bytes) {
    io::write_atomically(work / name, e.files[name]);
    const auto policy = policy::load_policy(work / name, network.observations(), network.actions());
    std::vector<float> acts(e.flown.action.size());
    policy->act(e.flown.rows(), e.flown.observation.data(), acts.data());
    const OutputError error = output_error(acts, e.flown.action, network.output_half());
    print((runtime + " differs by at most").c_str(), error, action);
    json[key] = json_of(error);
    if (*std::ranges::max_element(error.largest) > kMaxError)
      throw std::runtime_error(runtime + " does not act as the actor does");
    if (!request.prove) return;
    deploy::Agreement& row = rows.emplace_back(deploy::compare(name, runtime, *policy, network.output_half(), vectors));
    io::write_atomically(work / ("louder_" + name), loud_bytes);
    row.saturated = far_out(name, runtime, network) + far_out("louder_" + name, runtime, loud);
    std::printf(
        "%s, and the same with 16 times the sums of its last layer: %zu outputs saturate, none leaves its range\n",
        name.c_str(), row.saturated);
    const deploy::BesideActor flown = deploy::fly_beside(run.fly, *policy, kProofFlights);
    row.flights = kProofFlights;
    row.ended_alike = flown.ended_alike;
    row.largest_distance_m = flown.largest_distance_m;
  };
  if (policy::reads_torch_script()) {
    e.files["policy.pt"] = policy::torch_script(network, deploy::contract_text(run.fly, run.info));
    try_out("policy.pt", "TorchScript", "torch_script_error", policy::torch_script(loud, ""));
  } else {
    std::printf("policy.pt is not written: this build has no LibTorch (package flappy-torch)\n");
  }
  if (policy::writes_onnx()) {
    e.files["policy.onnx"] =
        policy::onnx_model(network, {{"task", run.info.task},
                                     {"opset", std::to_string(policy::kOnnxOpset)},
                                     {"observation", list_of(observation, &flight::Signal::name)},
                                     {"observation_unit", list_of(observation, &flight::Signal::unit)},
                                     {"action", list_of(action, &flight::Signal::name)},
                                     {"action_unit", list_of(action, &flight::Signal::unit)},
                                     {"contract_json_sha256", io::sha256(e.files["contract.json"])},
                                     {"config_sha256", run.info.config_sha256}});
    if (const std::string version = policy::onnxruntime_version(); !version.empty())
      try_out("policy.onnx", "onnxruntime " + version, "onnx_error", policy::onnx_model(loud, {}));
    else std::printf("policy.onnx, of opset %d, is not tried out: python3 has no onnxruntime\n", policy::kOnnxOpset);
  } else {
    std::printf("policy.onnx is not written: this build has no ONNX library\n");
  }
  if (rows.empty()) return;
  std::printf("%s", table_of(rows).c_str());
  json["agreement"] = json_of(rows);
}

/// Throws io::InputError if the folder is something else than an app, or the policy is too wide for the firmware's stack.
void check_app(const fs::path& folder, const std::string& firmware, const policy::PolicyNetwork& network) {
  constexpr int kWidest = 128;  // 1 KiB on the stack of the control task, which has 1.8 KiB in a Crazyflie
  if (fs::exists(folder) && !fs::is_empty(folder) && !deploy::is_app(folder, firmware))
    throw io::InputError(folder.string() + ": is no app that flappy-export made; accepted: another --out");
  if (const int widest = std::ranges::max(network.widths); widest > kWidest)
    throw io::InputError("--for " + firmware + ": the policy is " + std::to_string(widest) +
                         " wide, too much for the stack of the control task; accepted: networks.actor of at most " +
                         std::to_string(kWidest));
}

void run(const Request& request, const io::Program& program) {
  const bool is_name = !request.name.empty() && request.name.size() <= 40 && request.name[0] >= 'a' &&
                       request.name[0] <= 'z' &&
                       request.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
  if (!is_name)
    throw io::InputError("--name: \"" + request.name +
                         "\" begins no name; accepted: small letters, digits and _, a letter first, at most 40");
  if (!request.firmware.empty() && request.name != policy::kPrefix)
    throw io::InputError("--name: the firmware's app knows names of flappy_ alone; accepted: --for without --name");
  const learn::FinishedRun run = learn::read_finished_run(request.run);
  const policy::PolicyNetwork network = deploy::network_of(run.fly);
  if (!request.firmware.empty()) check_app(fs::path(request.out) / request.firmware, request.firmware, network);
  if (request.int8 && (network.layer_norm || network.linear || network.hidden > policy::Activation::tanh))
    throw io::InputError(
        "--int8: whole numbers hold no layer norm, linear output, elu or silu; accepted: a policy of relu or tanh "
        "without them");
  const auto signals = run.fly.fleet.task.observation();
  Export e;
  const std::string why_not = deploy::no_controller(run.fly);
  const bool with_controller = why_not.empty();
  if (!with_controller) std::printf("flappy_controller.h is not written: %s\n", why_not.c_str());
  e.flown = deploy::roll_out(run.fly, 0, kProofFlights);
  if (!std::ranges::all_of(e.flown.action, [](float x) { return std::isfinite(x); }))
    throw io::InputError((fs::path(request.run) / "best.json").string() +
                         ": adds what is not finite in flight; accepted: a policy that flies");
  PolicyVectors tests = deploy::some_of(e.flown, kTestVectors);
  deploy::append(tests, deploy::corners(network, signals));
  Json json = {{"run", request.run}, {"out", request.out}, {"config_sha256", run.info.config_sha256}};

  e.files = deploy::exported_files(run.fly, run.info, network, tests);
  e.proofs["flappy_policy.h"] = for_proof(e, network);
  if (!request.firmware.empty()) {
    for (const auto& [path, text] : deploy::firmware_files(request.firmware, run.fly, e.files))
      e.files[request.firmware + "/" + path] = text;
  }
  io::make_folder(request.out);
  if (request.int8) {
    const PolicyVectors fit = deploy::some_of(deploy::roll_out(run.fly, kProofFlights, kFitFlights), kFitVectors);
    const deploy::QuantisedNetwork whole = deploy::quantise(network, fit.observation);
    PolicyVectors own = tests;
    own.action = evaluate(whole, own.observation);
    e.files["flappy_policy_int8.h"] = deploy::policy_header(run.fly, run.info, whole, own);
    e.proofs["flappy_policy_int8.h"] = for_proof(e, whole);
    const OutputError error = output_error(evaluate(whole, e.flown.observation), e.flown.action, network.output_half());
    print("8 bits differ by at most", error, run.fly.fleet.task.action());
    json["int8_error"] = json_of(error);
  }
  const io::TemporaryFolder work;
  write_for_runtimes(e, request, run, network, work, json);

  const auto measure = [&](const std::string& name, const fs::path& folder, const char* header) {
    if (!request.prove) return;
    const std::vector<deploy::Footprint> rows = deploy::footprints(folder, header);
    std::printf("%s\n%s", name.c_str(), table_of(rows).c_str());
    json["footprints"][name] = json_of(rows);
  };
  for (const auto& [name, vectors] : e.proofs) {
    const fs::path folder = work / name.substr(0, name.find('.'));
    fs::create_directory(folder);
    io::write_atomically(folder / "flappy_policy.h", e.files[name]);
    if (with_controller) io::write_atomically(folder / "flappy_controller.h", e.files["flappy_controller.h"]);
    const std::vector<deploy::Parity> rows =
        deploy::prove(folder, vectors, request.prove ? deploy::Reach::everywhere : deploy::Reach::here);
    std::printf("%s\n%s", name.c_str(), table_of(rows).c_str());
    json["parity"][name] = json_of(rows);
    if (std::ranges::none_of(rows, &deploy::Parity::available)) {
      if (request.prove) throw io::InputError("--prove: there is no compiler in PATH; accepted: a C compiler");
      std::printf("%s is not proven: cc is not in PATH; its self-test is to pass on the target\n", name.c_str());
    }
    if (std::ranges::any_of(rows, &deploy::Parity::failed))
      throw std::runtime_error(name + " does not compute what was trained; nothing is written");
    measure(name, folder, "flappy_policy.h");
  }
  if (with_controller) measure("flappy_controller.h", work / "flappy_policy", "flappy_controller.h");
  std::map<std::string, std::string> files;
  for (const auto& [name, text] : e.files)
    if (name.ends_with(".h") && request.firmware.empty())
      files[policy::with_prefix(name, request.name)] = policy::with_prefix(text, request.name);
    else files[name] = name == "README.md" ? policy::with_prefix(text, request.name) : text;
  write_all(request.out, request.name, files);
  for (const auto& [name, text] : files)
    std::printf("%s: %zu bytes\n", (fs::path(request.out) / name).c_str(), text.size());
  program.write_json(json);
}

}  // namespace
}  // namespace flappy::exports

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-export",
                      "Exports a finished run as TorchScript, as ONNX and as C headers that prove themselves.",
                      {std::string("TorchScript ") + (policy::reads_torch_script() ? "yes" : "no"),
                       std::string("ONNX ") + (policy::writes_onnx() ? "yes" : "no")});
  exports::Request r;
  program.app().option("run", r.run, "run folder that flappy-train left").required();
  program.app().option("--out", r.out, "folder for what is exported").required();
  program.app().flag("--int8", r.int8, "the policy in whole numbers of 8 bits too: flappy_policy_int8.h");
  program.app()
      .option("--name", r.name, "what names in C, and of headers, begin with: two policies in one program need two")
      .shows_default();
  program.app()
      .option("--for", r.firmware,
              "sources of an app for this firmware, too: crazyflie (a Flapper Nimble+) or px4 (two motors)")
      .one_of({std::begin(deploy::kFirmwares), std::end(deploy::kFirmwares)});
  program.app().flag("--prove", r.prove,
                     "prove it on every compiler at hand and on a Cortex-M4F, and measure what microcontrollers need");
  return program.run(argc, argv, [&] { exports::run(r, program); });
}
