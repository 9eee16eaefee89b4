#include "adjoint/fit/problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "adjoint/equilibrium_tangents.h"
#include "core/scalar/dual.h"
#include "core/threads/pool.h"

namespace sheetbend {
namespace {

inline double exp(double a) { return std::exp(a); }
template <int N>
Dual<double, N> exp(const Dual<double, N>& a) {
  const double e = std::exp(a.v);
  return Dual<double, N>::map(a, e, e);
}

}  // namespace

Problem::Problem(std::vector<Experiment> experiments, std::vector<double> theta, std::vector<std::vector<int>> slots_of_experiment,
                 std::vector<FreeParameter> free, int threads)
    : experiments_(std::move(experiments)), theta_(std::move(theta)), slots_(std::move(slots_of_experiment)), free_(std::move(free)),
      first_row_{0}, threads_(threads) {
  for (const Experiment& e : experiments_) {
    e.check();
    first_row_.push_back(first_row_.back() + static_cast<int>(e.residual_count()));
  }
  for (const FreeParameter& p : free_) priors_ += p.has_prior;
}

template <class T>
void Problem::set_theta(const T* u, T* theta) const {
  for (std::size_t i = 0; i < theta_.size(); ++i) theta[i] = T(theta_[i]);
  for (std::size_t i = 0; i < free_.size(); ++i) {
    const T value = free_[i].log_scale ? exp(u[i]) : u[i];
    for (std::size_t k = 0; k < free_[i].slots.size(); ++k) theta[free_[i].slots[k]] = T(free_[i].factors[k]) * value;
  }
}

template <class T>
std::vector<T> Problem::local_theta(const std::vector<T>& theta, int experiment) const {
  std::vector<T> local;
  for (const int slot : slots_[experiment]) local.push_back(theta[slot]);
  return local;
}

// One sweep carries N columns of the Jacobian of one experiment; the first sweep also writes the residuals.
template <int N>
void Problem::evaluate_columns(const double* u, int experiment, int first_column, double* residual, double* jacobian,
                               Interrupt* interrupt) const {
  using D = Dual<double, N>;
  const int columns = std::min(N, parameters() - first_column);
  std::vector<D> duals(u, u + parameters()), theta(theta_.size());
  for (int k = 0; k < columns; ++k) duals[first_column + k].d[k] = 1.0;
  set_theta(duals.data(), theta.data());
  const int rows = first_row_[experiment + 1] - first_row_[experiment];
  std::vector<D> r(rows);
  experiments_[experiment].residuals(local_theta(theta, experiment).data(), r.data(), static_cast<D*>(nullptr), interrupt);
  for (int i = 0; i < rows; ++i) {
    const std::size_t row = first_row_[experiment] + i;
    if (first_column == 0) residual[row] = r[i].v;
    for (int k = 0; k < columns; ++k) jacobian[row * parameters() + first_column + k] = r[i].d[k];
  }
}

bool Problem::evaluate(const double* u, double* residual, double* jacobian, Interrupt* interrupt) const {
  const int p = parameters(), n = static_cast<int>(experiments_.size());
  const int width = jacobian ? (p <= 4 ? 4 : 8) : std::max(p, 1);
  const int sweeps = (p + width - 1) / width;
  std::mutex failing;
  bool ok = true;
  parallel_for(n * sweeps, threads_, 1, [&](int begin, int end) {
    for (int job = begin; job < end; ++job) {
      const int e = job / sweeps, column = (job % sweeps) * width;
      try {
        if (!jacobian) {
          std::vector<double> theta(theta_.size());
          set_theta(u, theta.data());
          experiments_[e].residuals(local_theta(theta, e).data(), residual + first_row_[e], static_cast<double*>(nullptr), interrupt);
        } else if (width == 4) {
          evaluate_columns<4>(u, e, column, residual, jacobian, interrupt);
        } else {
          evaluate_columns<8>(u, e, column, residual, jacobian, interrupt);
        }
      } catch (const Diverged& error) {
        std::lock_guard lock(failing);
        ok = false;
        failure_ = experiments_[e].name + ": " + error.what();
      } catch (const NoEquilibrium& error) {
        std::lock_guard lock(failing);
        ok = false;
        failure_ = experiments_[e].name + ": " + error.what();
      }
    }
  });
  int row = data_rows();
  for (int i = 0; i < p; ++i) {
    if (!free_[i].has_prior) continue;
    residual[row] = (u[i] - free_[i].prior_mean) / free_[i].prior_sd;
    if (jacobian)
      for (int k = 0; k < p; ++k) jacobian[static_cast<std::size_t>(row) * p + k] = k == i ? 1.0 / free_[i].prior_sd : 0.0;
    ++row;
  }
  return ok && std::all_of(residual, residual + rows(), [](double r) { return std::isfinite(r); });
}

std::vector<double> Problem::simulate(int experiment, const double* u, Interrupt* interrupt) const {
  const Experiment& e = experiments_.at(experiment);
  std::vector<double> theta(theta_.size()), markers(e.observed.measured.size());
  set_theta(u, theta.data());
  e.residuals(local_theta(theta, experiment).data(), static_cast<double*>(nullptr), markers.data(), interrupt);
  return markers;
}

std::vector<double> Problem::physical(const double* u) const {
  std::vector<double> theta(theta_.size());
  set_theta(u, theta.data());
  return theta;
}

}  // namespace sheetbend
