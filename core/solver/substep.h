// One substep, in the words of the paper (Macklin et al. 2016, algorithm 1): predict, project, and read the velocity off the positions.
#pragma once

#include <algorithm>
#include <atomic>

#include "core/solver/air.h"
#include "core/solver/project.h"
#include "core/solver/project_implicit.h"
#include "core/solver/retract.h"
#include "core/solver/volume.h"
#include "core/solver/yield.h"

namespace sheetbend {

// Volumes that are projected between sweeps; blocks have them among their rows.
inline std::size_t swept_volumes(const Scene& scene, const Plan& plan) {
  return plan.options.partition == Partition::gauss_seidel ? scene.volumes.size() : 0;
}

// Their scenes have one section.
template <class T>
Sections sections_of_record(const Scene& scene, const Plan& plan, int kept) {
  return scene.volumes.empty() ? sections_of<T>(plan.packs, kept) : Sections{kept, kept};
}

template <class T>
struct SubstepRecord {
  std::vector<IterationRecord<T>> iterations;
  Weights<T> weights;
  std::vector<T> C_r, lambda;  // damping references, multipliers (those of packs and blocks stay there)
  PackState<std::conditional_t<in_packs<T>, T, double>> packs;  // of colors that go through the kernels
  std::vector<BlockState<T>> blocks;
  std::vector<VolumeState<T>> volumes;
  std::vector<sheetbend_points::Frame> frames;  // that the kernels retract

  void resize(const Scene& scene, const Plan& plan, bool keep_iterations) {
    weights.w.resize(scene.nodes());
    if (scene.has_drag) weights.kept.resize(scene.nodes());
    if constexpr (!std::is_same_v<T, double>) frames = frames_of(scene);
    const int kept = kept_iterations(plan, keep_iterations);
    blocks.resize(plan.blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].resize(scene, plan.blocks[b], kept);
    volumes.resize(swept_volumes(scene, plan));
    for (std::size_t v = 0; v < volumes.size(); ++v) volumes[v].resize(scene.volumes[v], kept);
    if (plan.colors.empty()) return;
    C_r.resize(damped_rows(scene));
    if constexpr (in_packs<T>) {
      packs.resize(plan.packs, sections_of_record<T>(scene, plan, kept));
    } else {
      iterations.resize(std::max(1, kept));
      for (auto& i : iterations) i.resize(scene);
      lambda.resize(scene.rows);
    }
  }

  // Where the coordinates are while they are corrected: in the kernels' rows, or (duals) in q.
  Coordinates<T> coordinates(const Plan& plan, T* q) {
    if constexpr (in_packs<T> && !carries_tangents<T>)
      if (sweeps_packs<T>(plan)) return {packs.rows.at(0), sheetbend_packs::row};
    return {q, 3};
  }

