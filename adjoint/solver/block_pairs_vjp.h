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

// Compiled once, for plain rollouts and for scenes in lanes (block_pairs_vjp.cpp).
extern template PairNumbers<double> meet_vjp(bool, Part, const double*, const PairNumbers<double>&, const double*,
                                             double*, double*);
extern template PairNumbers<double> rub_vjp(bool, Part, const double*, const PairNumbers<double>&, const Rub<double>&,
                                            const double*, const Vec3<double>&, double*, double*, Rub<double>&);

// The reverse of Spots::at: a cotangent of where a spot is goes to its nodes, by to(node, cotangent), and to its weights, by weight(i, cotangent) in their
// order. at(node) are its nodes'.
template <class S, class At, class To, class Weight>
void spot_vjp(const Spots<S>& spots, int spot, const Vec3<S>& bar, At&& at, To&& to, Weight&& weight) {
  if (spots.is_node(spot)) return to(spot, bar);
  std::size_t i = spots.first_weight(spot);
  spots.for_each_node(spot, [&](int node, const S& b) {
    to(node, b * bar);
    weight(i++, dot(at(node), bar));
  });
}

// Likewise of Spots::inverse_mass.
template <class S, class W, class To, class Weight>
void inverse_mass_vjp(const Spots<S>& spots, int spot, const S& bar, W&& w, To&& to, Weight&& weight) {
  if (spots.is_node(spot)) return to(spot, bar);
  std::size_t i = spots.first_weight(spot);
  spots.for_each_node(spot, [&](int node, const S& b) {
    to(node, b * b * bar);
    weight(i++, S(2.0) * b * w(node) * bar);
  });
}

// Cotangents of one scene's PairFriction.
template <class S>
struct PairFrictionCotangents {
  S friction{};
  std::vector<Vec3<S>> carried;  // per place of a pair
  std::vector<S> from;           // per particle
  std::vector<S> weights;        // of points of bodies, in their order

  void resize(const DirectBlock& block) {
    if (!block.surface.rubs()) return;
    carried.resize(block.surface.carried.size());
    from.resize(3 * block.particles.size());
    weights.resize(4 * block.surface.on_bodies.size());
  }
  static std::size_t bytes(const DirectBlock& block) {
    if (!block.surface.rubs()) return 0;
    return sizeof(Vec3<S>) * block.surface.carried.size() +
           sizeof(S) * (3 * block.particles.size() + 4 * block.surface.on_bodies.size());
  }
  void clear() {
    friction = S(0.0);
    std::fill(carried.begin(), carried.end(), Vec3<S>(S(0.0), S(0.0), S(0.0)));
    std::fill(from.begin(), from.end(), S(0.0));
    std::fill(weights.begin(), weights.end(), S(0.0));
  }
  void add(const PairFriction<S>& of, const Spots<S>& spots, const BlockPair& pair, const Rub<S>& bar) {
    friction += bar.friction;
    if (const int place = of.place_of(pair.key); place >= 0) carried[place] = carried[place] + bar.carried;
    for (int k = 0; k < 4; ++k)
      spot_vjp(
          spots, pair.spots[k], Vec3<S>(bar.from + 3 * k), [&](int p) { return of.history(p); },
          [&](int p, const Vec3<S>& own) { own.add_to(&from[3 * static_cast<std::size_t>(p)]); },
          [&](std::size_t i, const S& own) { weights[i] += own; });
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
  for (std::size_t i = 0; i < bar.weights.size(); ++i)
    source.add(bar.weights[i], in_bar.of(Quantity::contact_weight)[block.surface.first_weight + i]);
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

// What kappa leaves to the inverse masses (4) of spots.
template <class S>
void kappa_vjp(bool triangle, const PairNumbers<S>& numbers, double stiffness, const S& kappa_bar, S* w_bar) {
  const S all = -(kappa_bar * numbers.kappa * numbers.kappa) * S(1.0 / stiffness);
  for (int k = 0; k < 4; ++k) w_bar[k] = (triangle ? (k == 0 ? 1.0 : 1.0 / 9.0) : 0.25) * all;
}

}  // namespace sheetbend
