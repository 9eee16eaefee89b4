// The reverse of one substep: velocity read-off, projections in reverse order, damping references, prediction.
#pragma once

#include "adjoint/air_vjp.h"
#include "adjoint/packs/packed_reverse.h"
#include "adjoint/project_implicit_vjp.h"
#include "adjoint/project_vjp.h"
#include "adjoint/volume_vjp.h"
#include "adjoint/yield_vjp.h"

namespace sheetbend {

template <class T>
struct ReverseScratch {
  std::vector<T> x, fixed, lambda, w, C_r;
  std::vector<T> carried;  // the state before what yields has yielded
  std::vector<Vec3<T>> gravity;
  PackCotangents<std::conditional_t<in_packs<T>, T, double>> packs;  // of colors that go through the kernels
  std::vector<BlockCotangents<T>> blocks;
  std::vector<VolumeCotangents<T>> volumes;

  ReverseScratch(const Scene& scene, const Plan& plan)
      : blocks(plan.blocks.size()), volumes(swept_volumes(scene, plan)) {
    for (std::size_t v = 0; v < volumes.size(); ++v) volumes[v].v.resize(scene.volumes[v].nodes.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].resize(scene, plan.blocks[b]);
    if (!plan.colors.empty()) C_r.resize(damped_rows(scene));
    if (scene.yields) carried.resize(scene.dofs());
    if (sweeps_packs<T>(plan)) {
      if constexpr (in_packs<T>) packs.resize(plan.packs);
      return;
    }
    x.resize(scene.dofs());
    w.resize(scene.nodes());
    if (plan.colors.empty()) return;
    fixed.resize(scene.stencil_coordinates);
    lambda.resize(scene.rows);
  }

  // Where the cotangents of the coordinates and of the inverse masses are while projections are reversed.
  Coordinates<T> q_bar(const Plan& plan) {
    if constexpr (in_packs<T>)
      if (sweeps_packs<T>(plan)) return {packs.rows.at(0), sheetbend_packs::row};
    return {x.data(), 3};
  }
  Strided<T> w_bar(const Plan& plan) {
    if constexpr (in_packs<T>)
      if (sweeps_packs<T>(plan)) return {packs.rows.at(0) + 3, sheetbend_packs::row};
    return {w.data(), 1};
  }
};

// Reverse of damping_references().
template <class T>
void damping_references_vjp(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
                            const T* C_r_bar, const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  const auto pull_back = [&]<class K>(K, const Group& group, int item, const T* at, const T* C_bar, const T& scale,
                                      T* x_bar) {
    const int* nodes = group.stencil.data() + static_cast<std::size_t>(item) * K::arity;
    const std::size_t value = group.first_value + static_cast<std::size_t>(item) * parameter_count<K>;
    T x[K::dofs], scaled[K::rows], by[K::dofs]{};
    for (int d = 0; d < K::dofs; ++d) x[d] = at[scene.first_dof[nodes[d / 3]] + d % 3];
    for (int j = 0; j < K::rows; ++j) scaled[j] = scale * C_bar[j];
    values_vjp<K>(x, in.of(Quantity::rest) + value, scaled, by, in_bar.of(Quantity::rest) + value);
    for (int d = 0; d < K::dofs; ++d) x_bar[scene.first_dof[nodes[d / 3]] + d % 3] += by[d];
  };
  for (const Group& group : scene.groups) {
    if (!group.damped) continue;
    with_kind(group.kind, [&]<class K>(K kind) {
      for (int i = 0; i < group.count; ++i) {
        const T* C_bar = C_r_bar + group.first_row + i * K::rows;
        pull_back(kind, group, i, s.x, C_bar, T(1.0 - bdf.before), bar.x);
        if (bdf.before != 0.0) pull_back(kind, group, i, s.x_before, C_bar, T(bdf.before), bar.x_before);
      }
    });
  }
}

template <class T>
void project_blocks_vjp(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf,
                        SubstepRecord<T>& record, ReverseScratch<T>& scratch, const StateCotangents<T>& bar,
                        const Inputs<T>& in_bar) {
  const SolverOptions& o = plan.options;
  const SubstepState<T> state{scene, in, bdf.eta, nullptr, record.weights.w.data(), nullptr, nullptr};
  parallel_for(static_cast<int>(plan.blocks.size()), o.threads, 1, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      BlockCotangents<T>& own = scratch.blocks[b];
      begin_block_vjp<T>(state, plan.blocks[b], scratch.x.data(), nullptr, in_bar, own);
      if (plan.blocks[b].implicit)
        project_implicit_vjp(state, plan.blocks[b], pack_kernels(), record.blocks[b], own);
      else
        for (int iteration = o.iterations - 1; iteration >= 0; --iteration)
          project_block_vjp(state, plan.blocks[b], pack_kernels(), record.blocks[b], iteration, own);
      end_block_vjp(state, plan.blocks[b], scratch.x.data(), scratch.w.data(), own);
      refer_block_vjp(state, plan.blocks[b], pack_kernels(), bdf.before, record.blocks[b], bar.x, bar.x_before, own);
    }
  });
  for (std::size_t b = 0; b < plan.blocks.size(); ++b)
    add_fixed(scene, plan.blocks[b], scratch.blocks[b], scratch.x.data(), bar.x, bar.x_before);
}

