#include "learn/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <map>

#include "io/files.hpp"
#include "io/tensorboard.hpp"
#include "refusal.hpp"

namespace flappy::learn {
namespace {

const double kNone = std::nan("");
const MetricsColumns kColumns = {{"update", "env_steps", "return_mean", "success"}, {"wall_s"}};

using test::refusal;

// ---- a reader of event files that shares nothing with the writer but the checksum, which has a test of its own

struct Event {
  double wall_s = 0;
  std::int64_t step = 0;
  std::string file_version;
  std::map<std::string, float> scalars;
};

class Decoder {
 public:
  explicit Decoder(std::string_view bytes) : rest_(bytes) {}
  bool done() const { return rest_.empty(); }
  template <class T>
  T fixed() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<unsigned char>(take(1)[0]);
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
  }
  std::string_view take(std::size_t size) {
    if (size > rest_.size()) throw std::runtime_error("cut short");
    const auto taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

 private:
  std::string_view rest_;
};

Event decode_event(std::string_view data) {
  Event event;
  for (Decoder d(data); !d.done();) {
    switch (d.varint()) {
      case 1 << 3 | 1:
        event.wall_s = d.fixed<double>();
        break;
      case 2 << 3 | 0:
        event.step = static_cast<std::int64_t>(d.varint());
        break;
      case 3 << 3 | 2:
        event.file_version = d.take(d.varint());
        break;
      case 5 << 3 | 2:
        for (Decoder summary(d.take(d.varint())); !summary.done();) {
          EXPECT_EQ(summary.varint(), 1u << 3 | 2);
          std::string tag;
          for (Decoder value(summary.take(summary.varint())); !value.done();) {
            const auto key = value.varint();
            if (key == (1 << 3 | 2)) tag = value.take(value.varint());
            else if (key == (2 << 3 | 5)) event.scalars[tag] = value.fixed<float>();
            else throw std::runtime_error("unknown field of a value");
          }
        }
        break;
      default:
        throw std::runtime_error("unknown field of an event");
    }
  }
  return event;
}

std::vector<Event> decode_events(const std::string& bytes) {
  std::vector<Event> events;
  for (Decoder d(bytes); !d.done();) {
    const auto checked = [&](std::uint64_t size) {
      const std::string_view data = d.take(size);
      const std::uint32_t rotated = d.fixed<std::uint32_t>() - 0xa282ead8u;
      EXPECT_EQ(rotated >> 17 | rotated << 15, io::crc32c(data));
      return data;
    };
    std::uint64_t size = 0;
    std::memcpy(&size, checked(8).data(), 8);
    events.push_back(decode_event(checked(size)));
  }
  return events;
}

class MetricsTest : public testing::Test {
 protected:
  ~MetricsTest() override { std::filesystem::remove_all(run_); }

  std::string text(const char* name) const { return io::read_text(run_ / name); }
  void record_three() {
    Metrics metrics(run_, kColumns);
    metrics.record(std::vector{1000.0, 1e6, -0.1, kNone}, std::vector{1.5});
    metrics.record(std::vector{2000.0, 2e6, 1.0 / 3, 0.75}, std::vector{3.25});
    metrics.record(std::vector{3000.0, 3e6, 1e300, 1.0}, std::vector{kNone});
    EXPECT_EQ(metrics.sync(), 3u);
  }
  std::string resume(std::uint64_t records, const MetricsColumns& columns = kColumns) {
    return refusal([&] { Metrics metrics(run_, columns, records); });
  }
  std::map<std::string, std::string> all() const {
    std::map<std::string, std::string> texts;
    for (const char* name : {"metrics.jsonl", "metrics.csv", "timing.jsonl", "events.out.tfevents.flappy"})
      texts[name] = text(name);
    return texts;
  }

