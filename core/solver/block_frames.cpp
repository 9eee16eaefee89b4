#include "core/solver/block_frames.h"

#include <array>
#include <map>

namespace sheetbend {
namespace {

using sheetbend_blocks::row;
constexpr double least_kept = 0.1;  // of a prediction: a turn by 84 degrees

// What takes the idle directions out of a vector.
std::array<double, 9> across_idle(const BlockFrame& f, Numbers<double>& x) {
  const auto at = [&](int particle) { return Vec3<double>(x.data() + row * particle); };
  std::array<double, 9> P;
  const auto outer = [&](const Vec3<double>& v, double sign, double identity) {
    double a[3];
    v.store(a);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) P[3 * i + k] = (i == k ? identity : 0.0) + sign * a[i] * a[k];
  };
  const Vec3<double> q = at(f.particle);
  if (f.is_normal) {
    outer((1.0 / norm(q)) * q, -1.0, 1.0);
  } else {
    const Across<double> own(f.tail < 0 ? at(f.head) : at(f.head) - at(f.tail), q);
    outer(cross(own.t, own.m1), 1.0, 0.0);
  }
  return P;
}

// E <- P E P in the rows and columns of place k of a symmetric E (dofs, dofs).
void project(const std::array<double, 9>& P, int k, int dofs, std::vector<double>& E) {
  const auto apply = [&](int first, int step) {
    for (int other = 0; other < dofs; ++other) {
      double own[3];
      for (int a = 0; a < 3; ++a) own[a] = E[first * (3 * k + a) + step * other];
      for (int a = 0; a < 3; ++a)
        E[first * (3 * k + a) + step * other] = P[3 * a] * own[0] + P[3 * a + 1] * own[1] + P[3 * a + 2] * own[2];
    }
  };
  apply(dofs, 1);
  apply(1, dofs);
}

}  // namespace

std::vector<BlockFrame> frames_of_block(const Scene& scene, const DirectBlock& block) {
  std::map<int, int> particle_of;
  for (int p = 0; p < static_cast<int>(block.particles.size()); ++p) particle_of.emplace(block.particles[p], p);
  std::vector<BlockFrame> normals, directors;
  for (const Director& d : scene.directors) {
    const auto own = particle_of.find(d.node);
    if (own == particle_of.end() || own->second >= block.movable) continue;
    const auto tail = particle_of.find(d.tail), head = particle_of.find(d.normal < 0 ? d.head : d.normal);
    if (d.is_normal())
      normals.push_back({own->second, -1, own->second, true});
    else if (head != particle_of.end() && (d.normal >= 0 || tail != particle_of.end()))
      directors.push_back({own->second, d.normal < 0 ? tail->second : -1, head->second, false});
  }
  normals.insert(normals.end(), directors.begin(), directors.end());
  return normals;
}

bool settle_frames(const DirectBlock& block, Numbers<double>& predicted, Numbers<double>& at) {
  const auto rows = [](Numbers<double>& x) { return [&x](int particle) { return x.data() + row * particle; }; };
  bool settled = true;
  for (const BlockFrame& f : block.frames) {
    const double kept = settle<double>(f, rows(at), rows(predicted));
    settled = settled && kept > least_kept * norm(Vec3<double>(predicted.data() + row * f.particle));
  }
  return settled;
}

void leave_out_idle(const Scene& scene, const DirectBlock& block, Numbers<double>& at,
                    std::vector<Numbers<double>>& elements) {
  if (block.frames.empty()) return;
  std::vector<int> frame_of(block.particles.size(), -1);
  std::vector<std::array<double, 9>> across;
  for (const BlockFrame& f : block.frames) {
    frame_of[f.particle] = static_cast<int>(across.size());
    across.push_back(across_idle(f, at));
  }
  std::vector<double> E;
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const int arity = scene.groups[run.group].arity, dofs = 3 * arity;
    E.resize(static_cast<std::size_t>(dofs) * dofs);
    for (int i = 0; i < run.count; ++i) {
      const auto frame_at = [&](int k) { return frame_of[run.nodes[lane_at(i, arity, k)] / row]; };
      bool any = false;
      for (int k = 0; k < arity; ++k) any |= frame_at(k) >= 0;
      if (!any) continue;
      const auto number = [&](int a, int b) -> double& {
        return elements[r][lane_at(i, triangle(dofs), triangle(a) + b)];
      };
      for (int a = 0; a < dofs; ++a)
        for (int b = 0; b <= a; ++b) E[dofs * a + b] = E[dofs * b + a] = number(a, b);
      for (int k = 0; k < arity; ++k)
        if (const int f = frame_at(k); f >= 0) project(across[f], k, dofs, E);
      for (int a = 0; a < dofs; ++a)
        for (int b = 0; b <= a; ++b) number(a, b) = E[dofs * a + b];
    }
  }
}

}  // namespace sheetbend
