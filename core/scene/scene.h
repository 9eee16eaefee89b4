// A scene's topology: fields, roles, constraint groups and the times of its motions. Immutable once built; every number that can be
// differentiated lives outside, in Inputs laid out by `layout`.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/contact/self_contact.h"
#include "core/contact/shapes.h"
#include "core/scene/bodies.h"
#include "core/scene/fields.h"
#include "core/scene/layout.h"
#include "core/scene/motion.h"

namespace sheetbend {

enum class Role : int { free, pinned, driven };

// A node that gives the frame of the edge from `tail` to `head` its direction. It has no inertia: it turns until no twist drives it.
// The frame's axis is the edge or, where the section may lean against it, the section's normal: a node of the same sort, which stands before
// and names itself.
struct Director {
  int node, tail, head;
  int normal = -1;

  bool is_normal() const { return normal == node; }
};

// A named set of constraints of one kind.
struct Group {
  std::string name;
  int kind = 0;
  int first = 0, count = 0;  // constraints, in the scene's order
  bool damped = false;       // whether its rate damping is evaluated at all
  std::vector<int> stencil;  // (count, arity) nodes
  int rows = 0, arity = 0, parameters = 0;
  int points = 0;                    // of a stencil; directors follow them
  bool unilateral = false;           // C >= 0
  int first_row = 0;                 // of the scene's multipliers
  std::size_t first_value = 0;       // into Quantity::rest
  std::size_t first_coordinate = 0;  // into arrays of all stencils' coordinates
  std::size_t first_gradient = 0;    // into arrays of all constraints' J

  std::span<const int> nodes(int i) const {
    return {stencil.data() + static_cast<std::size_t>(i) * arity, static_cast<std::size_t>(arity)};
  }
};

// A closed surface that keeps its volume.
struct Volume {
  std::string name;
  std::vector<int> nodes;                     // each once, ascending
  std::vector<std::array<int, 3>> triangles;  // places in `nodes`, counterclockwise from outside
};

// The most nodes that a point of a contact is a sum of.
inline constexpr int most_point_nodes = 4;

// A closed shape that stands, or moves as its poses say.
struct Collider {
  std::string name;
  int shape;                                 // in core/contact/shapes.h
  Knots motion;                              // when it has its poses; one knot for a shape that stands
  std::size_t first_pose, first_size;        // into Quantity::collider_pose and collider_size
  std::shared_ptr<const DistanceGrid> grid;  // of a distance field

  AnyShape any() const { return {shape, grid.get()}; }
};

// Points that may touch a collider: particles, or points of bodies. A point is a weighted sum of nodes; a particle is one node with the weight 1, whose
// numbers stand nowhere, and a body's point X its center and axes with 1, X1, X2, X3. The tangential force that a point is held by is carried from substep to
// substep [N], in the collider's frame: it stands in the state as a pinned node that the substep moves (core/step/carry_friction.h).
struct Contact {
  std::string name;
  int collider;
  int arity;                     // nodes of a point; they all move, or none does
  std::vector<int> nodes;        // (points, arity)
  std::vector<int> carried;      // per point: that node
  int stiffness;                 // place in Quantity::contact_stiffness, -1 where it is rigid
  int restitution;               // place in Quantity::restitution, -1 where nothing bounces
  int dissipation;               // place in Quantity::contact_dissipation, -1 where it is elastic
  std::size_t first = 0;         // of its points, in arrays of all contacts' points
  std::size_t first_weight = 0;  // in Quantity::contact_weight, where a point has several nodes: (points, arity)
  std::vector<char> held{};      // per point where something bounces: whether constraints hold it

  int points() const { return static_cast<int>(carried.size()); }
  // Of a point; the first one is a place: a particle, or the center of a body.
  std::span<const int> nodes_of(int item) const {
    return {nodes.data() + static_cast<std::size_t>(arity) * item, static_cast<std::size_t>(arity)};
  }
  int first_node(int item) const { return nodes[static_cast<std::size_t>(arity) * item]; }
  bool rebounds(int item) const { return !held.empty() && held[item]; }
};

// A particle that bounces. No constraint holds it, unless it is a ball.
struct Bouncer {
  int node;
  std::vector<int> contacts;  // off which it does
};

// Particles with a radius that hit each other.
struct Balls {
  std::vector<Bouncer> members;
  std::vector<char> held;        // likewise: whether constraints hold it
  std::size_t first_radius = 0;  // in Quantity::contact_radius, one for each
  int restitution = -1;          // place in Quantity::restitution

