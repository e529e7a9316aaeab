// The module flappy._core. io::InputError becomes flappy.InputError, a ValueError.
#include <csignal>
#include <mutex>

#include "bind.hpp"
#include "io/config.hpp"
#include "io/installation.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"

namespace flappy::python {

std::string shape_text(std::span<const std::size_t> shape) {
  std::string text = "(";
  for (const std::size_t& n : shape)
    text += std::to_string(n) + (shape.size() == 1 ? "," : &n == &shape.back() ? "" : ", ");
  return text + ")";
}

std::string text_of(const nb::object& str) { return nb::cast<std::string>(str); }

std::string described(nb::handle value) {
  const nb::object array = nb::module_::import_("numpy").attr("asarray")(value);
  std::vector<std::size_t> shape;
  for (const nb::handle n : nb::tuple(array.attr("shape"))) shape.push_back(nb::cast<std::size_t>(n));
  return text_of(array.attr("dtype").attr("name")) + " of shape " + shape_text(shape);
}

Floats::Floats(nb::handle value, const char* name, std::initializer_list<std::size_t> shape, float most) {
  const std::string accepted = "; accepted: float32 of shape " + shape_text({shape.begin(), shape.size()});
  if (!nb::try_cast(value, array_, false)) {
    nb::object array = nb::module_::import_("numpy").attr("asarray")(value);
    if (text_of(array.attr("dtype").attr("kind")) != "f")
      throw nb::type_error((std::string(name) + ": is " + described(value) + accepted).c_str());
    array = nb::module_::import_("numpy").attr("ascontiguousarray")(array, "dtype"_a = "float32");
    array_ = nb::cast<decltype(array_)>(array);
  }
  bool same = array_.ndim() == shape.size();
  for (std::size_t k = 0; same && k < shape.size(); ++k) same = array_.shape(k) == shape.begin()[k];
  if (!same) throw nb::value_error((std::string(name) + ": is " + described(value) + accepted).c_str());
  std::size_t outside = 0;
  for (std::size_t k = 0; k < array_.size(); ++k) outside += !(array_.data()[k] >= -most && array_.data()[k] <= most);
  if (outside == 0) return;
  std::size_t first = 0;
  while (array_.data()[first] >= -most && array_.data()[first] <= most) ++first;
  std::string place;
  for (std::size_t k = shape.size(), rest = first; k-- > 0; rest /= shape.begin()[k])
    place = "[" + std::to_string(rest % shape.begin()[k]) + "]" + place;
  throw nb::value_error((name + place + ": is " + io::shortest_digits(static_cast<double>(array_.data()[first])) +
                         ", one of " + std::to_string(outside) + " outside" + accepted + ", each from " +
                         io::shortest_digits(-static_cast<double>(most)) + " to " +
                         io::shortest_digits(static_cast<double>(most)))
                            .c_str());
}

Turn::Turn(std::atomic_flag& busy, const char* what) : busy_(busy) {
  if (busy_.test_and_set(std::memory_order_acquire))
    throw std::runtime_error(std::string(what) + ": another thread is in a call to it; accepted: one call at a time");
}

namespace {

std::mutex interruptible_guard;
int interruptible = 0;  ///< how many Interruptible live, in all threads
struct sigaction of_interrupt {
}, of_terminate{};

}  // namespace

Interruptible::Interruptible() {
  const std::scoped_lock lock(interruptible_guard);
  if (interruptible++ > 0) return;
  sigaction(SIGINT, nullptr, &of_interrupt);
  sigaction(SIGTERM, nullptr, &of_terminate);
  io::stop_on_interrupt();
}

Interruptible::~Interruptible() {
  const std::scoped_lock lock(interruptible_guard);
  if (--interruptible > 0) return;
  sigaction(SIGINT, &of_interrupt, nullptr);
  sigaction(SIGTERM, &of_terminate, nullptr);
  io::forget_interrupt();
}

void raise_interrupt() {
  PyErr_SetNone(PyExc_KeyboardInterrupt);
  throw nb::python_error();
}

std::filesystem::path found(const std::filesystem::path& file) {
  const std::filesystem::path own = io::configs_folder() / file;
  return !std::filesystem::exists(file) && std::filesystem::exists(own) ? own : file;
}

std::size_t checked_index(std::int64_t i, std::size_t count) {
  const auto n = static_cast<std::int64_t>(count);
  if (i < -n || i >= n)
    throw nb::index_error(
        ("index " + std::to_string(i) + ": accepted: " + std::to_string(-n) + " to " + std::to_string(n - 1)).c_str());
  return static_cast<std::size_t>(i < 0 ? i + n : i);
}

}  // namespace flappy::python

NB_MODULE(_core, m) {
  using namespace flappy::python;
  nb::exception<flappy::io::InputError>(m, "InputError", PyExc_ValueError);
  m.def("configs_folder", [] { return flappy::io::configs_folder(); });
  bind_vehicle(m);
  bind_environments(m);
  bind_flights(m);
  bind_policy(m);
  bind_diagnosis(m);
  bind_export(m);
}
