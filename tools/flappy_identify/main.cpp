// flappy-identify: fits a vehicle to measurements, and reports the agreement of model and measurements.
#include "command.hpp"
#include "io/program.hpp"

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-identify", "Fits a vehicle to measurements, and compares it with them.", {});
  const std::vector<identify::Command> commands = {
      identify::add_forces(program.app()),     identify::add_simulate_forces(program.app()),
      identify::add_calibrate(program),        identify::add_compare_map(program.app()),
      identify::add_kinematics(program.app()), identify::add_transitions(program.app()),
      identify::add_gait(program.app())};
  program.app().expect_commands(1, 1);
  program.takes_ranks();
  return program.run(argc, argv, [&] {
    for (const identify::Command& command : commands)
      if (command.app.given())
        command.shown ? program.write_shown_json(command.run()) : program.write_json(command.run());
  });
}
