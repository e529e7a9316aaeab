// The dashboard: what it shows, to whom, and that nobody can change or hold up anything.
#include "server/http/dashboard.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "io/progress.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"
#include "server/http/web.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

ServerConfig config_of(const fs::path& output) {
  ServerConfig c;
  c.jobs.folders = {output, output, output};
  c.http = {"127.0.0.1:0", {"lab.example"}, 2, 0.2};
  return c;
}

struct Page : ::testing::Test {
  Page() {
    queue.submit({"a", "train", "train/<b>.toml", {"seed=1"}});
    fs::create_directories(folder / "1/run");
    io::write_atomically(folder / "1/job.log", "first\nlast\n");
    io::write_atomically(folder / "1/run/metrics.jsonl",
                         "{\"update\":10,\"success_rate\":null,\"return_mean\":-1}\n{\"update\":20,\"success_rate\":0."
                         "5,\"return_mean\":2}\n{\"upd");
    io::write_atomically(folder / "secret", "secret");
    client.set_read_timeout(5);
  }
  int port() const { return std::stoi(dashboard.address().substr(dashboard.address().rfind(':') + 1)); }
  httplib::Result get(const std::string& path, const std::string& host = "localhost") {
    return client.Get(path, {{"Host", host}});
  }
  int connected() const {
    const int descriptor = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    const timeval patience{5, 0};
    setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    return descriptor;
  }
  /// All that comes until the server closes; `most` bytes end it, too.
  static std::string rest_of(int descriptor, std::size_t most = 1 << 20) {
    std::string text;
    char block[4096];
    ssize_t count = 0;
    while (text.size() < most && (count = recv(descriptor, block, sizeof block, 0)) > 0)
      text.append(block, static_cast<std::size_t>(count));
    return text;
  }
  std::string raw(const std::string& request) const {
    const int descriptor = connected();
    EXPECT_EQ(send(descriptor, request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
    const std::string text = rest_of(descriptor);
    close(descriptor);
    return text.substr(0, text.find('\r'));
  }

  io::TemporaryFolder folder;
  Queue queue{folder.path()};
  LiveState watched;
  Dashboard dashboard{queue, watched, config_of(folder.path())};
  httplib::Client client{"127.0.0.1", port()};
};

TEST_F(Page, ShowsWhatThereIs) {
  const auto json = [&](const std::string& path) {
    const auto result = get(path);
    EXPECT_TRUE(result && result->status == 200) << path;
    return Json::parse(result->body);
  };
  const Json jobs = json("/api/jobs");
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0]["id"], 1);
  EXPECT_EQ(jobs[0]["state"], "queued");
  EXPECT_EQ(jobs[0]["overrides"], Json({"seed=1"}));
  EXPECT_EQ(json("/api/jobs/1/curve"),
            Json::parse(R"({"update":[10,20],"success_rate":[null,0.5],"return_mean":[-1,2]})"));
  EXPECT_EQ(get("/api/jobs/1/log")->body, "first\nlast\n");
  const Json files = json("/api/jobs/1/files");
  ASSERT_EQ(files.size(), 2U) << files;
  EXPECT_EQ(files[0], Json({{"name", "job.log"}, {"bytes", 11}}));
  EXPECT_EQ(json("/api/jobs/1/history")[0]["why"], "submitted");
  EXPECT_TRUE(json("/api/watched").is_null());
  ShownState state;
  state.source = "job 1";
  state.position_m = {1, 2, 3};
  watched.set(state);
  EXPECT_EQ(json("/api/watched")["position_m"], Json({1, 2, 3}));
  EXPECT_TRUE(json("/api/watched")["battery_V"].is_null());
}

