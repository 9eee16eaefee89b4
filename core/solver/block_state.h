// The numbers of a direct block. They stand in its own order (particles, rows in elimination order) for a whole substep, and are taken from the
// scene's arrays and written there once.
#pragma once

#include "core/scalar/numbers.h"
#include "core/solver/block_volume.h"
#include "core/solver/implicit_block.h"
#include "core/solver/independent_rows.h"
#include "core/solver/placed.h"
#include "core/solver/plan.h"
#include "core/solver/states.h"

namespace sheetbend {

// Where number `part` of `parts` of a run's member stands: in a lane of a pack of members, or with its member's others.
template <class T>
std::size_t member_number(int member, int parts, int part) {
  return members_in_lanes<Plain<T>> ? lane_at(member, parts, part) : static_cast<std::size_t>(member) * parts + part;
}

template <class T>
struct BlockState {
  struct Iteration {
    Numbers<Plain<T>> gradients;
    Numbers<T> dl, u;
    Factor<Plain<T>> factor;
    CondensedSolver<Plain<T>> condensed;  // in its place, where the block is
  };
  std::vector<Iteration> iterations;
  std::vector<Numbers<T>> x, lambda;  // before each iteration and after the last; one of each where nothing is kept
  std::vector<Numbers<T>> values;     // per run
  std::vector<const double*> value_directions;  // of duals, where those of `values` stand
  std::vector<sheetbend_blocks::Run> runs;
  std::vector<BlockVolumeState<T>> volumes;
  Numbers<T> C_r, diagonal;
  // What damped constraints are at a state that damping refers to.
  struct Values {
    Numbers<T> x, C;
    int step = -1;  // of the state, as in SubstepStates
  };
  Values now, before;
  std::vector<ImplicitBlock> implicit;             // one per scene, where substeps are solved until forces balance
  std::vector<BlockContacts<Single<T>>> contacts;  // likewise
  std::vector<PairFriction<Single<T>>> friction;   // likewise, of pairs
  std::vector<Vec3<T>> frame_pushes;               // per frame of the block, on the way back: W^-1 (x - x~)
  IndependentRows independent;                     // of condensed blocks that close a loop of bodies
  double eta = 0.0;                                // of `values` and `diagonal`; 0 where they are not filled yet

