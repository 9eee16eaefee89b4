// One pass of block projections as a function of everything that it reads, theta = (q, w, C_r, lambda,
// inputs) -> (q', lambda'), and its reverse. The plan decides whether the blocks are single constraints by
// color, or direct.
#pragma once

#include <numeric>

#include "adjoint/solver/project_block_vjp.h"
#include "adjoint/solver/project_vjp.h"
#include "core/constraints/any_kind.h"
#include "core/solver/project.h"
#include "tests/cpp/support/case.h"
#include "tests/cpp/support/one_by_one.h"
#include "tests/cpp/support/random_scene.h"

namespace sheetbend::testing {

struct Projection {
  Scene scene;
  Plan plan;
  double eta;
  const sheetbend_packs::KernelTable* kernels = &pack_kernels();

  Projection(Scene s, Partition partition, double eta_)
      : scene(std::move(s)), plan(make_plan(scene, {.h = eta_, .partition = partition})), eta(eta_) {}

  // Where the parts of theta begin; the last entry is its size.
  std::vector<std::size_t> offsets() const {
    std::vector<std::size_t> at{0};
    for (const int size : {scene.dofs(), scene.nodes(), scene.rows, scene.rows}) at.push_back(at.back() + size);
    for (const std::size_t size : scene.layout.size) at.push_back(at.back() + size);
    return at;
  }
  std::size_t inputs_at() const { return offsets()[4]; }

  // Any state near the scene's own: displaced, with multipliers and references that do not vanish.
  std::vector<double> random_theta(const std::vector<double>& inputs, Random& random) const {
    std::vector<double> theta(inputs.begin(), inputs.begin() + scene.dofs());
    for (double& q : theta) q += random(-0.005, 0.005);
    const auto append = [&](const std::vector<double>& part) { theta.insert(theta.end(), part.begin(), part.end()); };
    append(random.vector(scene.nodes(), 30.0, 100.0));
    std::vector<double> C_r(scene.rows), lambda(scene.rows);
    for (const Group& group : scene.groups)
      for (int i = 0; i < group.count; ++i) {
        const Case sample = case_of(group.kind);
        AnyConstraint<double> near;
        std::ranges::copy(sample.x, near.x);
        near.evaluate(group.kind, sample.p.data());
        const double a = sample.compliance / (eta * eta);
        for (int j = 0; j < group.rows; ++j) {
          C_r[group.first_row + i * group.rows + j] = near.C[j] + random(-0.1, 0.1) * std::abs(near.C[j]);
          lambda[group.first_row + i * group.rows + j] = random(-1.0, 1.0) * std::abs(near.C[j]) / a;
        }
      }
    append(C_r);
    append(lambda);
    append(inputs);
    return theta;
  }

  template <class T>
  struct Run {
    std::vector<T> theta, out, w;
    IterationRecord<T> record;
    std::vector<BlockState<T>> blocks;
    SubstepState<T> state;

    Run(const Projection& p, const std::vector<T>& theta_)
        : theta(theta_),
          out(p.scene.dofs() + p.scene.rows),
          w(p.scene.nodes()),
          blocks(p.plan.blocks.size()),
          state{p.scene,
                {p.scene.layout, &theta[p.inputs_at()]},
                p.eta,
                &out[0],
                &w[0],
                &theta[p.offsets()[2]],
                &out[p.scene.dofs()]} {
      const auto at = p.offsets();
      for (int n = 0; n < p.scene.nodes(); ++n) w[n] = p.scene.role[n] == Role::free ? theta[at[1] + n] : T(0.0);
      std::copy_n(theta.begin(), p.scene.dofs(), out.begin());
      std::copy_n(theta.begin() + static_cast<std::ptrdiff_t>(at[3]), p.scene.rows, out.begin() + p.scene.dofs());
      record.resize(p.scene);
      // Wide scalars go through colors in kernels (test_packs.cpp).
      if constexpr (sizeof(T) <= 2 * sizeof(double))
        for (const Color& color : p.plan.colors) project_color(state, p.plan.options, color, record);
      else if (!p.plan.colors.empty())
        throw std::logic_error("colors are projected over one number or two");
      for (std::size_t b = 0; b < p.plan.blocks.size(); ++b) {
        blocks[b].resize(p.scene, p.plan.blocks[b], 1);
        begin_block(state, p.plan.blocks[b], blocks[b]);
        project_block(state, p.plan.blocks[b], *p.kernels, blocks[b], 0);
        end_block(state, p.plan.blocks[b], blocks[b]);
        unpack_multipliers(p.plan.blocks[b], blocks[b], state.lambda);
      }
    }
  };

