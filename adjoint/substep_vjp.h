// The reverse of one substep: velocity read-off, projections in reverse order, damping references, prediction.
#pragma once

#include "adjoint/packs/packed_reverse.h"
#include "adjoint/project_block_vjp.h"
#include "adjoint/project_vjp.h"

namespace sheetbend {

// Cotangents of the states at n and n-1, accumulated.
template <class T>
struct StateCotangents {
  T *x, *x_before, *v, *v_before;
};

template <class T>
struct ReverseScratch {
  std::vector<T> x, fixed, lambda, w, C_r;
  PackCotangents packs;
  std::vector<BlockCotangents<T>> blocks;

  ReverseScratch(const Scene& scene, const Plan& plan)
      : x(scene.dofs()),
        fixed(scene.stencil_coordinates),
        lambda(scene.rows),
        w(scene.nodes()),
        C_r(scene.rows),
        blocks(plan.blocks.size()) {
    for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].resize(scene, plan.blocks[b]);
    if constexpr (in_packs<T>) packs.resize(plan.packs);
  }
};

template <class T>
void pull_back_history(const Bdf& bdf, const T& bar, T& now_bar, T& before_bar) {
  now_bar += T(bdf.now) * bar;
  if (bdf.before != 0.0) before_bar += T(bdf.before) * bar;
}

template <class T>
void pull_back_knots(const KnotWeights& k, const Vec3<T>& bar, T* values_bar, int slots, int slot) {
  for (int i = 0; i < k.count; ++i)
    (T(k.weight[i]) * bar).add_to(values_bar + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot));
}

