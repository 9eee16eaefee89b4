#include <sstream>

#include "core/solver/implicit_block.h"
#include "core/solver/moved_rows.h"

namespace sheetbend {
namespace {

std::string words(const Unbalanced& e, int substep, double time) {
  std::ostringstream out;
  out << e.problem << ", in substep " << substep << " (t = " << time << " s). Fix: " << e.fix;
  return out.str();
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

void ImplicitBlock::give_up(const DirectBlock& block) const {
  const int node = potential.worst_node(block);
  std::string fix = "use a smaller substep, allow more iterations, or check boundary motion near that time";
  std::ostringstream problem;
  problem.precision(2);
  problem << "forces do not balance: after " << matrices_ << " Newton matrices " << std::scientific
          << potential.balance() << " of the largest force is left at particle " << node;
  if (!potential.pairs.empty() && block.surface.rubs())
    fix =
        "use another substep, allow more iterations, or leave out the friction between pieces that touch each other, "
        "which may not balance where layers are pressed together";
  Numbers<double> from = x_, to = x_, predicted = potential.target;
  move(from, 1.0, d_, to);
  if (!settle_frames(block, predicted, to)) {
    problem << ", where frames of a rod turn by more than 84 degrees in one substep";
    fix =
        "begin where its frames are at rest (an equilibrium), give it a director that fits its rest shape, or use a "
        "smaller substep";
  }
  throw Unbalanced(problem.str(), fix, matrices_, potential.balance(), node);
}

}  // namespace sheetbend
