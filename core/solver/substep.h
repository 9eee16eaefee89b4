// One substep, in the words of the paper (Macklin et al. 2016, algorithm 1): predict, project, and read the velocity off the positions.
#pragma once

#include <algorithm>

#include "core/solver/project.h"
#include "core/solver/project_block.h"

namespace sheetbend {

// The states that a substep reads and the one it writes.
template <class T>
struct SubstepStates {
  const T *x, *x_before, *v, *v_before;  // at n and n-1 (n-1 unused by BDF1)
};

// Whether colors go through the kernels of core/packs; other scalars go one constraint at a time.
template <class T>
inline constexpr bool in_packs = std::is_same_v<T, double>;

template <class T>
struct SubstepRecord {
  std::vector<IterationRecord<T>> iterations;
  std::vector<T> w, C_r,
      lambda;       // effective inverse masses, damping references, multipliers (those of packs and blocks stay there)
  PackState packs;  // of colors in double precision, which go eight constraints at a time
  std::vector<BlockState<T>> blocks;

  void resize(const Scene& scene, const Plan& plan, bool keep_iterations) {
    iterations.resize(keep_iterations ? plan.options.iterations : 1);
    if (!in_packs<T> && !plan.colors.empty())
      for (auto& i : iterations) i.resize(scene);
    w.resize(scene.nodes());
    C_r.resize(scene.rows);
    lambda.resize(scene.rows);
    blocks.resize(plan.blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b)
      blocks[b].resize(scene, plan.blocks[b], keep_iterations ? plan.options.iterations : 0);
    if constexpr (in_packs<T>) packs.resize(plan.packs, keep_iterations ? plan.options.iterations : 0);
  }
};

template <class T>
T history(const Bdf& bdf, const T& now, const T& before) {
  return bdf.before == 0.0 ? now : T(bdf.now) * now + T(bdf.before) * before;
}

// Value of something given at knots, (knots, slots, 3), for one slot.
template <class T>
Vec3<T> at_knots(const KnotWeights& k, const T* values, int slots, int slot) {
  Vec3<T> sum;
  for (int i = 0; i < k.count; ++i)
    sum = sum + T(k.weight[i]) * Vec3<T>(values + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot));
  return sum;
}

// The speed that quadratic drag is linearized at.
template <class T>
Vec3<T> extrapolated_velocity(const Bdf& bdf, const SubstepStates<T>& s, int dof) {
  return T(bdf.extrapolate_now) * Vec3<T>(s.v + dof) + T(bdf.extrapolate_before) * Vec3<T>(s.v_before + dof);
}

// x* = history(x) + eta v*, (m + eta c) v* = m history(v) + eta (m gravity + f), c = c1 + c2 |v|. Drag is implicit: it adds eta c to the mass
// that this substep's projections see, so the reaction of the constraints feels it too. Driven nodes go where their boundary is.
template <class T>
void predict(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, double t_next, const SubstepStates<T>& s,
             T* q, T* w) {
  const T* mass = in.of(Quantity::mass);
  const Vec3<T> gravity(in.of(Quantity::gravity));
  const KnotWeights boundary = scene.driven.empty() ? KnotWeights{} : scene.boundary.at(t_next);
  const KnotWeights force = scene.loaded.empty() ? KnotWeights{} : scene.force.at(t_next);
  const T eta(bdf.eta);
  for (int n = 0; n < scene.nodes(); ++n) {
    const int dof = scene.first_dof[n];
    if (scene.role[n] == Role::pinned) {
      w[n] = T(0.0);
      Vec3<T>(s.x + dof).store(q + dof);
      continue;
    }
    if (scene.role[n] == Role::driven) {
      w[n] = T(0.0);
      at_knots(boundary, in.of(Quantity::boundary), static_cast<int>(scene.driven.size()), scene.driven_slot[n])
          .store(q + dof);
      continue;
    }
    T m_eff = mass[n];
    if (scene.has_drag) {
      const Vec3<T> v = extrapolated_velocity(bdf, s, dof);
      m_eff += eta * (in.of(Quantity::drag_linear)[n] + in.of(Quantity::drag_quadratic)[n] * sqrt_or_zero(dot(v, v)));
    }
    w[n] = T(1.0) / m_eff;
    Vec3<T> f = mass[n] * gravity;
    if (scene.loaded_slot[n] >= 0)
      f = f + at_knots(force, in.of(Quantity::force), static_cast<int>(scene.loaded.size()), scene.loaded_slot[n]);
    for (int d = 0; d < 3; ++d) {
      const T fd = d == 0 ? f.x : d == 1 ? f.y : f.z;
      const T momentum = mass[n] * history(bdf, s.v[dof + d], s.v_before[dof + d]) + eta * fd;
      q[dof + d] = history(bdf, s.x[dof + d], s.x_before[dof + d]) + eta * (w[n] * momentum);
    }
  }
}

