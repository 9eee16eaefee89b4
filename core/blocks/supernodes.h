// LDL^T of a sparse symmetric matrix without pivoting, over any scalar: left-looking by supernodes (Ng & Peyton 1993). Columns that follow one
// another and have (nearly) the same rows are one dense panel, column by column: the columns' own rows first, of which the upper triangle is
// scratch, then the rows below, then zeros up to a whole number of packs. L overwrites A and keeps a unit diagonal unwritten. Plain numbers go eight
// rows at a time; every entry sees the same operations in the same order whatever the scalar and the instruction set.
#pragma once

#include "core/blocks/band.h"
#include "core/blocks/wide.h"

namespace sheetbend {

// As many rows of plain numbers as a register has lanes, one of any other scalar.
template <class T>
struct RowGroup {
  static constexpr int count = members_in_lanes<T> ? register_lanes : 1;
  using Type = std::conditional_t<members_in_lanes<T>, Register, T>;
  static Type load(const T* p) {
    Type rows;
    __builtin_memcpy(&rows, p, sizeof rows);
    return rows;
  }
  static void store(T* p, const Type& rows) { __builtin_memcpy(p, &rows, sizeof rows); }
};

// to (Columns, to_length) = L top^T: `rows` rows of a panel of `width` columns, times (width, Columns) numbers.
template <int Columns, class T>
void multiply_panel(const T* L, long length, int width, int rows, const T* top, T* to, long to_length) {
  using Group = typename RowGroup<T>::Type;
  constexpr int groups = members_in_lanes<T> ? 2 : 1, step = RowGroup<T>::count * groups;
  for (int r = 0; r < rows; r += step) {
    Group sum[Columns][groups];
    for (int c = 0; c < Columns; ++c)
      for (Group& s : sum[c]) s = Group(0.0);
    for (int k = 0; k < width; ++k) {
      const T* column = L + k * length + r;
      Group l[groups];
      for (int g = 0; g < groups; ++g) l[g] = RowGroup<T>::load(column + RowGroup<T>::count * g);
      for (int c = 0; c < Columns; ++c) {
        const Group y(top[k * Columns + c]);
        for (int g = 0; g < groups; ++g) sum[c][g] += l[g] * y;
      }
    }
    for (int c = 0; c < Columns; ++c)
      for (int g = 0; g < groups; ++g) RowGroup<T>::store(to + c * to_length + r + RowGroup<T>::count * g, sum[c][g]);
  }
}

template <class T>
struct SupernodalFactor {
  const sheetbend_blocks::Supernodes& s;
  T *panels, *inverse, *work;
  int* place;  // of a row in the panel that is being made

  int first(int node) const { return s.first[node]; }
  int width(int node) const { return s.first[node + 1] - s.first[node]; }
  int below(int node) const { return s.row_start[node + 1] - s.row_start[node]; }
  const int* rows(int node) const { return s.rows + s.row_start[node]; }

  void factorize() const {
    for (int node = 0; node < s.count; ++node) {
      for (int c = 0; c < width(node); ++c) {
        place[first(node) + c] = c;
        inverse[first(node) + c] = panels[s.panel[node] + c * static_cast<long>(s.length[node]) + c];  // the diagonal
      }
      for (int r = 0; r < below(node); ++r) place[rows(node)[r]] = width(node) + r;
      for (int u = s.update_start[node]; u < s.update_start[node + 1]; ++u) update(node, s.updates[u]);
      eliminate(node);
    }
  }

  // Takes what an earlier supernode has for this one off its panel.
  void update(int node, const sheetbend_blocks::Update& u) const {
    constexpr int most = 4;
    for (int c = u.begin; c < u.end; c += most) {
      switch (u.end - c) {
        case 1: return update_columns<1>(node, u.source, c);
        case 2: return update_columns<2>(node, u.source, c);
        case 3: return update_columns<3>(node, u.source, c);
        default: update_columns<4>(node, u.source, c);
      }
    }
  }

