#include "flightlog/ros/bag.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>

#include "flightlog/ros/mcap.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::ros::bag_test {
namespace {

namespace fs = std::filesystem;

void write_database(const fs::path& path, const std::string& statements) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(database, statements.c_str(), nullptr, nullptr, &error), SQLITE_OK) << error;
  sqlite3_close(database);
}

/// As Humble writes them.
const std::string kTables =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT "
    "NULL, "
    "offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB "
    "NOT NULL);"
    "INSERT INTO topics VALUES(1, '/a', 'std_msgs/msg/Header', 'cdr', ''), (2, '/b', 'q/msg/Own', 'cdr', ''),"
    " (3, '/c', 'q/msg/Own', 'protobuf', '');"
    "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 20, x'01'), (2, 10, x'0203'), (3, 12, x'04'), (9, 13, "
    "x'05');";

/// "topic type definition time bytes" of all messages.
std::vector<std::string> read(const fs::path& path) {
  const auto bag = Bag::open(path);
  std::vector<std::string> all;
  while (const auto m = bag->next())
    all.push_back(m->topic->name + " " + m->topic->type + " " + m->topic->definition + std::to_string(m->received_ns) +
                  " " + std::to_string(m->bytes.size()));
  for (const std::string& warning : bag->warnings()) all.push_back(warning);
  return all;
}

using Lines = std::vector<std::string>;

TEST(Bag, ReadsADatabaseInItsOwnOrder) {
  const io::TemporaryFolder folder;
  write_database(folder / "x.db3", kTables);
  EXPECT_TRUE(Bag::is_bag(folder / "x.db3"));
  EXPECT_EQ(Bag::open(folder / "x.db3")->topics(), (Lines{"/a", "/b", "/c"}));  // before any message is read
  EXPECT_EQ(read(folder / "x.db3"), (Lines{"/a std_msgs/msg/Header 20 1", "/b q/msg/Own 10 2", "/c q/msg/Own 12 1"}));
}

TEST(Bag, TakesDefinitionsOfADatabaseThatHasThem) {
  const io::TemporaryFolder folder;
  write_database(
      folder / "x.db3",
      kTables +
          "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, "
          "encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
          "INSERT INTO message_definitions VALUES(1, 'q/msg/Own', 'ros2msg', 'int16 x', '');");
  EXPECT_EQ(read(folder / "x.db3"),
            (Lines{"/a std_msgs/msg/Header 20 1", "/b q/msg/Own int16 x10 2", "/c q/msg/Own int16 x12 1"}));
}

std::vector<std::string> files_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

TEST(Bag, LeavesNothingBesideADatabase) {
  const io::TemporaryFolder folder;
  write_database(folder / "x.db3", "PRAGMA journal_mode=WAL;" + kTables);
  const Lines written = files_in(folder.path());
  EXPECT_EQ(read(folder / "x.db3").size(), 3u);
  EXPECT_EQ(files_in(folder.path()), written);
  // what its writer has not brought into the file yet
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "x.db3").c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 30, x'06')", nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  const Lines open_files = files_in(folder.path());
  EXPECT_EQ(open_files, (Lines{"x.db3", "x.db3-shm", "x.db3-wal"}));
  EXPECT_EQ(read(folder / "x.db3").back(), "/a std_msgs/msg/Header 30 1");
  EXPECT_EQ(files_in(folder.path()), open_files);
  sqlite3_close(database);
}

TEST(Bag, ReadsADatabaseThatWasCutOff) {
  const io::TemporaryFolder folder;
  std::string many = kTables + "BEGIN;";
  for (int i = 0; i < 4000; ++i)
    many += "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, " + std::to_string(100 + i) +
            ", x'0102030405060708');";
  write_database(folder / "x.db3", many + "COMMIT;");
  fs::resize_file(folder / "x.db3", fs::file_size(folder / "x.db3") / 2);
  const Lines some = read(folder / "x.db3");
  EXPECT_GT(some.size(), 1500u);
  EXPECT_TRUE(some.back().ends_with(": database disk image is malformed: read as far as it goes")) << some.back();
}

TEST(Bag, ReadsAFolderInTheOrderOfItsParts) {
  const io::TemporaryFolder folder;
  for (const int part : {10, 2, 0}) {
    McapWriter writer(folder / ("bag_" + std::to_string(part) + ".mcap"));
    writer.write(writer.add_topic("/a", "p/msg/A", "int8 x\n", ""), part, part, "x");
    writer.finish();
  }
  std::ofstream(folder / "metadata.yaml") << "rosbag2_bagfile_information:\n";
  std::ofstream(folder / "bag_11.mcap");  // a recorder that is killed leaves an empty part
  EXPECT_EQ(read(folder.path()), (Lines{"/a p/msg/A int8 x\n0 1", "/a p/msg/A int8 x\n2 1", "/a p/msg/A int8 x\n10 1",
                                        (folder / "bag_11.mcap").string() + ": is empty: left out"}));
}

TEST(Bag, KnowsTheLayoutByTheBagOrByItself) {
  EXPECT_EQ(layout_of({"/a", "q/msg/Own", "int16 x\n"})->fields[0].name, "x");
  EXPECT_EQ(layout_of({"/a", "std_msgs/msg/Header", ""})->fields[0].name, "stamp");
  EXPECT_EQ(layout_of({"/a", "std_msgs/msg/Header", "Unknown x\n"})->fields[0].name, "stamp");
  EXPECT_THROW(layout_of({"/a", "q/msg/Own", ""}), MessageError);
  EXPECT_THROW(layout_of({"/a", "q/msg/Own", "Unknown x\n"}), MessageError);
}

TEST(Bag, RefusesWhatIsNone) {
  const io::TemporaryFolder folder;
  const std::string at = folder.path().string();
  const std::string accepted = "; accepted: rosbag2's .mcap or .db3 files, or a folder of them";
  EXPECT_EQ(test::refusal([&] { read(folder.path()); }), at + ": holds no bag" + accepted);
  EXPECT_EQ(test::refusal([&] { read(folder / "none.mcap"); }),
            at + "/none.mcap: cannot be read: No such file or directory");
  write_database(folder / "x.db3", "CREATE TABLE other(id INTEGER);");
  EXPECT_EQ(test::refusal([&] { read(folder / "x.db3"); }),
            at + "/x.db3: cannot be read as a bag: no such table: topics" + accepted);
  std::ofstream(folder / "broken.db3") << "SQLite format 3" << '\0' << std::string(2000, 'x');
  EXPECT_EQ(test::refusal([&] { read(folder / "broken.db3"); }),
            at + "/broken.db3: cannot be read as a bag: file is not a database" + accepted);
}

}  // namespace
}  // namespace flappy::flightlog::ros::bag_test
