#include <sstream>

#include "core/solver/implicit_block.h"

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

}  // namespace sheetbend
