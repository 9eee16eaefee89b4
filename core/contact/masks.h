// What comparisons of a T give: bool, or of lanes a mask with one for each lane. Masks are joined by &, | and !, and used by select(); any() says whether
// one of them is true.
#pragma once

#include "core/scalar/pack.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

template <class T>
using MaskOf = decltype(std::declval<T>() < std::declval<T>());

inline bool any(bool mask) { return mask; }

using RegisterMask = Lanes<register_lanes>::Mask;  // kernels work on registers
static_assert(Lanes<register_lanes>::pieces == 1);

inline RegisterMask operator&(const RegisterMask& a, const RegisterMask& b) { return {{a.bits[0] & b.bits[0]}}; }
inline RegisterMask operator|(const RegisterMask& a, const RegisterMask& b) { return {{a.bits[0] | b.bits[0]}}; }
inline RegisterMask operator!(const RegisterMask& a) { return {{~a.bits[0]}}; }
inline bool has(const RegisterMask& mask, int lane) { return mask.bits[0][lane] != 0; }
inline bool any(const RegisterMask& mask) {
  long long some = 0;
  for (int lane = 0; lane < register_lanes; ++lane) some |= mask.bits[0][lane];
  return some != 0;
}

template <class M, class T>
[[gnu::always_inline]] inline Vec3<T> select(const M& mask, const Vec3<T>& a, const Vec3<T>& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}

}  // namespace sheetbend
