#include "adjoint/fit/problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>

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

Problem::Problem(std::vector<Experiment> experiments, std::vector<double> theta,
                 std::vector<std::vector<int>> slots_of_experiment, std::vector<FreeParameter> free, int threads)
    : experiments_(std::move(experiments)),
      theta_(std::move(theta)),
      slots_(std::move(slots_of_experiment)),
      free_(std::move(free)),
      first_row_{0},
      threads_(threads) {
  for (std::size_t i = 0; i < experiments_.size(); ++i) {
    experiments_[i].check();
    first_row_.push_back(first_row_.back() + static_cast<int>(experiments_[i].residual_count()));
    const std::set<int> used(slots_[i].begin(), slots_[i].end());
    columns_.emplace_back();
    for (int k = 0; k < parameters(); ++k)
      if (std::any_of(free_[k].slots.begin(), free_[k].slots.end(), [&](int slot) { return used.contains(slot); }))
        columns_[i].push_back(k);
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

// The first sweep of an experiment also writes its residuals.
template <int N>
void Problem::evaluate_columns(const double* u, int experiment, int first, double* residual, double* jacobian,
                               Interrupt* interrupt) const {
  using D = Dual<double, N>;
  const std::vector<int>& columns = columns_[experiment];
  const int count = std::min(N, static_cast<int>(columns.size()) - first);
  std::vector<D> duals(u, u + parameters()), theta(theta_.size());
  for (int k = 0; k < count; ++k) duals[columns[first + k]].d[k] = 1.0;
  set_theta(duals.data(), theta.data());
  const int rows = first_row_[experiment + 1] - first_row_[experiment];
  std::vector<D> r(rows);
  experiments_[experiment].residuals(local_theta(theta, experiment).data(), r.data(), static_cast<D*>(nullptr),
                                     interrupt);
  for (int i = 0; i < rows; ++i) {
    const std::size_t row = first_row_[experiment] + i;
    if (first == 0) residual[row] = r[i].v;
    for (int k = 0; k < count; ++k) jacobian[row * parameters() + columns[first + k]] = r[i].d[k];
  }
}

std::vector<Problem::Sweep> Problem::sweeps(bool jacobian) const {
  std::vector<Sweep> list;
  for (int e = 0; e < static_cast<int>(experiments_.size()); ++e) {
    const int columns = jacobian ? static_cast<int>(columns_[e].size()) : 0;
    if (columns == 0) list.push_back({e, 0, 0});
    for (int first = 0; first < columns; first += 8) list.push_back({e, first, columns - first <= 4 ? 4 : 8});
  }
  return list;
}

bool Problem::evaluate(const double* u, double* residual, double* jacobian, Interrupt* interrupt) const {
  const int p = parameters();
  if (jacobian) std::fill_n(jacobian, static_cast<std::size_t>(rows()) * p, 0.0);
  const std::vector<Sweep> jobs = sweeps(jacobian != nullptr);
  std::mutex failing;
  bool ok = true;
  parallel_for(static_cast<int>(jobs.size()), threads_, 1, [&](int begin, int end) {
    for (int job = begin; job < end; ++job) {
      const auto [e, first, width] = jobs[job];
      const auto fail = [&, e = e](const std::exception& error) {
        std::lock_guard lock(failing);
        ok = false;
        failure_ = experiments_[e].name + ": " + error.what();
      };
      try {
        if (width == 0) {
          std::vector<double> theta(theta_.size());
          set_theta(u, theta.data());
          experiments_[e].residuals(local_theta(theta, e).data(), residual + first_row_[e],
                                    static_cast<double*>(nullptr), interrupt);
        } else if (width == 4) {
          evaluate_columns<4>(u, e, first, residual, jacobian, interrupt);
        } else {
          evaluate_columns<8>(u, e, first, residual, jacobian, interrupt);
        }
      } catch (const Diverged& error) {
        fail(error);
      } catch (const Unconverged& error) {
        fail(error);
      } catch (const NoEquilibrium& error) {
        fail(error);
      }
    }
  });
  int row = data_rows();
  for (int i = 0; i < p; ++i) {
    if (!free_[i].has_prior) continue;
    residual[row] = (u[i] - free_[i].prior_mean) / free_[i].prior_sd;
    if (jacobian)
      for (int k = 0; k < p; ++k)
        jacobian[static_cast<std::size_t>(row) * p + k] = k == i ? 1.0 / free_[i].prior_sd : 0.0;
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
