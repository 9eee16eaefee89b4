#include "core/solver/incremental_potential.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sheetbend {
namespace {

using sheetbend_blocks::row;

constexpr double nothing = 1e-8;  // a displacement, of the coordinates
constexpr double roundings = 256.0 * std::numeric_limits<double>::epsilon();

// Of those that frames stand on, whose directions have the rounding of their ends; 1 where there is none.
double shortest_edge(const DirectBlock& block, const double* x) {
  double shortest = std::numeric_limits<double>::infinity();
  for (const BlockFrame& f : block.frames)
    if (f.tail >= 0)
      shortest = std::min(shortest, norm(Vec3<double>(x + row * f.head) - Vec3<double>(x + row * f.tail)));
  return std::isfinite(shortest) ? shortest : 1.0;
}

}  // namespace

void IncrementalPotential::resize(const Scene& scene, const DirectBlock& block) {
  for (auto* a : {&target, &push_, &magnitude_, &stiffness_}) a->assign(row * block.particles.size());
  unit.assign(block.particles.size(), 1.0);
  C_r.assign(block.size());
  R_.assign(3 * block.movable, 0.0);
  turns_.assign(block.movable, false);
  for (const BlockFrame& f : block.frames) turns_[f.particle] = true;
  contacts.resize(block);
  friction.resize(block);
  pairs.radius.assign(block.surface.empty() ? 0 : block.surface.spots(), 0.0);
  eta = 0.0;
  values.resize(block.runs.size());
  runs_.clear();
  runs_.reserve(block.runs.size());
  for (std::size_t r = 0; r < values.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const Group& group = scene.groups[run.group];
    values[r].assign(run.items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
    runs_.push_back({group.kind, run.count, group.damped, run.nodes.data(), run.gradients.data(), run.first_row.data(),
                     values[r].numbers(), nullptr});
  }
}

std::size_t IncrementalPotential::bytes(const Scene& scene, const DirectBlock& block) {
  std::size_t bytes = Numbers<double>::bytes(block.size()) + 4 * Numbers<double>::bytes(row * block.particles.size()) +
                      sizeof(double) * (3 * block.movable + block.particles.size()) + block.movable +
                      BlockContacts<double>::bytes(scene, block) + BlockPairs::bytes(block) +
                      PairFriction<double>::bytes(block);
  for (const MemberRun& run : block.runs) {
    const Group& group = scene.groups[run.group];
    bytes += sizeof(sheetbend_blocks::Run) + sizeof(Numbers<double>) +
             Numbers<double>::bytes(run.items.size() * sheetbend_blocks::value_count(group.damped, group.parameters));
  }
  return bytes;
}

sheetbend_blocks::Potential IncrementalPotential::arrays(const DirectBlock& block, Numbers<double>& at) {
  sheetbend_blocks::Potential b{};
  b.runs = runs_.data();
  b.run_count = static_cast<int>(runs_.size());
  b.particles = static_cast<int>(block.particles.size());
  b.x = at.numbers();
  b.C_r = C_r.numbers();
  b.force = push_.numbers();
  b.magnitude = magnitude_.numbers();
  b.stiffness = stiffness_.numbers();
  return b;
}

// What contacts add to Phi, to the pushes, and to what those are judged by.
double IncrementalPotential::add_contacts(const DirectBlock& block, const double* x) {
  double energy = 0.0;
  for (int i = 0; i < static_cast<int>(block.contacts.size()); ++i) {
    const Touch<double> touch = contacts.at(block, i, contacts.point(block, i, x));
    if (!touch.pushes) continue;
    const double kappa = contacts.numbers[i].kappa;
    energy += 0.5 * touch.normal * touch.normal / (contacts.numbers[i].firm * kappa);
    rubs_ |= touch.rubs;
    double force[3];
    contacts.pose(block, i).turned(touch.force).store(force);
    const BlockContact& c = block.contacts[i];
    for (int k = 0; k < c.nodes; ++k) {
      const int at = row * c.particles[k];
      const double weight = contacts.weights[i][k];
      for (int d = 0; d < 3; ++d) {
        push_[at + d] += weight * force[d];
        magnitude_[at + d] += std::abs(weight * force[d]);
        stiffness_[at + d] += weight * weight * kappa;
      }
    }
  }
  return energy;
}

// Likewise pairs that touch.
double IncrementalPotential::add_pairs(const DirectBlock& block, const double* x) {
  double energy = 0.0;
  for (const BlockPair& pair : pairs.all()) {
    double at[12], force[12];
    pairs.gather(pair, x, at);
    if (!touches(pair.key.triangle, at, pair.numbers)) continue;
    const Part part = nearest_part(pair.key.triangle, at, softness_of(pair.numbers));
    const Rub<double> rub = block.surface.rubs() ? friction.of(pair.key, pair.spots, pairs.spots) : Rub<double>{};
    const auto met = meet(pair.key.triangle, part, at, pair.numbers, block.surface.rubs() ? &rub : nullptr, force);
    if (!(met.depth > 0.0)) continue;
    energy += 0.5 * pair.numbers.kappa * met.depth * met.depth;
    rubs_ |= met.rubs;
    for (int k = 0; k < 4; ++k)
      pairs.spots.for_each_node(pair.spots[k], [&](int particle, double weight) {
        for (int d = 0; d < 3; ++d) {
          const int to = row * particle + d;
          push_[to] += weight * force[3 * k + d];
          magnitude_[to] += std::abs(weight * force[3 * k + d]);
          stiffness_[to] += weight * weight * pair.numbers.kappa;
        }
      });
  }
  return energy;
}

double IncrementalPotential::evaluate(const DirectBlock& block, Numbers<double>& at) {
  double elastic = pack_kernels().potential->evaluate(arrays(block, at));
  rubs_ = false;
  if (!block.contacts.empty()) elastic += add_contacts(block, at.data());
  if (!pairs.empty()) elastic += add_pairs(block, at.data());
  if (!rigid.empty()) {
    rigid.evaluate(given(block), at.data());
    rigid.push(block, push_.data(), magnitude_.data());
  }
  double inertial = 0.0, stiffest = 0.0, farthest = 0.0, lightest = std::numeric_limits<double>::infinity();
  const double *x = at.data(), *predicted = target.data();
  const double *push = push_.data(), *magnitude = magnitude_.data(), *stiffness = stiffness_.data();
  forces_ = torques_ = {};
  merit_ = 0.0;
  for (int p = 0; p < block.movable; ++p) {
    const double mass = 1.0 / x[row * p + 3], length = unit[p], per_length = 1.0 / length;
    if (!turns_[p]) lightest = std::min(lightest, mass * per_length * per_length);
    for (int i = row * p, d = 3 * p; d < 3 * p + 3; ++i, ++d) {
      const double away = x[i] - predicted[i];
      R_[d] = mass * away - push[i];
      inertial += mass * away * away;
      merit_ += R_[d] * R_[d] * x[row * p + 3];
      if (turns_[p]) {
        torques_.left = std::max(torques_.left, std::abs(R_[d]));
        torques_.largest = std::max(torques_.largest, mass + magnitude[i]);
        torques_.rounding = std::max(torques_.rounding, mass + stiffness[i]);
        continue;
      }
      forces_.left = std::max(forces_.left, per_length * std::abs(R_[d]));
      forces_.largest = std::max(forces_.largest, per_length * (mass * std::abs(away) + magnitude[i]));
      stiffest = std::max(stiffest, per_length * per_length * (mass + stiffness[i]));
      farthest = std::max(farthest, length * std::abs(x[i]));
    }
  }
  for (const auto& contact : contacts.numbers)  // but rigid rows need not be as firm
    if (contact.firm > 1.0) stiffest = std::max(stiffest, contact.firm * contact.kappa);
  if (!rigid.empty()) add_rigid_residuals();
  // No more than what moves a particle by nothing: near a collapsed triangle any force is rounding.
  forces_.rounding = std::min(roundings * stiffest, nothing * lightest) * farthest;
  torques_.rounding *= 0.25 * roundings * (1.0 + farthest / shortest_edge(block, x));
  if (torques_.left <= torques_.rounding) torques_.left = 0.0;
  return elastic + 0.5 * inertial;
}

// A residual counts as the force that would take it away.
void IncrementalPotential::add_rigid_residuals() {
  for (int j = 0; j < rigid.size(); ++j) {
    const double c = rigid.residual(j), multiplier = c * rigid.weight(j);
    merit_ += c * multiplier;
    forces_.left = std::max(forces_.left, std::abs(multiplier) * rigid.steepest(j));
  }
}

int IncrementalPotential::worst_node(const DirectBlock& block) const {
  int worst = 0;
  double most = 0.0;
  const auto share = [&](int d) {
    if (turns_[d / 3]) return torques_.left > 0.0 ? std::abs(R_[d]) / torques_.largest : 0.0;
    return std::abs(R_[d]) / unit[d / 3] / (forces_.largest > 0.0 ? forces_.largest : 1.0);
  };
  for (int d = 0; d < 3 * block.movable; ++d)
    if (const double own = share(d); own > most) most = own, worst = d / 3;
  return block.particles[worst];
}

}  // namespace sheetbend
