#include "core/scene/contact_gaps.h"

#include "core/contact/pose.h"
#include "core/contact/shapes.h"
#include "core/scene/point_of.h"

namespace sheetbend {

std::vector<std::array<double, 4>> contact_gaps(const Scene& scene, const Inputs<const double>& in, const double* x,
                                                double t, int contact) {
  const Contact& c = scene.contacts[contact];
  const Collider& collider = scene.colliders[c.collider];
  const KnotWeights knots = collider.motion.at(t);
  const double* poses = in.of(Quantity::collider_pose) + collider.first_pose;
  Pose<double> pose;
  pose.position = at_knots(knots, poses, 2, 0);
  turn_by(at_knots(knots, poses, 2, 1), pose.turn);
  std::vector<std::array<double, 4>> gaps;
  for (int item = 0; item < c.points(); ++item) {
    double z[3], distance, n[3];
    const Vec3<double> point = point_of(c, item, in, [&](int node) { return Vec3<double>(x + scene.first_dof[node]); });
    pose.in_frame(point).store(z);
    distance_from(collider.any(), z, in.of(Quantity::collider_size) + collider.first_size, distance, n);
    const Vec3<double> normal = pose.turned(unit_normal(collider.any(), Vec3<double>(n)));
    gaps.push_back({distance - in.of(Quantity::contact_radius)[contact], normal.x, normal.y, normal.z});
  }
  return gaps;
}

}  // namespace sheetbend
