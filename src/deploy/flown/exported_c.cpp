#include "deploy/flown/exported_c.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "io/files.hpp"
#include "io/refuse.hpp"
#include "io/run_program.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::deploy {
namespace {

namespace fs = std::filesystem;
using io::refuse;

/// Compiled after both headers. Its names stand for static inline functions, which no library shows.
constexpr const char* kWrapper = R"(
#ifndef FLAPPY_POLICY_MEMORY /* exported before policies had one */
typedef struct {
  float nothing;
} flappy_policy_state;
static inline void flappy_policy_reset(flappy_policy_state *state) { state->nothing = 0.0F; }
static inline int flappy_policy_step_with(flappy_policy_state *state, const float *obs, float *action) {
  (void)state;
  return flappy_policy_step(obs, action);
}
#endif
typedef struct {
  flappy_controller controller;
  flappy_policy_state policy;
} flown_state;
void flown_reset(flappy_controller *c) { flappy_policy_reset(&((flown_state *)c)->policy); }
unsigned flown_state_bytes(void) { return (unsigned)sizeof(flown_state); }
int flown_selftests(void) {
  return flappy_policy_selftest() != 0 ? 1 : flappy_controller_selftest() != 0 ? 2 : 0;
}
uint32_t flown_policy_crc32(void) { return FLAPPY_POLICY_CRC32; }
uint32_t flown_controller_crc32(void) { return FLAPPY_CONTROLLER_CRC32; }
float *flown_constants(void) { return (float *)&flappy_controller_k; }
static flappy_quaternion flown_quaternion(const float *x) {
  flappy_quaternion q;
  q.w = x[0];
  q.x = x[1];
  q.y = x[2];
  q.z = x[3];
  return q;
}
void flown_start(flappy_controller *c, uint32_t now_us, const float *x) {
  flappy_controller_start(c, now_us, flappy_vector_from(x), flown_quaternion(x + 3));
  flown_reset(c);
}
unsigned flown_remembered(void) {
  return (unsigned)((sizeof(flappy_estimator) + sizeof(flappy_motion) + sizeof(flappy_feedback)) / sizeof(float));
}
void flown_recall(flappy_controller *c, const float *x, uint32_t phase) {
  const unsigned own = (unsigned)(sizeof(flappy_estimator) / sizeof(float));
  const unsigned motion = (unsigned)(sizeof(flappy_motion) / sizeof(float)), all = flown_remembered();
  unsigned i;
  for (i = 0; i < own; ++i) ((float *)&c->estimator)[i] = x[i];
  for (i = 0; i < motion; ++i) ((float *)&c->estimate)[i] = x[own + i];
  for (i = own + motion; i < all; ++i) ((float *)&c->feedback)[i - own - motion] = x[i];
  c->phase = phase;
}
void flown_hover(flappy_controller *c) { flappy_controller_hover(c); }
void flown_stay(flappy_controller *c) { flappy_controller_stay(c); }
void flown_begin(flappy_controller *c) {
  flappy_controller_begin(c);
  flown_reset(c);
}
int flown_imu(flappy_controller *c, uint32_t taken_us, const float *x) {
  return flappy_controller_imu(c, taken_us, flappy_vector_from(x), flappy_vector_from(x + 3));
}
int flown_pose(flappy_controller *c, uint32_t taken_us, const float *x) {
  return flappy_controller_pose(c, taken_us, 1, flappy_vector_from(x), flown_quaternion(x + 3));
}
int flown_tick(flappy_controller *c, uint32_t now_us) { return flappy_controller_tick(c, now_us); }
int flown_handed_back(const flappy_controller *c) { return c->handed_back; }
void flown_set_handed_back(flappy_controller *c, int is) { c->handed_back = is; }
uint32_t flown_ticks(const flappy_controller *c) { return c->tick; }
void flown_observe(const flappy_controller *c, float *obs) { flappy_controller_observe(c, obs); }
void flown_forget(flappy_controller *c) {
#if FLAPPY_CONTROLLER_PAST > 0
  c->remembers = 0;
#else
  (void)c;
#endif
}
int flown_policy(flappy_controller *c, const float *obs, float *action) {
  return flappy_policy_step_with(&((flown_state *)c)->policy, obs, action);
}
void flown_act(flappy_controller *c, const float *action) { flappy_controller_act(c, action); }
void flown_steer(flappy_controller *c, float *input) {
  flappy_controller_steer(c);
  input[0] = c->input.amplitude_V;
  input[1] = c->input.difference_V;
  input[2] = c->input.bias_V;
  input[3] = c->input.split_cycle;
}
void flown_drive(flappy_controller *c, const float *input, float *volts) {
  c->input.amplitude_V = input[0];
  c->input.difference_V = input[1];
  c->input.bias_V = input[2];
  c->input.split_cycle = input[3];
#if FLAPPY_CONTROLLER_INPUTS > 0
  flappy_controller_inputs(c, volts);
#else
  flappy_controller_drive(c, volts, volts + 1);
#endif
}
)";

