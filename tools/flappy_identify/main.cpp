// flappy-identify: fits a vehicle to measurements, and validates it.
#include "io/program.hpp"
#include "transitions.hpp"

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-identify", "Fits a vehicle to measurements, and validates it.", {});
  const auto transitions = identify::add_transitions(program.app());
  program.app().require_subcommand(1);
  return program.run(argc, argv, [&] { program.write_json(transitions()); });
}
