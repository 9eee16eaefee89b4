// Frames of rods in an implicit block. A director's constraints see the direction of its part across the axis alone, so along that part and along the
// axis (a normal: along itself) nothing but its weight holds it to its prediction q~, and at the balance of a substep it is
//
//   q = (q~ . m1) m1 + (q~ . t) t                  a normal: (n~ . t) t,  t its own direction
//
// whatever direction m1 it has. Its weight is next to nothing: along these idle directions a Newton step goes as far as it likes. So the solver keeps
// frames settled, which moves no constraint and lowers the potential, and its matrix takes directors across their idle directions alone. At the balance
// that leaves out products of the hold. Derivatives have the whole matrix. The end of a substep makes directors unit vectors (step/retract_directors.h);
// the way back finds the settled ones again from these by the same equation.
#pragma once

#include <vector>

#include "core/scalar/across.h"
#include "core/scalar/numbers.h"
#include "core/solver/plan.h"

namespace sheetbend {

// The free directors and normals of a block, normals first. Those whose edge is not in the block are left out.
std::vector<BlockFrame> frames_of_block(const Scene& scene, const DirectBlock& block);

// at(particle) gives coordinates, predicted(particle) the predicted ones. Returns the share of the prediction that is kept along m1, or along a normal.
template <class T, class At, class Predicted>
T settle(const BlockFrame& f, At&& at, Predicted&& predicted) {
  const Vec3<T> q(at(f.particle)), before(predicted(f.particle));
  if (f.is_normal) {
    const Vec3<T> t = (T(1.0) / norm(q)) * q;
    const T kept = dot(before, t);
    (kept * t).store(at(f.particle));
    return kept;
  }
  const Vec3<T> head(at(f.head));
  const Across<T> own(f.tail < 0 ? head : head - Vec3<T>(at(f.tail)), q);
  const T kept = dot(before, own.m1);
  (kept * own.m1 + dot(before, own.t) * own.t).store(at(f.particle));
  return kept;
}

// All of a block, of coordinates in rows of four. False where one has turned by nearly a right angle from its prediction: then it is not settled.
bool settle_frames(const DirectBlock& block, Numbers<double>& predicted, Numbers<double>& at);

// Leaves in the matrices of a block's runs what directors do across their idle directions. `elements`: per run (packs, triangle(dofs), 8).
void leave_out_idle(const Scene& scene, const DirectBlock& block, Numbers<double>& at,
                    std::vector<Numbers<double>>& elements);

}  // namespace sheetbend