  template <int Columns>
  void update_columns(int node, int source, int begin) const {
    const long length = s.length[source];
    const T* top = panels + s.panel[source] + width(source) + begin;
    const int rows_left = below(source) - begin;
    T *scaled = work, *product = work + s.widest * 4;
    for (int k = 0; k < width(source); ++k) {
      const T pivot = panels[s.panel[source] + k * length + k];
      for (int c = 0; c < Columns; ++c) scaled[k * Columns + c] = top[k * length + c] * pivot;
    }
    multiply_panel<Columns>(top, length, width(source), rows_left, scaled, product, s.longest);
    const int* row = rows(source) + begin;
    for (int c = 0; c < Columns; ++c) {
      T* to = panels + s.panel[node] + place[row[c]] * static_cast<long>(s.length[node]);
      const T* from = product + c * static_cast<long>(s.longest);
      for (int r = c; r < rows_left; ++r) to[place[row[r]]] -= from[r];
    }
  }

  // The panel by itself, column after column.
  void eliminate(int node) const {
    const long length = s.length[node];
    const int used = width(node) + below(node);
    T* panel = panels + s.panel[node];
    for (int k = 0; k < width(node); ++k) {
      T* column = panel + k * length;
      T& scale = inverse[first(node) + k];
      scale = inverse_pivot(column[k], scale, s.least_pivot);
      for (int c = k + 1; c < width(node); ++c) subtract_rows(panel + c * length, column, column[c] * scale, c, used);
      for (int r = k + 1; r < used; ++r) column[r] = column[r] * scale;
    }
  }

  // to -= from y from row `begin` on, or from a few rows above.
  static void subtract_rows(T* to, const T* from, const T& y, int begin, int end) {
    constexpr int step = RowGroup<T>::count;
    const typename RowGroup<T>::Type factor(y);
    for (int r = begin / step * step; r < end; r += step)
      RowGroup<T>::store(to + r, RowGroup<T>::load(to + r) - RowGroup<T>::load(from + r) * factor);
  }
};

// b = A^-1 b, with the factor's numbers; b may be over a larger scalar U. `gathered` is as long as the longest column.
template <class T, class U>
void solve_supernodes(const sheetbend_blocks::Supernodes& s, const T* panels, const T* inverse, U* b, U* gathered) {
  const auto width = [&](int node) { return s.first[node + 1] - s.first[node]; };
  const auto below = [&](int node) { return s.row_start[node + 1] - s.row_start[node]; };
  for (int node = 0; node < s.count; ++node) {
    const int* rows = s.rows + s.row_start[node];
    U* own = b + s.first[node];
    for (int r = 0; r < below(node); ++r) gathered[r] = U(0.0);
    for (int k = 0; k < width(node); ++k) {
      const T* column = panels + s.panel[node] + k * static_cast<long>(s.length[node]);
      for (int r = k + 1; r < width(node); ++r) own[r] -= column[r] * own[k];
      for (int r = 0; r < below(node); ++r) gathered[r] += column[width(node) + r] * own[k];
    }
    for (int r = 0; r < below(node); ++r) b[rows[r]] -= gathered[r];
  }
  for (int i = 0; i < s.first[s.count]; ++i) b[i] = b[i] * inverse[i];
  for (int node = s.count - 1; node >= 0; --node) {
    const int* rows = s.rows + s.row_start[node];
    U* own = b + s.first[node];
    for (int r = 0; r < below(node); ++r) gathered[r] = b[rows[r]];
    for (int k = width(node) - 1; k >= 0; --k) {
      const T* column = panels + s.panel[node] + k * static_cast<long>(s.length[node]);
      constexpr int parts = 4;  // sums that do not wait for one another
      U sum[parts]{};
      int r = 0;
      for (; r + parts <= below(node); r += parts)
        for (int i = 0; i < parts; ++i) sum[i] += column[width(node) + r + i] * gathered[r + i];
      for (; r < below(node); ++r) sum[0] += column[width(node) + r] * gathered[r];
      own[k] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
      for (r = k + 1; r < width(node); ++r) own[k] -= column[r] * own[r];
    }
  }
}

}  // namespace sheetbend
