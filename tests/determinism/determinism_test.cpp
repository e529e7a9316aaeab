// The determinism contract for simulation: one hash for any number of threads, batch size, place in the batch,
// instruction set and optimisation level. This file is linked twice: against the library as built, and at -O0.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "determinism/tried.hpp"
#include "flappy/batch.hpp"
#include "model/effects/registry.hpp"
#include "sim/randomise.hpp"
#include "vehicles.hpp"

namespace flappy::sim {
namespace {

// A change here means that every recorded run and every trained policy flies differently: say so in the commit.
constexpr std::uint64_t kGoldenFloat = 0x72629c66d995a5c2;
constexpr std::uint64_t kGoldenDouble = 0x0c712c49d0b9b00c;

constexpr std::size_t kFlappers = 1024, kSmall = 68;
constexpr int kPeriods = 4, kSteps = 20;

const Randomisation& randomisation() {
  static const Randomisation r = [] {
    const auto config = io::Config::load(test::source_path("configs/randomisation/published.toml"));
    return Randomisation(test::identified(), config.root());
  }();
  return r;
}

model::Vehicle vehicle(std::size_t id) {
  model::Vehicle v = randomisation().sample({.seed = 11, .flapper = static_cast<std::uint32_t>(id), .episode = 2});
  if (id % 5 == 0) v.effects["body_drag"] = {{"drag_area_m2", 0.001}, {"centre_z_m", 0.01}};
  if (id % 7 == 0) v.effects["ground_effect"] = {{"gain", 0.2}, {"length_m", 0.05}};
  return v;
}

void reset(auto& batch, std::size_t i, std::size_t id, const Input& input) {
  FlapperState s;
  s.position_m[2] = id % 3 == 0 ? 0 : 0.4;
  s.velocity_m_s[0] = 0.1 * static_cast<double>(id % 11);
  batch.reset(i, s, id % 3 == 0 ? Start::standing : Start::flying);
  batch.set_input(i, input);
}

/// Flies flappers [first, first + count): every kind of start, stops under 18 V, effects, and a reset on the way.
template <class T>
Batch<T> fly(std::size_t first, std::size_t count, int threads, const std::string& instruction_set) {
  BatchOptions options;
  options.threads = threads;
  options.instruction_set = instruction_set;
  options.world.ground_z_m = 0;
  options.world.walls = {{1, 0, -1, 0}};
  Batch<T> batch(count, test::identified(), options);
  const auto input = [](std::size_t id) {
    return Input{8 + static_cast<double>(id % 21) / 2, 0.1 * static_cast<double>(id % 7), -0.2,
                 0.01 * static_cast<double>(id % 5)};
  };
  for (std::size_t i = 0; i < count; ++i) {
    batch.set_vehicle(i, vehicle(first + i));
    reset(batch, i, first + i, input(first + i));
  }
  for (int period = 0; period < kPeriods; ++period) {
    batch.step(kSteps);
    for (std::size_t i = 0; i < count && period == 2; ++i)
      if ((first + i) % 13 == 0) reset(batch, i, first + i, input(first + i + 1));
  }
  return batch;
}

/// Hash of the first kSmall flappers, flown in batches of `size`.
template <class T>
std::uint64_t hash_in_batches_of(std::size_t size, int threads, const std::string& instruction_set) {
  std::uint64_t all = 0;
  for (std::size_t first = 0; first < kSmall; first += size) {
    const Batch<T> batch = fly<T>(first, size, threads, instruction_set);
    for (std::size_t i = 0; i < size && first + i < kSmall; ++i) all = all * 31 + batch.hash(i, i + 1);
  }
  return all;
}

template <class T>
void one_hash(std::uint64_t golden) {
  std::uint64_t small = 0;
  for (const std::string& set : test::instruction_sets())
    for (const int threads : test::kThreads) {
      const Batch<T> batch = fly<T>(0, kFlappers, threads, set);
      EXPECT_EQ(batch.hash(), golden) << set << ", " << threads << " threads: 0x" << std::hex << batch.hash();
      EXPECT_EQ(batch.count_status(kFrozen), 0u);
      small = 0;
      for (std::size_t i = 0; i < kSmall; ++i) small = small * 31 + batch.hash(i, i + 1);
    }
  for (const std::string& set : test::instruction_sets())
    for (const std::size_t size : test::batch_sizes(set))
      EXPECT_EQ(hash_in_batches_of<T>(size, 2, set), small) << set << ", batches of " << size;
}

TEST(Determinism, Float) { one_hash<float>(kGoldenFloat); }
TEST(Determinism, Double) { one_hash<double>(kGoldenDouble); }

// ---- every effect at once

constexpr std::uint64_t kGoldenEffectsFloat = 0xea6c2bee7e004b81;
constexpr std::uint64_t kGoldenEffectsDouble = 0x74004c1d12adb2fe;

/// As many as fill blocks and leave some over; -O0 takes its time.
constexpr std::size_t kAffected = 51;

/// Every effect, each in three of four flappers and in its own size.
model::Vehicle affected(std::size_t id) {
  model::Vehicle v = test::identified();
  std::size_t index = id;
  for (const model::CatalogueEffect& e : model::effects()) {
    if (++index % 4 == 0) continue;
    for (const model::EffectParameter& p : e.parameters) v.effects[e.info.id][p.name] = p.typical;
    const model::EffectParameter& size = e.parameters[0];
    v.effects[e.info.id][size.name] = size.typical * 0.25 * static_cast<double>(1 + index % 5);
  }
  return v;
}

/// Hash of kAffected flappers that fly for most of a beat near everything there is, in batches of `size`.
template <class T>
std::uint64_t hash_of_affected(std::size_t size, int threads, const std::string& instruction_set) {
  BatchOptions options;
  options.threads = threads;
  options.instruction_set = instruction_set;
  options.world.ground_z_m = 0;
  options.world.ceiling_z_m = 0.6;
  options.world.walls = {{0.3, 0, -1, 0}, {0, -0.1, 0, 1}};
  std::uint64_t all = 0;
  for (std::size_t first = 0; first < kAffected; first += size) {
    const std::size_t count = std::min(size, kAffected - first);
    Batch<T> batch(count, test::identified(), options);
    for (std::size_t i = 0; i < count; ++i) {
      batch.set_vehicle(i, affected(first + i));
      reset(batch, i, first + i, {11 + static_cast<double>((first + i) % 13) / 2, 0.3, -0.2, 0.02});
    }
    batch.step(100);
    batch.step(100);
    EXPECT_EQ(batch.count_status(kFrozen), 0u);
    for (std::size_t i = 0; i < count; ++i) all = all * 31 + batch.hash(i, i + 1);
  }
  return all;
}

template <class T>
void one_hash_of_affected(std::uint64_t golden) {
  for (const std::string& set : test::instruction_sets()) {
    std::vector<std::size_t> sizes = test::batch_sizes(set);
    sizes.push_back(kAffected);
    for (const std::size_t size : sizes) {
      const int threads = size == kAffected ? 3 : size == 1 ? 1 : 2;
      const std::uint64_t hash = hash_of_affected<T>(size, threads, set);
      EXPECT_EQ(hash, golden) << set << ", " << threads << " threads, batches of " << size << ": 0x" << std::hex
                              << hash;
    }
  }
}

TEST(Determinism, EffectsInFloat) { one_hash_of_affected<float>(kGoldenEffectsFloat); }
TEST(Determinism, EffectsInDouble) { one_hash_of_affected<double>(kGoldenEffectsDouble); }

// ---- leaving the ground, falling back on it, and touching it in flight

constexpr std::uint64_t kGoldenGroundFloat = 0x457dffe7f590ff5b;
constexpr std::uint64_t kGoldenGroundDouble = 0x8c6e3f2a79bf48b3;

/// As many as fill blocks and leave some over.
constexpr std::size_t kGrounded = 19;

/// What became of flappers at the ground.
struct Grounded {
  std::vector<std::uint64_t> hashes;
  int rises = 0, falls_back = 0;
  std::size_t touches = 0;
};

/// Flappers [first, first + count): some sink onto the ground, the others stand on it and lift more or less of their weight.
template <class T>
Grounded at_ground(std::size_t first, std::size_t count, const std::string& instruction_set) {
  BatchOptions options;
  options.threads = 1;
  options.instruction_set = instruction_set;
  options.world.ground_z_m = 0;
  Batch<T> batch(count, test::identified(), options);
  std::vector<Start> support;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t id = first + i;
    const bool sinks = id % 6 == 5;
    FlapperState s;
    s.position_m[2] = sinks ? 0.005 : 0;
    support.push_back(sinks ? Start::flying : Start::standing);
    batch.set_vehicle(i, vehicle(id));
    batch.reset(i, s, support[i]);
    batch.set_input(i, {sinks ? 0 : 11 + static_cast<double>(id % 8), 0.1, 0, 0});
  }
  Grounded g;
  for (int period = 0; period < 28; ++period) {
    batch.step(kSteps);
    for (std::size_t i = 0; i < count; ++i) {
      const Start now = batch.support(i);
      g.rises += support[i] == Start::standing && now == Start::flying;
      g.falls_back += support[i] == Start::flying && now == Start::standing;
      support[i] = now;
    }
  }
  g.touches = batch.count_status(kTouchedGround);
  for (std::size_t i = 0; i < count; ++i) g.hashes.push_back(batch.hash(i, i + 1));
  return g;
}

template <class T>
void one_hash_at_ground(std::uint64_t golden) {
  for (const std::string& set : test::instruction_sets()) {
    const Grounded g = at_ground<T>(0, kGrounded, set);
    std::uint64_t all = 0;
    for (const std::uint64_t h : g.hashes) all = all * 31 + h;
    EXPECT_EQ(all, golden) << set << ": 0x" << std::hex << all;
    EXPECT_GT(g.rises, 10) << set;
    EXPECT_EQ(g.falls_back, 3) << set;
    EXPECT_EQ(g.touches, 3u) << set;
    for (const std::size_t i : {1, 10}) {  // without effects, and with one
      const Grounded alone = at_ground<T>(i, 1, set);
      EXPECT_EQ(alone.hashes[0], g.hashes[i]) << set << ", flapper " << i;
      EXPECT_EQ(alone.falls_back, 1) << set << ", flapper " << i;
    }
  }
}

TEST(Determinism, GroundInFloat) { one_hash_at_ground<float>(kGoldenGroundFloat); }
TEST(Determinism, GroundInDouble) { one_hash_at_ground<double>(kGoldenGroundDouble); }

// ---- voltages that are set directly, beside wing beats

constexpr std::uint64_t kGoldenVoltagesFloat = 0x31f5f63ca3dbcdf6;
constexpr std::uint64_t kGoldenVoltagesDouble = 0x5de63de6058b831c;

constexpr std::size_t kSet = 19;

/// Hash of kSet flappers, of which two in three get voltages now and then, and one of these its driver back on the way.
template <class T>
std::uint64_t hash_of_set(std::size_t size, int threads, const std::string& instruction_set) {
  BatchOptions options;
  options.threads = threads;
  options.instruction_set = instruction_set;
  std::uint64_t all = 0;
  for (std::size_t first = 0; first < kSet; first += size) {
    const std::size_t count = std::min(size, kSet - first);
    Batch<T> batch(count, test::identified(), options);
    for (std::size_t i = 0; i < count; ++i) {
      batch.set_vehicle(i, vehicle(first + i));
      reset(batch, i, first + i, {11, 0.3, -0.2, 0.02});
    }
    for (int period = 0; period < 10; ++period) {
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t id = first + i;
        const double volt = 0.7 * static_cast<double>(id) - 6 * (period % 3);
        if (id % 3 > 0 && (period < 7 || id % 3 == 1)) batch.set_voltages(i, volt, 3 - volt);
        else if (id % 3 == 2 && period == 7) batch.set_input(i, {12, 0, 0, 0});
      }
      batch.step(6);
    }
    EXPECT_EQ(batch.count_status(kFrozen), 0u);
    for (std::size_t i = 0; i < count; ++i) all = all * 31 + batch.hash(i, i + 1);
  }
  return all;
}

