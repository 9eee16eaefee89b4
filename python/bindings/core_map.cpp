// The parameter map from Python: values of named quantities to inputs, cotangents and tangents through it.
#include "adjoint/observe/parameter_map.h"

#include "core/scalar/dual.h"
#include "python/bindings/core_module.h"

namespace sheetbend::bindings {

ParameterMap make_map(const py::dict& d) {
  ParameterTerms terms;
  const auto base = d["base"].cast<Array>(), coefficient = d["coefficient"].cast<Array>(),
             weight = d["weight"].cast<Array>();
  terms.base.assign(base.data(), base.data() + base.size());
  terms.coefficient.assign(coefficient.data(), coefficient.data() + coefficient.size());
  terms.weight.assign(weight.data(), weight.data() + weight.size());
  terms.target = whole_numbers(d["target"]);
  terms.first_factor = whole_numbers(d["first_factor"]);
  terms.parameter = whole_numbers(d["parameter"]);
  for (const int f : whole_numbers(d["function"])) terms.function.push_back(static_cast<Factor1d>(f));
  if (!terms.in_order())
    throw std::invalid_argument("the map makes an intermediate value after it is used, or leaves one out");
  return ParameterMap(std::move(terms));
}

namespace {

// What make_map takes.
py::dict arrays_of(const ParameterMap& map) {
  const ParameterTerms& terms = map.terms();
  const auto numbers = [](const std::vector<int>& values) {
    return py::array_t<int>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  std::vector<int> function;
  for (const Factor1d f : terms.function) function.push_back(static_cast<int>(f));
  py::dict d;
  d["base"] = to_numpy(terms.base, {static_cast<py::ssize_t>(terms.base.size())});
  d["coefficient"] = to_numpy(terms.coefficient, {static_cast<py::ssize_t>(terms.coefficient.size())});
  d["weight"] = to_numpy(terms.weight, {static_cast<py::ssize_t>(terms.weight.size())});
  d["target"] = numbers(terms.target);
  d["first_factor"] = numbers(terms.first_factor);
  d["parameter"] = numbers(terms.parameter);
  d["function"] = numbers(function);
  return d;
}

}  // namespace

void bind_map(py::module_& m) {
  py::class_<ParameterMap>(m, "ParameterMap")
      .def(py::init(&make_map))
      .def(py::pickle(&arrays_of, &make_map))
      .def("inputs",
           [](const ParameterMap& map, const Array& theta) {
             py::array_t<double> out(static_cast<py::ssize_t>(map.terms().base.size()));
             map.apply(theta.data(), out.mutable_data());
             return out;
           })
      .def("inputs_dot",
           [](const ParameterMap& map, const Array& theta, const Array& theta_dot) {
             using D = Dual<double, 1>;
             std::vector<D> in(theta.data(), theta.data() + theta.size()), out(map.terms().base.size());
             for (std::size_t i = 0; i < in.size(); ++i) in[i].d[0] = theta_dot.data()[i];
             map.apply(in.data(), out.data());
             py::array_t<double> result(static_cast<py::ssize_t>(out.size()));
             for (std::size_t i = 0; i < out.size(); ++i) result.mutable_data()[i] = out[i].d[0];
             return result;
           })
      .def("theta_bar",
           [](const ParameterMap& map, const Array& theta, const Array& inputs_bar) {
             expect_size(inputs_bar, map.terms().base.size(), "inputs_bar");
             std::vector<double> out(theta.size());
             map.pull_back(theta.data(), inputs_bar.data(), out.data());
             return to_numpy(out, {static_cast<py::ssize_t>(out.size())});
           })
      // (theta_bar, its derivative along (theta_dot, inputs_bar_dot))
      .def("theta_bar_dot", [](const ParameterMap& map, const Array& theta, const Array& theta_dot,
                               const Array& inputs_bar, const Array& inputs_bar_dot) {
        using D = Dual<double, 1>;
        std::vector<D> in(theta.data(), theta.data() + theta.size()),
            bar(inputs_bar.data(), inputs_bar.data() + inputs_bar.size()), out(in.size());
        for (std::size_t i = 0; i < in.size(); ++i) in[i].d[0] = theta_dot.data()[i];
        for (std::size_t i = 0; i < bar.size(); ++i) bar[i].d[0] = inputs_bar_dot.data()[i];
        map.pull_back(in.data(), bar.data(), out.data());
        py::array_t<double> value(static_cast<py::ssize_t>(out.size())),
            derivative(static_cast<py::ssize_t>(out.size()));
        for (std::size_t i = 0; i < out.size(); ++i)
          value.mutable_data()[i] = out[i].v, derivative.mutable_data()[i] = out[i].d[0];
        return py::make_tuple(value, derivative);
      });
}

}  // namespace sheetbend::bindings
