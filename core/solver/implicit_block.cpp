#include "core/solver/implicit_block.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/solver/moved_rows.h"

namespace sheetbend {
namespace {

using sheetbend_blocks::row;

constexpr int turns = 8;                  // in which a direction of negative curvature gets steeper
constexpr double first_departure = 1e-4;  // along it, of the block's size
constexpr double first_share = 0.25, least_share = 1.0 / 256.0;  // of friction, that a step adds
constexpr double firmer =
    10.0;                    // contacts that lift (core/contact/rebound.h) get stiffer by this from balance to balance
constexpr int patience = 4;  // steps without progress before a leap over a kink
// Pairs leave little room to leap. After so many steps in which the merit has not become lower by a share, its minimum is given up.
constexpr int most_idle = 16;
constexpr double idle_share = 1e-2;
// How far leaps go, of a whole step. Whole steps alone may lead back to the same kink again and again.
constexpr double leap_shares[] = {1.0, 0.5, 2.0, 0.25, 1.5, 0.75, 0.35, 0.6};
constexpr int most_leaps = static_cast<int>(std::size(leap_shares));
constexpr double loosest_step = 1e-2, tightest_step = 1e-8;  // of what is left of R after a step by iterations
constexpr double near_saddle = 1e-3;  // so little of the largest force is left where it may be a saddle's

// The multipliers of rigid rows that leave the least of R at the solution x. What is left of it is rounding, which contacts make large: on the way back these
// multipliers are found again from x, and have to be the same. The second pass takes back the rounding of the first.
void balance_rigid(const DirectBlock& block, IncrementalPotential& potential, Numbers<double>& x) {
  RigidRows& rigid = potential.rigid;
  if (rigid.empty()) return;
  for (int pass = 0; pass < 2; ++pass) {
    potential.evaluate(block, x);
    if (pass == 0) rigid.factorize(block, x.data());
    const std::vector<double> more = rigid.balance(block, x.data(), potential.R().data(), rigid.residuals().data());
    for (std::size_t j = 0; j < more.size(); ++j) rigid.lambda[j] += more[j];
  }
  potential.evaluate(block, x);
}

}  // namespace

void ImplicitBlock::resize(const Scene& scene, const DirectBlock& block) {
  potential.resize(scene, block);
  matrix_.resize(scene, block);
  for (auto* a : {&start, &guess, &x_, &trial_, &z_, &Kz_}) a->assign(row * block.particles.size());
  d_.assign(3 * block.movable, 0.0);
  firm_.resize(block.contacts.size());
}

std::size_t ImplicitBlock::bytes(const Scene& scene, const DirectBlock& block) {
  return sizeof(ImplicitBlock) + IncrementalPotential::bytes(scene, block) + NewtonMatrix::bytes(scene, block) +
         6 * Numbers<double>::bytes(row * block.particles.size()) +
         sizeof(double) * (3 * block.movable + block.contacts.size());
}

// Rounding counts once Newton's steps no longer help.
bool ImplicitBlock::balanced(double tolerance) const {
  return potential.balanced(tolerance) || (slow() && potential.at_rounding());
}

// Whether the last step has left more than half of the force that there was before it.
bool ImplicitBlock::slow() const {
  const std::size_t k = balance_.size();
  return k > first_ + 1 && balance_[k - 1] > 0.5 * balance_[k - 2];
}

// The matrix of a Newton step from x_, where the potential was looked at last. Where friction acts it is factored once iterations have not done.
void ImplicitBlock::find_matrix(const Scene& scene, const DirectBlock& block) {
  ++matrices_;
  matrix_.find(scene, block, potential, x_);
  factored_ = !matrix_.rubs() || !rigid().empty();
  if (factored_)
    factorize_newton(scene, block);
  else
    convexity_ = 0.0;
}

void ImplicitBlock::factorize_newton(const Scene& scene, const DirectBlock& block) {
  factored_ = true;
  if (!potential.by_merit()) {
    convexity_ = matrix_.factorize_convex_enough(scene, block);
    return;
  }
  convexity_ = 0.0;  // what has no potential has no saddles to be left
  if (!block.may_slide()) {
    matrix_.factorize_convex_enough(scene, block);
    return;
  }
  if (matrix_.symmetric() && matrix_.factorize(scene, block, 0.0)) return;
  if (!matrix_.factorize_unsymmetric(scene, block, 0.0)) matrix_.factorize_unsymmetric(scene, block, 1.0);
}

// The Newton step.
void ImplicitBlock::take_direction(const Scene& scene, const DirectBlock& block) {
  for (std::size_t i = 0; i < d_.size(); ++i) d_[i] = -potential.R()[i];
  for (std::size_t j = 0; j < dl_.size(); ++j) dl_[j] = -rigid().residual(static_cast<int>(j));
  find_step(scene, block);
}

// What iterations may leave of R: about what Newton's method leaves by itself (Eisenstat & Walker 1996).
double ImplicitBlock::step_tolerance() const {
  const std::size_t k = balance_.size();
  if (k < first_ + 2) return loosest_step;
  const double share = balance_[k - 1] / balance_[k - 2];
  return std::clamp(share * share, tightest_step, loosest_step);
}

// From the right sides in d_ and dl_.
void ImplicitBlock::find_step(const Scene& scene, const DirectBlock& block) {
  if (!factored_ && matrix_.iterate(scene, block, step_tolerance(), false, d_.data())) return;
  if (!factored_) factorize_newton(scene, block);
  if (rigid().empty()) return matrix_.solve(block, d_.data());
  rigid().solve(block, d_.data(), dl_.data(), [&](double* z) { matrix_.solve(block, z); }, enough_digits);
  for (double& l : dl_) l = -l;
}

void ImplicitBlock::expect_digits(const DirectBlock& block, double share) const {
  if (share <= enough_digits) return;
  throw Unbalanced(
      "rigid constraints nearly follow from one another, or hold particles that others hold far more stiffly than they "
      "weigh: no derivative",
      "use a smaller substep, remove constraints that say the same, or give them a compliance", matrices_,
      potential.balance(), potential.worst_node(block));
}

// The point that the potential was looked at last is x_.
void ImplicitBlock::accept(double phi) {
  phi_ = phi;
  merit_ = potential.merit();
  by_merit_ = potential.by_merit();
  lambda_ = potential.rigid.lambda;
}

// Of K along d_, which is made as long as one in its largest number; Kz_ is K d_.
double ImplicitBlock::curvature(const DirectBlock& block) {
  double size = 0.0, sum = 0.0;
  for (const double a : d_) size = std::max(size, std::abs(a));
  for (double& a : d_) a /= size;
  z_.clear();
  move(z_, 1.0, d_, trial_);
  matrix_.multiply(block, trial_, Kz_);
  for (std::size_t i = 0; i < d_.size(); ++i) sum += d_[i] * Kz_[row * (i / 3) + i % 3];
  return sum;
}

// Where K is not positive definite: goes down along a direction of negative curvature. The direction is L^-T e of the first pivot that is not positive;
// turns z - P^-1 K z, with the matrix P that was factored instead, make it steeper. False, with nothing changed, where rounding
// alone bends Phi down.
bool ImplicitBlock::leave_saddle(const Scene& scene, const DirectBlock& block) {
  matrix_.factorize(scene, block, 0.0);
  if (!matrix_.find_negative_direction(block, d_.data())) return false;
  matrix_.factorize(scene, block, convexity_);
  std::vector<double> back(d_.size());
  double bend = curvature(block);
  for (int turn = 0; turn < turns && bend < 0.0; ++turn) {
    for (std::size_t i = 0; i < d_.size(); ++i) back[i] = Kz_[row * (i / 3) + i % 3];
    matrix_.solve(block, back.data());
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] -= back[i];
    bend = curvature(block);
  }
  return bend < 0.0 && descend(block, bend);
}