  template <class T>
  std::vector<T> forward(const std::vector<T>& theta) const {
    return Run<T>(*this, theta).out;
  }

  std::vector<double> reverse(const std::vector<double>& theta, const std::vector<double>& out_bar) const {
    return reverse_with(theta, out_bar, [&](Run<double>& run, const SubstepCotangent<double>& bar) {
      for (auto color = plan.colors.rbegin(); color != plan.colors.rend(); ++color)
        project_color_vjp(run.state, plan.options, *color, run.record, bar);
      for (std::size_t b = 0; b < plan.blocks.size(); ++b) {
        const DirectBlock& block = plan.blocks[b];
        BlockCotangents<double> own;
        own.resize(scene, block);
        begin_block_vjp(run.state, block, bar.x, bar.lambda, bar.inputs, own);
        project_block_vjp(run.state, block, *kernels, run.blocks[b], 0, own);
        end_block_vjp(run.state, block, bar.x, bar.w, own);
        for (int row = 0; row < block.size(); ++row) {
          bar.lambda[block.multipliers[row]] = own.lambda[row];
          bar.C_r[block.multipliers[row]] = own.C_r[row];
        }
        add_particles(scene, block, block.movable, block.particles.size(), own.x, bar.x);
        finish_block(scene, block, run.state.inputs, bar.inputs, own);
      }
    });
  }

  // Runs `reverse_blocks` on the cotangents of the outputs; gives those of theta.
  template <class F>
  std::vector<double> reverse_with(const std::vector<double>& theta, const std::vector<double>& out_bar,
                                   F&& reverse_blocks) const {
    const auto at = offsets();
    Run<double> run(*this, theta);
    std::vector<double> bar(theta.size()), fixed(scene.stencil_coordinates);
    std::copy_n(out_bar.begin(), scene.dofs(), bar.begin());
    std::copy_n(out_bar.begin() + scene.dofs(), scene.rows, bar.begin() + static_cast<std::ptrdiff_t>(at[3]));
    reverse_blocks(run, SubstepCotangent<double>{
                            &bar[0], fixed.data(), &bar[at[3]], &bar[at[1]], &bar[at[2]], {scene.layout, &bar[at[4]]}});
    for (const Group& group : scene.groups)
      for (std::size_t c = 0; c < static_cast<std::size_t>(group.count) * group.arity * 3; ++c)
        bar[scene.first_dof[group.stencil[c / 3]] + c % 3] += fixed[group.first_coordinate + c];
    return bar;
  }
};

// A scene of one constraint with the sample's values; `pinned` lists stencil places that cannot move.
inline Sample scene_of_one(int kind, unsigned seed, bool damped, std::vector<int> pinned = {}) {
  const Case sample = case_of(kind);
  SceneSpec spec;
  spec.particles = static_cast<int>(sample.x.size()) / 3;
  spec.pinned = std::move(pinned);
  std::vector<int> stencil(spec.particles);
  std::iota(stencil.begin(), stencil.end(), 0);
  spec.groups = {{"one", kind_name(kind), damped, stencil}};
  Sample out{build_scene(spec), {}};
  Random random(seed);
  out.inputs.resize(out.scene.layout.total());
  const Inputs<double> in{out.scene.layout, out.inputs.data()};
  for (std::size_t d = 0; d < sample.x.size(); ++d) in.of(Quantity::position)[d] = sample.x[d] + random(-0.005, 0.005);
  for (std::size_t k = 0; k < sample.p.size(); ++k) in.of(Quantity::rest)[k] = sample.p[k] + random(-0.02, 0.02);
  in.of(Quantity::compliance)[0] = sample.compliance * random(0.5, 1.5);
  in.of(Quantity::damping)[0] = sample.damping * random(0.5, 1.5);
  return out;
}

}  // namespace sheetbend::testing
