// Contacts between sweeps eight at a time: the bits of contacts one by one, the gradient of complex steps, and the law's reverse by itself.
#include "adjoint/contact/push_out_vjp.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

struct Rain {
  int particles;
  Integrator integrator = Integrator::bdf1;
  double stiffness = 0.0, dissipation = -1.0;
};

// Particles that fall on moving shapes, of which a last pack is not full: each shape meets some of them at a time.
Sample falling(const Rain& r) {
  ContactBuilder b;
  const double link = 0.03;
  for (int i = 0; i < r.particles; ++i)
    b.particle({link * i, 0.003 * (i % 5), 0.02 + 0.004 * (7 * i % 11)}, 0.002 + 0.0003 * (i % 3),
               {0.6 - 0.1 * (i % 7), 0.2 * (i % 3), -1.0 - 0.1 * (i % 4)});
  for (int i = 0; i + 1 < r.particles; ++i) b.constraint("distance", {i, i + 1}, link / 50.0, {link});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.02, -0.05, 0.3, 0.0, 0.0, 0.003, 0.05, -0.02, 0.3}, {0.0, 0.06});
  b.collider("sphere", {0.05}, {0.05, 0.02, -0.035, 0.1, 0.2, 0.0, 0.06, 0.02, -0.03, 0.4, 1.2, -0.5}, {0.0, 0.06});
  b.collider("capsule", {0.03, 0.1}, {0.15, 0.0, -0.015, 1.5, 0.0, 0.0, 0.14, 0.01, -0.02, 1.2, 0.5, 0.0}, {0.0, 0.06});
  b.collider("rounded_box", {0.04, 0.05, 0.02, 0.01}, {0.24, 0.01, -0.008, 0.0, 0.0, 0.5});
  b.collider("rounded_cylinder", {0.04, 0.03, 0.01}, {0.33, 0.0, -0.018, 0.3, 0.1, 0.0});
  b.contact(0.3, 0.003, r.stiffness, -1.0, r.dissipation);
  return b.build(9.81);
}

Program program(const Sample& s, const Rain& r, int sweeps = 4) {
  SolverOptions o = contact_options(1e-3, r.integrator);
  o.partition = Partition::gauss_seidel;
  o.iterations = sweeps;
  return moving_program(s, o, 40);
}

// The same with nothing in packs.
Program one_by_one(Program p) {
  for (SweptGroup& group : p.plan.contact_groups) group.nodes.clear(), group.carries.clear();
  return p;
}

struct ContactPacks : ::testing::TestWithParam<Rain> {
  Sample sample = falling(GetParam());
  Program packed = program(sample, GetParam()), alone = one_by_one(packed);
};

TEST_P(ContactPacks, HaveTheBitsOfContactsOneByOne) {
  for (const SweptGroup& group : packed.plan.contact_groups) ASSERT_TRUE(group.packed());
  EXPECT_GT(times_touching(packed, sample.inputs), 3 * GetParam().particles);
  EXPECT_EQ(times_touching(packed, sample.inputs), times_touching(alone, sample.inputs));
  EXPECT_TRUE(same_bits(states(packed, sample.inputs), states(alone, sample.inputs)));
  EXPECT_LE(relative_error(gradient(packed, sample.inputs), gradient(alone, sample.inputs)), 1e-11);
}

TEST_P(ContactPacks, HaveTheGradientOfComplexSteps) {
  const auto of = [&](const std::vector<Complex>& probe) { return loss(packed, probe); };
  expect_sums_agree(sample.scene.layout, of, sample.inputs, gradient(packed, sample.inputs), 1e-8);
}

