#include "learn/replay_buffer.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "sim/random.hpp"

namespace flappy::learn {

TransitionLayout::TransitionLayout(const TransitionShape& shape) {
  observation = 0;
  action = static_cast<std::size_t>(shape.observation);
  reward = action + static_cast<std::size_t>(shape.action);
  discount = reward + 1;
  next_observation = discount + 1;
  row = next_observation + static_cast<std::size_t>(shape.observation);
}

Replay::Replay(const TransitionShape& shape, std::size_t capacity)
    : shape_(shape), layout_(shape), capacity_(capacity) {
  if (shape.observation < 1 || shape.action < 1)
    throw std::invalid_argument("a transition needs an observation and an action");
  if (capacity < 1 || capacity > std::numeric_limits<std::uint32_t>::max())
    throw std::invalid_argument("a replay memory holds 1 to 2^32 - 1 transitions");
  rows_.resize(capacity * layout_.row);
}

void Replay::put(std::size_t ahead, const Transition& t) {
  float* row = &rows_[(cursor_ + ahead) % capacity_ * layout_.row];
  const auto copy = [&](std::size_t to, const float* from, int count) { std::copy_n(from, count, row + to); };
  copy(layout_.observation, t.observation, shape_.observation);
  copy(layout_.action, t.action, shape_.action);
  copy(layout_.next_observation, t.next_observation, shape_.observation);
  row[layout_.reward] = t.reward;
  row[layout_.discount] = t.discount;
}

void Replay::advance(std::size_t count) {
  cursor_ = (cursor_ + count) % capacity_;
  size_ = std::min(capacity_, size_ + count);
}

void Replay::add(const Transition& transition) {
  put(0, transition);
  advance(1);
}

void Replay::sample(std::uint64_t seed, std::uint64_t update, std::size_t first, std::span<std::uint32_t> out) const {
  const sim::RandomKey key{seed, static_cast<std::uint32_t>(update), static_cast<std::uint32_t>(update >> 32),
                           sim::Stream::replay};
  const auto place = [&](double u) {
    const auto i = static_cast<std::size_t>(u * static_cast<double>(size_));
    return static_cast<std::uint32_t>(std::min(i, size_ - 1));
  };
  for (std::size_t k = 0; k < out.size(); k += 2) {
    const sim::UniformPair u = sim::uniform_pair(key, static_cast<std::uint32_t>((first + k) / 2));
    out[k] = place(u.first);
    if (k + 1 < out.size()) out[k + 1] = place(u.second);
  }
}

void Replay::restore(std::span<const float> rows, std::size_t cursor) {
  const std::size_t size = rows.size() / layout_.row;
  if (rows.size() % layout_.row != 0 || size > capacity_ || cursor != (size < capacity_ ? size : cursor % capacity_))
    throw std::invalid_argument("what was saved is no content of this replay memory");
  std::ranges::copy(rows, rows_.begin());
  size_ = size;
  cursor_ = cursor;
}

}  // namespace flappy::learn
