// Ranks: processes that do one piece of work jointly: the same code on different shares; an exchange gives all the same
// data. The launcher tells a process its rank: torchrun (RANK, WORLD_SIZE), Open MPI's mpirun (OMPI_COMM_WORLD_RANK,
// OMPI_COMM_WORLD_SIZE) or Slurm's srun (SLURM_PROCID, SLURM_STEP_NUM_TASKS), tried in this order.
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

/// The rank of this process; rank 0 of 1 without a launcher. Throws InputError for variables that are missing, not
/// numbers or out of range, and where MASTER_ADDR is missing although the ranks run on several machines.
Rank this_rank();

bool is_loopback(const std::string& address);  ///< localhost, 127.x.x.x, ::1

/// Exit code of a process that ends because another rank is lost. Start the program again, or resume it.
inline constexpr int kRankLost = 75;

class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// Gathers equally many bytes of each rank on all ranks: `all` has the bytes of rank 0, then of rank 1 and so on.
  virtual void all_gather(std::span<const std::byte> mine, std::span<std::byte> all) = 0;
  /// Total cost of the exchanges so far: seconds, including waiting for other ranks, and bytes received from them.
  struct Costs {
    double seconds = 0, bytes = 0;
  };
  virtual Costs costs() const = 0;
  void wait();          ///< until all ranks have called it
  bool any(bool here);  ///< whether it is true on any rank
  /// Tells the other ranks that this one ends with an error, which it has reported; they end, too.
  virtual void leave() = 0;
  /// Every rank calls it last: a rank that ends without it counts as lost.
  virtual void finish() = 0;

  /// The items of `count` that belong to a rank: from first to before last.
  std::pair<std::size_t, std::size_t> share_of(std::size_t count, int rank) const {
    const auto n = static_cast<std::size_t>(size()), r = static_cast<std::size_t>(rank);
    return {count * r / n, count * (r + 1) / n};
  }
  /// Exchanges the shares of `count` items of `bytes` each, so that all ranks have all items, in place.
  void share(std::byte* things, std::size_t count, std::size_t bytes);
  /// Gathers the bytes of all ranks, of any length, on all ranks: [rank].
  std::vector<std::vector<std::byte>> gather(std::span<const std::byte> mine);
};

// For a pointer to ranks, where null means a single process.

/// Whether this process writes the common results.
inline bool writes(const Ranks* ranks) { return ranks == nullptr || ranks->rank() == 0; }
/// The items of `count` that belong to this process: from first to before last.
inline std::pair<std::size_t, std::size_t> own_share(const Ranks* ranks, std::size_t count) {
  return ranks == nullptr ? std::pair{std::size_t{0}, count} : ranks->share_of(count, ranks->rank());
}
/// Whether piece `i`, of pieces that are dealt out to the ranks in turn, belongs to this process.
inline bool is_own(const Ranks* ranks, std::size_t i) {
  return ranks == nullptr || i % static_cast<std::size_t>(ranks->size()) == static_cast<std::size_t>(ranks->rank());
}
inline void wait(Ranks* ranks) {
  if (ranks != nullptr) ranks->wait();
}
inline bool any(Ranks* ranks, bool here) { return ranks == nullptr ? here : ranks->any(here); }

/// Meets the other ranks at rank.address and port rank.port + 1, because the launcher may use the port itself. Rank 0
/// listens on every interface and authenticates nobody. When a rank is lost later, this process ends with one line and
/// exit code kRankLost. Throws InputError where the address is not loopback without `allow_network`, a port is in use,
/// rank 0 cannot be reached, this build has no LibTorch, or `agreed` (lines of "what: value") differs.
std::unique_ptr<Ranks> meet(const Rank& rank, bool allow_network, const std::string& agreed);

struct RanksFunctions {
  std::unique_ptr<Ranks> (*meet)(const Rank& rank);
};
extern "C" const RanksFunctions flappy_ranks_functions;  ///< the plugin's only export

}  // namespace flappy::io
