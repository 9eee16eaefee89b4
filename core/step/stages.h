// The substep is a list of stages (substep.h). The substep itself, its reverse (adjoint/step/substep.h) and the count of its bytes are loops
// over that list, so a stage that stands in it is part of all three. A stage S is a struct with
//
//   template <class T> using Record             what it keeps: from one substep to the next, and for its own reverse
//     void resize(scene, plan, bool reversed)   allocates it; `reversed`: for a substep that will be reversed
//     static std::size_t bytes(scene, plan, bool reversed)   that resize() allocates, the Record itself left out
//   template <class T> static void forward(const Step<T>&, Work<T>&, Record<T>&)
//   static constexpr bool repeated              whether a reverse computes it again before it begins. All stages up to the projection are;
//                                               a later one reads what it found from the corrected coordinates
//
// T is any scalar: double, Pack, Complex, or a dual. The reverse of S is ReverseOf<S> (adjoint/step/stages.h), in the file of the same name in
// adjoint/step.
#pragma once

#include <tuple>
#include <utility>

#include "core/step/step.h"

namespace sheetbend {

// The Record of a stage that keeps nothing.
struct Nothing {
  template <class... Whatever>
  void resize(const Whatever&...) {}
  template <class... Whatever>
  static std::size_t bytes(const Whatever&...) {
    return 0;
  }
};

template <class... S>
struct Stages {
  // Calls f(S{}) for every stage, first to last.
  template <class F>
  static void forward(F&& f) {
    (f(S{}), ...);
  }
  // Last to first.
  template <class F>
  static void backward(F&& f) {
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      (f(std::tuple_element_t<sizeof...(S) - 1 - i, std::tuple<S...>>{}), ...);
    }(std::index_sequence_for<S...>{});
  }
};

// What all stages of a list keep.
template <class S, class T>
struct RecordOf {
  typename S::template Record<T> record;
};

template <class T, class List>
struct Records;

template <class T, class... S>
struct Records<T, Stages<S...>> : private RecordOf<S, T>... {
  template <class Stage>
  auto& of() {
    return static_cast<RecordOf<Stage, T>&>(*this).record;
  }
  template <class Stage>
  const auto& of() const {
    return static_cast<const RecordOf<Stage, T>&>(*this).record;
  }
  void resize(const Scene& scene, const Plan& plan, bool reversed) { (of<S>().resize(scene, plan, reversed), ...); }
  static std::size_t bytes(const Scene& scene, const Plan& plan, bool reversed) {
    return (std::size_t{0} + ... + S::template Record<T>::bytes(scene, plan, reversed));
  }
};

}  // namespace sheetbend
