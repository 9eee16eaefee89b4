// Substeps of more stages than ours, as CONTRIBUTING.md describes them: a force along x, and a set that every substep finds anew, whose entries keep a
// value from one substep to the next.
#include "adjoint/tape/footprint.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/lanes.h"
#include "tests/cpp/support/substeps.h"

namespace sheetbend {

// A constant force along x on everything that has inertia. Its parameter, the force, stands behind the scene's inputs. It keeps the
// displacements that it has given, of which the record's bytes are.
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
      bar.w[n] += *step.in.beyond() * along;
    }
  }
};

// A dynamic set: the particles inside a layer, found from the state in every substep. An entry keeps the way that its particle has made since it came in
// and is pulled back by a spring along it. What it keeps stands in the coordinates of a pinned node, as friction does (core/step/carry_friction.h). The
// stiffness stands behind PushAlongX's force.
struct HoldInLayer {
  static constexpr bool repeated = true;
  struct Pair {
    int particle, carried;
  };
  struct Entry {
    Pair of;
    int lane;
  };
  static inline std::vector<Pair> pairs;  // of the scene that is tested, in the order of the set

  template <class T>
  struct Record {
    std::vector<Entry> entries;
    void resize(const Scene&, const Plan&, bool) { entries.reserve(scenes_of<T> * pairs.size()); }
    static std::size_t bytes(const Scene&, const Plan&, bool) { return sizeof(Entry) * scenes_of<T> * pairs.size(); }
  };

  template <class S>
  static bool is_inside(const Vec3<S>& x) {
    return value_of(x.z) < 0.0;
  }
  // Calls f(source, pair) for every pair, one of the step's scenes after the other.
  template <class T, class F>
  static void for_each_pair(const Step<T>& step, const InverseMasses<T>& masses, F&& f) {
    for (int lane = 0; lane < scenes_of<T>; ++lane)
      if (has(step.scenes, lane))
        for (const Pair& pair : pairs) f(contact_source(step, masses, lane), pair);
  }
  template <class T>
  static Vec3<Single<T>> none() {
    return {Single<T>(0.0), Single<T>(0.0), Single<T>(0.0)};
  }
  template <class T>
  static Single<T> stiffness(const ContactSource<T>& source) {
    return source.read(source.in.beyond()[1]);
  }

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    record.entries.clear();
    for_each_pair(step, work.masses, [&](const ContactSource<T>& source, const Pair& pair) {
      if (is_inside(source.at(step.from.x, pair.particle))) record.entries.push_back({pair, source.lane});
    });
    const Single<T> eta2(step.bdf.eta * step.bdf.eta);
    for (const auto& [pair, lane] : record.entries) {
      const ContactSource<T> source = contact_source(step, work.masses, lane);
      const Single<T> w = source.read(source.w[pair.particle]);
      source.add(-(eta2 * w * stiffness(source)) * source.at(step.from.x, pair.carried), work.q.of(pair.particle));
    }
  }
};

template <>
struct ReverseOf<HoldInLayer> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, HoldInLayer::Record<T>& record, Nothing&,
                  const StepCotangents<T>& bar) {
    const Single<T> eta2(step.bdf.eta * step.bdf.eta);
    for (const auto& [pair, lane] : record.entries) {
      const ContactSource<T> source = contact_source(step, work.masses, lane);
      const Single<T> w = source.read(source.w[pair.particle]), k = HoldInLayer::stiffness(source);
      const auto q_bar = source.read(Vec3<T>(bar.q.of(pair.particle)));
      const Single<T> along = dot(source.at(step.from.x, pair.carried), q_bar);
      source.add(-(eta2 * w * along), bar.in.beyond()[1]);
      source.add(-(eta2 * k * along), bar.w[pair.particle]);
      source.add(-(eta2 * w * k) * q_bar, bar.from.x + step.scene.first_dof[pair.carried]);
    }
  }
};