// Goes along d_, in which K has this negative curvature, to the nearest place where Phi rises again.
bool ImplicitBlock::descend(const DirectBlock& block, double curvature) {
  double slope = product(potential.R(), d_), t = 0.0;
  if (slope > 0.0) {
    for (double& a : d_) a = -a;
    slope = -slope;
  }
  for (std::size_t p = 1; p < block.particles.size(); ++p)
    for (int d = 0; d < 3; ++d) t = std::max(t, std::abs(x_[row * p + d] - x_[d]));
  const auto lowers = [&](double by, double there) {
    return there < phi_ + sufficient * by * slope + 0.25 * by * by * curvature;
  };
  const auto phi_at = [&](double by) { return look(block, by); };
  t *= first_departure;
  double found = phi_at(t);
  for (int halving = 0; halving < most_halvings && !lowers(t, found); ++halving) found = phi_at(t *= 0.5);
  if (!lowers(t, found)) {
    potential.evaluate(block, x_);
    return false;
  }
  for (double farther; (farther = phi_at(2.0 * t)) < found; t *= 2.0) found = farther;
  accept(phi_at(t));
  std::swap(x_, trial_);
  return true;
}

void ImplicitBlock::solve(const Scene& scene, const DirectBlock& block, const SolverOptions& options) {
  balance_.clear();
  matrices_ = 0;
  const auto finite = [&](Numbers<double>& rows) {
    return std::all_of(rows.data(), rows.data() + row * block.particles.size(),
                       [](double a) { return std::isfinite(a); });
  };
  if (!finite(start) || !finite(potential.target)) {
    x_ = potential.target;
    std::fill(potential.rigid.lambda.begin(), potential.rigid.lambda.end(), 0.0);
    return;
  }
  potential.pairs.find(block, start, guess, potential.target);
  matrix_.begin();
  auto& numbers = potential.contacts.numbers;
  double firmest = 1.0;
  for (std::size_t i = 0; i < numbers.size(); ++i) firmest = std::max(firmest, firm_[i] = numbers[i].firm);
  for (double most = 1.0;; most = std::min(firmest, firmer * most)) {  // how firm contacts are at most
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i].firm = std::min(most, firm_[i]);
    SolverOptions again = options;
    again.iterations += matrices_;
    begin();
    if (most == 1.0)
      take_first_step(scene, block);
    else
      accept(look(block));
    if (!find_balance(scene, block, again) && !raise_friction(scene, block, again)) give_up(block);
    if (most == firmest) return;
  }
}