  bool empty() const { return members.empty(); }
};

// A load along a row of a constraint (core/step/apply_loads.h).
struct Load {
  int group, item, row;
};

// A constraint that turns a body which keeps its spin.
struct Turning {
  int group, item;
};

struct Scene {
  Fields fields;
  std::vector<int> first_dof, dim;  // per node
  std::vector<Role> role;           // per node
  std::vector<Director> directors;
  std::vector<Body> bodies;
  std::vector<int> axes;                    // of bodies, those that are free
  bool keeps_spin = false;                  // whether any body does
  std::vector<Turning> turning;             // but for `rigid`, which turns none
  bool yields = false;                      // whether any constraint does
  std::vector<char> is_director, inertial;  // per node; what is free and no director moves by its mass
  std::vector<char> is_place, has_weight;   // per node; no director and no axis; of those, what has inertia
  std::vector<int> pinned;
  std::vector<int> driven;       // nodes whose motion is given, in the order of Quantity::boundary
  std::vector<int> driven_slot;  // per node: place in `driven`, or -1
  std::vector<int> loaded;       // nodes that time-dependent forces act on
  std::vector<int> loaded_slot;
  bool has_drag = false;
  bool drag_in_wind = false;            // drag is against the velocity relative to the wind, of what has weight
  std::vector<std::array<int, 3>> air;  // nodes of the triangles that air acts on
  Knots boundary, force, wind, load;
  std::vector<Load> loads;
  std::vector<Group> groups;
  std::vector<Volume> volumes;
  std::vector<Collider> colliders;
  std::vector<Contact> contacts;
  std::vector<Bouncer> bouncers;  // by node; balls stand in `balls` instead
  Balls balls;
  SelfContact self_contact;
  int constraints = 0, rows = 0;
  std::size_t stencil_coordinates = 0, gradient_entries = 0;
  Layout layout;

  int dofs() const { return fields.dofs; }
  int nodes() const { return fields.nodes; }
  int multipliers() const { return rows + static_cast<int>(volumes.size()); }  // the constraints', then the volumes'
};

struct GroupSpec {
  std::string name;
  std::string kind;
  bool damped = false;
  std::vector<int> stencil;
};

struct VolumeSpec {
  std::string name;
  std::vector<std::array<int, 3>> triangles;  // nodes
};

struct ColliderSpec {
  std::string name, shape;
  Knots motion;
  std::shared_ptr<const DistanceGrid> grid = nullptr;
};

struct ContactSpec {
  std::string name;
  int collider;
  std::vector<int> nodes, carried;  // as in Contact; those that carry are pinned
  bool rigid = true;
  bool bounces = false;  // has a restitution
  int arity = 1;
  bool dissipates = false;  // has a dissipation
};

// Each piece has a radius of its own; pieces share no particle. Particles are numbers of nodes; points of bodies count on after all nodes of the scene.
struct SelfContactSpec {
  struct Piece {
    std::vector<std::array<int, 2>> edges;
    std::vector<std::array<int, 3>> triangles;
  };
  std::vector<Piece> pieces;
  // With friction: pinned nodes, two for each pair that may touch at a time, as in SelfContact.
  std::vector<int> carried;
  std::vector<std::array<int, 4>> on_bodies = {};  // per point of a body: its center and its axes
};

struct SceneSpec {
  int particles = 0;  // nodes, directors and axes among them
  std::vector<Director> directors;
  std::vector<Body> bodies;
  std::vector<int> pinned, driven, loaded;
  bool has_drag = false;
  std::vector<std::array<int, 3>> air;
  Knots boundary, force, wind, load;
  std::vector<GroupSpec> groups;
  std::vector<Load> loads;
  std::vector<VolumeSpec> volumes;
  std::vector<ColliderSpec> colliders;
  std::vector<ContactSpec> contacts;
  SelfContactSpec self_contact;
  std::vector<int> balls = {};  // particles that hit each other
};

// Rows whose damping needs a reference: all of them, or none.
inline std::size_t damped_rows(const Scene& scene) {
  for (const Group& group : scene.groups)
    if (group.damped) return scene.rows;
  return 0;
}

// Points of all contacts, each as often as it stands in one.
inline std::size_t points_in_contact(const Scene& scene) {
  return scene.contacts.empty() ? 0 : scene.contacts.back().first + scene.contacts.back().carried.size();
}

// Whether a point of a contact does.
inline bool moves(const Scene& scene, const Contact& contact, int item) {
  return scene.role[contact.first_node(item)] == Role::free;
}

// Builds and validates the topology. Throws std::invalid_argument("field: what, got, fix").
Scene build_scene(const SceneSpec& spec);

// Kind number of a constraint name; throws std::invalid_argument that lists the known ones.
int kind_of(const std::string& name);

}  // namespace sheetbend
