#include "core/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "core/constraints/registry.h"
#include "core/scene/add_contacts.h"
#include "core/scene/spec_checks.h"

namespace sheetbend {
namespace {

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
      refuse(where +
             " holds only pinned or driven particles. Fix: leave it out, since nothing can move; of a cloth, pass the "
             "pinned or driven vertices as `held`");
  }
  return g;
}

// Every edge is there once in either direction.
void check_closed(const std::string& field, const std::vector<std::array<int, 3>>& triangles) {
  std::set<std::pair<int, int>> edges;
  const auto refuse_edge = [&](int a, int b) {
    refuse(field + ": edge " + std::to_string(a) + ", " + std::to_string(b) +
           " is not between two triangles. Fix: close the surface, all triangles counterclockwise from outside");
  };
  for (const auto& t : triangles)
    for (int k = 0; k < 3; ++k)
      if (!edges.emplace(t[k], t[(k + 1) % 3]).second) refuse_edge(t[k], t[(k + 1) % 3]);
  for (const auto& [a, b] : edges)
    if (!edges.contains({b, a})) refuse_edge(a, b);
}

Volume build_volume(const VolumeSpec& spec, const Scene& scene) {
  const std::string field = spec.name + ".volume";
  if (spec.triangles.empty()) refuse(field + ": no triangles. Fix: give those of a closed surface");
  check_triangles(field, spec.triangles, scene);
  check_closed(field, spec.triangles);
  Volume v{spec.name, {}, spec.triangles};
  for (const auto& t : spec.triangles) v.nodes.insert(v.nodes.end(), t.begin(), t.end());
  std::sort(v.nodes.begin(), v.nodes.end());
  v.nodes.erase(std::unique(v.nodes.begin(), v.nodes.end()), v.nodes.end());
  v.nodes.shrink_to_fit();
  for (auto& t : v.triangles)
    for (int& n : t) n = static_cast<int>(std::lower_bound(v.nodes.begin(), v.nodes.end(), n) - v.nodes.begin());
  if (std::none_of(v.nodes.begin(), v.nodes.end(), [&](int n) { return scene.role[n] == Role::free; }))
    refuse(field + ": holds only pinned or driven particles. Fix: leave it out, nothing can move");
  return v;
}

void add_loads(const SceneSpec& spec, Scene& s) {
  check_knots("load_times", spec.load, !spec.loads.empty());
  for (const Load& l : spec.loads)
    if (l.group < 0 || l.group >= static_cast<int>(s.groups.size()) || l.item < 0 ||
        l.item >= s.groups[l.group].count || l.row < 0 || l.row >= s.groups[l.group].rows)
      refuse("loads: group " + std::to_string(l.group) + ", constraint " + std::to_string(l.item) + ", row " +
             std::to_string(l.row) + " does not exist. Fix: give the numbers of a constraint and a row that it has");
  s.loads = spec.loads;
  s.load = spec.load;
}

void find_turning(Scene& s) {
  if (!s.keeps_spin) return;
  std::vector<char> turns(s.nodes(), false);
  for (const Body& b : s.bodies)
    for (const int n : b.axes) turns[n] = b.spin >= 0;
  for (int g = 0; g < static_cast<int>(s.groups.size()); ++g)
    for (int i = 0; i < s.groups[g].count; ++i)
      if (s.groups[g].kind != kind_of(Rigid::name) &&
          std::ranges::any_of(s.groups[g].nodes(i), [&](int n) { return turns[n]; }))
        s.turning.push_back({g, i});
}

