// Checkpoints of a training run: named sections of bytes in one file that is either whole and right, or refused.
//
//     flappy checkpoint 1\n
//     the bytes of the sections, one after the other
//     a list in JSON: header, name, size and SHA-256 of each section
//     size of that list (20 digits), its SHA-256 (64 digits), "\nflappy end\n"
//
// Numbers are stored as the processor has them (x86-64: little endian).
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "io/files.hpp"

namespace flappy::learn {

/// What a checkpoint is of. A resumed run wants its own configuration; the rest is for people.
struct CheckpointHeader {
  std::uint64_t update = 0;
  std::string config_sha256;    ///< of the resolved configuration
  std::string processor;        ///< the type, as /proc/cpuinfo names it
  std::string instruction_set;  ///< of the kernels
  std::string commit;           ///< of the program
  double wall_s = 0;            ///< of training until then
};

/// Bytes that are all value: a struct with padding would give other bytes in every run. A padding-free struct of
/// floats goes in through std::as_bytes.
template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T> ||
    (std::is_trivially_copyable_v<T>&& std::has_unique_object_representations_v<T>);

template <class V>
concept PlainRange = std::ranges::contiguous_range<V> && std::ranges::sized_range<V> &&
    Plain<std::ranges::range_value_t<V>> && !std::is_array_v<std::remove_cvref_t<V>>;

/// Where a section stands in its file.
struct CheckpointSection {
  std::string name, sha256;
  std::uint64_t offset = 0, size = 0;
};

/// Writes one checkpoint. It appears under its name on commit(); without it nothing is left, and whatever had the name
/// stays as it was. InputError when the disk does not take it.
class CheckpointWriter {
 public:
  CheckpointWriter(const std::filesystem::path& path, CheckpointHeader header);

  /// Stores a number, a vector, span, array or string of numbers under a name of its own; written at once, not copied.
  template <class V>
  requires PlainRange<V> || Plain<V>
  void put(std::string_view name, const V& value) {
    if constexpr (PlainRange<V>)
      put_bytes(name, std::as_bytes(std::span(std::ranges::data(value), std::ranges::size(value))));
    else put_bytes(name, std::as_bytes(std::span(&value, 1)));
  }
  void put_bytes(std::string_view name, std::span<const std::byte> bytes);

  /// On the disk, power failure or not, when it returns: the payload's SHA-256, see Checkpoint. Call it once, last.
  std::string commit();

 private:
  std::filesystem::path folder_;
  io::AtomicFile file_;
  CheckpointHeader header_;
  std::vector<CheckpointSection> sections_;
};

/// A checkpoint that has been read through once and found whole.
class Checkpoint {
 public:
  /// InputError that names the file and what is wrong with it: no checkpoint, another schema, cut short, damaged.
  explicit Checkpoint(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  const CheckpointHeader& header() const { return header_; }
  /// SHA-256 over names, sizes and contents of the sections in order of names: equal for equal states of training,
  /// whatever the header.
  const std::string& payload_sha256() const { return payload_sha256_; }
  bool has(std::string_view name) const;

  /// Fills what put() stored. InputError when there is no such section, or one of another size.
  template <class V>
  requires PlainRange<V> || Plain<std::remove_cvref_t<V>>
  void get(std::string_view name, V&& value) const {
    if constexpr (PlainRange<V>)
      get_bytes(name, std::as_writable_bytes(std::span(std::ranges::data(value), std::ranges::size(value))));
    else get_bytes(name, std::as_writable_bytes(std::span(&value, 1)));
  }
  void get_bytes(std::string_view name, std::span<std::byte> bytes) const;
  /// A section of any size.
  std::string text(std::string_view name) const;

 private:
  const CheckpointSection& section(std::string_view name) const;

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  CheckpointHeader header_;
  std::string payload_sha256_;
  std::vector<CheckpointSection> sections_;
};

/// checkpoint_000012000.flappy
std::string checkpoint_name(std::uint64_t update);

/// The checkpoints of a run folder by their names, newest first. InputError when the folder cannot be read.
std::vector<std::filesystem::path> checkpoints_in(const std::filesystem::path& run);

/// Removes all but the `count` newest.
void keep_newest(const std::filesystem::path& run, std::size_t count);

/// The newest checkpoint of a run folder. InputError when there is none, or when it is damaged: then the message
/// says which earlier one is good and how to go on from it. Nothing is skipped silently.
Checkpoint newest_checkpoint(const std::filesystem::path& run);

}  // namespace flappy::learn
