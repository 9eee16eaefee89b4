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
class Projection::Descent {
 public:
  using VectorXd = Eigen::VectorXd;

  Descent(Projection& of, const std::vector<double>& theta, double* residual, Interrupt* interrupt)
      : of_(of), theta_(theta), residual_(residual), interrupt_(interrupt) {}

  // The b at which cost and prior balance, whose residuals are written.
  VectorXd run(VectorXd trial) {
    for (int turn = 0; turn < most_steps; ++turn) {
      auto here = evaluate(trial);
      const double cost = here ? 0.5 * (sum_of_squares(here->residuals()) + trial.squaredNorm()) : cost_;
      if (cost < cost_) {
        accept(std::move(here), trial, cost);
      } else if (std::isinf(cost_)) {  // predicted too far
        if (trial == of_.b_) throw Diverged(of_.e_->steps(), 0, of_.e_->observed.times.back());
        trial = of_.b_;
        continue;
      } else if (damping_ == 0.0 && ++halvings_ <= most_halvings) {
        step_ *= 0.5;
        trial = best_ + step_;
        continue;
      } else if (!guide_anew()) {
        break;
      }
      step_ = -newton();
      decrease_ = -0.5 * gradient_.dot(step_) + 0.5 * damping_ * step_.squaredNorm();
      if (damping_ == 0.0 && decrease_ <= converged * cost_) break;
      halvings_ = 0;
      trial = best_ + step_;
    }
    if (damping_ > 0.0) of_.factor(0.0);
    if (damping_ > 0.0 || !(decrease_ <= within_rounding * cost_)) throw NoCorrection();
    return best_;
  }

 private:
  // Null where there is no motion and something else to try.
  std::unique_ptr<Corrected> evaluate(const VectorXd& trial) const {
    const bool must = std::isinf(cost_) && trial == of_.b_;
    try {
      return Corrected::at(*of_.e_, theta_.data(), of_.e_->correction.at(trial).data(), interrupt_);
    } catch (const Diverged&) {
      if (must) throw;
    } catch (const Unconverged&) {
      if (must) throw;
    } catch (const NoEquilibrium&) {
      if (must) throw;
    }
    return nullptr;
  }

  void accept(std::unique_ptr<Corrected> here, const VectorXd& trial, double cost) {
    const double gain = (cost_ - cost) / decrease_;
    const std::vector<double> by_b = here->gradient(interrupt_);
    const int unknowns = of_.unknowns();
    VectorXd next =
        VectorXd::Map(of_.e_->correction.sigma.data(), unknowns).cwiseProduct(VectorXd::Map(by_b.data(), unknowns)) +
        trial;
    if (step_.size() > 0 && step_.dot(next - gradient_) > 0.0) pairs_.emplace_back(step_, next - gradient_);
    best_ = trial;
    there_ = std::move(here);
    gradient_ = std::move(next);
    cost_ = cost;
    fresh_ = false;
    std::copy(there_->residuals().begin(), there_->residuals().end(), residual_);
    const bool damped = damping_ > 0.0;
    if (damped && gain > 0.5) damping_ = damping_ <= least_damping ? 0.0 : 0.1 * damping_;
    if (!of_.known_ || damped || since_++ == steps_per_response) relinearize();
  }

  // After steps that lowered nothing: with an A made here, then with more damping. False where nothing is left to gain, or to try.
  bool guide_anew() {
    if (damping_ > largest_damping || (damping_ == 0.0 && decrease_ <= within_rounding * cost_)) return false;
    if (!fresh_) {
      relinearize();
    } else {
      damping_ = std::max(least_damping, 10.0 * damping_);
      pairs_.clear();
      of_.factor(damping_);
    }
    return true;
  }

  void relinearize() {
    of_.linearize(*there_, {theta_, of_.e_->correction.at(best_), guiding}, damping_, interrupt_);
    pairs_.clear();
    since_ = 0;
    fresh_ = true;
  }

  VectorXd newton() const {
    VectorXd q = gradient_;
    std::vector<double> along(pairs_.size());
    for (std::size_t i = pairs_.size(); i-- > 0;) {
      const auto& [s, y] = pairs_[i];
      along[i] = s.dot(q) / s.dot(y);
      q -= along[i] * y;
    }
    q = of_.factor_.solve(q).eval();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const auto& [s, y] = pairs_[i];
      q += (along[i] - y.dot(q) / s.dot(y)) * s;
    }
    return q;
  }

  Projection& of_;
  const std::vector<double>& theta_;
  double* residual_;
  Interrupt* interrupt_;
  VectorXd best_, gradient_, step_;
  std::vector<std::pair<VectorXd, VectorXd>> pairs_;  // steps and what they change in the gradient
  std::unique_ptr<Corrected> there_;                  // at best_
  double cost_ = std::numeric_limits<double>::infinity(), decrease_ = cost_, damping_ = 0.0;
  int halvings_ = 0, since_ = 0;  // steps since A was made, or since this theta began
  bool fresh_ = false;            // A is of best_
};

void Projection::solve(const std::vector<double>& theta, const double* u, double* residual, Interrupt* interrupt) {
  renew(interrupt);
  b_ = Descent(*this, theta, residual, interrupt).run(predicted(u));
  solved_ = Eigen::VectorXd::Map(u, parameters_);
  given_ = e_->correction.at(b_);
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
