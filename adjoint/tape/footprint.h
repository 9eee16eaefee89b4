// Bytes that a rollout and its reverse work on besides the tape, known from scene and plan alone, so that a budget can be kept before anything
// is allocated. What a substep works on is counted by its stages, beside what allocates it. tests/cpp/test_footprint.cpp holds them against what is allocated.
#pragma once

#include "adjoint/step/substep.h"

namespace sheetbend {

template <class V>
std::size_t size_in_bytes(const std::vector<V>& v) {
  return sizeof(V) * v.size();
}

// Colors or blocks: what was found once about the scene.
inline std::size_t plan_bytes(const Plan& plan) {
  std::size_t bytes = size_in_bytes(plan.packs.ghosts) + size_in_bytes(plan.contacts);
  for (const Color& color : plan.colors) bytes += size_in_bytes(color.items);
  for (const PackedColor& color : plan.packs.colors) bytes += size_in_bytes(color.items) + size_in_bytes(color.nodes);
  for (const DirectBlock& block : plan.blocks) {
    bytes += size_in_bytes(block.members) + size_in_bytes(block.particles) + size_in_bytes(block.window) +
             size_in_bytes(block.window_rows) + size_in_bytes(block.multipliers) + size_in_bytes(block.positions) +
             size_in_bytes(block.volumes);
    for (const BlockVolume& volume : block.volumes)
      bytes += size_in_bytes(volume.particles) + size_in_bytes(volume.gradients);
    for (const MemberRun& run : block.runs)
      bytes += size_in_bytes(run.items) + size_in_bytes(run.nodes) + size_in_bytes(run.gradients) +
               size_in_bytes(run.first_row) + size_in_bytes(run.entries);
    // A sparse pattern: rows and columns of the matrix, and of its factor.
    bytes += block.structure.bytes();
    if (block.condensation) bytes += std::visit([](const auto& c) { return c.bytes(); }, *block.condensation);
  }
  return bytes;
}

// States that are set aside where a pack's scenes go with different formulas.
template <class T>
std::size_t mixed_states(const Scene& scene, const Plan& plan) {
  return scenes_of<T> > 1 && changes_at_contacts(scene, plan.options) ? 2 : 0;
}

template <class T, class List = Substep>
std::size_t rollout_bytes(const Scene& scene, const Plan& plan) {
  return (6 + mixed_states<T>(scene, plan)) * sizeof(T) * scene.dofs() + Records<T, List>::bytes(scene, plan, false);
}

template <class T, class List = Substep>
std::size_t reverse_bytes(const Scene& scene, const Plan& plan) {
  // Cotangents, velocities, room for the coordinates; the end where implicit blocks need it.
  const std::size_t states = 7 + (plan.options.integrator == Integrator::bdf1 ? 1 : 2) +
                             (plan.options.partition == Partition::implicit ? 1 : 0) + mixed_states<T>(scene, plan);
  return states * sizeof(T) * scene.dofs() + Records<T, List>::bytes(scene, plan, true) +
         Scratches<T, List>::bytes(scene, plan);
}

}  // namespace sheetbend
