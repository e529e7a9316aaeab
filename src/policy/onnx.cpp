#include "policy/onnx.hpp"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "io/child_process.hpp"
#include "io/files.hpp"
#include "io/plugin.hpp"
#include "io/refuse.hpp"
#include "io/run_program.hpp"

namespace flappy::policy {
namespace {

namespace fs = std::filesystem;
using io::refuse;
using Json = nlohmann::ordered_json;

constexpr const char* kOnnxPlugin = "onnx";

/// Runs under python3 with the file and the number of observations. It says in one line of JSON what the file is, then
/// answers each int64 count and float[count][width] by int64 size and float[size], or by minus the size of a complaint
/// and the complaint. A row holds an observation and, if the file has a second input, the memory; so do answers.
constexpr const char* kOnnxRuntime = R"(
import json, signal, struct, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asks decides
ours, theirs = sys.stdin.buffer, sys.stdout.buffer
def say(**what):
    theirs.write((json.dumps(what) + "\n").encode())
    theirs.flush()
try:
    import numpy, onnxruntime
except ImportError as e:
    say(missing=str(e))
    sys.exit()
options = onnxruntime.SessionOptions()
options.intra_op_num_threads = options.inter_op_num_threads = 1
options.log_severity_level = 4
try:
    session = onnxruntime.InferenceSession(sys.argv[1], options, providers=["CPUExecutionProvider"])
except Exception as e:
    say(refused=str(e))
    sys.exit()
def sides(values):
    return [{"name": v.name, "type": v.type, "shape": [n if isinstance(n, int) else -1 for n in v.shape]} for v in values]
say(inputs=sides(session.get_inputs()), outputs=sides(session.get_outputs()))
seen, width = session.get_inputs(), int(sys.argv[2])
single, split = seen[0].shape[0] == 1, [width][: len(seen) - 1]
width += sum(v.shape[1] for v in seen[1:] if isinstance(v.shape[1], int))
def act(rows):
    parts = [numpy.ascontiguousarray(part) for part in numpy.split(rows, split, 1)]
    made = session.run([v.name for v in session.get_outputs()], {v.name: part for v, part in zip(seen, parts)})
    return numpy.concatenate(made, 1) if split else made[0]
while len(head := ours.read(8)) == 8:
    count = struct.unpack("=q", head)[0]
    rows = numpy.frombuffer(ours.read(4 * count * width), numpy.float32).reshape(count, width)
    try:
        action = numpy.concatenate([act(row[None]) for row in rows]) if single else act(rows)
        theirs.write(struct.pack("=q", action.size) + action.astype(numpy.float32).tobytes())
    except Exception as e:
        what = str(e).encode()
        theirs.write(struct.pack("=q", -len(what)) + what)
    theirs.flush()
)";

/// The first line of what onnxruntime complains of, without its own prefix "[ONNXRuntimeError] : 1 : FAIL : ".
std::string reason(std::string complaint) {
  complaint.resize(std::min(complaint.find('\n'), complaint.size()));
  if (!complaint.starts_with("[ONNXRuntimeError]")) return complaint;
  std::size_t at = 0;
  for (int colons = 0; colons < 3 && at != std::string::npos; ++colons) at = complaint.find(" : ", at + 1);
  return at == std::string::npos ? complaint : complaint.substr(at + 3);
}

std::string shape_of(const Json& side) {
  std::string shape = side.at("type").get<std::string>() + "[";
  for (std::size_t i = 0; i < side.at("shape").size(); ++i) {
    const auto n = side["shape"][i].get<std::int64_t>();
    shape += (i > 0 ? ", " : "") + (n < 0 ? std::string("n") : std::to_string(n));
  }
  return shape + "]";
}

/// Whether it is float[n][width] or float[1][width]; a width that the file leaves open is tried out.
bool fits(const Json& side, int width) {
  const Json& shape = side.at("shape");
  return side.at("type") == "tensor(float)" && shape.size() == 2 && shape[0].get<std::int64_t>() <= 1 &&
         shape[0] != 0 && (shape[1] == width || shape[1].get<std::int64_t>() < 0);
}

class OnnxRuntime : public Policy {
 public:
  OnnxRuntime(const fs::path& path, int observations, int actions)
      : Policy(observations, actions),
        path_(path),
        python_({"python3", "-c", kOnnxRuntime, path.string(), std::to_string(observations)}) {}