  const std::filesystem::path run_ =
      testing::TempDir() + "flappy_metrics_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const bool made_ = std::filesystem::create_directories(run_);
};

TEST_F(MetricsTest, WritesTheSameFiguresEverywhere) {
  record_three();
  EXPECT_EQ(text("metrics.jsonl"),
            "{\"update\":1000,\"env_steps\":1000000,\"return_mean\":-0.1,\"success\":null}\n"
            "{\"update\":2000,\"env_steps\":2000000,\"return_mean\":0.3333333333333333,\"success\":0.75}\n"
            "{\"update\":3000,\"env_steps\":3000000,\"return_mean\":1e+300,\"success\":1}\n");
  EXPECT_EQ(text("metrics.csv"),
            "update,env_steps,return_mean,success\n1000,1000000,-0.1,\n2000,2000000,0.3333333333333333,0.75\n"
            "3000,3000000,1e+300,1\n");
  EXPECT_EQ(text("timing.jsonl"),
            "{\"update\":1000,\"wall_s\":1.5}\n{\"update\":2000,\"wall_s\":3.25}\n{\"update\":3000,\"wall_s\":null}\n");
  const auto events = decode_events(text("events.out.tfevents.flappy"));
  ASSERT_EQ(events.size(), 4u);
  EXPECT_EQ(events[0].file_version, "brain.Event:2");
  for (const auto& event : events) EXPECT_GT(event.wall_s, 1.7e9);
  EXPECT_EQ(events[1].step, 1000);
  using Scalars = std::map<std::string, float>;
  EXPECT_EQ(events[1].scalars, (Scalars{{"env_steps", 1e6f}, {"return_mean", -0.1f}, {"wall_s", 1.5f}}));
  EXPECT_EQ(events[2].step, 2000);
  EXPECT_EQ(events[2].scalars,
            (Scalars{{"env_steps", 2e6f}, {"return_mean", 1.0f / 3}, {"success", 0.75f}, {"wall_s", 3.25f}}));
  EXPECT_EQ(events[3].scalars.count("wall_s"), 0u);
}

TEST_F(MetricsTest, GoesOnAfterACheckpoint) {
  record_three();
  const auto whole = all();
  {
    Metrics metrics(run_, kColumns, 2);
    EXPECT_EQ(metrics.sync(), 2u);
    EXPECT_EQ(text("metrics.csv"),
              "update,env_steps,return_mean,success\n1000,1000000,-0.1,\n"
              "2000,2000000,0.3333333333333333,0.75\n");
    EXPECT_EQ(decode_events(text("events.out.tfevents.flappy")).size(), 3u);
    metrics.record(std::vector{3000.0, 3e6, 1e300, 1.0}, std::vector{kNone});
  }
  const auto again = all();
  for (const char* name : {"metrics.jsonl", "metrics.csv", "timing.jsonl"}) EXPECT_EQ(again.at(name), whole.at(name));
  EXPECT_EQ(decode_events(again.at("events.out.tfevents.flappy")).size(), 4u);
  // half a record of a killed program
  io::write_atomically(run_ / "metrics.jsonl", whole.at("metrics.jsonl") + "{\"update\":40");
  EXPECT_EQ(resume(3), "accepted");
  EXPECT_EQ(all().at("metrics.jsonl"), whole.at("metrics.jsonl"));
  // a run that starts again leaves nothing of the one before
  { const Metrics metrics(run_, kColumns); }
  EXPECT_EQ(text("metrics.jsonl") + text("timing.jsonl"), "");
  EXPECT_EQ(text("metrics.csv"), "update,env_steps,return_mean,success\n");
  EXPECT_EQ(decode_events(text("events.out.tfevents.flappy")).size(), 1u);
}

TEST_F(MetricsTest, RefusesFilesThatDoNotReachTheCheckpoint) {
  record_three();
  const auto whole = all();
  for (const auto& [name, good] : whole) {
    SCOPED_TRACE(name);
    const std::string file = (run_ / name).string();
    io::write_atomically(file, good.substr(0, good.size() - 1));
    const auto before = all();
    EXPECT_EQ(resume(3), file + ": has 2 records; accepted: at least the 3 of the checkpoint");
    EXPECT_EQ(all(), before) << "nothing was cut";
    std::filesystem::remove(file);
    EXPECT_EQ(resume(3), file + ": cannot be read: No such file or directory");
    EXPECT_FALSE(std::filesystem::exists(file));
    io::write_atomically(file, good);
  }
  EXPECT_EQ(resume(4),
            (run_ / "metrics.jsonl").string() + ": has 3 records; accepted: at least the 4 of the checkpoint");
  io::write_atomically(run_ / "events.out.tfevents.flappy", "");
  EXPECT_EQ(resume(1), (run_ / "events.out.tfevents.flappy").string() +
                           ": has 0 records; accepted: at least the 1 of the checkpoint");
  EXPECT_EQ(resume(1, {{"update", "success"}, {"wall_s"}}),
            (run_ / "metrics.csv").string() + ":1: has other columns; accepted: update,success");
}

TEST_F(MetricsTest, NamesTheFileThatCannotBeWritten) {
  std::filesystem::create_symlink("/dev/full", run_ / "timing.jsonl");
  Metrics metrics(run_, kColumns);
  EXPECT_EQ(refusal([&] {
              metrics.record(std::vector{1.0, 2.0, 3.0, 4.0}, std::vector{1.5});
            }),
            (run_ / "timing.jsonl").string() + ": cannot be written: No space left on device");
  EXPECT_EQ(refusal([&] { const Metrics none(run_ / "none", kColumns); }),
            (run_ / "none" / "metrics.jsonl").string() + ": cannot be written: No such file or directory");
  EXPECT_THROW(metrics.record(std::vector{1.0}, std::vector{1.5}), std::logic_error);
}

TEST_F(MetricsTest, ReadsItsRecords) {
  record_three();
  const MetricsTable table = read_metrics(run_ / "metrics.jsonl");
  EXPECT_EQ(table.names, kColumns.metrics);
  EXPECT_EQ(table.column("return_mean"), (std::vector{-0.1, 1.0 / 3, 1e300}));
  EXPECT_TRUE(std::isnan(table.column("success")[0]));
  EXPECT_EQ(table.column("success")[1], 0.75);
  const std::string file = (run_ / "metrics.jsonl").string();
  EXPECT_EQ(refusal([&] { static_cast<void>(table.column("sucess")); }),
            file +
                ": sucess: column is missing; columns here: update, env_steps, return_mean, success; "
                "did you mean \"success\"?");
  const auto read = [&](const std::string& text) {
    io::write_atomically(file, text);
    const std::string message = refusal([&] { read_metrics(file); });
    return message.starts_with(file) ? message.substr(file.size()) : message;
  };
  const std::string good = "{\"a\":1,\"b\":null}\n";
  EXPECT_EQ(read(""), "accepted");
  EXPECT_EQ(read(good + "{\"a\":1"), ":2: the line has no end; accepted: whole lines");
  EXPECT_EQ(read(good + "\n"), ":2: is no record; accepted: {\"name\":number,...}");
  EXPECT_EQ(read("[1]\n"), ":1: is no record; accepted: {\"name\":number,...}");
  const std::string other = ": is not what the first line has here; accepted: the same columns, numbers or null";
  EXPECT_EQ(read(good + "{\"a\":1,\"c\":2}\n"), ":2: c" + other);
  EXPECT_EQ(read(good + "{\"a\":1,\"b\":\"2\"}\n"), ":2: b" + other);
  EXPECT_EQ(read(good + "{\"a\":1,\"b\":2,\"c\":3}\n"), ":2: c" + other);
  EXPECT_EQ(read(good + "{\"a\":1}\n"), ":2: b: column is missing");
}

}  // namespace
}  // namespace flappy::learn
