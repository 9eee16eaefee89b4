// Loops of bodies: rows of their joints that follow from others are found, and motions and gradients are those without them.
#include <gtest/gtest.h>

#include "adjoint/rollout/rollout.h"
#include "core/rollout/redundant_rows.h"
#include "core/scalar/complex.h"
#include "core/solver/body_loops.h"
#include "tests/cpp/support/joints.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

using Place = Vec3<double>;
using Join = void (*)(BodyScene&, const Body&, const Place&, const Body&, const Place&);

// A leaf with two joints on one side, which turns about the line of both and moves along it: as far as the joints let it.
BodyScene door(Join first, Join second) {
  BodyScene s;
  const Body frame = ground(s, BodyScene::upright());
  const bool turns = first != slider && second != slider, slides = first != hinge && second != hinge;
  const Body leaf = s.add_body({0.4, 0, 0}, 2.0, {0.1, 0.12, 0.05}, BodyScene::upright(), {0, turns ? 1.0 : 0.0, 0},
                               {0, slides ? 0.4 : 0.0, turns ? -0.4 : 0.0});
  first(s, frame, {0, -0.5, 0}, leaf, {-0.4, -0.5, 0});
  second(s, frame, {0, 0.5, 0}, leaf, {-0.4, 0.5, 0});
  if (slides) s.add("along", nodes_of(frame, leaf, true), {0, 0, 0, -0.4, 0, 0, 0, 1, 0, 0.1}, 1e-2);  // a spring
  return s;
}

// A bar in the plane of x and z.
Body bar(BodyScene& s, const Place& from, const Place& to) {
  const Place e = (1.0 / norm(to - from)) * (to - from);
  const double l = norm(to - from);
  return s.add_body(0.5 * (from + to), l, {1e-3 * l, l * l * l / 12, l * l * l / 12},
                    {e, {0, 1, 0}, cross(e, {0, 1, 0})});
}

// From the middle of a bar to its end.
Place half(const Place& a, const Place& b) { return {0.5 * norm(b - a), 0, 0}; }

BodyScene four_bar() {
  BodyScene s;
  const Body frame = ground(s, BodyScene::upright());
  const Place A, B(0.02, 0, 0.1), C(0.25, 0, 0.2), D(0.2, 0, 0);
  const Body crank = bar(s, A, B), coupler = bar(s, B, C), rocker = bar(s, C, D);
  hinge(s, frame, A, crank, -half(A, B));
  hinge(s, crank, half(A, B), coupler, -half(B, C));
  hinge(s, coupler, half(B, C), rocker, -half(C, D));
  hinge(s, frame, D, rocker, half(C, D));
  return s;
}

// A crank and a rod, whose far end moves on a slider along x.
BodyScene crank_slider() {
  BodyScene s;
  const Body frame = ground(s, {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}});  // its second axis is x
  const Body shaft = ground(s, BodyScene::upright());
  const Place A, B(0.06, 0, 0.08), C(0.3, 0, 0);
  const Body crank = bar(s, A, B), rod = bar(s, B, C),
             piston = s.add_body(C, 0.5, {1e-3, 1e-3, 1e-3}, {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}});
  hinge(s, shaft, A, crank, -half(A, B));
  hinge(s, crank, half(A, B), rod, -half(B, C));
  s.add("coincide", nodes_of(rod, piston, true), {half(B, C).x, 0, 0, 0, 0, 0});
  for (const auto& other : {Place(1, 0, 0), Place(0, 1, 0)})  // of the piston, across y
    s.add("across", nodes_of(rod, piston, false), {0, 1, 0, other.x, other.y, 0});
  slider(s, frame, {0, 0.3, 0}, piston, {});
  return s;
}

// Two pairs of plates in planes across each other hold a table level (Sarrus 1853).
BodyScene sarrus() {
  BodyScene s;
  constexpr double w = 0.05;
  const Body table = s.add_body({0, 0, 0.1}, 0.5, {1e-3, 1e-3, 1.5e-3}, BodyScene::upright()),
             turned = ground(s, {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}}), still = ground(s, BodyScene::upright());
  const auto side = [&](const Body& frame, bool across_) {  // hinged about the second axis of a frame
    const auto at = [&](const Place& a) { return across_ ? Place(-a.y, a.x, a.z) : a; };
    const Place low(w, 0, 0), middle(1.8 * w, 0, 0.05), high(w, 0, 0.1);
    const auto plate = [&](const Place& a, const Place& b) {
      const Place e = (1.0 / norm(b - a)) * (b - a), f(0, 1, 0), g = cross(e, f);
      return s.add_body(at(0.5 * (a + b)), 0.1, {1e-4, 2e-4, 2e-4}, {at(e), at(f), at(g)});
    };
    const Body lower = plate(low, middle), upper = plate(middle, high);
    hinge(s, frame, low, lower, -half(low, middle));
    hinge(s, lower, half(low, middle), upper, -half(middle, high));
    s.add("coincide", nodes_of(upper, table, true), [&] {
      const Place h = half(middle, high), t = at({w, 0, 0});
      return std::vector<double>{h.x, h.y, h.z, t.x, t.y, t.z};
    }());
    const Place e = at({1, 0, 0});
    s.add("across", nodes_of(upper, table, false), {0, 1, 0, e.x, e.y, e.z});
    s.add("across", nodes_of(upper, table, false), {0, 1, 0, 0, 0, 1});
  };
  side(still, false);
  side(turned, true);
  return s;
}

