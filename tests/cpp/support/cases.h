// One row of cases per registered constraint: a sample stencil with parameters, and the symmetries that its C
// has. Every test that goes through the Registry, and every random scene, reads this table; a kind without a
// row does not compile. Who knows a kind by its number alone includes case.h.
#pragma once

#include <numeric>
#include <tuple>

#include "core/constraints/registry.h"
#include "tests/cpp/support/case.h"

namespace sheetbend::testing {

// Kinds whose last node is a number: of a joint's angle (joint_angle.h).
template <class K>
inline constexpr bool has_dial = requires { requires K::dials > 0; };

template <class K>
Case case_of() {
  static_assert(sizeof(K) == 0, "this registered constraint has no row in tests/cpp/support/cases.h: add one");
  return {};
}

template <>
inline Case case_of<Distance>() {
  return {.x = {0, 0, 0, 0.09, 0.03, -0.02},
          .p = {0.11},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 0},
          .sign = {1},
          .parameter_sign = {1}};
}

template <>
inline Case case_of<Tether>() {
  return {.x = {0, 0, 0, 0.09, 0.03, -0.02},
          .p = {0.08},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 0},
          .sign = {1},
          .parameter_sign = {1}};
}

template <>
inline Case case_of<Bend>() {
  return {.x = {0, 0, 0, 0.1, 0.02, 0.01, 0.18, 0.08, -0.03},
          .p = {},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::turns,
          .relabeling = {2, 1, 0},
          .sign = {-1, -1, -1},
          .parameter_sign = {}};
}

template <>
inline Case case_of<PlanarBend>() {
  return {.x = {0, 0, 0, 0.1, 0.02, 0.01, 0.18, 0.08, -0.03},
          .p = {0.0, 0.6, 0.8, 0.15},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::turns,
          .normal = 0,
          .relabeling = {2, 1, 0},
          .sign = {-1, -1, -1},
          .parameter_sign = {1, 1, 1, -1}};
}

template <>
inline Case case_of<Hinge>() {
  return {.x = {0, 0, 0, 0.1, 0.02, 0.01, 0.18, 0.08, -0.03},
          .p = {0.0, 0.6, 0.8, 0.2},
          .compliance = 1.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .normal = 0,
          .relabeling = {2, 1, 0},
          .sign = {-1},
          .parameter_sign = {1, 1, 1, -1}};
}

// Sliding: the angle from the set is about twelve times the yield angle.
template <>
inline Case case_of<FrictionHinge>() {
  return {.x = {0, 0, 0, 0.1, 0.02, 0.01, 0.18, 0.08, -0.03, -0.1, 0, 0},
          .p = {0.0, 0.6, 0.8, 0.06},
          .compliance = 1.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .normal = 0,
          .relabeling = {2, 1, 0, 3},
          .sign = {-1},
          .parameter_sign = {1, 1, 1, 1}};
}

template <>
inline Case case_of<Attachment>() {
  return {.x = {0, 0, 0, 0.04, 0.02, -0.03},
          .p = {0.003, -0.001, 0.002},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::turns,
          .normal = 0,
          .relabeling = {1, 0},
          .sign = {-1, -1, -1},
          .parameter_sign = {-1, -1, -1},
          .curved = false};
}

// A bent and twisted joint; the directors are neither unit vectors nor across their edges.
inline const std::vector<double> joint_sample{0,     0,    0,   0.1,  0.02, 0.01, 0.18, 0.08,
                                              -0.03, 0.05, 0.3, -0.9, 0.5,  0.4,  -0.6};

template <>
inline Case case_of<MaterialCurvature>() {
  return {.x = joint_sample,
          .p = {1.3, 0.2, -0.1},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {2, 1, 0, 4, 3},
          .sign = {1, -1},
          .parameter_sign = {1, 1, -1}};
}

template <>
inline Case case_of<YieldingCurvature>() {
  std::vector<double> x = joint_sample;
  x.insert(x.end(), {0.1, -0.2, 0.05});
  return {.x = x,
          .p = {1.3, 0.4, 0.25, 0.2, -0.1},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {2, 1, 0, 4, 3, 5},
          .sign = {1, -1},
          .parameter_sign = {1, 1, 1, 1, -1}};
}

