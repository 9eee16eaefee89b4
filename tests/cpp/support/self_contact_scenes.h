// Scenes in which ropes and cloths touch themselves and each other.
#pragma once

#include "tests/cpp/support/contact_scenes.h"

namespace sheetbend::testing {

// Adds pieces to what a ContactBuilder has; after its contacts with shapes.
struct TouchingBuilder : ContactBuilder {
  // A rope through places, its particles moving with v.
  void rope(const std::vector<Vec3<double>>& at, double m, const Vec3<double>& v, double r, double EA = 200.0,
            double EI = 1e-4) {
    SelfContactSpec::Piece piece;
    const int first = static_cast<int>(mass.size()), count = static_cast<int>(at.size());
    for (const auto& p : at) particle(p, m, v);
    for (int i = first; i + 1 < first + count; ++i) {
      const double link = norm(at[i + 1 - first] - at[i - first]);
      constraint("distance", {i, i + 1}, link / EA, {link});
      if (i + 2 < first + count) constraint("bend", {i, i + 1, i + 2}, link / EI, {});
      piece.edges.push_back({i, i + 1});
    }
    add(piece, r);
  }
  // One edge, whose ends are pinned.
  void held_edge(const Vec3<double>& from, const Vec3<double>& to, double r) {
    const int first = particle(from, 1.0);
    particle(to, 1.0);
    for (const int n : {first, first + 1}) spec.pinned.push_back(n);
    add({{{first, first + 1}}, {}}, r);
  }
  // A sheet of nx by ny squares that are cut in two, at corner(i, j).
  template <class F>
  void sheet(int nx, int ny, F&& corner, double m, const Vec3<double>& v, double r, double k) {
    SelfContactSpec::Piece piece;
    const int first = static_cast<int>(mass.size());
    const auto at = [&](int i, int j) { return first + i * (ny + 1) + j; };
    for (int i = 0; i <= nx; ++i)
      for (int j = 0; j <= ny; ++j) particle(corner(i, j), m, v);
    const auto edge = [&](int a, int b) {
      piece.edges.push_back({a, b});
      const double length = norm(Vec3<double>(&x[3 * a]) - Vec3<double>(&x[3 * b]));
      constraint("distance", {a, b}, 1.0 / k, {length});
    };
    for (int i = 0; i <= nx; ++i)
      for (int j = 0; j <= ny; ++j) {
        if (i < nx) edge(at(i, j), at(i + 1, j));
        if (j < ny) edge(at(i, j), at(i, j + 1));
        if (i == nx || j == ny) continue;
        edge(at(i, j), at(i + 1, j + 1));
        piece.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        piece.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    add(piece, r);
  }
  // Capsules of a body, between points of its frame that count from its center.
  void capsules(int center, const std::vector<std::array<Vec3<double>, 2>>& ends, double r) {
    SelfContactSpec::Piece piece;
    for (const auto& own : ends) {
      const int first = static_cast<int>(spec.self_contact.on_bodies.size());
      for (const Vec3<double>& p : own) {
        spec.self_contact.on_bodies.push_back({center, center + 1, center + 2, center + 3});
        weights.insert(weights.end(), {1.0, p.x, p.y, p.z});
      }
      piece.edges.push_back({-1 - first, -2 - first});  // numbered in build()
    }
    add(piece, r);
  }
  // A body that is pinned.
  int held_body(const Vec3<double>& at, const Vec3<double>& turn) {
    double R[9];
    turn_by(turn, R);
    const int center = particle(at, 1.0);
    for (int k = 0; k < 3; ++k) particle({R[k], R[3 + k], R[6 + k]}, 1.0);
    spec.bodies.push_back({center, {center + 1, center + 2, center + 3}});
    for (int n = center; n < center + 4; ++n) spec.pinned.push_back(n);
    return center;
  }
  testing::Sample build(double gravity) {
    for (auto& piece : spec.self_contact.pieces)
      for (auto& edge : piece.edges)
        for (int& spot : edge)
          if (spot < 0) spot = static_cast<int>(mass.size()) - 1 - spot;
    return ContactBuilder::build(gravity);
  }
  // Last: nodes for as many pairs to carry friction, which is in the place of a contact's.
  void rub(double mu, int pairs) {
    for (int i = 0; i < 2 * pairs; ++i) {
      spec.self_contact.carried.push_back(particle({0.0, 0.0, 0.0}, 1.0));
      spec.pinned.push_back(spec.self_contact.carried.back());
    }
    friction.push_back(mu);
  }

 private:
  void add(const SelfContactSpec::Piece& piece, double r) {
    spec.self_contact.pieces.push_back(piece);
    radius.push_back(r);
  }
};

inline std::vector<Vec3<double>> line(const Vec3<double>& from, const Vec3<double>& step, int count) {
  std::vector<Vec3<double>> at;
  for (int i = 0; i < count; ++i) at.push_back(from + static_cast<double>(i) * step);
  return at;
}

// Where the spots are at the end of a substep of a rollout.
inline std::vector<double> spot_places(const Rollout<double>& rollout, const Scene& scene,
                                       const std::vector<double>& inputs) {
  const SelfContact& s = scene.self_contact;
  const Inputs<const double> in{scene.layout, inputs.data()};
  const Spots<double> spots(s, [&](std::size_t i) { return in.of(Quantity::contact_weight)[i]; });
  std::vector<double> x(3 * s.spots());
  for (int n = 0; n < s.spots(); ++n)
    spots.at(n, [&](int node) { return Vec3<double>(rollout.x() + 3 * node); }).store(&x[3 * n]);
  return x;
}

// Pairs that touch there.
inline std::vector<PairKey> touching(const Rollout<double>& rollout, const Scene& scene,
                                     const std::vector<double>& inputs) {
  const SelfContact& s = scene.self_contact;
  const Inputs<const double> in{scene.layout, inputs.data()};
  const std::vector<double> x = spot_places(rollout, scene, inputs);
  std::vector<double> radius(s.spots(), 0.0), reach(s.spots(), 0.0);
  for (int n = 0; n < s.spots(); ++n)
    if (s.radius[n] >= 0) radius[n] = in.of(Quantity::contact_radius)[s.radius[n]];
  return find_pairs(s, {x.data(), 3, radius.data(), reach.data()});
}

struct TouchingCase {
  Sample (*make)(double friction);
  Integrator integrator;
  int steps;
  double friction = 0.0;
};

// Steps of a scene whose pieces touch.
class TouchingTest : public ::testing::TestWithParam<TouchingCase> {
 protected:
  const Sample s = GetParam().make(GetParam().friction);
  // Keys and forces that pairs carry are coordinates too, but are not counted: beside squares of numbers of edges a loss has no digits left for differences.
  const int counted = GetParam().friction > 0.0 ? 3 * s.scene.self_contact.carried[0][0] : s.scene.dofs();
  const Program p{s.scene, make_plan(s.scene, contact_options(1e-3, GetParam().integrator)), GetParam().steps, 0.0,
                  counted};

  // Calls visit(rollout, now) after each substep, with the pairs that touch there. Returns how many begin, how many end, and Newton matrices in all.
  struct Course {
    int began = 0, ended = 0;
    std::size_t matrices = 0;
  };
  template <class F>
  Course run(F&& visit) const {
    Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
    Course course;
    std::vector<PairKey> before;
    for (int n = 0; n < p.steps; ++n) {
      rollout.advance();
      course.matrices += rollout.balance()[0].size();
      const auto now = touching(rollout, s.scene, s.inputs);
      for (const PairKey& key : now) course.began += !std::ranges::binary_search(before, key);
      for (const PairKey& key : before) course.ended += !std::ranges::binary_search(now, key);
      visit(rollout, now);
      before = now;
    }
    return course;
  }
};

}  // namespace sheetbend::testing
