// The reverse of the block projection of a direct block, over the numbers that its forward kept. The kernels are in adjoint/blocks.
#pragma once

#include "adjoint/blocks/block_reverse.h"
#include "adjoint/blocks/every_kind.h"
#include "adjoint/element/rates_vjp.h"
#include "adjoint/solver/block_contacts_vjp.h"
#include "adjoint/solver/block_pairs_vjp.h"
#include "adjoint/solver/volume_vjp.h"
#include "core/solver/project_block.h"

namespace sheetbend {

template <class T>
const sheetbend_blocks::Reverse& reverse_kernels(const sheetbend_packs::KernelTable& kernels) {
  if constexpr (has_compiled_kernels<T>)
    return (std::is_same_v<T, Pack> ? kernels.blocks->many : kernels.blocks->one).reverse;
  else
    return ReverseKernels<T, ReverseOfEveryKind<T>>::all;
}

// Cotangents in the block's order. Those of the constraints' values gather over substeps of one eta; finish_block() hands them on.
template <class T>
struct BlockCotangents {
  Numbers<T> x, z, y, lambda, C_r;
  Numbers<T> x_now, x_before;      // of the states that damping refers to
  std::vector<Numbers<T>> values;  // per run
  struct VolumeValues {
    T rest{}, a{};           // of what is kept, and of a
    std::vector<Vec3<T>> v;  // of dV/dx
  };
  std::vector<VolumeValues> volumes;
  std::vector<BlockContactCotangents<Single<T>>> contacts;  // per scene, of implicit blocks
  std::vector<PairFrictionCotangents<Single<T>>> friction;  // likewise
  std::vector<T> radii;                                     // of contacts and of what touches itself, of such a block
  std::vector<T> weights;                                   // of points of bodies that touch something, likewise
  double eta = 0.0;

  void resize(const Scene& scene, const DirectBlock& block) {
    for (auto* a : {&x, &z}) a->assign(block.particles.size() * sheetbend_blocks::row);
    if (block.damped)
      for (auto* a : {&x_now, &x_before}) a->assign(block.particles.size() * sheetbend_blocks::row);
    y.assign(right_side<T>(block));
    for (auto* a : {&lambda, &C_r}) a->assign(block.size());
    values.resize(block.runs.size());
    for (std::size_t r = 0; r < values.size(); ++r)
      values[r].assign(block.runs[r].items.size() * (2 + scene.groups[block.runs[r].group].parameters));
    volumes.resize(block.volumes.size());
    for (std::size_t v = 0; v < volumes.size(); ++v) volumes[v].v.resize(block.volumes[v].particles.size());
    contacts.resize(block.implicit ? scenes_of<T> : 0);
    radii.assign(block.surface.empty() ? 0 : scene.layout.count(Quantity::contact_radius), T(0.0));
    weights.assign(4 * block.surface.on_bodies.size(), T(0.0));
    for (auto& scene_ : contacts) scene_.resize(scene, block);
    friction.resize(contacts.size());
    for (auto& scene_ : friction) scene_.resize(block);
  }
  // What resize() allocates, and what project_implicit_vjp() does.
  static std::size_t bytes(const Scene& scene, const DirectBlock& block) {
    const auto of = [](std::size_t count) { return sizeof(Numbers<T>) + Numbers<T>::bytes(count); };
    const std::size_t particles = of(sheetbend_blocks::row * block.particles.size());
    std::size_t sum = (block.damped ? 4 : 2) * particles + of(right_side<T>(block)) + 2 * of(block.size());
    for (const MemberRun& run : block.runs) sum += of(run.items.size() * (2 + scene.groups[run.group].parameters));
    for (const BlockVolume& volume : block.volumes)
      sum += sizeof(VolumeValues) + sizeof(Vec3<T>) * volume.particles.size();
    if (!block.surface.empty()) sum += sizeof(T) * scene.layout.count(Quantity::contact_radius);
    sum += sizeof(T) * 4 * block.surface.on_bodies.size();
    if (block.implicit)
      sum += 2 * sizeof(T) * 3 * block.movable +  // p and what it gathers
             scenes_of<T> *
                 (sizeof(BlockContactCotangents<Single<T>>) + BlockContactCotangents<Single<T>>::bytes(scene, block) +
                  sizeof(PairFrictionCotangents<Single<T>>) + PairFrictionCotangents<Single<T>>::bytes(block));
    return sum;
  }
};

// Adds the gathered cotangents of the constraints' values to those of the inputs, and forgets them.
template <class T>
void finish_block(const Scene& scene, const DirectBlock& block, const Inputs<const T>& in, const Inputs<T>& in_bar,
                  BlockCotangents<T>& bar) {
  if (bar.eta == 0.0) return;
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const Group& group = scene.groups[run.group];
    const int count = 2 + group.parameters;
    for (int i = 0; i < run.count; ++i) {
      const auto value = [&](int part) { return bar.values[r][member_number<T>(i, count, part)]; };
      add_values(in, group, run.items[i], bar.eta, value, in_bar);
    }
    bar.values[r].clear();
  }
  for (std::size_t v = 0; v < block.volumes.size(); ++v) {
    const int volume = block.volumes[v].volume;
    in_bar.of(Quantity::volume)[volume] += std::exchange(bar.volumes[v].rest, T(0.0));
    in_bar.of(Quantity::volume_compliance)[volume] +=
        std::exchange(bar.volumes[v].a, T(0.0)) * T(1.0 / (bar.eta * bar.eta));
  }
  bar.eta = 0.0;
}

