#include "io/config.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

namespace flappy::io {
namespace {

using Read = std::function<void(const Table&)>;
using Overrides = std::vector<std::string>;

/// What a person sees when a reader meets this text in v.toml; "accepted" when the reader finds no fault.
std::string message(const std::string& text, const Read& read, const Overrides& overrides = {}) {
  try {
    const Config config = Config::parse(text, "v.toml", overrides);
    read(config.root());
    config.root().finish();
    return "accepted";
  } catch (const InputError& error) {
    return error.what();
  }
}

void nothing(const Table&) {}

void read_torso(const Table& root) {
  const Table torso = root.table("torso");
  torso.number("mass_kg", {1e-6, 1});
  torso.number_or("length_m", 0.1, positive());
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Config, ReadsEveryType) {
  const Config config = Config::parse(
      R"(
        mass_kg = 0.012
        count = 7
        flag = true
        name = "colibri"
        colour = "red"
        gains = [1, 2.5, -3e-4]
        axes = ["x", "y"]
        vehicle = "../vehicles/v.toml"
        left.motor.resistance_ohm = 5
        [torso]
        height_m = 0.2
        [[wall]]
        x_m = 1.0
        [[wall]]
        x_m = 2.0
      )",
      "configs/tasks/hover.toml");
  const Table root = config.root();
  EXPECT_EQ(root.number("mass_kg"), 0.012);
  EXPECT_EQ(root.number("count"), 7.0);
  EXPECT_EQ(root.integer("count", 0, 7), 7);
  EXPECT_TRUE(root.boolean("flag"));
  EXPECT_EQ(root.string("name"), "colibri");
  EXPECT_EQ(root.choice("colour", {"green", "red"}), "red");
  EXPECT_EQ(root.numbers("gains"), (std::vector<double>{1, 2.5, -3e-4}));
  EXPECT_EQ(root.strings("axes"), (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(root.file("vehicle"), "configs/tasks/../vehicles/v.toml");
  EXPECT_EQ(root.number("left.motor.resistance_ohm"), 5.0);
  EXPECT_EQ(root.table("torso").path(), "torso");
  EXPECT_EQ(root.table("torso").number("height_m"), 0.2);
  ASSERT_EQ(root.tables("wall").size(), 2u);
  EXPECT_EQ(root.tables("wall")[0].number("x_m"), 1.0);
  EXPECT_EQ(root.tables("wall")[1].number("x_m"), 2.0);
  EXPECT_EQ(root.tables("wall")[1].path(), "wall[1]");
  EXPECT_EQ(root.path(), "");
  EXPECT_NO_THROW(root.finish());
}

TEST(Config, MissingOptionalKeysGiveTheFallback) {
  const Table root = Config::parse("", "v.toml").root();
  EXPECT_EQ(root.number_or("a_m", 0.5), 0.5);
  EXPECT_EQ(root.integer_or("b", 3, 0, 9), 3);
  EXPECT_TRUE(root.boolean_or("c", true));
  EXPECT_EQ(root.string_or("d", "e"), "e");
  EXPECT_FALSE(root.optional_table("f").has_value());
  EXPECT_TRUE(root.tables("g").empty());
}

TEST(Config, PresentOptionalKeysOverruleTheFallback) {
  const Table root = Config::parse("a_m = 2\nb = 4\nc = false\nd = 'x'\n[f]\n", "v.toml").root();
  EXPECT_EQ(root.number_or("a_m", 0.5), 2.0);
  EXPECT_EQ(root.integer_or("b", 3, 0, 9), 4);
  EXPECT_FALSE(root.boolean_or("c", true));
  EXPECT_EQ(root.string_or("d", "e"), "x");
  EXPECT_TRUE(root.optional_table("f").has_value());
}

TEST(Config, KeysAreSortedAndMayHoldDotsWhenQuoted) {
  const Config config = Config::parse("z = 1\n\"left.motor\" = 2\n", "v.toml");
  EXPECT_EQ(config.root().keys(), (std::vector<std::string>{"left.motor", "z"}));
  EXPECT_EQ(config.root().number("left.motor"), 2.0);
}

TEST(Config, SaysWhetherAKeyIsThere) {
  const Table root = Config::parse("a.b = 1\n", "v.toml").root();
  EXPECT_TRUE(root.has("a"));
  EXPECT_TRUE(root.has("a.b"));
  EXPECT_FALSE(root.has("a.c"));
  EXPECT_FALSE(root.has("d"));
  root.finish();  // what was asked about is known
}

TEST(Config, TablesOutliveTheConfig) {
  const Table torso = Config::parse("[torso]\nmass_kg = 0.1\n", "v.toml").root().table("torso");
  EXPECT_EQ(torso.number("mass_kg"), 0.1);
}

TEST(Config, RefusesUnknownKeys) {
  const std::string known = "[torso]\nmass_kg = 0.1\n";
  EXPECT_EQ(message(known, read_torso), "accepted");
  EXPECT_EQ(message(known + "lenght_m = 1\n", read_torso),
            "v.toml:3:1: torso.lenght_m: unknown key; accepted: length_m, mass_kg; did you mean \"length_m\"?");
  EXPECT_EQ(message(known + "Length_M = 1\n", read_torso),
            "v.toml:3:1: torso.Length_M: unknown key; accepted: length_m, mass_kg; did you mean \"length_m\"?");
  EXPECT_EQ(message(known + "colour = 1\n", read_torso),
            "v.toml:3:1: torso.colour: unknown key; accepted: length_m, mass_kg");
  EXPECT_EQ(message(known + "[torsoo]\nmass_kg = 1\n", read_torso),
            "v.toml:3:2: torsoo: unknown key; accepted: torso; did you mean \"torso\"?");
  EXPECT_EQ(message("  seed = 1\n", nothing), "v.toml:1:3: seed: unknown key; accepted: no key here");
  EXPECT_EQ(message("\"a\\u001b b\" = 1\n", nothing), "v.toml:1:1: \"a\\u001B b\": unknown key; accepted: no key here");
}

TEST(Config, UnknownKeysAreRefusedBeforeWhatIsMissing) {
  const auto read = [](const Table& root) {
    root.accept({"end", "success"});
    root.table("end").number("time_s");
    root.optional_table("success");
  };
  EXPECT_EQ(message("[end]\ntime_s = 1\n[success]\n", read), "accepted");
  EXPECT_EQ(message("[sucess]\n", read),
            "v.toml:1:2: sucess: unknown key; accepted: end, success; did you mean \"success\"?");
  EXPECT_EQ(message("[success]\n", read), "v.toml: end: is missing; accepted: a table");
  // a key that is accepted and not asked for stands there in vain
  EXPECT_EQ(message("end = 1\n", [](const Table& root) { root.accept({"end"}); }),
            "v.toml:1:1: end: unknown key; accepted: no key here");
  EXPECT_THROW(message("", [](const Table& root) { root.accept({"end"}), root.has("start"); }), std::logic_error);
}

TEST(Config, RefusesUnknownKeysBelowTables) {
  const auto read_walls = [](const Table& root) {
    for (const Table& wall : root.tables("wall")) wall.number("x_m");
  };
  EXPECT_EQ(message("[[wall]]\nx_m = 1\n[[wall]]\nx_m = 2\nz_m = 3\n", read_walls),
            "v.toml:5:1: wall[1].z_m: unknown key; accepted: x_m");
  EXPECT_EQ(message("wall = [{x_m = 1, z_m = 3}]\n", read_walls),
            "v.toml:1:19: wall[0].z_m: unknown key; accepted: x_m");
  EXPECT_EQ(message("left.motor.x = 1\nleft.y = 2\n", [](const Table& root) { root.number("left.motor.x"); }),
            "v.toml:2:6: left.y: unknown key; accepted: motor");
  EXPECT_EQ(message("[a]\nb = 1\n", [](const Table& root) { root.optional_table("a"); }),
            "v.toml:2:1: a.b: unknown key; accepted: no key here");
}

TEST(Config, NamesDifferingInADigitAreNotTakenForMisspellings) {
  const auto read = [](const Table& root) { root.number_or("z_cp1", 0); };
  EXPECT_EQ(message("z_cp2 = 1\n", read), "v.toml:1:1: z_cp2: unknown key; accepted: z_cp1");
  EXPECT_EQ(message("z_pc1 = 1\n", read), "v.toml:1:1: z_pc1: unknown key; accepted: z_cp1; did you mean \"z_cp1\"?");
}

TEST(Config, RefusesAnotherUnit) {
  EXPECT_EQ(message("[torso]\nmass_g = 12\n", read_torso),
            "v.toml:2:1: torso.mass_g: unknown key; accepted here with another unit: \"mass_kg\"");
  EXPECT_EQ(message("[torso]\nmass_kg = 0.1\nlength_mm = 12\n", read_torso),
            "v.toml:3:1: torso.length_mm: unknown key; accepted here with another unit: \"length_m\"");
  EXPECT_EQ(message("upper_deg = 90\n", [](const Table& root) { root.number("upper_rad"); }),
            "v.toml:1:1: upper_deg: unknown key; accepted here with another unit: \"upper_rad\"");
  EXPECT_EQ(message("inertia_g_mm2 = 90\n", [](const Table& root) { root.number("inertia_kg_m2"); }),
            "v.toml:1:1: inertia_g_mm2: unknown key; accepted here with another unit: \"inertia_kg_m2\"");
  EXPECT_EQ(message("battery_A = 1\n", [](const Table& root) { root.number("battery_V"); }),
            "v.toml: battery_V: is missing; accepted: a number; is it misspelt as \"battery_A\"?");
}

TEST(Config, RefusesMissingKeys) {
  EXPECT_EQ(message("", read_torso), "v.toml: torso: is missing; accepted: a table");
  EXPECT_EQ(message("\n  [torso]\n", read_torso),
            "v.toml:2:3: torso.mass_kg: is missing; accepted: a number from 1e-06 to 1");
  EXPECT_EQ(message("\n[torso]\nmas_kg = 1\n", read_torso),
            "v.toml:2:1: torso.mass_kg: is missing; accepted: a number from 1e-06 to 1; "
            "is it misspelt as \"mas_kg\"?");
  const auto missing = [](const Read& read) { return message("a.b = 1\n", read); };
  EXPECT_EQ(missing([](const Table& root) { root.number("left.motor.x_m"); }),
            "v.toml: left.motor.x_m: is missing; accepted: a number");
  EXPECT_EQ(missing([](const Table& root) { root.number("a.c.d_m"); }),
            "v.toml:1:1: a.c.d_m: is missing; accepted: a number");
  EXPECT_EQ(missing([](const Table& root) { root.integer("n", 1, 9); }),
            "v.toml: n: is missing; accepted: an integer from 1 to 9");
  EXPECT_EQ(missing([](const Table& root) { root.boolean("f"); }), "v.toml: f: is missing; accepted: true or false");
  EXPECT_EQ(missing([](const Table& root) { root.string("s"); }), "v.toml: s: is missing; accepted: a string");
  EXPECT_EQ(missing([](const Table& root) {
              root.choice("c", {"x", "y"});
            }),
            "v.toml: c: is missing; accepted: \"x\", \"y\"");
  EXPECT_EQ(missing([](const Table& root) { root.numbers("g", positive()); }),
            "v.toml: g: is missing; accepted: an array, each a number above 0");
  EXPECT_EQ(missing([](const Table& root) { root.strings("t"); }),
            "v.toml: t: is missing; accepted: an array of strings");
  EXPECT_EQ(missing([](const Table& root) { root.file("v"); }), "v.toml: v: is missing; accepted: the name of a file");
}

TEST(Config, RefusesWrongTypes) {
  const auto wrong = [](const std::string& value, const Read& read) { return message("k = " + value, read); };
  const Read number = [](const Table& root) { root.number("k", positive(1)); };
  EXPECT_EQ(wrong("'a'", number), "v.toml:1:5: k: is a string; accepted: a number above 0, at most 1");
  EXPECT_EQ(wrong("true", number), "v.toml:1:5: k: is a boolean; accepted: a number above 0, at most 1");
  EXPECT_EQ(wrong("[1]", number), "v.toml:1:5: k: is an array; accepted: a number above 0, at most 1");
  EXPECT_EQ(wrong("{a=1}", number), "v.toml:1:5: k: is a table; accepted: a number above 0, at most 1");
  EXPECT_EQ(wrong("1979-05-27", number), "v.toml:1:5: k: is a date or time; accepted: a number above 0, at most 1");
  EXPECT_EQ(wrong("'a'", [](const Table& root) { root.number_or("k", 1); }),
            "v.toml:1:5: k: is a string; accepted: a number");
  EXPECT_EQ(wrong("3.0", [](const Table& root) { root.integer("k", 1, 9); }),
            "v.toml:1:5: k: is a floating-point number; accepted: an integer from 1 to 9");
  EXPECT_EQ(wrong("3.0", [](const Table& root) { root.integer_or("k", 1, 1, 9); }),
            "v.toml:1:5: k: is a floating-point number; accepted: an integer from 1 to 9");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.boolean("k"); }),
            "v.toml:1:5: k: is an integer; accepted: true or false");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.boolean_or("k", true); }),
            "v.toml:1:5: k: is an integer; accepted: true or false");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.string("k"); }),
            "v.toml:1:5: k: is an integer; accepted: a string");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.string_or("k", ""); }),
            "v.toml:1:5: k: is an integer; accepted: a string");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.choice("k", {"x"}); }),
            "v.toml:1:5: k: is an integer; accepted: \"x\"");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.numbers("k"); }),
            "v.toml:1:5: k: is an integer; accepted: an array, each a number");
  EXPECT_EQ(wrong("[1, 'a']", [](const Table& root) { root.numbers("k"); }),
            "v.toml:1:9: k[1]: is a string; accepted: a number");
  EXPECT_EQ(wrong("'a'", [](const Table& root) { root.strings("k"); }),
            "v.toml:1:5: k: is a string; accepted: an array of strings");
  EXPECT_EQ(wrong("['a', 1]", [](const Table& root) { root.strings("k"); }),
            "v.toml:1:11: k[1]: is an integer; accepted: a string");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.file("k"); }),
            "v.toml:1:5: k: is an integer; accepted: the name of a file");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.table("k"); }), "v.toml:1:5: k: is an integer; accepted: a table");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.optional_table("k"); }),
            "v.toml:1:5: k: is an integer; accepted: a table");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.number("k.motor.x"); }),
            "v.toml:1:5: k: is an integer; accepted: a table");
  EXPECT_EQ(wrong("1", [](const Table& root) { root.tables("k"); }),
            "v.toml:1:5: k: is an integer; accepted: an array of tables");
  EXPECT_EQ(wrong("[{}, 1]", [](const Table& root) { root.tables("k"); }),
            "v.toml:1:10: k[1]: is an integer; accepted: a table");
}

