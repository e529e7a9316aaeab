#include "learn/lanes/learner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "io/parallel.hpp"
#include "learn/lanes/update.hpp"
#include "sim/kernels.hpp"
#include "sim/random.hpp"

namespace flappy::learn {

FLAPPY_KERNELS(UpdateKernel<float>, update_float);
FLAPPY_KERNELS(UpdateKernel<double>, update_double);

namespace {

/// Largest number of parts in which gradients are kept; with more chunks, several chunks share a part.
constexpr std::size_t kMaxParts = 16;
/// Number of weights that a thread steps at a time.
constexpr std::ptrdiff_t kShard = 2048;

/// Array that begins at a cache line.
template <class T>
class AlignedArray {
 public:
  explicit AlignedArray(std::size_t count)
      : lines_((count * sizeof(T) + sizeof(Line) - 1) / sizeof(Line)), count_(count) {}
  T* data() { return reinterpret_cast<T*>(lines_.data()); }
  const T* data() const { return reinterpret_cast<const T*>(lines_.data()); }
  std::size_t size() const { return count_; }

 private:
  struct alignas(64) Line {
    std::array<T, 64 / sizeof(T)> numbers{};
  };
  std::vector<Line> lines_;
  std::size_t count_;
};

NetworkShape network_shape(int inputs, const std::vector<int>& hidden, int outputs, policy::Activation activation,
                           bool bounded) {
  std::vector<int> widths = {inputs};
  widths.insert(widths.end(), hidden.begin(), hidden.end());
  widths.push_back(outputs);
  return {static_cast<int>(widths.size()) - 1, widths.data(), activation, bounded};
}

/// Calls visit(layer, input or -1 for the bias, output, index of the weight) in the order of an actor's file.
template <class Visit>
void each_weight(const NetworkShape& net, const Visit& visit) {
  for (int l = 0; l < net.layers; ++l)
    for (int o = 0; o < net.widths[l + 1]; ++o)
      for (int i = -1; i < net.widths[l]; ++i)
        visit(l, i, o, net.weights[l] + std::ptrdiff_t{1 + i} * padded(net.widths[l + 1]) + o);
}

}  // namespace

void check_options(const LearnerOptions& o) {
  const auto inputs = static_cast<std::size_t>(o.shape.observation);
  if (o.input.mean.size() != inputs || o.input.scale.size() != inputs || !(o.input.clip > 0))
    throw std::invalid_argument("a normaliser has one mean and one scale for each input, and a clip above 0");
  if (o.batch < kChunk || o.batch % kChunk != 0)
    throw std::invalid_argument("a batch is a multiple of " + std::to_string(kChunk));
  if (o.threads < 1 || o.policy_delay < 1) throw std::invalid_argument("threads and policy_delay are at least 1");
  for (const auto* hidden : {&o.actor_hidden, &o.critic_hidden}) {
    if (hidden->size() >= policy::kMaxLayers)
      throw std::invalid_argument("a network has at most " + std::to_string(policy::kMaxLayers) + " layers");
    for (const int w : *hidden)
      if (w < 1 || w > policy::kMaxWidth)
        throw std::invalid_argument("a layer is 1 to " + std::to_string(policy::kMaxWidth) + " wide");
  }
}

double first_weight(std::uint64_t seed, int network, int layer, int inputs, std::uint32_t number, double scale) {
  const sim::RandomKey key{seed, static_cast<std::uint32_t>(network), static_cast<std::uint32_t>(layer),
                           sim::Stream::weights};
  const sim::UniformPair u = sim::uniform_pair(key, number / 2);
  return scale / std::sqrt(inputs) * (2 * (number % 2 == 0 ? u.first : u.second) - 1);
}

template <class T>
struct Learner<T>::Storage {
  LearnerOptions options;
  const UpdateKernel<T>* kernel;
  UpdatePlan<T> plan;
  std::ptrdiff_t count;  // number of weights of all networks
  std::size_t parts;     // number of parts of the gradients
  AlignedArray<T> input_numbers, numbers, gradients, work;
  std::vector<ChunkSums<T>> sums;  // [chunk]
  std::vector<std::byte> parcels;  // message to other ranks
  std::ptrdiff_t work_size;
  LearnerCounters counters;
  UpdateMetrics metrics;

