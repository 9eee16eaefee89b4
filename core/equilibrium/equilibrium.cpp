#include "core/equilibrium/equilibrium.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/equilibrium/equilibrium_state.h"
#include "core/equilibrium/residual.h"

namespace sheetbend {
namespace {

constexpr int max_corrections = 5;        // simplified Newton steps per factorization
constexpr int max_departures = 10;        // from saddles
constexpr double almost_no_eta = 1e-100;  // to which only rigid rows count, see redundant_rows.h

std::string not_converged(const Equilibrium& e, double tolerance, bool touching) {
  std::ostringstream text;
  text << "equilibrium: no rest found in " << e.iterations << " iterations, relative residual " << e.residual
       << " (tolerance " << tolerance << ")";
  if (touching && e.residual <= near_rest)
    text << ". Forces nearly balance, but a part moves freely. Fix: hold it, or let friction hold it, which acts on "
            "what touches at the start (to 1e-6 m)";
  else
    text << ". Fix: start nearer to the shape, give more iterations, or check that supports"
         << (touching ? " and friction" : "") << " hold every part against its loads";
  return text.str();
}

}  // namespace

// One step of pseudo-time (of Newton for mu = 0) from an assembled matrix; false, with nothing changed, where it is not to be trusted. Constraints
// that alpha says are rigid lose this share of their violation.
bool EquilibriumSolver::step(State& s, double mu, const double* alpha, double share) {
  if (!kkt_.factorize(mu, alpha)) return false;
  if (mu == 0.0 && kkt_.negative_modes() == 0) s.falling = false;
  if (s.options.stable && (s.residual > near_rest || s.falling) && kkt_.negative_modes() > 0) return false;
  std::vector<double> x = s.x, lambda = s.lambda, dx, dl;
  double first = 0.0, before = 0.0;
  std::vector<double> left(lambda.size(), 0.0);
  if (share < 1.0) {
    s.evaluate(x, lambda);
    s.for_each_row([&](int c, int row) { left[row] = alpha[c] == 0.0 ? (1.0 - share) * s.r_l[row] : 0.0; });
  }
  for (int k = 0; k < max_corrections; ++k) {
    s.evaluate(x, lambda);
    dx = s.r_x;
    dl = s.r_l;
    for (int i = 0; i < scene_.dofs(); ++i) dx[i] = -(dx[i] - mu * kkt_.metric(i) * (x[i] - s.x[i]));
    s.for_each_row(
        [&](int c, int row) { dl[row] = -(dl[row] - left[row] + (alpha[c] - s.compliance[c]) * lambda[row]); });
    if (!finite(dx) || !finite(dl) || !kkt_.solve(dx.data(), dl.data(), 1e-8)) return false;
    for (int i = 0; i < scene_.dofs(); ++i) x[i] += dx[i];
    for (std::size_t i = 0; i < lambda.size(); ++i) lambda[i] += dl[i];
    const double size = largest(dx);
    if (k == 0) first = size;
    const bool negligible = size <= 1e-14 * s.size;
    if (k > 0 && size > 0.5 * before && !negligible) return false;
    if (negligible || (k > 0 && size < 0.02 * first)) {
      if (!finite(x) || !finite(lambda)) return false;
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

// Leaves out the rigid rows that others say already at the state's x.
void EquilibriumSolver::find_redundant_rows(State& s) {
  if (!s.any_rigid()) return;
  if (!blocks_) {
    Scene constraints = scene_;
    constraints.volumes.clear();
    constraints.contacts.clear();
    blocks_ = make_plan(constraints, {});
  }
  std::vector<double> w(scene_.nodes());
  for (int n = 0; n < scene_.nodes(); ++n) w[n] = scene_.role[n] == Role::free;
  s.leave_out(redundant_rows(scene_, *blocks_, s.in.data, s.x.data(), w.data(), almost_no_eta));
}

// The multipliers that would hold the start best: those of one heavily damped step from it, which is not taken.
void EquilibriumSolver::estimate_multipliers(State& s) {
  assemble(s);
  const double mu = s.first_pseudo_stiffness(kkt_);
  std::vector<double> x = s.r_x, lambda = s.r_l;
  for (double& r : x) r = -r;
  for (double& r : lambda) r = -r;
  if (kkt_.factorize(mu, s.compliance.data()) && kkt_.solve(x.data(), lambda.data(), 1e-3))
    s.lambda = lambda;
  else
    s.take_elastic_multipliers();
}

void EquilibriumSolver::assemble(State& s) {
  kkt_.assemble(s.in.data, s.x.data(), s.lambda.data(), s.force_stiffness(), s.left_out);
  kkt_.take_contacts(s.modes.blocks(s.contacts, s.x.data()));
}

// The lowest mode of K on the tangent space of the rigid rows, by inverse iteration on a K + mu that is positive definite, with mu ever closer to minus
// the Rayleigh quotient. Empty where no direction of negative curvature is found.
EquilibriumSolver::Mode EquilibriumSolver::lowest_mode(const State& s) {
  const double* alpha = s.compliance.data();
  const auto definite = [&](double mu) { return kkt_.factorize(mu, alpha) && kkt_.negative_modes() == 0; };
  double mu = s.force_stiffness();
  for (int k = 0; !definite(mu); ++k, mu *= 4.0)
    if (k == 50) return {};
  Mode mode;
  std::vector<double> v(scene_.dofs()), w, rows(scene_.multipliers());
  for (int i = 0; i < scene_.dofs(); ++i) v[i] = std::sin(1.0 + 1.7 * i);
  const auto product = [&](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (int i = 0; i < scene_.dofs(); ++i) sum += kkt_.metric(i) * a[i] * b[i];
    return sum;
  };
  for (int k = 0; k < 60; ++k) {
    w = v;
    for (int i = 0; i < scene_.dofs(); ++i) w[i] *= kkt_.metric(i);
    std::fill(rows.begin(), rows.end(), 0.0);
    if (!kkt_.solve(w.data(), rows.data(), 1e-6) || !finite(w)) return {};
    const double before = mode.curvature, length2 = product(w, w);
    mode.curvature = -product(w, v) / length2 - mu;  // A has -K
    for (int i = 0; i < scene_.dofs(); ++i) v[i] = w[i] / std::sqrt(length2);
    if (mode.curvature < 0.0 && std::abs(mode.curvature - before) < 0.01 * -mode.curvature) {
      mode.direction = std::move(v);
      return mode;
    }
    const double nearer = mode.curvature < 0.0 ? std::min(mu, -1.2 * mode.curvature) : 0.2 * mu;
    if (nearer < mu && definite(nearer))
      mu = nearer;
    else
      definite(mu);
  }
  return {};
}

// Steps off a saddle to a shape of less energy: a proximal step from a little to each side along its lowest mode, so little that the energy falls on both.
// Of these that is taken where it falls less, since a stable shape that is near lies there. At a surface it may fall on one side only. From then on no step
// goes toward a saddle until K has been positive definite. False, with nothing changed, where the energy falls by no more than rounding.
bool EquilibriumSolver::leave_saddle(State& s, double& mu) {
  const Mode mode = lowest_mode(s);
  if (mode.direction.empty()) return false;
  const std::vector<double> x = s.x, lambda = s.lambda;
  const double from = s.energy(), rounding = 1e-14 * (std::abs(from) + s.total * s.size);
  double longest = 0.0;
  for (int i = 0; i < scene_.dofs(); ++i)
    longest = std::max(longest, std::sqrt(kkt_.metric(i)) * std::abs(mode.direction[i]));
  mu = -2.0 * mode.curvature;
  s.exact = s.falling = true;
  s.softened = s.compliance;
  struct Side {
    std::vector<double> x, lambda;
    double fall = 0.0;
  };
  const auto side = [&](double way) {
    s.x = x;
    s.lambda = lambda;
    for (int i = 0; i < scene_.dofs(); ++i) s.x[i] += way / longest * mode.direction[i];
    retract_directors(scene_, s.x.data());
    s.measure();
    assemble(s);
    Side reached;
    for (int k = 0; k < 6; ++k)
      if (step(s, std::pow(4.0, k) * mu, s.compliance.data())) {
        s.measure();
        reached = {s.x, s.lambda, from - s.energy()};
        break;
      }
    return reached;
  };
  Side to{x, lambda};
  bool both = false;
  for (double way = 0.1 * s.edge; !both && way > 1e-7 * s.edge; way *= 0.25) {
    Side left = side(way), right = side(-way);
    both = std::min(left.fall, right.fall) > rounding;
    const bool to_left = both ? left.fall <= 1.001 * right.fall : left.fall > right.fall;
    Side& one = to_left ? left : right;
    if (both || (to.fall == 0.0 && one.fall > rounding)) to = std::move(one);
  }
  s.falling = to.fall > 0.0;
  s.x = std::move(to.x);
  s.lambda = std::move(to.lambda);
  s.last_step = std::numeric_limits<double>::infinity();
  s.measure();
  return s.falling;
}

// A step of pseudo-time, with mu raised until it is to be trusted; the next one then begins with less. False where no mu helps. Multipliers that
// are but guessed go first.
bool EquilibriumSolver::damped_step(State& s, double& mu, bool guessed) {
  s.soften();
  if (mu == 0.0) {
    if (guessed) {
      std::fill(s.lambda.begin(), s.lambda.end(), 0.0);
      assemble(s);
    }
    mu = s.first_pseudo_stiffness(kkt_);
  }
  bool accepted = false;
  const double least = mu;
  for (int tries = 0; tries < 40 && !(accepted = step(s, mu, s.softened.data())); ++tries) mu *= 4.0;
  if (!accepted) mu = least;
  // What is rigid asks for its whole way in one step, whatever mu is.
  for (double share = 0.25; share > 1e-9 && !accepted; share *= 0.25, mu *= 4.0)
    accepted = step(s, mu, s.softened.data(), share);
  mu *= 0.1;
  return accepted;
}

Equilibrium EquilibriumSolver::solve(const double* inputs, const double* start_x, const double* start_lambda,
                                     const EquilibriumOptions& options, Interrupt* interrupt) {
  State s(scene_, inputs, start_x, start_lambda, options);
  Equilibrium result;
  result.t0 = options.t0;
  double mu = 0.0;
  bool newton = true;
  int departures = 0;
  find_redundant_rows(s);
  if (!start_lambda) estimate_multipliers(s);
  for (std::size_t v = 0; v < scene_.volumes.size(); ++v)
    s.inflation.push_back(0.5 * std::abs(s.missing_volume(v) * s.lambda[scene_.rows + v]));
  s.measure();
  while (result.iterations < options.max_iterations) {
    if (interrupt) interrupt->poll();
    if (s.converged() || !s.left_out.empty()) {  // others may be redundant than at the start
      find_redundant_rows(s);
      s.measure();
    }
    assemble(s);
    ++result.iterations;
    if (!s.falling && (s.converged() || s.find_unstressed())) {
      result.unstable_modes = kkt_.factorize(0.0, s.compliance.data()) ? kkt_.negative_modes() : -1;
      result.converged = true;
      if (!options.stable || result.unstable_modes <= 0 || departures == max_departures || !leave_saddle(s, mu)) break;
      ++departures;
      result.converged = newton = false;
      continue;
    }
    const bool guessed = !start_lambda && result.iterations == 1;
    if (!(newton && step(s, 0.0, s.compliance.data())) && !damped_step(s, mu, guessed)) break;
    newton = true;
    s.measure();
  }
  result.residual = s.residual;
  result.force_stiffness = s.force_stiffness();
  result.energy = s.energy();
  if (!result.converged) result.message = not_converged(result, options.tolerance, !scene_.contacts.empty());
  result.left_out = std::move(s.left_out);
  if (options.held) result.held.assign(options.held, options.held + scene_.dofs());
  result.x = std::move(s.x);
  result.lambda = std::move(s.lambda);
  return result;
}

}  // namespace sheetbend
