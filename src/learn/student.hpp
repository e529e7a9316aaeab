// One policy for many robots. Teachers learn by TD3, each for one robot that the configuration draws; a student then
// imitates them all on its own flights, as in DAgger (Ross, Gordon, Bagnell 2011, arXiv 1011.0686) and RAPTOR (Eschmann,
// Albani, Loianno 2025, arXiv 2509.11481). With a memory it can tell the robots apart by how they fly. Beside what every
// run writes (trainer.hpp):
//
//   RUN/ancestor/        run of TD3 on all robots, from which each teacher learns on; with TrainOptions::init there is none
//   RUN/teachers/N.json  actor of teacher N
//
// What is there already when the run starts again is not learnt again; the student begins anew.
#pragma once

#include "learn/trainer.hpp"

namespace flappy::learn {

/// Number of the first robot that has a teacher; it is flown neither in evaluations nor by the ancestor.
inline constexpr std::uint32_t kTeacherFlappers = std::uint32_t{1} << 29;

/// The summary and the records are of the student alone; its updates are steps of Adam. Teachers are shared out to the ranks, which
/// see one folder. Throws io::InputError as train() does, and where ranks have no common folder.
TrainSummary train_student(const TrainConfig& config, const TrainOptions& options);

}  // namespace flappy::learn
