// Directors at the end of a substep: made perpendicular to their frames' axes again and of length one,  q -> across/|across|,
// across = q - (q.t) t; normals of sections keep length one. The constraints see the directions alone, so this moves nothing; it keeps the
// coordinates well scaled and carries a frame along as its axis turns. Those that are held stay as given.
#pragma once

#include "core/points/kernels.h"
#include "core/scalar/across.h"
#include "core/scene/scene.h"
#include "core/step/stages.h"

namespace sheetbend {

// x(node) gives where a node's coordinates are.
template <class T, class At>
Across<T> across_axis(const Director& d, At&& x) {
  const Vec3<T> axis = d.normal < 0 ? Vec3<T>(x(d.head)) - Vec3<T>(x(d.tail)) : Vec3<T>(x(d.normal));
  return {axis, Vec3<T>(x(d.node))};
}

template <class T>
void retract_directors(const Scene& scene, T* x) {
  const auto at = [&](int node) { return x + scene.first_dof[node]; };
  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    const Vec3<T> q(at(d.node));
    (d.is_normal() ? (T(1.0) / norm(q)) * q : across_axis<T>(d, at).m1).store(at(d.node));
  }
}

// The same frames for the kernels of core/points.
inline std::vector<sheetbend_points::Frame> frames_of(const Scene& scene) {
  std::vector<sheetbend_points::Frame> frames;
  const auto at = [&](int node) { return scene.first_dof[node]; };
  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    const bool leans = d.normal >= 0;
    frames.push_back({at(d.node), leans ? -1 : at(d.tail), at(leans ? d.normal : d.head)});
  }
  return frames;
}

struct RetractDirectors {
  static constexpr bool repeated = false;
  template <class T>
  struct Record {
    std::vector<sheetbend_points::Frame> frames;  // that the kernels retract

    void resize(const Scene& scene, const Plan&, bool) {
      if constexpr (!std::is_same_v<T, double>) frames = frames_of(scene);
    }
    static std::size_t bytes(const Scene& scene, const Plan&, bool) {
      return std::is_same_v<T, double> ? 0 : sizeof(sheetbend_points::Frame) * scene.directors.size();
    }
  };

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    if constexpr (std::is_same_v<T, double>)
      retract_directors(step.scene, work.x_next);
    else
      point_kernels<T>().retract(record.frames.data(), static_cast<int>(record.frames.size()),
                                 reinterpret_cast<double*>(work.x_next));
  }
};

}  // namespace sheetbend
