// Scenes in which particles touch shapes.
#pragma once

#include "core/rollout/rollout.h"
#include "core/scalar/across.h"
#include "tests/cpp/support/distance_grids.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {

// Builds a scene whose particles all may touch all colliders; nodes that carry friction follow the particles.
struct ContactBuilder {
  SceneSpec spec;
  std::vector<double> x, velocity, mass, compliance, rest, friction, radius, stiffness, restitution, pose, size,
      weights, dissipation;

  int particle(const Vec3<double>& at, double m, const Vec3<double>& v = {0.0, 0.0, 0.0}) {
    x.insert(x.end(), {at.x, at.y, at.z});
    velocity.insert(velocity.end(), {v.x, v.y, v.z});
    mass.push_back(m);
    return static_cast<int>(mass.size()) - 1;
  }
  void collider(const std::string& shape, const std::vector<double>& sizes, const std::vector<double>& poses,
                const std::vector<double>& times = {0.0}) {
    spec.colliders.push_back({shape, shape, {times, Interpolation::cubic}});
    size.insert(size.end(), sizes.begin(), sizes.end());
    pose.insert(pose.end(), poses.begin(), poses.end());
  }
  void constraint(const std::string& kind, const std::vector<int>& nodes, double c, const std::vector<double>& p) {
    for (GroupSpec& g : spec.groups)
      if (g.kind == kind) {
        g.stencil.insert(g.stencil.end(), nodes.begin(), nodes.end());
        compliances[kind].push_back(c);
        rests[kind].insert(rests[kind].end(), p.begin(), p.end());
        return;
      }
    spec.groups.push_back({kind, kind, false, {}});
    constraint(kind, nodes, c, p);
  }
  // Last: of what was added before. Nothing bounces where e is negative, nor dissipates where a is.
  void contact(double mu, double r, double k = 0.0, double e = -1.0, double a = -1.0) {
    if (moving < 0) moving = static_cast<int>(mass.size());
    for (int c = 0; c < static_cast<int>(spec.colliders.size()); ++c) {
      ContactSpec contact{"contact", c, {}, {}, k == 0.0, e >= 0.0, 1, a >= 0.0};
      for (int n = 0; n < moving; ++n) {
        if (std::ranges::any_of(spec.directors, [&](const Director& d) { return d.node == n; })) continue;
        contact.nodes.push_back(n);
        contact.carried.push_back(particle({0.0, 0.0, 0.0}, 1.0));
        spec.pinned.push_back(contact.carried.back());
      }
      spec.contacts.push_back(contact);
      friction.push_back(mu);
      radius.push_back(r);
      if (k > 0.0) stiffness.push_back(k);
      if (e >= 0.0) restitution.push_back(e);
      if (a >= 0.0) dissipation.push_back(a);
    }
  }
  // A body of a mass and moments of inertia about its center; the number of its center, three axes after it.
  int body(double m, const Vec3<double>& I, const Vec3<double>& at, const Vec3<double>& turn, const Vec3<double>& v,
           const Vec3<double>& omega) {
    double R[9];
    turn_by(turn, R);
    const int center = particle(at, m, v);
    for (int k = 0; k < 3; ++k) {
      const Vec3<double> axis(R[k], R[3 + k], R[6 + k]);
      const double moments[3] = {I.x, I.y, I.z};
      particle(axis, 0.5 * (I.x + I.y + I.z) - moments[k], cross(omega, axis));
    }
    spec.bodies.push_back({center, {center + 1, center + 2, center + 3}});
    constraint("rigid", {center + 1, center + 2, center + 3}, 0.0, {});
    return center;
  }
  // A rod through these points; its first particle, directors after the last. Links that stretch where EA is positive.
  int rod(const std::vector<Vec3<double>>& at, double density, double EA, double EI, double GJ,
          const Vec3<double>& across, const Vec3<double>& v = {0.0, 0.0, 0.0}) {
    const int links = static_cast<int>(at.size()) - 1, first = static_cast<int>(mass.size());
    const double l = norm(at[1] - at[0]);
    for (int k = 0; k <= links; ++k) particle(at[k], density * l * (k == 0 || k == links ? 0.5 : 1.0), v);
    const int director = first + links + 1;
    for (int k = 0; k < links; ++k) {
      spec.directors.push_back(
          {particle(Across<double>(at[k + 1] - at[k], across).m1, 1e-4 * GJ / (links * l)), first + k, first + k + 1});
      constraint("distance", {first + k, first + k + 1}, EA > 0.0 ? l / EA : 0.0, {l});
    }
    for (int k = 0; k + 1 < links; ++k) {
      const std::vector<int> joint{first + k, first + k + 1, first + k + 2, director + k, director + k + 1};
      constraint("material_curvature", joint, l / EI, {1.0, 0.0, 0.0});
      constraint("twist", joint, l / GJ, {0.0});
    }
    return first;
  }
  // Points of a body, and every collider, in the place of contact().
  void contact_of(int center, const std::vector<Vec3<double>>& points, double mu, double r, double e = -1.0) {
    for (int c = 0; c < static_cast<int>(spec.colliders.size()); ++c) {
      ContactSpec contact{"contact", c, {}, {}, true, e >= 0.0, 4};
      for (const Vec3<double>& p : points) {
        for (int k = 0; k < 4; ++k) contact.nodes.push_back(center + k);
        weights.insert(weights.end(), {1.0, p.x, p.y, p.z});
        contact.carried.push_back(particle({0.0, 0.0, 0.0}, 1.0));
        spec.pinned.push_back(contact.carried.back());
      }
      spec.contacts.push_back(contact);
      friction.push_back(mu);
      radius.push_back(r);
      if (e >= 0.0) restitution.push_back(e);
    }
  }
  // Particles with these radii that hit each other; after all contacts.
  void balls(const std::vector<int>& nodes, const std::vector<double>& radii, double e) {
    spec.balls = nodes;
    radius.insert(radius.end(), radii.begin(), radii.end());
    restitution.push_back(e);
  }
  testing::Sample build(double gravity) {
    spec.particles = static_cast<int>(mass.size());
    testing::Sample s{build_scene(spec), {}};
    s.inputs.resize(s.scene.layout.total());
    const Inputs<double> in{s.scene.layout, s.inputs.data()};
    const auto put = [&](Quantity q, const std::vector<double>& values) {
      ASSERT_EQ(values.size(), s.scene.layout.count(q)) << quantity_names[static_cast<int>(q)];
      std::copy(values.begin(), values.end(), in.of(q));
    };
    for (const GroupSpec& g : spec.groups) {
      compliance.insert(compliance.end(), compliances[g.kind].begin(), compliances[g.kind].end());
      rest.insert(rest.end(), rests[g.kind].begin(), rests[g.kind].end());
    }
    put(Quantity::position, x), put(Quantity::velocity, velocity), put(Quantity::mass, mass);
    put(Quantity::compliance, compliance), put(Quantity::rest, rest), put(Quantity::gravity, {0.0, 0.0, -gravity});
    put(Quantity::friction, friction), put(Quantity::contact_radius, radius);
    put(Quantity::contact_stiffness, stiffness), put(Quantity::restitution, restitution),
        put(Quantity::collider_pose, pose), put(Quantity::collider_size, size), put(Quantity::contact_weight, weights);
    put(Quantity::contact_dissipation, dissipation);
    return s;
  }

