#include "flightlog/import/dataflash.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "flightlog/import/ulogs.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::dataflash_test {
namespace {

using Lines = std::vector<std::string>;
using Column = std::vector<double>;

template <class T>
std::string bytes(T value) {
  return test::UlogText::bytes(value);
}

std::string padded(std::string text, std::size_t size) {
  text.resize(size, '\0');
  return text;
}

std::string message(int type, const std::string& content) {
  return "\xA3\x95" + std::string(1, static_cast<char>(type)) + content;
}

std::string fmt(int type, std::size_t size, const std::string& name, const std::string& letters,
                const std::string& columns) {
  return message(128, std::string{static_cast<char>(type), static_cast<char>(size)} + padded(name, 4) +
                          padded(letters, 16) + padded(columns, 64));
}

std::string imu(std::uint64_t t_us, std::uint8_t instance, float x) {
  return message(129, bytes(t_us) + bytes(instance) + bytes(x));
}

/// Instances of IMU, and messages of every letter.
std::string whole() {
  std::string text = fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
                     fmt(129, 16, "IMU", "QBf", "TimeUS,I,AccX") +
                     fmt(130, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds") +
                     fmt(131, 3 + 4 + 37 + 64, "ALL", "IbBhHiIfcCeELgMa", "TimeMS,b,B,h,H,i,I,f,c,C,e,E,L,g,M,a") +
                     fmt(132, 3 + 20, "TXT", "Qnq", "TimeUS,n,q");
  text += imu(1000, 0, 0.5f);  // before it is known which column is the instance
  text += message(130, bytes(std::uint64_t{0}) + std::string("\x81", 1) + padded("s#o", 16) + padded("F-0", 16));
  text += imu(1000, 1, -0.5f) + imu(2000, 0, 1.5f) + imu(2000, 1, -1.5f);
  std::string array;
  for (std::int16_t k = 0; k < 32; ++k) array += bytes(static_cast<std::int16_t>(-k));
  text +=
      message(131, bytes(std::uint32_t{7}) + bytes(std::int8_t{-1}) + bytes(std::uint8_t{255}) +
                       bytes(std::int16_t{-300}) + bytes(std::uint16_t{60000}) + bytes(std::int32_t{-70000}) +
                       bytes(std::uint32_t{4000000000}) + bytes(0.25f) + bytes(std::int16_t{-1234}) +
                       bytes(std::uint16_t{61234}) + bytes(std::int32_t{-123456}) + bytes(std::uint32_t{123456}) +
                       bytes(std::int32_t{-353621474}) + bytes(std::uint16_t{0xC100}) + bytes(std::uint8_t{4}) + array);
  text += message(132, bytes(std::uint64_t{5}) + "abcd" + bytes(std::int64_t{-5}));
  return text;
}

Channels read(const std::string& text, Lines* warnings = nullptr, Wanted wanted = {}) {
  Channels channels(std::move(wanted));
  Lines ignored;
  (is_dataflash(text) ? read_dataflash : read_dataflash_text)(text, "f.bin", channels, warnings ? *warnings : ignored);
  return channels;
}

TEST(Dataflash, ReadsInstancesAndTimes) {
  ASSERT_TRUE(is_dataflash(whole()));
  Lines warnings;
  const Channels channels = read(whole(), &warnings);
  EXPECT_EQ(warnings, Lines());
  EXPECT_EQ(channels.names(), (Lines{"ALL", "IMU[0]", "IMU[1]", "TXT"}));
  EXPECT_EQ(*channels.find("IMU")->column("AccX"), (Column{0.5, 1.5}));
  EXPECT_EQ(*channels.find("IMU[1]")->column("AccX"), (Column{-0.5, -1.5}));
  EXPECT_EQ(channels.find("IMU[1]")->stamp_ns(), (std::vector<std::int64_t>{1'000'000, 2'000'000}));
  EXPECT_EQ(channels.find("IMU")->received_ns(), channels.find("IMU")->stamp_ns());
}

TEST(Dataflash, ScalesByTheLetters) {
  const Channel all = *read(whole()).find("ALL");
  for (const auto& [field, value] : std::map<std::string, double>{{"b", -1},
                                                                  {"B", 255},
                                                                  {"h", -300},
                                                                  {"H", 60000},
                                                                  {"i", -70000},
                                                                  {"I", 4e9},
                                                                  {"f", 0.25},
                                                                  {"c", -12.34},
                                                                  {"C", 612.34},
                                                                  {"e", -1234.56},
                                                                  {"E", 1234.56},
                                                                  {"L", -35.3621474},
                                                                  {"g", -2.5},
                                                                  {"M", 4},
                                                                  {"a[31]", -31}})
    EXPECT_EQ(*all.column(field), Column{value}) << field;
  EXPECT_EQ(read(whole()).find("TXT")->fields(), (Lines{"TimeUS", "q"}));  // a text is no number
  EXPECT_EQ(*read(whole()).find("TXT")->column("q"), Column{-5});
  EXPECT_EQ(all.stamp_ns(), (std::vector<std::int64_t>{7'000'000}));
}

TEST(Dataflash, ReadsText) {
  const std::string text =
      "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\r\n"
      "FMT, 129, 31, IMU, QBf, TimeUS,I,AccX\r\n"  // a length that says nothing here

      "FMT, 130, 44, FMTU, QBNN, TimeUS,FmtType,UnitIds,MultIds\n"
      "FMT, 131, 77, MSG, QcZ, TimeUS,Alt,Message\n"
      "FMTU, 0, 129, s#o, F-0\n"
      "IMU, 1000, 0, 0.5\nIMU, 1000, 1, -0.5\nIMU, 2000, 0, 1.5\n"
      "MSG, 3000, 12.34, hello, world\n"
      "IMU, 4000, 0\nBOO, 1\n";
  ASSERT_TRUE(is_dataflash_text(text));
  EXPECT_TRUE(is_dataflash_text("\r\nArduPlane V2.74\r\nFree RAM: 2048\r\n" + text));
  EXPECT_FALSE(is_dataflash_text("type,FMT, 128, 89\n"));
  Lines warnings;
  const Channels channels = read(text, &warnings);
  EXPECT_EQ(*channels.find("IMU[0]")->column("AccX"), (Column{0.5, 1.5}));
  EXPECT_EQ(channels.find("IMU[1]")->stamp_ns(), (std::vector<std::int64_t>{1'000'000}));
  EXPECT_EQ(*channels.find("MSG")->column("Alt"), (Column{12.34}));  // written scaled
  EXPECT_EQ(warnings,
            (Lines{"f.bin: 2 lines left out, the first of them line 10, which is of no type with as many cells"}));
}

TEST(Dataflash, ReadsWhatIsWantedAlone) {
  const Channels channels = read(whole(), nullptr, {{"IMU[1]", {"AccX"}}});
  EXPECT_EQ(*channels.find("IMU[1]")->column("AccX"), (Column{-0.5, -1.5}));
  EXPECT_EQ(channels.find("IMU[1]")->column("I"), nullptr);
  EXPECT_TRUE(channels.find("ALL")->stamp_ns().empty());
}

TEST(Dataflash, SkipsWhatIsDamagedAndSaysSo) {
  const std::string text = whole(), first = imu(1000, 1, -0.5f);
  const std::size_t at = text.find(first);
  Lines warnings;
  // a byte is lost: the next message begins within the one that lost it
  const Channels channels = read(text.substr(0, at + 5) + text.substr(at + 6), &warnings);
  EXPECT_EQ(*channels.find("IMU[1]")->column("AccX"), (Column{-1.5}));
  EXPECT_EQ(*channels.find("IMU[0]")->column("AccX"), (Column{0.5, 1.5}));
  EXPECT_EQ(warnings, (Lines{"f.bin: is damaged: 15 bytes skipped in 1 place, at byte " + std::to_string(at)}));
  warnings.clear();
  EXPECT_EQ(read(text.substr(0, at + 5), &warnings).find("IMU")->stamp_ns().size(), 1u);
  EXPECT_EQ(warnings,
            (Lines{"f.bin: ends within a message, at byte " + std::to_string(at) + ": read as far as it goes"}));
  warnings.clear();
  std::string description = text;
  description[text.find("QBf")] = '?';
  EXPECT_EQ(read(description, &warnings).find("IMU"), nullptr);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0], "f.bin: describes 1 types of messages in a damaged way: left out");
  EXPECT_EQ(warnings[1],
            "f.bin: is damaged: 64 bytes skipped in 2 places, the first at byte " + std::to_string(5 * 89));
}

TEST(Dataflash, OutlivesAnyDamage) {
  const std::string text = whole();
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  for (int i = 0; i < 200; ++i) {
    std::string damaged = text;
    if (i % 2 == 0)
      damaged.erase(below(damaged.size()), 1 + below(15));  // a whole message that is gone leaves no trace
    else
      for (std::size_t flips = 1 + below(8); flips > 0; --flips)
        damaged[below(damaged.size())] ^= static_cast<char>(1 << below(8));
    if (!is_dataflash(damaged)) continue;
    Lines warnings;
    read(damaged, &warnings);
    if (i % 2 == 0) EXPECT_FALSE(warnings.empty()) << i;
  }
}

}  // namespace
}  // namespace flappy::flightlog::dataflash_test
