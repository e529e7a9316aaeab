#include "flightlog/ros/bag.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <deque>
#include <fstream>
#include <map>

#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/mcap_records.hpp"
#include "flightlog/ros/ros_messages.hpp"
#include "io/files.hpp"
#include "io/mapped_file.hpp"
#include "io/temporary_folder.hpp"
#include "io/text.hpp"

namespace flappy::flightlog::ros {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSqliteMagic("SQLite format 3\0", 16);
constexpr std::string_view kAccepted = "rosbag2's .mcap or .db3 files, or a folder of them";

class McapBag : public Bag {
 public:
  explicit McapBag(const fs::path& path) : file_(path), reader_(file_.bytes(), path.string()) {}

  std::optional<BagMessage> next() override {
    while (const auto message = reader_.next()) {
      const McapTopic& t = *message->topic;
      BagTopic& topic = topics_[&t];
      if (topic.name.empty())
        topic = {t.name, t.type, t.definition_encoding == "ros2msg" ? t.definition : "", t.encoding};
      return BagMessage{&topic, message->logged_ns, message->bytes};
    }
    return {};
  }
  std::vector<std::string> topics() const override { return reader_.topics(); }
  std::vector<std::string> warnings() const override { return reader_.warnings(); }

 private:
  io::MappedFile file_;
  McapReader reader_;
  std::map<const McapTopic*, BagTopic> topics_;
};

class SqliteBag : public Bag {
 public:
  explicit SqliteBag(const fs::path& path) : name_(path.string()) {
    io::MappedFile readable(path);  // throws InputError where the file cannot be read
    sqlite3* database = nullptr;
    const std::string uri = uri_of(unfinished(path) ? copy_of(path) : path);
    const int code = sqlite3_open_v2(uri.c_str(), &database,
                                     (copy_ ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) | SQLITE_OPEN_URI, nullptr);
    database_.reset(database);
    if (code != SQLITE_OK) refuse();
    // Without this, SQLite refuses a file that is shorter than its header says. Nothing is written.
    sqlite3_db_config(database, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
    read_topics();
    // In the order of the file, so that a truncated file can be read up to its end.
    messages_ = prepare("SELECT topic_id, timestamp, data FROM messages");
    if (!messages_) refuse();
  }

  std::optional<BagMessage> next() override {
    while (!ended_) {
      const int code = sqlite3_step(messages_.get());
      if (code != SQLITE_ROW) {
        ended_ = true;
        if (code != SQLITE_DONE)
          warnings_.push_back(name_ + ": " + sqlite3_errmsg(database_.get()) + ": read as far as it goes");
        break;
      }
      const auto topic = topics_.find(sqlite3_column_int64(messages_.get(), 0));
      if (topic == topics_.end()) continue;
      const auto* data = static_cast<const char*>(sqlite3_column_blob(messages_.get(), 2));
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(messages_.get(), 2));
      return BagMessage{&topic->second, sqlite3_column_int64(messages_.get(), 1), {data, size}};
    }
    return {};
  }
  std::vector<std::string> topics() const override {
    std::vector<std::string> names;
    for (const auto& [id, topic] : topics_) names.push_back(topic.name);
    return names;
  }
  std::vector<std::string> warnings() const override { return warnings_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Close>;

  /// Whether a writer left a journal of unfinished changes next to the file.
  static bool unfinished(const fs::path& path) {
    return std::ranges::any_of(kBeside, [&](const char* ending) {
      std::error_code missing;
      return fs::file_size(path.string() + ending, missing) > 0 && !missing;
    });
  }

  /// Copies the file and its journals: SQLite merges the journal before reading, and the user's file must not change.
  fs::path copy_of(const fs::path& path) {
    copy_.emplace();
    for (const char* ending : {"", kBeside[0], kBeside[1]}) {
      const fs::path from = path.string() + ending, to = copy_->path() / ("bag" + std::string(ending));
      std::error_code error;
      if (*ending != 0 && !fs::exists(from, error)) continue;
      if (!fs::copy_file(from, to, error))
        throw io::InputError(from.string() + ": cannot be copied to " + to.string() + ": " + error.message());
      fs::permissions(to, fs::perms::owner_all, fs::perm_options::add);  // the file may be read-only
    }
    return copy_->path() / "bag";
  }

  /// With "immutable", SQLite creates neither locks nor files next to the file.
  std::string uri_of(const fs::path& path) const {
    std::string uri = "file:";
    for (const char c : path.string())
      uri += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
    return uri + (copy_ ? "" : "?immutable=1");
  }

  [[noreturn]] void refuse() const {
    throw io::InputError(name_ + ": cannot be read as a bag: " + sqlite3_errmsg(database_.get()) +
                         "; accepted: " + std::string(kAccepted));
  }

  Statement prepare(const char* query) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_.get(), query, -1, &statement, nullptr);
    return Statement(statement);
  }

