#include "flightlog/import/matlab.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flightlog/import/mats.hpp"
#include "flightlog/import/sources.hpp"
#include "io/files.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::matlab_test {
namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;
using Column = std::vector<double>;

Channels read(const fs::path& file, Lines* warnings = nullptr, Wanted wanted = {}) {
  Channels channels(std::move(wanted));
  Lines ignored;
  read_source(file, channels, warnings ? *warnings : ignored);
  return channels;
}

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

const Column kTimes = {0, 0.01, 0.02, 0.03}, kPlaces = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};

/// What a test file of either version holds: a struct with a struct in it, arrays beside it, and what is no array.
void expect_take(const Channels& channels) {
  EXPECT_EQ(channels.names(), (Lines{"mocap", "take", "trial[0]", "trial[1]"}));
  const Channel& mocap = *channels.find("mocap");
  EXPECT_EQ(mocap.fields(), (Lines{"position[0]", "position[1]", "position[2]", "signals.values", "t"}));
  EXPECT_EQ(*mocap.column("t"), kTimes);
  EXPECT_EQ(*mocap.column("position[2]"), (Column{9, 10, 11, 12}));
  EXPECT_EQ(*mocap.column("signals.values"), (Column{-4, -3, -2, -1}));
  EXPECT_EQ(mocap.stamp_ns(), (std::vector<std::int64_t>(4, kNoTime)));
  const Channel& outside = *channels.find("take");
  EXPECT_EQ(outside.fields(), (Lines{"a[0]", "a[1]", "pages[0][0]", "pages[0][1]", "pages[1][0]", "pages[1][1]", "t"}));
  EXPECT_EQ(*outside.column("a[1]"), (Column{2, 4, 6}));  // 2 x 3: the longer side is the rows
  EXPECT_EQ(*outside.column("pages[1][0]"), (Column{2, 6, 10}));
  EXPECT_EQ(*outside.column("t"), (Column{5, 6, 7}));
  EXPECT_EQ(*channels.find("trial[1]")->column("x"), (Column{3, 4}));
}

std::string version_5(bool swapped, bool packed) {
  test::MatText mat(swapped);
  const auto add = [&](const std::string& element) { mat.add(packed ? mat.compressed(element) : element); };
  const std::string small = mat.matrix("", 10, {4, 1}, mat.element(3, [&] {
    std::string raw;
    for (int v = -4; v < 0; ++v) raw += mat.bytes(static_cast<std::int16_t>(v));
    return raw;
  }()));
  add(mat.object("when", "datetime"));
  add(mat.structs(
      "mocap", 1, {"t", "log", "position", "signals", "label", "rate"},
      {mat.column("", kTimes), mat.object("", "table"), mat.doubles("", {4, 3}, kPlaces),
       mat.structs("", 1, {"values"}, {small}), mat.characters("", "bird"), mat.doubles("", {1, 1}, {200})}));
  add(mat.doubles("a", {2, 3}, {1, 2, 3, 4, 5, 6}));
  add(mat.doubles("pages", {2, 2, 3}, kPlaces));
  add(mat.doubles("t", {1, 3}, {5, 6, 7}));
  add(mat.structs("trial", 2, {"x"}, {mat.column("", {1, 2}), mat.column("", {3, 4})}));
  add(mat.matrix("names", 1, {1, 1}, mat.characters("", "x")));
  add(mat.doubles("", {3, 1}, {1, 2, 3}));  // as what objects hold
  return mat.text;
}

TEST(Matlab, ReadsVersion5ByEitherByteOrder) {
  const io::TemporaryFolder folder;
  for (const bool swapped : {false, true})
    for (const bool packed : {false, true}) {
      write(folder / "take.mat", version_5(swapped, packed));
      Lines warnings;
      expect_take(read(folder / "take.mat", &warnings));
      EXPECT_EQ(warnings,
                (Lines{(folder / "take.mat").string() + ": left out, as no arrays of numbers: when (datetime), "
                                                        "mocap.log (object), names (cell); accepted: as of seconds(t - "
                                                        "t(1)), of table2struct(T, \"ToScalar\", true)"}));
    }
}

