// The forward kernels of a direct block over a scalar T.
#pragma once

#include <array>
#include <tuple>

#include "core/blocks/fours.h"
#include "core/blocks/supernodes.h"
#include "core/blocks/wide.h"
#include "core/constraints/registry.h"

namespace sheetbend {

template <class K, class T>
void evaluate_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* rows = indices_of<T>(r.first_row, 1, n);
    const int* gradients = indices_of<T>(r.gradients, K::arity, n);
    const auto e = load_element<K, T>(b.x, r, indices_of<T>(r.nodes, K::arity, n), n);
    const Evaluation<K, Wide<T>> value(e.x, e.p);
    Wide<T> lambda[K::rows], C_r[K::rows];
    for (int j = 0; j < K::rows; ++j) {
      lambda[j] = gather(numbers_of<T>(b.lambda), rows, j);
      if (r.damped) C_r[j] = gather(numbers_of<T>(b.C_r), rows, j);
    }
    for (int j = 0; j < K::rows; ++j) {
      scatter(numbers_of<T>(b.dl), rows, j,
              -(e.residual(value.C, lambda, r.damped ? C_r : nullptr, j) * e.rates.scale));
      for (int k = 0; k < K::arity; ++k)
        store_gradient(numbers_of<T>(b.gradients), gradients + k * Pack::lanes, j, value.J + j * K::dofs + 3 * k);
    }
  }
}

template <class K, class T>
void values_of_run(const sheetbend_blocks::Values& b, const sheetbend_blocks::Run& r) {
  using W = Wide<T>;
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* nodes = indices_of<T>(r.nodes, K::arity, n);
    W x[K::dofs], unused;
    for (int k = 0; k < K::arity; ++k) load_particle(numbers_of<T>(b.x), nodes + k * Pack::lanes, x + 3 * k, unused);
    const Evaluation<K, W> value(x, parameters_of<K, T>(r, n));
    for (int j = 0; j < K::rows; ++j) scatter(numbers_of<T>(b.C), indices_of<T>(r.first_row, 1, n), j, value.C[j]);
  }
}

template <class K, class T>
void refer_run(const sheetbend_blocks::References& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* rows = indices_of<T>(r.first_row, 1, n);
    for (int j = 0; j < K::rows; ++j) {
      const Wide<T> now = gather(numbers_of<T>(b.C), rows, j);
      const Wide<T> before = gather(numbers_of<T>(b.C_before), rows, j);
      scatter(numbers_of<T>(b.C_r), rows, j,
              b.before == 0.0 ? now : now - Wide<T>(b.before) * difference<K>(now, before));
    }
  }
}

// A += w G G^T of one particle's `count` gradient rows G, which follow one another from `column` on.
template <class T>
void add_window(const T* G, int count, const T& w, int band, T* column) {
  for (int k = 0; k < count; ++k, column += band + 1) {
    const T *Gk = G + 4 * k, wx = w * Gk[0], wy = w * Gk[1], wz = w * Gk[2];
    for (int i = 0; i < count - k; ++i) {
      const T* Gi = Gk + 4 * i;
      column[i] += wx * Gi[0] + wy * Gi[1] + wz * Gi[2];
    }
  }
}

// J^T b of one particle.
template <class T>
Vec3<T> transpose_times_at(const sheetbend_blocks::Block& block, int particle, const T* b) {
  Vec3<T> sum;
  for (int k = block.window[particle]; k < block.window[particle + 1]; ++k)
    sum = sum + b[block.rows[k]] * Vec3<T>(numbers_of<T>(block.gradients) + sheetbend_blocks::row * k);
  return sum;
}

template <class T>
struct ForwardKernels {
  using Block = sheetbend_blocks::Block;

  static void evaluate(const Block& b) {
    for (int r = 0; r < b.run_count; ++r) evaluate_of[b.runs[r].kind](b, b.runs[r]);
  }

  static void factor(const Block& b) {
    T *A = numbers_of<T>(b.matrix), *inverse = numbers_of<T>(b.inverse);
    const T *diagonal = numbers_of<T>(b.diagonal), *x = numbers_of<T>(b.x), *G = numbers_of<T>(b.gradients);
    with_band(b.band, [&]<int Band>() {
      const int band = b.band;
      T* columns = A + band * (band + 1);
      for (int j = 0; j < b.size; ++j) {
        T* column = columns + static_cast<long>(j) * (band + 1);
        column[0] = diagonal[j];
        for (int i = 1; i <= band; ++i) column[i] = T(0.0);
      }
      for (int p = 0; p < b.movable; ++p) {
        const int begin = b.window[p];
        const int count = b.window[p + 1] - begin;
        const T *rows = G + sheetbend_blocks::row * static_cast<long>(begin), w = x[sheetbend_blocks::row * p + 3];
        T* to = columns + static_cast<long>(b.rows[begin]) * (band + 1);
        if constexpr (members_in_lanes<T> && has_fours && Band > 0)
          add_window_by_fours<Band>(rows, count, w, to);
        else
          add_window(rows, count, w, band, to);
      }
      if constexpr (members_in_lanes<T> && has_fours && Band >= least_band_in_fours)
        factorize_band_by_fours<Band>(b.size, A, inverse);
      else
        factorize_band<Band>(b.size, band, A, inverse);
    });
  }

  static void solve(const Block& b, double* right_side) {
    with_band(b.band, [&]<int Band>() {
      solve_band<Band>(b.size, b.band, numbers_of<T>(b.matrix), numbers_of<T>(b.inverse), numbers_of<T>(right_side));
    });
  }

  static void push(const Block& b) {
    const T* dl = numbers_of<T>(b.dl);
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      const T* x = numbers_of<T>(b.x) + at;
      T *u = numbers_of<T>(b.u) + at, *x_next = numbers_of<T>(b.x_next) + at;
      const T w = x[3];
      const Vec3<T> push = p < b.movable ? transpose_times_at(b, p, dl) : Vec3<T>();
      push.store(u);
      (Vec3<T>(x) + w * push).store(x_next);
      x_next[3] = w;
    }
    for (int j = 0; j < b.size; ++j) numbers_of<T>(b.lambda_next)[j] = numbers_of<T>(b.lambda)[j] + dl[j];
  }

  static void values(const sheetbend_blocks::Values& b) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) values_of[b.runs[r].kind](b, b.runs[r]);
  }

  static void refer(const sheetbend_blocks::References& b) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) refer_of[b.runs[r].kind](b, b.runs[r]);
  }

  static void factor_supernodes(const sheetbend_blocks::Supernodes& s, double* panels, double* inverse, double* work,
                                int* place) {
    SupernodalFactor<T>{s, numbers_of<T>(panels), numbers_of<T>(inverse), numbers_of<T>(work), place}.factorize();
  }

  static constexpr auto evaluate_of = []<class... K>(std::tuple<K...>*) {
    return std::array{&evaluate_run<K, T>...};
  }(static_cast<Registry*>(nullptr));

  static constexpr auto values_of = []<class... K>(std::tuple<K...>*) {
    return std::array{&values_of_run<K, T>...};
  }(static_cast<Registry*>(nullptr));

  static constexpr auto refer_of = []<class... K>(std::tuple<K...>*) {
    return std::array{&refer_run<K, T>...};
  }(static_cast<Registry*>(nullptr));

  static constexpr sheetbend_blocks::Forward all{&evaluate, &factor,           &solve, &push, &values,
                                                 &refer,    &factor_supernodes};
};

}  // namespace sheetbend
