// Scenes from Python, and back to what they were made from.
#include "core/scene/scene.h"

#include <map>
#include <memory>

#include "core/constraints/registry.h"
#include "core/contact/shapes.h"
#include "core/scene/contact_gaps.h"
#include "core/scene/pair_gaps.h"
#include "python/bindings/core_module.h"

namespace sheetbend::bindings {
using namespace py::literals;
namespace {

Interpolation interpolation_of(const std::string& name) {
  if (name == "cubic") return Interpolation::cubic;
  if (name == "linear") return Interpolation::linear;
  throw std::invalid_argument("interpolation: got '" + name + "'. Fix: use 'cubic' or 'linear'");
}

using Triangles = std::vector<std::array<int, 3>>;

// Of a distance field: (origin, spacing, coefficients of three axes).
std::shared_ptr<const DistanceGrid> grid_of(const py::handle& collider) {
  if (!collider.contains("grid")) return nullptr;
  using Values = py::array_t<double, py::array::c_style | py::array::forcecast>;
  const auto [origin, spacing, values] = collider["grid"].cast<std::tuple<std::array<double, 3>, double, Values>>();
  if (values.ndim() != 3)
    throw std::invalid_argument("collider.grid: has no three axes. Fix: give coefficients (x, y, z)");
  DistanceGrid grid{origin, spacing, {}, std::vector<double>(values.data(), values.data() + values.size())};
  for (int d = 0; d < 3; ++d) grid.count[d] = static_cast<int>(values.shape(d));
  return std::make_shared<const DistanceGrid>(std::move(grid));
}

// Keyword arguments of Python's Scene to a scene.
std::shared_ptr<Scene> make_scene(const py::kwargs& given) {
  SceneSpec spec;
  spec.particles = given["particles"].cast<int>();
  for (const auto& [node, tail, head, normal] : given["directors"].cast<std::vector<std::array<int, 4>>>())
    spec.directors.push_back({node, tail, head, normal});
  if (given.contains("bodies"))
    for (const auto& [center, first, second, third, spin] : given["bodies"].cast<std::vector<std::array<int, 5>>>())
      spec.bodies.push_back({center, {first, second, third}, spin});
  spec.pinned = whole_numbers(given["pinned"]);
  spec.driven = whole_numbers(given["driven"]);
  spec.loaded = whole_numbers(given["loaded"]);
  spec.has_drag = given["has_drag"].cast<bool>();
  spec.boundary = {given["boundary_times"].cast<std::vector<double>>(),
                   interpolation_of(given["boundary_interpolation"].cast<std::string>())};
  spec.force = {given["force_times"].cast<std::vector<double>>(), Interpolation::linear};
  spec.air = given["air"].cast<Triangles>();
  spec.wind = {given["wind_times"].cast<std::vector<double>>(), Interpolation::linear};
  for (const py::handle g : given["groups"])
    spec.groups.push_back({g["name"].cast<std::string>(), g["kind"].cast<std::string>(), g["damped"].cast<bool>(),
                           whole_numbers(g["stencil"])});
  for (const py::handle v : given["volumes"])
    spec.volumes.push_back({v["name"].cast<std::string>(), v["triangles"].cast<Triangles>()});
  for (const py::handle c : given["colliders"])
    spec.colliders.push_back(
        {c["name"].cast<std::string>(),
         c["shape"].cast<std::string>(),
         {c["times"].cast<std::vector<double>>(), interpolation_of(c["interpolation"].cast<std::string>())},
         grid_of(c)});
  for (const py::handle c : given["contacts"])
    spec.contacts.push_back({c["name"].cast<std::string>(), c["collider"].cast<int>(), whole_numbers(c["nodes"]),
                             whole_numbers(c["carried"]), c["rigid"].cast<bool>(), c["bounces"].cast<bool>(),
                             c["arity"].cast<int>(), c["dissipates"].cast<bool>()});
  if (given.contains("self_contact"))
    for (const py::handle p : given["self_contact"])
      spec.self_contact.pieces.push_back(
          {p["edges"].cast<std::vector<std::array<int, 2>>>(), p["triangles"].cast<Triangles>()});
  if (given.contains("self_carried")) spec.self_contact.carried = whole_numbers(given["self_carried"]);
  if (given.contains("self_on_bodies"))
    spec.self_contact.on_bodies = given["self_on_bodies"].cast<std::vector<std::array<int, 4>>>();
  if (given.contains("balls")) spec.balls = whole_numbers(given["balls"]);
  if (given.contains("loads")) {
    for (const auto& [group, item, row] : given["loads"].cast<std::vector<std::array<int, 3>>>())
      spec.loads.push_back({group, item, row});
    spec.load = {given["load_times"].cast<std::vector<double>>(), Interpolation::linear};
  }
  return std::make_shared<Scene>(build_scene(spec));
}

// The keyword arguments that make a scene, again.
py::dict arguments_of_scene(const Scene& s) {
  std::vector<std::array<int, 4>> directors;
  for (const Director& d : s.directors) directors.push_back({d.node, d.tail, d.head, d.normal});
  std::vector<std::array<int, 5>> bodies;
  for (const Body& b : s.bodies) bodies.push_back({b.center, b.axes[0], b.axes[1], b.axes[2], b.spin});
  py::list groups, volumes;
  for (const Group& g : s.groups) {
    const std::string kind = [&] {
      std::string name;
      with_kind(g.kind, [&]<class K>(K) { name = K::name; });
      return name;
    }();
    groups.append(
        py::dict("name"_a = g.name, "kind"_a = kind, "damped"_a = g.damped,
                 "stencil"_a = py::array_t<int>(static_cast<py::ssize_t>(g.stencil.size()), g.stencil.data())));
  }
  std::vector<std::array<int, 3>> loads;
  for (const Load& l : s.loads) loads.push_back({l.group, l.item, l.row});
  for (const Volume& v : s.volumes) {
    Triangles triangles = v.triangles;
    for (auto& t : triangles)
      for (int& n : t) n = v.nodes[n];
    volumes.append(py::dict("name"_a = v.name, "triangles"_a = triangles));
  }
  py::list colliders, contacts;
  for (const Collider& c : s.colliders)
    with_shape(c.shape, [&]<class S>(S) {
      colliders.append(
          py::dict("name"_a = c.name, "shape"_a = S::name, "times"_a = c.motion.times,
                   "interpolation"_a = c.motion.interpolation == Interpolation::cubic ? "cubic" : "linear"));
      if (c.grid)
        colliders[colliders.size() - 1]["grid"] = py::make_tuple(
            c.grid->origin, c.grid->spacing, py::array_t<double>(c.grid->count, c.grid->coefficients.data()));
    });
  for (const Contact& c : s.contacts)
    contacts.append(py::dict("name"_a = c.name, "collider"_a = c.collider, "arity"_a = c.arity,
                             "nodes"_a = py::array_t<int>(py::cast(c.nodes)),
                             "carried"_a = py::array_t<int>(py::cast(c.carried)), "rigid"_a = c.stiffness < 0,
                             "bounces"_a = c.restitution >= 0, "dissipates"_a = c.dissipation >= 0));
  std::map<int, std::pair<std::vector<std::array<int, 2>>, Triangles>> touching;  // by the place of its radius
  for (const auto& edge : s.self_contact.edges) touching[s.self_contact.radius[edge[0]]].first.push_back(edge);
  for (const auto& t : s.self_contact.triangles) touching[s.self_contact.radius[t[0]]].second.push_back(t);
  std::vector<int> balls;
  for (const Bouncer& own : s.balls.members) balls.push_back(own.node);
  py::list pieces;
  for (const auto& [place, piece] : touching)
    pieces.append(py::dict("edges"_a = piece.first, "triangles"_a = piece.second));
  const bool cubic = s.boundary.interpolation == Interpolation::cubic;
  return py::dict("particles"_a = s.nodes(), "directors"_a = directors, "bodies"_a = bodies, "pinned"_a = s.pinned,
                  "driven"_a = s.driven, "boundary_times"_a = s.boundary.times,
                  "boundary_interpolation"_a = cubic ? "cubic" : "linear", "loaded"_a = s.loaded,
                  "force_times"_a = s.force.times, "has_drag"_a = s.has_drag, "air"_a = s.air,
                  "wind_times"_a = s.wind.times, "groups"_a = groups, "volumes"_a = volumes, "colliders"_a = colliders,
                  "contacts"_a = contacts, "loads"_a = loads, "load_times"_a = s.load.times, "self_contact"_a = pieces,
                  "self_carried"_a = s.self_contact.carried, "self_on_bodies"_a = s.self_contact.on_bodies,
                  "balls"_a = py::array_t<int>(py::cast(balls)));
}

}  // namespace

void bind_scene(py::module_& m) {
  py::dict shapes;  // by name: what it is, and the names of its sizes
  for (int shape = 0; shape < shape_count; ++shape)
    with_shape(shape, [&]<class S>(S) {
      py::list sizes;
      for (const char* size : S::sizes) sizes.append(size);
      shapes[S::name] = py::make_tuple(S::about, sizes);
    });
  m.attr("SHAPES") = shapes;
  py::class_<Scene, std::shared_ptr<Scene>>(m, "Scene")
      .def(py::init(&make_scene))
      .def(py::pickle(&arguments_of_scene, [](const py::dict& given) { return make_scene(py::kwargs(given)); }))
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
      .def_property_readonly("dofs", &Scene::dofs)
      .def("contact_gaps",
           [](const Scene& s, const Array& inputs, double t, int contact) {
             const Inputs<const double> in{s.layout, inputs.data()};
             const auto gaps = contact_gaps(s, in, in.of(Quantity::position), t, contact);
             py::array_t<double> out({static_cast<py::ssize_t>(gaps.size()), static_cast<py::ssize_t>(4)});
             for (std::size_t i = 0; i < gaps.size(); ++i)
               std::copy(gaps[i].begin(), gaps[i].end(), out.mutable_data() + 4 * i);
             return out;
           })
      .def("pair_gaps", [](const Scene& s, const Array& inputs) {
        const Inputs<const double> in{s.layout, inputs.data()};
        const auto found = pair_gaps(s, in, in.of(Quantity::position));
        const auto count = static_cast<py::ssize_t>(found.size());
        py::array_t<double> gaps(count);
        py::array_t<int> nodes({count, static_cast<py::ssize_t>(4)});
        for (std::size_t i = 0; i < found.size(); ++i) {
          gaps.mutable_data()[i] = found[i].gap;
          std::copy(found[i].nodes.begin(), found[i].nodes.end(), nodes.mutable_data() + 4 * i);
        }
        return py::make_tuple(gaps, nodes);
      });
}

}  // namespace sheetbend::bindings
