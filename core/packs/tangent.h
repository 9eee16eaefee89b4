// Eight directions beside a value: what the kernels of tangents compute with, and where they find it.
#pragma once

#include "core/packs/lanes.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// A value in every lane of a register and one direction in each.
using Tangent = Dual<Register, 1>;

// Register `lane`/register_lanes of the directions that belong to number `i`.
inline Register& directions_at(double* directions, long i, int lane) {
  return *reinterpret_cast<Register*>(directions + Pack::lanes * i + lane);
}
inline const Register& directions_at(const double* directions, long i, int lane) {
  return *reinterpret_cast<const Register*>(directions + Pack::lanes * i + lane);
}
inline Tangent tangent_at(const double* values, const double* directions, long i, int lane) {
  Tangent a{Register(values[i])};
  a.d[0] = directions_at(directions, i, lane);
  return a;
}

}  // namespace sheetbend
