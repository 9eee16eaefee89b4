// The reverse of the volumes' projections.
#pragma once

#include "adjoint/solver/cotangents.h"
#include "core/solver/states.h"
#include "core/solver/volume.h"

namespace sheetbend {

template <class T>
struct VolumeCotangents {
  std::vector<Vec3<T>> v;  // of dV/dx
  T lambda{};

  void resize(const Volume& volume) { v.resize(volume.nodes.size()); }
  static std::size_t bytes(const Volume& volume) { return sizeof(Vec3<T>) * volume.nodes.size(); }
};

// Reverse of project_volumes(): q_bar goes from the cotangent of the coordinates after an iteration to that of those before, w_bar and in_bar are
// added to. Of the multipliers after the last iteration nothing arrives.
template <class T>
void project_volumes_vjp(const Scene& scene, const Inputs<const T>& in, double eta, const T* w, int iteration,
                         bool last, std::vector<VolumeState<T>>& states, const Coordinates<T>& q_bar, T* w_bar,
                         const Inputs<T>& in_bar, std::vector<VolumeCotangents<T>>& bars) {
  for (int i = static_cast<int>(states.size()) - 1; i >= 0; --i) {
    const Volume& volume = scene.volumes[i];
    const std::vector<int>& nodes = volume.nodes;
    std::vector<Vec3<T>>& g = states[i].gradient;
    const VolumeRecord<T>& record = states[i].record(iteration);
    const VolumeRow<T> row(scene, in, eta, w, i, record, g);
    VolumeCotangents<T>& bar = bars[i];
    if (last) bar.lambda = T(0.0);
    T dl_bar = bar.lambda;
    for (std::size_t k = 0; k < nodes.size(); ++k) dl_bar += w[nodes[k]] * dot(g[k], Vec3<T>(q_bar.of(nodes[k])));
    const T y = dl_bar / row.D;
    bar.lambda -= row.a * y;
    in_bar.of(Quantity::volume)[i] += y;
    in_bar.of(Quantity::volume_compliance)[i] -= y * (record.lambda + record.dl) * T(1.0 / (eta * eta));
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Vec3<T> z = Vec3<T>(q_bar.of(nodes[k])) - y * g[k];
      w_bar[nodes[k]] += record.dl * dot(g[k], z);
      bar.v[k] = (w[nodes[k]] * record.dl) * (z - y * g[k]);
      z.store(q_bar.of(nodes[k]));
    }
    for_each_hessian_times(volume, record.x, bar.v,
                           [&](int k, const Vec3<T>& share) { share.add_to(q_bar.of(nodes[k])); });
  }
}

}  // namespace sheetbend
