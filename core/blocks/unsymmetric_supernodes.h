// LU of a sparse matrix whose pattern is symmetric, three rows and columns per particle: left-looking by the supernodes of supernodes.h, which begin
// and end between particles. Each has two panels laid out as there: L with a unit diagonal unwritten, in whose upper triangle U stands, and the
// transpose of U's rows beyond its columns, whose first rows are unused. They overwrite A. There is no pivoting among particles; within one, the three
// rows of its pivot go largest first, since a sliding contact may leave nothing on the diagonal. Of plain numbers; every entry sees the same operations
// in the same order whatever the instruction set.
#pragma once

#include <cmath>
#include <utility>

#include "core/blocks/supernodes.h"

namespace sheetbend {

struct UnsymmetricSupernodalFactor {
  // That an update goes by: those of two particles, whose sums fill the registers of AVX2.
  static constexpr int most_columns = 6;

  const sheetbend_blocks::Supernodes& s;
  double *lower, *upper, *inverse;  // inverse: of the pivots
  int* from;                        // of the factored rows, the rows of A
  double* work;                     // most_columns (widest + longest) numbers
  int* place;                       // of a row in the panel that is being made

  int first(int node) const { return s.first[node]; }
  int width(int node) const { return s.first[node + 1] - s.first[node]; }
  int below(int node) const { return s.row_start[node + 1] - s.row_start[node]; }
  const int* rows(int node) const { return s.rows + s.row_start[node]; }

  // Says whether every pivot has an inverse.
  bool factorize() const {
    for (int node = 0; node < s.count; ++node) {
      for (int c = 0; c < width(node); ++c) place[first(node) + c] = c;
      for (int r = 0; r < below(node); ++r) place[rows(node)[r]] = width(node) + r;
      for (int u = s.update_start[node]; u < s.update_start[node + 1]; ++u) update(node, s.updates[u]);
      if (!eliminate(node)) return false;
    }
    return true;
  }

  // Takes what an earlier supernode has for this one off its panels.
  void update(int node, const sheetbend_blocks::Update& u) const {
    for (int c = u.begin; c < u.end; c += most_columns) {
      if (u.end - c == 3)
        update_columns<3>(node, u, c);
      else
        update_columns<most_columns>(node, u, c);
    }
  }

  template <int Columns>
  void update_columns(int node, const sheetbend_blocks::Update& u, int column) const {
    subtract_product<Columns>(node, u.source, lower, u.begin, upper, column);
    subtract_product<Columns>(node, u.source, upper, u.end, lower, column);
  }

  // From the columns `column` and following of one panel of `node` the product of that of the source, from row `begin` on, and the rows `column` and
  // following of the other.
  template <int Columns>
  void subtract_product(int node, int source, double* panels, int begin, const double* others, int column) const {
    const long length = s.length[source];
    const int left = below(source) - begin;
    if (left == 0) return;
    const double* other = others + s.panel[source] + width(source) + column;
    double *top = work, *product = work + s.widest * most_columns;
    for (int k = 0; k < width(source); ++k)
      for (int c = 0; c < Columns; ++c) top[k * Columns + c] = other[k * length + c];
    multiply_panel<Columns>(panels + s.panel[source] + width(source) + begin, length, width(source), left, top, product,
                            s.longest);
    const int* row = rows(source) + begin;
    for (int c = 0; c < Columns; ++c) {
      double* to = panels + s.panel[node] + place[rows(source)[column + c]] * static_cast<long>(s.length[node]);
      const double* by = product + c * static_cast<long>(s.longest);
      for (int r = 0; r < left; ++r) to[place[row[r]]] -= by[r];
    }
  }

  // The panels by themselves, one particle after the other.
  bool eliminate(int node) const {
    const long length = s.length[node];
    const int all = width(node), used = all + below(node);
    double *L = lower + s.panel[node], *U = upper + s.panel[node];
    for (int c = 0; c < all; ++c) from[first(node) + c] = first(node) + c;
    for (int k = 0; k < all; k += 3) {
      for (int i = k; i < k + 3; ++i) {
        double* column = L + i * length;
        exchange(node, i, largest(column, i, k + 3));
        if (!(std::abs(column[i]) > 0.0) || !std::isfinite(column[i])) return false;
        const double scale = inverse[first(node) + i] = 1.0 / column[i];
        for (int r = i + 1; r < used; ++r) column[r] *= scale;
        for (int c = i + 1; c < k + 3; ++c) {
          subtract_columns<1>(L + c * length, column, length, L + c * length + i, 1, i + 1, used);
          subtract_columns<1>(U + c * length, U + i * length, length, column + c, 0, all, used);
        }
      }
      const double *l = L + k * length, *u = U + k * length;
      for (int c = k + 3; c < all; ++c) {
        double* to = L + c * length;
        to[k + 1] -= l[k + 1] * to[k];
        to[k + 2] = (to[k + 2] - l[k + 2] * to[k]) - l[length + k + 2] * to[k + 1];
        subtract_columns<3>(to, l, length, to + k, 1, k + 3, used);
        subtract_columns<3>(U + c * length, u, length, l + c, length, all, used);
      }
    }
    return true;
  }

