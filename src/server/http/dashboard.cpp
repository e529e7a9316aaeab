#include "server/http/dashboard.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>
#include <utility>

#include "io/files.hpp"
#include "io/progress.hpp"
#include "server/http/listener.hpp"
#include "server/http/web.hpp"
#include "server/jobs/commands.hpp"
#include "server/jobs/job_types.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using httplib::Request;
using httplib::Response;
using Json = nlohmann::ordered_json;

constexpr std::size_t kJobs = 200, kLogBytes = 32'768, kCurveBytes = 4'000'000, kCurvePoints = 500;
constexpr std::size_t kThreads = 6;  // in addition to one for each stream of /events
constexpr std::chrono::milliseconds kEventEvery{100};
constexpr double kHeartbeat_s = 10;

/// The page may load this server's own files only, and no inline script or style.
const httplib::Headers kHeaders = {
    {"Content-Security-Policy",
     "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Referrer-Policy", "no-referrer"},
    {"Cache-Control", "no-store"},
};

void answer(Response& response, int status, const std::string& line) {
  response.status = status;
  response.set_content(line + "\n", "text/plain; charset=utf-8");
}

void answer(Response& response, const Json& json) {
  response.set_content(json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n", "application/json");
}

/// Splits "127.0.0.1:8080" or "[::1]:8080" into address and port.
std::pair<std::string, int> split_address(const std::string& listen) {
  const std::size_t colon = listen.rfind(':');
  const std::string port = colon == std::string::npos ? "" : listen.substr(colon + 1);
  const bool number = !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
  if (!number || colon == 0 || std::stoi(port) > 65535)
    throw io::InputError("http.listen: \"" + listen + "\" is no address; accepted: ADDRESS:PORT, as 127.0.0.1:8080");
  std::string host = listen.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return {host, std::stoi(port)};
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The host of a Host header in lower case, without port and brackets.
std::string host_of(const std::string& header) {
  const std::size_t colon = header.rfind(':');
  const bool port =
      colon != std::string::npos && header.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  std::string host = lower(port && header.back() != ']' ? header.substr(0, colon) : header);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return host;
}

Json json_of(const Job& job) {
  return {{"id", job.id},
          {"kind", job.asked.kind},
          {"config", job.asked.config},
          {"overrides", job.asked.overrides},
          {"state", name_of(job.state)},
          {"attempts", job.attempts},
          {"exit_code", job.exit_code ? Json(*job.exit_code) : Json(nullptr)},
          {"progress", job.progress},
          {"message", job.message},
          {"submitted_s", job.submitted_s},
          {"started_s", job.started_s},
          {"ended_s", job.ended_s}};
}

Json json_of(const std::optional<ShownState>& state) {
  if (!state) return nullptr;
  return {{"source", state->source},
          {"t_s", state->t_s},
          {"position_m", state->position_m},
          {"q_WB", state->q_WB},
          {"v_WB_W_m_s", state->v_WB_W_m_s},
          {"w_WB_B_rad_s", state->w_WB_B_rad_s},
          {"battery_V", state->battery_V ? Json(*state->battery_V) : Json(nullptr)}};
}

/// The training curve from the end of metrics.jsonl, thinned to at most kCurvePoints points.
Json curve_of(const fs::path& run) {
  const std::string text = tail_of(run / "metrics.jsonl", kCurveBytes);
  std::vector<Json> records;
  for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    Json record = Json::parse(text.substr(at, end - at), nullptr, false);
    if (record.is_object()) records.push_back(std::move(record));
  }
  const std::size_t step = records.size() / kCurvePoints + 1;
  Json curve;
  for (const char* column : {"update", "success_rate", "return_mean"}) {
    curve[column] = Json::array();
    for (std::size_t i = (records.size() + step - 1) % step; i < records.size(); i += step)
      curve[column].push_back(records[i].value(column, Json(nullptr)));
  }
  return curve;
}

}  // namespace

struct Dashboard::Parts {
  Parts(const Queue& its_queue, const LiveState& its_watched, const ServerConfig& config)
      : queue(its_queue),
        watched(its_watched),
        output(config.jobs.folders.output),
        most_streams(config.http.streams),
        listener(kThreads + static_cast<std::size_t>(config.http.streams), config.http.patience_s) {
    for (const char* own : {"localhost", "127.0.0.1", "::1"}) hosts.insert(own);
    for (const std::string& host : config.http.hosts) hosts.insert(lower(host));
  }

  void route();
  void stream_events(Response& response);

  const Queue& queue;
  const LiveState& watched;
  fs::path output;
  int most_streams;
  std::set<std::string> hosts;
  std::atomic<int> streams = 0;
  std::atomic<bool> over = false;
  Listener listener;
  std::thread thread;
};