/// Names of the numbers of flappy_controller_k, in their order: each is in a comment at the end of its line.
std::vector<std::pair<std::string, std::size_t>> names_of_constants(const std::string& header) {
  std::vector<std::pair<std::string, std::size_t>> names;
  const std::size_t begin = header.find("flappy_controller_constants flappy_controller_k = {");
  std::istringstream lines(header.substr(begin, header.find("};", begin) - begin));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t comment = line.find("/* "), end = line.find(" */");
    if (comment == std::string::npos || line.find("0x") == std::string::npos) continue;
    std::size_t count = 0;
    for (std::size_t at = line.find("0x"); at < comment; at = line.find("0x", at + 2)) ++count;
    names.emplace_back(line.substr(comment + 3, end - comment - 3), count);
  }
  return names;
}

std::string read_header(const fs::path& file) {
  if (!fs::exists(file)) refuse(file, "is not there", "a folder that flappy-export wrote, without --name");
  return io::read_text(file);
}

/// The headers with constants that may be changed.
std::string source_of(const fs::path& folder, Build build, const std::string& controller) {
  const std::string constant = "static const flappy_controller_constants flappy_controller_k";
  std::string text = controller;
  const std::size_t at = text.find(constant);
  if (at == std::string::npos)
    refuse(folder / "flappy_controller.h", "has no constants", "a header that flappy-export wrote");
  text.replace(at, constant.size(), "static flappy_controller_constants flappy_controller_k");
  return read_header(folder / (build == Build::int8 ? "flappy_policy_int8.h" : "flappy_policy.h")) + text + kWrapper;
}

io::SharedLibrary compiled(const fs::path& folder, Build build, const std::string& controller) {
  const io::TemporaryFolder work;
  const fs::path source = work / "flown.c", library = work / "flown.so";
  io::write_atomically(source, source_of(folder, build, controller));
  std::vector<std::string> command = {build == Build::contracted ? "clang" : "cc", "-O1", "-shared", "-fPIC"};
  if (build == Build::contracted) command.insert(command.end(), {"-ffp-contract=fast", "-march=native"});
  command.insert(command.end(), {source.string(), "-o", library.string()});
  try {
    if (const io::Finished done = io::run(command); done.exit_code != 0)
      refuse(folder, "does not compile: " + done.err.substr(0, done.err.find('\n')),
             "headers that flappy-export wrote");
  } catch (const std::system_error& e) {
    refuse(folder, "cannot be compiled: " + command.front() + ": " + e.code().message(), "a compiler of this name");
  }
  try {
    return io::SharedLibrary(library);
  } catch (const std::runtime_error& e) {
    refuse(folder, std::string("cannot be loaded: ") + e.what(), "headers for this processor");
  }
}

}  // namespace

