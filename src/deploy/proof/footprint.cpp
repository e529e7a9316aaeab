#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "deploy/embedded.hpp"
#include "deploy/proof/board.hpp"
#include "deploy/proof/proof.hpp"
#include "io/files.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::deploy {
namespace {

namespace fs = std::filesystem;

struct Target {
  std::string name;
  CrossCompiler compiler;
  std::vector<std::string> machine;
};

std::vector<Target> targets() {
  const CrossCompiler arm = arm_compiler(), riscv = riscv_compiler();
  return {{"Cortex-M0+", arm, {"-mcpu=cortex-m0plus", "-mthumb"}},
          {"Cortex-M4F", arm, board_machine()},
          {"Cortex-M7", arm, {"-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16"}},
          {"RV32IMAC", riscv, {"-march=rv32imac", "-mabi=ilp32"}},
          {"RV32IMAFC", riscv, {"-march=rv32imafc", "-mabi=ilp32f"}}};
}

/// Call graph with frame sizes in bytes, from gcc's -fcallgraph-info=su, a line for each node and edge.
class CallGraph {
 public:
  explicit CallGraph(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("node:")) {
        const std::string label = quoted(line, "label: ");
        const std::size_t bytes = label.find(" bytes (");
        if (bytes != label.npos)
          frame_[quoted(line, "title: ")] = std::stol(label.substr(label.rfind("\\n", bytes) + 2));
      } else if (line.starts_with("edge:")) {
        calls_[quoted(line, "sourcename: ")].insert(quoted(line, "targetname: "));
      }
    }
  }

  /// Bytes of the deepest path from a function (a static one's title ends with ":name"); nothing for recursion or an
  /// unknown name. Functions compiled elsewhere count as 0.
  std::optional<long> deepest(const std::string& name) const {
    for (const auto& [title, bytes] : frame_)
      if (title == name || title.ends_with(":" + name)) return below(title, {});
    return std::nullopt;
  }

 private:
  static std::string quoted(const std::string& line, const std::string& key) {
    const std::size_t at = line.find(key + '"');
    if (at == line.npos) return "";
    const std::size_t begin = at + key.size() + 1;
    return line.substr(begin, line.find('"', begin) - begin);
  }

  std::optional<long> below(const std::string& title, std::set<std::string> path) const {
    if (!path.insert(title).second) return std::nullopt;
    long deepest = 0;
    if (const auto called = calls_.find(title); called != calls_.end())
      for (const auto& callee : called->second) {
        const std::optional<long> bytes = below(callee, path);
        if (!bytes) return std::nullopt;
        deepest = std::max(deepest, *bytes);
      }
    const auto frame = frame_.find(title);
    return deepest + (frame == frame_.end() ? 0 : frame->second);
  }

  std::map<std::string, long> frame_;
  std::map<std::string, std::set<std::string>> calls_;
};

struct Built {
  std::string why_not;
  long flash = 0, ram = 0, stack = 0;
};

/// Builds footprint.c for one target; `call` is the macro that selects the function it calls, or empty.
Built build(const fs::path& headers, const std::string& header, const io::TemporaryFolder& work, const Target& target,
            const std::string& optimisation, const std::string& call) {
  const std::string gcc = target.compiler.prefix + "gcc";
  std::string graph;
  for (const std::string source : {"footprint", "memory"}) {
    std::vector<std::string> command = {gcc,
                                        "-std=gnu99",
                                        optimisation,
                                        "-ffreestanding",
                                        "-ffunction-sections",
                                        "-fdata-sections",
                                        "-fcallgraph-info=su"};
    append(command, target.machine);
    append(command, strict_options({headers}));
    append(command, {"-DFOOTPRINT_HEADER=\"" + header + "\"", "-c", (work / (source + ".c")).string(), "-o",
                     (work / (source + ".o")).string()});
    if (!call.empty()) command.push_back("-D" + call);
    const io::Finished compiled = run_limited(command);
    if (compiled.exit_code != 0) return {"does not compile: " + first_complaint(compiled.err)};
    graph += io::read_text(work / (source + ".ci"));
  }
  const std::string program = (work / "footprint.elf").string();
  std::vector<std::string> link = {gcc};
  append(link, target.machine);
  append(link, {"-nostdlib", "-Wl,-e,main", "-Wl,--gc-sections", (work / "footprint.o").string(),
                (work / "memory.o").string(), "-lgcc", "-o", program});
  const io::Finished linked = run_limited(link);
  if (linked.exit_code != 0) return {"does not link: " + first_complaint(linked.err)};
  std::istringstream sizes(run_limited({target.compiler.prefix + "size", program}).out);
  std::string titles;
  long text = 0, data = 0, bss = 0;
  std::getline(sizes, titles);
  if (!(sizes >> text >> data >> bss)) return {"cannot be measured by " + target.compiler.prefix + "size"};
  const std::optional<long> stack = CallGraph(graph).deepest("footprint");
  if (!stack) return {"recurses: no bound of its stack"};
  return {"", text + data, data + bss, *stack};
}

}  // namespace

std::vector<Footprint> footprints(const fs::path& folder, const std::string& header) {
  io::read_text(folder / header);  // throws where the file is missing
  const fs::path headers = fs::absolute(folder);
  const io::TemporaryFolder work;
  for (const std::string name : {"footprint.c", "memory.c"}) io::write_atomically(work / name, kEmbedded.at(name));
  const std::string stem = header.substr(0, header.rfind('.'));
  std::vector<std::pair<std::string, std::string>> functions;  // name, and the macro that makes footprint.c call it
  const std::string work_of = stem + (stem == "flappy_policy" ? "_step" : "_period");
  functions.emplace_back(work_of, "FOOTPRINT_STEP=" + work_of);
  functions.emplace_back(stem + "_selftest", "FOOTPRINT_SELFTEST=" + stem + "_selftest");

  std::vector<Footprint> rows;
  for (const auto& target : targets()) {
    std::string machine;
    for (const auto& word : target.machine) machine += (machine.empty() ? "" : " ") + word;
    const bool installed = in_path(target.compiler.prefix + "gcc");
    for (const std::string options : {"-Os", "-O2"}) {
      const Built without = installed ? build(headers, header, work, target, options, "") : Built{};
      for (const auto& [function, call] : functions) {
        Footprint row{.function = function, .target = target.name, .options = options, .machine = machine};
        if (!installed) {
          row.available = false;
          row.why_not = "not installed: " + target.compiler.package;
        } else {
          const Built with = without.why_not.empty() ? build(headers, header, work, target, options, call) : without;
          row.why_not = with.why_not;
          if (with.why_not.empty()) {
            row.flash_bytes = with.flash - without.flash;
            row.ram_bytes = with.ram - without.ram;
            row.stack_bytes = with.stack;
          }
        }
        rows.push_back(row);
      }
    }
  }
  return rows;
}

}  // namespace flappy::deploy
