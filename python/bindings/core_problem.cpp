// Least-squares problems from Python: built from plain dictionaries that sheetbend.fit assembles.
#include "adjoint/fit/problem.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <optional>

#include "adjoint/fit/evaluation.h"
#include "adjoint/observe/settled.h"
#include "python/bindings/interrupt.h"
#include "python/bindings/solver.h"

namespace sheetbend::bindings {
namespace {

template <class V>
V get(const py::dict& d, const char* key) {
  return d[key].cast<V>();
}

std::vector<double> numbers(const py::dict& d, const char* key) {
  const auto a = d[key].cast<Array>();
  return {a.data(), a.data() + a.size()};
}

Observations make_observations(const py::dict& d) {
  Observations o;
  o.times = numbers(d, "times");
  o.measured = numbers(d, "measured");
  o.sigma = numbers(d, "sigma");
  o.axes = get<std::vector<int>>(d, "axes");
  const auto loss = get<std::string>(d, "loss");
  const std::map<std::string, Loss> losses = {
      {"squares", Loss::squares}, {"soft_l1", Loss::soft_l1}, {"huber", Loss::huber}, {"cauchy", Loss::cauchy}};
  if (!losses.contains(loss))
    throw std::invalid_argument("loss: got '" + loss + "'. Fix: use 'squares', 'soft_l1', 'huber' or 'cauchy'");
  o.loss = losses.at(loss);
  o.loss_scale = get<double>(d, "loss_scale");
  if (!d["cloud"].is_none()) {
    const auto cloud = get<py::dict>(d, "cloud");
    o.unplaced = get<std::size_t>(cloud, "points");
    auto vertices = get<std::vector<int>>(cloud, "vertices");
    if (cloud.contains("triangles"))
      o.shape = make_cloth_surface(std::move(vertices), get<std::vector<std::array<int, 3>>>(cloud, "triangles"));
    else
      o.shape = make_rope_lines(std::move(vertices), get<std::vector<std::array<int, 2>>>(cloud, "links"));
  }
  for (const py::handle item : d["markers"]) {
    const auto m = item.cast<py::dict>();
    Marker marker;
    const auto dof = get<std::vector<int>>(m, "dof");
    const auto weight = get<std::vector<double>>(m, "weight");
    if (dof.size() < 4 || dof.size() > marker.dof.size() || weight.size() != dof.size())
      throw std::invalid_argument("markers: a place has four to eight nodes and as many weights");
    marker.nodes = static_cast<int>(dof.size());
    std::ranges::copy(dof, marker.dof.begin());
    std::ranges::copy(weight, marker.weight.begin());
    marker.tangent = get<std::array<double, 4>>(m, "tangent");
    marker.normal = get<std::array<double, 3>>(m, "normal");
    marker.carries_offset = get<bool>(m, "carries_offset");
    marker.on_axes = get<bool>(m, "on_axes");
    o.markers.push_back(marker);
  }
  return o;
}

ForceSensor make_sensor(const Scene& scene, const py::dict& d) {
  ForceSensor s;
  s.reader = SupportReader(scene, {whole_numbers(d["particles"]), whole_numbers(d["carried"]), get<int>(d, "about")});
  s.arm = get<std::array<double, 3>>(d, "arm");
  s.sign = get<double>(d, "sign");
  s.times = numbers(d, "times");
  s.sample = whole_numbers(d["sample"]);
  s.share = numbers(d, "share");
  s.rotation = numbers(d, "rotation");
  s.measured = numbers(d, "measured");
  s.sigma = get<std::array<double, 6>>(d, "sigma");
  return s;
}

Estimated make_correction(const py::dict& d) {
  Estimated c;
  c.sigma = numbers(d, "sigma");
  c.given = numbers(d, "given");
  c.first = whole_numbers(d["first"]);
  c.target = whole_numbers(d["target"]);
  c.weight = numbers(d, "weight");
  return c;
}

Start start_of(const std::string& name) {
  if (name == "estimated" || name == "settled") return Start::settled;
  if (name == "equilibrium") return Start::equilibrium;
  if (name == "given") return Start::given;
  throw std::invalid_argument("start: '" + name + "' is unknown");
}

Experiment make_experiment(const py::dict& d) {
  Experiment e;
  e.name = get<std::string>(d, "name");
  e.scene = get<std::shared_ptr<Scene>>(d, "scene");
  SolverOptions o;
  o.h = get<double>(d, "h");
  o.integrator = get<std::string>(d, "integrator") == "bdf1" ? Integrator::bdf1 : Integrator::bdf2;
  o.partition = partition_of(get<std::string>(d, "partition"));
  o.iterations = get<int>(d, "iterations");
  o.force_tolerance = get<double>(d, "force_tolerance");
  o.cg_tolerance = get<double>(d, "cg_tolerance");
  o.cg_iterations = get<int>(d, "cg_iterations");
  e.plan = make_plan(*e.scene, o);
  for (const auto& [h, weight] : get<std::vector<std::pair<double, double>>>(d, "finer")) {
    o.h = h;
    e.finer.push_back({make_plan(*e.scene, o), weight});
  }
  e.map = make_map(get<py::dict>(d, "map"));
  e.least = numbers(d, "least");
  e.most = numbers(d, "most");
  e.observed = make_observations(get<py::dict>(d, "observed"));
  for (const py::handle sensor : d["sensors"]) e.sensors.push_back(make_sensor(*e.scene, sensor.cast<py::dict>()));
  if (!d["correction"].is_none()) e.correction = make_correction(get<py::dict>(d, "correction"));
  e.is_static = get<bool>(d, "is_static");
  e.start = start_of(get<std::string>(d, "start"));
  if (e.start == Start::settled) e.settling = settling_plan(*e.scene, e.plan.options);
  e.t0 = get<double>(d, "t0");
  e.equilibrium.t0 = e.t0;
  return e;
}

FreeParameter make_free(const py::dict& d) {
  FreeParameter p;
  p.name = get<std::string>(d, "name");
  p.log_scale = get<bool>(d, "log");
  p.slots = get<std::vector<int>>(d, "slots");
  p.factors = get<std::vector<double>>(d, "factors");
  p.has_prior = !d["prior"].is_none();
  if (p.has_prior) std::tie(p.prior_mean, p.prior_sd) = d["prior"].cast<std::pair<double, double>>();
  return p;
}

Problem make_problem(const std::vector<py::dict>& experiments, std::vector<double> theta,
                     std::vector<std::vector<int>> slots, const std::vector<py::dict>& free, int threads) {
  std::vector<Experiment> e;
  std::vector<FreeParameter> f;
  for (const py::dict& d : experiments) e.push_back(make_experiment(d));
  for (const py::dict& d : free) f.push_back(make_free(d));
  return Problem(std::move(e), std::move(theta), std::move(slots), std::move(f), threads);
}

// The compiled evaluation, for sheetbend._ceres; the problem must outlive it.
py::capsule evaluation(const Problem& p) {
  const auto call = [](const void* problem, const double* u, double* residual, double* jacobian, double* seconds) {
    SignalInterrupt interrupt;
    try {
      const auto began = std::chrono::steady_clock::now();
      const bool ok = static_cast<const Problem*>(problem)->evaluate(u, residual, jacobian, &interrupt);
      *seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
      return ok ? EvaluationStatus::ok : EvaluationStatus::no_answer;
    } catch (const Interrupted&) {
      return EvaluationStatus::interrupted;
    }
  };
  return py::capsule(new EvaluationFunction{&p, p.rows(), p.parameters(), call, !p.state().empty()},
                     EvaluationFunction::capsule_name, [](void* f) { delete static_cast<EvaluationFunction*>(f); });
}

// What a Python function is asked for by `evaluation_of`.
struct Asked {
  int rows, parameters;
  py::function function;
};

// The same of a Python function (u, with_jacobian) -> ((ok, residual, jacobian), seconds or None). What it raises passes through the optimizer,
// except for KeyboardInterrupt, which ends it with its best so far.
py::capsule evaluation_of(int rows, int parameters, py::function function, bool jacobian_along) {
  const auto call = [](const void* asked, const double* u, double* residual, double* jacobian, double* seconds) {
    const Asked& a = *static_cast<const Asked*>(asked);
    const py::gil_scoped_acquire gil;
    try {
      const auto [found, took] =
          a.function(Array(a.parameters, u), jacobian != nullptr).cast<std::pair<py::tuple, std::optional<double>>>();
      const auto r = found[1].cast<Array>(), J = found[2].cast<Array>();
      *seconds = took.value_or(std::numeric_limits<double>::quiet_NaN());
      if (!found[0].cast<bool>()) return EvaluationStatus::no_answer;
      expect_size(r, a.rows, "residuals");
      std::copy_n(r.data(), r.size(), residual);
      if (jacobian) {
        expect_size(J, static_cast<std::size_t>(a.rows) * a.parameters, "jacobian");
        std::copy_n(J.data(), J.size(), jacobian);
      }
      return EvaluationStatus::ok;
    } catch (const py::error_already_set& error) {
      if (!error.matches(PyExc_KeyboardInterrupt)) throw;
      return EvaluationStatus::interrupted;
    }
  };
  return py::capsule(
      new EvaluationFunction{new Asked{rows, parameters, std::move(function)}, rows, parameters, call, jacobian_along},
      EvaluationFunction::capsule_name, [](void* f) {
        const auto* made = static_cast<EvaluationFunction*>(f);
        delete static_cast<const Asked*>(made->problem);
        delete made;
      });
}

// What f(&interrupt) returns; it runs without the GIL and ends at a signal.
template <class F>
auto run_freely(F&& f) {
  py::gil_scoped_release release;
  SignalInterrupt interrupt;
  return f(&interrupt);
}

// As an array (size / columns, columns).
py::array_t<double> in_columns(const std::vector<double>& numbers, int columns) {
  return to_numpy(numbers, {static_cast<py::ssize_t>(numbers.size()) / columns, columns});
}
py::array_t<double> in_a_row(const std::vector<double>& numbers) {
  return to_numpy(numbers, {static_cast<py::ssize_t>(numbers.size())});
}

// (ok, residual, jacobian or None)
py::tuple evaluate(const Problem& p, const Array& u, bool with_jacobian) {
  expect_size(u, p.parameters(), "u");
  const auto rows = static_cast<py::ssize_t>(p.rows()), columns = static_cast<py::ssize_t>(p.parameters());
  py::array_t<double> residual(rows), jacobian({with_jacobian ? rows : 0, columns});
  double *r = residual.mutable_data(), *J = with_jacobian ? jacobian.mutable_data() : nullptr;
  const bool ok = run_freely([&](Interrupt* interrupt) { return p.evaluate(u.data(), r, J, interrupt); });
  return py::make_tuple(ok, residual, jacobian);
}

py::array_t<double> physical(const Problem& p, const Array& u) {
  expect_size(u, p.parameters(), "u");
  return in_a_row(p.physical(u.data()));
}

// Markers of an experiment, (frames times markers, 3).
py::array_t<double> markers_of(const Problem& p, int experiment, const Array& u) {
  expect_size(u, p.parameters(), "u");
  return in_columns(run_freely([&](Interrupt* interrupt) { return p.simulate(experiment, u.data(), interrupt); }), 3);
}

// Forces and torques of its sensors, (frames times sensors, 6).
py::array_t<double> readings_of(const Problem& p, int experiment, const Array& u) {
  expect_size(u, p.parameters(), "u");
  return in_columns(run_freely([&](Interrupt* interrupt) { return p.readings(experiment, u.data(), interrupt); }), 6);
}

// (changes, numbers of the markers)
py::array_t<double> respond(const Problem& p, int experiment, const Array& u, const Array& changes) {
  expect_size(u, p.parameters(), "u");
  const std::size_t numbers = p.correction(experiment).size();
  const auto count = numbers == 0 ? 0 : static_cast<int>(changes.size() / numbers);
  expect_size(changes, count * numbers, "changes");
  const auto moved = run_freely(
      [&](Interrupt* interrupt) { return p.respond(experiment, u.data(), changes.data(), count, interrupt); });
  return to_numpy(moved, {count, static_cast<py::ssize_t>(moved.size()) / std::max(count, 1)});
}

py::array_t<double> reduced(const Problem& p, const Array& change) {
  expect_size(change, p.data_rows(), "change");
  return in_a_row(p.reduced(change.data()));
}

}  // namespace

void bind_problem(py::module_& m) {
  py::class_<Problem>(m, "Problem")
      .def(py::init(&make_problem), py::kw_only(), py::arg("experiments"), py::arg("theta"), py::arg("slots"),
           py::arg("free"), py::arg("threads"))
      .def_property_readonly("rows", &Problem::rows)
      .def_property_readonly("data_rows", &Problem::data_rows)
      .def_property_readonly("first_rows", &Problem::first_rows)
      .def_property_readonly("parameters", &Problem::parameters)
      .def_property_readonly("failure", &Problem::failure)
      .def("evaluate", &evaluate, py::arg("u"), py::arg("jacobian") = true)
      .def("physical", &physical)
      .def("simulate", &markers_of)
      .def("readings", &readings_of)
      .def("respond", &respond)
      .def("reduced", &reduced)
      .def("correction", [](const Problem& p, int experiment) { return in_a_row(p.correction(experiment)); })
      .def("absorbed", &Problem::absorbed)
      .def("relinearize", &Problem::relinearize)
      .def("follow", &Problem::follow, py::arg("other"))
      .def("state", [](const Problem& p) { return in_a_row(p.state()); })
      .def("restore",
           [](const Problem& p, const Array& state) { p.restore({state.data(), state.data() + state.size()}); })
      .def("evaluation", &evaluation);
  m.def("evaluation_of", &evaluation_of, py::arg("rows"), py::arg("parameters"), py::arg("function"),
        py::arg("jacobian_along") = false);
}

}  // namespace sheetbend::bindings