TEST(Config, ReadsArraysOfOneLength) {
  const Table root = Config::parse("a = [1, 2.5]\nnone = []\nwalls = [[0, 1.5], [-2, 3e-4]]\n", "v.toml").root();
  EXPECT_EQ(root.numbers("a", 2), (std::vector<double>{1, 2.5}));
  EXPECT_EQ(root.rows("walls", 2), (std::vector<std::vector<double>>{{0, 1.5}, {-2, 3e-4}}));
  EXPECT_TRUE(root.rows("none", 2).empty());
  EXPECT_NO_THROW(root.finish());

  const auto three = [](const std::string& value) {
    return message("k = " + value, [](const Table& t) { t.numbers("k", 3, non_negative(1)); });
  };
  EXPECT_EQ(three("[0, 1, 0.5]"), "accepted");
  EXPECT_EQ(three("[0, 1]"), "v.toml:1:5: k: has 2 elements; accepted: an array of 3, each a number from 0 to 1");
  EXPECT_EQ(three("[0, 1, 1, 0]"), "v.toml:1:5: k: has 4 elements; accepted: an array of 3, each a number from 0 to 1");
  EXPECT_EQ(three("[0, 2, 1]"), "v.toml:1:9: k[1]: 2 is out of range; accepted: a number from 0 to 1");
  EXPECT_EQ(three("7"), "v.toml:1:5: k: is an integer; accepted: an array of 3, each a number from 0 to 1");
  EXPECT_EQ(message("", [](const Table& t) { t.numbers("k", 3); }),
            "v.toml: k: is missing; accepted: an array of 3, each a number");
}