void add_bodies(const SceneSpec& spec, Scene& s) {
  std::vector<char> taken = s.is_director;
  for (const Body& b : spec.bodies) {
    for (const int n : {b.center, b.axes[0], b.axes[1], b.axes[2]}) {
      check_nodes("bodies", {n}, s.nodes());
      if (taken[n])
        refuse("bodies: node " + std::to_string(n) +
               " is a director or in a body already. Fix: give each body a center and three axes of its own");
      taken[n] = true;
    }
    for (const int n : b.axes) {
      s.is_place[n] = false;
      if (s.role[n] == Role::free) s.axes.push_back(n);
    }
    if (b.spin < 0) continue;
    check_nodes("bodies", {b.spin}, s.nodes());
    if (taken[b.spin] || s.role[b.spin] != Role::pinned)
      refuse("bodies: node " + std::to_string(b.spin) + " keeps a spin. Fix: give each a pinned node of its own");
    if (std::ranges::any_of(b.axes, [&](int n) { return s.role[n] != Role::free; }))
      refuse("bodies: the spin of center " + std::to_string(b.center) +
             " is kept, but its axes are held. Fix: leave its spin out");
    taken[b.spin] = true;
    s.is_place[b.spin] = false;
    s.keeps_spin = true;
  }
  s.bodies = spec.bodies;
  for (int n = 0; n < s.nodes(); ++n) s.has_weight.push_back(s.inertial[n] && s.is_place[n]);
}

void add_nodes(const SceneSpec& spec, Scene& s) {
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
}

void add_directors(const SceneSpec& spec, Scene& s) {
  for (const Director& d : spec.directors) check_nodes("directors", {d.node, d.tail, d.head}, s.nodes());
  s.directors = spec.directors;
  s.is_director.assign(s.nodes(), false);
  for (const Director& d : s.directors) {
    if (d.tail == d.head || d.node == d.tail || d.node == d.head || s.is_director[d.node])
      refuse("directors: node " + std::to_string(d.node) + " with edge " + std::to_string(d.tail) + ", " +
             std::to_string(d.head) + ". Fix: give each director a node of its own and two distinct ends");
    s.is_director[d.node] = true;
    if (d.normal != -1 && (d.normal < 0 || d.normal >= s.nodes() || !s.is_director[d.normal]))
      refuse("directors: node " + std::to_string(d.node) + " with normal " + std::to_string(d.normal) +
             ". Fix: give a normal that stands before, the node itself for a normal, or -1");
  }
  for (int n = 0; n < s.nodes(); ++n) {
    s.inertial.push_back(s.role[n] == Role::free && !s.is_director[n]);
    s.is_place.push_back(!s.is_director[n]);
  }
}

// What changes over time: driven nodes, forces, and the wind.
void add_knots(const SceneSpec& spec, Scene& s) {
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
  check_triangles("air", s.air, s);
  check_knots("wind_times", s.wind, !s.air.empty());
  s.drag_in_wind = s.has_drag && !s.wind.times.empty();
}

// Returns how many values the parameters of all constraints are.
std::size_t add_groups(const SceneSpec& spec, Scene& s) {
  std::size_t values = 0;
  for (const GroupSpec& g : spec.groups) {
    s.groups.push_back(build_group(g, s));
    Group& built = s.groups.back();
    built.first_value = values;
    built.first_coordinate = s.stencil_coordinates;
    built.first_gradient = s.gradient_entries;
    s.constraints += built.count;
    with_kind(built.kind, [&]<class K>(K) {
      if constexpr (Yields<K>) {
        s.yields = true;
        for (int i = 0; i < built.count; ++i)
          for (const int node : built.nodes(i).last(set_nodes<K>)) s.is_place[node] = false;
      }
    });
    s.rows += built.count * built.rows;
    values += static_cast<std::size_t>(built.count) * built.parameters;
    s.stencil_coordinates += static_cast<std::size_t>(built.count) * 3 * built.arity;
    s.gradient_entries += static_cast<std::size_t>(built.count) * 3 * built.arity * built.rows;
  }
  return values;
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
  add_nodes(spec, s);
  add_directors(spec, s);
  add_bodies(spec, s);
  add_knots(spec, s);
  const std::size_t values = add_groups(spec, s);
  find_turning(s);
  add_loads(spec, s);
  for (const VolumeSpec& v : spec.volumes) s.volumes.push_back(build_volume(v, s));
  const auto [frictions, radii, stiffnesses, poses, sizes, restitutions, weights, dissipations] = add_contacts(spec, s);

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
                   s.air.size(),
                   s.volumes.size(),
                   s.volumes.size(),
                   frictions,
                   radii,
                   stiffnesses,
                   poses,
                   sizes,
                   restitutions,
                   s.load.times.size() * s.loads.size(),
                   weights,
                   dissipations};
  s.layout.close();
  return s;
}

}  // namespace sheetbend
