// The contacts that go by sweeps (swept_contacts.h), and which of them go eight particles at a time.
#pragma once

#include "core/solver/plan.h"

namespace sheetbend {

// The contacts of movable particles, in the order of the scene.
std::vector<SweptContact> swept_contacts(const Scene& scene);

// The same by scene contacts. Grids are read particle by particle, and so is what restitution lifts; all others go in packs.
std::vector<SweptGroup> swept_groups(const Scene& scene, const std::vector<SweptContact>& contacts);

}  // namespace sheetbend
