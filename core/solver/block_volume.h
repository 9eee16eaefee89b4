// The rows of kept volumes in a direct block (volume.h), over its numbers: what they are worth, their gradients and their tangents. The rest they
// share with the rows of constraints, through the windows of the particles. State is a BlockState.
#pragma once

#include "core/blocks/kernels.h"
#include "core/scalar/numbers.h"
#include "core/solver/plan.h"
#include "core/solver/volume.h"

namespace sheetbend {

template <class T>
struct BlockVolumeState {
  std::vector<Vec3<T>> x, gradient;

  void resize(const BlockVolume& volume) {
    x.resize(volume.particles.size());
    gradient.resize(x.size());
  }
};

// Coordinates of a volume's nodes before an iteration.
template <class T, class State>
void place_volume(const BlockVolume& volume, State& state, int iteration, std::vector<Vec3<T>>& x) {
  auto& rows = state.at(state.x, iteration);
  place_volume(
      [&](std::size_t k) {
        const std::size_t at = sheetbend_blocks::row * static_cast<std::size_t>(volume.particles[k]);
        return Vec3<T>(T(rows[at]), T(rows[at + 1]), T(rows[at + 2]));
      },
      x);
}

// Gradients, and the right side -(C + a lambda) into dl.
template <class T, class State>
void evaluate_volumes(const Scene& scene, const Inputs<const T>& in, const DirectBlock& block, State& state,
                      int iteration) {
  auto& own = state.at(iteration);
  for (std::size_t v = 0; v < block.volumes.size(); ++v) {
    const BlockVolume& volume = block.volumes[v];
    BlockVolumeState<T>& at = state.volumes[v];
    place_volume(volume, state, iteration, at.x);
    const T C = enclosed(scene.volumes[volume.volume], at.x, at.gradient) - in.of(Quantity::volume)[volume.volume];
    own.dl[volume.row] = -(C + T(state.diagonal[volume.row]) * T(state.at(state.lambda, iteration)[volume.row]));
    for (std::size_t k = 0; k < at.gradient.size(); ++k) {
      Plain<T>* G = own.gradients.data() + sheetbend_blocks::row * static_cast<std::size_t>(volume.gradients[k]);
      const Vec3<T>& g = at.gradient[k];
      G[0] = coefficient<Plain<T>>(g.x);
      G[1] = coefficient<Plain<T>>(g.y);
      G[2] = coefficient<Plain<T>>(g.z);
    }
  }
}

// What their own change adds to the directions of a right side: -a' dl - g'.z, and W g' dl in z' with -J of that everywhere (block_tangents.h).
template <class T, class State>
void add_volume_tangents(const DirectBlock& block, const sheetbend_blocks::Block& arrays,
                         const sheetbend_blocks::Tangents& t, State& state) {
  const auto directions = [](const T& a) {
    Pack d(0.0);
    std::copy_n(a.d, T::directions, reinterpret_cast<double*>(&d));
    return d;
  };
  Pack *right = numbers_of<Pack>(t.dl), *u = numbers_of<Pack>(t.u);
  for (std::size_t v = 0; v < block.volumes.size(); ++v) {
    const BlockVolume& volume = block.volumes[v];
    const Pack dl(arrays.dl[volume.row]);
    right[volume.row] -= directions(T(state.diagonal[volume.row])) * dl;
    for (std::size_t k = 0; k < volume.particles.size(); ++k) {
      const int p = volume.particles[k];
      if (p >= block.movable) continue;
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      const Vec3<T>& g = state.volumes[v].gradient[k];
      const Pack w(arrays.x[at + 3]), own[3] = {directions(g.x), directions(g.y), directions(g.z)};
      Pack moved[3];
      for (int d = 0; d < 3; ++d) {
        right[volume.row] -= own[d] * (w * Pack(arrays.u[at + d]));
        moved[d] = w * own[d] * dl;
        u[at + d] += moved[d];
      }
      for (int i = block.window[p]; i < block.window[p + 1]; ++i) {
        const double* G = arrays.gradients + sheetbend_blocks::row * static_cast<long>(i);
        right[block.window_rows[i]] -= Pack(G[0]) * moved[0] + Pack(G[1]) * moved[1] + Pack(G[2]) * moved[2];
      }
    }
  }
}

}  // namespace sheetbend
