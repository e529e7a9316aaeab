// List of all controllers. A new one is a file with a table of functions, and a place in the list; no other code names
// it. A table C has
//   kName                        its name in configurations
//   Constants<T>, Memory<T>      its constants, beginning with LoopConstants<T>, and its memory; all members are T
//   fields(constants, add)       add(key, number, range) for each parameter of its configuration; a fourth argument is the
//                                value of one that need not be given
//   derive(constants)            optional: constants that follow from others, once those of the loop are known
//   start(memory, estimate)      memory, all 0 before, at the start of a flight
//   update(constants, memory, estimate, set point)    inputs of the wing beat for the next control period
//   trim(constants, memory)      the inputs that it has learnt to hold; in a settled vehicle, those of hover
//   unlearn(held, before, now)   restores the learnt part of the memory in the lanes `held`
//   rotate(sin, cos, memory)     rotates the memory about z of W
//   kSource, exported(constants, add)    only if exported: C code (kSource.h, kSource_types.h in src/deploy/c),
//                                and add(member, number or struct of numbers) for each of its constants there
#pragma once

#include <algorithm>
#include <tuple>

#include "flight/arc.hpp"
#include "flight/pid.hpp"
#include "model/flapper.hpp"

namespace flappy::flight {
inline namespace FLAPPY_ISA {

using Controllers = std::tuple<PidController, ArcController>;

/// A controller is identified by its index in the list.
inline constexpr int kNoController = -1, kControllers = std::tuple_size_v<Controllers>;

template <class C, int I = 0>
constexpr int kind_of() {
  if constexpr (std::is_same_v<C, std::tuple_element_t<I, Controllers>>) return I;
  else return kind_of<C, I + 1>();
}

/// Calls `use(table)` for the controller of this kind; does nothing for kNoController.
template <int I = 0>
FLAPPY_INLINE void with_controller(int kind, const auto& use) {
  if constexpr (I < kControllers) {
    if (kind == I) use(std::tuple_element_t<I, Controllers>{});
    else with_controller<I + 1>(kind, use);
  }
}

template <class T, class List>
struct ConstantsOf;
template <class T, class... C>
struct ConstantsOf<T, std::tuple<C...>> : C::template Constants<T>... {
  static constexpr int kRows = std::max({model::kRows<C::template Memory>...});
};

template <class T>
struct ControllerConstants : ConstantsOf<T, Controllers> {
  template <class C>
  FLAPPY_INLINE const typename C::template Constants<T>& of() const {
    return *this;
  }
  template <class C>
  FLAPPY_INLINE typename C::template Constants<T>& of() {
    return *this;
  }
};

/// Rows of memory: those of the controller that needs most.
inline constexpr int kControllerRows = ControllerConstants<float>::kRows;

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