TEST_P(ContactPacks, HaveTheSameBitsInEveryLaneAndWithAnyTape) {
  expect_bits_of_any_tape(packed, sample.inputs);
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  inputs[3][sample.scene.layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[3][sample.scene.layout.of(Quantity::velocity) + 2] = -0.7;
  expect_bits_of_lanes(packed, inputs, {3, 5}, every_state);
}

INSTANTIATE_TEST_SUITE_P(, ContactPacks,
                         ::testing::Values(Rain{13}, Rain{13, Integrator::bdf2}, Rain{3, Integrator::bdf2},
                                           Rain{8, Integrator::bdf1, 300.0, 0.7}, Rain{11, Integrator::bdf2, 300.0}));

// Colliders whose particles go in packs beside ones whose particles go one by one: a distance field, and a shape off which particles bounce.
struct Mix {
  const char* name;
  bool field, bounces;
  Integrator integrator = Integrator::bdf1;

  // A contact that lifts a particle is stiffer by `firmness`, and rounding weighs more by that: inputs one unit of their last place apart have
  // gradients up to 4e-9 apart, in packs or not. Without such contacts they are at most 7e-11 apart.
  double near(double elastic, double bouncing) const { return bounces ? bouncing : elastic; }
};
void PrintTo(const Mix& m, std::ostream* out) { *out << m.name; }

// A chain that falls, a particle that runs into the corner between the plane and a ball, one by itself above the box, and two that run into the corner
// between the plane and the box.
Sample mixed(const Mix& m) {
  ContactBuilder b;
  const double link = 0.03;
  const int chain = 13;
  for (int i = 0; i < chain; ++i)
    b.particle({link * i, 0.003 * (i % 5), 0.02 + 0.004 * (7 * i % 11)}, 0.002 + 0.0003 * (i % 3),
               {0.6 - 0.1 * (i % 7), 0.2 * (i % 3), -1.0 - 0.1 * (i % 4)});
  for (int i = 0; i + 1 < chain; ++i) b.constraint("distance", {i, i + 1}, link / 50.0, {link});
  b.particle({0.01, 0.04, 0.006}, 0.003, {0.9, -0.5, -0.9});
  b.particle({0.235, 0.01, 0.03}, 0.002, {0.1, 0.2, -1.5});
  b.particle({0.24, 0.075, 0.009}, 0.003, {0.0, -1.0, -0.9});
  b.particle({0.26, 0.075, 0.009}, 0.003, {0.0, -1.0, -0.9});
  b.constraint("distance", {chain + 2, chain + 3}, link / 50.0, {0.02});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.02, -0.01, 0.3, 0.0, 0.0, 0.003, 0.03, -0.02, 0.3}, {0.0, 0.06});
  b.collider(m.field ? "distance_field" : "sphere", m.field ? std::vector<double>{} : std::vector<double>{0.022},
             {0.045, 0.02, 0.008, 0.1, 0.2, 0.0, 0.04, 0.02, 0.009, 0.4, -0.4, -0.5}, {0.0, 0.06});
  if (m.field) b.spec.colliders.back().grid = ball_on_grid(0.022, 0.0044);
  b.collider("capsule", {0.03, 0.1}, {0.15, 0.0, -0.015, 1.5, 0.0, 0.0, 0.14, 0.01, -0.02, 1.2, 0.5, 0.0}, {0.0, 0.06});
  b.collider("rounded_box", {0.04, 0.05, 0.02, 0.002}, {0.24, 0.01, -0.008, 0.0, 0.0, 0.1});
  b.contact(0.3, 0.003);
  if (m.bounces) b.spec.contacts[3].bounces = true, b.restitution.push_back(0.3);
  return b.build(9.81);
}

// How often contacts touch their points, contact by contact, how often a point is touched by contacts of both ways at a time, and how often one that
// nothing holds bounces.
struct Touches {
  std::vector<int> of_contact;
  int of_both = 0;
  std::size_t impacts = 0;
};
Touches touches(const Program& p, const std::vector<double>& inputs) {
  Touches found{std::vector<int>(p.scene.contacts.size())};
  Rollout<double> rollout(p.scene, p.plan, inputs.data());
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    found.impacts += rollout.impacts().size();
    std::vector<char> in_packs(p.scene.nodes()), alone(p.scene.nodes());
    for (const SweptGroup& group : p.plan.contact_groups)
      for (int i = group.first; i < group.first + group.count; ++i) {
        const SweptContact& c = p.plan.contacts[i];
        if (rollout.contact_modes()[p.scene.contacts[c.contact].first + c.item] == ContactMode::apart) continue;
        ++found.of_contact[c.contact];
        (group.packed() ? in_packs : alone)[c.node] = true;
      }
    for (int node = 0; node < p.scene.nodes(); ++node) found.of_both += in_packs[node] && alone[node];
  }
  return found;
}

struct MixedContacts : ::testing::TestWithParam<Mix> {
  Sample sample = mixed(GetParam());
  Program packed = program(sample, Rain{0, GetParam().integrator}), alone = one_by_one(packed);
};

