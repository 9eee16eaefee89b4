#include "adjoint/fit/corrected_motion.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "adjoint/equilibrium/equilibrium_vjp.h"
#include "adjoint/fit/corrected_rest.h"
#include "adjoint/observe/observation_vjp.h"
#include "core/threads/pool.h"

namespace sheetbend {
namespace {

using Eight = Dual<double, 8>;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr int numbers_per_stretch = 48;  // or those of one knot

// columns = directions (orthonormal) * coordinates, but for what is no longer than about `tolerance`. The pivots are chosen on the small factor of a plain
// QR, which goes by blocks.
struct Compressed {
  MatrixXd directions, coordinates;

  Compressed(const MatrixXd& columns, double tolerance) {
    const Eigen::HouseholderQR<MatrixXd> tall(columns);
    const Index count = std::min(columns.rows(), columns.cols());
    const Eigen::ColPivHouseholderQR<MatrixXd> small(
        MatrixXd(tall.matrixQR().topRows(count).triangularView<Eigen::Upper>()));
    const Index rank = (small.matrixQR().diagonal().array().abs() > tolerance).count();
    coordinates =
        MatrixXd(small.matrixQR().topRows(rank).triangularView<Eigen::Upper>()) * small.colsPermutation().transpose();
    directions = MatrixXd::Zero(columns.rows(), rank);
    directions.topRows(count) = small.householderQ() * MatrixXd::Identity(count, rank);
    directions.applyOnTheLeft(tall.householderQ().setLength(count));
  }
};

std::vector<int> up_to(int last) {
  std::vector<int> every(last + 1);
  std::iota(every.begin(), every.end(), 0);
  return every;
}

}  // namespace

std::unique_ptr<Corrected> Corrected::at(const Experiment& e, const double* theta, const double* b,
                                         Interrupt* interrupt) {
  if (e.is_static) return std::make_unique<CorrectedRest>(e, theta, b, interrupt);
  return std::make_unique<CorrectedMotion>(e, theta, b, interrupt);
}

CorrectedMotion::CorrectedMotion(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt)
    : Corrected(e, theta, b), last_(e.steps()), start_(inputs_) {
  const Scene& scene = *e.scene;
  const std::size_t dofs = scene.dofs();
  if (e.start == Start::equilibrium) {
    rest_ = e.anchor->solve(scene, inputs_.data(), e.equilibrium, interrupt);
    std::copy(rest_->x.begin(), rest_->x.end(), &start_[scene.layout.of(Quantity::position)]);
  } else if (e.start == Start::settled) {
    settled_.emplace(scene, *e.settling, inputs_.data(), e.t0);
    std::copy(settled_->x().begin(), settled_->x().end(), &start_[scene.layout.of(Quantity::position)]);
  }
  const std::vector<int> every = up_to(last_);
  states_.resize(every.size() * dofs);
  tape_.emplace(record_rollout(scene, e.plan, start_.data(), e.t0, every, states_.data(), every_state, interrupt));

  const double* offsets = &inputs_[scene.layout.total()];
  std::vector<double> x(dofs);
  double* r = residuals_.data();
  for (std::size_t f = 0; f < e.observed.times.size(); ++f) {
    first_row_.push_back(r - residuals_.data());
    const FramePlace<double> place(e, e.plan, f, inputs_.back(), last_);
    place.interpolate(dofs, [&](int k) { return &states_[(place.base - 1 + k) * dofs]; }, x.data());
    r = frame_residuals(e.observed, f, x.data(), offsets, r, static_cast<double*>(nullptr));
  }
  first_row_.push_back(residuals_.size());
}

std::vector<double> CorrectedMotion::gradient(Interrupt* interrupt) {
  const Scene& scene = *e_.scene;
  const std::size_t dofs = scene.dofs();
  std::vector<double> x_bar(states_.size()), x(dofs), frame_bar(dofs), inputs_bar(scene.layout.total());
  for (std::size_t f = 0; f < e_.observed.times.size(); ++f) {
    const FramePlace<double> place(e_, e_.plan, f, inputs_.back(), last_);
    const std::size_t first = (place.base - 1) * dofs;
    place.interpolate(dofs, [&](int k) { return &states_[first + k * dofs]; }, x.data());
    std::fill(frame_bar.begin(), frame_bar.end(), 0.0);
    pull_back_frame(e_.observed, f, x.data(), &inputs_[scene.layout.total()], frame_bar.data());
    for (int k = 0; k < 4; ++k)
      for (std::size_t i = 0; i < dofs; ++i) x_bar[first + k * dofs + i] += place.weight[k] * frame_bar[i];
  }
  reverse_rollout(scene, e_.plan, start_.data(), e_.t0, *tape_, up_to(last_), x_bar.data(), inputs_bar.data(),
                  interrupt);
  if (rest_ || settled_) {
    const auto at = inputs_bar.begin() + static_cast<std::ptrdiff_t>(scene.layout.of(Quantity::position));
    const std::vector<double> start_bar(at, at + static_cast<std::ptrdiff_t>(dofs));
    if (rest_) EquilibriumDerivative(scene, inputs_.data(), *rest_).vjp(start_bar.data(), nullptr, inputs_bar.data());
    if (settled_) {  // which these places alone make
      std::fill_n(at, dofs, 0.0);
      settled_->pull_back(start_bar.data(), inputs_bar.data());
    }
  }
  std::vector<double> b_bar(e_.correction.count());
  e_.correction.pull_back(inputs_bar.data(), b_bar.data());
  return b_bar;
}

// A knot reaches over one piece of the boundary's motion on either side, or two; the end values hold before and after. What the motion starts with
// acts at its start alone.
CorrectedMotion::Acts CorrectedMotion::acts(int number) const {
  const Scene& scene = *e_.scene;
  const Estimated& c = e_.correction;
  const auto begin = c.target.begin() + c.first[number], end = c.target.begin() + c.first[number + 1];
  if (begin == end) return {last_, 0};  // it moves nothing
  if (*std::min_element(begin, end) < static_cast<int>(scene.layout.of(Quantity::boundary))) return {0, 0};
  const auto knot = [&](int target) {
    return (target - static_cast<int>(scene.layout.of(Quantity::boundary))) /
           (3 * static_cast<int>(scene.driven.size()));
  };
  const int reach = scene.boundary.interpolation == Interpolation::cubic ? 2 : 1;
  const std::vector<double>& times = scene.boundary.times;
  const int first = knot(*std::min_element(begin, end)) - reach, behind = knot(*std::max_element(begin, end)) + reach;
  const auto step = [&](int k) { return (times[k] - e_.t0) / e_.plan.options.h; };
  const double from = first + reach == 0 ? 0.0 : std::floor(step(std::max(first, 0)) + 1e-9) + 1.0;
  return {static_cast<int>(std::clamp(from, 0.0, static_cast<double>(last_))),
          behind >= static_cast<int>(times.size())
              ? last_
              : static_cast<int>(std::clamp(std::ceil(step(behind) - 1e-9), 0.0, static_cast<double>(last_)))};
}

// A stretch begins three substeps before its first number does, so that every frame that is moved has its four states in it.
std::vector<CorrectedMotion::Stretch> CorrectedMotion::stretches() const {
  const int count = e_.correction.unknowns();
  std::vector<int> order(count), from(count), until(count);
  for (int i = 0; i < count; ++i) {
    const Acts a = acts(i);
    order[i] = i;
    from[i] = std::max(0, a.from - 3);
    until[i] = a.until;
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return from[a] < from[b]; });
  std::vector<Stretch> all;
  for (int first = 0, next; first < count; first = next) {
    next = std::min(first + numbers_per_stretch, count);
    while (next < count && from[order[next]] == from[order[next - 1]]) ++next;
    Stretch s{from[order[first]], next < count ? from[order[next]] : last_, {}, {}, {}, {}, {}};
    for (int i = first; i < next; ++i) {
      s.numbers.push_back(order[i]);
      s.at.push_back(from[order[i]]);
    }
    if (!all.empty()) s.acting = all.back().onward;
    for (const auto* numbers : {&s.acting, &s.numbers})
      for (const int i : *numbers)
        if (next < count && until[i] > s.end) s.onward.push_back(i);
    const auto frame_from = [&](int step) {
      std::size_t f = 0;
      while (f < e_.observed.times.size() && FramePlace<double>(e_, e_.plan, f, inputs_.back(), last_).base - 1 < step)
        ++f;
      return f;
    };
    s.frames[0] = frame_from(s.begin);
    s.frames[1] = next < count ? frame_from(s.end) : e_.observed.times.size();
    all.push_back(std::move(s));
  }
  return all;
}

