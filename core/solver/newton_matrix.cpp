#include "core/solver/newton_matrix.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/constraints/any_kind.h"
#include "core/solver/block_frames.h"

namespace sheetbend {
namespace {

using sheetbend_blocks::lanes;
using sheetbend_blocks::row;

constexpr double convexities[] = {1.0 / 64.0, 1.0 / 8.0, 1.0};

using Matrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, largest_kind.dofs, largest_kind.dofs>;

// Numbers of a run's elements.
std::size_t numbers_of(const Scene& scene, const MemberRun& run) {
  return run.items.size() * triangle(3 * scene.groups[run.group].arity);
}

// Whether what differs between M (3, 3) and its transpose is rounding.
bool is_symmetric(const double* M) {
  double largest = 0.0, apart = 0.0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      largest = std::max(largest, std::abs(M[3 * a + b]));
      apart = std::max(apart, std::abs(M[3 * a + b] - M[3 * b + a]));
    }
  return apart <= 16.0 * std::numeric_limits<double>::epsilon() * largest;
}

// The part of the matrix of a pair that touches that has no negative eigenvalues, kappa g g^T: the root of kappa times g (12), the gradient of the depth. Without friction.
void convex_root(bool triangle, Part part, const double* x, const PairNumbers<double>& numbers, double* root) {
  const Nearest<double> n = nearest_points(triangle, x, softness_of(numbers), part);
  const double scale = n.squared > 0.0 ? std::sqrt(numbers.kappa / n.squared) : 0.0;
  for (int k = 0; k < 4; ++k) ((scale * n.weight[k]) * n.apart).store(root + 3 * k);
}

}  // namespace

void make_convex(int dofs, double* E) {
  Eigen::Map<Matrix> matrix(E, dofs, dofs);
  const Eigen::SelfAdjointEigenSolver<Matrix> modes(matrix);
  if (!(modes.eigenvalues()[0] < 0.0)) return;
  matrix = modes.eigenvectors() * modes.eigenvalues().cwiseMax(0.0).asDiagonal() * modes.eigenvectors().transpose();
}

void NewtonMatrix::resize(const Scene& scene, const DirectBlock& block) {
  masses_.assign(block.movable, 0.0);
  for (auto* all : {&elements_, &convex_}) {
    all->resize(block.runs.size());
    for (std::size_t r = 0; r < all->size(); ++r) (*all)[r].assign(numbers_of(scene, block.runs[r]));
  }
  element_numbers_.clear();
  element_numbers_.reserve(elements_.size());
  for (auto& run : elements_) element_numbers_.push_back(run.numbers());
  pairs_.clear();
  paired_.reset();
  in_pattern_.clear();
  factor_.reset(pattern_of(block).structure);
  contacts_.assign(9 * block.contacts.size(), 0.0);
  weights_.resize(block.contacts.size());
  if (block.may_slide()) lu_.resize(pattern_of(block).structure);
  iteration_.resize(scene, block);
}

std::size_t NewtonMatrix::bytes(const Scene& scene, const DirectBlock& block) {
  const CondensedPattern& pattern = std::get<CondensedPattern>(*block.condensation);
  const FactorStructure& structure = pattern.structure;
  std::size_t bytes = sizeof(double) * (block.movable + structure.size()) + Factor<double>::bytes(structure);
  bytes += sizeof(double) * (9 + most_point_nodes) * block.contacts.size();
  if (block.may_slide()) bytes += UnsymmetricFactor::bytes(structure);
  bytes += NewtonIteration::bytes(block);
  for (const MemberRun& run : block.runs)
    bytes += 2 * (sizeof(Numbers<double>) + Numbers<double>::bytes(numbers_of(scene, run))) + sizeof(double*);
  return bytes;
}

void NewtonMatrix::find(const Scene& scene, const DirectBlock& block, IncrementalPotential& potential,
                        Numbers<double>& at, bool curved) {
  for (int p = 0; p < block.movable; ++p) masses_[p] = 1.0 / at[row * p + 3];
  arrays_ = potential.arrays(block, at);
  arrays_.elements = element_numbers_.data();
  pack_kernels().potential->find_elements(arrays_);
  potential.add_rigid_elements(block, at, elements_);
  if (!curved) leave_out_idle(scene, block, at, elements_);
  convex_found_ = iteration_found_ = false;
  find_contacts(block, potential.contacts, at.data(), curved);
  find_pairs(scene, block, potential, at.data());
}

void NewtonMatrix::find_contacts(const DirectBlock& block, const BlockContacts<double>& contacts, const double* x,
                                 bool curved) {
  symmetric_ = true;
  rubs_ = false;
  weights_ = contacts.weights;
  for (int i = 0; i < static_cast<int>(block.contacts.size()); ++i) {
    const Pose<double>& pose = contacts.pose(block, i);
    const Vec3<double> z = pose.in_frame(contacts.point(block, i, x));
    double A[9], AR[9], *M = &contacts_[9 * i];
    std::fill_n(M, 9, 0.0);
    const Touch<double> touch = touch_matrix(block.contacts[i].shape, z, contacts.numbers[i], curved, A);
    if (!touch.pushes) continue;
    rubs_ |= touch.rubs;
    const double* R = pose.turn;  // M = R A R^T
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        AR[3 * a + b] = A[3 * a] * R[3 * b] + A[3 * a + 1] * R[3 * b + 1] + A[3 * a + 2] * R[3 * b + 2];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) M[3 * a + b] = R[3 * a] * AR[b] + R[3 * a + 1] * AR[3 + b] + R[3 * a + 2] * AR[6 + b];
    symmetric_ = symmetric_ && is_symmetric(M);
  }
}

