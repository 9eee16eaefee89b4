// What a scene may touch: colliders, contacts with them, and ropes and cloths that touch themselves.
#pragma once

#include <array>

#include "core/scene/scene.h"

namespace sheetbend {

// How many numbers there are of each quantity of contacts.
struct ContactSizes {
  std::size_t frictions, radii, stiffnesses, poses, sizes, restitutions, weights, dissipations;
};

ContactSizes add_contacts(const SceneSpec& spec, Scene& s);

}  // namespace sheetbend
