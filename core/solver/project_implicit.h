// The implicit step of a direct block over any scalar (implicit_block.h has the equations and their solution). A pack's scenes are solved one after
// the other, with the bits that each has alone; what duals and complex numbers carry beside their values follows from
// K dx = -dR, the implicit function theorem, R being evaluated over them.
#pragma once

#include "core/constraints/any_kind.h"
#include "core/solver/pair_source.h"
#include "core/solver/project_block.h"

namespace sheetbend {

// The length of a body's axis is that of its mass's moments about the center.
template <class T>
void find_units(const SubstepState<T>& s, const DirectBlock& block, IncrementalPotential& potential, int scene) {
  if (s.scene.bodies.empty()) return;
  std::vector<double> of_node(s.scene.nodes(), 1.0);
  const auto mass = [&](int node) { return number_of(s.inputs.of(Quantity::mass)[node], scene); };
  for (const Body& body : s.scene.bodies) {
    const double length = std::sqrt((mass(body.axes[0]) + mass(body.axes[1]) + mass(body.axes[2])) / mass(body.center));
    for (const int axis : body.axes)
      if (s.scene.role[axis] == Role::free && length > 0.0 && std::isfinite(length)) of_node[axis] = length;
  }
  for (std::size_t p = 0; p < block.particles.size(); ++p) potential.unit[p] = of_node[block.particles[p]];
}

// Which rows do not give way: judged by inputs alone, so that it does not depend on where a rollout begins.
template <class T>
void find_rigid(const SubstepState<T>& s, const DirectBlock& block, IncrementalPotential& potential, int scene) {
  Numbers<double> at;
  at.assign(sheetbend_blocks::row * block.particles.size());
  for (std::size_t p = 0; p < block.particles.size(); ++p) {
    const int node = block.particles[p];
    for (int d = 0; d < 3; ++d)
      at[sheetbend_blocks::row * p + d] =
          number_of(s.inputs.of(Quantity::position)[s.scene.first_dof[node] + d], scene);
    if (p >= static_cast<std::size_t>(block.movable)) continue;
    const double mass = number_of(s.inputs.of(Quantity::mass)[node], scene);
    at[sheetbend_blocks::row * p + 3] = 1.0 / (s.scene.inertial[node] ? mass : mass * s.eta * s.eta);
  }
  find_units(s, block, potential, scene);
  potential.rigid.find(s.scene, potential.given(block), at.data());
}

// The radii and the stiffness of a scene's pairs, and where its points of bodies are.
template <class T>
void load_pairs(const SubstepState<T>& s, const DirectBlock& block, double h, int scene, BlockPairs& pairs) {
  if (block.surface.empty()) return;
  pairs.stiffness = rigidity * (s.eta / h) * (s.eta / h);
  pairs.spots = Spots<double>(
      block.surface, [&](std::size_t i) { return number_of(s.inputs.of(Quantity::contact_weight)[i], scene); });
  for (int p = 0; p < block.surface.spots(); ++p)
    if (const int place = block.surface.radius[p]; place >= 0)
      pairs.radius[p] = number_of(s.inputs.of(Quantity::contact_radius)[place], scene);
}

// Hands a scene's numbers to its solver; the guess is where the substep ends if that is known.
template <class T>
void load_implicit(const SubstepState<T>& s, const DirectBlock& block, const SubstepStates<T>& states, double h,
                   BlockState<T>& state, int scene) {
  ImplicitBlock& own = state.implicit[scene];
  IncrementalPotential& potential = own.potential;
  if (potential.eta != s.eta) {
    for (std::size_t r = 0; r < block.runs.size(); ++r) {
      const Group& group = s.scene.groups[block.runs[r].group];
      const int count = sheetbend_blocks::value_count(group.damped, group.parameters);
      for (int i = 0; i < static_cast<int>(block.runs[r].items.size()); ++i)
        for (int part = 0; part < count; ++part)
          potential.values[r][lane_at(i, count, part)] =
              number_of<T>(state.values[r][member_number<T>(i, count, part)], scene);
    }
    potential.eta = s.eta;
    find_rigid(s, block, potential, scene);
  }
  for (std::size_t p = 0; p < block.particles.size(); ++p) {
    const int node = block.particles[p];
    const std::size_t at = sheetbend_blocks::row * p;
    for (int d = 0; d < 3; ++d) {
      const int dof = s.scene.first_dof[node] + d;
      own.start[at + d] = number_of(states.x[dof], scene);
      potential.target[at + d] = number_of(s.q[dof], scene);
      own.guess[at + d] = states.x_next               ? number_of(states.x_next[dof], scene)
                          : s.scene.is_director[node] ? potential.target[at + d]
                                                      : own.start[at + d] + h * number_of(states.v[dof], scene);
    }
    own.start[at + 3] = own.guess[at + 3] = potential.target[at + 3] = number_of(s.w[node], scene);
  }
  if (block.damped)
    for (int j = 0; j < block.size(); ++j) potential.C_r[j] = number_of<T>(state.C_r[j], scene);
  load_pairs(s, block, h, scene, potential.pairs);
  if constexpr (is_plain<T>) {
    if (block.surface.rubs()) potential.friction = state.friction[scene];
    if (!block.contacts.empty()) potential.contacts = state.contacts[scene];
  } else {
    if (block.surface.rubs()) take_values(state.friction[scene], potential.friction);
    if (!block.contacts.empty()) take_values(state.contacts[scene], potential.contacts);
  }
}

// The particle, in the block's order, of place k of a run's constraint.
inline int particle_of(const MemberRun& run, int arity, int i, int k) {
  return run.nodes[lane_at(i, arity, k)] / sheetbend_blocks::row;
}

// Calls f(run, i, element, lambda) for every constraint over T, evaluated at the coordinates at(particle, d): lambda = -(C + g (C - C_r))/a.
// That of a rigid row is the one in the state; c (rigid rows) gets their residuals.
template <class T, class At, class F>
void for_each_elastic(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state, std::vector<T>& c,
                      At&& at, F&& f) {
  const RigidRows& rigid = state.implicit[0].rigid();
  c.assign(rigid.size(), T(0.0));
  AnyConstraint<T> element;
  T lambda[largest_kind.rows];
  for (const MemberRun& run : block.runs) {
    const Group& group = s.scene.groups[run.group];
    const AnyKind<T>& kind = any_kind<T>(group.kind);
    if (!kind.balances) continue;
    for (int i = 0; i < run.count; ++i) {
      const int item = run.items[i];
      for (int d = 0; d < kind.dofs; ++d) element.x[d] = at(particle_of(run, group.arity, i, d / 3), d % 3);
      element.evaluate(group.kind, s.inputs.of(Quantity::rest) + group.first_value +
                                       static_cast<std::size_t>(item) * group.parameters);
      const Rates<T> rates(s.inputs.of(Quantity::compliance)[group.first + item],
                           group.damped ? s.inputs.of(Quantity::damping)[group.first + item] : T(0.0), s.eta);
      for (int j = 0; j < kind.rows; ++j) {
        T residual = element.C[j];
        if (group.damped) residual += rates.g * kind.difference(element.C[j], T(state.C_r[run.first_row[i] + j]));
        if (const int own = rigid.own_row(run.first_row[i] + j); own >= 0) {
          lambda[j] = T(state.lambda[0][run.first_row[i] + j]);
          c[own] = rates.scale * (residual + rates.a * lambda[j]);
        } else {
          lambda[j] = -(residual / rates.a);
        }
      }
      f(run, i, element, lambda);
    }
  }
}

// R -= J^T lambda over T at x, three numbers per particle; c as above.
template <class T>
void subtract_elastic_forces(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state,
                             const std::vector<T>& x, std::vector<T>& R, std::vector<T>& c) {
  for_each_elastic(
      s, block, state, c, [&](int particle, int d) { return x[3 * particle + d]; },
      [&](const MemberRun& run, int i, AnyConstraint<T>& element, const T* lambda) {
        const int dofs = element.kind->dofs;
        element.set_push(lambda);
        for (int d = 0; d < dofs; ++d) {
          const int particle = particle_of(run, dofs / 3, i, d / 3);
          if (particle < block.movable) R[3 * particle + d % 3] -= element.push[d];
        }
      });
}

// Likewise what contacts push with.
template <class T>
void subtract_contact_forces(const DirectBlock& block, const BlockState<T>& state, const std::vector<T>& x,
                             std::vector<T>& R) {
  const BlockContacts<T>& contacts = state.contacts[0];
  for (int i = 0; i < static_cast<int>(block.contacts.size()); ++i) {
    const BlockContact& c = block.contacts[i];
    const Vec3<T> point = contacts.point(block, i, [&](int particle) { return Vec3<T>(&x[3 * particle]); });
    const Touch<T> touch = contacts.at(block, i, point);
    if (!touch.pushes) continue;
    const Vec3<T> force = contacts.pose(block, i).turned(touch.force);
    for (int k = 0; k < c.nodes; ++k) (-(contacts.weights[i][k] * force)).add_to(&R[3 * c.particles[k]]);
  }
}

// Likewise pairs that touch.
template <class T>
void subtract_pair_forces(const SubstepState<T>& s, const DirectBlock& block, const BlockState<T>& state,
                          const std::vector<T>& x, std::vector<T>& R) {
  const PairSource<T> source{s, block, state.implicit[0].potential.pairs, state.friction[0], 0};
  source.for_each_touching(
      [&](int particle) { return &x[3 * static_cast<std::size_t>(particle)]; },
      [&](const BlockPair& pair, Part part, const T* at, const PairNumbers<T>& numbers, const Rub<T>* rub) {
        T force[12];
        meet(pair.key.triangle, part, at, numbers, rub, force);
        for (int k = 0; k < 4; ++k)
          source.spots.for_each_node(pair.spots[k], [&](int p, const T& weight) {
            if (p < block.movable) (-(weight * Vec3<T>(force + 3 * k))).add_to(&R[3 * static_cast<std::size_t>(p)]);
          });
      });
}

// The multipliers of scalars that carry tangents, which the solution comes without.
template <class T>
void carry_multipliers(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  std::vector<T> c;
  for_each_elastic(
      s, block, state, c,
      [&](int particle, int d) {
        return T(state.x[0][sheetbend_blocks::row * static_cast<std::size_t>(particle) + d]);
      },
      [&](const MemberRun& run, int i, const AnyConstraint<T>& element, const T* lambda) {
        for (int j = 0; j < element.kind->rows; ++j) state.lambda[0][run.first_row[i] + j] = lambda[j];
      });
}

// What R and c carry beside their values at x (particles, 3) and the rigid rows' multipliers in the state.
template <class T>
void find_first_order(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state, const std::vector<T>& x,
                      std::vector<T>& R, std::vector<T>& c) {
  R.resize(3 * static_cast<std::size_t>(block.movable));
  for (int p = 0; p < block.movable; ++p) {
    const int dof = s.scene.first_dof[block.particles[p]];
    const T w(state.x[0][sheetbend_blocks::row * static_cast<std::size_t>(p) + 3]);
    for (int d = 0; d < 3; ++d) R[3 * p + d] = (x[3 * p + d] - s.q[dof + d]) / w;
  }
  subtract_elastic_forces(s, block, state, x, R, c);
  subtract_contact_forces(block, state, x, R);
  subtract_pair_forces(s, block, state, x, R);
  for (auto* residuals : {&R, &c})
    for (T& r : *residuals) r = r - T(value_of(r));
}

// Adds to the multipliers of rigid rows.
template <class T>
void add_rigid(const RigidRows& rigid, const std::vector<T>& more, BlockState<T>& state) {
  for (int j = 0; j < rigid.size(); ++j) state.lambda[0][rigid.row(j)] = T(state.lambda[0][rigid.row(j)]) + more[j];
}

// The multipliers of rigid rows at the solution: what solving has found.
template <class T>
void set_rigid(BlockState<T>& state) {
  for (int scene = 0; scene < static_cast<int>(state.implicit.size()); ++scene) {
    const RigidRows& rigid = state.implicit[scene].rigid();
    for (int j = 0; j < rigid.size(); ++j)
      set_in_scene<T>(Single<T>(rigid.lambda[j]), scene, state.lambda[0][rigid.row(j)]);
  }
}

// What a scalar carries beside its value at the solution x (particles, 3), which comes with the value alone.
template <class T>
void carry_first_order(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state, std::vector<T>& x) {
  const RigidRows& rigid = state.implicit[0].rigid();
  const int passes = (rigid.empty() ? 2 : 3) + (state.contacts[0].lifts() ? 3 : 0);  // after the first one they refine
  state.implicit[0].factorize(s.scene, block);
  std::vector<T> R, c;
  for (int pass = 0; pass < passes; ++pass) {
    find_first_order(s, block, state, x, R, c);
    state.implicit[0].solve(block, R.data(), c.data());
    for (std::size_t i = 0; i < R.size(); ++i) x[i] = x[i] - R[i];
    add_rigid(rigid, c, state);
  }
}

// The same of the rigid rows' multipliers alone, where the coordinates are known: those that balance what R carries.
template <class T>
void carry_rigid(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  const RigidRows& rigid = state.implicit[0].rigid();
  if (rigid.empty()) return;
  std::vector<T> x(3 * block.particles.size()), R, c;
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = T(state.x[0][sheetbend_blocks::row * (i / 3) + i % 3]);
  std::vector<double> at(sheetbend_blocks::row * block.particles.size());
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = value_of(T(state.x[0][i]));
  for (int pass = 0; pass < 2; ++pass) {
    find_first_order(s, block, state, x, R, c);
    add_rigid(rigid, rigid.balance(block, at.data(), R.data(), c.data()), state);
  }
}

// The solution over T, with what T carries beside its value.
template <class T>
void write_solution(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  const auto row_of = [](std::size_t p) { return sheetbend_blocks::row * p; };
  if constexpr (is_plain<T>) {
    for (int p = 0; p < block.movable; ++p)
      for (int d = 0; d < 3; ++d) {
        const std::size_t at = row_of(p) + d;
        for (int scene = 0; scene < scenes_of<T>; ++scene)
          set_in_scene<T>(state.implicit[scene].x()[at], scene, state.x[0][at]);
      }
  } else {
    std::vector<T> x(3 * block.particles.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t p = i / 3, d = i % 3;
      x[i] = p < static_cast<std::size_t>(block.movable) ? T(state.implicit[0].x()[row_of(p) + d])
                                                         : T(state.x[0][row_of(p) + d]);
    }
    carry_first_order(s, block, state, x);
    for (int p = 0; p < block.movable; ++p)
      for (int d = 0; d < 3; ++d) state.x[0][row_of(p) + d] = x[3 * p + d];
  }
}

// Puts the rigid rows' multipliers (of all rows; empty where there are none) in the place of what a division by their compliance has made.
template <class T>
void keep_rigid(const std::vector<T>& lambda, BlockState<T>& state) {
  T* dl = state.at(0).dl.data();
  for (int scene = 0; !lambda.empty() && scene < static_cast<int>(state.implicit.size()); ++scene) {
    const RigidRows& rigid = state.implicit[scene].rigid();
    for (int j = 0; j < rigid.size(); ++j) {
      const int row = rigid.row(j);
      set_in_scene<T>(in_scene(lambda[row], scene), scene, dl[row]);
      state.lambda[0][row] = dl[row];
    }
  }
}

// The settled frames of the solution in state.x, whose directors are those of the substep's end (block_frames.h), and what pushes them from their
// prediction: read off the motion, since what a balance leaves of its largest_kind force is not small beside it.
template <class T>
void settle_again(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  if (block.frames.empty()) return;
  std::vector<T> x(3 * block.particles.size());
  const auto row_of = [](std::size_t i) { return sheetbend_blocks::row * (i / 3) + i % 3; };
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = T(state.x[0][row_of(i)]);
  for (const BlockFrame& f : block.frames)
    settle<T>(
        f, [&](int particle) { return &x[3 * static_cast<std::size_t>(particle)]; },
        [&](int particle) { return s.q + s.scene.first_dof[block.particles[particle]]; });
  for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(block.movable); ++i) state.x[0][row_of(i)] = x[i];
  for (std::size_t i = 0; i < block.frames.size(); ++i) {
    const int particle = block.frames[i].particle, node = block.particles[particle];
    const Vec3<T> moved = Vec3<T>(&x[3 * static_cast<std::size_t>(particle)]) - Vec3<T>(s.q + s.scene.first_dof[node]);
    state.frame_pushes[i] = (T(1.0) / s.w[node]) * moved;
  }
}

