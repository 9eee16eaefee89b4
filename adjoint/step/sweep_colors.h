// The reverse of SweepColors: sweeps in reverse order, then what contacts were made of and the damping references.
#pragma once

#include "adjoint/packs/packed_reverse.h"
#include "adjoint/solver/project_vjp.h"
#include "adjoint/solver/swept_contacts_vjp.h"
#include "adjoint/solver/volume_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/sweep_colors.h"

namespace sheetbend {

template <>
struct ReverseOf<SweepColors> {
  template <class T>
  struct Scratch {
    PackCotangents<std::conditional_t<in_packs<T>, T, double>> packs;  // of colors that go through the kernels
    std::vector<T> fixed, lambda;                                      // of others
    std::vector<T> C_r;
    std::vector<VolumeCotangents<T>> volumes;
    std::vector<SweptContactCotangents<Single<T>>> contacts;

    void resize(const Scene& scene, const Plan& plan) {
      volumes.resize(swept_volumes(scene, plan).size());
      for (std::size_t v = 0; v < volumes.size(); ++v) volumes[v].resize(scene.volumes[v]);
      contacts.resize(plan.contacts.empty() ? 0 : scenes_of<T>);
      for (auto& own : contacts) own.resize(scene, plan);
      if (plan.colors.empty()) return;
      C_r.resize(damped_rows(scene));
      if constexpr (in_packs<T>) {
        packs.resize(plan.packs);
      } else {
        fixed.resize(scene.stencil_coordinates);
        lambda.resize(scene.rows);
      }
    }
    static std::size_t bytes(const Scene& scene, const Plan& plan) {
      std::size_t sum = 0;
      for (const Volume& volume : swept_volumes(scene, plan))
        sum += sizeof(VolumeCotangents<T>) + VolumeCotangents<T>::bytes(volume);
      if (!plan.contacts.empty())
        sum += scenes_of<T> *
               (sizeof(SweptContactCotangents<Single<T>>) + SweptContactCotangents<Single<T>>::bytes(scene, plan));
      if (plan.colors.empty()) return sum;
      sum += sizeof(T) * damped_rows(scene);
      if constexpr (in_packs<T>)
        return sum + PackCotangents<T>::bytes(plan.packs);
      else
        return sum + sizeof(T) * (scene.stencil_coordinates + scene.rows);
    }

    // Where the cotangents of the coordinates are: in the kernels' rows, or in q.
    Coordinates<T> of_coordinates(const Plan& plan, T* q) {
      if constexpr (in_packs<T>)
        if (sweeps_packs<T>(plan)) return {packs.rows.at(0), sheetbend_packs::row};
      return {q, 3};
    }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, SweepColors::Record<T>& record, Scratch<T>& scratch,
                  const StepCotangents<T>& bar);

  // What gathered of the constraints' own values.
  template <class T>
  static void finish(const Scene& scene, const Plan& plan, const Inputs<const T>& in, Scratch<T>& scratch,
                     const Inputs<T>& in_bar) {
    if constexpr (in_packs<T>) sheetbend::finish(scene, plan.packs, in, in_bar, scratch.packs);
  }

 private:
  template <class T>
  static void sweep(const Step<T>& step, const Work<T>& work, int iteration, bool last, SweepColors::Record<T>& record,
                    Scratch<T>& scratch, const StepCotangents<T>& bar) {
    const Plan& plan = step.plan;
    const SolverOptions& o = plan.options;
    if constexpr (in_packs<T>) {
      sweep_vjp(plan.packs, pack_kernels(), o.threads, o.grain, iteration, last, record.packs, scratch.packs);
    } else {
      const SubstepState<T> state = SweepColors::state_of<T>(step, work.masses, nullptr, record);
      const SubstepCotangent<T> cotangent{bar.q.data, scratch.fixed.data(), scratch.lambda.data(),
                                          bar.w,      scratch.C_r.data(),   bar.in};
      for (auto color = plan.colors.rbegin(); color != plan.colors.rend(); ++color)
        project_color_vjp(state, o, *color, record.iterations[iteration], cotangent);
    }
  }

  // Adds what fixed nodes received, per stencil, to their own.
  template <class T>
  static void end(const Step<T>& step, Scratch<T>& scratch, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    if constexpr (in_packs<T>) {
      end_sweeps_vjp(scene, step.plan.packs, step.threads(), scratch.packs, bar.w, scratch.C_r.data());
    } else {
      for (const Group& group : scene.groups)
        for (int i = 0; i < group.count; ++i)
          for (int k = 0; k < group.arity; ++k) {
            const int node = group.nodes(i)[k];
            if (scene.role[node] == Role::free) continue;
            const std::size_t from = group.first_coordinate + (static_cast<std::size_t>(i) * group.arity + k) * 3;
            Vec3<T>(&scratch.fixed[from]).add_to(bar.q.of(node));
          }
    }
  }
};

template <class T>
void ReverseOf<SweepColors>::run(const Step<T>& step, const Work<T>& work, SweepColors::Record<T>& record,
                                 Scratch<T>& scratch, const StepCotangents<T>& bar) {
  const SolverOptions& o = step.plan.options;
  const bool swept = !step.plan.colors.empty();
  for (auto* buffer : {&scratch.C_r, &scratch.fixed, &scratch.lambda})
    std::fill(buffer->begin(), buffer->end(), T(0.0));
  if constexpr (in_packs<T>)
    if (swept) begin_sweeps_vjp(step.scene, step.plan.packs, o.threads, step.in, record.packs, bar.in, scratch.packs);
  for (int iteration = o.iterations - 1; iteration >= 0; --iteration) {
    const bool last = iteration == o.iterations - 1;
    SweepColors::for_each_scene(step, work.masses, record.contacts, [&](const auto& source, auto& contacts) {
      project_contacts_vjp(source, step.plan, iteration, contacts, bar.q, bar.w, scratch.contacts[source.lane]);
    });
    project_volumes_vjp(step.scene, step.in, step.bdf.eta, work.masses.w.data(), iteration, last, record.volumes, bar.q,
                        bar.w, bar.in, scratch.volumes);
    sweep(step, work, iteration, last, record, scratch, bar);
  }
  SweepColors::for_each_scene(step, work.masses, record.contacts, [&](const auto& source, auto& contacts) {
    spread_contacts(source, step.plan, contacts, scratch.contacts[source.lane], bar.from, bar.in, bar.w);
  });
  if (!swept) return;
  end(step, scratch, bar);
  // In a pack, scenes go with either formula in other substeps than alone: sums over substeps would have other bits.
  if (changes_at_contacts(step.scene, o)) finish(step.scene, step.plan, step.in, scratch, bar.in);
  damping_references_vjp(step.scene, step.in, step.bdf, step.from, scratch.C_r.data(), bar.from, bar.in);
}

// The scalars of adjoint/rollout/instances_*.cpp.
extern template void ReverseOf<SweepColors>::run(const Step<double>&, const Work<double>&, SweepColors::Record<double>&,
                                                 Scratch<double>&, const StepCotangents<double>&);
extern template void ReverseOf<SweepColors>::run(const Step<Pack>&, const Work<Pack>&, SweepColors::Record<Pack>&,
                                                 Scratch<Pack>&, const StepCotangents<Pack>&);
extern template void ReverseOf<SweepColors>::run(const Step<Dual<double, 1>>&, const Work<Dual<double, 1>>&,
                                                 SweepColors::Record<Dual<double, 1>>&, Scratch<Dual<double, 1>>&,
                                                 const StepCotangents<Dual<double, 1>>&);

}  // namespace sheetbend
