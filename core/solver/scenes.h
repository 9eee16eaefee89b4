// The scenes of a T: the lanes of a pack, otherwise one. What is not done for all of them at once takes the numbers of one after the other.
#pragma once

#include <type_traits>

#include "core/scalar/pack.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template <class T>
inline constexpr int scenes_of = std::is_same_v<T, Pack> ? Pack::lanes : 1;

// Some of them, a bit each.
using Scenes = unsigned char;
static_assert(Pack::lanes <= 8);

template <class T>
inline constexpr Scenes all_scenes = static_cast<Scenes>((1u << scenes_of<T>)-1u);

inline bool has(Scenes scenes, int scene) { return (scenes >> scene & 1) != 0; }

// a in some scenes, b in the others.
template <class T>
T chosen(Scenes scenes, const T& a, const T& b) {
  if constexpr (std::is_same_v<T, Pack>) {
    T mixed = b;
    for (int scene = 0; scene < Pack::lanes; ++scene)
      if (has(scenes, scene)) mixed.set(scene, a[scene]);
    return mixed;
  } else {
    return scenes ? a : b;
  }
}

// A number of one of them.
template <class T>
using Single = std::conditional_t<std::is_same_v<T, Pack>, double, T>;

template <class T>
Single<T> in_scene(const T& a, [[maybe_unused]] int scene) {
  if constexpr (std::is_same_v<T, Pack>)
    return a[scene];
  else
    return a;
}
// Its value.
template <class T>
double number_of(const T& a, int scene) {
  return value_of(in_scene(a, scene));
}
// `to` is one of a T or stands for it (Numbers).
template <class T, class To>
void set_in_scene(const Single<T>& a, [[maybe_unused]] int scene, To&& to) {
  if constexpr (std::is_same_v<T, Pack>)
    to.set(scene, a);
  else
    to = a;
}
template <class T>
void add_in_scene(const Single<T>& a, int scene, T& to) {
  if constexpr (std::is_same_v<T, Pack>)
    to.set(scene, to[scene] + a);
  else
    to += a;
}

}  // namespace sheetbend
