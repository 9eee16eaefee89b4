// The load of a support: what holds the particles of a grip, a clamp or a hook where their motion is given, at the end of a substep.
//
//   F = - sum_i J_i^T lambda/eta^2            the constraints' pull on the held particles (core/solver: x' = x + W J^T dl)
//     + sum_k m_k (a_k - gravity) - drag_k - air_k      what the support carries besides: the mass that stands in held particles
//
// with a torque about one of the particles; a held director or axis, which is a direction, takes torque and no force. The multipliers hold elastic
// and damping forces alike, and those of rigid constraints. Accelerations follow from positions at several substeps (force_sensor.h), so
// that a substep hands on the moments that they are derivatives of.
#pragma once

#include <algorithm>
#include <vector>

#include "core/equilibrium/residual.h"
#include "core/step/apply_air_forces.h"

namespace sheetbend {

struct Support {
  std::vector<int> nodes;    // held together, directors and axes among them
  std::vector<int> carried;  // those whose mass, drag and air are the support's to bear
  int about = 0;             // node at whose place torques are taken
};

// What a substep tells of a support; torques are about `place`.
template <class T>
struct SupportLoad {
  static constexpr int size = 15;
  Vec3<T> force, torque, place;
  Vec3<T> moment, spin;  // sum m x of places, and sum x cross m v, of what is carried

  void store(T* to) const {
    int k = 0;
    for (const Vec3<T>* v : {&force, &torque, &place, &moment, &spin}) v->store(to + 3 * k++);
  }
};

// Which constraints, volumes and triangles in air reach a support.
class SupportReader {
 public:
  SupportReader() = default;
  SupportReader(const Scene& scene, Support support) : support_(std::move(support)) {
    for (int g = 0; g < static_cast<int>(scene.groups.size()); ++g)
      for (int i = 0; i < scene.groups[g].count; ++i) {
        const auto nodes = scene.groups[g].nodes(i);
        if (std::any_of(nodes.begin(), nodes.end(), [&](int n) { return holds(n); })) constraints_.push_back({g, i});
      }
    for (int v = 0; v < static_cast<int>(scene.volumes.size()); ++v) {
      const std::vector<int>& nodes = scene.volumes[v].nodes;
      if (std::any_of(nodes.begin(), nodes.end(), [&](int n) { return holds(n); })) volumes_.push_back(v);
    }
    for (int t = 0; t < static_cast<int>(scene.air.size()); ++t)
      for (const int n : scene.air[t])
        if (carries(n)) air_.push_back({t, n});
  }

  const Support& support() const { return support_; }

  template <class T>
  T carried_mass(const Scene& scene, const Inputs<const T>& in) const {
    T sum(0.0);
    for (const int n : support_.carried)
      if (scene.is_place[n]) sum += in.of(Quantity::mass)[n];
    return sum;
  }

  // From the state at the end of a substep, at time t, and its multipliers.
  template <class T>
  SupportLoad<T> read(const Scene& scene, const Inputs<const T>& in, double eta, double t, const T* x, const T* v,
                      const T* lambda) const {
    SupportLoad<T> load;
    const auto at = [&](const T* from, int node) { return Vec3<T>(from + scene.first_dof[node]); };
    load.place = at(x, support_.about);
    const auto hold = [&](int node, const Vec3<T>& force) {  // that the support puts on a node
      if (scene.is_place[node]) {
        load.force = load.force + force;
        load.torque = load.torque + cross(at(x, node) - load.place, force);
      } else {
        load.torque = load.torque + cross(at(x, node), force);
      }
    };
    const T rate(-1.0 / (eta * eta));
    AnyConstraint<T> own;
    for (const auto& [g, item] : constraints_) {
      const Group& group = scene.groups[g];
      const auto nodes = group.nodes(item);
      evaluate(scene, in, group, item, x, own);
      own.set_push(lambda + group.first_row + item * group.rows);
      for (int k = 0; k < group.arity; ++k)
        if (holds(nodes[k])) hold(nodes[k], rate * Vec3<T>(own.push + 3 * k));
    }
    std::vector<Vec3<T>> gradient;
    for (const int volume : volumes_) {
      kept_volume(scene, in, volume, x, gradient);
      const std::vector<int>& nodes = scene.volumes[volume].nodes;
      for (std::size_t k = 0; k < nodes.size(); ++k)
        if (holds(nodes[k])) hold(nodes[k], (rate * lambda[scene.rows + volume]) * gradient[k]);
    }
    const Vec3<T> wind = wind_at(scene, in, t);
    for (const int n : support_.carried) {
      const Vec3<T> place = at(x, n), speed = at(v, n), momentum = in.of(Quantity::mass)[n] * speed;
      if (scene.is_place[n]) load.moment = load.moment + in.of(Quantity::mass)[n] * place;
      load.spin = load.spin + cross(place, momentum);
      if (!scene.has_drag) continue;
      hold(n, -drag_force(in, n, scene.is_place[n] ? wind - speed : -speed));
    }
    blown(scene, in, wind, at, x, v, hold);
    return load;
  }

 private:
  struct Part {
    int group, item;
  };
  struct Vertex {
    int triangle, node;
  };

  bool holds(int node) const {
    return std::find(support_.nodes.begin(), support_.nodes.end(), node) != support_.nodes.end();
  }
  bool carries(int node) const {
    return std::find(support_.carried.begin(), support_.carried.end(), node) != support_.carried.end();
  }

  // The air's third of each triangle at the vertices that are carried.
  template <class T, class At, class Hold>
  void blown(const Scene& scene, const Inputs<const T>& in, const Vec3<T>& wind, At&& at, const T* x, const T* v,
             Hold&& hold) const {
    for (const auto& [i, node] : air_) {
      const auto& [a, b, c] = scene.air[i];
      const AirTriangle<T> triangle{at(x, b) - at(x, a),
                                    at(x, c) - at(x, a),
                                    wind - T(1.0 / 3.0) * (at(v, a) + at(v, b) + at(v, c)),
                                    in.of(Quantity::air_normal)[i],
                                    in.of(Quantity::air_tangential)[i],
                                    in.of(Quantity::pressure)[i]};
      hold(node, T(-1.0 / 3.0) * AirForce<T>(triangle).f);
    }
  }

  Support support_;
  std::vector<Part> constraints_;
  std::vector<int> volumes_;
  std::vector<Vertex> air_;
};

}  // namespace sheetbend