TEST_F(Page, IsStrictWithContent) {
  for (const char* path : {"/", "/page.js", "/page.css", "/icon.svg", "/live.js", "/scene.js", "/geometry.js",
                           "/three.min.js", "/api/jobs", "/none"}) {
    const auto result = get(path);
    ASSERT_TRUE(result) << path;
    EXPECT_EQ(result->status, std::string(path) == "/none" ? 404 : 200) << path;
    EXPECT_TRUE(result->get_header_value("Content-Security-Policy").starts_with("default-src 'self';")) << path;
    EXPECT_EQ(result->get_header_value("Content-Security-Policy").find("unsafe"), std::string::npos);
    EXPECT_EQ(result->get_header_value("X-Content-Type-Options"), "nosniff");
    EXPECT_FALSE(result->has_header("Access-Control-Allow-Origin"));
  }
  // the page itself holds to it: nothing inline, nothing from elsewhere
  const std::string html(kWeb.at("page.html"));
  for (const char* bad : {"style=", "<style", "onclick", "onload", "http:", "https:", "javascript:"})
    EXPECT_EQ(html.find(bad), std::string::npos) << bad;
  EXPECT_NE(html.find("<script src=\"page.js\" type=\"module\"></script>"), std::string::npos);
  for (const char* bad : {"innerHTML", "insertAdjacentHTML", "document.write", "eval(", "https:"})
    for (const char* script : {"page.js", "live.js", "scene.js", "geometry.js"})
      EXPECT_EQ(kWeb.at(script).find(bad), std::string_view::npos) << script << " " << bad;
  // whatever a script imports is served
  for (const auto& [name, text] : kWeb)
    for (std::size_t at = 0; (at = text.find(" from \"./", at)) != std::string_view::npos; ++at) {
      const std::string_view path = text.substr(at + 8);
      EXPECT_EQ(get(std::string(path.substr(0, path.find('"'))).c_str())->status, 200) << name;
    }
}

TEST_F(Page, AnswersToItsOwnNamesAlone) {
  for (const char* host : {"localhost", "LOCALHOST:9000", "127.0.0.1", "127.0.0.1:8080", "[::1]:8080", "lab.example"})
    EXPECT_EQ(get("/", host)->status, 200) << host;
  for (const char* host : {"evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80", "", "localhost:80:80",
                           "localhost:x", "[::1"})
    EXPECT_EQ(get("/api/jobs", host)->status, 421) << host;
  EXPECT_EQ(raw("GET / HTTP/1.1\r\n\r\n"), "HTTP/1.1 421 Misdirected Request");
  EXPECT_EQ(raw("GET / HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-,0-\r\n\r\n"),
            "HTTP/1.1 416 Range Not Satisfiable");
  EXPECT_EQ(raw("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n"), "HTTP/1.1 421 Misdirected Request");
}

TEST_F(Page, ChangesNothing) {
  for (const char* method : {"POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE"}) {
    const std::string request =
        std::string(method) + " /api/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n{}";
    EXPECT_EQ(raw(request), "HTTP/1.1 405 Method Not Allowed") << method;
  }
  EXPECT_EQ(raw("BREW / HTTP/1.1\r\nHost: localhost\r\n\r\n"), "HTTP/1.1 400 Bad Request");
  EXPECT_EQ(client.Head("/")->status, 200);
  EXPECT_EQ(queue.jobs(10).size(), 1u);
}

TEST_F(Page, LeadsToNoFile) {
  for (const char* path :
       {"/../secret", "/%2e%2e/secret", "/secret", "/api/jobs/../secret/log", "/api/jobs/%2e%2e/log",
        "/api/jobs/1/secret", "/api/jobs/1/run/metrics.jsonl", "/api/jobs/-1/log", "/api/jobs/2/log",
        "/api/jobs/999999999999999999/log", "/api/jobs/9999999999999999999999/log", "/queue.sqlite", "//etc/passwd"}) {
    const auto result = get(path);
    ASSERT_TRUE(result) << path;
    EXPECT_EQ(result->status, 404) << path;
    EXPECT_EQ(result->body.find("secret\n"), std::string::npos);
  }
}

