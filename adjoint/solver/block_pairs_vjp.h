// The reverse of an implicit block's pairs. R has minus their forces, so K^T p = x'_bar leaves p times the derivatives of the forces to what they are
// made of: coordinates, radii and, through kappa, inverse masses; with friction also the coefficient, and what the substeps before have left.
#pragma once

#include "adjoint/solver/cotangents.h"
#include "core/solver/pair_source.h"

namespace sheetbend {

// A pair's share along p (12): x_bar (12), and what goes to D and kappa. The forces have a potential, so what they are made of along p is how they
// change along p.
template <class S>
PairNumbers<S> meet_vjp(bool triangle, Part part, const S* x, const PairNumbers<S>& numbers, const S* p, S* x_bar,
                        S* force) {
  using D = Dual<S, 2>;
  D at[12], found[12];
  for (int d = 0; d < 12; ++d) {
    at[d] = D(x[d]);
    at[d].d[0] = p[d];
  }
  PairNumbers<D> own{D(numbers.touching), D(numbers.kappa)};
  own.touching.d[1] = S(1.0);
  meet<D>(triangle, part, at, own, static_cast<const Rub<D>*>(nullptr), found);
  PairNumbers<S> bar{S(0.0), S(0.0)};
  for (int d = 0; d < 12; ++d) {
    x_bar[d] = found[d].d[0];
    force[d] = found[d].v;
    bar.touching += p[d] * found[d].d[1];
    bar.kappa += p[d] * found[d].v;
  }
  bar.kappa = bar.kappa / numbers.kappa;
  return bar;
}

// The same with friction, which has no potential; force_bar (12) is p, and tangential_bar is of what the pair carries on.
template <class S>
PairNumbers<S> rub_vjp(bool triangle, Part part, const S* x, const PairNumbers<S>& numbers, const Rub<S>& rub,
                       const S* force_bar, const Vec3<S>& tangential_bar, S* x_bar, S* force, Rub<S>& rub_bar) {
  constexpr int touching = 12, kappa = 13, friction = 14, carried = 15;
  using D = Dual<S, 18>;
  const auto input = [](const S& a, int i) {
    D d(a);
    d.d[i] = S(1.0);
    return d;
  };
  D at[12], found[12];
  for (int d = 0; d < 12; ++d) at[d] = input(x[d], d);
  Rub<D> own = constants<D>(rub);
  own.friction = input(rub.friction, friction);
  own.carried = {input(rub.carried.x, carried), input(rub.carried.y, carried + 1), input(rub.carried.z, carried + 2)};
  const Meeting<D> met =
      meet<D>(triangle, part, at, {input(numbers.touching, touching), input(numbers.kappa, kappa)}, &own, found);
  D sum = D(tangential_bar.x) * met.tangential.x + D(tangential_bar.y) * met.tangential.y +
          D(tangential_bar.z) * met.tangential.z;
  for (int d = 0; d < 12; ++d) {
    force[d] = found[d].v;
    sum = sum + D(force_bar[d]) * found[d];
  }
  for (int d = 0; d < 12; ++d) x_bar[d] = sum.d[d];
  rub_bar.friction = sum.d[friction];
  rub_bar.carried = Vec3<S>(&sum.d[carried]);
  // The law has slip in P (f - kappa u) alone, u = sum b (x - from).
  const Nearest<S> n = nearest_points(triangle, x, softness_of(numbers), part);
  for (int k = 0; k < 4; ++k) ((numbers.kappa * n.weight[k]) * rub_bar.carried).store(rub_bar.from + 3 * k);
  return {sum.d[touching], sum.d[kappa]};
}

// Cotangents of one scene's PairFriction.
template <class S>
struct PairFrictionCotangents {
  S friction{};
  std::vector<Vec3<S>> carried;  // per place of a pair
  std::vector<S> from;           // per particle

  void resize(const DirectBlock& block) {
    if (!block.surface.rubs()) return;
    carried.resize(block.surface.carried.size());
    from.resize(3 * block.particles.size());
  }
  static std::size_t bytes(const DirectBlock& block) {
    if (!block.surface.rubs()) return 0;
    return sizeof(Vec3<S>) * block.surface.carried.size() + sizeof(S) * 3 * block.particles.size();
  }
  void clear() {
    friction = S(0.0);
    std::fill(carried.begin(), carried.end(), Vec3<S>(S(0.0), S(0.0), S(0.0)));
    std::fill(from.begin(), from.end(), S(0.0));
  }
  void add(const PairFriction<S>& of, const BlockPair& pair, const Rub<S>& bar) {
    friction += bar.friction;
    if (const int place = of.place_of(pair.key); place >= 0) carried[place] = carried[place] + bar.carried;
    for (int d = 0; d < 12; ++d) from[3 * static_cast<std::size_t>(pair.particles[d / 3]) + d % 3] += bar.from[d];
  }
};

// What has gathered goes on: the reverse of PairFriction::load().
template <class T>
void spread_friction(const ContactSource<T>& source, const DirectBlock& block,
                     const PairFrictionCotangents<Single<T>>& bar, const StateCotangents<T>& from_bar,
                     const Inputs<T>& in_bar) {
  using S = Single<T>;
  if (!block.surface.rubs()) return;
  const std::vector<int>& first_dof = source.scene.first_dof;
  source.add(bar.friction, in_bar.of(Quantity::friction)[block.surface.friction]);
  for (std::size_t p = 0; p < block.particles.size(); ++p) {
    const Vec3<S> history(&bar.from[3 * p]);
    const int dof = first_dof[block.particles[p]];
    source.add(S(source.bdf.now) * history, from_bar.x + dof);
    if (source.bdf.before != 0.0) source.add(S(source.bdf.before) * history, from_bar.x_before + dof);
  }
  for (std::size_t i = 0; i < bar.carried.size(); ++i)
    source.add(S(source.bdf.eta * source.bdf.eta) * bar.carried[i],
               from_bar.x + first_dof[block.surface.carried[i][1]]);
}

// What kappa leaves to the inverse masses (4).
template <class S>
void kappa_vjp(bool triangle, const PairNumbers<S>& numbers, double stiffness, const S& kappa_bar, S* w_bar) {
  const S all = -(kappa_bar * numbers.kappa * numbers.kappa) * S(1.0 / stiffness);
  for (int k = 0; k < 4; ++k) w_bar[k] = (triangle ? (k == 0 ? 1.0 : 1.0 / 9.0) : 0.25) * all;
}

}  // namespace sheetbend