  // Which of the rows from `begin` to `end` is the largest.
  static int largest(const double* column, int begin, int end) {
    int found = begin;
    for (int r = begin + 1; r < end; ++r)
      if (std::abs(column[r]) > std::abs(column[found])) found = r;
    return found;
  }

  void exchange(int node, int i, int k) const {
    if (i == k) return;
    const long length = s.length[node];
    double *L = lower + s.panel[node], *U = upper + s.panel[node];
    std::swap(from[first(node) + i], from[first(node) + k]);
    for (int c = 0; c < width(node); ++c) std::swap(L[c * length + i], L[c * length + k]);
    for (int r = width(node); r < width(node) + below(node); ++r) std::swap(U[i * length + r], U[k * length + r]);
  }

  // to -= the sum of columns that are `length` apart times factors that are `stride` apart, one after the other, in the rows from `begin` to `end`.
  template <int Columns>
  static void subtract_columns(double* to, const double* columns, long length, const double* factors, long stride,
                               int begin, int end) {
    double y[Columns];
    for (int i = 0; i < Columns; ++i) y[i] = factors[i * stride];
    constexpr int step = RowGroup<double>::count;
    int r = begin;
    for (; r + step <= end; r += step) {
      Register sum = RowGroup<double>::load(to + r);
      for (int i = 0; i < Columns; ++i) sum -= RowGroup<double>::load(columns + i * length + r) * Register(y[i]);
      RowGroup<double>::store(to + r, sum);
    }
    for (; r < end; ++r)
      for (int i = 0; i < Columns; ++i) to[r] -= columns[i * length + r] * y[i];
  }
};

// What the solves go through, of one supernode; b may be over a larger scalar U than the factor. `gathered` is as long as the longest column.
template <class U>
struct UnsymmetricSolve {
  const sheetbend_blocks::Supernodes& s;
  const double *lower, *upper, *inverse;
  const int* from;
  U *b, *gathered;

  int width(int node) const { return s.first[node + 1] - s.first[node]; }
  int below(int node) const { return s.row_start[node + 1] - s.row_start[node]; }
  const double* column(const double* panels, int node, int k) const {
    return panels + s.panel[node] + k * static_cast<long>(s.length[node]);
  }

  // b = A^-1 b
  void solve() const {
    for (int node = 0; node < s.count; ++node) {
      U* own = b + s.first[node];
      for (int k = 0; k < width(node); ++k) gathered[k] = b[from[s.first[node] + k]];
      for (int k = 0; k < width(node); ++k) {
        own[k] = gathered[k];
        const double* l = column(lower, node, k);
        for (int r = k + 1; r < width(node); ++r) gathered[r] -= l[r] * own[k];
      }
      spread(lower, node);
    }
    for (int node = s.count; node-- > 0;) {
      U* own = b + s.first[node];
      collect(upper, node);
      for (int k = width(node); k-- > 0;) {
        const double* u = column(lower, node, k);
        own[k] = own[k] * inverse[s.first[node] + k];
        for (int r = 0; r < k; ++r) own[r] -= u[r] * own[k];
      }
    }
  }

  // b = A^-T b
  void solve_transposed() const {
    for (int node = 0; node < s.count; ++node) {
      U* own = b + s.first[node];
      for (int k = 0; k < width(node); ++k) {
        const double* u = column(lower, node, k);
        for (int r = 0; r < k; ++r) own[k] -= u[r] * own[r];
        own[k] = own[k] * inverse[s.first[node] + k];
      }
      spread(upper, node);
    }
    for (int node = s.count; node-- > 0;) {
      U* own = b + s.first[node];
      collect(lower, node);
      for (int k = width(node); k-- > 0;) {
        const double* l = column(lower, node, k);
        for (int r = k + 1; r < width(node); ++r) own[k] -= l[r] * own[r];
      }
      for (int k = 0; k < width(node); ++k) gathered[k] = own[k];
      for (int k = 0; k < width(node); ++k) b[from[s.first[node] + k]] = gathered[k];
    }
  }

 private:
  // Off the rows below what the supernode's own have for them.
  void spread(const double* panels, int node) const {
    const int* rows = s.rows + s.row_start[node];
    const U* own = b + s.first[node];
    for (int r = 0; r < below(node); ++r) gathered[r] = U(0.0);
    for (int k = 0; k < width(node); ++k) {
      const double* entries = column(panels, node, k) + width(node);
      for (int r = 0; r < below(node); ++r) gathered[r] += entries[r] * own[k];
    }
    for (int r = 0; r < below(node); ++r) b[rows[r]] -= gathered[r];
  }

  // Off its own what the rows below have for them.
  void collect(const double* panels, int node) const {
    const int* rows = s.rows + s.row_start[node];
    U* own = b + s.first[node];
    for (int r = 0; r < below(node); ++r) gathered[r] = b[rows[r]];
    for (int k = 0; k < width(node); ++k) {
      const double* entries = column(panels, node, k) + width(node);
      constexpr int parts = 4;  // sums that do not wait for one another
      U sum[parts]{};
      int r = 0;
      for (; r + parts <= below(node); r += parts)
        for (int i = 0; i < parts; ++i) sum[i] += entries[r + i] * gathered[r + i];
      for (; r < below(node); ++r) sum[0] += entries[r] * gathered[r];
      own[k] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
    }
  }
};

}  // namespace sheetbend
