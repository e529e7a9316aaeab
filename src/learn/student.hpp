// One policy for many robots. Teachers learn by TD3, each for robots with one effect of those that the configuration draws;
// a student then imitates them all on its own flights, as in DAgger (Ross, Gordon, Bagnell 2011, arXiv 1011.0686) and
// RAPTOR (Eschmann, Albani, Loianno 2025, arXiv 2509.11481), which has a teacher for each robot. With a memory the student
// can tell robots apart by how they fly. Beside what every run writes (trainer.hpp):
//
//   RUN/ancestor/                    run of TD3 on all robots, from which each teacher learns on; with TrainOptions::init
//                                    a copy of its actor and its checkpoint
//   RUN/teachers/EFFECT.json         actor of a teacher
//   RUN/teachers/EFFECT_gain.json    {"before": b, "after": a}: success of the ancestor and of the teacher
//
// A robot with several effects is taught by the teacher with the largest gain, a robot without effects by the ancestor. A
// run that goes on keeps its ancestor and its finished teachers; its student begins anew.
#pragma once

#include "learn/trainer.hpp"

namespace flappy::learn {

/// Number of the student's first robot: none of them is flown in evaluations, or by ancestor and teachers.
inline constexpr std::uint32_t kStudentFlappers = std::uint32_t{1} << 29;

/// The summary and the records are of the student alone; its updates are steps of Adam. Teachers are shared out to the
/// ranks, which see one folder. Throws io::InputError as train() does, for a damaged file of a teacher, and where ranks
/// have no common folder.
TrainSummary train_student(const TrainConfig& config, const TrainOptions& options);

}  // namespace flappy::learn
