// BiCGSTAB, preconditioned from the right (van der Vorst 1992; Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., sec. 7.4.2), for matrices that
// need not be symmetric. Vectors are rows of four numbers, of which the last may be unused (zero).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/scalar/numbers.h"

namespace sheetbend {

// Four sums that do not wait for one another, of rows.
inline double product_of_rows(const double* a, const double* b, std::size_t size) {
  std::array<double, 4> sum{};
  for (std::size_t i = 0; i < size; i += 4)
    for (std::size_t k = 0; k < 4; ++k) sum[k] += a[i + k] * b[i + k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

class Bicgstab {
 public:
  // Rows that are solved for, and behind them rows that stay zero.
  void resize(std::size_t rows, std::size_t fixed) {
    size_ = 4 * rows;
    for (auto* a : vectors()) a->assign(size_ + 4 * fixed);
  }
  static std::size_t bytes(std::size_t rows, std::size_t fixed) {
    return vector_count * Numbers<double>::bytes(4 * (rows + fixed));
  }

  // Goes to the solution x of A x = b, from zero, until no more than `tolerance` of b is left: A.multiply(p, q) is q = A p, A.precondition(r, z) is
  // z = M^-1 r. False where `most` iterations, of two products each, do not do.
  template <class Matrix>
  bool solve(const Matrix& A, double tolerance, int most) {
    double *r = b.data(), *solution = x.data(), *p = p_.data(), *v = v_.data(), *t = t_.data(), *y = y_.data();
    const double enough = tolerance * tolerance * product_of_rows(r, r, size_);
    std::copy_n(r, size_, shadow_.data());
    for (auto* a : {&x, &p_, &v_}) std::fill_n(a->data(), size_, 0.0);
    double along = 1.0, step = 1.0, turn = 1.0;
    for (int iteration = 0; !(product_of_rows(r, r, size_) <= enough); ++iteration) {
      if (iteration == most) return false;
      const double next = product_of_rows(shadow_.data(), r, size_), back = next / along * (step / turn);
      along = next;
      for (std::size_t i = 0; i < size_; ++i) p[i] = r[i] + back * (p[i] - turn * v[i]);
      A.precondition(p, y);
      A.multiply(y_, v_);
      step = along / product_of_rows(shadow_.data(), v, size_);
      for (std::size_t i = 0; i < size_; ++i) solution[i] += step * y[i], r[i] -= step * v[i];
      A.precondition(r, y);
      A.multiply(y_, t_);
      turn = product_of_rows(t, r, size_) / product_of_rows(t, t, size_);
      if (!std::isfinite(turn)) turn = 0.0;  // nothing is left of r
      for (std::size_t i = 0; i < size_; ++i) solution[i] += turn * y[i], r[i] -= turn * t[i];
      if (turn == 0.0) return product_of_rows(r, r, size_) <= enough;
    }
    return true;
  }

  Numbers<double> b, x;  // b is what is left of it afterwards

 private:
  static constexpr int vector_count = 7;
  std::array<Numbers<double>*, vector_count> vectors() { return {&b, &x, &shadow_, &p_, &v_, &t_, &y_}; }

  std::size_t size_ = 0;
  Numbers<double> shadow_, p_, v_, t_, y_;
};

}  // namespace sheetbend
