#include "flightlog/import/table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

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

TEST(Table, FindsNamesBelowIdsAndEmptyRows) {
  expect_rows(",Body,Body\n,robot,robot\n,1,1\n,Position,Position\nt,x,y\n0.5,9,0\n0.75,-2e-3,0\n");
  expect_rows("Name,hover,Date,today,Who,me\n,,\nt,x\n0.5,9\n0.75,-2e-3\n,\n");
  expect_rows(
      "Channels\t7\t\nSamples\t40\t40\nDate\t2026/05/04\t2026/05/04\n***\t\t\nt\tx\ty\n0.5\t9\t1\n0.75\t-2e-3\t1\n");
}

TEST(Table, ReadsListsAsTheyArePrinted) {
  const auto second = [](const std::string& cell) {
    Channels channels(Wanted{{"f", std::set<std::string>{"p[1]"}}});
    Lines warnings;
    read_table("t,p\n1," + cell + "\n2," + cell + "\n", "f.csv", "f", channels, warnings);
    return channels.find("f")->column("p[1]")->at(1);
  };
  for (const char* cell :
       {"\"[1, 2.5]\"", "[1 2.5]", "(1;2.5)", "\"{1,2.5}\"", "\"array([1, 2.5])\"", "\"[[1, 2.5]]\"",
        "\"[np.float64(1), np.float64(2.5)]\"", "\"array('d', [1, 2.5])\"", "\"array([1, 2.5], dtype=float32)\""})
    EXPECT_EQ(second(cell), 2.5) << cell;
  for (const char* cell : {"[1 2.5", "[1 2.5)", "array(1)", "\"1, 2.5\""})
    EXPECT_TRUE(std::isinf(second(cell))) << cell;
}

TEST(Table, TakesUnitsInNames) {
  Channels channels;
  Lines warnings;
  read_table("time [us],x (mm),pitch(deg),y [px],q[1]\n1,2,3,4,5\n2,2,3,4,5\n", "f.csv", "f", channels, warnings);
  const Channel& found = *channels.find("f");
  EXPECT_EQ(found.unit("time [us]"), "us");
  EXPECT_EQ(found.unit("x (mm)"), "mm");
  EXPECT_EQ(found.unit("pitch(deg)"), "deg");
  EXPECT_EQ(found.unit("y [px]"), "");
  EXPECT_EQ(found.unit("q[1]"), "");
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
  EXPECT_EQ(refusal("t,x,x\n0.5,9,1\n"), "f.csv:1:1: x: column name is given twice; accepted: \"x 1\", \"x 2\"");
  EXPECT_EQ(refusal("go\n,a,b\nt,x,x\n0.5,9,1\n0.6,9,1\n"),
            "f.csv:3:1: x: column name is given twice; accepted: \"a x\", \"b x\"");
  EXPECT_EQ(refusal("t,x\n0.5,9,1\n0.75,1,2\n"),
            "f.csv:2:1: 3 cells for 2 names, and no row is otherwise; accepted: rows of as many cells");
}

TEST(Table, SkipsWhatStandsAboveTheNames) {
  expect_rows("Recorded by hand\nRoom 3, at noon\n\nt,x\n0.5,9\n0.75,-2e-3\n");
  expect_rows("Rate,100\nSubject,bird\nt,x\n0.5,9\n0.75,-2e-3\n");
  expect_rows(
      "FRAMES\t4\nCAMERAS\t8\nWHEN\t2026-05-04, "
      "10:15:00\t12.5\nNAMES\tbird\nFrame\tt\tx\n1\t0.5\t9\t\n2\t0.75\t-2e-3\t\n");
  expect_rows(
      "Version,1.23,Take,hover,Rate,100\r\n\r\n,Type,Body\r\n,Name,bird\r\n,ID,1\r\nFrame,t,x,\r\n0,0.5,9,\r\n1,0.75,-"
      "2e-3,\r\n");
  // some rows of another width are left out, as ever, and do not become names
  EXPECT_EQ(read("t,x\n0.5,9\n0.75,1\na,b,c\n1,2,3\n").t, (std::vector<double>{0.5, 0.75}));
  EXPECT_EQ(read("t,x\n0.5,9\nERR,overflow\n0.75,1\n0.8,1\n").x, (std::vector<double>{9, kInfinity, 1, 1}));
}

/// A channel of all fields, or of those that are wanted, some of them times.
Channels whole(const std::string& text, const std::set<std::string>& fields = {}, Lines* warnings = nullptr) {
  Channels channels({{"f", fields}}, {{"f", {"day", "clock"}}});
  Lines ignored;
  read_table(text, "f.csv", "f", channels, warnings ? *warnings : ignored);
  return channels;
}

