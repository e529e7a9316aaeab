#include "flightlog/ros/mcap.hpp"

#include <gtest/gtest.h>
#include <lz4frame.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <csignal>
#include <map>
#include <set>

#include "flightlog/ros/mcap_records.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::ros::mcap_test {
namespace {

using mcap::Bytes;

struct Seen {
  std::string topic, type, definition, bytes;
  std::int64_t logged_ns, stamp_ns;
  bool operator==(const Seen&) const = default;
};

/// All messages, and what was warned of.
std::vector<Seen> read(std::string_view bytes, std::vector<std::string>* warnings = nullptr) {
  McapReader reader(bytes, "f.mcap");
  std::vector<Seen> all;
  while (const auto m = reader.next())
    all.push_back(
        {m->topic->name, m->topic->type, m->topic->definition, std::string(m->bytes), m->logged_ns, m->stamp_ns});
  if (warnings) *warnings = reader.warnings();
  return all;
}

/// `count` messages a millisecond apart, of two topics.
std::string written(const McapOptions& options, int count, std::vector<Seen>* expected = nullptr) {
  const io::TemporaryFolder folder;
  McapWriter writer(folder / "f.mcap", options);
  const auto a = writer.add_topic("/a", "p/msg/A", "int8 x\n", "RIHS01_00");
  const auto b = writer.add_topic("/b", "p/msg/B", "int8 y\n", "");
  for (int i = 0; i < count; ++i) {
    const Seen s = {i % 3 ? "/a" : "/b",
                    i % 3 ? "p/msg/A" : "p/msg/B",
                    i % 3 ? "int8 x\n" : "int8 y\n",
                    "message " + std::to_string(i),
                    1'000'000ll * i,
                    1'000'000ll * i - 5};
    writer.write(i % 3 ? a : b, s.logged_ns, s.stamp_ns, s.bytes);
    if (expected) expected->push_back(s);
  }
  writer.finish();
  return io::read_text(folder / "f.mcap");
}

TEST(Mcap, ReadsWhatItWrote) {
  for (const bool compress : {true, false}) {
    std::vector<Seen> expected;
    std::vector<std::string> warnings;
    EXPECT_EQ(read(written({compress, 500, 1}, 100, &expected), &warnings), expected);
    EXPECT_TRUE(warnings.empty());
  }
}

struct Record {
  std::uint8_t code;
  std::string_view content;
};

Record record_at(std::string_view bytes, std::uint64_t at) {
  mcap::Parts parts(bytes.substr(at));
  const auto code = parts.number<std::uint8_t>();
  return {code, parts.raw(parts.number<std::uint64_t>())};
}

/// No reader that is tried with --full follows these offsets, but others do.
TEST(Mcap, HasASummaryThatPointsToEveryMessage) {
  const std::string bytes = written({false, 500, 1}, 100);
  const std::size_t footer = bytes.size() - mcap::kMagic.size() - 29;
  mcap::Parts end(record_at(bytes, footer).content);
  const auto summary = end.number<std::uint64_t>(), offsets = end.number<std::uint64_t>();
  const std::string_view summed = std::string_view(bytes).substr(summary, footer + 25 - summary);
  EXPECT_EQ(end.number<std::uint32_t>(), crc32_z(0, reinterpret_cast<const Bytef*>(summed.data()), summed.size()));
  std::map<std::uint8_t, std::uint64_t> groups;
  for (std::size_t at = offsets; at < footer;) {
    const Record r = record_at(bytes, at);
    ASSERT_EQ(r.code, mcap::kSummaryOffset);
    mcap::Parts parts(r.content);
    const auto code = parts.number<std::uint8_t>();
    groups[code] = parts.number<std::uint64_t>();
    EXPECT_EQ(record_at(bytes, groups[code]).code, code);
    at += 9 + r.content.size();
  }
  EXPECT_EQ(groups.size(), 4u);  // schemas, channels, statistics, chunks
  std::set<std::uint64_t> times;
  for (std::size_t at = groups.at(mcap::kChunkIndex); at < offsets;) {
    const Record r = record_at(bytes, at);
    ASSERT_EQ(r.code, mcap::kChunkIndex);
    at += 9 + r.content.size();
    mcap::Parts parts(r.content);
    parts.raw(16);
    const Record chunk = record_at(bytes, parts.number<std::uint64_t>());
    ASSERT_EQ(chunk.code, mcap::kChunk);
    EXPECT_EQ(parts.number<std::uint64_t>(), 9 + chunk.content.size());
    const std::string_view records = chunk.content.substr(40);  // times, sizes, checksum, no compression
    for (mcap::Parts places(parts.string()); !places.rest().empty();) {
      const auto topic = places.number<std::uint16_t>();
      const Record index = record_at(bytes, places.number<std::uint64_t>());
      ASSERT_EQ(index.code, mcap::kMessageIndex);
      mcap::Parts entries(index.content);
      EXPECT_EQ(entries.number<std::uint16_t>(), topic);
      for (mcap::Parts entry(entries.string()); !entry.rest().empty();) {
        const auto time = entry.number<std::uint64_t>();
        const Record message = record_at(records, entry.number<std::uint64_t>());
        ASSERT_EQ(message.code, mcap::kMessage);
        mcap::Parts head(message.content);
        EXPECT_EQ(head.number<std::uint16_t>(), topic);
        head.raw(4);
        EXPECT_EQ(head.number<std::uint64_t>(), time);
        times.insert(time);
      }
    }
  }
  EXPECT_EQ(times.size(), 100u);
}

TEST(Mcap, CompressesWhereAsked) { EXPECT_LT(written({true}, 1000).size(), written({false}, 1000).size() / 2); }

TEST(Mcap, LeavesAReadableFileWhenKilled) {
  const io::TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    McapWriter writer(folder / "f.mcap", {true, 1 << 20, 0.05});
    const auto topic = writer.add_topic("/a", "p/msg/A", "int8 x\n", "");
    for (int i = 0; i < 1000; ++i) writer.write(topic, 1'000'000ll * i, 0, "message " + std::to_string(i));
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  std::vector<std::string> warnings;
  const std::vector<Seen> seen = read(io::read_text(folder / "f.mcap"), &warnings);
  ASSERT_GE(seen.size(), 950u);  // 50 ms of messages may be in memory
  for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i].bytes, "message " + std::to_string(i));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("f.mcap: ends within a record, at byte "), std::string::npos) << warnings[0];
}

