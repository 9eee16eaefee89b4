#include "adjoint/library/model.h"

#include <algorithm>
#include <cmath>

#include "adjoint/library/ranges.h"
#include "core/constraints/registry.h"

namespace sheetbend::v0 {

void Model::complete() {
  for (const sheetbend::Group& g : topology.groups)
    with_kind(g.kind, [&]<class K>(K) { groups.push_back({g.name, K::name, g.count}); });
  for (int q = 0; q < quantity_count; ++q)
    arrays.push_back({quantity_names[q], topology.layout.offset[q], topology.layout.size[q]});
  auto ranges = library::ranges_of(topology);
  least = std::move(ranges.least), most = std::move(ranges.most);
}

std::vector<double> checked_values(const Model& model, std::span<const double> values) {
  std::vector<double> theta(values.begin(), values.end());
  if (values.empty())
    for (const Quantity& q : model.quantities) theta.push_back(q.value);
  check_size("values", theta.size(), model.quantities.size());
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const Quantity& q = model.quantities[k];
    if (std::isfinite(theta[k]) && theta[k] >= q.least && theta[k] <= q.most) continue;
    throw InputError("values." + q.name, "is " + std::to_string(theta[k]),
                     q.positive ? "give a positive number in " + q.unit
                                : "give a number from " + std::to_string(q.least) + " to " + std::to_string(q.most));
  }
  return theta;
}

std::vector<double> checked_inputs(const Model& model, std::span<const double> values) {
  const std::vector<double> theta = checked_values(model, values);
  std::vector<double> inputs(model.map.terms().base.size());
  model.map.apply(theta.data(), inputs.data());
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (!(inputs[i] >= model.least[i] && inputs[i] <= model.most[i]))
      throw InputError("values",
                       "make the " + library::describe_input(model.topology, i) + " " + std::to_string(inputs[i]),
                       "give values that leave it in its range");
  return inputs;
}

SolverOptions options_of(const Solver& s) {
  const auto refuse_unless = [](bool ok, const char* field, const char* problem, const char* fix) {
    if (!ok) throw InputError(field, problem, fix);
  };
  refuse_unless(std::isfinite(s.h) && s.h > 0.0, "solver.h", "must be a positive time in s",
                "give the substep, such as 1/600");
  refuse_unless(s.iterations >= 0, "solver.iterations", "must not be negative",
                "give at least 1, or 0 for the method's own");
  refuse_unless(s.threads >= 1 && s.grain >= 1 && s.cg_iterations >= 1, "solver.threads, grain, cg_iterations",
                "must be positive", "give at least 1");
  for (const double tolerance : {s.force_tolerance, s.cg_tolerance})
    refuse_unless(tolerance > 0.0 && tolerance <= 1e-3, "solver.force_tolerance, cg_tolerance", "must be at most 1e-3",
                  "give a small number, such as 1e-10");
  SolverOptions o;
  o.h = s.h;
  o.integrator = s.integrator == Integrator::bdf1 ? sheetbend::Integrator::bdf1 : sheetbend::Integrator::bdf2;
  switch (s.method) {
    case Method::direct: o.partition = Partition::direct, o.iterations = 2; break;
    case Method::newton: o.partition = Partition::newton, o.iterations = 2; break;
    case Method::newton_cg: o.partition = Partition::newton_cg, o.iterations = 2; break;
    case Method::implicit: o.partition = Partition::implicit, o.iterations = 100; break;
    case Method::gauss_seidel: o.partition = Partition::gauss_seidel, o.iterations = 10; break;
  }
  if (s.iterations > 0) o.iterations = s.iterations;
  o.force_tolerance = s.force_tolerance;
  o.cg_tolerance = s.cg_tolerance;
  o.cg_iterations = s.cg_iterations;
  o.threads = s.threads;
  o.grain = s.grain;
  return o;
}

Plan plan_of(const Model& model, const Solver& solver) {
  const SolverOptions options = options_of(solver);
  if (solver.method == Method::direct && options.iterations == 1 &&
      std::ranges::any_of(model.groups, [](const Group& g) { return g.kind == "shear"; }))
    throw InputError("solver.iterations", "1 loses up to half of the digits of gradients of rods that shear", "use 2");
  return translated([&] { return make_plan(model.topology, options); });
}

}  // namespace sheetbend::v0
