#include "core/equilibrium/equilibrium.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "core/equilibrium/residual.h"

namespace sheetbend {
namespace {

constexpr double near_rest =
    1e-6;  // relative residual below which Newton may go to a saddle (it is left again afterwards)
constexpr double energy_share = 0.1;  // of the loads' energy that softened constraints may hold
constexpr double stiffening = 0.9;    // of softened constraints, per iteration
constexpr int max_corrections = 5;    // simplified Newton steps per factorization
constexpr int max_departures = 5;     // from saddles

double largest(const std::vector<double>& v) {
  double m = 0.0;
  for (const double a : v) m = std::max(m, std::abs(a));
  return m;
}

bool finite(const std::vector<double>& v) {
  return std::all_of(v.begin(), v.end(), [](double a) { return std::isfinite(a); });
}

// Diagonal of the box around all particles.
double scene_size(const Scene& scene, const double* x) {
  Vec3<double> low(x), high(x);
  for (int n = 0; n < scene.nodes(); ++n) {
    if (scene.is_director[n]) continue;
    const Vec3<double> p(x + scene.first_dof[n]);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return norm(high - low);
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

// The solver works with the Hessian of an energy. The forces of wind have none, those of pressure only in some scenes.
void expect_energy(const Scene& scene, const Inputs<const double>& in, double t0) {
  if (scene.air.empty()) return;
  if (const int n = without_energy(scene, in); n >= 0)
    throw std::invalid_argument(
        "pressure: a state of rest was asked for, but at particle " + std::to_string(n) +
        " the surface under pressure ends or the pressure changes. Fix: close the surface or hold its rim, give one "
        "pressure, or simulate with drag until the motion has died down");
  const Vec3<double> wind = at_knots(scene.wind.at(t0), in.of(Quantity::wind), 1, 0);
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

std::string not_converged(const Equilibrium& e, double tolerance) {
  std::ostringstream text;
  text << "equilibrium: no rest found in " << e.iterations << " iterations, relative residual " << e.residual
       << " (tolerance " << tolerance
       << "). Fix: start nearer to the shape, give more iterations, or check that supports hold every part against its "
          "loads";
  return text.str();
}

}  // namespace

struct EquilibriumSolver::State {
  const Scene& scene;
  Inputs<const double> in;
  const EquilibriumOptions& options;
  std::vector<double> x, lambda, r_x, r_l, compliance, softened, soft;
  double size, edge, weight, total = 0.0;  // of the scene, of an edge  [m]; largest and summed external force  [N]
  std::vector<double> inflation;  // per volume, what changing the start's to its own takes by the first estimate  [J]
  double residual = 0.0, last_step = std::numeric_limits<double>::infinity();

  State(const Scene& scene_, const double* inputs, const double* start_x, const double* start_lambda,
        const EquilibriumOptions& o)
      : scene(scene_),
        in{scene_.layout, inputs},
        options(o),
        r_x(scene_.dofs()),
        r_l(scene_.multipliers()),
        compliance(compliances(scene_, in)),
        softened(compliance),
        soft(scene_.groups.size() + scene_.volumes.size(), std::numeric_limits<double>::infinity()) {
    expect_energy(scene, in, o.t0);
    expect_no_unilateral(scene);
    const double* from = start_x ? start_x : in.of(Quantity::position);
    x.assign(from, from + scene.dofs());
    lambda.assign(scene.multipliers(), 0.0);
    if (start_lambda) std::copy_n(start_lambda, lambda.size(), lambda.data());
    place_fixed(scene, in, o.t0, x.data());
    retract_directors(scene, x.data());
    size = scene_size(scene, x.data());
    edge = mean_edge(scene, x.data());
    external_force(scene, in, o.t0, x.data(), r_x.data());
    weight = largest(r_x);
    for (const double f : r_x) total += std::abs(f);
    evaluate(x, lambda);
    if (!finite(x) || !finite(r_x) || !finite(r_l))
      throw std::invalid_argument(
          "start: the residual is not finite. Fix: give finite inputs and a start without edges of no length or folded "
          "back");
  }

  // A scale of stiffness that is there before any multiplier: of the loads or, without loads, a part of the softest constraint's. A kept
  // volume loads the constraints of its surface; one that only holds the body in place is no measure of them.
  double force_stiffness() const {
    if (weight > 0.0 && edge > 0.0) return weight / edge;
    std::vector<char> counts(scene.nodes(), scene.volumes.empty());
    for (const Volume& volume : scene.volumes)
      for (const int n : volume.nodes) counts[n] = true;
    double softest = std::numeric_limits<double>::infinity();
    for_each_constraint(scene, [&]<class K>(K, const Group& group, int item) {
      if (!std::ranges::all_of(group.nodes(item), [&](int n) { return counts[n]; })) return;
      double local[K::dofs], J2 = 0.0;
      gather<K>(scene, group, item, x.data(), local);
      for (const double j : Evaluation<K, double>(local, rest_parameters<K>(in, group, item)).J)
        J2 = std::max(J2, j * j);
      if (const double alpha = compliance[group.first + item]; alpha > 0.0) softest = std::min(softest, J2 / alpha);
    });
    return std::isfinite(softest) ? 1e-4 * softest : 0.0;
  }
  double first_pseudo_stiffness(Kkt& kkt) const {
    kkt.factorize(0.0, compliance.data());
    return std::max(1e-6 * kkt.largest_diagonal(), force_stiffness());
  }

  // A compliance for each group, always falling, at which its violated constraints hold no more than a part of the energy that
  // the loads can give: full stiffness would answer a rough start with forces that crumple it. A volume is a load itself: of the work that
  // it is estimated to take, it may hold all.
  void soften() {
    const double budget = energy_share * total * size;
    for (std::size_t g = 0; g < scene.groups.size(); ++g) {
      const Group& group = scene.groups[g];
      double sum = 0.0;
      with_kind(group.kind, [&]<class K>(K) {
        for (int i = 0; i < group.count; ++i) {
          double local[K::dofs];
          gather<K>(scene, group, i, x.data(), local);
          for (const double c : Evaluation<K, double>(local, rest_parameters<K>(in, group, i)).C) sum += 0.5 * c * c;
        }
      });
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

  double missing_volume(std::size_t v) const {
    std::vector<Vec3<double>> gradient;
    return kept_volume(scene, in, static_cast<int>(v), x.data(), gradient);
  }

  void evaluate(const std::vector<double>& at_x, const std::vector<double>& at_lambda) {
    equilibrium_residual(scene, in, options.t0, at_x.data(), at_lambda.data(), r_x.data(), r_l.data());
  }

  // The residual at (x, lambda), relative to the forces that cancel in it and, by |J|, to the scene's size.
  void measure() {
    evaluate(x, lambda);
    std::vector<double> force(scene.dofs());
    external_force(scene, in, options.t0, x.data(), force.data());
    for (double& f : force) f = std::abs(f);
    residual = 0.0;
    for_each_constraint(scene, [&]<class K>(K, const Group& group, int item) {
      double local[K::dofs];
      gather<K>(scene, group, item, x.data(), local);
      const Evaluation<K, double> value(local, rest_parameters<K>(in, group, item));
      for (int j = 0; j < K::rows; ++j) {
        const int row = group.first_row + item * K::rows + j;
        double J2 = 0.0;
        for (int d = 0; d < K::dofs; ++d) {
          J2 += value.J[j * K::dofs + d] * value.J[j * K::dofs + d];
          force[scene.first_dof[group.nodes(item)[d / 3]] + d % 3] += std::abs(value.J[j * K::dofs + d] * lambda[row]);
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
  }

  // A Newton step of no length counts near rest only: at a fold K is so stiff that every step is short. Without loads the residual at rest
  // is rounding relative to rounding.
  bool converged() const {
    return residual <= options.tolerance ||
           ((residual <= near_rest || total == 0.0) && last_step <= options.tolerance * size);
  }

  double energy() const {
    std::vector<double> f(scene.dofs());
    dead_load(scene, in, options.t0, f.data());
    double sum = pressure_energy(scene, in, x.data());
    for (int i = 0; i < scene.dofs(); ++i) sum -= f[i] * x[i];
    for_each_constraint(scene, [&]<class K>(K, const Group& group, int item) {
      for (int j = 0; j < K::rows; ++j) {
        const double l = lambda[group.first_row + item * K::rows + j];
        sum += 0.5 * compliance[group.first + item] * l * l;
      }
    });
    for (std::size_t v = 0; v < scene.volumes.size(); ++v)
      sum += 0.5 * compliance[scene.constraints + v] * lambda[scene.rows + v] * lambda[scene.rows + v];
    return sum;
  }
};

// One step of pseudo-time (of Newton for mu = 0) from an assembled matrix; false, with nothing changed, where it is not to be trusted.
bool EquilibriumSolver::step(State& s, double mu, const double* alpha) {
  if (!kkt_.factorize(mu, alpha)) return false;
  if (s.options.stable && s.residual > near_rest && kkt_.negative_modes() > 0) return false;
  std::vector<double> x = s.x, lambda = s.lambda, dx, dl;
  double first = 0.0, before = 0.0;
  for (int k = 0; k < max_corrections; ++k) {
    s.evaluate(x, lambda);
    dx = s.r_x;
    dl = s.r_l;
    for (int i = 0; i < scene_.dofs(); ++i) dx[i] = -(dx[i] - mu * kkt_.metric(i) * (x[i] - s.x[i]));
    for (const Group& group : scene_.groups)
      for (int i = 0; i < group.count; ++i) {
        const int c = group.first + i, row = group.first_row + i * group.rows;
        for (int j = row; j < row + group.rows; ++j) dl[j] = -(dl[j] + (alpha[c] - s.compliance[c]) * lambda[j]);
      }
    for (int j = scene_.rows, c = scene_.constraints; j < scene_.multipliers(); ++j, ++c)
      dl[j] = -(dl[j] + (alpha[c] - s.compliance[c]) * lambda[j]);
    if (!finite(dx) || !finite(dl) || !kkt_.solve(dx.data(), dl.data(), 1e-8)) return false;
    for (int i = 0; i < scene_.dofs(); ++i) x[i] += dx[i];
    for (std::size_t i = 0; i < lambda.size(); ++i) lambda[i] += dl[i];
    const double size = largest(dx);
    if (k == 0) first = size;
    const bool negligible = size <= 1e-14 * s.size;
    if (k > 0 && size > 0.5 * before && !negligible) return false;
    if (negligible || (k > 0 && size < 0.02 * first)) {
      std::swap(s.x, x);
      std::swap(s.lambda, lambda);
      retract_directors(scene_, s.x.data());
      s.last_step = mu == 0.0 ? first : std::numeric_limits<double>::infinity();
      return true;
    }
    before = size;
  }
  return false;
}

// The multipliers that would hold the start best: those of one heavily damped step from it, which is not taken.
void EquilibriumSolver::estimate_multipliers(State& s) {
  kkt_.assemble(s.in.data, s.x.data(), s.lambda.data(), s.force_stiffness());
  const double mu = s.first_pseudo_stiffness(kkt_);
  std::vector<double> x = s.r_x, lambda = s.r_l;
  for (double& r : x) r = -r;
  for (double& r : lambda) r = -r;
  if (kkt_.factorize(mu, s.compliance.data()) && kkt_.solve(x.data(), lambda.data(), 1e-3)) s.lambda = lambda;
}

// Moves a little along a direction of negative curvature, found by inverse iteration on the smallest K + mu that is positive definite.
void EquilibriumSolver::leave_saddle(State& s) {
  const double* alpha = s.compliance.data();
  double mu = 1e-9 * kkt_.largest_diagonal();
  for (int k = 0; k < 100 && (!kkt_.factorize(mu, alpha) || kkt_.negative_modes() > 0); ++k) mu *= 2.0;
  std::vector<double> v(scene_.dofs()), rows(scene_.multipliers());
  for (int i = 0; i < scene_.dofs(); ++i) v[i] = std::sin(1.0 + 1.7 * i);
  for (int k = 0; k < 8; ++k) {
    std::fill(rows.begin(), rows.end(), 0.0);
    kkt_.solve(v.data(), rows.data(), 1e-3);
    const double scale = 1.0 / largest(v);
    for (double& a : v) a *= scale;
  }
  for (int i = 0; i < scene_.dofs(); ++i) s.x[i] += 0.1 * s.edge * v[i];
  s.last_step = std::numeric_limits<double>::infinity();
}

Equilibrium EquilibriumSolver::solve(const double* inputs, const double* start_x, const double* start_lambda,
                                     const EquilibriumOptions& options, Interrupt* interrupt) {
  State s(scene_, inputs, start_x, start_lambda, options);
  Equilibrium result;
  result.t0 = options.t0;
  double mu = 0.0;
  bool newton = true;
  int departures = 0;
  if (!start_lambda) estimate_multipliers(s);
  for (std::size_t v = 0; v < scene_.volumes.size(); ++v)
    s.inflation.push_back(0.5 * std::abs(s.missing_volume(v) * s.lambda[scene_.rows + v]));
  s.measure();
  while (result.iterations < options.max_iterations) {
    if (interrupt) interrupt->poll();
    kkt_.assemble(inputs, s.x.data(), s.lambda.data(), s.force_stiffness());
    ++result.iterations;
    if (s.converged()) {
      result.unstable_modes = kkt_.factorize(0.0, s.compliance.data()) ? kkt_.negative_modes() : -1;
      result.converged = true;
      if (!options.stable || result.unstable_modes <= 0 || departures == max_departures) break;
      leave_saddle(s);
      ++departures;
      result.converged = newton = false;
      s.measure();
      continue;
    }
    bool accepted = newton && step(s, 0.0, s.compliance.data());
    if (!accepted) {
      s.soften();
      if (mu == 0.0) {
        if (!start_lambda && result.iterations == 1) {
          std::fill(s.lambda.begin(), s.lambda.end(), 0.0);
          kkt_.assemble(inputs, s.x.data(), s.lambda.data(), s.force_stiffness());
        }
        mu = s.first_pseudo_stiffness(kkt_);
      }
      for (int tries = 0; tries < 40 && !(accepted = step(s, mu, s.softened.data())); ++tries) mu *= 4.0;
      mu *= 0.1;
    }
    if (!accepted) break;
    newton = true;
    s.measure();
  }
  result.residual = s.residual;
  result.force_stiffness = s.force_stiffness();
  result.energy = s.energy();
  if (!result.converged) result.message = not_converged(result, options.tolerance);
  result.x = std::move(s.x);
  result.lambda = std::move(s.lambda);
  return result;
}

}  // namespace sheetbend