// The arrays of one iteration with those of its reverse.
template <class T>
sheetbend_blocks::Block arrays_of(const DirectBlock& block, const std::vector<sheetbend_blocks::Run>& runs,
                                  BlockState<T>& state, int iteration, BlockCotangents<T>& bar) {
  sheetbend_blocks::Block b = arrays_of(block, runs, state, iteration);
  b.x_bar = bar.x.numbers();
  b.z = bar.z.numbers();
  b.y = bar.y.numbers();
  b.lambda_bar = bar.lambda.numbers();
  b.C_r_bar = bar.C_r.numbers();
  return b;
}

// Takes the cotangents of the corrected coordinates (dofs) and of the multipliers (rows of the scene; null where nothing reads them).
template <class T>
void begin_block_vjp(const SubstepState<T>& s, const DirectBlock& block, const T* x_bar, const T* lambda_bar,
                     const Inputs<T>& in_bar, BlockCotangents<T>& bar) {
  if (bar.eta != s.eta) finish_block(s.scene, block, s.inputs, in_bar, bar);
  bar.eta = s.eta;
  bar.x.clear();
  bar.C_r.clear();
  for (int row = 0; row < block.size(); ++row)
    bar.lambda[row] = lambda_bar ? lambda_bar[block.multipliers[row]] : T(0.0);
  for (int p = 0; p < block.movable; ++p)
    std::copy_n(x_bar + s.scene.first_dof[block.particles[p]], 3, bar.x.data() + sheetbend_blocks::row * p);
}

// The volumes' own share, as pull_back() is that of the constraints.
template <class T>
void pull_back_volumes(const Scene& scene, const DirectBlock& block, BlockState<T>& state, int iteration,
                       BlockCotangents<T>& bar) {
  auto& own = state.at(iteration);
  const auto vector_at = [](Numbers<T>& rows, int particle) {
    return Vec3<T>(rows.data() + sheetbend_blocks::row * static_cast<std::size_t>(particle));
  };
  for (std::size_t i = 0; i < block.volumes.size(); ++i) {
    const BlockVolume& volume = block.volumes[i];
    const T dl = own.dl[volume.row], y = bar.y[volume.row];
    typename BlockCotangents<T>::VolumeValues& values = bar.volumes[i];
    values.rest += y;
    values.a -= y * (state.at(state.lambda, iteration)[volume.row] + dl);
    bar.lambda[volume.row] -= state.diagonal[volume.row] * y;
    for (std::size_t k = 0; k < values.v.size(); ++k) {
      const int p = volume.particles[k];
      const T w = p < block.movable ? state.at(state.x, iteration)[sheetbend_blocks::row * p + 3] : T(0.0);
      values.v[k] = w * (dl * vector_at(bar.z, p) - y * vector_at(own.u, p));
    }
    place_volume(volume, state, iteration, state.volumes[i].x);
    for_each_hessian_times(
        scene.volumes[volume.volume], state.volumes[i].x, values.v,
        [&](int k, const Vec3<T>& share) { share.add_to(bar.x.data() + sheetbend_blocks::row * volume.particles[k]); });
  }
}

