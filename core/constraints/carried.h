// Constraints between points and directions that bodies carry. A law K says what C is of a few vectors y_k, and each vector is a weighted sum of nodes:
//
//   BodyPoint       p + b1 a1 + b2 a2 + b3 a3      the material point b of a body (core/scene/bodies.h)
//   BodyDirection   b1 a1 + b2 a2 + b3 a3          the direction b in a body
//   NodeItself      the node's own place
//
// so that C = K(y), dC/dx_i = sum_k b_ki dK/dy_k. The weights are parameters, so that gradients with respect to places on bodies follow; they stand first, vector
// by vector, and K's own parameters after them. K subtracts these from its rows, unless it says `inner_parameters = parameters`: then it may use them anywhere. The stencil has its points first (centers of bodies, particles), then three
// axes per body, then dials.
//
//   struct Law { static constexpr int vectors, rows; bool linear;    linear: in the vectors
//     template <class T> static void evaluate(const T* y, const T* p, T* C, T* J); };   J is rows x 3 vectors, fully written
//
// A joint is one header: a law where no other fits, and a struct with its name, unit and parameters that derives from Carried.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/dual.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

// `Center` and `Axes` are places in the stencil.
template <int Center, int Axes>
struct BodyPoint {
  static constexpr int weights = 3;
  // Calls f(node, weight) for the nodes that have a parameter as weight, and g(node) for the others.
  template <class F, class G>
  static void each(F&& f, G&& g) {
    g(Center);
    for (int i = 0; i < 3; ++i) f(Axes + i, i);
  }
};

template <int Axes>
struct BodyDirection {
  static constexpr int weights = 3;
  template <class F, class G>
  static void each(F&& f, G&&) {
    for (int i = 0; i < 3; ++i) f(Axes + i, i);
  }
};

template <int Node>
struct NodeItself {
  static constexpr int weights = 0;
  template <class F, class G>
  static void each(F&&, G&& g) {
    g(Node);
  }
};

