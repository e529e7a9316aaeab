// Checkpoints of a training run: named sections of bytes in one file, refused unless complete and undamaged.
//
//     flappy checkpoint 1\n
//     the bytes of the sections in order
//     a list in JSON: header, and name, size and SHA-256 of each section
//     size of that list (20 digits), its SHA-256 (64 digits), "\nflappy end\n"
//
// Numbers are stored in the processor's byte order (x86-64: little endian).
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

/// What a run has taken so far, summed over all its processes.
struct RunTimes {
  double wall_s = 0;     ///< wall-clock time without evaluations
  double threads_s = 0;  ///< the same of all threads, of which the next two are parts
  double simulation_s = 0, learning_s = 0;
  double evaluation_s = 0;
  double exchange_s = 0, exchanged_bytes = 0;  ///< exchange of the first rank with others, waiting included
};

/// A run can be resumed only if config_sha256 is that of its configuration; the rest is information.
struct CheckpointHeader {
  std::uint64_t update = 0;
  std::string config_sha256;    ///< of the resolved configuration
  std::string processor;        ///< as in /proc/cpuinfo
  std::string instruction_set;  ///< of the kernels
  std::string commit;           ///< of the program
  RunTimes times;
};

/// Types without padding, whose bytes differ between runs. Store padding-free structs of floats by std::as_bytes.
template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T> ||
    (std::is_trivially_copyable_v<T>&& std::has_unique_object_representations_v<T>);

template <class V>
concept PlainRange = std::ranges::contiguous_range<V> && std::ranges::sized_range<V> &&
    Plain<std::ranges::range_value_t<V>> && !std::is_array_v<std::remove_cvref_t<V>>;

struct CheckpointSection {
  std::string name, sha256;
  std::uint64_t offset = 0, size = 0;  ///< in the file, bytes
};

/// Writes one checkpoint. The file appears on commit(); without it, no file is left, and an older one of that name
/// stays. Throws io::InputError if writing fails.
class CheckpointWriter {
 public:
  CheckpointWriter(const std::filesystem::path& path, CheckpointHeader header);

  /// Stores numbers (one, vector, span, array, string) under a unique name. Writes at once and keeps no copy.
  template <class V>
  requires PlainRange<V> || Plain<V>
  void put(std::string_view name, const V& value) {
    if constexpr (PlainRange<V>)
      put_bytes(name, std::as_bytes(std::span(std::ranges::data(value), std::ranges::size(value))));
    else put_bytes(name, std::as_bytes(std::span(&value, 1)));
  }
  void put_bytes(std::string_view name, std::span<const std::byte> bytes);

  /// Finishes the file and syncs it to the disk. Returns Checkpoint::payload_sha256(). Call it once, last.
  std::string commit();

 private:
  std::filesystem::path folder_;
  io::AtomicFile file_;
  CheckpointHeader header_;
  std::vector<CheckpointSection> sections_;
};

/// A checkpoint for reading; the constructor has checked the whole file.
class Checkpoint {
 public:
  /// Throws io::InputError, with file and reason, if it is no checkpoint, of another schema, truncated or damaged.
  explicit Checkpoint(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  const CheckpointHeader& header() const { return header_; }
  /// SHA-256 over the sections' names, sizes, contents, in order of names: equal for equal states of training.
  const std::string& payload_sha256() const { return payload_sha256_; }
  bool has(std::string_view name) const;

  /// Reads what put() stored. Throws io::InputError if the section is missing or has another size.
  template <class V>
  requires PlainRange<V> || Plain<std::remove_cvref_t<V>>
  void get(std::string_view name, V&& value) const {
    if constexpr (PlainRange<V>)
      get_bytes(name, std::as_writable_bytes(std::span(std::ranges::data(value), std::ranges::size(value))));
    else get_bytes(name, std::as_writable_bytes(std::span(&value, 1)));
  }
  void get_bytes(std::string_view name, std::span<std::byte> bytes) const;
  /// A whole section as text. Throws io::InputError if it is missing.
  std::string text(std::string_view name) const;

 private:
  const CheckpointSection& section(std::string_view name) const;

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  CheckpointHeader header_;
  std::string payload_sha256_;
  std::vector<CheckpointSection> sections_;
};

/// File name of a checkpoint, as checkpoint_000012000.flappy.
std::string checkpoint_name(std::uint64_t update);

/// Checkpoints of a run folder, found by their names, newest first. Throws io::InputError if the folder cannot be read.
std::vector<std::filesystem::path> checkpoints_in(const std::filesystem::path& run);

/// Removes all but the `count` newest checkpoints.
void keep_newest(const std::filesystem::path& run, std::size_t count);

/// The newest checkpoint of a run folder. Throws io::InputError if there is none, or if it is damaged, naming an
/// earlier good one and how to resume from it. A damaged checkpoint is never skipped silently.
Checkpoint newest_checkpoint(const std::filesystem::path& run);

}  // namespace flappy::learn
