#include <gtest/gtest.h>

#include "flightlog/check/check.hpp"
#include "flightlog/check/data_faults.hpp"
#include "flightlog/check/inputs_log.hpp"

namespace flappy::flightlog {
namespace {

const Finding& of_input(const CheckReport& report, const std::string& input) {
  return *std::ranges::find(report.findings, "input " + input, &Finding::check);
}

/// Flights of one robot, cheap: inputs are what differs.
std::vector<FlightLog> flights(std::size_t count) {
  const FlightLog one = inputs_log({.duration_s = 3});
  std::vector<FlightLog> logs(count, one);
  for (std::size_t i = 0; i < count; ++i)
    for (double& v : logs[i].command.declared[0]) v *= 1 + 0.1 * static_cast<double>(i);  // the battery
  return logs;
}

TEST(CheckInputs, FindNothingInFlightsThatAreAlike) {
  for (const CheckReport& report : check_flights(flights(4))) {
    EXPECT_EQ(of_input(report, "motor").verdict, Verdict::ok) << of_input(report, "motor").text;
    EXPECT_EQ(of_input(report, "servo").verdict, Verdict::ok) << of_input(report, "servo").text;
  }
}

TEST(CheckInputs, AskNothingOfMotorsWhoseVoltageIsUnknown) {
  FlightLog log = inputs_log({.duration_s = 3});
  log.header.power->currents = true, log.header.power->current_noise_A = 0.03;
  log.power->left_current_A = log.power->right_current_A = Column(log.power->t_s.size(), 0.3);
  for (const Finding& f : check_flight(log).findings) EXPECT_NE(f.check, "left motor");
}

TEST(CheckInputs, RefuseASpoiltColumn) {
  std::vector<FlightLog> logs = flights(4);
  for (double& v : logs[2].command.declared[0]) v *= 1.9;
  const std::vector<CheckReport> reports = check_flights(logs);
  EXPECT_EQ(of_input(reports[2], "motor").verdict, Verdict::warning);
  EXPECT_NE(of_input(reports[2], "motor").text.find("usual in these flights"), std::string::npos);
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(of_input(reports[i], "motor").verdict, Verdict::ok);
  const std::vector<DataFault> faults = data_faults(logs, {"a", "b", "c", "d"});
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].file, "c/command.csv");
  // Alone it looks like any other.
  EXPECT_TRUE(data_faults(logs[2], "c").empty());
}

TEST(CheckInputs, RefuseASpoiltColumnThatHasNoLevel) {
  std::vector<FlightLog> logs = flights(3);
  for (double& v : logs[0].command.declared[1]) v *= 57.3;
  const std::vector<CheckReport> reports = check_flights(logs);
  EXPECT_EQ(of_input(reports[0], "servo").fault.file, "command.csv");
  EXPECT_NE(of_input(reports[0], "servo").text.find("varies by"), std::string::npos);
  EXPECT_EQ(of_input(reports[1], "servo").verdict, Verdict::ok);
}

/// Which of two is right nobody knows.
TEST(CheckInputs, BlameNeitherOfTwo) {
  std::vector<FlightLog> logs = flights(2);
  for (double& v : logs[1].command.declared[0]) v *= 65535;
  const std::vector<CheckReport> reports = check_flights(logs);
  for (const CheckReport& report : reports) EXPECT_EQ(of_input(report, "motor").verdict, Verdict::warning);
  EXPECT_TRUE(data_faults(logs, {"a", "b"}).empty());
}

TEST(CheckInputs, CompareWhatHasTheSameInputs) {
  std::vector<FlightLog> logs = flights(4);
  logs[3].header.inputs = {"engine", "servo"};
  for (double& v : logs[3].command.declared[0]) v *= 65535;
  logs.push_back(synthetic_log({.duration_s = 3}));
  const std::vector<CheckReport> reports = check_flights(logs);
  ASSERT_EQ(reports.size(), 5u);
  EXPECT_EQ(of_input(reports[3], "engine").verdict, Verdict::ok);
  EXPECT_EQ(of_input(reports[0], "motor").verdict, Verdict::ok);
}

