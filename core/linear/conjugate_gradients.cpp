#include "core/linear/conjugate_gradients.h"

#include <sstream>

namespace sheetbend {
namespace {

std::string words(const Stopping& stop, double residual) {
  std::ostringstream out;
  out.precision(2);
  out << "conjugate gradients: after " << stop.most << " iterations the residual is still " << std::scientific
      << residual << " of the right side, above a tolerance of " << stop.tolerance
      << ". Fix: allow more iterations, use a smaller substep, or newton where its factor fits in memory";
  return out.str();
}

}  // namespace

Unconverged::Unconverged(const Stopping& stop, double residual_)
    : std::runtime_error(words(stop, residual_)), iterations(stop.most), residual(residual_) {}

}  // namespace sheetbend
