// What force sensors read along rollouts: values with tangents have the bits of those without, and the tangents are those of the complex step.
#include "adjoint/observe/force_sensor.h"
#include "core/rollout/rollout.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

// Everything that is held hangs on one sensor that turns; what is driven counts with its own mass, drag and air.
ForceSensor sensor_on(const Scene& scene, double h) {
  ForceSensor s;
  Support support;
  support.nodes = scene.driven;
  support.nodes.insert(support.nodes.end(), scene.pinned.begin(), scene.pinned.end());
  support.carried = scene.driven;
  support.about = scene.driven[0];
  s.reader = SupportReader(scene, support);
  s.arm = {0.02, -0.01, 0.05};
  s.sign = -1.0;
  s.times = {2.3 * h, 3.6 * h, 5.9 * h};
  s.sample = {0, 0, 1};
  s.share = {0.5, 0.5, 1.0};
  for (const double c : {1.0, 0.6}) {  // about z, about x
    const double n = std::sqrt(1.0 - c * c);
    for (const double entry : {c, -n, 0.0, n, c, 0.0, 0.0, 0.0, 1.0}) s.rotation.push_back(entry);
  }
  s.measured.assign(2 * ForceSensor::channels, 0.1);
  s.sigma = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  return s;
}

// Residuals and readings; the sensor's own inputs stand behind the scene's.
template <class T>
std::vector<T> read(const Program& p, const ForceSensor& sensor, const std::vector<T>& inputs) {
  const T* own = inputs.data() + p.scene.layout.total();
  const Inputs<const T> in{p.scene.layout, inputs.data()};
  SensorRun<T> run(sensor, p.scene, inputs.data(), own, p.plan.options.h, p.t0, p.steps);
  std::vector<T> means(sensor.measured.size(), T(0.0)), r(sensor.rows());
  Rollout<T> rollout(p.scene, p.plan, inputs.data(), p.t0);
  rollout.run(p.steps, [&](int step, const T* x, const T* v) {
    if (step == 0 || !run.wants(step)) return;
    const double eta = Bdf::at(p.plan.options, step - 1).eta;
    run.take(step, sensor.reader.read(p.scene, in, eta, rollout.time(step), x, v, rollout.multipliers()));
    run.read(step, T(1.0), means.data());
  });
  sensor_residuals(sensor, own, means.data(), r.data());
  r.insert(r.end(), means.begin(), means.end());
  return r;
}

struct Sensors : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, Sensors, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Sensors, ::testing::Values(implicit_bdf2), solver_name);

TEST_P(Sensors, HaveTheTangentsOfTheComplexStep) {
  using D = Dual<double, 8>;
  const Sample sample = random_scene(85, GetParam().shape());
  const SolverOptions options = GetParam().options(2);
  const Program p{sample.scene, make_plan(sample.scene, options), 8, 0.004};
  const ForceSensor sensor = sensor_on(sample.scene, options.h);
  std::vector<double> values = sample.inputs;
  for (int k = 0; k < ForceSensor::inputs; ++k) values.push_back(k < 10 ? 0.1 + 0.02 * k : 0.1 * options.h);
  // A sensor's clock is that of the rollout, which begins at t0.
  ForceSensor shifted = sensor;
  for (double& t : shifted.times) t += p.t0;

  Random random(80);
  std::vector<D> inputs(values.begin(), values.end());
  for (D& a : inputs)
    for (double& d : a.d) d = random(-1.0, 1.0) * std::abs(a.v);
  const std::vector<D> found = read(p, shifted, inputs);
  const auto part = [](const std::vector<D>& all, int k) {
    std::vector<double> out;
    for (const D& a : all) out.push_back(k < 0 ? a.v : a.d[k]);
    return out;
  };
  EXPECT_LE(relative_error(part(found, -1), read(p, shifted, values)), 1e-13);
  double worst = 0.0;
  for (int k = 0; k < 8; ++k) {
    const auto oracle =
        complex_step_along([&](const std::vector<Complex>& z) { return read(p, shifted, z); }, values, part(inputs, k));
    worst = std::max(worst, relative_error(part(found, k), oracle));
  }
  EXPECT_LE(worst, 1e-10);
  record_error("tangents of forces", worst);
}

}  // namespace
}  // namespace sheetbend::testing
