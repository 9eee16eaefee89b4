#include "core/equilibrium/equilibrium_state.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "core/equilibrium/residual.h"

namespace sheetbend {
namespace {

constexpr double energy_share = 0.1;  // of the loads' energy that softened constraints may hold
constexpr double rounding = 1e-14;    // of the scene's size, by which a contact may be above a surface
constexpr double stiffening = 0.9;    // of softened constraints, per iteration

// Diagonal of the box around all particles, with bodies that have a width.
double scene_size(const Scene& scene, const double* x, const double* mass) {
  Vec3<double> low(x), high(x);
  for (int n = 0; n < scene.nodes(); ++n) {
    if (!scene.is_place[n]) continue;
    const Vec3<double> p(x + scene.first_dof[n]);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return norm(high - low) + width_of_bodies(scene.bodies, mass);
}

// Mean distance between neighboring points of a stencil.
double mean_edge(const Scene& scene, const double* x) {
  double sum = 0.0;
  int count = 0;
  for (const Group& group : scene.groups)
    for (int i = 0; i < group.count; ++i)
      for (int k = 1; k < group.points; ++k, ++count)
        sum += norm(Vec3<double>(x + scene.first_dof[group.nodes(i)[k]]) -
                    Vec3<double>(x + scene.first_dof[group.nodes(i)[k - 1]]));
  return count == 0 ? 0.0 : sum / count;
}

// The solver works with the Hessian of an energy. The forces of wind on triangles have none, those of pressure only in some scenes.
void expect_energy(const Scene& scene, const Inputs<const double>& in, double t0) {
  if (scene.air.empty()) return;
  if (const int n = without_energy(scene, in); n >= 0)
    throw std::invalid_argument(
        "pressure: a state of rest was asked for, but at particle " + std::to_string(n) +
        " the surface under pressure ends or the pressure changes. Fix: close the surface or hold its rim, give one "
        "pressure, or simulate with drag until the motion has died down");
  const Vec3<double> wind = wind_at(scene, in, t0);
  if (dot(wind, wind) == 0.0) return;
  std::ostringstream text;
  text << "wind: a state of rest was asked for at t = " << t0 << " s, where the wind is " << norm(wind)
       << " m/s. Fix: let it rise from zero after that time, or simulate until the motion has died down";
  throw std::invalid_argument(text.str());
}

// Which of them push would have to be found too.
void expect_no_unilateral(const Scene& scene) {
  for (const Group& group : scene.groups)
    if (group.unilateral)
      throw std::invalid_argument("equilibrium: group " + group.name + " may go slack. Fix: leave it out");
}

}  // namespace

bool finite(const std::vector<double>& v) {
  return std::all_of(v.begin(), v.end(), [](double a) { return std::isfinite(a); });
}

EquilibriumState::EquilibriumState(const Scene& scene_, const double* inputs, const double* start_x,
                                   const double* start_lambda, const EquilibriumOptions& o)
    : scene(scene_),
      in{scene_.layout, inputs},
      options(o),
      r_x(scene_.dofs()),
      r_l(scene_.multipliers()),
      compliance(compliances(scene_, in)),
      softened(compliance),
      soft(scene_.groups.size() + scene_.volumes.size(), std::numeric_limits<double>::infinity()),
      exact(start_lambda != nullptr),
      contacts(scene_, in, o.t0, o.held ? o.held : in.of(Quantity::position)) {
  expect_energy(scene, in, o.t0);
  expect_no_unilateral(scene);
  if (!scene.loads.empty())
    throw std::invalid_argument(
        "equilibrium: loads act along rows. Fix: leave them out, or simulate with drag until the motion has died down");
  const double* from = start_x ? start_x : in.of(Quantity::position);
  x.assign(from, from + scene.dofs());
  lambda.assign(scene.multipliers(), 0.0);
  if (start_lambda) std::copy_n(start_lambda, lambda.size(), lambda.data());
  place_fixed(scene, in, o.t0, x.data());
  retract_directors(scene, x.data());
  size = scene_size(scene, x.data(), in.of(Quantity::mass));
  edge = mean_edge(scene, x.data());
  if (edge == 0.0) edge = width_of_bodies(scene.bodies, in.of(Quantity::mass));
  external_force(scene, in, o.t0, x.data(), r_x.data());
  weight = largest(r_x);
  for (const double f : r_x) total += std::abs(f);
  modes.decide(contacts, x.data(), 0.0);
  evaluate(x, lambda);
  if (!finite(x) || !finite(r_x) || !finite(r_l))
    throw std::invalid_argument(
        "start: the residual is not finite. Fix: give finite inputs and a start without edges of no length or folded "
        "back");
}

double EquilibriumState::force_stiffness() const {
  if (weight > 0.0 && edge > 0.0) return weight / edge;
  std::vector<char> counts(scene.nodes(), scene.volumes.empty());
  for (const Volume& volume : scene.volumes)
    for (const int n : volume.nodes) counts[n] = true;
  double softest = std::numeric_limits<double>::infinity();
  AnyConstraint<double> own;
  for_each_constraint(scene, [&](const Group& group, int item) {
    if (!std::ranges::all_of(group.nodes(item), [&](int n) { return counts[n]; })) return;
    double J2 = 0.0;
    sheetbend::evaluate(scene, in, group, item, x.data(), own);
    for (int e = 0; e < group.rows * 3 * group.arity; ++e) J2 = std::max(J2, own.J[e] * own.J[e]);
    if (const double alpha = compliance[group.first + item]; alpha > 0.0) softest = std::min(softest, J2 / alpha);
  });
  return std::isfinite(softest) ? 1e-4 * softest : 0.0;
}

double EquilibriumState::first_pseudo_stiffness(Kkt& kkt) const {
  kkt.factorize(0.0, compliance.data());
  return std::max(1e-6 * kkt.largest_diagonal(), force_stiffness());
}

void EquilibriumState::soften() {
  if (exact) return;
  const double budget = energy_share * total * size;
  AnyConstraint<double> own;
  for (std::size_t g = 0; g < scene.groups.size(); ++g) {
    const Group& group = scene.groups[g];
    double sum = 0.0;
    for (int i = 0; i < group.count; ++i) {
      sheetbend::evaluate(scene, in, group, i, x.data(), own);
      for (int j = 0; j < group.rows; ++j) sum += 0.5 * own.C[j] * own.C[j];
    }
    soft[g] = budget > 0.0 ? std::min(sum / budget, stiffening * soft[g]) : 0.0;
    for (int c = group.first; c < group.first + group.count; ++c) softened[c] = std::max(compliance[c], soft[g]);
  }
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    double& own = soft[scene.groups.size() + v];
    const double missing = missing_volume(v);
    own = inflation[v] > 0.0 ? std::min(0.5 * missing * missing / inflation[v], stiffening * own) : 0.0;
    softened[scene.constraints + v] = std::max(compliance[scene.constraints + v], own);
  }
}

double EquilibriumState::missing_volume(std::size_t v) const {
  std::vector<Vec3<double>> gradient;
  return kept_volume(scene, in, static_cast<int>(v), x.data(), gradient);
}

void EquilibriumState::take_elastic_multipliers() {
  evaluate(x, std::vector<double>(lambda.size(), 0.0));
  for_each_row([&](int c, int row) { lambda[row] = compliance[c] > 0.0 ? -r_l[row] / compliance[c] : 0.0; });
}

void EquilibriumState::leave_out(std::vector<RedundantRow> rows) {
  if (!std::ranges::equal(rows, left_out, {}, &RedundantRow::row, &RedundantRow::row))
    last_step = std::numeric_limits<double>::infinity();
  left_out = std::move(rows);
  for (const RedundantRow& r : left_out) lambda[r.row] = 0.0;
  evaluate(x, lambda);
}

bool EquilibriumState::any_rigid() const {
  return std::any_of(compliance.begin(), compliance.begin() + scene.constraints, [](double a) { return a == 0.0; });
}

void EquilibriumState::evaluate(const std::vector<double>& at_x, const std::vector<double>& at_lambda) {
  equilibrium_residual(scene, in, options.t0, at_x.data(), at_lambda.data(), r_x.data(), r_l.data());
  modes.add_forces(contacts, at_x.data(), r_x);
  for (const RedundantRow& r : left_out) r_l[r.row] = 0.0;
}

void EquilibriumState::measure() {
  if (modes.decide(contacts, x.data(), rounding * size)) last_step = std::numeric_limits<double>::infinity();
  evaluate(x, lambda);
  std::vector<double> force(scene.dofs());
  external_force(scene, in, options.t0, x.data(), force.data());
  for (double& f : force) f = std::abs(f);
  modes.add_sizes(contacts, x.data(), force);
  residual = 0.0;
  AnyConstraint<double> own;
  for_each_constraint(scene, [&](const Group& group, int item) {
    const int dofs = 3 * group.arity;
    sheetbend::evaluate(scene, in, group, item, x.data(), own);
    for (int j = 0; j < group.rows; ++j) {
      const int row = group.first_row + item * group.rows + j;
      double J2 = 0.0;
      for (int d = 0; d < dofs; ++d) {
        const double a = own.J[j * dofs + d];
        J2 += a * a;
        force[scene.first_dof[group.nodes(item)[d / 3]] + d % 3] += std::abs(a * lambda[row]);
      }
      residual = std::max(residual, std::abs(r_l[row]) / (J2 > 0.0 ? std::sqrt(J2) * size : 1.0));
    }
  });
  std::vector<Vec3<double>> gradient;
  for (int v = 0; v < static_cast<int>(scene.volumes.size()); ++v) {
    const int row = scene.rows + v;
    double g2 = 0.0;
    kept_volume(scene, in, v, x.data(), gradient);
    for (std::size_t k = 0; k < gradient.size(); ++k) {
      const Vec3<double> push = lambda[row] * gradient[k];
      Vec3<double>(std::abs(push.x), std::abs(push.y), std::abs(push.z))
          .add_to(&force[scene.first_dof[scene.volumes[v].nodes[k]]]);
      g2 += dot(gradient[k], gradient[k]);
    }
    residual = std::max(residual, std::abs(r_l[row]) / (g2 > 0.0 ? std::sqrt(g2) * size : 1.0));
  }
  const double scale = largest(force);
  if (scale > 0.0) residual = std::max(residual, largest(r_x) / scale);
  if (!finite(r_x) || !finite(r_l)) residual = std::numeric_limits<double>::infinity();
}

bool EquilibriumState::converged() const {
  return residual <= options.tolerance ||
         ((residual <= near_rest || total == 0.0) && last_step <= options.tolerance * size);
}

bool EquilibriumState::find_unstressed() {
  if (total > 0.0) return false;
  std::vector<double> none(lambda.size(), 0.0), given = std::exchange(lambda, none);
  measure();
  if (residual <= options.tolerance) return true;
  lambda = std::move(given);
  measure();
  return false;
}

double EquilibriumState::energy() const {
  std::vector<double> f(scene.dofs());
  dead_load(scene, in, options.t0, f.data());
  double sum = pressure_energy(scene, in, x.data()) + modes.energy(contacts, x.data());
  for (int i = 0; i < scene.dofs(); ++i) sum -= f[i] * x[i];
  for_each_constraint(scene, [&](const Group& group, int item) {
    for (int j = 0; j < group.rows; ++j) {
      const int row = group.first_row + item * group.rows + j;
      const double l = lambda[row];
      sum += 0.5 * compliance[group.first + item] * l * l - l * r_l[row];
    }
  });
  for (std::size_t v = 0; v < scene.volumes.size(); ++v)
    sum += lambda[scene.rows + v] *
           (0.5 * compliance[scene.constraints + v] * lambda[scene.rows + v] - r_l[scene.rows + v]);
  return sum;
}

}  // namespace sheetbend