// What the entries of the next substep keep: nothing where the particle is outside.
struct CarryInLayer {
  static constexpr bool repeated = false;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    HoldInLayer::for_each_pair(step, work.masses, [&](const auto& source, const HoldInLayer::Pair& pair) {
      const auto next = source.at(work.x_next, pair.particle);
      auto kept = source.at(step.from.x, pair.carried) + (next - source.at(step.from.x, pair.particle));
      if (!HoldInLayer::is_inside(next)) kept = HoldInLayer::none<T>();
      source.write(kept, work.x_next + step.scene.first_dof[pair.carried]);
    });
  }
};

template <>
struct ReverseOf<CarryInLayer> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Nothing&, const StepCotangents<T>& bar) {
    HoldInLayer::for_each_pair(step, work.masses, [&](const auto& source, const HoldInLayer::Pair& pair) {
      const int particle = step.scene.first_dof[pair.particle], carried = step.scene.first_dof[pair.carried];
      const auto kept_bar = source.at(bar.x_next, pair.carried);
      if (HoldInLayer::is_inside(source.read(Vec3<T>(work.q.of(pair.particle))))) {
        source.add(kept_bar, bar.from.x + carried);
        source.add(kept_bar, bar.x_next + particle);
        source.add(-kept_bar, bar.from.x + particle);
      }
      source.write(HoldInLayer::none<T>(), bar.x_next + carried);
    });
  }
};

using LongerSubstep = Stages<ComputeEffectiveMasses, Predict, ApplyForces, ApplyLoads, PushAlongX, HoldInLayer,
                             ApplyAirForces, PlaceColliders, Bounce, ProjectBlocks, SweepColors, UpdateVelocities,
                             LeaveImpacts, KeepSpin, RetractDirectors, Yield, CarryFriction, CarryInLayer>;

}  // namespace sheetbend

