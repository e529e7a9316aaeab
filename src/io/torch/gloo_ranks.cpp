// Ranks that communicate by Gloo (LibTorch's c10d). A heartbeat in rank 0's key-value store detects lost ranks.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <torch/csrc/distributed/c10d/GlooDeviceFactory.hpp>
#include <torch/csrc/distributed/c10d/PrefixStore.hpp>
#include <torch/csrc/distributed/c10d/ProcessGroupGloo.hpp>
#include <torch/csrc/distributed/c10d/TCPStore.hpp>

#include "io/files.hpp"
#include "io/ranks.hpp"

namespace flappy::io {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kMeeting = 60s;        // longest wait for all ranks to appear
constexpr auto kExchange = 24h * 30;  // a rank may take this long, as long as its heartbeat goes on
constexpr auto kBeat = 500ms;         // period of each rank's heartbeat
constexpr auto kSilence = 15s;        // a rank without heartbeat for this long is lost
constexpr auto kSilenceSuspect = 3s;  //   after an exchange has failed

c10::intrusive_ptr<c10d::TCPStore> store_of(const Rank& rank, bool serves, std::chrono::milliseconds timeout) {
  c10d::TCPStoreOptions options;
  options.port = static_cast<std::uint16_t>(rank.port + 1);
  options.isServer = serves;
  options.waitWorkers = false;
  options.timeout = timeout;
  const std::string place = rank.address + ":" + std::to_string(options.port);
  try {
    return c10::make_intrusive<c10d::TCPStore>(rank.address, options);
  } catch (const std::exception&) {
    throw InputError(serves ? "MASTER_PORT=" + std::to_string(rank.port) +
                                  ": the port above it is in use, or not allowed; "
                                  "accepted: another one"
                            : "rank 0 does not answer at " + place +
                                  "; accepted: MASTER_ADDR and MASTER_PORT as rank 0 has them");
  }
}

class GlooRanks : public Ranks {
 public:
  explicit GlooRanks(const Rank& rank) : rank_(rank), store_(store_of(rank, rank.rank == 0, kMeeting)) {
    std::signal(SIGPIPE, SIG_IGN);  // Gloo writes to sockets whose rank may be dead: that is an error, not the end
    auto options = c10d::ProcessGroupGloo::Options::create(kExchange);
    options->devices.push_back(is_loopback(rank.address) ? c10d::GlooDeviceFactory::makeDeviceForHostname(rank.address)
                                                         : c10d::ProcessGroupGloo::createDefaultDevice());
    options->threads = 1;
    try {
      std::vector<std::string> all;
      for (int r = 0; r < rank.size; ++r) all.push_back("here" + std::to_string(r));
      store_->set(all[static_cast<std::size_t>(rank.rank)], {1});
      store_->wait(all, kMeeting);
      group_ = c10::make_intrusive<c10d::ProcessGroupGloo>(c10::make_intrusive<c10d::PrefixStore>("flappy", store_),
                                                           rank.rank, rank.size, options);
    } catch (const std::exception&) {
      throw InputError("rank " + std::to_string(rank.rank) + ": not all " + std::to_string(rank.size) +
                       " ranks came within a minute; accepted: all of them, with the same MASTER_ADDR and MASTER_PORT");
    }
    heart_ = std::thread([this] { beat(); });
    watch_ = std::thread([this] { watch(); });
  }
  ~GlooRanks() override { stop(); }

  int rank() const override { return rank_.rank; }
  int size() const override { return rank_.size; }

  void all_gather(std::span<const std::byte> mine, std::span<std::byte> all) override {
    const auto tensor = [](const std::byte* at, std::size_t count) {
      return at::from_blob(const_cast<std::byte*>(at), {static_cast<std::int64_t>(count)}, at::kByte);
    };
    std::vector<std::vector<at::Tensor>> out(1);
    for (std::size_t r = 0; r < static_cast<std::size_t>(size()); ++r)
      out[0].push_back(tensor(all.data() + r * mine.size(), mine.size()));
    const auto from = Clock::now();
    std::vector<at::Tensor> in = {tensor(mine.data(), mine.size())};
    try {
      group_->allgather(out, in)->wait();
    } catch (const std::exception& e) {
      suspicious_ = true;  // the heartbeat finds out which rank is lost
      std::this_thread::sleep_for(kSilenceSuspect + 4 * kBeat);
      end("a rank is lost: " + std::string(e.what()).substr(0, std::string(e.what()).find('\n')));
    }
    costs_.seconds += std::chrono::duration<double>(Clock::now() - from).count();
    costs_.bytes += static_cast<double>(all.size() - mine.size());
  }

  Costs costs() const override { return costs_; }

