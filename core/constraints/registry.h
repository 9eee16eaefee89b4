// Every constraint that the program knows, one line each. Kinds are numbered in this order.
#pragma once

#include <stdexcept>
#include <string>
#include <tuple>

#include "core/constraints/across.h"
#include "core/constraints/along.h"
#include "core/constraints/area.h"
#include "core/constraints/attachment.h"
#include "core/constraints/bend.h"
#include "core/constraints/body_distance.h"
#include "core/constraints/coincide.h"
#include "core/constraints/dihedral.h"
#include "core/constraints/distance.h"
#include "core/constraints/exponential_strain.h"
#include "core/constraints/friction_hinge.h"
#include "core/constraints/hinge.h"
#include "core/constraints/isometric_bending.h"
#include "core/constraints/joint_angle.h"
#include "core/constraints/joint_friction.h"
#include "core/constraints/joint_stops.h"
#include "core/constraints/material_curvature.h"
#include "core/constraints/neo_hookean.h"
#include "core/constraints/planar_bend.h"
#include "core/constraints/rigid.h"
#include "core/constraints/shear.h"
#include "core/constraints/sheet_curvature.h"
#include "core/constraints/sinh_strain.h"
#include "core/constraints/solid_strain.h"
#include "core/constraints/solid_volume.h"
#include "core/constraints/spline_strain.h"
#include "core/constraints/strain.h"
#include "core/constraints/tether.h"
#include "core/constraints/twist.h"
#include "core/constraints/yielding_curvature.h"
#include "core/constraints/yielding_sheet_curvature.h"
#include "core/constraints/yielding_solid_strain.h"
#include "core/constraints/yielding_strain.h"

namespace sheetbend {

using Registry = std::tuple<   //
    Distance,                  //
    Bend,                      //
    PlanarBend,                //
    Hinge,                     //
    Attachment,                //
    MaterialCurvature,         //
    Twist,                     //
    YieldingCurvature,         //
    Shear,                     //
    SectionCurvature,          //
    SectionTwist,              //
    SectionYieldingCurvature,  //
    Strain,                    //
    ExponentialStrain,         //
    SinhStrain,                //
    SplineStrain,              //
    Dihedral,                  //
    IsometricBending,          //
    SheetCurvature,            //
    YieldingSheetCurvature,    //
    Area,                      //
    Tether,                    //
    FrictionHinge,             //
    Rigid,                     //
    Coincide,                  //
    CoincideParticle,          //
    BodyDistance,              //
    BodyParticleDistance,      //
    DirectionsAcross,          //
    Along,                     //
    JointAngle,                //
    JointFriction,             //
    AngleStop,                 //
    SlideStop,                 //
    BrickStrain,               //
    BrickVolume,               //
    TetrahedronStrain,         //
    TetrahedronVolume,         //
    BrickNeoHookean,           //
    TetrahedronNeoHookean,     //
    YieldingBrickStrain,       //
    YieldingStrain>;

inline constexpr int kind_count = std::tuple_size_v<Registry>;

// Calls f with an object of the constraint type that `kind` numbers.
template <int I = 0, class F>
void with_kind(int kind, F&& f) {
  if constexpr (I < kind_count) {
    if (kind == I) return f(std::tuple_element_t<I, Registry>{});
    with_kind<I + 1>(kind, f);
  } else {
    throw std::logic_error("constraint kind " + std::to_string(kind) + " is not in the registry");
  }
}

template <class F>
void for_each_kind(F&& f) {
  for (int kind = 0; kind < kind_count; ++kind) with_kind(kind, f);
}

}  // namespace sheetbend
