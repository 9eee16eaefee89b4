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

// An array of Numbers, which is a whole number of packs.
template <class T>
std::size_t numbers_bytes(std::size_t count) {
  const std::size_t pack = sizeof(Wide<T>);
  return sizeof(Numbers<T>) + (count * sizeof(T) + pack - 1) / pack * pack;
}

// One direct block's BlockState.
template <class T>
std::size_t block_bytes(const Scene& scene, const DirectBlock& block, int kept_iterations) {
  const std::size_t rows = right_side<T>(block), iterations = std::max(1, kept_iterations);
  const auto of = [](std::size_t count) { return numbers_bytes<T>(count); };
  const std::size_t particles = of(sheetbend_blocks::row * block.particles.size());
  std::size_t factor = sizeof(Factor<T>) + sizeof(CondensedSolver<T>) + Factor<T>::bytes(block.structure);
  if (block.condensation && !block.implicit)
    factor += CondensedSolver<T>::bytes(*block.condensation, block.movable, block.size(), block.volumes.size());
  std::size_t bytes =
      sizeof(BlockState<T>) + 2 * of(block.size()) + (block.damped ? 2 * (particles + of(block.size())) : 0) +
      iterations * (of(sheetbend_blocks::row * block.window_rows.size()) + of(rows) + particles + factor) +
      (kept_iterations + 1) * (particles + of(block.size()));
  if (block.implicit) bytes += scenes_of<T> * ImplicitBlock::bytes(scene, block);
  for (const MemberRun& run : block.runs) {
    const Group& group = scene.groups[run.group];
    bytes += of(run.items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
    bytes += sizeof(sheetbend_blocks::Run);
  }
  for (const BlockVolume& volume : block.volumes)
    bytes += sizeof(BlockVolumeState<T>) + 2 * sizeof(Vec3<T>) * volume.particles.size();
  return bytes;
}

// One direct block's BlockCotangents.
template <class T>
std::size_t block_cotangent_bytes(const Scene& scene, const DirectBlock& block) {
  const auto of = [](std::size_t count) { return numbers_bytes<T>(count); };
  const std::size_t particles = of(sheetbend_blocks::row * block.particles.size());
  std::size_t bytes =
      sizeof(BlockCotangents<T>) + (block.damped ? 4 : 2) * particles + of(right_side<T>(block)) + 2 * of(block.size());
  for (const MemberRun& run : block.runs) bytes += of(run.items.size() * (2 + scene.groups[run.group].parameters));
  for (const BlockVolume& volume : block.volumes)
    bytes += sizeof(typename BlockCotangents<T>::VolumeValues) + sizeof(Vec3<T>) * volume.particles.size();
  if (block.implicit) bytes += 2 * sizeof(T) * 3 * block.movable;  // p and what it gathers
  return bytes;
}

template <class T>
std::size_t row_bytes(const PackPlan& plan) {
  return sizeof(T) * sheetbend_packs::row * static_cast<std::size_t>(plan.rows());
}

// The VolumeStates.
template <class T>
std::size_t volume_bytes(const Scene& scene, const Plan& plan, int kept_iterations) {
  const std::size_t iterations = std::max(1, kept_iterations);
  std::size_t bytes = 0;
  for (const Volume& volume : std::span(scene.volumes).first(swept_volumes(scene, plan)))
    bytes += sizeof(VolumeState<T>) + iterations * sizeof(VolumeRecord<T>) +
             (iterations + 1) * sizeof(Vec3<T>) * volume.nodes.size();
  return bytes;
}

template <class T>
std::size_t volume_cotangent_bytes(const Scene& scene, const Plan& plan) {
  std::size_t bytes = 0;
  for (const Volume& volume : std::span(scene.volumes).first(swept_volumes(scene, plan)))
    bytes += sizeof(VolumeCotangents<T>) + sizeof(Vec3<T>) * volume.nodes.size();
  return bytes;
}

template <class T>
std::size_t substep_bytes(const Scene& scene, const Plan& plan, bool keeps_iterations) {
  const int kept = kept_iterations(plan, keeps_iterations);
  std::size_t bytes = sizeof(T) * (scene.has_drag ? 2 : 1) * static_cast<std::size_t>(scene.nodes());
  if constexpr (!std::is_same_v<T, double>) bytes += sizeof(sheetbend_points::Frame) * scene.directors.size();
  for (const DirectBlock& block : plan.blocks) bytes += block_bytes<T>(scene, block, kept);
  bytes += volume_bytes<T>(scene, plan, kept);
  if (plan.colors.empty()) return bytes;
  bytes += sizeof(T) * damped_rows(scene);
  if constexpr (in_packs<T>) {
    const Sections sections = sections_of_record<T>(scene, plan, kept);
    const std::size_t begun = std::max(1, sections.count());  // the sweeps as they go, and where sections begin
    for (const PackedColor& color : plan.packs.colors) {
      const std::size_t own = color.value_count() + color.rows * (begun + (color.damped ? 1 : 0));
      bytes += sizeof(Pack) * (color.packs<T>() * own + sections.length * color.record_packs<T>()) +
               sizeof(typename PackState<T>::ColorState) + sections.length * sizeof(Numbers<Pack>) +
               (begun - 1) * sizeof(Numbers<T>);
    }
    return bytes + begun * row_bytes<T>(plan.packs) + (begun - 1) * sizeof(Rows<T>);
  } else {
    return bytes + sizeof(T) * (scene.rows + std::max(1, kept) * (scene.stencil_coordinates + 2 * scene.rows));
  }
}

template <class T>
std::size_t rollout_bytes(const Scene& scene, const Plan& plan) {
  return 6 * sizeof(T) * scene.dofs() + substep_bytes<T>(scene, plan, false);
}

template <class T>
std::size_t reverse_bytes(const Scene& scene, const Plan& plan) {
  const std::size_t dofs = scene.dofs(), rows = scene.rows, nodes = scene.nodes();
  // Cotangents, velocities, where the coordinates are corrected; then ReverseScratch.
  const std::size_t states = 7 + (plan.options.integrator == Integrator::bdf1 ? 1 : 2) +
                             (plan.options.partition == Partition::implicit ? 1 : 0);
  std::size_t bytes = sizeof(T) * states * dofs + substep_bytes<T>(scene, plan, true);
  for (const DirectBlock& block : plan.blocks) bytes += block_cotangent_bytes<T>(scene, block);
  bytes += volume_cotangent_bytes<T>(scene, plan);
  if (scene.yields) bytes += sizeof(T) * dofs;
  if (!sweeps_packs<T>(plan)) bytes += sizeof(T) * (dofs + nodes);
  if (plan.colors.empty()) return bytes;
  bytes += sizeof(T) * damped_rows(scene);
  if constexpr (in_packs<T>) {
    for (const PackedColor& color : plan.packs.colors)
      bytes += sizeof(Pack) * color.packs<T>() * (2 + color.parameters + color.rows * (color.damped ? 2 : 1)) +
               sizeof(ColorNumbers<T>);
    return bytes + row_bytes<T>(plan.packs);
  } else {
    return bytes + sizeof(T) * (scene.stencil_coordinates + rows);
  }
}

}  // namespace sheetbend