namespace sheetbend::testing {
namespace {

// The end of a rollout in longer substeps, and the gradient of its loss sum_dof weight x^2, with a tape of `kept` states.
template <class T>
struct Ended {
  std::vector<T> end, gradient;
};
template <class T>
Ended<T> longer_rollout(const Program& p, const std::vector<T>& inputs, int kept = every_state) {
  Rollout<T, LongerSubstep> rollout(p.scene, p.plan, inputs.data(), p.t0);
  Tape<T> tape(p.scene, p.plan, p.steps, kept);
  std::vector<char> keep(p.steps + 1, 0);
  keep[0] = 1;
  if (tape.keeps_end()) keep[p.steps] = 1;
  Schedule schedule = tape.schedule();
  for (auto action = schedule.next(); action && std::holds_alternative<Advance>(*action); action = schedule.next()) {
    const Advance& advance = std::get<Advance>(*action);
    std::fill(keep.begin() + advance.keep, keep.begin() + advance.to + 1, 1);
  }
  Ended<T> found{{}, std::vector<T>(inputs.size(), T(0.0))};
  rollout.run(p.steps, [&](int step, const T* x, const T*) {
    if (keep[step]) tape.record(step, x);
    if (step == p.steps) found.end.assign(x, x + p.scene.dofs());
  });
  std::vector<T> of_end;
  for (std::size_t i = 0; i < found.end.size(); ++i)
    of_end.push_back(T(2.0 * weight(p.steps, static_cast<int>(i))) * found.end[i]);
  CotangentGrowth<T> growth;
  growth.seed(of_end.data(), of_end.size());
  const auto seed = [&](int step, T* x_bar) {
    for (std::size_t i = 0; step == p.steps && i < of_end.size(); ++i) x_bar[i] += of_end[i];
  };
  rollout_vjp<T, LongerSubstep>(p.scene, p.plan, inputs.data(), p.t0, tape, seed, growth, found.gradient.data());
  return found;
}

// The loss over complex numbers.
Complex longer_loss(const Program& p, const std::vector<Complex>& inputs) {
  Rollout<Complex, LongerSubstep> rollout(p.scene, p.plan, inputs.data(), p.t0);
  Complex loss(0.0);
  rollout.run(p.steps, [&](int step, const Complex* x, const Complex*) {
    for (int i = 0; step == p.steps && i < p.scene.dofs(); ++i) loss += Complex(weight(step, i)) * x[i] * x[i];
  });
  return loss;
}

struct AStageMore : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, AStageMore, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, AStageMore, ::testing::Values(implicit_bdf2), solver_name);

TEST_P(AStageMore, HasItsReverse) {
  const Sample sample = random_scene(42, GetParam().shape());
  const Scene& scene = sample.scene;
  const OneSubstep one{scene, make_plan(scene, GetParam().options(2)), 1};
  Random random(42);
  auto theta = random_theta(sample, random);
  theta.insert(theta.end(), {0.7, 0.0});  // N, N/m
  const auto out_bar = random.vector(2 * scene.dofs());
  const auto along = random.vector(theta.size());
  std::vector<Complex> z(theta.begin(), theta.end());
  const auto slope = [&](const std::vector<Complex>& at) {
    const auto out = forward<Complex, LongerSubstep>(one, at);
    double sum = 0.0;
    for (std::size_t i = 0; i < out.size(); ++i) sum += out_bar[i] * out[i].im / complex_step;
    return sum;
  };
  const auto bar = reverse<LongerSubstep>(one, theta, out_bar);
  z[z.size() - 2].im = complex_step;
  const double by_force = slope(z);
  EXPECT_GT(std::abs(by_force), 1e-6);
  EXPECT_NEAR(bar[bar.size() - 2], by_force, 1e-10 * std::abs(by_force));
  // With respect to the masses, which reach the stage through w.
  const std::size_t masses = 4 * scene.dofs() + scene.layout.of(Quantity::mass);
  double found = 0.0;
  z[z.size() - 2].im = 0.0;
  for (std::size_t i = masses; i < masses + scene.layout.count(Quantity::mass); ++i) {
    z[i].im = complex_step * along[i];
    found += bar[i] * along[i];
  }
  const double expected = slope(z);
  EXPECT_NEAR(found, expected, 1e-10 * std::abs(expected));
  // It is counted without being named elsewhere.
  EXPECT_EQ((reverse_bytes<double, LongerSubstep>(scene, one.plan)),
            reverse_bytes<double>(scene, one.plan) + sizeof(double) * scene.nodes());
}

TEST(RolloutOfAStageMore, HasItsGradient) {
  const Sample sample = random_scene(43);
  const Program p{sample.scene, make_plan(sample.scene, {.h = 4e-3, .integrator = Integrator::bdf2, .iterations = 2}),
                  10};
  std::vector<double> inputs = sample.inputs;
  inputs.insert(inputs.end(), {0.7, 0.0});
  const std::size_t force = inputs.size() - 2;
  std::vector<Complex> z(inputs.begin(), inputs.end());
  z[force].im = complex_step;
  const double expected = longer_loss(p, z).im / complex_step;
  const auto whole = longer_rollout(p, inputs).gradient;
  EXPECT_NEAR(whole[force], expected, 1e-9 * std::abs(expected));
  EXPECT_TRUE(same_bits(whole, longer_rollout(p, inputs, Tape<double>::window(p.plan) + 2).gradient));
}

// A rope of six that falls into the layer and is thrown out again, some of it before the rest has come in.
struct ADynamicSet : ::testing::TestWithParam<Integrator> {
  ADynamicSet() {
    ContactBuilder b;
    for (int i = 0; i < particles; ++i)
      b.particle({0.05 * i, 0.01 * (i % 2), 0.01 * i}, 0.01, {0.3, 0.0, -1.0 - 0.1 * i});
    for (int i = 0; i + 1 < particles; ++i) b.constraint("distance", {i, i + 1}, 1e-3, {0.05});
    HoldInLayer::pairs.clear();
    for (int i = 0; i < particles; ++i) {
      HoldInLayer::pairs.push_back({i, b.particle({0.0, 0.0, 0.0}, 1.0)});
      b.spec.pinned.push_back(HoldInLayer::pairs.back().carried);
    }
    sample = b.build(9.81);
    sample.inputs.insert(sample.inputs.end(), {0.002, 30.0});
  }
  ~ADynamicSet() override { HoldInLayer::pairs.clear(); }

