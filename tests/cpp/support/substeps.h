// One substep of a list of stages as a function theta = (x, x_before, v, v_before, inputs) -> (x, v), and its reverse.
#pragma once

#include "adjoint/rollout/rollout_vjp.h"
#include "adjoint/step/substep.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {

struct OneSubstep {
  const Scene& scene;
  Plan plan;
  int number;
  double t_next = 0.013;
};

template <class T>
Step<T> step_of(const OneSubstep& one, const std::vector<T>& theta) {
  const std::size_t dofs = one.scene.dofs();
  return {one.scene,
          one.plan,
          {one.scene.layout, theta.data() + 4 * dofs},
          Bdf::at(one.plan.options, one.number),
          one.t_next,
          {theta.data(), theta.data() + dofs, theta.data() + 2 * dofs, theta.data() + 3 * dofs}};
}

template <class T, class List = Substep>
std::vector<T> forward(const OneSubstep& one, const std::vector<T>& theta) {
  const std::size_t dofs = one.scene.dofs();
  std::vector<T> out(2 * dofs);
  SubstepRecord<T, List> record;
  record.resize(one.scene, one.plan, true);
  substep(step_of(one, theta), out.data(), out.data() + dofs, record);
  return out;
}

template <class List = Substep>
std::vector<double> reverse(const OneSubstep& one, const std::vector<double>& theta,
                            const std::vector<double>& out_bar) {
  const Step<double> step = step_of(one, theta);
  const int dofs = one.scene.dofs();
  std::vector<double> bar(theta.size()), next_bar = out_bar, q(dofs);
  SubstepRecord<double, List> record;
  record.resize(one.scene, one.plan, true);
  SubstepScratch<double, List> scratch(one.scene, one.plan);
  const Inputs<double> in_bar{one.scene.layout, &bar[4 * dofs]};
  substep_vjp(step, q.data(), next_bar.data(), next_bar.data() + dofs, record, scratch,
              {&bar[0], &bar[dofs], &bar[2 * dofs], &bar[3 * dofs]}, in_bar);
  finish_substeps(one.scene, one.plan, step.in, scratch, in_bar);
  return bar;
}

// States at n and n-1 that are near the scene's initial one but owe nothing to each other.
inline std::vector<double> random_theta(const Sample& sample, Random& random) {
  const std::size_t dofs = sample.scene.dofs();
  std::vector<double> theta;
  for (const double spread : {0.005, 0.005, 0.3, 0.3})
    for (std::size_t i = 0; i < dofs; ++i)
      theta.push_back((spread < 0.1 ? sample.inputs[i] : 0.0) + random(-spread, spread));
  theta.insert(theta.end(), sample.inputs.begin(), sample.inputs.end());
  return theta;
}

}  // namespace sheetbend::testing
