// brick_strain, tetrahedron_strain: the Green strain of a solid at a point of an element (solid_element.h), E = (F^T F - 1)/2, and the rows that carry an
// orthotropic St. Venant-Kirchhoff energy (Bonet & Wood 2008, ch. 6),
//
//   C1..C3 = M (E_11, E_22, E_33)      C4..C6 = (2 E_23/sqrt(r_23), 2 E_13/sqrt(r_13), 2 E_12/sqrt(r_12))
//
// With M^T M = the inverse of (1, -n12 sqrt(r_2), ...; ...), the normal part of the compliance times E_1, the energy V |C|^2 E_1/2 of a volume V has Young's
// moduli E_1, E_1/r_2, E_1/r_3, shear moduli E_1/r_ij and couplings n_ij = sqrt(nu_ij nu_ji); alpha = 1/(V E_1). An isotropic material with Poisson's number nu has
// n = nu and r_ij = 2 (1 + nu). Without couplings and with r_ij = 2, which are the usual values, it is mu V tr E^2 with alpha = 1/(2 mu V): the part that
// stands beside a volume row (solid_volume.h), for materials that hardly change their volume.
//
// An element has one constraint per quadrature point: eight of a brick (2 x 2 x 2 of Gauss), one of a tetrahedron.
// Degenerate: nothing in space, an element that is turned inside out has finite strain; couplings without a positive definite compliance are no number.
// UncoupledRows have the usual values and no parameters.
#pragma once

#include <numbers>

#include "core/constraints/solid_element.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// The rows of the strains (E_11, E_22, E_33, 2 E_23, 2 E_13, 2 E_12): a lower triangle, and a factor for each shear.
template <class T>
struct SolidRows {
  static constexpr int parameters = 8;
  T normal[6], shear[3];  // triangle(j) + c

  // p: n12, n13, n23, r_2, r_3, r_23, r_13, r_12. The triangle is the inverse of the Cholesky factor of (1, -n12, -n13; .., 1, -n23; .., .., 1).
  explicit SolidRows(const T* p) {
    const T one(1.0);
    const T over_2 = one / sqrt(one - p[0] * p[0]), L32 = -((p[2] + p[1] * p[0]) * over_2);
    const T over_3 = one / sqrt(one - p[1] * p[1] - L32 * L32);
    normal[0] = one;
    normal[1] = p[0] * over_2;
    normal[2] = over_2 / sqrt(p[3]);
    normal[3] = (p[1] - L32 * normal[1]) * over_3;
    normal[4] = -(L32 * normal[2] * over_3);
    normal[5] = over_3 / sqrt(p[4]);
    for (int c = 0; c < 3; ++c) shear[c] = one / sqrt(p[5 + c]);
  }
  // C = M e.
  void times(const T* e, T* C) const {
    for (int j = 0; j < 3; ++j) {
      C[j] = normal[triangle(j)] * e[0];
      for (int c = 1; c <= j; ++c) C[j] += normal[triangle(j) + c] * e[c];
      C[3 + j] = shear[j] * e[3 + j];
    }
  }
  // e = M^T C.
  void transpose_times(const T* C, T* e) const {
    for (int c = 0; c < 3; ++c) {
      e[c] = normal[triangle(c) + c] * C[c];
      for (int j = c + 1; j < 3; ++j) e[c] += normal[triangle(j) + c] * C[j];
      e[3 + c] = shear[c] * C[3 + c];
    }
  }

 protected:
  SolidRows() = default;
};

template <class T>
struct UncoupledRows : SolidRows<T> {
  static constexpr int parameters = 0;

  explicit UncoupledRows(const T*) {
    for (int j = 0; j < 3; ++j) {
      for (int c = 0; c <= j; ++c) this->normal[triangle(j) + c] = T(c == j ? 1.0 : 0.0);
      this->shear[j] = T(std::numbers::sqrt2 / 2.0);
    }
  }
};

template <int N, template <class> class Rows = SolidRows>
struct SolidStrain : SolidElement<N> {
  static constexpr int rows = 6, dofs = 3 * N;
  using Element = SolidElement<N>;
  using Element::gradients;
  // Strain c is of the axes first and second.
  static constexpr int first[rows] = {0, 1, 2, 1, 0, 0}, second[rows] = {0, 1, 2, 2, 2, 1};
  static constexpr int component[3][3] = {{0, 5, 4}, {5, 1, 3}, {4, 3, 2}};

  template <class T>
  struct Factors {
    T C[rows], N_[N][3];  // gradients, the first node's too
    Vec3<T> F[3];         // F's columns
    Rows<T> M;

