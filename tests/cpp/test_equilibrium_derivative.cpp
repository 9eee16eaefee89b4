// The implicit derivative of an equilibrium: against its own residual, its transpose, and equilibria solved again.
#include <gtest/gtest.h>

#include "adjoint/equilibrium/equilibrium_vjp.h"
#include "core/equilibrium/residual.h"
#include "tests/cpp/support/case.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/ropes.h"

namespace sheetbend::testing {
namespace {

struct AtRest {
  Scene scene;
  std::vector<double> inputs;
  Equilibrium rest;
};

AtRest at_rest(Scene scene, std::vector<double> inputs) {
  Equilibrium rest = EquilibriumSolver(scene).solve(inputs.data(), nullptr, nullptr, {.t0 = 0.007});
  EXPECT_TRUE(rest.converged) << rest.message;
  return {std::move(scene), std::move(inputs), std::move(rest)};
}

// A hanging rope with every kind of constraint and every quantity that acts at rest; its last particle is tied to a driven one, and every edge
// has a director, of which the first is pinned; sets are pinned, since nothing yields at rest. Beside these, every edge has a section with a
// normal and a director; the first ones are pinned. Two particles are centers of bodies, whose axes are pinned but for one each.
AtRest every_kind() {
  const int n = 10;
  SceneSpec spec;
  const int directors = n + 2, sets = directors + n, normals = sets + n, leaning = normals + n;
  const int axes = leaning + n, centers[2] = {3, 7};
  spec.particles = axes + 6;
  for (int b = 0; b < 2; ++b) spec.bodies.push_back({centers[b], {axes + 3 * b, axes + 3 * b + 1, axes + 3 * b + 2}});
  spec.pinned = {0, directors, normals, leaning};
  for (int k = 0; k < n; ++k) spec.pinned.push_back(sets + k);
  for (const int k : {0, 1, 4, 5}) spec.pinned.push_back(axes + k);
  for (int k = 0; k < n; ++k) {
    spec.directors.push_back({directors + k, k, k + 1});
    spec.directors.push_back({normals + k, k, k + 1, normals + k});
    spec.directors.push_back({leaning + k, k, k + 1, normals + k});
  }
  spec.driven = {n + 1};
  spec.loaded = {4, 7};
  spec.boundary.times = {0.0, 0.011, 0.02, 0.05};
  spec.force.times = {0.0, 0.03};
  for_each_kind([&]<class K>(K) {
    if constexpr (K::unilateral) return;
    GroupSpec group{K::name, K::name, false, {}};
    if constexpr (K::axes > 0)
      for (int k = 0; k + K::axes <= 6; k += 3) {
        for (int i = 0; i < K::points; ++i) group.stencil.push_back(3 * i < K::axes ? centers[k / 3 + i] : 5);
        for (int i = 0; i < K::axes; ++i) group.stencil.push_back(axes + k + i);
        for (int i = K::points + K::axes; i < K::arity; ++i) group.stencil.push_back(sets);
      }
    else if constexpr (std::same_as<K, Attachment>)
      group.stencil = {n, n + 1};
    else if constexpr (std::same_as<K, BrickNeoHookean>)
      group.stencil = {7, 4, 3, 9, 5, 10, 0, 2};  // in this order the first two columns of F are far from parallel
    else if constexpr (std::same_as<K, Shear>)
      for (int k = 0; k < n; ++k) group.stencil.insert(group.stencil.end(), {k, k + 1, normals + k, leaning + k});
    else if constexpr (K::points == 0)
      for (int k = 0; k + 2 <= n; ++k)
        for (int i = 0; i < K::arity; ++i)
          group.stencil.push_back(i < 2 ? normals + k + i : i < 4 ? leaning + k + i - 2 : sets + k);
    else
      for (int k = 0; k + K::points <= n + 1; ++k)
        for (int i = 0; i < K::arity; ++i) {
          const int past = i - K::points;  // directors, then a set
          const int of_set = i - (K::arity - set_nodes<K>);
          const bool is_set = Yields<K> && of_set >= 0;
          group.stencil.push_back(past < 0 ? k + i : is_set ? sets + k + of_set : directors + k + past);
        }
    spec.groups.push_back(group);
  });
  AtRest s{build_scene(spec), {}, {}};
  s.inputs.assign(s.scene.layout.total(), 0.0);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  Random random(15);
  const auto fill = [&](Quantity q, double low, double high) {
    for (std::size_t i = 0; i < s.scene.layout.count(q); ++i) in.of(q)[i] = random(low, high);
  };
  fill(Quantity::mass, 0.01, 0.03);
  fill(Quantity::force, -0.1, 0.1);
  fill(Quantity::gravity, -1.0, 1.0);
  in.of(Quantity::gravity)[2] = -g;
  for (int k = 0; k < n + 2; ++k) {
    const double t = std::min(k, n) / static_cast<double>(n);
    Vec3<double>(0.6 * t, random(-0.01, 0.01), -1.5 * t * (1.0 - t)).store(in.of(Quantity::position) + 3 * k);
  }
  const auto place = [&](int node) { return in.of(Quantity::position) + 3 * node; };
  for (int k = 0; k < n; ++k) {
    Vec3<double>(random(-0.1, 0.1), 0.8, random(-0.1, 0.1)).store(place(directors + k));
    Vec3<double>(random(-0.1, 0.1), random(-0.1, 0.1), 0.0).store(place(sets + k));
    (Vec3<double>(place(k + 1)) - Vec3<double>(place(k))).store(place(normals + k));
    Vec3<double>(random(-0.1, 0.1), 0.8, random(-0.1, 0.1)).store(place(leaning + k));
  }
  for (int k = 0; k < 6; ++k) place(axes + k)[k % 3] = 1.0;
  for (std::size_t knot = 0; knot < 4; ++knot)
    Vec3<double>(0.6 + random(-0.01, 0.01), random(-0.01, 0.01), random(-0.01, 0.01))
        .store(in.of(Quantity::boundary) + 3 * knot);
  AnyConstraint<double> at;
  for (const Group& group : s.scene.groups)
    for (int i = 0; i < group.count; ++i) {
      double* p = in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(i) * group.parameters;
      const std::vector<double> sample = case_of(group.kind).p;
      for (std::size_t k = 0; k < sample.size(); ++k) p[k] = random(0.95, 1.05) * sample[k];
      gather(s.scene, group, i, in.of(Quantity::position), at.x);
      at.evaluate(group.kind, p);
      double force = 0.0;
      for (int j = 0; j < at.kind->rows; ++j)
        for (int d = 0; d < at.kind->dofs; ++d)
          force = std::max(force, std::abs(at.C[j] * at.J[j * at.kind->dofs + d]));
      // links hold the rope; the rest pulls less than its weight, rubber so little that no element comes near to where its rows have no gradient, and the
      // membrane with a set so little that the triangles of the folded rope have a rest that Newton's steps find
      double softer = 1.0;
      if (kind_name(group.kind) == TetrahedronNeoHookean::name) softer = 30.0;
      if (kind_name(group.kind) == YieldingStrain::name) softer = 100.0;
      bool on_bodies = false;
      with_kind(group.kind, [&]<class K>(K) { on_bodies = K::axes > 0; });
      in.of(Quantity::compliance)[group.first + i] =
          softer * random(1.0, 2.0) * (group.arity == 2 ? 1e-3 : std::max(force / 0.02, on_bodies ? 0.1 : 1e2));
    }
  return at_rest(std::move(s.scene), std::move(s.inputs));
}

AtRest rigid_catenary() {
  Rope rope = make_catenary(10, 0.6, 0.2);
  Random random(3);
  for (std::size_t i = 0; i < rope.scene.layout.count(Quantity::force); ++i)
    rope.of(Quantity::force)[i] = random(-0.1, 0.1);
  return at_rest(std::move(rope.scene), std::move(rope.inputs));
}

AtRest soft_wire() {
  Rope wire = make_wire(6e-5, 1e4);
  return at_rest(std::move(wire.scene), std::move(wire.inputs));
}

// A net of 5 x 5 knots whose rim is held (one of it driven), under pressure.
AtRest bulging_net() {
  const int n = 5;
  const auto knot = [](int i, int j) { return n * j + i; };
  SceneSpec spec;
  spec.particles = n * n;
  spec.driven = {knot(2, 0)};
  spec.boundary.times = {0.0, 0.02};
  spec.wind.times = {0.0};
  GroupSpec links{"links", "distance", false, {}};
  const auto rim = [](int i, int j) { return i == 0 || j == 0 || i == n - 1 || j == n - 1; };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      if (rim(i, j) && knot(i, j) != spec.driven[0]) spec.pinned.push_back(knot(i, j));
      for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {1, 1}})
        if (i + di < n && j + dj < n && !(rim(i, j) && rim(i + di, j + dj)))
          links.stencil.insert(links.stencil.end(), {knot(i, j), knot(i + di, j + dj)});
      if (i + 1 == n || j + 1 == n) continue;
      spec.air.push_back({knot(i, j), knot(i + 1, j), knot(i + 1, j + 1)});
      spec.air.push_back({knot(i, j), knot(i + 1, j + 1), knot(i, j + 1)});
    }
  spec.groups.push_back(links);
  AtRest s{build_scene(spec), {}, {}};
  s.inputs.assign(s.scene.layout.total(), 0.0);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  Random random(12);
  for (int k = 0; k < n * n; ++k)
    Vec3<double>(0.1 * (k % n), 0.1 * (k / n), random(-0.005, 0.005)).store(in.of(Quantity::position) + 3 * k);
  for (const int at : {0, 3})
    std::copy_n(in.of(Quantity::position) + 3 * knot(2, 0), 3, in.of(Quantity::boundary) + at);
  std::fill_n(in.of(Quantity::mass), n * n, 0.01);
  in.of(Quantity::gravity)[2] = -g;
  std::fill_n(in.of(Quantity::pressure), spec.air.size(), 40.0);
  for (int i = 0; i < s.scene.groups[0].count; ++i) {
    const auto nodes = s.scene.groups[0].nodes(i);
    const double* x = in.of(Quantity::position);
    in.of(Quantity::rest)[i] = 0.98 * norm(Vec3<double>(x + 3 * nodes[1]) - Vec3<double>(x + 3 * nodes[0]));
    in.of(Quantity::compliance)[i] = random(1e-3, 2e-3);
  }
  return at_rest(std::move(s.scene), std::move(s.inputs));
}