void write_73(const fs::path& file, H5T_str_t padding) {
  using test::Mat73;
  Mat73 mat(file);
  const hid_t mocap = Mat73::group(mat.file, "mocap"), signals = Mat73::group(mocap, "signals");
  Mat73::add(mocap, "t", {4, 1}, kTimes, "double", padding);
  Mat73::add(mocap, "position", {4, 3}, kPlaces, "double", padding, true);
  Mat73::add(mocap, "label", {1, 4}, {1, 1, 1, 1}, "char", padding);
  Mat73::add(mocap, "rate", {1, 1}, {200}, "double", padding);
  Mat73::add(signals, "values", {4, 1}, {-4, -3, -2, -1}, "int16", padding);
  Mat73::add(mat.file, "a", {2, 3}, {1, 2, 3, 4, 5, 6}, "double", padding);
  Mat73::add(mat.file, "pages", {2, 2, 3}, kPlaces, "double", padding);
  Mat73::add(mat.file, "t", {1, 3}, {5, 6, 7}, "double", padding);
  Mat73::add(mat.file, "when", {1, 4}, {1, 2, 3, 4}, "datetime", padding);
  const hid_t hidden = H5Gcreate2(mat.file, "#refs#", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  Mat73::add(hidden, "a", {2, 1}, {1, 2}, "double", padding);
  Mat73::add(hidden, "b", {2, 1}, {3, 4}, "double", padding);
  const hid_t trial = Mat73::group(mat.file, "trial");
  mat.refer(trial, "x", {"/#refs#/a", "/#refs#/b"});
  for (const hid_t group : {mocap, signals, hidden, trial}) H5Gclose(group);
}

TEST(Matlab, ReadsVersion73HoweverItsClassesArePadded) {
  const io::TemporaryFolder folder;
  for (const H5T_str_t padding : {H5T_STR_NULLTERM, H5T_STR_NULLPAD}) {
    write_73(folder / "take.mat", padding);
    Lines warnings;
    expect_take(read(folder / "take.mat", &warnings));
    EXPECT_EQ(warnings,
              (Lines{(folder / "take.mat").string() +
                     ": left out, as no arrays of numbers: when (datetime); accepted: as of seconds(t - t(1)), "
                     "of table2struct(T, \"ToScalar\", true)"}));
  }
}

TEST(Matlab, ReadsWhatIsWantedAlone) {
  const io::TemporaryFolder folder;
  write(folder / "take.mat", version_5(false, true));
  const Channels channels = read(folder / "take.mat", nullptr, {{"mocap", {"t", "position[1]"}}});
  EXPECT_EQ(*channels.find("mocap")->column("position[1]"), (Column{5, 6, 7, 8}));
  EXPECT_EQ(channels.find("mocap")->column("position[0]"), nullptr);
  EXPECT_EQ(channels.find("mocap")->fields().size(), 5u);
  EXPECT_TRUE(channels.find("take")->stamp_ns().empty());
  // rows without a wanted field, so that its name is what is refused
  EXPECT_EQ(read(folder / "take.mat", nullptr, {{"mocap", {"time"}}}).find("mocap")->stamp_ns().size(), 4u);
}

TEST(Matlab, FillsShorterColumns) {
  const io::TemporaryFolder folder;
  test::MatText mat;
  write(folder / "take.mat", mat.add(mat.column("t", {1, 2, 3})).add(mat.column("x", {4, 5})).text);
  const Channels channels = read(folder / "take.mat");
  const Column& x = *channels.find("*")->column("x");
  ASSERT_EQ(x.size(), 3u);
  EXPECT_EQ(x[1], 5);
  EXPECT_TRUE(std::isnan(x[2]));
}

TEST(Matlab, LeavesOutWhatIsDamagedAndSaysSo) {
  const io::TemporaryFolder folder;
  const std::string at = (folder / "take.mat").string();
  const test::MatText mat;
  const std::string first = mat.compressed(mat.column("x", kTimes)), second = mat.compressed(mat.column("y", kTimes));
  Lines warnings;
  std::string damaged = first;
  damaged[damaged.size() - 1] ^= 1;  // the sum
  write(folder / "take.mat", mat.text + damaged + second);
  EXPECT_EQ(read(folder / "take.mat", &warnings).find("*")->fields(), (Lines{"y"}));
  EXPECT_EQ(warnings, (Lines{at + ": x is damaged: left out"}));
  warnings.clear();
  write(folder / "take.mat", mat.text + first + second.substr(0, second.size() - 3));
  EXPECT_EQ(read(folder / "take.mat", &warnings).find("*")->fields(), (Lines{"x"}));
  EXPECT_EQ(warnings, (Lines{at + ": ends within a variable at byte " + std::to_string(128 + first.size()) +
                             ": read as far as it goes"}));
}

TEST(Matlab, RefusesWhatItCannotRead) {
  const io::TemporaryFolder folder;
  const auto refusal = [&](const std::string& bytes) {
    write(folder / "take.mat", bytes);
    return test::refusal([&] { read(folder / "take.mat"); }).substr((folder / "take.mat").string().size());
  };
  EXPECT_EQ(refusal(test::MatText().text.substr(0, 60)), ": ends within its head; accepted: what save of MATLAB wrote");
  write_73(folder / "whole.mat", H5T_STR_NULLTERM);
  const std::string whole = io::read_text(folder / "whole.mat");
  EXPECT_EQ(refusal(whole.substr(0, whole.size() - 500)),
            ": is damaged or was cut off; accepted: what save of MATLAB wrote");
  EXPECT_EQ(refusal("Matlab? no"),
            ": does not begin as a .mat file; accepted: a bag, a ULog, a usdlog, a log of ArduPilot, a MATLAB file, a "
            "C3D or a CSV");
}

TEST(Matlab, OutlivesAnyDamage) {
  const io::TemporaryFolder folder;
  write_73(folder / "whole.mat", H5T_STR_NULLPAD);
  const Lines whole = {version_5(false, false), version_5(false, true), io::read_text(folder / "whole.mat")};
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  std::size_t refused = 0, warned = 0;
  constexpr int kDamages = 200;
  for (int i = 0; i < kDamages; ++i) {
    std::string bytes = whole[i % 3];
    if (i % 4 == 0) bytes.resize(below(bytes.size()));
    else if (i % 4 == 1)
      bytes.replace(below(bytes.size() - 4) & ~3ul, 4, i % 8 == 1 ? "\xff\xff\xff\x7f" : "\xff\xff\xff\xff");
    else
      for (std::size_t flips = 1 + below(8); flips > 0; --flips)
        bytes[below(bytes.size())] ^= static_cast<char>(1 << below(8));
    write(folder / "take.mat", bytes);
    Lines warnings;
    const std::string line = test::refusal([&] { read(folder / "take.mat", &warnings); });
    if (line != "accepted") {
      EXPECT_NE(line.find("; accepted: "), std::string::npos) << line;
      ++refused;
    }
    warned += warnings.size() > 1;
    if (i % 4 == 0)
      EXPECT_TRUE(line != "accepted" || !warnings.empty() || bytes.size() == 128) << i << ' ' << bytes.size();
  }
  EXPECT_GT(refused, kDamages / 10u);
  EXPECT_GT(warned, kDamages / 20u);
}

}  // namespace
}  // namespace flappy::flightlog::matlab_test