Response CorrectedMotion::response(double tolerance, int threads, Interrupt* interrupt) const {
  Response found{static_cast<int>(residuals_.size()), e_.correction.unknowns(), {}};
  const std::vector<Stretch> all = stretches();
  const double time = last_ * e_.plan.options.h / static_cast<double>(std::max<std::size_t>(all.size(), 1));
  const double place = *std::min_element(e_.observed.sigma.begin(), e_.observed.sigma.end());
  const Unit unit{place, place / time};
  MatrixXd carried(4 * e_.scene->dofs(), 0);
  for (const Stretch& s : all) {
    const bool last = &s == &all.back();
    const int directions = static_cast<int>(carried.cols() + s.numbers.size());
    Response::Segment& segment = found.segments.emplace_back();
    segment.numbers = s.numbers;
    segment.first_row = static_cast<int>(first_row_[s.frames[0]]);
    segment.G = MatrixXd::Zero(static_cast<Index>(first_row_[s.frames[1]]) - segment.first_row, directions);
    MatrixXd reached =
        MatrixXd::Zero(last ? 0 : static_cast<Index>(4 * e_.scene->dofs() + s.onward.size()), directions);
    parallel_for((directions + 7) / 8, threads, 1, [&](int begin, int end) {
      for (int first = 8 * begin; first < std::min(8 * end, directions); first += 8)
        march({s, unit, carried, first, std::min(8, directions - first)}, segment.G, reached, interrupt);
    });
    segment.R.resize(0, directions);
    if (last) break;
    const Compressed basis(reached, tolerance);
    segment.R = basis.coordinates;
    carried = basis.directions;
  }
  return found;
}

