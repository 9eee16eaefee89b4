// brick_neo_hookean, tetrahedron_neo_hookean: six rows of the deformation gradient F at a point of an element (solid_element.h) that store the energy of a
// neo-Hookean solid. With F = Q T, Q a rotation and T an upper triangle (Gram & Schmidt), and a, b, c on T's diagonal, J = det F = a b c,
//
//   C = (T_12, T_13, T_23, a - b, c (1 - a b), sqrt(2 a b) (1 - c)),     |C|^2 = |F|^2 - 4 J + J^2.
//
// With alpha = 1/(mu V) and a volume row of lambda (solid_volume.h) beside it the energy is, but for a constant, the one of Smith, de Goes & Kim 2018,
//
//   mu V (|F|^2 - 3)/2 + (lambda + mu) V (J - 1 - mu/(lambda + mu))^2/2:
//
// that of linear elasticity's lambda and mu for small strains, and of rubber for large ones. The rows |F| and J - 1 - mu/(lambda + mu) of Macklin & Mueller 2021 store
// it too, but pull against each other at rest, and a projection leaves out lambda Hess(C): all of the stiffness in shear. These rows are zero at rest. Their choice
// depends on the order of the axes, and what they store does not.
// Degenerate: the first two axes of the material lie along one line, where C has no gradient. Elements that are turned inside out, c < 0, have finite rows.
#pragma once

#include "core/constraints/solid_element.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// C of F's columns, and its derivative there, as a map of changes of F and transposed.
template <class T>
struct NeoHookeanRows {
  static constexpr int rows = 6;
  T a, b, c, t12, t13, t23, area, root, over_a, over_b;
  Vec3<T> e1, e2, e3;  // Q's columns

  explicit NeoHookeanRows(const Vec3<T>* F) {
    const Vec3<T> normal = cross(F[0], F[1]);
    const T one(1.0);
    a = norm(F[0]);
    area = norm(normal);
    over_a = one / a;
    e1 = over_a * F[0];
    e3 = (one / area) * normal;
    e2 = cross(e3, e1);
    b = area * over_a;
    over_b = one / b;
    c = dot(e3, F[2]);
    t12 = dot(e1, F[1]);
    t13 = dot(e1, F[2]);
    t23 = dot(e2, F[2]);
    root = sqrt(T(2.0) * area);
  }
  void values(T* C) const {
    const T one(1.0);
    C[0] = t12;
    C[1] = t13;
    C[2] = t23;
    C[3] = a - b;
    C[4] = c * (one - area);
    C[5] = root * (one - c);
  }
  // dC of a change D of F. e1 turns by (p, q) towards e2 and e3, and e2 by r towards e3.
  void times(const Vec3<T>* D, T* dC) const {
    const T one(1.0);
    const T p = over_a * dot(e2, D[0]), q = over_a * dot(e3, D[0]), r = over_b * (dot(e3, D[1]) - t12 * q);
    const T da = dot(e1, D[0]), db = dot(e2, D[1]) - t12 * p, dc = dot(e3, D[2]) - t13 * q - t23 * r;
    const T darea = b * da + a * db;
    dC[0] = dot(e1, D[1]) + b * p;
    dC[1] = dot(e1, D[2]) + t23 * p + c * q;
    dC[2] = dot(e2, D[2]) - t13 * p + c * r;
    dC[3] = da - db;
    dC[4] = (one - area) * dc - c * darea;
    dC[5] = (one - c) / root * darea - root * dc;
  }
  // The derivative of y . C with respect to F.
  void transpose_times(const T* y, Vec3<T>* F_bar) const {
    const T one(1.0);
    const T area_bar = (one - c) / root * y[5] - c * y[4], c_bar = (one - area) * y[4] - root * y[5];
    const T a_bar = y[3] + b * area_bar, b_bar = a * area_bar - y[3], r_bar = c * y[2] - t23 * c_bar;
    const T p_bar = b * y[0] + t23 * y[1] - t13 * y[2] - t12 * b_bar;
    const T q_bar = c * y[1] - t13 * c_bar - over_b * t12 * r_bar;
    F_bar[0] = a_bar * e1 + (over_a * p_bar) * e2 + (over_a * q_bar) * e3;
    F_bar[1] = y[0] * e1 + b_bar * e2 + (over_b * r_bar) * e3;
    F_bar[2] = y[1] * e1 + y[2] * e2 + c_bar * e3;
  }
  // That of row j alone.
  void gradient(int j, Vec3<T>* F_bar) const {
    T y[rows];
    for (int i = 0; i < rows; ++i) y[i] = T(i == j ? 1.0 : 0.0);
    transpose_times(y, F_bar);
  }
};

