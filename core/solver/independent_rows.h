// Which rigid rows of a condensed block (core/linear/condensed.h) follow from its other rigid rows. An LDL^T factor of J W J^T has no pivot for such a row;
// blocks that are factored by rows notice that as they go, but a condensed block is factored by particles, so its rigid rows are looked at here.
// Of rows that say the same the last one in the block is left out, so that a small change of the scene does not leave out another one.
// The matrix is dense, as the border of the condensed solve is: rigid rows are few.
#pragma once

#include <cmath>
#include <vector>

#include "core/linear/block_numbers.h"
#include "core/solver/scenes.h"

namespace sheetbend {

class IndependentRows {
 public:
  // Per row of the block, the scenes in which it is rigid and left out: with a pivot of at most `least` of its own diagonal. No allocation once it has grown.
  template <class T>
  const std::vector<Scenes>& left_out(const BlockNumbers<T>& block, double least) {
    left_out_.assign(block.size, 0);
    for (int scene = 0; scene < scenes_of<T>; ++scene) {
      fill(block, scene);
      eliminate(least);
      for (std::size_t v = 0; v < rigid_.size(); ++v)
        if (!kept_[v]) left_out_[rigid_[v]] |= static_cast<Scenes>(1u << scene);
    }
    return left_out_;
  }

 private:
  // J W J^T over the rigid rows of a scene.
  template <class T>
  void fill(const BlockNumbers<T>& block, int scene) {
    const auto number = [scene](const T& a) { return number_of(a, scene); };
    place_.assign(block.size, -1);
    rigid_.clear();
    for (int row = 0; row < block.size; ++row)
      if (number(block.diagonal[row]) == 0.0) {
        place_[row] = static_cast<int>(rigid_.size());
        rigid_.push_back(row);
      }
    const std::size_t n = rigid_.size();
    matrix_.assign(n * n, 0.0);
    const auto gradient = [&](int k) {
      const T* G = block.gradient(k);
      return Vec3<double>(number(G[0]), number(G[1]), number(G[2]));
    };
    for (int p = 0; p < block.movable; ++p)
      for (int i = block.window[p]; i < block.window[p + 1]; ++i) {
        const int v = place_[block.rows[i]];
        if (v < 0) continue;
        const Vec3<double> wG = number(block.inverse_mass(p)) * gradient(i);
        for (int k = block.window[p]; k < block.window[p + 1]; ++k)
          if (const int w = place_[block.rows[k]]; w >= 0) matrix_[v * n + w] += dot(wG, gradient(k));
      }
  }

  void eliminate(double least) {
    const std::size_t n = rigid_.size();
    kept_.assign(n, false);
    factor_.resize(n * n);
    rest_.resize(n);
    for (std::size_t v = 0; v < n; ++v) rest_[v] = matrix_[v * n + v];
    for (std::size_t k = 0; k < n; ++k) {
      if (!(rest_[k] > least * matrix_[k * n + k])) continue;
      kept_[k] = true;
      double* column = &factor_[k * n];
      std::copy_n(&matrix_[k * n], n, column);
      for (std::size_t j = 0; j < k; ++j) {
        if (!kept_[j]) continue;
        const double *before = &factor_[j * n], share = before[k];
        for (std::size_t v = k; v < n; ++v) column[v] -= share * before[v];
      }
      const double scale = 1.0 / std::sqrt(rest_[k]);
      for (std::size_t v = k; v < n; ++v) {
        column[v] *= scale;
        rest_[v] -= column[v] * column[v];
      }
    }
  }

  std::vector<int> place_, rigid_;  // per row of the block its place among the rigid ones, or -1; those
  std::vector<double> matrix_, factor_,
      rest_;  // (n, n) of the rigid rows; columns of its factor; what is left of its diagonal
  std::vector<char> kept_;
  std::vector<Scenes> left_out_;
};

}  // namespace sheetbend