TEST_P(MixedContacts, HaveTheBitsOfContactsOneByOne) {
  std::vector<bool> in_packs;
  for (const SweptGroup& group : packed.plan.contact_groups) in_packs.push_back(group.packed());
  ASSERT_EQ(in_packs, (std::vector<bool>{true, !GetParam().field, true, !GetParam().bounces}));
  const Touches found = touches(packed, sample.inputs);
  for (const int times : found.of_contact) EXPECT_GT(times, 3);
  EXPECT_GT(found.of_both, 3);
  EXPECT_EQ(found.impacts > 0, GetParam().bounces);
  EXPECT_EQ(found.of_contact, touches(alone, sample.inputs).of_contact);
  EXPECT_TRUE(same_bits(states(packed, sample.inputs), states(alone, sample.inputs)));
  EXPECT_LE(relative_error(gradient(packed, sample.inputs), gradient(alone, sample.inputs)),
            GetParam().near(1e-11, 1e-9));
}

TEST_P(MixedContacts, HaveTheGradientOfComplexSteps) {
  const auto of = [&](const std::vector<Complex>& probe) { return loss(packed, probe); };
  expect_sums_agree(sample.scene.layout, of, sample.inputs, gradient(packed, sample.inputs),
                    GetParam().near(1e-8, 1e-7));
}

TEST_P(MixedContacts, HaveTheSameBitsInEveryLaneAndWithAnyTape) {
  expect_bits_of_any_tape(packed, sample.inputs);
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  inputs[3][sample.scene.layout.of(Quantity::velocity) + 2] = -0.7;
  expect_bits_of_lanes(packed, inputs, {3, 5}, every_state);
}

INSTANTIATE_TEST_SUITE_P(, MixedContacts,
                         ::testing::Values(Mix{"Field", true, false}, Mix{"Bounces", false, true},
                                           Mix{"Both", true, true, Integrator::bdf2}),
                         [](const auto& info) { return std::string(info.param.name); });

// A name that the two lists do not share would leave contacts to other kernels, or to none.
TEST(PackedContacts, HaveKernelsOfEveryInstructionSet) {
  for (const auto* kernels : available_kernels()) EXPECT_STREQ(contact_kernels_of(kernels->name).name, kernels->name);
  EXPECT_STREQ(contact_kernels().name, pack_kernels().name);
  EXPECT_THROW(contact_kernels_of("x86-64"), std::logic_error);
}

// A short pack repeats its last particle.
TEST(PackedContacts, AreFullButTheLast) {
  const Rain rain{13};
  const Sample s = falling(rain);
  const Program p = program(s, rain);
  for (const SweptGroup& group : p.plan.contact_groups) {
    ASSERT_EQ(group.count, 13);
    ASSERT_EQ(group.nodes.size(), 16u);
    for (std::size_t i = 13; i < 16; ++i) EXPECT_EQ(group.nodes[i], group.nodes[12]);
  }
}

