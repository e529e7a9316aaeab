#include "flightlog/import/table.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "refusal.hpp"

namespace flappy::flightlog::table_test {
namespace {

using Lines = std::vector<std::string>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What a table of names and rows gives of "t" and "x", and what is warned of.
struct Read {
  std::vector<double> t, x;
  Lines warnings;
};

Read read(const std::string& text) {
  Channels channels({{"f", {"t", "x"}}});
  Read r;
  read_table(text, "f.csv", "f", channels, r.warnings);
  const Channel& found = *channels.find("f");
  if (const auto* t = found.column("t")) r.t = *t;
  if (const auto* x = found.column("x")) r.x = *x;
  return r;
}

/// The two rows that every shape of a table holds.
void expect_rows(const std::string& text, const Lines& warnings = {}) {
  const Read r = read(text);
  EXPECT_EQ(r.t, (std::vector<double>{0.5, 0.75})) << text;
  EXPECT_EQ(r.x, (std::vector<double>{9, -2e-3})) << text;
  EXPECT_EQ(r.warnings, warnings) << text;
}

TEST(Table, ReadsWhatSeparatesCells) {
  expect_rows("t,x\n0.5,9\n0.75,-2e-3\n");
  expect_rows("t;x\n0.5;9\n0.75;-2e-3\n");
  expect_rows("t;x\n0,5;9\n0,75;-2e-3\n");  // decimal commas
  expect_rows("t\tx\n0.5\t9\n0.75\t-2e-3\n");
  expect_rows("t x\n 0.5  9\n0.75 -2e-3 \n");
  expect_rows("# t x\n0.5 9\n0.75 -2e-3\n");
  expect_rows("# t, x\n0.5 9\n0.75 -2e-3\n");
  expect_rows("# t;x\n0,5;9\n0,75;-2e-3\n");
  expect_rows("# flown by hand\n# t,x\n#\n0.5,9\n0.75,-2e-3\n");
  expect_rows("\xEF\xBB\xBFt, x\r\n 0.5 ,\t9\r\n0.75, -2e-3");
  expect_rows("t,x\r0.5,9\r0.75,-2e-3\r");
}

TEST(Table, ReadsQuotes) {
  expect_rows("\"t\",\"x\"\n0.5,9\n0.75,-2e-3\n");
  expect_rows("\"t\",\"x\"\n\"0.5\",\"9\"\n\"0.75\",\"-2e-3\"\n");
  expect_rows("t,note,x\n0.5,\"a, \"\"b\"\"\",9\n0.75,\"two\nlines\",-2e-3\n");
}

TEST(Table, DoesNotMindWhatNobodyWants) {
  expect_rows("t,x,mode\n0.5,9,hover\n0.75,-2e-3,\n");
  expect_rows("day,t,x\n2026-11-26T04:00:00,0.5,9\n2026-11-26T04:00:01,0.75,-2e-3\n");
  expect_rows("t,x,v,v\n0.5,9,1e-400,True\n0.75,-2e-3,inf,3\n");
  expect_rows(",t,x\n0,0.5,9\n1,0.75,-2e-3\n");  // pandas' index
  expect_rows("t,x,\n0.5,9,\n0.75,-2e-3,\n");
  expect_rows("t,x\n0.5,9,\n0.75,-2e-3,\n");
  expect_rows("t,x,\n0.5,9\n0.75,-2e-3\n");
  expect_rows("t,x,\n0.5,9,hover\n0.75,-2e-3,\n");
}

TEST(Table, ReadsNumbersAsLoggersPrintThem) {
  EXPECT_EQ(read("t,x\n+0.5,+9.0\n1e-400,.5\n1.,0x1F\n").t, (std::vector<double>{0.5, 0, 1}));
  EXPECT_EQ(read("# t,x\n0.5,nan\n0.75,1\n").t, (std::vector<double>{0.5, 0.75}));  // the first row lacks a number
  EXPECT_EQ(read("t\tx\n0.5\t1,234\n").x, std::vector<double>{kInfinity});          // a comma between thousands
  for (const char* missing : {"", "nan", "-nan", "NaN", "NA", "N/A", "None", "null", "\"\""}) {
    const Read r = read("t,x\n0.5,1\n0.75," + std::string(missing) + "\n1,3\n");
    ASSERT_EQ(r.x.size(), 3u) << missing;
    EXPECT_TRUE(std::isnan(r.x[1])) << missing;
    EXPECT_EQ(r.warnings, Lines()) << missing;
  }
  for (const char* no_number : {"inf", "-inf", "1e400", "hover", "9.0V", "2026-11-26", "\"1,5\""}) {
    const Read r = read("t,x\n0.5,1\n0.75," + std::string(no_number) + "\n1,3\n");
    ASSERT_EQ(r.x.size(), 3u) << no_number;
    EXPECT_EQ(std::abs(r.x[1]), kInfinity) << no_number;
    ASSERT_EQ(r.warnings.size(), 1u) << no_number;
    EXPECT_TRUE(r.warnings[0].starts_with("f.csv: x: 1 of 3 cells are no numbers, in line 3: \"")) << r.warnings[0];
  }
}

TEST(Table, LeavesOutWhatIsNoRowAndSaysSo) {
  expect_rows("# flown by hand\nt,x\n0.5,9\n\n0.75,-2e-3\n\n");
  expect_rows("t,x\n0.5,9\n# a gust\n0.75,-2e-3\n", {"f.csv: 1 comments among the rows left out, in line 3"});
  expect_rows("t,x\n0.5,9\n0.75,-2e-3\n0.9", {"f.csv: 1 of 3 rows left out, in line 4: 1 cell for 2 names"});
  expect_rows("t,x\n0.5,9\n0.6,1,2,3\n0.75,-2e-3\n0.9\n",
              {"f.csv: 2 of 4 rows left out, the first in line 3: 4 cells for 2 names"});
  // a cell that was lost may be one before those that are wanted
  expect_rows("t,x,y\n0.5,9,1\n0.6,12\n0.75,-2e-3,1\n",
              {"f.csv: 1 of 3 rows left out, in line 3: 2 cells for 3 names"});
  expect_rows("t note x\n0.5 \"\" 9\n0.75 \"a b\" -2e-3\n");
  // one quote that is never closed takes its own row alone
  std::string rows = "t,x\n0.5,9\n0.6,\"1\n";
  for (int i = 0; i < 100; ++i) rows += "0.7,1\n";
  const Read r = read(rows);
  EXPECT_EQ(r.t.size(), 101u);
  EXPECT_EQ(r.warnings, (Lines{"f.csv: 1 of 102 rows left out, in line 3: quotes that are not closed"}));
}

TEST(Table, ReadsThreeThousandNamesOfWhichTwoAreWanted) {
  std::string names = "t", row = "1";
  for (int i = 0; i < 3000; ++i) names += ",c" + std::to_string(i), row += ",text";
  const Read r = read(names + ",x\n" + row + ",2\n");
  EXPECT_EQ(r.x, std::vector<double>{2});
}

TEST(Table, RefusesWhatIsNone) {
  const auto refusal = [](const std::string& text) { return test::refusal([&] { read(text); }); };
  EXPECT_EQ(refusal(""), "f.csv: is empty; accepted: a line of column names, then rows of numbers");
  EXPECT_EQ(refusal("# nothing\n\n"), "f.csv: holds no table; accepted: a line of column names, then rows of numbers");
  EXPECT_EQ(refusal("0.5,9\n0.75,1\n"), "f.csv:1:1: holds numbers; accepted: a line of column names before them");
  EXPECT_EQ(refusal("t,x,x\n0.5,9,1\n"), "f.csv:1:1: x: column name is given twice");
  EXPECT_EQ(refusal("t,x\n0.5,9,1\n0.75,1,2\n"),
            "f.csv:2:1: 3 cells for 2 names, and no row is otherwise; accepted: rows of as many cells");
}

TEST(Table, NamesTheLineOfNamesBelowAHead) {
  const auto refusal = [](const std::string& text) { return test::refusal([&] { read(text); }); };
  // as Motive exports a rigid body; the last column has no name
  EXPECT_EQ(
      refusal("Format Version,1.23,Take Name,hover\r\n\r\n,Type,Rigid Body\r\n,ID,1\r\nt,x,\r\n0,0.5,1\r\n1,0.6,1\r\n"),
      "f.csv:3:1: 3 cells for 4 names, and no row is otherwise; accepted: names in the first line, as made by: tail "
      "-n +5 FILE");
  // as QTM does: some lines of the head have as many cells as the first, and rows end with a tab
  EXPECT_EQ(
      refusal("FRAMES\t4\nCAMERAS\t8\nFrame\tt\tx\n1\t0.0\t5\t\n2\t0.1\t6\t\n3\t0.2\t7\t\n"),
      "f.csv:3:1: 3 cells for 2 names, and most rows are otherwise; accepted: names in the first line, as made by: "
      "tail -n +3 FILE");
  // some rows of another width are left out, as ever
  EXPECT_EQ(read("t,x\n0.5,9\n0.75,1\na,b,c\n1,2,3\n").t, (std::vector<double>{0.5, 0.75}));
}

}  // namespace
}  // namespace flappy::flightlog::table_test
