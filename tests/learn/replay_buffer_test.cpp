#include "learn/replay_buffer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>

#include "learn/lanes/learners.hpp"

namespace flappy::learn {
namespace {

constexpr std::size_t kLongest = 64;  // numbers of any observation or action below

/// A transition whose numbers all tell its number.
void add_numbered(Replay& replay, int number) {
  const std::vector<float> many(kLongest, static_cast<float>(number));
  replay.add({many.data(), many.data(), many.data(), many[0], many[0]});
}

TEST(Replay, parts_stand_where_the_layout_says) {
  const std::array<float, 2> seen = {1, 2}, next = {7, 8};
  const std::array<float, 1> action = {6};
  Replay replay({2, 1}, 4);
  replay.add({seen.data(), action.data(), next.data(), 20, 30});
  EXPECT_EQ(replay.layout().row, 7U);
  EXPECT_EQ(replay.layout().next_observation, 5U);
  EXPECT_EQ(replay.bytes(), 4 * 7 * sizeof(float));
  EXPECT_EQ(std::vector<float>(replay.row(0), replay.row(0) + 7), (std::vector<float>{1, 2, 6, 20, 30, 7, 8}));
}

TEST(Replay, the_oldest_is_overwritten) {
  Replay replay({3, 2}, 5);
  for (int i = 0; i < 3; ++i) add_numbered(replay, i);
  EXPECT_EQ(replay.size(), 3U);
  EXPECT_EQ(replay.cursor(), 3U);
  for (int i = 3; i < 12; ++i) add_numbered(replay, i);
  EXPECT_EQ(replay.size(), 5U);
  EXPECT_EQ(replay.cursor(), 2U);
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t k = 0; k < replay.layout().row; ++k)
      EXPECT_EQ(replay.row(i)[k], (std::array{10.0F, 11.0F, 7.0F, 8.0F, 9.0F}[i]));
}

TEST(Replay, putting_many_at_once_is_adding_them) {
  Replay one = random_replay(kWide, 7), other = random_replay(kWide, 7);
  for (int i = 0; i < 5; ++i) add_numbered(one, i);
  for (const std::size_t i : {3U, 0U, 4U, 1U, 2U}) {
    const std::vector<float> many(kLongest, static_cast<float>(i));
    other.put(i, {many.data(), many.data(), many.data(), many[0], many[0]});
  }
  other.advance(5);
  EXPECT_EQ(one.cursor(), other.cursor());
  EXPECT_TRUE(std::ranges::equal(one.rows(), other.rows()));
}

TEST(Replay, samples_are_uniform_among_those_held) {
  Replay replay({1, 1}, 1000);
  for (int i = 0; i < 10; ++i) add_numbered(replay, i);
  std::array<int, 10> counts{};
  constexpr int kUpdates = 500, kBatch = 64;
  for (std::uint64_t update = 0; update < kUpdates; ++update) {
    std::array<std::uint32_t, kBatch> rows;
    replay.sample(9, update, 0, rows);
    for (const std::uint32_t r : rows) ++counts.at(r);
  }
  // each count is binomial: mean 3200, sd 54
  for (const int n : counts) EXPECT_NEAR(n, kUpdates * kBatch / 10, 5 * 54);
}

TEST(Replay, a_sample_depends_on_its_place_in_the_batch_alone) {
  const Replay replay = random_replay({1, 1}, 1000);
  std::array<std::uint32_t, 128> all;
  std::array<std::uint32_t, 64> half;
  replay.sample(9, 5, 0, all);
  replay.sample(9, 5, 64, half);
  EXPECT_TRUE(std::equal(half.begin(), half.end(), all.begin() + 64));
  std::array<std::uint32_t, 64> other;
  for (const auto& [seed, update] : {std::pair<std::uint64_t, std::uint64_t>{9, 6}, {10, 5}, {9, 5 + (1ULL << 32)}}) {
    replay.sample(seed, update, 64, other);
    EXPECT_NE(other, half);
  }
}

TEST(Replay, what_was_saved_is_restored) {
  for (const int held : {3, 5, 8}) {
    Replay saved({3, 2}, 5), restored({3, 2}, 5);
    for (int i = 0; i < held; ++i) add_numbered(saved, i);
    restored.restore(saved.rows(), saved.cursor());
    for (int i = 20; i < 24; ++i) add_numbered(saved, i), add_numbered(restored, i);
    EXPECT_EQ(restored.size(), saved.size());
    EXPECT_TRUE(std::ranges::equal(restored.rows(), saved.rows()));
  }
  Replay small({3, 2}, 4);
  const std::vector<float> rows(5 * small.layout().row);
  EXPECT_THROW(small.restore(rows, 0), std::invalid_argument);                                       // too many
  EXPECT_THROW(small.restore(std::span(rows).first(3), 0), std::invalid_argument);                   // half a row
  EXPECT_THROW(small.restore(std::span(rows).first(small.layout().row), 3), std::invalid_argument);  // a gap
  EXPECT_THROW(Replay({0, 1}, 4), std::invalid_argument);
  EXPECT_THROW(Replay({1, 1}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace flappy::learn