// A wheel whose center is pinned, on a hinge beside it: the center holds what the hinge's point holds.
BodyScene held_center() {
  BodyScene s;
  const Body frame = ground(s, BodyScene::upright());
  const Body wheel = s.add_body({}, 0.5, {1e-3, 1e-3, 1.5e-3}, BodyScene::upright(), {0, 2.0, 0});
  s.spec.pinned.push_back(wheel.center);
  hinge(s, frame, {0, 0.1, 0}, wheel, {0, 0.1, 0});
  s.add("across", nodes_of(frame, wheel, false), {1, 0, 0, 0, 0, 1}, 10.0);  // a spring against its turn
  return s;
}

struct Loop {
  const char* name;
  BodyScene scene;
  int redundant;  // rows

  friend std::ostream& operator<<(std::ostream& to, const Loop& loop) { return to << loop.name; }
};

struct TooManyRows : ::testing::TestWithParam<Loop> {
  BodyScene s = GetParam().scene;
  Scene scene = build_scene(s.spec);
  std::vector<double> inputs = s.inputs(scene);
};
INSTANTIATE_TEST_SUITE_P(, TooManyRows,
                         ::testing::Values(Loop{"TwoHinges", door(hinge, hinge), 5},
                                           Loop{"HingeAndCylinder", door(hinge, cylinder), 4},
                                           Loop{"TwoCylinders", door(cylinder, cylinder), 4},
                                           Loop{"TwoSliders", door(slider, slider), 5}, Loop{"FourBar", four_bar(), 3},
                                           Loop{"CrankAndSlider", crank_slider(), 3}, Loop{"Sarrus", sarrus(), 1},
                                           Loop{"HeldCenter", held_center(), 3}),
                         [](const auto& info) { return info.param.name; });

TEST_P(TooManyRows, AreLookedForInALoop) {
  const SolverOptions options{.h = 1.0 / 480, .partition = Partition::direct};
  for (const DirectBlock& block : make_plan(scene, options).blocks) EXPECT_EQ(block.loop_pivot, pivot_of_loop);
}

TEST_P(TooManyRows, AreNamed) {
  const Plan plan = make_plan(scene, {.h = 1.0 / 480, .partition = Partition::direct});
  const auto rows = redundant_rows(scene, plan, inputs.data(), 0.0);
  EXPECT_EQ(static_cast<int>(rows.size()), GetParam().redundant) << describe(scene, rows, inputs.data());
  for (const auto& r : rows) {
    EXPECT_LE(r.contradiction, 1e-12);
    EXPECT_NE(group_of(scene, r.row).name, "rigid");  // a body's own rows stay
  }
}

TEST_P(TooManyRows, MoveAndDifferentiateAsWithoutThem) {
  const Program program{scene, make_plan(scene, {.h = 1.0 / 480, .partition = Partition::direct}), 48};
  const auto all = states(program, inputs);
  const double* x = &all[48 * scene.dofs()];
  double moved = 0.0;
  for (int i = 0; i < scene.dofs(); ++i) moved = std::max(moved, std::abs(x[i] - all[i]));
  EXPECT_GT(moved, 0.03);
  AnyConstraint<double> at;
  for (const Group& group : scene.groups)
    for (int i = 0; i < group.count; ++i) {
      if (inputs[scene.layout.of(Quantity::compliance) + group.first + i] > 0.0) continue;
      for (int k = 0; k < group.arity; ++k) std::copy_n(x + scene.first_dof[group.nodes(i)[k]], 3, at.x + 3 * k);
      at.evaluate(group.kind, &inputs[scene.layout.of(Quantity::rest)] + group.first_value + i * group.parameters);
      for (int j = 0; j < group.rows; ++j) EXPECT_NEAR(at.C[j], 0.0, 1e-12) << group.name << i;
    }
  const auto oracle = complex_step_gradient([&](const std::vector<Complex>& z) { return loss(program, z); }, inputs);
  const auto found = gradient(program, inputs);
  for (const Quantity q : {Quantity::velocity, Quantity::mass, Quantity::rest, Quantity::position}) {
    const std::size_t first = scene.layout.of(q), count = scene.layout.count(q);
    const double error =
        relative_error(std::span(found).subspan(first, count), std::span(oracle).subspan(first, count));
    EXPECT_LE(error, 1e-8) << quantity_names[static_cast<int>(q)];
    record_error(quantity_names[static_cast<int>(q)], error);
  }
}

TEST(OpenChain, OfEveryJointIsNoLoop) {
  BodyScene s;
  Body above = ground(s, BodyScene::upright());
  for (const Join join : {Join(hinge), Join(cylinder), Join(slider)}) {
    const Body below = s.add_body({}, 1.0, {1e-3, 1e-3, 1e-3}, BodyScene::upright());
    join(s, above, {}, below, {});
    above = below;
  }
  s.add("along", nodes_of(s.spec.bodies[2], above, true), {0, 0, 0, 0, 0, 0, 0, 1, 0, 0}, 1e-3);  // a spring
  const Scene scene = build_scene(s.spec);
  for (const Partition p : {Partition::direct, Partition::newton})
    for (const DirectBlock& block : make_plan(scene, {.h = 1e-3, .partition = p}).blocks)
      EXPECT_EQ(block.loop_pivot, 0.0);
}

}  // namespace
}  // namespace sheetbend::testing