void ImplicitBlock::begin() { first_ = balance_.size(); }

// Newton's method from x_, where the potential was looked at last. False where it stalls, or takes too many matrices. Where friction acts, its merit may
// lead to a kink that is no balance; a step that need not lower it leaps over that.
bool ImplicitBlock::find_balance(const Scene& scene, const DirectBlock& block, const SolverOptions& options) {
  int leaps = 0, idle = 0;
  double lowest = std::numeric_limits<double>::infinity();  // merit
  std::size_t last_leap = first_;
  const auto stalls = [&](std::size_t since) {
    const std::size_t k = balance_.size();
    return k > since + patience && balance_[k - 1] > 0.9 * balance_[k - 1 - patience];
  };
  while (true) {
    balance_.push_back(potential.balance());
    if (!std::isfinite(phi_)) return false;
    if (balanced(options.force_tolerance)) {
      if (convexity_ == 0.0) {
        balance_rigid(block, potential, x_);
        return true;
      }
      find_matrix(scene, block);
      if (convexity_ == 0.0 || !leave_saddle(scene, block)) return true;
      continue;
    }
    if (matrices_ >= options.iterations) return false;
    if (rigid().empty() && !potential.pairs.empty() && by_merit_ && merit_ > (1.0 - idle_share) * lowest) {
      if (++idle > most_idle) return false;
    } else {
      idle = 0;
      lowest = merit_;
    }
    const bool was_convex = convexity_ > 0.0;
    find_matrix(scene, block);
    // Past a saddle the way is long with a matrix that was made convex.
    if (was_convex && convexity_ > 0.0 && slow() && balance_.back() < near_saddle && leave_saddle(scene, block))
      continue;
    take_direction(scene, block);
    if (rigid().empty() && by_merit_ && leaps < most_leaps && stalls(last_leap)) {
      last_leap = balance_.size();
      const double there = look(block, leap_shares[leaps++]);
      if (std::isfinite(there)) {
        std::swap(x_, trial_);
        accept(there);
        continue;
      }
      look(block);
    }
    if (!go_down(scene, block, options.iterations)) {
      look(block);
      if (convexity_ > 0.0 || !potential.at_rounding()) return false;
      balance_rigid(block, potential, x_);
      return true;
    }
  }
}

