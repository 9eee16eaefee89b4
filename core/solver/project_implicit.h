// The implicit step of a direct block over any scalar (implicit_block.h has the equations and their solution). A pack's scenes are solved one after
// the other, with the bits that each has alone; what duals and complex numbers carry beside their values follows from
// K dx = -dR, the implicit function theorem, R being evaluated over them.
#pragma once

#include "core/solver/project_block.h"

namespace sheetbend {

// A number of one scene.
template <class T>
double number_of(const T& a, [[maybe_unused]] int scene) {
  if constexpr (std::is_same_v<T, Pack>)
    return a[scene];
  else
    return value_of(a);
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
  }
  for (std::size_t p = 0; p < block.particles.size(); ++p) {
    const int node = block.particles[p];
    const std::size_t at = sheetbend_blocks::row * p;
    for (int d = 0; d < 3; ++d) {
      const int dof = s.scene.first_dof[node] + d;
      own.start[at + d] = number_of(states.x[dof], scene);
      own.guess[at + d] = states.x_next ? number_of(states.x_next[dof], scene)
                                        : own.start[at + d] + h * number_of(states.v[dof], scene);
      potential.target[at + d] = number_of(s.q[dof], scene);
    }
    own.start[at + 3] = own.guess[at + 3] = potential.target[at + 3] = number_of(s.w[node], scene);
  }
  if (block.damped)
    for (int j = 0; j < block.size(); ++j) potential.C_r[j] = number_of<T>(state.C_r[j], scene);
  if (block.contacts.empty()) return;
  if constexpr (is_plain<T>)
    potential.contacts = state.contacts[scene];
  else
    take_values(state.contacts[scene], potential.contacts);
}

// The particle, in the block's order, of place k of a run's constraint.
template <class K>
int particle_of(const MemberRun& run, int i, int k) {
  return run.nodes[lane_at(i, K::arity, k)] / sheetbend_blocks::row;
}

// Calls f(K{}, run, i, J, lambda) for every constraint over T, at the coordinates at(particle, d): lambda = -(C + g (C - C_r))/a.
template <class T, class At, class F>
void for_each_elastic(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state, At&& at, F&& f) {
  for (const MemberRun& run : block.runs) {
    const Group& group = s.scene.groups[run.group];
    with_kind(group.kind, [&]<class K>(K kind) {
      if constexpr (holds_points<K>)
        for (int i = 0; i < run.count; ++i) {
          const int item = run.items[i];
          constexpr int P = parameter_count<K>;
          T local[K::dofs], lambda[K::rows];
          for (int d = 0; d < K::dofs; ++d) local[d] = at(particle_of<K>(run, i, d / 3), d % 3);
          const Evaluation<K, T> value(
              local, s.inputs.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * P);
          const Rates<T> rates(s.inputs.of(Quantity::compliance)[group.first + item],
                               group.damped ? s.inputs.of(Quantity::damping)[group.first + item] : T(0.0), s.eta);
          for (int j = 0; j < K::rows; ++j) {
            T residual = value.C[j];
            if (group.damped) residual += rates.g * difference<K>(value.C[j], T(state.C_r[run.first_row[i] + j]));
            lambda[j] = -(residual / rates.a);
          }
          f(kind, run, i, value.J, lambda);
        }
    });
  }
}

// R -= J^T lambda over T at x, three numbers per particle.
template <class T>
void subtract_elastic_forces(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state,
                             const std::vector<T>& x, std::vector<T>& R) {
  for_each_elastic(
      s, block, state, [&](int particle, int d) { return x[3 * particle + d]; },
      [&]<class K>(K, const MemberRun& run, int i, const T* J, const T* lambda) {
        T push[K::dofs];
        transpose_times<K>(J, lambda, push);
        for (int d = 0; d < K::dofs; ++d) {
          const int particle = particle_of<K>(run, i, d / 3);
          if (particle < block.movable) R[3 * particle + d % 3] -= push[d];
        }
      });
}

// Likewise what contacts push with.
template <class T>
void subtract_contact_forces(const DirectBlock& block, const BlockState<T>& state, const std::vector<T>& x,
                             std::vector<T>& R) {
  const BlockContacts<T>& contacts = state.contacts[0];
  for (int i = 0; i < static_cast<int>(block.contacts.size()); ++i) {
    const std::size_t at = 3 * static_cast<std::size_t>(block.contacts[i].particle);
    const Touch<T> touch = contacts.at(block, i, Vec3<T>(&x[at]));
    if (touch.pushes) (-contacts.pose(block, i).turned(touch.force)).add_to(&R[at]);
  }
}

// The multipliers of scalars that carry tangents, which the solution comes without.
template <class T>
void carry_multipliers(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  for_each_elastic(
      s, block, state,
      [&](int particle, int d) { return T(state.x[0][sheetbend_blocks::row * static_cast<std::size_t>(particle) + d]); },
      [&]<class K>(K, const MemberRun& run, int i, const T*, const T* lambda) {
        for (int j = 0; j < K::rows; ++j) state.lambda[0][run.first_row[i] + j] = lambda[j];
      });
}

// What a scalar carries beside its value at the solution x (particles, 3), which comes with the value alone.
template <class T>
void carry_first_order(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state, std::vector<T>& x) {
  constexpr int passes = 2;  // the second one refines
  state.implicit[0].factorize(s.scene, block);
  std::vector<T> R(3 * static_cast<std::size_t>(block.movable));
  for (int pass = 0; pass < passes; ++pass) {
    for (int p = 0; p < block.movable; ++p) {
      const std::size_t at = sheetbend_blocks::row * static_cast<std::size_t>(p);
      for (int d = 0; d < 3; ++d) R[3 * p + d] = (x[3 * p + d] - T(state.x[0][at + d])) / T(state.x[0][at + 3]);
    }
    subtract_elastic_forces(s, block, state, x, R);
    subtract_contact_forces(block, state, x, R);
    for (T& r : R) r = r - T(value_of(r));
    state.implicit[0].solve(block, R.data());
    for (std::size_t i = 0; i < R.size(); ++i) x[i] = x[i] - R[i];
  }
}

// The solution over T, with what T carries beside its value.
template <class T>
void write_solution(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state) {
  const auto row_of = [](std::size_t p) { return sheetbend_blocks::row * p; };
  if constexpr (is_plain<T>) {
    for (int p = 0; p < block.movable; ++p)
      for (int d = 0; d < 3; ++d) {
        T& to = state.x[0][row_of(p) + d];
        if constexpr (std::is_same_v<T, Pack>)
          for (int scene = 0; scene < Pack::lanes; ++scene) to.set(scene, state.implicit[scene].x()[row_of(p) + d]);
        else
          to = state.implicit[0].x()[row_of(p) + d];
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
  if (states.x_next)
    for (int p = 0; p < block.movable; ++p)
      for (int d = 0; d < 3; ++d)
        state.x[0][sheetbend_blocks::row * p + d] = states.x_next[s.scene.first_dof[block.particles[p]] + d];
  else
    write_solution(s, block, state);
  if constexpr (!carries_tangents<T>) {  // whose multipliers are found where they are asked for
    const auto arrays = arrays_of(block, runs_of(s, block, state), state, 0);
    forward_kernels<T>(table).evaluate(arrays);
    T* dl = state.at(0).dl.data();
    for (int j = 0; j < block.size(); ++j) state.lambda[0][j] = dl[j] = dl[j] / state.diagonal[j];
  }
}

}  // namespace sheetbend
