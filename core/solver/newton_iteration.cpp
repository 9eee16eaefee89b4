#include "core/solver/newton_iteration.h"

#include <algorithm>
#include <cmath>

#include "core/packs/lanes.h"
#include "core/scalar/vec3.h"

namespace sheetbend {
namespace {

// Multiplications of an LU.
double work_of_factor(const DirectBlock& block) {
  const auto nodes = std::get<CondensedPattern>(*block.condensation).structure.supernodes();
  double work = 0.0;
  for (int node = 0; node < nodes.count; ++node) {
    double below = nodes.row_start[node + 1] - nodes.row_start[node];
    for (int column = nodes.first[node]; column < nodes.first[node + 1]; ++column, ++below) work += below * below;
  }
  return work;
}

// Multiplications of an iteration: two products with the elements, and some per coordinate.
double work_of_iteration(const Scene& scene, const DirectBlock& block) {
  double work = 40.0 * 3.0 * block.movable;
  for (const MemberRun& run : block.runs) {
    const double dofs = 3.0 * scene.groups[run.group].arity;
    work += 2.0 * run.count * dofs * dofs;
  }
  return work;
}

// The columns of the inverse of B (3, 3), row by row: cross products of its rows over the determinant.
void invert_block(const double* B, double* columns) {
  const Vec3<double> a(B), b(B + 3), c(B + 6);
  const Vec3<double> bc = cross(b, c);
  const double over = 1.0 / dot(a, bc);
  (over * bc).store(columns);
  (over * cross(c, a)).store(columns + 4);
  (over * cross(a, b)).store(columns + 8);
}

}  // namespace

bool NewtonIteration::serves(const DirectBlock& block) {
  return !block.contacts.empty() && block.surface.empty() && block.frames.empty() &&
         std::ranges::all_of(block.contacts, [](const BlockContact& c) { return c.nodes == 1; });
}

void NewtonIteration::resize(const Scene& scene, const DirectBlock& block) {
  if (!serves(block)) return;
  particles_ = static_cast<std::size_t>(block.movable);
  krylov_.resize(particles_, block.particles.size() - particles_);
  own_.assign(9 * particles_, 0.0);
  inverse_.assign(12 * particles_, 0.0);
  most_ = work_of_factor(block) / work_of_iteration(scene, block);
}

std::size_t NewtonIteration::bytes(const DirectBlock& block) {
  if (!serves(block)) return 0;
  const auto movable = static_cast<std::size_t>(block.movable);
  return Bicgstab::bytes(movable, block.particles.size() - movable) + sizeof(double) * (9 + 12) * movable;
}

void NewtonIteration::find(const Scene& scene, const DirectBlock& block, const std::vector<double>& masses,
                           std::vector<Numbers<double>>& elements, const std::vector<double>& contacts) {
  std::fill(own_.begin(), own_.end(), 0.0);
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const int arity = scene.groups[run.group].arity, dofs = 3 * arity;
    const double* E = elements[r].data();
    for (int i = 0; i < run.count; ++i)
      for (int k = 0; k < arity; ++k) {
        const int particle = run.nodes[lane_at(i, arity, k)] / sheetbend_blocks::row;
        if (particle >= block.movable) continue;
        double* B = &own_[9 * static_cast<std::size_t>(particle)];
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b <= a; ++b) B[3 * a + b] += E[lane_at(i, triangle(dofs), triangle(3 * k + a) + 3 * k + b)];
      }
  }
  ratio_ = 0.0;
  for (std::size_t p = 0; p < particles_; ++p) {
    double* B = &own_[9 * p];
    ratio_ = std::max(ratio_, std::max({B[0], B[4], B[8]}) / masses[p]);
    B[1] = B[3], B[2] = B[6], B[5] = B[7];
    for (int d = 0; d < 9; d += 4) B[d] += masses[p];
  }
  for (std::size_t i = 0; i < block.contacts.size(); ++i)
    for (int d = 0; d < 9; ++d)
      own_[9 * static_cast<std::size_t>(block.contacts[i].particles[0]) + d] += contacts[9 * i + d];
  for (std::size_t p = 0; p < particles_; ++p) invert_block(&own_[9 * p], &inverse_[12 * p]);
}

// Half as many as conjugate gradients take, with twice the products. The preconditioned matrix is at most 2 (springs), and at least the share of inertia.
double NewtonIteration::expected(double tolerance) const {
  return 1.0 + 0.25 * std::sqrt(2.0 * (1.0 + ratio_)) * std::log(2.0 / tolerance);
}

void NewtonIteration::precondition(bool transposed, const double* r, double* y) const {
  for (std::size_t p = 0; p < particles_; ++p, r += row, y += row) {
    const double* M = &inverse_[12 * p];
    if (transposed)
      for (std::size_t c = 0; c < 3; ++c) y[c] = M[row * c] * r[0] + M[row * c + 1] * r[1] + M[row * c + 2] * r[2];
    else
      for (std::size_t d = 0; d < row; ++d) y[d] = M[d] * r[0] + M[row + d] * r[1] + M[2 * row + d] * r[2];
  }
}

}  // namespace sheetbend
