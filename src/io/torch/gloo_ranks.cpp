// Ranks that talk through Gloo, by LibTorch's c10d.
#include <atomic>
#include <chrono>
#include <condition_variable>
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

constexpr auto kMeeting = 60s;        // until all ranks are there
constexpr auto kExchange = 24h * 30;  // a rank may take as long as it likes, while its heart beats
constexpr auto kBeat = 500ms;         // of each rank's heart
constexpr auto kSilence = 15s;        // after which a rank is lost
constexpr auto kSilenceSuspect = 3s;  //   the same, where an exchange has failed

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
      suspicious_ = true;  // the heart finds out who it is
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
      return;  // nobody is there to be told
    }
    std::this_thread::sleep_for(3 * kBeat);  // as the store may be this process's
  }

  void finish() override {
    wait();
    stop();
    wait();  // the store serves until no heart beats any more
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
        lock.unlock();  // as a store whose process stands still answers nothing, for ever
        const auto before = Clock::now();
        if (before - beaten_.load() > 4 * kBeat)
          changed.assign(changed.size(), before);  // this very process stood still
        store->add(key(rank()), 1);
        for (int r = 0; r < size(); ++r) {
          const auto k = static_cast<std::size_t>(r);
          const std::int64_t now = store->add(key(r), 0);
          // one's own silence, as after a stop of the process, is nobody else's
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
            if (rank() == 0) std::this_thread::sleep_for(3 * kBeat);  // until the others have read it, too
            if (fate == std::string("lost")) lost(who);
            end("rank " + std::to_string(who) + " ended: it says why");
          }
        beaten_ = Clock::now();
        lock.lock();
      }
    } catch (const std::exception&) {
      const std::lock_guard lock(mutex_);
      if (!stops_) lost(0);  // which serves the store
    }
  }
  static std::vector<std::uint8_t> word_of(int rank) {
    return {static_cast<std::uint8_t>(rank & 255), static_cast<std::uint8_t>(rank >> 8)};
  }
  /// Before this process is lost itself, and rank 0 with the store.
  [[noreturn]] void tell(c10d::Store& store, int rank) const {
    store.set("lost", word_of(rank));
    std::this_thread::sleep_for(3 * kBeat);
    lost(rank);
  }
  /// Whether the heart goes on: it waits for the store that rank 0 serves.
  void watch() {
    std::unique_lock lock(mutex_);
    for (auto woken = Clock::now(); !wakes_.wait_for(lock, kBeat, [&] { return stops_; }); woken = Clock::now()) {
      if (Clock::now() - woken > 4 * kBeat) beaten_ = Clock::now();  // this very process stood still
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
