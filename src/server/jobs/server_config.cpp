#include "server/jobs/server_config.hpp"

#include <algorithm>

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

fs::path existing_folder(const io::Table& table, const std::string& key) {
  std::error_code error;
  fs::path folder = fs::canonical(table.file(key), error);
  if (error || !fs::is_directory(folder)) table.fail(key, "is no folder", "a folder that exists");
  return folder;
}

JobsConfig read_jobs(const io::Table& table) {
  table.accept({"configs", "output", "data", "backend", "at_once", "threads", "attempts", "grace_s", "sbatch"});
  JobsConfig c;
  c.folders.configs = existing_folder(table, "configs");
  if (table.has("data")) c.folders.data = existing_folder(table, "data");
  if (table.has("output")) {
    io::make_folder(table.file("output"));
    c.folders.output = existing_folder(table, "output");
  } else {
    io::make_folder(kJobsFolder);
    c.folders.output = fs::canonical(kJobsFolder);
  }
  c.backend =
      table.choice_or("backend", "local", {"local", "slurm"}) == "slurm" ? BackendKind::slurm : BackendKind::local;
  c.at_once = static_cast<int>(table.integer_or("at_once", 1, 1, 1000));
  c.threads = static_cast<int>(table.integer_or("threads", 0, 0, 1024));
  c.attempts = static_cast<int>(table.integer_or("attempts", 3, 1, 100));
  c.grace_s = table.number_or("grace_s", 30, {0, 3600});
  if (table.has("sbatch")) c.sbatch = table.strings("sbatch");
  if (!c.sbatch.empty() && c.backend != BackendKind::slurm)
    table.fail("sbatch", "is of no use here", "backend = \"slurm\"");
  if (!std::ranges::all_of(c.sbatch, [](const std::string& word) { return word.starts_with("--"); }))
    table.fail("sbatch", "holds what is no option", "as [\"--partition=short\", \"--time=60\"]");
  return c;
}

HttpConfig read_http(const io::Table& table) {
  HttpConfig c;
  c.listen = table.string_or("listen", "");
  if (table.has("hosts")) c.hosts = table.strings("hosts");
  c.streams = static_cast<int>(table.integer_or("streams", 4, 1, 64));
  c.patience_s = table.number_or("patience_s", 5, {0.1, 60});
  return c;
}

RateConfig read_rates(const io::Table& table) {
  constexpr io::Range kRate{0.01, 10000};
  RateConfig c;
  c.per_client_hz = table.number_or("per_client_hz", c.per_client_hz, kRate);
  c.all_hz = table.number_or("all_hz", c.all_hz, kRate);
  c.burst_s = table.number_or("burst_s", c.burst_s, {0.1, 1000});
  return c;
}

}  // namespace

ServerConfig read_server_config(const fs::path& path, const std::vector<std::string>& overrides) {
  const io::Config config = io::Config::load(path, overrides);
  const io::Table root = config.root();
  root.accept({"schema", "jobs", "http", "rates", "dds"});
  root.schema(1);
  ServerConfig c;
  if (const auto table = root.optional_table("http")) c.http = read_http(*table);
  if (const auto table = root.optional_table("rates")) c.rates = read_rates(*table);
  c.dds = io::read_dds_config(root);
  c.jobs = read_jobs(root.table("jobs"));
  root.finish();
  return c;
}

}  // namespace flappy::server
