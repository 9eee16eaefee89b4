// The projection of direct blocks.
#pragma once

#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"
#include "core/solver/loop_rows.h"
#include "core/solver/project_block.h"
#include "core/solver/project_implicit.h"
#include "core/step/stages.h"

namespace sheetbend {

// Blocks share no movable particle: each goes through all its iterations, or to where its forces balance.
struct ProjectBlocks {
  static constexpr bool repeated = true;

  template <class T>
  struct Record {
    std::vector<BlockState<T>> blocks;

    void resize(const Scene& scene, const Plan& plan, bool reversed) {
      blocks.resize(plan.blocks.size());
      for (std::size_t b = 0; b < blocks.size(); ++b)
        blocks[b].resize(scene, plan.blocks[b], kept_iterations(plan, reversed));
    }
    static std::size_t bytes(const Scene& scene, const Plan& plan, bool reversed) {
      std::size_t sum = 0;
      for (const DirectBlock& block : plan.blocks)
        sum += sizeof(BlockState<T>) + BlockState<T>::bytes(scene, block, kept_iterations(plan, reversed));
      return sum;
    }
  };

  // The substep as blocks see it.
  template <class T>
  static SubstepState<T> state_of(const Step<T>& step, const InverseMasses<T>& masses, T* q) {
    return {step.scene, step.in, step.bdf.eta, q, masses.w.data(), nullptr, nullptr};
  }

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record);

  // Writes the multipliers of the last substep in the scene's order.
  template <class T>
  static void multipliers(const Scene& scene, const Plan& plan, const Inputs<const T>& in, Record<T>& record,
                          T* lambda) {
    for (std::size_t b = 0; b < plan.blocks.size(); ++b) {
      BlockState<T>& block = record.blocks[b];
      if constexpr (carries_tangents<T>)
        if (plan.blocks[b].implicit)
          carry_multipliers(SubstepState<T>{scene, in, block.eta, nullptr, nullptr, nullptr, nullptr}, plan.blocks[b],
                            block);
      unpack_multipliers(plan.blocks[b], block, lambda);
    }
  }
};

template <class T>
void ProjectBlocks::forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
  const Plan& plan = step.plan;
  parallel_for(static_cast<int>(plan.blocks.size()), step.threads(), 1, [&](int begin, int end) {
    const SubstepState<T> state = state_of(step, work.masses, work.x_next);
    for (int b = begin; b < end; ++b) {
      const DirectBlock& block = plan.blocks[b];
      begin_block(state, block, record.blocks[b]);
      damping_references(state, block, pack_kernels(), step.bdf.before, step.from, record.blocks[b]);
      load_contacts(
          block, [&](int lane) { return contact_source(step, work.masses, lane); }, *work.poses, record.blocks[b]);
      if (block.implicit) {
        project_implicit(state, block, plan.options, step.from, step.scenes, pack_kernels(), record.blocks[b]);
      } else {
        let_loop_rows_give_way(state, block, pack_kernels(), step.from.x, record.blocks[b]);
        for (int iteration = 0; iteration < plan.options.iterations; ++iteration)
          project_block(state, block, pack_kernels(), record.blocks[b], iteration);
      }
      end_block(state, block, record.blocks[b]);
    }
  });
  if (work.multipliers) multipliers(step.scene, plan, step.in, record, work.multipliers);
}

// The scalars of adjoint/rollout/instances_*.cpp.
extern template void ProjectBlocks::forward(const Step<double>&, Work<double>&, Record<double>&);
extern template void ProjectBlocks::forward(const Step<Pack>&, Work<Pack>&, Record<Pack>&);
extern template void ProjectBlocks::forward(const Step<Complex>&, Work<Complex>&, Record<Complex>&);
extern template void ProjectBlocks::forward(const Step<Dual<double, 1>>&, Work<Dual<double, 1>>&,
                                            Record<Dual<double, 1>>&);
extern template void ProjectBlocks::forward(const Step<Dual<double, 4>>&, Work<Dual<double, 4>>&,
                                            Record<Dual<double, 4>>&);
extern template void ProjectBlocks::forward(const Step<Dual<double, 8>>&, Work<Dual<double, 8>>&,
                                            Record<Dual<double, 8>>&);

}  // namespace sheetbend
