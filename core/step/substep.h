// One substep, in the words of the paper (Macklin et al. 2016, algorithm 1): predict, project, and read the velocities off the positions.
// stages.h says what a stage is; adjoint/step has their reverses.
#pragma once

#include "core/step/apply_air_forces.h"
#include "core/step/apply_forces.h"
#include "core/step/apply_loads.h"
#include "core/step/bounce.h"
#include "core/step/carry_friction.h"
#include "core/step/carry_pair_friction.h"
#include "core/step/effective_masses.h"
#include "core/step/keep_spin.h"
#include "core/step/place_colliders.h"
#include "core/step/predict.h"
#include "core/step/project_blocks.h"
#include "core/step/retract_directors.h"
#include "core/step/sweep_colors.h"
#include "core/step/update_velocities.h"
#include "core/step/yield.h"

namespace sheetbend {

using Substep = Stages<ComputeEffectiveMasses,  // w = 1/(m + eta c), c the implicit drag
                       Predict,                 // x* = history(x) + eta v*,  v* = m w (history(v) + eta gravity)
                       ApplyForces,             // x* += eta^2 w f(t)
                       ApplyLoads,              // x* += w eta^2 tau(t) J^T of rows that are loaded
                       ApplyAirForces,          // x* += eta^2 w f of the wind and the pressure on triangles
                       PlaceColliders,          // poses at n+1, n and n-1, which the next ones read
                       Bounce,                  // what meets a collider with restitution goes on from there
                       ProjectBlocks,           // direct blocks: x <- x + W J^T dlambda, or until their forces balance
                       SweepColors,             // the same for one constraint after the other, and for kept volumes
                       UpdateVelocities,        // v = (x - history(x))/eta
                       LeaveImpacts,            // of what has bounced, with the velocity after the impact
                       KeepSpin,                // bodies that keep their spin: v += dw x a on their axes
                       RetractDirectors,        // rods: frames are made orthonormal again
                       Yield,                   // joints that slide: their set follows
                       CarryFriction,           // contacts: their tangential forces go on to the next substep
                       CarryPairFriction        // likewise those of pairs that touch
                       >;

template <class T, class List = Substep>
using SubstepRecord = Records<T, List>;

// What the stages share. Where coordinates are corrected elsewhere than in the kernels' rows, it is in x_next.
template <class T, class List>
Work<T> work_of(const Plan& plan, Records<T, List>& record, T* x_next, T* v_next) {
  Work<T> work{record.template of<ComputeEffectiveMasses>(),
               record.template of<SweepColors>().coordinates(plan, x_next), x_next, v_next};
  work.poses = &record.template of<PlaceColliders>().scenes;
  work.swept = &record.template of<SweepColors>().contacts;
  if (auto& own = record.template of<KeepSpin>().multipliers; !own.empty()) work.multipliers = own.data();
  return work;
}

// Steps from n to n+1, writing x_next and v_next. Says whether the state is finite.
template <class T, class List>
bool substep(const Step<T>& step, T* x_next, T* v_next, Records<T, List>& record) {
  Work<T> work = work_of(step.plan, record, x_next, v_next);
  List::forward([&]<class Stage>(Stage) { Stage::forward(step, work, record.template of<Stage>()); });
  return work.finite;
}

}  // namespace sheetbend