TEST(Config, RefusesFaultyRows) {
  const auto rows = [](const std::string& value) {
    return message("k = " + value, [](const Table& t) { t.rows("k", 2, {-9, 9}); });
  };
  EXPECT_EQ(rows("[[1, 2],\n  [3, 4]]"), "accepted");
  EXPECT_EQ(rows("[[1, 2],\n  [3, 'a']]"), "v.toml:2:7: k[1][1]: is a string; accepted: a number from -9 to 9");
  EXPECT_EQ(rows("[[1, 2],\n  [3, 10]]"), "v.toml:2:7: k[1][1]: 10 is out of range; accepted: a number from -9 to 9");
  EXPECT_EQ(rows("[[1, nan]]"), "v.toml:1:10: k[0][1]: nan is not finite; accepted: a number from -9 to 9");
  EXPECT_EQ(rows("[[1, 2],\n  [3]]"),
            "v.toml:2:3: k[1]: has 1 elements; accepted: an array of 2, each a number from -9 to 9");
  EXPECT_EQ(rows("[[1, 2], 3]"),
            "v.toml:1:14: k[1]: is an integer; accepted: an array of 2, each a number from -9 to 9");
  EXPECT_EQ(rows("true"),
            "v.toml:1:5: k: is a boolean; accepted: an array, each an array of 2, each a number from -9 to 9");
  EXPECT_EQ(message("", [](const Table& t) { t.rows("k", 2); }),
            "v.toml: k: is missing; accepted: an array, each an array of 2, each a number");
}