template <int N>
struct NeoHookean : SolidElement<N> {
  static constexpr int rows = 6, dofs = 3 * N;
  using Element = SolidElement<N>;

  template <class T>
  struct Factors {
    T C[rows], N_[N][3];  // gradients, the first node's too
    Vec3<T> F[3];         // its columns
    NeoHookeanRows<T> at;

    Factors(const T* x, const T* p) : F{of(x, p, 0), of(x, p, 1), of(x, p, 2)}, at(F) {
      for (int a = 0; a < 3; ++a) Element::find_gradients(p, N_, a);
      at.values(C);
    }
    void gradient(T* J) const {
      Vec3<T> G[3];
      for (int j = 0; j < rows; ++j) {
        at.gradient(j, G);
        for (int k = 0; k < N; ++k) on_node(G, k).store(J + j * dofs + 3 * k);
      }
    }
    // With S = sum_k w_k grad N_k (x) grad N_k, rows i and j have tr(G_i S G_j^T), G the derivative of a row with respect to F.
    void matrix(const T* w, T* A) const {
      T S[3][3];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) {
          T sum = w[0] * (N_[0][a] * N_[0][b]);
          for (int k = 1; k < N; ++k) sum += w[k] * (N_[k][a] * N_[k][b]);
          S[a][b] = S[b][a] = sum;
        }
      Vec3<T> G[rows][3];
      for (int i = 0; i < rows; ++i) {
        at.gradient(i, G[i]);
        Vec3<T> by[3];
        for (int a = 0; a < 3; ++a) by[a] = S[a][0] * G[i][0] + S[a][1] * G[i][1] + S[a][2] * G[i][2];
        for (int j = 0; j <= i; ++j) A[i * rows + j] = dot(by[0], G[j][0]) + dot(by[1], G[j][1]) + dot(by[2], G[j][2]);
      }
    }
    void add_times(const T* v, T* y) const {
      Vec3<T> D[3];
      for (int a = 0; a < 3; ++a) {
        D[a] = N_[1][a] * (Vec3<T>(v + 3) - Vec3<T>(v));
        for (int k = 2; k < N; ++k) D[a] = D[a] + N_[k][a] * (Vec3<T>(v + 3 * k) - Vec3<T>(v));
      }
      T dC[rows];
      at.times(D, dC);
      for (int j = 0; j < rows; ++j) y[j] += dC[j];
    }
    void transpose_times(const T* y, T* out) const {
      Vec3<T> G[3];
      at.transpose_times(y, G);
      for (int k = 0; k < N; ++k) on_node(G, k).store(out + 3 * k);
    }