  void leave() override {
    try {
      store_->set("left", word_of(rank()));
    } catch (const std::exception&) {
      return;  // no other rank is left to be told
    }
    std::this_thread::sleep_for(3 * kBeat);  // this process may serve the store, which the others still have to read
  }

  void finish() override {
    wait();
    stop();
    wait();  // serve the store until no heartbeat of any rank needs it
  }

 private:
  void beat() {
    std::vector<std::int64_t> last(static_cast<std::size_t>(size()), 0);
    std::vector<Clock::time_point> changed(last.size(), Clock::now());
    const auto key = [](int r) { return "beat" + std::to_string(r); };
    try {
      const auto store = store_of(rank_, false, kSilence);
      std::unique_lock lock(mutex_);
      while (!wakes_.wait_for(lock, kBeat, [&] { return stops_; })) {
        lock.unlock();  // unlock, because calls of the store never return if the process that serves it stands still
        const auto before = Clock::now();
        if (before - beaten_.load() > 4 * kBeat)
          changed.assign(changed.size(), before);  // this process itself stood still
        store->add(key(rank()), 1);
        for (int r = 0; r < size(); ++r) {
          const auto k = static_cast<std::size_t>(r);
          const std::int64_t now = store->add(key(r), 0);
          // if this call took long, this process or the store stood still, which says nothing about other ranks
          if (now != last[k] || Clock::now() - before > kSilenceSuspect / 2) last[k] = now, changed[k] = Clock::now();
          if (r != rank() &&
              Clock::now() - changed[k] > (suspicious_ ? Clock::duration(kSilenceSuspect) : Clock::duration(kSilence)))
            tell(*store, r);
        }
        for (const char* fate : {"lost", "left"})
          if (store->check({fate})) {
            const std::vector<std::uint8_t> word = store->get(fate);
            const int who = word.at(0) + 256 * word.at(1);
            if (who == rank()) continue;
            if (rank() == 0) std::this_thread::sleep_for(3 * kBeat);  // until the others have read the store
            if (fate == std::string("lost")) lost(who);
            end("rank " + std::to_string(who) + " ended: it says why");
          }
        beaten_ = Clock::now();
        lock.lock();
      }
    } catch (const std::exception&) {
      const std::lock_guard lock(mutex_);
      if (!stops_) lost(0);  // rank 0 serves the store
    }
  }
  static std::vector<std::uint8_t> word_of(int rank) {
    return {static_cast<std::uint8_t>(rank & 255), static_cast<std::uint8_t>(rank >> 8)};
  }
  /// Tells the others which rank is lost, waits for them to read it (rank 0 serves the store), then ends this process.
  [[noreturn]] void tell(c10d::Store& store, int rank) const {
    store.set("lost", word_of(rank));
    std::this_thread::sleep_for(3 * kBeat);
    lost(rank);
  }
  /// Ends the process where the heartbeat no longer advances, because it waits for the store that rank 0 serves.
  void watch() {
    std::unique_lock lock(mutex_);
    for (auto woken = Clock::now(); !wakes_.wait_for(lock, kBeat, [&] { return stops_; }); woken = Clock::now()) {
      if (Clock::now() - woken > 4 * kBeat) beaten_ = Clock::now();  // this process itself stood still
      if (Clock::now() - beaten_.load() > (suspicious_ ? Clock::duration(kSilenceSuspect) : Clock::duration(kSilence)))
        lost(0);
    }
  }
  [[noreturn]] void lost(int rank) const {
    end("rank " + std::to_string(rank) + " of " + std::to_string(size()) +
        " died or hangs: it is not heard of any more; go on: the same command, or --resume, with any number of ranks");
  }
  [[noreturn]] static void end(const std::string& why) {
    std::fprintf(stderr, "%s\n", why.c_str());
    std::fflush(stdout);
    std::_Exit(kRankLost);
  }
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      stops_ = true;
    }
    wakes_.notify_all();
    for (std::thread* thread : {&heart_, &watch_})
      if (thread->joinable()) thread->join();
  }

  const Rank rank_;
  c10::intrusive_ptr<c10d::TCPStore> store_;
  c10::intrusive_ptr<c10d::ProcessGroupGloo> group_;
  Costs costs_;
  std::atomic<bool> suspicious_ = false;
  std::atomic<Clock::time_point> beaten_ = Clock::now();
  bool stops_ = false;
  std::mutex mutex_;
  std::condition_variable wakes_;
  std::thread heart_, watch_;
};

std::unique_ptr<Ranks> meet_by_gloo(const Rank& rank) { return std::make_unique<GlooRanks>(rank); }

}  // namespace

const RanksFunctions flappy_ranks_functions = {meet_by_gloo};

}  // namespace flappy::io