// Tangents of the numbers of the correction.
std::vector<Eight> CorrectedMotion::moved_numbers(const Directions& d) const {
  const std::size_t dofs = e_.scene->dofs();
  std::vector<Eight> b(e_.correction.count());
  d.each_brought([&](int k, const auto& direction) {
    for (std::size_t i = 0; i < d.stretch.acting.size(); ++i)
      b[d.stretch.acting[i]].d[k] = d.unit.place * direction[4 * dofs + i];
  });
  for (int k = std::max(0, d.brought() - d.first); k < d.width; ++k) {
    const int number = d.stretch.numbers[d.first + k - d.brought()];
    b[number].d[k] = e_.correction.sigma[number];
  }
  return b;
}

// The inputs with these tangents, and those of what the motion starts at.
std::vector<Eight> CorrectedMotion::moved_inputs(const Directions& d, const std::vector<Eight>& b,
                                                 Interrupt* interrupt) const {
  const Scene& scene = *e_.scene;
  const bool starts = d.from() == 0;
  const std::vector<double>& values = starts ? inputs_ : start_;
  std::vector<Eight> in(values.begin(), values.end());
  for (const auto* numbers : {&d.stretch.acting, &d.stretch.numbers})
    for (const int i : *numbers)
      e_.correction.apply(i, b[i], in.data());  // of value zero: they are in the inputs already
  if (starts && rest_) {
    const auto x = equilibrium_coordinates<Eight>(scene, in.data(), e_.equilibrium, *e_.anchor, interrupt);
    std::copy(x.begin(), x.end(), &in[scene.layout.of(Quantity::position)]);
  } else if (starts && settled_) {
    const auto x = settled_coordinates<Eight>(scene, *e_.settling, in.data(), e_.t0);
    std::copy(x.begin(), x.end(), &in[scene.layout.of(Quantity::position)]);
  }
  return in;
}

