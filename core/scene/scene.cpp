#include "core/scene/scene.h"

#include <algorithm>
#include <stdexcept>

#include "core/constraints/registry.h"

namespace sheetbend {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw std::invalid_argument(message); }

void check_nodes(const std::string& field, const std::vector<int>& nodes, int count) {
  for (const int node : nodes)
    if (node < 0 || node >= count)
      refuse(field + ": particle " + std::to_string(node) + " does not exist. Fix: use 0 to " +
             std::to_string(count - 1));
}

void check_knots(const std::string& field, const Knots& knots, bool needed) {
  if (needed && knots.times.empty()) refuse(field + ": no knot times. Fix: give at least one");
  for (std::size_t i = 1; i < knots.times.size(); ++i)
    if (!(knots.times[i] > knots.times[i - 1]))
      refuse(field + ": time " + std::to_string(knots.times[i]) + " at knot " + std::to_string(i) +
             " does not increase. Fix: sort the knots");
}

std::vector<int> slots(const std::vector<int>& list, int count, const std::string& field) {
  std::vector<int> slot(count, -1);
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (slot[list[i]] >= 0)
      refuse(field + ": particle " + std::to_string(list[i]) + " is listed twice. Fix: list it once");
    slot[list[i]] = static_cast<int>(i);
  }
  return slot;
}

Group build_group(const GroupSpec& spec, const Scene& scene) {
  Group g;
  g.name = spec.name;
  g.kind = kind_of(spec.kind);
  g.damped = spec.damped;
  g.stencil = spec.stencil;
  g.first = scene.constraints;
  g.first_row = scene.rows;
  with_kind(g.kind, [&]<class K>(K) {
    g.arity = K::arity, g.points = K::points, g.rows = K::rows, g.parameters = parameter_count<K>;
    g.unilateral = K::unilateral;
  });
  if (g.stencil.size() % g.arity != 0)
    refuse(spec.name + ": " + std::to_string(g.stencil.size()) + " indices. Fix: a " + spec.kind + " takes " +
           std::to_string(g.arity) + " each");
  g.count = static_cast<int>(g.stencil.size()) / g.arity;
  check_nodes(spec.name, g.stencil, scene.nodes());
  for (int i = 0; i < g.count; ++i) {
    const auto nodes = g.nodes(i);
    const std::string where = spec.name + ": constraint " + std::to_string(i);
    for (int a = 0; a < g.arity; ++a)
      for (int b = 0; b < a; ++b)
        if (nodes[a] == nodes[b])
          refuse(where + " uses particle " + std::to_string(nodes[a]) + " twice. Fix: use distinct particles");
    if (std::none_of(nodes.begin(), nodes.end(), [&](int n) { return scene.role[n] == Role::free; }))
      refuse(where + " holds only pinned or driven particles. Fix: leave it out, nothing can move");
  }
  return g;
}

void check_air(const Scene& scene) {
  for (const auto& [a, b, c] : scene.air) {
    check_nodes("air", {a, b, c}, scene.nodes());
    const std::string which = std::to_string(a) + ", " + std::to_string(b) + ", " + std::to_string(c);
    if (a == b || b == c || c == a) refuse("air: triangle " + which + " has no area. Fix: give distinct particles");
    if (scene.is_director[a] || scene.is_director[b] || scene.is_director[c])
      refuse("air: triangle " + which + " holds a director. Fix: let air act on particles");
  }
}

}  // namespace

int kind_of(const std::string& name) {
  int found = -1;
  std::string known;
  for (int kind = 0; kind < kind_count; ++kind)
    with_kind(kind, [&]<class K>(K) {
      if (name == K::name) found = kind;
      known += (kind ? ", " : "") + std::string(K::name);
    });
  if (found < 0) refuse("kind: no constraint is called '" + name + "'. Fix: use one of " + known);
  return found;
}

Scene build_scene(const SceneSpec& spec) {
  if (spec.particles <= 0) refuse("particles: the scene is empty. Fix: add particles");
  Scene s;
  s.fields.add("position", 3, spec.particles);
  s.role.assign(s.nodes(), Role::free);
  for (const Field& field : s.fields.list)
    for (int i = 0; i < field.count; ++i) {
      s.first_dof.push_back(field.first_dof + i * field.dim);
      s.dim.push_back(field.dim);
    }
  check_nodes("pinned", spec.pinned, s.nodes());
  check_nodes("driven", spec.driven, s.nodes());
  check_nodes("loaded", spec.loaded, s.nodes());
  for (const int n : spec.pinned) s.role[n] = Role::pinned;
  for (const int n : spec.driven) s.role[n] = Role::driven;
  for (const Director& d : spec.directors) check_nodes("directors", {d.node, d.tail, d.head}, s.nodes());
  s.directors = spec.directors;
  s.is_director.assign(s.nodes(), false);
  for (const Director& d : s.directors) {
    if (d.tail == d.head || d.node == d.tail || d.node == d.head || s.is_director[d.node])
      refuse("directors: node " + std::to_string(d.node) + " with edge " + std::to_string(d.tail) + ", " +
             std::to_string(d.head) + ". Fix: give each director a node of its own and two distinct ends");
    s.is_director[d.node] = true;
  }
  for (int n = 0; n < s.nodes(); ++n) s.inertial.push_back(s.role[n] == Role::free && !s.is_director[n]);
  for (const int n : spec.loaded)
    if (s.is_director[n] && s.role[n] == Role::free)
      refuse("loaded: node " + std::to_string(n) + " is a director. Fix: let forces act on particles");
  s.driven = spec.driven;
  for (int n = 0; n < s.nodes(); ++n)
    if (s.role[n] == Role::pinned) s.pinned.push_back(n);
  s.driven_slot = slots(spec.driven, s.nodes(), "driven");
  s.loaded = spec.loaded;
  s.loaded_slot = slots(spec.loaded, s.nodes(), "loaded");
  s.has_drag = spec.has_drag;
  s.boundary = spec.boundary;
  s.force = spec.force;
  check_knots("boundary_times", s.boundary, !s.driven.empty());
  check_knots("force_times", s.force, !s.loaded.empty());
  s.air = spec.air;
  s.wind = spec.wind;
  check_air(s);
  check_knots("wind_times", s.wind, !s.air.empty());

  std::size_t values = 0;
  for (const GroupSpec& g : spec.groups) {
    s.groups.push_back(build_group(g, s));
    Group& built = s.groups.back();
    built.first_value = values;
    built.first_coordinate = s.stencil_coordinates;
    built.first_gradient = s.gradient_entries;
    s.constraints += built.count;
    with_kind(built.kind, [&]<class K>(K) { s.yields |= Yields<K>; });
    s.rows += built.count * built.rows;
    values += static_cast<std::size_t>(built.count) * built.parameters;
    s.stencil_coordinates += static_cast<std::size_t>(built.count) * 3 * built.arity;
    s.gradient_entries += static_cast<std::size_t>(built.count) * 3 * built.arity * built.rows;
  }

  const std::size_t dofs = s.dofs(), nodes = s.nodes(), m = s.constraints;
  s.layout.size = {dofs,
                   dofs,
                   nodes,
                   m,
                   m,
                   values,
                   s.boundary.times.size() * s.driven.size() * 3,
                   s.force.times.size() * s.loaded.size() * 3,
                   3,
                   nodes,
                   nodes,
                   s.wind.times.size() * 3,
                   s.air.size(),
                   s.air.size(),
                   s.air.size()};
  s.layout.close();
  return s;
}

}  // namespace sheetbend