template <class T>
void one_hash_of_set(std::uint64_t golden) {
  for (const std::string& set : test::instruction_sets()) {
    std::vector<std::size_t> sizes = test::batch_sizes(set);
    sizes.push_back(kSet);
    for (const std::size_t size : sizes) {
      const std::uint64_t hash = hash_of_set<T>(size, size == kSet ? 3 : 1, set);
      EXPECT_EQ(hash, golden) << set << ", batches of " << size << ": 0x" << std::hex << hash;
    }
  }
}

TEST(Determinism, VoltagesInFloat) { one_hash_of_set<float>(kGoldenVoltagesFloat); }
TEST(Determinism, VoltagesInDouble) { one_hash_of_set<double>(kGoldenVoltagesDouble); }

// ---- points of contact that touch ground, wall and solids, that slide and grasp

constexpr std::uint64_t kGoldenContactFloat = 0x670bea869993d833;
constexpr std::uint64_t kGoldenContactDouble = 0xd33764b229ea2eba;

/// As many as fill blocks and leave some over.
constexpr std::size_t kTouch = 19;

/// Hash of kTouch flappers that fall and flap among solids.
template <class T>
std::uint64_t hash_of_touching(std::size_t size, int threads, const std::string& instruction_set) {
  static const model::Vehicle legs = model::read_vehicle(test::source_path("configs/vehicles/hummingbird_legs.toml"));
  BatchOptions options;
  options.threads = threads;
  options.instruction_set = instruction_set;
  options.world.ground_z_m = 0;
  options.world.walls = {{0.15, 0, -1, 0}};
  options.world.shapes = {box({0, 0, 0}, {0.1, 0.3, 0.06}, {0.2, 0.1, 0.5}), sphere({-0.15, 0, 0.05}, 0.06),
                          cylinder({0.1, -0.2, 0.08}, {0.05, 0.2, 0.1}, 0.02)};
  std::uint64_t all = 0;
  std::uint32_t touched = 0;
  std::size_t together = 0;
  for (std::size_t first = 0; first < kTouch; first += size) {
    const std::size_t count = std::min(size, kTouch - first);
    Batch<T> batch(count, legs, options);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t id = first + i;
      model::Vehicle v = legs;
      v.torso.mass_kg *= 1 + 0.01 * static_cast<double>(id);
      v.contact[id % 4].friction = 0.1 * static_cast<double>(id);
      if (id % 5 == 0) v.effects["ground_effect"] = {{"gain", 0.2}, {"length_m", 0.05}};
      batch.set_vehicle(i, v);
      FlapperState s;
      s.position_m[0] = 0.02 * static_cast<double>(id) - 0.2;
      s.position_m[1] = 0.01 * static_cast<double>(id % 7);
      s.position_m[2] = 0.16;
      s.velocity_m_s[0] = 0.2 * static_cast<double>(id % 3);
      s.body_rate_rad_s[1] = static_cast<double>(id % 4);
      batch.reset(i, s, id % 4 == 0 ? Start::standing : Start::flying);
      batch.set_input(i, {static_cast<double>(id % 10), 0.5, -0.2, 0.02});
    }
    for (int period = 0; period < 40; ++period) batch.step(kSteps);
    EXPECT_EQ(batch.count_status(kFrozen), 0u);
    for (std::size_t i = 0; i < count; ++i) {
      all = all * 31 + batch.hash(i, i + 1);
      touched |= batch.status(i);
      together += (batch.status(i) & kTouchedShape) != 0;
    }
  }
  EXPECT_EQ(touched, kTouchedGround | kTouchedWall | kTouchedShape | kTouching);
  EXPECT_GT(together, kTouch / 2);
  return all;
}

template <class T>
void one_hash_of_touching(std::uint64_t golden) {
  for (const std::string& set : test::instruction_sets()) {
    std::vector<std::size_t> sizes = test::batch_sizes(set);
    sizes.push_back(kTouch);
    for (const std::size_t size : sizes) {
      const std::uint64_t hash = hash_of_touching<T>(size, size == kTouch ? 3 : 1, set);
      EXPECT_EQ(hash, golden) << set << ", batches of " << size << ": 0x" << std::hex << hash;
    }
  }
}

TEST(Determinism, ContactInFloat) { one_hash_of_touching<float>(kGoldenContactFloat); }
TEST(Determinism, ContactInDouble) { one_hash_of_touching<double>(kGoldenContactDouble); }

TEST(Determinism, HashSeesEveryNumber) {
  Batch<float> a = fly<float>(0, 2, 1, ""), b = fly<float>(0, 2, 1, "");
  EXPECT_EQ(a.hash(), b.hash());
  b.set_input(1, {8, 0, 0, 0.001});
  EXPECT_NE(a.hash(), b.hash());
  EXPECT_EQ(a.hash(0, 1), b.hash(0, 1));
}

}  // namespace
}  // namespace flappy::sim
