// Several processes that do one piece of work together, and what they hand each other. All of them do the same, but for their share:
// what is gathered is the same on all. Which of them a process is, the launcher says that started them: torchrun (RANK, WORLD_SIZE), Open MPI's mpirun
// (OMPI_COMM_WORLD_RANK, OMPI_COMM_WORLD_SIZE) or Slurm's srun (SLURM_PROCID, SLURM_STEP_NUM_TASKS), in this order.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace flappy::io {

struct Rank {
  int rank = 0, size = 1;
  int local_size = 1;                 ///< ranks on this machine
  std::string address = "127.0.0.1";  ///< where rank 0 runs: MASTER_ADDR
  int port = 29500;                   ///< MASTER_PORT
};

/// Rank 0 of 1 without a launcher. InputError for variables that are missing, no numbers or out of range, and where several machines
/// are to work together but MASTER_ADDR is missing.
Rank this_rank();

/// Whether an address is this machine's own: localhost, 127.x.x.x, ::1.
bool is_loopback(const std::string& address);

/// The exit code of a process that ends because another rank is gone: start again, or resume.
inline constexpr int kRankLost = 75;

class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// Hands all ranks what each of them has, as many bytes from each: `all` is that of rank 0, then that of rank 1 and so on.
  virtual void all_gather(std::span<const std::byte> mine, std::span<std::byte> all) = 0;
  /// What exchanges took so far: seconds in them, waiting for others included, and bytes that came from others.
  struct Costs {
    double seconds = 0, bytes = 0;
  };
  virtual Costs costs() const = 0;
  /// Waits for all ranks.
  void wait();
  /// Whether it is so on any of them.
  bool any(bool here);
  /// Tells the others that this rank ends of a mistake that it has told of: they end, too.
  virtual void leave() = 0;
  /// The last thing that a rank does with the others: whoever is gone before is lost.
  virtual void finish() = 0;

  /// The share of `count` things that is a rank's: from first to last.
  std::pair<std::size_t, std::size_t> share_of(std::size_t count, int rank) const {
    const auto n = static_cast<std::size_t>(size()), r = static_cast<std::size_t>(rank);
    return {count * r / n, count * (r + 1) / n};
  }
  /// Hands all ranks the shares of `count` things of `bytes` each, in place.
  void share(std::byte* things, std::size_t count, std::size_t bytes);
  /// Hands all ranks what each has, of whatever length.
  std::vector<std::vector<std::byte>> gather(std::span<const std::byte> mine);
};

// What a process asks of its ranks, where none stand for itself alone.

/// Whether it is the one that writes what all have found.
inline bool writes(const Ranks* ranks) { return ranks == nullptr || ranks->rank() == 0; }
/// Its share of `count` things: from first to last.
inline std::pair<std::size_t, std::size_t> own_share(const Ranks* ranks, std::size_t count) {
  return ranks == nullptr ? std::pair{std::size_t{0}, count} : ranks->share_of(count, ranks->rank());
}
/// Whether piece `i` of many, which are dealt out in turn, is its.
inline bool is_own(const Ranks* ranks, std::size_t i) {
  return ranks == nullptr || i % static_cast<std::size_t>(ranks->size()) == static_cast<std::size_t>(ranks->rank());
}
inline void wait(Ranks* ranks) {
  if (ranks != nullptr) ranks->wait();
}
inline bool any(Ranks* ranks, bool here) { return ranks == nullptr ? here : ranks->any(here); }

/// Meets the other ranks at the address and one above the port of `rank`: a launcher of its own may serve at the port itself. The
/// rendezvous listens on every interface of rank 0's machine, whatever its address says, with nothing that keeps strangers out.
/// A rank that is not heard of any more ends this process: one line, exit code kRankLost. InputError where the address is
/// not loopback without `allow_network`, a port is in use, rank 0 cannot be reached, this build has no LibTorch, or `agreed` (lines
/// of "what: value") is not the same on all ranks.
std::unique_ptr<Ranks> meet(const Rank& rank, bool allow_network, const std::string& agreed);

/// What the plugin does.
struct RanksFunctions {
  std::unique_ptr<Ranks> (*meet)(const Rank& rank);
};
extern "C" const RanksFunctions flappy_ranks_functions;  ///< all that the plugin exports

}  // namespace flappy::io
