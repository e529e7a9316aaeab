#include "flightlog/import/c3d.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "flightlog/import/c3ds.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::c3d_test {
namespace {

using test::C3dText;
using test::Processor;
using Lines = std::vector<std::string>;
using Column = std::vector<double>;

Channels read(const std::string& bytes, Lines* warnings = nullptr) {
  Channels channels;
  Lines ignored;
  read_c3d(bytes, "f.c3d", "f", channels, warnings ? *warnings : ignored);
  return channels;
}

constexpr int kFrames = 5, kTimes = 2;
constexpr double kScale_mm = 0.5;

/// Two points, of which the second is not seen in frame 1, and two analog channels of twice the rate.
std::string whole(Processor processor, bool real, const std::string& unit = "mm") {
  C3dText text(processor, real);
  text.group(1, "POINT").group(2, "ANALOG").group(3, "TRIAL");
  text.integers(1, "USED", {2}).reals(1, "SCALE", {real ? -kScale_mm : kScale_mm}).reals(1, "RATE", {200});
  text.integers(1, "FRAMES", {kFrames}).texts(1, "LABELS", {"nose", "tail"}).texts(1, "UNITS", {unit});
  text.integers(2, "USED", {2}).reals(2, "RATE", {400}).reals(2, "GEN_SCALE", {0.5}).reals(2, "SCALE", {0.25, 2});
  text.integers(2, "OFFSET", {100, -3}).texts(2, "LABELS", {"Fx", "volt"});
  text.integers(3, "ACTUAL_START_FIELD", {11, 0}).integers(3, "ACTUAL_END_FIELD", {15, 0});
  // a place of its own block is known once all parameters are there: this one has the same size whatever it says
  text.integers(1, "DATA_START", {text.data_block()});
  std::string data;
  for (int f = 0; f < kFrames; ++f) {
    for (int p = 0; p < 2; ++p) {
      const double unit_of_storage = real ? kScale_mm : 1;
      for (int k = 0; k < 3; ++k) data += text.stored(unit_of_storage * (1000 * p + 100 * k + f - 50));
      data += text.stored(p == 1 && f == 1 ? -1 : 0x0300 + 6);  // two cameras, residual 6
    }
    for (int s = 0; s < kTimes; ++s) data += text.stored(100 + 8 * (f * kTimes + s)) + text.stored(-3 + f);
  }
  return text.file(2, 4, kTimes, kFrames, real ? -kScale_mm : kScale_mm, 200, data);
}

TEST(C3d, ReadsEveryProcessorAndStorage) {
  for (const Processor processor : {Processor::intel, Processor::dec, Processor::mips})
    for (const bool real : {false, true}) {
      const std::string bytes = whole(processor, real);
      ASSERT_TRUE(is_c3d(bytes));
      Lines warnings;
      const Channels channels = read(bytes, &warnings);
      EXPECT_EQ(warnings, Lines());
      EXPECT_EQ(channels.names(), (Lines{"f", "f.analog"}));
      const Channel &points = *channels.find("f"), &analog = *channels.find("f.analog");
      EXPECT_EQ(points.fields(), (Lines{"frame", "nose.residual", "nose.x", "nose.y", "nose.z", "t", "tail.residual",
                                        "tail.x", "tail.y", "tail.z"}));
      EXPECT_EQ(*points.column("frame"), (Column{11, 12, 13, 14, 15}));
      for (int f = 0; f < kFrames; ++f) {
        EXPECT_DOUBLE_EQ(points.column("t")->at(f), f / 200.0);
        EXPECT_NEAR(points.column("nose.y")->at(f), 0.0005 * (50 + f), 1e-9);
        EXPECT_NEAR(points.column("nose.residual")->at(f), 0.003, 1e-12);
        for (const char* field : {"tail.x", "tail.residual"})
          EXPECT_EQ(std::isnan(points.column(field)->at(f)), f == 1) << field << f;
        if (f != 1) EXPECT_NEAR(points.column("tail.z")->at(f), 0.0005 * (1150 + f), 1e-7);
        for (int s = 0; s < kTimes; ++s) {
          EXPECT_DOUBLE_EQ(analog.column("t")->at(f * kTimes + s), (f * kTimes + s) / 400.0);
          EXPECT_DOUBLE_EQ(analog.column("Fx")->at(f * kTimes + s), f * kTimes + s);
          EXPECT_DOUBLE_EQ(analog.column("volt")->at(f * kTimes + s), f);
        }
      }
    }
}

TEST(C3d, ReadsSamplesWithoutSign) {
  C3dText text(Processor::intel, false);
  text.group(1, "POINT").integers(1, "USED", {1}).reals(1, "SCALE", {1}).reals(1, "RATE", {100});
  text.integers(1, "FRAMES", {3}).texts(1, "LABELS", {"a"}).texts(1, "UNITS", {"mm"}).group(2, "ANALOG");
  text.integers(2, "USED", {1}).reals(2, "RATE", {100}).reals(2, "GEN_SCALE", {1}).reals(2, "SCALE", {2});
  text.texts(2, "FORMAT", {"UNSIGNED"}).integers(2, "OFFSET", {32768}).texts(2, "LABELS", {"Fz"});
  text.integers(1, "DATA_START", {text.data_block()});
  std::string data;
  for (const int raw : {30000, 32768, 40000})
    data += text.word(1) + text.word(2) + text.word(3) + text.word(0) + text.word(raw);
  const Channels channels = read(text.file(1, 1, 1, 3, 1, 100, data));
  EXPECT_EQ(*channels.find("f.analog")->column("Fz"), (Column{-5536, 0, 14464}));
  EXPECT_EQ(channels.find("f")->stamp_ns(), (std::vector<std::int64_t>{0, 10'000'000, 20'000'000}));
  EXPECT_EQ(channels.find("f.analog")->stamp_ns(), channels.find("f")->stamp_ns());
}

TEST(C3d, CountsFramesBeyondSixteenBits) {
  constexpr int kMany = 70000;
  const auto made = [&](const auto& count) {
    C3dText text(Processor::intel, false);
    text.group(1, "POINT").group(2, "TRIAL");
    text.integers(1, "USED", {1}).reals(1, "SCALE", {1}).texts(1, "LABELS", {"a"}).texts(1, "UNITS", {"m"});
    count(text);
    std::string data;
    for (int f = 0; f < kMany; ++f) data += text.word(f % 1000) + text.word(0) + text.word(0) + text.word(0);
    return text.file(1, 0, 0, 65535, 1, 500, data);
  };
  for (const std::string& bytes :
       {made([](C3dText& t) {
          t.integers(1, "FRAMES", {65535})
              .integers(2, "ACTUAL_START_FIELD", {1, 0})
              .integers(2, "ACTUAL_END_FIELD", {kMany - 65536, 1});
        }),
        made([](C3dText& t) {
          t.integers(1, "FRAMES", {kMany - 65536})
              .integers(2, "ACTUAL_START_FIELD", {1, 0})
              .integers(2, "ACTUAL_END_FIELD", {kMany - 65536, 1});
        }),
        made([](C3dText& t) { t.integers(1, "FRAMES", {65535}).reals(1, "LONG_FRAMES", {kMany}); }),
        made([](C3dText& t) { t.reals(1, "FRAMES", {kMany}); })}) {
    Lines warnings;
    const Channels channels = read(bytes, &warnings);
    EXPECT_EQ(warnings, Lines());
    ASSERT_EQ(channels.find("f")->stamp_ns().size(), std::size_t{kMany});
    EXPECT_EQ(channels.find("f")->column("a.x")->back(), (kMany - 1) % 1000);
    EXPECT_EQ(channels.find("f")->column("frame")->back(), kMany);
  }
}

/// A rotation of `angle` about z at a place, and one that was not measured.
std::string with_rotations(double angle, bool skewed) {
  C3dText text(Processor::intel, true);
  text.group(1, "POINT").group(2, "ROTATION");
  text.integers(1, "USED", {1})
      .reals(1, "SCALE", {-1})
      .texts(1, "LABELS", {"a"})
      .texts(1, "UNITS", {"mm"})
      .integers(1, "FRAMES", {1});
  text.integers(2, "USED", {2}).integers(2, "RATIO", {2}).texts(2, "LABELS", {"body", "lost"});
  text.integers(2, "DATA_START", {text.data_block() + 1});
  std::string data = text.real(1) + text.real(2) + text.real(3) + text.real(0);
  data = C3dText::padded(data);
  for (int s = 0; s < 2; ++s)
    for (const double reliability : {0.0, -1.0}) {
      const double c = std::cos(angle * s), d = std::sin(angle * s);
      for (const double v :
           {c, d, 0.0, 0.0, -d, c, 0.0, 0.0, 0.0, skewed ? 0.5 : 0.0, 1.0, 0.0, 100.0, 200.0, 300.0 + s, 1.0})
        data += text.real(v);
      data += text.real(reliability);
    }
  return text.file(1, 0, 0, 1, -1, 100, data);
}

TEST(C3d, ReadsRotations) {
  Lines warnings;
  const Channels channels = read(with_rotations(1.0, false), &warnings);
  EXPECT_EQ(warnings, Lines());
  const Channel& rotations = *channels.find("f.rotation");
  EXPECT_EQ(*rotations.column("t"), (Column{0, 0.005}));
  EXPECT_NEAR(rotations.column("body.z")->at(1), 0.301, 1e-7);
  EXPECT_NEAR(rotations.column("body.qw")->at(1), std::cos(0.5), 1e-7);
  EXPECT_NEAR(rotations.column("body.qz")->at(1), std::sin(0.5), 1e-7);
  EXPECT_TRUE(std::isnan(rotations.column("lost.qw")->at(0)));
  const Channels skewed = read(with_rotations(1.0, true), &warnings);
  EXPECT_TRUE(std::isnan(skewed.find("f.rotation")->column("body.qw")->at(0)));
  EXPECT_EQ(warnings, (Lines{"f.c3d: has 2 rotations whose matrix is none: taken as missing"}));
}

TEST(C3d, SaysWhatIsCutOffOrContradictory) {
  const std::string bytes = whole(Processor::intel, true);
  Lines warnings;
  const std::size_t data = bytes.size() - 512;  // its five frames take 240 bytes
  EXPECT_EQ(read(bytes.substr(0, data + 100), &warnings).find("f")->stamp_ns().size(), 2u);
  EXPECT_EQ(warnings, (Lines{"f.c3d: ends after 2 of 5 frames: read as far as it goes"}));
  warnings.clear();
  EXPECT_EQ(read(bytes + std::string(2000, '\1'), &warnings).find("f")->stamp_ns().size(), 5u);
  EXPECT_EQ(warnings, (Lines{"f.c3d: has 2272 bytes behind the 5 frames that it declares: left out"}));
  warnings.clear();
  EXPECT_NEAR(read(whole(Processor::intel, true, "furlong"), &warnings).find("f")->column("nose.y")->at(0), 25, 1e-6);
  EXPECT_EQ(
      warnings,
      (Lines{"f.c3d: has the unit \"furlong\": its lengths are as they stand; accepted: m, dm, cm, mm, um, in, ft"}));
  warnings.clear();
  std::string header = bytes;
  header[4] = 6;  // analog samples of a frame
  read(header, &warnings);
  EXPECT_EQ(
      warnings,
      (Lines{
          "f.c3d: has 6 analog samples in a frame by its header, 4 by its parameters: taken as the parameters say"}));
  std::string twice = bytes;
  twice.replace(twice.find("tail"), 4, "nose");
  warnings.clear();
  EXPECT_NE(read(twice, &warnings).find("f")->column("nose#2.x"), nullptr);
  EXPECT_EQ(warnings, (Lines{"f.c3d: has two labels nose: the later one is nose#2"}));
}

TEST(C3d, RefusesWhatItCannotRead) {
  const auto refusal = [](const std::string& parameter, const std::string& value) {
    std::string bytes = whole(Processor::intel, true);
    // behind its name: an offset, a type and the number of sizes, 0
    bytes.replace(bytes.find(parameter) + parameter.size() + 4, value.size(), value);
    return test::refusal([&] { read(bytes); });
  };
  const C3dText text(Processor::intel, true);
  EXPECT_EQ(refusal("RATE", text.real(0)), "f.c3d: has a rate of 0 Hz; accepted: a rate above 0");
  EXPECT_EQ(refusal("SCALE", text.real(0)), "f.c3d: has a scale of 0; accepted: another than 0");
  EXPECT_EQ(refusal("DATA_START", text.word(99)),
            "f.c3d: has its frames at block 99; accepted: blocks of 512 bytes within the file");
  EXPECT_FALSE(is_c3d("xP,y,z\n1,2,3\n"));
}

TEST(C3d, OutlivesAnyDamage) {
  std::vector<std::string> files;
  for (const Processor processor : {Processor::intel, Processor::dec, Processor::mips})
    for (const bool real : {false, true}) files.push_back(whole(processor, real));
  files.push_back(with_rotations(1, false));
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  std::size_t refused = 0, warned = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    std::string bytes = files[i % files.size()];
    if (i % 4 == 0) bytes.resize(below(bytes.size()));
    else if (i % 4 == 1) bytes.replace(below(bytes.size() - 4), 2, "\xff\xff");
    else
      for (std::size_t flips = 1 + below(8); flips > 0; --flips) bytes[below(1536)] ^= static_cast<char>(1 << below(8));
    Lines warnings;
    const std::string line = test::refusal([&] { read(bytes, &warnings); });
    if (line != "accepted") {
      EXPECT_NE(line.find("; accepted: "), std::string::npos) << line;
      ++refused;
    } else if (!warnings.empty()) {
      ++warned;
    } else if (i % 4 == 0) {
      EXPECT_GE(bytes.size() + 512, files[i % files.size()].size());  // what lies behind the data alone is gone
    }
  }
  EXPECT_GT(refused, 20u);
  EXPECT_GT(warned, 20u);
}

}  // namespace
}  // namespace flappy::flightlog::c3d_test