// Reverse of damping_references().
template <class T>
void damping_references_vjp(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
                            const T* C_r_bar, const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  const auto pull_back = [&]<class K>(K, const Group& group, int item, const T* at, const T* C_bar, const T& scale,
                                      T* x_bar) {
    constexpr int P = parameter_count<K>;
    const int* nodes = group.stencil.data() + static_cast<std::size_t>(item) * K::arity;
    const std::size_t value = group.first_value + static_cast<std::size_t>(item) * P;
    using D = std::conditional_t<P == 0, T, Dual<T, P>>;
    D x[K::dofs], p[P + 1], C[K::rows], J[K::rows * K::dofs];
    for (int d = 0; d < K::dofs; ++d) x[d] = D(at[scene.first_dof[nodes[d / 3]] + d % 3]);
    for (int k = 0; k < P; ++k) p[k] = D(in.of(Quantity::rest)[value + k]);
    if constexpr (P > 0)
      for (int k = 0; k < P; ++k) p[k].d[k] = T(1.0);
    K::evaluate(x, p, C, J);
    for (int j = 0; j < K::rows; ++j) {
      const T bar_j = scale * C_bar[j];
      for (int d = 0; d < K::dofs; ++d)
        x_bar[scene.first_dof[nodes[d / 3]] + d % 3] += bar_j * primal<T>(J[j * K::dofs + d]);
      if constexpr (P > 0)
        for (int k = 0; k < P; ++k) in_bar.of(Quantity::rest)[value + k] += bar_j * C[j].d[k];
    }
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

// Reverse of predict(), given the cotangents of q and w.
template <class T>
void predict_vjp(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, double t_next,
                 const SubstepStates<T>& s, const T* w, const T* q_bar, const T* w_bar, const StateCotangents<T>& bar,
                 const Inputs<T>& in_bar) {
  const Vec3<T> gravity(in.of(Quantity::gravity));
  const KnotWeights boundary = scene.driven.empty() ? KnotWeights{} : scene.boundary.at(t_next);
  const KnotWeights force = scene.loaded.empty() ? KnotWeights{} : scene.force.at(t_next);
  const T eta(bdf.eta);
  for (int n = 0; n < scene.nodes(); ++n) {
    const int dof = scene.first_dof[n];
    const Vec3<T> qb(q_bar + dof);
    if (scene.role[n] == Role::pinned) {
      qb.add_to(bar.x + dof);
      continue;
    }
    if (scene.role[n] == Role::driven) {
      pull_back_knots(boundary, qb, in_bar.of(Quantity::boundary), static_cast<int>(scene.driven.size()),
                      scene.driven_slot[n]);
      continue;
    }
    const T m = in.of(Quantity::mass)[n];
    Vec3<T> f = m * gravity;
    if (scene.loaded_slot[n] >= 0)
      f = f + at_knots(force, in.of(Quantity::force), static_cast<int>(scene.loaded.size()), scene.loaded_slot[n]);
    Vec3<T> v_history;
    for (int d = 0; d < 3; ++d) {
      const T h = history(bdf, s.v[dof + d], s.v_before[dof + d]);
      (d == 0 ? v_history.x : d == 1 ? v_history.y : v_history.z) = h;
    }
    // q = history(x) + eta w P,  P = m history(v) + eta f,  w = 1/m_eff
    const Vec3<T> v_star_bar = eta * qb, P_bar = w[n] * v_star_bar, P = m * v_history + eta * f;
    const T m_eff_bar = -(w[n] * w[n] * (w_bar[n] + dot(P, v_star_bar)));
    in_bar.of(Quantity::mass)[n] += m_eff_bar + dot(P_bar, v_history + eta * gravity);
    (eta * m * P_bar).add_to(in_bar.of(Quantity::gravity));
    if (scene.loaded_slot[n] >= 0)
      pull_back_knots(force, eta * P_bar, in_bar.of(Quantity::force), static_cast<int>(scene.loaded.size()),
                      scene.loaded_slot[n]);
    const T x_bar[3] = {qb.x, qb.y, qb.z}, v_bar[3] = {m * P_bar.x, m * P_bar.y, m * P_bar.z};
    for (int d = 0; d < 3; ++d) {
      pull_back_history(bdf, x_bar[d], bar.x[dof + d], bar.x_before[dof + d]);
      pull_back_history(bdf, v_bar[d], bar.v[dof + d], bar.v_before[dof + d]);
    }
    if (scene.has_drag) {
      const Vec3<T> v = extrapolated_velocity(bdf, s, dof);
      const T v2 = dot(v, v), speed = sqrt_or_zero(v2);
      in_bar.of(Quantity::drag_linear)[n] += eta * m_eff_bar;
      in_bar.of(Quantity::drag_quadratic)[n] += eta * speed * m_eff_bar;
      const auto moving = v2 > T(0.0);
      const T along =
          select(moving, eta * in.of(Quantity::drag_quadratic)[n] * m_eff_bar / select(moving, speed, T(1.0)), T(0.0));
      (T(bdf.extrapolate_now) * along * v).add_to(bar.v + dof);
      if (bdf.extrapolate_before != 0.0) (T(bdf.extrapolate_before) * along * v).add_to(bar.v_before + dof);
    }
  }
}

// Reverse of project(): scratch.x goes from the cotangent of the corrected coordinates to that of the predicted ones.
template <class T>
void project_vjp(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf,
                 SubstepRecord<T>& record, ReverseScratch<T>& scratch, const StateCotangents<T>& bar,
                 const Inputs<T>& in_bar) {
  if constexpr (in_packs<T>)
    if (!plan.colors.empty())
      return reverse_sweeps(scene, plan.packs, pack_kernels(), plan.options.iterations, plan.options.threads,
                            plan.options.grain, in, record.packs, scratch.x.data(), scratch.w.data(),
                            scratch.C_r.data(), in_bar, scratch.packs);
  const SubstepState<T> state{scene, in, bdf.eta, nullptr, record.w.data(), record.C_r.data(), record.lambda.data()};
  const SubstepCotangent<T> cotangent{scratch.x.data(), scratch.fixed.data(), scratch.lambda.data(),
                                      scratch.w.data(), scratch.C_r.data(),   in_bar};
  parallel_for(static_cast<int>(plan.blocks.size()), plan.options.threads, 1, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      BlockCotangents<T>& own = scratch.blocks[b];
      begin_block_vjp(state, plan.blocks[b], scratch.x.data(), scratch.lambda.data(), in_bar, own);
      for (int iteration = plan.options.iterations - 1; iteration >= 0; --iteration)
        project_block_vjp(state, plan.blocks[b], pack_kernels(), record.blocks[b], iteration, own);
      end_block_vjp(state, plan.blocks[b], scratch.x.data(), scratch.w.data(), own);
      refer_block_vjp(state, plan.blocks[b], pack_kernels(), bdf.before, record.blocks[b], bar.x, bar.x_before, own);
    }
  });
  for (std::size_t b = 0; b < plan.blocks.size(); ++b)
    add_fixed(scene, plan.blocks[b], scratch.blocks[b], scratch.x.data(), bar.x, bar.x_before);
  if (plan.colors.empty()) return;
  for (int iteration = plan.options.iterations - 1; iteration >= 0; --iteration)
    for (auto color = plan.colors.rbegin(); color != plan.colors.rend(); ++color)
      project_color_vjp(state, plan.options, *color, record.iterations[iteration], cotangent);
  for (const Group& group : scene.groups)
    for (int i = 0; i < group.count; ++i)
      for (int k = 0; k < group.arity; ++k) {
        const int node = group.nodes(i)[k];
        if (scene.role[node] == Role::free) continue;
        const std::size_t from = group.first_coordinate + (static_cast<std::size_t>(i) * group.arity + k) * 3;
        for (int d = 0; d < 3; ++d) scratch.x[scene.first_dof[node] + d] += scratch.fixed[from + d];
      }
}

// Given the cotangents of x_{n+1} and v_{n+1}, adds to those of the states before and of the inputs. The record is the substep's own, recomputed.
template <class T>
void substep_vjp(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
                 const SubstepStates<T>& s, SubstepRecord<T>& record, const T* x_next_bar, const T* v_next_bar,
                 ReverseScratch<T>& scratch, const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  for (int i = 0; i < scene.dofs(); ++i) {
    const T back = v_next_bar[i] * T(1.0 / bdf.eta);
    scratch.x[i] = x_next_bar[i] + back;
    pull_back_history(bdf, -back, bar.x[i], bar.x_before[i]);
  }
  for (auto* buffer : {&scratch.fixed, &scratch.lambda, &scratch.w, &scratch.C_r})
    std::fill(buffer->begin(), buffer->end(), T(0.0));

  project_vjp(scene, plan, in, bdf, record, scratch, bar, in_bar);
  if (plan.blocks.empty()) damping_references_vjp(scene, in, bdf, s, scratch.C_r.data(), bar, in_bar);
  predict_vjp(scene, in, bdf, t_next, s, record.w.data(), scratch.x.data(), scratch.w.data(), bar, in_bar);
}

}  // namespace sheetbend
