// Rollouts from Python: forward, and batches in lanes. Shapes: inputs (total,), states (wanted, dofs); a batch has a leading dimension.
#include <algorithm>
#include <functional>
#include <numeric>

#include "adjoint/observe/settled.h"
#include "adjoint/rollout/rollout.h"
#include "core/rollout/contact_counts.h"
#include "core/rollout/redundant_rows.h"
#include "python/bindings/solver.h"

namespace sheetbend::bindings {

using namespace py::literals;

namespace {

Solver make_solver(std::shared_ptr<Scene> scene, double h, const std::string& integrator, const std::string& partition,
                   int iterations, double force_tolerance, int threads, int grain, double cg_tolerance,
                   int cg_iterations) {
  SolverOptions o;
  o.h = h;
  o.iterations = iterations;
  o.force_tolerance = force_tolerance;
  o.threads = threads;
  o.grain = grain;
  o.cg_tolerance = cg_tolerance;
  o.cg_iterations = cg_iterations;
  if (integrator != "bdf1" && integrator != "bdf2")
    throw std::invalid_argument("integrator: got '" + integrator + "'. Fix: use 'bdf1' or 'bdf2'");
  o.integrator = integrator == "bdf1" ? Integrator::bdf1 : Integrator::bdf2;
  o.partition = partition_of(partition);
  Plan plan = make_plan(*scene, o);
  return {std::move(scene), std::move(plan)};
}

// The arguments of make_solver, in order.
py::tuple arguments_of_solver(const Solver& s) {
  const SolverOptions& o = s.plan.options;
  return py::make_tuple(s.scene, o.h, o.integrator == Integrator::bdf1 ? "bdf1" : "bdf2", name_of(o.partition),
                        o.iterations, o.force_tolerance, o.threads, o.grain, o.cg_tolerance, o.cg_iterations);
}

Solver solver_of(const py::tuple& a) {
  return make_solver(a[0].cast<std::shared_ptr<Scene>>(), a[1].cast<double>(), a[2].cast<std::string>(),
                     a[3].cast<std::string>(), a[4].cast<int>(), a[5].cast<double>(), a[6].cast<int>(),
                     a[7].cast<int>(), a[8].cast<double>(), a[9].cast<int>());
}

// Forward only: positions, velocities and constraint multipliers in force units at the wanted substeps, how many substeps went with BDF1, and
// what contacts did: counted over the substeps, and in the last one before each frame (0 apart, 1 sticks, 2 slides), one contact after the other.
py::dict simulate(const Solver& s, const Array& inputs, const Steps& steps, double t0) {
  check(s, inputs, 1, steps);
  const std::size_t dofs = s.scene->dofs(), rows = s.scene->multipliers(), frames = steps.size();
  auto positions = empty({frames, dofs}), velocities = empty({frames, dofs}), multipliers = empty({frames, rows});
  double *x = positions.mutable_data(), *v = velocities.mutable_data(), *force = multipliers.mutable_data();
  int first_order = 0;
  CountContacts contacts(*s.scene);
  const std::size_t touching = points_in_contact(*s.scene);
  py::array_t<unsigned char> modes({frames, touching});
  unsigned char* mode = modes.mutable_data();
  {
    Release release;
    SignalInterrupt interrupt;
    Rollout<double> rollout(*s.scene, s.plan, inputs.data(), t0);
    std::size_t next = 0;
    rollout.run(
        steps.back(),
        [&](int step, const double* xs, const double* vs) {
          const double eta = rollout.bdf().eta;
          if (step > 0) {
            first_order += rollout.first_order() != 0;
            contacts.look(rollout);
          }
          const double* lambda = next < frames && steps[next] == step ? rollout.multipliers() : nullptr;
          for (; next < frames && steps[next] == step; ++next) {
            x = std::copy_n(xs, dofs, x);
            v = std::copy_n(vs, dofs, v);
            for (std::size_t r = 0; r < rows; ++r) *force++ = step == 0 ? 0.0 : lambda[r] / (eta * eta);
            mode = std::transform(rollout.contact_modes().begin(), rollout.contact_modes().end(), mode,
                                  [](ContactMode m) { return static_cast<unsigned char>(m); });
          }
        },
        &interrupt);
  }
  py::dict out;
  out["positions"] = positions;
  out["velocities"] = velocities;
  out["multipliers"] = multipliers;
  out["first_order"] = first_order;
  py::list counts;
  const auto counted = [&](const ContactCounts& c) {
    counts.append(py::dict("most"_a = c.most, "began"_a = c.began, "ended"_a = c.ended, "touching"_a = c.touching,
                           "sliding"_a = c.sliding));
  };
  for (const ContactCounts& c : contacts.counts()) counted(c);
  if (s.scene->self_contact.rubs()) counted(contacts.pairs());
  if (!s.scene->balls.empty()) counted(contacts.balls());
  out["contacts"] = counts;
  out["contact_modes"] = modes;
  return out;
}

// The force that is left at the start and after each Newton step, over the largest one: per substep, and per block in it.
std::vector<std::vector<std::vector<double>>> force_balance(const Solver& s, const Array& inputs, int steps,
                                                            double t0) {
  check(s, inputs, 1, {steps});
  std::vector<std::vector<std::vector<double>>> all;
  Release release;
  SignalInterrupt interrupt;
  Rollout<double> rollout(*s.scene, s.plan, inputs.data(), t0);
  rollout.run(
      steps,
      [&](int step, const double*, const double*) {
        if (step > 0) all.push_back(rollout.balance());
      },
      &interrupt);
  return all;
}

// Where a start that settles (adjoint/observe/settled.h) begins: (dofs,).
py::array_t<double> settled(const Solver& s, const Array& inputs, double t0) {
  expect_size(inputs, s.scene->layout.total(), "inputs");
  auto out = empty({static_cast<std::size_t>(s.scene->dofs())});
  double* to = out.mutable_data();
  Release release;
  std::ranges::copy(settled_coordinates(*s.scene, settling_plan(*s.scene, s.plan.options), inputs.data(), t0), to);
  return out;
}

// Which rows of the first substep say what others say already, in words; empty where there are none.
std::string redundant(const Solver& s, const Array& inputs, double t0) {
  expect_size(inputs, s.scene->layout.total(), "inputs");
  Release release;
  const double* x = inputs.data() + s.scene->layout.of(Quantity::position);
  return describe(*s.scene, redundant_rows(*s.scene, s.plan, inputs.data(), t0), x);
}

// The constraints that these rows take part in, as constraints_among() has them.
std::vector<int> redundant_constraints(const Solver& s, const Array& inputs, double t0) {
  expect_size(inputs, s.scene->layout.total(), "inputs");
  Release release;
  return constraints_among(*s.scene, redundant_rows(*s.scene, s.plan, inputs.data(), t0));
}

py::array_t<double> states(const Solver& s, const Array& inputs, const Steps& steps, double t0) {
  check(s, inputs, 1, steps);
  auto out = empty({steps.size(), static_cast<std::size_t>(s.scene->dofs())});
  double* x = out.mutable_data();
  Release release;
  SignalInterrupt interrupt;
  rollout_states(*s.scene, s.plan, inputs.data(), t0, steps, x, &interrupt);
  return out;
}

// States (B, F, dofs) of a batch; after its own last frame a scene stands still.
py::array_t<double> simulate_batch(const Solver& s, const Array& inputs, const Steps& steps, double t0,
                                   const Lengths& lengths) {
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs(), frames = steps.size();
  const std::size_t count = static_cast<std::size_t>(inputs.size()) / total;
  check(s, inputs, count, steps);
  auto out = empty({count, frames, dofs});
  double* x = out.mutable_data();
  for_each_pack(s, inputs.data(), count, steps, lengths,
                [&](const PackOfScenes& pack, const std::vector<Pack>& in, const Steps& own, Interrupt* interrupt) {
                  std::vector<Pack> lanes(own.size() * dofs);
                  rollout_states(*s.scene, s.plan, in.data(), t0, own, lanes.data(), interrupt);
                  pack.from_lanes(lanes, x, frames * dofs);
                  for (int k = 0; k < pack.count; ++k) {
                    double* scene = x + pack.scene[k] * frames * dofs;
                    for (std::size_t f = pack.length[k]; f < frames; ++f)
                      std::copy_n(scene + (pack.length[k] - 1) * dofs, dofs, scene + f * dofs);
                  }
                });
  return out;
}

}  // namespace

void check(const Solver& s, const Array& inputs, std::size_t batch, const Steps& steps) {
  expect_size(inputs, batch * s.scene->layout.total(), "inputs");
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (steps[i] < 0 || (i > 0 && steps[i] < steps[i - 1]))
      throw std::invalid_argument("steps: must be ascending and not negative");
  if (steps.empty()) throw std::invalid_argument("steps: empty. Fix: ask for at least one");
}

std::vector<Pack> PackOfScenes::to_lanes(const double* data, std::size_t size, std::size_t stride) const {
  std::vector<Pack> lanes(size);
  for (int k = 0; k < Pack::lanes; ++k)
    for (std::size_t i = 0; i < size; ++i) lanes[i].set(k, data[scene[k] * stride + i]);
  return lanes;
}

void PackOfScenes::from_lanes(const std::vector<Pack>& lanes, double* data, std::size_t stride) const {
  for (int k = 0; k < count; ++k)
    for (std::size_t i = 0; i < lanes.size(); ++i) data[scene[k] * stride + i] = lanes[i][k];
}

Lengths frames_of(std::size_t batch, const Steps& steps, const Lengths& lengths) {
  const int frames = static_cast<int>(steps.size());
  if (lengths.empty()) return Lengths(batch, frames);
  if (lengths.size() != batch)
    throw std::invalid_argument("lengths: got " + std::to_string(lengths.size()) + ". Fix: give one for each of " +
                                std::to_string(batch) + " scenes");
  for (const int length : lengths)
    if (length < 1 || length > frames)
      throw std::invalid_argument("lengths: got " + std::to_string(length) + ". Fix: give 1 to " +
                                  std::to_string(frames) + " frames");
  return lengths;
}

std::vector<PackOfScenes> packs_of(const Lengths& frames) {
  const std::size_t batch = frames.size();
  std::vector<std::size_t> order(batch);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t scene) { return frames[scene]; });
  std::vector<PackOfScenes> packs;
  for (std::size_t first = 0; first < batch; first += Pack::lanes) {
    PackOfScenes& pack = packs.emplace_back();
    pack.count = static_cast<int>(std::min<std::size_t>(Pack::lanes, batch - first));
    for (int k = 0; k < Pack::lanes; ++k) {
      pack.scene[k] = order[std::min(first + k, batch - 1)];
      pack.length[k] = frames[pack.scene[k]];
    }
    pack.frames = pack.length[0];
  }
  return packs;
}