TEST(Table, TellsColumnsOfOneNameApart) {
  const std::string text =
      "Take,3\n\n,,bird,,,,box,,\n,,Rotation,,Position,,Position,,\nFrame,t,X,Y,X,Y,X,Y,\n1,0.5,1,2,3,4,5,6,\n2,0.6,1,"
      "2,3,4,5,6,\n";
  const std::set<std::string> said = {"t", "Rotation X", "X 2", "box Y", "bird Position Y"};
  const Channels channels = whole(text, said);
  const Channel& f = *channels.find("f");
  EXPECT_EQ(f.column("t")->at(0), 0.5);
  EXPECT_EQ(f.column("Rotation X")->at(0), 1);
  EXPECT_EQ(f.column("X 2")->at(0), 3);
  EXPECT_EQ(f.column("bird Position Y")->at(0), 4);
  EXPECT_EQ(f.column("box Y")->at(0), 6);
  // what is offered is each column's own
  EXPECT_EQ(whole(text).find("f")->fields(),
            (Lines{"Frame", "Rotation X", "Rotation Y", "bird Position X", "bird Position Y", "box X", "box Y", "t"}));
  EXPECT_EQ(test::refusal([&] { whole(text, {"Position X"}); }),
            "f.csv:5:1: Position X: column name is given twice; accepted: \"bird Position X\", \"box X\"");
  // a name that looks like a place is a name
  EXPECT_EQ(whole("x,x,x 2\n1,2,3\n", {"x 2"}).find("f")->column("x 2")->at(0), 3);
}

TEST(Table, TakesARowOfUnits) {
  expect_rows("t,x\ns,mm\n0.5,9\n0.75,-2e-3\n");
  expect_rows("Objects\n100\n,,bird,\nFrame,t,x,\n,s,mm,\n1,0.5,9,\n2,0.75,-2e-3,\n");
  EXPECT_EQ(whole("t,x\ns,[mm]\n0.5,9\n", {"t", "x"}).find("f")->unit("x"), "[mm]");
  EXPECT_EQ(whole("t,x\n0.5,9\n", {"t", "x"}).find("f")->unit("x"), "");
}

TEST(Table, ReadsListsInCells) {
  const std::string text = "t,p,q\n0.5,\"[0.1, -0.2]\",[1 2 3]\n0.6,,\"(4; 5.5; 6)\"\n0.7,\"[0.3]\",7\n";
  Lines warnings;
  const Channels channels = whole(text, {"t", "p[1]", "q[2]"}, &warnings);
  const std::vector<double>& p = *channels.find("f")->column("p[1]");
  EXPECT_EQ(p[0], -0.2);
  EXPECT_TRUE(std::isnan(p[1]));
  EXPECT_EQ(p[2], kInfinity);
  EXPECT_EQ(*channels.find("f")->column("q[2]"), (std::vector<double>{3, 6, kInfinity}));
  EXPECT_EQ(warnings, (Lines{"f.csv: p[1]: 1 of 3 cells are no numbers, in line 4: \"[0.3]\"",
                             "f.csv: q[2]: 1 of 3 cells are no numbers, in line 4: \"7\""}));
  EXPECT_EQ(whole("t,p[0]\n0.5,3\n", {"p[0]"}).find("f")->column("p[0]")->at(0), 3);  // a name, not an element
}

TEST(Table, ReadsDatesAndTimesOfDayWhereATimeIsWanted) {
  const auto days = [](const std::string& cell) {
    return whole("day;x\n" + cell + ";1\n", {"day", "x"}).find("f")->column("day")->at(0);
  };
  // 2026-05-04 is 20,577 days after 1970-01-01 (date -u -d 2026-05-04 +%s)
  constexpr double kMidnight = 1777852800;
  EXPECT_EQ(days("2026-05-04"), kMidnight);
  EXPECT_EQ(days("2026/05/04"), kMidnight);
  EXPECT_EQ(days("04.05.2026"), kMidnight);
  EXPECT_EQ(days("04.05.2026 10:15:00"), kMidnight + 36900);
  EXPECT_EQ(days("2026-05-04T10:15:00"), kMidnight + 36900);
  EXPECT_EQ(days("2026-05-04 10:15:00.25"), kMidnight + 36900.25);
  EXPECT_EQ(days("2026-05-04T10:15:00,5Z"), kMidnight + 36900.5);
  EXPECT_EQ(days("2026-05-04T10:15+02:00"), kMidnight + 36900 - 7200);
  EXPECT_EQ(days("2026-05-04 10:15:00 -0330"), kMidnight + 36900 + 12600);
  EXPECT_EQ(days("10:15:00.125"), 36900.125);
  EXPECT_EQ(days("1777852800.5"), kMidnight + 0.5);
  for (const char* none : {"2026-13-04", "2026-02-30", "2026-05-04T10", "2026-05-04T10:61", "2026-05-04T10:15+2",
                           "04/05/2026", "10:15:00 AM"})
    EXPECT_EQ(days(none), kInfinity) << none;
  // two columns; and where no time is wanted, a date is no number
  const Channels two = whole("day clock x\n2026-05-04 10:15:00.5 1\n", {"day", "clock", "x"});
  EXPECT_EQ(two.find("f")->column("day")->at(0), kMidnight);
  EXPECT_EQ(two.find("f")->column("clock")->at(0), 36900.5);
  EXPECT_EQ(whole("t,x\n1,2026-05-04\n", {"x"}).find("f")->column("x")->at(0), kInfinity);
}

}  // namespace
}  // namespace flappy::flightlog::table_test
