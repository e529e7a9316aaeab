// Replay memory of the newest transitions. Each is one row of floats, so that a sample reads one place in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace flappy::learn {

/// Number of transitions that an update processes together; the size of a batch is a multiple of it.
inline constexpr std::size_t kChunk = 64;

struct TransitionShape {
  int observation = 0, action = 0;  ///< numbers of elements
};

struct Transition {
  const float *observation, *action, *next_observation;
  float reward;    ///< scaled, discounted sum over n steps
  float discount;  ///< gamma^n; 0 if the episode terminated, so that the next observation has no weight
};

/// Offsets of the parts of a transition in its row, and the row's length `row`, in floats.
struct TransitionLayout {
  explicit TransitionLayout(const TransitionShape& shape);
  std::size_t observation, action, reward, discount, next_observation, row;
};

class Replay {
 public:
  /// Allocates all memory at once. Throws std::invalid_argument for a capacity of 0 or above 2^32 - 1, or for an
  /// observation or action without elements.
  Replay(const TransitionShape& shape, std::size_t capacity);

  /// Adds a transition. When the memory is full, it replaces the oldest one.
  void add(const Transition& transition);
  /// add() in two steps, for several threads. Each calls put(), which writes the row `ahead` rows after cursor(), with
  /// a number of its own, 0 <= ahead < capacity. Then one thread calls advance(count) with the number of rows written.
  /// No thread may sample in between.
  void put(std::size_t ahead, const Transition& transition);
  void advance(std::size_t count);

  const TransitionShape& shape() const { return shape_; }
  const TransitionLayout& layout() const { return layout_; }
  std::size_t capacity() const { return capacity_; }
  std::size_t size() const { return size_; }      ///< transitions held
  std::size_t cursor() const { return cursor_; }  ///< row that is written next
  std::size_t bytes() const { return rows_.size() * sizeof(float); }
  const float* row(std::size_t i) const { return &rows_[i * layout_.row]; }

  /// Draws the row numbers of members `first` to `first + out.size() - 1` of an update's batch into `out`, uniformly
  /// from the rows held, with replacement. `first` is even, because numbers are drawn in pairs. A member's row depends
  /// only on seed, update, its position in the batch, and size().
  void sample(std::uint64_t seed, std::uint64_t update, std::size_t first, std::span<std::uint32_t> out) const;

  /// The rows held, for checkpoints.
  std::span<const float> rows() const { return {rows_.data(), size_ * layout_.row}; }
  /// Restores saved rows and cursor. Throws std::invalid_argument if the length of `rows` or the cursor is impossible
  /// for this shape and capacity.
  void restore(std::span<const float> rows, std::size_t cursor);

 private:
  TransitionShape shape_;
  TransitionLayout layout_;
  std::size_t capacity_, size_ = 0, cursor_ = 0;
  std::vector<float> rows_;
};

}  // namespace flappy::learn
