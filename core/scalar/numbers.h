// Arrays of scalars as kernels see them: aligned for packs, the directions of duals apart from their values.
#pragma once

#include <algorithm>
#include <type_traits>
#include <vector>

#include "core/scalar/dual.h"
#include "core/scalar/pack.h"

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

template <class T>
class Numbers {
 public:
  void assign(std::size_t count) { wide_.assign(bytes(count) / sizeof(Aligned), Aligned(0.0)); }
  static std::size_t bytes(std::size_t count) {
    return (count * sizeof(T) + sizeof(Aligned) - 1) / sizeof(Aligned) * sizeof(Aligned);
  }
  void clear() { std::fill(wide_.begin(), wide_.end(), Aligned(0.0)); }
  T* data() { return reinterpret_cast<T*>(wide_.data()); }
  double* numbers() { return reinterpret_cast<double*>(wide_.data()); }
  T& operator[](std::size_t i) { return data()[i]; }
  bool empty() const { return wide_.empty(); }

 private:
  using Aligned = std::conditional_t<std::is_same_v<T, double>, Pack, T>;
  std::vector<Aligned> wide_;
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
  void clear() {
    values_.clear();
    directions_.clear();
  }
  bool empty() const { return values_.empty(); }
  double* data() { return values_.data(); }
  double* numbers() { return values_.numbers(); }
  double* directions() { return directions_.numbers(); }
  Reference operator[](std::size_t i) { return {values_[i], directions() + Pack::lanes * i}; }

 private:
  Numbers<double> values_;
  Numbers<Pack> directions_;
};

}  // namespace sheetbend
