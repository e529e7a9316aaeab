// Shared by the parts of the module: arrays that Python owns, checks of arguments, and error messages that describe them.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <span>
#include <string>

namespace flappy::python {

namespace nb = nanobind;
using namespace nb::literals;

template <class T>
using Array = nb::ndarray<nb::numpy, T, nb::c_contig, nb::device::cpu>;

/// Describes a value as NumPy sees it: "float64 of shape (3, 4)".
std::string described(nb::handle value);
std::string shape_text(std::span<const std::size_t> shape);

/// Converts a Python array to floats of a given shape: float32 as it is, other floats rounded. Throws TypeError for other types, and
/// ValueError, with both shapes in the message, for another shape and for numbers that are not within +-`most`.
class Floats {
 public:
  Floats(nb::handle value, const char* name, std::initializer_list<std::size_t> shape, float most);
  const float* data() const { return array_.data(); }

 private:
  nb::ndarray<const float, nb::c_contig, nb::device::cpu> array_;
};

/// A new array of zeros that Python owns.
template <class T>
Array<T> make_array(std::initializer_list<std::size_t> shape) {
  std::size_t size = 1;
  for (const std::size_t n : shape) size *= n;
  auto* data = new T[size]();
  return Array<T>(data, shape.size(), shape.begin(),
                  nb::capsule(data, [](void* p) noexcept { delete[] static_cast<T*>(p); }));
}

/// Admits one call at a time: throws RuntimeError while another thread is in a call.
class Turn {
 public:
  Turn(std::atomic_flag& busy, const char* what);
  ~Turn() { busy_.clear(std::memory_order_release); }
  Turn(const Turn&) = delete;

 private:
  std::atomic_flag& busy_;
};

/// While any of these lives, Ctrl-C stops our work early (io::interrupted()); afterwards Python handles it again.
class Interruptible {
 public:
  Interruptible();
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
};

/// Raises KeyboardInterrupt.
[[noreturn]] void raise_interrupt();

/// Finds a file: `file` itself, or else a configuration of the package, such as "fly/hover.toml".
std::filesystem::path found(const std::filesystem::path& file);

/// For a class that can be copied: copy.copy(x) and copy.deepcopy(x) are copies of the state.
template <class T>
void bind_copies(nb::class_<T>& type) {
  type.def(
      "__copy__", [](const T& x) { return std::make_unique<T>(x); }, "A copy of the state.");
  type.def(
      "__deepcopy__", [](const T& x, const nb::dict&) { return std::make_unique<T>(x); }, "memo"_a,
      "A copy of the state.");
}

/// Checks an index, which counts from the end where it is negative. Throws IndexError.
std::size_t checked_index(std::int64_t i, std::size_t count);

void bind_vehicle(nb::module_& m);
void bind_environments(nb::module_& m);
void bind_flights(nb::module_& m);
void bind_policy(nb::module_& m);
void bind_diagnosis(nb::module_& m);
void bind_export(nb::module_& m);

}  // namespace flappy::python