  // Particles inside after each substep.
  std::vector<int> lengths() const {
    const Program p = program();
    Rollout<double, LongerSubstep> rollout(p.scene, p.plan, sample.inputs.data());
    std::vector<int> all;
    for (int n = 0; n < steps; ++n) {
      rollout.advance();
      all.push_back(0);
      for (int i = 0; i < particles; ++i) all.back() += rollout.x()[3 * i + 2] < 0.0;
    }
    return all;
  }
  Program program() const {
    return {sample.scene, make_plan(sample.scene, {.h = 2e-3, .integrator = GetParam(), .iterations = 4}), steps};
  }

  static constexpr int particles = 6, steps = 70;
  Sample sample;
};
INSTANTIATE_TEST_SUITE_P(, ADynamicSet, ::testing::Values(Integrator::bdf1, Integrator::bdf2));

TEST_P(ADynamicSet, HasTheGradientOfComplexSteps) {
  const std::vector<int> found = lengths();
  EXPECT_EQ(std::ranges::max(found), particles);
  EXPECT_LT(found.back(), 2);
  int changes = 0;
  for (std::size_t i = 1; i < found.size(); ++i) changes += found[i] != found[i - 1];
  EXPECT_GT(changes, 6);

  const Program p = program();
  const auto bar = longer_rollout(p, sample.inputs).gradient;
  const auto of = [&](const std::vector<Complex>& z) { return longer_loss(p, z); };
  expect_sums_agree(p.scene.layout, of, sample.inputs, bar, 1e-9);
  std::vector<Complex> z(sample.inputs.begin(), sample.inputs.end());
  z.back().im = complex_step;
  const double expected = of(z).im / complex_step;
  EXPECT_GT(std::abs(expected), 1e-6);
  EXPECT_NEAR(bar.back(), expected, 1e-9 * std::abs(expected));
}

TEST_P(ADynamicSet, HasTheSameBitsWithFewStatesAndInLanes) {
  const Program p = program();
  const auto whole = longer_rollout(p, sample.inputs);
  const int few = Schedule::least(steps, Tape<double>::window(p.plan)) + 2;
  EXPECT_TRUE(same_bits(whole.gradient, longer_rollout(p, sample.inputs, few).gradient));
  // Other scenes find other sets.
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  for (int lane = 0; lane < Pack::lanes; ++lane) inputs[lane][p.scene.layout.of(Quantity::velocity) + 2] -= 0.1 * lane;
  const auto lanes = longer_rollout(p, packed(inputs), few);
  for (const int lane : {0, 3, 7}) {
    const auto alone = longer_rollout(p, inputs[lane]);
    EXPECT_TRUE(same_bits(lane_of(lanes.end, lane), alone.end)) << lane;
    EXPECT_TRUE(same_bits(lane_of(lanes.gradient, lane), alone.gradient)) << lane;
  }
}

TEST_P(ADynamicSet, IsCounted) {
  const Program p = program();
  const std::size_t entries = sizeof(HoldInLayer::Entry) * particles, pushes = p.scene.nodes();
  EXPECT_EQ((reverse_bytes<double, LongerSubstep>(p.scene, p.plan)),
            reverse_bytes<double>(p.scene, p.plan) + sizeof(double) * pushes + entries);
  EXPECT_EQ((reverse_bytes<Pack, LongerSubstep>(p.scene, p.plan)),
            reverse_bytes<Pack>(p.scene, p.plan) + sizeof(Pack) * pushes + Pack::lanes * entries);
}

}  // namespace
}  // namespace sheetbend::testing
