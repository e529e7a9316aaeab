#include "server/http/command_socket.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <thread>

#include "io/files.hpp"
#include "server/http/listener.hpp"
#include "server/jobs/status_json.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using httplib::Request;
using httplib::Response;
using Json = nlohmann::ordered_json;

constexpr std::size_t kSocketThreads = 8;
constexpr double kSocketPatience_s = 10;
constexpr std::chrono::milliseconds kFollow{500};  // how long /jobs waits for a change

void reply(Response& response, const Json& json) {
  response.set_content(json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n", "application/json");
}

std::uint64_t number(const Request& request, const char* key) {
  const std::string text = request.get_param_value(key);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw io::InputError(std::string(key) + ": is no number; accepted: 0, 1, ...");
  return value;
}

Command command_of(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  try {
    return {json.at("id"),
            {},
            json.at("verb"),
            json.value("kind", ""),
            json.value("config", ""),
            json.value("job", std::uint64_t{0}),
            json.value("overrides", std::vector<std::string>())};
  } catch (const Json::exception&) {
    throw io::InputError("a command: is malformed; accepted: as src/server/http/command_socket.hpp says it");
  }
}

}  // namespace

SocketPath::SocketPath(const fs::path& folder) : folder_(open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)) {
  if (folder_ < 0) throw io::InputError(folder.string() + ": is no folder; accepted: the folder of a server's jobs");
}

SocketPath::~SocketPath() { close(folder_); }

std::string SocketPath::text() const { return "/proc/self/fd/" + std::to_string(folder_) + "/" + kSocketName; }

struct CommandSocket::Parts {
  Parts(Commands& its_commands, const fs::path& folder)
      : commands(its_commands), path(folder), listener(kSocketThreads, kSocketPatience_s) {}
  void route();

  Commands& commands;
  SocketPath path;
  Listener listener;
  std::thread thread;
};

void CommandSocket::Parts::route() {
  listener.set_exception_handler([](const Request&, Response& response, const std::exception_ptr& what) {
    try {
      std::rethrow_exception(what);
    } catch (const io::InputError& e) {
      response.status = 400;
      reply(response, {{"message", e.what()}});
    } catch (...) {
      response.status = 500;
      reply(response, {{"message", "internal fault"}});
    }
  });
  listener.Post("/command", [this](const Request& request, Response& response) {
    const CommandResult r = commands.execute(command_of(request.body));
    reply(response, {{"id", r.id}, {"accepted", r.accepted}, {"job", r.job}, {"message", r.message}});
  });
  listener.Get("/jobs", [this](const Request& request, Response& response) {
    const std::uint64_t changes =
        request.has_param("since") ? commands.wait_for_change(number(request, "since"), kFollow) : commands.changes();
    Json jobs = Json::array();
    for (const JobStatus& each : commands.statuses()) jobs.push_back(json_of(each));
    reply(response, {{"changes", changes}, {"jobs", std::move(jobs)}});
  });
  listener.Get("/files", [this](const Request& request, Response& response) {
    const std::uint64_t job = number(request, "job");
    const std::vector<JobFile> files = commands.files(job);
    if (!request.has_param("name")) {
      Json list = Json::array();
      for (const JobFile& file : files) list.push_back({{"name", file.name}, {"bytes", file.bytes}});
      return reply(response, list);
    }
    const std::string name = request.get_param_value("name");
    const auto found = std::ranges::find(files, name, &JobFile::name);
    if (found == files.end()) throw io::InputError(std::string(kNoSuchFile) + ": \"" + shown(name) + "\"");
    if (found->bytes == 0) return response.set_content("", "application/octet-stream");
    response.set_content_provider(
        found->bytes, "application/octet-stream",
        [this, job, name](std::size_t offset, std::size_t left, httplib::DataSink& sink) {
          std::string piece;
          try {
            piece = commands.chunk(job, name, offset);
          } catch (const io::InputError&) {  // the file is gone: the client notices that bytes are missing
          }
          piece.resize(std::min(piece.size(), left));  // the file may grow meanwhile
          return !piece.empty() && sink.write(piece.data(), piece.size());
        });
  });
}

CommandSocket::CommandSocket(Commands& commands, const fs::path& folder)
    : parts_(std::make_unique<Parts>(commands, folder)) {
  parts_->route();
  const std::string path = parts_->path.text();
  unlink(path.c_str());  // of a server that was killed
  parts_->listener.set_address_family(AF_UNIX);
  const mode_t before = umask(0177);
  const bool bound = parts_->listener.bind_to_port(path, 1);
  umask(before);
  if (!bound)
    throw io::InputError((folder / kSocketName).string() +
                         ": cannot be listened on; accepted: a folder on a disk that holds sockets");
  parts_->thread = std::thread([this] { parts_->listener.listen_after_bind(); });
}

CommandSocket::~CommandSocket() {
  // stop() has no effect before the listener runs
  while (!parts_->listener.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  parts_->listener.stop();
  parts_->thread.join();
  unlink(parts_->path.text().c_str());
}

}  // namespace flappy::server
