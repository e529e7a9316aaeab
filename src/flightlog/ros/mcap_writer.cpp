#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>

#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/mcap_records.hpp"
#include "io/files.hpp"

namespace flappy::flightlog::ros {
namespace {

using namespace mcap;

std::uint32_t crc(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

struct McapWriter::ChunkIndex {
  std::int64_t first_ns, last_ns;
  std::uint64_t offset, size, index_size, compressed, uncompressed;
  std::map<std::uint16_t, std::uint64_t> index_offsets;
};

McapWriter::McapWriter(const std::filesystem::path& path, const McapOptions& options) : file_(path), options_(options) {
  append(std::string(kMagic) + Bytes().string("ros2").string("flappy").record(kHeader));
}

McapWriter::~McapWriter() {
  try {
    finish();
  } catch (const io::InputError&) {  // callers who need the error call finish() themselves
  }
}

void McapWriter::append(std::string_view bytes) {
  file_.write(bytes);
  data_crc_ = crc(bytes, data_crc_);
  size_ += bytes.size();
}

std::uint16_t McapWriter::add_topic(const std::string& topic, const std::string& type, const std::string& definition,
                                    const std::string& hash) {
  std::size_t schema = 0;
  while (schema < schemas_.size() && (schemas_[schema].type != type || schemas_[schema].definition != definition))
    ++schema;
  if (schema == schemas_.size()) schemas_.push_back({type, definition});
  topics_.push_back({topic, hash, static_cast<std::uint16_t>(schema)});
  return static_cast<std::uint16_t>(topics_.size() - 1);
}

// Numbers of schemas begin at 1, because 0 means no schema.
std::string McapWriter::schema_record(std::size_t index) const {
  const Schema& schema = schemas_[index];
  return Bytes()
      .number(static_cast<std::uint16_t>(index + 1))
      .string(schema.type)
      .string("ros2msg")
      .string(schema.definition)
      .record(kSchema);
}

std::string McapWriter::channel_record(std::size_t index) const {
  const Topic& topic = topics_[index];
  Bytes metadata;
  metadata.string("offered_qos_profiles").string("");  // required by the profile; empty: any QoS
  if (!topic.hash.empty()) metadata.string("topic_type_hash").string(topic.hash);
  return Bytes()
      .number(static_cast<std::uint16_t>(index))
      .number(static_cast<std::uint16_t>(topic.schema + 1))
      .string(topic.name)
      .string("cdr")
      .string(metadata.text())
      .record(kChannel);
}

void McapWriter::write(std::uint16_t topic, std::int64_t logged_ns, std::int64_t stamp_ns, std::string_view bytes) {
  Topic& t = topics_.at(topic);
  const double open_s = 1e-9 * static_cast<double>(logged_ns - opened_ns_);
  if (!chunk_.empty() && (chunk_.size() >= options_.chunk_bytes || std::abs(open_s) >= options_.flush_s)) flush();
  if (chunk_.empty()) chunk_first_ns_ = chunk_last_ns_ = opened_ns_ = logged_ns;
  if (messages_ == 0) first_ns_ = last_ns_ = logged_ns;
  if (!t.in_chunks) {
    chunk_ += schema_record(t.schema) + channel_record(topic);
    t.in_chunks = true;
  }
  Bytes entry;
  entry.number(static_cast<std::uint64_t>(logged_ns)).number(static_cast<std::uint64_t>(chunk_.size()));
  chunk_messages_[topic] += entry.text();
  chunk_ += Bytes()
                .number(topic)
                .number(t.sequence++)
                .number(static_cast<std::uint64_t>(logged_ns))
                .number(static_cast<std::uint64_t>(stamp_ns))
                .raw(bytes)
                .record(kMessage);
  chunk_first_ns_ = std::min(chunk_first_ns_, logged_ns), chunk_last_ns_ = std::max(chunk_last_ns_, logged_ns);
  first_ns_ = std::min(first_ns_, logged_ns), last_ns_ = std::max(last_ns_, logged_ns);
  ++t.count, ++messages_;
}

void McapWriter::flush() {
  if (chunk_.empty()) return;
  std::string packed;
  if (options_.compress) {
    packed.resize(ZSTD_compressBound(chunk_.size()));
    packed.resize(ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), 1));
  }
  const std::string& records = options_.compress ? packed : chunk_;
  Bytes chunk;
  chunk.number(chunk_first_ns_).number(chunk_last_ns_).number(std::uint64_t{chunk_.size()}).number(crc(chunk_));
  chunk.string(options_.compress ? "zstd" : "").number(std::uint64_t{records.size()}).raw(records);
  std::string all = chunk.record(kChunk);
  ChunkIndex index{chunk_first_ns_, chunk_last_ns_, size_, all.size(), 0, records.size(), chunk_.size(), {}};
  for (const auto& [topic, entries] : chunk_messages_) {
    index.index_offsets[topic] = size_ + all.size();
    all += Bytes().number(topic).string(entries).record(kMessageIndex);
  }
  index.index_size = all.size() - index.size;
  append(all);
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_messages_.clear();
}

void McapWriter::finish() {
  if (finished_) return;
  finished_ = true;
  flush();
  append(Bytes().number(data_crc_).record(kDataEnd));
  const std::uint64_t start = size_;
  std::string summary, offsets;
  const auto group = [&](Code code, const std::string& records) {
    if (records.empty()) return;
    offsets += Bytes()
                   .number<std::uint8_t>(code)
                   .number(start + summary.size())
                   .number(std::uint64_t{records.size()})
                   .record(kSummaryOffset);
    summary += records;
  };
  std::string schemas, channels, indexes;
  for (std::size_t i = 0; i < schemas_.size(); ++i) schemas += schema_record(i);
  for (std::size_t i = 0; i < topics_.size(); ++i) channels += channel_record(i);
  for (const ChunkIndex& c : chunks_) {
    Bytes places;
    for (const auto& [topic, offset] : c.index_offsets) places.number(topic).number(offset);
    indexes += Bytes()
                   .number(c.first_ns)
                   .number(c.last_ns)
                   .number(c.offset)
                   .number(c.size)
                   .string(places.text())
                   .number(c.index_size)
                   .string(options_.compress ? "zstd" : "")
                   .number(c.compressed)
                   .number(c.uncompressed)
                   .record(kChunkIndex);
  }
  Bytes counts, statistics;
  for (std::size_t i = 0; i < topics_.size(); ++i)
    counts.number(static_cast<std::uint16_t>(i)).number(topics_[i].count);
  statistics.number(messages_)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(topics_.size()))
      .number(std::uint32_t{0})
      .number(std::uint32_t{0})
      .number(static_cast<std::uint32_t>(chunks_.size()))
      .number(first_ns_)
      .number(last_ns_)
      .string(counts.text());
  group(kSchema, schemas);
  group(kChannel, channels);
  group(kStatistics, statistics.record(kStatistics));
  group(kChunkIndex, indexes);
  const std::uint64_t offset_start = start + summary.size();
  summary += offsets;
  // The checksum covers the summary and the footer up to the checksum itself.
  Bytes footer;
  footer.number(start).number(offset_start);
  Bytes head;
  head.number<std::uint8_t>(kFooter).number(std::uint64_t{footer.text().size() + 4});
  summary += head.text() + footer.text();
  append(summary + Bytes().number(crc(summary)).text() + std::string(kMagic));
  file_.sync();
}

}  // namespace flappy::flightlog::ros