    Factors(const T* x, const T* p) : M(p + gradients) {
      for (int a = 0; a < 3; ++a) {
        Element::find_gradients(p, N_, a);
        F[a] = Element::summed(x, p, a);
      }
      T e[rows];
      const T half(0.5), one(1.0);
      for (int c = 0; c < 3; ++c) e[c] = half * (dot(F[c], F[c]) - one);
      for (int c = 3; c < rows; ++c) e[c] = dot(F[first[c]], F[second[c]]);
      M.times(e, C);
    }
    void gradient(T* J) const {
      for (int k = 0; k < N; ++k) {
        Vec3<T> along[3];
        for (int c = 0; c < 3; ++c) along[c] = N_[k][c] * F[c];
        for (int j = 0; j < 3; ++j) {
          Vec3<T> sum = M.normal[triangle(j)] * along[0];
          for (int c = 1; c <= j; ++c) sum = sum + M.normal[triangle(j) + c] * along[c];
          sum.store(J + j * dofs + 3 * k);
          const int a = first[3 + j], b = second[3 + j];
          (M.shear[j] * (N_[k][a] * F[b] + N_[k][b] * F[a])).store(J + (3 + j) * dofs + 3 * k);
        }
      }
    }
    // With S = sum_k w_k grad N_k (x) grad N_k and G = F^T F, strains (a, b) and (c, d) have S_ac G_bd + S_ad G_bc + S_bc G_ad + S_bd G_ac, normal ones half of it.
    void matrix(const T* w, T* A) const {
      T S[3][3], G[3][3], of[rows][rows], by[3];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) {
          T sum = w[0] * (N_[0][a] * N_[0][b]);
          for (int k = 1; k < N; ++k) sum += w[k] * (N_[k][a] * N_[k][b]);
          S[a][b] = S[b][a] = sum;
          G[a][b] = G[b][a] = dot(F[a], F[b]);
        }
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j <= i; ++j) {
          const int a = first[i], b = second[i], c = first[j], d = second[j];
          if (i < 3)
            of[i][j] = S[a][c] * G[a][c];
          else if (j < 3)
            of[i][j] = S[a][c] * G[b][c] + S[b][c] * G[a][c];
          else
            of[i][j] = S[a][c] * G[b][d] + S[a][d] * G[b][c] + S[b][c] * G[a][d] + S[b][d] * G[a][c];
          of[j][i] = of[i][j];
        }
      for (int i = 0; i < rows; ++i) {
        for (int c = 0; c < 3; ++c) {  // row i of M times `of`, at normal strains
          if (i < 3) {
            by[c] = M.normal[triangle(i)] * of[0][c];
            for (int b = 1; b <= i; ++b) by[c] += M.normal[triangle(i) + b] * of[b][c];
          } else {
            by[c] = M.shear[i - 3] * of[i][c];
          }
        }
        for (int j = 0; j <= i && j < 3; ++j) {
          T sum = M.normal[triangle(j)] * by[0];
          for (int c = 1; c <= j; ++c) sum += M.normal[triangle(j) + c] * by[c];
          A[i * rows + j] = sum;
        }
        for (int j = 3; j <= i; ++j) A[i * rows + j] = M.shear[i - 3] * M.shear[j - 3] * of[i][j];
      }
    }
    void add_times(const T* v, T* y) const {
      Vec3<T> D[3];
      for (int a = 0; a < 3; ++a) D[a] = along(v, a);
      T e[rows], by[rows];
      for (int c = 0; c < 3; ++c) e[c] = dot(F[c], D[c]);
      for (int c = 3; c < rows; ++c) e[c] = dot(F[first[c]], D[second[c]]) + dot(F[second[c]], D[first[c]]);
      M.times(e, by);
      for (int j = 0; j < rows; ++j) y[j] += by[j];
    }
    void transpose_times(const T* y, T* out) const {
      T e[rows];
      M.transpose_times(y, e);
      Vec3<T> of[3];
      for (int a = 0; a < 3; ++a) of[a] = mixed(e, F, a);
      for (int k = 0; k < N; ++k) (N_[k][0] * of[0] + N_[k][1] * of[1] + N_[k][2] * of[2]).store(out + 3 * k);
    }

   private:
    // sum_k dN_k/da v_k, by the nodes' differences from the first.
    Vec3<T> along(const T* v, int a) const {
      Vec3<T> sum = N_[1][a] * (Vec3<T>(v + 3) - Vec3<T>(v));
      for (int k = 2; k < N; ++k) sum = sum + N_[k][a] * (Vec3<T>(v + 3 * k) - Vec3<T>(v));
      return sum;
    }
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Factors<T> at(x, p);
    std::copy_n(at.C, rows, C);
    at.gradient(J);
  }

  // Of v_j . J_j - y_j C_j, summed over rows, as a sum over strains c of X_c (a's derivative) - Y_c (b's derivative + e_c), with X = M^T dl and Y = M^T y.
  template <class T>
  static void reverse(const T* x, const T* p, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T* p_bar) {
    const Rows<T> M(p + gradients);
    T X[rows], Y[rows];
    M.transpose_times(dl, X);
    M.transpose_times(y, Y);
    Vec3<T> F[3], A[3], B[3];
    for (int i = 0; i < 3; ++i) {
      F[i] = Element::summed(x, p, i);
      A[i] = Element::summed(a, p, i);
      B[i] = Element::summed(b, p, i);
    }
    for (int i = 0; i < 3; ++i) {
      const Vec3<T> to = mixed(X, F, i), of = mixed(Y, F, i), bar = mixed(X, A, i) - mixed(Y, B, i);
      Element::add_reverse(i, x, p, a, b, bar, to, of, x_bar, p_bar);
    }

    if constexpr (Rows<T>::parameters > 0) add_reverse_of_rows(M, F, A, B, p, dl, y, p_bar);
  }

  template <class T>
  static void add_hessian(const T*, const T* p, const T* lambda, T* H) {
    T L[rows], N_[N][3];
    Rows<T>(p + gradients).transpose_times(lambda, L);
    for (int a = 0; a < 3; ++a) Element::find_gradients(p, N_, a);
    for (int i = 0; i < N; ++i) {
      T by[3];
      for (int b = 0; b < 3; ++b)
        by[b] = L[component[0][b]] * N_[i][0] + L[component[1][b]] * N_[i][1] + L[component[2][b]] * N_[i][2];
      for (int k = 0; k <= i; ++k) {
        const T same = by[0] * N_[k][0] + by[1] * N_[k][1] + by[2] * N_[k][2];
        for (int a = 0; a < 3; ++a) H[triangle(3 * i + a) + 3 * k + a] += same;
      }
    }
  }

 private:
  // dQ/dM_jc, through M's derivatives.
  template <class T>
  static void add_reverse_of_rows(const Rows<T>& M, const Vec3<T>* F, const Vec3<T>* A, const Vec3<T>* B, const T* p,
                                  const T* dl, const T* y, T* p_bar) {
    const T half(0.5), one(1.0);
    T of_a[rows], of_b[rows];
    for (int c = 0; c < rows; ++c) {
      const int i = first[c], k = second[c];
      of_a[c] = c < 3 ? dot(F[i], A[i]) : dot(F[i], A[k]) + dot(F[k], A[i]);
      of_b[c] = c < 3 ? dot(F[i], B[i]) + half * (dot(F[i], F[i]) - one)
                      : dot(F[i], B[k]) + dot(F[k], B[i]) + dot(F[i], F[k]);
    }
    using D = Dual<T, 5>;
    D at[8];
    for (int i = 0; i < 8; ++i) at[i].v = p[gradients + i];
    for (int i = 0; i < 5; ++i) at[i].d[i] = one;
    const SolidRows<D> rows_at(at);
    T* bar = p_bar + gradients;
    for (int j = 0; j < 3; ++j) {
      for (int c = 0; c <= j; ++c) {
        const T M_bar = dl[j] * of_a[c] - y[j] * of_b[c];
        for (int i = 0; i < 5; ++i) bar[i] += M_bar * rows_at.normal[triangle(j) + c].d[i];
      }
      const T M_bar = dl[3 + j] * of_a[3 + j] - y[3 + j] * of_b[3 + j];
      bar[5 + j] -= M_bar * (half * (M.shear[j] * M.shear[j] * M.shear[j]));
    }
  }

  // sum_b e_ab v_b of the symmetric matrix of strains e.
  template <class T>
  static Vec3<T> mixed(const T* e, const Vec3<T>* v, int a) {
    return e[component[a][0]] * v[0] + e[component[a][1]] * v[1] + e[component[a][2]] * v[2];
  }
};

