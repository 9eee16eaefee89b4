// How far an implicit block's Newton steps go: along a line where Phi tells, and by the merit where friction acts or rows do not give way.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/solver/implicit_block.h"
#include "core/solver/moved_rows.h"

namespace sheetbend {
namespace {

using sheetbend_blocks::row;

constexpr double flat = 1e-8;  // relative changes of Phi that rounding may hide
// Of a step that goes down in the merit: shorter ones only run into a kink at which it has a minimum.
constexpr int most_halvings_of_merit = 30;
constexpr int most_kinks = 10;     // full steps in a row that may raise the merit
constexpr double barred = 0x1p-6;  // so short a step is given up where pairs bar longer ones
constexpr double no_slip = 1e30;   // a friction
constexpr int most_sections = 36;  // of the way, where its lowest point is looked for
constexpr double well_down = 0.9;  // of the merit: less than this is gained where a kink holds it up

// What sticks does so within a slip of next to nothing, and steps of a matrix that has it sliding go back and forth over that. From one point to another some
// contacts turn to slide the other way: they are to stick, as if friction had no bound. Says whether there are any.
bool hold_turning(const DirectBlock& block, IncrementalPotential& potential, const double* from, const double* to) {
  bool any = false;
  for (int i = 0; i < static_cast<int>(block.contacts.size()); ++i) {
    const BlockContacts<double>& contacts = potential.contacts;
    const Touch<double> before = contacts.at(block, i, contacts.point(block, i, from)),
                        after = contacts.at(block, i, contacts.point(block, i, to));
    if (!before.slides || !after.slides || !(dot(before.tangential, after.tangential) < 0.0)) continue;
    potential.contacts.numbers[i].friction = no_slip;
    any = true;
  }
  return any;
}

// Where f is lowest on the way from 0, where it is f0, to 1: by golden sections around the first halving of 1 that is lower than f0. 0 where none is.
template <class F>
double lowest(F&& f, double f0) {
  constexpr double golden = 0.6180339887498949;
  double t = 1.0, best = f(t);
  for (int halving = 0; !(best < f0); best = f(t *= 0.5))
    if (++halving > ImplicitBlock::most_halvings) return 0.0;
  double low = 0.0, high = std::min(1.0, 2.0 * t), at = t;
  double a = high - golden * (high - low), b = low + golden * (high - low), fa = f(a), fb = f(b);
  for (int section = 0; section < most_sections; ++section) {
    if (fa < fb) {
      high = b, b = a, fb = fa, a = high - golden * (high - low), fa = f(a);
    } else {
      low = a, a = b, fa = fb, b = low + golden * (high - low), fb = f(b);
    }
    for (const auto& [where, value] : {std::pair{a, fa}, std::pair{b, fb}})
      if (value < best) best = value, at = where;
  }
  return at;
}

}  // namespace

// Phi at x_, and at x_ + t d_, which trial_ is then.
double ImplicitBlock::look(const DirectBlock& block) {
  potential.rigid.lambda = lambda_;
  potential.pairs.stay(block, x_);
  return potential.evaluate(block, x_);
}

double ImplicitBlock::look(const DirectBlock& block, double t) {
  move(x_, t, d_, trial_);
  for (std::size_t j = 0; j < lambda_.size(); ++j) potential.rigid.lambda[j] = lambda_[j] + t * dl_[j];
  if (!settle_frames(block, potential.target, trial_) || !potential.pairs.can_go(block, x_, trial_))
    return potential.refuse();
  return potential.evaluate(block, trial_);
}

// Goes along d_ as far as Phi falls enough, or the merit where friction acts; R and the forces are those of the new x_. False where it does not fall.
bool ImplicitBlock::search_line(const DirectBlock& block, int most_trials) {
  const double slope = product(potential.R(), d_);
  double t = 1.0;
  for (int trial = 0; trial < most_trials; ++trial, t *= 0.5) {
    const double there = look(block, t);
    if (by_merit_ || potential.by_merit()) {
      const bool falls = potential.merit() <= (1.0 - 2.0 * sufficient * t) * merit_;
      if (!falls && !potential.at_rounding()) continue;
    } else {
      const bool falls = there <= phi_ + sufficient * t * slope;
      // Near the minimum rounding hides what Phi does, not what its slope does (Hager & Zhang 2005).
      const bool levels = there <= phi_ + flat * phi_ && std::abs(product(potential.R(), d_)) <= 0.5 * std::abs(slope);
      if (!falls && !levels) continue;
    }
    std::swap(x_, trial_);
    accept(there);
    return true;
  }
  return false;
}

// Where the Newton step does not lower the merit, those of more convex matrices may.
bool ImplicitBlock::search_where_it_rubs(const Scene& scene, const DirectBlock& block) {
  if (!block.may_slide()) return false;
  for (const double convexity : {1.0 / 8.0, 1.0}) {
    look(block);
    ++matrices_;
    factored_ = true;
    if (!matrix_.factorize_unsymmetric(scene, block, convexity)) continue;
    take_direction(scene, block);
    if (search_line(block, most_halvings_of_merit)) return true;
  }
  return false;
}

// Where contacts begin, end, slide or stick along a step, the merit has kinks that shorter steps only run into; full ones get to the other side, where
// the next matrix knows what acts there; where pairs bar a full step, one as far as they allow. False, and back at the same point with its Newton step,
// where the merit has not fallen after some.
bool ImplicitBlock::step_over_kinks(const Scene& scene, const DirectBlock& block, int most_matrices) {
  if (block.contacts.empty() && potential.pairs.empty()) return false;
  const Numbers<double> x = x_;
  const std::vector<double> lambda = lambda_, d = d_, dl = dl_;
  const double merit = merit_;
  look(block);
  for (int step = 0; step < most_kinks && matrices_ < most_matrices; ++step) {
    double t = 1.0, there = look(block, t);
    while (!std::isfinite(potential.merit()) && !potential.pairs.empty() && t > barred) there = look(block, t *= 0.5);
    if (!std::isfinite(potential.merit())) break;
    std::swap(x_, trial_);
    accept(there);
    if (merit_ < (1.0 - sufficient) * merit) return true;
    const auto numbers = potential.contacts.numbers;
    if (hold_turning(block, potential, trial_.data(), x_.data())) look(block);
    find_matrix(scene, block);
    take_direction(scene, block);
    potential.contacts.numbers = numbers;
  }
  x_ = x, lambda_ = lambda, d_ = d, dl_ = dl;
  accept(look(block));
  return false;
}

// Along the Newton step that is in d_. False where nothing lowers what is to fall.
bool ImplicitBlock::go_down(const Scene& scene, const DirectBlock& block, int most_matrices) {
  if (rigid().empty()) {
    const int most = by_merit_ ? most_halvings_of_merit : most_halvings;
    if (search_line(block, most)) return true;
    if (!factored_) {  // what iterations left of R may be that of a heavy particle, which the merit feels less
      look(block);
      factorize_newton(scene, block);
      take_direction(scene, block);
      if (search_line(block, most)) return true;
    }
    return search_where_it_rubs(scene, block);
  }
  if (search_line(block, 1)) return true;
  if (step_over_kinks(scene, block, most_matrices)) return true;
  const double before = merit_;
  const auto goes_to_the_lowest = [&] {
    const auto merit_at = [&](double t) {
      look(block, t);
      return std::isfinite(potential.merit()) ? potential.merit() : std::numeric_limits<double>::infinity();
    };
    const double t = lowest(merit_at, merit_);
    if (t == 0.0) return false;
    const double there = look(block, t);
    if (!(potential.merit() < well_down * before)) return false;
    std::swap(x_, trial_);
    accept(there);
    return true;
  };
  return goes_to_the_lowest() || search_line(block, most_halvings) || search_where_it_rubs(scene, block);
}

}  // namespace sheetbend
