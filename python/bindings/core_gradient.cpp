// Gradients from Python: tapes and what they will cost, VJPs, single and in lanes. `memory` is a budget in bytes, None without one. Shapes as in
// core_rollout.cpp.
#include "adjoint/rollout/rollout.h"
#include "python/bindings/solver.h"

namespace sheetbend::bindings {
namespace {

TapePlan tape_plan(const Solver& s, const Steps& steps, std::size_t scenes, const Memory& memory) {
  return scenes == 1 ? plan_of<double>(s, steps, 1, memory) : plan_of<Pack>(s, steps, scenes, memory);
}

// (states, tape); the tape refers to the solver.
py::tuple record(const py::object& self, const Array& inputs, const Steps& steps, double t0, const Memory& memory) {
  const auto& s = self.cast<const Solver&>();
  check(s, inputs, 1, steps);
  const TapePlan plan = plan_of<double>(s, steps, 1, memory);
  auto states = empty({steps.size(), static_cast<std::size_t>(s.scene->dofs())});
  double* x = states.mutable_data();
  py::object tape = py::cast([&] {
    Release release;
    SignalInterrupt interrupt;
    return record_rollout(*s.scene, s.plan, inputs.data(), t0, steps, x, plan.states, &interrupt);
  }());
  py::detail::keep_alive_impl(tape, self);
  return py::make_tuple(states, tape);
}

// (gradient, substeps that were computed again for it).
py::tuple reverse(const Solver& s, const Array& inputs, Tape<double>& tape, const Steps& steps, const Array& x_bar,
                  double t0) {
  check(s, inputs, 1, steps);
  expect_size(x_bar, steps.size() * s.scene->dofs(), "x_bar");
  auto out = zeros({s.scene->layout.total()});
  double* inputs_bar = out.mutable_data();
  const long recomputed = [&] {
    Release release;
    SignalInterrupt interrupt;
    return reverse_rollout(*s.scene, s.plan, inputs.data(), t0, tape, steps, x_bar.data(), inputs_bar, &interrupt);
  }();
  return py::make_tuple(out, recomputed);
}

py::object vjp(const Solver& s, const Array& inputs, Tape<double>& tape, const Steps& steps, const Array& x_bar,
               double t0) {
  return reverse(s, inputs, tape, steps, x_bar, t0)[0];
}

// Records and reverses a batch, eight scenes at a time. seed(pack, x) makes cotangents of the states x (frames of the pack, dofs).
template <class Seed>
py::array_t<double> reverse_batch(const Solver& s, const Array& inputs, const Steps& steps, double t0,
                                  const Memory& memory, const Lengths& lengths, Seed&& seed) {
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs();
  const std::size_t count = static_cast<std::size_t>(inputs.size()) / total;
  check(s, inputs, count, steps);
  const TapePlan plan = plan_of<Pack>(s, steps, count, memory);
  auto out = empty({count, total});
  double* inputs_bar = out.mutable_data();
  for_each_pack(s, inputs.data(), count, steps, lengths,
                [&](const PackOfScenes& pack, const std::vector<Pack>& in, const Steps& own, Interrupt* interrupt) {
                  std::vector<Pack> x(own.size() * dofs), bar(total);
                  auto tape = record_rollout(*s.scene, s.plan, in.data(), t0, own, x.data(), plan.states, interrupt);
                  seed(pack, x);
                  for (int k = 0; k < Pack::lanes; ++k)
                    for (std::size_t i = pack.length[k] * dofs; i < x.size(); ++i) x[i].set(k, 0.0);
                  reverse_rollout(*s.scene, s.plan, in.data(), t0, tape, own, x.data(), bar.data(), interrupt);
                  pack.from_lanes(bar, inputs_bar, total);
                });
  return out;
}

// Gradients (B, total) of a batch from cotangents of its states; those of frames after a scene's last do not count.
py::array_t<double> vjp_batch(const Solver& s, const Array& inputs, const Steps& steps, const Array& x_bar, double t0,
                              const Memory& memory, const Lengths& lengths) {
  const std::size_t size = steps.size() * s.scene->dofs();
  expect_size(x_bar, static_cast<std::size_t>(inputs.size()) / s.scene->layout.total() * size, "x_bar");
  return reverse_batch(s, inputs, steps, t0, memory, lengths, [&](const PackOfScenes& pack, std::vector<Pack>& x) {
    x = pack.to_lanes(x_bar.data(), x.size(), size);
  });
}

// Half the sum of squared distances to targets (B, F, dofs), or (F, dofs) for all, and its gradient, in one pass over the batch: (B), (B, total).
py::tuple misfit_batch(const Solver& s, const Array& inputs, const Steps& steps, const Array& targets, double t0,
                       const Memory& memory, const Lengths& lengths) {
  const std::size_t dofs = s.scene->dofs(), size = steps.size() * dofs;
  const std::size_t batch = static_cast<std::size_t>(inputs.size()) / s.scene->layout.total();
  const bool shared = static_cast<std::size_t>(targets.size()) == size;
  if (!shared) expect_size(targets, batch * size, "targets");
  auto misfits = empty({batch});
  double* misfit = misfits.mutable_data();
  auto gradient =
      reverse_batch(s, inputs, steps, t0, memory, lengths, [&](const PackOfScenes& pack, std::vector<Pack>& x) {
        const auto wanted = pack.to_lanes(targets.data(), x.size(), shared ? 0 : size);
        for (std::size_t i = 0; i < x.size(); ++i) x[i] -= wanted[i];
        for (int k = 0; k < pack.count; ++k) {
          double sum = 0.0;
          for (std::size_t i = 0; i < pack.length[k] * dofs; ++i) sum += x[i][k] * x[i][k];
          misfit[pack.scene[k]] = 0.5 * sum;
        }
      });
  return py::make_tuple(misfits, gradient);
}

}  // namespace

void bind_gradient(py::module_& m, py::class_<Solver>& solver) {
  py::class_<Tape<double>>(m, "Tape")
      .def_property_readonly("bytes", &Tape<double>::bytes)
      .def_property_readonly("steps", &Tape<double>::steps)
      .def_property_readonly("states", &Tape<double>::states)
      .def_property_readonly("recomputed", &Tape<double>::recomputed);
  py::class_<TapePlan>(m, "TapePlan")
      .def_readonly("steps", &TapePlan::steps)
      .def_readonly("states", &TapePlan::states)
      .def_readonly("inputs", &TapePlan::inputs)
      .def_readonly("frames", &TapePlan::frames)
      .def_readonly("plan", &TapePlan::plan)
      .def_readonly("forward", &TapePlan::forward)
      .def_readonly("reverse", &TapePlan::reverse)
      .def_readonly("heap", &TapePlan::heap)
      .def_readonly("tape", &TapePlan::tape)
      .def_readonly("least", &TapePlan::least)
      .def_readonly("recomputed", &TapePlan::recomputed);
  solver.def("tape_plan", &tape_plan, py::arg("steps"), py::arg("scenes") = 1, py::arg("memory") = py::none())
      .def("record", &record, py::arg("inputs"), py::arg("steps"), py::arg("t0"), py::arg("memory") = py::none())
      .def("reverse", &reverse, py::arg("inputs"), py::arg("tape"), py::arg("steps"), py::arg("x_bar"), py::arg("t0"))
      .def("vjp", &vjp, py::arg("inputs"), py::arg("tape"), py::arg("steps"), py::arg("x_bar"), py::arg("t0"))
      .def("vjp_batch", &vjp_batch, py::arg("inputs"), py::arg("steps"), py::arg("x_bar"), py::arg("t0"),
           py::arg("memory") = py::none(), py::arg("lengths") = Lengths())
      .def("misfit_batch", &misfit_batch, py::arg("inputs"), py::arg("steps"), py::arg("targets"), py::arg("t0"),
           py::arg("memory") = py::none(), py::arg("lengths") = Lengths());
}

}  // namespace sheetbend::bindings
