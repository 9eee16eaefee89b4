// An element of a solid with N nodes at one of its quadrature points: F = sum_k x_k (x) grad N_k, where grad N_k are the gradients of the element's shape
// functions with respect to the material's own axes 1, 2, 3 at rest. The first parameters of a kind are the gradients of all nodes but the first, whose gradient
// makes their sum zero.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template <int N>
struct SolidElement : OnPoints<N> {
  static constexpr int gradients = 3 * (N - 1);

  // sum_k dN_k/da v_k: F's column a of positions v.
  template <class T>
  static Vec3<T> summed(const T* v, const T* p, int a) {
    const Vec3<T> origin(v);
    Vec3<T> sum = p[a] * (Vec3<T>(v + 3) - origin);
    for (int k = 2; k < N; ++k) sum = sum + p[3 * (k - 1) + a] * (Vec3<T>(v + 3 * k) - origin);
    return sum;
  }
  // dN_k/da of all nodes.
  template <class T>
  static void find_gradients(const T* p, T (*all)[3], int a) {
    T sum = p[a];
    for (int k = 1; k < N; ++k) all[k][a] = p[3 * (k - 1) + a];
    for (int k = 2; k < N; ++k) sum += all[k][a];
    all[0][a] = -sum;
  }
  // A kind's `reverse` (concept.h) through F's column i, where A and B are made of a and b as F is of x: `bar`, `to` and `of` are the derivatives of
  // sum_j v_j . J_j with respect to F and A, and of sum_j y_j C_j with respect to F.
  template <class T>
  static void add_reverse(int i, const T* x, const T* p, const T* a, const T* b, const Vec3<T>& bar, const Vec3<T>& to,
                          const Vec3<T>& of, T* x_bar, T* p_bar) {
    Vec3<T> first_bar = p[i] * bar;
    for (int k = 1; k < N; ++k) {
      const int at = 3 * (k - 1) + i;
      const auto edge = [k](const T* v) { return Vec3<T>(v + 3 * k) - Vec3<T>(v); };
      (p[at] * bar).add_to(x_bar + 3 * k);
      if (k > 1) first_bar = first_bar + p[at] * bar;
      p_bar[at] += dot(edge(x), bar - of) + dot(edge(a), to) - dot(edge(b), of);
    }
    (-first_bar).add_to(x_bar);
  }
};

// Fills the names of the first N nodes' gradients but one; returns how many parameters they are.
template <int N, class Parameters>
constexpr int name_gradients(Parameters& all) {
  constexpr const char* names[] = {"N1_1", "N1_2", "N1_3", "N2_1", "N2_2", "N2_3", "N3_1",
                                   "N3_2", "N3_3", "N4_1", "N4_2", "N4_3", "N5_1", "N5_2",
                                   "N5_3", "N6_1", "N6_2", "N6_3", "N7_1", "N7_2", "N7_3"};
  constexpr int count = 3 * (N - 1);
  for (int k = 0; k < count; ++k) all[k] = {names[k], units::per_meter, ranges::any, defaults::given};
  return count;
}

}  // namespace sheetbend
