#include "server/http/socket_client.hpp"

#include <httplib.h>
#include <sys/socket.h>

#include <map>
#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "io/log.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFetches = 3;  // of a file that is replaced while it is fetched

JobStatus job_of(const Json& j) {
  return {j.at("id"),        j.at("kind"),     j.at("config"),  j.at("state"), j.at("attempts"),
          j.at("exit_code"), j.at("progress"), j.at("message"), j.at("folder")};
}

/// The body of an answer. Throws io::InputError with the server's message where it refuses.
std::string body(const httplib::Result& result, const fs::path& folder) {
  if (!result && result.error() == httplib::Error::Connection)
    throw io::InputError(folder.string() +
                         ": no server works here; accepted: the folder of jobs of a flappy-server that "
                         "runs, by --jobs FOLDER");
  if (!result) throw io::InputError(folder.string() + ": the server does not answer in time (--timeout)");
  if (result->status == 200) return result->body;
  const Json json = Json::parse(result->body, nullptr, false);
  throw io::InputError(json.is_object() ? json.value("message", "the server refuses") : "the server refuses");
}

}  // namespace

SocketClient::SocketClient(const fs::path& folder, double timeout_s)
    : folder_(folder), path_(folder), client_(std::make_unique<httplib::Client>(path_.text())) {
  client_->set_address_family(AF_UNIX);
  const auto microseconds = std::chrono::microseconds(static_cast<std::int64_t>(1e6 * timeout_s));
  client_->set_connection_timeout(microseconds);
  client_->set_read_timeout(microseconds + std::chrono::seconds(1));  // the server lets who follows wait
  client_->set_write_timeout(microseconds);
}

SocketClient::~SocketClient() = default;

CommandResult SocketClient::ask(Command command) {
  if (command.id.empty()) command.id = fresh_id();
  const Json asked = {{"id", command.id},         {"verb", command.verb}, {"kind", command.kind},
                      {"config", command.config}, {"job", command.job},   {"overrides", command.overrides}};
  const Json r = Json::parse(
      body(client_->Post("/command", asked.dump(-1, ' ', false, Json::error_handler_t::replace), "application/json"),
           folder_));
  return {r.at("id"), r.at("accepted"), r.at("job"), r.at("message")};
}

SocketClient::Listed SocketClient::ask_for_jobs(const std::string& query) {
  const Json json = Json::parse(body(client_->Get("/jobs" + query), folder_));
  Listed listed{json.at("changes"), {}};
  for (const Json& each : json.at("jobs")) listed.jobs.push_back(job_of(each));
  return listed;
}

std::vector<JobStatus> SocketClient::list() {
  seen_ = ask_for_jobs("");
  return seen_.jobs;
}

void SocketClient::watch(const std::function<bool(const JobStatus& job)>& see,
                         const std::function<bool()>& keep_going) {
  std::map<std::uint64_t, JobStatus> before;
  for (const JobStatus& each : seen_.jobs) before.emplace(each.id, each);
  while (keep_going()) {
    seen_ = ask_for_jobs("?since=" + std::to_string(seen_.changes));
    for (auto each = seen_.jobs.rbegin(); each != seen_.jobs.rend(); ++each) {  // oldest first
      const auto [at, fresh] = before.try_emplace(each->id, *each);
      if (!fresh && at->second == *each) continue;
      at->second = *each;
      if (!see(*each)) return;
    }
  }
}

std::size_t SocketClient::fetch(std::uint64_t job, const fs::path& folder,
                                const std::function<void(const JobFile&)>& see) {
  const std::string query = "/files?job=" + std::to_string(job);
  const Json files = Json::parse(body(client_->Get(query), folder_));
  std::size_t fetched = 0;
  for (const Json& each : files) {
    const JobFile file{each.at("name"), each.at("bytes")};
    see(file);
    const fs::path path = place_of(folder, file.name);
    bool there = true, whole = false;
    for (int attempt = 0; attempt < kFetches && there && !whole; ++attempt) {
      io::AtomicFile to(path);
      std::uint64_t got = 0;
      const httplib::Result result =
          client_->Get(query + "&name=" + file.name, [&](const char* bytes, std::size_t size) {
            to.write({bytes, size});
            got += size;
            return true;
          });
      there = !result || result->status == 200;
      whole = result && there && std::to_string(got) == result->get_header_value("Content-Length");
      if (whole) to.commit();
    }
    if (!there) io::log(io::LogLevel::warning, file.name + ": is gone meanwhile, and is left out");
    else if (!whole) throw io::InputError(file.name + ": changes while it is fetched; accepted: the same once more");
    fetched += whole;
  }
  return fetched;
}

}  // namespace flappy::server