TEST(Config, RefusesNumbersOutOfRange) {
  const auto at = [](const std::string& value, Range range) {
    return message("[torso]\n\nmass_kg = " + value, [&](const Table& root) { root.number("torso.mass_kg", range); });
  };
  EXPECT_EQ(at("-0.01", positive(1)),
            "v.toml:3:11: torso.mass_kg: -0.01 is out of range; accepted: a number above 0, at most 1");
  EXPECT_EQ(at("0", positive()), "v.toml:3:11: torso.mass_kg: 0 is out of range; accepted: a number above 0");
  EXPECT_EQ(at("0", non_negative()), "accepted");
  EXPECT_EQ(at("-1", non_negative()),
            "v.toml:3:11: torso.mass_kg: -1 is out of range; accepted: a number of at least 0");
  EXPECT_EQ(at("1.5", {-kInfinity, 1}),
            "v.toml:3:11: torso.mass_kg: 1.5 is out of range; accepted: a number of at most 1");
  EXPECT_EQ(at("1", {-1, 1}), "accepted");
  EXPECT_EQ(at("-1", {-1, 1}), "accepted");
  EXPECT_EQ(at("1.0000001", {-1, 1}),
            "v.toml:3:11: torso.mass_kg: 1.0000001 is out of range; accepted: a number from -1 to 1");
}

