// The first step of an implicit block's search for a balance, which takes what is driven to where it goes.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/solver/implicit_block.h"
#include "core/solver/moved_rows.h"

namespace sheetbend {

using sheetbend_blocks::row;

// One Newton step from the guess, to the first order in where fixed particles go; or the state at n with those moved, where Phi is lower.
void ImplicitBlock::take_first_step(const Scene& scene, const DirectBlock& block) {
  x_ = guess;
  settle_frames(block, potential.target, x_);
  if (!rigid().empty()) {
    potential.rigid.leave_out(potential.given(block), start.data());
    lambda_.assign(rigid().size(), 0.0);
  } else {
    lambda_.clear();
  }
  dl_ = lambda_;
  look(block);
  find_matrix(scene, block);
  z_.clear();
  bool moved = false;
  for (std::size_t i = row * block.movable; i < row * block.particles.size(); ++i) {
    z_[i] = potential.target[i] - guess[i];
    moved |= z_[i] != 0.0;
  }
  for (std::size_t i = 0; i < d_.size(); ++i) d_[i] = -potential.R()[i];
  if (moved) {
    matrix_.multiply(block, z_, Kz_);
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] -= Kz_[row * (i / 3) + i % 3];
  }
  if (!rigid().empty()) {
    rigid().multiply(block, z_.data(), dl_.data());
    rigid().add_softened(block, dl_.data(), d_.data());  // which K z has, being softened
    for (std::size_t j = 0; j < dl_.size(); ++j) dl_[j] = -(dl_[j] + rigid().residual(static_cast<int>(j)));
  }
  find_step(scene, block);
  move(guess, 1.0, d_, trial_);
  x_ = start;
  for (Numbers<double>* rows : {&x_, &trial_})
    std::copy(potential.target.data() + row * block.movable, potential.target.data() + row * block.particles.size(),
              rows->data() + row * block.movable);
  for (const BlockFrame& f : block.frames) std::copy_n(&potential.target[row * f.particle], 3, &x_[row * f.particle]);
  settle_frames(block, potential.target, x_);
  const auto at_trial = [&](Numbers<double>& from) {
    return settle_frames(block, potential.target, trial_) && potential.pairs.can_go(block, from, trial_)
               ? potential.evaluate(block, trial_)
               : potential.refuse();
  };
  if (potential.pairs.passing(start, x_)) {  // what is driven passes what stays behind, and may not what comes along
    potential.rigid.lambda = dl_;
    const double there = at_trial(start);
    if (!std::isfinite(there)) expect_none_passes(block, start, x_);
    std::swap(x_, trial_);
    accept(there);
    return;
  }
  accept(look(block));
  potential.rigid.lambda = dl_;
  const double there = at_trial(x_);
  const bool falls = by_merit_ || potential.by_merit() ? potential.merit() < merit_ : there < phi_;
  if (falls || !std::isfinite(phi_)) {
    std::swap(x_, trial_);
    accept(there);
  } else {
    look(block);
  }
}

// Of what is driven through something.
void ImplicitBlock::expect_none_passes(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) const {
  const BlockPair* pair = potential.pairs.passing(from, to);
  if (!pair) return;
  std::ostringstream problem;
  problem << "particles";
  const auto node_of = [&](int k) { return block.particles[block.surface.whole(pair->spots[k])]; };
  for (int k = 0; k < 4; ++k) problem << (k ? ", " : " ") << node_of(k);
  problem << " are driven through each other, or start there";
  throw Unbalanced(problem.str(), "use a smaller substep, or drive them around each other", matrices_,
                   potential.balance(), node_of(0));
}

}  // namespace sheetbend