  // Calls f(at), at(node, d) being where a coordinate is while colors are swept. The rows of duals hold values and directions apart.
  template <class F>
  void with_coordinates(const Plan& plan, T* q, F&& f) {
    if constexpr (carries_tangents<T>)
      if (sweeps_packs<T>(plan))
        return f([&rows = packs.rows](int node, int d) {
          return rows[sheetbend_packs::row * static_cast<std::size_t>(node) + d];
        });
    f([at = coordinates(plan, q)](int node, int d) -> T& { return at.of(node)[d]; });
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

// Direct blocks, which share no movable particle: each goes through all its iterations, or to where its forces balance.
template <class T>
void project_blocks(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf,
                    const SubstepStates<T>& s, T* q, SubstepRecord<T>& record) {
  parallel_for(static_cast<int>(plan.blocks.size()), plan.options.threads, 1, [&](int begin, int end) {
    const SubstepState<T> state{scene, in, bdf.eta, q, record.weights.w.data(), nullptr, nullptr};
    for (int b = begin; b < end; ++b) {
      begin_block(state, plan.blocks[b], record.blocks[b]);
      refer_block(state, plan.blocks[b], pack_kernels(), bdf.before, s, record.blocks[b]);
      if (plan.blocks[b].implicit)
        project_implicit(state, plan.blocks[b], plan.options, s, pack_kernels(), record.blocks[b]);
      else
        for (int iteration = 0; iteration < plan.options.iterations; ++iteration)
          project_block(state, plan.blocks[b], pack_kernels(), record.blocks[b], iteration);
      end_block(state, plan.blocks[b], record.blocks[b]);
    }
  });
}

template <class T>
void begin_colors(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf,
                  const SubstepStates<T>& s, [[maybe_unused]] T* q, SubstepRecord<T>& record) {
  damping_references(scene, in, bdf, s, record.C_r.data());
  if constexpr (in_packs<T>)
    begin_sweeps(scene, plan.packs, in, bdf.eta, record.weights.w.data(), record.C_r.data(), record.packs, q);
  else
    std::fill(record.lambda.begin(), record.lambda.end(), T(0.0));
}

// One pass over all colors.
template <class T>
void project_colors(const Scene& scene, const Plan& plan, const Inputs<const T>& in, double eta, int iteration, T* q,
                    SubstepRecord<T>& record) {
  const SolverOptions& o = plan.options;
  if constexpr (in_packs<T>) {
    sweep(plan.packs, pack_kernels(), o.threads, o.grain, iteration, record.packs);
  } else {
    const SubstepState<T> state{scene, in, eta, q, record.weights.w.data(), record.C_r.data(), record.lambda.data()};
    for (const Color& color : plan.colors)
      project_color(state, o, color, record.iterations[record.iterations.size() == 1 ? 0 : iteration]);
  }
}

// Blocks; or iterations over colors and volumes, with the damping references that they need.
template <class T>
void project(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
             T* q, SubstepRecord<T>& record) {
  project_blocks(scene, plan, in, bdf, s, q, record);
  if (!plan.colors.empty()) begin_colors(scene, plan, in, bdf, s, q, record);
  record.with_coordinates(plan, q, [&](auto at) {
    for (int iteration = 0; iteration < plan.options.iterations; ++iteration) {
      project_colors(scene, plan, in, bdf.eta, iteration, q, record);
      project_volumes(scene, in, bdf.eta, record.weights.w.data(), iteration, at, record.volumes);
    }
  });
  if constexpr (in_packs<T>)
    if (!plan.colors.empty()) end_sweeps(scene, record.packs, q);
}

// What the reverse repeats of a substep: everything but the velocity. The record holds every iteration when it was sized so, the last one
// otherwise; q (dofs) is used where the coordinates are not in the record.
template <class T>
void correct(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
             const SubstepStates<T>& s, T* q, SubstepRecord<T>& record) {
  weigh(scene, in, bdf, s, record.weights);
  predict(scene, in, bdf, t_next, s, record.weights, plan.options.threads, record.coordinates(plan, q));
  blow(scene, in, bdf, t_next, s, record.weights, record.coordinates(plan, q));
  project(scene, plan, in, bdf, s, q, record);
}

// v = (q - history(x))/eta, and q to x_next. Says whether all of q is finite.
template <class T>
bool read_off(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
              Weights<T>& weights, int threads, const Coordinates<T>& q, T* x_next, T* v) {
  std::atomic<bool> finite = true;
  // q - q, which only what is finite has as zero
  if constexpr (std::is_same_v<T, double>) {
    const double rate = 1.0 / bdf.eta;
    const int* first_dof = scene.first_dof.data();
    parallel_for(scene.nodes(), threads, points_per_thread, [=, &finite](int begin, int end) {
      PointSum<T> difference;
      for_each_point<T>(begin, end, [=, &difference](int n, auto how) {
        const int dof = first_dof[n];
        const auto now = how.load(q.of(n));
        how.store(x_next + dof, now);
        how.store(v + dof, scaled(rate, now - history(bdf, how, s.x + dof, s.x_before + dof)));
        difference.add(now - now);
      });
      const Vec3<T> d = difference.total();
      if (!all_finite(d.x) || !all_finite(d.y) || !all_finite(d.z)) finite = false;
    });
  } else {
    auto points = points_of(scene, in, bdf, s, weights);
    points.q = reinterpret_cast<double*>(q.data);
    points.stride = q.stride;
    points.x_next = reinterpret_cast<double*>(x_next);
    points.v_next = reinterpret_cast<double*>(v);
    parallel_for(scene.nodes(), threads, points_per_thread, [&](int begin, int end) {
      if (!point_kernels<T>().read_off(points, begin, end)) finite = false;
    });
  }
  return finite;
}

// Steps from n to n+1, writing x_next and v. Says whether the state is finite.
template <class T>
bool substep(const Scene& scene, const Plan& plan, const Inputs<const T>& in, const Bdf& bdf, double t_next,
             const SubstepStates<T>& s, T* x_next, T* v, SubstepRecord<T>& record) {
  correct(scene, plan, in, bdf, t_next, s, x_next, record);
  const bool finite =
      read_off(scene, in, bdf, s, record.weights, plan.options.threads, record.coordinates(plan, x_next), x_next, v);
  if constexpr (std::is_same_v<T, double>)
    retract_directors(scene, x_next);
  else
    point_kernels<T>().retract(record.frames.data(), static_cast<int>(record.frames.size()),
                               reinterpret_cast<double*>(x_next));
  yield(scene, in, x_next);
  return finite;
}

}  // namespace sheetbend
