#include <sheetbend/residual_function.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "adjoint/fit/problem.h"
#include "adjoint/library/model.h"

namespace sheetbend::v0 {
namespace {

void check(const Observations& o, const sheetbend::Scene& scene) {
  if (o.times.empty() || o.markers.empty()) throw InputError("observed", "shows nothing", "give frames and markers");
  check_finite("observed.times", o.times);
  if (o.times.front() < 0.0 || !std::ranges::is_sorted(o.times))
    throw InputError("observed.times", "must be ascending from 0 or later", "give s on the scene's clock");
  if (o.at_rest && o.times.size() != 1)
    throw InputError("observed.times", "are several, and an equilibrium has one frame",
                     "give each shape as a recording of its own");
  check_size("observed.positions", o.positions.size(), 3 * o.times.size() * o.markers.size());
  for (std::size_t i = 0; i < o.positions.size(); i += 3) {
    const auto here = std::span(o.positions).subspan(i, 3);
    const auto finite = std::ranges::count_if(here, [](double x) { return std::isfinite(x); });
    const auto missing = std::ranges::count_if(here, [](double x) { return std::isnan(x); });
    if (finite != 3 && missing != 3)
      throw InputError("observed.positions", "hold part of a marker at " + std::to_string(i),
                       "give three finite numbers, or three NaN where it was not seen");
  }
  for (const Marker& m : o.markers)
    for (int k = 0; k < 4; ++k)
      if (m.particles[k] < 0 || m.particles[k] >= scene.nodes() || !std::isfinite(m.weights[k]))
        throw InputError("observed.markers", "sit on particles that do not exist",
                         "use particles 0 to " + std::to_string(scene.nodes() - 1) + " and finite weights");
  for (const double scale : {o.sigma, o.loss_scale})
    if (!(scale > 0.0) || !std::isfinite(scale))
      throw InputError("observed.sigma, loss_scale", "must be positive", "give the expected error of a marker in m");
}

sheetbend::Loss loss_of(Loss loss) {
  switch (loss) {
    case Loss::squares: return sheetbend::Loss::squares;
    case Loss::soft_l1: return sheetbend::Loss::soft_l1;
    case Loss::huber: return sheetbend::Loss::huber;
  }
  throw InputError("observed.loss", "is unknown", "use one of Loss");
}

Experiment experiment_of(const Scene& scene, Observations observed, Solver solver) {
  const std::shared_ptr<const Model>& model = Model::of(scene);
  solver.threads = 1;  // they share the columns
  Experiment e;
  e.name = model->name;
  e.scene = {model, &model->topology};
  e.plan = plan_of(*model, solver);
  e.map = model->map;
  e.map.extend(3 * observed.markers.size() + 1);  // no offsets of markers or of time
  e.least = model->least;
  e.most = model->most;
  for (const Marker& m : observed.markers) {
    sheetbend::Marker& marker = e.observed.markers.emplace_back();
    for (int k = 0; k < 4; ++k) marker.dof[k] = model->topology.first_dof[m.particles[k]];
    std::ranges::copy(m.weights, marker.weight.begin());
  }
  e.observed.sigma.assign(observed.times.size() * observed.markers.size(), observed.sigma);
  e.observed.times = std::move(observed.times);
  e.observed.measured = std::move(observed.positions);
  e.observed.loss = loss_of(observed.loss);
  e.observed.loss_scale = observed.loss_scale;
  e.is_static = observed.at_rest;
  e.start = observed.starts_at_rest ? Start::equilibrium : Start::given;
  return e;
}

std::vector<FreeParameter> free_parameters(const Scene& scene, const std::vector<Parameter>& parameters) {
  if (parameters.empty()) throw InputError("parameters", "are none", "name at least one quantity");
  std::vector<FreeParameter> free;
  for (const Parameter& p : parameters) {
    const std::size_t slot = scene.quantity(p.name);
    const Quantity& q = scene.quantities()[slot];
    if (p.scale == Scale::logarithmic && !(q.positive && q.value > 0.0))
      throw InputError("parameters." + p.name, "has no logarithm", "use Scale::linear");
    if (std::ranges::count(parameters, p.name, &Parameter::name) > 1)
      throw InputError("parameters." + p.name, "is there twice", "name it once");
    free.push_back({p.name, p.scale == Scale::logarithmic, {static_cast<int>(slot)}, {1.0}});
  }
  return free;
}

}  // namespace

struct ResidualFunction::Parts {
  std::vector<double> start;
  Problem problem;

  static std::unique_ptr<Parts> make(const Scene& scene, Observations observed, const Solver& solver,
                                     const std::vector<Parameter>& parameters) {
    const Model& model = *Model::of(scene);
    check(observed, model.topology);
    std::vector<FreeParameter> free = free_parameters(scene, parameters);
    std::vector<double> theta = checked_values(model, {}), start;
    for (const FreeParameter& p : free) {
      const double value = theta[static_cast<std::size_t>(p.slots[0])];
      start.push_back(p.log_scale ? std::log(value) : value);
    }
    std::vector<int> slots(theta.size());
    std::iota(slots.begin(), slots.end(), 0);
    std::vector<Experiment> experiments{experiment_of(scene, std::move(observed), solver)};
    return std::unique_ptr<Parts>(new Parts{
        std::move(start),
        Problem(std::move(experiments), std::move(theta), {std::move(slots)}, std::move(free), solver.threads)});
  }
};

ResidualFunction::ResidualFunction(const Scene& scene, Observations observed, const Solver& solver,
                                   std::vector<Parameter> parameters)
    : parts_(translated([&] { return Parts::make(scene, std::move(observed), solver, parameters); })) {}

ResidualFunction::~ResidualFunction() = default;
ResidualFunction::ResidualFunction(ResidualFunction&&) noexcept = default;
ResidualFunction& ResidualFunction::operator=(ResidualFunction&&) noexcept = default;

int ResidualFunction::rows() const { return parts_->problem.rows(); }
int ResidualFunction::parameters() const { return parts_->problem.parameters(); }
std::vector<double> ResidualFunction::start() const { return parts_->start; }

bool ResidualFunction::evaluate(std::span<const double> u, double* residual, double* jacobian) const {
  check_size("u", u.size(), parts_->start.size());
  return translated([&] { return parts_->problem.evaluate(u.data(), residual, jacobian, nullptr); });
}

std::string ResidualFunction::failure() const {
  const std::string& said = parts_->problem.failure();
  return said.empty() ? "a residual is not finite" : said;
}

std::vector<double> ResidualFunction::values(std::span<const double> u) const {
  check_size("u", u.size(), parts_->start.size());
  return parts_->problem.physical(u.data());
}

std::vector<double> ResidualFunction::simulate(std::span<const double> u) const {
  check_size("u", u.size(), parts_->start.size());
  return translated([&] { return parts_->problem.simulate(0, u.data(), nullptr); });
}

}  // namespace sheetbend::v0
