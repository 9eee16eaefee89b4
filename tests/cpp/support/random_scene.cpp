#include "tests/cpp/support/random_scene.h"

#include "tests/cpp/support/cases.h"

namespace sheetbend::testing {
namespace {

struct SceneBuilder {
  Random random;
  SceneSpec spec{};
  std::vector<double> x{};
  struct Values {
    std::string kind;
    bool damped;
    std::vector<int> stencil;
    std::vector<double> p, compliance, damping;
  };
  std::vector<Values> groups{};
  std::vector<int> sets{}, sections{};  // sections: of the current rope, two normals and two directors
  std::vector<Body> bodies{};           // of the current rope
  std::vector<double> volumes{}, volume_compliances{};

  explicit SceneBuilder(unsigned seed) : random(seed) {}

  int add_particle(double px, double py, double pz) {
    x.insert(x.end(), {px, py, pz});
    return static_cast<int>(x.size()) / 3 - 1;
  }

  template <class K>
  Values& group(bool damped) {
    for (Values& g : groups)
      if (g.kind == K::name && g.damped == damped) return g;
    return groups.emplace_back(Values{K::name, damped, {}, {}, {}, {}});
  }

  template <class K>
  void add_constraint(bool damped, const std::vector<int>& nodes, const std::vector<double>& p) {
    const Case sample = case_of<K>();
    Values& g = group<K>(damped);
    g.stencil.insert(g.stencil.end(), nodes.begin(), nodes.end());
    g.p.insert(g.p.end(), p.begin(), p.end());
    g.compliance.push_back(sample.compliance * random(0.5, 1.5));
    g.damping.push_back(sample.damping * random(0.5, 1.5));
  }

  // Hangs a jittered sample stencil on particle `tail`; returns its last particle.
  template <class K>
  int add_stencil(int tail, bool damped) {
    const Case sample = case_of<K>();
    constexpr int points = K::points, directors = K::arity - points - (Yields<K> ? set_nodes<K> : 0);
    std::vector<int> nodes{tail};
    for (int k = 1; k < K::arity; ++k) {
      double at[3];
      for (int d = 0; d < 3; ++d)
        at[d] = (k < points ? x[3 * tail + d] : 0.0) + sample.x[3 * k + d] - sample.x[d] + random(-0.005, 0.005);
      nodes.push_back(add_particle(at[0], at[1], at[2]));
    }
    for (int k = 0; k < directors; ++k)
      if constexpr (std::same_as<K, Shear>)
        spec.directors.push_back({nodes[points + k], nodes[0], nodes[1], nodes[points]});
      else
        spec.directors.push_back({nodes[points + k], nodes[k], nodes[k + 1]});
    add_constraint<K>(damped, nodes, jittered_parameters<K>());
    for (int k = points + directors; k < K::arity; ++k) sets.push_back(nodes[k]);
    return nodes[points - 1];
  }

  template <class K>
  std::vector<double> jittered_parameters() {
    std::vector<double> p = case_of<K>().p;
    for (double& v : p) {
      const double by = random(-0.02, 0.02);
      v +=
          K::unit.meters > 1 ? by * v : by;  // areas and volumes stay positive: at none there is no shape to go back to
    }
    return p;
  }

  // A particle near (3,) `sample`, counted from particle `tail` if there is one.
  int add_near(const double* sample, int tail = -1) {
    double at[3];
    for (int d = 0; d < 3; ++d) at[d] = (tail < 0 ? 0.0 : x[3 * tail + d]) + sample[d] + random(-0.005, 0.005);
    return add_particle(at[0], at[1], at[2]);
  }

  // Two edges on particle `tail` with sections that shear; returns the last particle.
  int add_sections(int tail, bool damped) {
    const std::vector<int> points{tail, add_near(&joint_sample[3], tail), add_near(&joint_sample[6], tail)};
    for (int k = 0; k < 4; ++k) {
      sections.push_back(add_near(&sections_sample[3 * k]));
      spec.directors.push_back({sections[k], points[k % 2], points[k % 2 + 1], sections[k % 2]});
    }
    for (int k = 0; k < 2; ++k)
      add_constraint<Shear>(damped, {points[k], points[k + 1], sections[k], sections[2 + k]}, {});
    return points.back();
  }

  // A constraint between the rope's two sections, which the first kind adds; returns the last particle.
  template <class K>
  int add_between_sections(int tail, bool damped) {
    if (sections.empty()) tail = add_sections(tail, damped);
    std::vector<int> nodes = sections;
    if constexpr (K::arity > 4) {
      nodes.push_back(add_near(&case_of<K>().x[12]));
      sets.push_back(nodes.back());
    }
    add_constraint<K>(damped, nodes, jittered_parameters<K>());
    return tail;
  }

