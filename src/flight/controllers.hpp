// Every controller. A new one is a file with its table of functions, and added to the list here; nothing else knows it by name.
//
// A table C has
//   kName                        what configurations call it
//   Constants<T>, Memory<T>      what it is told, beginning with LoopConstants<T>, and what it remembers; all members are T
//   fields(constants, add)       add(key, number, range) for each number of its configuration
//   start(memory, estimate)      memory, all 0 before, at the start of a flight
//   update(constants, memory, estimate, set point)    inputs of the wing beat for the next control period
//   trim(constants, memory)      the inputs that it has learnt: those of a settled vehicle
//   unlearn(held, before, now)   takes back what it learnt in the last period in the lanes `held`
//   rotate(sin, cos, memory)     memory of a flight that is rotated about z of W
//   kSource, exported(constants, add)    where it can be exported: its C code (kSource.h and kSource_types.h in src/deploy/c),
//                                        and add(member, number or struct of numbers) for each of its constants there
#pragma once

#include <algorithm>
#include <tuple>

#include "flight/arc.hpp"
#include "flight/pid.hpp"
#include "model/flapper.hpp"

namespace flappy::flight {
inline namespace FLAPPY_ISA {

using Controllers = std::tuple<PidController, ArcController>;

/// A kind of controller is its index in the list.
inline constexpr int kNoController = -1, kControllers = std::tuple_size_v<Controllers>;

template <class C, int I = 0>
constexpr int kind_of() {
  if constexpr (std::is_same_v<C, std::tuple_element_t<I, Controllers>>) return I;
  else return kind_of<C, I + 1>();
}

/// Calls `use(table)` for the controller of this kind; not at all where there is none.
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

/// Constants of all controllers.
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

/// Rows that suffice for the memory of any.
inline constexpr int kControllerRows = ControllerConstants<float>::kRows;

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