void NewtonMatrix::find_pairs(const Scene& scene, const DirectBlock& block, const IncrementalPotential& potential,
                              const double* x) {
  const BlockPairs& pairs = potential.pairs;
  pairs_.clear();
  for (const BlockPair& pair : pairs.all()) {
    double at[12];
    pairs.gather(pair, x, at);
    if (!touches(pair.key.triangle, at, pair.numbers)) continue;
    const Part part = nearest_part(pair.key.triangle, at, softness_of(pair.numbers));
    const Rub<double> rub =
        block.surface.rubs() ? potential.friction.of(pair.key, pair.spots, pairs.spots) : Rub<double>{};
    pairs_.push_back({pair.key, pair.spots, {}, {}});
    convex_root(pair.key.triangle, part, at, pair.numbers, pairs_.back().convex.data());
    const bool rubs = meeting_matrix(pair.key.triangle, part, at, pair.numbers, block.surface.rubs() ? &rub : nullptr,
                                     pairs_.back().matrix.data());
    symmetric_ = symmetric_ && !rubs;
  }
  if (pairs_.empty()) return;
  spots_ = pairs.spots;
  find_pattern(scene, block, pairs);
}

// With all pairs of the list where a substep's first ones touch, and with those of the list besides where others do later.
void NewtonMatrix::find_pattern(const Scene& scene, const DirectBlock& block, const BlockPairs& pairs) {
  const bool known = std::ranges::all_of(
      pairs_, [&](const TouchingPair& pair) { return std::ranges::binary_search(in_pattern_, pair.key); });
  if (!begins_ && known) return;
  std::vector<PairKey> listed, all;
  for (const BlockPair& pair : pairs.all()) listed.push_back(pair.key);
  if (begins_)
    all = std::move(listed);
  else
    std::ranges::set_union(in_pattern_, listed, std::back_inserter(all));
  begins_ = false;
  if (paired_ && all == in_pattern_) return;
  paired_ = pattern_with(scene, block, all);
  in_pattern_ = std::move(all);
}

void NewtonMatrix::find_convex(const Scene& scene, const DirectBlock& block) {
  convex_found_ = true;
  Matrix E;
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const int dofs = 3 * scene.groups[block.runs[r].group].arity;
    E.resize(dofs, dofs);
    for (int i = 0; i < block.runs[r].count; ++i) {
      const auto at = [&](int a, int b) { return lane_at(i, triangle(dofs), triangle(a) + b); };
      for (int a = 0; a < dofs; ++a)
        for (int b = 0; b <= a; ++b) E(a, b) = E(b, a) = elements_[r][at(a, b)];
      make_convex(dofs, E.data());
      for (int a = 0; a < dofs; ++a)
        for (int b = 0; b <= a; ++b) convex_[r][at(a, b)] = E(a, b);
    }
  }
}

// Masses and constraints, to the values of the symmetric factor.
void NewtonMatrix::assemble(const Scene& scene, const DirectBlock& block, double convexity) {
  const CondensedPattern& pattern = pattern_of(block);
  factor_.reset(pattern.structure);
  for (int p = 0; p < block.movable; ++p)
    for (int d = pattern.dof_of[p]; d < pattern.dof_of[p] + 3; ++d)
      factor_.values[pattern.structure.position(d, d)] = masses_[p];
  if (convexity > 0.0 && !convex_found_) find_convex(scene, block);
  double* values = factor_.values.data();
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const std::vector<int>& entries = entries_of_run(block, r);
    const double *E = elements_[r].data(), *convex = convex_[r].data();
    for (std::size_t e = 0; e < entries.size(); ++e)
      if (entries[e] >= 0) values[entries[e]] += convexity > 0.0 ? E[e] + convexity * (convex[e] - E[e]) : E[e];
  }
}

void NewtonMatrix::add_pairs(const DirectBlock& block, double convexity) {
  const CondensedPattern& pattern = pattern_of(block);
  for (const TouchingPair& pair : pairs_) {
    auto E = pair.matrix;
    if (convexity > 0.0)
      for (int i = 0; i < 144; ++i) E[i] += convexity * (pair.convex[i / 12] * pair.convex[i % 12] - E[i]);
    for_each_block(pair, [&](int p, int q, double weight, int k, int l) {
      if (p >= block.movable || q >= block.movable) return;
      const int row_dof = pattern.dof_of[p], column_dof = pattern.dof_of[q];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          if (column_dof + b <= row_dof + a)
            factor_.values[pattern.structure.position(row_dof + a, column_dof + b)] +=
                weight * E[12 * (3 * k + a) + 3 * l + b];
    });
  }
}

