#include "core/solver/divergence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>

#include "core/constraints/any_kind.h"
#include "core/solver/volume.h"

namespace sheetbend {
namespace {

constexpr double fast = 1e4, stretched = 1e3, shrunk = 10.0;  // over the energy put in
constexpr double wide = 2.0, narrow = 0.01;                   // over a stencil's width at the start
constexpr double least_gravity =
    9.81;  // a motion of this acceleration over the scene's size needs no explanation [m/s^2]

double squared_distance(const double* a, const double* b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

std::string in_words(const char* format, double value) {
  std::array<char, 160> text;
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// Diagonal of the box around all particles, with bodies that have a width.
double size_of(const Scene& scene, const Moved& s) {
  std::array<double, 3> low, high;
  low.fill(1e300);
  high.fill(-1e300);
  for (int n = 0; n < scene.nodes(); ++n) {
    if (!scene.is_place[n]) continue;
    for (int d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], s.start[scene.first_dof[n] + d]);
      high[d] = std::max(high[d], s.start[scene.first_dof[n] + d]);
    }
  }
  return std::sqrt(squared_distance(low.data(), high.data())) + width_of_bodies(scene.bodies, s.mass);
}

double mass_of(const Scene& scene, const double* mass) {
  double sum = 0.0;
  for (int n = 0; n < scene.nodes(); ++n)
    if (scene.has_weight[n]) sum += mass[n];
  return sum;
}

double kinetic_energy(const Scene& scene, const double* mass, const double* v) {
  constexpr std::array<double, 3> rest{};
  double sum = 0.0;
  for (int n = 0; n < scene.nodes(); ++n)
    if (scene.inertial[n]) sum += 0.5 * mass[n] * squared_distance(v + scene.first_dof[n], rest.data());
  return sum;
}

// Distance of a stencil's points from its first one, at most; squared.
double squared_width(const Scene& scene, const Group& group, int item, const double* x) {
  const auto nodes = group.nodes(item);
  double width = 0.0;
  for (int k = 1; k < group.points; ++k)
    width = std::max(width, squared_distance(x + scene.first_dof[nodes[0]], x + scene.first_dof[nodes[k]]));
  return width;
}

// Calls f(group, item, width at the start, width now), squared, for stencils of two points and more; widths at the start count as a hundredth of
// the scene's size at least.
template <class F>
void for_each_width(const Scene& scene, const Moved& s, double size, F&& f) {
  const double least = 1e-4 * size * size;
  for (const Group& group : scene.groups)
    for (int i = 0; group.points > 1 && i < group.count; ++i)
      f(group, i, std::max(least, squared_width(scene, group, i, s.start)), squared_width(scene, group, i, s.x));
}

// Calls f(C, compliance, its gradient, nodes) for the rows of a constraint that act.
template <class F>
void for_each_row(const Scene& scene, const Inputs<const double>& in, const Group& group, int item, const double* x,
                  F&& f) {
  AnyConstraint<double> at;
  const auto nodes = group.nodes(item);
  for (int k = 0; k < group.arity; ++k) std::copy_n(x + scene.first_dof[nodes[k]], 3, at.x + 3 * k);
  at.evaluate(group.kind,
              in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * group.parameters);
  const std::size_t dofs = 3 * nodes.size();
  for (int j = 0; j < group.rows; ++j)
    if (!group.unilateral || at.C[j] < 0.0)
      f(at.C[j], in.of(Quantity::compliance)[group.first + item], std::span<const double>(at.J + j * dofs, dofs),
        nodes);
}

// C^2/(2 alpha); of rigid rows what one projection releases, C^2/(2 eta^2 J W J^T).
double releasable(const Scene& scene, const Inputs<const double>& in, const Group& group, int item, double eta,
                  const double* x) {
  double energy = 0.0;
  for_each_row(scene, in, group, item, x, [&](double C, double alpha, std::span<const double> J, auto nodes) {
    double soft = alpha;
    if (alpha == 0.0)
      for (std::size_t d = 0; d < J.size(); ++d) {
        const double mass = in.of(Quantity::mass)[nodes[d / 3]];
        if (scene.role[nodes[d / 3]] == Role::free && mass > 0.0) soft += eta * eta * J[d] * J[d] / mass;
      }
    if (soft > 0.0) energy += 0.5 * C * C / soft;
  });
  return energy;
}

// C^2/(2 alpha); without bound where a rigid row is off by more than `tolerated`, as a length: |C|/|J|.
double stored(const Scene& scene, const Inputs<const double>& in, const Group& group, int item, double tolerated,
              const double* x) {
  double energy = 0.0;
  for_each_row(scene, in, group, item, x, [&](double C, double alpha, std::span<const double> J, auto) {
    double squared = 0.0;
    for (const double j : J) squared += j * j;
    if (alpha > 0.0)
      energy += 0.5 * C * C / alpha;
    else if (C * C > tolerated * tolerated * squared)
      energy = HUGE_VAL;
  });
  return energy;
}

// How far, how fast and along which path the driven nodes have been led, in m; directors and axes as if they were as long as the scene.
struct Lead {
  double apart = 0.0;  // of the held particles among each other, since the first knot
  double speed = 0.0, path = 0.0;
};

Lead lead_until(const Scene& scene, const Inputs<const double>& in, double size, double t) {
  Lead lead;
  const std::size_t slots = scene.driven.size();
  if (slots == 0) return lead;
  const double* knots = in.of(Quantity::boundary);
  std::vector<double> path(slots);
  std::vector<Vec3<double>> moved(slots);
  for (std::size_t k = 1; k < scene.boundary.times.size() && scene.boundary.times[k - 1] < t; ++k) {
    Vec3<double> sum;
    double particles = static_cast<double>(scene.pinned.size());
    for (std::size_t i = 0; i < slots; ++i) {
      const double* now = knots + 3 * (k * slots + i);
      const bool place = scene.is_place[scene.driven[i]];
      const double step = std::sqrt(squared_distance(now, now - 3 * slots)) * (place ? 1.0 : size);
      path[i] += step;
      lead.speed = std::max(lead.speed, step / (scene.boundary.times[k] - scene.boundary.times[k - 1]));
      if (!place) continue;
      moved[i] = Vec3<double>(now) - Vec3<double>(knots + 3 * i);
      sum = sum + moved[i];
      particles += 1.0;
    }
    if (particles < 2.0) continue;
    const Vec3<double> mean = scaled(1.0 / particles, sum);
    for (std::size_t i = 0; i < slots; ++i) {
      if (!scene.is_place[scene.driven[i]]) continue;
      const Vec3<double> off = moved[i] - mean;
      lead.apart = std::max(lead.apart, 2.0 * std::sqrt(dot(off, off)));
    }
  }
  lead.path = *std::max_element(path.begin(), path.end());
  return lead;
}

// Largest length among rows of three numbers; `stride` rows lie between those of one column.
double longest(const double* rows, std::size_t count, std::size_t stride) {
  constexpr std::array<double, 3> zero{};
  double most = 0.0;
  for (std::size_t k = 0; k < count; ++k) most = std::max(most, squared_distance(rows + 3 * k * stride, zero.data()));
  return std::sqrt(most);
}

// Work of gravity, loads, air and pressure, each along a particle's displacement and the scene's size, from above.
double work_of_forces(const Scene& scene, const Moved& s, const Inputs<const double>& in, double size) {
  const double gravity = longest(in.of(Quantity::gravity), 1, 1);
  const auto moved = [&](int n) {
    return std::sqrt(squared_distance(s.x + scene.first_dof[n], s.start + scene.first_dof[n]));
  };
  double work = 0.0;
  for (int n = 0; n < scene.nodes(); ++n)
    if (scene.has_weight[n]) work += s.mass[n] * (gravity * moved(n) + std::max(gravity, least_gravity) * size);
  const std::size_t loads = scene.loaded.size();
  for (std::size_t i = 0; i < loads; ++i)
    work += longest(in.of(Quantity::force) + 3 * i, scene.force.times.size(), loads) *
            (moved(scene.loaded[i]) + (scene.is_place[scene.loaded[i]] ? size : 1.0));
  const double wind = longest(in.of(Quantity::wind), scene.wind.times.size(), 1);
  for (int n = 0; n < scene.nodes() && scene.drag_in_wind; ++n)
    if (scene.has_weight[n])
      work += (in.of(Quantity::drag_linear)[n] + in.of(Quantity::drag_quadratic)[n] * wind) * wind * (moved(n) + size);
  for (std::size_t i = 0; i < scene.air.size(); ++i) {
    const auto& [a, b, c] = scene.air[i];
    const double* at[2] = {s.start, s.x};
    double area = 0.0;
    for (const double* x : at) {
      const Vec3<double> corner(x + scene.first_dof[a]);
      const Vec3<double> n =
          cross(Vec3<double>(x + scene.first_dof[b]) - corner, Vec3<double>(x + scene.first_dof[c]) - corner);
      area = std::max(area, 0.5 * std::sqrt(dot(n, n)));
    }
    const double drag = in.of(Quantity::air_normal)[i] + in.of(Quantity::air_tangential)[i];
    work += area * (drag * wind * wind + std::abs(in.of(Quantity::pressure)[i])) *
            (std::max({moved(a), moved(b), moved(c)}) + size);
  }
  return work;
}

// Kinetic and elastic energy at the start.
double energy_at_start(const Scene& scene, const Moved& s, const Inputs<const double>& in, double eta) {
  double energy = kinetic_energy(scene, s.mass, in.of(Quantity::velocity));
  for (const Group& group : scene.groups)
    for (int i = 0; i < group.count; ++i) energy += releasable(scene, in, group, i, eta, s.start);
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const Volume& volume = scene.volumes[v];
    std::vector<Vec3<double>> x(volume.nodes.size()), gradient(volume.nodes.size());
    place_volume<double>([&](std::size_t k) { return Vec3<double>(s.start + scene.first_dof[volume.nodes[k]]); }, x);
    const double C = enclosed(volume, x, gradient) - in.of(Quantity::volume)[v];
    double soft = in.of(Quantity::volume_compliance)[v];
    if (soft == 0.0)
      for (std::size_t k = 0; k < x.size(); ++k)
        if (scene.inertial[volume.nodes[k]])
          soft += eta * eta * dot(gradient[k], gradient[k]) / s.mass[volume.nodes[k]];
    if (soft > 0.0) energy += 0.5 * C * C / soft;
  }
  return energy;
}

struct Shape {
  double widening = 0.0;  // largest width over that at the start, squared
  std::size_t narrow = 0, all = 0;
  bool collapsed() const { return 2 * narrow > all; }
};

Shape shape_of(const Scene& scene, const Moved& s, double size) {
  Shape shape;
  for_each_width(scene, s, size, [&](const Group&, int, double before, double now) {
    shape.widening = std::max(shape.widening, now / before);
    shape.narrow += now < narrow * narrow * before;
    ++shape.all;
  });
  return shape;
}

}  // namespace

