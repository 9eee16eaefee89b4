// The law of one contact: a stiff force along the normal that pushes and never pulls, and Coulomb friction by a return mapping (Simo & Hughes 1998,
// sec. 5) of a tangential force that is carried from substep to substep, so that what sticks does not creep:
//
//   lambda_n = kappa max(0, -gap) max(0, 1 - a v)     v = n . u/eta,  a: dissipation (Hunt & Crossley 1975), none of a rigid contact
//   tau      = P (f - kappa u)                        P = I - n n^T,  u: slip over the substep,  f: tangential force before
//   lambda_t = tau min(1, mu lambda_n/|tau|)          sticks, or slides along tau
//
// in multipliers, force times eta^2. lambda_t is what the next substep begins with; a contact that ends forgets it. Contact, sticking and sliding follow
// from the signs here and are decided nowhere else. All vectors are in the collider's frame, which turns what is carried along with it.
#pragma once

#include "core/contact/masks.h"
#include "core/contact/plain_vec3.h"

namespace sheetbend {

// kappa of a rigid contact, over the particle's mass and (eta/h)^2. It is as deep as g h^2/rigidity under its own weight.
inline constexpr double rigidity = 1e3;

template <class T>
struct ContactForce {
  using Mask = MaskOf<T>;
  T normal{};                       // lambda_n
  Vec3<T> tangential;               // lambda_t
  Mask pushes{}, slides{}, rubs{};  // rubs: pushes, and friction or dissipation may act: no potential
};

// C is T, or double where these numbers do not vary. `loss` is a/eta, of a contact that dissipates.
template <class T, class C>
ContactForce<T> contact_force(const T& gap, const Vec3<C>& n, const Vec3<T>& slip, const Vec3<C>& carried,
                              const C& friction, const C& kappa, const C* loss = nullptr) {
  const T zero(0.0);
  ContactForce<T> c;
  c.pushes = gap < zero;
  if (!any(c.pushes)) return c;
  T normal = -(kappa * gap);
  if (loss) {
    const T share = T(1.0) - *loss * dot(n, slip);
    c.pushes = c.pushes & (share > zero);
    if (!any(c.pushes)) return c;
    normal = normal * share;
  }
  c.normal = select(c.pushes, normal, zero);
  const T limit = friction * c.normal;
  c.rubs = c.pushes;
  if (!loss) c.rubs = c.rubs & (limit > zero);
  const Vec3<T> trial = carried - kappa * slip;
  const Vec3<T> tau = trial - dot(n, trial) * n;
  const T squared = dot(tau, tau);
  c.slides = c.pushes & (squared > limit * limit);
  const Vec3<T> none(zero, zero, zero);
  // What has no friction slips where nothing has moved it yet, too: there tau is zero, and its derivatives must not stay.
  const Vec3<T> held = select(limit > zero, tau, none);
  c.tangential = select(c.pushes, select(c.slides, (limit / sqrt(squared)) * tau, held), none);
  return c;
}

}  // namespace sheetbend
