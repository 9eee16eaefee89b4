// Rollouts from Python: forward, with a tape, VJP, JVP, second derivatives and batches in lanes. Shapes: inputs (total,), states
// (wanted, dofs); a batch has a leading dimension.
#include <memory>

#include "adjoint/rollout.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"
#include "core/threads/pool.h"
#include "python/bindings/core_module.h"
#include "python/bindings/interrupt.h"

namespace sheetbend::bindings {
namespace {

struct Solver {
  std::shared_ptr<Scene> scene;
  Plan plan;
};

using Steps = std::vector<int>;
using Release = py::gil_scoped_release;

Solver make_solver(std::shared_ptr<Scene> scene, double h, const std::string& integrator, const std::string& partition,
                   int iterations, int threads, int grain) {
  SolverOptions o;
  o.h = h;
  o.iterations = iterations;
  o.threads = threads;
  o.grain = grain;
  if (integrator != "bdf1" && integrator != "bdf2")
    throw std::invalid_argument("integrator: got '" + integrator + "'. Fix: use 'bdf1' or 'bdf2'");
  if (partition != "direct" && partition != "gauss_seidel")
    throw std::invalid_argument("partition: got '" + partition + "'. Fix: use 'direct' or 'gauss_seidel'");
  o.integrator = integrator == "bdf1" ? Integrator::bdf1 : Integrator::bdf2;
  o.partition = partition == "direct" ? Partition::direct : Partition::gauss_seidel;
  Plan plan = make_plan(*scene, o);
  return {std::move(scene), std::move(plan)};
}

void check(const Solver& s, const Array& inputs, std::size_t batch, const Steps& steps) {
  expect_size(inputs, batch * s.scene->layout.total(), "inputs");
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (steps[i] < 0 || (i > 0 && steps[i] < steps[i - 1]))
      throw std::invalid_argument("steps: must be ascending and not negative");
  if (steps.empty()) throw std::invalid_argument("steps: empty. Fix: ask for at least one");
}

template <class T, class Get>
std::vector<double> pick(const Tape<T>& tape, const Steps& steps, std::size_t dofs, Get&& get) {
  std::vector<double> out(steps.size() * dofs);
  for (std::size_t f = 0; f < steps.size(); ++f)
    for (std::size_t i = 0; i < dofs; ++i) out[f * dofs + i] = get(tape.x(steps[f])[i]);
  return out;
}

// Forward only: positions, velocities and constraint multipliers in force units at the wanted substeps.
py::dict simulate(const Solver& s, const Array& inputs, const Steps& steps, double t0) {
  check(s, inputs, 1, steps);
  const std::size_t dofs = s.scene->dofs(), rows = s.scene->rows;
  std::vector<double> x(steps.size() * dofs), v(x.size()), force(steps.size() * rows);
  {
    Release release;
    SignalInterrupt interrupt;
    Rollout<double> rollout(*s.scene, s.plan, inputs.data(), t0);
    std::size_t next = 0;
    rollout.run(
        steps.back(),
        [&](int step, const double* xs, const double* vs) {
          const double eta = Bdf::at(s.plan.options, std::max(step - 1, 0)).eta;
          const double* lambda = next < steps.size() && steps[next] == step ? rollout.multipliers() : nullptr;
          for (; next < steps.size() && steps[next] == step; ++next) {
            std::copy_n(xs, dofs, &x[next * dofs]);
            std::copy_n(vs, dofs, &v[next * dofs]);
            for (std::size_t r = 0; r < rows; ++r) force[next * rows + r] = step == 0 ? 0.0 : lambda[r] / (eta * eta);
          }
        },
        &interrupt);
  }
  const auto f = static_cast<py::ssize_t>(steps.size()), d = static_cast<py::ssize_t>(dofs),
             r = static_cast<py::ssize_t>(rows);
  py::dict out;
  out["positions"] = to_numpy(x, {f, d});
  out["velocities"] = to_numpy(v, {f, d});
  out["multipliers"] = to_numpy(force, {f, r});
  return out;
}

py::array_t<double> states(const Solver& s, const Tape<double>& tape, const Steps& steps) {
  const std::size_t dofs = s.scene->dofs();
  return to_numpy(pick(tape, steps, dofs, [](double x) { return x; }),
                  {static_cast<py::ssize_t>(steps.size()), static_cast<py::ssize_t>(dofs)});
}

py::tuple jvp(const Solver& s, const Array& inputs, const Array& inputs_dot, const Steps& steps, double t0) {
  using D = Dual<double, 8>;
  check(s, inputs, 1, steps);
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs(), frames = steps.size();
  const std::size_t columns = static_cast<std::size_t>(inputs_dot.size()) / total;
  expect_size(inputs_dot, columns * total, "inputs_dot");
  std::vector<double> x(frames * dofs), x_dot(columns * frames * dofs);
  {
    Release release;
    SignalInterrupt interrupt;
    for (std::size_t first = 0; first < columns; first += 8) {
      const std::size_t width = std::min<std::size_t>(8, columns - first);
      std::vector<D> in(inputs.data(), inputs.data() + total);
      for (std::size_t k = 0; k < width; ++k)
        for (std::size_t i = 0; i < total; ++i) in[i].d[k] = inputs_dot.data()[(first + k) * total + i];
      const Tape<D> tape = record_rollout(*s.scene, s.plan, in.data(), t0, steps.back(), &interrupt);
      x = pick(tape, steps, dofs, [](const D& a) { return a.v; });
      for (std::size_t k = 0; k < width; ++k) {
        const auto column = pick(tape, steps, dofs, [k](const D& a) { return a.d[k]; });
        std::copy(column.begin(), column.end(),
                  x_dot.begin() + static_cast<std::ptrdiff_t>((first + k) * frames * dofs));
      }
    }
  }
  const auto f = static_cast<py::ssize_t>(frames), d = static_cast<py::ssize_t>(dofs);
  return py::make_tuple(to_numpy(x, {f, d}), to_numpy(x_dot, {static_cast<py::ssize_t>(columns), f, d}));
}

// Derivative of the states along one direction by complex step: an independent path for checks.
py::array_t<double> complex_step(const Solver& s, const Array& inputs, const Array& direction, const Steps& steps,
                                 double t0) {
  check(s, inputs, 1, steps);
  expect_size(direction, s.scene->layout.total(), "direction");
  constexpr double step = 1e-40;
  std::vector<double> x_dot;
  {
    Release release;
    SignalInterrupt interrupt;
    std::vector<Complex> in(inputs.data(), inputs.data() + inputs.size());
    for (std::size_t i = 0; i < in.size(); ++i) in[i].im = step * direction.data()[i];
    const auto tape = record_rollout(*s.scene, s.plan, in.data(), t0, steps.back(), &interrupt);
    x_dot = pick(tape, steps, s.scene->dofs(), [](const Complex& a) { return a.im / step; });
  }
  return to_numpy(x_dot, {static_cast<py::ssize_t>(steps.size()), static_cast<py::ssize_t>(s.scene->dofs())});
}

py::array_t<double> vjp(const Solver& s, const Array& inputs, const Tape<double>& tape, const Steps& steps,
                        const Array& x_bar, double t0) {
  check(s, inputs, 1, steps);
  expect_size(x_bar, steps.size() * s.scene->dofs(), "x_bar");
  std::vector<double> bar(s.scene->layout.total());
  {
    Release release;
    SignalInterrupt interrupt;
    reverse_rollout(*s.scene, s.plan, inputs.data(), t0, tape, steps, x_bar.data(), bar.data(), &interrupt);
  }
  return to_numpy(bar, {static_cast<py::ssize_t>(bar.size())});
}

// Forward over reverse: the VJP and its derivative along (inputs_dot, x_bar_dot).
py::tuple vjp_dot(const Solver& s, const Array& inputs, const Array& inputs_dot, const Steps& steps, const Array& x_bar,
                  const Array& x_bar_dot, double t0) {
  using D = Dual<double, 1>;
  check(s, inputs, 1, steps);
  const std::size_t total = s.scene->layout.total();
  expect_size(inputs_dot, total, "inputs_dot");
  expect_size(x_bar, steps.size() * s.scene->dofs(), "x_bar");
  expect_size(x_bar_dot, steps.size() * s.scene->dofs(), "x_bar_dot");
  std::vector<double> value(total), derivative(total);
  {
    Release release;
    SignalInterrupt interrupt;
    const auto duals = [](const Array& v, const Array& d) {
      std::vector<D> out(v.data(), v.data() + v.size());
      for (std::size_t i = 0; i < out.size(); ++i) out[i].d[0] = d.data()[i];
      return out;
    };
    const std::vector<D> in = duals(inputs, inputs_dot), seed = duals(x_bar, x_bar_dot);
    const auto tape = record_rollout(*s.scene, s.plan, in.data(), t0, steps.back(), &interrupt);
    std::vector<D> bar(total);
    reverse_rollout(*s.scene, s.plan, in.data(), t0, tape, steps, seed.data(), bar.data(), &interrupt);
    for (std::size_t i = 0; i < total; ++i) value[i] = bar[i].v, derivative[i] = bar[i].d[0];
  }
  const auto n = static_cast<py::ssize_t>(total);
  return py::make_tuple(to_numpy(value, {n}), to_numpy(derivative, {n}));
}

// Packs of eight scenes; lanes past the end repeat the last scene.
std::vector<Pack> to_lanes(const double* data, std::size_t batch, std::size_t first, std::size_t size) {
  std::vector<Pack> lanes(size);
  for (int k = 0; k < Pack::lanes; ++k) {
    const double* from = data + std::min(first + k, batch - 1) * size;
    for (std::size_t i = 0; i < size; ++i) lanes[i].set(k, from[i]);
  }
  return lanes;
}

// Forward of a batch and, when x_bar is given, its VJP: (B, F, dofs) or (B, total).
py::array_t<double> batch(const Solver& s, const Array& inputs, const Steps& steps, const Array* x_bar, double t0) {
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs(), frames = steps.size();
  const std::size_t count = static_cast<std::size_t>(inputs.size()) / total, width = x_bar ? total : frames * dofs;
  check(s, inputs, count, steps);
  if (x_bar) expect_size(*x_bar, count * frames * dofs, "x_bar");
  std::vector<double> out(count * width);
  {
    Release release;
    SignalInterrupt interrupt;
    const int packs = static_cast<int>((count + Pack::lanes - 1) / Pack::lanes);
    parallel_for(packs, s.plan.options.threads, 1, [&](int begin, int end) {
      for (int p = begin; p < end; ++p) {
        const std::size_t first = static_cast<std::size_t>(p) * Pack::lanes;
        const auto in = to_lanes(inputs.data(), count, first, total);
        const Tape<Pack> tape = record_rollout(*s.scene, s.plan, in.data(), t0, steps.back(), &interrupt);
        std::vector<Pack> result;
        if (x_bar) {
          result.resize(total);
          const auto seed = to_lanes(x_bar->data(), count, first, frames * dofs);
          reverse_rollout(*s.scene, s.plan, in.data(), t0, tape, steps, seed.data(), result.data(), &interrupt);
        } else {
          for (const int step : steps) result.insert(result.end(), tape.x(step), tape.x(step) + dofs);
        }
        for (std::size_t k = 0; k < Pack::lanes && first + k < count; ++k)
          for (std::size_t i = 0; i < width; ++i) out[(first + k) * width + i] = result[i][static_cast<int>(k)];
      }
    });
  }
  const auto b = static_cast<py::ssize_t>(count);
  if (x_bar) return to_numpy(out, {b, static_cast<py::ssize_t>(total)});
  return to_numpy(out, {b, static_cast<py::ssize_t>(frames), static_cast<py::ssize_t>(dofs)});
}

}  // namespace

void bind_rollout(py::module_& m) {
  py::class_<Tape<double>>(m, "Tape")
      .def_property_readonly("bytes", &Tape<double>::bytes)
      .def_property_readonly("steps", &Tape<double>::steps);
  py::class_<Solver>(m, "Solver")
      .def(py::init(&make_solver), py::kw_only(), py::arg("scene"), py::arg("h"), py::arg("integrator"),
           py::arg("partition"), py::arg("iterations"), py::arg("threads"), py::arg("grain"))
      .def("simulate", &simulate, py::arg("inputs"), py::arg("steps"), py::arg("t0"))
      .def(
          "record",
          [](const Solver& s, const Array& inputs, int steps, double t0) {
            check(s, inputs, 1, {steps});
            Release release;
            SignalInterrupt interrupt;
            return record_rollout(*s.scene, s.plan, inputs.data(), t0, steps, &interrupt);
          },
          py::arg("inputs"), py::arg("steps"), py::arg("t0"), py::keep_alive<0, 1>())
      .def("states", &states, py::arg("tape"), py::arg("steps"))
      .def("vjp", &vjp, py::arg("inputs"), py::arg("tape"), py::arg("steps"), py::arg("x_bar"), py::arg("t0"))
      .def("vjp_dot", &vjp_dot, py::arg("inputs"), py::arg("inputs_dot"), py::arg("steps"), py::arg("x_bar"),
           py::arg("x_bar_dot"), py::arg("t0"))
      .def("jvp", &jvp, py::arg("inputs"), py::arg("inputs_dot"), py::arg("steps"), py::arg("t0"))
      .def("complex_step", &complex_step, py::arg("inputs"), py::arg("direction"), py::arg("steps"), py::arg("t0"))
      .def(
          "simulate_batch",
          [](const Solver& s, const Array& inputs, const Steps& steps, double t0) {
            return batch(s, inputs, steps, nullptr, t0);
          },
          py::arg("inputs"), py::arg("steps"), py::arg("t0"))
      .def(
          "vjp_batch",
          [](const Solver& s, const Array& inputs, const Steps& steps, const Array& x_bar, double t0) {
            return batch(s, inputs, steps, &x_bar, t0);
          },
          py::arg("inputs"), py::arg("steps"), py::arg("x_bar"), py::arg("t0"))
      .def_property_readonly("blocks",
                             [](const Solver& s) {
                               std::vector<std::tuple<int, int, bool>> blocks;
                               for (const DirectBlock& b : s.plan.blocks)
                                 blocks.emplace_back(b.structure.size(), b.structure.half_bandwidth(),
                                                     b.structure.banded());
                               return blocks;
                             })
      .def_property_readonly("colors", [](const Solver& s) { return s.plan.colors.size(); });
}

}  // namespace sheetbend::bindings
