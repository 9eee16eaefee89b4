// The reverse of one substep: the stages up to the projection again, then the reverses of all stages, last to first.
#pragma once

#include "adjoint/step/apply_air_forces.h"
#include "adjoint/step/apply_forces.h"
#include "adjoint/step/apply_loads.h"
#include "adjoint/step/bounce.h"
#include "adjoint/step/carry_friction.h"
#include "adjoint/step/carry_pair_friction.h"
#include "adjoint/step/effective_masses.h"
#include "adjoint/step/keep_spin.h"
#include "adjoint/step/place_colliders.h"
#include "adjoint/step/predict.h"
#include "adjoint/step/project_blocks.h"
#include "adjoint/step/retract_directors.h"
#include "adjoint/step/sweep_colors.h"
#include "adjoint/step/update_velocities.h"
#include "adjoint/step/yield.h"
#include "core/step/substep.h"

namespace sheetbend {

template <class T, class List = Substep>
using SubstepScratch = Scratches<T, List>;

// Given the cotangents of x_next and v_next (dofs), adds to those of the states before and of the inputs. The record was sized for a reverse; q
// (dofs) is room for coordinates. x_next_bar is used up.
template <class T, class List>
void substep_vjp(const Step<T>& step, T* q, T* x_next_bar, const T* v_next_bar, Records<T, List>& record,
                 Scratches<T, List>& scratch, const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  Work<T> work = work_of(step.plan, record, q, static_cast<T*>(nullptr));
  List::forward([&]<class Stage>(Stage) {
    if constexpr (Stage::repeated) Stage::forward(step, work, record.template of<Stage>());
  });

  auto& masses = scratch.template of<ComputeEffectiveMasses>();
  auto& colors = scratch.template of<SweepColors>();
  std::fill(masses.w.begin(), masses.w.end(), T(0.0));
  StepCotangents<T> cotangents{x_next_bar,
                               v_next_bar,
                               colors.of_coordinates(step.plan, scratch.template of<UpdateVelocities>().q.data()),
                               masses.w.data(),
                               masses.kept.data(),
                               masses.w_of_forces.data(),
                               bar,
                               in_bar};
  cotangents.swept = &colors.contacts;
  if (auto& own = scratch.template of<KeepSpin>().multipliers; !own.empty()) cotangents.multipliers = own.data();
  List::backward([&]<class Stage>(Stage) {
    ReverseOf<Stage>::run(step, work, record.template of<Stage>(), scratch.template of<Stage>(), cotangents);
  });
}

// After the last substep: adds what the stages have gathered to the cotangents of the inputs.
template <class T, class List>
void finish_substeps(const Scene& scene, const Plan& plan, const Inputs<const T>& in, Scratches<T, List>& scratch,
                     const Inputs<T>& in_bar) {
  List::forward([&]<class Stage>(Stage) {
    auto& own = scratch.template of<Stage>();
    if constexpr (requires { ReverseOf<Stage>::finish(scene, plan, in, own, in_bar); })
      ReverseOf<Stage>::finish(scene, plan, in, own, in_bar);
  });
}

}  // namespace sheetbend
