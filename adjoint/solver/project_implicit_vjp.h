// The reverse of an implicit step (core/solver/project_implicit.h), by the implicit function theorem: K^T p = x'_bar, then
//
//   z = W^-1 p (of the predicted coordinates)     y = D^-1 J p     w_bar_i = (J^T lambda + F)_i . z_i
//
// F: the forces of contacts. Frames of rods have w_bar_i = W^-1 (x - x~)_i . z_i, which is the same at the balance. It does not lose digits where a
// balance to a part of the block's largest force leaves much of the small push on a frame.
// Everything else is as for a projection (element/element_vjp.h) with dl = lambda and v_j = lambda_j W z. Both y and v are linear in p, and what the
// elements and contacts send to the coordinates is what K^T p leaves of x'_bar: a second pass on that refines p, and brings the first order
// of scalars that carry one. K is not symmetric where contacts slide. Rows that do not give way (core/solver/rigid_rows.h) have no D^-1: their y is an
// unknown beside p, with J p = D y.
#pragma once

#include "adjoint/solver/project_block_vjp.h"
#include "core/solver/project_implicit.h"

namespace sheetbend {

template <class T>
bool has_rigid_rows(const BlockState<T>& state) {
  return std::ranges::any_of(state.implicit, [](const ImplicitBlock& scene) { return !scene.rigid().empty(); });
}

// z = K^-T z of some scenes, with y (rows of the block; of rigid ones alone) that is taken along; of others both are zero.
template <class T>
void solve_implicit(const Scene& whole, const DirectBlock& block, Scenes scenes, BlockState<T>& state,
                    std::vector<T>& z, std::vector<T>& y) {
  for (int scene = 0; scene < static_cast<int>(state.implicit.size()); ++scene) {
    if (!has(scenes, scene)) continue;
    ImplicitBlock& implicit = state.implicit[scene];
    const RigidRows& rigid = implicit.rigid();
    std::vector<Single<T>> own(z.size()), mu(rigid.size());
    for (std::size_t i = 0; i < z.size(); ++i) own[i] = in_scene(z[i], scene);
    for (int j = 0; j < rigid.size(); ++j) mu[j] = in_scene(y[rigid.row(j)], scene);
    implicit.solve_transposed(whole, block, own.data(), mu.data());
    for (std::size_t i = 0; i < z.size(); ++i) set_in_scene<T>(own[i], scene, z[i]);
    for (int j = 0; j < rigid.size(); ++j) set_in_scene<T>(mu[j], scene, y[rigid.row(j)]);
  }
}

// y of the rigid rows goes to the place of what a division by their compliance would be, J p, and what that leaves of their equations into `rest`.
template <class T>
void keep_rigid_rows(BlockState<T>& state, const std::vector<T>& y, std::vector<T>& rest, const std::vector<T>& Jp,
                     BlockCotangents<T>& bar) {
  for (int scene = 0; scene < static_cast<int>(state.implicit.size()); ++scene) {
    const RigidRows& rigid = state.implicit[scene].rigid();
    for (int j = 0; j < rigid.size(); ++j) {
      const int row = rigid.row(j);
      const T left = rest[row] - Jp[row] + state.diagonal[row] * y[row];
      set_in_scene<T>(in_scene(y[row], scene), scene, bar.y[row]);
      set_in_scene<T>(in_scene(left, scene), scene, rest[row]);
    }
  }
}

// A contact's share along p, in one scene: to the coordinates of the particles that carry its point, and gathered for spread_contacts().
template <class T>
void pull_back_contact(const DirectBlock& block, BlockState<T>& state, int scene, int i, const std::vector<T>& p,
                       BlockCotangents<T>& bar) {
  using S = Single<T>;
  const BlockContact& contact = block.contacts[i];
  const BlockContacts<S>& contacts = state.contacts[scene];
  const auto read = [&](const T* from) {
    return Vec3<S>(in_scene(from[0], scene), in_scene(from[1], scene), in_scene(from[2], scene));
  };
  const auto row_of = [](int particle) { return sheetbend_blocks::row * static_cast<std::size_t>(particle); };
  const auto x_of = [&](int particle) { return read(&state.x[0][row_of(particle)]); };
  const auto p_of = [&](int particle) { return read(&p[3 * static_cast<std::size_t>(particle)]); };
  Vec3<S> force;
  const Vec3<S> x_bar = bar.contacts[scene].pull_back(block, contacts, i, contacts.point(block, i, x_of),
                                                      contacts.point(block, i, p_of), force);
  for (int k = 0; k < contact.nodes; ++k) {
    const int particle = contact.particles[k];
    const std::size_t at = row_of(particle);
    S by[4], along = dot(force, p_of(particle));
    Vec3<S> own_bar = x_bar;
    if (contact.nodes > 1) {
      const S weight = contacts.weights[i][k];
      bar.contacts[scene].weights[i][k] += along + dot(x_bar, x_of(particle));
      along = weight * along, own_bar = weight * x_bar;
    }
    own_bar.store(by);
    by[3] = along / in_scene(state.x[0][at + 3], scene);
    for (int d = 0; d < 4; ++d) add_in_scene(by[d], scene, bar.x[at + d]);
  }
}

// Likewise that of pairs that touch; what goes to radii and to weights of points of bodies gathers.
template <class T>
void pull_back_pairs(const SubstepState<T>& s, const DirectBlock& block, BlockState<T>& state, const std::vector<T>& p,
                     BlockCotangents<T>& bar) {
  using S = Single<T>;
  for (int scene = 0; scene < static_cast<int>(state.implicit.size()); ++scene) {
    const PairFriction<S>& friction = state.friction[scene];
    const PairSource<T> source{s, block, state.implicit[scene].potential.pairs, friction, scene};
    const auto add = [&](const S& a, T& to) { add_in_scene(a, scene, to); };
    const auto row_of = [](int particle) { return sheetbend_blocks::row * static_cast<std::size_t>(particle); };
    const auto x_of = [&](int particle) { return &state.x[0][row_of(particle)]; };
    const auto p_of = [&](int particle) {
      const T* at = &p[3 * static_cast<std::size_t>(particle)];
      return particle < block.movable ? Vec3<S>(source.read(at[0]), source.read(at[1]), source.read(at[2])) : Vec3<S>();
    };
    const auto place_of = [&](int particle) { return source.place(particle, x_of); };
    source.for_each_touching(
        x_of, [&](const BlockPair& pair, Part part, const S* x, const PairNumbers<S>& numbers, const Rub<S>* rub) {
          S along[12], x_bar[12], force[12], w_bar[4], by[3];
          for (int k = 0; k < 4; ++k) source.spots.at(pair.spots[k], p_of).store(along + 3 * k);
          PairNumbers<S> numbers_bar;
          if (rub) {
            Rub<S> rub_bar;
            const Vec3<S> none(S(0.0), S(0.0), S(0.0));
            numbers_bar = rub_vjp(pair.key.triangle, part, x, numbers, *rub, along, none, x_bar, force, rub_bar);
            bar.friction[scene].add(friction, source.spots, pair, rub_bar);
          } else {
            numbers_bar = meet_vjp(pair.key.triangle, part, x, numbers, along, x_bar, force);
          }
          kappa_vjp(pair.key.triangle, numbers, source.pairs.stiffness, numbers_bar.kappa, w_bar);
          for (int k = 0; k < 4; ++k) {
            const int spot = pair.spots[k];
            const Vec3<S> own_bar(x_bar + 3 * k), push(force + 3 * k);
            std::size_t i = source.spots.first_weight(spot);
            source.spots.for_each_node(spot, [&](int particle, const S& b) {
              T* to = &bar.x[row_of(particle)];
              (b * own_bar).store(by);
              for (int d = 0; d < 3; ++d) add(by[d], to[d]);
              const S work = dot(push, p_of(particle));
              if (particle < block.movable) add(b * work / source.read(x_of(particle)[3]) + b * b * w_bar[k], to[3]);
              if (source.spots.is_node(spot)) return;
              const S of_mass = S(2.0) * b * source.inverse_mass(particle) * w_bar[k];
              add(work + dot(own_bar, place_of(particle)) + of_mass, bar.weights[i++]);
            });
          }
          for (const int k : {0, source.second_side(pair)})
            add(numbers_bar.touching, bar.radii[source.radius_of(pair, k)]);
        });
  }
}

// The matrices of these scenes at the solution, and no cotangents yet.
template <class T>
void begin_implicit_vjp(const Scene& whole, const DirectBlock& block, Scenes scenes, BlockState<T>& state,
                        BlockCotangents<T>& bar) {
  for (int scene = 0; scene < static_cast<int>(state.implicit.size()); ++scene)
    if (has(scenes, scene)) {
      if constexpr (is_plain<T>)
        state.implicit[scene].prepare_transposed(whole, block);
      else
        state.implicit[scene].factorize(whole, block);
    }
  for (auto& scene : bar.contacts) scene.clear();
  for (auto& scene : bar.friction) scene.clear();
  for (auto* gathered : {&bar.radii, &bar.weights}) std::fill(gathered->begin(), gathered->end(), T(0.0));
  state.lambda[0].clear();  // all of it is dl
  state.at(0).u.clear();    // J stands in no linearized row
}

// p = K^-T x'_bar and y = D^-1 J p of what is left of x'_bar; `rest` is what is left of the equations of rigid rows (empty where there are none).
template <class T>
void find_multipliers(const Scene& whole, const DirectBlock& block, Scenes scenes, BlockState<T>& state,
                      std::vector<T>& p, std::vector<T>& rest, BlockCotangents<T>& bar) {
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = bar.x[sheetbend_blocks::row * (i / 3) + i % 3];
  std::vector<T> y = rest, Jp(rest.size());
  solve_implicit(whole, block, scenes, state, p, y);
  bar.y.clear();
  numbers_of_block(block, state, 0).subtract_times(p.data(), bar.y.data());
  for (std::size_t j = 0; j < Jp.size(); ++j) Jp[j] = -bar.y[j];
  for (int j = 0; j < block.size(); ++j) bar.y[j] = -(bar.y[j] / state.diagonal[j]);
  keep_rigid_rows(state, y, rest, Jp, bar);
}

// z = W^-1 p, added to x_bar, with w_bar; of x'_bar is left what z and J^T y do not take.
template <class T>
void take_from_rest(const DirectBlock& block, const sheetbend_blocks::Block& arrays, BlockState<T>& state,
                    const std::vector<T>& p, std::vector<T>& x_bar, BlockCotangents<T>& bar) {
  for (int n = 0; n < static_cast<int>(block.particles.size()); ++n) {
    const std::size_t at = sheetbend_blocks::row * static_cast<std::size_t>(n);
    Vec3<T> left = Vec3<T>(&bar.x[at]) - transpose_times_at<T>(arrays, n, bar.y.data());
    if (n < block.movable) {
      const T mass = T(1.0) / state.x[0][at + 3];
      const Vec3<T> z = mass * Vec3<T>(&p[3 * n]);
      z.store(&bar.z[at]);
      z.add_to(&x_bar[3 * n]);
      left = left - z;
      bar.x[at + 3] += dot(transpose_times_at<T>(arrays, n, state.at(0).dl.data()), z);
    }
    left.store(&bar.x[at]);
  }
}

template <class T>
void project_implicit_vjp(const SubstepState<T>& s, const DirectBlock& block, Scenes scenes,
                          const sheetbend_packs::KernelTable& table, BlockState<T>& state, BlockCotangents<T>& bar) {
  const bool has_rigid = has_rigid_rows(state);
  const bool lifts = std::any_of(state.contacts.begin(), state.contacts.end(), [](const auto& c) { return c.lifts(); });
  const int passes = (has_rigid ? 3 : 2) + (lifts ? 3 : 0);
  begin_implicit_vjp(s.scene, block, scenes, state, bar);
  const auto arrays = arrays_of(block, runs_of(s, block, state, &bar.values), state, 0, bar);
  std::vector<T> p(3 * static_cast<std::size_t>(block.movable)), x_bar(p.size(), T(0.0));
  std::vector<T> rest(has_rigid ? block.size() : 0, T(0.0));
  for (int pass = 0; pass < passes; ++pass) {
    find_multipliers(s.scene, block, scenes, state, p, rest, bar);
    take_from_rest(block, arrays, state, p, x_bar, bar);
    reverse_kernels<T>(table).pull_back(arrays);
    for (int scene = 0; scene < static_cast<int>(state.contacts.size()); ++scene)
      for (int i = 0; i < static_cast<int>(block.contacts.size()); ++i)
        pull_back_contact(block, state, scene, i, p, bar);
    pull_back_pairs(s, block, state, p, bar);
  }
  for (std::size_t i = 0; i < p.size(); ++i) bar.x[sheetbend_blocks::row * (i / 3) + i % 3] = x_bar[i];
  for (std::size_t i = 0; i < block.frames.size(); ++i) {
    const std::size_t at = static_cast<std::size_t>(block.frames[i].particle);
    bar.x[sheetbend_blocks::row * at + 3] = dot(state.frame_pushes[i], Vec3<T>(&x_bar[3 * at]));
  }
}

}  // namespace sheetbend
