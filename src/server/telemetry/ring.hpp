// A lock-free queue from one producer thread, which must not wait, to one consumer thread. Drops and counts the excess.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace flappy::server {

template <class T, std::size_t kSize>  // kSize: a power of 2
class Ring {
 public:
  /// For the producer only. Returns false, and counts the item as dropped, where the ring is full.
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
  /// For the consumer only. Takes the oldest item; false where the ring is empty.
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
  std::uint64_t seen_tail_ = 0;  // the producer's copy of tail_, refreshed only when the ring looks full
  std::atomic<std::uint64_t> dropped_ = 0;
  alignas(64) std::atomic<std::uint64_t> tail_ = 0;
};

}  // namespace flappy::server
