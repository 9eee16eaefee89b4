#include "adjoint/fit/ceres_fit.h"

#include <ceres/ceres.h>
#if __has_include(<glog/logging.h>)
#include <glog/logging.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>

namespace sheetbend {
namespace {

// A Jacobian that costs less than this many times the residuals alone is made with them: most steps are taken, and then Ceres asks for it.
constexpr double cheap = 3.0;

// Entries of the largest Jacobian that is kept for the caller, 64 MB.
constexpr std::size_t most_kept = std::size_t{1} << 23;

// All experiments are simulated once per point, here, before Ceres asks for residuals.
class Point : public ceres::EvaluationCallback {
 public:
  Point(const EvaluationFunction& evaluation, const std::vector<double>& u, const CeresOptions& options)
      : evaluation_(evaluation),
        u_(u),
        longest_(options.longest_step),
        seconds_{options.residual_seconds, std::numeric_limits<double>::infinity()},
        residual(evaluation.rows),
        jacobian(static_cast<std::size_t>(evaluation.rows) * u.size()) {}

  void PrepareForEvaluation(bool with_jacobian, bool new_point) override {
    prepare(with_jacobian, new_point);
    if (!with_jacobian || status != EvaluationStatus::ok || jacobian.size() > most_kept) return;
    accepted_u = u_;
    accepted_residual = residual;
    accepted_jacobian = jacobian;
  }

 private:
  void prepare(bool with_jacobian, bool new_point) {
    if (with_jacobian) last_ = u_;  // also where the Jacobian was made along before: steps must not depend on that
    if ((!new_point || u_ == at_) && (!with_jacobian || has_jacobian_)) return;
    if (status == EvaluationStatus::interrupted) return;
    if (!with_jacobian && too_far()) {
      status = EvaluationStatus::no_answer;
      has_jacobian_ = false;
      at_ = u_;
      return;
    }
    const bool both = with_jacobian || evaluation_.jacobian_along || seconds_[1] < cheap * seconds_[0];
    double seconds = 0.0;
    status =
        evaluation_.call(evaluation_.problem, u_.data(), residual.data(), both ? jacobian.data() : nullptr, &seconds);
    if (status == EvaluationStatus::ok && std::isfinite(seconds)) seconds_[both] = seconds;
    has_jacobian_ = both;
    at_ = u_;
    ++evaluations;
    jacobians += both;
  }

  // A step longer than it may be is refused without a run, so that the trust region shrinks at no cost: its radius is in units of the
  // Jacobian's columns, no limit in logarithms. Ceres asks for a Jacobian only at points that it goes on from.
  bool too_far() const {
    if (last_.empty()) return false;
    for (std::size_t i = 0; i < u_.size(); ++i)
      if (std::abs(u_[i] - last_[i]) > longest_[i]) return true;
    return false;
  }

  const EvaluationFunction& evaluation_;
  const std::vector<double>& u_;
  const std::vector<double>& longest_;
  std::vector<double> at_, last_;
  bool has_jacobian_ = false;
  double seconds_[2];  // of the last evaluation without, with a Jacobian

 public:
  std::vector<double> residual, jacobian;
  std::vector<double> accepted_u, accepted_residual, accepted_jacobian;  // where Ceres last asked for a Jacobian
  EvaluationStatus status = EvaluationStatus::ok;
  int evaluations = 0, jacobians = 0;
};

class Residuals : public ceres::CostFunction {
 public:
  Residuals(const Point& point, int parameters) : point_(point) {
    mutable_parameter_block_sizes()->push_back(parameters);
    set_num_residuals(static_cast<int>(point.residual.size()));
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    std::copy(point_.residual.begin(), point_.residual.end(), residuals);
    if (jacobians && jacobians[0]) std::copy(point_.jacobian.begin(), point_.jacobian.end(), jacobians[0]);
    return point_.status == EvaluationStatus::ok;
  }

 private:
  const Point& point_;
};

// Ceres logs failed evaluations whatever its options say; the result tells of them. Its own small stand-in for glog has no such flag.
class Quiet {
#ifdef GLOG_EXPORT
 public:
  Quiet() { FLAGS_minloglevel = google::GLOG_FATAL; }
  ~Quiet() { FLAGS_minloglevel = before_; }

 private:
  const int before_ = FLAGS_minloglevel;
#endif
};

class Callback : public ceres::IterationCallback {
 public:
  Callback(const Observe& observe, const Point& point, const std::vector<double>& u)
      : observe_(observe), point_(point), u_(u) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    if (point_.status == EvaluationStatus::interrupted) return ceres::SOLVER_ABORT;
    return observe_({s.iteration, s.cost, s.step_norm, s.gradient_max_norm}, u_) ? ceres::SOLVER_CONTINUE
                                                                                 : ceres::SOLVER_ABORT;
  }

 private:
  const Observe& observe_;
  const Point& point_;
  const std::vector<double>& u_;
};

}  // namespace

CeresResult minimize_with_ceres(const EvaluationFunction& evaluation, std::vector<double> u,
                                const std::vector<double>& lower, const std::vector<double>& upper,
                                const CeresOptions& options, const Observe& observe) {
  Point point(evaluation, u, options);
  Callback callback(observe, point, u);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &point;
  ceres::Problem problem(problem_options);
  problem.AddParameterBlock(u.data(), static_cast<int>(u.size()));
  problem.AddResidualBlock(new Residuals(point, static_cast<int>(u.size())), nullptr, u.data());
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (std::isfinite(lower[i])) problem.SetParameterLowerBound(u.data(), static_cast<int>(i), lower[i]);
    if (std::isfinite(upper[i])) problem.SetParameterUpperBound(u.data(), static_cast<int>(i), upper[i]);
  }
  // With a bound Ceres searches along each step that it projects, which is slow where parameters rest on theirs: those are left out.
  if (!options.held.empty())
    problem.SetManifold(u.data(), new ceres::SubsetManifold(static_cast<int>(u.size()), options.held));

  ceres::Solver::Options o;
  o.minimizer_type = ceres::TRUST_REGION;
  o.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  o.linear_solver_type = ceres::DENSE_QR;
  o.num_threads = 1;
  o.max_num_iterations = options.max_iterations;
  o.function_tolerance = options.function_tolerance;
  o.gradient_tolerance = options.gradient_tolerance;
  o.parameter_tolerance = options.parameter_tolerance;
  o.max_num_consecutive_invalid_steps = 20;
  // With bounds Ceres also searches along each step; cubic interpolation would ask for a Jacobian at every trial of it.
  o.line_search_interpolation_type = ceres::QUADRATIC;
  o.logging_type = ceres::SILENT;
  o.update_state_every_iteration = true;
  o.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  [[maybe_unused]] const Quiet quiet;
  ceres::Solve(o, &problem, &summary);

  CeresResult result;
  result.u = u;
  result.cost = summary.final_cost;
  result.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  result.evaluations = point.evaluations;
  result.jacobians = point.jacobians;
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.stopped = summary.termination_type == ceres::USER_FAILURE || point.status == EvaluationStatus::interrupted;
  result.message = summary.message;
  if (point.accepted_u == u) {
    result.residual = std::move(point.accepted_residual);
    result.jacobian = std::move(point.accepted_jacobian);
  }
  return result;
}

}  // namespace sheetbend