void Dashboard::Parts::route() {
  listener.set_default_headers(kHeaders);
  listener.set_pre_routing_handler([this](const Request& request, Response& response) {
    const auto refuse = [&](int status, const std::string& line) {
      answer(response, status, line);
      return httplib::Server::HandlerResponse::Handled;
    };
    // against DNS rebinding: a foreign page may have led the browser here under a name of its own
    if (request.get_header_value_count("Host") != 1 || !hosts.contains(host_of(request.get_header_value("Host"))))
      return refuse(421, "Host: is not this server's; accepted: localhost, its address, http.hosts");
    if (request.method != "GET" && request.method != "HEAD") {
      response.set_header("Allow", "GET, HEAD");
      return refuse(405, "nothing can be changed here");
    }
    if (request.get_header_value("Range").find(',') != std::string::npos)  // else each would be a copy in memory
      return refuse(416, "Range: has several ranges; accepted: one");
    return httplib::Server::HandlerResponse::Unhandled;
  });
  listener.set_error_handler([](const Request&, Response& response) {
    if (response.body.empty()) answer(response, response.status, "there is nothing here");
  });
  listener.set_exception_handler([](const Request&, Response& response, const std::exception_ptr& what) {
    try {
      std::rethrow_exception(what);
    } catch (const io::InputError& e) {
      answer(response, 404, e.what());
    } catch (...) {
      answer(response, 500, "internal fault");
    }
  });

  const auto page = [this](const char* path, const char* file, const char* type) {
    listener.Get(path, [=](const Request&, Response& response) {
      const std::string_view text = kWeb.at(file);
      response.set_content(text.data(), text.size(), type);
    });
  };
  page("/", "page.html", "text/html; charset=utf-8");
  for (const char* script : {"/page.js", "/live.js", "/scene.js", "/geometry.js", "/three.min.js"})
    page(script, script + 1, "text/javascript; charset=utf-8");
  page("/page.css", "page.css", "text/css; charset=utf-8");
  page("/icon.svg", "icon.svg", "image/svg+xml");

  listener.Get("/api/jobs", [this](const Request&, Response& response) {
    Json list = Json::array();
    for (const Job& job : queue.jobs(kJobs)) list.push_back(json_of(job));
    answer(response, list);
  });
  const auto of_job = [this](const char* what, auto call) {
    listener.Get(std::string(R"(/api/jobs/(\d{1,18})/)") + what,
                 [this, call](const Request& request, Response& response) {
                   call(queue.job(std::stoull(request.matches[1])), response);
                 });
  };
  of_job("curve",
         [this](const Job& job, Response& response) { answer(response, curve_of(output / job.folder / "run")); });
  of_job("log", [this](const Job& job, Response& response) {
    response.set_content(tail_of(output / job.folder / kLogName, kLogBytes), "text/plain; charset=utf-8");
  });
  of_job("files", [this](const Job& job, Response& response) {
    Json list = Json::array();
    for (const JobFile& file : files_of(output / job.folder))
      list.push_back({{"name", file.name}, {"bytes", file.bytes}});
    answer(response, list);
  });
  of_job("history", [this](const Job& job, Response& response) {
    Json list = Json::array();
    for (const Transition& t : queue.history(job.id))
      list.push_back({{"time_s", t.time_s}, {"state", name_of(t.state)}, {"attempt", t.attempt}, {"why", t.why}});
    answer(response, list);
  });
  listener.Get("/api/watched",
               [this](const Request&, Response& response) { answer(response, json_of(watched.get().first)); });
  listener.Get("/events", [this](const Request&, Response& response) { stream_events(response); });
}

/// Every client of /events occupies a thread, so their number is limited.
void Dashboard::Parts::stream_events(Response& response) {
  if (streams.fetch_add(1) >= most_streams) {
    --streams;
    response.set_header("Retry-After", "10");
    return answer(response, 503, "as many follow as may; accepted: to ask for /api/jobs now and then");
  }
  struct Seen {
    std::uint64_t jobs = UINT64_MAX, watched = 0;
    double told_s = 0;
  };
  auto seen = std::make_shared<Seen>();
  response.set_chunked_content_provider(
      "text/event-stream",
      [this, seen](std::size_t, httplib::DataSink& sink) {
        if (over || !sink.is_writable()) return false;
        std::string events;
        if (const std::uint64_t changes = queue.changes(); changes != seen->jobs) {
          events += "event: jobs\ndata: " + std::to_string(changes) + "\n\n";
          seen->jobs = changes;
        }
        if (const auto [state, count] = watched.get(); count != seen->watched) {
          events +=
              "event: watched\ndata: " + json_of(state).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n\n";
          seen->watched = count;
        }
        const double now_s = io::steady_seconds();
        if (events.empty() && now_s > seen->told_s + kHeartbeat_s) events = ": still here\n\n";
        if (!events.empty()) {
          seen->told_s = now_s;
          if (!sink.write(events.data(), events.size())) return false;
        }
        std::this_thread::sleep_for(kEventEvery);
        return true;
      },
      [this](bool) { --streams; });
}

Dashboard::Dashboard(const Queue& queue, const LiveState& watched, const ServerConfig& config)
    : parts_(std::make_unique<Parts>(queue, watched, config)) {
  auto [host, port] = split_address(config.http.listen);
  parts_->hosts.insert(lower(host));
  parts_->route();
  if (port == 0) port = parts_->listener.bind_to_any_port(host);
  else if (!parts_->listener.bind_to_port(host, port)) port = -1;
  if (port < 0)
    throw io::InputError("http.listen: \"" + config.http.listen +
                         "\" cannot be listened on; accepted: a free port of an address of this machine");
  parts_->listener.widen();
  address_ = (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + std::to_string(port);
  parts_->thread = std::thread([this] { parts_->listener.listen_after_bind(); });
}

Dashboard::~Dashboard() {
  parts_->over = true;
  // stop() has no effect before the listener runs
  while (!parts_->listener.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  parts_->listener.stop();
  parts_->thread.join();
}

}  // namespace flappy::server
