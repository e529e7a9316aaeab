#include "io/csv.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace flappy::io {
namespace {

std::string message(const std::string& text) {
  try {
    parse_csv(text, "log.csv");
    return "accepted";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(Csv, ReadsColumns) {
  const CsvTable table = parse_csv("t_s,x_m\n0,1.5\n0.25,-2e-3\n", "log.csv");
  EXPECT_EQ(table.names, (std::vector<std::string>{"t_s", "x_m"}));
  EXPECT_EQ(table.column("t_s"), (std::vector<double>{0, 0.25}));
  EXPECT_EQ(table.column("x_m"), (std::vector<double>{1.5, -2e-3}));
}

TEST(Csv, AcceptsWhatOtherProgramsWrite) {
  const CsvTable table = parse_csv("\xEF\xBB\xBFt_s, x_m\r\n 0 ,\t1\r\n2, 3", "log.csv");
  EXPECT_EQ(table.column("t_s"), (std::vector<double>{0, 2}));
  EXPECT_EQ(table.column("x_m"), (std::vector<double>{1, 3}));
  EXPECT_TRUE(parse_csv("t_s\n", "log.csv").column("t_s").empty());
}

TEST(Csv, RefusesFilesWithoutHeader) {
  EXPECT_EQ(message(""), "log.csv: is empty; accepted: a line of column names, then rows of numbers");
  EXPECT_EQ(message("\n1\n"), "log.csv:1:1: column name is empty; accepted: one name for each column");
  EXPECT_EQ(message("t_s,,x_m\n"), "log.csv:1:5: column name is empty; accepted: one name for each column");
  EXPECT_EQ(message("t_s,x_m, t_s\n"), "log.csv:1:10: t_s: column name is given twice");
}

TEST(Csv, RefusesRaggedRows) {
  EXPECT_EQ(message("t_s,x_m\n1,2\n3\n"), "log.csv:3:2: row has 1 cells; accepted: 2, as in the header");
  EXPECT_EQ(message("t_s,x_m\n1,2, 3\n"), "log.csv:2:6: row has 3 cells; accepted: 2, as in the header");
  EXPECT_EQ(message("t_s\n1\n\n2\n"), "log.csv:3:1: is an empty line; accepted: 1 cells");
}

TEST(Csv, RefusesWhatIsNoNumber) {
  EXPECT_EQ(message("t_s,x_m\n1, abc\n"), "log.csv:2:4: x_m: \"abc\" is not a number; accepted: a number");
  EXPECT_EQ(message("t_s,x_m\n1,2m\n"), "log.csv:2:3: x_m: \"2m\" is not a number; accepted: a number");
  EXPECT_EQ(message("t_s,x_m\n1,\"2\"\n"), "log.csv:2:3: x_m: \"\"2\"\" is not a number; accepted: a number");
  EXPECT_EQ(message("t_s,x_m\n,2\n"), "log.csv:2:1: t_s: is empty; accepted: a number");
  EXPECT_EQ(message("t_s,x_m\n1,nan\n"), "log.csv:2:3: x_m: nan is not finite; accepted: a number");
  EXPECT_EQ(message("t_s,x_m\n-inf,2\n"), "log.csv:2:1: t_s: -inf is not finite; accepted: a number");
  EXPECT_EQ(message("t_s\n1e999\n"), "log.csv:2:1: t_s: 1e999 does not fit a double; accepted: a number");
}

TEST(Csv, NamesTheNearestColumn) {
  const CsvTable table = parse_csv("t_s,battery_V\n", "log.csv");
  try {
    table.column("batery_V");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "log.csv: batery_V: column is missing; columns here: t_s, battery_V; did you mean \"battery_V\"?");
  }
}

TEST(Csv, RefusesUnreadableFiles) {
  try {
    read_csv("no/such.csv");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "no/such.csv: cannot be read: No such file or directory");
  }
}

class CsvWriterTest : public testing::Test {
 protected:
  ~CsvWriterTest() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      testing::TempDir() + "flappy_csv_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const std::filesystem::path path_ = folder_ / "log.csv";
  const bool made_ = std::filesystem::create_directories(folder_);
};

TEST_F(CsvWriterTest, WritesDigitsThatReadBackToTheSameDoubles) {
  const std::vector<double> first = {0.1, 1e300, -5e-324};
  const std::vector<double> second = {1.0 / 3, 2, std::numeric_limits<double>::max()};
  CsvWriter writer(path_, {"a_m", "b_m", "c_m"});
  writer.row(first);
  writer.row(second);
  writer.close();
  EXPECT_EQ(read_text(path_), "a_m,b_m,c_m\n0.1,1e+300,-5e-324\n0.3333333333333333,2,1.7976931348623157e+308\n");
  const CsvTable table = read_csv(path_);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(table.columns[i], (std::vector<double>{first[i], second[i]}));
}

TEST(Csv, TextReadsBackToTheSameTable) {
  const std::vector<std::vector<double>> columns = {{0.1, 1.0 / 3}, {-5e-324, 2}};
  const std::string text = csv_text({"a_m", "b_m"}, columns);
  EXPECT_EQ(text, "a_m,b_m\n0.1,-5e-324\n0.3333333333333333,2\n");
  EXPECT_EQ(parse_csv(text, "log.csv").columns, columns);
  EXPECT_THROW(csv_text({"a_m", "b_m"}, {{1}, {}}), std::invalid_argument);
  EXPECT_THROW(csv_text({"a_m", "b_m"}, {{1}}), std::invalid_argument);
}

TEST_F(CsvWriterTest, LeavesNoFileUnlessClosed) {
  { CsvWriter(path_, {"a_m"}).row(std::vector<double>{1}); }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(CsvWriterTest, RefusesRowsOfAnotherWidth) {
  CsvWriter writer(path_, {"a_m", "b_m"});
  EXPECT_THROW(writer.row(std::vector<double>{1}), std::invalid_argument);
}

}  // namespace
}  // namespace flappy::io
