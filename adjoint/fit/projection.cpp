#include "adjoint/fit/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sheetbend {
namespace {

constexpr double converged = 1e-13;       // of the cost: what another step would take off it
constexpr double within_rounding = 1e-9;  // likewise, where no step that is tried lowers the cost any more
constexpr double guiding = 1e-2,
                 exact = 1e-8;  // of sigma: tolerances of an A that guides steps, and of one for intervals
constexpr double least_damping = 1.0, largest_damping = 1e9;
constexpr int steps_per_response = 15;  // cost less than the response does
constexpr int most_steps = 600, most_halvings = 12;

double sum_of_squares(const std::vector<double>& a) { return std::inner_product(a.begin(), a.end(), a.begin(), 0.0); }

}  // namespace

Projection::Projection(const Experiment& e, int parameters, int threads)
    : e_(&e), parameters_(parameters), threads_(threads), given_(e.correction.given) {
  b_.resize(unknowns());
  for (int i = 0, count = unknowns(); i < count; ++i) b_[i] = given_[i] / e.correction.sigma[i];
}

void Projection::linearize(const Corrected& here, Place place, double damping, Interrupt* interrupt) {
  known_ = stale_ = false;  // until all of it is there
  A_ = here.response(place.tolerance, threads_, interrupt);
  factor(damping);
  place_ = std::move(place);
  known_ = true;
  followed_ = false;
}

void Projection::factor(double damping) {
  factor_ = ResponseFactor(A_, 1.0 + damping);
  damping_ = damping;
}

void Projection::renew(Interrupt* interrupt) {
  if (!stale_) return;
  const auto here = Corrected::at(*e_, place_.theta.data(), place_.b.data(), interrupt);
  linearize(*here, Place(place_), damping_, interrupt);
}

void Projection::follow(Projection& other) {
  const Eigen::Index common = std::min(b_.size(), other.b_.size());
  b_.head(common) = other.b_.head(common);
  given_ = e_->correction.at(b_);
  if (other.unknowns() != unknowns() || other.residuals() != residuals()) return;
  other.renew(nullptr);
  if (!other.known_) return;
  A_ = other.A_;
  place_ = other.place_;
  factor_ = other.factor_;
  damping_ = other.damping_;
  known_ = followed_ = true;
  stale_ = false;
  const bool alike = other.parameters_ == parameters_;
  X_ = alike ? other.X_ : Eigen::MatrixXd();
  u_ = alike ? other.u_ : Eigen::VectorXd();
  b_there_ = alike ? other.b_there_ : Eigen::VectorXd();
  solved_ = alike ? other.solved_ : Eigen::VectorXd();
}

void Projection::save(std::vector<double>& numbers) const {
  const auto append = [&](const double* first, std::size_t size) {
    numbers.push_back(static_cast<double>(size));
    numbers.insert(numbers.end(), first, first + size);
  };
  numbers.insert(numbers.end(), {double(exact_), double(known_), double(followed_), damping_, place_.tolerance});
  append(place_.theta.data(), place_.theta.size());
  append(place_.b.data(), place_.b.size());
  for (const Eigen::VectorXd* v : {&b_, &u_, &b_there_, &solved_}) append(v->data(), v->size());
  append(X_.data(), X_.size());
}

void Projection::restore(const double*& numbers) {
  const auto next = [&] { return *numbers++; };
  const auto taken = [&] {
    const auto size = static_cast<Eigen::Index>(next());
    const Eigen::VectorXd v = Eigen::VectorXd::Map(numbers, size);
    numbers += size;
    return v;
  };
  const auto list = [&] {
    const Eigen::VectorXd v = taken();
    return std::vector<double>(v.data(), v.data() + v.size());
  };
  exact_ = next() != 0.0;
  known_ = next() != 0.0;
  const bool followed = next() != 0.0;
  damping_ = next();
  place_.tolerance = next();
  place_.theta = list();
  place_.b = list();
  for (Eigen::VectorXd* v : {&b_, &u_, &b_there_, &solved_}) *v = taken();
  const Eigen::VectorXd X = taken();
  X_ = Eigen::MatrixXd::Map(X.data(), X.size() == 0 ? 0 : unknowns(), parameters_);
  given_ = e_->correction.at(b_);
  stale_ = known_ && !(followed && followed_);
}

Eigen::VectorXd Projection::predicted(const double* u) const {
  const Eigen::Map<const Eigen::VectorXd> here(u, parameters_);
  if (X_.size() == 0 || (solved_.size() > 0 && here == solved_)) return b_;
  return b_there_ + X_ * (here - u_);
}

