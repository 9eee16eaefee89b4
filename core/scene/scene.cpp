#include "core/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
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
      refuse(where +
             " holds only pinned or driven particles. Fix: leave it out, since nothing can move; of a cloth, pass the "
             "pinned or driven vertices as `held`");
  }
  return g;
}

// What a node is that is no place.
std::string a_direction(const Scene& scene, int node) {
  return scene.is_director[node] ? "a director" : "an axis of a body";
}

void check_triangles(const std::string& field, const std::vector<std::array<int, 3>>& triangles, const Scene& scene) {
  for (const auto& [a, b, c] : triangles) {
    check_nodes(field, {a, b, c}, scene.nodes());
    const std::string which = std::to_string(a) + ", " + std::to_string(b) + ", " + std::to_string(c);
    if (a == b || b == c || c == a)
      refuse(field + ": triangle " + which + " has no area. Fix: give distinct particles");
    for (const int n : {a, b, c})
      if (!scene.is_place[n])
        refuse(field + ": triangle " + which + " holds " + a_direction(scene, n) + ". Fix: use particles");
  }
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

// Of a body: the center and the axes of one, all of them.
void check_points_of_bodies(const ContactSpec& spec, const Scene& scene) {
  for (auto p = spec.nodes.begin(); p != spec.nodes.end(); p += spec.arity) {
    const bool known = std::ranges::any_of(scene.bodies, [&](const Body& b) {
      return b.center == p[0] && std::equal(b.axes.begin(), b.axes.end(), p + 1);
    });
    if (!known || std::any_of(p, p + spec.arity, [&](int n) { return scene.role[n] != scene.role[p[0]]; }))
      refuse(spec.name + ": the point of node " + std::to_string(p[0]) +
             " is of no body. Fix: give a body's center and its three axes, which all move or all stand");
  }
}

void check_contact(const ContactSpec& spec, const Scene& scene, std::vector<char>& carries) {
  check_nodes(spec.name, spec.nodes, scene.nodes());
  check_nodes(spec.name + ".carried", spec.carried, scene.nodes());
  if (spec.collider < 0 || spec.collider >= static_cast<int>(scene.colliders.size()))
    refuse(spec.name + ": collider " + std::to_string(spec.collider) + " does not exist. Fix: add it first");
  if (spec.nodes.empty()) refuse(spec.name + ": no particles. Fix: give those that may touch");
  if (spec.arity != 1 && spec.arity != most_point_nodes)
    refuse(spec.name + ".arity: " + std::to_string(spec.arity) + ". Fix: give 1 for particles, 4 for points of bodies");
  if (spec.nodes.size() != spec.carried.size() * spec.arity)
    refuse(spec.name + ".carried: " + std::to_string(spec.carried.size()) + " nodes. Fix: give one for each point");
  if (spec.arity > 1) {
    check_points_of_bodies(spec, scene);
  } else {
    slots(spec.nodes, scene.nodes(), spec.name);
    for (const int n : spec.nodes)
      if (!scene.is_place[n])
        refuse(spec.name + ": node " + std::to_string(n) + " is " + a_direction(scene, n) + ". Fix: use particles");
  }
  for (const int n : spec.carried) {
    if (carries[n] || scene.role[n] != Role::pinned)
      refuse(spec.name + ".carried: node " + std::to_string(n) + ". Fix: give each particle a pinned node of its own");
    carries[n] = true;
  }
}

// Of contacts with restitution: the free particles that nothing holds, and which ones constraints hold. A soft contact of what is held gives back
// by itself.
void add_bouncers(Scene& s) {
  std::vector<char> held(s.nodes(), false);
  for (const Group& g : s.groups)
    for (const int n : g.stencil) held[n] = true;
  for (const Volume& v : s.volumes)
    for (const int n : v.nodes) held[n] = true;
  std::map<int, std::vector<int>> contacts;
  for (std::size_t c = 0; c < s.contacts.size(); ++c) {
    Contact& contact = s.contacts[c];
    if (contact.restitution < 0) continue;
    for (int item = 0; item < contact.points(); ++item) {
      const int n = contact.first_node(item);
      contact.held.push_back(held[n]);
      if (s.role[n] != Role::free) continue;
      if (!held[n])
        contacts[n].push_back(static_cast<int>(c));
      else if (contact.stiffness >= 0)
        refuse(contact.name + ".restitution: particle " + std::to_string(n) +
               " is held by constraints, and the contact has a stiffness. Fix: leave out one of the two");
    }
  }
  for (auto& [node, own] : contacts) s.bouncers.push_back({node, std::move(own)});
}

// The radii of pieces stand behind those of contacts. Where any piece has triangles, the points of all pieces may touch them.
void add_self_contact(const SceneSpec& spec, Scene& s) {
  SelfContact& own = s.self_contact;
  const std::string field = "self_contact";
  own.radius.assign(s.nodes(), -1);
  int place = static_cast<int>(s.contacts.size());
  for (const SelfContactSpec::Piece& piece : spec.self_contact.pieces) {
    if (piece.edges.empty()) refuse(field + ": a piece has no edges. Fix: give ropes, cloths or both");
    std::vector<int> nodes;
    for (const auto& [a, b] : piece.edges) {
      check_nodes(field, {a, b}, s.nodes());
      if (a == b) refuse(field + ": an edge from particle " + std::to_string(a) + " to itself. Fix: leave it out");
      nodes.insert(nodes.end(), {a, b});
    }
    check_triangles(field, piece.triangles, s);
    for (const auto& t : piece.triangles) nodes.insert(nodes.end(), t.begin(), t.end());
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    for (const int n : nodes) {
      if (!s.is_place[n])
        refuse(field + ": node " + std::to_string(n) + " is " + a_direction(s, n) + ". Fix: use particles");
      if (own.radius[n] >= 0)
        refuse(field + ": particle " + std::to_string(n) + " is in two pieces. Fix: list each piece once");
      own.radius[n] = place;
      own.points.push_back(n);
    }
    own.edges.insert(own.edges.end(), piece.edges.begin(), piece.edges.end());
    own.triangles.insert(own.triangles.end(), piece.triangles.begin(), piece.triangles.end());
    ++place;
  }
  if (own.empty()) own.radius.clear();
  if (own.triangles.empty()) own.points.clear();
}

// A distance field has a grid, and nothing else has one.
void check_grid(const ColliderSpec& c) {
  const DistanceGrid* g = c.grid.get();
  if ((c.shape == DistanceField::name) != (g != nullptr))
    refuse(c.name + ".grid: is of distance fields alone. Fix: give one to them, and none to other shapes");
  if (!g) return;
  std::size_t size = 1;
  for (const int n : g->count) size *= static_cast<std::size_t>(std::max(n, 0));
  const auto finite = [](double a) { return std::isfinite(a); };
  if (std::ranges::any_of(g->count, [](int n) { return n < 4; }) || size != g->coefficients.size() ||
      !(g->spacing > 0.0) || !finite(g->spacing) || !std::ranges::all_of(g->origin, finite) ||
      !std::ranges::all_of(g->coefficients, finite))
    refuse(c.name +
           ".grid: has fewer than two points along an axis, or numbers that are not finite. "
           "Fix: give distances on two points or more along each axis");
}

// Colliders and contacts; returns how many numbers there are of each of their quantities.
std::array<std::size_t, 7> add_contacts(const SceneSpec& spec, Scene& s) {
  std::size_t poses = 0, sizes = 0, soft = 0, bouncing = 0, weights = 0;
  for (const ColliderSpec& c : spec.colliders) {
    check_knots(c.name + ".times", c.motion, true);
    check_grid(c);
    s.colliders.push_back({c.name, shape_of(c.shape), c.motion, poses, sizes, c.grid});
    poses += 6 * c.motion.times.size();
    with_shape(s.colliders.back().shape, [&]<class S>(S) { sizes += size_count<S>; });
  }
  std::vector<char> carries(s.nodes(), false);
  for (const ContactSpec& c : spec.contacts) {
    check_contact(c, s, carries);
    s.contacts.push_back({c.name, c.collider, c.arity, c.nodes, c.carried, c.rigid ? -1 : static_cast<int>(soft++),
                          c.bounces ? static_cast<int>(bouncing++) : -1, points_in_contact(s), weights});
    if (c.arity > 1) weights += c.nodes.size();
  }
  add_bouncers(s);
  add_self_contact(spec, s);
  return {
      s.contacts.size(), s.contacts.size() + spec.self_contact.pieces.size(), soft, poses, sizes, bouncing, weights};
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
    if (d.normal != -1 && (d.normal < 0 || d.normal >= s.nodes() || !s.is_director[d.normal]))
      refuse("directors: node " + std::to_string(d.node) + " with normal " + std::to_string(d.normal) +
             ". Fix: give a normal that stands before, the node itself for a normal, or -1");
  }
  for (int n = 0; n < s.nodes(); ++n) {
    s.inertial.push_back(s.role[n] == Role::free && !s.is_director[n]);
    s.is_place.push_back(!s.is_director[n]);
  }
  add_bodies(spec, s);
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

  find_turning(s);
  add_loads(spec, s);

  for (const VolumeSpec& v : spec.volumes) s.volumes.push_back(build_volume(v, s));

  const auto [frictions, radii, stiffnesses, poses, sizes, restitutions, weights] = add_contacts(spec, s);

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
                   weights};
  s.layout.close();
  return s;
}

}  // namespace sheetbend
