// The reverse of CarryPairFriction: the cotangents of the forces that pairs carry on go through the law to the state that the substep has found, to those
// before and to the inputs.
#pragma once

#include "adjoint/solver/block_pairs_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/carry_pair_friction.h"

namespace sheetbend {

template <>
struct ReverseOf<CarryPairFriction> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Nothing&, const StepCotangents<T>& bar) {
    for (const DirectBlock& block : step.plan.blocks) {
      if (!block.surface.rubs()) continue;
      for (int lane = 0; lane < scenes_of<T>; ++lane)
        if (has(step.scenes, lane)) run_lane(step, work, block, lane, bar);
    }
    // They were written, whatever they were before.
    for (const auto& place : step.scene.self_contact.carried)
      for (const int node : place) std::fill_n(bar.x_next + step.scene.first_dof[node], 3, T(0.0));
  }

 private:
  template <class T>
  static void run_lane(const Step<T>& step, const Work<T>& work, const DirectBlock& block, int lane,
                       const StepCotangents<T>& bar) {
    using S = Single<T>;
    const std::vector<int>& first_dof = step.scene.first_dof;
    const S rate(1.0 / (step.bdf.eta * step.bdf.eta));
    const S none[12] = {};
    PairFrictionCotangents<S> friction_bar;
    friction_bar.resize(block);
    friction_bar.clear();
    std::size_t count = 0;
    CarryPairFriction::for_each_touching(
        step, work.masses, block, lane, [&](int node) { return work.q.of(node); },
        [&](const ContactSource<T>& source, const PairSource<T>& of, const BlockPair& pair, Part part, const S* x,
            const PairNumbers<S>& numbers, const Rub<S>& rub) {
          S x_bar[12], force[12], w_bar[4];
          Rub<S> rub_bar;
          const Vec3<S> carried_bar = source.at(bar.x_next, block.surface.carried[count++][1]);
          const auto numbers_bar =
              rub_vjp(pair.key.triangle, part, x, numbers, rub, none, rate * carried_bar, x_bar, force, rub_bar);
          friction_bar.add(of.friction, of.spots, pair, rub_bar);
          kappa_vjp(pair.key.triangle, numbers, of.pairs.stiffness, numbers_bar.kappa, w_bar);
          const auto add_to_weight = [&](std::size_t i, const S& own) { friction_bar.weights[i] += own; };
          for (int k = 0; k < 4; ++k) {
            spot_vjp(
                of.spots, pair.spots[k], Vec3<S>(x_bar + 3 * k),
                [&](int p) { return source.read(Vec3<T>(work.q.of(block.particles[p]))); },
                [&](int p, const Vec3<S>& own) { source.add(own, bar.x_next + first_dof[block.particles[p]]); },
                add_to_weight);
            inverse_mass_vjp(
                of.spots, pair.spots[k], w_bar[k], [&](int p) { return of.inverse_mass(p); },
                [&](int p, const S& own) {
                  if (p < block.movable) source.add(own, bar.w[block.particles[p]]);
                },
                add_to_weight);
          }
          for (const int k : {0, of.second_side(pair)})
            source.add(numbers_bar.touching, bar.in.of(Quantity::contact_radius)[of.radius_of(pair, k)]);
        });
    spread_friction(contact_source(step, work.masses, lane), block, friction_bar, bar.from, bar.in);
  }
};

}  // namespace sheetbend