// A body of springs with a wall between its two halves, of which each keeps a volume of its own: two pyramids on a ring of six around a
// particle; three of the ring are held, one of them by its motion.
AtRest two_chambers() {
  const int n = 6, center = n, top = n + 1, bottom = n + 2;
  SceneSpec spec;
  spec.particles = n + 3;
  spec.pinned = {0, 2};
  spec.driven = {4};
  spec.boundary.times = {0.0, 0.02};
  spec.volumes = {{"upper", {}}, {"lower", {}}};
  GroupSpec links{"links", "distance", false, {}};
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    for (const std::array<int, 3>& t : {std::array{top, k, next}, {center, next, k}})
      spec.volumes[0].triangles.push_back(t);
    for (const std::array<int, 3>& t : {std::array{bottom, next, k}, {center, k, next}})
      spec.volumes[1].triangles.push_back(t);
    for (const int other : {next, center, top, bottom}) links.stencil.insert(links.stencil.end(), {k, other});
  }
  spec.groups.push_back(links);
  AtRest s{build_scene(spec), {}, {}};
  s.inputs.assign(s.scene.layout.total(), 0.0);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  Random random(21);
  const auto place = [&](int node, double x, double y, double z) {
    Vec3<double>(x + random(-0.005, 0.005), y, z).store(in.of(Quantity::position) + 3 * node);
  };
  for (int k = 0; k < n; ++k) place(k, 0.1 * std::cos(k * M_PI / 3.0), 0.1 * std::sin(k * M_PI / 3.0), 0.0);
  place(center, 0.0, 0.0, 0.0);
  place(top, 0.0, 0.0, 0.1);
  place(bottom, 0.0, 0.0, -0.1);
  for (const int at : {0, 3}) std::copy_n(in.of(Quantity::position) + 3 * 4, 3, in.of(Quantity::boundary) + at);
  std::fill_n(in.of(Quantity::mass), spec.particles, 0.01);
  in.of(Quantity::gravity)[2] = -g;
  for (int i = 0; i < s.scene.groups[0].count; ++i) {
    const auto nodes = s.scene.groups[0].nodes(i);
    const double* x = in.of(Quantity::position);
    in.of(Quantity::rest)[i] = norm(Vec3<double>(x + 3 * nodes[1]) - Vec3<double>(x + 3 * nodes[0]));
    in.of(Quantity::compliance)[i] = random(1e-2, 2e-2);
  }
  std::copy_n(std::array{1.4e-3, 1.1e-3}.data(), 2, in.of(Quantity::volume));
  in.of(Quantity::volume_compliance)[1] = 1e-7;  // the other is incompressible
  return at_rest(std::move(s.scene), std::move(s.inputs));
}

