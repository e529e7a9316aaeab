#include "flightlog/import/ulog.hpp"

#include <gtest/gtest.h>

#include "flightlog/import/ulogs.hpp"
#include "refusal.hpp"

namespace flappy::flightlog::ulog_test {
namespace {

using test::UlogText;
using Lines = std::vector<std::string>;

template <class T>
std::string bytes(T value) {
  return UlogText::bytes(value);
}

Channels read(const std::string& text, Lines* warnings = nullptr, Wanted wanted = {}) {
  Channels channels(std::move(wanted));
  Lines ignored;
  read_ulog(text, "f.ulg", channels, warnings ? *warnings : ignored);
  return channels;
}

std::string sensor(std::uint64_t t_us, float x, float y) {
  return bytes(t_us) + bytes(t_us - 100) + bytes(x) + bytes(y) + bytes(std::int16_t{-3});
}

UlogText sensors() {
  UlogText log;
  log.format("sensor:uint64_t timestamp;uint64_t timestamp_sample;float[2] gyro;int16_t level;uint8_t[6] _padding0;");
  log.topic(0, 7, "sensor").topic(1, 8, "sensor");
  return log;
}

TEST(Ulog, ReadsTopicsByInstance) {
  UlogText log = sensors();
  log.data(7, sensor(1000, 1, 2)).data(8, sensor(1500, 5, 6)).data(7, sensor(2000, 3, 4));
  const Channels channels = read(log.text);
  EXPECT_EQ(channels.names(), (Lines{"sensor[0]", "sensor[1]"}));
  const Channel& first = *channels.find("sensor");
  EXPECT_EQ(first.fields(), (Lines{"gyro[0]", "gyro[1]", "level", "timestamp", "timestamp_sample"}));
  EXPECT_EQ(*first.column("gyro[1]"), (std::vector<double>{2, 4}));
  EXPECT_EQ(*first.column("level"), (std::vector<double>{-3, -3}));
  EXPECT_EQ(first.received_ns(), (std::vector<std::int64_t>{1'000'000, 2'000'000}));
  EXPECT_EQ(first.stamp_ns(), (std::vector<std::int64_t>{900'000, 1'900'000}));
  EXPECT_EQ(*channels.find("sensor[1]")->column("gyro[0]"), (std::vector<double>{5}));
}

TEST(Ulog, ReadsFormatsInFormats) {
  UlogText log;
  log.format("esc_status:uint64_t timestamp;esc_report[2] esc;bool armed;");
  log.format("esc_report:uint8_t id;uint8_t[3] _padding0;float current;").topic(0, 1, "esc_status");
  log.data(1, bytes(std::uint64_t{5}) + std::string("\1\0\0\0", 4) + bytes(1.5f) + std::string("\2\0\0\0", 4) +
                  bytes(2.5f) + "\1");
  const Channels channels = read(log.text, nullptr, {{"esc_status", {"esc[1].current", "armed"}}});
  const Channel& esc = *channels.find("esc_status");
  EXPECT_EQ(*esc.column("esc[1].current"), (std::vector<double>{2.5}));
  EXPECT_EQ(*esc.column("armed"), (std::vector<double>{1}));
  EXPECT_EQ(esc.column("esc[0].current"), nullptr);  // nobody wanted it
  EXPECT_EQ(esc.stamp_ns(), esc.received_ns());
}

TEST(Ulog, ReadsAsFarAsItGoes) {
  UlogText log = sensors();
  log.data(7, sensor(1000, 1, 2)).data(7, sensor(2000, 3, 4));
  for (std::size_t size = 16; size < log.text.size(); ++size) {
    const Channels channels = read(log.text.substr(0, size));
    const Channel* found = channels.find("sensor");
    EXPECT_LE(found ? found->received_ns().size() : 0, 1u) << size;
  }
  Lines warnings;
  EXPECT_EQ(read(log.text.substr(0, log.text.size() - 1), &warnings).find("sensor")->received_ns().size(), 1u);
  EXPECT_EQ(warnings, (Lines{"f.ulg: ends within a message, at byte " + std::to_string(log.text.size() - 31) +
                             ": read as far as it goes"}));
}

TEST(Ulog, LeavesOutWhatIsDamagedAndSaysSo) {
  UlogText log = sensors();
  log.topic(0, 9, "unknown").format("loop:loop next;").topic(0, 10, "loop").format("empty:").topic(0, 11, "empty");
  log.data(7, "short").data(99, "of no topic").message('O', bytes(std::uint16_t{40})).message('F', "no colon");
  log.data(7, sensor(1000, 1, 2));
  Lines warnings;
  EXPECT_EQ(read(log.text, &warnings).find("sensor")->received_ns().size(), 1u);
  EXPECT_EQ(
      warnings,
      (Lines{"f.ulg: topic unknown has no format that can be read: left out",
             "f.ulg: topic loop has no format that can be read: left out",
             "f.ulg: topic empty has no format that can be read: left out", "f.ulg: 2 damaged messages left out",
             "f.ulg: 1 messages of topics that are not announced left out", "f.ulg: the logger itself dropped 40 ms"}));
}

/// 400 samples of two topics in turn.
UlogText flown() {
  UlogText log = sensors();
  for (std::uint64_t i = 0; i < 200; ++i) log.data(7, sensor(1000 + i, 1, 2)).data(8, sensor(1000 + i, 5, 6));
  return log;
}

std::size_t samples(const Channels& channels) {
  std::size_t count = 0;
  for (const char* name : {"sensor[0]", "sensor[1]"})
    if (const Channel* found = channels.find(name)) count += found->received_ns().size();
  return count;
}

TEST(Ulog, GoesOnBehindDamage) {
  const std::string whole = flown().text;
  const std::size_t begin = whole.size() - 400 * 31;  // of the data: 3 of a header, 2 of a number, 26 of a sample
  for (std::size_t at = begin; at + 600 < whole.size(); at += 101) {
    std::string lost = whole, zeroed = whole, inserted = whole;
    lost.erase(at, 1);
    zeroed.replace(at, 512, 512, '\0');
    inserted.insert(at, "#");
    for (const auto& [text, fewer] : {std::pair(lost, 2u), std::pair(inserted, 2u), std::pair(zeroed, 20u)}) {
      Lines warnings;
      EXPECT_GE(samples(read(text, &warnings)), 400 - fewer) << at;
      ASSERT_EQ(warnings.size(), 1u) << at;
      EXPECT_TRUE(warnings[0].starts_with("f.ulg: is damaged: ")) << warnings[0];
    }
  }
  std::string lost = whole;
  lost.erase(begin + 31 + 10, 1);
  Lines warnings;
  EXPECT_EQ(samples(read(lost, &warnings)), 399u);
  EXPECT_EQ(warnings, (Lines{"f.ulg: is damaged: 30 bytes skipped in 1 place, at byte " + std::to_string(begin + 31)}));
}

TEST(Ulog, GoesOnWhereATopicIsNoLongerAnnounced) {
  std::string text = flown().text;
  const std::size_t second = text.rfind(std::string("A\x01\x08", 3) + '\0');
  ASSERT_NE(second, std::string::npos);
  text[second] = '?';
  Lines warnings;
  EXPECT_EQ(samples(read(text, &warnings)), 200u);
  EXPECT_EQ(warnings, (Lines{"f.ulg: 1 messages of kinds that are not known left out",
                             "f.ulg: 200 messages of topics that are not announced left out"}));
}

TEST(Ulog, TakesTextForTextWhateverItLooksLike) {
  UlogText log = sensors();
  std::string text = std::string("\x01\x08perf_top", 10);
  for (int i = 0; i < 200; ++i)
    text += "  PID COMMAND          CPU(ms)  F: I: A: P:  \n";  // "  P" is a size and a type
  for (std::uint64_t i = 0; i < 400; ++i) log.data(7, sensor(1000 + i, 1, 2));
  log.message('M', text).data(7, sensor(2000, 1, 2)).message('Z', text);
  for (std::uint64_t i = 0; i < 400; ++i) log.data(7, sensor(3000 + i, 1, 2));
  Lines warnings;
  EXPECT_EQ(samples(read(log.text, &warnings)), 801u);
  EXPECT_EQ(warnings, (Lines{"f.ulg: 1 messages of kinds that are not known left out"}));
}

TEST(Ulog, SaysHowMuchOfItsEndIsEmpty) {
  UlogText log = sensors();
  log.data(7, sensor(1000, 1, 2)).data(7, sensor(2000, 1, 2));
  Lines warnings;
  read(log.text + std::string(100'000, '\0'), &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find(" bytes skipped in 1 place, at byte "), std::string::npos) << warnings[0];
}

TEST(Ulog, TakesFlagsAtItsHeadAlone) {
  UlogText log = sensors();
  std::string flags(40, '\0');
  flags[8] = 2;  // of a kind that is newer
  log.data(7, sensor(1000, 1, 2)).message('B', flags).data(7, sensor(2000, 1, 2));
  Lines warnings;
  EXPECT_EQ(samples(read(log.text, &warnings)), 2u);
  EXPECT_EQ(warnings, (Lines{"f.ulg: 1 damaged messages left out"}));
}

TEST(Ulog, ShowsNamesEscapedAndCut) {
  UlogText log;
  log.topic(0, 7, std::string(70, 'n')).format("a:uint64_t timestamp;");
  Lines warnings;
  read(log.text, &warnings);
  EXPECT_EQ(warnings, (Lines{"f.ulg: topic " + std::string(60, 'n') + "... has no format that can be read: left out"}));
}

TEST(Ulog, GoesOnWhereDataWereAppended) {
  UlogText log = sensors();
  log.data(7, sensor(1000, 1, 2));
  const std::string half = log.text.substr(0, log.text.size() - 5);
  UlogText later = sensors();
  const std::size_t before = later.text.size();
  later.data(7, sensor(9000, 8, 9));
  std::string flags(40, '\0');
  flags[8] = 1;
  const std::string offset = bytes(std::uint64_t{half.size()});
  flags.replace(16, 8, offset);
  std::string text = half + later.text.substr(before);
  text.replace(19, 40, flags);
  EXPECT_EQ(*read(text).find("sensor")->column("gyro[0]"), (std::vector<double>{8}));
}

TEST(Ulog, RefusesWhatIsNone) {
  EXPECT_EQ(test::refusal([] { read("ULog of old"); }), "f.ulg: is no ULog; accepted: a file that begins as one");
  std::string flags(40, '\0');
  flags[8] = 2;
  EXPECT_EQ(test::refusal([&] { read(UlogText(flags).text); }),
            "f.ulg: is a ULog of a kind that is newer than this reader; accepted: appended data alone");
}

TEST(Ulog, MarksWhatIsNotMeasured) {
  test::UlogText log;
  log.format("battery_status:uint64_t timestamp;float voltage_v;float current_a;").topic(0, 1, "battery_status");
  for (const float current : {-1.0f, 2.0f})
    log.data(1, test::UlogText::bytes(std::uint64_t{1}) + test::UlogText::bytes(7.5f) + test::UlogText::bytes(current));
  Channels channels;
  std::vector<std::string> warnings;
  read_ulog(log.text, "log", channels, warnings);
  const auto& current = *channels.find("battery_status")->column("current_a");
  EXPECT_TRUE(is_not_measured(current[0]));
  EXPECT_EQ(current[1], 2);
}

}  // namespace
}  // namespace flappy::flightlog::ulog_test