bool NewtonMatrix::factorize(const Scene& scene, const DirectBlock& block, double convexity) {
  const CondensedPattern& pattern = pattern_of(block);
  assemble(scene, block, convexity);
  add_pairs(block, convexity);
  as_lu_ = false;
  for_each_contact(block, [&](int p, int q, double weight, const double* M) {
    const int row_dof = pattern.dof_of[p], column_dof = pattern.dof_of[q];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (column_dof + b <= row_dof + a)
          factor_.values[pattern.structure.position(row_dof + a, column_dof + b)] += weight * M[3 * a + b];
  });
  factor_.factorize(pattern.structure, pack_kernels().blocks->one.forward.factor_supernodes);
  // A pivot that is not positive has zero for its inverse.
  return std::all_of(factor_.inverse.begin(), factor_.inverse.end(), [](double p) { return p > 0.0; });
}

bool NewtonMatrix::factorize_unsymmetric(const Scene& scene, const DirectBlock& block, double convexity) {
  const CondensedPattern& pattern = pattern_of(block);
  assemble(scene, block, convexity);
  as_lu_ = true;
  lu_.resize(pattern.structure);
  lu_.load(pattern.structure, factor_.values.data());
  for_each_contact(block, [&](int p, int q, double weight, const double* M) {
    lu_.add(pattern.structure, pattern.dof_of[p], pattern.dof_of[q], weight, M);
  });
  for (const TouchingPair& pair : pairs_)
    for_each_block(pair, [&](int p, int q, double weight, int k, int l) {
      if (p >= block.movable || q >= block.movable) return;
      double M[9];
      for (int a = 0; a < 9; ++a) M[a] = pair.matrix[12 * (3 * k + a / 3) + 3 * l + a % 3];
      lu_.add(pattern.structure, pattern.dof_of[p], pattern.dof_of[q], weight, M);
    });
  return lu_.factorize(pattern.structure, pack_kernels().factor_unsymmetric);
}

double NewtonMatrix::factorize_convex_enough(const Scene& scene, const DirectBlock& block) {
  if (factorize(scene, block, 0.0)) return 0.0;
  for (const double convexity : convexities)
    if (factorize(scene, block, convexity)) return convexity;
  return 1.0;
}

bool NewtonMatrix::iterate(const Scene& scene, const DirectBlock& block, double tolerance, bool transposed, double* z) {
  if (!rubs_ || !iterates_ || !NewtonIteration::serves(block)) return false;
  if (!iteration_found_) iteration_.find(scene, block, masses_, elements_, contacts_);
  iteration_found_ = true;
  if (!iteration_.pays(tolerance)) return false;
  const auto multiply = [&](Numbers<double>& p, Numbers<double>& q) {
    multiply_held(block, p, q);
    const double* from = p.data();
    double* to = q.data();
    for (std::size_t i = 0; i < block.contacts.size(); ++i) {
      const int at = row * block.contacts[i].particles[0];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          to[at + a] += contacts_[9 * i + (transposed ? 3 * b + a : 3 * a + b)] * from[at + b];
    }
  };
  iterates_ = iteration_.solve(tolerance, transposed, multiply, z);
  return iterates_;
}

void NewtonMatrix::multiply_held(const DirectBlock& block, Numbers<double>& z, Numbers<double>& Kz) {
  Kz.clear();
  const double* from = z.data();
  double* to = Kz.data();
  for (int p = 0; p < block.movable; ++p)
    for (int d = row * p; d < row * p + 3; ++d) to[d] = masses_[p] * from[d];
  pack_kernels().potential->multiply(arrays_, z.numbers(), Kz.numbers());
}

void NewtonMatrix::multiply(const DirectBlock& block, Numbers<double>& z, Numbers<double>& Kz) {
  multiply_held(block, z, Kz);
  for_each_contact(block, [&](int p, int q, double weight, const double* M) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) Kz[row * p + a] += weight * M[3 * a + b] * z[row * q + b];
  });
  for (const TouchingPair& pair : pairs_)
    for_each_block(pair, [&](int p, int q, double weight, int k, int l) {
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          Kz[row * p + a] += weight * pair.matrix[12 * (3 * k + a) + 3 * l + b] * z[row * q + b];
    });
}

bool NewtonMatrix::find_negative_direction(const DirectBlock& block, double* d) {
  const auto pivot = std::find_if(factor_.inverse.begin(), factor_.inverse.end(), [](double p) { return !(p > 0.0); });
  if (pivot == factor_.inverse.end()) return false;
  const CondensedPattern& pattern = pattern_of(block);
  const int at = static_cast<int>(pivot - factor_.inverse.begin());
  std::fill(factor_.inverse.begin(), factor_.inverse.end(), 0.0);
  factor_.inverse[at] = 1.0;
  for (std::size_t p = 0; p < pattern.dof_of.size(); ++p)
    for (int i = 0; i < 3; ++i) d[3 * p + i] = pattern.dof_of[p] + i == at ? 1.0 : 0.0;
  solve(block, d);
  return true;
}

}  // namespace sheetbend
