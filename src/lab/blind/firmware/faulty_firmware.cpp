#include "lab/blind/firmware/faulty_firmware.hpp"

#include <algorithm>
#include <sstream>
#include <system_error>

#include "io/files.hpp"
#include "io/run_program.hpp"
#include "io/shared_library.hpp"
#include "io/temporary_folder.hpp"
#include "lab/blind/firmware/embedded_firmware.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;

/// Names behind firmware_ in the enumeration of firmware.h.
std::vector<std::string> names_in(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream lines(text.substr(text.find("enum {")));
  for (std::string line; std::getline(lines, line) && !line.starts_with("};");)
    if (line.starts_with("  firmware_")) names.push_back(line.substr(11, line.find_first_of(",", 11) - 11));
  return names;
}

io::SharedLibrary compiled(const fs::path& exported, const std::string& mistake) {
  const io::TemporaryFolder work;
  const fs::path source = work / "firmware.c", library = work / "firmware.so";
  const fs::path policy = exported / (mistake == "int8" ? "flappy_policy_int8.h" : "flappy_policy.h");
  for (const fs::path& header : {policy, exported / "flappy_controller.h"})
    if (!fs::exists(header))
      throw io::InputError(header.string() + ": is not there; accepted: a folder that flappy-export wrote" +
                           (mistake == "int8" ? " with --int8" : ""));
  io::write_atomically(source, "#include \"" + fs::absolute(policy).string() + "\"\n#include \"" +
                                   fs::absolute(exported / "flappy_controller.h").string() + "\"\n" +
                                   std::string(kFirmware.at("firmware.h")));
  const bool contracted = mistake == "contracted";
  std::vector<std::string> command = {contracted ? "clang" : "cc", "-O2", "-shared", "-fPIC",
                                      "-DFIRMWARE_MISTAKE=firmware_" + mistake};
  if (contracted) command.insert(command.end(), {"-ffp-contract=fast", "-march=native"});
  command.insert(command.end(), {source.string(), "-o", library.string(), "-lm"});
  try {
    if (const io::Finished done = io::run(command); done.exit_code != 0)
      throw io::InputError(exported.string() + ": does not compile: " + done.err.substr(0, done.err.find('\n')) +
                           "; accepted: headers that flappy-export wrote");
  } catch (const std::system_error& e) {
    throw io::InputError(command.front() + ": " + e.code().message() + "; accepted: a compiler of this name in PATH");
  }
  try {
    return io::SharedLibrary(library);
  } catch (const std::runtime_error& e) {
    throw io::InputError(exported.string() + ": cannot be loaded: " + e.what() +
                         "; accepted: headers for this processor");
  }
}

class Firmware final : public OnBoard {
 public:
  Firmware(const fs::path& exported, const std::string& mistake, const FirmwareSensors& sensors, double begin_s)
      : sensors_(sensors), begin_s_(begin_s), library_(compiled(exported, mistake)) {
    const auto take = [&]<class F>(F*& to, const char* name) { to = library_.function<F>(name); };
    take(start_, "firmware_start");
    take(go_, "firmware_go");
    take(imu_, "firmware_take_imu");
    take(pose_, "firmware_take_pose");
    take(volts_, "firmware_volts");
  }

  void start(double now_s, const Pose& pose) override {
    start_s_ = now_s;
    went_ = false;
    start_(1e6 * now_s, pose.data());
  }
  void imu(double arrived_s, const std::array<double, 3>& rate, const std::array<double, 3>& force) override {
    imu_(1e6 * (arrived_s - sensors_.imu_latency_s), rate.data(), force.data());
  }
  void pose(double arrived_s, const Pose& pose) override {
    pose_(1e6 * (arrived_s - sensors_.mocap_latency_s), pose.data());
  }
  std::array<double, 2> volts(double now_s) override {
    if (!went_ && now_s > start_s_ + begin_s_ - 1e-6) {
      go_();
      went_ = true;
    }
    std::array<double, 2> volts{};
    volts_(1e6 * now_s, volts.data());
    return volts;
  }

 private:
  const FirmwareSensors sensors_;
  const double begin_s_;
  const io::SharedLibrary library_;
  double start_s_ = 0;
  bool went_ = false;
  void (*start_)(double, const double*);
  void (*go_)();
  void (*imu_)(double, const double*, const double*);
  void (*pose_)(double, const double*);
  void (*volts_)(double, double*);
};

class Silent final : public OnBoard {
 public:
  void start(double, const Pose&) override {}
  void imu(double, const std::array<double, 3>&, const std::array<double, 3>&) override {}
  void pose(double, const Pose&) override {}
  std::array<double, 2> volts(double) override { return {0, 0}; }
};

}  // namespace

std::unique_ptr<OnBoard> silent_firmware() { return std::make_unique<Silent>(); }

const std::vector<std::string>& firmware_mistakes() {
  static const std::vector<std::string> names = names_in(std::string(kFirmware.at("firmware.h")));
  return names;
}

std::unique_ptr<OnBoard> make_firmware(const fs::path& exported, const std::string& mistake,
                                       const FirmwareSensors& sensors, double begin_s) {
  if (std::ranges::count(firmware_mistakes(), mistake) == 0)
    throw io::InputError("--firmware " + mistake + ": no such mistake; accepted: " + io::joined(firmware_mistakes()) +
                         io::did_you_mean(mistake, firmware_mistakes()));
  return std::make_unique<Firmware>(exported, mistake, sensors, begin_s);
}

}  // namespace flappy::blind