// Lets a rollout go on from the state where directions begin, with their tangents.
void CorrectedMotion::restart(const Directions& d, Rollout<Eight>& rollout) const {
  const std::size_t dofs = e_.scene->dofs();
  const int from = d.from();
  std::vector<double> v(dofs), v_before(dofs);
  const double* v0 = &start_[e_.scene->layout.of(Quantity::velocity)];
  tape_->velocity(from, v0, v.data());
  tape_->velocity(from - 1, v0, v_before.data());
  const double* parts[4] = {&states_[from * dofs], &states_[(from - 1) * dofs], v.data(), v_before.data()};
  std::array<std::vector<Eight>, 4> state;
  for (std::size_t part = 0; part < 4; ++part) {
    state[part].assign(parts[part], parts[part] + dofs);
    d.each_brought([&](int k, const auto& direction) {
      for (std::size_t i = 0; i < dofs; ++i) state[part][i].d[k] = d.unit.of(part) * direction[part * dofs + i];
    });
  }
  rollout.restart(from, {state[0].data(), state[1].data(), state[2].data(), state[3].data(), from});
}

// Fills the columns of these directions in G, and in what is reached at the end of their stretch.
void CorrectedMotion::march(const Directions& d, MatrixXd& G, MatrixXd& reached, Interrupt* interrupt) const {
  const Scene& scene = *e_.scene;
  const Stretch& s = d.stretch;
  const std::size_t dofs = scene.dofs();
  const int from = d.from();
  const std::vector<Eight> b = moved_numbers(d), in = moved_inputs(d, b, interrupt);
  Rollout<Eight> rollout(scene, e_.plan, in.data(), e_.t0);
  if (from > 0) restart(d, rollout);

  const std::vector<Eight> offsets(inputs_.begin() + static_cast<std::ptrdiff_t>(scene.layout.total()), inputs_.end());
  std::vector<Eight> ring(4 * dofs), x(dofs), r(3 * e_.observed.markers.size());
  std::size_t next = s.frames[0];
  const auto place_of = [&] { return FramePlace<Eight>(e_, e_.plan, next, Eight(inputs_.back()), last_); };
  while (next < s.frames[1] && place_of().base - 1 < from) ++next;
  const auto keep = [&](int step) {
    std::copy_n(rollout.x(), dofs, &ring[(step % 4) * dofs]);
    for (; next < s.frames[1]; ++next) {
      const FramePlace<Eight> place = place_of();
      if (step < place.base + 2) return;
      place.interpolate(dofs, [&](int k) { return &ring[((place.base - 1 + k) % 4) * dofs]; }, x.data());
      const Eight* end =
          frame_residuals(e_.observed, next, x.data(), offsets.data(), r.data(), static_cast<Eight*>(nullptr));
      const auto row = static_cast<Index>(first_row_[next] - first_row_[s.frames[0]]);
      for (int k = 0; k < d.width; ++k)
        for (std::ptrdiff_t i = 0; i < end - r.data(); ++i) G(row + i, d.first + k) = r[i].d[k];
    }
  };
  keep(from);
  for (int step = from; step < s.end || next < s.frames[1];) {
    poll(interrupt, ++step, scene.dofs());
    rollout.advance();
    keep(step);
    if (step != s.end || reached.size() == 0) continue;
    const SubstepStates<Eight> now = rollout.state();
    const Eight* parts[4] = {now.x, now.x_before, now.v, now.v_before};
    for (int k = 0; k < d.width; ++k) {
      for (std::size_t part = 0; part < 4; ++part)
        for (std::size_t i = 0; i < dofs; ++i)
          reached(part * dofs + i, d.first + k) = parts[part][i].d[k] / d.unit.of(part);
      for (std::size_t i = 0; i < s.onward.size(); ++i)
        reached(4 * dofs + i, d.first + k) = b[s.onward[i]].d[k] / d.unit.place;
    }
  }
}

}  // namespace sheetbend
