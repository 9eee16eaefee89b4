// Bytes that a rollout and its reverse work on besides the tape, known from scene and plan alone, so that a budget can be kept before anything
// is allocated. tests/cpp/test_footprint.cpp holds them against what is allocated.
#pragma once

#include "adjoint/substep_vjp.h"

namespace sheetbend {

template <class V>
std::size_t size_in_bytes(const std::vector<V>& v) {
  return sizeof(V) * v.size();
}

// Colors or blocks: what was found once about the scene.
inline std::size_t plan_bytes(const Plan& plan) {
  std::size_t bytes = size_in_bytes(plan.packs.ghosts);
  for (const Color& color : plan.colors) bytes += size_in_bytes(color.items);
  for (const PackedColor& color : plan.packs.colors) bytes += size_in_bytes(color.items) + size_in_bytes(color.nodes);
  for (const DirectBlock& block : plan.blocks) {
    bytes += size_in_bytes(block.members) + size_in_bytes(block.nodes) + size_in_bytes(block.couplings) +
             size_in_bytes(block.position);
    // A sparse pattern: rows and columns of the matrix, and of its factor.
    if (!block.structure.banded()) bytes += 2 * sizeof(int) * (block.structure.values() + block.structure.fill());
  }
  return bytes;
}

// Factors of the direct blocks.
template <class T>
std::size_t factor_bytes(const Plan& plan) {
  std::size_t bytes = 0;
  for (const DirectBlock& block : plan.blocks) {
    const FactorStructure& s = block.structure;
    bytes += sizeof(Factor<T>) + sizeof(T) * (s.values() + s.size());
    if (!s.banded()) bytes += (sizeof(T) + sizeof(int)) * (s.fill() + s.size());
  }
  return bytes;
}

template <class T>
std::size_t row_bytes(const PackPlan& plan) {
  return sizeof(T) * sheetbend_packs::row * static_cast<std::size_t>(plan.rows());
}

template <class T>
std::size_t substep_bytes(const Scene& scene, const Plan& plan, bool keeps_iterations) {
  const std::size_t rows = scene.rows, kept = keeps_iterations ? plan.options.iterations : 1;
  std::size_t bytes =
      sizeof(T) * ((scene.has_drag ? 2 : 1) * static_cast<std::size_t>(scene.nodes()) + damped_rows(scene));
  if (!sweeps_packs<T>(plan)) {
    bytes += 2 * sizeof(T) * rows;
    const std::size_t gradients = plan.blocks.empty() ? 0 : scene.gradient_entries;
    return bytes + kept * (sizeof(T) * (scene.stencil_coordinates + 2 * rows + gradients) + factor_bytes<T>(plan));
  }
  for (const PackedColor& color : plan.packs.colors) {
    const std::size_t own =
        color.value_count() + color.rows * (color.damped ? 2 : 1) + (keeps_iterations ? kept * color.record_size() : 0);
    if constexpr (in_packs<T>)
      bytes += sizeof(Pack) * color.packs<T>() * own + sizeof(typename PackState<T>::ColorState);
    if (keeps_iterations) bytes += kept * sizeof(std::vector<Pack>);
  }
  return bytes + row_bytes<T>(plan.packs);
}

template <class T>
std::size_t rollout_bytes(const Scene& scene, const Plan& plan) {
  return 6 * sizeof(T) * scene.dofs() + substep_bytes<T>(scene, plan, false);
}

template <class T>
std::size_t reverse_bytes(const Scene& scene, const Plan& plan) {
  const std::size_t dofs = scene.dofs(), rows = scene.rows, nodes = scene.nodes();
  // Cotangents, velocities, where the coordinates are corrected; then ReverseScratch.
  const std::size_t states = 6 + (plan.options.integrator == Integrator::bdf1 ? 1 : 2);
  std::size_t bytes = sizeof(T) * (states * dofs + damped_rows(scene));
  if (!sweeps_packs<T>(plan))
    return bytes + sizeof(T) * (4 * dofs + scene.stencil_coordinates + rows + nodes) +
           substep_bytes<T>(scene, plan, true);
  if constexpr (in_packs<T>) {
    for (const PackedColor& color : plan.packs.colors)
      bytes += sizeof(Pack) * color.packs<T>() * (2 + color.parameters + color.rows * (color.damped ? 2 : 1)) +
               sizeof(typename PackCotangents<T>::ColorCotangents);
    bytes += row_bytes<T>(plan.packs);
  }
  return bytes + substep_bytes<T>(scene, plan, true);
}

}  // namespace sheetbend