// C_r = C(x_n) for BDF1, (4 C(x_n) - C(x_{n-1}))/3 for BDF2 (angles kept on one branch).
template <class T>
void damping_references(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
                        T* C_r) {
  for (const Group& group : scene.groups) {
    if (!group.damped) continue;
    with_kind(group.kind, [&]<class K>(K) {
      for (int i = 0; i < group.count; ++i) {
        T x[K::dofs], x_before[K::dofs];
        const int* nodes = group.stencil.data() + static_cast<std::size_t>(i) * K::arity;
        for (int k = 0; k < K::arity; ++k) {
          std::copy_n(s.x + scene.first_dof[nodes[k]], 3, x + 3 * k);
          std::copy_n(s.x_before + scene.first_dof[nodes[k]], 3, x_before + 3 * k);
        }
        const T* p = in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(i) * parameter_count<K>;
        const Evaluation<K, T> now(x, p), before(x_before, p);
        for (int j = 0; j < K::rows; ++j)
          C_r[group.first_row + i * K::rows + j] =
              bdf.before == 0.0 ? now.C[j] : now.C[j] - T(bdf.before) * difference<K>(now.C[j], before.C[j]);
      }
    });
  }
}

// All iterations, on q, with the damping references that they need.
template <class T>
void project(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
             T* q, SubstepRecord<T>& record) {
  const SolverOptions& o = plan.options;
  const double eta = bdf.eta;
  if (plan.blocks.empty()) damping_references(scene, in, bdf, s, record.C_r.data());
  if constexpr (in_packs<T>)
    if (!plan.colors.empty()) {
      begin_sweeps(scene, plan.packs, in, eta, q, record.w.data(), record.C_r.data(), record.packs);
      for (int iteration = 0; iteration < o.iterations; ++iteration)
        sweep(plan.packs, pack_kernels(), o.threads, o.grain, iteration, record.packs);
      return end_sweeps(scene, plan.packs, record.packs, q);
    }
  const SubstepState<T> state{
      scene, in, eta, q, record.w.data(), plan.blocks.empty() ? record.C_r.data() : nullptr, record.lambda.data()};
  parallel_for(static_cast<int>(plan.blocks.size()), o.threads, 1, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      begin_block(state, plan.blocks[b], record.blocks[b]);
      refer_block(state, plan.blocks[b], pack_kernels(), bdf.before, s.x, s.x_before, record.blocks[b]);
      for (int iteration = 0; iteration < o.iterations; ++iteration)
        project_block(state, plan.blocks[b], pack_kernels(), record.blocks[b], iteration);
      end_block(state, plan.blocks[b], record.blocks[b]);
    }
  });
  if (plan.colors.empty()) return;
  for (int iteration = 0; iteration < o.iterations; ++iteration)
    for (const Color& color : plan.colors)
      project_color(state, o, color, record.iterations[record.iterations.size() == 1 ? 0 : iteration]);
}

// Steps from n to n+1, writing q (x_{n+1}) and v. The record holds every iteration when it was sized so, the last one otherwise.
template <class T>
void substep(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
             const SubstepStates<T>& s, T* q, T* v, SubstepRecord<T>& record) {
  predict(scene, in, bdf, t_next, s, q, record.w.data());
  std::fill(record.lambda.begin(), record.lambda.end(), T(0.0));
  project(scene, plan, in, bdf, s, q, record);
  for (int i = 0; i < scene.dofs(); ++i) v[i] = (q[i] - history(bdf, s.x[i], s.x_before[i])) * T(1.0 / bdf.eta);
}

}  // namespace sheetbend