  // A body on particle `tail`; returns its center.
  int add_body(int tail, bool damped) {
    constexpr double away[3] = {0.06, 0.02, 0.05};
    Body body{add_near(away, tail), {}};
    for (int k = 0; k < 3; ++k) body.axes[k] = add_near(&axes_sample[3 * k]);
    bodies.push_back(body);
    spec.bodies.push_back(body);
    add_constraint<Rigid>(damped, {body.axes.begin(), body.axes.end()}, {});
    return body.center;
  }

  // A constraint on the rope's two bodies, which the first kind adds; returns the last particle.
  template <class K>
  int add_on_bodies(int tail, bool damped) {
    if (bodies.empty()) tail = add_body(add_body(tail, damped), damped);
    if constexpr (std::same_as<K, Rigid>) return tail;
    std::vector<int> nodes;
    for (int k = 0; k < K::points; ++k)
      nodes.push_back(3 * k < K::axes ? bodies[k].center : tail = add_near(&case_of<K>().x[3 * k], bodies[0].center));
    for (int k = 0; k < K::axes; ++k) nodes.push_back(bodies[k / 3].axes[k % 3]);
    for (int k = K::points + K::axes; k < K::arity; ++k) {
      nodes.push_back(add_near(&case_of<K>().x[3 * k]));
      sets.push_back(nodes.back());
    }
    add_constraint<K>(damped, nodes, jittered_parameters<K>());
    return tail;
  }

  void add_brace(int a, int b) {
    const double l = std::hypot(x[3 * b] - x[3 * a], x[3 * b + 1] - x[3 * a + 1], x[3 * b + 2] - x[3 * a + 2]);
    add_constraint<Distance>(false, {a, b}, {l * random(0.97, 1.03)});
  }

  // An octahedron with a corner at place k of a rope, tied to it and to the particle before.
  void add_volume(const std::vector<int>& rope, std::size_t k) {
    const int corner = rope[k];
    constexpr double r = 0.08, inside = 4.0 / 3.0 * r * r * r;
    std::vector<int> ring;
    for (const auto& [a, b] : {std::pair{r, 0.0}, {0.0, r}, {-r, 0.0}, {0.0, -r}}) {
      ring.push_back(add_particle(x[3 * corner] + a + random(-0.005, 0.005), x[3 * corner + 1] + b,
                                  x[3 * corner + 2] - r + random(-0.005, 0.005)));
      add_brace(corner, ring.back());
    }
    add_brace(rope[k - 1], ring[0]);
    const int below = add_particle(x[3 * corner], x[3 * corner + 1], x[3 * corner + 2] - 2.0 * r);
    add_brace(ring[2], below);
    VolumeSpec volume{"volume", {}};
    for (int k = 0; k < 4; ++k) {
      volume.triangles.push_back({corner, ring[k], ring[(k + 1) % 4]});
      volume.triangles.push_back({below, ring[(k + 1) % 4], ring[k]});
    }
    spec.volumes.push_back(volume);
    volumes.push_back(inside * random(0.95, 1.05));
    volume_compliances.push_back(5e-8 * random(0.5, 1.5));
  }

  std::vector<int> add_rope(bool damped, bool with_bodies, const SceneShape& shape) {
    const int first = static_cast<int>(x.size()) / 3;
    int tail = 0;
    sections.clear();
    bodies.clear();
    for_each_kind([&]<class K>(K) {
      if (K::unilateral && !shape.unilateral) return;
      if (K::points != K::arity && !shape.directors) return;
      if (K::axes > 0 && !with_bodies) return;
      if constexpr (K::axes > 0)
        tail = add_on_bodies<K>(tail, damped);
      else if constexpr (K::points == 0)
        tail = add_between_sections<K>(tail, damped);
      else
        tail = add_stencil<K>(tail, damped);
    });
    std::vector<int> rope{0};
    const auto is_point = [&](int n) {
      return std::none_of(spec.directors.begin(), spec.directors.end(),
                          [&](const Director& d) { return d.node == n; }) &&
             std::none_of(bodies.begin(), bodies.end(),
                          [&](const Body& b) { return std::ranges::find(b.axes, n) != b.axes.end(); }) &&
             std::find(sets.begin(), sets.end(), n) == sets.end();
    };
    for (int n = first; n < static_cast<int>(x.size()) / 3; ++n)
      if (is_point(n)) rope.push_back(n);
    for (std::size_t k = 1; k < rope.size(); ++k) add_brace(rope[k - 1], rope[k]);
    return rope;
  }