template <class T>
void project_block_vjp(const SubstepState<T>& s, const DirectBlock& block, const sheetbend_packs::KernelTable& table,
                       BlockState<T>& state, int iteration, BlockCotangents<T>& bar) {
  const auto& runs = runs_of(s, block, state, &bar.values);
  const auto arrays = arrays_of(block, runs, state, iteration, bar);
  const auto& reverse = reverse_kernels<T>(table);
  reverse.right_side(arrays);
  if (block.banded())
    forward_kernels<T>(table).solve(arrays, arrays.y);
  else
    solve_sparse(block, state, iteration, bar.y.data());
  reverse.spread(arrays);
  reverse.pull_back(arrays);
  pull_back_volumes(s.scene, block, state, iteration, bar);
}

// Writes the cotangents of the predicted coordinates of movable nodes and adds those of inverse masses (nodes). Those of fixed nodes stay
// behind, since several blocks may share a node: add_fixed() is called for one block after the other.
template <class T>
void end_block_vjp(const SubstepState<T>& s, const DirectBlock& block, T* x_bar, T* w_bar, BlockCotangents<T>& bar) {
  for (int p = 0; p < block.movable; ++p) {
    const T* own = bar.x.data() + sheetbend_blocks::row * p;
    std::copy_n(own, 3, x_bar + s.scene.first_dof[block.particles[p]]);
    w_bar[block.particles[p]] += own[3];
  }
}

// Adds what stands in rows to the coordinates (dofs) of the particles from `begin` to `end`.
template <class T>
void add_particles(const Scene& scene, const DirectBlock& block, std::size_t begin, std::size_t end, Numbers<T>& rows,
                   T* x_bar) {
  for (std::size_t p = begin; p < end; ++p)
    Vec3<T>(rows.data() + sheetbend_blocks::row * p).add_to(x_bar + scene.first_dof[block.particles[p]]);
}

// The reverse of damping_references(): adds to the cotangents of the states at n and n-1, for movable nodes.
template <class T>
void damping_references_vjp(const SubstepState<T>& s, const DirectBlock& block,
                            const sheetbend_packs::KernelTable& table, double before, BlockState<T>& state, T* x_bar,
                            T* x_before_bar, BlockCotangents<T>& bar) {
  if (!block.damped) return;
  const auto& runs = runs_of(s, block, state, &bar.values);
  const auto pull_back = [&](typename BlockState<T>::Values& values, double scale, Numbers<T>& rows, T* to) {
    rows.clear();
    if (scale == 0.0) return;
    auto arrays = values_at<T>(runs, values);
    arrays.C_bar = bar.C_r.numbers();
    arrays.scale = scale;
    arrays.x_bar = rows.numbers();
    reverse_kernels<T>(table).values(arrays);
    add_particles(s.scene, block, 0, block.movable, rows, to);
  };
  pull_back(state.now, 1.0 - before, bar.x_now, x_bar);
  pull_back(state.before, before, bar.x_before, x_before_bar);
}

// Adds the cotangents of fixed nodes: of their coordinates during the substep, and at n and n-1.
template <class T>
void add_fixed(const Scene& scene, const DirectBlock& block, BlockCotangents<T>& bar, T* q_bar, T* x_bar,
               T* x_before_bar) {
  add_particles(scene, block, block.movable, block.particles.size(), bar.x, q_bar);
  if (!block.damped) return;
  add_particles(scene, block, block.movable, block.particles.size(), bar.x_now, x_bar);
  add_particles(scene, block, block.movable, block.particles.size(), bar.x_before, x_before_bar);
}

}  // namespace sheetbend