  void resize(const Scene& scene, const DirectBlock& block, int kept_iterations);
  static std::size_t bytes(const Scene& scene, const DirectBlock& block, int kept_iterations);
  Numbers<T>& at(std::vector<Numbers<T>>& states, int iteration) { return states[states.size() == 1 ? 0 : iteration]; }
  Iteration& at(int iteration) { return iterations[iterations.size() == 1 ? 0 : iteration]; }
};

// Length of a right side: of a band, with zeros at the end.
template <class T>
std::size_t right_side(const DirectBlock& block) {
  return block.condensation ? block.size() : Factor<T>::right_side(block.structure);
}

template <class T>
void BlockState<T>::resize(const Scene& scene, const DirectBlock& block, int kept_iterations) {
  const std::size_t particles = block.particles.size() * sheetbend_blocks::row;
  const std::size_t rows = right_side<Plain<T>>(block);
  eta = 0.0;
  iterations.resize(std::max(1, kept_iterations));
  for (Iteration& i : iterations) {
    i.gradients.assign(block.window_rows.size() * sheetbend_blocks::row);
    i.dl.assign(rows);
    i.u.assign(particles);
    i.factor.reset(block.structure);
  }
  x.resize(kept_iterations + 1);
  lambda.resize(kept_iterations + 1);
  for (auto& a : x) a.assign(particles);
  for (auto& a : lambda) a.assign(block.size());
  C_r.assign(block.size());
  diagonal.assign(block.size());
  for (Values* v : {&now, &before}) {
    v->step = -1;
    if (!block.damped) continue;
    v->x.assign(particles);
    v->C.assign(block.size());
  }
  implicit.resize(block.implicit ? scenes_of<T> : 0);
  for (ImplicitBlock& scene_ : implicit) scene_.resize(scene, block);
  contacts.resize(implicit.size());
  for (auto& scene_ : contacts) scene_.resize(block);
  friction.resize(implicit.size());
  for (auto& scene_ : friction) scene_.resize(block);
  frame_pushes.resize(block.frames.size());
  volumes.resize(block.volumes.size());
  for (std::size_t v = 0; v < volumes.size(); ++v) volumes[v].resize(block.volumes[v]);
  runs.reserve(block.runs.size());
  values.resize(block.runs.size());
  for (std::size_t r = 0; r < values.size(); ++r) {
    const Group& group = scene.groups[block.runs[r].group];
    values[r].assign(block.runs[r].items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
  }
  value_directions.clear();
  if constexpr (carries_tangents<T>)
    for (Numbers<T>& v : values) value_directions.push_back(v.directions());
}

// What resize() allocates.
template <class T>
std::size_t BlockState<T>::bytes(const Scene& scene, const DirectBlock& block, int kept_iterations) {
  const std::size_t rows = right_side<T>(block), iterations = std::max(1, kept_iterations);
  const auto of = [](std::size_t count) { return sizeof(Numbers<T>) + Numbers<Plain<T>>::bytes(count); };
  const std::size_t particles = of(sheetbend_blocks::row * block.particles.size());
  std::size_t factor = sizeof(Factor<T>) + sizeof(CondensedSolver<T>) + Factor<T>::bytes(block.structure);
  if (block.condensation && !block.implicit)
    factor += CondensedSolver<T>::bytes(*block.condensation, block.movable, block.size(), block.volumes.size());
  std::size_t sum =
      2 * of(block.size()) + (block.damped ? 2 * (particles + of(block.size())) : 0) +
      iterations * (of(sheetbend_blocks::row * block.window_rows.size()) + of(rows) + particles + factor) +
      (kept_iterations + 1) * (particles + of(block.size()));
  if (block.implicit)
    sum += scenes_of<T> * (ImplicitBlock::bytes(scene, block) + sizeof(BlockContacts<Single<T>>) +
                           BlockContacts<Single<T>>::bytes(scene, block) + sizeof(PairFriction<Single<T>>) +
                           PairFriction<Single<T>>::bytes(block));
  sum += sizeof(Vec3<T>) * block.frames.size();
  for (const MemberRun& run : block.runs) {
    const Group& group = scene.groups[run.group];
    sum += of(run.items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
    sum += sizeof(sheetbend_blocks::Run);
  }
  for (const BlockVolume& volume : block.volumes)
    sum += sizeof(BlockVolumeState<T>) + 2 * sizeof(Vec3<T>) * volume.particles.size();
  return sum;
}

// What does not change while eta does not: coefficients and the constraints' own parameters.
template <class T>
void fill_values(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const Group& group = s.scene.groups[run.group];
    const int count = sheetbend_blocks::value_count(group.damped, group.parameters);
    for (int i = 0; i < static_cast<int>(run.items.size()); ++i) {
      const int item = run.items[i];
      const auto set = [&](int part, const T& a) { state.values[r][member_number<T>(i, count, part)] = a; };
      const Rates<T> rates(s.inputs.of(Quantity::compliance)[group.first + item],
                           group.damped ? s.inputs.of(Quantity::damping)[group.first + item] : T(0.0), s.eta);
      set(0, rates.a);
      if (group.damped) {
        set(1, rates.g);
        set(2, rates.scale);
      }
      const T* p = s.inputs.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * group.parameters;
      for (int k = 0; k < group.parameters; ++k) set(count - group.parameters + k, p[k]);
      for (int j = 0; j < group.rows; ++j) state.diagonal[run.first_row[i] + j] = rates.a * rates.scale;
    }
  }
  for (const BlockVolume& v : block.volumes)
    state.diagonal[v.row] = s.inputs.of(Quantity::volume_compliance)[v.volume] * T(1.0 / (s.eta * s.eta));
  state.eta = s.eta;
}

// Particles' coordinates (dofs) to their rows.
template <class T>
void load_coordinates(const Scene& scene, const DirectBlock& block, const T* x, Numbers<T>& rows) {
  for (std::size_t p = 0; p < block.particles.size(); ++p)
    for (int d = 0; d < 3; ++d) rows[sheetbend_blocks::row * p + d] = x[scene.first_dof[block.particles[p]] + d];
}

// Takes coordinates and inverse masses from the substep's state, and multipliers and damping references where it has them.
template <class T>
void begin_block(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  if (state.eta != s.eta) fill_values(s, block, state);
  load_coordinates(s.scene, block, s.q, state.x[0]);
  for (std::size_t p = 0; p < block.particles.size(); ++p)
    state.x[0][sheetbend_blocks::row * p + 3] = s.w[block.particles[p]];
  for (int row = 0; row < block.size(); ++row)
    state.lambda[0][row] = s.lambda ? s.lambda[block.multipliers[row]] : T(0.0);
  if (s.C_r)
    for (int row = 0; row < block.size(); ++row) state.C_r[row] = s.C_r[block.multipliers[row]];
}

// What contacts read of a substep; source_of(lane) says where it comes from for a scene of a pack, whose colliders have these poses.
template <class T, class F>
void load_contacts(const DirectBlock& block, F&& source_of, const std::vector<ColliderPoses<Single<T>>>& poses,
                   BlockState<T>& state) {
  for (int scene = 0; scene < static_cast<int>(state.contacts.size()); ++scene) {
    if (!block.contacts.empty()) state.contacts[scene].load(source_of(scene), poses[scene], block);
    state.friction[scene].load(source_of(scene), block);
  }
}

// Writes the movable particles' coordinates.
template <class T>
void end_block(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  for (int p = 0; p < block.movable; ++p)
    for (int d = 0; d < 3; ++d)
      s.q[s.scene.first_dof[block.particles[p]] + d] = state.x.back()[sheetbend_blocks::row * p + d];
}

// Writes the multipliers in the scene's order.
template <class T>
void unpack_multipliers(const DirectBlock& block, BlockState<T>& state, T* lambda) {
  for (int row = 0; row < block.size(); ++row) lambda[block.multipliers[row]] = state.lambda.back()[row];
}

}  // namespace sheetbend