struct Derivative : ::testing::TestWithParam<AtRest (*)()> {};
INSTANTIATE_TEST_SUITE_P(, Derivative,
                         ::testing::Values(&every_kind, &rigid_catenary, &soft_wire, &bulging_net, &two_chambers));

// The residual, in complex arithmetic, stays zero along the tangents.
TEST_P(Derivative, TangentsKeepTheResidualZero) {
  const AtRest s = GetParam()();
  Random random(7);
  std::vector<Dual<double, 8>> p(s.inputs.begin(), s.inputs.end()), x(s.scene.dofs()), lambda(s.scene.multipliers());
  for (std::size_t i = 0; i < p.size(); ++i)
    for (double& d : p[i].d) d = random(-1.0, 1.0) * s.inputs[i];
  const EquilibriumDerivative derivative(s.scene, s.inputs.data(), s.rest);
  derivative.jvp(p.data(), x.data(), lambda.data());
  const auto along = [](const Dual<double, 8>& a, double step) { return Complex(a.v, step * a.d[5]); };
  std::vector<Complex> pc(p.size()), xc(x.size()), lc(lambda.size()), r_x(x.size()), r_l(lambda.size());
  const auto residual = [&](bool with_state) {
    for (std::size_t i = 0; i < p.size(); ++i) pc[i] = along(p[i], complex_step);
    for (std::size_t i = 0; i < x.size(); ++i) xc[i] = along(x[i], with_state ? complex_step : 0.0);
    for (std::size_t i = 0; i < lambda.size(); ++i) lc[i] = along(lambda[i], with_state ? complex_step : 0.0);
    const Inputs<const Complex> in{s.scene.layout, pc.data()};
    place_fixed(s.scene, in, s.rest.t0, xc.data());
    equilibrium_residual(s.scene, in, s.rest.t0, xc.data(), lc.data(), r_x.data(), r_l.data());
    std::pair<double, double> worst;
    for (const Complex& r : r_x) worst.first = std::max(worst.first, std::abs(r.im) / complex_step);
    for (const Complex& r : r_l) worst.second = std::max(worst.second, std::abs(r.im) / complex_step);
    return worst;
  };
  const auto fixed = residual(false), moving = residual(true);
  EXPECT_LE(moving.first, 1e-9 * fixed.first);
  EXPECT_LE(moving.second, 1e-9 * fixed.second);
  record_error("r_x", moving.first / fixed.first);
  record_error("r_l", moving.second / fixed.second);

  std::vector<Complex> x_complex(x.size());
  for (std::size_t i = 0; i < p.size(); ++i) pc[i] = along(p[i], complex_step);
  derivative.jvp(pc.data(), x_complex.data(), static_cast<Complex*>(nullptr));
  std::vector<double> a, b;
  for (std::size_t i = 0; i < x.size(); ++i) a.push_back(x_complex[i].im / complex_step), b.push_back(x[i].d[5]);
  EXPECT_LE(relative_error(a, b), 1e-9);
}

