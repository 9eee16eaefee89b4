// One substep, in the words of the paper (Macklin et al. 2016, algorithm 1): predict, project, and read the velocity off the positions.
#pragma once

#include <algorithm>
#include <atomic>

#include "core/solver/predict.h"
#include "core/solver/project_block.h"

namespace sheetbend {

template <class T>
struct SubstepRecord {
  std::vector<IterationRecord<T>> iterations;
  Weights<T> weights;
  std::vector<T> C_r;           // damping references
  std::vector<T> lambda, rows;  // multipliers; right sides and solutions of direct blocks
  PackState<std::conditional_t<in_packs<T>, T, double>> packs;  // all of that where colors go through the kernels

  void resize(const Scene& scene, const Plan& plan, bool keep_iterations) {
    weights.w.resize(scene.nodes());
    if (scene.has_drag) weights.kept.resize(scene.nodes());
    C_r.resize(damped_rows(scene));
    if (sweeps_packs<T>(plan)) {
      if constexpr (in_packs<T>) packs.resize(plan.packs, keep_iterations ? plan.options.iterations : 0);
      return;
    }
    iterations.resize(keep_iterations ? plan.options.iterations : 1);
    for (auto& i : iterations) i.resize(scene, plan);
    lambda.resize(scene.rows);
    rows.resize(scene.rows);
  }

  // Where the coordinates are while they are corrected: in the kernels' rows, or in q.
  Coordinates<T> coordinates(const Plan& plan, T* q) {
    if constexpr (in_packs<T>)
      if (sweeps_packs<T>(plan)) return {packs.rows.at(0), sheetbend_packs::row};
    return {q, 3};
  }
};

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

// All iterations.
template <class T>
void project(const Scene& scene, const Plan& plan, const Inputs<const T>& in, double eta, T* q,
             SubstepRecord<T>& record) {
  const SolverOptions& o = plan.options;
  if constexpr (in_packs<T>)
    if (sweeps_packs<T>(plan)) {
      begin_sweeps(scene, plan.packs, in, eta, record.weights.w.data(), record.C_r.data(), record.packs);
      for (int iteration = 0; iteration < o.iterations; ++iteration)
        sweep(plan.packs, pack_kernels(), o.threads, o.grain, iteration, record.packs);
      return;
    }
  std::fill(record.lambda.begin(), record.lambda.end(), T(0.0));
  const SubstepState<T> state{scene, in, eta, q, record.weights.w.data(), record.C_r.data(), record.lambda.data()};
  for (int iteration = 0; iteration < o.iterations; ++iteration) {
    IterationRecord<T>& kept = record.iterations[record.iterations.size() == 1 ? 0 : iteration];
    parallel_for(static_cast<int>(plan.blocks.size()), o.threads, 1, [&](int begin, int end) {
      for (int b = begin; b < end; ++b) project_block(state, plan.blocks[b], record.rows.data(), kept, kept.factors[b]);
    });
    for (const Color& color : plan.colors) project_color(state, o, color, kept);
  }
}

// What the reverse repeats of a substep: everything but the velocity. The record holds every iteration when it was sized so, the last one
// otherwise; q (dofs) is used where the coordinates are not in the record.
template <class T>
void correct(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
             const SubstepStates<T>& s, T* q, SubstepRecord<T>& record) {
  weigh(scene, in, bdf, s, record.weights);
  predict(scene, in, bdf, t_next, s, record.weights, plan.options.threads, record.coordinates(plan, q));
  damping_references(scene, in, bdf, s, record.C_r.data());
  project(scene, plan, in, bdf.eta, q, record);
}

// v = (q - history(x))/eta, and q to x_next. Says whether all of q is finite.
template <class T>
bool read_off(const Scene& scene, const Bdf& bdf, const SubstepStates<T>& s, int threads, const Coordinates<T>& q,
              T* x_next, T* v) {
  std::atomic<bool> finite = true;
  parallel_for(scene.nodes(), threads, points_per_thread, [&](int begin, int end) {
    PointSum<T> difference;  // q - q, which only what is finite has as zero
    for_each_point<T>(begin, end, [&](int n, auto how) {
      const int dof = scene.first_dof[n];
      const auto now = how.load(q.of(n));
      how.store(x_next + dof, now);
      how.store(v + dof, scaled(T(1.0 / bdf.eta), now - history(bdf, how, s.x + dof, s.x_before + dof)));
      difference.add(now - now);
    });
    const Vec3<T> d = difference.total();
    if (!all_finite(d.x) || !all_finite(d.y) || !all_finite(d.z)) finite = false;
  });
  return finite;
}

// Steps from n to n+1, writing x_next and v. Says whether the state is finite.
template <class T>
bool substep(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
             const SubstepStates<T>& s, T* x_next, T* v, SubstepRecord<T>& record) {
  correct(scene, plan, in, bdf, t_next, s, x_next, record);
  return read_off(scene, bdf, s, plan.options.threads, record.coordinates(plan, x_next), x_next, v);
}

}  // namespace sheetbend
