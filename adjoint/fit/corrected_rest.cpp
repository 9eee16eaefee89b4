#include "adjoint/fit/corrected_rest.h"

#include <numeric>

#include "adjoint/observe/observation_vjp.h"
#include "core/threads/pool.h"

namespace sheetbend {

CorrectedRest::CorrectedRest(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt)
    : Corrected(e, theta, b) {
  const Equilibrium rest = e.anchor->solve(*e.scene, inputs_.data(), e.equilibrium, interrupt);
  derivative_.emplace(*e.scene, inputs_.data(), rest);
  x_ = rest.x;
  frame_residuals(e.observed, 0, x_.data(), offsets(), residuals_.data(), static_cast<double*>(nullptr));
}

std::vector<double> CorrectedRest::gradient(Interrupt*) {
  std::vector<double> x_bar(x_.size()), inputs_bar(e_.scene->layout.total()), b_bar(e_.correction.count());
  pull_back_frame(e_.observed, 0, x_.data(), offsets(), x_bar.data());
  derivative_->vjp(x_bar.data(), nullptr, inputs_bar.data());
  e_.correction.pull_back(inputs_bar.data(), b_bar.data());
  return b_bar;
}

// There is nothing to leave out: one segment.
Response CorrectedRest::response(double, int threads, Interrupt* interrupt) const {
  using Eight = Dual<double, 8>;
  const int count = e_.correction.unknowns(), rows = static_cast<int>(residuals_.size());
  Response found{rows, count, {}};
  Response::Segment& all = found.segments.emplace_back();
  all.numbers.resize(count);
  std::iota(all.numbers.begin(), all.numbers.end(), 0);
  all.G.resize(rows, count);
  all.R.resize(0, count);
  parallel_for((count + 7) / 8, threads, 1, [&](int begin, int end) {
    for (int first = 8 * begin; first < std::min(8 * end, count); first += 8) {
      if (interrupt) interrupt->poll();
      const int width = std::min(8, count - first);
      std::vector<Eight> in(inputs_.begin(), inputs_.end()), x(x_.size()), r(rows);
      for (int k = 0; k < width; ++k) {
        Eight b;
        b.d[k] = e_.correction.sigma[first + k];
        e_.correction.apply(first + k, b, in.data());
      }
      derivative_->jvp(in.data(), x.data(), static_cast<Eight*>(nullptr));
      frame_residuals(e_.observed, 0, x.data(), &in[e_.scene->layout.total()], r.data(), static_cast<Eight*>(nullptr));
      for (int k = 0; k < width; ++k)
        for (int i = 0; i < rows; ++i) all.G(i, first + k) = r[i].d[k];
    }
  });
  return found;
}

}  // namespace sheetbend