  static std::string text(const Statement& statement, int column) {
    const auto* chars = reinterpret_cast<const char*>(sqlite3_column_text(statement.get(), column));
    return chars ? chars : "";
  }

  void read_topics() {
    // This table exists since Iron.
    std::map<std::string, std::string> definitions;
    if (const Statement found =
            prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"))
      while (sqlite3_step(found.get()) == SQLITE_ROW)
        if (text(found, 1) == "ros2msg") definitions[text(found, 0)] = text(found, 2);
    const Statement topics = prepare("SELECT id, name, type, serialization_format FROM topics");
    if (!topics) refuse();
    while (sqlite3_step(topics.get()) == SQLITE_ROW) {
      const std::string type = text(topics, 2);
      topics_[sqlite3_column_int64(topics.get(), 0)] = {text(topics, 1), type, definitions[type], text(topics, 3)};
    }
  }

  static constexpr std::array kBeside = {"-wal", "-journal"};

  std::string name_;
  std::optional<io::TemporaryFolder> copy_;  ///< declared before database_, because it must outlive it
  std::unique_ptr<sqlite3, Close> database_;
  Statement messages_;
  std::map<std::int64_t, BagTopic> topics_;
  std::vector<std::string> warnings_;
  bool ended_ = false;
};

class SplitBag : public Bag {
 public:
  SplitBag(std::vector<std::unique_ptr<Bag>> parts, std::vector<std::string> warnings)
      : parts_(std::move(parts)), warnings_(std::move(warnings)) {}
  std::optional<BagMessage> next() override {
    for (; part_ < parts_.size(); ++part_)
      if (auto message = parts_[part_]->next()) return message;
    return {};
  }
  std::vector<std::string> topics() const override { return of_all(&Bag::topics); }
  std::vector<std::string> warnings() const override { return of_all(&Bag::warnings, warnings_); }

 private:
  std::vector<std::string> of_all(std::vector<std::string> (Bag::*list)() const,
                                  std::vector<std::string> all = {}) const {
    for (const auto& part : parts_)
      for (const std::string& each : (*part.*list)()) all.push_back(each);
    return all;
  }

  std::vector<std::unique_ptr<Bag>> parts_;
  std::vector<std::string> warnings_;
  std::size_t part_ = 0;
};

std::string beginning(const fs::path& path) {
  std::array<char, 16> bytes = {};
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), bytes.size());
  return {bytes.data(), static_cast<std::size_t>(file.gcount())};
}

/// The number at the end of a file's stem, so that bag_2.mcap comes before bag_10.mcap.
std::uint64_t part_number(const fs::path& path) {
  const std::string stem = path.stem().string();
  const std::string digits = stem.substr(stem.find_last_not_of("0123456789") + 1);
  std::uint64_t number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return number;
}

std::vector<fs::path> parts_of(const fs::path& folder) {
  std::vector<fs::path> parts;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".mcap" || ending == ".db3") parts.push_back(entry.path());
  }
  std::ranges::sort(parts, [](const fs::path& a, const fs::path& b) {
    return std::pair(part_number(a), a) < std::pair(part_number(b), b);
  });
  return parts;
}

}  // namespace

bool Bag::is_bag(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return !parts_of(path).empty();
  const std::string begins = beginning(path);
  return begins.starts_with(mcap::kMagic) || begins == kSqliteMagic;
}

std::unique_ptr<Bag> Bag::open(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    std::vector<std::unique_ptr<Bag>> parts;
    std::vector<std::string> warnings;
    for (const fs::path& part : parts_of(path))
      if (beginning(part).size() < mcap::kMagic.size()) warnings.push_back(part.string() + ": is empty: left out");
      else parts.push_back(open(part));
    if (parts.empty()) throw io::InputError(path.string() + ": holds no bag; accepted: " + std::string(kAccepted));
    return std::make_unique<SplitBag>(std::move(parts), std::move(warnings));
  }
  if (beginning(path) == kSqliteMagic) return std::make_unique<SqliteBag>(path);
  return std::make_unique<McapBag>(path);
}

std::shared_ptr<const Layout> layout_of(const BagTopic& topic) {
  if (topic.encoding != "cdr")
    throw MessageError("messages are in \"" + io::shortened(topic.encoding) + "\", read are those in \"cdr\"" +
                       (topic.encoding == "ros1" ? ", which rosbags-convert makes of a bag of ROS 1" : ""));
  if (!topic.definition.empty()) {
    Definitions definitions;
    definitions.add(topic.type, topic.definition);
    // A bag's definition may omit the standard messages that it refers to: then use our own definition of the type.
    try {
      return definitions.layout(topic.type);
    } catch (const MessageError&) {
      if (!standard_messages().has(topic.type)) throw;
    }
  }
  return standard_messages().layout(topic.type);
}

}  // namespace flappy::flightlog::ros
