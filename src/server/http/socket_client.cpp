#include "server/http/socket_client.hpp"

#include <httplib.h>
#include <sys/socket.h>

#include <map>
#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "server/jobs/status_json.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

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
  for (const Json& each : json.at("jobs")) listed.jobs.push_back(status_from(each));
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

std::vector<JobFile> SocketClient::list_files(std::uint64_t job) {
  std::vector<JobFile> files;
  for (const Json& each : Json::parse(body(client_->Get("/files?job=" + std::to_string(job)), folder_)))
    files.push_back({each.at("name"), each.at("bytes")});
  return files;
}

JobClient::Download SocketClient::download(std::uint64_t job, const std::string& name,
                                           const std::function<void(std::string_view)>& write) {
  std::uint64_t got = 0;
  const httplib::Result result =
      client_->Get("/files?job=" + std::to_string(job) + "&name=" + name, [&](const char* bytes, std::size_t size) {
        write({bytes, size});
        got += size;
        return true;
      });
  if (result && result->status != 200) return Download::gone;
  const bool whole = result && std::to_string(got) == result->get_header_value("Content-Length");
  return whole ? Download::whole : Download::changed;
}

}  // namespace flappy::server