void bind_rollout(py::module_& m) {
  py::class_<Solver> solver(m, "Solver");
  solver
      .def(py::init(&make_solver), py::kw_only(), py::arg("scene"), py::arg("h"), py::arg("integrator"),
           py::arg("partition"), py::arg("iterations"), py::arg("force_tolerance"), py::arg("threads"),
           py::arg("grain"), py::arg("cg_tolerance"), py::arg("cg_iterations"))
      .def(py::pickle(&arguments_of_solver, &solver_of))
      .def("simulate", &simulate, py::arg("inputs"), py::arg("steps"), py::arg("t0"))
      .def("states", &states, py::arg("inputs"), py::arg("steps"), py::arg("t0"))
      .def("force_balance", &force_balance, py::arg("inputs"), py::arg("steps"), py::arg("t0"))
      .def("settled", &settled, py::arg("inputs"), py::arg("t0"))
      .def("redundant", &redundant, py::arg("inputs"), py::arg("t0"))
      .def("redundant_constraints", &redundant_constraints, py::arg("inputs"), py::arg("t0"))
      .def("simulate_batch", &simulate_batch, py::arg("inputs"), py::arg("steps"), py::arg("t0"),
           py::arg("lengths") = Lengths())
      .def_property_readonly("blocks",
                             [](const Solver& s) {
                               std::vector<std::tuple<int, int, bool>> blocks;
                               for (const DirectBlock& b : s.plan.blocks)
                                 blocks.emplace_back(b.size(), b.structure.half_bandwidth(), b.banded());
                               return blocks;
                             })
      .def_property_readonly("colors", [](const Solver& s) { return s.plan.colors.size(); });
  bind_gradient(m, solver);
  bind_tangents(solver);
}

}  // namespace sheetbend::bindings
