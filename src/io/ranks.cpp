#include "io/ranks.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "io/files.hpp"
#include "io/plugin.hpp"

namespace flappy::io {
namespace {

std::optional<std::string> variable(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? std::nullopt : std::optional<std::string>(text);
}

int number(const char* name, int low, int high) {
  const auto text = variable(name);
  const std::string accepted = "; accepted: a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  if (!text) throw InputError(std::string(name) + ": is missing" + accepted);
  int value = 0;
  const auto read = std::from_chars(text->data(), text->data() + text->size(), value);
  if (read.ec != std::errc{} || read.ptr != text->data() + text->size() || value < low || value > high)
    throw InputError(std::string(name) + "=" + *text + accepted);
  return value;
}

/// The environment variables of one launcher; `local`: number of ranks on this machine.
struct Launcher {
  const char *rank, *size, *local;
};
constexpr Launcher kLaunchers[] = {
    {"RANK", "WORLD_SIZE", "LOCAL_WORLD_SIZE"},
    {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE"},
    // not SLURM_NTASKS, which is also set in a batch script, where there is only one process
    {"SLURM_PROCID", "SLURM_STEP_NUM_TASKS", "SLURM_STEP_TASKS_PER_NODE"},
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

bool is_loopback(const std::string& address) {
  return address == "localhost" || address.starts_with("127.") || address == "::1";
}

Rank this_rank() {
  for (const Launcher& l : kLaunchers) {
    const bool of_slurm = std::string(l.rank) == "SLURM_PROCID";
    if (!variable(l.size) && (of_slurm || !variable(l.rank))) continue;
    Rank r;
    r.size = number(l.size, 1, 65536);
    r.rank = number(l.rank, 0, r.size - 1);
    if (r.size == 1) return r;
    const auto local = variable(l.local);
    // Slurm's form "2(x3),1" lists the ranks on each machine; we take the first number for this machine
    r.local_size = local ? std::max(1, std::atoi(local->c_str())) : 1;
    const auto address = variable("MASTER_ADDR");
    if (address) r.address = *address;
    else if (r.local_size < r.size)
      throw InputError("MASTER_ADDR: is missing, and ranks run on several machines; accepted: the address of rank 0");
    if (variable("MASTER_PORT")) r.port = number("MASTER_PORT", 1, 65534);
    return r;
  }
  return {};
}

void Ranks::wait() { any(false); }

bool Ranks::any(bool here) {
  const std::byte mine{here};
  std::vector<std::byte> all(static_cast<std::size_t>(size()));
  all_gather({&mine, 1}, all);
  return std::ranges::any_of(all, [](std::byte b) { return b != std::byte{0}; });
}

void Ranks::share(std::byte* things, std::size_t count, std::size_t bytes) {
  std::size_t most = 0;
  for (int r = 0; r < size(); ++r) most = std::max(most, share_of(count, r).second - share_of(count, r).first);
  std::vector<std::byte> mine(most * bytes), all(mine.size() * static_cast<std::size_t>(size()));
  const auto [first, last] = share_of(count, rank());
  std::copy(things + first * bytes, things + last * bytes, mine.begin());
  all_gather(mine, all);
  for (int r = 0; r < size(); ++r) {
    const auto [from, to] = share_of(count, r);
    if (r != rank())
      std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(r) * mine.size()),
                  (to - from) * bytes, things + from * bytes);
  }
}

std::vector<std::vector<std::byte>> Ranks::gather(std::span<const std::byte> mine) {
  const auto n = static_cast<std::size_t>(size());
  std::vector<std::uint64_t> sizes(n);
  const std::uint64_t own = mine.size();
  all_gather(std::as_bytes(std::span(&own, 1)), std::as_writable_bytes(std::span(sizes)));
  const std::size_t most = *std::ranges::max_element(sizes);
  std::vector<std::byte> padded(most), all(most * n);
  std::ranges::copy(mine, padded.begin());
  if (most > 0) all_gather(padded, all);
  std::vector<std::vector<std::byte>> parts;
  for (std::size_t r = 0; r < n; ++r) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(r * most);
    parts.emplace_back(from, from + static_cast<std::ptrdiff_t>(sizes[r]));
  }
  return parts;
}

std::unique_ptr<Ranks> meet(const Rank& rank, bool allow_network, const std::string& agreed) {
  if (!is_loopback(rank.address) && !allow_network)
    throw InputError(
        "MASTER_ADDR=" + rank.address +
        ": is not this machine alone, and the rendezvous listens on every interface, to anybody; accepted: "
        "127.0.0.1, or --allow-network");
  // silence LibTorch's messages about failures that we report in one line
  setenv("GLOG_minloglevel", "4", 0);
  setenv("TORCH_CPP_LOG_LEVEL", "FATAL", 0);
  static const auto* const functions =
      plugin<RanksFunctions>("ranks", "flappy_ranks_functions",
                             "several ranks need LibTorch with Gloo (libtorch-dev, libgloo-dev), which this build has "
                             "not; accepted: one rank, or the package flappy-torch");
  std::unique_ptr<Ranks> ranks = functions->meet(rank);
  const auto all = ranks->gather(std::as_bytes(std::span(agreed)));
  const auto text = [&](std::size_t r) {
    return std::string(reinterpret_cast<const char*>(all[r].data()), all[r].size());
  };
  const std::vector<std::string> own = lines_of(text(0));
  for (std::size_t r = 1; r < all.size(); ++r) {
    const std::vector<std::string> other = lines_of(text(r));
    for (std::size_t k = 0; k < own.size(); ++k)
      if (k >= other.size() || other[k] != own[k])
        throw InputError("rank " + std::to_string(r) + " has " + (k < other.size() ? other[k] : "nothing") +
                         ", rank 0 has " + own[k] + "; accepted: the same on all ranks");
  }
  return ranks;
}

}  // namespace flappy::io
