// Arrays of scalars as the kernels of direct blocks see them.
#pragma once

#include <algorithm>
#include <vector>

#include "core/blocks/wide.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// Duals of forward rollouts: their values go through the kernels of plain numbers, their directions through kernels of their own. Those that are
// reversed as well (one direction) stay whole.
template <class T>
inline constexpr bool carries_tangents = false;
template <int N>
inline constexpr bool carries_tangents<Dual<double, N>> = N == 4 || N == 8;

// What the kernels of values compute with.
template <class T>
using Plain = std::conditional_t<carries_tangents<T>, double, T>;

// Aligned for packs.
template <class T>
class Numbers {
 public:
  void assign(std::size_t count) {
    const std::size_t width = sizeof(Wide<T>) / sizeof(T);
    wide_.assign((count + width - 1) / width, Wide<T>(0.0));
  }
  void clear() { std::fill(wide_.begin(), wide_.end(), Wide<T>(0.0)); }
  T* data() { return reinterpret_cast<T*>(wide_.data()); }
  double* numbers() { return reinterpret_cast<double*>(wide_.data()); }
  T& operator[](std::size_t i) { return data()[i]; }

 private:
  std::vector<Wide<T>> wide_;
};

// Values and directions apart, with room for eight directions.
template <int N>
  requires carries_tangents<Dual<double, N>>
class Numbers<Dual<double, N>> {
 public:
  using D = Dual<double, N>;
  class Reference {
   public:
    Reference(double& value, double* directions) : value_(value), directions_(directions) {}
    operator D() const {
      D a(value_);
      std::copy_n(directions_, N, a.d);
      return a;
    }
    void operator=(const D& a) const {
      value_ = a.v;
      std::copy_n(a.d, N, directions_);
    }

   private:
    double& value_;
    double* directions_;
  };

  void assign(std::size_t count) {
    values_.assign(count);
    directions_.assign(count);
  }
  double* data() { return values_.data(); }
  double* numbers() { return values_.numbers(); }
  double* directions() { return directions_.numbers(); }
  Reference operator[](std::size_t i) { return {values_[i], directions() + Pack::lanes * i}; }

 private:
  Numbers<double> values_;
  Numbers<Pack> directions_;
};

}  // namespace sheetbend
