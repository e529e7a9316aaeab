// The least voltage that carries a vehicle: eighty-one of them stand on the ground, each with a little more amplitude.
#include <cstdio>
#include <exception>

#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: hover VEHICLE.toml\n");
    return 2;
  }
  try {
    const flappy::model::Vehicle vehicle = flappy::model::read_vehicle(argv[1]);
    const auto amplitude_V = [](std::size_t i) { return 6 + 0.1 * static_cast<double>(i); };

    flappy::sim::Batch<float> batch(81, vehicle, {.step_s = 1e-4, .world = {.ground_z_m = 0}});
    for (std::size_t i = 0; i < batch.size(); ++i) {
      batch.reset(i, {}, flappy::sim::Start::standing);
      batch.set_input(i, {.amplitude_V = amplitude_V(i)});
    }
    for (int period = 0; period < 250; ++period) batch.step(8);  // half a second

    std::size_t first = 0;
    while (first < batch.size() && batch.support(first) == flappy::sim::Start::standing) ++first;
    if (first < batch.size()) std::printf("%s lifts off at %.1f V\n", vehicle.name.c_str(), amplitude_V(first));
    else std::printf("%s does not lift off up to %.1f V\n", vehicle.name.c_str(), amplitude_V(first - 1));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
