#include "core/solver/rigid_rows.h"

#include <algorithm>

#include "core/constraints/rigid.h"
#include "core/element/any_kind_hessian.h"
#include "core/linear/low_fill.h"
#include "core/scalar/pivot.h"
#include "core/solver/elimination.h"

namespace sheetbend {
namespace {

constexpr int at_row = sheetbend_blocks::row;
constexpr double gives_way = 1e-10;     // D of a row that does, of J W J^T
constexpr double stiff_joint = 1e-4;    // likewise of a joint of bodies, whose block has multipliers anyway
constexpr double firm_joint = 1e-7;     // likewise of one that is softened as rigid rows are
constexpr double softening = 1e-5;      // S, of J diag(K)^-1 J^T
constexpr std::size_t few = 256;        // rows whose order is kept, as a border of H does (condensed.h)
constexpr double far_less = 10.0;       // ratio of shares from which a row is exchanged
constexpr double no_stiffness = 1e150;  // a of a member that has been taken out: products with zero stay zero

// A member's numbers as its kind wants them.
struct Numbered : AnyConstraint<double> {
  double w[largest_kind.dofs / 3], p[largest_kind.parameters];

  void take(int number, const MemberRun& run, const double* values, bool damped, int place, const double* at) {
    const AnyKind<double>& of = any_kind<double>(number);
    const int arity = of.dofs / 3, parameters = of.parameters;
    const int count = sheetbend_blocks::value_count(damped, parameters);
    for (int k = 0; k < arity; ++k) {
      const double* from = at + run.nodes[lane_at(place, arity, k)];
      std::copy_n(from, 3, x + 3 * k);
      w[k] = from[3];
    }
    for (int k = 0; k < parameters; ++k) p[k] = values[lane_at(place, count, count - parameters + k)];
  }
};

// The kind that keeps a body rigid. It is found once: kind_of() compares names.
int kind_of_bodies() {
  static const int kind = kind_of(Rigid::name);
  return kind;
}

}  // namespace

void RigidRows::find(const Scene& scene, const Given& given, const double* at) {
  *this = {};
  Numbered own;
  std::vector<char> axis(given.block.particles.size(), 0);  // of a body that is kept rigid: no frame of shape matching
  for (const MemberRun& run : given.block.runs)
    if (const Group& group = scene.groups[run.group]; group.kind == kind_of_bodies())
      for (int i = 0; i < run.count; ++i)
        for (int k = 0; k < group.arity; ++k) axis[run.nodes[lane_at(i, group.arity, k)] / at_row] = 1;
  for (int r = 0; r < static_cast<int>(given.block.runs.size()); ++r) {
    const MemberRun& run = given.block.runs[r];
    const Group& group = scene.groups[run.group];
    const int count = sheetbend_blocks::value_count(group.damped, group.parameters);
    double* values = given.values[r].data();
    if (!any_kind<double>(group.kind).balances) continue;
    const int dofs = 3 * group.arity;
    bool slides = false;  // dry friction, whose bound makes a kink: Newton's method finds it without a multiplier
    with_kind(group.kind, [&]<class K>(K) { slides = Yields<K>; });
    for (int i = 0; i < run.count; ++i) {
      double& a = values[lane_at(i, count, 0)];
      const double g = group.damped ? values[lane_at(i, count, 1)] : 0.0;
      own.take(group.kind, run, values, group.damped, i, at);
      own.evaluate(group.kind, own.p);
      double stiffest = 0.0;  // J W J^T
      for (int j = 0; j < group.rows; ++j) {
        double sum = 0.0;
        for (int d = 0; d < dofs; ++d) sum += own.w[d / 3] * own.J[j * dofs + d] * own.J[j * dofs + d];
        stiffest = std::max(stiffest, sum);
      }
      bool joint = false;
      for (int k = 0; k < group.arity && !slides; ++k)
        joint |= axis[run.nodes[lane_at(i, group.arity, k)] / at_row] != 0;
      if (a != 0.0 && !(a <= (joint ? stiff_joint : gives_way) * (1.0 + g) * stiffest)) continue;
      members_.push_back({group.kind, r, i, run.first_row[i], group.rows, 0, group.arity, group.damped});
      for (int j = 0; j < group.rows; ++j) {
        a_.push_back(a);
        g_.push_back(g);
      }
      a = no_stiffness;
    }
  }
  if (!empty()) place_rows(given.block);
}

// Rows in the order of the block's, or in one of low fill where there are many and that is no band.
void RigidRows::place_rows(const DirectBlock& block) {
  const std::size_t count = members_.size();
  std::vector<int> first(count), order(count);
  for (std::size_t m = 0, row = 0; m < count; row += members_[m++].count) first[m] = static_cast<int>(row);
  const std::vector<double> a = a_, g = g_;
  const std::vector<Member> members = members_;
  const auto put = [&] {
    members_.clear(), rows_.clear(), a_.clear(), g_.clear();
    uses_.assign(block.movable, {});
    std::size_t J = 0;
    for (const int m : order) {
      Member own = members[m];
      const int block_row = own.first;
      own.first = static_cast<int>(rows_.size());
      own.J = J;
      for (int j = 0; j < own.count; ++j) {
        for (int k = 0; k < own.arity; ++k)
          if (const int p = particle(block, own, k); p < block.movable)
            uses_[p].push_back({own.first + j, J + 3 * static_cast<std::size_t>(j * own.arity + k)});
        rows_.push_back(block_row + j);
        a_.push_back(a[first[m] + j]);
        g_.push_back(g[first[m] + j]);
      }
      J += static_cast<std::size_t>(3 * own.count * own.arity);
      members_.push_back(own);
    }
    J_.assign(J, 0.0);
    std::vector<std::pair<int, int>> entries;
    for (const auto& uses : uses_) add_entries_of_particle(uses, entries);
    structure_ = FactorStructure(static_cast<int>(rows_.size()), entries, block.loop_pivot == 0.0,
                                 std::max(block.loop_pivot, redundant_pivot));
  };
  for (std::size_t m = 0; m < count; ++m) order[m] = static_cast<int>(m);
  std::sort(order.begin(), order.end(), [&](int m, int n) { return members[m].first < members[n].first; });
  put();
  if (!structure_.banded() && rows_.size() > few) {
    std::vector<std::vector<int>> joined(block.movable);
    for (std::size_t m = 0; m < count; ++m)
      for (int k = 0; k < members[m].arity; ++k)
        if (const int p = particle(block, members[m], k); p < block.movable) joined[p].push_back(static_cast<int>(m));
    const std::vector<int> place = places_for_low_fill(static_cast<int>(count), joined);
    for (std::size_t m = 0; m < count; ++m) order[place[m]] = static_cast<int>(m);
    if (block.loop_pivot > 0.0)  // as order_bodies_first()
      std::ranges::stable_partition(order, [&](int m) { return members[m].kind == kind_of_bodies(); });
    put();
  }
  const std::size_t n = rows_.size();
  D_.resize(n);
  for (std::size_t j = 0; j < n; ++j) D_[j] = a_[j] / (1.0 + g_[j]);
  S_ = D_;
  for (auto* numbers : {&C_, &c_, &weight_, &steepest_, &lambda}) numbers->assign(n, 0.0);
  left_out_.assign(n, false);
  own_rows_.assign(block.size(), -1);
  for (std::size_t j = 0; j < n; ++j) own_rows_[rows_[j]] = static_cast<int>(j);
}

void RigidRows::evaluate(const Given& given, const double* at) {
  Numbered own;
  for (const Member& m : members_) {
    const int dofs = 3 * m.arity;
    own.take(m.kind, given.block.runs[m.run], given.values[m.run].data(), m.damped, m.place, at);
    own.evaluate(m.kind, own.p);
    std::copy_n(own.J, m.count * dofs, &J_[m.J]);
    for (int j = 0; j < m.count; ++j) {
      const int row = m.first + j;
      C_[row] = own.C[j];
      steepest_[row] = 0.0;
      for (int d = 0; d < dofs; ++d)
        steepest_[row] =
            std::max(steepest_[row], std::abs(own.J[j * dofs + d]) / given.unit[particle(given.block, m, d / 3)]);
      double residual = own.C[j] + a_[row] * lambda[row];
      if (m.damped) residual += g_[row] * own.kind->difference(own.C[j], given.C_r[rows_[row]]);
      c_[row] = left_out_[row] ? 0.0 : residual / (1.0 + g_[row]);
    }
  }
}

// A column of J W J^T + D over all rows.
std::vector<double> RigidRows::matrix(const DirectBlock& block, const double* at, int column) const {
  std::vector<double> sum(D_.size(), 0.0);
  sum[column] = D_[column];
  for (int p = 0; p < block.movable; ++p)
    for (const Use& k : uses_[p]) {
      if (k.row != column) continue;
      const Vec3<double> wG = at[at_row * p + 3] * Vec3<double>(&J_[k.J]);
      for (const Use& i : uses_[p]) sum[i.row] += dot(wG, Vec3<double>(&J_[i.J]));
    }
  return sum;
}

// Of the rows that are not left out; those have zeros.
void RigidRows::factorize(const DirectBlock& block, const double* at) {
  factor_.reset(structure_);
  for (int j = 0; j < size(); ++j)
    if (!left_out_[j]) factor_.values[structure_.position(j, j)] = D_[j];
  for (int p = 0; p < block.movable; ++p)
    for (const Use& k : uses_[p]) {
      const Vec3<double> wG = at[at_row * p + 3] * Vec3<double>(&J_[k.J]);
      for (const Use& i : uses_[p])
        if (i.row >= k.row && !left_out_[i.row] && !left_out_[k.row])
          factor_.values[structure_.position(i.row, k.row)] += dot(wG, Vec3<double>(&J_[i.J]));
    }
  factor_.factorize(structure_);
}

void RigidRows::leave_out(const Given& given, const double* at) {
  std::fill(left_out_.begin(), left_out_.end(), false);
  std::fill(lambda.begin(), lambda.end(), 0.0);
  evaluate(given, at);
  for (int j = 0; j < size(); ++j) weight_[j] = D_[j];
  for (int p = 0; p < given.block.movable; ++p)
    for (const Use& k : uses_[p]) {
      const Vec3<double> G(&J_[k.J]);
      weight_[k.row] += at[at_row * p + 3] * dot(G, G);
    }
  for (double& w : weight_) w = w > 0.0 ? 1.0 / w : 0.0;
  factorize(given.block, at);
  const std::size_t before = structure_.banded() ? structure_.stored_band() : 0;
  for (int j = 0; j < size(); ++j) left_out_[j] = factor_.inverse[before + j] == 0.0;
  if (given.block.loop_pivot == 0.0) return;
  // A row is kept even if those before leave little of it, and bodies then have another balance nearby, where they stand apart. So a row of a joint that is
  // left out takes the place of the one that has by far the largest share in it, when it is written as a sum of others.
  for (int j = 0, swaps = 0; j < size() && swaps < size(); ++j) {
    if (!left_out_[j] || !moves(j)) continue;
    const std::vector<double> c = as_sum(given, at, j);
    const auto share = [&](int i) { return c[i] * c[i] * weight_[j] / weight_[i]; };
    int most = -1;
    for (const Member& m : members_) {
      if (m.kind == kind_of_bodies()) continue;
      for (int i = m.first; i < m.first + m.count; ++i)
        if (!left_out_[i] && (most < 0 || share(i) > share(most))) most = i;
    }
    if (most < 0 || share(most) <= far_less * far_less) continue;
    left_out_[j] = false, left_out_[most] = true;
    factorize(given.block, at);
    j = -1, ++swaps;  // the others are sums of other rows now
  }
}

std::vector<double> RigidRows::as_sum(const Given& given, const double* at, int row) {
  std::vector<double> c = matrix(given.block, at, row);
  for (int j = 0; j < size(); ++j)
    if (left_out_[j]) c[j] = 0.0;
  c.resize(Factor<double>::right_side(structure_));
  factor_.solve(structure_, c.data());
  c.resize(D_.size());
  return c;
}

double RigidRows::steepness(const DirectBlock& block, int row) const {
  double sum = 0.0;
  for (int p = 0; p < block.movable; ++p)
    for (const Use& use : uses_[p])
      if (use.row == row) sum += dot(Vec3<double>(&J_[use.J]), Vec3<double>(&J_[use.J]));
  return std::sqrt(sum);
}

void RigidRows::push(const DirectBlock& block, double* force, double* magnitude) const {
  for_each_number(block, [&](int j, int dof, double J) {
    const double term = J * lambda[j];
    const int to = at_row * (dof / 3) + dof % 3;
    force[to] += term;
    magnitude[to] += std::abs(term);
  });
}

void RigidRows::add_elements(const Given& given, double* at, const double* stiffness,
                             std::vector<Numbers<double>>& elements) {
  S_ = D_;
  std::vector<double> soft(D_.size(), 0.0);
  // Stiffness of the joints that give way.
  std::vector<double> joints(3 * static_cast<std::size_t>(given.block.movable), 0.0);
  for_each_number(given.block, [&](int j, int dof, double J) {
    if (D_[j] * weight_[j] > firm_joint) joints[dof] += J * J / D_[j];
  });
  for_each_number(given.block, [&](int j, int dof, double J) {
    const int p = at_row * (dof / 3);
    soft[j] += softening * J * J / (1.0 / at[p + 3] + stiffness[p + dof % 3] + joints[dof]);
  });
  for (int j = 0; j < size(); ++j) S_[j] = std::max({D_[j], soft[j], left_out_[j] ? 1.0 : 0.0});
  Numbered own;
  double E[triangle(largest_kind.dofs)], minus[largest_kind.rows];
  for (const Member& m : members_) {
    const int dofs = 3 * m.arity, numbers = triangle(dofs);
    own.take(m.kind, given.block.runs[m.run], given.values[m.run].data(), m.damped, m.place, at);
    for (int j = 0; j < m.count; ++j) minus[j] = -lambda[m.first + j];
    std::fill_n(E, numbers, 0.0);
    add_hessian(m.kind, own.x, own.p, minus, own.J, E);
    for (int j = 0; j < m.count; ++j)
      if (!left_out_[m.first + j])
        for (int a = 0; a < dofs; ++a)
          for (int b = 0; b <= a; ++b)
            E[triangle(a) + b] += own.J[j * dofs + a] * own.J[j * dofs + b] / S_[m.first + j];
    for (int e = 0; e < numbers; ++e) elements[m.run][lane_at(m.place, numbers, e)] += E[e];
  }
}

void RigidRows::multiply(const DirectBlock& block, const double* z, double* to) const {
  for (const Member& m : members_)
    for (int j = 0; j < m.count; ++j) {
      if (left_out_[m.first + j]) continue;
      const double* J = &J_[m.J + static_cast<std::size_t>(3 * j * m.arity)];
      for (int d = 0; d < 3 * m.arity; ++d) to[m.first + j] += J[d] * z[at_row * particle(block, m, d / 3) + d % 3];
    }
}

}  // namespace sheetbend
