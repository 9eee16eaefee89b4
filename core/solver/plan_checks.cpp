#include "core/solver/plan_checks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/constraints/registry.h"

namespace sheetbend {
namespace {

void check(const SolverOptions& o) {
  if (!(o.h > 0.0) || !std::isfinite(o.h))
    throw std::invalid_argument("h: the substep is " + std::to_string(o.h) + " s. Fix: give a positive time");
  if (o.iterations < 1)
    throw std::invalid_argument("iterations: got " + std::to_string(o.iterations) + ". Fix: give at least 1");
  if (!(o.cg_tolerance > 0.0 && o.cg_tolerance < 1.0))
    throw std::invalid_argument("cg_tolerance: got " + std::to_string(o.cg_tolerance) +
                                ". Fix: give a relative residual between 0 and 1");
  if (o.cg_iterations < 1)
    throw std::invalid_argument("cg_iterations: got " + std::to_string(o.cg_iterations) + ". Fix: give at least 1");
  if (!(o.force_tolerance > 0.0 && o.force_tolerance < 1.0))
    throw std::invalid_argument("force_tolerance: got " + std::to_string(o.force_tolerance) +
                                ". Fix: give a share of the largest force between 0 and 1");
  if (o.threads < 1)
    throw std::invalid_argument("threads: got " + std::to_string(o.threads) + ". Fix: give at least 1");
}

// Which of them push is not known before a block is solved.
void expect_no_unilateral(const Scene& scene) {
  for (const Group& group : scene.groups)
    if (group.unilateral)
      throw std::invalid_argument("solver.method: group " + group.name +
                                  " may go slack, which only sweeps allow. Fix: use gauss_seidel, or leave it out");
}

void expect_no_volume(const Scene& scene) {
  if (!scene.volumes.empty())
    throw std::invalid_argument("solver.method: the volume of " + scene.volumes.front().name +
                                " is to be kept, which implicit substeps do not do. Fix: use newton, newton_cg, direct "
                                "or gauss_seidel, or give a pressure instead");
}

void expect_no_self_contact(const Scene& scene) {
  if (!scene.self_contact.empty())
    throw std::invalid_argument(
        "solver.method: ropes, cloths or bodies may touch each other, which needs substeps whose forces balance. Fix: "
        "use implicit");
}

// Contact stands in the balance of forces, which implicit substeps find, or is projected between sweeps.
void expect_no_contact(const Scene& scene) {
  if (!scene.contacts.empty())
    throw std::invalid_argument("solver.method: this one does not compute contacts, and the scene has the contact " +
                                scene.contacts.front().name +
                                ". Fix: use implicit, or gauss_seidel for cloth in many short substeps");
}

// Sweeps project particles out of colliders.
void expect_contact_of_particles(const Scene& scene) {
  for (const Contact& contact : scene.contacts)
    if (contact.arity > 1)
      throw std::invalid_argument("solver.method: gauss_seidel does not compute contacts of bodies, and the contact " +
                                  contact.name + " has points of one. Fix: use implicit");
}

// Blocks are made of constraints and what they join.
void expect_constraints_around_volumes(const Scene& scene) {
  if (scene.volumes.empty()) return;
  std::vector<char> joined(scene.nodes(), false);
  for (const Group& group : scene.groups)
    for (const int node : group.stencil) joined[node] = true;
  for (const Volume& volume : scene.volumes)
    for (const int node : volume.nodes)
      if (scene.role[node] == Role::free && !joined[node])
        throw std::invalid_argument("solver.method: particle " + std::to_string(node) + " of the volume of " +
                                    volume.name + " is in no constraint. Fix: use gauss_seidel, or give it a skin");
}

}  // namespace

void check_solver(const Scene& scene, const SolverOptions& options) {
  check(options);
  if (options.partition != Partition::gauss_seidel) {
    expect_no_unilateral(scene);
    expect_constraints_around_volumes(scene);
  }
  if (options.partition == Partition::implicit) {
    expect_no_volume(scene);
  } else {
    expect_no_self_contact(scene);
    if (options.partition == Partition::gauss_seidel)
      expect_contact_of_particles(scene);
    else
      expect_no_contact(scene);
  }
  if (scene.keeps_spin && options.partition != Partition::direct)
    throw std::invalid_argument(
        "solver.method: bodies keep their spin in direct alone. Fix: use direct, or leave their spin out");
}

}  // namespace sheetbend