Contract read_contract(const fs::path& folder) {
  const fs::path file = folder / "contract.json";
  if (!fs::exists(file))
    refuse(file, "is not there", "a folder that flappy-export wrote, or the folder of a finished run");
  try {
    const auto json = nlohmann::json::parse(io::read_text(file));
    if (json.at("schema") != 1) refuse(file, "schema " + json.at("schema").dump(), "1");
    if (json.at("controller_crc32").is_null()) refuse(file, "has no controller", "an export with flappy_controller.h");
    Contract c;
    c.task = json.at("task");
    c.policy_crc32 = json.at("policy_crc32");
    c.controller_crc32 = json.at("controller_crc32");
    const auto& period = json.at("period_us");
    c.control_s = 1e-6 * period.at("control").get<double>();
    c.policy_s = 1e-6 * period.at("policy").get<double>();
    c.driver_s = 1e-6 * period.at("driver").get<double>();
    if (std::min({c.control_s, c.policy_s, c.driver_s}) <= 0) refuse(file, "has a period of 0", "periods above 0");
    const auto& sensors = json.at("sensors");
    c.imu_Hz = sensors.at("imu_Hz");
    c.imu_latency_s = sensors.at("imu_latency_s");
    c.mocap_Hz = sensors.at("mocap_Hz");
    c.mocap_latency_s = sensors.at("mocap_latency_s");
    c.history = json.at("history");
    c.memory = json.value("memory", 0);
    for (const auto& i : json.at("inputs"))
      c.inputs.push_back({i.at("name"), i.at("neutral"), i.at("low"), i.at("high"), i.at("mix")});
    const auto signals = [](const nlohmann::json& list) {
      std::vector<Contract::Signal> to;
      for (const auto& s : list) to.push_back({s.at("name"), s.at("unit"), s.at("low"), s.at("high")});
      return to;
    };
    c.observation = signals(json.at("observation"));
    c.action = signals(json.at("action"));
    c.mean = json.at("normalisation").at("mean").get<std::vector<float>>();
    c.scale = json.at("normalisation").at("scale").get<std::vector<float>>();
    if (c.mean.size() != c.observation.size() || c.scale.size() != c.observation.size() || c.action.size() != 4)
      refuse(file, "its lists differ in length", "a file that flappy-export wrote");
    if (std::ranges::count(c.scale, 0.0F) > 0) refuse(file, "has a scale of 0", "a file that flappy-export wrote");
    return c;
  } catch (const nlohmann::json::exception& e) {
    refuse(file, std::string("is damaged: ") + e.what(), "a file that flappy-export wrote");
  }
}

ExportedC::ExportedC(const fs::path& folder, Build build)
    : ExportedC(folder, build, read_header(folder / "flappy_controller.h")) {}

ExportedC::ExportedC(const fs::path& folder, Build build, const std::string& controller)
    : library_(compiled(folder, build, controller)) {
  const auto take = [&]<class F>(F*& to, const char* name) { to = library_.function<F>(name); };
  take(start, "flown_start");
  take(policy_crc32, "flown_policy_crc32");
  take(controller_crc32, "flown_controller_crc32");
  take(remembered, "flown_remembered");
  take(recall, "flown_recall");
  take(hover, "flown_hover");
  take(stay, "flown_stay");
  take(begin, "flown_begin");
  take(imu, "flown_imu");
  take(pose, "flown_pose");
  take(tick, "flown_tick");
  take(handed_back, "flown_handed_back");
  take(set_handed_back, "flown_set_handed_back");
  take(ticks, "flown_ticks");
  take(observe, "flown_observe");
  take(forget, "flown_forget");
  take(reset, "flown_reset");
  take(policy, "flown_policy");
  take(act, "flown_act");
  take(steer, "flown_steer");
  take(drive, "flown_drive");
  if (const int failed = library_.function<int()>("flown_selftests")(); failed != 0)
    refuse(folder / (failed == 1 ? "flappy_policy.h" : "flappy_controller.h"), "fails its self-test",
           "a header as flappy-export wrote it");
  float* next = library_.function<float*()>("flown_constants")();
  for (const auto& [name, count] : names_of_constants(controller))
    for (std::size_t i = 0; i < count; ++i) constants_[name].push_back(next++);
}

std::size_t ExportedC::state_bytes() const { return library_.function<unsigned()>("flown_state_bytes")(); }

}  // namespace flappy::deploy
