// Colors eight constraints at a time: every instruction set gives the bits of the single-constraint kernels, whatever the color's length.
#include "adjoint/packs/packed_reverse.h"
#include "tests/cpp/support/one_by_one.h"
#include "tests/cpp/support/random_scene.h"

namespace sheetbend::testing {
namespace {

constexpr double eta = 1.0 / 300.0;

// Hinges that share no particle, with angles all the way round.
Sample hinges_around_a_turn() {
  constexpr int count = 67;
  SceneSpec spec;
  spec.particles = 3 * count;
  spec.groups = {{"hinges", Hinge::name, true, {}}};
  for (int n = 0; n < spec.particles; ++n) spec.groups[0].stencil.push_back(n);
  Sample out{build_scene(spec), {}};
  out.inputs.resize(out.scene.layout.total());
  const Inputs<double> in{out.scene.layout, out.inputs.data()};
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * i / (count - 1) - M_PI;
    const double x[] = {0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.1 + 0.1 * std::cos(angle), 0.1 * std::sin(angle), 0.0};
    const double rest[] = {0.0, 0.0, 1.0, 0.9 * angle};
    std::copy_n(x, 9, in.of(Quantity::position) + 9 * i);
    std::copy_n(rest, 4, in.of(Quantity::rest) + 4 * i);
    in.of(Quantity::compliance)[i] = 1.0;
    in.of(Quantity::damping)[i] = 5e-4;
  }
  return out;
}

enum class Scenes { ropes, net, turn };

struct Packs : ::testing::TestWithParam<Scenes> {
  Sample sample = GetParam() == Scenes::turn ? hinges_around_a_turn()
                                             : random_scene(60, {.net = GetParam() == Scenes::net, .unilateral = true});
  const Scene& scene = sample.scene;
  Plan plan = make_plan(scene, {.h = eta, .partition = Partition::gauss_seidel, .iterations = 3});
  Inputs<const double> in{scene.layout, sample.inputs.data()};
  std::vector<double> q, w, C_r, x_bar;

  Packs() {
    Random random(61);
    q.assign(sample.inputs.begin(), sample.inputs.begin() + scene.dofs());
    for (double& a : q) a += random(-0.005, 0.005);
    for (int n = 0; n < scene.nodes(); ++n) w.push_back(scene.role[n] == Role::free ? random(30.0, 100.0) : 0.0);
    C_r = random.vector(scene.rows, -0.01, 0.01);
    x_bar = random.vector(scene.dofs());
  }

  struct Forward {
    std::vector<double> q, lambda;
    PackState<double> state;
  };
  // `section`: sweeps whose record is kept at once; 0 = all.
  Forward forward(const sheetbend_packs::KernelTable& kernels, int threads, int section = 0) const {
    Forward f{q, std::vector<double>(scene.rows), {}};
    f.state.resize(plan.packs, {plan.options.iterations, section > 0 ? section : plan.options.iterations});
    for (int n = 0; n < scene.nodes(); ++n) Vec3<double>(&q[scene.first_dof[n]]).store(f.state.rows.at(n));
    begin_sweeps(scene, plan.packs, in, eta, w.data(), C_r.data(), f.state);
    for (int i = 0; i < plan.options.iterations; ++i) sweep(plan.packs, kernels, threads, 1, i, f.state);
    for (int n = 0; n < scene.nodes(); ++n) Vec3<double>(f.state.rows.at(n)).store(&f.q[scene.first_dof[n]]);
    unpack_multipliers(scene, plan.packs, f.state, f.lambda.data());
    return f;
  }

  // Cotangents of coordinates, inverse masses, references and inputs, one after the other.
  std::vector<double> reverse(const sheetbend_packs::KernelTable& kernels, int threads, int section = 0) const {
    Forward f = forward(kernels, threads, section);
    PackCotangents<double> bar;
    bar.resize(plan.packs);
    std::vector<double> all = x_bar;
    all.resize(scene.dofs() + scene.nodes() + scene.rows + scene.layout.total());
    double *w_bar = &all[scene.dofs()], *C_r_bar = w_bar + scene.nodes();
    const Inputs<double> in_bar{scene.layout, C_r_bar + scene.rows};
    for (int n = 0; n < scene.nodes(); ++n) Vec3<double>(&x_bar[scene.first_dof[n]]).store(bar.rows.at(n));
    begin_sweeps_vjp(scene, plan.packs, threads, in, f.state, in_bar, bar);
    const int last = plan.options.iterations - 1;
    for (int i = last; i >= 0; --i) sweep_vjp(plan.packs, kernels, threads, 1, i, i == last, f.state, bar);
    end_sweeps_vjp(scene, plan.packs, threads, bar, w_bar, C_r_bar);
    for (int n = 0; n < scene.nodes(); ++n) Vec3<double>(bar.rows.at(n)).store(&all[scene.first_dof[n]]);
    finish(scene, plan.packs, in, in_bar, bar);
    return all;
  }

