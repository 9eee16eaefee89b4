// The states around a substep, and the coordinates in between.
#pragma once

#include "core/solver/first_order.h"

namespace sheetbend {

// The states that a substep reads.
template <class T>
struct SubstepStates {
  const T *x, *x_before, *v, *v_before;  // at n and n-1 (n-1 unused by BDF1)
  int step = -1;                         // n, by which a rollout's states are known again; -1 where it has none
  const T* x_next = nullptr;             // at n+1, where the reverse of implicit blocks knows it
  AfterImpact<T> after_impact = {};      // of a rollout of BDF2
};

// Coordinates while they are corrected: node n's begin at stride n.
template <class T>
struct Coordinates {
  T* data;
  int stride;
  T* of(int node) const { return data + static_cast<long>(stride) * node; }
};

}  // namespace sheetbend