TEST(Config, RefusesNumbersThatAreNotFinite) {
  const Read read = [](const Table& root) { root.number("k"); };
  EXPECT_EQ(message("k = nan", read), "v.toml:1:5: k: nan is not finite; accepted: a number");
  EXPECT_EQ(message("k = -inf", read), "v.toml:1:5: k: -inf is not finite; accepted: a number");
  EXPECT_EQ(message("k = inf", [](const Table& root) { root.number("k", positive()); }),
            "v.toml:1:5: k: inf is not finite; accepted: a number above 0");
  EXPECT_EQ(message("k = [1, nan]", [](const Table& root) { root.numbers("k"); }),
            "v.toml:1:9: k[1]: nan is not finite; accepted: a number");
}

TEST(Config, RefusesIntegersOutOfRange) {
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  const auto at = [](const std::string& value, std::int64_t low, std::int64_t high) {
    return message("n = " + value, [&](const Table& root) { root.integer("n", low, high); });
  };
  EXPECT_EQ(at("0", 1, 9), "v.toml:1:5: n: 0 is out of range; accepted: an integer from 1 to 9");
  EXPECT_EQ(at("10", 1, 9), "v.toml:1:5: n: 10 is out of range; accepted: an integer from 1 to 9");
  EXPECT_EQ(at("0", 1, kMax), "v.toml:1:5: n: 0 is out of range; accepted: an integer of at least 1");
  EXPECT_EQ(at("10", kMin, 9), "v.toml:1:5: n: 10 is out of range; accepted: an integer of at most 9");
  EXPECT_EQ(at("-9223372036854775808", kMin, kMax), "accepted");
}

TEST(Config, RefusesUnknownChoices) {
  const Read read = [](const Table& root) { root.choice("k", {"hover", "landing"}); };
  EXPECT_EQ(message("k = 'huver'", read),
            "v.toml:1:5: k: \"huver\" is not known; accepted: \"hover\", \"landing\"; did you mean \"hover\"?");
  EXPECT_EQ(message("k = 'x'", read), "v.toml:1:5: k: \"x\" is not known; accepted: \"hover\", \"landing\"");
  std::string chosen;
  const Read read_or = [&](const Table& root) { chosen = root.choice_or("k", "landing", {"hover", "landing"}); };
  EXPECT_EQ(message("k = 'x'", read_or), message("k = 'x'", read));
  EXPECT_EQ(message("", read_or), "accepted");
  EXPECT_EQ(chosen, "landing");
  EXPECT_EQ(message("k = 'hover'", read_or), "accepted");
  EXPECT_EQ(chosen, "hover");
}