// Where a contact puts its particle, as firm as restitution makes it and as friction holds it.
TEST(PushOut, HasTheDerivativesOfComplexSteps) {
  const auto ball = ball_on_grid(0.8, 0.21);
  const Vec3<double> force_bar(0.3, -1.1, 0.7), x_bar(-0.2, 0.5, 0.9);
  for (const char* name : {"plane", "sphere", "distance_field"})
    for (const double firm : {1.0, firmness})
      for (const double friction : {0.0, 0.1, 50.0}) {
        const int number = shape_of(name);
        const AnyShape shape{number, number == shape_of("distance_field") ? ball.get() : nullptr};
        const auto numbers_of = [&]<class T>(const std::vector<T>& a) {
          ContactNumbers<T> c{};
          c.from = Vec3<T>(&a[4]), c.carried = Vec3<T>(&a[7]), c.friction = a[10], c.radius = a[11], c.kappa = a[12];
          c.lift = a[13], c.firm = firm, c.size[0] = a[14];
          return c;
        };
        const auto pose_of = [&]<class T>(const std::vector<T>& a) {
          Pose<T> p;
          p.position = Vec3<T>(&a[15]);
          turn_by(Vec3<T>(T(0.2), T(-0.5), T(0.3)), p.turn);
          return p;
        };
        std::vector<double> at{0.3, -0.2,     0.45, 0.1, 0.298, -0.203, 0.451, 0.7, -0.4,
                               0.5, friction, 0.0,  1e4, 1e-3,  0.8,    0.0,   0.0, 0.0};
        double z[3], n[3], distance;
        pose_of(at).in_frame(Vec3<double>(&at[0])).store(z);
        distance_from(shape, z, &at[14], distance, n);
        at[11] = distance + 0.01;
        bool found;
        const auto out = [&]<class T>(const std::vector<T>& a) {
          return push_out(shape, pose_of(a), Vec3<T>(&a[0]), a[3], numbers_of(a), found);
        };
        const auto plain = out(at);
        ASSERT_TRUE(found && plain.pushes);
        ContactNumbers<double> bar{};
        Pose<double> pose_bar{};
        const Vec3<double> y_bar = x_bar + push_out_vjp(shape, pose_of(at), plain.x, at[3], numbers_of(at),
                                                        force_bar + at[3] * x_bar, bar, pose_bar);
        std::vector<double> reverse{y_bar.x, y_bar.y, y_bar.z, dot(plain.force, y_bar)};
        for (const Vec3<double>& v : {bar.from, bar.carried}) reverse.insert(reverse.end(), {v.x, v.y, v.z});
        reverse.insert(reverse.end(), {bar.friction, bar.radius, bar.kappa, bar.lift, bar.size[0]});
        for (const double a : {pose_bar.position.x, pose_bar.position.y, pose_bar.position.z}) reverse.push_back(a);
        const auto expected = complex_step_gradient(
            [&](const std::vector<Complex>& a) {
              const auto p = out(a);
              return Complex(x_bar.x) * p.x.x + Complex(x_bar.y) * p.x.y + Complex(x_bar.z) * p.x.z +
                     Complex(force_bar.x) * p.force.x + Complex(force_bar.y) * p.force.y +
                     Complex(force_bar.z) * p.force.z;
            },
            at);
        for (std::size_t i = 0; i < at.size(); ++i)
          EXPECT_NEAR(reverse[i], expected[i], 1e-9 * std::max(1.0, std::abs(expected[i])))
              << i << " " << name << " " << firm << " " << friction;
      }
}

// The law by itself, where it sticks, slides, dissipates and is apart.
TEST(LawReverse, HasTheDerivativesOfComplexSteps) {
  const Vec3<double> tangential_bar(-0.2, 0.5, 0.9);
  const double normal_bar = 0.7;
  int slid = 0, stuck = 0, apart = 0;
  for (const double gap : {-0.02, -1e-4, 0.01})
    for (const double friction : {0.0, 0.1, 50.0})
      for (const bool dissipates : {false, true}) {
        const auto law = [&]<class T>(const std::vector<T>& a) {
          return contact_force(a[0], Vec3<T>(&a[1]), Vec3<T>(&a[4]), Vec3<T>(&a[7]), a[10], a[11],
                               dissipates ? &a[12] : nullptr);
        };
        const std::vector<double> at{gap,  2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0, 2e-3,  3e-3, -1e-3,
                                     0.07, -0.04,     0.05,       friction,  120.0, 30.0};
        const auto found = law(at);
        slid += found.slides, stuck += found.pushes && !found.slides, apart += !found.pushes;
        const LawCotangents<double> bar =
            contact_force_vjp(at[0], Vec3<double>(&at[1]), Vec3<double>(&at[4]), Vec3<double>(&at[7]), at[10], at[11],
                              dissipates ? &at[12] : nullptr, normal_bar, tangential_bar);
        const std::vector<double> reverse{bar.gap,      bar.n.x,    bar.n.y,       bar.n.z,       bar.slip.x,
                                          bar.slip.y,   bar.slip.z, bar.carried.x, bar.carried.y, bar.carried.z,
                                          bar.friction, bar.kappa,  bar.loss};
        const auto expected = complex_step_gradient(
            [&](const std::vector<Complex>& a) {
              const auto c = law(a);
              return Complex(normal_bar) * c.normal + Complex(tangential_bar.x) * c.tangential.x +
                     Complex(tangential_bar.y) * c.tangential.y + Complex(tangential_bar.z) * c.tangential.z;
            },
            at);
        EXPECT_LE(relative_error(reverse, expected), 1e-13) << gap << " " << friction << " " << dissipates;
      }
  EXPECT_GT(slid, 2);
  EXPECT_GT(stuck, 2);
  EXPECT_GT(apart, 2);
}

}  // namespace
}  // namespace sheetbend::testing