// Quasi-Newton steps (limited-memory BFGS, Nocedal & Wright 2006, algorithm 7.4) that begin with the normal matrix of A, from here or from an earlier
// theta: they go downhill whatever A is, are shortened until they lower the cost, and make A anew where they are many. Where no length of theirs lowers
// it, A is made anew, and from then on steps are damped (Levenberg 1944) for as long as that is needed: far from the truth a long motion answers noise
// by much more than in proportion.
void Projection::solve(const std::vector<double>& theta, const double* u, double* residual, Interrupt* interrupt) {
  using Eigen::VectorXd;
  renew(interrupt);
  VectorXd trial = predicted(u), best, gradient, step;
  std::vector<std::pair<VectorXd, VectorXd>> pairs;  // steps and what they change in the gradient
  std::unique_ptr<Corrected> there;                  // at best
  double cost = std::numeric_limits<double>::infinity(), decrease = cost, damping = 0.0;
  int halvings = 0, since = 0;  // steps since A was made, or since this theta began
  bool fresh = false;           // A is of `best`
  const auto newton = [&] {
    VectorXd q = gradient;
    std::vector<double> along(pairs.size());
    for (std::size_t i = pairs.size(); i-- > 0;) {
      const auto& [s, y] = pairs[i];
      along[i] = s.dot(q) / s.dot(y);
      q -= along[i] * y;
    }
    q = factor_.solve(q).eval();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& [s, y] = pairs[i];
      q += (along[i] - y.dot(q) / s.dot(y)) * s;
    }
    return q;
  };
  const auto relinearize = [&] {
    linearize(*there, {theta, e_->correction.at(best), guiding}, damping, interrupt);
    pairs.clear();
    since = 0;
    fresh = true;
  };
  for (int turn = 0; turn < most_steps; ++turn) {
    const bool must = std::isinf(cost) && trial == b_;  // there is nothing else to try
    std::unique_ptr<Corrected> here;
    try {
      here = Corrected::at(*e_, theta.data(), e_->correction.at(trial).data(), interrupt);
    } catch (const Diverged&) {
      if (must) throw;
    } catch (const Unconverged&) {
      if (must) throw;
    } catch (const NoEquilibrium&) {
      if (must) throw;
    }
    const double cost_here = here ? 0.5 * (sum_of_squares(here->residuals()) + trial.squaredNorm()) : cost;
    if (!(cost_here < cost)) {
      if (std::isinf(cost)) {  // predicted too far
        if (must) throw Diverged(e_->steps(), 0, e_->observed.times.back());
        trial = b_;
        continue;
      }
      if (damping == 0.0 && ++halvings <= most_halvings) {
        step *= 0.5;
        trial = best + step;
        continue;
      }
      if (damping > largest_damping || (damping == 0.0 && decrease <= within_rounding * cost)) break;
      if (!fresh) {
        relinearize();
      } else {
        damping = std::max(least_damping, 10.0 * damping);
        pairs.clear();
        factor(damping);
      }
    } else {
      const double gain = (cost - cost_here) / decrease;
      const std::vector<double> by_b = here->gradient(interrupt);
      VectorXd next =
          VectorXd::Map(e_->correction.sigma.data(), unknowns()).cwiseProduct(VectorXd::Map(by_b.data(), unknowns())) +
          trial;
      if (step.size() > 0 && step.dot(next - gradient) > 0.0) pairs.emplace_back(step, next - gradient);
      best = trial;
      there = std::move(here);
      gradient = std::move(next);
      cost = cost_here;
      fresh = false;
      std::copy(there->residuals().begin(), there->residuals().end(), residual);
      const bool damped = damping > 0.0;
      if (damped && gain > 0.5) damping = damping <= least_damping ? 0.0 : 0.1 * damping;
      if (!known_ || damped || since++ == steps_per_response) relinearize();
    }
    step = -newton();
    decrease = -0.5 * gradient.dot(step) + 0.5 * damping * step.squaredNorm();
    if (damping == 0.0 && decrease <= converged * cost) break;
    halvings = 0;
    trial = best + step;
  }
  if (damping > 0.0) factor(0.0);
  if (damping > 0.0 || !(decrease <= within_rounding * cost)) throw NoCorrection();
  b_ = best;
  solved_ = VectorXd::Map(u, parameters_);
  given_ = e_->correction.at(best);
  if (exact_)
    linearize(*Corrected::at(*e_, theta.data(), given_.data(), interrupt), {theta, given_, exact}, 0.0, interrupt);
  exact_ = false;
}

void Projection::reduce(double* change, double* prior_change) {
  renew(nullptr);
  Eigen::Map<Eigen::VectorXd> r(change, A_.rows);
  const Eigen::VectorXd x = -factor_.solve(A_.transposed(r));
  r += A_.times(x);
  Eigen::VectorXd::Map(prior_change, unknowns()) = x;
}

void Projection::project(const double* u, const double* residual, double* jacobian, double* prior_jacobian) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor> J(jacobian, A_.rows, parameters_), P(prior_jacobian, unknowns(), parameters_);
  const Eigen::Map<const Eigen::VectorXd> r(residual, A_.rows);
  X_ = -factor_.solve(A_.transposed(J));
  u_ = Eigen::Map<const Eigen::VectorXd>(u, parameters_);
  b_there_ = b_;
  J += A_.times(X_);
  P = X_;
  // What an A of an earlier theta adds to the gradient, taken out again along the residuals: nothing where A is exact.
  const Eigen::VectorXd excess = X_.transpose() * (A_.transposed(r) + b_);
  const double size = r.squaredNorm() + b_.squaredNorm();
  if (size == 0.0) return;
  J -= r * excess.transpose() / size;
  P -= b_ * excess.transpose() / size;
}

}  // namespace sheetbend