template <>
inline Case case_of<Twist>() {
  return {.x = joint_sample,
          .p = {0.15},
          .compliance = 4.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {2, 1, 0, 4, 3},
          .sign = {1},
          .parameter_sign = {1}};
}

// Two sections that are bent, twisted, and turned out of the edges of joint_sample.
inline const std::vector<double> sections_sample{0.2, 0.05, 0.03, 0.18, 0.09, -0.05, 0.05, 0.3, -0.9, 0.5, 0.4, -0.6};

template <>
inline Case case_of<Shear>() {
  return {.x = {0, 0, 0, 0.1, 0.02, 0.01, 0.09, 0.04, 0.03, 0.05, 0.3, -0.9},
          .p = {},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 0, 2, 3},
          .sign = {-1, -1},
          .parameter_sign = {}};
}

template <>
inline Case case_of<SectionCurvature>() {
  return {.x = sections_sample,
          .p = {1.3, 0.2, -0.1},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 0, 3, 2},
          .sign = {-1, -1},
          .parameter_sign = {1, -1, -1}};
}

template <>
inline Case case_of<SectionYieldingCurvature>() {
  std::vector<double> x = sections_sample;
  x.insert(x.end(), {0.1, -0.2, 0.05});
  return {.x = x,
          .p = {1.3, 0.4, 0.25, 0.2, -0.1},
          .compliance = 2.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 0, 3, 2, 4},
          .sign = {-1, -1},
          .parameter_sign = {1, 1, 1, -1, -1}};
}

template <>
inline Case case_of<SectionTwist>() {
  return {.x = sections_sample,
          .p = {0.15},
          .compliance = 4.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 0, 3, 2},
          .sign = {-1},
          .parameter_sign = {-1}};
}

inline const std::vector<double> triangle_sample{0, 0, 0, 0.055, 0.09, 0.01, -0.048, 0.1, -0.02};
inline const std::vector<double> hinge_sample{0, 0, 0, 0.09, 0.03, -0.02, 0.01, 0.1, 0.03, 0.06, -0.08, 0.02};

template <>
inline Case case_of<Strain>() {
  return {.x = triangle_sample,
          .p = {10.0, 5.5, -10.0, 5.5, 0.3, 0.8, 0.5},
          .compliance = 0.2,
          .damping = 0.02,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 2, 1},
          .sign = {1, 1, 1},
          .parameter_sign = {1, 1, 1, 1, 1, 1, 1},
          .parameter_relabeling = {2, 3, 0, 1, 4, 5, 6}};
}

// Sliding: the shear from the set is about three times the yield strain. Damping as for YieldingBrickStrain, below: at Strain's the derivative with respect
// to compliance loses three digits to cancellation in one of the random states.
template <>
inline Case case_of<YieldingStrain>() {
  Case row = case_of<Strain>();
  row.damping = 0.01;
  row.x.insert(row.x.end(), {0.0, 0.0, 0.05});
  row.p.insert(row.p.end(), {0.4, 0.03});
  row.relabeling.push_back(3);
  row.parameter_sign.resize(row.p.size(), 1);
  row.parameter_relabeling.insert(row.parameter_relabeling.end(), {7, 8});
  return row;
}

template <>
inline Case case_of<ExponentialStrain>() {
  return {.x = triangle_sample,
          .p = {10.0, 5.5, -10.0, 5.5, 0.3, 0.8, 0.5, 3.0, 2.0, 8.0},
          .compliance = 0.2,
          .damping = 0.02,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 2, 1},
          .sign = {1, 1, 1},
          .parameter_sign = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1},
          .parameter_relabeling = {2, 3, 0, 1, 4, 5, 6, 7, 8, 9}};
}

template <>
inline Case case_of<SinhStrain>() {
  return case_of<ExponentialStrain>();
}

template <>
inline Case case_of<SplineStrain>() {
  Case row = case_of<Strain>();
  row.x = {0, 0, 0, 0.3, 0.58, 0.04, -0.23, 0.47, -0.08};  // beyond the last knot of each component
  row.p = {3.33, 1.83, -3.33, 1.83, 0.3, 0.8, 0.5};
  for (const double spacing : {0.24, 0.27, 0.18}) row.p.insert(row.p.end(), {spacing, 1.5, 2.0, 4.0, 3.0});
  row.parameter_sign.resize(row.p.size(), 1);
  for (int k = 7; k < 22; ++k) row.parameter_relabeling.push_back(k);
  return row;
}

