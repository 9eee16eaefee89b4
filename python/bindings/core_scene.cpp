#include "core/scene/scene.h"

#include <memory>

#include "python/bindings/core_module.h"

namespace sheetbend::bindings {
namespace {

Interpolation interpolation_of(const std::string& name) {
  if (name == "cubic") return Interpolation::cubic;
  if (name == "linear") return Interpolation::linear;
  throw std::invalid_argument("interpolation: got '" + name + "'. Fix: use 'cubic' or 'linear'");
}

std::shared_ptr<const Scene> make_scene(int particles, const std::vector<std::array<int, 4>>& directors,
                                        std::vector<int> pinned, std::vector<int> driven,
                                        std::vector<double> boundary_times, const std::string& boundary_interpolation,
                                        std::vector<int> loaded, std::vector<double> force_times, bool has_drag,
                                        std::vector<std::array<int, 3>> air, std::vector<double> wind_times,
                                        const std::vector<py::dict>& groups, const std::vector<py::dict>& volumes) {
  SceneSpec spec;
  spec.particles = particles;
  for (const auto& [node, tail, head, normal] : directors) spec.directors.push_back({node, tail, head, normal});
  spec.pinned = std::move(pinned);
  spec.driven = std::move(driven);
  spec.loaded = std::move(loaded);
  spec.has_drag = has_drag;
  spec.boundary = {std::move(boundary_times), interpolation_of(boundary_interpolation)};
  spec.force = {std::move(force_times), Interpolation::linear};
  spec.air = std::move(air);
  spec.wind = {std::move(wind_times), Interpolation::linear};
  for (const py::dict& g : groups)
    spec.groups.push_back({g["name"].cast<std::string>(), g["kind"].cast<std::string>(), g["damped"].cast<bool>(),
                           whole_numbers(g["stencil"])});
  for (const py::dict& v : volumes)
    spec.volumes.push_back({v["name"].cast<std::string>(), v["triangles"].cast<std::vector<std::array<int, 3>>>()});
  return std::make_shared<const Scene>(build_scene(spec));
}

}  // namespace

void bind_scene(py::module_& m) {
  py::class_<Scene, std::shared_ptr<Scene>>(m, "Scene")
      .def(py::init([](int particles, const std::vector<std::array<int, 4>>& directors, std::vector<int> pinned,
                       std::vector<int> driven, std::vector<double> boundary_times,
                       const std::string& boundary_interpolation, std::vector<int> loaded,
                       std::vector<double> force_times, bool has_drag, std::vector<std::array<int, 3>> air,
                       std::vector<double> wind_times, const std::vector<py::dict>& groups,
                       const std::vector<py::dict>& volumes) {
             return std::const_pointer_cast<Scene>(
                 make_scene(particles, directors, std::move(pinned), std::move(driven), std::move(boundary_times),
                            boundary_interpolation, std::move(loaded), std::move(force_times), has_drag, std::move(air),
                            std::move(wind_times), groups, volumes));
           }),
           py::kw_only(), py::arg("particles"), py::arg("directors"), py::arg("pinned"), py::arg("driven"),
           py::arg("boundary_times"), py::arg("boundary_interpolation"), py::arg("loaded"), py::arg("force_times"),
           py::arg("has_drag"), py::arg("air"), py::arg("wind_times"), py::arg("groups"), py::arg("volumes"))
      .def_property_readonly("layout",
                             [](const Scene& s) {
                               py::dict layout;
                               for (int q = 0; q < quantity_count; ++q)
                                 layout[quantity_names[q]] = py::make_tuple(s.layout.offset[q], s.layout.size[q]);
                               return layout;
                             })
      .def_property_readonly("inputs", [](const Scene& s) { return s.layout.total(); })
      .def_property_readonly("constraints", [](const Scene& s) { return s.constraints; })
      .def_property_readonly("rows", [](const Scene& s) { return s.rows; })
      .def_property_readonly("dofs", &Scene::dofs);
}

}  // namespace sheetbend::bindings