Diverged::Diverged(int substep_, int node_, double time_, const std::string& seen_)
    : std::runtime_error("the rollout diverged at substep " + std::to_string(substep_) +
                         " (t = " + std::to_string(time_) + " s): particle " + std::to_string(node_) + " " + seen_ +
                         ". Fix: use a smaller substep, more iterations, or check masses and stiffnesses"),
      substep(substep_),
      node(node_),
      time(time_),
      seen(seen_) {}

bool StateCheck::suspects(const Moved& s) const {
  const double size = size_of(scene_, s);
  const double usual = fast * mass_of(scene_, s.mass) * least_gravity * size;
  if (kinetic_energy(scene_, s.mass, s.v) > std::max(usual, kinetic_)) return true;
  const Shape shape = shape_of(scene_, s, size);
  return shape.widening > std::max(wide * wide, widening_) || shape.collapsed();
}

std::optional<Finding> StateCheck::find(const Moved& s, const Inputs<const double>& in, double t) {
  const double size = size_of(scene_, s), eta = Bdf::at(options_, 1).eta;
  const Lead lead = lead_until(scene_, in, size, t);
  const double led = 2.0 * lead.speed * (1.0 + (size > 0.0 ? lead.path / size : 0.0));
  const double given = work_of_forces(scene_, s, in, size) + energy_at_start(scene_, s, in, eta) +
                       0.5 * mass_of(scene_, s.mass) * led * led;

  const double kinetic = kinetic_energy(scene_, s.mass, s.v);
  if (!std::isfinite(kinetic) || kinetic > fast * given) {
    int fastest = 0;
    double speed = -1.0;
    for (int n = 0; n < scene_.nodes(); ++n)
      if (const double own = longest(s.v + scene_.first_dof[n], 1, 1) * (scene_.is_place[n] ? 1.0 : size);
          scene_.inertial[n] && own > speed)
        fastest = n, speed = own;
    return Finding{fastest, in_words("moves at %.3g m/s, which nothing put into the scene explains", speed)};
  }

  Finding widest{0, ""};
  double energy = 0.0, most = 0.0, collapsed = 0.0;
  for_each_width(scene_, s, size, [&](const Group& group, int item, double before, double now) {
    const double tolerated = std::sqrt(before) + lead.apart;
    if (now > wide * wide * tolerated * tolerated) {
      energy += stored(scene_, in, group, item, 0.5 * tolerated, s.x);
      if (now / before > most) {
        most = now / before;
        double far = -1.0;
        for (const int n : group.nodes(item).first(group.points))
          if (const double own = squared_distance(s.x + scene_.first_dof[n], s.start + scene_.first_dof[n]); own > far)
            widest.node = n, far = own;
        widest.seen = in_words("is %.3g m from its start, ", std::sqrt(far)) + "where '" + group.name +
                      in_words("' is stretched to %.3g times its width", std::sqrt(most));
      }
    } else if (now < narrow * narrow * before) {
      collapsed += stored(scene_, in, group, item, 0.5 * std::sqrt(before), s.x);
    }
  });
  if (energy > stretched * given) return widest;
  const Shape shape = shape_of(scene_, s, size);
  if (shape.collapsed() && collapsed > shrunk * given)
    return Finding{scene_.groups[0].stencil[0],
                   "is at one point with its neighbors: more than half of all constraints "
                   "are below a hundredth of their width"};
  kinetic_ = 2.0 * kinetic;
  widening_ = 1.5 * shape.widening;
  return std::nullopt;
}

}  // namespace sheetbend
