// The tangential forces of pairs that touch at the end of a substep, f = lambda_t/eta^2: the next substep begins with them. They are a list by key that changes
// from substep to substep, in the coordinates of pinned nodes: in the order of keys each pair writes its key into one and its force into another, and
// what is left over is zero. So tape, checkpoints and restarts have the list as they have any coordinate. Keys carry no derivative.
#pragma once

#include "core/step/project_blocks.h"

namespace sheetbend {

struct CarryPairFriction {
  static constexpr bool repeated = false;
  template <class T>
  using Record = Nothing;

  // Calls f(source, of, pair, part, x, numbers, rub) for every pair that touches where the block's nodes are at x_of(node) (3 of a T), in the order
  // of keys; of: the PairSource. Both are of one scene of the step.
  template <class T, class At, class F>
  static void for_each_touching(const Step<T>& step, const InverseMasses<T>& masses, const DirectBlock& block, int lane,
                                At&& x_of, F&& f) {
    using S = Single<T>;
    constexpr int row = sheetbend_blocks::row;
    const ContactSource<T> source = contact_source(step, masses, lane);
    const SubstepState<T> state = ProjectBlocks::state_of<T>(step, masses, nullptr);
    BlockPairs pairs;
    pairs.radius.assign(block.surface.spots(), 0.0);
    load_pairs(state, block, step.plan.options.h, lane, pairs);
    Numbers<double> rows;
    rows.assign(row * block.particles.size());
    for (std::size_t p = 0; p < block.particles.size(); ++p) {
      const int node = block.particles[p];
      for (int d = 0; d < 3; ++d) rows[row * p + d] = number_of(x_of(node)[d], lane);
      rows[row * p + 3] = number_of(masses.w[node], lane);
    }
    pairs.find_at(block, rows);
    if (pairs.empty()) return;
    PairFriction<S> friction;
    friction.resize(block);
    friction.load(source, block);
    const PairSource<T> of{state, block, pairs, friction, lane};
    of.for_each_touching([&](int particle) { return x_of(block.particles[particle]); },
                         [&](const BlockPair& pair, Part part, const S* x, const PairNumbers<S>& numbers,
                             const Rub<S>* rub) { f(source, of, pair, part, x, numbers, *rub); });
  }

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    if (!work.finite) return;
    const Scene& scene = step.scene;
    for (const DirectBlock& block : step.plan.blocks) {
      const auto& places = block.surface.carried;
      for (int lane = 0; lane < scenes_of<T>; ++lane) {
        if (!block.surface.rubs() || !has(step.scenes, lane)) continue;
        std::size_t count = 0;
        std::vector<T> list(6 * places.size(), T(0.0));  // written at the end, since x_next is read
        using S = Single<T>;
        for_each_touching(
            step, work.masses, block, lane, [&](int node) { return work.x_next + scene.first_dof[node]; },
            [&](const ContactSource<T>& source, const PairSource<T>&, const BlockPair& pair, Part part, const S* x,
                const PairNumbers<S>& numbers, const Rub<S>& rub) {
              if (count == places.size()) refuse(block, pair, count);
              S force[12];
              const auto met = meet(pair.key.triangle, part, x, numbers, &rub, force);
              const auto code = coded(pair.key, met.slides);
              source.write(Vec3<S>(S(code[0]), S(code[1]), S(code[2])), &list[6 * count]);
              source.write(S(1.0 / (step.bdf.eta * step.bdf.eta)) * met.tangential, &list[6 * count + 3]);
              ++count;
            });
        const ContactSource<T> source = contact_source(step, work.masses, lane);
        for (std::size_t i = 0; i < places.size(); ++i)
          for (int k = 0; k < 2; ++k) {
            const T* from = &list[6 * i + 3 * k];
            source.write(source.read(Vec3<T>(from)), work.x_next + scene.first_dof[places[i][k]]);
          }
      }
    }
  }

  [[noreturn]] static void refuse(const DirectBlock& block, const BlockPair& pair, std::size_t places) {
    throw Unbalanced("more than " + std::to_string(places) + " pairs touch with friction",
                     "give add_self_contact(pairs=...) as many as may touch at a time", 0, 0.0,
                     block.particles[block.surface.whole(pair.spots[0])]);
  }
};

}  // namespace sheetbend
