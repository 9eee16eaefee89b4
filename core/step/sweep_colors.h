// The projection of colors: sweeps over constraints one by one (nonlinear Gauss-Seidel), and after each sweep over the volumes that are kept and the
// particles that touch colliders.
#pragma once

#include <algorithm>

#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"
#include "core/solver/project.h"
#include "core/solver/swept_contacts.h"
#include "core/solver/volume.h"
#include "core/step/stages.h"

namespace sheetbend {

// Volumes that are projected between sweeps; blocks have them among their rows.
inline std::span<const Volume> swept_volumes(const Scene& scene, const Plan& plan) {
  return std::span(scene.volumes).first(plan.options.partition == Partition::gauss_seidel ? scene.volumes.size() : 0);
}

struct SweepColors {
  static constexpr bool repeated = true;

  template <class T>
  struct Record {
    PackState<std::conditional_t<in_packs<T>, T, double>> packs;  // of colors that go through the kernels
    std::vector<IterationRecord<T>> iterations;                   // of others
    std::vector<T> C_r, lambda;                                   // damping references; the others' multipliers
    std::vector<VolumeState<T>> volumes;
    std::vector<SweptContacts<Single<T>>> contacts;  // of each scene of a T; none where nothing may touch

    void resize(const Scene& scene, const Plan& plan, bool reversed);
    static std::size_t bytes(const Scene& scene, const Plan& plan, bool reversed);

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

  // Scenes with volumes or contacts have one section.
  template <class T>
  static Sections sections(const Scene& scene, const Plan& plan, int kept) {
    const bool plain = scene.volumes.empty() && plan.contacts.empty();
    return plain ? sections_of<T>(plan.packs, kept) : Sections{kept, kept};
  }

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record);

  // Writes the multipliers of the last substep in the scene's order.
  template <class T>
  static void multipliers(const Scene& scene, const Plan& plan, Record<T>& record, T* lambda) {
    if (!plan.colors.empty()) {
      if constexpr (in_packs<T>)
        unpack_multipliers(scene, plan.packs, record.packs, lambda);
      else
        std::copy(record.lambda.begin(), record.lambda.end(), lambda);
    }
    for (std::size_t v = 0; v < record.volumes.size(); ++v) lambda[scene.rows + v] = record.volumes[v].lambda;
  }

  // Calls f(source, contacts) for the contacts of every scene that is solved.
  template <class T, class F>
  static void for_each_scene(const Step<T>& step, const InverseMasses<T>& masses,
                             std::vector<SweptContacts<Single<T>>>& contacts, F&& f) {
    for (int scene = 0; scene < static_cast<int>(contacts.size()); ++scene)
      if (has(step.scenes, scene)) f(contact_source(step, masses, scene), contacts[scene]);
  }

  // The substep as single constraints see it.
  template <class T>
  static SubstepState<T> state_of(const Step<T>& step, const InverseMasses<T>& masses, T* q, Record<T>& record) {
    return {step.scene, step.in, step.bdf.eta, q, masses.w.data(), record.C_r.data(), record.lambda.data()};
  }

 private:
  template <class T>
  static void begin(const Step<T>& step, Work<T>& work, [[maybe_unused]] T* q, Record<T>& record) {
    damping_references(step.scene, step.in, step.bdf, step.from, record.C_r.data());
    if constexpr (in_packs<T>)
      begin_sweeps(step.scene, step.plan.packs, step.in, step.bdf.eta, work.masses.w.data(), record.C_r.data(),
                   record.packs, q);
    else
      std::fill(record.lambda.begin(), record.lambda.end(), T(0.0));
  }