  explicit Storage(const LearnerOptions& o, const UpdatePlan<T>& p)
      : options(o),
        kernel(&sim::kernel_of<T>(update_floats, update_doubles, o.instruction_set)),
        plan(p),
        count(p.weight_count()),
        parts(std::min(kMaxParts, o.batch / kChunk)),
        input_numbers(2 * static_cast<std::size_t>(p.input.count)),
        numbers(static_cast<std::size_t>(4 * count)),
        gradients(static_cast<std::size_t>(count) * parts),
        work(static_cast<std::size_t>(o.threads * work_room(p))),
        sums(o.batch / kChunk),
        work_size(work_room(p)) {
    put_input(plan.input, o.input, input_numbers.data());
    plan.weights = numbers.data();
    plan.targets = numbers.data() + count;
    for (int c = 0; c < plan.critics; ++c) start(plan.critic, c * plan.critic.weight_count(), 1 + c);
    start(plan.actor, plan.actor_at(), 0);
  }

  static std::ptrdiff_t work_room(const UpdatePlan<T>& p) { return (Workspace<T>::count(p) + 15) / 16 * 16; }

  static void put_input(InputView<T>& view, const Normaliser& n, T* to) {
    std::ranges::transform(n.mean, to, [](double x) { return static_cast<T>(x); });
    std::ranges::transform(n.scale, to + view.count, [](double x) { return static_cast<T>(x); });
    view.mean = to, view.scale = to + view.count;
    view.clip = static_cast<T>(n.clip);
  }

  T* weights_at(std::ptrdiff_t at, bool target) { return numbers.data() + (target ? count : 0) + at; }

  void start(const NetworkShape& net, std::ptrdiff_t at, int network) {
    each_weight(net, [&](int l, int i, int o, std::ptrdiff_t place) {
      if (i < 0) return;
      const double w =
          first_weight(options.seed, network, l, net.widths[l], static_cast<std::uint32_t>(o * net.widths[l] + i),
                       l + 1 == net.layers ? options.last_layer_scale : 1);
      *weights_at(at + place, false) = *weights_at(at + place, true) = static_cast<T>(w);
    });
  }

  policy::Actor actor() {
    policy::Actor a;
    a.widths.assign(plan.actor.widths, plan.actor.widths + plan.actor.layers + 1);
    a.hidden = plan.actor.hidden;
    a.mean = options.input.mean;
    a.scale = options.input.scale;
    a.clip = options.input.clip;
    const T* from = weights_at(plan.actor_at(), false);
    each_weight(plan.actor, [&](int, int, int, std::ptrdiff_t place) { a.weights.push_back(from[place]); });
    return a;
  }

  std::pair<std::size_t, std::size_t> own_parts() const { return io::own_share(options.ranks, parts); }
  /// Exchanges the gradients and sums of all parts between ranks, in one message.
  void exchange() {
    if (options.ranks == nullptr) return;
    const std::size_t sent = static_cast<std::size_t>(plan.actor_learns ? count : plan.actor_at());
    const std::size_t most = (sums.size() + parts - 1) / parts, row = sent * sizeof(T) + most * sizeof sums[0];
    parcels.resize(parts * row);
    const auto each = [&](const auto& copy) {
      for (std::size_t part = 0; part < parts; ++part) {
        std::byte* const parcel = parcels.data() + part * row;
        copy(parcel, gradients.data() + static_cast<std::ptrdiff_t>(part) * count, sent * sizeof(T));
        const std::size_t from = part * sums.size() / parts, to = (part + 1) * sums.size() / parts;
        copy(parcel + sent * sizeof(T), &sums[from], (to - from) * sizeof sums[0]);
      }
    };
    each([](std::byte* parcel, void* here, std::size_t bytes) { std::memcpy(parcel, here, bytes); });
    options.ranks->share(parcels.data(), parts, row);
    each([](std::byte* parcel, void* here, std::size_t bytes) { std::memcpy(here, parcel, bytes); });
  }

  /// Computes gradient part `part`: the sum over the chunks that share it, in order.
  void work_on(std::size_t part, const Replay& replay, int thread) {
    T* place = work.data() + thread * work_size;
    const std::size_t chunks = sums.size();
    bool accumulate = false;
    for (std::size_t c = part * chunks / parts; c < (part + 1) * chunks / parts; ++c) {
      std::array<std::uint32_t, kChunk> rows;
      replay.sample(options.seed, counters.updates, c * kChunk, rows);
      sums[c] = kernel->chunk(plan, place, replay.row(0), rows.data(), static_cast<std::uint32_t>(c * kChunk),
                              gradients.data() + static_cast<std::ptrdiff_t>(part) * count, accumulate);
      accumulate = true;
    }
  }

