#include "core/scene/add_contacts.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/scene/spec_checks.h"

namespace sheetbend {
namespace {

// A point of a body: the center and the axes of one, all of them.
void check_point_of_body(const std::string& field, const int* p, const Scene& scene) {
  const bool known = std::ranges::any_of(
      scene.bodies, [&](const Body& b) { return b.center == p[0] && std::equal(b.axes.begin(), b.axes.end(), p + 1); });
  if (!known || std::any_of(p, p + most_point_nodes, [&](int n) { return scene.role[n] != scene.role[p[0]]; }))
    refuse(field + ": the point of node " + std::to_string(p[0]) +
           " is of no body. Fix: give a body's center and its three axes, which all move or all stand");
}

// Nodes that carry what a substep leaves to the next: each pinned, and listed once in the scene.
void check_carried(const std::string& field, const std::vector<int>& nodes, const Scene& scene,
                   std::vector<char>& carries) {
  check_nodes(field, nodes, scene.nodes());
  for (const int n : nodes) {
    if (carries[n] || scene.role[n] != Role::pinned)
      refuse(field + ": node " + std::to_string(n) + ". Fix: give each particle a pinned node of its own");
    carries[n] = true;
  }
}

void check_contact(const ContactSpec& spec, const Scene& scene, std::vector<char>& carries) {
  check_nodes(spec.name, spec.nodes, scene.nodes());
  if (spec.collider < 0 || spec.collider >= static_cast<int>(scene.colliders.size()))
    refuse(spec.name + ": collider " + std::to_string(spec.collider) + " does not exist. Fix: add it first");
  if (spec.nodes.empty()) refuse(spec.name + ": no particles. Fix: give those that may touch");
  if (spec.arity != 1 && spec.arity != most_point_nodes)
    refuse(spec.name + ".arity: " + std::to_string(spec.arity) + ". Fix: give 1 for particles, 4 for points of bodies");
  if (spec.nodes.size() != spec.carried.size() * spec.arity)
    refuse(spec.name + ".carried: " + std::to_string(spec.carried.size()) + " nodes. Fix: give one for each point");
  if (spec.arity > 1) {
    for (std::size_t p = 0; p < spec.nodes.size(); p += spec.arity)
      check_point_of_body(spec.name, &spec.nodes[p], scene);
  } else {
    slots(spec.nodes, scene.nodes(), spec.name);
    for (const int n : spec.nodes)
      if (!scene.is_place[n])
        refuse(spec.name + ": node " + std::to_string(n) + " is " + a_direction(scene, n) + ". Fix: use particles");
  }
  if (spec.dissipates && (spec.rigid || spec.bounces))
    refuse(spec.name +
           ".dissipation: the contact is rigid, or has a restitution. Fix: give a stiffness and no restitution");
  check_carried(spec.name + ".carried", spec.carried, scene, carries);
}

// Per node, whether constraints hold it.
std::vector<char> held_nodes(const Scene& s) {
  std::vector<char> held(s.nodes(), false);
  for (const Group& g : s.groups)
    for (const int n : g.stencil) held[n] = true;
  for (const Volume& v : s.volumes)
    for (const int n : v.nodes) held[n] = true;
  return held;
}

// Of contacts with restitution: the free particles that nothing holds, and which ones constraints hold. A soft contact of what is held gives back
// by itself.
void add_bouncers(const std::vector<char>& held, Scene& s) {
  std::map<int, std::vector<int>> contacts;
  for (std::size_t c = 0; c < s.contacts.size(); ++c) {
    Contact& contact = s.contacts[c];
    if (contact.restitution < 0) continue;
    for (int item = 0; item < contact.points(); ++item) {
      const int n = contact.first_node(item);
      contact.held.push_back(held[n] || contact.arity > 1);  // a body holds its points
      if (s.role[n] != Role::free) continue;
      if (!contact.held.back())
        contacts[n].push_back(static_cast<int>(c));
      else if (contact.stiffness >= 0)
        refuse(contact.name + ".restitution: " + (contact.arity > 1 ? "the body of node " : "particle ") +
               std::to_string(n) +
               " is held by constraints, and the contact has a stiffness. Fix: leave out one of the two");
    }
  }
  for (auto& [node, own] : contacts) s.bouncers.push_back({node, std::move(own)});
}

// Their radii and their restitution stand behind all others.
void add_balls(const std::vector<int>& nodes, const std::vector<char>& held, std::size_t radii,
               std::size_t restitutions, Scene& s) {
  if (nodes.empty()) return;
  const std::string field = "collisions";
  check_nodes(field, nodes, s.nodes());
  const std::vector<int> slot = slots(nodes, s.nodes(), field);
  if (nodes.size() < 2) refuse(field + ": one particle. Fix: give two or more, which may hit each other");
  s.balls.first_radius = radii;
  s.balls.restitution = static_cast<int>(restitutions);
  for (const int n : nodes) {
    const std::string particle = field + ": particle " + std::to_string(n);
    if (!s.is_place[n])
      refuse(field + ": node " + std::to_string(n) + " is " + a_direction(s, n) + ". Fix: use particles");
    if (s.role[n] != Role::free)
      refuse(particle + " is held. Fix: leave it out, and let the others touch a sphere there");
    s.balls.members.push_back({n, {}});
    s.balls.held.push_back(held[n]);
  }
  for (const Group& g : s.groups)
    for (const int n : g.stencil)
      if (g.unilateral && slot[n] >= 0)
        refuse(field + ": particle " + std::to_string(n) + " is on a tether of " + g.name +
               ", which impacts would take for slack. Fix: use distance constraints, or leave out the particle");
  for (Bouncer& own : s.bouncers)
    if (slot[own.node] >= 0) s.balls.members[slot[own.node]].contacts = std::move(own.contacts);
  std::erase_if(s.bouncers, [&](const Bouncer& own) { return slot[own.node] >= 0; });
}

// Its coefficient stands behind those of contacts.
void add_pair_friction(const SelfContactSpec& spec, Scene& s, std::vector<char>& carries) {
  if (spec.carried.empty()) return;
  const std::string field = "self_contact.carried";
  if (spec.pieces.empty() || spec.carried.size() % 2)
    refuse(field + ": " + std::to_string(spec.carried.size()) + " nodes for " + std::to_string(spec.pieces.size()) +
           " pieces. Fix: give two for each pair that may touch at a time, where anything does");
  check_carried(field, spec.carried, s, carries);
  s.self_contact.friction = static_cast<int>(s.contacts.size());
  for (auto n = spec.carried.begin(); n != spec.carried.end(); n += 2) s.self_contact.carried.push_back({n[0], n[1]});
}

// The radii of pieces stand behind those of contacts, and the weights of points of bodies likewise. Where any piece has triangles, the points of all pieces
// may touch them.
void add_self_contact(const SceneSpec& spec, std::size_t weights, Scene& s, std::vector<char>& carries) {
  SelfContact& own = s.self_contact;
  const std::string field = "self_contact";
  own.nodes = s.nodes();
  own.on_bodies = spec.self_contact.on_bodies;
  own.first_weight = weights;
  for (const auto& nodes : own.on_bodies) {
    check_nodes(field, {nodes.begin(), nodes.end()}, s.nodes());
    check_point_of_body(field, nodes.data(), s);
  }
  own.radius.assign(own.spots(), -1);
  int place = static_cast<int>(s.contacts.size());
  for (const SelfContactSpec::Piece& piece : spec.self_contact.pieces) {
    if (piece.edges.empty()) refuse(field + ": a piece has no edges. Fix: give ropes, cloths or both");
    std::vector<int> nodes;
    for (const auto& [a, b] : piece.edges) {
      check_nodes(field, {a, b}, own.spots());
      if (a == b) refuse(field + ": an edge from particle " + std::to_string(a) + " to itself. Fix: leave it out");
      nodes.insert(nodes.end(), {a, b});
    }
    check_triangles(field, piece.triangles, s);
    for (const auto& t : piece.triangles) nodes.insert(nodes.end(), t.begin(), t.end());
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    for (const int n : nodes) {
      if (n < own.nodes && !s.is_place[n])
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
  add_pair_friction(spec.self_contact, s, carries);
  if (const auto loose = std::find(own.radius.begin() + own.nodes, own.radius.end(), -1); loose != own.radius.end())
    refuse(field + ": point " + std::to_string(loose - own.radius.begin() - own.nodes) +
           " of a body is in no piece. Fix: leave it out");
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

}  // namespace

ContactSizes add_contacts(const SceneSpec& spec, Scene& s) {
  std::size_t poses = 0, sizes = 0, soft = 0, bouncing = 0, weights = 0, dissipating = 0;
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
                          c.bounces ? static_cast<int>(bouncing++) : -1,
                          c.dissipates ? static_cast<int>(dissipating++) : -1, points_in_contact(s), weights});
    if (c.arity > 1) weights += c.nodes.size();
  }
  const std::vector<char> held = held_nodes(s);
  add_bouncers(held, s);
  add_self_contact(spec, weights, s, carries);
  const std::size_t radii = s.contacts.size() + spec.self_contact.pieces.size();
  add_balls(spec.balls, held, radii, bouncing, s);
  return {s.contacts.size() + s.self_contact.rubs(),
          radii + s.balls.members.size(),
          soft,
          poses,
          sizes,
          bouncing + !s.balls.empty(),
          weights + most_point_nodes * s.self_contact.on_bodies.size(),
          dissipating};
}

}  // namespace sheetbend