  int moving = -1;
  std::map<std::string, std::vector<double>> compliances, rests;
};

inline SolverOptions contact_options(double h, Integrator integrator = Integrator::bdf1) {
  return {.h = h, .integrator = integrator, .partition = Partition::implicit, .iterations = 100};
}

// The tangents of a program's end along four inputs are those of complex steps.
inline void expect_tangents_agree(const Program& p, const std::vector<double>& inputs,
                                  const std::array<std::size_t, 4>& along, double bound) {
  using D = Dual<double, 4>;
  std::vector<D> moving(inputs.begin(), inputs.end());
  for (int d = 0; d < 4; ++d) moving[along[d]].d[d] = 1.0;
  Rollout<D> rollout(p.scene, p.plan, moving.data());
  for (int n = 0; n < p.steps; ++n) rollout.advance();
  for (int d = 0; d < 4; ++d) {
    std::vector<Complex> probe(inputs.begin(), inputs.end());
    probe[along[d]].im = complex_step;
    const auto all = states(p, probe);
    std::vector<double> found, expected;
    for (int i = 0; i < std::min(p.scene.dofs(), p.counted); ++i) {
      expected.push_back(all[p.steps * p.scene.dofs() + i].im / complex_step);
      found.push_back(rollout.x()[i].d[d]);
    }
    EXPECT_LE(relative_error(found, expected), bound) << d;
  }
}

// A program whose loss counts what moves alone: forces that contacts carry are as stiff as these, and would drown all else.
inline Program moving_program(const Sample& s, const SolverOptions& options, int steps) {
  return {s.scene, make_plan(s.scene, options), steps, 0.0, 3 * s.scene.contacts[0].carried[0]};
}

// How often a point touches in a program, over all its substeps.
inline int times_touching(const Program& p, const std::vector<double>& inputs) {
  Rollout<double> rollout(p.scene, p.plan, inputs.data());
  int touching = 0;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    for (const ContactMode mode : rollout.contact_modes()) touching += mode != ContactMode::apart;
  }
  return touching;
}

// d x_dof/d inputs at the last step of a program.
inline std::vector<double> gradient_of_end(const Program& p, const std::vector<double>& inputs,
                                           const std::vector<double>& seed, int kept = every_state) {
  std::vector<double> end(p.scene.dofs()), bar(inputs.size());
  auto tape = record_rollout<double>(p.scene, p.plan, inputs.data(), p.t0, {p.steps}, end.data(), kept, nullptr);
  reverse_rollout<double>(p.scene, p.plan, inputs.data(), p.t0, tape, {p.steps}, seed.data(), bar.data(), nullptr);
  return bar;
}

}  // namespace sheetbend::testing
