#include "adjoint/fit/problem.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>

#include "adjoint/equilibrium/equilibrium_tangents.h"
#include "core/scalar/dual.h"
#include "core/threads/pool.h"

namespace sheetbend {
namespace {

std::mutex failing;  // over what is said of failures

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
  for (const Experiment& e : experiments_) {
    projections_.push_back(e.correction.unknowns() > 0 ? std::make_unique<Projection>(e, parameters(), threads_)
                                                       : nullptr);
    corrections_ += e.correction.unknowns();
  }
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
std::vector<T> Problem::local_theta(const T* u, int experiment) const {
  std::vector<T> theta(theta_.size()), local;
  set_theta(u, theta.data());
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
  std::vector<D> duals(u, u + parameters());
  for (int k = 0; k < count; ++k) duals[columns[first + k]].d[k] = 1.0;
  const int rows = first_row_[experiment + 1] - first_row_[experiment];
  std::vector<D> r(rows);
  const std::vector<D> b(correction(experiment).begin(), correction(experiment).end());
  experiments_[experiment].residuals(local_theta(duals.data(), experiment).data(), b.data(), r.data(),
                                     static_cast<D*>(nullptr), static_cast<D*>(nullptr), interrupt);
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

template <class F>
bool Problem::attempt(int experiment, F&& f) const {
  const auto fail = [&](const std::exception& error) {
    std::lock_guard lock(failing);
    failure_ = experiments_[experiment].name + ": " + error.what();
    return false;
  };
  try {
    f(experiment);
    return true;
  } catch (const Diverged& error) {
    return fail(error);
  } catch (const Unconverged& error) {
    return fail(error);
  } catch (const NoEquilibrium& error) {
    return fail(error);
  } catch (const OutOfDomain& error) {
    return fail(error);
  } catch (const NoCorrection& error) {
    return fail(error);
  }
}

bool Problem::evaluate(const double* u, double* residual, double* jacobian, Interrupt* interrupt) const {
  const int p = parameters();
  if (jacobian) std::fill_n(jacobian, static_cast<std::size_t>(rows()) * p, 0.0);
  std::atomic<bool> ok = true;
  for (int e = 0; e < static_cast<int>(experiments_.size()) && ok; ++e)
    if (projections_[e])
      ok = attempt(e, [&](int) { projections_[e]->solve(local_theta(u, e), u, residual + first_row_[e], interrupt); });
  if (!ok) return false;
  const std::vector<Sweep> jobs = sweeps(jacobian != nullptr);
  parallel_for(static_cast<int>(jobs.size()), threads_, 1, [&](int begin, int end) {
    for (int job = begin; job < end; ++job) {
      const auto [experiment, first, width] = jobs[job];
      const bool done = attempt(experiment, [&, first = first, width = width](int e) {
        if (width == 0) {
          if (!projections_[e])
            experiments_[e].residuals(local_theta(u, e).data(), correction(e).data(), residual + first_row_[e],
                                      static_cast<double*>(nullptr), static_cast<double*>(nullptr), interrupt);
        } else if (width == 4) {
          evaluate_columns<4>(u, e, first, residual, jacobian, interrupt);
        } else {
          evaluate_columns<8>(u, e, first, residual, jacobian, interrupt);
        }
      });
      if (!done) ok = false;
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
  if (ok) project(u, residual, jacobian);
  return ok && std::all_of(residual, residual + rows(), [](double r) { return std::isfinite(r); });
}

void Problem::project(const double* u, double* residual, double* jacobian) const {
  int row = data_rows() + priors_;
  for (std::size_t e = 0; e < projections_.size(); ++e) {
    if (!projections_[e]) continue;
    Projection& own = *projections_[e];
    const auto at = [&](int r) { return jacobian + static_cast<std::size_t>(r) * parameters(); };
    if (jacobian) own.project(u, residual + first_row_[e], at(first_row_[e]), at(row));
    for (int i = 0, count = own.unknowns(); i < count; ++i)
      residual[row++] = own.b()[i] / experiments_[e].correction.sigma[i];
  }
}

std::vector<double> Problem::simulate(int experiment, const double* u, Interrupt* interrupt) const {
  const Experiment& e = experiments_.at(experiment);
  std::vector<double> markers(e.observed.measured.size());
  e.residuals(local_theta(u, experiment).data(), correction(experiment).data(), static_cast<double*>(nullptr),
              markers.data(), static_cast<double*>(nullptr), interrupt);
  return markers;
}

std::vector<double> Problem::readings(int experiment, const double* u, Interrupt* interrupt) const {
  const Experiment& e = experiments_.at(experiment);
  std::vector<double> read(e.readings());
  e.residuals(local_theta(u, experiment).data(), correction(experiment).data(), static_cast<double*>(nullptr),
              static_cast<double*>(nullptr), read.data(), interrupt);
  return read;
}

std::vector<double> Problem::respond(int experiment, const double* u, const double* changes, int count,
                                     Interrupt* interrupt) const {
  using D = Dual<double, 8>;
  const Experiment& e = experiments_.at(experiment);
  const std::size_t rows = e.residual_count(), numbers = correction(experiment).size();
  const std::vector<double> at = local_theta(u, experiment);
  const std::vector<D> theta(at.begin(), at.end());
  std::vector<double> moved(count * rows);
  parallel_for((count + 7) / 8, threads_, 1, [&](int begin, int end) {
    for (int first = 8 * begin; first < std::min(8 * end, count); first += 8) {
      std::vector<D> b(correction(experiment).begin(), correction(experiment).end()), r(rows);
      const int width = std::min(8, count - first);
      for (int k = 0; k < width; ++k)
        for (std::size_t i = 0; i < numbers; ++i) b[i].d[k] = changes[(first + k) * numbers + i];
      e.residuals(theta.data(), b.data(), r.data(), static_cast<D*>(nullptr), static_cast<D*>(nullptr), interrupt);
      for (int k = 0; k < width; ++k)
        for (std::size_t i = 0; i < rows; ++i) moved[(first + k) * rows + i] = r[i].d[k];
    }
  });
  return moved;
}

std::vector<double> Problem::reduced(const double* change) const {
  std::vector<double> made(rows(), 0.0);
  std::copy_n(change, data_rows(), made.begin());
  int row = data_rows() + priors_;
  for (std::size_t e = 0; e < projections_.size(); ++e) {
    if (!projections_[e]) continue;
    projections_[e]->reduce(made.data() + first_row_[e], made.data() + row);
    row += projections_[e]->unknowns();
  }
  return made;
}

const std::vector<double>& Problem::correction(int experiment) const {
  const auto& own = projections_.at(experiment);
  return own ? own->b() : experiments_[experiment].correction.given;
}

double Problem::absorbed(int experiment) const {
  const auto& own = projections_.at(experiment);
  return own ? own->absorbed() : 0.0;
}

void Problem::relinearize() const {
  for (const auto& own : projections_)
    if (own) own->relinearize();
}

void Problem::follow(const Problem& other) const {
  for (std::size_t e = 0; e < std::min(projections_.size(), other.projections_.size()); ++e)
    if (projections_[e] && other.projections_[e]) projections_[e]->follow(*other.projections_[e]);
}

std::vector<double> Problem::state() const {
  std::vector<double> numbers;
  for (const auto& own : projections_)
    if (own) own->save(numbers);
  return numbers;
}

void Problem::restore(const std::vector<double>& state) const {
  const double* next = state.data();
  for (const auto& own : projections_)
    if (own) own->restore(next);
}

std::vector<double> Problem::physical(const double* u) const {
  std::vector<double> theta(theta_.size());
  set_theta(u, theta.data());
  return theta;
}

}  // namespace sheetbend
