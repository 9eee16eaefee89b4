#include "core/solver/implicit_block.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/packs/kernels.h"
#include "core/solver/element_stiffness.h"

namespace sheetbend {
namespace {

constexpr int row = sheetbend_blocks::row;
constexpr double sufficient = 1e-4;  // share of the slope's promise that a step has to keep (Armijo)
constexpr double flat = 1e-8;        // relative changes of Phi that rounding may hide
constexpr int most_halvings = 60;
constexpr double nothing = 1e-8;  // a displacement, of the coordinates
constexpr double convexities[] = {1.0 / 64.0, 1.0 / 8.0, 1.0};
constexpr int turns = 8;                  // in which a direction of negative curvature gets steeper
constexpr double first_departure = 1e-4;  // along it, of the block's size
constexpr double near_saddle = 1e-3;      // so little of the largest force is left where it may be a saddle's

std::string words(const Unbalanced& e, int substep, double time) {
  std::ostringstream out;
  out << e.problem << ", in substep " << substep << " (t = " << time << " s). Fix: " << e.fix;
  return out.str();
}

// Sets `to` to the rows `from` plus t d on the movable particles.
void move(Numbers<double>& from, double t, const std::vector<double>& d, Numbers<double>& to) {
  to = from;
  for (std::size_t i = 0; i < d.size(); ++i) to[row * (i / 3) + i % 3] += t * d[i];
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

Unbalanced::Unbalanced(const std::string& problem_, const std::string& fix_, int matrices, double residual_, int node_)
    : Unconverged(problem_ + ". Fix: " + fix_, matrices, residual_), problem(problem_), fix(fix_), node(node_) {}

Unbalanced::Unbalanced(const Unbalanced& e, int substep_, double time_)
    : Unconverged(words(e, substep_, time_), e.iterations, e.residual),
      problem(e.problem),
      fix(e.fix),
      substep(substep_),
      node(e.node),
      time(time_) {}

std::size_t ImplicitBlock::element_numbers(const Scene& scene, const DirectBlock& block) {
  std::size_t count = 0;
  for (const Member& m : block.members) count += 9 * scene.groups[m.group].arity * scene.groups[m.group].arity;
  return count;
}

void ImplicitBlock::resize(const Scene& scene, const DirectBlock& block) {
  const std::size_t particles = row * block.particles.size();
  for (auto* a : {&start, &guess, &target, &x_, &trial_}) a->assign(particles);
  for (auto* a : {&C_r, &diagonal, &lambda_, &dl_, &no_multipliers_}) a->assign(block.size());
  gradients_.assign(row * block.window_rows.size());
  for (auto* a : {&R_, &d_}) a->assign(3 * block.movable, 0.0);
  for (auto* a : {&elements_, &convex_elements_}) a->assign(element_numbers(scene, block), 0.0);
  factor_.reset(pattern_of(block).structure);
  eta = 0.0;
  values.resize(block.runs.size());
  runs_.clear();
  runs_.reserve(block.runs.size());
  for (std::size_t r = 0; r < values.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const Group& group = scene.groups[run.group];
    values[r].assign(run.items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
    runs_.push_back({group.kind, run.count, group.damped, run.nodes.data(), run.gradients.data(), run.first_row.data(),
                     values[r].numbers(), nullptr});
  }
}

// Phi at `at`, with gradients, multipliers and R.
double ImplicitBlock::evaluate(const DirectBlock& block, Numbers<double>& at) {
  sheetbend_blocks::Block b{};
  b.runs = runs_.data();
  b.run_count = static_cast<int>(runs_.size());
  b.movable = block.movable;
  b.particles = static_cast<int>(block.particles.size());
  b.size = block.size();
  b.window = block.window.data();
  b.rows = block.window_rows.data();
  b.x = at.numbers();
  b.lambda = no_multipliers_.numbers();
  b.C_r = C_r.numbers();
  b.diagonal = diagonal.numbers();
  b.gradients = gradients_.numbers();
  b.dl = dl_.numbers();
  pack_kernels().blocks->one.forward.evaluate(b);

  double potential = 0.0, stiffest = 0.0, farthest = 0.0, lightest = std::numeric_limits<double>::infinity();
  for (int j = 0; j < block.size(); ++j) {
    lambda_[j] = dl_[j] / diagonal[j];
    potential += dl_[j] * lambda_[j];
  }
  largest_ = force_ = 0.0;
  for (int p = 0; p < block.movable; ++p)
    for (int d = 0; d < 3; ++d) {
      const double now = at[row * p + d], mass = 1.0 / at[row * p + 3], away = now - target[row * p + d];
      double push = 0.0, sum = mass * std::abs(away), stiffness = mass;
      for (int k = block.window[p]; k < block.window[p + 1]; ++k) {
        const double G = gradients_[row * k + d], force = G * lambda_[block.window_rows[k]];
        push += force;
        sum += std::abs(force);
        stiffness += G * G / diagonal[block.window_rows[k]];
      }
      potential += mass * away * away;
      lightest = std::min(lightest, mass);
      R_[3 * p + d] = mass * away - push;
      largest_ = std::max(largest_, std::abs(R_[3 * p + d]));
      force_ = std::max(force_, sum);
      stiffest = std::max(stiffest, stiffness);
      farthest = std::max(farthest, std::abs(now));
    }
  // No more than what moves a particle by nothing: near a collapsed triangle any force is rounding.
  rounding_ = std::min(256.0 * std::numeric_limits<double>::epsilon() * stiffest, nothing * lightest) * farthest;
  return 0.5 * potential;
}

// Rounding counts once Newton's steps no longer help.
bool ImplicitBlock::balanced(double tolerance) const {
  return largest_ <= tolerance * force_ || (slow() && largest_ <= rounding_);
}

// Whether the last step has left more than half of the force that there was before it.
bool ImplicitBlock::slow() const {
  const std::size_t k = balance_.size();
  return k > 1 && balance_[k - 1] > 0.5 * balance_[k - 2];
}

// f(member, group, run, place in it, numbers before its own) for each constraint, in the block's order.
template <class F>
void ImplicitBlock::for_each_element(const Scene& scene, const DirectBlock& block, F&& f) const {
  std::vector<int> run_of(scene.groups.size(), -1), next(block.runs.size(), 0);
  for (std::size_t r = 0; r < block.runs.size(); ++r) run_of[block.runs[r].group] = static_cast<int>(r);
  std::size_t first = 0;
  for (std::size_t m = 0; m < block.members.size(); ++m) {
    const Group& group = scene.groups[block.members[m].group];
    const int r = run_of[block.members[m].group], dofs = 3 * group.arity;
    f(m, group, r, next[r]++, first);
    first += static_cast<std::size_t>(dofs) * dofs;
  }
}

// The constraints' shares of K at `at`, where Phi was evaluated.
void ImplicitBlock::find_elements(const Scene& scene, const DirectBlock& block, Numbers<double>& at) {
  std::vector<double> x, parameters;
  for_each_element(scene, block, [&](std::size_t m, const Group& group, int r, int i, std::size_t first) {
    const MemberRun& run = block.runs[r];
    const int count = sheetbend_blocks::value_count(group.damped, group.parameters),
              first_row = block.members[m].first_row;
    x.resize(3 * group.arity);
    for (int k = 0; k < group.arity; ++k)
      for (int d = 0; d < 3; ++d) x[3 * k + d] = at[run.nodes[lane_at(i, group.arity, k)] + d];
    parameters.resize(group.parameters);
    for (int k = 0; k < group.parameters; ++k)
      parameters[k] = values[r][lane_at(i, count, count - group.parameters + k)];
    element_stiffness(group.kind, x.data(), parameters.data(), 1.0 / diagonal[first_row], &lambda_[first_row],
                      &elements_[first]);
  });
}

void ImplicitBlock::find_convex_elements(const Scene& scene, const DirectBlock& block) {
  convex_elements_ = elements_;
  for_each_element(scene, block, [&](std::size_t, const Group& group, int, int, std::size_t first) {
    make_convex(3 * group.arity, &convex_elements_[first]);
  });
}

// LDL^T of W^-1 and the elements, so much of the way to the convex ones. Says whether it is positive definite.
bool ImplicitBlock::factorize_elements(const Scene& scene, const DirectBlock& block, double convexity) {
  const CondensedPattern& pattern = pattern_of(block);
  factor_.reset(pattern.structure);
  for (int p = 0; p < block.movable; ++p)
    for (int d = pattern.dof_of[p]; d < pattern.dof_of[p] + 3; ++d)
      factor_.values[pattern.structure.position(d, d)] = 1.0 / x_[row * p + 3];
  const std::size_t* entry = pattern.entries.data();
  std::vector<double> E;
  std::vector<int> own;  // the element's first dofs of its movable particles
  for_each_element(scene, block, [&](std::size_t m, const Group& group, int r, int i, std::size_t first) {
    const int dofs = 3 * group.arity;
    E.assign(&elements_[first], &elements_[first] + static_cast<std::size_t>(dofs) * dofs);
    if (convexity > 0.0)
      for (std::size_t e = 0; e < E.size(); ++e) E[e] += convexity * (convex_elements_[first + e] - E[e]);
    own.clear();
    for (int k = 0; k < group.arity; ++k)
      if (block.runs[r].nodes[lane_at(i, group.arity, k)] < row * block.movable) own.push_back(3 * k);
    const auto& member = pattern.shares.members[m];
    const int* dof = &pattern.shares.dofs[member.first_use];
    for (int i_use = 0; i_use < member.uses; ++i_use)
      for (int k_use = 0; k_use < member.uses; ++k_use) {
        if (dof[k_use] > dof[i_use]) continue;
        for (int b = 0; b < 3; ++b, ++entry)
          for (int a = i_use == k_use ? b : 0; a < 3; ++a)
            factor_.values[*entry + a] += E[(own[i_use] + a) * dofs + own[k_use] + b];
      }
  });
  factor_.factorize(pattern.structure, pack_kernels().blocks->one.forward.factor_supernodes);
  // A pivot that is not positive has zero for its inverse.
  return std::all_of(factor_.inverse.begin(), factor_.inverse.end(), [](double p) { return p > 0.0; });
}

// The matrix of a Newton step from x_.
void ImplicitBlock::factorize_newton(const Scene& scene, const DirectBlock& block) {
  ++matrices_;
  find_elements(scene, block, x_);
  convexity_ = 0.0;
  if (factorize_elements(scene, block, convexity_)) return;
  find_convex_elements(scene, block);
  for (const double part : convexities) {
    convexity_ = part;
    if (factorize_elements(scene, block, convexity_)) return;
  }
}

// Kz = K z at x_, whose elements were found.
void ImplicitBlock::multiply(const Scene& scene, const DirectBlock& block, const std::vector<double>& z,
                             std::vector<double>& Kz) {
  for (std::size_t i = 0; i < z.size(); ++i) Kz[i] = z[i] / x_[row * (i / 3) + 3];
  for_each_element(scene, block, [&](std::size_t, const Group& group, int r, int item, std::size_t first) {
    const int dofs = 3 * group.arity, movable = 3 * block.movable;
    const auto place = [&](int d) {
      return 3 * (block.runs[r].nodes[lane_at(item, group.arity, d / 3)] / row) + d % 3;
    };
    for (int a = 0; a < dofs; ++a)
      for (int b = 0; b < dofs; ++b)
        if (place(a) < movable && place(b) < movable) Kz[place(a)] += elements_[first + a * dofs + b] * z[place(b)];
  });
}

// One Newton step from the guess, to the first order in where fixed particles go; or the state at n with those moved, where Phi is lower.
void ImplicitBlock::take_first_step(const Scene& scene, const DirectBlock& block) {
  x_ = guess;
  evaluate(block, x_);
  factorize_newton(scene, block);
  for (std::size_t i = 0; i < d_.size(); ++i) d_[i] = -R_[i];
  for_each_element(scene, block, [&](std::size_t, const Group& group, int r, int item, std::size_t first) {
    const int dofs = 3 * group.arity;
    for (int b = 0; b < dofs; ++b) {
      const auto at = [&](int d) { return block.runs[r].nodes[lane_at(item, group.arity, d / 3)] + d % 3; };
      if (at(b) < row * block.movable) continue;
      const double by = target[at(b)] - guess[at(b)];
      for (int a = 0; a < dofs; ++a)
        if (at(a) < row * block.movable) d_[3 * (at(a) / row) + a % 3] -= elements_[first + a * dofs + b] * by;
    }
  });
  solve(block, d_.data());
  move(guess, 1.0, d_, trial_);
  x_ = start;
  for (Numbers<double>* rows : {&x_, &trial_})
    for (std::size_t i = row * block.movable; i < row * block.particles.size(); ++i) (*rows)[i] = target[i];
  potential_ = evaluate(block, x_);
  if (const double moved = evaluate(block, trial_); moved < potential_ || !std::isfinite(potential_)) {
    std::swap(x_, trial_);
    potential_ = moved;
  } else {
    evaluate(block, x_);
  }
}

// Goes along d_ as far as Phi falls enough; R and the multipliers are those of the new x_. False where it does not fall.
bool ImplicitBlock::search_line(const DirectBlock& block) {
  const double slope = product(R_, d_);
  double t = 1.0;
  for (int halving = 0; halving < most_halvings; ++halving, t *= 0.5) {
    move(x_, t, d_, trial_);
    const double potential = evaluate(block, trial_);
    const bool falls = potential <= potential_ + sufficient * t * slope;
    // Near the minimum rounding hides what Phi does, not what its slope does (Hager & Zhang 2005).
    const bool levels =
        potential <= potential_ + flat * potential_ && std::abs(product(R_, d_)) <= 0.5 * std::abs(slope);
    if (!falls && !levels) continue;
    std::swap(x_, trial_);
    potential_ = potential;
    return true;
  }
  return false;
}

// Where K is not positive definite: goes down along a direction of negative curvature, to the nearest place where Phi rises again. The direction is L^-T e
// of the first pivot that is not positive; turns z - P^-1 K z, with the matrix P that was factored instead, make it steeper. False, with nothing
// changed, where rounding alone bends Phi down.
bool ImplicitBlock::leave_saddle(const Scene& scene, const DirectBlock& block) {
  factorize_elements(scene, block, 0.0);
  const CondensedPattern& pattern = pattern_of(block);
  const std::vector<double> inverse = factor_.inverse;
  const auto pivot = std::find_if(inverse.begin(), inverse.end(), [](double p) { return !(p > 0.0); });
  if (pivot == inverse.end()) return false;
  std::fill(factor_.inverse.begin(), factor_.inverse.end(), 0.0);
  const auto at = pivot - inverse.begin();
  factor_.inverse[at] = 1.0;
  for (std::size_t p = 0; p < pattern.dof_of.size(); ++p)
    for (int d = 0; d < 3; ++d) d_[3 * p + d] = pattern.dof_of[p] + d == at ? 1.0 : 0.0;
  solve(block, d_.data());
  factorize_elements(scene, block, convexity_);
  std::vector<double> Kd(d_.size());
  double curvature = 0.0;
  for (int turn = 0;; ++turn) {
    double size = 0.0;
    for (const double a : d_) size = std::max(size, std::abs(a));
    for (double& a : d_) a /= size;
    multiply(scene, block, d_, Kd);
    curvature = product(d_, Kd);
    if (turn == turns || !(curvature < 0.0)) break;
    solve(block, Kd.data());
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] -= Kd[i];
  }
  if (!(curvature < 0.0)) return false;
  double slope = product(R_, d_), t = 0.0;
  if (slope > 0.0) {
    for (double& a : d_) a = -a;
    slope = -slope;
  }
  for (std::size_t p = 1; p < block.particles.size(); ++p)
    for (int d = 0; d < 3; ++d) t = std::max(t, std::abs(x_[row * p + d] - x_[d]));
  const auto lowers = [&](double by, double potential) {
    return potential < potential_ + sufficient * by * slope + 0.25 * by * by * curvature;
  };
  const auto potential_at = [&](double by) {
    move(x_, by, d_, trial_);
    return evaluate(block, trial_);
  };
  t *= first_departure;
  double found = potential_at(t);
  for (int halving = 0; halving < most_halvings && !lowers(t, found); ++halving) found = potential_at(t *= 0.5);
  if (!lowers(t, found)) {
    evaluate(block, x_);
    return false;
  }
  for (double farther; (farther = potential_at(2.0 * t)) < found; t *= 2.0) found = farther;
  potential_ = potential_at(t);
  std::swap(x_, trial_);
  return true;
}

int ImplicitBlock::worst_node(const DirectBlock& block) const {
  const auto worst =
      std::max_element(R_.begin(), R_.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  return block.particles[(worst - R_.begin()) / 3];
}

void ImplicitBlock::give_up(const DirectBlock& block) const {
  const int node = worst_node(block);
  std::ostringstream problem;
  problem.precision(2);
  problem << "forces do not balance: after " << matrices_ << " Newton matrices " << std::scientific << largest_ / force_
          << " of the largest force is left at particle " << node;
  throw Unbalanced(problem.str(),
                   "use a smaller substep, allow more iterations, or check boundary motion near that time", matrices_,
                   largest_ / force_, node);
}

void ImplicitBlock::solve(const Scene& scene, const DirectBlock& block, const SolverOptions& options) {
  balance_.clear();
  matrices_ = 0;
  const auto finite = [&](Numbers<double>& rows) {
    return std::all_of(rows.data(), rows.data() + row * block.particles.size(),
                       [](double a) { return std::isfinite(a); });
  };
  if (!finite(start) || !finite(target)) {
    x_ = target;
    return;
  }
  take_first_step(scene, block);
  while (true) {
    balance_.push_back(force_ > 0.0 ? largest_ / force_ : 0.0);
    if (!std::isfinite(potential_)) give_up(block);
    if (balanced(options.force_tolerance)) {
      if (convexity_ == 0.0) return;
      factorize_newton(scene, block);
      if (convexity_ == 0.0 || !leave_saddle(scene, block)) return;
      continue;
    }
    if (matrices_ >= options.iterations) give_up(block);
    const bool was_convex = convexity_ > 0.0;
    factorize_newton(scene, block);
    // Past a saddle the way is long with a matrix that was made convex.
    if (was_convex && convexity_ > 0.0 && slow() && balance_.back() < near_saddle && leave_saddle(scene, block))
      continue;
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] = -R_[i];
    solve(block, d_.data());
    if (!search_line(block)) {
      evaluate(block, x_);
      give_up(block);
    }
  }
}

void ImplicitBlock::factorize(const Scene& scene, const DirectBlock& block) {
  evaluate(block, x_);
  find_elements(scene, block, x_);
  if (!factorize_elements(scene, block, 0.0))
    throw Unbalanced(
        "forces balance where they have no stiffness against some motion, at the point of buckling: no derivative",
        "use a smaller substep, or an imperfection that says which way", matrices_, largest_ / force_,
        worst_node(block));
}

std::size_t ImplicitBlock::bytes(const Scene& scene, const DirectBlock& block) {
  const auto numbers = [](std::size_t count) {
    return sizeof(double) * ((count + Pack::lanes - 1) / Pack::lanes * Pack::lanes);
  };
  std::size_t bytes = sizeof(ImplicitBlock) + 5 * numbers(row * block.particles.size()) + 5 * numbers(block.size()) +
                      numbers(row * block.window_rows.size()) +
                      sizeof(double) * (6 * block.movable + 2 * element_numbers(scene, block)) +
                      sizeof(double) * pattern_of(block).structure.size() +
                      Factor<double>::bytes(pattern_of(block).structure);
  for (const MemberRun& run : block.runs) {
    const Group& group = scene.groups[run.group];
    bytes += sizeof(sheetbend_blocks::Run) + sizeof(Numbers<double>) +
             numbers(run.items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
  }
  return bytes;
}

}  // namespace sheetbend