  // One pass over all colors.
  template <class T>
  static void sweep(const Step<T>& step, Work<T>& work, int iteration, T* q, Record<T>& record) {
    const SolverOptions& o = step.plan.options;
    if constexpr (in_packs<T>) {
      sheetbend::sweep(step.plan.packs, pack_kernels(), o.threads, o.grain, iteration, record.packs);
    } else {
      const SubstepState<T> state = state_of(step, work.masses, q, record);
      for (const Color& color : step.plan.colors)
        project_color(state, o, color, record.iterations[record.iterations.size() == 1 ? 0 : iteration]);
    }
  }
};

template <class T>
void SweepColors::Record<T>::resize(const Scene& scene, const Plan& plan, bool reversed) {
  const int kept = kept_iterations(plan, reversed);
  volumes.resize(swept_volumes(scene, plan).size());
  for (std::size_t v = 0; v < volumes.size(); ++v) volumes[v].resize(scene.volumes[v], kept);
  contacts.resize(plan.contacts.empty() ? 0 : scenes_of<T>);
  for (auto& own : contacts) own.resize(plan, kept);
  if (plan.colors.empty()) return;
  C_r.resize(damped_rows(scene));
  if constexpr (in_packs<T>) {
    packs.resize(plan.packs, sections<T>(scene, plan, kept));
  } else {
    iterations.resize(std::max(1, kept));
    for (auto& i : iterations) i.resize(scene);
    lambda.resize(scene.rows);
  }
}

template <class T>
std::size_t SweepColors::Record<T>::bytes(const Scene& scene, const Plan& plan, bool reversed) {
  const int kept = kept_iterations(plan, reversed);
  std::size_t sum = 0;
  for (const Volume& volume : swept_volumes(scene, plan))
    sum += sizeof(VolumeState<T>) + VolumeState<T>::bytes(volume, kept);
  if (!plan.contacts.empty())
    sum += scenes_of<T> * (sizeof(SweptContacts<Single<T>>) + SweptContacts<Single<T>>::bytes(scene, plan, kept));
  if (plan.colors.empty()) return sum;
  sum += sizeof(T) * damped_rows(scene);
  if constexpr (in_packs<T>)
    return sum + PackState<T>::bytes(plan.packs, sections<T>(scene, plan, kept));
  else
    return sum + std::max(1, kept) * IterationRecord<T>::bytes(scene) + sizeof(T) * scene.rows;
}

template <class T>
void SweepColors::forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
  const Scene& scene = step.scene;
  const bool swept = !step.plan.colors.empty();
  T* q = work.x_next;
  if (swept) begin(step, work, q, record);
  for_each_scene(step, work.masses, record.contacts, [&](const auto& source, auto& contacts) {
    contacts.begin(source, (*work.poses)[source.lane], step.plan);
  });
  record.with_coordinates(step.plan, q, [&](auto at) {
    for (int iteration = 0; iteration < step.plan.options.iterations; ++iteration) {
      sweep(step, work, iteration, q, record);
      project_volumes(scene, step.in, step.bdf.eta, work.masses.w.data(), iteration, at, record.volumes);
      for_each_scene(step, work.masses, record.contacts, [&](const auto& source, auto& contacts) {
        project_contacts(source, step.plan, iteration, work.q, at, contacts);
      });
    }
  });
  if constexpr (in_packs<T>)
    if (swept) end_sweeps(scene, record.packs, q);
}

// The scalars of adjoint/rollout/instances_*.cpp.
extern template void SweepColors::forward(const Step<double>&, Work<double>&, Record<double>&);
extern template void SweepColors::forward(const Step<Pack>&, Work<Pack>&, Record<Pack>&);
extern template void SweepColors::forward(const Step<Complex>&, Work<Complex>&, Record<Complex>&);
extern template void SweepColors::forward(const Step<Dual<double, 1>>&, Work<Dual<double, 1>>&,
                                          Record<Dual<double, 1>>&);
extern template void SweepColors::forward(const Step<Dual<double, 4>>&, Work<Dual<double, 4>>&,
                                          Record<Dual<double, 4>>&);
extern template void SweepColors::forward(const Step<Dual<double, 8>>&, Work<Dual<double, 8>>&,
                                          Record<Dual<double, 8>>&);

}  // namespace sheetbend
