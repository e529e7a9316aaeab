// From one thread that must not wait to one that may: what does not fit is dropped and counted.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace flappy::server {

/// kSize: a power of 2.
template <class T, std::size_t kSize>
class Ring {
 public:
  /// Of one thread. False where there was no room.
  bool push(const T& item) {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - seen_tail_ >= kSize) {
      seen_tail_ = tail_.load(std::memory_order_acquire);
      if (head - seen_tail_ >= kSize) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return false;
      }
    }
    (*items_)[head % kSize] = item;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Of one other thread: the oldest, or nothing.
  bool pop(T& to) {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    to = (*items_)[tail % kSize];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::unique_ptr<std::array<T, kSize>> items_ = std::make_unique<std::array<T, kSize>>();
  alignas(64) std::atomic<std::uint64_t> head_ = 0;
  std::uint64_t seen_tail_ = 0;  // of who pushes
  std::atomic<std::uint64_t> dropped_ = 0;
  alignas(64) std::atomic<std::uint64_t> tail_ = 0;
};

}  // namespace flappy::server
