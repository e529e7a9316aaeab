// Replay memory: the last transitions, one row of float each, so that a random sample touches one place in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace flappy::learn {

/// Transitions that an update works on together; a batch is a multiple of it.
inline constexpr std::size_t kChunk = 64;

/// Numbers in the parts of a transition.
struct TransitionShape {
  int observation = 0, action = 0;
};

/// One transition, as seen from outside.
struct Transition {
  const float *observation, *action, *next_observation;
  float reward;    ///< summed over n steps and scaled
  float discount;  ///< gamma^n; 0: the episode terminated, so the next observation does not count
};

/// Where the parts of a transition stand in its row; `row` is the row's length.
struct TransitionLayout {
  explicit TransitionLayout(const TransitionShape& shape);
  std::size_t observation, action, reward, discount, next_observation, row;
};

class Replay {
 public:
  /// Memory for `capacity` transitions, taken at once. std::invalid_argument for a capacity of 0 or above 2^32 - 1, or
  /// parts without numbers.
  Replay(const TransitionShape& shape, std::size_t capacity);

  /// Overwrites the oldest one once the memory is full.
  void add(const Transition& transition);
  /// The same in two steps, for many at once: threads may put different `ahead` (from 0, below `capacity`) at a time, then
  /// one of them advances past all that were put. Nobody may sample meanwhile.
  void put(std::size_t ahead, const Transition& transition);
  void advance(std::size_t count);

  const TransitionShape& shape() const { return shape_; }
  const TransitionLayout& layout() const { return layout_; }
  std::size_t capacity() const { return capacity_; }
  std::size_t size() const { return size_; }      ///< transitions held
  std::size_t cursor() const { return cursor_; }  ///< the row to be written next
  std::size_t bytes() const { return rows_.size() * sizeof(float); }
  const float* row(std::size_t i) const { return &rows_[i * layout_.row]; }

  /// Samples rows `first` to `first + out.size() - 1` of the batch of an update, uniformly among those held: a function of
  /// seed, update, number in the batch, and size alone. `first` is even.
  void sample(std::uint64_t seed, std::uint64_t update, std::size_t first, std::span<std::uint32_t> out) const;

  /// For checkpoints: the rows held, the first size() of all.
  std::span<const float> rows() const { return {rows_.data(), size_ * layout_.row}; }
  /// What was saved; std::invalid_argument where it does not fit this memory.
  void restore(std::span<const float> rows, std::size_t cursor);

 private:
  TransitionShape shape_;
  TransitionLayout layout_;
  std::size_t capacity_, size_ = 0, cursor_ = 0;
  std::vector<float> rows_;
};

}  // namespace flappy::learn