// Friction has kinks where it starts to slide and where it turns round, and the merit may have a minimum at one that is no balance. From the balance
// without friction that with all of it follows in steps, which are halved where one fails. False where that fails too.
bool ImplicitBlock::raise_friction(const Scene& scene, const DirectBlock& block, const SolverOptions& options) {
  auto& numbers = potential.contacts.numbers;
  std::vector<double> friction;
  for (const auto& n : numbers) friction.push_back(n.friction);
  double& of_pairs = potential.friction.friction;
  friction.push_back(of_pairs);
  if (std::all_of(friction.begin(), friction.end(), [](double mu) { return mu == 0.0; })) return false;
  const auto take = [&](double share) {
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i].friction = share * friction[i];
    of_pairs = share * friction.back();
    begin();
  };
  const auto balances = [&] {
    SolverOptions again = options;  // each share of friction may take as many matrices
    again.iterations += matrices_;
    return find_balance(scene, block, again);
  };
  take(0.0);
  take_first_step(scene, block);
  bool found = balances();
  Numbers<double> last = x_;
  std::vector<double> multipliers = lambda_;
  for (double done = 0.0, step = first_share; found && done < 1.0;) {
    const double share = std::min(1.0, done + step);
    take(share);
    accept(look(block));
    if (balances()) {
      done = share;
      last = x_;
      multipliers = lambda_;
      step *= 2.0;
    } else {
      x_ = last;
      lambda_ = multipliers;
      step *= 0.5;
      found = step >= least_share;
    }
  }
  if (!found) {
    take(1.0);
    look(block);
  }
  return found;
}

void ImplicitBlock::take_guess(const DirectBlock& block) {
  x_ = potential.target;
  std::copy_n(guess.data(), row * block.movable, x_.data());
  settle_frames(block, potential.target, x_);
  potential.pairs.find_at(block, x_);
  matrix_.begin();
  if (rigid().empty()) return;
  potential.rigid.leave_out(potential.given(block), start.data());
  balance_rigid(block, potential, x_);
}

void ImplicitBlock::factorize(const Scene& scene, const DirectBlock& block) {
  matrix_.find(scene, block, potential, x_, true);
  factorize_solution(scene, block);
}

void ImplicitBlock::prepare_transposed(const Scene& scene, const DirectBlock& block) {
  matrix_.find(scene, block, potential, x_, true);
  factored_ = !matrix_.rubs() || !rigid().empty();
  if (factored_) factorize_solution(scene, block);
}

void ImplicitBlock::factorize_solution(const Scene& scene, const DirectBlock& block) {
  factored_ = true;
  if (matrix_.symmetric() && matrix_.factorize(scene, block, 0.0)) return;
  potential.evaluate(block, x_);
  const bool has_lu = potential.by_merit() ? block.may_slide() : !matrix_.symmetric();
  if (has_lu && matrix_.factorize_unsymmetric(scene, block, 0.0)) return;
  throw Unbalanced(
      "forces balance where they have no stiffness against some motion, at the point of buckling: no derivative",
      "use a smaller substep, or an imperfection that says which way", matrices_, potential.balance(),
      potential.worst_node(block));
}

}  // namespace sheetbend
