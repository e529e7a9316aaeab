#include "lab/benchmark/foresee_bench.hpp"

#include <cstdio>

#include "io/files.hpp"
#include "lab/benchmark/families.hpp"
#include "lab/benchmark/predict/foresee.hpp"
#include "lab/benchmark/records.hpp"
#include "lab/benchmark/work.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

fs::path file_of(const fs::path& folder, std::size_t number) {
  return folder / "foreseen" / (number_text(number) + ".json");
}

/// A row for each case and effect.
void write_table(const fs::path& folder, const Manifest& manifest) {
  std::string text = "case,effect,rival,nats,probability\n";
  for (const PublicCase& c : manifest.cases) {
    const Json foreseen = read_json(file_of(folder, c.number));
    for (const auto& [effect, f] : foreseen.items())
      text += std::to_string(c.number) + "," + effect + "," + f.at("rival").get<std::string>() + "," +
              io::shortest_digits(f.at("nats")) + "," + io::shortest_digits(f.at("probability")) + "\n";
  }
  io::write_atomically(folder / kForeseenFile, text);
  std::printf("written: %s\n", (folder / kForeseenFile).c_str());
}

}  // namespace

bool foresee_bench(const BenchQuestions& command) {
  for (const fs::path& folder : command.folders) {
    const Manifest manifest = read_manifest(folder);
    if (fs::exists(true_fits(folder)))
      throw io::InputError(folder.string() + ": its labels were opened; accepted: a benchmark that was never scored");
    io::make_folder(folder / "foreseen");
    if (const std::string other = command.other_option(folder / "foreseen" / "options.txt"); !other.empty())
      throw io::InputError(folder.string() + ": was planned with another " + other +
                           "; accepted: the same options, or without the folder " + (folder / "foreseen").string());
    std::vector<const PublicCase*> open;
    for (const PublicCase& c : manifest.cases)
      if (!fs::exists(file_of(folder, c.number))) open.push_back(&c);
    const bool all = work_through("planning", open.size(), command.threads, nullptr, [&](std::size_t k) {
      const PublicCase& c = *open[k];
      const Question q = command.question(folder, manifest, c);
      Json json;
      for (const Foreseen& f : foresee(q))
        json[f.effect] = {{"rival", f.rival}, {"nats", f.nats}, {"probability", f.probability}};
      io::write_atomically(file_of(folder, c.number), json.dump(1) + "\n");
    });
    if (!all) return false;
    write_table(folder, manifest);
  }
  return true;
}

std::optional<Foresight> read_foreseen(const fs::path& folder, std::size_t number, const std::string& effect) {
  if (!fs::exists(file_of(folder, number))) return {};
  const Json json = read_json(file_of(folder, number));
  if (!json.contains(effect)) return {};
  return Foresight{json.at(effect).at("nats"), json.at(effect).at("probability")};
}

}  // namespace flappy::benchmark