TEST(Config, RefusesFileNamesThatAreNone) {
  const Read read = [](const Table& root) { root.file("k"); };
  EXPECT_EQ(message("k = ''", read), "v.toml:1:5: k: is empty; accepted: the name of a file");
  EXPECT_EQ(message("k = \"a\\u0000b\"", read), "v.toml:1:5: k: holds a NUL character; accepted: the name of a file");
}

TEST(Config, FilesStartAtTheFolderOfTheConfig) {
  EXPECT_EQ(Config::parse("k = 'a.toml'", "v.toml").root().file("k"), "a.toml");
  EXPECT_EQ(Config::parse("k = '/x/a.toml'", "c/v.toml").root().file("k"), "/x/a.toml");
}

TEST(Config, ReportsFaultsOfTheCaller) {
  const std::string text = "[a]\nb.c = 1\n";
  const auto fail = [&](const std::string& key, const std::string& accepted) {
    return message(text, [&](const Table& root) { root.table("a").fail(key, "is odd", accepted); });
  };
  EXPECT_EQ(fail("b.c", "even ones"), "v.toml:2:7: a.b.c: is odd; accepted: even ones");
  EXPECT_EQ(fail("b.c", ""), "v.toml:2:7: a.b.c: is odd");
  EXPECT_EQ(fail("missing", ""), "v.toml:1:1: a.missing: is odd");
  EXPECT_EQ(fail("", "even ones"), "v.toml:1:1: a: is odd; accepted: even ones");
  EXPECT_EQ(message("", [](const Table& root) { root.fail("", "is odd", ""); }), "v.toml: is odd");
  const Read fail_default = [](const Table& root) {
    root.number_or("d", 1);
    root.fail("d", "is odd", "");
  };
  EXPECT_EQ(message("", fail_default), "v.toml: d: is odd");
}

TEST(Config, RefusesWhatIsNotToml) {
  EXPECT_EQ(message("a = 1\nb = = 2\n", nothing),
            "v.toml:2:5: not valid TOML: Error while parsing value: could not determine value type");
  EXPECT_EQ(message("a = 1\n\n  a = 2\n", nothing),
            "v.toml:3:7: not valid TOML: Error while parsing key-value pair: cannot redefine existing integer 'a'");
  EXPECT_EQ(message("a = 1\nb = [1, 2", nothing),
            "v.toml:2:10: not valid TOML: Error while parsing array: encountered end-of-file");
  EXPECT_EQ(message("a = 010\n", nothing),
            "v.toml:1:8: not valid TOML: Error while parsing decimal integer: leading zeroes are prohibited");
}

TEST(Config, RefusesDeepNestingBeforeParsing) {
  const auto repeated = [](const std::string& part, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += part;
    return text;
  };
  const std::string fault = "tables and arrays nest too deeply; accepted: at most 32 levels";
  EXPECT_EQ(message("a = 1\nb = " + repeated("[", 200000), nothing), "v.toml:2:37: " + fault);
  EXPECT_EQ(message(repeated("a.", 200000) + "b = 1", nothing), "v.toml:1:66: " + fault);
  EXPECT_EQ(message("a = 1\nb = [\"\"\"\n\"\"\"\", " + repeated("[", 200000), nothing), "v.toml:3:38: " + fault);
  EXPECT_EQ(message("a = '''\n'''''\n[" + repeated("b.", 200000) + "c]", nothing), "v.toml:3:67: " + fault);
  EXPECT_EQ(message(repeated("a.", 20) + "b = {" + repeated("c.", 20) + "d = 1}", nothing), "v.toml: " + fault);
  const Read read = [](const Table& root) { root.string("k"); };
  EXPECT_EQ(message("# " + repeated("[.", 99) + "\nk = \"\\\"" + repeated("[.", 99) + "\"", read), "accepted");
}

TEST(Config, SurvivesWhatTomlCallsUnreachable) {
  const Read read = [](const Table& root) { root.string("s"); };
  EXPECT_EQ(Config::parse("s = \"\"\"a\\\n  ü\"\"\"\n", "v.toml").root().string("s"), "aü");
  EXPECT_EQ(message("s = 1\n\u00fc = 2\n", read).find("v.toml:2:1: not valid TOML: "), 0u);
  EXPECT_EQ(message("s = 1.7\"ü\n", read).find("v.toml:1:8: not valid TOML: "), 0u);
  EXPECT_EQ(message("s = 1979-05-27T\\2:00:00\n", read).find("v.toml:1:16: not valid TOML: "), 0u);
}

