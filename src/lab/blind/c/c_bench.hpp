// Family C's bench: the torso stands clamped in mid-room, 1 m above the ground and as far below the ceiling and from the
// wall. The plate of the stand is 0.3 m below the torso: over four wing lengths, where the ground effect has ended.
// In the log W is B, so the room is told from the torso.
#pragma once

#include "lab/blind/c/c_bench_programme.hpp"
#include "lab/blind/c/c_rig.hpp"
#include "lab/blind/c/c_sensors.hpp"

namespace flappy::blind::c {

/// Runs 0 to 2. The wings rest for a second before the log, in which the sensor is zeroed. `until_s` cuts the run short.
FamilyFlight run_on_bench(const Assignment& a, std::size_t run, double until_s = 1e3);

}  // namespace flappy::blind::c
