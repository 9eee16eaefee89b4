// Fourth rung: one substep, theta = (x, x_before, v, v_before, inputs) -> (x, v), its reverse against complex
// step. Also of a substep with a stage more than ours, as CONTRIBUTING.md describes it.
#include "adjoint/footprint.h"
#include "adjoint/rollout_vjp.h"
#include "adjoint/step/substep.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend {

// The stage of this test: a constant force along x on everything that has inertia. Its parameter, the force, stands behind the scene's inputs. It
// keeps the displacements that it has given, of which the record's bytes are.
struct PushAlongX {
  static constexpr bool repeated = true;

  template <class T>
  struct Record {
    std::vector<T> moved;
    void resize(const Scene& scene, const Plan&, bool) { moved.resize(scene.nodes()); }
    static std::size_t bytes(const Scene& scene, const Plan&, bool) { return sizeof(T) * scene.nodes(); }
  };

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    const T eta(step.bdf.eta);
    for (int n = 0; n < step.scene.nodes(); ++n) {
      if (!step.scene.inertial[n]) continue;
      record.moved[n] = eta * eta * work.masses.w[n] * *step.in.beyond();
      *work.q.of(n) += record.moved[n];
    }
  }
};

template <>
struct ReverseOf<PushAlongX> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, PushAlongX::Record<T>&, Nothing&,
                  const StepCotangents<T>& bar) {
    const T eta(step.bdf.eta);
    for (int n = 0; n < step.scene.nodes(); ++n) {
      if (!step.scene.inertial[n]) continue;
      const T along = eta * eta * *bar.q.of(n);
      *bar.in.beyond() += work.masses.w[n] * along;
      bar.w.of(n) += *step.in.beyond() * along;
    }
  }
};

using PushedSubstep =
    Stages<ComputeEffectiveMasses, Predict, ApplyForces, ApplyLoads, PushAlongX, ApplyAirForces, Bounce, ProjectBlocks,
           SweepColors, UpdateVelocities, LeaveImpacts, KeepSpin, RetractDirectors, Yield, CarryFriction>;

}  // namespace sheetbend

