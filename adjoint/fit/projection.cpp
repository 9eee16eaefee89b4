#include "adjoint/fit/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/threads/pool.h"

namespace sheetbend {
namespace {

constexpr double largest = 2e9;           // bytes of A
constexpr double converged = 1e-13;       // of the cost: what another step would take off it
constexpr double within_rounding = 1e-9;  // likewise, where no step that is tried lowers the cost any more
constexpr int steps_per_matrix = 15;      // cost less than the matrix does
constexpr int most_steps = 600, most_halvings = 12;

double squared(const std::vector<double>& a) {
  double sum = 0.0;
  for (const double x : a) sum += x * x;
  return sum;
}

}  // namespace

Projection::Projection(const Experiment& e, int threads)
    : e_(&e), threads_(threads), weight_(1.0 / (e.correction.sigma * e.correction.sigma)), b_(e.correction.given) {
  const double bytes = 8.0 * static_cast<double>(e.residual_count()) * unknowns();
  if (bytes > largest)
    throw std::invalid_argument(
        e.name + ".driven_sigma: has " + std::to_string(unknowns()) + " coordinates to correct, more than " +
        std::to_string(e.residual_count()) +
        " residuals leave memory for. Fix: fit a shorter part, or fewer frames of every second");
}

void Projection::linearize(const CorrectedMotion& motion, Interrupt* interrupt) {
  A_.resize(0, 0);  // until all of it is there
  Eigen::MatrixXd A(static_cast<Eigen::Index>(e_->residual_count()), unknowns());
  parallel_for((unknowns() + 7) / 8, threads_, 1, [&](int begin, int end) {
    for (int group = begin; group < end; ++group) {
      const int first = 8 * group;
      motion.columns(first, std::min(8, unknowns() - first), &A(0, first), interrupt);
    }
  });
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns(), unknowns());
  normal.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
  normal.diagonal().array() += weight_;
  normal_.compute(normal);
  A_ = std::move(A);
}

std::vector<double> Projection::predicted(const double* u) const {
  if (X_.size() == 0) return b_;
  const Eigen::VectorXd b = b_there_ + X_ * (Eigen::Map<const Eigen::VectorXd>(u, u_.size()) - u_);
  return {b.data(), b.data() + b.size()};
}

// Quasi-Newton steps (limited-memory BFGS, Nocedal & Wright 2006, algorithm 7.4) that begin with the normal matrix of A, from here or from an earlier
// theta: they go downhill whatever A is, are shortened until they lower the cost, and make A anew where they are many.
void Projection::solve(const double* theta, const double* u, double* residual, Interrupt* interrupt) {
  using Eigen::VectorXd;
  const auto vector = [](const std::vector<double>& a) {
    return Eigen::Map<const VectorXd>(a.data(), static_cast<Eigen::Index>(a.size()));
  };
  std::vector<double> trial = predicted(u);
  VectorXd best, gradient, step;
  std::vector<std::pair<VectorXd, VectorXd>> pairs;  // steps and what they change in the gradient
  double cost = std::numeric_limits<double>::infinity(), decrease = cost;
  int halvings = 0, since = 0;  // steps since A was made, or since this theta began
  const auto newton = [&] {
    VectorXd q = gradient;
    std::vector<double> along(pairs.size());
    for (std::size_t i = pairs.size(); i-- > 0;) {
      const auto& [s, y] = pairs[i];
      along[i] = s.dot(q) / s.dot(y);
      q -= along[i] * y;
    }
    q = normal_.solve(q).eval();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& [s, y] = pairs[i];
      q += (along[i] - y.dot(q) / s.dot(y)) * s;
    }
    return q;
  };
  for (int turn = 0; turn < most_steps; ++turn) {
    std::optional<CorrectedMotion> motion;
    try {
      motion.emplace(*e_, theta, trial.data(), interrupt);
    } catch (const Diverged&) {
      if (std::isinf(cost) && trial == b_) throw;
    }
    const double here = motion ? 0.5 * (squared(motion->residuals()) + weight_ * squared(trial)) : cost;
    if (!(here < cost)) {
      if (std::isinf(cost)) {  // predicted too far
        if (trial == b_) throw Diverged(e_->steps(), 0, e_->observed.times.back());
        trial = b_;
        continue;
      }
      if (++halvings <= most_halvings) {
        step *= 0.5;
      } else if (!pairs.empty()) {  // once more without them
        pairs.clear();
        step = -newton();
        halvings = 0;
      } else {
        break;
      }
      VectorXd::Map(trial.data(), step.size()) = best + step;
      continue;
    }
    VectorXd next = vector(motion->gradient(interrupt)) + weight_ * vector(trial);
    if (step.size() > 0 && step.dot(next - gradient) > 0.0) pairs.emplace_back(step, next - gradient);
    best = vector(trial);
    gradient = std::move(next);
    cost = here;
    std::copy(motion->residuals().begin(), motion->residuals().end(), residual);
    if (A_.size() == 0 || since++ == steps_per_matrix) {
      linearize(*motion, interrupt);
      pairs.clear();
      since = 0;
    }
    step = -newton();
    decrease = -0.5 * gradient.dot(step);
    if (decrease <= converged * cost) break;
    halvings = 0;
    VectorXd::Map(trial.data(), step.size()) = best + step;
  }
  if (!(decrease <= within_rounding * cost)) throw NoCorrection();
  b_.assign(best.data(), best.data() + best.size());
  if (exact_) linearize(CorrectedMotion(*e_, theta, b_.data(), interrupt), interrupt);
  exact_ = false;
}

void Projection::project(const double* u, const double* residual, double* jacobian, double* prior_jacobian,
                         int parameters) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor> J(jacobian, A_.rows(), parameters), P(prior_jacobian, unknowns(), parameters);
  const Eigen::Map<const Eigen::VectorXd> r(residual, A_.rows()), b(b_.data(), unknowns());
  X_ = -normal_.solve(A_.transpose() * J);
  u_ = Eigen::Map<const Eigen::VectorXd>(u, parameters);
  b_there_ = b;
  J += A_ * X_;
  P = std::sqrt(weight_) * X_;
  // What an A of an earlier theta adds to the gradient, taken out again along the residuals: nothing where A is exact.
  const Eigen::VectorXd excess = X_.transpose() * (A_.transpose() * r + weight_ * b);
  const double size = r.squaredNorm() + weight_ * b.squaredNorm();
  if (size == 0.0) return;
  J -= r * excess.transpose() / size;
  P -= std::sqrt(weight_) * b * excess.transpose() / size;
}

double Projection::absorbed() const {
  const Eigen::MatrixXd inverse = normal_.solve(Eigen::MatrixXd::Identity(unknowns(), unknowns()));
  return unknowns() - weight_ * inverse.trace();
}

}  // namespace sheetbend