// <x_bar, x_dot> + <lambda_bar, lambda_dot> = <inputs_bar, inputs_dot>, quantity by quantity.
TEST_P(Derivative, CotangentsAreTheTransposeOfTangents) {
  const AtRest s = GetParam()();
  Random random(8);
  const EquilibriumDerivative derivative(s.scene, s.inputs.data(), s.rest);
  std::vector<double> x_bar = random.vector(s.scene.dofs()), lambda_bar = random.vector(s.scene.multipliers()),
                      inputs_bar(s.inputs.size());
  for (double& bar : lambda_bar) bar /= largest(s.rest.lambda);
  derivative.vjp(x_bar.data(), lambda_bar.data(), inputs_bar.data());
  for (int q = 0; q < quantity_count; ++q) {
    std::vector<Dual<double, 1>> p(s.inputs.begin(), s.inputs.end()), x(s.scene.dofs()), lambda(s.scene.multipliers());
    double by_inputs = 0.0, by_state = 0.0, scale = 0.0;
    for (std::size_t i = s.scene.layout.offset[q]; i < s.scene.layout.offset[q + 1]; ++i) {
      p[i].d[0] = random(-1.0, 1.0) * s.inputs[i];
      by_inputs += p[i].d[0] * inputs_bar[i];
      scale += std::abs(p[i].d[0] * inputs_bar[i]);
    }
    derivative.jvp(p.data(), x.data(), lambda.data());
    for (int i = 0; i < s.scene.dofs(); ++i) by_state += x_bar[i] * x[i].d[0], scale += std::abs(x_bar[i] * x[i].d[0]);
    for (int i = 0; i < s.scene.multipliers(); ++i)
      by_state += lambda_bar[i] * lambda[i].d[0], scale += std::abs(lambda_bar[i] * lambda[i].d[0]);
    EXPECT_NEAR(by_inputs, by_state, 1e-10 * scale) << quantity_names[q];
    record_error(quantity_names[q], scale > 0.0 ? std::abs(by_inputs - by_state) / scale : 0.0);
  }
}