namespace sheetbend::testing {
namespace {

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
std::vector<double> random_theta(const Sample& sample, Random& random) {
  const std::size_t dofs = sample.scene.dofs();
  std::vector<double> theta;
  for (const double spread : {0.005, 0.005, 0.3, 0.3})
    for (std::size_t i = 0; i < dofs; ++i)
      theta.push_back((spread < 0.1 ? sample.inputs[i] : 0.0) + random(-spread, spread));
  theta.insert(theta.end(), sample.inputs.begin(), sample.inputs.end());
  return theta;
}

struct Substep : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, Substep, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Substep, ::testing::Values(implicit_bdf2), solver_name);

TEST_P(Substep, ReverseMatchesComplexStep) {
  const Sample sample = random_scene(40, GetParam().shape());
  const Scene& scene = sample.scene;
  for (const int number : {0, 1}) {
    SCOPED_TRACE(number == 0 ? "the first substep" : "a later substep");
    const OneSubstep one{scene, make_plan(scene, GetParam().options(3)), number};
    Random random(40 + number);
    const auto theta = random_theta(sample, random);
    const auto out_bar = random.vector(2 * scene.dofs());
    const auto oracle = complex_step_gradient(
        [&](const std::vector<Complex>& z) {
          const auto out = forward(one, z);
          Complex sum(0.0);
          for (std::size_t i = 0; i < out.size(); ++i) sum += Complex(out_bar[i]) * out[i];
          return sum;
        },
        theta);
    const auto bar = reverse(one, theta, out_bar);
    const std::size_t dofs = scene.dofs();
    const char* names[] = {"x", "x_before", "v", "v_before"};
    for (int part = 0; part < 4; ++part)
      EXPECT_LE(relative_error(std::span(bar).subspan(part * dofs, dofs), std::span(oracle).subspan(part * dofs, dofs)),
                1e-10)
          << names[part];
    // A substep reads the states that it is given, not the initial ones.
    for (int q = 0; q < quantity_count; ++q) {
      const auto of = [&](const std::vector<double>& g) {
        return std::span(g).subspan(4 * dofs + scene.layout.offset[q], scene.layout.size[q]);
      };
      const bool initial = q == static_cast<int>(Quantity::position) || q == static_cast<int>(Quantity::velocity);
      const bool missing = (scene.volumes.empty() && is_of_volumes(q)) || (scene.contacts.empty() && is_of_contacts(q));
      EXPECT_EQ(largest(of(oracle)) > 0.0, !initial && !missing) << quantity_names[q];
      const double error = relative_error(of(bar), of(oracle));
      EXPECT_LE(error, 1e-10) << quantity_names[q];
      record_error(quantity_names[q], error);
    }
  }
}

// The gradient of a rollout in substeps of a list, with a tape that keeps a few states only.
template <class List>
std::vector<double> rollout_gradient(const Program& p, const std::vector<double>& inputs, int kept) {
  Rollout<double, List> rollout(p.scene, p.plan, inputs.data(), p.t0);
  Tape<double> tape(p.scene, p.plan, p.steps, kept);
  std::vector<char> keep(p.steps + 1, 0);
  keep[0] = 1;
  if (tape.keeps_end()) keep[p.steps] = 1;
  Schedule schedule = tape.schedule();
  for (auto action = schedule.next(); action && std::holds_alternative<Advance>(*action); action = schedule.next()) {
    const Advance& advance = std::get<Advance>(*action);
    std::fill(keep.begin() + advance.keep, keep.begin() + advance.to + 1, 1);
  }
  std::vector<double> end, bar(inputs.size());
  rollout.run(p.steps, [&](int step, const double* x, const double*) {
    if (keep[step]) tape.record(step, x);
    if (step == p.steps) end.assign(x, x + p.scene.dofs());
  });
  CotangentGrowth<double> growth;
  const auto seed = [&](int step, double* x_bar) {
    if (step != p.steps) return;
    std::vector<double> of_end(end.size());
    for (std::size_t i = 0; i < end.size(); ++i) of_end[i] = 2.0 * weight(step, static_cast<int>(i)) * end[i];
    growth.seed(of_end.data(), of_end.size());
    for (std::size_t i = 0; i < end.size(); ++i) x_bar[i] += of_end[i];
  };
  rollout_vjp<double, List>(p.scene, p.plan, inputs.data(), p.t0, tape, seed, growth, bar.data());
  return bar;
}

TEST_P(Substep, TakesAStageMore) {
  const Sample sample = random_scene(42, GetParam().shape());
  const Scene& scene = sample.scene;
  const OneSubstep one{scene, make_plan(scene, GetParam().options(2)), 1};
  Random random(42);
  auto theta = random_theta(sample, random);
  theta.push_back(0.7);  // N
  const auto out_bar = random.vector(2 * scene.dofs());
  const auto along = random.vector(theta.size());
  std::vector<Complex> z(theta.begin(), theta.end());
  const auto slope = [&](const std::vector<Complex>& at) {
    const auto out = forward<Complex, PushedSubstep>(one, at);
    double sum = 0.0;
    for (std::size_t i = 0; i < out.size(); ++i) sum += out_bar[i] * out[i].im / complex_step;
    return sum;
  };
  const auto bar = reverse<PushedSubstep>(one, theta, out_bar);
  z.back().im = complex_step;
  const double by_force = slope(z);
  EXPECT_GT(std::abs(by_force), 1e-6);
  EXPECT_NEAR(bar.back(), by_force, 1e-10 * std::abs(by_force));
  // With respect to the masses, which reach the stage through w.
  const std::size_t masses = 4 * scene.dofs() + scene.layout.of(Quantity::mass);
  double found = 0.0;
  z.back().im = 0.0;
  for (std::size_t i = masses; i < masses + scene.layout.count(Quantity::mass); ++i) {
    z[i].im = complex_step * along[i];
    found += bar[i] * along[i];
  }
  const double expected = slope(z);
  EXPECT_NEAR(found, expected, 1e-10 * std::abs(expected));
  // A stage is counted without being named elsewhere.
  EXPECT_EQ((reverse_bytes<double, PushedSubstep>(scene, one.plan)),
            reverse_bytes<double>(scene, one.plan) + sizeof(double) * scene.nodes());
}

TEST(ASubstepWithAStageMore, GivesRolloutsWithTheirGradient) {
  const Sample sample = random_scene(43);
  const Program p{sample.scene, make_plan(sample.scene, {.h = 4e-3, .integrator = Integrator::bdf2, .iterations = 2}),
                  10};
  std::vector<double> inputs = sample.inputs;
  inputs.push_back(0.7);
  std::vector<Complex> z(inputs.begin(), inputs.end());
  z.back().im = complex_step;
  Rollout<Complex, PushedSubstep> rollout(p.scene, p.plan, z.data());
  Complex loss(0.0);
  rollout.run(p.steps, [&](int step, const Complex* x, const Complex*) {
    if (step != p.steps) return;
    for (int i = 0; i < p.scene.dofs(); ++i) loss += Complex(weight(step, i)) * x[i] * x[i];
  });
  const double expected = loss.im / complex_step;
  const auto whole = rollout_gradient<PushedSubstep>(p, inputs, every_state);
  EXPECT_NEAR(whole.back(), expected, 1e-9 * std::abs(expected));
  EXPECT_TRUE(same_bits(whole, rollout_gradient<PushedSubstep>(p, inputs, Tape<double>::window(p.plan) + 2)));
}

// At rest in still air no speed has a direction; their slopes are taken as zero, and nothing becomes NaN.
TEST(SubstepAtRest, ReverseIsFinite) {
  Sample sample = random_scene(41);
  const Inputs<double> in{sample.scene.layout, sample.inputs.data()};
  std::fill_n(in.of(Quantity::wind), sample.scene.layout.count(Quantity::wind), 0.0);
  const OneSubstep one{sample.scene, make_plan(sample.scene, {.h = 4e-3, .integrator = Integrator::bdf2}), 1};
  Random random(41);
  auto theta = random_theta(sample, random);
  const std::size_t dofs = sample.scene.dofs();
  std::fill_n(theta.begin() + static_cast<std::ptrdiff_t>(2 * dofs), 2 * dofs, 0.0);
  for (const double b : reverse(one, theta, random.vector(2 * dofs))) EXPECT_TRUE(std::isfinite(b));
}

// Directors across an edge and across a normal, and the normal itself, of which one is held.
TEST(Retraction, ReverseMatchesComplexStep) {
  SceneSpec spec;
  spec.particles = 7;
  spec.directors = {{2, 0, 1}, {3, 0, 1, 3}, {4, 0, 1, 3}, {5, 1, 0, 5}, {6, 1, 0, 5}};
  spec.pinned = {5};
  spec.groups = {{"all", "section_curvature", false, {3, 5, 4, 6}}};
  const Scene scene = build_scene(spec);
  Random random(4);
  const std::vector<double> x = random.vector(scene.dofs()), bar = random.vector(scene.dofs());
  std::vector<double> found = bar;
  retract_directors_vjp<double>(scene, [&](int node) { return &x[scene.first_dof[node]]; }, found.data());
  for (int i = 0; i < scene.dofs(); ++i) {
    std::vector<Complex> z(x.begin(), x.end());
    z[i].im = complex_step;
    retract_directors(scene, z.data());
    double expected = 0.0;
    for (int k = 0; k < scene.dofs(); ++k) expected += bar[k] * z[k].im / complex_step;
    EXPECT_NEAR(found[i], expected, 1e-13);
  }
  for (const int free : {2, 3, 4, 6}) {
    std::vector<double> once = x;
    retract_directors(scene, once.data());
    EXPECT_NEAR(norm(Vec3<double>(&once[3 * free])), 1.0, 1e-15);
  }
}

TEST(Retraction, RefusesANormalThatComesLater) {
  SceneSpec spec;
  spec.particles = 4;
  spec.directors = {{2, 0, 1, 3}, {3, 0, 1, 3}};
  EXPECT_THROW(build_scene(spec), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