template <>
inline Case case_of<Dihedral>() {
  return {.x = hinge_sample,
          .p = {0.1},
          .compliance = 1.0,
          .damping = 5e-4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 1, 3, 2},
          .sign = {-1},
          .parameter_sign = {-1}};
}

template <>
inline Case case_of<IsometricBending>() {
  return {.x = hinge_sample,
          .p = {1.5, -1.0, -2.0},
          .compliance = 7e-3,
          .damping = 0.1,
          .under_rotation = UnderRotation::turns,
          .relabeling = {0, 1, 3, 2},
          .sign = {1, 1, 1},
          .parameter_sign = {1, 1, 1},
          .parameter_relabeling = {0, 2, 1},
          .curved = false};
}

template <>
inline Case case_of<SheetCurvature>() {
  return {.x = {0, 0, 0, 0.09, 0.03, -0.02, 0.01, 0.1, 0.03, 0.06, -0.08, 0.02, 0.12, 0.11, 0.01, -0.08, 0.06, -0.01},
          .p = {6.0, 5.0, -2.0, 1.0, 4.0, 7.0, 3.0, -5.0, 2.0, 0.8, 1.2, 0.1, -0.05, 0.08},
          .compliance = 30.0,
          .damping = 2e-5,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 2, 0, 4, 5, 3},
          .sign = {1, 1, 1},
          .parameter_sign = std::vector<int>(14, 1),
          .parameter_relabeling = {1, 2, 0, 4, 5, 3, 7, 8, 6, 9, 10, 12, 13, 11}};
}

template <>
inline Case case_of<YieldingSheetCurvature>() {
  Case row = case_of<SheetCurvature>();
  row.x.insert(row.x.end(), {0.3, -0.4, 0.2});
  row.p.insert(row.p.end(), {0.4, 0.6});
  row.relabeling.push_back(6);
  row.parameter_sign.resize(row.p.size(), 1);
  row.parameter_relabeling.insert(row.parameter_relabeling.end(), {14, 15});
  return row;
}

template <>
inline Case case_of<Area>() {
  return {.x = triangle_sample,
          .p = {0.004},
          .compliance = 6e-6,
          .damping = 600.0,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 2, 1},
          .sign = {1},
          .parameter_sign = {1}};
}

// The axes of a body that is strained.
inline const std::vector<double> axes_sample{0.9, 0.3, -0.2, -0.2, 1.1, 0.1, 0.3, -0.1, 0.95};

template <>
inline Case case_of<Rigid>() {
  return {.x = axes_sample,
          .p = {},
          .compliance = 1e-3,
          .damping = 1.0,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 1, 2},
          .sign = {1, 1, 1, 1, 1, 1},
          .parameter_sign = {}};
}

// Two bodies: their centers, then their axes.
inline std::vector<double> bodies_sample(bool centers) {
  std::vector<double> x;
  if (centers) x = {0, 0, 0, 0.06, 0.02, 0.05};
  x.insert(x.end(), axes_sample.begin(), axes_sample.end());
  x.insert(x.end(), {0.8, -0.5, 0.1, 0.4, 0.9, -0.2, 0.1, 0.2, 1.05});
  return x;
}
inline const std::vector<int> other_body_first{1, 0, 5, 6, 7, 2, 3, 4};

template <>
inline Case case_of<Coincide>() {
  return {.x = bodies_sample(true),
          .p = {0.03, -0.04, 0.05, -0.06, 0.03, -0.07},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::turns,
          .relabeling = other_body_first,
          .sign = {-1, -1, -1},
          .parameter_sign = {1, 1, 1, 1, 1, 1},
          .parameter_relabeling = {3, 4, 5, 0, 1, 2},
          .curved = false};
}

template <>
inline Case case_of<CoincideParticle>() {
  std::vector<double> x{0, 0, 0, 0.06, 0.02, 0.05};
  x.insert(x.end(), axes_sample.begin(), axes_sample.end());
  return {.x = x,
          .p = {0.03, -0.04, 0.05},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::turns,
          .relabeling = {0, 1, 2, 3, 4},
          .sign = {1, 1, 1},
          .parameter_sign = {1, 1, 1},
          .curved = false};
}

