#include "learn/checkpoint.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "io/read_files.hpp"
#include "io/schema.hpp"
#include "io/sha256.hpp"

namespace flappy::learn {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kKind = "flappy checkpoint ";
constexpr std::string_view kFirst = "flappy checkpoint 1\n";
constexpr std::string_view kEnd = "\nflappy end\n";
constexpr std::size_t kSizeDigits = 20, kHashDigits = 64;
constexpr std::size_t kTail = kSizeDigits + kHashDigits + kEnd.size();
constexpr std::string_view kPrefix = "checkpoint_", kSuffix = ".flappy";

constexpr std::pair<const char*, double RunTimes::*> kTimes[] = {{"wall_s", &RunTimes::wall_s},
                                                                 {"threads_s", &RunTimes::threads_s},
                                                                 {"simulation_s", &RunTimes::simulation_s},
                                                                 {"learning_s", &RunTimes::learning_s},
                                                                 {"evaluation_s", &RunTimes::evaluation_s},
                                                                 {"exchange_s", &RunTimes::exchange_s},
                                                                 {"exchanged_bytes", &RunTimes::exchanged_bytes}};

std::string payload_hash(std::vector<CheckpointSection> sections) {
  std::ranges::sort(sections, {}, &CheckpointSection::name);
  io::Sha256 hash;
  for (const auto& s : sections) hash.add(s.name + "\n" + std::to_string(s.size) + "\n" + s.sha256 + "\n");
  return hash.digits();
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The text as a whole number; empty if it is not one.
std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The update in a checkpoint's file name, as 12000 in checkpoint_000012000.flappy; empty for other files.
std::optional<std::uint64_t> update_of(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix) || name.size() < kPrefix.size() + kSuffix.size())
    return std::nullopt;
  return number(std::string_view(name).substr(kPrefix.size(), name.size() - kPrefix.size() - kSuffix.size()));
}

}  // namespace

CheckpointWriter::CheckpointWriter(const std::filesystem::path& path, CheckpointHeader header)
    : folder_(path.parent_path()), file_(path), header_(std::move(header)) {
  file_.write(kFirst);
}

void CheckpointWriter::put_bytes(std::string_view name, std::span<const std::byte> bytes) {
  if (std::ranges::any_of(sections_, [&](const auto& s) { return s.name == name; }))
    throw std::logic_error("checkpoint: " + std::string(name) + " is put twice");
  file_.write(text_of(bytes));
  sections_.push_back({std::string(name), io::sha256(text_of(bytes)), 0, bytes.size()});
}

std::string CheckpointWriter::commit() {
  Json list;
  list["update"] = header_.update;
  list["config_sha256"] = header_.config_sha256;
  list["processor"] = header_.processor;
  list["instruction_set"] = header_.instruction_set;
  list["commit"] = header_.commit;
  for (const auto& [name, time] : kTimes) list[name] = header_.times.*time;
  list["payload_sha256"] = payload_hash(sections_);
  list["sections"] = Json::array();
  for (const auto& s : sections_)
    list["sections"].push_back({{"name", s.name}, {"size", s.size}, {"sha256", s.sha256}});
  const std::string text = list.dump(1);
  std::string size = std::to_string(text.size());
  size.insert(0, kSizeDigits - size.size(), '0');
  file_.write(text);
  file_.write(size);
  file_.write(io::sha256(text));
  file_.write(kEnd);
  file_.commit();
  io::sync_folder(folder_);
  return list["payload_sha256"];
}

Checkpoint::Checkpoint(std::filesystem::path path) : path_(std::move(path)), file_(nullptr, std::fclose) {
  const auto refuse = [&](const std::string& what) { throw io::InputError(path_.string() + ": " + what); };
  const auto refuse_system = [&](int error) { refuse("cannot be read: " + std::generic_category().message(error)); };
  std::error_code error;
  const auto status = std::filesystem::status(path_, error);  // checked first, because opening a pipe would block
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) refuse("is not a regular file");
  file_.reset(std::fopen(path_.c_str(), "rbe"));
  if (!file_) refuse_system(errno);
  io::note_read(path_);
  const auto read_at = [&](std::uint64_t offset, std::span<char> into) {
    if (fseeko(file_.get(), static_cast<off_t>(offset), SEEK_SET) != 0) refuse_system(errno);
    if (std::fread(into.data(), 1, into.size(), file_.get()) == into.size()) return;
    if (std::ferror(file_.get())) refuse_system(errno);
    refuse("became shorter while it was read");
  };

  if (fseeko(file_.get(), 0, SEEK_END) != 0) refuse_system(errno);
  const auto size = static_cast<std::uint64_t>(ftello(file_.get()));
  std::string first(std::min<std::size_t>(kFirst.size(), size), '\0');
  read_at(0, first);
  if (!kFirst.starts_with(first)) {
    if (!first.starts_with(kKind)) refuse("is no checkpoint of flappy");
    const auto schema = number(std::string_view(first).substr(kKind.size(), first.find('\n') - kKind.size()));
    if (!schema) refuse("is damaged: its first line is not \"flappy checkpoint 1\"");
    refuse("is a checkpoint whose schema " + io::other_schema(static_cast<std::int64_t>(*schema), 1) +
           "; accepted: schema 1");
  }
  if (size < kFirst.size() + kTail) refuse("is damaged: it is cut short");
  std::array<char, kTail> tail;
  read_at(size - kTail, tail);
  const std::string_view tail_text(tail.data(), tail.size());
  if (!tail_text.ends_with(kEnd)) refuse("is damaged: its end is missing");
  const auto list_size = number(tail_text.substr(0, kSizeDigits));
  const std::uint64_t most = size - kTail - kFirst.size();
  if (!list_size || *list_size > most) refuse("is damaged: the list of its sections differs from its checksum");
  std::string text(*list_size, '\0');
  const std::uint64_t list_begin = size - kTail - text.size();
  read_at(list_begin, text);
  if (io::sha256(text) != tail_text.substr(kSizeDigits, kHashDigits))
    refuse("is damaged: the list of its sections differs from its checksum");
  try {
    const Json list = Json::parse(text);
    list.at("update").get_to(header_.update);
    list.at("config_sha256").get_to(header_.config_sha256);
    list.at("processor").get_to(header_.processor);
    list.at("instruction_set").get_to(header_.instruction_set);
    list.at("commit").get_to(header_.commit);
    for (const auto& [name, time] : kTimes) header_.times.*time = list.value(name, 0.0);
    list.at("payload_sha256").get_to(payload_sha256_);
    for (const Json& s : list.at("sections")) sections_.push_back({s.at("name"), s.at("sha256"), 0, s.at("size")});
  } catch (const Json::exception& e) {
    refuse(std::string("is damaged: the list of its sections is not as it should be: ") + e.what());
  }

  std::uint64_t offset = kFirst.size();
  std::vector<char> block(1 << 20);
  for (auto& s : sections_) {
    s.offset = offset;
    if (s.size > list_begin - offset) refuse("is damaged: section " + s.name + " is cut short");
    io::Sha256 hash;
    for (const std::uint64_t end = offset + s.size; offset < end;) {
      const std::span<char> piece(block.data(), std::min<std::uint64_t>(block.size(), end - offset));
      read_at(offset, piece);
      hash.add({piece.data(), piece.size()});
      offset += piece.size();
    }
    if (hash.digits() != s.sha256) refuse("is damaged: section " + s.name + " differs from its checksum");
  }
  if (offset != list_begin) refuse("is damaged: bytes that belong to no section");
  if (payload_hash(sections_) != payload_sha256_) refuse("is damaged: its payload differs from its checksum");
}

