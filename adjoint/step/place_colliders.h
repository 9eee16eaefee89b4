// The reverse of PlaceColliders. Stages that read poses hand on their cotangents themselves, each as a whole, so that sums keep their order.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/place_colliders.h"

namespace sheetbend {

template <>
struct ReverseOf<PlaceColliders> {
  template <class T>
  using Scratch = Nothing;
  template <class T>
  static void run(const Step<T>&, const Work<T>&, PlaceColliders::Record<T>&, Nothing&, const StepCotangents<T>&) {}
};

}  // namespace sheetbend