template <>
inline Case case_of<BodyDistance>() {
  return {.x = bodies_sample(true),
          .p = {0.03, -0.04, 0.05, -0.06, 0.03, -0.07, 0.11},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::stays,
          .relabeling = other_body_first,
          .sign = {1},
          .parameter_sign = {1, 1, 1, 1, 1, 1, 1},
          .parameter_relabeling = {3, 4, 5, 0, 1, 2, 6}};
}

template <>
inline Case case_of<BodyParticleDistance>() {
  Case row = case_of<CoincideParticle>();
  row.p = {0.03, -0.04, -0.05, 0.11};
  row.under_rotation = UnderRotation::stays;
  row.sign = {1};
  row.parameter_sign = {1, 1, 1, 1};
  row.curved = true;
  return row;
}

template <>
inline Case case_of<DirectionsAcross>() {
  return {.x = bodies_sample(false),
          .p = {0.6, 0.2, -0.7, 0.5, 0.6, 0.4},
          .compliance = 1e-3,
          .damping = 0.5,
          .under_rotation = UnderRotation::stays,
          .relabeling = {3, 4, 5, 0, 1, 2},
          .sign = {1},
          .parameter_sign = {1, 1, 1, 1, 1, 1},
          .parameter_relabeling = {3, 4, 5, 0, 1, 2}};
}

template <>
inline Case case_of<Along>() {
  std::vector<double> x = bodies_sample(true);
  x[3] = 0.3, x[4] = 0.25, x[5] = -0.2;
  return {.x = x,
          .p = {0.03, -0.04, 0.05, -0.06, 0.03, -0.07, 0.7, 0.5, -0.4, 0.02},
          .compliance = 3e-4,
          .damping = 3.0,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 1, 2, 3, 4, 5, 6, 7},
          .sign = {1},
          .parameter_sign = std::vector<int>(10, 1)};
}

template <>
inline Case case_of<JointAngle>() {
  std::vector<double> x = bodies_sample(false);
  x.insert(x.end(), {0.3, 0.0, 0.0});
  return {.x = x,
          .p = {0.9, 0.1, -0.2, 0.1, 0.8, 0.3, 0.7, 0.5, 0.2, 0.15},
          .compliance = 1e-3,
          .damping = 0.5,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 1, 2, 3, 4, 5, 6},
          .sign = {1},
          .parameter_sign = std::vector<int>(10, 1)};
}

// Sliding: the angle from the set is about seven times the yield angle.
template <>
inline Case case_of<JointFriction>() {
  Case row = case_of<JointAngle>();
  row.x[18] = -0.2;  // the set
  row.p.back() = 0.06;
  return row;
}

// Beyond its range by less than the depth.
template <>
inline Case case_of<AngleStop>() {
  return {.x = bodies_sample(false),
          .p = {0.9, 0.1, -0.2, 0.1, 0.8, 0.3, 0.7, 0.5, 0.2, -0.2, 0.3, 0.6},
          .compliance = 1e-3,
          .damping = 0.5,
          .under_rotation = UnderRotation::stays,
          .relabeling = {0, 1, 2, 3, 4, 5},
          .sign = {1},
          .parameter_sign = std::vector<int>(12, 1)};
}

template <>
inline Case case_of<SlideStop>() {
  Case row = case_of<Along>();
  row.p.pop_back();
  row.p.insert(row.p.end(), {-0.075, 0.125, 0.7});
  row.parameter_sign.assign(row.p.size(), 1);
  return row;
}