// Against equilibria solved again at inputs moved to both sides: central differences, Richardson-extrapolated from two steps.
TEST_P(Derivative, MatchesEquilibriaSolvedAgain) {
  const AtRest s = GetParam()();
  EquilibriumSolver solver(s.scene);
  const EquilibriumDerivative derivative(s.scene, s.inputs.data(), s.rest);
  for (const Quantity q : {Quantity::position, Quantity::mass, Quantity::compliance, Quantity::rest, Quantity::boundary,
                           Quantity::force, Quantity::gravity, Quantity::volume, Quantity::volume_compliance}) {
    Random random(9);
    std::vector<Dual<double, 1>> p(s.inputs.begin(), s.inputs.end()), x(s.scene.dofs()), lambda(s.scene.multipliers());
    for (std::size_t i = 0; i < s.scene.layout.count(q); ++i) {
      const std::size_t at = s.scene.layout.of(q) + i;
      p[at].d[0] = random(-1.0, 1.0) * (q == Quantity::position ? 0.1 : s.inputs[at]);
    }
    derivative.jvp(p.data(), x.data(), lambda.data());
    const auto moved = [&](double step) {
      std::vector<double> in(s.inputs);
      for (std::size_t i = 0; i < in.size(); ++i) in[i] += step * p[i].d[0];
      const Equilibrium e =
          solver.solve(in.data(), s.rest.x.data(), s.rest.lambda.data(), {.tolerance = 1e-14, .t0 = s.rest.t0});
      EXPECT_TRUE(e.converged) << e.message;
      return e;
    };
    const double step = 5e-4;
    const Equilibrium a = moved(step), b = moved(-step), c = moved(0.5 * step), d = moved(-0.5 * step);
    const auto difference = [&](const std::vector<double>& a, const std::vector<double>& b,
                                const std::vector<double>& c, const std::vector<double>& d, std::size_t i) {
      return (4.0 * (c[i] - d[i]) / step - (a[i] - b[i]) / (2.0 * step)) / 3.0;
    };
    std::vector<double> x_dot, x_fd, l_dot, l_fd;
    for (std::size_t i = 0; i < x.size(); ++i)
      x_dot.push_back(x[i].d[0]), x_fd.push_back(difference(a.x, b.x, c.x, d.x, i));
    for (std::size_t i = 0; i < lambda.size(); ++i)
      l_dot.push_back(lambda[i].d[0]), l_fd.push_back(difference(a.lambda, b.lambda, c.lambda, d.lambda, i));
    // A quantity that does not act (no force on the wire, a compliance of zero) leaves nothing but the solver's own rounding.
    const auto expect_equal = [&](const std::vector<double>& found, const std::vector<double>& expected) {
      if (largest(expected) == 0.0)
        EXPECT_LE(largest(found), 1e-10) << quantity_names[static_cast<int>(q)];
      else
        EXPECT_LE(relative_error(found, expected), 1e-7) << quantity_names[static_cast<int>(q)];
    };
    expect_equal(x_fd, x_dot);
    expect_equal(l_fd, l_dot);
    record_error(std::string(quantity_names[static_cast<int>(q)]) + "_x", relative_error(x_fd, x_dot));
  }
}

}  // namespace
}  // namespace sheetbend::testing
