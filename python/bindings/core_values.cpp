// What constraints are worth at given positions, and the forces that multipliers exert.
#include <memory>

#include "core/equilibrium/residual.h"
#include "python/bindings/core_module.h"

namespace sheetbend::bindings {
namespace {

// (C (rows), J^T lambda (dofs)): of every constraint, and on every particle, held ones too, volumes included.
py::tuple evaluate_constraints(const std::shared_ptr<Scene>& scene, const Array& inputs, const Array& positions,
                               const Array& multipliers) {
  expect_size(inputs, scene->layout.total(), "inputs");
  expect_size(positions, scene->dofs(), "positions");
  expect_size(multipliers, scene->multipliers(), "multipliers");
  const Inputs<const double> in{scene->layout, inputs.data()};
  std::vector<double> values(scene->rows), forces(scene->dofs());
  AnyConstraint<double> at;
  for_each_constraint(*scene, [&](const Group& group, int item) {
    const std::size_t first = group.first_row + static_cast<std::size_t>(item) * group.rows;
    const int dofs = 3 * group.arity;
    evaluate(*scene, in, group, item, positions.data(), at);
    std::copy_n(at.C, group.rows, values.begin() + static_cast<std::ptrdiff_t>(first));
    for (int j = 0; j < group.rows; ++j)
      for (int d = 0; d < dofs; ++d)
        forces[scene->first_dof[group.nodes(item)[d / 3]] + d % 3] +=
            at.J[j * dofs + d] * multipliers.data()[first + j];
  });
  std::vector<Vec3<double>> gradient;
  for (std::size_t v = 0; v < scene->volumes.size(); ++v) {
    kept_volume(*scene, in, static_cast<int>(v), positions.data(), gradient);
    for (std::size_t k = 0; k < gradient.size(); ++k)
      (multipliers.data()[scene->rows + v] * gradient[k]).add_to(&forces[scene->first_dof[scene->volumes[v].nodes[k]]]);
  }
  return py::make_tuple(to_numpy(values, {static_cast<py::ssize_t>(values.size())}),
                        to_numpy(forces, {static_cast<py::ssize_t>(forces.size())}));
}

}  // namespace

void bind_values(py::module_& m) {
  m.def("evaluate_constraints", &evaluate_constraints, py::arg("scene"), py::arg("inputs"), py::arg("positions"),
        py::arg("multipliers"));
}

}  // namespace sheetbend::bindings