  /// Plan of a step of Adam for the weights from `at` on. The powers of beta already include this step.
  AdamPlan<T> adam(std::ptrdiff_t at, double rate, double beta1_power, double beta2_power) {
    AdamPlan<T> p{};
    p.weights = numbers.data() + at;
    p.targets = p.weights + count;
    p.first = p.targets + count;
    p.second = p.first + count;
    p.gradients = gradients.data() + at;
    p.parts = static_cast<std::ptrdiff_t>(parts);
    p.part_size = count;
    p.beta1 = static_cast<T>(options.beta1);
    p.beta2 = static_cast<T>(options.beta2);
    p.epsilon = static_cast<T>(options.epsilon);
    p.rate = static_cast<T>(rate / (1 - beta1_power));
    p.second_root = static_cast<T>(1 / std::sqrt(1 - beta2_power));
    p.tau = plan.actor_learns ? static_cast<T>(options.tau) : T(0);
    return p;
  }

  void measure() {
    double loss = 0, q = 0, actor_q = 0;
    for (const ChunkSums<T>& s : sums) loss += s.loss, q += s.q, actor_q += s.actor_q;
    const auto batch = static_cast<double>(options.batch);
    metrics.critic_loss = loss / (batch * plan.critics);
    metrics.mean_q = q / batch;
    if (plan.actor_learns) metrics.actor_q = actor_q / batch;
  }
};

template <class T>
Learner<T>::Learner(const LearnerOptions& o) {
  check_options(o);
  if (o.layer_norm || o.weight_decay > 0 || o.gradient_clip > 0 || o.device != "cpu" ||
      std::max(o.actor_activation, o.critic_activation) > policy::Activation::tanh)
    throw std::invalid_argument("lanes learn neither layer norm, decay of weights, clipped gradients, elu nor silu");
  UpdatePlan<T> plan;
  plan.actor = network_shape(o.shape.observation, o.actor_hidden, o.shape.action, o.actor_activation, true);
  plan.critic = network_shape(o.shape.observation + o.shape.action, o.critic_hidden, 1, o.critic_activation, false);
  plan.critics = o.twin ? 2 : 1;
  const TransitionLayout layout(o.shape);
  const auto column = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
  plan.input.count = o.shape.observation;
  plan.input.now = column(layout.observation);
  plan.input.next = column(layout.next_observation);
  plan.action = column(layout.action);
  plan.reward = column(layout.reward);
  plan.discount = column(layout.discount);
  plan.row = column(layout.row);
  plan.noise_sd = static_cast<T>(o.noise_sd);
  plan.noise_clip = static_cast<T>(o.noise_clip);
  plan.huber = static_cast<T>(o.huber);
  plan.critic_share = static_cast<T>((o.huber > 0 ? 1.0 : 2.0) / static_cast<double>(o.batch));
  plan.actor_share = static_cast<T>(1.0 / static_cast<double>(o.batch));
  plan.seed = o.seed;
  storage_ = std::make_unique<Storage>(o, plan);
}

template <class T>
Learner<T>::~Learner() = default;
template <class T>
Learner<T>::Learner(Learner&&) noexcept = default;
template <class T>
Learner<T>& Learner<T>::operator=(Learner&&) noexcept = default;

template <class T>
void Learner<T>::update(const Replay& replay, double actor_rate, double critic_rate, const ParallelWork& beside) {
  Storage& s = *storage_;
  const TransitionShape &have = replay.shape(), &want = s.options.shape;
  if (replay.size() == 0 || have.observation != want.observation || have.action != want.action)
    throw std::invalid_argument("a replay memory that is empty or of another shape");
  LearnerCounters& n = s.counters;
  s.plan.update = static_cast<std::uint32_t>(n.updates);
  s.plan.actor_learns = (n.updates + 1) % static_cast<std::uint64_t>(s.options.policy_delay) == 0;
  n.critic_beta1 *= s.options.beta1, n.critic_beta2 *= s.options.beta2;
  if (s.plan.actor_learns) n.actor_beta1 *= s.options.beta1, n.actor_beta2 *= s.options.beta2;
  const std::ptrdiff_t actor_at = s.plan.actor_at();
  const AdamPlan<T> critics = s.adam(0, critic_rate, n.critic_beta1, n.critic_beta2);
  const AdamPlan<T> actor = s.adam(actor_at, actor_rate, n.actor_beta1, n.actor_beta2);
  const std::ptrdiff_t critic_shards = (actor_at + kShard - 1) / kShard;
  const std::ptrdiff_t shards = critic_shards + (s.plan.actor_learns ? (s.count - actor_at + kShard - 1) / kShard : 0);

  const auto [first, last] = s.own_parts();
  const std::size_t own = last - first;
  io::parallel_for(own + beside.items, s.options.threads, [&, first = first](std::size_t i, int thread) {
    if (i < own) s.work_on(first + i, replay, thread);
    else beside.run(i - own);
  });
  s.exchange();
  io::parallel_for(static_cast<std::size_t>(shards), s.options.threads, [&](std::size_t k) {
    const auto i = static_cast<std::ptrdiff_t>(k);
    const bool of_actor = i >= critic_shards;
    const std::ptrdiff_t begin = (of_actor ? i - critic_shards : i) * kShard;
    const std::ptrdiff_t end = std::min(begin + kShard, of_actor ? s.count - actor_at : actor_at);
    s.kernel->adam(of_actor ? actor : critics, begin, end);
  });
  ++n.updates;
  s.measure();
}

template <class T>
const LearnerOptions& Learner<T>::options() const {
  return storage_->options;
}
template <class T>
const UpdateMetrics& Learner<T>::metrics() const {
  return storage_->metrics;
}
template <class T>
policy::Actor Learner<T>::actor() const {
  return storage_->actor();
}

template <class T>
void Learner<T>::set_actor(const policy::Actor& a) {
  Storage& s = *storage_;
  const NetworkShape& net = s.plan.actor;
  if (!std::ranges::equal(a.widths, std::span(net.widths).first(static_cast<std::size_t>(net.layers) + 1)) ||
      a.hidden != net.hidden || a.recurrent || a.linear || a.layer_norm ||
      a.weights.size() != policy::weight_count(a.widths))
    throw std::invalid_argument("the actor's layers are not those of the learner");
  std::size_t next = 0;
  each_weight(net, [&](int, int, int, std::ptrdiff_t place) {
    const std::ptrdiff_t at = s.plan.actor_at() + place;
    *s.weights_at(at, false) = *s.weights_at(at, true) = static_cast<T>(a.weights[next++]);
  });
}

template <class T>
void Learner<T>::act(const float* observations, std::size_t count, T* actions) const {
  const Storage& s = *storage_;
  const auto inputs = static_cast<std::size_t>(s.options.shape.observation);
  const auto outputs = static_cast<std::size_t>(s.options.shape.action);
  AlignedArray<T> work(static_cast<std::size_t>(s.work_size));
  std::vector<float> in(kChunk * inputs);
  std::vector<T> out(kChunk * outputs);
  for (std::size_t first = 0; first < count; first += kChunk) {
    const std::size_t n = std::min(kChunk, count - first);
    std::copy_n(observations + first * inputs, n * inputs, in.begin());
    s.kernel->act(s.plan, work.data(), in.data(), out.data());
    std::copy_n(out.begin(), n * outputs, actions + first * outputs);
  }
}

template <class T>
std::span<T> Learner<T>::numbers() {
  return {storage_->numbers.data(), storage_->numbers.size()};
}
template <class T>
std::span<const T> Learner<T>::numbers() const {
  return {storage_->numbers.data(), storage_->numbers.size()};
}
template <class T>
LearnerCounters& Learner<T>::counters() {
  return storage_->counters;
}
template <class T>
const LearnerCounters& Learner<T>::counters() const {
  return storage_->counters;
}

template <class T>
std::vector<typename Learner<T>::Layer> Learner<T>::layers(Network network, Kind kind) const {
  const Storage& s = *storage_;
  const bool of_actor = network == Network::actor;
  const NetworkShape& net = of_actor ? s.plan.actor : s.plan.critic;
  const T* from = s.numbers.data() + static_cast<std::ptrdiff_t>(kind) * s.count;
  from += of_actor ? s.plan.actor_at() : static_cast<std::ptrdiff_t>(network) * net.weight_count();
  std::vector<Layer> list;
  for (int l = 0; l < net.layers; ++l) {
    const int outputs = net.widths[l + 1];
    list.push_back({{from + net.weights[l], from + net.weights[l + 1]}, net.widths[l], outputs, padded(outputs)});
  }
  return list;
}

template class Learner<float>;
template class Learner<double>;

}  // namespace flappy::learn
