// Gradients of a chunk and the step of Adam, compiled for each instruction set (FLAPPY_ISA); all give the same bits.
#include "learn/lanes/update.hpp"

#include "sim/noise.hpp"
#include "sim/random.hpp"

namespace flappy::learn {
inline namespace FLAPPY_ISA {
namespace {

/// Sum of a row by halving: the order of additions is the same for any width of register.
template <class T>
FLAPPY_INLINE T folded(T* numbers) {
  for (std::ptrdiff_t half = kRow / 2; half > 0; half /= 2)
    for (std::ptrdiff_t i = 0; i < half; ++i) numbers[i] += numbers[i + half];
  return numbers[0];
}

/// Copies the chunk's transitions and transposes them to [column][kChunk].
template <class T>
FLAPPY_INLINE void gather(const UpdatePlan<T>& plan, const Workspace<T>& w, const float* memory,
                          const std::uint32_t* rows) {
  const std::ptrdiff_t wide = Workspace<T>::row(plan);
  const auto row = [&](std::ptrdiff_t s) { return memory + static_cast<std::ptrdiff_t>(rows[s]) * plan.row; };
  for (std::ptrdiff_t s = 0; s < kRow; ++s)
    for (std::ptrdiff_t i = 0; i < plan.row; i += 16) __builtin_prefetch(row(s) + i);
  for (std::ptrdiff_t s = 0; s < kRow; ++s) {
    const float* from = row(s);
    T* to = w.gathered + s * wide;
    for (std::ptrdiff_t i = 0; i < plan.row; ++i) to[i] = static_cast<T>(from[i]);
  }
  transpose(kRow, static_cast<int>(wide), w.gathered, wide, w.columns, kRow);
}

template <class T>
FLAPPY_INLINE void normalise(const InputView<T>& view, const T* from, T* to) {
  const L<T> clip(view.clip);
  for (int i = 0; i < view.count; ++i, from += kRow, to += kRow) {
    const L<T> mean(view.mean[i]), scale(view.scale[i]);
    for_rows<T>(1, [&](std::ptrdiff_t s) {
      clamp(L<T>((L<T>::load(from + s) - mean) * scale), L<T>(-clip), clip).store(to + s);
    });
  }
}

template <class T>
FLAPPY_INLINE void copy_rows(int count, const T* from, T* to) {
  for_rows<T>(count, [&](std::ptrdiff_t i) { L<T>::load(from + i).store(to + i); });
}

/// Adds clipped noise to the target actor's actions, and clips the result (target policy smoothing of TD3).
template <class T>
FLAPPY_INLINE void add_noise(const UpdatePlan<T>& plan, std::uint32_t sample, int actions, T* rows) {
  std::uint32_t number[kChunk], update[kChunk];
  for (std::uint32_t s = 0; s < kChunk; ++s) number[s] = sample + s, update[s] = plan.update;
  const L<T> sd(plan.noise_sd), most(plan.noise_clip), one(1);
  for (int first = 0; first < actions; first += 4)
    for (std::ptrdiff_t s = 0; s < kRow; s += kWidth<T>) {
      const auto noise = sim::normals<L<T>>(plan.seed, static_cast<std::uint32_t>(sim::Stream::target_noise),
                                            static_cast<std::uint32_t>(first / 4), number + s, update + s);
      for (int k = 0; k < 4 && first + k < actions; ++k) {
        T* at = rows + (first + k) * kRow + s;
        const L<T> step = clamp(L<T>(sd * noise.n[k]), L<T>(-most), most);
        clamp(L<T>(L<T>::load(at) + step), L<T>(-one), one).store(at);
      }
    }
}

/// Writes the critics' targets y to w.target. A discount of 0 removes the next observation; the clip has made it
/// finite, so that 0 times its value is 0.
template <class T>
FLAPPY_INLINE void find_targets(const UpdatePlan<T>& plan, const Workspace<T>& w, std::uint32_t sample) {
  const int actions = plan.actor.widths[plan.actor.layers];
  T* critic_in = rows_of(plan.critic, w.critic, 0);
  T* action = critic_in + plan.input.count * kRow;
  normalise(plan.input, w.columns + plan.input.next * kRow, rows_of(plan.actor, w.actor, 0));
  forward(plan.actor, plan.targets + plan.actor_at(), w.actor);
  copy_rows(actions, rows_of(plan.actor, w.actor, plan.actor.layers), action);
  if (plan.noise_sd > 0) add_noise(plan, sample, actions, action);
  normalise(plan.input, w.columns + plan.input.next * kRow, critic_in);
  const T* q = rows_of(plan.critic, w.critic, plan.critic.layers);
  for (int c = 0; c < plan.critics; ++c) {
    forward(plan.critic, plan.targets + c * plan.critic.weight_count(), w.critic);
    for_rows<T>(1, [&](std::ptrdiff_t s) {
      const L<T> next = L<T>::load(q + s);
      (c == 0 ? next : min(L<T>::load(w.target + s), next)).store(w.target + s);
    });
  }
  for_rows<T>(1, [&](std::ptrdiff_t s) {
    const L<T> reward = L<T>::load(w.columns + plan.reward * kRow + s);
    const L<T> discount = L<T>::load(w.columns + plan.discount * kRow + s);
    L<T>(discount * L<T>::load(w.target + s) + reward).store(w.target + s);
  });
}

/// Computes the gradient of the loss by the critic's outputs into w.gradients.now; returns the sum of the losses.
template <class T>
FLAPPY_INLINE T find_loss(const UpdatePlan<T>& plan, const Workspace<T>& w, const T* q) {
  T* loss = w.q;
  const L<T> share(plan.critic_share), bend(plan.huber);
  for_rows<T>(1, [&](std::ptrdiff_t s) {
    const L<T> error = L<T>::load(q + s) - L<T>::load(w.target + s);
    if (plan.huber > 0) {
      const L<T> near = clamp(error, L<T>(-bend), bend);  // |e| <= bend: e^2 / 2, beyond: bend (|e| - bend / 2)
      L<T>(share * near).store(w.gradients.now + s);
      L<T>(near * L<T>(error - L<T>(L<T>(0.5) * near))).store(loss + s);
    } else {
      L<T>(share * error).store(w.gradients.now + s);
      L<T>(error * error).store(loss + s);
    }
  });
  return folded(loss);
}

template <class T>
FLAPPY_INLINE T sum_of(const Workspace<T>& w, const T* row) {
  copy_rows(1, row, w.q);
  return folded(w.q);
}

template <class T>
ChunkSums<T> chunk(const UpdatePlan<T>& plan, T* work, const float* memory, const std::uint32_t* rows,
                   std::uint32_t sample, T* gradient, bool accumulate) {
  Workspace<T> w(plan, work);
  const int actions = plan.actor.widths[plan.actor.layers], seen = plan.input.count;
  T* critic_in = rows_of(plan.critic, w.critic, 0);
  const T* q = rows_of(plan.critic, w.critic, plan.critic.layers);
  ChunkSums<T> sums;
  put_ones(plan.actor, w.actor);
  put_ones(plan.critic, w.critic);
  gather(plan, w, memory, rows);

  find_targets(plan, w, sample);

  normalise(plan.input, w.columns + plan.input.now * kRow, critic_in);
  copy_rows(actions, w.columns + plan.action * kRow, critic_in + seen * kRow);
  for (int c = 0; c < plan.critics; ++c) {
    const std::ptrdiff_t at = c * plan.critic.weight_count();
    forward(plan.critic, plan.weights + at, w.critic);
    sums.loss += find_loss(plan, w, q);
    if (c == 0) sums.q = sum_of(w, q);
    backward<T>(plan.critic, plan.weights + at, w.critic, w.gradients, gradient + at, accumulate, 0, 0);
  }

  if (plan.actor_learns) {
    const T* mine = plan.weights + plan.actor_at();
    normalise(plan.input, w.columns + plan.input.now * kRow, rows_of(plan.actor, w.actor, 0));
    forward(plan.actor, mine, w.actor);
    copy_rows(actions, rows_of(plan.actor, w.actor, plan.actor.layers), critic_in + seen * kRow);
    forward(plan.critic, plan.weights, w.critic);
    sums.actor_q = sum_of(w, q);
    for_rows<T>(1, [&](std::ptrdiff_t s) { L<T>(-plan.actor_share).store(w.gradients.now + s); });
    backward<T>(plan.critic, plan.weights, w.critic, w.gradients, nullptr, false, seen, actions);
    backward<T>(plan.actor, mine, w.actor, w.gradients, gradient + plan.actor_at(), accumulate, 0, 0);
  }
  return sums;
}

template <class T>
void adam(const AdamPlan<T>& p, std::ptrdiff_t begin, std::ptrdiff_t end) {
  const L<T> beta1(p.beta1), beta2(p.beta2), rest1(T(1) - p.beta1), rest2(T(1) - p.beta2);
  const L<T> rate(p.rate), second_root(p.second_root), epsilon(p.epsilon), tau(p.tau);
  for (std::ptrdiff_t i = begin; i < end; i += kWidth<T>) {
    L<T> g = L<T>::load(p.gradients + i);
    for (std::ptrdiff_t k = 1; k < p.parts; ++k) g += L<T>::load(p.gradients + k * p.part_size + i);
    const L<T> m = rest1 * g + L<T>(beta1 * L<T>::load(p.first + i));
    const L<T> v = L<T>(rest2 * g) * g + L<T>(beta2 * L<T>::load(p.second + i));
    m.store(p.first + i);
    v.store(p.second + i);
    const L<T> x = L<T>::load(p.weights + i) - rate * L<T>(m / (sqrt(v) * second_root + epsilon));
    x.store(p.weights + i);
    if (p.tau > 0) {
      const L<T> target = L<T>::load(p.targets + i);
      L<T>(tau * L<T>(x - target) + target).store(p.targets + i);
    }
  }
}

template <class T>
void act(const UpdatePlan<T>& plan, T* work, const float* observations, T* actions) {
  const Workspace<T> w(plan, work);
  const int inputs = plan.input.count, outputs = plan.actor.widths[plan.actor.layers];
  put_ones(plan.actor, w.actor);
  for (std::ptrdiff_t s = 0; s < kRow; ++s)
    for (std::ptrdiff_t i = 0; i < inputs; ++i) w.columns[i * kRow + s] = static_cast<T>(observations[s * inputs + i]);
  normalise(plan.input, w.columns, rows_of(plan.actor, w.actor, 0));
  forward(plan.actor, plan.weights + plan.actor_at(), w.actor);
  const T* out = rows_of(plan.actor, w.actor, plan.actor.layers);
  for (std::ptrdiff_t s = 0; s < kRow; ++s)
    for (std::ptrdiff_t o = 0; o < outputs; ++o) actions[s * outputs + o] = out[o * kRow + s];
}

}  // namespace

extern const UpdateKernel<float> update_float;
extern const UpdateKernel<double> update_double;
const UpdateKernel<float> update_float = {chunk<float>, adam<float>, act<float>};
const UpdateKernel<double> update_double = {chunk<double>, adam<double>, act<double>};

}  // namespace FLAPPY_ISA
}  // namespace flappy::learn
