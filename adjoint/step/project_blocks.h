// The reverse of ProjectBlocks.
#pragma once

#include "adjoint/solver/project_implicit_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/project_blocks.h"

namespace sheetbend {

template <>
struct ReverseOf<ProjectBlocks> {
  template <class T>
  struct Scratch {
    std::vector<BlockCotangents<T>> blocks;

    void resize(const Scene& scene, const Plan& plan) {
      blocks.resize(plan.blocks.size());
      for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].resize(scene, plan.blocks[b]);
    }
    static std::size_t bytes(const Scene& scene, const Plan& plan) {
      std::size_t sum = 0;
      for (const DirectBlock& block : plan.blocks)
        sum += sizeof(BlockCotangents<T>) + BlockCotangents<T>::bytes(scene, block);
      return sum;
    }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, ProjectBlocks::Record<T>& record, Scratch<T>& scratch,
                  const StepCotangents<T>& bar);

  // What gathered of the constraints' own values.
  template <class T>
  static void finish(const Scene& scene, const Plan& plan, const Inputs<const T>& in, Scratch<T>& scratch,
                     const Inputs<T>& in_bar) {
    for (std::size_t b = 0; b < plan.blocks.size(); ++b)
      finish_block(scene, plan.blocks[b], in, in_bar, scratch.blocks[b]);
  }
};

template <class T>
void ReverseOf<ProjectBlocks>::run(const Step<T>& step, const Work<T>& work, ProjectBlocks::Record<T>& record,
                                   Scratch<T>& scratch, const StepCotangents<T>& bar) {
  const Plan& plan = step.plan;
  const SubstepState<T> state = ProjectBlocks::state_of<T>(step, work.masses, nullptr);
  parallel_for(static_cast<int>(plan.blocks.size()), step.threads(), 1, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      const DirectBlock& block = plan.blocks[b];
      BlockCotangents<T>& block_bar = scratch.blocks[b];
      begin_block_vjp<T>(state, block, bar.q.data, bar.multipliers, bar.in, block_bar);
      if (block.implicit)
        project_implicit_vjp(state, block, step.scenes, pack_kernels(), record.blocks[b], block_bar);
      else
        for (int iteration = plan.options.iterations - 1; iteration >= 0; --iteration)
          project_block_vjp(state, block, pack_kernels(), record.blocks[b], iteration, block_bar);
      end_block_vjp(state, block, bar.q.data, bar.w, block_bar);
      damping_references_vjp(state, block, pack_kernels(), step.bdf.before, record.blocks[b], bar.from.x,
                             bar.from.x_before, block_bar);
    }
  });
  for (std::size_t b = 0; b < plan.blocks.size(); ++b) {
    // Where the formula changes at contacts, a scene gathers in the same order alone and beside others that change at other times.
    if (changes_at_contacts(step.scene, plan.options))
      finish_block(step.scene, plan.blocks[b], step.in, bar.in, scratch.blocks[b]);
    add_fixed(step.scene, plan.blocks[b], scratch.blocks[b], bar.q.data, bar.from.x, bar.from.x_before);
    for (std::size_t i = 0; i < scratch.blocks[b].radii.size(); ++i)
      bar.in.of(Quantity::contact_radius)[i] += scratch.blocks[b].radii[i];
    for (std::size_t i = 0; i < scratch.blocks[b].weights.size(); ++i)
      bar.in.of(Quantity::contact_weight)[plan.blocks[b].surface.first_weight + i] += scratch.blocks[b].weights[i];
    auto& contacts = scratch.blocks[b].contacts;
    for (std::size_t lane = 0; lane < contacts.size(); ++lane) {
      const auto source = contact_source(step, work.masses, static_cast<int>(lane));
      spread_contacts(source, plan.blocks[b], record.blocks[b].contacts[lane], contacts[lane], bar.from, bar.in,
                      [&](int node) -> T& { return bar.w[node]; });
      spread_friction(source, plan.blocks[b], scratch.blocks[b].friction[lane], bar.from, bar.in);
    }
  }
}

// The scalars of adjoint/rollout/instances_*.cpp.
extern template void ReverseOf<ProjectBlocks>::run(const Step<double>&, const Work<double>&,
                                                   ProjectBlocks::Record<double>&, Scratch<double>&,
                                                   const StepCotangents<double>&);
extern template void ReverseOf<ProjectBlocks>::run(const Step<Pack>&, const Work<Pack>&, ProjectBlocks::Record<Pack>&,
                                                   Scratch<Pack>&, const StepCotangents<Pack>&);
extern template void ReverseOf<ProjectBlocks>::run(const Step<Dual<double, 1>>&, const Work<Dual<double, 1>>&,
                                                   ProjectBlocks::Record<Dual<double, 1>>&, Scratch<Dual<double, 1>>&,
                                                   const StepCotangents<Dual<double, 1>>&);

}  // namespace sheetbend