template <class Law, int Points, int Bodies, int Dials, class... Vectors>
struct CarriedOn : OnPoints<Points + 3 * Bodies + Dials> {
  static constexpr int points = Points, axes = 3 * Bodies, dials = Dials, rows = Law::rows;
  static constexpr int dofs = 3 * (Points + 3 * Bodies + Dials), vectors = sizeof...(Vectors), width = 3 * vectors;
  static constexpr int weights = (Vectors::weights + ... + 0);
  static constexpr int inner = [] {
    if constexpr (requires { Law::inner_parameters; }) return Law::inner_parameters;
    return 0;
  }();
  static_assert(vectors == Law::vectors, "give a vector for each that the law takes");

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    T y[width], by[rows * width];
    sums(x, p, y);
    Law::evaluate(y, p + weights, C, by);
    for (int d = 0; d < rows * dofs; ++d) J[d] = T(0.0);
    for (int j = 0; j < rows; ++j) spread(by + j * width, p, J + j * dofs);
  }

  // With v_j = dl_j a - y_j b, summed over its nodes as x is: the law's Hessian takes it, and the weights get what they multiply in C and in v_j . J_j.
  template <class T>
  static void reverse(const T* x, const T* p, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T* p_bar) {
    using D = Dual<T, 1 + inner>;
    D at[width], own[16], C[rows], by[rows * width];
    T s[width], along_a[width], along_b[width], bar[width];
    sums(x, p, s);
    sums(a, p, along_a);
    sums(b, p, along_b);
    for (int d = 0; d < width; ++d) at[d].v = s[d], bar[d] = T(0.0);
    for (int k = 0; k < Law::parameters; ++k) own[k].v = p[weights + k];
    for (int k = 0; k < inner; ++k) own[k].d[1 + k] = T(1.0);
    for (int j = 0; j < rows; ++j) {
      if (j == 0 || !Law::linear) {
        for (int d = 0; d < width; ++d) at[d].d[0] = dl[j] * along_a[d] - y[j] * along_b[d];
        Law::evaluate(at, own, C, by);
      }
      if constexpr (!Law::linear)
        for (int d = 0; d < width; ++d) bar[d] += by[j * width + d].d[0];
      for_each_weight([&](int vector, int node, int weight) {
        for (int d = 0; d < 3; ++d) {
          const int i = 3 * node + d;
          p_bar[weight] += by[j * width + 3 * vector + d].v * (dl[j] * a[i] - y[j] * (b[i] + x[i]));
        }
      });
      if constexpr (inner > 0)
        for (int k = 0; k < inner; ++k) {
          p_bar[weights + k] -= y[j] * C[j].d[1 + k];
          for (int d = 0; d < width; ++d)
            p_bar[weights + k] += by[j * width + d].d[1 + k] * (dl[j] * along_a[d] - y[j] * along_b[d]);
        }
      else if constexpr (Law::parameters > 0)
        if (j < Law::parameters) p_bar[weights + j] += y[j];
    }
    if constexpr (Law::linear) return;
    for_each_weight([&](int vector, int node, int weight) {
      p_bar[weight] += dot(Vec3<T>(bar + 3 * vector), Vec3<T>(x + 3 * node));
    });
    spread(bar, p, x_bar);
  }

  // H += sum_j lambda_j B^T Hess(K_j) B.
  template <class T>
  static void add_hessian(const T* x, const T* p, const T* lambda, T* H) {
    if constexpr (!Law::linear) {
      using D = Dual<T, width>;
      D at[width], own[16], C[rows], by[rows * width];
      T y[width], bend[width * width];
      sums(x, p, y);
      for (int d = 0; d < width; ++d) at[d].v = y[d], at[d].d[d] = T(1.0);
      for (int k = 0; k < Law::parameters; ++k) own[k].v = p[weights + k];
      Law::evaluate(at, own, C, by);
      for (int a = 0; a < width; ++a)
        for (int b = 0; b < width; ++b) {
          bend[a * width + b] = T(0.0);
          for (int j = 0; j < rows; ++j) bend[a * width + b] += lambda[j] * by[j * width + a].d[b];
        }
      for_each_part(p, [&](int k, int i, const T& weight) {
        for_each_part(p, [&](int l, int n, const T& other) {
          if (n > i) return;
          const T both = weight * other;
          for (int a = 0; a < 3; ++a)
            for (int b = 0; b < (n == i ? a + 1 : 3); ++b)
              H[triangle(3 * i + a) + 3 * n + b] += both * bend[(3 * k + a) * width + 3 * l + b];
        });
      });
    }
  }

 private:
  // Calls f(vector, node, weight) for every node of every vector.
  template <class T, class F>
  static void for_each_part(const T* p, F&& f) {
    int vector = 0;
    (..., [&] {
      Vectors::each([&](int node, int i) { f(vector, node, p[i]); }, [&](int node) { f(vector, node, T(1.0)); });
      ++vector, p += Vectors::weights;
    }());
  }

  // Calls f(vector, node, parameter).
  template <class F>
  static void for_each_weight(F&& f) {
    int vector = 0, first = 0;
    (..., [&] {
      Vectors::each([&](int node, int i) { f(vector, node, first + i); }, [](int) {});
      ++vector, first += Vectors::weights;
    }());
  }

  // y = B x.
  template <class T>
  static void sums(const T* x, const T* p, T* y) {
    (..., [&] {
      Vec3<T> sum(T(0.0), T(0.0), T(0.0));
      Vectors::each([&](int node, int i) { sum = sum + p[i] * Vec3<T>(x + 3 * node); },
                    [&](int node) { sum = sum + Vec3<T>(x + 3 * node); });
      sum.store(y);
      y += 3, p += Vectors::weights;
    }());
  }

  // x_bar += B^T y_bar.
  template <class T>
  static void spread(const T* y_bar, const T* p, T* x_bar) {
    (..., [&] {
      const Vec3<T> bar(y_bar);
      Vectors::each([&](int node, int i) { (p[i] * bar).add_to(x_bar + 3 * node); },
                    [&](int node) { bar.add_to(x_bar + 3 * node); });
      y_bar += 3, p += Vectors::weights;
    }());
  }
};

// Two bodies p + a1 a2 a3, q + b1 b2 b3 as the stencil (p, q, a1, a2, a3, b1, b2, b3).
template <class Law, class... Vectors>
using OnTwoBodies = CarriedOn<Law, 2, 2, 0, Vectors...>;

// Parameters.
template <std::size_t... N>
constexpr auto joined(const std::array<Parameter, N>&... parts) {
  std::array<Parameter, (N + ... + 0)> all{};
  auto to = all.begin();
  (..., (to = std::copy(parts.begin(), parts.end(), to)));
  return all;
}
constexpr std::array<Parameter, 3> place_in_body(const char* x, const char* y, const char* z) {
  return {Parameter{x, units::meters, ranges::any, defaults::given},
          Parameter{y, units::meters, ranges::any, defaults::given},
          Parameter{z, units::meters, ranges::any, defaults::given}};
}
constexpr std::array<Parameter, 3> direction_in_body(const char* x, const char* y, const char* z) {
  return {Parameter{x, units::none, ranges::any, defaults::given},
          Parameter{y, units::none, ranges::any, defaults::given},
          Parameter{z, units::none, ranges::any, defaults::given}};
}

}  // namespace sheetbend
