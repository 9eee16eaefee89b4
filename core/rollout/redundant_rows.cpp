#include "core/rollout/redundant_rows.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "core/rollout/rollout.h"

namespace sheetbend {
namespace {

constexpr double least_share = 1e-6;         // of a row's own size: what a row that says it has at least in it
constexpr double told_contradiction = 1e-6;  // of the scene's size
constexpr std::size_t most_named = 4, most_others = 8;

using State = BlockState<double>;

// Whether the factor has left a row out of which something can move.
bool left_out(const DirectBlock& block, State& state, int row) {
  const auto& factor = state.at(0).factor;
  const std::size_t before = block.banded() ? block.structure.stored_band() : 0;
  return factor.inverse[before + row] == 0.0;
}

// Of the matrix A = J W J^T + D before it was factored.
std::vector<double> diagonal_of(const BlockNumbers<double>& numbers) {
  std::vector<double> diagonal(numbers.diagonal, numbers.diagonal + numbers.size);
  for (int p = 0; p < numbers.movable; ++p)
    for (int k = numbers.window[p]; k < numbers.window[p + 1]; ++k) {
      const Vec3<double> G(numbers.gradient(k));
      diagonal[numbers.rows[k]] += numbers.inverse_mass(p) * dot(G, G);
    }
  return diagonal;
}

// A row as a sum of the others: A c = A e_row over the rows that are kept.
RedundantRow take_apart(const DirectBlock& block, State& state, int row, const std::vector<double>& C,
                        const std::vector<double>& diagonal) {
  const auto numbers = numbers_of_block(block, state, 0);
  std::vector<double> unit(block.size(), 0.0), z(3 * static_cast<std::size_t>(block.movable)),
      c(right_side<double>(block), 0.0);
  unit[row] = 1.0;
  numbers.transpose_times(unit.data(), z.data());
  double J2 = 0.0;
  for (double& g : z) J2 += g * g;
  for (std::size_t d = 0; d < z.size(); ++d) z[d] *= -numbers.inverse_mass(static_cast<int>(d / 3));
  numbers.subtract_times(z.data(), c.data());
  state.at(0).factor.solve(block.structure, c.data());

  RedundantRow found{block.multipliers[row], {}, C[row]};
  for (int i = 0; i < block.size(); ++i) {
    found.contradiction -= c[i] * C[i];
    if (c[i] * c[i] * diagonal[i] > least_share * least_share * diagonal[row])
      found.others.push_back(block.multipliers[i]);
  }
  std::ranges::sort(found.others);
  found.contradiction = std::abs(found.contradiction) / std::sqrt(J2);
  return found;
}

// The same for the rigid rows of a block whose other rows stand in a matrix of its particles.
void find_among_rigid(const SubstepState<double>& substep, const DirectBlock& block, std::vector<RedundantRow>& found) {
  State state;
  state.resize(substep.scene, block, 0);
  begin_block(substep, block, state);
  RigidRows rigid;
  const std::vector<double> unit(block.particles.size(), 1.0);
  const RigidRows::Given given{block, state.values, state.C_r, unit};
  const double* at = state.x[0].data();
  rigid.find(substep.scene, given, at);
  if (rigid.empty()) return;
  rigid.leave_out(given, at);
  for (int row = 0; row < rigid.size(); ++row) {
    if (!rigid.left_out(row) || !rigid.moves(row)) continue;
    const std::vector<double> c = rigid.as_sum(given, at, row);
    RedundantRow one{block.multipliers[rigid.row(row)], {}, rigid.value(row)};
    for (int i = 0; i < rigid.size(); ++i) {
      one.contradiction -= c[i] * rigid.value(i);
      if (c[i] * c[i] * rigid.weight(row) > least_share * least_share * rigid.weight(i))
        one.others.push_back(block.multipliers[rigid.row(i)]);
    }
    std::ranges::sort(one.others);
    one.contradiction = std::abs(one.contradiction) / rigid.steepness(block, row);
    found.push_back(one);
  }
}

// From the first particle.
double largest_distance(const Scene& scene, const double* x) {
  double largest = 0.0;
  for (int n = 1; n < scene.nodes(); ++n)
    if (scene.is_place[n])
      largest = std::max(largest, norm(Vec3<double>(x + scene.first_dof[n]) - Vec3<double>(x + scene.first_dof[0])));
  return largest;
}

// "links 5 (particles 1 and 3)", or the volume of that name.
std::string name_of(const Scene& scene, int row, bool with_particles) {
  if (row >= scene.rows) return "the volume of " + scene.volumes[row - scene.rows].name;
  const Group& group = group_of(scene, row);
  const int item = (row - group.first_row) / group.rows;
  std::string text = group.name + " " + std::to_string(item);
  if (group.rows > 1) text = "row " + std::to_string((row - group.first_row) % group.rows) + " of " + text;
  if (!with_particles) return text;
  const auto nodes = group.nodes(item);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    text += (k == 0 ? " (particles " : k + 1 < nodes.size() ? ", " : " and ") + std::to_string(nodes[k]);
  return text + ")";
}

}  // namespace

std::vector<RedundantRow> redundant_rows(const Scene& scene, const Plan& plan, const double* inputs, const double* x,
                                         const double* w, double eta) {
  std::vector<RedundantRow> found;
  std::vector<double> q(x, x + scene.dofs());
  const SubstepState<double> substep{scene, {scene.layout, inputs}, eta, q.data(), w, nullptr, nullptr};
  for (const DirectBlock& block : plan.blocks) {
    if (block.condensation) {
      find_among_rigid(substep, block, found);  // what gives way is never said by others
      continue;
    }
    State state;
    state.resize(scene, block, 0);
    begin_block(substep, block, state);
    const auto arrays = arrays_of(block, runs_of(substep, block, state), state, 0);
    const auto& kernels = forward_kernels<double>(pack_kernels());
    kernels.evaluate(arrays);
    evaluate_volumes(scene, substep.inputs, block, state, 0);
    if (block.banded())
      kernels.factor(arrays);
    else
      factor_sparse(block, kernels, state, 0);
    std::vector<double> C(arrays.dl, arrays.dl + block.size());
    for (double& c : C) c = -c;
    std::vector<double> diagonal;
    for (int row = 0; row < block.size(); ++row) {
      if (!left_out(block, state, row)) continue;
      if (diagonal.empty()) diagonal = diagonal_of(numbers_of_block(block, state, 0));
      if (!(diagonal[row] > 0.0)) continue;  // nothing of it can move
      found.push_back(take_apart(block, state, row, C, diagonal));
    }
  }
  return found;
}

std::vector<int> constraints_among(const Scene& scene, const std::vector<RedundantRow>& rows) {
  std::set<int> found;
  const auto add = [&](int row) {
    if (row >= scene.rows) {
      found.insert(scene.constraints + row - scene.rows);
    } else {
      const Group& group = group_of(scene, row);
      found.insert(group.first + (row - group.first_row) / group.rows);
    }
  };
  for (const RedundantRow& r : rows) {
    add(r.row);
    for (const int other : r.others) add(other);
  }
  return {found.begin(), found.end()};
}

const Group& group_of(const Scene& scene, int row) {
  const Group* group = scene.groups.data();
  while (row >= group->first_row + group->count * group->rows) ++group;
  return *group;
}

std::vector<RedundantRow> redundant_rows(const Scene& scene, const Plan& plan, const double* inputs, double t0) {
  const Inputs<const double> in{scene.layout, inputs};
  const Bdf bdf = Bdf::at(plan.options, 0);
  std::vector<double> x(scene.dofs()), v(scene.dofs());
  Rollout<double>::initial_state(scene, in, t0, x.data(), v.data());
  InverseMasses<double> masses;
  masses.resize(scene, plan, false);
  const Step<double> step{scene, plan, in, bdf, t0 + plan.options.h, {x.data(), x.data(), v.data(), v.data()}};
  ComputeEffectiveMasses::compute(step, masses);
  return redundant_rows(scene, plan, inputs, x.data(), masses.w.data(), bdf.eta);
}

std::string describe(const Scene& scene, const std::vector<RedundantRow>& rows, const double* x) {
  if (rows.empty()) return {};
  const double size = largest_distance(scene, x);
  std::ostringstream text;
  for (std::size_t i = 0; i < std::min(rows.size(), most_named); ++i) {
    const RedundantRow& r = rows[i];
    text << (i == 0 ? "" : "; ") << name_of(scene, r.row, true) << " follows from ";
    for (std::size_t k = 0; k < std::min(r.others.size(), most_others); ++k)
      text << (k == 0 ? "" : ", ") << name_of(scene, r.others[k], false);
    if (r.others.size() > most_others) text << " and " << r.others.size() - most_others << " more";
    if (r.contradiction > told_contradiction * size) text << ", and contradicts them by " << r.contradiction;
  }
  if (rows.size() > most_named) text << "; and " << rows.size() - most_named << " more";
  return text.str();
}

}  // namespace sheetbend