   private:
    static Vec3<T> of(const T* x, const T* p, int a) { return Element::summed(x, p, a); }
    Vec3<T> on_node(const Vec3<T>* G, int k) const { return N_[k][0] * G[0] + N_[k][1] * G[1] + N_[k][2] * G[2]; }
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Factors<T> at(x, p);
    std::copy_n(at.C, rows, C);
    at.gradient(J);
  }

  // sum_j v_j . J_j = dl . (C's derivative along A) - y . (that along B); its derivative with respect to F is one of C's gradients along A and B.
  template <class T>
  static void reverse(const T* x, const T* p, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T* p_bar) {
    Vec3<T> F[3], A[3], B[3], to[3], of[3], along_a[3], along_b[3];
    for (int i = 0; i < 3; ++i) {
      F[i] = Element::summed(x, p, i);
      A[i] = Element::summed(a, p, i);
      B[i] = Element::summed(b, p, i);
    }
    turned(F, A, dl, to, along_a);
    turned(F, B, y, of, along_b);
    for (int i = 0; i < 3; ++i)
      Element::add_reverse(i, x, p, a, b, along_a[i] - along_b[i], to[i], of[i], x_bar, p_bar);
  }

  template <class T>
  static void add_hessian(const T* x, const T* p, const T* lambda, T* H) {
    using D = Dual<T, 9>;
    T N_[N][3], block[9];
    Vec3<D> F[3], G[3];
    for (int a = 0; a < 3; ++a) {
      Element::find_gradients(p, N_, a);
      const Vec3<T> f = Element::summed(x, p, a);
      F[a] = {D(f.x), D(f.y), D(f.z)};
      F[a].x.d[3 * a] = F[a].y.d[3 * a + 1] = F[a].z.d[3 * a + 2] = T(1.0);
    }
    D weights[rows];
    for (int j = 0; j < rows; ++j) weights[j].v = lambda[j];
    NeoHookeanRows<D>(F).transpose_times(weights, G);
    for (int i = 0; i < N; ++i) {
      const auto own = [&](auto member, int d) {
        return N_[i][0] * (G[0].*member).d[d] + N_[i][1] * (G[1].*member).d[d] + N_[i][2] * (G[2].*member).d[d];
      };
      T of_node[3][9];  // the derivatives of the forces on node i with respect to F
      for (int d = 0; d < 9; ++d) {
        of_node[0][d] = own(&Vec3<D>::x, d);
        of_node[1][d] = own(&Vec3<D>::y, d);
        of_node[2][d] = own(&Vec3<D>::z, d);
      }
      for (int k = 0; k <= i; ++k) {
        for (int r = 0; r < 3; ++r)
          for (int s = 0; s < 3; ++s)
            block[3 * r + s] = N_[k][0] * of_node[r][s] + N_[k][1] * of_node[r][3 + s] + N_[k][2] * of_node[r][6 + s];
        add_to_triangle(i, k, block, H);
      }
    }
  }

 private:
  // The gradient of w . C with respect to F, and how it changes along D.
  template <class T>
  static void turned(const Vec3<T>* F, const Vec3<T>* D, const T* w, Vec3<T>* gradient, Vec3<T>* change) {
    using U = Dual<T, 1>;
    Vec3<U> at[3], G[3];
    U weights[rows];
    for (int i = 0; i < 3; ++i) {
      at[i] = {U(F[i].x), U(F[i].y), U(F[i].z)};
      at[i].x.d[0] = D[i].x, at[i].y.d[0] = D[i].y, at[i].z.d[0] = D[i].z;
    }
    for (int j = 0; j < rows; ++j) weights[j].v = w[j];
    NeoHookeanRows<U>(at).transpose_times(weights, G);
    for (int i = 0; i < 3; ++i) {
      gradient[i] = {G[i].x.v, G[i].y.v, G[i].z.v};
      change[i] = {G[i].x.d[0], G[i].y.d[0], G[i].z.d[0]};
    }
  }
};

template <int N>
constexpr auto neo_hookean_parameters() {
  std::array<Parameter, 3 * (N - 1)> all{};
  name_gradients<N>(all);
  return all;
}

struct BrickNeoHookean : NeoHookean<8> {
  static constexpr const char* name = "brick_neo_hookean";
  static constexpr const char* about = "the deformation at a point of a brick of eight nodes, as rubber stores energy";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (volume shear modulus), beside a volume row"};
  static constexpr std::array parameters = neo_hookean_parameters<8>();
};

struct TetrahedronNeoHookean : NeoHookean<4> {
  static constexpr const char* name = "tetrahedron_neo_hookean";
  static constexpr const char* about = "the deformation of a tetrahedron, as rubber stores energy";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (volume shear modulus), beside a volume row"};
  static constexpr std::array parameters = neo_hookean_parameters<4>();
};

}  // namespace sheetbend