  void fill(const Scene& scene, std::vector<double>& inputs) {
    const Inputs<double> in{scene.layout, inputs.data()};
    const auto fill = [&](Quantity q, double low, double high) {
      for (std::size_t i = 0; i < scene.layout.count(q); ++i) in.of(q)[i] = random(low, high);
    };
    std::copy(x.begin(), x.end(), in.of(Quantity::position));
    fill(Quantity::velocity, -0.3, 0.3);
    fill(Quantity::mass, 0.01, 0.03);
    fill(Quantity::force, -0.1, 0.1);
    fill(Quantity::load, -0.01, 0.01);
    fill(Quantity::gravity, -9.0, 9.0);
    fill(Quantity::drag_linear, 0.01, 0.1);
    fill(Quantity::drag_quadratic, 0.01, 0.1);
    double *compliance = in.of(Quantity::compliance), *damping = in.of(Quantity::damping),
           *rest = in.of(Quantity::rest);
    for (const Values& g : groups) {
      compliance = std::copy(g.compliance.begin(), g.compliance.end(), compliance);
      damping = std::copy(g.damping.begin(), g.damping.end(), damping);
      rest = std::copy(g.p.begin(), g.p.end(), rest);
    }
    double* knot = in.of(Quantity::boundary);
    for (std::size_t k = 0; k < scene.boundary.times.size(); ++k)
      for (const int node : scene.driven)
        for (int d = 0; d < 3; ++d) *knot++ = x[3 * node + d] + random(-0.01, 0.01);
    fill(Quantity::wind, -3.0, 3.0);
    fill(Quantity::air_normal, 0.3, 0.9);
    fill(Quantity::air_tangential, 0.03, 0.2);
    fill(Quantity::pressure, -0.2, 0.2);
    std::copy(volumes.begin(), volumes.end(), in.of(Quantity::volume));
    std::copy(volume_compliances.begin(), volume_compliances.end(), in.of(Quantity::volume_compliance));
  }
};

}  // namespace

Sample random_scene(unsigned seed, const SceneShape& shape) {
  SceneBuilder b(seed);
  b.add_particle(0.0, 0.0, 0.0);
  std::vector<std::vector<int>> ropes;
  for (int r = 0; r < shape.ropes; ++r) ropes.push_back(b.add_rope(r < 2, r == 0 || r == 2, shape));
  if (shape.net)
    for (std::size_t r = 1; r < ropes.size(); ++r)
      for (std::size_t k = 1; k + 2 < ropes[r].size() && k < ropes[r - 1].size(); k += 2)
        b.add_brace(ropes[r - 1][k], ropes[r][k + 2]);
  if (shape.volumes)
    for (std::size_t r = 0; r < ropes.size(); ++r)
      b.add_volume(ropes[r], r == 1 ? ropes[r].size() / 2 : ropes[r].size() - 1);
  b.spec.particles = static_cast<int>(b.x.size()) / 3;
  b.spec.driven = {shape.net ? ropes[2].back() : 0, ropes[1][ropes[1].size() / 2]};
  b.spec.pinned = b.sets;
  b.spec.pinned.push_back(ropes[0].back());
  b.spec.loaded = {ropes[0][1], ropes[2][3]};
  b.spec.has_drag = true;
  // Some of these triangles hold a driven, a loaded or a pinned particle.
  for (const auto& rope : ropes)
    for (std::size_t k = 0; k + 2 < rope.size(); k += 2) b.spec.air.push_back({rope[k], rope[k + 1], rope[k + 2]});
  b.spec.boundary = {{0.0, 0.011, 0.02, 0.05}, Interpolation::cubic};
  b.spec.force = {{0.0, 0.03}, Interpolation::linear};
  b.spec.wind = {{0.0, 0.008, 0.02}, Interpolation::linear};
  for (const auto& g : b.groups)
    b.spec.groups.push_back({g.kind + (g.damped ? "_damped" : ""), g.kind, g.damped, g.stencil});
  for (std::size_t g = 0; g < b.groups.size(); g += 3)  // the last row of every third group
    with_kind(kind_of(b.groups[g].kind),
              [&]<class K>(K) { b.spec.loads.push_back({static_cast<int>(g), 0, K::rows - 1}); });
  b.spec.load = {{0.0, 0.02}, Interpolation::linear};
  Sample sample{build_scene(b.spec), {}};
  sample.inputs.resize(sample.scene.layout.total());
  b.fill(sample.scene, sample.inputs);
  return sample;
}

}  // namespace sheetbend::testing