TEST(Mcap, ReadsATruncatedFileAsFarAsItGoes) {
  std::vector<Seen> expected;
  const std::string whole = written({false, 300, 1}, 40, &expected);
  std::size_t most = 0;
  for (std::size_t size = 8; size < whole.size(); ++size) {
    const std::vector<Seen> seen = read(std::string_view(whole).substr(0, size));
    ASSERT_TRUE(std::equal(seen.begin(), seen.end(), expected.begin())) << size;
    EXPECT_GE(seen.size(), most);
    most = seen.size();
  }
  EXPECT_EQ(most, expected.size());
}

TEST(Mcap, LeavesOutDamagedChunks) {
  std::vector<Seen> expected;
  const std::string whole = written({false, 300, 1}, 40, &expected);
  for (const char* damaged : {"message 0", "message 20"}) {  // the first has the channels in its chunk
    std::string bytes = whole;
    bytes[bytes.find(damaged) + 2] = 'X';
    std::vector<std::string> warnings;
    const std::vector<Seen> seen = read(bytes, &warnings);
    EXPECT_GT(seen.size(), 30u);
    EXPECT_LT(seen.size(), expected.size());
    for (const Seen& s : seen) EXPECT_EQ(s, expected[static_cast<std::size_t>(s.logged_ns / 1'000'000)]);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(warnings[0].starts_with("f.mcap: the record at byte ")) << warnings[0];
    EXPECT_TRUE(warnings[0].ends_with(" is a chunk that its checksum does not match: left out")) << warnings[0];
  }
}

TEST(Mcap, ReadsMessagesWithoutChunksAndChunksInLz4) {
  const std::string schema =
      Bytes().number<std::uint16_t>(1).string("p/msg/A").string("ros2msg").string("int8 x\n").record(mcap::kSchema);
  const std::string channel =
      Bytes().number<std::uint16_t>(4).number<std::uint16_t>(1).string("/a").string("cdr").string("").record(
          mcap::kChannel);
  const auto message = [](std::int64_t t_ns) {
    return Bytes().number<std::uint16_t>(4).number<std::uint32_t>(0).number(t_ns).number(t_ns).raw("bytes").record(
        mcap::kMessage);
  };
  const std::string inner = message(2);
  std::string packed(LZ4F_compressFrameBound(inner.size(), nullptr), '\0');
  packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), inner.data(), inner.size(), nullptr));
  const auto chunk = [&](const char* compression, const std::string& records) {
    return Bytes()
        .number<std::int64_t>(2)
        .number<std::int64_t>(2)
        .number<std::uint64_t>(inner.size())
        .number<std::uint32_t>(0)
        .string(compression)
        .number<std::uint64_t>(records.size())
        .raw(records)
        .record(mcap::kChunk);
  };
  std::vector<std::string> warnings;
  const std::vector<Seen> seen =
      read(std::string(mcap::kMagic) + schema + channel + message(1) + chunk("lz4", packed) + chunk("br", packed) +
               chunk("zstd", packed) + message(3) + Bytes().record(mcap::kDataEnd),
           &warnings);
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_EQ(seen[1], (Seen{"/a", "p/msg/A", "int8 x\n", "bytes", 2, 2}));
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("is compressed as br, which is not read: left out"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("cannot be uncompressed"), std::string::npos) << warnings[1];
}

TEST(Mcap, RefusesWhatIsNone) {
  EXPECT_EQ(test::refusal([] { read("PK something else"); }),
            "f.mcap: is no MCAP file; accepted: a file that begins as one");
  EXPECT_EQ(test::refusal([] { McapWriter("/nowhere/at/all.mcap"); }),
            "/nowhere/at/all.mcap: cannot be written: No such file or directory");
}

}  // namespace
}  // namespace flappy::flightlog::ros::mcap_test
