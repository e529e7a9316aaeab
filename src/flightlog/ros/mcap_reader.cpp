#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <memory>

#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/mcap_records.hpp"
#include "io/files.hpp"

namespace flappy::flightlog::ros {
namespace {

using namespace mcap;

/// Largest size of an uncompressed chunk. Writers use some MB, so a larger value is a damaged length.
constexpr std::uint64_t kLargestChunk = 256u << 20;
/// Largest compression ratio: a block of 128 KiB takes at least 4 bytes in zstd and in lz4.
constexpr std::uint64_t kMaxCompressed = 1u << 15;
constexpr std::size_t kMaxWarnings = 20;

void unpack_zstd(std::string_view packed, std::string& out) {
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
  if (ZSTD_isError(size)) throw MessageError(std::string("cannot be uncompressed: ") + ZSTD_getErrorName(size));
  if (size != out.size()) throw MessageError("is shorter than it says");
}

void unpack_lz4(std::string_view packed, std::string& out) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw,
                                                                                     LZ4F_freeDecompressionContext);
  std::size_t done = 0, taken = 0;
  while (done < out.size()) {
    std::size_t room = out.size() - done, left = packed.size() - taken;
    const std::size_t result = LZ4F_decompress(raw, out.data() + done, &room, packed.data() + taken, &left, nullptr);
    if (LZ4F_isError(result)) throw MessageError(std::string("cannot be uncompressed: ") + LZ4F_getErrorName(result));
    if (room == 0 && left == 0) throw MessageError("is shorter than it says");
    done += room;
    taken += left;
  }
}

}  // namespace

McapReader::McapReader(std::string_view bytes, std::string name) : name_(std::move(name)), all_(bytes), rest_(bytes) {
  if (!rest_.starts_with(kMagic))
    throw io::InputError(name_ + ": is no MCAP file; accepted: a file that begins as one");
  rest_.remove_prefix(kMagic.size());
  try {
    read_summary();
  } catch (const MessageError&) {  // no or damaged summary: the channels also stand before their messages
  }
}

/// Reads the channels repeated in the summary, so that a damaged chunk does not lose them.
void McapReader::read_summary() {
  constexpr std::size_t kFooterSize = kHead + 20;
  if (!all_.ends_with(kMagic) || all_.size() < 2 * kMagic.size() + kFooterSize) return;
  const std::size_t footer = all_.size() - kMagic.size() - kFooterSize;
  if (all_[footer] != kFooter) return;
  const auto start = Parts(all_.substr(footer + kHead)).number<std::uint64_t>();
  if (start < kMagic.size() || start > footer) return;
  for (Parts parts(all_.substr(start, footer - start)); !parts.rest().empty();) {
    const auto code = parts.number<std::uint8_t>();
    const std::string_view content = parts.raw(parts.number<std::uint64_t>());
    if (code == kSchema || code == kChannel) record(code, content);
  }
}

std::vector<std::string> McapReader::topics() const {
  std::vector<std::string> names;
  for (const auto& [id, topic] : topics_) names.push_back(topic.name);
  return names;
}

void McapReader::warn(const std::string& what) {
  if (warnings_.size() < kMaxWarnings) warnings_.push_back(name_ + ": " + what);
  else if (warnings_.size() == kMaxWarnings) warnings_.push_back(name_ + ": is damaged in more places");
}

std::optional<McapMessage> McapReader::next() {
  while (true) {
    if (in_chunk_ && chunk_rest_.empty()) in_chunk_ = false;
    if (!in_chunk_ && ended_) return {};
    std::string_view& rest = in_chunk_ ? chunk_rest_ : rest_;
    const std::size_t at = all_.size() - rest_.size();  // offset in the file; within a chunk: the chunk's end
    try {
      Parts parts(rest);
      const auto code = parts.number<std::uint8_t>();
      const std::string_view content = parts.raw(parts.number<std::uint64_t>());
      rest = parts.rest();
      const bool in_chunk = in_chunk_;
      try {
        if (auto message = record(code, content)) return message;
      } catch (const MessageError& error) {
        warn((in_chunk ? "a record in the chunk before byte " : "the record at byte ") + std::to_string(at) + " " +
             error.what() + ": left out");
      }
    } catch (const MessageError&) {  // the record is longer than the rest
      if (in_chunk_) warn("the chunk before byte " + std::to_string(at) + " ends within a record");
      else warn("ends within a record, at byte " + std::to_string(at) + ": read as far as it goes");
      (in_chunk_ ? chunk_rest_ : rest_) = {};
      if (!in_chunk_) ended_ = true;
    }
  }
}

std::optional<McapMessage> McapReader::record(std::uint8_t code, std::string_view content) {
  Parts parts(content);
  switch (code) {
    case kSchema: {
      const auto id = parts.number<std::uint16_t>();
      McapTopic schema;
      schema.type = parts.string();
      schema.definition_encoding = parts.string();
      schema.definition = parts.string();
      schemas_[id] = std::move(schema);
      return {};
    }
    case kChannel: {
      const auto id = parts.number<std::uint16_t>();
      const auto schema = schemas_.find(parts.number<std::uint16_t>());
      McapTopic topic = schema == schemas_.end() ? McapTopic() : schema->second;
      topic.name = parts.string();
      topic.encoding = parts.string();
      topics_.try_emplace(id, std::move(topic));  // keep the first of repeated records: messages point to it
      return {};
    }
    case kMessage: {
      const auto topic = topics_.find(parts.number<std::uint16_t>());
      if (topic == topics_.end()) throw MessageError("is a message of an unknown channel");
      McapMessage message{&topic->second, parts.number<std::uint32_t>(), 0, 0, {}};
      message.logged_ns = parts.number<std::int64_t>();
      message.stamp_ns = parts.number<std::int64_t>();
      message.bytes = parts.rest();
      return message;
    }
    case kChunk:
      if (in_chunk_) throw MessageError("is a chunk in a chunk");
      open_chunk(content);
      return {};
    case kDataEnd:
    case kFooter:  // the rest repeats earlier records
      if (!in_chunk_) ended_ = true;
      return {};
    default:
      return {};
  }
}

void McapReader::open_chunk(std::string_view content) {
  Parts parts(content);
  parts.raw(16);  // skip the first and the last time
  const auto size = parts.number<std::uint64_t>();
  const auto expected = parts.number<std::uint32_t>();
  const std::string_view compression = parts.string();
  const std::string_view records = parts.raw(parts.number<std::uint64_t>());
  if (size > kLargestChunk || (!compression.empty() && size / kMaxCompressed > records.size()))
    throw MessageError("is a chunk of " + std::to_string(size) + " bytes");
  if (compression.empty()) {
    chunk_rest_ = records;
  } else {
    chunk_.assign(size, '\0');
    if (compression == "zstd") unpack_zstd(records, chunk_);
    else if (compression == "lz4") unpack_lz4(records, chunk_);
    else throw MessageError("is compressed as " + std::string(compression) + ", which is not read");
    chunk_rest_ = chunk_;
  }
  const auto found =
      static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(chunk_rest_.data()), chunk_rest_.size()));
  if (expected != 0 && expected != found) throw MessageError("is a chunk that its checksum does not match");
  in_chunk_ = true;
}

}  // namespace flappy::flightlog::ros
