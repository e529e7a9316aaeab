#include "flightlog/import/usdlog.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <map>

#include "flightlog/import/ulogs.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::usdlog_test {
namespace {

using Lines = std::vector<std::string>;

template <class T>
std::string bytes(T value) {
  return test::UlogText::bytes(value);
}

std::string named(const std::string& text) { return text + '\0'; }

std::string with_checksum(const std::string& text) {
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
  return text + bytes(static_cast<std::uint32_t>(sum));
}

/// The head of a log with two kinds of events: number 3 every 10 ms, number 9 now and then.
std::string head(std::uint16_t version) {
  return "\xBC" + bytes(version) + bytes(std::uint16_t{2}) + bytes(std::uint16_t{3}) + named("fixedFrequency") +
         bytes(std::uint16_t{3}) + named("motor.m1(I)") + named("pm.vbatMV(H)") + named("stateEstimate.x(f)") +
         bytes(std::uint16_t{9}) + named("estTDOA") + bytes(std::uint16_t{2}) + named("idA(B)") + named("half(e)");
}

std::string fixed(auto time, std::uint32_t motor, std::uint16_t battery_mV, float x) {
  return bytes(std::uint16_t{3}) + bytes(time) + bytes(motor) + bytes(battery_mV) + bytes(x);
}

std::string whole() {
  return head(2) + fixed(std::uint64_t{10'000}, 40000, 3700, 0.5f) + bytes(std::uint16_t{9}) +
         bytes(std::uint64_t{12'345}) + '\7' + bytes(std::uint16_t{0xC100}) +
         fixed(std::uint64_t{20'000}, 41000, 3690, -0.25f);
}

Channels read(const std::string& text, Lines* warnings = nullptr) {
  Channels channels;
  Lines ignored;
  read_usdlog(text, "log00", channels, warnings ? *warnings : ignored);
  return channels;
}

TEST(Usdlog, ReadsSeveralKindsOfEvents) {
  const std::string text = with_checksum(whole());
  ASSERT_TRUE(is_usdlog(text));
  Lines warnings;
  const Channels channels = read(text, &warnings);
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(channels.names(), (Lines{"estTDOA", "fixedFrequency"}));
  const Channel& fixed = *channels.find("fixedFrequency");
  EXPECT_EQ(fixed.stamp_ns(), (std::vector<std::int64_t>{10'000'000, 20'000'000}));
  EXPECT_EQ(fixed.received_ns(), fixed.stamp_ns());
  EXPECT_EQ(*fixed.column("motor.m1"), (std::vector<double>{40000, 41000}));
  EXPECT_EQ(*fixed.column("pm.vbatMV"), (std::vector<double>{3700, 3690}));
  EXPECT_EQ(*fixed.column("stateEstimate.x"), (std::vector<double>{0.5, -0.25}));
  const Channel& other = *channels.find("estTDOA");
  EXPECT_EQ(other.stamp_ns(), (std::vector<std::int64_t>{12'345'000}));
  EXPECT_EQ(*other.column("idA"), (std::vector<double>{7}));
  EXPECT_EQ(*other.column("half"), (std::vector<double>{-2.5}));
}

/// Blocks of their own rates side by side: what the firmware logs on each event of its estimator and of its rotors.
TEST(Usdlog, KeepsBlocksOfDifferentRatesApart) {
  std::string text = "\xBC" + bytes(std::uint16_t{2}) + bytes(std::uint16_t{3}) + bytes(std::uint16_t{0}) +
                     named("fixedFrequency") + bytes(std::uint16_t{1}) + named("acc.z(f)") + bytes(std::uint16_t{1}) +
                     named("estPose") + bytes(std::uint16_t{2}) + named("x(f)") + named("qw(f)") +
                     bytes(std::uint16_t{4}) + named("rpm") + bytes(std::uint16_t{2}) + named("m1(H)") + named("m2(H)");
  std::map<std::string, std::vector<std::int64_t>> expected_ns;
  for (std::uint64_t t_us = 0; t_us < 100'000; t_us += 500) {
    const auto begin = [&](std::uint16_t id, const char* name) {
      expected_ns[name].push_back(static_cast<std::int64_t>(1000 * t_us));
      return bytes(id) + bytes(t_us);
    };
    const auto t_s = static_cast<float>(1e-6 * static_cast<double>(t_us));
    if (t_us % 2000 == 0) text += begin(0, "fixedFrequency") + bytes(9.81f + t_s);
    if (t_us % 9500 == 0) text += begin(1, "estPose") + bytes(t_s) + bytes(1.0f);
    if (t_us % 1500 == 0)
      text += begin(4, "rpm") + bytes(static_cast<std::uint16_t>(t_us / 100)) + bytes(std::uint16_t{7});
  }
  Lines warnings;
  const Channels channels = read(with_checksum(text), &warnings);
  EXPECT_EQ(warnings, Lines());
  EXPECT_EQ(channels.names(), (Lines{"estPose", "fixedFrequency", "rpm"}));
  for (const auto& [name, stamps_ns] : expected_ns) EXPECT_EQ(channels.find(name)->stamp_ns(), stamps_ns) << name;
  const auto& x_m = *channels.find("estPose")->column("x");
  const auto& m1_rpm = *channels.find("rpm")->column("m1");
  for (std::size_t k = 0; k < x_m.size(); ++k) EXPECT_NEAR(x_m[k], 0.0095 * static_cast<double>(k), 1e-8);
  for (std::size_t k = 0; k < m1_rpm.size(); ++k) EXPECT_EQ(m1_rpm[k], 15.0 * static_cast<double>(k));
  EXPECT_EQ(channels.find("fixedFrequency")->column("m1"), nullptr);
}

TEST(Usdlog, TimesOfVersionOneAreMilliseconds) {
  Lines warnings;
  const Channels channels = read(with_checksum(head(1) + fixed(std::uint32_t{1234}, 1, 2, 3)), &warnings);
  EXPECT_EQ(channels.find("fixedFrequency")->stamp_ns(), (std::vector<std::int64_t>{1'234'000'000}));
  EXPECT_TRUE(warnings.empty());
}

TEST(Usdlog, SaysThatTheChecksumIsWrong) {
  std::string text = with_checksum(whole());
  text.back() ^= 1;
  Lines warnings;
  EXPECT_EQ(read(text, &warnings).find("fixedFrequency")->stamp_ns().size(), 2u);
  EXPECT_EQ(warnings, (Lines{"log00: has a wrong checksum: some of its numbers may be damaged"}));
}

TEST(Usdlog, ReadsAsFarAsItGoes) {
  const std::string text = with_checksum(whole());
  const std::size_t last = whole().size() - 20;
  for (std::size_t size = head(2).size(); size < text.size(); ++size) {
    Lines warnings;
    const Channels channels = read(text.substr(0, size), &warnings);
    EXPECT_LE(channels.find("fixedFrequency")->stamp_ns().size(), size < whole().size() ? 1u : 2u) << size;
    if (size > last + 2 && size < whole().size() && size != last + 4) {
      EXPECT_EQ(warnings, (Lines{"log00: ends within an event, at byte " + std::to_string(last) +
                                 ", without a sound checksum: read as far as it goes"}))
          << size;
    }
  }
  Lines warnings;
  std::string damaged = text;
  damaged[last] = 77;
  EXPECT_EQ(read(damaged, &warnings).find("fixedFrequency")->stamp_ns().size(), 1u);
  EXPECT_EQ(warnings, (Lines{"log00: has an event of no known kind, at byte " + std::to_string(last) +
                             ", without a sound checksum: read as far as it goes"}));
}

TEST(Usdlog, RefusesHeadsThatItCannotRead) {
  const auto refusal = [](const std::string& text) { return test::refusal([&] { read(text); }); };
  EXPECT_EQ(refusal(head(3)), "log00: is a usdlog of version 3; accepted: versions 1 and 2");
  const std::string cut = "log00: ends within its head; accepted: a whole log of the microSD card";
  for (std::size_t size = 3; size < head(2).size(); ++size) EXPECT_EQ(refusal(head(2).substr(0, size)), cut) << size;
  std::string typed = head(2);
  typed[typed.find("(f)") + 1] = 'z';
  EXPECT_EQ(refusal(typed),
            "log00: variable \"stateEstimate.x(z)\" of event fixedFrequency has no known type; accepted: as in "
            "stateEstimate.x(f)");
  std::string twice = head(2);
  twice.replace(twice.find("estTDOA"), 7, "fixedFrequency");
  EXPECT_EQ(refusal(twice), "log00: describes event fixedFrequency twice; accepted: a log of the microSD card");
}

TEST(Usdlog, IsToldFromText) {
  EXPECT_FALSE(is_usdlog("t,x\n1,2\n"));
  EXPECT_FALSE(is_usdlog("\xBC"));
}

}  // namespace
}  // namespace flappy::flightlog::usdlog_test