// From the predicted coordinates in state.x to those at which forces balance, with gradients and multipliers. Nothing is solved where these coordinates
// are known, as on the way back, nor in scenes other than `scenes`.
template <class T>
void project_implicit(const SubstepState<T>& s, const DirectBlock& block, const SolverOptions& options,
                      const SubstepStates<T>& states, Scenes scenes, const sheetbend_packs::KernelTable& table,
                      BlockState<T>& state) {
  for (int scene = 0; scene < static_cast<int>(state.implicit.size()); ++scene) {
    load_implicit(s, block, states, options.h, state, scene);
    if (states.x_next || !has(scenes, scene))
      state.implicit[scene].take_guess(block);
    else
      state.implicit[scene].solve(s.scene, block, options);
  }
  set_rigid(state);
  if (states.x_next) {
    for (int p = 0; p < block.movable; ++p)
      for (int d = 0; d < 3; ++d)
        state.x[0][sheetbend_blocks::row * p + d] = states.x_next[s.scene.first_dof[block.particles[p]] + d];
    settle_again(s, block, state);
  } else {
    write_solution(s, block, state);
  }
  if constexpr (!carries_tangents<T>) {  // whose multipliers are found where they are asked for
    const auto arrays = arrays_of(block, runs_of(s, block, state), state, 0);
    forward_kernels<T>(table).evaluate(arrays);
    T* dl = state.at(0).dl.data();
    std::vector<T> rigid;
    if (std::ranges::any_of(state.implicit, [](const ImplicitBlock& scene) { return !scene.rigid().empty(); })) {
      if constexpr (!is_plain<T>)
        if (states.x_next) carry_rigid(s, block, state);
      rigid.assign(state.lambda[0].data(), state.lambda[0].data() + block.size());
    }
    for (int j = 0; j < block.size(); ++j) state.lambda[0][j] = dl[j] = dl[j] / state.diagonal[j];
    keep_rigid(rigid, state);
  }
}

}  // namespace sheetbend