  Json description() const { return Json::parse(python_.read_line()); }

  void act(std::size_t count, const float* observation, float* action) const override {
    const auto rows = static_cast<std::int64_t>(count);
    std::int64_t size = 0;
    std::string complaint;
    try {
      python_.write(&rows, sizeof rows);
      python_.write(observation, count * static_cast<std::size_t>(observations() + memory()) * sizeof(float));
      python_.read(&size, sizeof size);
      if (size == rows * (actions() + memory()))
        return python_.read(action, static_cast<std::size_t>(size) * sizeof(float));
      complaint.resize(size < 0 ? static_cast<std::size_t>(-size) : 0);
      python_.read(complaint.data(), complaint.size());
    } catch (const std::runtime_error& e) {
      throw std::runtime_error(path_.string() + ": python3 with onnxruntime " + e.what());
    }
    if (size < 0) refuse(path_, "cannot be evaluated: " + reason(complaint), sizes());
    refuse(path_, "makes " + std::to_string(size) + " numbers of " + std::to_string(count) + " observations", sizes());
  }

  /// A file that is recurrent: its second input is the memory.
  void set_memory(int units) { memory_ = units; }

  std::string sizes() const {
    return "float[n][" + std::to_string(observations()) + "] to float[n][" + std::to_string(actions()) +
           "], as the task has";
  }

 private:
  fs::path path_;
  io::ChildProcess python_;
};

}  // namespace

bool writes_onnx() { return io::has_plugin(kOnnxPlugin); }

std::string onnx_model(const PolicyNetwork& network, const OnnxMetadata& metadata) {
  if (!writes_onnx()) throw std::invalid_argument("ONNX is not written by a build without the ONNX library");
  return io::plugin<OnnxFunctions>(kOnnxPlugin, "flappy_onnx_functions", "")->write(network, metadata);
}

std::string onnxruntime_version() {
  try {
    const io::Finished python =
        io::run({"python3", "-c", "import importlib.metadata as m; print(m.version('onnxruntime'))"});
    return python.exit_code == 0 ? python.out.substr(0, python.out.find('\n')) : "";
  } catch (const std::system_error&) {
    return "";
  }
}

std::unique_ptr<const Policy> load_onnx(const fs::path& path, int observations, int actions) {
  io::read_text(path);
  const std::string runtime = "python3 in PATH with the package onnxruntime; or a C header (.h)";
  std::unique_ptr<OnnxRuntime> policy;
  Json file;
  try {
    policy = std::make_unique<OnnxRuntime>(path, observations, actions);
    file = policy->description();
  } catch (const std::exception& e) {  // none of this name, or one that does not start
    refuse(path, std::string("cannot be flown: python3: ") + e.what(), runtime);
  }
  if (file.contains("missing"))
    refuse(path, "cannot be flown: python3: " + file["missing"].get<std::string>(), runtime);
  if (file.contains("refused"))
    refuse(path, "is not read by onnxruntime: " + reason(file["refused"]), "an ONNX file of an opset that it knows");
  const bool recurrent = file.at("inputs").size() == 2 && file.at("outputs").size() == 2;
  int units = 0;
  for (const auto& [side, width] : {std::pair("inputs", observations), std::pair("outputs", actions)}) {
    const Json& values = file.at(side);
    if (values.size() != 1 && !recurrent)
      refuse(path, "has " + std::to_string(values.size()) + " " + side,
             "one input and one output, " + policy->sizes() + "; or two of each, with the memory second");
    if (!fits(values[0], width))
      refuse(path, values[0].at("name").get<std::string>() + " is " + shape_of(values[0]), policy->sizes());
    if (!recurrent) continue;
    const Json& shape = values[1].at("shape");
    if (units == 0 && shape.size() == 2) units = std::max(0, shape[1].get<int>());
    if (units == 0 || shape.size() != 2 || shape[1] != units || !fits(values[1], units))
      refuse(path, values[1].at("name").get<std::string>() + " is " + shape_of(values[1]),
             "a memory of float[n][units], as wide before as after");
  }
  policy->set_memory(units);
  const std::vector<float> nothing(2 * static_cast<std::size_t>(observations + units));
  std::vector<float> action(2 * static_cast<std::size_t>(actions + units));
  policy->act(2, nothing.data(), action.data());
  return policy;
}

}  // namespace flappy::policy