TEST(CheckInputs, FindColumnsThatAreSwapped) {
  // A second motor goes with the first; in one flight its column and the servo's have changed places, at the same level.
  std::vector<FlightLog> logs = flights(3);
  for (FlightLog& log : logs) {
    log.header.inputs.emplace_back("other_motor");
    log.command.declared.push_back(log.command.declared[0]);
    for (double& v : log.command.declared[1]) v += 0.6;
  }
  std::swap(logs[1].command.declared[1], logs[1].command.declared[2]);
  const std::vector<CheckReport> reports = check_flights(logs);
  EXPECT_EQ(of_input(reports[1], "other_motor").text.substr(0, 25), "goes along with motor by ");
  EXPECT_EQ(of_input(reports[1], "other_motor").verdict, Verdict::warning);
  for (const std::size_t i : {0u, 2u})
    for (const char* input : {"motor", "servo", "other_motor"})
      EXPECT_EQ(of_input(reports[i], input).verdict, Verdict::ok) << of_input(reports[i], input).text;
  EXPECT_TRUE(data_faults(logs, {"a", "b", "c"}).empty());  // a suspicion
}

TEST(CheckInputs, FindAScaleThatChangesInAFlight) {
  std::vector<FlightLog> logs = flights(1);
  Column& motor = logs[0].command.declared[0];
  for (std::size_t i = motor.size() * 7 / 10; i < motor.size(); ++i) motor[i] *= 100;
  const CheckReport report = check_flight(logs[0]);
  EXPECT_NE(of_input(report, "motor").text.find("in part 8 of 10 of the flight: its scale changes"), std::string::npos)
      << of_input(report, "motor").text;
  EXPECT_EQ(data_faults(logs[0], report, "a").size(), 1u);
}

TEST(CheckInputs, FindACounterThatMissesPulses) {
  FlightLog log = inputs_log();
  Column& motor = log.command.declared[0];
  for (std::size_t i = 20; i < 26; i += 2) motor[i] *= 0.5;
  EXPECT_EQ(of_input(check_flight(log), "motor").text.substr(0, 60),
            "drops for one sample to 0 (0 times) or half (3 times): a cou");
  EXPECT_TRUE(data_faults(log, "a").empty());
  for (std::size_t i = 30; i + 20 < motor.size(); i += 30) motor[i] = 0;
  EXPECT_EQ(data_faults(log, "a").size(), 1u) << "one in thirty";
  // a command that goes to 0 and stays there does not drop for one sample
  log = inputs_log();
  for (std::size_t i = 100; i < 105; ++i) log.command.declared[0][i] = 0;
  EXPECT_EQ(of_input(check_flight(log), "motor").verdict, Verdict::ok);
}

TEST(CheckInputs, FindADeadColumn) {
  std::vector<FlightLog> logs = flights(3);
  for (double& v : logs[1].command.declared[1]) v = 0.25;
  const std::vector<CheckReport> reports = check_flights(logs);
  EXPECT_EQ(of_input(reports[1], "servo").text.substr(0, 17), "is 0.25 all the t");
  EXPECT_EQ(of_input(reports[0], "servo").verdict, Verdict::ok);
}

// With the robot's own estimate nothing is compared, and check says so.
TEST(CheckInputs, AnEstimateIsNoSecondOpinion) {
  FlightLog log = inputs_log();
  log.header.mocap.source = PoseSource::estimate;
  const auto findings_of = [&] {
    std::vector<std::string> names;
    for (const Finding& f : check_flight(log).findings) names.push_back(f.check);
    return names;
  };
  EXPECT_EQ(std::ranges::count(findings_of(), "estimate"), 1);
  EXPECT_EQ(std::ranges::count(findings_of(), "axes"), 0);
  log.header.mocap.source = PoseSource::motion_capture;
  EXPECT_EQ(std::ranges::count(findings_of(), "estimate"), 0);
  EXPECT_EQ(std::ranges::count(findings_of(), "axes"), 1);
}

}  // namespace
}  // namespace flappy::flightlog