TEST(Config, RefusesLargeText) {
  EXPECT_EQ(message(std::string((1 << 20) + 1, '\n'), nothing),
            "v.toml: is 1048577 bytes long; accepted: at most 1048576");
  EXPECT_EQ(message(std::string(1 << 20, '\n'), nothing), "accepted");
}

TEST(Config, LoadRefusesWhatCannotBeRead) {
  const auto load = [](const std::filesystem::path& path) -> std::string {
    try {
      Config::load(path);
      return "accepted";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(load("no/such.toml"), "no/such.toml: cannot be read: No such file or directory");
  EXPECT_EQ(load("/tmp"), "/tmp: cannot be read: Is a directory");
}

TEST(Config, LoadReadsAFile) {
  const std::filesystem::path path = testing::TempDir() + "flappy_config_test.toml";
  write_atomically(path, "[torso]\nmass_kg = 0.1\n");
  const Config config = Config::load(path, {"torso.mass_kg=0.2"});
  EXPECT_EQ(config.root().number("torso.mass_kg"), 0.2);
  std::filesystem::remove(path);
}

TEST(Overrides, ReplaceAndCreate) {
  const Table root = Config::parse("a.b = 1\nc = [1]\nd = {x = 1, y = 2}\n", "v.toml",
                                   {"a.b=2.5", "a.new.deep = true", "c=[1, 2]", "d={x = 3}", "e=bare-word", "f='q'",
                                    "a.b=4", "g=two words"})
                         .root();
  EXPECT_EQ(root.number("a.b"), 4.0);
  EXPECT_TRUE(root.boolean("a.new.deep"));
  EXPECT_EQ(root.numbers("c"), (std::vector<double>{1, 2}));
  EXPECT_EQ(root.number("d.x"), 3.0);
  EXPECT_EQ(root.string("e"), "bare-word");
  EXPECT_EQ(root.string("f"), "q");
  EXPECT_EQ(root.string("g"), "two words");
  EXPECT_NO_THROW(root.finish());
}

TEST(Overrides, AreTheirOwnPlaceInMessages) {
  const std::string text = "[torso]\nmass_kg = 0.1\n";
  EXPECT_EQ(message(text, read_torso, {"torso.mass_kg=-1"}),
            "--set torso.mass_kg=-1: torso.mass_kg: -1 is out of range; accepted: a number from 1e-06 to 1");
  EXPECT_EQ(message(text, read_torso, {"torso.mass_kg=heavy"}),
            "--set torso.mass_kg=heavy: torso.mass_kg: is a string; accepted: a number from 1e-06 to 1");
  EXPECT_EQ(message(text, read_torso, {"torso.mas_kg=1"}),
            "--set torso.mas_kg=1: torso.mas_kg: unknown key; accepted: length_m, mass_kg; did you mean "
            "\"mass_kg\"?");
  EXPECT_EQ(message(text, read_torso, {"torso.mass_g=1"}),
            "--set torso.mass_g=1: torso.mass_g: unknown key; accepted here with another unit: \"mass_kg\"");
  EXPECT_EQ(message(text, read_torso, {"a.b=1"}), "--set a.b=1: a: unknown key; accepted: torso");
  EXPECT_EQ(message(text + "colour = 1\n", read_torso, {"torso.colour=2"}),
            "--set torso.colour=2: torso.colour: unknown key; accepted: length_m, mass_kg");
  EXPECT_EQ(message("", read_torso, {"torso.length_m=1"}),
            "--set torso.length_m=1: torso.mass_kg: is missing; accepted: a number from 1e-06 to 1");
}

TEST(Overrides, RefuseElementsOfArraysAndWhatIsNoTable) {
  const std::string text = "n = 1\n[[wall]]\nx_m = 1\n";
  EXPECT_EQ(message(text, nothing, {"wall[0].x_m=2"}),
            "--set wall[0].x_m=2: wall[0].x_m: is an element of an array; accepted: the whole array");
  EXPECT_EQ(message(text, nothing, {"wall.x_m=2"}), "--set wall.x_m=2: wall: is an array; accepted: the whole array");
  EXPECT_EQ(message(text, nothing, {"n.x_m=2"}), "--set n.x_m=2: n: is an integer; accepted: a table");
}

TEST(Overrides, RefuseMalformedOnes) {
  const auto at = [](const std::string& text) { return message("", nothing, {text}); };
  const std::string fault = " is not an override; accepted: a.b.c=value";
  for (const std::string text : {"", "a", "a=", "=1", "a b=1", "#a=1", "\"a\"=1"}) {
    EXPECT_EQ(at(text), "--set " + text + ":" + fault);
  }
  EXPECT_EQ(at("a=1\nb=2"), "--set a=1\\x0ab=2:" + fault);
  EXPECT_EQ(at("a=[1, 2"), "--set a=[1, 2: not valid TOML: Error while parsing array: encountered end-of-file");
  EXPECT_NE(at("a..b=1").find("--set a..b=1: not valid TOML: "), std::string::npos);
  std::string deep = "a";
  for (int i = 0; i < 100000; ++i) deep += ".a";
  EXPECT_NE(at(deep + "=1").find(": tables and arrays nest too deeply"), std::string::npos);
}

TEST(Resolved, HoldsOverridesAndDefaults) {
  const Config config = Config::parse("name = 'v'\n[torso]\nmass_kg = 0.1\n", "v.toml", {"torso.mass_kg=0.2"});
  const Table root = config.root();
  root.number_or("torso.length_m", 2);
  root.number_or("left.motor.resistance_ohm", 0.1);
  root.integer_or("seed", 7, 0, 9);
  root.boolean_or("fast", false);
  root.string_or("title", "a \"b\"");
  EXPECT_NO_THROW(root.number("torso.mass_kg"));
  EXPECT_EQ(config.resolved(),
            "fast = false\nname = \"v\"\nseed = 7\ntitle = \"a \\\"b\\\"\"\n\n[left]\n\n[left.motor]\n"
            "resistance_ohm = 0.1\n\n[torso]\nlength_m = 2.0\nmass_kg = 0.2\n");
  EXPECT_EQ(root.string("name"), "v");
  EXPECT_NO_THROW(root.finish());
}

TEST(Resolved, LeavesOutFallbacksThatMeanNotSet) {
  const Config config = Config::parse("", "v.toml");
  EXPECT_EQ(config.root().number_or("limit_V", kInfinity, positive()), kInfinity);
  EXPECT_EQ(config.root().number_or("height_m", -1, positive()), -1);
  EXPECT_EQ(config.root().integer_or("count", -1, 0, 9), -1);
  EXPECT_EQ(config.resolved(), "");
}

TEST(Resolved, KeepsRows) {
  const std::string text = "k = [[0.1, -2], [1e-300, 3]]\n";
  const Config first = Config::parse("", "v.toml", {text.substr(0, text.size() - 1)});
  const Config second = Config::parse(first.resolved(), "v.toml");
  EXPECT_EQ(first.resolved(), text);
  EXPECT_EQ(second.root().rows("k", 2), (std::vector<std::vector<double>>{{0.1, -2}, {1e-300, 3}}));
}

TEST(Resolved, ReadsIdenticallyWhenParsedAgain) {
  const std::string text = R"(
    numbers = [0.1, 1e300, 5e-324, -0.0, 2.0, 123456789012345680.0, 1e-7, 1.7976931348623157e308, 9007199254740993]
    text = ["\u0000\u001f\u007f\"\\\n\tü\U0001F426", '', "\u2028"]
    "quoted.key \u00e9\n" = 1
    "" = 2
    day = 1979-05-27T07:32:00.5-07:00
    mixed = [[1], {a = [{b = 1}], "c d" = {}}]
    [a]
    [a.b."c.d"]
    [[walls]]
    x = 1
    [walls.inner]
    y = 1
    [[walls.points]]
    z = 1
    [[walls]]
  )";
  const Config first = Config::parse(text, "v.toml");
  const Config second = Config::parse(first.resolved(), "v.toml");
  EXPECT_EQ(first.resolved(), second.resolved());
  EXPECT_EQ(first.root().numbers("numbers"), second.root().numbers("numbers"));
  EXPECT_TRUE(std::signbit(second.root().numbers("numbers")[3]));
  EXPECT_EQ(first.root().strings("text"), second.root().strings("text"));
  EXPECT_EQ(first.root().keys(), second.root().keys());
  EXPECT_EQ(second.root().integer("", 0, 9), 2);
  EXPECT_EQ(second.root().table("a.b").keys(), std::vector<std::string>{"c.d"});
  ASSERT_EQ(second.root().tables("walls").size(), 2u);
  EXPECT_EQ(second.root().tables("walls")[0].tables("points")[0].number("z"), 1.0);
  EXPECT_TRUE(second.root().tables("walls")[1].keys().empty());
  EXPECT_NE(first.resolved().find("day = 1979-05-27T07:32:00.5-07:00\n"), std::string::npos);
}

}  // namespace
}  // namespace flappy::io
