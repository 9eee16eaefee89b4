// The registry of constraints as Python sees it.
#include <cmath>

#include "core/constraints/registry.h"
#include "core/constraints/rest_values.h"
#include "core/constraints/unit_names.h"
#include "python/bindings/core_module.h"

namespace sheetbend::bindings {
namespace {

const char* source_name(Source source) {
  switch (source) {
    case Source::given: return "given";
    case Source::measured: return "measured";
    case Source::usual: return "usual";
    case Source::normal: return "normal";
    case Source::preset: return "preset";
  }
  throw std::logic_error("unknown source of a parameter");
}

py::dict make_parameter(const Parameter& p) {
  py::dict parameter;
  parameter["unit"] = unit_name(p.unit);
  parameter["least"] = p.range.least;
  parameter["most"] = p.range.most;
  parameter["source"] = source_name(p.otherwise.source);
  const bool has_value = p.otherwise.source == Source::usual || p.otherwise.source == Source::preset;
  parameter["value"] = has_value ? py::object(py::float_(p.otherwise.value)) : py::none();
  return parameter;
}

template <class K>
py::dict make_kind() {
  py::dict kind, compliance, damping, parameters;
  compliance["unit"] = compliance_unit(K::unit);
  compliance["made_of"] = K::compliance.made_of;
  compliance["form"] = K::compliance.form == Compliance::matrix ? "matrix" : "scalar";
  compliance["never_zero"] = K::compliance.never_zero ? py::object(py::str(K::compliance.never_zero)) : py::none();
  damping["unit"] = damping_unit(K::unit);
  for (const Parameter& p : K::parameters) parameters[p.name] = make_parameter(p);
  kind["about"] = K::about;
  kind["arity"] = K::arity;
  kind["points"] = K::points;
  kind["rows"] = K::rows;
  kind["unit"] = unit_name(K::unit);
  kind["compliance"] = compliance;
  kind["damping"] = damping;
  kind["parameters"] = parameters;
  kind["instead_of_rest"] = K::instead_of_rest ? py::object(py::str(K::instead_of_rest)) : py::none();
  kind["periodic"] = K::periodic;
  kind["unilateral"] = K::unilateral;
  return kind;
}

py::dict constraint_kinds() {
  py::dict kinds;
  for_each_kind([&]<class K>(K) { kinds[K::name] = make_kind<K>(); });
  return kinds;
}

// (count, parameters) from first positions (count, arity, 3); NaN where a value has to be given.
py::array_t<double> rest_values_of(const std::string& name, const Array& x) {
  py::array_t<double> values;
  bool known = false;
  for_each_kind([&]<class K>(K) {
    if (name != K::name) return;
    known = true;
    const auto count = static_cast<std::size_t>(x.size()) / K::dofs;
    expect_size(x, count * K::dofs, "x");
    values = py::array_t<double>({count, static_cast<std::size_t>(parameter_count<K>)});
    for (std::size_t i = 0; i < count; ++i)
      rest_values<K>(x.data() + i * K::dofs, values.mutable_data() + i * parameter_count<K>);
  });
  if (!known) throw std::invalid_argument("kind: got '" + name + "'. Fix: use one of constraint_kinds()");
  return values;
}

}  // namespace

void bind_kinds(py::module_& m) {
  m.def("constraint_kinds", &constraint_kinds);
  m.def("rest_values", &rest_values_of, py::arg("kind"), py::arg("x"));
}

}  // namespace sheetbend::bindings
