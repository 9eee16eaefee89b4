#include "adjoint/observe/settled.h"

#include <algorithm>
#include <utility>

#include "core/rollout/rollout.h"

namespace sheetbend {
namespace {

template <class T>
std::vector<T> at_rest(const Scene& scene, const T* inputs) {
  std::vector<T> still(inputs, inputs + scene.layout.total());
  std::fill_n(still.begin() + static_cast<std::ptrdiff_t>(scene.layout.of(Quantity::velocity)), scene.dofs(), T(0.0));
  return still;
}

// Pinned nodes stay as they are given: forces that contacts carry and sets that slide stand there, which so short a substep would make by its own measure.
template <class F>
void for_each_pinned(const Scene& scene, F&& f) {
  for (int n = 0; n < scene.nodes(); ++n)
    for (int d = 0; scene.role[n] == Role::pinned && d < 3; ++d) f(scene.first_dof[n] + d);
}

constexpr double settling_share = 1e-3;  // of a substep
constexpr int settling_iterations = 10;  // of Newton, or more

double before(const Plan& settling, double t0) { return t0 - settling.options.h; }

}  // namespace

Plan settling_plan(const Scene& scene, SolverOptions options) {
  options.h *= settling_share;
  options.iterations = std::max(options.iterations, settling_iterations);
  return make_plan(scene, options);
}

template <class T>
std::vector<T> settled_coordinates(const Scene& scene, const Plan& settling, const T* inputs, double t0) {
  const std::vector<T> still = at_rest(scene, inputs);
  Rollout<T> one(scene, settling, still.data(), before(settling, t0));
  one.advance();
  std::vector<T> x(one.x(), one.x() + scene.dofs());
  for_each_pinned(scene, [&](int i) { x[i] = inputs[scene.layout.of(Quantity::position) + i]; });
  return x;
}

template std::vector<double> settled_coordinates(const Scene&, const Plan&, const double*, double);
template std::vector<Dual<double, 4>> settled_coordinates(const Scene&, const Plan&, const Dual<double, 4>*, double);
template std::vector<Dual<double, 8>> settled_coordinates(const Scene&, const Plan&, const Dual<double, 8>*, double);

Settled::Settled(const Scene& scene, const Plan& settling, const double* inputs, double t0)
    : scene_(scene),
      settling_(settling),
      t0_(before(settling, t0)),
      still_(at_rest(scene, inputs)),
      x_(scene.dofs()),
      tape_(record_rollout(scene, settling, still_.data(), t0_, {1}, x_.data(), every_state, nullptr)) {
  for_each_pinned(scene, [&](int i) { x_[i] = still_[scene.layout.of(Quantity::position) + i]; });
}

void Settled::pull_back(const double* x_bar, double* inputs_bar) {
  std::vector<double> own(scene_.layout.total()), moved_bar(x_bar, x_bar + scene_.dofs());
  for_each_pinned(
      scene_, [&](int i) { inputs_bar[scene_.layout.of(Quantity::position) + i] += std::exchange(moved_bar[i], 0.0); });
  reverse_rollout(scene_, settling_, still_.data(), t0_, tape_, {1}, moved_bar.data(), own.data(), nullptr);
  const std::size_t v = scene_.layout.of(Quantity::velocity);
  for (std::size_t i = 0; i < own.size(); ++i)
    if (i < v || i >= v + scene_.dofs()) inputs_bar[i] += own[i];
}

}  // namespace sheetbend