template <int N>
constexpr auto solid_parameters() {
  constexpr Default none = defaults::usually(0.0), one = defaults::usually(1.0), two = defaults::usually(2.0);
  std::array<Parameter, 3 * (N - 1) + 8> all{};
  int k = name_gradients<N>(all);
  for (const char* name : {"n_12", "n_13", "n_23"})
    all[k++] = {name, units::none, ranges::between_minus_one_and_one, none};
  for (const char* name : {"r_2", "r_3"}) all[k++] = {name, units::none, ranges::positive, one};
  for (const char* name : {"r_23", "r_13", "r_12"}) all[k++] = {name, units::none, ranges::positive, two};
  return all;
}

struct BrickStrain : SolidStrain<8> {
  static constexpr const char* name = "brick_strain";
  static constexpr const char* about = "the strains at a point of a brick of eight nodes, orthotropic and linear";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (volume E_1), or 1 / (2 volume shear modulus) beside a volume row",
                                         Compliance::matrix};
  static constexpr std::array parameters = solid_parameters<8>();
};

struct TetrahedronStrain : SolidStrain<4> {
  static constexpr const char* name = "tetrahedron_strain";
  static constexpr const char* about = "the strains of a tetrahedron, orthotropic and linear";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (volume E_1), or 1 / (2 volume shear modulus) beside a volume row",
                                         Compliance::matrix};
  static constexpr std::array parameters = solid_parameters<4>();
};

}  // namespace sheetbend