// An element of about the sizes of its gradients, then couplings and ratios of stiffness. Its second and third node change places.
inline Case solid_case(std::vector<double> x, std::vector<double> gradients) {
  Case row{.x = std::move(x),
           .p = std::move(gradients),
           .compliance = 0.2,
           .damping = 0.02,
           .under_rotation = UnderRotation::stays,
           .relabeling = {0, 2, 1},
           .sign = {1, 1, 1, 1, 1, 1},
           .parameter_sign = {},
           .parameter_relabeling = {3, 4, 5, 0, 1, 2}};
  for (int k = 3; k < static_cast<int>(row.x.size()) / 3; ++k) row.relabeling.push_back(k);
  row.p.insert(row.p.end(), {0.3, 0.2, 0.25, 1.3, 0.8, 2.1, 1.7, 2.6});
  row.parameter_sign.assign(row.p.size(), 1);
  for (int k = 6; k < static_cast<int>(row.p.size()); ++k) row.parameter_relabeling.push_back(k);
  return row;
}
inline const std::vector<double> brick_sample{0,    0,    0,   0.1,  0.01,  0.02, 0.11, 0.11, 0.03, -0.01, 0.09, 0.01,
                                              0.02, 0.01, 0.1, 0.12, -0.01, 0.11, 0.13, 0.12, 0.12, 0.01,  0.1,  0.09};
inline const std::vector<double> tetrahedron_sample{0, 0, 0, 0.1, 0.01, 0.02, -0.01, 0.11, 0.01, 0.02, -0.02, 0.09};

inline const std::vector<double> brick_gradients{2.5, -1.6, -4.9, 1.6, 1.9, -3.2, -0.9, 1,  -1.3, -4.4, -2.3,
                                                 3.2, 3.3,  -4.4, 3.5, 2.1, 4,    2.5,  -3, 2.2,  2.2};
inline const std::vector<double> tetrahedron_gradients{9.99, 1.07, -1.94, -1.26, 8.54, 2.13, -2.04, -1.16, 10.96};

template <>
inline Case case_of<BrickStrain>() {
  return solid_case(brick_sample, brick_gradients);
}

template <>
inline Case case_of<TetrahedronStrain>() {
  return solid_case(tetrahedron_sample, tetrahedron_gradients);
}

// Sliding: the strain is about twice the yield strain. At this damping no derivative with respect to compliance or damping, a sum over six rows, loses
// more than two digits to cancellation.
template <>
inline Case case_of<YieldingBrickStrain>() {
  Case row = case_of<BrickStrain>();
  row.damping = 0.01;
  const std::size_t count = brick_gradients.size();
  row.x.insert(row.x.end(), {0.06, -0.04, 0.02, 0.04, -0.08, 0.06});
  row.p.resize(count);
  row.p.insert(row.p.end(), {0.3, 0.06});
  row.relabeling.insert(row.relabeling.end(), {8, 9});
  row.parameter_sign.assign(row.p.size(), 1);
  row.parameter_relabeling.resize(row.p.size());
  std::iota(row.parameter_relabeling.begin() + count, row.parameter_relabeling.end(), count);
  return row;
}

// The same material, 1/(mu V) where strains have 1/(2 mu V), without the ratios of stiffness.
inline Case neo_hookean_case(std::vector<double> x, std::vector<double> gradients) {
  const std::size_t count = gradients.size();
  Case row = solid_case(std::move(x), std::move(gradients));
  row.compliance *= 2.0;
  row.damping /= 2.0;
  row.p.resize(count);
  row.parameter_sign.resize(count);
  row.parameter_relabeling.resize(count);
  return row;
}

template <>
inline Case case_of<BrickNeoHookean>() {
  return neo_hookean_case(brick_sample, brick_gradients);
}

template <>
inline Case case_of<TetrahedronNeoHookean>() {
  return neo_hookean_case(tetrahedron_sample, tetrahedron_gradients);
}

template <>
inline Case case_of<BrickVolume>() {
  return {.x = brick_sample,
          .p = {9.6e-4},
          .compliance = 4e-8,
          .damping = 2e4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 2, 3, 0, 5, 6, 7, 4},
          .sign = {1},
          .parameter_sign = {1}};
}

template <>
inline Case case_of<TetrahedronVolume>() {
  return {.x = tetrahedron_sample,
          .p = {2e-4},
          .compliance = 1e-8,
          .damping = 8e4,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 2, 0, 3},
          .sign = {1},
          .parameter_sign = {1}};
}

// The kinds that a test of every kind goes through.
#ifdef SHEETBEND_TEST_KIND  // alone, as tests/meta/test_new_kind.py does
using TestedKinds = std::tuple<SHEETBEND_TEST_KIND>;
#else
using TestedKinds = Registry;
#endif

}  // namespace sheetbend::testing