// Reverse of project_colors().
template <class T>
void project_colors_vjp(const Scene& scene, const Plan& plan, const Inputs<const T>& in, double eta, int iteration,
                        bool last, SubstepRecord<T>& record, ReverseScratch<T>& scratch, const Inputs<T>& in_bar) {
  const SolverOptions& o = plan.options;
  if constexpr (in_packs<T>) {
    sweep_vjp(plan.packs, pack_kernels(), o.threads, o.grain, iteration, last, record.packs, scratch.packs);
  } else {
    const SubstepState<T> state{
        scene, in, eta, nullptr, record.weights.w.data(), record.C_r.data(), record.lambda.data()};
    const SubstepCotangent<T> cotangent{scratch.x.data(), scratch.fixed.data(), scratch.lambda.data(),
                                        scratch.w.data(), scratch.C_r.data(),   in_bar};
    for (auto color = plan.colors.rbegin(); color != plan.colors.rend(); ++color)
      project_color_vjp(state, o, *color, record.iterations[iteration], cotangent);
  }
}

// Adds what fixed nodes received, per stencil, to their own.
template <class T>
void end_colors_vjp(const Scene& scene, const Plan& plan, ReverseScratch<T>& scratch) {
  if constexpr (in_packs<T>) {
    end_sweeps_vjp(scene, plan.packs, scratch.packs, scratch.C_r.data());
  } else {
    for (const Group& group : scene.groups)
      for (int i = 0; i < group.count; ++i)
        for (int k = 0; k < group.arity; ++k) {
          const int node = group.nodes(i)[k];
          if (scene.role[node] == Role::free) continue;
          const std::size_t from = group.first_coordinate + (static_cast<std::size_t>(i) * group.arity + k) * 3;
          Vec3<T>(&scratch.fixed[from]).add_to(&scratch.x[scene.first_dof[node]]);
        }
  }
}

// Reverse of project(): scratch.q_bar() goes from the cotangent of the corrected coordinates to that of the predicted ones.
template <class T>
void project_vjp(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf,
                 const SubstepStates<T>& s, SubstepRecord<T>& record, ReverseScratch<T>& scratch,
                 const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  const SolverOptions& o = plan.options;
  for (auto* buffer : {&scratch.C_r, &scratch.fixed, &scratch.lambda, &scratch.w})
    std::fill(buffer->begin(), buffer->end(), T(0.0));
  project_blocks_vjp(scene, plan, in, bdf, record, scratch, bar, in_bar);
  if constexpr (in_packs<T>)
    if (!plan.colors.empty()) begin_sweeps_vjp(scene, plan.packs, o.threads, in, record.packs, in_bar, scratch.packs);
  for (int iteration = o.iterations - 1; iteration >= 0; --iteration) {
    const bool last = iteration == o.iterations - 1;
    project_volumes_vjp(scene, in, bdf.eta, record.weights.w.data(), iteration, last, record.volumes,
                        scratch.q_bar(plan), scratch.w_bar(plan), in_bar, scratch.volumes);
    project_colors_vjp(scene, plan, in, bdf.eta, iteration, last, record, scratch, in_bar);
  }
  if (plan.colors.empty()) return;
  end_colors_vjp(scene, plan, scratch);
  damping_references_vjp(scene, in, bdf, s, scratch.C_r.data(), bar, in_bar);
}

// Given the cotangents of x_{n+1} and v_{n+1}, adds to those of the states before and of the inputs. The record and q are
// the substep's own, recomputed by correct(). x_next_bar is used up.
template <class T>
void substep_vjp(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
                 const SubstepStates<T>& s, SubstepRecord<T>& record, T* q, T* x_next_bar, const T* v_next_bar,
                 ReverseScratch<T>& scratch, const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  const int threads = plan.options.threads;
  const Coordinates<T> corrected = record.coordinates(plan, q);
  if (scene.yields) {
    read_carried(scene, corrected, scratch.carried.data());
    yield_vjp(scene, in, scratch.carried.data(), x_next_bar, in_bar);
  }
  retract_directors_vjp(scene, [&](int node) { return corrected.of(node); }, x_next_bar);
  read_off_vjp(scene, bdf, x_next_bar, v_next_bar, threads, scratch.q_bar(plan), bar);
  project_vjp(scene, plan, in, bdf, s, record, scratch, bar, in_bar);
  blow_vjp(scene, in, bdf, t_next, s, record.weights, scratch.q_bar(plan), scratch.w_bar(plan), bar, in_bar);
  predict_vjp(scene, in, bdf, t_next, s, record.weights, scratch.q_bar(plan), scratch.w_bar(plan), threads,
              scratch.gravity, bar, in_bar);
}

}  // namespace sheetbend
