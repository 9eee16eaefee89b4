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
  for_each_constraint(*scene, [&]<class K>(K, const Group& group, int item) {
    double local[K::dofs];
    gather<K>(*scene, group, item, positions.data(), local);
    const Evaluation<K, double> at(local, rest_parameters<K>(in, group, item));
    const std::size_t first = group.first_row + static_cast<std::size_t>(item) * K::rows;
    std::copy_n(at.C, K::rows, &values[first]);
    for (int j = 0; j < K::rows; ++j)
      for (int d = 0; d < K::dofs; ++d)
        forces[scene->first_dof[group.nodes(item)[d / 3]] + d % 3] +=
            at.J[j * K::dofs + d] * multipliers.data()[first + j];
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
