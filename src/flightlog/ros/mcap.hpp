// Writes and reads MCAP files (mcap.dev/spec), messages of many topics, with profile "ros2", as rosbag2 and Foxglove.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/append_file.hpp"

namespace flappy::flightlog::ros {

struct McapOptions {
  bool compress = true;  ///< whether chunks are compressed by zstd
  std::size_t chunk_bytes = 1u << 20;
  /// Longest span of log times that a chunk may cover, so that no more is lost when the process is killed.
  double flush_s = 1;
};

/// Writes messages in chunks, which do not depend on later bytes, so a killed process leaves a file that can be read up
/// to the last one. InputError where the file cannot be written.
class McapWriter {
 public:
  explicit McapWriter(const std::filesystem::path& path, const McapOptions& options = {});
  /// Finishes the file if finish() was not called; errors of writing are then not reported.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Returns the number of the topic for write(). `definition`: concatenated. `hash`: from type_hash(), or empty.
  std::uint16_t add_topic(const std::string& topic, const std::string& type, const std::string& definition,
                          const std::string& hash);
  /// `stamp_ns`: time of sending or of the event that the message reports.
  void write(std::uint16_t topic, std::int64_t logged_ns, std::int64_t stamp_ns, std::string_view bytes);
  void flush();
  /// Writes the summary, which gives readers random access.
  void finish();
  std::uint64_t messages() const { return messages_; }

 private:
  struct Schema {
    std::string type, definition;
  };
  struct Topic {
    std::string name, hash;
    std::uint16_t schema;
    std::uint32_t sequence = 0;
    std::uint64_t count = 0;
    bool in_chunks = false;  ///< whether its channel record was written in a chunk
  };
  struct ChunkIndex;

  std::string schema_record(std::size_t index) const;
  std::string channel_record(std::size_t index) const;
  void append(std::string_view bytes);

  io::AppendFile file_;
  McapOptions options_;
  std::uint64_t size_ = 0, messages_ = 0;
  std::uint32_t data_crc_ = 0;
  std::vector<Schema> schemas_;
  std::vector<Topic> topics_;
  std::string chunk_;
  std::int64_t chunk_first_ns_ = 0, chunk_last_ns_ = 0, opened_ns_ = 0, first_ns_ = 0, last_ns_ = 0;
  std::map<std::uint16_t, std::string> chunk_messages_;  ///< index of the open chunk: log times and offsets, by topic
  std::vector<ChunkIndex> chunks_;
  bool finished_ = false;
};

struct McapTopic {
  std::string name, type, encoding;             ///< encoding: serialisation of the messages, "cdr"
  std::string definition, definition_encoding;  ///< "ros2msg" for the format of layout.hpp
};

struct McapMessage {
  const McapTopic* topic;
  std::uint32_t sequence;
  std::int64_t logged_ns, stamp_ns;
  std::string_view bytes;  ///< valid until the next message is read
};

/// Reads in the order of the file. Leaves out damaged records; ends where the file ends early; warns of both.
class McapReader {
 public:
  /// `bytes` must outlive the reader; `name` is the file in messages. InputError where this is no MCAP file.
  McapReader(std::string_view bytes, std::string name);
  std::optional<McapMessage> next();
  std::vector<std::string> topics() const;
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void read_summary();
  std::optional<McapMessage> record(std::uint8_t code, std::string_view content);
  void open_chunk(std::string_view content);
  void warn(const std::string& what);

  std::string name_;
  std::string_view all_, rest_;  ///< the whole file, and its unread part
  std::string_view chunk_rest_;
  std::string chunk_;  ///< uncompressed
  std::map<std::uint16_t, McapTopic> schemas_;
  std::map<std::uint16_t, McapTopic> topics_;
  std::vector<std::string> warnings_;
  bool in_chunk_ = false, ended_ = false;
};

}  // namespace flappy::flightlog::ros