bool Checkpoint::has(std::string_view name) const {
  return std::ranges::any_of(sections_, [&](const auto& s) { return s.name == name; });
}

const CheckpointSection& Checkpoint::section(std::string_view name) const {
  const auto found = std::ranges::find(sections_, name, &CheckpointSection::name);
  if (found != sections_.end()) return *found;
  std::string here;
  for (const auto& s : sections_) here += (here.empty() ? "" : ", ") + s.name;
  throw io::InputError(path_.string() + ": has no section " + std::string(name) + "; sections here: " + here +
                       io::writer_reads(header_.commit));
}

void Checkpoint::get_bytes(std::string_view name, std::span<std::byte> bytes) const {
  const CheckpointSection& s = section(name);
  if (s.size != bytes.size())
    throw io::InputError(path_.string() + ": section " + s.name + " has " + std::to_string(s.size) +
                         " bytes; accepted: " + std::to_string(bytes.size()) + ", as this configuration has it" +
                         io::writer_reads(header_.commit));
  if (fseeko(file_.get(), static_cast<off_t>(s.offset), SEEK_SET) != 0 ||
      std::fread(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    throw io::InputError(path_.string() + ": cannot be read: " + std::generic_category().message(errno));
}

std::string Checkpoint::text(std::string_view name) const {
  std::string text(section(name).size, '\0');
  get(name, text);
  return text;
}

std::string checkpoint_name(std::uint64_t update) {
  std::string digits = std::to_string(update);
  if (digits.size() < 9) digits.insert(0, 9 - digits.size(), '0');
  return std::string(kPrefix) + digits + std::string(kSuffix);
}

std::vector<std::filesystem::path> checkpoints_in(const std::filesystem::path& run) {
  std::vector<std::pair<std::uint64_t, std::filesystem::path>> found;
  std::error_code error;
  for (auto entry = std::filesystem::directory_iterator(run, error); !error && entry != std::filesystem::end(entry);
       entry.increment(error)) {
    if (const auto update = update_of(entry->path())) found.emplace_back(*update, entry->path());
  }
  if (error) throw io::InputError(run.string() + ": cannot be read: " + error.message());
  std::ranges::sort(found, std::greater());
  std::vector<std::filesystem::path> paths;
  for (auto& [update, path] : found) paths.push_back(std::move(path));
  return paths;
}

void keep_newest(const std::filesystem::path& run, std::size_t count) {
  const auto paths = checkpoints_in(run);
  for (std::size_t i = count; i < paths.size(); ++i) {
    std::error_code ignored;  // a file that cannot be removed is kept
    std::filesystem::remove(paths[i], ignored);
  }
}

Checkpoint newest_checkpoint(const std::filesystem::path& run) {
  const auto paths = checkpoints_in(run);
  if (paths.empty())
    throw io::InputError(run.string() + ": holds no checkpoint; accepted: a run folder with " + checkpoint_name(0) +
                         " or the like");
  std::string fault;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    try {
      Checkpoint checkpoint(paths[i]);
      if (i == 0) return checkpoint;
      const std::string name = paths[i].filename().string();
      fault += "; the " + std::string(i == 1 ? "one" : "last good one") + " before, " + name + ", is good: --resume " +
               run.string() + " --from " + name;
      break;
    } catch (const io::InputError& e) {
      if (i == 0) fault = e.what();
      if (i + 1 == paths.size()) fault += i == 0 ? "; there is no other" : "; so are all before it";
    }
  }
  throw io::InputError(fault);
}

}  // namespace flappy::learn