  // The same by the kernels of one constraint.
  struct Singly {
    std::vector<double> q, lambda, reverse;
  };
  Singly singly() const {
    Singly s{q, std::vector<double>(scene.rows), x_bar};
    const SubstepState<double> state{scene, in, eta, s.q.data(), w.data(), C_r.data(), s.lambda.data()};
    std::vector<IterationRecord<double>> records(plan.options.iterations);
    for (auto& record : records) {
      record.resize(scene);
      for (const Color& color : plan.colors) project_color(state, plan.options, color, record);
    }
    s.reverse.resize(scene.dofs() + scene.nodes() + scene.rows + scene.layout.total());
    double *w_bar = &s.reverse[scene.dofs()], *C_r_bar = w_bar + scene.nodes();
    std::vector<double> fixed(scene.stencil_coordinates), lambda(scene.rows);
    const SubstepCotangent<double> bar{
        s.reverse.data(), fixed.data(), lambda.data(), w_bar, C_r_bar, {scene.layout, C_r_bar + scene.rows}};
    for (int i = plan.options.iterations - 1; i >= 0; --i)
      for (auto color = plan.colors.rbegin(); color != plan.colors.rend(); ++color)
        project_color_vjp(state, plan.options, *color, records[i], bar);
    for (const Group& group : scene.groups)
      for (std::size_t c = 0; c < group.stencil.size() * 3; ++c)
        s.reverse[scene.first_dof[group.stencil[c / 3]] + c % 3] += fixed[group.first_coordinate + c];
    return s;
  }
};
constexpr const char* scene_names[] = {"Ropes", "Net", "Turn"};
INSTANTIATE_TEST_SUITE_P(, Packs, ::testing::Values(Scenes::ropes, Scenes::net, Scenes::turn),
                         [](const auto& info) { return scene_names[static_cast<int>(info.param)]; });

TEST_P(Packs, ForwardHasTheBitsOfOneAtATime) {
  const Singly expected = singly();
  for (const auto* kernels : available_kernels())
    for (const int threads : {1, 3}) {
      const Forward found = forward(*kernels, threads);
      EXPECT_TRUE(same_bits(found.q, expected.q)) << kernels->name << ", threads " << threads;
      EXPECT_TRUE(same_bits(found.lambda, expected.lambda)) << kernels->name << ", threads " << threads;
    }
}

TEST_P(Packs, ReverseAgreesWithOneAtATime) {
  EXPECT_LE(relative_error(reverse(pack_kernels(), 1), singly().reverse), 1e-14);
}

TEST_P(Packs, ReverseHasTheSameBitsOnEveryInstructionSet) {
  const auto expected = reverse(pack_kernels(), 1);
  for (const auto* kernels : available_kernels())
    for (const int threads : {1, 3})
      EXPECT_TRUE(same_bits(reverse(*kernels, threads), expected)) << kernels->name << ", threads " << threads;
}

TEST_P(Packs, SweptAgainInSectionsHasTheSameBits) {
  const auto expected = reverse(pack_kernels(), 1);
  for (const int section : {1, 2})
    for (const int threads : {1, 3})
      EXPECT_TRUE(same_bits(reverse(pack_kernels(), threads, section), expected)) << section << ", threads " << threads;
}

TEST_P(Packs, SectionsKeepToTheirSize) {
  const auto length = [&](int sweeps, std::size_t whole, std::size_t section) {
    return sections_of<double>(plan.packs, sweeps, whole, section).length;
  };
  std::size_t sweep = 0;
  for (const PackedColor& color : plan.packs.colors) sweep += sizeof(Pack) * color.record_packs<double>();
  EXPECT_EQ(length(0, 0, 0), 0);
  EXPECT_EQ(length(10, 10 * sweep, sweep), 10);
  EXPECT_EQ(length(10, 10 * sweep - 1, 3 * sweep), 3);
  EXPECT_EQ(length(10, sweep, sweep - 1), 1);
  const Sections sections{10, 3};
  EXPECT_EQ(sections.count(), 4);
  std::vector<int> of, begin;
  for (int i = 0; i < 10; ++i) of.push_back(sections.of(i));
  for (int i = 0; i < 4; ++i) begin.push_back(sections.begin(i));
  EXPECT_EQ(of, (std::vector<int>{3, 2, 2, 2, 1, 1, 1, 0, 0, 0}));
  EXPECT_EQ(begin, (std::vector<int>{7, 4, 1, 0}));
}

TEST_P(Packs, RepeatedLanesCountOnce) {
  for (const PackedColor& color : plan.packs.colors) {
    EXPECT_EQ(static_cast<int>(color.items.size()), color.packs<double>() * sheetbend_packs::lanes);
    EXPECT_EQ(color.count, color.packs<Pack>());
    for (std::size_t lane = color.count; lane < color.items.size(); ++lane)
      EXPECT_EQ(color.items[lane], color.items[color.count - 1]);
  }
}

}  // namespace
}  // namespace sheetbend::testing