TEST_F(Page, TellsWhatChanges) {
  std::string seen;
  std::atomic<bool> submitted = false;
  const double from_s = io::steady_seconds();
  client.Get("/events", {{"Host", "localhost"}}, [&](const char* bytes, std::size_t count) {
    seen.append(bytes, count);
    if (seen.find("event: jobs") != std::string::npos && !submitted.exchange(true)) {
      queue.submit({"b", "train", "x", {}});
      watched.set({"flapper 7", 1.5, {0, 0, 1}});
    }
    const std::size_t first = seen.find("event: jobs");
    const bool all =
        seen.find("event: jobs", first + 1) != std::string::npos && seen.find("flapper 7") != std::string::npos;
    return !all && io::steady_seconds() < from_s + 5;
  });
  EXPECT_NE(seen.find("event: watched\ndata: {\"source\":\"flapper 7\",\"t_s\":1.5,\"position_m\":[0.0,0.0,1.0]"),
            std::string::npos)
      << seen;
}

TEST_F(Page, LetsSoManyFollow) {
  const std::string request = "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n";
  std::vector<int> followers;
  for (int i = 0; i < 2; ++i) {
    followers.push_back(connected());
    ASSERT_GT(send(followers.back(), request.data(), request.size(), 0), 0);
    EXPECT_TRUE(rest_of(followers.back(), 15).starts_with("HTTP/1.1 200 OK"));
  }
  EXPECT_EQ(raw(request), "HTTP/1.1 503 Service Unavailable");
  EXPECT_EQ(get("/api/jobs")->status, 200);
  // who leaves makes room
  close(followers[0]);
  const double from_s = io::steady_seconds();
  bool room = false;
  while (!room && io::steady_seconds() < from_s + 5) {
    const int follower = connected();
    send(follower, request.data(), request.size(), 0);
    room = rest_of(follower, 15).starts_with("HTTP/1.1 200 OK");
    close(follower);
  }
  EXPECT_TRUE(room);
  close(followers[1]);
}

TEST_F(Page, WaitsForNobodyLong) {
  // one byte at a time would keep any timeout of a single read at bay
  const int slow = connected();
  const double from_s = io::steady_seconds();
  const std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(1000, 'x');
  for (std::size_t i = 0; i < request.size() && io::steady_seconds() < from_s + 3; ++i) {
    if (send(slow, &request[i], 1, MSG_NOSIGNAL) < 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_LT(io::steady_seconds() - from_s, 1.5);
  close(slow);
  // and as many as like to say nothing do not keep out who speaks
  std::vector<int> silent;
  for (int i = 0; i < 100; ++i) silent.push_back(connected());
  const double then_s = io::steady_seconds();
  int status = 0;
  while (status != 200 && io::steady_seconds() < then_s + 5)
    if (const auto result = get("/api/jobs")) status = result->status;
  EXPECT_EQ(status, 200);
  for (const int descriptor : silent) close(descriptor);
}

TEST_F(Page, TakesNoLargeRequest) {
  const std::string much(1'000'000, 'x');
  EXPECT_FALSE(raw("GET /" + much + " HTTP/1.1\r\nHost: localhost\r\n\r\n").starts_with("HTTP/1.1 200"));
  std::string headers;
  for (int i = 0; i < 200; ++i) headers += "X-" + std::to_string(i) + ": " + std::string(100, 'x') + "\r\n";
  const int descriptor = connected();
  const std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n";
  send(descriptor, request.data(), request.size(), MSG_NOSIGNAL);
  EXPECT_FALSE(rest_of(descriptor).starts_with("HTTP/1.1 200"));
  close(descriptor);
  EXPECT_EQ(get("/")->status, 200);
}

TEST(Dashboard, ListensWhereItIsToldOrSaysWhyNot) {
  const io::TemporaryFolder folder;
  Queue queue(folder.path());
  LiveState watched;
  ServerConfig config = config_of(folder.path());
  const Dashboard first(queue, watched, config);
  const auto refused = [&](const std::string& listen) {
    config.http.listen = listen;
    return flappy::test::refusal([&] { Dashboard other(queue, watched, config); });
  };
  EXPECT_EQ(refused(first.address()),
            "http.listen: \"" + first.address() +
                "\" cannot be listened on; accepted: a free port of an address of this machine");
  for (const char* bad : {"8080", ":8080", "localhost", "localhost:", "localhost:http", "localhost:99999"})
    EXPECT_NE(refused(bad).find("is no address; accepted: ADDRESS:PORT"), std::string::npos) << bad;
}

}  // namespace
}  // namespace flappy::server
